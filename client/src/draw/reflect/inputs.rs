//! What reflections of a picture come from.

use std::collections::BTreeMap;

use camera::Pinhole;
use glam::DAffine3;
use protocol::Held;
use surface::GBuffer;

use super::Settings;
use crate::draw::impostors::Impostors;

/// See the module.
pub(crate) struct ReflectInputs<'a> {
    pub gbuffer: &'a GBuffer,
    pub held: &'a Held,
    pub poses_now: &'a BTreeMap<u16, DAffine3>,
    pub camera: &'a Pinhole,
    /// What all light is multiplied by before it is shown.
    pub exposure: f32,
    pub impostors: &'a Impostors,
    pub settings: Settings,
}
