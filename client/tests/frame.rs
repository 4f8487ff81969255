//! The picture of a small held copy, pixel by pixel.

use camera::{Camera, Pinhole, Rigid};
use glam::DVec3;
use gpu::{Gpu, Readback};
use protocol::held::HeldPatch;
use protocol::image::octahedral_code;
use protocol::{DepthImage, DepthScale, Held, Light, Lighting, Mask, Material, Patch, PatchId, Purpose};
use surface::HeldSurfaces;
use vantage_client::draw::antialiasing::Antialias;
use vantage_client::draw::frame::{FrameRenderer, MARK, Options};
use vantage_client::draw::rest::RestView;

const SIDE: u32 = 64;
const BACKGROUND: [u8; 3] = [90, 140, 200];

fn camera() -> Pinhole {
    Pinhole::symmetric(Rigid::look_at(DVec3::ZERO, DVec3::NEG_Z), (SIDE, SIDE), 1.0, 0.05)
}

/// A wall two metres away over the lower three quarters of the view, less what `hole` takes out.
fn wall(material: u8, hole: impl Fn(u32, u32) -> bool) -> HeldPatch {
    let mut mask = Mask::empty(SIDE, SIDE);
    for (x, y) in (SIDE / 4..SIDE).flat_map(|y| (0..SIDE).map(move |x| (x, y))) {
        mask.set(x, y, !hole(x, y));
    }
    let count = mask.count();
    let image = DepthImage {
        camera: Camera::Pinhole(camera()),
        depth_scale: DepthScale { w_min: 0.5, w_step: 0.0 },
        mask,
        depth: vec![0; count],
        normal: vec![octahedral_code(glam::Vec3::Z); count],
        normal_rest: Vec::new(),
        colour_rest: Vec::new(),
        share: Vec::new(),
        ends: Vec::new(),
        colour: vec![[200, 100, 50]; count],
        object: vec![1; count],
        material: vec![material; count],
    };
    let patch = Patch { id: PatchId(1), purpose: Purpose::Eye, capture_time_s: 0.0, objects: Vec::new(), image };
    HeldPatch { patch, trims: Vec::new() }
}

fn held(patch: HeldPatch) -> Held {
    let lighting = Lighting {
        ambient: [0.25; 3],
        lights: vec![Light::Directional { direction_world: [0.0, 0.0, -1.0], irradiance: [std::f32::consts::PI; 3] }],
        background: BACKGROUND,
        burley: false,
        ..Lighting::default()
    };
    let unlit = Material { unlit: true, ..Material::default() };
    let mut held = Held::default();
    held.patches.insert(PatchId(1), patch);
    held.materials = vec![unlit, Material::default()];
    held.lighting = Some(lighting);
    held
}

struct Shown {
    pixels: Vec<[u8; 4]>,
    uncovered_share: f64,
}

impl Shown {
    fn at(&self, x: u32, y: u32) -> [u8; 3] {
        let [r, g, b, _] = self.pixels[(y * SIDE + x) as usize];
        [r, g, b]
    }
}

fn show(held: &Held, format: wgpu::TextureFormat, options: Options) -> Shown {
    show_from(&camera(), held, format, options)
}

fn show_from(camera: &Pinhole, held: &Held, format: wgpu::TextureFormat, options: Options) -> Shown {
    let gpu = Gpu::block_on(Gpu::new_headless()).expect("an adapter");
    let mut surfaces = HeldSurfaces::new(&gpu);
    surfaces.rebuild(held);
    let mut rest = RestView::new(&gpu);
    rest.rebuild(held);
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
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    let shown = vantage_client::draw::shown::Shown { rest: Some(&rest), ..(&surfaces, held).into() };
    frame.draw(&mut encoder, shown, camera, &output.create_view(&Default::default()), options);
    let mut readback = Readback::default();
    let slot = readback.texture(&output, 0, (SIDE, SIDE));
    let encoded = readback.encode(&gpu, &mut encoder);
    gpu.queue.submit([encoder.finish()]);
    frame.submitted(true);
    let pixels = encoded.map().wait(&gpu).expect("a readback").values(slot);
    gpu.wait_idle().expect("the device lives");
    Shown { pixels, uncovered_share: frame.uncovered_share().expect("a counted frame") }
}

const PLAIN: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;

#[test]
fn surfaces_are_lit_and_the_rest_is_background() {
    let options = Options { fill: false, ..Options::default() };
    let unlit = show(&held(wall(0, |_, _| false)), PLAIN, options);
    assert_eq!(unlit.at(20, 40), [200, 100, 50]);
    assert_eq!(unlit.at(20, 5), BACKGROUND);
    assert_eq!(unlit.uncovered_share, 0.25);
    let lit = show(&held(wall(1, |_, _| false)), PLAIN, options);
    // A facing light of irradiance pi: c = base * (0.25 + 1), shown = sRGB(1 - exp(-c)).
    let expected = [200.0_f32, 100.0, 50.0].map(|value| {
        let linear = ((value / 255.0 + 0.055) / 1.055).powf(2.4);
        let shown = 1.0 - (-1.25 * linear).exp();
        (1.055 * shown.powf(1.0 / 2.4) - 0.055) * 255.0
    });
    for (found, expected) in lit.at(20, 40).into_iter().zip(expected) {
        assert!((f32::from(found) - expected).abs() <= 1.0, "{found} for {expected}");
    }
}

#[test]
fn a_target_that_encodes_shows_the_same() {
    let options = Options::default();
    let plain = show(&held(wall(1, |_, _| false)), PLAIN, options);
    let encoding = show(&held(wall(1, |_, _| false)), wgpu::TextureFormat::Rgba8UnormSrgb, options);
    for (a, b) in plain.pixels.iter().zip(&encoding.pixels) {
        assert!(a.iter().zip(b).all(|(&a, &b)| a.abs_diff(b) <= 1), "{a:?} {b:?}");
    }
}

#[test]
fn small_holes_are_filled_and_the_sky_is_not() {
    let crack = |x: u32, y: u32| x == 30 && y > 20 || (40..44).contains(&x) && (40..44).contains(&y);
    let missing = (SIDE - 21 + 16) as f64 + 0.25 * f64::from(SIDE * SIDE);
    let filled = show(&held(wall(0, crack)), PLAIN, Options::default());
    assert_eq!(filled.uncovered_share, missing / f64::from(SIDE * SIDE), "counted before filling");
    for (x, y) in [(30, 40), (30, 62), (41, 42), (43, 43)] {
        assert_eq!(filled.at(x, y), [200, 100, 50], "{x} {y}");
    }
    for y in 0..SIDE / 4 - 2 {
        for x in 0..SIDE {
            assert_eq!(filled.at(x, y), BACKGROUND, "{x} {y}");
        }
    }
    let open = show(&held(wall(0, crack)), PLAIN, Options { fill: false, ..Options::default() });
    assert_eq!(open.at(30, 40), BACKGROUND);
    let marked = show(&held(wall(0, crack)), PLAIN, Options { mark_uncovered: true, ..Options::default() });
    assert_eq!((marked.at(30, 40), marked.at(5, 5), marked.at(20, 40)), (MARK, MARK, [200, 100, 50]));
}

/// Says that each sample's surface ends half-way to the next pixel wherever nothing is there.
fn ending(mut wall: HeldPatch) -> HeldPatch {
    let count = wall.patch.image.sample_count();
    wall.patch.image.settle_ends(vec![0x4444; count]);
    wall
}

#[test]
fn a_gap_between_what_ends_stays_open() {
    let gap = |x: u32, y: u32| (40..44).contains(&x) && (40..44).contains(&y);
    let filled = show(&held(wall(0, gap)), PLAIN, Options::default());
    let open = show(&held(ending(wall(0, gap))), PLAIN, Options::default());
    for (x, y) in (40..44).flat_map(|y| (40..44).map(move |x| (x, y))) {
        assert_eq!((filled.at(x, y), open.at(x, y)), ([200, 100, 50], BACKGROUND), "{x} {y}");
    }
    assert_eq!(open.at(39, 42), [200, 100, 50], "beside it");
}

#[test]
fn a_hole_beside_what_ends_shows_what_goes_on_behind() {
    // A wall half as far to the left, and a strip that nobody saw between the two.
    let mut nearer = ending(wall(0, |x, _| x >= 20));
    (nearer.patch.id, nearer.patch.image.depth_scale.w_min) = (PatchId(2), 1.0);
    nearer.patch.image.object.fill(2);
    nearer.patch.image.colour.fill([10, 250, 90]);
    let mut both = held(wall(0, |x, _| x < 22));
    both.patches.insert(PatchId(2), nearer);
    let shown = show(&both, PLAIN, Options::default());
    assert_eq!((shown.at(19, 40), shown.at(22, 40)), ([10, 250, 90], [200, 100, 50]));
    assert_eq!((shown.at(20, 40), shown.at(21, 40)), ([200, 100, 50], [200, 100, 50]), "the farther one's");
}

/// A mix of two sRGB-encoded colours in linear light, `share` of the first.
fn mixed(a: [u8; 3], b: [u8; 3], share: f32) -> [u8; 3] {
    let linear = |code: u8| ((f32::from(code) / 255.0 + 0.055) / 1.055).powf(2.4);
    std::array::from_fn(|channel| {
        let mix = share * linear(a[channel]) + (1.0 - share) * linear(b[channel]);
        ((1.055 * mix.powf(1.0 / 2.4) - 0.055) * 255.0).round() as u8
    })
}

fn antialiased() -> Options {
    Options { fill: false, antialias: Antialias::On, smoothing: surface::Smoothing::None, ..Options::default() }
}

fn near(a: [u8; 3], b: [u8; 3]) -> bool {
    a.iter().zip(b).all(|(&a, b)| a.abs_diff(b) <= 1)
}

#[test]
fn an_edge_through_a_pixel_is_a_mix_in_linear_light() {
    let held = held(wall(0, |_, _| false));
    // The wall's upper edge runs through the middle of a row.
    let mut beside = camera();
    beside.centre_px.y += 0.5;
    let row = SIDE / 4;
    let stairs = show_from(&beside, &held, PLAIN, Options { antialias: Antialias::Off, ..antialiased() });
    assert!([[200, 100, 50], BACKGROUND].contains(&stairs.at(20, row)));
    let smooth = show_from(&beside, &held, PLAIN, antialiased());
    let half = mixed([200, 100, 50], BACKGROUND, 0.5);
    assert!(near(smooth.at(20, row), half), "{:?} for {half:?}", smooth.at(20, row));
    assert_eq!((smooth.at(20, row + 2), smooth.at(20, row - 2)), ([200, 100, 50], BACKGROUND));
}

#[test]
fn a_view_at_rest_shows_its_pixels_by_their_parts() {
    // Of every pixel 12 of 16 are the wall; of the rest another wall has half where x < 32.
    let mut first = wall(0, |_, _| false);
    first.patch.purpose = Purpose::Rest;
    first.patch.image.share = vec![48; first.patch.image.sample_count()];
    let mut second = wall(0, |x, _| x >= 32);
    (second.patch.id, second.patch.purpose) = (PatchId(2), Purpose::Rest);
    second.patch.image.share = vec![8; second.patch.image.sample_count()];
    second.patch.image.colour.fill([10, 250, 90]);
    let mut held = held(first);
    held.patches.insert(PatchId(2), second);
    let shown = show(&held, PLAIN, antialiased());
    let beside = mixed([200, 100, 50], BACKGROUND, 0.75);
    assert!(near(shown.at(50, 40), beside), "{:?} for {beside:?}", shown.at(50, 40));
    let both = mixed([200, 100, 50], mixed([10, 250, 90], BACKGROUND, 0.5), 0.75);
    assert!(near(shown.at(20, 40), both), "{:?} for {both:?}", shown.at(20, 40));
    assert_eq!(shown.at(20, 5), BACKGROUND);
    let mut elsewhere = camera();
    elsewhere.world_from_eye.translation.x += 1e-3;
    let moved = show_from(&elsewhere, &held, PLAIN, antialiased());
    assert_eq!(moved.at(20, 40), BACKGROUND, "it is of another camera");
}
