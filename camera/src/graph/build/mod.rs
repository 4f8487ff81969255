//! Graph cameras for common scenes.

mod around;
mod corridors;
mod floor;
mod split;

pub use corridors::{CorridorMap, CorridorMapError, Heading};
pub use floor::{FloorGrid, Storey};
pub use split::split_behind;
