//! The impostors that a client holds: depth images with colours, on the GPU, that rays are intersected with. Rays of reflections
//! ([`crate::draw::reflect`]) and rays of the eye ([`crate::draw::relief`]) share them; [`Impostors`] follows what is held.
//!
//! An impostor is 42 bytes a pixel where its side is a power of two. Its textures are relative to an anchor in world space at capture, so
//! a moving eye or object changes one small uniform.

mod averages;
mod held;
mod image;
mod placed;

use std::collections::BTreeMap;

use gpu::Gpu;

pub use image::{ImpostorImage, ImpostorKind, UnfitImage};
pub(crate) use placed::{Placed, PlacedCamera};

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
