//! Scenes: loaded from files or made by code, and sampled in time. Server side only; no GPU.

pub mod builtin;
pub mod load;
pub mod model;
pub mod sanitize;

pub use model::{Bounds, Deformed, Instance, Material, Mesh, Scene, SceneLight, Snapshot, Texture, Vertex};
