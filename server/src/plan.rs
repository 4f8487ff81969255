//! Where to look for what a viewer lacks, and whether to look at all.
//!
//! The **view region** is the ball where the viewer will be when the samples arrive: around the predicted eye, with radius
//! `speed * update interval / 2 + error + margin`: the eye is predicted for the middle of the interval for which samples are new, and
//! the error of predictions is measured. The first view is the predicted one. Who moves is also looked for further on his way, and
//! while he is on it as expected, not again until it ends ([`way`]); the others look from the region's rim, so that what motion
//! uncovers is there before it is seen. Only they are wider by the error of predictions: what is expected keeps its density. A
//! viewer that stands still in a scene that stands still costs nothing at all once a look found nothing lacking.

mod rules;
pub mod way;

use std::f64::consts::TAU;

use camera::{Pinhole, Rigid};
use glam::{DVec2, DVec3};
use protocol::message::ViewSize;

use crate::allowance::Allowance;
use crate::discretize::DepthPrecision;
use crate::viewer::{Prediction, Viewer};

use rules::TURN_MARGIN_RAD;
use way::Way;

pub use rules::Rules;

/// No image is wider than this half angle: at 62 degrees a pixel at the rim has 4.5 times the solid angle's density of one
/// in the middle, and the middle has lost half of its own.
const MAX_HALF_FIELD_RAD: f64 = 1.08;
/// A viewer who moved by less than this share of the margin stands still: 2.5 mm for a walker.
const STILL_SHARE: f64 = 0.01;
/// Views from the rim that are taken in turn while the viewer or the scene moves.
const RIM_VIEWS: usize = 4;
/// Samples stay held while the viewer walks on: they are stored as precisely as an eye this many margins away needs.
const PARALLAX_MARGINS: f64 = 4.0;
/// Images are not longer than this many times their width, whatever the view's shape.
const MAX_ASPECT: f64 = 4.0;
/// Sides of images are whole multiples of this.
pub const SIZE_STEP_PX: f64 = 4.0;
/// How far a sample may be shifted on the screen by the coding of its depth, where nothing else is asked for.
pub const PARALLAX_ERROR_PX: f64 = 0.1;
/// How much wider than the view the own image of a viewer who stands still is on each side: what rounding needs, so that its
/// pixels lie where the viewer looks. Images from the rim keep the turn's margin.
const STILL_MARGIN_RAD: f64 = 0.01;
/// A view that turned by less than this did not turn: two pixels of a view of 640.
const LEAST_TURN_RAD: f64 = 0.004;

/// Why the server looks.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Reason {
    /// The client holds nothing.
    First,
    /// The viewer moved.
    Moved,
    /// The view turned.
    Turned,
    /// The client's output changed.
    Resized,
    /// The scene moved on.
    Animated,
    /// Nothing moved, but the last look still found something lacking.
    Settling,
    /// No look at what is lacking: the viewer stands still and gets his own view, see [`crate::rest`].
    Rest,
    /// Nothing lacks: what will be needed next, see [`crate::anticipate`].
    Ahead,
    /// No look either: the client asked for the image of a camera, see [`crate::asked`].
    Camera,
}

impl Reason {
    /// Every reason.
    pub const ALL: [Reason; 9] = [
        Reason::First,
        Reason::Moved,
        Reason::Turned,
        Reason::Resized,
        Reason::Animated,
        Reason::Settling,
        Reason::Rest,
        Reason::Ahead,
        Reason::Camera,
    ];

    /// Whether the next look will be from elsewhere or at another time, as far as one knows.
    pub fn is_passing(self) -> bool {
        matches!(self, Reason::Moved | Reason::Turned | Reason::Animated)
    }

    /// A name for logs and counters.
    pub fn name(self) -> &'static str {
        match self {
            Reason::First => "first",
            Reason::Moved => "moved",
            Reason::Turned => "turned",
            Reason::Resized => "resized",
            Reason::Animated => "animated",
            Reason::Settling => "settling",
            Reason::Rest => "rest",
            Reason::Ahead => "ahead",
            Reason::Camera => "camera",
        }
    }
}

/// What a look covers.
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
    /// Where a viewer who moves was expected to go on.
    pub way: Option<Way>,
}

/// The last look at what a client holds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Focus {
    /// What it covered.
    pub coverage: Coverage,
    /// Whether it found nothing lacking, anywhere.
    pub settled: bool,
    /// Whether it was a look in passing: it sees nothing from the region's rim but from one place, and few of them trim what stands over.
    pub passing: bool,
    /// Looks so far.
    pub looks: usize,
}

/// Where to look.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// Why.
    pub reason: Reason,
    /// What it will cover.
    pub coverage: Coverage,
    /// The cameras; the first is the predicted view.
    pub views: Vec<Pinhole>,
    /// The first so many views may refine what is held too coarsely: those on the way of a viewer who moves, all of one who
    /// stands still.
    pub refining: usize,
    /// How finely depth is stored.
    pub precision: DepthPrecision,
    /// Whether its images are smaller than they would be on a path that carries more.
    pub is_coarse: bool,
    /// What an update may bring.
    pub allowance: Allowance,
}

impl Plan {
    /// Of all views together.
    pub fn pixels(&self) -> u64 {
        self.views.iter().map(|view| u64::from(view.width_px) * u64::from(view.height_px)).sum()
    }
}

/// Where to look now, or `None` where nothing can be lacking since the last look.
pub fn plan(rules: &Rules, viewer: &Viewer, now_s: f64, last: Option<&Focus>) -> Option<Plan> {
    let course = viewer.course(now_s, rules.update_interval_s, rules.max_radius_m());
    let predicted = course.after(0.0);
    let wanted = wanted_coverage(rules, viewer, &predicted, now_s);
    let reason = reason(rules, last, &wanted)?;
    let is_looked_ahead_for = last.and_then(|focus| focus.coverage.way).is_some_and(|way| {
        matches!(reason, Reason::Moved | Reason::Turned) && way.leads_past(rules, &predicted, now_s)
    });
    if is_looked_ahead_for {
        return None;
    }
    let all = region_views(&wanted, rules);
    let way = Way::of(rules, course, now_s);
    let (views, refining) = match reason {
        Reason::First | Reason::Resized | Reason::Settling | Reason::Rest | Reason::Ahead | Reason::Camera => {
            (still_views(all, &wanted), usize::MAX)
        }
        Reason::Moved | Reason::Turned | Reason::Animated => {
            let rim = Rules { images: 1 + RIM_VIEWS, ..*rules };
            let in_turn = last.map_or(0, |focus| focus.looks) % RIM_VIEWS;
            let own = on_way(rules, viewer, &predicted, all[0]);
            let mut views = vec![own];
            views.extend(way.eyes().map(|world_from_eye| Pinhole { world_from_eye, ..own }));
            let on_way = views.len();
            views.push(region_views(&wanted, &rim)[1 + in_turn]);
            views.truncate(rules.images);
            (views, on_way)
        }
    };
    let precision = precision(rules, &wanted);
    let coverage = Coverage { way: reason.is_passing().then_some(way), ..wanted };
    Some(Plan { reason, coverage, views, refining, precision, is_coarse: false, allowance: Allowance::ALL })
}

/// A view on the way, no wider than for turns that are expected: what is only possible is covered from the rim, more coarsely.
fn on_way(rules: &Rules, viewer: &Viewer, predicted: &Prediction, wide: Pinhole) -> Pinhole {
    let turn_rad = TURN_MARGIN_RAD + turned_rad(rules, predicted);
    let (_, half_field) = field(rules, half_view(viewer.view), turn_rad);
    Pinhole { focal_px: wide.centre_px.x / half_field.x, ..wide }
}

/// Views along an arc follow its turn; one that turns on the spot sees by a wider field what they would.
fn turned_rad(rules: &Rules, predicted: &Prediction) -> f64 {
    if predicted.is_on_arc { 0.0 } else { predicted.turn_rad_s * rules.update_interval_s / 2.0 }
}

/// A sample is seen from elsewhere than where it was taken.
fn precision(rules: &Rules, coverage: &Coverage) -> DepthPrecision {
    precision_within(rules, coverage.view, coverage.radius_m)
}

/// How finely depth is stored of what is seen from this far around.
pub fn precision_within(rules: &Rules, view: ViewSize, radius_m: f64) -> DepthPrecision {
    DepthPrecision::Parallax {
        epsilon_px: rules.parallax_error_px,
        focal_px: output_focal_px(view),
        offset_m: (PARALLAX_MARGINS * rules.margin_m).max(2.0 * radius_m),
    }
}

/// What a set made now would cover.
fn wanted_coverage(rules: &Rules, viewer: &Viewer, predicted: &Prediction, now_s: f64) -> Coverage {
    let (error, half_interval_s) = (viewer.expected_error(predicted), rules.update_interval_s / 2.0);
    let away_m = predicted.speed_m_s * half_interval_s + error.distance_m;
    let radius_m = (away_m + rules.margin_m).min(rules.max_radius_m());
    let turn_rad = TURN_MARGIN_RAD + turned_rad(rules, predicted) + error.turn_rad;
    let (image_size_px, half_field) = field(rules, half_view(viewer.view), turn_rad);
    Coverage {
        world_from_eye: predicted.world_from_eye,
        radius_m,
        half_field,
        image_size_px,
        view: viewer.view,
        scene_time_s: now_s,
        way: None,
    }
}

/// Size and half fields of images that cover a view and turns of `turn_rad` around it. The size depends on the view alone,
/// so that the GPU's targets serve every set; its shape is that of a resting viewer's field, so that no row is wasted.
fn field(rules: &Rules, half_view: DVec2, turn_rad: f64) -> ((u32, u32), DVec2) {
    let rest = widened(half_view, TURN_MARGIN_RAD);
    let aspect = (rest.x / rest.y).clamp(1.0 / MAX_ASPECT, MAX_ASPECT);
    let whole = |size_px: f64| ((size_px / SIZE_STEP_PX).round() * SIZE_STEP_PX).max(SIZE_STEP_PX);
    let side_px = f64::from(rules.image_size_px);
    let width_px = whole(side_px * aspect.sqrt());
    let size_px = DVec2::new(width_px, whole(side_px * side_px / width_px));
    let focal_px = (size_px / 2.0 / widened(half_view, turn_rad)).min_element();
    ((size_px.x as u32, size_px.y as u32), size_px / 2.0 / focal_px)
}

/// Tangents of half fields, wider by `margin_rad` on each side.
fn widened(half_view: DVec2, margin_rad: f64) -> DVec2 {
    let widen = |half: f64| (half.atan() + margin_rad).min(MAX_HALF_FIELD_RAD).max(half.atan()).tan();
    DVec2::new(widen(half_view.x), widen(half_view.y))
}

fn reason(rules: &Rules, last: Option<&Focus>, wanted: &Coverage) -> Option<Reason> {
    let Some(Focus { coverage: held, settled, passing, .. }) = last else { return Some(Reason::First) };
    let moved_m = held.world_from_eye.translation.distance(wanted.world_from_eye.translation);
    let turn = held.world_from_eye.rotation.conjugate() * wanted.world_from_eye.rotation;
    let turn_rad = 2.0 * turn.xyz().length().min(1.0).asin();
    if half_view(held.view) != half_view(wanted.view) {
        Some(Reason::Resized)
    } else if rules.animated && wanted.scene_time_s != held.scene_time_s {
        Some(Reason::Animated)
    } else if moved_m > STILL_SHARE * rules.margin_m {
        Some(Reason::Moved)
    } else if turn_rad > LEAST_TURN_RAD {
        Some(Reason::Turned)
    } else if !settled || *passing {
        Some(Reason::Settling)
    } else {
        None
    }
}

/// Focal length of an output in pixels.
pub fn output_focal_px(view: ViewSize) -> f64 {
    f64::from(view.height_px) / 2.0 / half_view(view).y
}

/// Tangents of the half fields of an output along x and y.
pub fn half_view(view: ViewSize) -> DVec2 {
    let half_y = (view.fov_y_rad / 2.0).tan();
    DVec2::new(half_y * f64::from(view.width_px) / f64::from(view.height_px), half_y)
}

/// The view of who stands still, as it was looked at last.
pub fn own_view(coverage: &Coverage, rules: &Rules) -> Pinhole {
    still_views(region_views(coverage, &Rules { images: 1, ..*rules }), coverage)[0]
}

/// The same views, of which the own one is no wider than the output needs, but no denser than the output either: denser samples
/// only alias.
fn still_views(mut views: Vec<Pinhole>, coverage: &Coverage) -> Vec<Pinhole> {
    let half_field = widened(half_view(coverage.view), STILL_MARGIN_RAD);
    if let Some(own) = views.first_mut() {
        let narrow_px = (own.centre_px / half_field).min_element();
        own.focal_px = narrow_px.min(output_focal_px(coverage.view)).max(own.focal_px);
    }
    views
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
mod tests;
