//! A square that is held as its triangles, pixel by pixel.

use std::sync::Arc;

use camera::{Camera, Pinhole, Rigid};
use glam::{DAffine3, DVec3};
use gpu::{Gpu, Readback};
use protocol::body::{Body, Clip, Skin, Wrap};
use protocol::held::Edit;
use protocol::{DepthImage, DepthScale, Held, Instance, Lighting, Mask, Material, ObjectPose, Patch, PatchId, Purpose};
use surface::HeldSurfaces;
use vantage_client::draw::bodies::Bodies;
use vantage_client::draw::frame::{FrameRenderer, Options};
use vantage_client::draw::shown::Shown;

const SIDE: u32 = 64;
const BACKGROUND: [u8; 3] = [90, 140, 200];
const PERIOD_S: f64 = 2.0;
/// Far from the origin nothing is otherwise.
const PLACE: DVec3 = DVec3::new(3e6, -20.0, 1e6);

fn camera(eye: DVec3, at: DVec3) -> Pinhole {
    Pinhole::symmetric(Rigid::look_at(PLACE + eye, PLACE + at), (SIDE, SIDE), std::f64::consts::FRAC_PI_2, 0.05)
}

/// Two metres before the square, which fills the middle half of the view.
fn front() -> Pinhole {
    camera(DVec3::Z * 2.0, DVec3::ZERO)
}

/// Red and green above, nothing and blue below.
fn atlas() -> DepthImage {
    let mut mask = Mask::empty(2, 2);
    [(0, 0), (1, 0), (1, 1)].into_iter().for_each(|(x, y)| mask.set(x, y, true));
    DepthImage {
        camera: Camera::Pinhole(Pinhole::symmetric(Rigid::IDENTITY, (2, 2), 1.0, 1.0)),
        depth_scale: DepthScale { w_min: 1.0, w_step: 0.0 },
        mask,
        depth: vec![0; 3],
        normal: vec![[127; 2]; 3],
        normal_rest: Vec::new(),
        colour_rest: Vec::new(),
        share: Vec::new(),
        ends: Vec::new(),
        colour: vec![[255, 0, 0], [0, 255, 0], [0, 0, 255]],
        object: vec![0; 3],
        material: vec![0; 3],
    }
}

/// Two metres wide and high in the plane z = 0; its bone goes a metre along x in half of the period, and back at once.
fn square(double_sided: bool) -> Body {
    let moment = |x: i32| [1000, 0, 0, x, 0, 1000, 0, 0, 0, 0, 1000, 0];
    let clip = Clip {
        period_s: PERIOD_S,
        bones: 1,
        linear_step: 1e-3,
        offset_step: 1e-3,
        codes: [moment(0), moment(1000), moment(2000)].concat(),
    };
    let all = u16::MAX;
    Body {
        positions: vec![[0, 0, 0], [all, 0, 0], [all, all, 0], [0, all, 0]],
        least: [-1.0, -1.0, 0.0],
        step: [2.0 / f32::from(all), 2.0 / f32::from(all), 0.0],
        normals: vec![[511; 2]; 4],
        uvs: vec![[0, all], [all, all], [all, 0], [0, 0]],
        least_uv: [0.0; 2],
        step_uv: [1.0 / f32::from(all); 2],
        colours: Vec::new(),
        indices: vec![0, 1, 2, 0, 2, 3],
        double_sided,
        cut_out: true,
        wrap: [Wrap::Clamp; 2],
        nearest: true,
        bounds: [[-1.0, -1.0, 0.0], [3.0, 1.0, 0.0]],
        skin: Some(Skin { bones: vec![[0; 4]; 4], shares: vec![[all, 0, 0, 0]; 4], clip }),
    }
}

/// White, but for a texel in its middle.
fn pierced() -> DepthImage {
    const SIDE_PX: u32 = 15;
    let mut mask = Mask::empty(SIDE_PX, SIDE_PX);
    let texels = (0..SIDE_PX).flat_map(|y| (0..SIDE_PX).map(move |x| (x, y)));
    texels.filter(|&texel| texel != (7, 7)).for_each(|(x, y)| mask.set(x, y, true));
    let count = mask.count();
    DepthImage {
        camera: Camera::Pinhole(Pinhole::symmetric(Rigid::IDENTITY, (SIDE_PX, SIDE_PX), 1.0, 1.0)),
        mask,
        depth: vec![0; count],
        normal: vec![[127; 2]; count],
        colour: vec![[255; 3]; count],
        object: vec![0; count],
        material: vec![0; count],
        ..atlas()
    }
}

fn held(body: Body) -> Held {
    held_with(atlas(), body)
}

fn held_with(atlas: DepthImage, body: Body) -> Held {
    let id = PatchId(1);
    let patch = Patch { id, purpose: Purpose::Body, capture_time_s: 0.0, objects: Vec::new(), image: atlas };
    let pose = ObjectPose { object: 4, world_from_object: DAffine3::from_translation(PLACE) };
    let edits = vec![
        Edit::Materials(vec![Material { unlit: true, ..Material::default() }]),
        Edit::Light(Box::new(Lighting { background: BACKGROUND, ..Lighting::default() })),
        Edit::Add(Box::new(patch)),
        Edit::Body(id, Arc::new(body)),
        Edit::Place(id, vec![Instance { pose, tint: [255; 3] }]),
    ];
    let mut held = Held::default();
    held.commit(edits, 0.0, 0).expect("whole");
    held
}

fn shown(held: &Held, camera: &Pinhole, scene_time_s: f64) -> impl Fn(u32, u32) -> [u8; 3] + use<> {
    let gpu = Gpu::block_on(Gpu::new_headless()).expect("an adapter");
    let mut bodies = Bodies::new(&gpu);
    bodies.rebuild(held);
    bodies.show_at(scene_time_s);
    let surfaces = HeldSurfaces::new(&gpu);
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
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    let shown = Shown { bodies: Some(&bodies), ..(&surfaces, held).into() };
    frame.draw(&mut encoder, shown, camera, &output.create_view(&Default::default()), Options::default());
    let mut readback = Readback::default();
    let slot = readback.texture(&output, 0, (SIDE, SIDE));
    let encoded = readback.encode(&gpu, &mut encoder);
    gpu.queue.submit([encoder.finish()]);
    let pixels: Vec<[u8; 4]> = encoded.map().wait(&gpu).expect("a readback").values(slot);
    move |x, y| {
        let [red, green, blue, _] = pixels[(y * SIDE + x) as usize];
        [red, green, blue]
    }
}

#[test]
fn a_square_shows_its_image_where_its_bone_has_it() {
    let held = held(square(false));
    let at_first = shown(&held, &front(), 0.0);
    assert_eq!([at_first(24, 24), at_first(40, 24), at_first(40, 40)], [[255, 0, 0], [0, 255, 0], [0, 0, 255]]);
    // The quarter that is cut out, and beside it: no filling goes on into either.
    assert_eq!([at_first(24, 40), at_first(14, 30), at_first(50, 30)], [BACKGROUND; 3]);
    // A quarter of the period later it is half a metre to the right, eight pixels.
    for time_s in [0.5, 0.5 + PERIOD_S, 0.5 - 3.0 * PERIOD_S] {
        let later = shown(&held, &front(), time_s);
        assert_eq!([later(20, 24), later(32, 24), later(50, 24)], [BACKGROUND, [255, 0, 0], [0, 255, 0]], "{time_s} s");
    }
}

#[test]
fn only_what_has_two_sides_shows_from_behind() {
    let behind = camera(DVec3::Z * -2.0, DVec3::ZERO);
    let one = shown(&held(square(false)), &behind, 0.0);
    assert_eq!([one(24, 24), one(40, 24), one(24, 40)], [BACKGROUND; 3]);
    let two = shown(&held(square(true)), &behind, 0.0);
    assert_eq!([two(24, 24), two(40, 24), two(24, 40)], [[0, 255, 0], [255, 0, 0], [0, 0, 255]]);
}

#[test]
fn a_gap_in_a_body_is_no_hole_to_be_filled() {
    let pierced = shown(&held_with(pierced(), square(false)), &front(), 0.0);
    assert_eq!([pierced(31, 31), pierced(28, 31)], [BACKGROUND, [255; 3]]);
}

#[test]
fn images_too_large_are_left_out_before_they_are_made() {
    let gpu = Gpu::block_on(Gpu::new_headless()).expect("an adapter");
    let mut bodies = Bodies::new(&gpu);
    // A bit a pixel on the wire: 8192 x 8192 of them are 8 MiB, and would be some hundreds on the GPU.
    let large = DepthImage {
        camera: Camera::Pinhole(Pinhole::symmetric(Rigid::IDENTITY, (8192, 8192), 1.0, 1.0)),
        mask: Mask::empty(8192, 8192),
        depth: Vec::new(),
        normal: Vec::new(),
        colour: Vec::new(),
        object: Vec::new(),
        material: Vec::new(),
        ..atlas()
    };
    bodies.rebuild(&held_with(large, square(false)));
    assert_eq!(bodies.len(), 0);
    bodies.rebuild(&held(Body { indices: Vec::new(), ..square(false) }));
    assert_eq!(bodies.len(), 0, "nothing to draw");
    bodies.rebuild(&held(square(false)));
    assert_eq!(bodies.len(), 1);
}
