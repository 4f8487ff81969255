//! Objects drawn by one relief, beside what the CPU's walk and the scene itself say of the same rays.

extern crate impostor as vantage_impostor;

#[path = "../../../impostor/tests/support/mod.rs"]
mod support;

mod client;

use std::time::Instant;

use camera::{Camera, Pinhole, Rigid, Spoc};
use client::{Client, Drawn};
use glam::{DAffine3, DMat3, DQuat, DVec3};
use impostor::{Impostor, Method, Ray, Side, Steps};
use protocol::held::{Edit, Instance, ObjectPose};
use protocol::image::octahedral_code;
use protocol::{DepthImage, DepthScale, Held, Mask, Patch, PatchId, Purpose, Update};
use support::scenes::{POT_BOUNDS, POT_EYE, pot};
use support::{Image, Shown as Sampled};
use surface::{BuiltSurfaces, HeldSurfaces};
use vantage_client::draw::impostors::ImpostorImage;
use vantage_client::receive::follow::Follow;

const SIDE: u32 = 128;
const RELIEF: PatchId = PatchId(1);
const WALL: u16 = 40;
const BASE: [u8; 3] = [200, 100, 50];
/// Codes of the materials: of what lies left and right in the pot.
const MATERIALS: [u8; 2] = [3, 200];

/// Where the pot was when its image was taken.
fn at_capture() -> DAffine3 {
    DAffine3::from_scale_rotation_translation(
        DVec3::splat(2.0),
        DQuat::from_rotation_y(0.4),
        DVec3::new(1.0, 2.0, -3.0),
    )
}

fn pot_by_spoc(side: u32) -> Image {
    let camera = Spoc::around(&POT_BOUNDS, POT_EYE, (side, side), 1.0).expect("outside of the pot");
    Image::take(Camera::Spoc(camera), pot())
}

/// The patch of an image of the pot, as it is sent.
fn relief(image: &Image) -> Patch {
    let (width, height) = (image.size.0 as u32, image.size.1 as u32);
    let mut mask = Mask::empty(width, height);
    for place in 0..image.size.0 * image.size.1 {
        mask.set(place as u32 % width, place as u32 / width, image.shown[place].is_some());
    }
    let shown: Vec<&Sampled> = image.shown.iter().flatten().collect();
    let range = |limit: fn(f64, f64) -> f64, start: f64| shown.iter().map(|shown| shown.w).fold(start, limit) as f32;
    let (w_min, w_max) = (range(f64::min, f64::INFINITY), range(f64::max, 0.0));
    let depth_scale = DepthScale { w_min, w_step: (w_max - w_min) / 65535.0 };
    let image = DepthImage {
        camera: image.impostor.camera().clone(),
        depth_scale,
        mask,
        depth: shown.iter().map(|shown| depth_scale.code(shown.w as f32)).collect(),
        normal: shown.iter().map(|shown| octahedral_code(shown.normal.as_vec3())).collect(),
        normal_rest: Vec::new(),
        colour_rest: Vec::new(),
        share: Vec::new(),
        ends: Vec::new(),
        colour: vec![BASE; shown.len()],
        object: vec![7; shown.len()],
        material: shown.iter().map(|shown| MATERIALS[usize::from(shown.p_world.x > 0.0)]).collect(),
    };
    let objects = vec![ObjectPose { object: 7, world_from_object: at_capture() }];
    Patch { id: RELIEF, purpose: Purpose::Relief(7), capture_time_s: 0.0, objects, image }
}

/// An object that stands as the pot does after it was moved from where it was captured.
fn instance(object: u16, now_from_capture: DAffine3, tint: [u8; 3]) -> Instance {
    Instance { pose: ObjectPose { object, world_from_object: now_from_capture * at_capture() }, tint }
}

/// A thousand kilometres from the origin.
const FAR_AWAY: DVec3 = DVec3::new(1e6, -3e5, 5e5);

fn view() -> Pinhole {
    Pinhole::symmetric(Rigid::look_at(FAR_AWAY + DVec3::new(0.3, 0.9, 3.8), FAR_AWAY), (SIDE, SIDE), 1.1, 0.05)
}

/// Turned and bent; mirrored and small; large and behind both.
fn three() -> Vec<Instance> {
    let place = |x: f64, y: f64, z: f64| DAffine3::from_translation(FAR_AWAY + DVec3::new(x, y, z));
    let bent = DAffine3::from_mat3(DMat3::from_cols(DVec3::X, DVec3::new(0.3, 1.0, 0.0), DVec3::Z));
    vec![
        instance(3, place(-0.9, 0.4, 0.2) * DAffine3::from_rotation_y(-0.5) * bent, [255; 3]),
        instance(11, place(0.7, -0.3, 0.4) * DAffine3::from_scale(DVec3::new(-0.8, 0.8, 0.7)), [255, 128, 0]),
        instance(
            65535,
            place(0.4, 0.6, -1.5) * DAffine3::from_rotation_y(0.3) * DAffine3::from_scale(DVec3::splat(1.7)),
            [64; 3],
        ),
    ]
}

fn held(patch: &Patch, instances: Vec<Instance>) -> Held {
    let mut held = Held::default();
    held.commit(vec![Edit::Add(Box::new(patch.clone())), Edit::Place(RELIEF, instances)], 0.0, 0).expect("it is held");
    held
}

/// What a ray of the eye should show.
#[derive(Debug, Clone, Copy)]
struct Expected {
    object: u16,
    z_m: f64,
    /// How wide a sample is there, along the ray.
    footprint_m: f64,
    normal: DVec3,
    material: u8,
}

/// The impostor as a client has it, walked in f64.
struct Walked {
    impostor: Impostor,
    image: ImpostorImage,
    footprints_m: Vec<f64>,
}

impl Walked {
    fn new(patch: &Patch) -> Walked {
        let image = ImpostorImage::of_patch(patch).expect("a relief is an impostor");
        let impostor = Impostor::new(image.camera.clone(), &image.samples).expect("samples");
        let footprints_m = impostor.sample_shapes().map(|shape| shape.footprint_m).collect();
        Walked { impostor, image, footprints_m }
    }

    /// The first crossing from the front.
    fn hit(&self, capture_from_now: DAffine3, eye: DVec3, way: DVec3, near_m: f64) -> Option<(f64, f64, usize)> {
        let mut ray = Ray::endless(capture_from_now.transform_point3(eye), capture_from_now.transform_vector3(way));
        ray.t_from = near_m;
        for _ in 0..4 {
            let hit = self.impostor.hit(&ray, Steps { method: Method::Hierarchy, fine_px: 1.0 }).hit?;
            let pixel = (hit.pixel.1 * self.image.camera.size_px().0 + hit.pixel.0) as usize;
            let footprint_m = self.footprints_m[pixel] / ray.direction_world.length();
            if hit.side == Side::Front {
                return Some((hit.t, footprint_m, pixel));
            }
            ray.t_from = hit.t + footprint_m;
        }
        None
    }

    /// The nearest of all instances that each pixel should show.
    fn expected(&self, instances: &[Instance], view: &Pinhole) -> Vec<Option<Expected>> {
        let pixels = (0..view.height_px).flat_map(|y| (0..view.width_px).map(move |x| (x, y)));
        let expected = |(x, y): (u32, u32)| {
            let way = way(view, x, y);
            let of_instance = |instance: &Instance| {
                let capture_from_now = at_capture() * instance.pose.world_from_object.inverse();
                let (z_m, footprint_m, pixel) =
                    self.hit(capture_from_now, view.world_from_eye.translation, way, view.near_m)?;
                let normal = capture_from_now.matrix3.transpose() * self.image.samples[pixel].normal_world;
                let (object, material) = (instance.pose.object, self.image.colour[pixel][3]);
                Some(Expected { object, z_m, footprint_m, normal: normal.normalize(), material })
            };
            instances.iter().filter_map(of_instance).min_by(|a, b| a.z_m.total_cmp(&b.z_m))
        };
        pixels.map(expected).collect()
    }
}

/// The way through a pixel's centre, a metre deep.
fn way(view: &Pinhole, x: u32, y: u32) -> DVec3 {
    view.world_from_eye.transform_vector(view.ray_eye_from_image(f64::from(x) + 0.5, f64::from(y) + 0.5))
}

/// At least 99 of 100 pixels that show an object, or should: the rest lies so near to an edge that rounding decides.
fn agree(name: &str, drawn: &Drawn, expected: &[Option<Expected>]) {
    let (mut shown, mut agreeing, mut turned) = (0, 0, 0);
    for (pixel, expected) in expected.iter().enumerate() {
        let object = drawn.object(pixel);
        if object.is_none() && expected.is_none() {
            continue;
        }
        shown += 1;
        let Some(expected) = expected.filter(|expected| Some(expected.object) == object) else { continue };
        let [normal, ids] = drawn.normal_ids[pixel];
        let z_m = 1.0 / f64::from(drawn.w[pixel]);
        let is_there = (z_m - expected.z_m).abs() <= 0.1 * expected.footprint_m;
        agreeing += usize::from(is_there && ids >> 16 == u32::from(expected.material));
        turned += usize::from(fine_normal(normal).dot(expected.normal) < 0.97);
    }
    println!("{name}: {agreeing} of {shown} agree, {turned} turned");
    assert!(shown * 8 > drawn.w.len(), "{name}: {shown} pixels are too few to say anything");
    assert!(agreeing * 100 >= shown * 99, "{name}: {agreeing} of {shown} agree");
    // Between samples normals are averages.
    assert!(turned * 20 < shown, "{name}: {turned} of {shown} face another way");
}

/// A normal from its octahedral code of 16 + 16 bits.
fn fine_normal(code: u32) -> DVec3 {
    let coordinate = |bits: u32| f64::from(bits as u16 as i16) / 32767.0;
    let (x, y) = (coordinate(code), coordinate(code >> 16));
    let z = 1.0 - x.abs() - y.abs();
    let fold = |a: f64, b: f64| (1.0 - b.abs()) * a.signum();
    if z < 0.0 { DVec3::new(fold(x, y), fold(y, x), z).normalize() } else { DVec3::new(x, y, z).normalize() }
}

#[test]
fn objects_stand_where_the_cpu_s_walk_and_the_scene_itself_meet_them() {
    let image = pot_by_spoc(128);
    let patch = relief(&image);
    let (held, view) = (held(&patch, three()), view());
    let drawn = Client::of(&held).draw(&held, &view);
    let expected = Walked::new(&patch).expected(&three(), &view);
    agree("three", &drawn, &expected);
    for object in [3, 11, 65535] {
        let count = (0..drawn.w.len()).filter(|&pixel| drawn.object(pixel) == Some(object)).count();
        assert!(count > 400, "object {object} shows {count} pixels");
    }
    for (&depth, &w) in drawn.depth.iter().zip(&drawn.w) {
        assert!((depth - view.near_m as f32 * w).abs() <= 1e-6 * depth, "{depth} of {w}");
    }
    // One layer does not hold all that this eye sees; where it holds it, it is there.
    let eye = view.world_from_eye.translation;
    let truly = |pixel: usize| {
        let way = way(&view, pixel as u32 % SIDE, pixel as u32 / SIDE);
        let of_instance = |instance: Instance| {
            let capture_from_now = at_capture() * instance.pose.world_from_object.inverse();
            let (origin, direction) = (capture_from_now.transform_point3(eye), capture_from_now.transform_vector3(way));
            Some((image.scene.points(origin, direction, view.near_m, 1e3).first()?.t, instance.pose.object))
        };
        three().into_iter().filter_map(of_instance).min_by(|a, b| a.0.total_cmp(&b.0))
    };
    let (mut shown, mut right) = (0, 0);
    for (pixel, truth) in (0..drawn.w.len()).map(|pixel| (pixel, truly(pixel))) {
        if drawn.object(pixel).is_some() || truth.is_some() {
            shown += 1;
            let z_m = 1.0 / f64::from(drawn.w[pixel]);
            right += usize::from(
                truth.is_some_and(|(t, object)| Some(object) == drawn.object(pixel) && (z_m - t).abs() < 0.05),
            );
        }
    }
    println!("{right} of {shown} as in the scene");
    assert!(right * 100 > shown * 90, "{right} of {shown} as in the scene");
}

#[test]
fn an_eye_in_the_box_and_a_relief_by_a_pinhole_are_right_too() {
    let camera = Pinhole::symmetric(Rigid::look_at(POT_EYE, POT_BOUNDS.middle()), (SIDE, SIDE), 0.7, 0.5);
    let patch = relief(&Image::take(Camera::Pinhole(camera), pot()));
    // As it is, and in a mirror, where the triangles of the box run the other way round.
    for side in [1.0, -1.0] {
        let now_from_capture = DAffine3::from_translation(FAR_AWAY) * DAffine3::from_scale(DVec3::new(side, 1.0, 1.0));
        let instances = vec![instance(3, now_from_capture, [255; 3])];
        let held = held(&patch, instances.clone());
        // Within the bounds, over the spout's side.
        let eye = FAR_AWAY + DVec3::new(side * 0.4, 0.75, 0.68);
        let view = Pinhole::symmetric(Rigid::look_at(eye, FAR_AWAY), (SIDE, SIDE), 1.5, 0.05);
        let drawn = Client::of(&held).draw(&held, &view);
        agree("inside", &drawn, &Walked::new(&patch).expected(&instances, &view));
    }
}

#[test]
fn of_two_reliefs_of_an_object_the_nearer_surface_shows() {
    let from = |eye: DVec3| {
        let pose = Rigid::look_at(eye, POT_BOUNDS.middle());
        relief(&Image::take(Camera::Pinhole(Pinhole::symmetric(pose, (SIDE, SIDE), 0.7, 0.5)), pot()))
    };
    let patches = [from(POT_EYE), Patch { id: PatchId(2), ..from(POT_EYE * DVec3::new(1.0, 1.0, -1.0)) }];
    let side_on = DAffine3::from_translation(FAR_AWAY) * DAffine3::from_rotation_y(1.4);
    let place = |patch: &Patch| {
        let placed = Edit::Place(patch.id, vec![instance(3, side_on, [255; 3])]);
        [Edit::Add(Box::new(patch.clone())), placed]
    };
    let draw = |patches: &[Patch]| {
        let mut held = Held::default();
        held.commit(patches.iter().flat_map(place).collect(), 0.0, 0).expect("it is held");
        Client::of(&held).draw(&held, &view()).w
    };
    let [both, front, back] = [&patches[..], &patches[..1], &patches[1..]].map(draw);
    let nearer = |a: &[f32], b: &[f32]| a.iter().zip(b).filter(|(a, b)| a > b).count();
    assert!(nearer(&front, &back) > 100 && nearer(&back, &front) > 100, "each holds what the other does not");
    assert!(both.iter().zip(front.iter().zip(&back)).all(|(&both, (&front, &back))| both == front.max(back)));
}

/// A wall across the left half of the view, at a depth.
fn wall(view: &Pinhole, z_m: f64) -> Patch {
    let mut mask = Mask::empty(SIDE, SIDE);
    (0..SIDE).flat_map(|y| (0..SIDE / 2).map(move |x| (x, y))).for_each(|(x, y)| mask.set(x, y, true));
    let count = mask.count();
    let image = DepthImage {
        camera: Camera::Pinhole(*view),
        depth_scale: DepthScale { w_min: 1.0 / z_m as f32, w_step: 0.0 },
        mask,
        depth: vec![0; count],
        normal: vec![octahedral_code(glam::Vec3::Z); count],
        normal_rest: Vec::new(),
        colour_rest: Vec::new(),
        share: Vec::new(),
        ends: Vec::new(),
        colour: vec![[9; 3]; count],
        object: vec![WALL; count],
        material: vec![0; count],
    };
    Patch { id: PatchId(2), purpose: Purpose::Eye, capture_time_s: 0.0, objects: Vec::new(), image }
}

#[test]
fn surfaces_and_objects_hide_each_other() {
    let patch = relief(&pot_by_spoc(128));
    let (mut held, view) = (held(&patch, three()), view());
    // In the midst of the first object, and before the last one.
    let wall_m = 3.7;
    held.commit(vec![Edit::Add(Box::new(wall(&view, wall_m)))], 0.0, 0).expect("it is held");
    let drawn = Client::of(&held).draw(&held, &view);
    let expected = Walked::new(&patch).expected(&three(), &view);
    let (mut before, mut behind, mut wrong) = (0, 0, 0);
    for (pixel, expected) in
        expected.iter().enumerate().filter(|(pixel, _)| pixel % (SIDE as usize) < SIDE as usize / 2)
    {
        let Some(expected) = expected else {
            wrong += usize::from(drawn.object(pixel) != Some(WALL));
            continue;
        };
        // Half of a wall's pixel is what a surface is set back by.
        if (expected.z_m - wall_m).abs() < wall_m / view.focal_px {
            continue;
        }
        let object = if expected.z_m < wall_m { expected.object } else { WALL };
        *(if expected.z_m < wall_m { &mut before } else { &mut behind }) += 1;
        wrong += usize::from(drawn.object(pixel) != Some(object));
    }
    assert!(before > 200 && behind > 200, "{before} before, {behind} behind the wall");
    assert!(wrong * 100 <= before + behind, "{wrong} of {before} and {behind}");
}

fn linear_from_srgb(value: u8) -> f64 {
    let c = f64::from(value) / 255.0;
    if c <= 0.04045 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }
}

fn srgb_from_linear(linear: f64) -> u8 {
    let c = if linear <= 0.0031308 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 };
    (c * 255.0).round() as u8
}

#[test]
fn a_tint_multiplies_linear_light() {
    let patch = relief(&pot_by_spoc(128));
    let held = held(&patch, three());
    let drawn = Client::of(&held).draw(&held, &view());
    for Instance { pose, tint } in three() {
        let expected: [u8; 3] = std::array::from_fn(|channel| {
            srgb_from_linear(linear_from_srgb(BASE[channel]) * f64::from(tint[channel]) / 255.0)
        });
        for pixel in (0..drawn.w.len()).filter(|&pixel| drawn.object(pixel) == Some(pose.object)) {
            let [red, green, blue, covered] = drawn.colour[pixel];
            let near = [red, green, blue].iter().zip(expected).all(|(a, b)| a.abs_diff(b) <= 1);
            assert!(near && covered == 255, "object {} is {:?}, not {expected:?}", pose.object, drawn.colour[pixel]);
        }
    }
}

#[test]
fn updates_are_followed_and_nothing_is_made_while_nothing_is_placed() {
    let patch = relief(&pot_by_spoc(64));
    let (mut held, mut client, view) = (Held::default(), Client::new(), view());
    let update = |client: &mut Client, held: &mut Held, edits: Vec<Edit>| {
        let update: Update = held.commit(edits, 0.0, 0).expect("it fits");
        client.impostors.follow(held, &update, false, &mut BuiltSurfaces::default());
    };
    update(&mut client, &mut held, vec![Edit::Add(Box::new(patch.clone()))]);
    let empty = client.draw(&held, &view);
    assert!(!empty.draws_reliefs && empty.w.iter().all(|&w| w == 0.0), "a relief alone shows nothing");
    let there = three();
    // Objects that moved before they were placed stand where they moved to.
    let moved = Edit::Move(there.iter().map(|instance| instance.pose).collect());
    let elsewhere = DAffine3::from_translation(DVec3::X * 7.0);
    let placed = there.iter().map(|instance| instance_at(instance, elsewhere)).collect();
    update(&mut client, &mut held, vec![moved, Edit::Place(RELIEF, placed)]);
    let drawn = client.draw(&held, &view);
    assert!(drawn.draws_reliefs);
    let at_once = self::held(&patch, three());
    assert_eq!(drawn, Client::of(&at_once).draw(&at_once, &view));
    assert_eq!(drawn, Client::of(&held).draw(&held, &view), "a client that starts anew");
    update(&mut client, &mut held, vec![Edit::Withdraw(vec![3, 65535])]);
    let drawn = client.draw(&held, &view);
    let is_left = |pixel| drawn.object(pixel).is_none_or(|object| object == 11);
    assert!((0..drawn.w.len()).all(is_left) && drawn.w.iter().any(|&w| w > 0.0));
    update(&mut client, &mut held, vec![Edit::Withdraw(vec![11]), Edit::Remove(RELIEF)]);
    assert_eq!((client.draw(&held, &view).w, client.impostors.len()), (empty.w.clone(), 0));
    let again = PatchId(9);
    let patch = Patch { id: again, ..patch };
    update(&mut client, &mut held, vec![Edit::Clear, Edit::Add(Box::new(patch)), Edit::Place(again, three())]);
    assert_eq!(client.draw(&held, &view), Client::of(&at_once).draw(&at_once, &view));
    update(&mut client, &mut held, vec![Edit::Clear]);
    assert_eq!((client.draw(&held, &view).w, client.impostors.len()), (empty.w, 0));
}

fn instance_at(instance: &Instance, moved: DAffine3) -> Instance {
    let pose = ObjectPose { world_from_object: moved * instance.pose.world_from_object, ..instance.pose };
    Instance { pose, ..*instance }
}

#[test]
fn objects_that_no_ray_comes_back_from_and_images_too_large_are_left_out() {
    let mut patch = relief(&pot_by_spoc(64));
    let far = |scale: f64| DAffine3::from_translation(FAR_AWAY) * DAffine3::from_scale(DVec3::splat(scale));
    let mut instances = three();
    // As small as a pixel, smaller than f32 tells, larger than it tells, and moved to where everything is flat.
    instances
        .extend([(70, 1e-4), (71, 1e-60), (72, 1e60), (73, 1.0)].map(|(id, scale)| instance(id, far(scale), [255; 3])));
    instances.sort_by_key(|instance| instance.pose.object);
    let mut held = held(&patch, instances);
    let flat = ObjectPose { object: 73, world_from_object: DAffine3::from_scale(DVec3::new(1.0, 0.0, 1.0)) };
    held.commit(vec![Edit::Move(vec![flat])], 0.0, 0).expect("it fits");
    let three_alone = self::held(&patch, three());
    let drawn = Client::of(&held).draw(&held, &view());
    assert_eq!(drawn, Client::of(&three_alone).draw(&three_alone, &view()));

    let (side, mut mask) = (4096, Mask::empty(4096, 4096));
    mask.set(9, 9, true);
    patch.image = DepthImage {
        camera: Camera::Pinhole(Pinhole::symmetric(Rigid::IDENTITY, (side, side), 1.0, 0.1)),
        depth_scale: DepthScale { w_min: 0.5, w_step: 0.0 },
        mask,
        depth: vec![0],
        normal: vec![[127, 127]],
        normal_rest: Vec::new(),
        colour_rest: Vec::new(),
        share: Vec::new(),
        ends: Vec::new(),
        colour: vec![[9; 3]],
        object: vec![7],
        material: vec![0],
    };
    let held = self::held(&patch, three());
    let mut client = Client::of(&held);
    assert_eq!(client.impostors.len(), 0);
    assert!(client.draw(&held, &view()).w.iter().all(|&w| w == 0.0));
}

/// Prints milliseconds for 40 objects: `cargo test --release --test relief -- --ignored --nocapture`.
#[test]
#[ignore = "measures"]
fn forty_objects_at_640_by_480() {
    let held = {
        let place = |index: u16| {
            let offset = DVec3::new(f64::from(index % 8) * 2.4 - 8.4, 0.0, f64::from(index / 8) * -2.4);
            instance(index, DAffine3::from_translation(offset), [255, 40 + index as u8 * 5, 255])
        };
        held(&relief(&pot_by_spoc(512)), (0..40).map(place).collect())
    };
    let pose = Rigid::look_at(DVec3::new(0.0, 5.0, 9.0), DVec3::new(0.0, 0.0, -3.0));
    let view = Pinhole::symmetric(pose, (640, 480), 0.9, 0.05);
    let mut client = Client::of(&held);
    let mut without = held.clone();
    without.instances.clear();
    for (name, held) in [("nothing", &without), ("40 objects", &held)] {
        let drawn = client.draw(held, &view);
        let shown = drawn.w.iter().filter(|&&w| w > 0.0).count();
        let surfaces = HeldSurfaces::new(&client.gpu);
        let mut times_ms: Vec<f64> = (0..9)
            .map(|_| {
                let begin = Instant::now();
                let encoder = client.encode(&surfaces, held, &view);
                client.gpu.queue.submit([encoder.finish()]);
                client.frame.submitted(true);
                client.gpu.wait_idle().expect("the device lives");
                begin.elapsed().as_secs_f64() * 1e3
            })
            .collect();
        times_ms.sort_by(f64::total_cmp);
        println!("{name}: {:.1} ms a frame, the median of 9; {shown} pixels show an object", times_ms[4]);
    }
}
