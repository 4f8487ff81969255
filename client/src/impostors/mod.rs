//! The impostors that a client holds: depth images with colours, on the GPU, that rays are intersected with. Rays of reflections
//! ([`crate::reflect`]) and rays of the eye ([`crate::relief`]) share them; [`Impostors`] follows what is held.
//!
//! An impostor is 42 bytes a pixel where its side is a power of two. Its textures are relative to an anchor in world space at capture, so
//! a moving eye or object changes one small uniform.

mod averages;
mod held;
mod placed;

use std::collections::BTreeMap;

use camera::Camera;
use glam::DAffine3;
use gpu::Gpu;
use impostor::{ImpostorError, Sample};
use thiserror::Error;

pub(crate) use placed::{Placed, PlacedCamera};

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

/// The impostors that rays of a picture are intersected with, by the ids of their patches.
#[derive(Debug)]
pub struct Impostors {
    gpu: Gpu,
    placed: BTreeMap<u32, Placed>,
}

impl Impostors {
    /// None yet.
    pub fn new(gpu: &Gpu) -> Impostors {
        Impostors { gpu: gpu.clone(), placed: BTreeMap::new() }
    }

    /// Puts one up, in place of what was there by this id. An image without any sample leaves nothing there.
    ///
    /// # Errors
    /// Where the image is none; then what was there by this id stays.
    pub fn insert(&mut self, id: u32, image: &ImpostorImage) -> Result<(), UnfitImage> {
        match Placed::new(&self.gpu, image)? {
            Some(placed) => self.placed.insert(id, placed),
            None => self.placed.remove(&id),
        };
        Ok(())
    }

    /// Takes one away, if it is there.
    pub fn remove(&mut self, id: u32) {
        self.placed.remove(&id);
    }

    /// Takes all away.
    pub fn clear(&mut self) {
        self.placed.clear();
    }

    /// Pixels of all of them.
    pub(crate) fn pixels(&self) -> u64 {
        self.placed.values().map(|placed| placed.pixels).sum()
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.placed.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.placed.is_empty()
    }

    /// Those that rays off mirrors and in glass look at.
    pub(crate) fn reflected(&self) -> impl Iterator<Item = &Placed> {
        self.placed.values().filter(|placed| !matches!(placed.kind, ImpostorKind::Relief(_)))
    }

    /// One that rays of the eye look at, if it is there.
    pub(crate) fn relief(&self, id: u32) -> Option<&Placed> {
        self.placed.get(&id).filter(|placed| matches!(placed.kind, ImpostorKind::Relief(_)))
    }
}
