//! What Vantage says over the wire.
//!
//! - [`image`]: [`DepthImage`], what one camera captured, as plain values.
//! - [`held`]: [`Patch`], [`Edit`], [`Update`], and [`Held`], the copy of the client that both ends keep.
//! - [`look`]: materials, lights and how colour is shown.
//! - `codec`: bytes of the bulk samples; `wire`: bytes of everything else (the only file that names the serializer).
//! - `session`: the sans-IO state machines of both ends.

pub mod held;
pub mod image;
pub mod look;
pub mod message;

pub use held::{Edit, Held, ObjectPose, Patch, PatchId, Purpose, Update};
pub use image::{DepthImage, DepthScale, Mask};
pub use look::{Light, Lighting, Look, Material};
pub use message::{ClientMessage, ServerMessage};
