//! What a frame shows.

use camera::Pinhole;
use protocol::Held;
use surface::HeldSurfaces;

use crate::draw::bodies::Bodies;
use crate::draw::impostors::Impostors;
use crate::draw::layers::Layers;
use crate::draw::light_images::LightImages;
use crate::draw::rest::{RestView, RowsOf};

/// What a frame shows.
#[derive(Debug, Clone, Copy)]
pub struct Shown<'a> {
    /// What is held, as surfaces, and where its objects are.
    pub surfaces: &'a HeldSurfaces,
    /// Its materials and lights, and which objects reliefs show.
    pub held: &'a Held,
    /// What mirrors and glass show, and what objects are drawn by; without, mirrors and glass are plain surfaces, and objects
    /// that reliefs show are missing.
    pub impostors: Option<&'a Impostors>,
    /// What is held as its triangles; without, it is missing.
    pub bodies: Option<&'a Bodies>,
    /// What lights see; without, everything held casts their shadows.
    pub lights: Option<&'a LightImages>,
    /// What occludes, beside all that is held as surfaces.
    pub occluders: Option<&'a HeldSurfaces>,
    /// What is blended with it.
    pub layers: Option<&'a Layers>,
    /// What is shown in place of all else as long as the camera is that of a viewer at rest.
    pub rest: Option<&'a RestView>,
}

impl<'a> Shown<'a> {
    /// Whether anything is blended.
    pub(crate) fn is_seen_through(&self) -> bool {
        self.layers.is_some_and(|layers| layers.surfaces().len() > 0)
    }

    /// What is there of a camera's view at rest.
    pub(crate) fn rows_of(&self, camera: &Pinhole) -> RowsOf<'a> {
        self.rest.map(|rest| rest.rows_of(camera)).unwrap_or_default()
    }
}

impl<'a> From<(&'a HeldSurfaces, &'a Held)> for Shown<'a> {
    fn from((surfaces, held): (&'a HeldSurfaces, &'a Held)) -> Shown<'a> {
        Shown { surfaces, held, impostors: None, bodies: None, lights: None, occluders: None, layers: None, rest: None }
    }
}
