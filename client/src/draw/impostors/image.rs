//! A depth image with colours, as rays meet it.

use camera::Camera;
use glam::DAffine3;
use impostor::{ImpostorError, Sample};
use thiserror::Error;

/// What an impostor shows, and so which rays look at it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ImpostorKind {
    /// One object: reflected rays that do not leave this object.
    Object(u16),
    /// Everything around: all reflected rays but those in glass.
    Environment,
    /// The back faces of a glass object, as seen from outside: the rays in this object.
    Inside(u16),
    /// One object: rays of the eye to objects of its shape, this one or others.
    Relief(u16),
}

/// A depth image with colours, as rays meet it.
#[derive(Debug, Clone)]
pub struct ImpostorImage {
    /// What it shows.
    pub kind: ImpostorKind,
    /// What took it, where it was at capture.
    pub camera: Camera,
    /// One for each pixel, row by row.
    pub samples: Vec<Sample>,
    /// One for each pixel: base colour as sRGB bytes, and the material's code.
    pub colour: Vec<[u8; 4]>,
    /// The object that the impostor moves with, and `world_from_object` at capture; `None` of what stands still.
    pub pose: Option<(u16, DAffine3)>,
}

/// Why an image is no impostor. All are faults of who made it.
#[derive(Debug, Error, Clone, Copy, PartialEq, Eq)]
pub enum UnfitImage {
    /// Samples and camera do not fit.
    #[error(transparent)]
    Impostor(#[from] ImpostorError),
    /// Not one colour for each pixel.
    #[error("{colours} colours for {samples} samples")]
    Colours {
        /// How many there are.
        colours: usize,
        /// How many there should be.
        samples: usize,
    },
    /// A texture of it would be larger than the GPU takes.
    #[error("an impostor needs textures {need_px} texels wide, and the GPU has {limit_px}")]
    TooLarge {
        /// The longest side.
        need_px: u32,
        /// The device's limit.
        limit_px: u32,
    },
    /// With it, impostors would have more pixels together than a client holds.
    #[error("impostors of {pixels} pixels are more than are held")]
    TooMany {
        /// How many there would be.
        pixels: u64,
    },
    /// A frustum of its graph camera has more planes than a shader reads.
    #[error("a frustum of the impostor's camera has too many planes")]
    Planes,
}
