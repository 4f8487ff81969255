//! Scenes: loaded from files or made by code, and sampled in time. Server side only; no GPU.

mod added;
pub mod builtin;
pub mod environment;
mod floor_plan;
mod held;
pub mod load;
pub mod model;
mod rig;
pub mod sanitize;

pub use environment::Environment;
pub use floor_plan::{floor_plan, heights_m};
pub use model::{Bounds, Deformed, Instance, LightArea, Material, Mesh, Scene, SceneLight, Snapshot, Texture, Vertex};
pub use rig::Rig;
