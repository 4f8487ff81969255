//! Where shadows fall.

use camera::Pinhole;
use protocol::Held;
use surface::GBuffer;

/// A view with what it shows.
#[derive(Debug, Clone, Copy)]
pub struct Receivers<'a> {
    /// Its surfaces.
    pub gbuffer: &'a GBuffer,
    /// Whose materials they have.
    pub held: &'a Held,
    /// Where it was drawn from.
    pub view: &'a Pinhole,
}
