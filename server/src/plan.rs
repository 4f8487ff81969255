//! Which images to make for a viewer, and whether to make any: the set is replaced when the viewer leaves what it covers.
//!
//! The **view region** is the ball where the viewer will be when the samples arrive: around the predicted eye, with radius
//! `speed * (round trip + update interval) + margin`. Image 0 looks from its middle, the others from its rim, so that what
//! the viewer's motion uncovers is there before it is seen. A viewer that stands still in a scene that stands still costs
//! nothing at all.

use std::f64::consts::TAU;

use camera::{Pinhole, Rigid};
use glam::{DVec2, DVec3};
use protocol::message::ViewSize;

use crate::discretize::DepthPrecision;
use crate::viewer::{Prediction, Viewer};

/// A walker's margin: the region in which a standing person moves the head.
const WALK_MARGIN_M: f64 = 0.25;
/// An object's margin as a share of its bounding radius.
const OBJECT_MARGIN: f64 = 0.05;
/// A region of more than these many margins cannot be covered by a handful of images; faster viewers see holes.
const MAX_RADIUS_MARGINS: f64 = 8.0;
/// How much wider than the view an image is on each side, for turns that nobody predicted.
const TURN_MARGIN_RAD: f64 = 0.10;
/// No image is wider than this half angle: at 62 degrees a pixel at the rim has 4.5 times the solid angle's density of one
/// in the middle, and the middle has lost half of its own.
const MAX_HALF_FIELD_RAD: f64 = 1.08;
/// The share of the region's radius that a viewer may use up before the set is replaced; the rest is its way on while the
/// next one is made.
const REPLACE_AT: f64 = 0.5;
/// A still viewer's set is made anew when it was made for a region or a field this many times larger than needed.
const SETTLE_AT: f64 = 1.5;
/// Images are not longer than this many times their width, whatever the view's shape.
const MAX_ASPECT: f64 = 4.0;
/// Sides of images are whole multiples of this.
const SIZE_STEP_PX: f64 = 4.0;
/// How far a sample may be shifted on the screen by the coding of its depth, anywhere in the region.
const PARALLAX_ERROR_PX: f64 = 0.1;
/// Turns of less than this do not make a set anew, whatever the field.
const LEAST_TURN_RAD: f64 = 0.01;

/// What holds for all viewers of a scene.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rules {
    /// Images a set.
    pub images: usize,
    /// An image has as many pixels as a square of this side.
    pub image_size_px: u32,
    /// Seconds between two ticks of a session.
    pub update_interval_s: f64,
    /// Points nearer than this have no image.
    pub near_m: f64,
    /// Radius of the region of a viewer who stands still.
    pub margin_m: f64,
    /// Whether the scene changes with time.
    pub animated: bool,
}

impl Rules {
    /// The margin of a scene with this bounding radius.
    pub fn margin_m(walk: bool, bounds_radius_m: f64) -> f64 {
        let object_m = OBJECT_MARGIN * bounds_radius_m;
        let margin_m = if walk { WALK_MARGIN_M.min(object_m) } else { object_m };
        if margin_m > 0.0 { margin_m } else { WALK_MARGIN_M }
    }

    fn max_radius_m(&self) -> f64 {
        self.margin_m * MAX_RADIUS_MARGINS
    }
}

/// Why a set is made.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Reason {
    /// The client holds nothing.
    First,
    /// The viewer walked out of the region.
    Moved,
    /// The view turned out of the field.
    Turned,
    /// The client's output changed.
    Resized,
    /// The scene moved on.
    Animated,
    /// The viewer came to rest in a set made for motion: a tighter one shows more.
    Settled,
}

impl Reason {
    /// Every reason.
    pub const ALL: [Reason; 6] =
        [Reason::First, Reason::Moved, Reason::Turned, Reason::Resized, Reason::Animated, Reason::Settled];

    /// A name for logs and counters.
    pub fn name(self) -> &'static str {
        match self {
            Reason::First => "first",
            Reason::Moved => "moved",
            Reason::Turned => "turned",
            Reason::Resized => "resized",
            Reason::Animated => "animated",
            Reason::Settled => "settled",
        }
    }
}

/// What a set of images covers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Coverage {
    /// The eye in the region's middle, which looks along the middle of the field.
    pub world_from_eye: Rigid,
    /// The region's radius.
    pub radius_m: f64,
    /// Tangents of the images' half fields along x and y.
    pub half_field: DVec2,
    /// Width and height of an image.
    pub image_size_px: (u32, u32),
    /// The output it was made for.
    pub view: ViewSize,
    /// Scene time of the capture.
    pub scene_time_s: f64,
}

/// A set of images to make.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// Why.
    pub reason: Reason,
    /// What it will cover.
    pub coverage: Coverage,
    /// The cameras; image 0 looks from the region's middle.
    pub views: Vec<Pinhole>,
    /// How finely depth is stored.
    pub precision: DepthPrecision,
}

/// The set to make now, or `None` where the one that the client holds still serves.
pub fn plan(rules: &Rules, viewer: &Viewer, now_s: f64, held: Option<&Coverage>) -> Option<Plan> {
    let predicted = viewer.predict(now_s, rules.update_interval_s, rules.max_radius_m());
    let wanted = wanted_coverage(rules, viewer, &predicted, now_s);
    let reason = reason(rules, held, &wanted, &predicted)?;
    let views = region_views(&wanted, rules);
    Some(Plan { reason, coverage: wanted, views, precision: precision(&wanted) })
}

/// A sample of an image on one side of the region is seen from its other side.
fn precision(coverage: &Coverage) -> DepthPrecision {
    DepthPrecision::Parallax {
        epsilon_px: PARALLAX_ERROR_PX,
        focal_px: f64::from(coverage.view.height_px) / 2.0 / half_view(coverage.view).y,
        offset_m: 2.0 * coverage.radius_m,
    }
}

/// What a set made now would cover.
fn wanted_coverage(rules: &Rules, viewer: &Viewer, predicted: &Prediction, now_s: f64) -> Coverage {
    let exposed_s = viewer.round_trip_s + rules.update_interval_s;
    let radius_m = (predicted.speed_m_s * exposed_s + rules.margin_m).min(rules.max_radius_m());
    let turn_rad = TURN_MARGIN_RAD + predicted.turn_rad_s * exposed_s;
    let (image_size_px, half_field) = field(rules, half_view(viewer.view), turn_rad);
    Coverage {
        world_from_eye: predicted.world_from_eye,
        radius_m,
        half_field,
        image_size_px,
        view: viewer.view,
        scene_time_s: now_s,
    }
}

/// Size and half fields of images that cover a view and turns of `turn_rad` around it. The size depends on the view alone,
/// so that the GPU's targets serve every set; its shape is that of a resting viewer's field, so that no row is wasted.
fn field(rules: &Rules, half_view: DVec2, turn_rad: f64) -> ((u32, u32), DVec2) {
    let widen = |half: f64, turn_rad: f64| (half.atan() + turn_rad).min(MAX_HALF_FIELD_RAD).max(half.atan()).tan();
    let widened = |turn_rad: f64| DVec2::new(widen(half_view.x, turn_rad), widen(half_view.y, turn_rad));
    let rest = widened(TURN_MARGIN_RAD);
    let aspect = (rest.x / rest.y).clamp(1.0 / MAX_ASPECT, MAX_ASPECT);
    let whole = |size_px: f64| ((size_px / SIZE_STEP_PX).round() * SIZE_STEP_PX).max(SIZE_STEP_PX);
    let side_px = f64::from(rules.image_size_px);
    let width_px = whole(side_px * aspect.sqrt());
    let size_px = DVec2::new(width_px, whole(side_px * side_px / width_px));
    let focal_px = (size_px / 2.0 / widened(turn_rad)).min_element();
    ((size_px.x as u32, size_px.y as u32), size_px / 2.0 / focal_px)
}

fn reason(rules: &Rules, held: Option<&Coverage>, wanted: &Coverage, predicted: &Prediction) -> Option<Reason> {
    let Some(held) = held else { return Some(Reason::First) };
    let walked_m = held.world_from_eye.translation.distance(wanted.world_from_eye.translation);
    if rules.animated && wanted.scene_time_s > held.scene_time_s {
        Some(Reason::Animated)
    } else if half_view(held.view) != half_view(wanted.view) {
        Some(Reason::Resized)
    } else if walked_m > REPLACE_AT * held.radius_m.min(wanted.radius_m) {
        Some(Reason::Moved)
    } else if turned_out(held, wanted) {
        Some(Reason::Turned)
    } else if predicted.is_still() && is_loose(held, wanted) {
        Some(Reason::Settled)
    } else {
        None
    }
}

/// Whether a corner of the wanted view lies outside of the held field. A view wider than any image stays where it is.
fn turned_out(held: &Coverage, wanted: &Coverage) -> bool {
    let held_from_wanted = held.world_from_eye.rotation.conjugate() * wanted.world_from_eye.rotation;
    let turn_rad = 2.0 * held_from_wanted.xyz().length().min(1.0).asin();
    let half = half_view(wanted.view);
    let inside = |corner: DVec2| {
        let ray = held_from_wanted * (half * corner).extend(1.0);
        ray.z > 0.0 && ray.truncate().abs().cmple(held.half_field * ray.z).all()
    };
    let corners = [DVec2::new(-1.0, -1.0), DVec2::new(1.0, -1.0), DVec2::new(-1.0, 1.0), DVec2::ONE];
    turn_rad > LEAST_TURN_RAD && !corners.into_iter().all(inside)
}

/// Whether the held set spends its samples on much more than is wanted.
fn is_loose(held: &Coverage, wanted: &Coverage) -> bool {
    held.radius_m > SETTLE_AT * wanted.radius_m || held.half_field.x > SETTLE_AT * wanted.half_field.x
}

/// Tangents of the half fields of an output along x and y.
fn half_view(view: ViewSize) -> DVec2 {
    let half_y = (view.fov_y_rad / 2.0).tan();
    DVec2::new(half_y * f64::from(view.width_px) / f64::from(view.height_px), half_y)
}

/// The cameras of a set: the middle of the region, then a ring on its rim, across the view, where motion uncovers most.
pub fn region_views(coverage: &Coverage, rules: &Rules) -> Vec<Pinhole> {
    let (width_px, height_px) = coverage.image_size_px;
    let centre_px = DVec2::new(width_px.into(), height_px.into()) / 2.0;
    let middle = Pinhole {
        world_from_eye: coverage.world_from_eye,
        width_px,
        height_px,
        focal_px: centre_px.x / coverage.half_field.x,
        centre_px,
        near_m: rules.near_m,
    };
    let ring = rules.images.saturating_sub(1);
    // With two on the ring they stand left and right; a person moves sideways more than up and down.
    let first_rad = if ring == 3 { -TAU / 4.0 } else { 0.0 };
    let rim = (0..ring).map(|index| {
        let angle_rad = first_rad + TAU * index as f64 / ring as f64;
        let offset_eye = DVec3::new(angle_rad.cos(), angle_rad.sin(), 0.0) * coverage.radius_m;
        let translation = coverage.world_from_eye.transform_point(offset_eye);
        Pinhole { world_from_eye: Rigid { translation, ..coverage.world_from_eye }, ..middle }
    });
    std::iter::once(middle).chain(rim).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DQuat;

    const VIEW: ViewSize = ViewSize { width_px: 640, height_px: 360, fov_y_rad: 1.047 };
    const RULES: Rules =
        Rules { images: 4, image_size_px: 512, update_interval_s: 0.1, near_m: 0.05, margin_m: 0.25, animated: false };

    fn viewer() -> Viewer {
        Viewer::at_start(VIEW, Rigid::look_along(DVec3::new(0.0, 1.7, 0.0), DVec3::NEG_Z), 0.0)
    }

    fn first(viewer: &Viewer, now_s: f64) -> Coverage {
        plan(&RULES, viewer, now_s, None).expect("a first set").coverage
    }

    #[test]
    fn a_still_viewer_gets_one_set_and_then_nothing() {
        let viewer = viewer();
        let held = first(&viewer, 0.0);
        for tick in 1..100 {
            assert_eq!(plan(&RULES, &viewer, f64::from(tick) * 0.1, Some(&held)), None);
        }
    }

    #[test]
    fn the_set_is_replaced_when_the_viewer_leaves_and_not_before() {
        let mut viewer = viewer();
        let held = first(&viewer, 0.0);
        let mut pose = viewer.world_from_eye;
        pose.translation.x += 0.1;
        viewer.hear(1, 1.0, pose, DVec3::ZERO, 1.0);
        assert_eq!(plan(&RULES, &viewer, 1.0, Some(&held)), None);
        pose.translation.x += 0.1;
        viewer.hear(2, 2.0, pose, DVec3::ZERO, 2.0);
        assert_eq!(plan(&RULES, &viewer, 2.0, Some(&held)).map(|plan| plan.reason), Some(Reason::Moved));
    }

    #[test]
    fn a_small_turn_is_covered_and_a_large_one_is_not() {
        let mut viewer = viewer();
        let held = first(&viewer, 0.0);
        let start = viewer.world_from_eye;
        let turned = |angle: f64| Rigid { rotation: DQuat::from_rotation_y(angle) * start.rotation, ..start };
        viewer.hear(1, 1.0, turned(0.05), DVec3::ZERO, 1.0);
        assert_eq!(plan(&RULES, &viewer, 1.0, Some(&held)), None);
        viewer.hear(2, 2.0, turned(0.3), DVec3::ZERO, 2.0);
        let next = plan(&RULES, &viewer, 2.0, Some(&held)).expect("the view left the field");
        assert_eq!(next.reason, Reason::Turned);
        assert_eq!(plan(&RULES, &viewer, 3.0, Some(&next.coverage)), None);
    }

    #[test]
    fn a_runner_who_stops_gets_a_tighter_set_once() {
        let mut viewer = viewer();
        viewer.hear(1, 0.0, viewer.world_from_eye, DVec3::new(0.0, 0.0, -5.0), 0.0);
        let running = first(&viewer, 0.0);
        assert!((running.radius_m - 0.75).abs() < 1e-12);
        viewer.hear(2, 0.4, running.world_from_eye, DVec3::ZERO, 0.4);
        let settled = plan(&RULES, &viewer, 1.0, Some(&running)).expect("a tighter set");
        assert_eq!(settled.reason, Reason::Settled);
        assert_eq!(plan(&RULES, &viewer, 1.1, Some(&settled.coverage)), None);
    }

    #[test]
    fn a_moving_scene_is_sampled_at_each_tick() {
        let rules = Rules { animated: true, ..RULES };
        let held = first(&viewer(), 0.0);
        assert_eq!(plan(&rules, &viewer(), 0.0, Some(&held)), None);
        assert_eq!(plan(&rules, &viewer(), 0.1, Some(&held)).map(|plan| plan.reason), Some(Reason::Animated));
    }

    #[test]
    fn images_cover_the_view_from_the_middle_and_the_rim_of_the_region() {
        let coverage = first(&viewer(), 0.0);
        let views = region_views(&coverage, &RULES);
        assert_eq!(views.len(), 4);
        let half = half_view(VIEW);
        for view in &views {
            assert!(view.is_valid());
            let half_field = view.centre_px / view.focal_px;
            assert!(half_field.cmpgt(half).all() && half_field.cmplt(half * 1.5).all(), "{half_field} for {half}");
            let pixels = f64::from(view.width_px * view.height_px);
            assert!((pixels / (512.0 * 512.0) - 1.0).abs() < 0.02, "{pixels} pixels");
        }
        for rim in &views[1..] {
            let offset = rim.world_from_eye.translation - views[0].world_from_eye.translation;
            assert!((offset.length() - coverage.radius_m).abs() < 1e-9);
            assert!(offset.dot(DVec3::NEG_Z).abs() < 1e-9, "the ring lies across the view");
        }
    }

    #[test]
    fn a_view_wider_than_any_image_does_not_ask_for_ever() {
        let mut viewer = viewer();
        viewer.view.fov_y_rad = 2.9;
        let held = first(&viewer, 0.0);
        assert_eq!(plan(&RULES, &viewer, 1.0, Some(&held)), None);
    }
}
