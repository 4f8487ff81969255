//! The topics, one file each.

use crate::topic::Topic;

/// Every topic, in the order in which the command lists them.
pub const ALL: &[&dyn Topic] = &[];
