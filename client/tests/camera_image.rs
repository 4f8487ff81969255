//! The image of a camera that bends, shown as it is: pixel by pixel where it fits, and whole in the middle where it does not.

use std::sync::Arc;

use camera::{
    Camera, FaceDescription, FrustumDescription, GraphCamera, GraphDescription, HalfSpace, ImagePoint, Pinhole, Rigid,
    RootDescription,
};
use glam::{DVec3, Vec3};
use gpu::{Gpu, Readback};
use protocol::held::HeldPatch;
use protocol::image::octahedral_code;
use protocol::{DepthImage, DepthScale, Held, Light, Lighting, Mask, Material, Patch, PatchId, Purpose};
use vantage_client::draw::picture::{Picture, PictureOptions};

const SIZE: (u32, u32) = (48, 32);
const BACKGROUND: [u8; 3] = [90, 140, 200];
const ORIGIN: DVec3 = DVec3::new(1e6, 20.0, -3e5);

/// Looks along -z, and after two metres on to the right.
fn bent() -> GraphCamera {
    let world_from_eye = Rigid::look_along(ORIGIN, DVec3::NEG_Z);
    let pinhole = Pinhole::symmetric(world_from_eye, SIZE, 1.0, 0.05);
    let end = HalfSpace { point: ORIGIN + DVec3::NEG_Z * 2.0, outward: DVec3::NEG_Z };
    // What the view sees at two metres.
    let (half_x, half_y) = (2.0 * 0.5_f64.tan() * 1.5, 2.0 * 0.5_f64.tan());
    let corner = |(x, y): (f64, f64)| ORIGIN + DVec3::new(x * half_x, y * half_y, -2.0);
    let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(corner).to_vec();
    let on = FrustumDescription {
        name: "on".to_owned(),
        centre: ORIGIN + DVec3::new(-1.0, 0.0, -0.3),
        faces: vec![FaceDescription { parent: "root".to_owned(), corners }],
        limits: vec![HalfSpace { point: ORIGIN + DVec3::NEG_Z * 9.0, outward: DVec3::NEG_Z }],
    };
    let root = RootDescription { name: "root".to_owned(), pinhole, limits: vec![end] };
    GraphCamera::from_description(&GraphDescription { root, frusta: vec![on], min_face_px: 0.0 }).expect("sound")
}

fn colour(x: u32, y: u32) -> [u8; 3] {
    [(40 + 4 * x) as u8, (30 + 6 * y) as u8, ((x * y) % 200) as u8]
}

/// A wall a metre before the eye in the left half of the image, and one behind the bend in the right; the uppermost row shows nothing.
fn image(camera: &GraphCamera) -> DepthImage {
    let mut mask = Mask::empty(SIZE.0, SIZE.1);
    let (mut depth, mut colours) = (Vec::new(), Vec::new());
    let behind = camera.frusta()[1].image_from_world(ORIGIN + DVec3::NEG_Z * 5.0).expect("in view");
    let depth_scale = DepthScale { w_min: behind.w as f32, w_step: 1.0 - behind.w as f32 };
    for (x, y) in (1..SIZE.1).flat_map(|y| (0..SIZE.0).map(move |x| (x, y))) {
        mask.set(x, y, true);
        depth.push(u16::from(x < SIZE.0 / 2));
        colours.push(colour(x, y));
    }
    let count = mask.count();
    DepthImage {
        camera: Camera::Graph(Arc::new(camera.clone())),
        depth_scale,
        mask,
        depth,
        normal: vec![octahedral_code(Vec3::Z); count],
        normal_rest: Vec::new(),
        colour_rest: Vec::new(),
        share: Vec::new(),
        ends: Vec::new(),
        colour: colours,
        object: vec![1; count],
        material: vec![0; count],
    }
}

fn held(image: DepthImage, unlit: bool, lights: Vec<Light>) -> Held {
    let patch = Patch { id: PatchId(7), purpose: Purpose::Camera, capture_time_s: 0.0, objects: Vec::new(), image };
    let mut held = Held::default();
    held.patches.insert(PatchId(7), HeldPatch { patch, trims: Vec::new() });
    held.materials = vec![Material { unlit, ..Material::default() }];
    held.lighting =
        Some(Lighting { ambient: [0.0; 3], lights, background: BACKGROUND, burley: false, ..Lighting::default() });
    held
}

/// What a viewer with an output of this size sees, wherever it looks.
fn show(held: &Held, size_px: (u32, u32)) -> Vec<[u8; 4]> {
    let gpu = Gpu::block_on(Gpu::new_headless()).expect("an adapter");
    let format = wgpu::TextureFormat::Rgba8Unorm;
    let mut picture = Picture::new(&gpu, format, PictureOptions::default()).expect("the shaders compile");
    picture.rebuild(held);
    let output = gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: None,
        size: wgpu::Extent3d { width: size_px.0, height: size_px.1, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
        view_formats: &[],
    });
    let elsewhere = Pinhole::symmetric(Rigid::look_along(DVec3::ZERO, DVec3::X), size_px, 1.0, 0.05);
    picture.draw(held, &elsewhere, &output.create_view(&wgpu::TextureViewDescriptor::default()));
    let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    let mut readback = Readback::default();
    let slot = readback.texture(&output, 0, size_px);
    let encoded = readback.encode(&gpu, &mut encoder);
    gpu.queue.submit([encoder.finish()]);
    encoded.map().wait(&gpu).expect("a readback").values(slot)
}

fn linear_from_srgb(byte: u8) -> f32 {
    let value = f32::from(byte) / 255.0;
    if value <= 0.04045 { value / 12.92 } else { ((value + 0.055) / 1.055).powf(2.4) }
}

fn srgb_from_linear(linear: f32) -> u8 {
    let value = if linear <= 0.003_130_8 { linear * 12.92 } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 };
    (value * 255.0).round() as u8
}

/// `expected` by the place in the picture, to a step of its bytes.
fn compare(pixels: &[[u8; 4]], (width, height): (u32, u32), expected: impl Fn(u32, u32) -> [u8; 3]) {
    for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
        let [r, g, b, _] = pixels[(y * width + x) as usize];
        let (found, expected) = ([r, g, b], expected(x, y));
        let is_near = found.iter().zip(expected).all(|(found, expected)| found.abs_diff(expected) <= 1);
        assert!(is_near, "{x} {y}: {found:?} for {expected:?}");
    }
}

#[test]
fn it_is_shown_pixel_by_pixel_where_it_fits() {
    let held = held(image(&bent()), true, Vec::new());
    compare(&show(&held, SIZE), SIZE, |x, y| if y == 0 { BACKGROUND } else { colour(x, y) });
}

#[test]
fn it_is_whole_in_the_middle_of_a_larger_output() {
    let held = held(image(&bent()), true, Vec::new());
    let size = (SIZE.0 + 10, SIZE.1);
    let beside = |x: u32| x < 5 || x >= SIZE.0 + 5;
    compare(&show(&held, size), size, |x, y| if y == 0 || beside(x) { BACKGROUND } else { colour(x - 5, y) });
}

#[test]
fn it_is_lit_where_its_bent_rays_meet_the_scene() {
    let camera = bent();
    let image = image(&camera);
    let lamp_world = ORIGIN + DVec3::new(0.5, 0.4, -3.0);
    let intensity = [6.0_f32, 5.0, 4.0];
    let light = Light::Point {
        position_world: lamp_world.to_array(),
        intensity,
        direction_world: [0.0, 0.0, -1.0],
        spot_cos: [-1.0, -2.0],
        range_m: f32::INFINITY,
        area: None,
    };
    let place = |x: u32, y: u32| {
        let w = if x < SIZE.0 / 2 { 1.0 } else { f64::from(image.depth_scale.w(0)) };
        let point = ImagePoint { u: f64::from(x) + 0.5, v: f64::from(y) + 0.5, w };
        camera.world_from_image(point, camera.frustum_at(point).expect("in view")).expect("in view")
    };
    // Lambert: base / pi * intensity * cosine / distance².
    let expected = |x: u32, y: u32| {
        let to_lamp = lamp_world - place(x, y);
        let arriving = (to_lamp.normalize().z.max(0.0) / to_lamp.length_squared()) as f32;
        let base = colour(x, y).map(linear_from_srgb);
        std::array::from_fn(|k| {
            srgb_from_linear(1.0 - (-base[k] * intensity[k] * arriving / std::f32::consts::PI).exp())
        })
    };
    let held = held(image.clone(), false, vec![light]);
    let pixels = show(&held, SIZE);
    let lit = |x: u32| pixels[(SIZE.1 / 2 * SIZE.0 + x) as usize][1];
    assert!(lit(SIZE.0 / 2 + 4) > lit(4) + 20, "the lamp is behind the bend: {} {}", lit(4), lit(SIZE.0 / 2 + 4));
    compare(&pixels, SIZE, |x, y| if y == 0 { BACKGROUND } else { expected(x, y) });
}
