//! The topics, one file or folder each.

pub mod reconstruction;
pub mod timing;

use crate::topic::Topic;

/// Every topic, in the order in which the command lists them.
pub const ALL: &[&dyn Topic] = &[&reconstruction::Reconstruction, &timing::Timing];
