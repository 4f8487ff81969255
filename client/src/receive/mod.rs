//! From the socket to what is held.
//!
//! - [`viewer`]: everything between the socket and the picture, without either. [`follow`]: what follows the held copy.
//! - [`connection`]: when to connect, when to try again, and what to tell the person meanwhile.
//! - [`moment`]: what of the scene is shown at once.
//! - [`stats`]: figures about the last second.
//! - [`history`]: the last minute of them. [`address`]: a server's address as people type it.
//! - Natively: `socket`, the websocket, and `pump`, its loop; `traffic`, what crosses it; `trust`, which servers are believed.

pub mod address;
pub mod connection;
pub mod follow;
pub mod history;
pub mod moment;
#[cfg(not(target_arch = "wasm32"))]
pub mod pump;
#[cfg(not(target_arch = "wasm32"))]
pub mod socket;
pub mod stats;
#[cfg(not(target_arch = "wasm32"))]
pub mod traffic;
#[cfg(not(target_arch = "wasm32"))]
pub mod trust;
pub mod viewer;
