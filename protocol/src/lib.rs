//! What Vantage says over the wire.
//!
//! - [`image`]: [`DepthImage`], what one camera captured, as plain values.
//! - [`ends`]: where surfaces end within a pixel.
//! - [`held`]: [`Patch`], [`Edit`], [`Update`], and [`Held`], the copy of the client that both ends keep.
//! - [`body`]: objects as triangles, where samples of them would be more.
//! - [`inventory`]: what is made for a client, and what is left out, for people.
//! - [`staging`]: how a client has the scene put before it: its time, its parts, where it is cut.
//! - [`look`]: materials, lights and how colour is shown.
//! - [`sky`]: light from far around. [`message`]: what both ends say. [`wire`]: its bytes, and the only file that names the serializer. [`codec`]: the bytes of
//!   samples. [`plain`]: an update where bytes are handed over within one machine.
//! - [`session`]: the sans-IO state machines of both ends: bytes and the time go in, bytes, events and deadlines come out.
//! - [`limits`]: caps on everything that comes from outside.

pub mod body;
mod bytes;
pub mod codec;
pub mod ends;
pub mod held;
pub mod image;
pub mod inventory;
mod lamp;
pub mod limits;
pub mod look;
pub mod message;
mod occluder_views;
pub mod plain;
pub mod session;
mod shadow_views;
pub mod sky;
pub mod staging;
pub mod wire;

pub use body::Body;
pub use held::{
    Edit, Held, HeldError, HeldInstance, Instance, NextSteps, ObjectPose, ObjectShift, ObjectSteps, Patch, PatchId,
    Purpose, Step, Steps, Update,
};
pub use image::{DepthImage, DepthScale, Mask};
pub use inventory::Inventory;
pub use lamp::Lamp;
pub use limits::Limits;
pub use look::{Area, AreaShape, Effect, Light, Lighting, Look, Material, Tone};
pub use message::{ClientMessage, ServerMessage};
pub use occluder_views::Ball;
pub use shadow_views::{Viewpoint, shadow_views};
pub use sky::Sky;
pub use staging::Staging;
