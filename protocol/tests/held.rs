//! The held copy: applied as a whole or not at all, the same at both ends.

#![allow(clippy::unwrap_used, reason = "a test that unwraps fails, as it should")]

mod common;

use std::sync::Arc;

use common::{cast, cast_with_mirror, fragments, patch, with_ends};
use glam::{DAffine3, DVec3, Vec3};
use vantage_protocol::body::{Body, Clip, Skin, Wrap};
use vantage_protocol::codec::Coding;
use vantage_protocol::wire::{decode_update, encode_update};
use vantage_protocol::{
    DepthImage, DepthScale, Edit, Held, HeldError, Instance, Limits, Mask, Material, NextSteps, ObjectPose,
    ObjectShift, ObjectSteps, Patch, PatchId, Purpose, Step, Update,
};

fn image() -> DepthImage {
    with_ends(cast_with_mirror((48, 32), fragments))
}

fn add(id: u32) -> Edit {
    Edit::Add(Box::new(patch(id, image())))
}

fn addresses(image: &DepthImage) -> Vec<(u16, u16)> {
    image.mask.occupied().map(|(x, y)| (x as u16, y as u16)).collect()
}

fn moved(object: u16, x_m: f64) -> ObjectPose {
    ObjectPose { object, world_from_object: DAffine3::from_translation(DVec3::new(x_m, 0.0, 0.0)) }
}

/// From where [`moved`] puts an object to where it would put it next.
fn shifted(object: u16, from_m: f64, to_m: f64) -> ObjectShift {
    let [from, to] = [from_m, to_m].map(|x_m| moved(object, x_m).world_from_object);
    ObjectShift::between(object, &from, &to).expect("whole steps")
}

fn relief(id: u32) -> Edit {
    Edit::Add(Box::new(Patch { purpose: Purpose::Relief(3), ..patch(id, image()) }))
}

/// The patch of a body, and a triangle that a bone moves.
fn body(id: u32) -> [Edit; 2] {
    let clip = Clip { period_s: 1.0, bones: 1, linear_step: 0.5, offset_step: 0.1, codes: (0..24).collect() };
    let body = Body {
        positions: vec![[0, 1, 2], [65535, 0, 9], [7, 7, 7]],
        least: [-1.0; 3],
        step: [1e-4; 3],
        normals: vec![[0, 1022]; 3],
        uvs: Vec::new(),
        least_uv: [0.0; 2],
        step_uv: [0.0; 2],
        colours: vec![[1, 2, 3]; 3],
        indices: vec![0, 1, 2],
        double_sided: false,
        cut_out: false,
        wrap: [Wrap::Repeat; 2],
        nearest: false,
        bounds: [[-1.0; 3], [6.0; 3]],
        skin: Some(Skin { bones: vec![[0; 4]; 3], shares: vec![[65535, 0, 0, 0]; 3], clip }),
    };
    let patch = Patch { purpose: Purpose::Body, ..patch(id, image()) };
    [Edit::Add(Box::new(patch)), Edit::Body(PatchId(id), Arc::new(body))]
}

/// The same with something wrong.
fn other_body(id: u32, change: impl Fn(&mut Body)) -> Vec<Edit> {
    let mut edits = body(id);
    if let Edit::Body(_, body) = &mut edits[1] {
        change(Arc::make_mut(body));
    }
    edits.to_vec()
}

fn instance(object: u16) -> Instance {
    Instance { pose: moved(object, f64::from(object)), tint: [255, 128, object as u8] }
}

/// What the client does with what the server made.
fn send(client: &mut Held, update: &Update) {
    let bytes = encode_update(update, Coding::default()).bytes;
    let decoded = decode_update(&bytes, &Limits::default()).unwrap();
    assert!(decoded == *update);
    client.apply(&decoded).unwrap();
}

#[test]
fn both_ends_agree_after_every_kind_of_edit() {
    let (mut server, mut client) = (Held::default(), Held::default());
    let mut latecomers: Vec<Held> = Vec::new();
    let held = addresses(&image());
    let steps = [
        vec![Edit::Materials(vec![Material::default(); 3]), add(1), add(2)],
        vec![Edit::Delete(PatchId(1), held.iter().copied().step_by(2).collect())],
        vec![Edit::Trim(PatchId(1), held.iter().skip(1).step_by(2).map(|&(x, y)| (x, y, 3)).collect())],
        vec![Edit::Move(vec![moved(2, 1.0), moved(7, 2.0)]), Edit::Remove(PatchId(2)), add(5)],
        vec![
            Edit::Shift(vec![shifted(2, 1.0, -0.5)]),
            Edit::Move(vec![moved(8, 0.25)]),
            Edit::Shift(vec![shifted(8, 0.25, 4.0)]),
        ],
        vec![relief(6), Edit::Place(PatchId(6), vec![instance(3), instance(9)])],
        vec![relief(7), Edit::Place(PatchId(7), vec![instance(9)]), Edit::Withdraw(vec![9]), Edit::Remove(PatchId(7))],
        vec![Edit::Remove(PatchId(6))],
        vec![Edit::Withdraw(vec![3])],
        vec![],
        body(8).into_iter().chain([Edit::Place(PatchId(8), vec![instance(4)])]).collect(),
        body(9).into_iter().chain([Edit::Remove(PatchId(8))]).collect(),
        vec![Edit::Clear, add(8)],
    ];
    for (index, edits) in steps.into_iter().enumerate() {
        let update = server.commit(edits, index as f64, 0).unwrap();
        send(&mut client, &update);
        assert_eq!((client.digest(), client.number), (server.digest(), server.number));
        assert!(client.patches == server.patches && client.poses_now == server.poses_now);
        assert!(client.instances == server.instances && client.bodies == server.bodies);
        // Whoever came after one of the steps holds the same after all that follow.
        latecomers.iter_mut().for_each(|latecomer| send(latecomer, &update));
        let mut latecomer = Held::default();
        send(&mut latecomer, &server.whole());
        latecomers.push(latecomer);
        for latecomer in &latecomers {
            assert_eq!((latecomer.digest(), latecomer.number), (server.digest(), server.number));
            assert_eq!(latecomer.sample_count(), server.sample_count());
            assert!(latecomer.patches == server.patches && latecomer.instances == server.instances);
            assert!(latecomer.bodies == server.bodies);
            assert!(latecomer.poses_now == server.poses_now && latecomer.materials == server.materials);
        }
        let counted: usize = client.patches.values().map(|held| held.patch.image.sample_count()).sum();
        assert_eq!(client.sample_count(), counted);
    }
    assert_eq!(client.patches.keys().copied().collect::<Vec<_>>(), [PatchId(8)]);
    assert!(client.materials.is_empty() && client.poses_now.is_empty() && client.instances.is_empty(), "cleared");
}

#[test]
fn an_object_goes_on_from_where_the_edits_before_put_it() {
    let mut held = Held::default();
    let x_m = |held: &Held| held.poses_now[&2].translation.x;
    held.commit(vec![Edit::Move(vec![moved(2, 1.0)])], 0.0, 0).unwrap();
    held.commit(vec![Edit::Shift(vec![shifted(2, 1.0, 4.0)]), Edit::Shift(vec![shifted(2, 4.0, 4.5)])], 1.0, 0)
        .unwrap();
    assert_eq!(x_m(&held), 4.5);
    held.commit(vec![Edit::Move(vec![moved(2, 8.0)]), Edit::Shift(vec![shifted(2, 8.0, 7.0)])], 2.0, 0).unwrap();
    assert_eq!(x_m(&held), 7.0);
    let forgotten = held.commit(vec![Edit::Clear, Edit::Shift(vec![shifted(2, 1.0, 4.0)])], 3.0, 0);
    assert_eq!(forgotten.err(), Some(HeldError::UnknownPose(2)));
    assert_eq!(x_m(&held), 7.0);
}

#[test]
fn a_whole_copy_that_came_out_otherwise_is_refused() {
    let mut server = Held::default();
    server.commit(vec![add(1)], 0.0, 0).unwrap();
    let mut whole = server.whole();
    let Some(Edit::Add(patch)) = whole.edits.iter_mut().find(|edit| matches!(edit, Edit::Add(_))) else {
        panic!("the patch is in it")
    };
    patch.image.depth[3] ^= 1;
    assert_eq!(Held::default().apply(&whole), Err(HeldError::Digest { number: 1 }));
}

#[test]
fn deletes_and_trims_reach_the_named_samples() {
    let mut held = Held::default();
    held.commit(vec![add(1)], 0.0, 0).unwrap();
    let before = image();
    let all = addresses(&before);
    held.commit(vec![Edit::Trim(PatchId(1), vec![(all[5].0, all[5].1, 2)])], 0.0, 0).unwrap();
    held.commit(vec![Edit::Delete(PatchId(1), vec![all[0], all[3]])], 0.0, 0).unwrap();
    let patch = &held.patches[&PatchId(1)];
    let after = &patch.patch.image;
    let expected: Vec<usize> = (0..all.len()).filter(|rank| ![0, 3].contains(rank)).collect();
    assert_eq!(addresses(after), expected.iter().map(|&rank| all[rank]).collect::<Vec<_>>());
    assert_eq!(after.depth, expected.iter().map(|&rank| before.depth[rank]).collect::<Vec<_>>());
    assert_eq!(after.colour, expected.iter().map(|&rank| before.colour[rank]).collect::<Vec<_>>());
    let trims: Vec<u8> = expected.iter().map(|&rank| if rank == 5 { 2 } else { 0 }).collect();
    assert_eq!(patch.trims, trims);
}

#[test]
fn a_refused_update_changes_nothing() {
    let mut held = Held::default();
    held.commit(vec![add(4), Edit::Move(vec![moved(1, 1.0)])], 1.0, 0).unwrap();
    let first = addresses(&image())[0];
    let hole = (0..48).map(|x| (x, 0)).find(|&(x, y)| !image().mask.get(x, y)).unwrap();
    let hole = (hole.0 as u16, hole.1 as u16);
    let mut short = image();
    short.depth.pop();
    let mut broken_camera = image();
    let camera::Camera::Pinhole(pinhole) = &mut broken_camera.camera else { panic!("a pinhole took it") };
    pinhole.focal_px = f64::NAN;
    let mut pushed = image();
    pushed.camera = camera::Camera::Spoc(camera::Spoc {
        pinhole: *image().camera.root(),
        pole_px: glam::DVec2::ZERO,
        push_from_m: 1.0,
        push_to_m: 2.0,
        push_max_px: 1.0,
        ramp_px: 1.0,
    });
    let nan = ObjectPose { object: 1, world_from_object: DAffine3::from_translation(DVec3::NAN) };
    let flat = ObjectPose { object: 1, world_from_object: DAffine3::from_scale(DVec3::new(1.0, 0.0, 1.0)) };
    let flat = Instance { pose: flat, tint: [255; 3] };
    let id = PatchId(4);
    let refused = [
        (vec![add(4)], HeldError::PatchIdUsed(id)),
        (vec![add(3)], HeldError::PatchIdUsed(PatchId(3))),
        (vec![Edit::Remove(PatchId(9))], HeldError::UnknownPatch(PatchId(9))),
        (vec![Edit::Remove(id), Edit::Remove(id)], HeldError::UnknownPatch(id)),
        (vec![Edit::Delete(id, vec![hole])], HeldError::NoSample { patch: id, x: hole.0, y: hole.1 }),
        (vec![Edit::Delete(id, vec![first, first])], HeldError::NotAscending(id)),
        (vec![Edit::Delete(id, vec![(60000, 60000)])], HeldError::NoSample { patch: id, x: 60000, y: 60000 }),
        (vec![Edit::Trim(id, vec![(first.0, first.1, 5)])], HeldError::TrimTooFar { patch: id, extent: 5 }),
        (vec![Edit::Move(vec![moved(2, 0.0), moved(2, 0.0)])], HeldError::ObjectsNotAscending),
        (vec![Edit::Move(vec![nan])], HeldError::NotFinite("object pose")),
        (vec![Edit::Shift(vec![shifted(9, 1.0, 2.0)])], HeldError::UnknownPose(9)),
        (vec![Edit::Shift(vec![shifted(1, 9.0, 2.0); 2])], HeldError::ObjectsNotAscending),
        (vec![Edit::Add(Box::new(patch(5, short)))], HeldError::PlanesDiffer(PatchId(5))),
        (vec![Edit::Add(Box::new(patch(5, broken_camera)))], HeldError::NotFinite("camera")),
        (vec![Edit::Add(Box::new(patch(5, pushed)))], HeldError::CameraUnfit(PatchId(5))),
        (vec![Edit::Place(id, vec![instance(1)])], HeldError::NoRelief(id)),
        (vec![Edit::Place(PatchId(9), vec![instance(1)])], HeldError::UnknownPatch(PatchId(9))),
        (body(5)[1..].to_vec(), HeldError::UnknownPatch(PatchId(5))),
        (vec![add(5), body(5)[1].clone()], HeldError::NoBody(PatchId(5))),
        ([body(5).as_slice(), &body(5)[1..]].concat(), HeldError::NoBody(PatchId(5))),
        (other_body(5, |body| body.indices[2] = 3), HeldError::BodyNotWhole(PatchId(5))),
        (other_body(5, |body| body.normals.truncate(2)), HeldError::BodyNotWhole(PatchId(5))),
        (other_body(5, |body| body.bounds[1][2] = f32::NAN), HeldError::BodyNotWhole(PatchId(5))),
        (other_body(5, |body| body.skin.as_mut().unwrap().bones[1][2] = 1), HeldError::BodyNotWhole(PatchId(5))),
        (other_body(5, |body| body.skin.as_mut().unwrap().clip.period_s = 0.0), HeldError::BodyNotWhole(PatchId(5))),
        (vec![relief(5), Edit::Place(PatchId(5), vec![instance(2), instance(1)])], HeldError::ObjectsNotAscending),
        (vec![relief(5), Edit::Place(PatchId(5), vec![flat])], HeldError::NotFinite("inverse of an instance's pose")),
        (vec![Edit::Withdraw(vec![1])], HeldError::NoInstance(1)),
        (vec![Edit::Materials(vec![Material::default(); 257])], HeldError::TooMuch("materials")),
        (vec![add(5), Edit::Clear], HeldError::LateClear),
    ];
    let before = held.clone();
    for (edits, error) in refused {
        // A sound edit first: it must not stay.
        let sound = matches!(edits.last(), Some(Edit::Clear));
        let edits = if sound { edits } else { [vec![Edit::Move(vec![moved(1, 9.0)])], edits].concat() };
        let update = Update { number: 2, scene_time_s: 2.0, pose_seq: 0, edits, next: NextSteps::default(), digest: 0 };
        assert_eq!(held.apply(&update), Err(error));
        assert!(held.patches == before.patches && held.poses_now == before.poses_now);
        assert_eq!((held.digest(), held.number, held.scene_time_s), (before.digest(), 1, 1.0));
    }
}

#[test]
fn steps_ahead_must_be_sound_and_change_nothing_that_is_held() {
    let steps = |object, way_m| {
        let step = Step { way_world: Vec3::X * way_m, turn_world: Vec3::Y };
        ObjectSteps { object, steps: [Step::default(), step, step] }
    };
    let told = |step_s, objects| {
        let mut server = Held::default();
        let update = server.commit(vec![add(1)], 0.0, 0).unwrap();
        let mut client = Held::default();
        let applied = client.apply(&Update { next: NextSteps { step_s, objects }, ..update });
        applied.map(|()| assert_eq!(client.digest(), server.digest()))
    };
    assert_eq!(told(0.05, vec![steps(3, 1.0), steps(9, -1e30)]), Ok(()));
    assert_eq!(told(0.0, vec![]), Ok(()));
    assert_eq!(told(0.05, vec![steps(9, 1.0), steps(9, 1.0)]), Err(HeldError::ObjectsNotAscending));
    let not_finite = Err(HeldError::NotFinite("next step of an object"));
    assert_eq!(told(0.05, vec![steps(9, f32::NAN)]), not_finite);
    for step_s in [0.0, -1.0, f32::NAN, f32::INFINITY] {
        assert_eq!(told(step_s, vec![steps(9, 1.0)]), not_finite, "a step of {step_s} s");
    }
}

#[test]
fn numbers_and_digests_must_follow() {
    let (mut server, mut client) = (Held::default(), Held::default());
    let first = server.commit(vec![add(1)], 0.0, 0).unwrap();
    let second = server.commit(vec![add(2)], 0.1, 0).unwrap();
    assert_eq!(client.apply(&second), Err(HeldError::Number { held: 0, update: 2 }));
    client.apply(&first).unwrap();
    assert_eq!(client.apply(&first), Err(HeldError::Number { held: 1, update: 1 }));
    let wrong = Update { digest: second.digest ^ 1, ..second.clone() };
    assert_eq!(client.apply(&wrong), Err(HeldError::Digest { number: 2 }));
    client.apply(&second).unwrap();
    // A fresh start may leave a gap or come again, and ids begin anew.
    server.commit(vec![add(3)], 0.2, 0).unwrap();
    let fresh = server.commit(vec![Edit::Clear, add(1)], 0.3, 0).unwrap();
    client.apply(&fresh).unwrap();
    client.apply(&fresh).unwrap();
    assert_eq!(client.digest(), server.digest());
}

#[test]
fn every_integer_of_a_patch_enters_the_digest() {
    let digest = |image: DepthImage| {
        let mut held = Held::default();
        held.commit(vec![Edit::Add(Box::new(patch(1, image)))], 0.0, 0).unwrap();
        held.digest()
    };
    let image = || with_ends(cast_with_mirror((48, 32), |_, _| true));
    let base = digest(image());
    let changes: [fn(&mut DepthImage); 7] = [
        |image| image.depth[7] ^= 1,
        |image| image.normal[7][1] ^= 1,
        |image| image.normal_rest[7] ^= 1,
        |image| image.ends[7] ^= 1,
        |image| image.colour[7][2] ^= 1,
        |image| image.object[7] ^= 1,
        |image| image.material[7] ^= 1,
    ];
    for change in changes {
        let mut changed = image();
        change(&mut changed);
        assert_ne!(digest(changed), base);
    }
}

#[test]
fn the_copy_is_capped() {
    let limits = Limits { held_samples: 100, ..Limits::default() };
    let update = Update {
        number: 1,
        scene_time_s: 0.0,
        pose_seq: 0,
        edits: vec![add(1)],
        next: NextSteps::default(),
        digest: 0,
    };
    assert_eq!(Held::default().apply_within(&update, &limits), Err(HeldError::TooMuch("samples")));
}

/// Every pixel of an image of this size, with one of its samples changed so that no two are equal.
fn full(id: u32, size_px: u32) -> Patch {
    let (width_px, height_px) = (size_px, size_px);
    let seed = cast((1, 1), |_, _| true);
    let count = (width_px * height_px) as usize;
    let mut mask = Mask::empty(width_px, height_px);
    (0..count as u32).for_each(|pixel| mask.set(pixel % width_px, pixel / width_px, true));
    let camera = *seed.camera.root();
    let noise = |index: usize| (index as u32).wrapping_add(id * 7919).wrapping_mul(0x9e37_79b9);
    let image = DepthImage {
        camera: camera::Camera::Pinhole(camera::Pinhole { width_px, height_px, ..camera }),
        depth_scale: DepthScale { w_min: 0.1, w_step: 1e-4 },
        mask,
        depth: (0..count).map(|index| (noise(index) >> 20) as u16).collect(),
        normal: vec![[127, 127]; count],
        normal_rest: Vec::new(),
        colour_rest: Vec::new(),
        share: Vec::new(),
        ends: Vec::new(),
        colour: (0..count).map(|index| noise(index).to_le_bytes()).map(|[_, r, g, b]| [r, g, b]).collect(),
        object: vec![id as u16 % 7; count],
        material: vec![0; count],
    };
    patch(id, image)
}

#[test]
fn a_million_held_samples_are_one_more_update() {
    const PATCHES: u32 = 64;
    const SIZE_PX: u32 = 128;
    let (mut server, mut client) = (Held::default(), Held::default());
    // All at once, as to a client that comes back; then a little of every patch.
    let all = (1..=PATCHES).map(|id| Edit::Add(Box::new(full(id, SIZE_PX)))).collect();
    let first = server.commit(all, 0.0, 0).unwrap();
    send(&mut client, &first);
    assert_eq!(client.sample_count(), 1 << 20);
    let column = |x: u16| (0..SIZE_PX as u16).map(move |y| (x, y));
    for step in 0..4 {
        let mut edits = vec![add(PATCHES + 1 + u32::from(step))];
        for id in (1..=PATCHES).map(PatchId) {
            edits.push(Edit::Delete(id, column(2 * step).collect()));
            edits.push(Edit::Trim(id, column(2 * step + 1).map(|(x, y)| (x, y, 1)).collect()));
        }
        let update = server.commit(edits, 0.1, 0).unwrap();
        send(&mut client, &update);
        assert_eq!(client.digest(), server.digest());
    }
    assert!(client.patches == server.patches);
    let left = (1 << 20) - 4 * (PATCHES * SIZE_PX) as usize + 4 * image().sample_count();
    assert_eq!((client.sample_count(), server.sample_count()), (left, left));
}

#[test]
fn after_the_last_number_only_a_fresh_start_follows() {
    let mut server = Held::default();
    server.number = u64::MAX - 1;
    let last = server.commit(vec![Edit::Clear, add(1)], 0.5, 0).unwrap();
    let mut client = Held::default();
    client.apply(&last).unwrap();
    for number in [0, 1, u64::MAX] {
        let next = Update { number, edits: Vec::new(), ..last.clone() };
        assert_eq!(client.apply(&next), Err(HeldError::Number { held: u64::MAX, update: number }));
    }
    let anew = Held::default().commit(vec![Edit::Clear], 0.5, 0).unwrap();
    assert_eq!((client.apply(&anew), client.number), (Ok(()), 1));
}
