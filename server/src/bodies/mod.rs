//! Bodies: objects that are sent as their triangles, once, instead of as samples of what views see of them.
//!
//! A figure that deforms is another surface at every moment: its samples are true for one, so they are sent anew with every update, and are late by
//! half a round trip even then. Its triangles, colours and what its bones do over a clip are sent once; clients bend it at each frame to where it
//! is then ([`protocol::Body`]). A wall is a dozen triangles, and tens of thousands of samples that never reach its edges. The 2016 paper names triangles beside samples as future work (section 7).
//!
//! - **Which objects**: those that bones alone bend or move, in the same way over and over ([`scene::Rig`]), and those that are rigid, of a material that is the same everywhere but for its colour;
//! - **when**: once a second of sampling the object anew would take more bytes than its body; of what is rigid, once sampling what a small image says is seen of all objects of its mesh would, twice;
//! - **how finely**: bones' maps, and how many moments of them, to a tenth of a pixel of a figure that fills a view (`clip.rs`).
//!
//! Who was sent a body keeps it. Bodies depend on the scene alone, so each is made once, for all clients. What is rigid goes on hiding what lies behind it
//! from the views of the server, and is itself never lacking there.

mod atlas;
mod build;
mod clip;
mod decide;
mod made;
mod serve;
mod store;

pub use build::build;
pub use decide::{Eye, PROBE_PX};
pub use made::{Made, Unfit};
pub use serve::{KeptBodies, Sent, serve};
pub use store::Bodies;
