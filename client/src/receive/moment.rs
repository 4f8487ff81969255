//! [`Moment`]: what of the scene is shown at once.

use std::collections::BTreeMap;

use glam::DAffine3;

/// A moment of scene time, and where rigid objects are then.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Moment {
    /// Seconds.
    pub scene_time_s: f64,
    /// Whether the scene changes with time at all.
    pub changes: bool,
    /// By object.
    pub world_from_objects: BTreeMap<u16, DAffine3>,
}
