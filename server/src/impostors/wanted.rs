//! An impostor that a client should hold, and all of them together: plain values.

use camera::Camera;
use glam::DVec3;
use protocol::Purpose;

use crate::render::Faces;

/// Which objects an impostor shows.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Drawn {
    /// One.
    Only(u16),
    /// All others; ids ascend.
    AllBut(Vec<u16>),
}

impl Drawn {
    /// Whether an object is drawn.
    pub fn contains(&self, object: u16) -> bool {
        match self {
            Drawn::Only(only) => *only == object,
            Drawn::AllBut(others) => others.binary_search(&object).is_err(),
        }
    }
}

/// A picture of some objects.
#[derive(Debug, Clone, Copy)]
pub struct Shot<'a> {
    /// Takes it.
    pub camera: &'a Camera,
    /// What it shows.
    pub drawn: &'a Drawn,
    /// Of these, which sides.
    pub faces: Faces,
    /// Whether a single object has its tint.
    pub is_tinted: bool,
}

/// Names an impostor of a client; a newer image takes the place of the older one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Key {
    /// The reflector that needs it.
    pub reflector: u16,
    /// The object that it shows; `None` for the surroundings.
    pub shown: Option<u16>,
    /// Number among the images of the same.
    pub part: u8,
}

/// What an impostor was taken from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Basis {
    /// The eye relative to the middle of the one object shown, in metres, along the object's axes: the same as long as they move
    /// together.
    Object(DVec3),
    /// The eye, and how far it may move before the image shows what is around from too far beside.
    Place {
        /// In world space.
        eye_world: DVec3,
        /// Metres.
        reach_m: f64,
    },
}

/// An impostor that a client should hold.
#[derive(Debug, Clone, PartialEq)]
pub struct Wanted {
    /// Its name.
    pub key: Key,
    /// What it is for, for the client.
    pub purpose: Purpose,
    /// Takes it.
    pub camera: Camera,
    /// What it shows.
    pub drawn: Drawn,
    /// Of these, which sides.
    pub faces: Faces,
    /// What it was taken from, to tell when it has to be taken anew.
    pub basis: Basis,
    /// The scene time of what changes in it by itself; `None` where nothing does.
    pub changes_at_s: Option<f64>,
}

impl Wanted {
    /// The picture of it.
    pub fn shot(&self) -> Shot<'_> {
        Shot { camera: &self.camera, drawn: &self.drawn, faces: self.faces, is_tinted: true }
    }
}

/// What is to be held, and why.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Decision {
    /// The impostors.
    pub wanted: Vec<Wanted>,
    /// A sentence for each reflector, or one that there is none.
    pub reasons: Vec<String>,
}
