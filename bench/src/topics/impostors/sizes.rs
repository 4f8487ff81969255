//! Cameras of impostors whose images have another size.

use std::sync::Arc;

use camera::{Camera, GraphCamera, Pinhole, Spoc};

/// A camera that sees the same with `share` as many pixels along each axis, rounded to whole ones.
pub(super) fn scaled(camera: &Camera, share: f64) -> Camera {
    match camera {
        Camera::Pinhole(pinhole) => Camera::Pinhole(scaled_pinhole(pinhole, share)),
        Camera::Spoc(spoc) => {
            let pinhole = scaled_pinhole(&spoc.pinhole, share);
            let share = pinhole.focal_px / spoc.pinhole.focal_px;
            let (pole_px, push_max_px, ramp_px) =
                (spoc.pole_px * share, spoc.push_max_px * share, spoc.ramp_px * share);
            Camera::Spoc(Spoc { pinhole, pole_px, push_max_px, ramp_px, ..*spoc })
        }
        Camera::Graph(graph) => {
            let mut description = graph.description().clone();
            description.root.pinhole = scaled_pinhole(&description.root.pinhole, share);
            let scaled = GraphCamera::from_description(&description);
            scaled.map_or_else(|_| camera.clone(), |scaled| Camera::Graph(Arc::new(scaled)))
        }
    }
}

/// Widths are whole pixels: the share is rounded to one.
fn scaled_pinhole(pinhole: &Pinhole, share: f64) -> Pinhole {
    let width_px = (f64::from(pinhole.width_px) * share).round().max(1.0);
    let share = width_px / f64::from(pinhole.width_px);
    Pinhole {
        width_px: width_px as u32,
        height_px: (f64::from(pinhole.height_px) * share).round().max(1.0) as u32,
        focal_px: pinhole.focal_px * share,
        centre_px: pinhole.centre_px * share,
        ..*pinhole
    }
}
