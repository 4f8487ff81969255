//! How it is found out which points of a light are seen.

use std::fmt;

/// See the module.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Method {
    /// A shadow map from each (2016 paper, Alg. 5).
    Maps,
    /// The same maps from parallelograms, by compute shaders; [`Method::Maps`] where there are none, of lamps amid what they light, and where one
    /// patch has more samples than a buffer may hold (2.8 million on the least of devices).
    #[default]
    Warp,
    /// Rays through the images of the light's corners; [`Method::Maps`] of lamps amid what they light.
    March,
}

impl fmt::Display for Method {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Method::Maps => "maps",
            Method::Warp => "warp",
            Method::March => "march",
        })
    }
}
