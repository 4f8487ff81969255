//! How much light arrives, where not all of it does.

use crate::draw::effects::Strengths;
use crate::draw::fullscreen::Target;

/// How much light arrives at each pixel, where not all of it does.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Shares<'a> {
    /// Of the ambient light.
    pub(crate) ambient: Option<&'a Target>,
    /// Of single lights.
    pub(crate) lights: Option<LightShares<'a>>,
    /// How much of what hides them counts.
    pub(crate) strengths: Strengths,
}

impl Shares<'_> {
    pub(crate) fn is_all(&self) -> bool {
        self.ambient.is_none() && self.lights.is_none()
    }
}

/// Which lights arrive where.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LightShares<'a> {
    /// How much of each light, in its channel.
    pub(crate) target: &'a Target,
    /// The places of these lights in the lighting, by channel.
    pub(crate) lights: &'a [usize],
}
