//! What the client holds: patches of samples, and the edits that change them.
//!
//! A sample's address is `(patch, x, y)`. The server keeps the same copy as the client; both fold every edit into a running
//! digest over integers, and compare it at edit numbers that the client has acknowledged.

mod apply;
mod digest;
pub(crate) mod shift;
mod whole;

use std::collections::BTreeMap;
use std::sync::Arc;

use glam::{DAffine3, Vec3};
use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::body::Body;
use crate::image::DepthImage;
use crate::look::{Lighting, Material};
use crate::sky::Sky;
pub use shift::{ObjectShift, Steps};

/// Names a patch until everything is forgotten. Ids ascend from one added patch to the next, so none is used twice.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct PatchId(pub u32);

/// What a patch is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub enum Purpose {
    /// Seen from the viewer's region.
    Eye,
    /// Seen from light number `.0` of [`Lighting::lights`]: what casts its shadows. A light that has such patches, but none with a
    /// sample, casts nothing.
    Light(u16),
    /// An impostor of object `.0`.
    Impostor(u16),
    /// An impostor of the surroundings.
    Environment,
    /// A relief, taken of object `.0`: objects of the same shape are drawn by rays against it, see [`Edit::Place`].
    Relief(u16),
    /// The back faces of glass object `.0`, where rays leave it.
    Inside(u16),
    /// Rows of the own view of a viewer who stands still: at the eye, and at the pixels of the output. From that very camera it shows in place
    /// of all else, pixels without a sample too; from any other it shows nothing.
    Rest,
    /// The image of the camera that the client asked for by its name: shown as it is, in place of all else.
    Camera,
    /// What keeps ambient light off what the eye sees, without having been seen by it: it is neither shown nor reflected, and casts no shadow.
    Occluders,
    /// What the eye sees through, where it is blended: of layer `.0`, below [`Purpose::LAYERS`]. Samples say how much they hide ([`DepthImage::share`](crate::DepthImage::share)).
    /// Each layer is drawn by itself, from its front alone, and blended with what lies behind it.
    Layer(u8),
    /// The colours and materials of a [`Body`], by texture coordinates: u to the right, v down. Pixels without a sample are cut out, or nothing shows them. Depth,
    /// normals and objects say nothing.
    Body,
}

impl Purpose {
    /// How many layers there may be: of two groups of objects their front faces and their back faces.
    pub const LAYERS: u8 = 4;

    /// Whether it is drawn as a surface, from anywhere.
    pub fn is_surface(self) -> bool {
        matches!(self, Purpose::Eye | Purpose::Light(_) | Purpose::Occluders | Purpose::Layer(_))
    }

    /// Whether it is a surface that an eye sees from anywhere.
    pub fn is_for_eyes(self) -> bool {
        matches!(self, Purpose::Eye | Purpose::Layer(_))
    }
}

/// Where an object was when a patch captured it, or is now. Objects that never move are left out everywhere.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ObjectPose {
    /// The object.
    pub object: u16,
    /// f64, as the scene composes it.
    pub world_from_object: DAffine3,
}

/// A step that a rigid object goes.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Step {
    /// How far its origin goes, in metres in world space.
    pub way_world: Vec3,
    /// How it turns about its origin: axis times angle in world space.
    pub turn_world: Vec3,
}

/// What a rigid object does next.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ObjectSteps {
    /// The object.
    pub object: u16,
    /// From where an update puts it, and on from there.
    pub steps: [Step; 3],
}

/// The steps that rigid objects go next, as far as the scene's own motion is known ahead. What is not named goes on as it went, or stands.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct NextSteps {
    /// How long each step takes, in seconds of scene time; positive where there are any.
    pub step_s: f32,
    /// Ids ascend.
    pub objects: Vec<ObjectSteps>,
}

/// An object that is drawn by rays against reliefs or as a body, instead of from samples of its own.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Instance {
    /// Where the object is, as long as no [`Edit::Move`] says otherwise; the relief's own object has its pose at capture in
    /// [`Patch::objects`].
    pub pose: ObjectPose,
    /// What its colours are multiplied by: linear RGB, 255 for all of it.
    pub tint: [u8; 3],
}

/// One depth image, or the residual part of one, with what is needed to place it.
#[derive(Debug, Clone, PartialEq)]
pub struct Patch {
    /// Its name.
    pub id: PatchId,
    /// What it is for.
    pub purpose: Purpose,
    /// Scene time of the capture, in seconds.
    pub capture_time_s: f64,
    /// The moving rigid objects in it, at capture, and in a relief the one that it was taken of; ids ascend.
    pub objects: Vec<ObjectPose>,
    /// The samples.
    pub image: DepthImage,
}

/// One change of what the client holds.
#[derive(Debug, Clone, PartialEq)]
pub enum Edit {
    /// Forgets everything: patches, poses, tables and the digest. Only as the first edit of an update, whose number may then
    /// be any; the other edits of that update bring the new picture, so the old one stays on screen until it is there.
    Clear,
    /// Holds a new patch.
    Add(Box<Patch>),
    /// Forgets a patch; objects that only a forgotten relief shows are not shown.
    Remove(PatchId),
    /// Forgets single samples of a patch; addresses `(x, y)` of held samples, ascending row by row. A patch without samples
    /// stays until it is removed.
    Delete(PatchId, Vec<(u16, u16)>),
    /// Sets the extent of single samples to `2^-n` of their pixel, `n` at most [`Edit::MAX_TRIM`]; false cover shrinks with
    /// it. Addresses `(x, y)` ascend row by row.
    Trim(PatchId, Vec<(u16, u16, u8)>),
    /// Moves rigid objects to where they are now; ids ascend.
    Move(Vec<ObjectPose>),
    /// The same of objects whose poses are known, by how far they went; ids ascend.
    Shift(Vec<ObjectShift>),
    /// Gives a held patch of [`Purpose::Body`] its triangles, once.
    Body(PatchId, Arc<Body>),
    /// Shows objects by a held relief or body from now on, beside others: of several the nearest surface shows. Ids ascend.
    Place(PatchId, Vec<Instance>),
    /// Shows objects by no relief and no body any more.
    Withdraw(Vec<u16>),
    /// Replaces the material table.
    Materials(Vec<Material>),
    /// Replaces the lights.
    Light(Box<Lighting>),
    /// Replaces the light from far around.
    Sky(Arc<Sky>),
    /// Turns these bits of the digest over: what is held came to be by other edits at the sender, see [`Held::whole`].
    Join(u64),
}

impl Edit {
    /// The smallest extent is `2^-4` of a pixel.
    pub const MAX_TRIM: u8 = 4;
}

/// The edits that one server tick makes; applied as a whole or not at all.
#[derive(Debug, Clone, PartialEq)]
pub struct Update {
    /// Counts from 1 without gaps; an update that begins with [`Edit::Clear`] may have any number.
    pub number: u64,
    /// Scene time that the held copy shows afterwards.
    pub scene_time_s: f64,
    /// The newest pose that the server had heard when it made this, 0 before any; closes the round trip.
    pub pose_seq: u64,
    /// In order.
    pub edits: Vec<Edit>,
    /// Where rigid objects go from there. Nothing of the copy: it tells what to show until the next update.
    pub next: NextSteps,
    /// Digest of the held copy afterwards, see [`Held::digest`].
    pub digest: u64,
}

/// The edits of an update in the making, see [`Held::edit`].
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Draft {
    edits: Vec<Edit>,
}

impl Draft {
    /// The edits so far, in order.
    pub fn edits(&self) -> &[Edit] {
        &self.edits
    }
}

/// A held patch with what edits did to its samples since.
#[derive(Debug, Clone, PartialEq)]
pub struct HeldPatch {
    /// As it was added, less the deleted samples.
    pub patch: Patch,
    /// Extent codes (see [`Edit::Trim`]) of the samples, in the order of the planes; empty where none was trimmed.
    pub trims: Vec<u8>,
}

/// An [`Instance`] as it is held.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HeldInstance {
    /// See [`Instance::pose`].
    pub world_from_object: DAffine3,
    /// See [`Instance::tint`].
    pub tint: [u8; 3],
}

/// The copy of the client, as both ends keep it.
#[derive(Debug, Clone, Default)]
pub struct Held {
    /// By id.
    pub patches: BTreeMap<PatchId, HeldPatch>,
    /// Where the moving rigid objects are now.
    pub poses_now: BTreeMap<u16, DAffine3>,
    /// The triangles of patches of [`Purpose::Body`].
    pub bodies: BTreeMap<PatchId, Arc<Body>>,
    /// The objects that are shown by reliefs and bodies, and which: patches of [`Purpose::Relief`] and [`Purpose::Body`], which may be forgotten by now.
    pub instances: BTreeMap<(u16, PatchId), HeldInstance>,
    /// Indexed by the samples.
    pub materials: Vec<Material>,
    /// `None` before the first update.
    pub lighting: Option<Lighting>,
    /// `None` until one is sent, which a plain look does without.
    pub sky: Option<Arc<Sky>>,
    /// Number of the last update applied, 0 before any.
    pub number: u64,
    /// Scene time shown.
    pub scene_time_s: f64,
    /// `None` before the first update.
    digest: Option<u64>,
    /// The newest patch ever added.
    last_patch: Option<PatchId>,
    /// Samples and mask pixels of all patches.
    samples: usize,
    pixels: usize,
}

/// Why an update was refused; nothing of it was applied. The sender is at fault, or the copy went wrong before.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum HeldError {
    /// An update is missing, or came twice.
    #[error("update {update} does not follow update {held}")]
    Number {
        /// The last one applied.
        held: u64,
        /// The refused one.
        update: u64,
    },
    /// The copies of both ends differ.
    #[error("the digest after update {number} differs from the sender's")]
    Digest {
        /// The refused update.
        number: u64,
    },
    /// A sky lacks texels, or has some that are infinite or not a number.
    #[error("the sky is not whole")]
    SkyNotWhole,
    /// Ids ascend and are never used again.
    #[error("patch id {0:?} was used before")]
    PatchIdUsed(PatchId),
    /// An edit of a patch that is not held.
    #[error("{0:?} is not held")]
    UnknownPatch(PatchId),
    /// An address where nothing is held.
    #[error("{patch:?} holds no sample at ({x}, {y})")]
    NoSample {
        /// The patch.
        patch: PatchId,
        /// Column.
        x: u16,
        /// Row.
        y: u16,
    },
    /// Addresses are out of order or come twice.
    #[error("addresses of {0:?} do not ascend")]
    NotAscending(PatchId),
    /// Object ids are out of order or come twice.
    #[error("object ids do not ascend")]
    ObjectsNotAscending,
    /// An extent code above [`Edit::MAX_TRIM`].
    #[error("{patch:?} trims to 2^-{extent}")]
    TrimTooFar {
        /// The patch.
        patch: PatchId,
        /// The code.
        extent: u8,
    },
    /// Planes, mask and camera of a patch do not have one size.
    #[error("planes, mask and camera of {0:?} differ in size")]
    PlanesDiffer(PatchId),
    /// Surfaces are made of pinhole images only, and a graph camera has no more than
    /// [`crate::wire::GRAPH_MAX_FRUSTA`] frusta.
    #[error("{0:?} has a camera that does not fit its purpose")]
    CameraUnfit(PatchId),
    /// An object is to be shown by a patch that is none.
    #[error("{0:?} is no relief and no body")]
    NoRelief(PatchId),
    /// Triangles for a patch that has some, or is no body's.
    #[error("{0:?} takes no triangles")]
    NoBody(PatchId),
    /// Triangles whose parts do not fit each other, or with numbers that are none.
    #[error("the body of {0:?} is not whole")]
    BodyNotWhole(PatchId),
    /// An object is to be withdrawn that no relief shows.
    #[error("object {0} is shown by no relief and no body")]
    NoInstance(u16),
    /// Of an object that goes on from a pose that nobody told.
    #[error("object {0} has no pose to go on from")]
    UnknownPose(u16),
    /// A number that is infinite, not a number, or out of its range.
    #[error("{0} is not finite or out of range")]
    NotFinite(&'static str),
    /// Past one of the [`crate::Limits`].
    #[error("more {0} than allowed")]
    TooMuch(&'static str),
    /// [`Edit::Clear`] anywhere but first.
    #[error("an update clears after its first edit")]
    LateClear,
}
