//! Sends a client the bodies that it should hold.

use std::collections::{BTreeMap, BTreeSet};

use glam::DAffine3;
use protocol::{Body, Held, Instance, Limits, ObjectPose, PatchId};
use scene::{Scene, Snapshot};

use super::decide::{Eye, Question, Wanted};
use super::made::Made;
use super::store::Bodies;
use crate::account::{Account, Surroundings};
use crate::discretize::Capture;
use crate::stage_error::StageError;

/// The bodies that a client was sent, by the first object of their shape.
#[derive(Debug, Clone, Default)]
pub struct KeptBodies(BTreeMap<u16, PatchId>);

impl KeptBodies {
    /// The objects of which a body is held, shown by it or not.
    pub fn objects(&self, bodies: &Bodies) -> BTreeSet<u16> {
        let held = bodies.shapes.iter().filter(|shape| self.0.contains_key(&shape.objects[0]));
        held.flat_map(|shape| &shape.objects).copied().collect()
    }
}

/// What a look sent of bodies.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sent {
    /// What they take, in bytes.
    pub bytes: f64,
    /// Whether those are all that the client is better sent so, as things are.
    pub are_all: bool,
}

impl Sent {
    /// Nothing was to be sent.
    pub const NOTHING: Sent = Sent { bytes: 0.0, are_all: true };
}

/// Sends a client bodies of objects that it is better sent so and that are not hidden, as many as an update may bring. `probe` draws what is seen, in a small image, where that must be known.
pub fn serve(
    bodies: &Bodies,
    (scene, snapshot): (&Scene, &Snapshot),
    (codes, hidden): (&[Option<u8>], &BTreeSet<u16>),
    eye: &Eye,
    now: &Surroundings<'_>,
    (account, kept): (&mut Account, &mut KeptBodies),
    probe: impl FnOnce() -> Result<Option<Capture>, StageError>,
) -> Result<Sent, StageError> {
    kept.0.retain(|_, id| account.held().bodies.contains_key(id));
    // Many of one shape may be shown by one relief for all.
    let shown: BTreeSet<u16> = account.shown_otherwise().union(hidden).copied().collect();
    let question = Question { scene, snapshot, codes, eye, shown: &shown, held: &kept.0.clone() };
    let probed = if question.needs_probe(bodies) { probe()? } else { None };
    let seen_px = probed.map_or(BTreeMap::new(), |probe| eye.seen_px(&probe));
    let (mut placed, mut sent) = (Vec::new(), Sent::NOTHING);
    for Wanted { shape, objects, .. } in question.wanted(bodies, &seen_px) {
        let Some(made) = shape.made(scene, codes) else { continue };
        let id = match kept.0.get(&shape.objects[0]) {
            Some(id) => *id,
            None if !has_room(account.held(), made) => continue,
            None if eye.is_too_slow_for(made.bytes as f64) => continue,
            None if !eye.takes(made.bytes as f64, sent.bytes) => {
                sent.are_all = false;
                continue;
            }
            None => {
                sent.bytes += made.bytes as f64;
                account.add_body(made.atlas.clone(), made.body.clone(), now)?
            }
        };
        kept.0.insert(shape.objects[0], id);
        let instance = |object: u16| {
            let own = snapshot.world_from_mesh[usize::from(object)];
            let world_from_object = made.origin_world.map_or(own, DAffine3::from_translation);
            let tint = scene.instances[usize::from(object)].tint;
            Instance { pose: ObjectPose { object, world_from_object }, tint }
        };
        placed.push((id, objects.into_iter().map(instance).collect()));
    }
    account.place(placed)?;
    Ok(sent)
}

/// Whether a client takes another body beside those that it holds.
fn has_room(held: &Held, made: &Made) -> bool {
    let Limits { body_vertices, body_indices, body_clip_numbers, .. } = Limits::default();
    let numbers = |body: &Body| {
        let of_clip = body.skin.as_ref().map_or(0, |skin| skin.clip.codes.len());
        [body.positions.len(), body.indices.len(), of_clip]
    };
    let pixels = |(width_px, height_px): (u32, u32)| u64::from(width_px) * u64::from(height_px);
    let all = held.bodies.values().map(|body| numbers(body)).chain([numbers(&made.body)]);
    let sums = all.fold([0; 3], |sums, of_one| std::array::from_fn(|which| sums[which] + of_one[which]));
    let images = held.bodies.keys().filter_map(|id| Some(held.patches.get(id)?.patch.image.mask.size_px()));
    let images_px: u64 = images.chain([made.atlas.mask.size_px()]).map(pixels).sum();
    let fits = sums.iter().zip([body_vertices, body_indices, body_clip_numbers]).all(|(&sum, most)| sum <= most);
    fits && images_px <= Body::MOST_PIXELS
}
