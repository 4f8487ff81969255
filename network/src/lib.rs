//! The emulated network: what a path does to bytes, as a deterministic model for virtual time and as a TCP proxy on loopback
//! for the wall clock.
//!
//! - [`Link`]: round trip, jitter, bandwidth and stalls, as `rtt=40,jitter=20,mbit=20,stall=300@5000` says.
//! - [`LinkModel`]: one direction of a link, without I/O: when do bytes that leave now arrive? Seeded, so that a run repeats.
//! - `Proxy` (not on wasm32): forwards TCP connections, each through two such models.

mod fade;
mod link;
mod model;
#[cfg(not(target_arch = "wasm32"))]
mod proxy;
mod random;

pub use link::{Blackout, Fading, Link, LinkError, Stall};
pub use model::LinkModel;
#[cfg(not(target_arch = "wasm32"))]
pub use proxy::Proxy;
