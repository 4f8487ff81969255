//! Frames of key pictures beside whole ones.

mod common;

use std::thread::sleep;
use std::time::Duration;

use camera::Pinhole;
use common::{Block, FLOOR, SIDE, World, camera, lit_by};
use glam::{DQuat, DVec3};
use gpu::{Gpu, Readback};
use protocol::{Held, Light};
use vantage_client::draw::picture::{Picture, PictureOptions};
use vantage_client::draw::steady::{FrameRate, Resolution};
use vantage_client::receive::follow::Follow;

const BOX: Block = (DVec3::new(-1.0, 0.0, -1.0), DVec3::new(1.0, 1.5, 1.0));
/// Longer than an eye stands that is at rest.
const REST: Duration = Duration::from_millis(300);
/// A key picture never takes so many frames.
const MANY: usize = 20;

struct Screen {
    gpu: Gpu,
    picture: Picture,
    target: wgpu::Texture,
}

impl Screen {
    /// On a device that says that it is slow.
    fn new(held: &Held, frame_rate: FrameRate) -> Screen {
        let mut gpu = Gpu::block_on(Gpu::new_headless()).expect("an adapter");
        gpu.caps.software = true;
        let format = wgpu::TextureFormat::Rgba8Unorm;
        let options = PictureOptions { frame_rate, ..PictureOptions::default() };
        let mut picture = Picture::new(&gpu, format, options).expect("the shaders compile");
        picture.rebuild(held);
        let target = gpu.device.create_texture(&wgpu::TextureDescriptor {
            label: None,
            size: wgpu::Extent3d { width: SIDE, height: SIDE, depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
            view_formats: &[],
        });
        Screen { gpu, picture, target }
    }

    fn draw(&mut self, held: &Held, camera: &Pinhole) -> Vec<[u8; 4]> {
        self.picture.draw(held, camera, &self.target.create_view(&Default::default()));
        let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
        let mut readback = Readback::default();
        let slot = readback.texture(&self.target, 0, (SIDE, SIDE));
        let encoded = readback.encode(&self.gpu, &mut encoder);
        self.gpu.queue.submit([encoder.finish()]);
        encoded.map().wait(&self.gpu).expect("a readback").values(slot)
    }

    /// What is seen once the eye has stood for a while.
    fn draw_at_rest(&mut self, held: &Held, camera: &Pinhole) -> Vec<[u8; 4]> {
        self.draw(held, camera);
        sleep(REST);
        self.draw(held, camera)
    }
}

fn boxes() -> (World, Held) {
    let world = World { origin: DVec3::ZERO, scale: 1.0, side_px: 192 };
    let light = Light::Directional { direction_world: [-0.3, -0.8, -0.5], irradiance: [2.0; 3] };
    (world, world.held(&[FLOOR, BOX], lit_by(vec![light])))
}

/// A step to the side with a turn of some degrees, by shares of it.
fn moved(camera: &Pinhole, share: f64) -> Pinhole {
    let mut camera = *camera;
    camera.world_from_eye.translation += share * DVec3::new(0.3, 0.05, -0.1);
    camera.world_from_eye.rotation = DQuat::from_rotation_y(share * 0.08) * camera.world_from_eye.rotation;
    camera
}

/// Of red, away from the border, where something comes into view that no picture before holds.
fn difference(a: &[[u8; 4]], b: &[[u8; 4]]) -> f64 {
    let inside = |pixel: &u32| [pixel % SIDE, pixel / SIDE].iter().all(|at| (SIDE / 8..SIDE - SIDE / 8).contains(at));
    let of_pixel = |pixel: u32| f64::from(a[pixel as usize][0].abs_diff(b[pixel as usize][0]));
    (0..SIDE * SIDE).filter(inside).map(of_pixel).sum::<f64>() / f64::from(SIDE * SIDE)
}

#[test]
fn at_rest_everything_is_seen_as_a_whole_and_then_nothing_is_drawn() {
    let (world, held) = boxes();
    let camera = camera(&world);
    let whole = Screen::new(&held, FrameRate::Free).draw(&held, &camera);
    let mut steady = Screen::new(&held, FrameRate::Held);
    for share in [0.0, 0.1, 0.2, 0.3] {
        steady.draw(&held, &moved(&camera, share));
        assert!(steady.picture.goes_on());
    }
    let at_rest = steady.draw_at_rest(&held, &camera);
    assert!(at_rest == whole, "the picture differs by {}", difference(&at_rest, &whole));
    assert!(!steady.picture.goes_on() && steady.picture.is_ready());
    assert!(matches!(steady.picture.resolution(), Resolution::Keys(_)), "the device has not become faster");
}

#[test]
fn between_key_pictures_the_last_one_is_seen_from_where_the_eye_is() {
    let (world, held) = boxes();
    let before = camera(&world);
    let mut turned = before;
    turned.world_from_eye.rotation = DQuat::from_rotation_y(0.08) * before.world_from_eye.rotation;
    // A turn is exact but for what comes into view; what a step uncovers is stretched.
    for (name, after, most) in [("turn", turned, 0.3), ("step", moved(&before, 1.0), 0.55)] {
        let mut whole = Screen::new(&held, FrameRate::Free);
        let (whole_before, whole_after) = (whole.draw(&held, &before), whole.draw(&held, &after));
        let mut steady = Screen::new(&held, FrameRate::Held);
        steady.draw_at_rest(&held, &before);
        let shown = steady.draw(&held, &after);
        assert!(!steady.picture.is_ready(), "the next key picture is not there yet");
        let (stale, found) = (difference(&whole_before, &whole_after), difference(&shown, &whole_after));
        println!("{name}: the picture before differs by {stale:.2}, what is shown by {found:.2}");
        assert!(found < most * stale, "{name}: what is shown differs by {found}, the picture before by {stale}");
    }
}

#[test]
fn key_pictures_end_and_updates_come_between_two() {
    let (world, held) = boxes();
    let camera = camera(&world);
    let mut steady = Screen::new(&held, FrameRate::Held);
    steady.draw_at_rest(&held, &camera);
    let mut ready = Vec::new();
    for step in 0..3 * MANY {
        steady.draw(&held, &moved(&camera, step as f64 / MANY as f64));
        ready.push(steady.picture.is_ready());
    }
    let longest = ready.split(|&is_ready| is_ready).map(<[bool]>::len).max().unwrap_or(0);
    assert!((1..MANY).contains(&longest), "{ready:?}");
}
