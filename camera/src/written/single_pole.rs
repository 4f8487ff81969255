use glam::DVec3;
use serde::Deserialize;

use super::error::{WrittenError, check_size};
use crate::{Bounds, Rigid, Spoc};

/// A single-pole camera as people write it: see [`Spoc::around`].
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WrittenSinglePole {
    /// Where the eye is.
    #[serde(default)]
    pub eye: DVec3,
    /// What it sees past the silhouette of.
    pub target: Target,
    /// Width and height of the image in pixels.
    pub size_px: (u32, u32),
    /// How far beside the eye its outer rays come from, in metres: the further, the more of the target's sides it sees.
    pub ring_m: f64,
}

/// What a single-pole camera looks at.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(untagged)]
pub enum Target {
    /// The scene's first object of this name, where it is at time 0.
    Object(String),
    /// A ball.
    Ball {
        /// Its middle.
        centre: DVec3,
        /// In metres.
        radius_m: f64,
    },
}

impl WrittenSinglePole {
    pub(super) fn compile(
        &self,
        world_from_written: &Rigid,
        bounds_of: &dyn Fn(&str) -> Option<Bounds>,
    ) -> Result<Spoc, WrittenError> {
        check_size(self.size_px)?;
        let bounds = match &self.target {
            Target::Object(name) => bounds_of(name).ok_or_else(|| WrittenError::NoTarget { name: name.clone() })?,
            Target::Ball { centre, radius_m } => {
                let middle = world_from_written.transform_point(*centre);
                // The camera looks at the ball around a box: at this one, around a cube.
                let half_m = radius_m / 3.0_f64.sqrt();
                Bounds { min: middle - half_m, max: middle + half_m }
            }
        };
        if !(self.ring_m >= 0.0 && self.ring_m.is_finite()) {
            return Err(WrittenError::Ring);
        }
        let eye_world = world_from_written.transform_point(self.eye);
        Spoc::around(&bounds, eye_world, self.size_px, self.ring_m).ok_or(WrittenError::EyeInside)
    }
}
