//! What reflections cost: a pot by a single-pole camera in 256 x 256 pixels, in a mirror that it fills much of.
//! `cargo test -p vantage-client --test reflect_cost -- --nocapture` prints steps and times.

extern crate impostor as vantage_impostor;

#[path = "../../impostor/tests/support/mod.rs"]
mod support;

use std::time::Instant;

use camera::{Camera, Pinhole, Rigid};
use glam::DVec3;
use gpu::Gpu;
use impostor::Sample;
use protocol::held::HeldPatch;
use protocol::image::octahedral_code;
use protocol::{DepthImage, DepthScale, Held, Lighting, Mask, Material, Patch, PatchId, Purpose};
use support::{Image, scenes};
use surface::HeldSurfaces;
use vantage_client::frame::{FrameRenderer, Options};
use vantage_client::reflect::{Bounces, ImpostorImage, ImpostorKind, Impostors, Search, Settings};

const SIDES: [u32; 1] = [96];
const FRAMES: usize = 9;

/// From beside the pot into a mirror that stands where the pot's camera does.
fn view(side: u32) -> Pinhole {
    Pinhole::symmetric(Rigid::look_along(DVec3::new(0.3, 0.6, 1.8), DVec3::Z), (side, side), 0.7, 0.05)
}

const MIRROR_Z_M: f64 = 3.0;

/// The mirror, which fills the view.
fn held(side: u32) -> Held {
    let mut mask = Mask::empty(side, side);
    (0..side).flat_map(|y| (0..side).map(move |x| (x, y))).for_each(|(x, y)| mask.set(x, y, true));
    let count = mask.count();
    let w_min = (MIRROR_Z_M - view(side).world_from_eye.translation.z).recip() as f32;
    let image = DepthImage {
        camera: Camera::Pinhole(view(side)),
        depth_scale: DepthScale { w_min, w_step: 0.0 },
        mask,
        depth: vec![0; count],
        normal: vec![octahedral_code(glam::Vec3::NEG_Z); count],
        colour: vec![[255; 3]; count],
        object: vec![1; count],
        material: vec![0; count],
    };
    let patch = Patch { id: PatchId(1), purpose: Purpose::Eye, capture_time_s: 0.0, objects: Vec::new(), image };
    let mut held = Held::default();
    held.patches.insert(PatchId(1), HeldPatch { patch, trims: Vec::new() });
    held.materials = vec![Material { metallic: 1.0, roughness: 0.0, ..Material::default() }, Material::default()];
    held.lighting = Some(Lighting { ambient: [0.5; 3], lights: Vec::new(), background: [90, 140, 200], burley: false });
    held
}

fn pot(image: &Image) -> ImpostorImage {
    let sample = |shown: &Option<support::Shown>| {
        shown.map_or(Sample::EMPTY, |shown| Sample { w: shown.w, normal_world: shown.normal })
    };
    ImpostorImage {
        kind: ImpostorKind::Object(9),
        camera: image.impostor.camera().clone(),
        samples: image.shown.iter().map(sample).collect(),
        colour: vec![[200, 80, 40, 1]; image.shown.len()],
        pose: None,
    }
}

struct Stage {
    gpu: Gpu,
    side: u32,
    held: Held,
    surfaces: HeldSurfaces,
    impostors: Impostors,
    frame: FrameRenderer,
    output: wgpu::TextureView,
}

impl Stage {
    fn new(side: u32, impostor: &ImpostorImage) -> Stage {
        let gpu = Gpu::block_on(Gpu::new_headless()).expect("an adapter");
        let format = wgpu::TextureFormat::Rgba8Unorm;
        let output = gpu.device.create_texture(&wgpu::TextureDescriptor {
            label: None,
            size: wgpu::Extent3d { width: side, height: side, depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT,
            view_formats: &[],
        });
        let held = held(side);
        let (mut surfaces, mut impostors) = (HeldSurfaces::new(&gpu), Impostors::new(&gpu));
        surfaces.rebuild(&held);
        impostors.insert(1, impostor).expect("an impostor");
        let frame = FrameRenderer::new(&gpu, format).expect("the shaders compile");
        let output = output.create_view(&Default::default());
        Stage { gpu, side, held, surfaces, impostors, frame, output }
    }

    /// Milliseconds of light, reflections and all behind them.
    fn draw(&mut self, settings: Settings, reflects: bool) -> f64 {
        let (view, options) = (view(self.side), Options { reflect: settings, ..Options::default() });
        let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
        self.frame.draw_surfaces(&mut encoder, &self.surfaces, &view, options);
        self.gpu.queue.submit([encoder.finish()]);
        self.gpu.wait_idle().expect("the device lives");
        let begin = Instant::now();
        let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
        let impostors = reflects.then_some(&self.impostors);
        self.frame.draw_reflecting(&mut encoder, (&self.held, impostors), &view, &self.output, options);
        self.gpu.queue.submit([encoder.finish()]);
        self.frame.submitted();
        self.gpu.wait_idle().expect("the device lives");
        begin.elapsed().as_secs_f64() * 1e3
    }

    fn median_ms(&mut self, settings: Settings, reflects: bool) -> f64 {
        let mut times: Vec<f64> = (0..FRAMES).map(|_| self.draw(settings, reflects)).collect();
        times.sort_by(f64::total_cmp);
        times[FRAMES / 2]
    }
}

#[test]
fn a_ray_takes_a_few_steps() {
    let impostor = pot(&scenes::pot_by_spoc(256));
    for side in SIDES {
        let mut stage = Stage::new(side, &impostor);
        let mut settings = Settings { bounces: Bounces::One, fade: false, ..Settings::default() };
        println!("{side} x {side}, without reflections: {:.1} ms", stage.median_ms(settings, false));
        let mut means = Vec::new();
        for search in [Search::EnvironmentMap, Search::Whole, Search::Half, Search::Quarter] {
            settings.search = search;
            stage.draw(Settings { count_steps: true, ..settings }, true);
            let sum = stage.frame.steps().expect("a readback").expect("counted");
            assert_eq!(sum.walks, f64::from(side * side), "all of the view is a mirror");
            means.push(sum.steps / sum.walks);
            let (sharp, faded) = (Settings { filter: false, ..settings }, Settings { fade: true, ..settings });
            let (ms, sharp, faded) =
                (stage.median_ms(settings, true), stage.median_ms(sharp, true), stage.median_ms(faded, true));
            println!(
                "  {search:?}: {:.1} steps a ray, {ms:.1} ms; not filtered {sharp:.1}, with fading {faded:.1}",
                sum.steps / sum.walks
            );
        }
        // The papers' 22, 31 and 48 (section 7.2), with all the rays that pass by.
        assert_eq!(means[0], 1.0);
        assert!(means[1] > 3.0 && means[1] <= means[2] && means[2] <= means[3], "{means:?}");
        assert!(means[1] < 22.0 && means[2] < 31.0 && means[3] < 48.0, "{means:?}");
    }
}
