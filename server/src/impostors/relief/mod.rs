//! Relief: one image of an object serves all objects of its shape, wherever they stand, in colours of their own. A client draws them
//! by rays against it, and gets no other samples of them.
//!
//! Rosen, Popescu, Hayward, Wyman, *Non-pinhole approximations for interactive rendering*, section 6.2. The papers choose what
//! becomes relief by hand, and look at it from above. Here the server decides for each object and viewer:
//!
//! - **which shapes**: a mesh that eight objects and more have, rigid, neither mirror nor glass, whose triangles would not take less,
//!   and of which images hold nearly all that any viewer sees, by rays against them (`judge.rs`);
//! - **which side**: images are taken from both ends of an axis of the mesh. Where one holds all that viewers on its half of space see,
//!   as of a pyramid, they get that alone; otherwise both, as of a box or a ball, of which the nearer surface shows;
//! - **how fine**: as fine as the nearest object that it shows needs for the viewer's output; what is nearer than the finest
//!   image serves is sampled as everything else.
//!
//! Images depend on the shape alone, so they are drawn once a scene, for all clients.

mod judge;
mod kept;
mod key;
pub(super) mod picture;
mod serve;

use std::cmp::Reverse;
use std::collections::btree_map::Entry;
use std::collections::{BTreeMap, BTreeSet};

use camera::{Bounds, Spoc};
use glam::DVec3;
use protocol::{DepthImage, ObjectPose};
use scene::{Scene, Snapshot};

use super::reflector::{shown_by_mesh, shows};
use crate::imager::{Imager, ImagerError};
use crate::portions::BYTES_PER_SAMPLE;
pub use kept::KeptReliefs;
pub use key::{End, Key};
use picture::{DISTANCE_RADII, RING_RADII, SIDE_PX, camera, relief, turned_back};
pub use serve::serve;

/// Fewer objects of a shape are not worth images of it from all sides.
const LEAST_OBJECTS: usize = 8;
/// Shapes that are looked at: those of the most objects.
const MOST_SHAPES: usize = 32;
/// About what an image of the finest takes on the wire, of which an object fills a fifth. A shape whose triangles take less is no relief: they are exact, and serve from everywhere.
const FINEST_BYTES: f64 = 0.2 * SIDE_PX[1] as f64 * SIDE_PX[1] as f64 * BYTES_PER_SAMPLE;
/// An object that is shown so stays it until it is nearer by this factor, so that who walks to and fro is not sent it again and again.
const SLACK: f64 = 1.25;
/// What a viewer should be shown by one image.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Wanted {
    /// The least side of the image, in pixels.
    pub side_px: u32,
    /// The objects; ids ascend.
    pub objects: Vec<u16>,
}

/// An image of a shape.
#[derive(Debug, Clone, PartialEq)]
pub struct Relief {
    /// Without the tint of the object that it was taken of.
    pub image: DepthImage,
    /// That object, where it was.
    pub pose: ObjectPose,
}

/// What of a scene may be shown by reliefs, and the images for it.
#[derive(Debug, Default)]
pub struct Reliefs {
    shapes: BTreeMap<u32, Shape>,
    judged: Judged,
}

/// When a shape is judged, for which a software renderer takes a second.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Judged {
    /// At the first look that it matters to: every run is the same.
    #[default]
    AtOnce,
    /// By [`Reliefs::judge_next`]: no viewer waits for it, and until then its objects are sampled as any others.
    Aside,
}

#[derive(Debug, Default)]
struct Shape {
    /// Ids ascend.
    objects: Vec<u16>,
    /// `None` before anybody was near.
    verdict: Option<judge::Verdict>,
    /// The object that a viewer came near to before there was a verdict.
    asked_for: Option<u16>,
    /// The verdict that it was asked for.
    judging: Option<judge::Judging>,
    images: BTreeMap<(End, u32), Relief>,
}

/// What objects may be shown by otherwise.
#[derive(Clone, Copy)]
pub struct Otherwise<'a> {
    /// Objects that are shown so, or not at all.
    pub objects: &'a BTreeSet<u16>,
    /// What the triangles of an object would take, in bytes; `None` where they cannot be sent.
    pub triangle_bytes: &'a dyn Fn(u16) -> Option<f64>,
}

/// Who looks, from where.
#[derive(Debug, Clone, Copy)]
pub struct Eye {
    /// In world space.
    pub eye_world: DVec3,
    /// Of the output.
    pub focal_px: f64,
}

impl Reliefs {
    /// Of a scene.
    pub fn new(scene: &Scene) -> Reliefs {
        let mut shapes: BTreeMap<u32, Shape> = BTreeMap::new();
        let all_show = shows(scene, false);
        for (instance, object) in scene.instances.iter().zip(0_u16..) {
            let mesh = scene.meshes.get(instance.mesh as usize);
            let is_seen_through = mesh.is_some_and(|mesh| scene.is_seen_through(mesh.material as usize));
            if !instance.deforms && shown_by_mesh(scene, &all_show, instance.mesh).is_none() && !is_seen_through {
                let new = || Shape::default();
                shapes.entry(instance.mesh).or_insert_with(new).objects.push(object);
            }
        }
        shapes.retain(|_, shape| shape.objects.len() >= LEAST_OBJECTS);
        let mut by_count: Vec<(u32, Shape)> = shapes.into_iter().collect();
        by_count.sort_by_key(|(_, shape)| Reverse(shape.objects.len()));
        by_count.truncate(MOST_SHAPES);
        Reliefs { shapes: by_count.into_iter().collect(), judged: Judged::default() }
    }

    /// The same, whose shapes are judged at another time.
    pub fn judged(self, judged: Judged) -> Reliefs {
        Reliefs { judged, ..self }
    }

    /// Whether a look asked for a verdict that is still to be given.
    pub fn is_asked(&self) -> bool {
        self.shapes.values().any(|shape| shape.asked_for.is_some())
    }

    /// Goes on by a step in judging a shape that a look asked for; whether there was one.
    pub fn judge_next(
        &mut self,
        (scene, snapshot): (&Scene, &Snapshot),
        imager: &mut dyn Imager,
    ) -> Result<bool, ImagerError> {
        let asked = self.shapes.values_mut().find_map(|shape| Some((shape.asked_for?, shape)));
        let Some((object, shape)) = asked else { return Ok(false) };
        match &mut shape.judging {
            None => shape.judging = Some(judge::Judging::begin(scene, snapshot, object, imager)?),
            Some(judging) => {
                if let Some(verdict) = judging.step(scene, snapshot, imager)? {
                    (shape.verdict, shape.judging, shape.asked_for) = (Some(verdict), None, None);
                }
            }
        }
        Ok(true)
    }

    /// Whether there is nothing to decide.
    pub fn is_nothing(&self) -> bool {
        self.shapes.is_empty()
    }

    /// How many shapes were judged. What a viewer should be shown changes with it.
    pub fn judged_shapes(&self) -> usize {
        self.shapes.values().filter(|shape| shape.verdict.is_some()).count()
    }

    /// What a viewer should be shown by which images; `shown` says what it is shown by now. A shape that comes into reach for the first
    /// time is judged, or asked for, and what was found is said in the log; one a call, for it takes a software renderer a second.
    pub fn wanted(
        &mut self,
        (scene, snapshot): (&Scene, &Snapshot),
        eye: Eye,
        (shown, otherwise): (&BTreeMap<u16, Vec<End>>, Otherwise<'_>),
        imager: &mut dyn Imager,
    ) -> Result<BTreeMap<Key, Wanted>, ImagerError> {
        let mut wanted: BTreeMap<Key, Wanted> = BTreeMap::new();
        let mut has_judged = false;
        for (&mesh, shape) in &mut self.shapes {
            for &object in shape.objects.iter().filter(|object| !otherwise.objects.contains(object)) {
                let now = shown.get(&object);
                let Some(bounds) = scene.bounds_of(snapshot, object) else { continue };
                let Some(side_px) = side_px(&bounds, eye, if now.is_some() { SLACK } else { 1.0 }) else { continue };
                let verdict = match &shape.verdict {
                    Some(verdict) => verdict,
                    None if (otherwise.triangle_bytes)(object).is_some_and(|bytes| bytes <= FINEST_BYTES) => {
                        shape.verdict.insert(judge::Verdict::NONE)
                    }
                    None if has_judged => continue,
                    None if self.judged == Judged::Aside => {
                        shape.asked_for.get_or_insert(object);
                        continue;
                    }
                    None => {
                        has_judged = true;
                        shape.verdict.insert(judge::judge(scene, snapshot, object, imager)?)
                    }
                };
                let world_from_object = &snapshot.world_from_mesh[usize::from(object)];
                let to_eye = turned_back(world_from_object, eye.eye_world - bounds.middle());
                for end in verdict.ends_for(to_eye, now.map_or(&[], Vec::as_slice)) {
                    let new = || Wanted { side_px: 0, objects: Vec::new() };
                    let of_key = wanted.entry(Key { mesh, end }).or_insert_with(new);
                    of_key.side_px = of_key.side_px.max(side_px);
                    of_key.objects.push(object);
                }
            }
        }
        Ok(wanted)
    }

    /// An image of a shape that was judged.
    pub fn image(
        &mut self,
        key: Key,
        side_px: u32,
        (scene, snapshot): (&Scene, &Snapshot),
        imager: &mut dyn Imager,
    ) -> Result<Option<&Relief>, ImagerError> {
        let Some(shape) = self.shapes.get_mut(&key.mesh) else { return Ok(None) };
        let (Some(verdict), Some(&object)) = (&shape.verdict, shape.objects.first()) else { return Ok(None) };
        Ok(Some(match shape.images.entry((key.end, side_px)) {
            Entry::Occupied(image) => image.into_mut(),
            Entry::Vacant(place) => {
                let axis = verdict.axis * key.end.sign();
                let Some(camera) = camera(scene, snapshot, object, axis, side_px) else { return Ok(None) };
                let Some(image) = relief(imager, snapshot, object, &camera)? else { return Ok(None) };
                let world_from_object = snapshot.world_from_mesh[usize::from(object)];
                place.insert(Relief { image, pose: ObjectPose { object, world_from_object } })
            }
        }))
    }
}

/// How large an image has to be for an object whose bounds these are; `None` where none is fine enough.
///
/// A pixel of it at the depth of the object's middle is to be no wider than one of the output on the object's near side.
fn side_px(bounds: &Bounds, eye: Eye, slack: f64) -> Option<u32> {
    let radius_m = bounds.min.distance(bounds.max) / 2.0;
    let output_px_m = (bounds.middle().distance(eye.eye_world) - radius_m) / eye.focal_px;
    let [least, most] = SIDE_PX;
    // Width and focal length of an image grow together, see `Spoc::around`.
    let focal_px = Spoc::around(
        bounds,
        bounds.middle() + DVec3::Y * DISTANCE_RADII * radius_m,
        (most, most),
        RING_RADII * radius_m,
    )?
    .pinhole
    .focal_px;
    let need_px = f64::from(most) * DISTANCE_RADII * radius_m / focal_px / output_px_m;
    let fits = output_px_m > 0.0 && need_px <= f64::from(most) * slack;
    fits.then(|| (need_px.ceil() as u32).clamp(least, most).next_power_of_two().min(most))
}
