//! The graph cameras that look for occluders.

use camera::{Bounds, GraphCamera, GraphError, Pinhole, split_behind};
use glam::DVec3;
use protocol::Ball;

/// Graph cameras that stand around what is looked at, with the pixel of the common image that each begins at.
#[derive(Debug)]
pub(super) struct Lookers {
    pub(super) cameras: Vec<(GraphCamera, [u32; 2])>,
    /// Of the common image.
    pub(super) size_px: (u32, u32),
    /// What they stand around.
    pub(super) ball: Ball,
}

/// Side of the image of each. Two by two are as wide as every device can draw (2048).
const SIDE_PX: u32 = 512;
/// How far the two eyes behind the split stand to the sides, in distances to the split point.
const SHIFT: f64 = 0.2;

impl Lookers {
    /// For a view of what lies within `bounds`; `None` where that is nothing.
    pub(super) fn new(view: &Pinhole, bounds: Bounds, reach_m: f64) -> Option<Lookers> {
        let ball = Ball::new(bounds, view.world_from_eye.translation, reach_m)?;
        let looker = |(view, index): (&Pinhole, u32)| {
            let description = split_behind(view, ball.middle_world, SHIFT * ball.distance_m(), ball.far_m());
            Ok((GraphCamera::from_description(&description)?, [index % 2 * SIDE_PX, index / 2 * SIDE_PX]))
        };
        let cameras: Result<Vec<_>, GraphError> = ball.views(SIDE_PX).iter().zip(0..).map(looker).collect();
        Some(Lookers { cameras: cameras.ok()?, size_px: (2 * SIDE_PX, 2 * SIDE_PX), ball })
    }

    /// What they and their points are relative to.
    pub(super) fn anchor_world(&self) -> DVec3 {
        self.ball.middle_world
    }
}
