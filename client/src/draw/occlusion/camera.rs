//! The graph cameras that look for occluders.

use camera::{Bounds, GraphCamera, GraphError, Pinhole, Rigid, split_behind};
use glam::{DVec2, DVec3};

/// Graph cameras with the pixel of the common image that each begins at, and what they stand relative to.
#[derive(Debug)]
pub(super) struct Lookers {
    pub(super) cameras: Vec<(GraphCamera, [u32; 2])>,
    /// Of the common image.
    pub(super) size_px: (u32, u32),
    pub(super) anchor_world: DVec3,
    /// Whether they stand still while the eye moves.
    pub(super) standing: bool,
}

/// Graph cameras around an object, a quarter turn apart.
const STANDING: usize = 4;
/// Side of the image of each. Two by two are as wide as every device can draw (2048).
const STANDING_PX: u32 = 512;
/// Their distance from the middle, in bounding radii.
const STANDING_RADII: f64 = 3.0;
/// How high they stand over the horizon, and how far they are turned from the axes, in radians.
const STANDING_ELEVATION_RAD: f64 = 0.7;
const STANDING_TURN_RAD: f64 = std::f64::consts::FRAC_PI_8;
/// How far the two eyes behind the split stand to the sides, in distances to the split point.
const STANDING_SHIFT: f64 = 0.2;

/// The image of a camera that goes with the view is so much wider and higher, on every side, in shares of the view's: what
/// stands just outside occludes as well, and what crosses the border of the view does not come and go.
const MARGIN: f64 = 0.125;
/// As [`STANDING_SHIFT`], for it.
const SHIFT: f64 = 0.5;

impl Lookers {
    /// For a view of what lies within `bounds`. From outside, four cameras stand around it, whatever the view; from within, one
    /// goes with the view.
    pub(super) fn new(view: &Pinhole, bounds: Bounds) -> Result<Lookers, GraphError> {
        let radius_m = (bounds.max - bounds.min).length() / 2.0;
        let is_outside = view.world_from_eye.translation.distance(bounds.middle()) > radius_m;
        if is_outside && radius_m > 0.0 {
            standing(bounds.middle(), radius_m)
        } else {
            following(view, bounds, radius_m)
        }
    }
}

fn standing(middle_world: DVec3, radius_m: f64) -> Result<Lookers, GraphError> {
    let distance_m = STANDING_RADII * radius_m;
    let fov_rad = 2.0 * (1.0 / STANDING_RADII).asin();
    let side_px = STANDING_PX;
    let camera = |index: usize| {
        let yaw_rad = std::f64::consts::TAU * index as f64 / STANDING as f64 + STANDING_TURN_RAD;
        let (up, along) = STANDING_ELEVATION_RAD.sin_cos();
        let out = DVec3::new(yaw_rad.sin() * along, up, yaw_rad.cos() * along);
        let eye = Rigid::look_at(middle_world + out * distance_m, middle_world);
        let near_m = distance_m - radius_m;
        let view = Pinhole::symmetric(eye, (side_px, side_px), fov_rad, near_m);
        let description = split_behind(&view, middle_world, STANDING_SHIFT * distance_m, distance_m + radius_m);
        let place = [index as u32 % 2 * side_px, index as u32 / 2 * side_px];
        Ok((GraphCamera::from_description(&description)?, place))
    };
    Ok(Lookers {
        cameras: (0..STANDING).map(camera).collect::<Result<_, GraphError>>()?,
        size_px: (2 * side_px, 2 * side_px),
        anchor_world: middle_world,
        standing: true,
    })
}

/// Split across the view at the middle of what is held, which stays where it is while the view moves; but before the eye.
fn following(view: &Pinhole, bounds: Bounds, radius_m: f64) -> Result<Lookers, GraphError> {
    /// The split is no nearer than this share of the depth of the scene.
    const LEAST_SHARE: f64 = 0.25;
    let wide = widened(view);
    let middle_m = view.world_from_eye.inverse().transform_point(bounds.middle()).z;
    let far_m = (middle_m + radius_m).max(4.0 * view.near_m);
    let split_m = middle_m.max(LEAST_SHARE * far_m);
    let split_world = view.world_from_eye.transform_point(DVec3::Z * split_m);
    let description = split_behind(&wide, split_world, SHIFT * split_m, far_m);
    Ok(Lookers {
        cameras: vec![(GraphCamera::from_description(&description)?, [0, 0])],
        size_px: (wide.width_px, wide.height_px),
        anchor_world: view.world_from_eye.translation,
        standing: false,
    })
}

/// The same eye with [`MARGIN`] around its image.
fn widened(view: &Pinhole) -> Pinhole {
    let size_px = DVec2::new(view.width_px.into(), view.height_px.into());
    let margin_px = (MARGIN * size_px).ceil();
    Pinhole {
        width_px: view.width_px + 2 * margin_px.x as u32,
        height_px: view.height_px + 2 * margin_px.y as u32,
        centre_px: view.centre_px + margin_px,
        ..*view
    }
}
