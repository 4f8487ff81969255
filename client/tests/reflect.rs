//! Mirrors and glass before scenes whose pictures are known in closed form.

extern crate impostor as vantage_impostor;

#[path = "reflect/rough.rs"]
mod rough;
#[path = "../../impostor/tests/support/mod.rs"]
mod support;
#[path = "reflect/walks.rs"]
mod walks;

use std::collections::BTreeMap;

use camera::{Camera, Pinhole, Rigid, Spoc};
use glam::{DAffine3, DVec2, DVec3};
use gpu::{Gpu, Readback};
use impostor::Sample;
use protocol::held::HeldPatch;
use protocol::image::octahedral_code;
use protocol::{DepthImage, DepthScale, Edit, Held, Light, Lighting, Mask, Material, Patch, PatchId, Purpose};
use support::scenes;
use surface::HeldSurfaces;
use vantage_client::draw::frame::{FrameRenderer, Options};
use vantage_client::draw::impostors::{ImpostorImage, ImpostorKind, Impostors, UnfitImage};
use vantage_client::draw::reflect::{Bounces, EdgeRays, Search, Settings, StepSum, Walk};

const SIDE: u32 = 64;
const BACKGROUND: [u8; 3] = [90, 140, 200];

/// Edges are as wide as a sample, so that places can be told.
const SHARP: Settings = Settings {
    bounces: Bounces::Two,
    search: Search::Whole,
    walk: Walk::Hierarchy,
    fade: true,
    filter: false,
    edges: EdgeRays::Never,
    count_steps: false,
};

// Codes of the materials.
const UNLIT: u8 = 0;
const MIRROR: u8 = 1;
const GLASS: u8 = 2;
const ROUGH: u8 = 3;

/// The reflector: a white wall in this depth before the eye, which is at the origin and looks along -z.
const WALL_M: f64 = 2.0;
const WALL_OBJECT: u16 = 1;

fn view() -> Pinhole {
    Pinhole::symmetric(Rigid::look_at(DVec3::ZERO, DVec3::NEG_Z), (SIDE, SIDE), 1.0, 0.05)
}

/// The way through a pixel's centre, as far as -1 along z.
fn way(x: u32, y: u32) -> DVec3 {
    let view = view();
    view.world_from_eye.transform_vector(view.ray_eye_from_image(f64::from(x) + 0.5, f64::from(y) + 0.5))
}

fn held(material: u8, ior: f32) -> Held {
    let mut mask = Mask::empty(SIDE, SIDE);
    (0..SIDE).flat_map(|y| (0..SIDE).map(move |x| (x, y))).for_each(|(x, y)| mask.set(x, y, true));
    let count = mask.count();
    let image = DepthImage {
        camera: Camera::Pinhole(view()),
        depth_scale: DepthScale { w_min: 1.0 / WALL_M as f32, w_step: 0.0 },
        mask,
        depth: vec![0; count],
        normal: vec![octahedral_code(glam::Vec3::Z); count],
        normal_rest: Vec::new(),
        colour_rest: Vec::new(),
        share: Vec::new(),
        ends: Vec::new(),
        colour: vec![[255; 3]; count],
        object: vec![WALL_OBJECT; count],
        material: vec![material; count],
    };
    let patch = Patch { id: PatchId(1), purpose: Purpose::Eye, capture_time_s: 0.0, objects: Vec::new(), image };
    let unlit = Material { unlit: true, ..Material::default() };
    let mirror = Material { metallic: 1.0, roughness: 0.0, ..Material::default() };
    let glass = Material { transmission: 1.0, ior, ..Material::default() };
    let mut held = Held::default();
    held.patches.insert(PatchId(1), HeldPatch { patch, trims: Vec::new() });
    held.materials = vec![unlit, mirror, glass, Material::default()];
    held.lighting = Some(Lighting {
        ambient: [0.5; 3],
        lights: Vec::new(),
        background: BACKGROUND,
        burley: false,
        ..Lighting::default()
    });
    held
}

/// An impostor of a plane across z at `z_m`, of one `colour` and material for each place of it.
fn plane(camera: Camera, kind: ImpostorKind, z_m: f64, colour: impl Fn(f64, f64) -> Option<[u8; 4]>) -> ImpostorImage {
    let eye = eye(&camera);
    let met = |way: DVec3| {
        let p = eye + way * ((z_m - eye.z) / way.z);
        let colour = colour(p.x, p.y).filter(|_| (z_m - eye.z) * way.z > 0.0)?;
        Some((p, DVec3::Z * (eye.z - z_m).signum(), colour))
    };
    image(camera, kind, met)
}

fn eye(camera: &Camera) -> DVec3 {
    match camera {
        Camera::Pinhole(camera) => camera.world_from_eye.translation,
        Camera::Spoc(camera) => camera.pinhole.world_from_eye.translation,
        Camera::Graph(_) => panic!("no such camera here"),
    }
}

/// An impostor of what `met` says of the way through each pixel, from the eye: place, normal, and colour with material.
fn image(camera: Camera, kind: ImpostorKind, met: impl Fn(DVec3) -> Option<(DVec3, DVec3, [u8; 4])>) -> ImpostorImage {
    let pinhole = match &camera {
        Camera::Pinhole(camera) => *camera,
        Camera::Spoc(camera) => camera.pinhole,
        Camera::Graph(_) => panic!("no such camera here"),
    };
    let pixels = (0..pinhole.height_px).flat_map(|y| (0..pinhole.width_px).map(move |x| (x, y)));
    let shown = pixels.map(|(x, y)| {
        let ray = pinhole.ray_eye_from_image(f64::from(x) + 0.5, f64::from(y) + 0.5);
        let Some((p, normal_world, colour)) = met(pinhole.world_from_eye.transform_vector(ray)) else {
            return (Sample::EMPTY, [0; 4]);
        };
        let w = pinhole.image_from_world(p).expect("before the eye").w;
        (Sample { w, normal_world }, colour)
    });
    let (samples, colour) = shown.unzip();
    ImpostorImage { kind, camera, samples, colour, pose: None }
}

fn pinhole(eye: DVec3, along: DVec3, side: u32) -> Camera {
    Camera::Pinhole(Pinhole::symmetric(Rigid::look_along(eye, along), (side, side), 2.0, 0.05))
}

/// Fields of half a metre, each of another colour.
fn fields(x: f64, y: f64) -> [u8; 4] {
    let (column, row) = ((x * 2.0).floor() as i64, (y * 2.0).floor() as i64);
    [(40 + column.rem_euclid(5) * 50) as u8, (30 + row.rem_euclid(4) * 70) as u8, 120, UNLIT]
}

/// Whether a place lies well within a field.
fn is_inner(x: f64, y: f64, margin_m: f64) -> bool {
    let from_border = |v: f64| (v * 2.0 - (v * 2.0).round()).abs() / 2.0;
    from_border(x).min(from_border(y)) > margin_m
}

struct Shown {
    pixels: Vec<[u8; 4]>,
    reflects: bool,
    steps: Option<StepSum>,
}

impl Shown {
    fn at(&self, x: u32, y: u32) -> [u8; 3] {
        let [r, g, b, _] = self.pixels[(y * SIDE + x) as usize];
        [r, g, b]
    }

    /// Every pixel that `expected` knows.
    fn is(&self, expected: impl Fn(u32, u32) -> Option<[u8; 3]>) {
        self.is_but(0.0, expected);
    }

    /// Every pixel that `expected` knows, but a share.
    fn is_but(&self, share: f64, expected: impl Fn(u32, u32) -> Option<[u8; 3]>) {
        let pixels = (0..SIDE).flat_map(|y| (0..SIDE).map(move |x| (x, y)));
        let known: Vec<_> = pixels.filter_map(|(x, y)| Some((x, y, expected(x, y)?))).collect();
        let differ = |&&(x, y, expected): &&(u32, u32, [u8; 3])| {
            self.at(x, y).iter().zip(expected).any(|(a, b)| a.abs_diff(b) > 2)
        };
        let wrong: Vec<_> = known.iter().filter(differ).collect();
        assert!(known.len() >= 200, "{} pixels say nothing", known.len());
        let first = wrong.first().map(|&&(x, y, expected)| (x, y, expected, self.at(x, y)));
        assert!(wrong.len() as f64 <= share * known.len() as f64, "{} of {}: {first:?}", wrong.len(), known.len());
    }
}

/// One that offers no more than WebGL2.
fn least_gpu() -> Gpu {
    let Gpu { instance, adapter, .. } = Gpu::block_on(Gpu::new_headless()).expect("an adapter");
    Gpu::block_on(Gpu::from_adapter(instance, adapter)).expect("a device")
}

fn show(held: &Held, images: &[ImpostorImage], settings: Settings) -> Shown {
    let gpu = least_gpu();
    let mut impostors = Impostors::new(&gpu);
    for (image, id) in images.iter().zip(0..) {
        impostors.insert(id, image).expect("an impostor");
    }
    let mut surfaces = HeldSurfaces::new(&gpu);
    surfaces.rebuild(held);
    let format = wgpu::TextureFormat::Rgba8Unorm;
    let mut frame = FrameRenderer::new(&gpu, format).expect("the shaders compile");
    let output = gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: None,
        size: wgpu::Extent3d { width: SIDE, height: SIDE, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
        view_formats: &[],
    });
    let (view, target) = (view(), output.create_view(&Default::default()));
    let options = Options { reflect: settings, ..Options::default() };
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    let shown = vantage_client::draw::shown::Shown {
        surfaces: &surfaces,
        held,
        impostors: Some(&impostors),
        bodies: None,
        lights: None,
        occluders: None,
        layers: None,
        rest: None,
    };
    frame.draw(&mut encoder, shown, &view, &target, options);
    let mut readback = Readback::default();
    let slot = readback.texture(&output, 0, (SIDE, SIDE));
    let encoded = readback.encode(&gpu, &mut encoder);
    gpu.queue.submit([encoder.finish()]);
    frame.submitted(true);
    let pixels = encoded.map().wait(&gpu).expect("a readback").values(slot);
    Shown { pixels, reflects: frame.reflects(), steps: frame.steps().expect("a readback") }
}

fn colour([r, g, b, _]: [u8; 4]) -> [u8; 3] {
    [r, g, b]
}

/// What is shown at a distance from the eye along z, with mirrors unfolded.
fn fields_at(z_m: f64, margin_m: f64) -> impl Fn(u32, u32) -> Option<[u8; 3]> {
    move |x, y| {
        let p = way(x, y) * z_m;
        is_inner(p.x, p.y, margin_m).then(|| colour(fields(p.x, p.y)))
    }
}

/// What is behind the eye, 5 m from the mirror, as seen from beside the mirror.
fn behind(kind: ImpostorKind) -> ImpostorImage {
    plane(pinhole(DVec3::new(0.5, 0.3, -1.0), DVec3::Z, 256), kind, 3.0, |x, y| Some(fields(x, y)))
}

#[test]
fn a_mirror_shows_what_is_behind_the_eye_at_the_right_place() {
    let images = [behind(ImpostorKind::Environment)];
    let shown = show(&held(MIRROR, 1.5), &images, SHARP);
    shown.is(fields_at(WALL_M + 5.0, 0.07));
    assert_eq!(shown.steps, None, "nobody asked");
    // A filtered edge is as wide as two pixels of the picture.
    show(&held(MIRROR, 1.5), &images, Settings::default()).is(fields_at(WALL_M + 5.0, 0.17));
}

#[test]
fn rays_of_every_step_length_find_the_same_and_steps_are_counted() {
    for search in [Search::Whole, Search::Half, Search::Quarter] {
        let settings = Settings { search, count_steps: true, ..SHARP };
        let shown = show(&held(MIRROR, 1.5), &[behind(ImpostorKind::Object(9))], settings);
        shown.is(fields_at(WALL_M + 5.0, 0.07));
        let StepSum { steps, walks } = shown.steps.expect("steps");
        assert_eq!(walks, f64::from(SIDE * SIDE), "every ray hits at once");
        assert!(steps >= walks && steps < 4.0 * walks, "a thin wall is met in a step or two: {}", steps / walks);
    }
}

#[test]
fn an_environment_map_goes_by_direction_alone() {
    let settings = Settings { search: Search::EnvironmentMap, ..SHARP };
    let shown = show(&held(MIRROR, 1.5), &[behind(ImpostorKind::Environment)], settings);
    shown.is(|x, y| {
        let p = DVec2::new(0.5, 0.3) + way(x, y).truncate() * 4.0;
        is_inner(p.x, p.y, 0.07).then(|| colour(fields(p.x, p.y)))
    });
}

/// `sRGB(1 - exp(-c))`.
fn shown_from_light(c: [f64; 3]) -> [u8; 3] {
    c.map(|c| {
        let linear = 1.0 - (-c).exp();
        let encoded = if linear <= 0.0031308 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 };
        (encoded * 255.0).round() as u8
    })
}

/// The light that shows as an sRGB colour.
fn light_from_shown(shown: [u8; 3]) -> [f64; 3] {
    shown.map(|value| {
        let c = f64::from(value) / 255.0;
        -(1.0 - if c <= 0.04045 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }).ln()
    })
}

#[test]
fn a_mirror_before_a_mirror_shows_a_second_bounce_or_itself_as_a_rough_surface() {
    let mirror = plane(pinhole(DVec3::new(0.5, 0.3, -1.0), DVec3::Z, 256), ImpostorKind::Environment, 3.0, |_, _| {
        Some([255, 255, 255, MIRROR])
    });
    let beyond =
        plane(pinhole(DVec3::new(-0.2, 0.1, 2.0), DVec3::NEG_Z, 256), ImpostorKind::Environment, -4.0, |x, y| {
            Some(fields(x, y))
        });
    let images = [mirror, beyond];
    let two = show(&held(MIRROR, 1.5), &images, SHARP);
    two.is(fields_at(2.0 + 5.0 + 7.0, 0.1));
    let one = show(&held(MIRROR, 1.5), &images, Settings { bounces: Bounces::One, ..Settings::default() });
    one.is(|_, _| Some(shown_from_light([0.5; 3])));
}

#[test]
fn glass_shows_what_is_behind_it_moved_as_two_interfaces_do() {
    let thick_m = 0.5;
    let eye = pinhole(DVec3::ZERO, DVec3::NEG_Z, 256);
    let far_side = plane(eye, ImpostorKind::Inside(WALL_OBJECT), -WALL_M - thick_m, |_, _| Some([255; 4]));
    let beyond =
        plane(pinhole(DVec3::new(0.2, 0.1, 0.0), DVec3::NEG_Z, 256), ImpostorKind::Environment, -5.0, |x, y| {
            Some(fields(x, y))
        });
    let images = [far_side, beyond];
    for ior in [1.0, 1.5_f32] {
        show(&held(GLASS, ior), &images, SHARP).is(|x, y| {
            let offset = way(x, y).truncate();
            // Snell's law, and outside the same way again.
            let sine = offset.length() / way(x, y).length() / f64::from(ior);
            let within = offset.normalize() * (sine / (1.0 - sine * sine).sqrt());
            let p = offset * (5.0 - thick_m) + within * thick_m;
            is_inner(p.x, p.y, 0.08).then(|| colour(fields(p.x, p.y)))
        });
    }
}

#[test]
fn without_reflectors_or_impostors_nothing_is_made_and_nothing_changes() {
    let images = [behind(ImpostorKind::Environment)];
    let settings = Settings::default();
    let mut rough = held(ROUGH, 1.5);
    rough.materials = vec![Material::default(); 4];
    let [with, without] = [show(&rough, &images, settings), show(&rough, &[], settings)];
    assert_eq!(with.pixels, without.pixels);
    assert!(!with.reflects && !without.reflects);
    let mirror = show(&held(MIRROR, 1.5), &[], settings);
    assert_eq!(mirror.pixels, without.pixels, "a mirror without impostors is a rough wall");
    assert!(!mirror.reflects);
    // Reflectors in the table, and none in the picture.
    let elsewhere = show(&held(ROUGH, 1.5), &images, settings);
    assert_eq!(elsewhere.pixels, without.pixels);
    assert!(elsewhere.reflects);
}

#[test]
fn a_moving_object_takes_its_reflection_with_it() {
    let square = |x: f64, y: f64| (x.abs() < 1.0 && y.abs() < 1.0).then_some([200, 30, 60, UNLIT]);
    let camera = pinhole(DVec3::new(0.5, 0.3, -1.0), DVec3::Z, 256);
    let at_capture = DAffine3::from_translation(DVec3::new(5.0, 6.0, 7.0));
    let mut image = plane(camera, ImpostorKind::Object(7), 3.0, square);
    image.pose = Some((7, at_capture));
    let turn = DAffine3::from_rotation_z(0.5);
    for moved in [DAffine3::IDENTITY, DAffine3::from_translation(DVec3::new(0.8, -0.5, 0.0)) * turn] {
        let mut held = held(MIRROR, 1.5);
        held.poses_now = BTreeMap::from([(7, moved * at_capture)]);
        show(&held, std::slice::from_ref(&image), Settings::default()).is(|x, y| {
            let p = moved.inverse().transform_point3(way(x, y).with_z(0.0) * 7.0).truncate().abs().max_element();
            // A filtered edge is as wide as a pixel of the picture.
            ((p - 1.0).abs() > 0.15).then_some(if p < 1.0 { [200, 30, 60] } else { BACKGROUND })
        });
    }
}

#[test]
fn a_turned_object_is_lit_as_it_stands_now() {
    let white = |_, _| Some([255, 255, 255, ROUGH]);
    let mut image = plane(pinhole(DVec3::new(0.5, 0.3, -1.0), DVec3::Z, 128), ImpostorKind::Object(7), 3.0, white);
    image.pose = Some((7, DAffine3::IDENTITY));
    let (angle, there) = (0.5_f64, DAffine3::from_translation(DVec3::Z * 3.0));
    let mut held = held(MIRROR, 1.5);
    held.poses_now = BTreeMap::from([(7, there * DAffine3::from_rotation_x(angle) * there.inverse())]);
    let light = Light::Directional { direction_world: [0.0, -0.6, 0.8], irradiance: [std::f32::consts::PI; 3] };
    held.lighting.as_mut().expect("light").lights.push(light);
    // The normal was -z.
    let c = 0.5 + 0.6 * angle.sin() + 0.8 * angle.cos();
    show(&held, &[image], SHARP).is(|x, y| {
        let is_middle = (16..48).contains(&x) && (16..48).contains(&y);
        is_middle.then(|| shown_from_light([c; 3]))
    });
}

#[test]
fn a_reflector_does_not_meet_its_own_impostor() {
    let images = [behind(ImpostorKind::Object(WALL_OBJECT))];
    show(&held(MIRROR, 1.5), &images, Settings::default()).is(|_, _| Some(BACKGROUND));
}

/// A floor below, which a single-pole camera (without a push) just over it grazes.
#[test]
fn samples_that_were_grazed_fade_into_what_lies_behind() {
    let (floor_m, eye) = (-0.6, DVec3::new(0.0, -0.5, -1.0));
    let Camera::Pinhole(camera) = pinhole(eye, DVec3::Z, 512) else { panic!("a pinhole") };
    let camera = Spoc {
        pinhole: camera,
        pole_px: camera.centre_px,
        push_from_m: 0.5,
        push_to_m: 4.0,
        push_max_px: 0.0,
        ramp_px: 1.0,
    };
    let red = [220, 40, 40, UNLIT];
    let met = |way: DVec3| {
        let share = (floor_m - eye.y) / way.y;
        (share > 0.0 && share < 6.0).then(|| (eye + way * share, DVec3::Y, red))
    };
    let floor = image(Camera::Spoc(camera), ImpostorKind::Object(9), met);
    let expected = |fade: bool| {
        move |x: u32, y: u32| {
            let way = way(x, y);
            let distance_m = floor_m / way.y;
            // Unfolded; the mirror stands two metres before the eye.
            let p = way.with_z(0.0) * distance_m + DVec3::Z * (distance_m - 2.0 * WALL_M);
            let offset = p - eye;
            if !(distance_m > 0.0 && (0.4..3.0).contains(&offset.z) && offset.x.abs() < offset.z * 1.4) {
                return None;
            }
            let facing = (eye.y - floor_m) / offset.length();
            let weight = if fade { (facing / 10_f64.to_radians().sin()).min(1.0) } else { 1.0 };
            let (near, far) = (light_from_shown(colour(red)), light_from_shown(BACKGROUND));
            Some(shown_from_light(std::array::from_fn(|i| near[i] * weight + far[i] * (1.0 - weight))))
        }
    };
    for fade in [true, false] {
        let shown = show(&held(MIRROR, 1.5), std::slice::from_ref(&floor), Settings { fade, ..SHARP });
        shown.is(expected(fade));
    }
}

#[test]
fn what_is_smaller_than_a_pixel_is_averaged() {
    // Black and white by turns, a quarter of a pixel of the picture wide.
    let wide_m = 7.0 / view().focal_px / 4.0;
    let checks = |x: f64, y: f64| {
        let odd = ((x / wide_m).floor() + (y / wide_m).floor()).rem_euclid(2.0) == 1.0;
        Some(if odd { [255, 255, 255, ROUGH] } else { [0, 0, 0, ROUGH] })
    };
    let image = plane(pinhole(DVec3::new(0.1, 0.2, -2.0), DVec3::Z, 1024), ImpostorKind::Environment, 3.0, checks);
    let filtered =
        |filter| show(&held(MIRROR, 1.5), std::slice::from_ref(&image), Settings { filter, ..Settings::default() });
    // Half of the ambient light of 0.5.
    let mean = shown_from_light([0.25; 3])[0];
    let far_off = |shown: &Shown| shown.pixels.iter().filter(|pixel| pixel[0].abs_diff(mean) > 20).count();
    assert!(far_off(&filtered(true)) < 40, "{}", far_off(&filtered(true)));
    assert!(far_off(&filtered(false)) > 500, "{}", far_off(&filtered(false)));
}

#[test]
fn more_rays_tell_how_much_of_a_pixel_an_edge_leaves() {
    // White beside black, along a line that crosses pixels everywhere.
    let edge_at = |y: f64| 0.31 * y + 0.05;
    let image = plane(pinhole(DVec3::new(0.1, 0.2, -2.0), DVec3::Z, 1024), ImpostorKind::Environment, 3.0, |x, y| {
        Some(if x > edge_at(y) { [255, 255, 255, UNLIT] } else { [0, 0, 0, UNLIT] })
    });
    let coverage = |x: u32, y: u32| {
        let parts = (0..64).filter(|part| {
            let at = |index: u32| (f64::from(index) + 0.5) / 8.0;
            let view = view();
            let place = (f64::from(x) + at(part % 8), f64::from(y) + at(part / 8));
            let p = view.world_from_eye.transform_vector(view.ray_eye_from_image(place.0, place.1)) * (WALL_M + 5.0);
            p.x > edge_at(p.y)
        });
        parts.count() as f64 / 64.0
    };
    let mean_off = |filter| {
        let shown = show(&held(MIRROR, 1.5), std::slice::from_ref(&image), Settings { filter, ..Settings::default() });
        let linear = |shown: u8| (f64::from(shown) / 255.0).powf(2.2);
        let pixels = (0..SIDE).flat_map(|y| (0..SIDE).map(move |x| (x, y, coverage(x, y))));
        let cut: Vec<f64> = pixels
            .filter(|(_, _, share)| (0.05..0.95).contains(share))
            .map(|(x, y, share)| (linear(shown.at(x, y)[0]) - share).abs())
            .collect();
        assert!(cut.len() > 50, "{}", cut.len());
        cut.iter().sum::<f64>() / cut.len() as f64
    };
    let (one, more) = (mean_off(false), mean_off(true));
    assert!(more < 0.1 && one > 0.2, "{more} of a pixel with more rays, {one} with one");
}

#[test]
fn a_mirror_in_a_maze_shows_it_round_corners_by_a_graph_camera() {
    let image = scenes::maze_by_graph((960, 720));
    let painted = |p: DVec3| fields((p.x + p.z) / 8.0, p.y / 4.0);
    let sample = |shown: &Option<support::Shown>| match shown {
        Some(shown) => (Sample { w: shown.w, normal_world: shown.normal }, painted(shown.p_world)),
        None => (Sample::EMPTY, [0; 4]),
    };
    let (samples, colour_of_samples) = image.shown.iter().map(sample).unzip();
    // The mirror stands across a corridor of the maze.
    let maze_from_mirror =
        DAffine3::from_translation(DVec3::new(0.0, 1.5, 6.5)) * DAffine3::from_rotation_y(std::f64::consts::FRAC_PI_2);
    let maze_from_now = maze_from_mirror * DAffine3::from_translation(DVec3::Z * WALL_M);
    let maze = ImpostorImage {
        kind: ImpostorKind::Environment,
        camera: image.impostor.camera().clone(),
        samples,
        colour: colour_of_samples,
        pose: Some((3, DAffine3::IDENTITY)),
    };
    let mut held = held(MIRROR, 1.5);
    held.poses_now = BTreeMap::from([(3, maze_from_now.inverse())]);
    // What the maze's image misses, or has few samples of, far away.
    show(&held, &[maze], SHARP).is_but(0.1, |x, y| {
        let (origin, direction) = (way(x, y) * WALL_M, way(x, y) * DVec3::new(1.0, 1.0, -1.0));
        let (origin, direction) = (maze_from_now.transform_point3(origin), maze_from_now.transform_vector3(direction));
        let p = image.scene.points(origin, direction, 0.0, 100.0).first()?.p_world;
        is_inner((p.x + p.z) / 8.0, p.y / 4.0, 0.1).then(|| colour(painted(p)))
    });
}

#[test]
fn images_that_are_none_are_refused_and_empty_ones_are_not_held() {
    let gpu = Gpu::block_on(Gpu::new_headless()).expect("an adapter");
    let mut impostors = Impostors::new(&gpu);
    let mut image = behind(ImpostorKind::Environment);
    image.colour.pop();
    let refused = impostors.insert(1, &image);
    assert_eq!(refused, Err(UnfitImage::Colours { colours: 256 * 256 - 1, samples: 256 * 256 }));
    let empty = plane(pinhole(DVec3::ZERO, DVec3::Z, 16), ImpostorKind::Environment, 3.0, |_, _| None);
    assert_eq!((impostors.insert(1, &empty), impostors.is_empty()), (Ok(()), true));
    impostors.insert(1, &behind(ImpostorKind::Environment)).expect("an impostor");
    assert!(!impostors.is_empty());
    impostors.insert(1, &empty).expect("an empty one takes its place");
    assert!(impostors.is_empty());
}

/// A patch of surroundings whose image has `side` times `side` pixels and one sample.
fn surroundings(side: u32) -> Patch {
    let mut mask = Mask::empty(side, side);
    mask.set(0, 0, true);
    let camera = Camera::Pinhole(Pinhole::symmetric(Rigid::IDENTITY, (side, side), 1.0, 0.1));
    let image = DepthImage {
        camera,
        depth_scale: DepthScale { w_min: 0.5, w_step: 0.0 },
        mask,
        depth: vec![0],
        normal: vec![[127, 127]],
        normal_rest: Vec::new(),
        colour_rest: Vec::new(),
        share: Vec::new(),
        ends: Vec::new(),
        colour: vec![[9, 9, 9]],
        object: vec![1],
        material: vec![0],
    };
    let (id, purpose) = (PatchId(1), Purpose::Environment);
    Patch { id, purpose, capture_time_s: 0.0, objects: Vec::new(), image }
}

#[test]
fn more_pixels_than_a_client_holds_are_left_out() {
    let gpu = least_gpu();
    for (side, count) in [(64, 1), (4096, 0)] {
        let mut held = Held::default();
        held.commit(vec![Edit::Add(Box::new(surroundings(side)))], 0.0, 0).expect("it fits");
        let mut impostors = Impostors::new(&gpu);
        impostors.rebuild(&held);
        assert_eq!(impostors.len(), count, "{side} pixels wide");
    }
}
