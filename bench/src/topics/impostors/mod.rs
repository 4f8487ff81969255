//! Topic `impostors`.

pub mod occlusion;
