//! Names of the images of a scene's shapes.

/// One of the two images of a shape.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Key {
    /// The shape: its mesh.
    pub mesh: u32,
    /// Which end of the shape's axis it is taken from.
    pub end: End,
}

/// An end of an axis of a shape.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum End {
    /// Where the axis points.
    Upper,
    /// The other one.
    Lower,
}

impl End {
    pub(super) const BOTH: [End; 2] = [End::Upper, End::Lower];

    pub(super) fn sign(self) -> f64 {
        match self {
            End::Upper => 1.0,
            End::Lower => -1.0,
        }
    }
}
