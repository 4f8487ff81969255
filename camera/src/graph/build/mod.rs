//! Graph cameras for common scenes.

mod corridors;
mod split;

pub use corridors::{CorridorMap, CorridorMapError, Heading};
pub use split::split_behind;
