//! The graph camera that looks for occluders.

use camera::{Bounds, GraphCamera, GraphError, Pinhole, split_behind};
use glam::{DVec2, DVec3};

/// The image is so much wider and higher than the view, on every side, in shares of the view's: what stands just outside
/// occludes as well, and what crosses the border of the view does not come and go.
const MARGIN: f64 = 0.125;
/// How far the two eyes behind the split stand to the sides, in distances to the split point.
const SHIFT: f64 = 0.5;

/// Of three frusta, for a view of what lies within `bounds`: split across the view at the middle of what is held, which stays where it is while the
/// view moves.
pub(super) fn graph_camera(view: &Pinhole, bounds: Bounds) -> Result<GraphCamera, GraphError> {
    let wide = widened(view);
    let eye_from_world = view.world_from_eye.inverse();
    let radius_m = (bounds.max - bounds.min).length() / 2.0;
    let middle_m = eye_from_world.transform_point(bounds.middle()).z;
    let far_m = (middle_m + radius_m).max(4.0 * view.near_m);
    let split_m = middle_m.clamp(2.0 * view.near_m, far_m * 0.9);
    let split_world = view.world_from_eye.transform_point(DVec3::Z * split_m);
    GraphCamera::from_description(&split_behind(&wide, split_world, SHIFT * split_m, far_m))
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
