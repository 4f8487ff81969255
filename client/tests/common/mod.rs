//! Held copies of boxes, and what a client draws of them.
#![allow(dead_code)] // each test file uses its part

use camera::{Camera, Pinhole, Rigid};
use glam::DVec3;
use gpu::{Gpu, Readback};
use protocol::held::HeldPatch;
use protocol::image::octahedral_code;
use protocol::{DepthImage, DepthScale, Held, Light, Lighting, Mask, Material, Patch, PatchId, Purpose};
use surface::{Corners, HeldSurfaces};
use vantage_client::draw::antialiasing::Antialias;
use vantage_client::draw::frame::{FrameRenderer, Options};
use vantage_client::draw::layers::Layers;
use vantage_client::draw::light_images::LightImages;
use vantage_client::draw::occlusion;
use vantage_client::draw::rest::RestView;
use vantage_client::draw::shown::Shown;

/// Of pictures.
pub const SIDE: u32 = 96;

/// A box, by its least and greatest corner.
pub type Block = (DVec3, DVec3);

pub const FLOOR: Block = (DVec3::new(-4.0, -1.0, -4.0), DVec3::new(4.0, 0.0, 4.0));

/// Where a ray enters a box, in lengths of `along`, and the normal there.
pub fn entry((low, high): Block, from: DVec3, along: DVec3) -> Option<(f64, DVec3)> {
    let (a, b) = ((low - from) / along, (high - from) / along);
    let (near, far) = (a.min(b), a.max(b));
    let axis = near.max_position();
    let t = near[axis];
    (t > 0.0 && t <= far.min_element()).then(|| (t, DVec3::AXES[axis] * -along[axis].signum()))
}

/// A picture's camera.
pub fn view(eye: DVec3, at: DVec3) -> Pinhole {
    Pinhole::symmetric(Rigid::look_at(eye, at), (SIDE, SIDE), 1.0, 0.05)
}

/// Where boxes stand, how large they are, and how finely they were seen.
#[derive(Clone, Copy)]
pub struct World {
    /// What lies in the middle, in world space.
    pub origin: DVec3,
    /// Metres a unit of the boxes.
    pub scale: f64,
    /// Of the images that are held.
    pub side_px: u32,
}

impl World {
    /// From the boxes' units.
    pub fn point(&self, p: DVec3) -> DVec3 {
        self.origin + p * self.scale
    }

    /// What a camera in world space sees of boxes.
    fn patch(&self, id: u32, camera: &Pinhole, blocks: &[Block]) -> HeldPatch {
        let (mut mask, mut depth, mut normal) = (Mask::empty(self.side_px, self.side_px), Vec::new(), Vec::new());
        let depth_scale = DepthScale { w_min: 0.0, w_step: (1.0 / 65535.0 / self.scale) as f32 };
        for (x, y) in (0..self.side_px).flat_map(|y| (0..self.side_px).map(move |x| (x, y))) {
            let ray = camera.ray_eye_from_image(f64::from(x) + 0.5, f64::from(y) + 0.5);
            let along = camera.world_from_eye.transform_vector(ray);
            let from = (camera.world_from_eye.translation - self.origin) / self.scale;
            let hits = blocks.iter().filter_map(|block| entry(*block, from, along));
            if let Some((t, towards)) = hits.min_by(|a, b| a.0.total_cmp(&b.0)) {
                mask.set(x, y, true);
                depth.push(depth_scale.code((1.0 / (t * self.scale)) as f32));
                normal.push(octahedral_code(towards.as_vec3()));
            }
        }
        let count = mask.count();
        let image = DepthImage {
            camera: Camera::Pinhole(*camera),
            depth_scale,
            mask,
            depth,
            normal,
            normal_rest: Vec::new(),
            colour_rest: Vec::new(),
            share: Vec::new(),
            ends: Vec::new(),
            colour: vec![[200, 200, 200]; count],
            object: vec![1; count],
            material: vec![0; count],
        };
        let patch = Patch { id: PatchId(id), purpose: Purpose::Eye, capture_time_s: 0.0, objects: Vec::new(), image };
        HeldPatch { patch, trims: Vec::new() }
    }

    /// Boxes as seen from around and above.
    pub fn held(&self, blocks: &[Block], lighting: Lighting) -> Held {
        let eyes = [(0.0, 5.0, 7.0), (7.0, 5.0, 0.0), (0.0, 5.0, -7.0), (-7.0, 5.0, 0.0), (1.0, 9.0, 1.0)];
        self.held_from(&eyes.map(DVec3::from), blocks, lighting)
    }

    /// Boxes as seen from some eyes, given in the boxes' units, that look at the middle.
    pub fn held_from(&self, eyes: &[DVec3], blocks: &[Block], lighting: Lighting) -> Held {
        let mut held = Held::default();
        for (eye, id) in eyes.iter().zip(1..) {
            let eye = Rigid::look_at(self.point(*eye), self.origin);
            let camera = Pinhole::symmetric(eye, (self.side_px, self.side_px), 1.0, 0.05 * self.scale);
            held.patches.insert(PatchId(id), self.patch(id, &camera, blocks));
        }
        held.materials = vec![Material::default()];
        held.lighting = Some(lighting);
        held
    }
}

/// By lights and a little from everywhere.
pub fn lit_by(lights: Vec<Light>) -> Lighting {
    Lighting { ambient: [0.1; 3], lights, background: [0; 3], burley: false, ..Lighting::default() }
}

/// From the side and above; where shadows are looked at.
pub fn camera(world: &World) -> Pinhole {
    let mut camera = view(world.point(DVec3::new(1.5, 5.0, 5.5)), world.origin);
    camera.near_m *= world.scale;
    camera
}

/// A pixel whose middle shows the top of a floor, in the boxes' units.
pub struct OnFloor {
    pub pixel: usize,
    pub p: DVec3,
    /// What it spans there.
    pub footprint: f64,
}

/// Of the picture that was drawn last; pixels that show something else, as held samples end beside what they show, are left out.
pub fn on_floor(stage: &Stage, world: &World, camera: &Pinhole, blocks: &[Block]) -> Vec<OnFloor> {
    let drawn_w: Vec<f32> = stage.read(&stage.frames.gbuffer().expect("drawn").w);
    let from = (camera.world_from_eye.translation - world.origin) / world.scale;
    let at = |pixel: u32| {
        let ray = camera.ray_eye_from_image(f64::from(pixel % SIDE) + 0.5, f64::from(pixel / SIDE) + 0.5);
        let along = camera.world_from_eye.transform_vector(ray);
        let hits = blocks.iter().map(|block| entry(*block, from, along));
        let first = (0..).zip(hits).filter_map(|(block, hit)| Some((block, hit?)));
        let (block, (t, normal)) = first.min_by(|a, b| a.1.0.total_cmp(&b.1.0))?;
        let footprint = t / camera.focal_px / -along.normalize().y;
        // By as much the depth differs within the pixel.
        let is_drawn = (1.0 / (f64::from(drawn_w[pixel as usize]) * world.scale) - t).abs() < footprint;
        let found = OnFloor { pixel: pixel as usize, p: from + t * along, footprint };
        (block == 0 && normal == DVec3::Y && is_drawn).then_some(found)
    };
    (0..SIDE * SIDE).filter_map(at).collect()
}

/// Draws pictures of one held copy.
pub struct Stage {
    pub gpu: Gpu,
    /// Of what is held.
    pub surfaces: HeldSurfaces,
    /// What lights see, where that is held.
    pub lights: Option<LightImages>,
    /// What only occludes.
    pub occluders: Option<HeldSurfaces>,
    /// What is blended.
    pub layers: Layers,
    pub frames: FrameRenderer,
    output: wgpu::Texture,
}

impl Stage {
    pub fn new(held: &Held) -> Stage {
        let gpu = Gpu::block_on(Gpu::new_headless()).expect("an adapter");
        let mut surfaces = HeldSurfaces::new(&gpu);
        surfaces.rebuild(held);
        let frames = FrameRenderer::new(&gpu, wgpu::TextureFormat::Rgba8Unorm).expect("the shaders compile");
        let output = gpu.device.create_texture(&wgpu::TextureDescriptor {
            label: None,
            size: wgpu::Extent3d { width: SIDE, height: SIDE, depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: wgpu::TextureFormat::Rgba8Unorm,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
            view_formats: &[],
        });
        let mut occluders = occlusion::occluders(&gpu, Corners::default());
        occluders.rebuild(held);
        let mut layers = Layers::new(&gpu, Corners::default());
        layers.rebuild(held);
        Stage { gpu, surfaces, lights: None, occluders: Some(occluders), layers, frames, output }
    }

    /// Of the device.
    pub fn gpu(&self) -> &Gpu {
        &self.gpu
    }

    /// The picture that a camera of [`SIDE`] pixels sees.
    pub fn shoot(&mut self, held: &Held, camera: &Pinhole) -> Vec<[u8; 4]> {
        self.shoot_with(held, camera, Options::default())
    }

    /// The same drawn otherwise.
    pub fn shoot_with(&mut self, held: &Held, camera: &Pinhole, options: Options) -> Vec<[u8; 4]> {
        let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
        let view = self.output.create_view(&Default::default());
        let (lights, occluders) = (self.lights.as_ref(), self.occluders.as_ref());
        let shown = Shown { lights, occluders, layers: Some(&self.layers), ..Shown::from((&self.surfaces, held)) };
        self.frames.draw(&mut encoder, shown, camera, &view, options);
        self.gpu.queue.submit([encoder.finish()]);
        self.frames.submitted(true);
        self.read(&self.output)
    }

    /// The antialiased picture of a viewer at rest.
    pub fn shoot_at_rest(&mut self, held: &Held, camera: &Pinhole, rest: &RestView) -> Vec<[u8; 4]> {
        let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
        let view = self.output.create_view(&Default::default());
        let shown = Shown { layers: Some(&self.layers), rest: Some(rest), ..Shown::from((&self.surfaces, held)) };
        let options = Options { antialias: Antialias::On, ..Options::default() };
        self.frames.draw(&mut encoder, shown, camera, &view, options);
        self.gpu.queue.submit([encoder.finish()]);
        self.frames.submitted(true);
        self.read(&self.output)
    }

    /// The values of a texture of [`SIDE`] pixels.
    pub fn read<T: bytemuck::Pod>(&self, texture: &wgpu::Texture) -> Vec<T> {
        let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
        let mut readback = Readback::default();
        let slot = readback.texture(texture, 0, (SIDE, SIDE));
        let encoded = readback.encode(&self.gpu, &mut encoder);
        self.gpu.queue.submit([encoder.finish()]);
        encoded.map().wait(&self.gpu).expect("a readback").values(slot)
    }
}
