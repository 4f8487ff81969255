//! What a client would show of a set of images: the client's own library, drawing off screen.

use std::time::Instant;

use camera::Pinhole;
use client::draw::bodies::Bodies;
use client::draw::frame::{FrameRenderer, Options};
use client::draw::impostors::Impostors;
use client::draw::occlusion;
use client::draw::reflect::StepSum;
use client::draw::shadow;
use client::draw::shown::Shown;
use gpu::{Gpu, Readback};
use protocol::held::{Edit, Held, HeldPatch};
use protocol::{DepthImage, Lighting, Material};
use surface::{HeldSurfaces, PatchMesh};

use crate::compare::Picture;
use crate::sets;

/// What a client holds, and its surfaces.
pub struct HeldSet {
    /// The copy.
    pub held: Held,
    /// On the GPU.
    pub surfaces: HeldSurfaces,
    /// Wall time for building the surfaces.
    pub build_ms: f64,
    /// Objects as their triangles.
    pub bodies: Bodies,
}

impl HeldSet {
    /// Holds a set of images of a still scene, as a client does.
    pub fn new(gpu: &Gpu, images: &[DepthImage], look: (&[Material], &Lighting)) -> anyhow::Result<HeldSet> {
        HeldSet::with_meshes(gpu, images, look, |surfaces, held, _| surfaces.mesh(held))
    }

    /// The same with meshes of one's own, of the patch and the number of its image.
    pub fn with_meshes(
        gpu: &Gpu,
        images: &[DepthImage],
        (materials, lighting): (&[Material], &Lighting),
        mesh: impl Fn(&HeldSurfaces, &HeldPatch, usize) -> PatchMesh,
    ) -> anyhow::Result<HeldSet> {
        let mut held = Held::default();
        let mut edits = vec![Edit::Materials(materials.to_vec()), Edit::Light(Box::new(lighting.clone()))];
        edits.extend(sets::patches(images).map(|patch| Edit::Add(Box::new(patch))));
        held.commit(edits, 0.0, 0)?;
        let started = Instant::now();
        let mut surfaces = HeldSurfaces::new(gpu);
        surfaces.set_materials(&held.materials);
        for (index, patch) in held.patches.values().enumerate() {
            let mesh = mesh(&surfaces, patch, index);
            surfaces.place(patch, mesh);
        }
        gpu.wait_idle()?;
        let build_ms = started.elapsed().as_secs_f64() * 1000.0;
        Ok(HeldSet { build_ms, ..HeldSet::of(gpu, held, surfaces) })
    }

    /// What is held, with its surfaces.
    pub fn of(gpu: &Gpu, held: Held, surfaces: HeldSurfaces) -> HeldSet {
        let mut bodies = Bodies::new(gpu);
        bodies.rebuild(&held);
        HeldSet { held, surfaces, build_ms: 0.0, bodies }
    }

    /// What a frame shows of it.
    pub fn shown<'a>(&'a self, impostors: Option<&'a Impostors>) -> Shown<'a> {
        Shown {
            surfaces: &self.surfaces,
            held: &self.held,
            impostors,
            bodies: Some(&self.bodies),
            lights: None,
            occluders: None,
            layers: None,
            rest: None,
        }
    }
}

/// A frame as a client shows it, with what lies behind it.
#[derive(Debug, Clone)]
pub struct Drawn {
    /// As shown; its mask says where there was a surface before any filling.
    pub picture: Picture,
    /// Inverse depth in 1/m, 0 where there is no surface; a value a pixel.
    pub w: Vec<f32>,
    /// Wall time from encoding to the end of the GPU's work.
    pub frame_ms: f64,
}

/// sRGB bytes are read back as they are.
pub(crate) const SCREEN: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;

/// What frames are drawn onto and read back from.
pub(crate) fn screen(gpu: &Gpu, (width, height): (u32, u32)) -> wgpu::Texture {
    gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: Some("screen"),
        size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: SCREEN,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
        view_formats: &[],
    })
}

/// Draws frames of one size.
pub struct ClientView {
    gpu: Gpu,
    frames: FrameRenderer,
    output: wgpu::Texture,
    output_view: wgpu::TextureView,
}

impl ClientView {
    /// For frames of a size.
    pub fn new(gpu: &Gpu, (width, height): (u32, u32)) -> anyhow::Result<ClientView> {
        let output = screen(gpu, (width, height));
        let output_view = output.create_view(&wgpu::TextureViewDescriptor::default());
        Ok(ClientView { gpu: gpu.clone(), frames: FrameRenderer::new(gpu, SCREEN)?, output, output_view })
    }

    /// How ambient occlusion is measured from now on.
    pub fn set_occlusion(&mut self, settings: occlusion::Settings) {
        self.frames.set_occlusion(settings);
    }

    /// How shadows are drawn from now on.
    pub fn set_shadows(&mut self, settings: shadow::Settings) {
        self.frames.set_shadows(settings);
    }

    /// The share of ambient light that arrived at each pixel of the last frame, drawn from `camera`; 1 everywhere where none was
    /// measured.
    pub fn ambient_shares(&self, camera: &Pinhole) -> anyhow::Result<Vec<f32>> {
        let size_px = (camera.width_px, camera.height_px);
        let Some(shares) = self.frames.ambient_shares() else {
            return Ok(vec![1.0; (size_px.0 * size_px.1) as usize]);
        };
        let mut encoder = self.gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let mut readback = Readback::default();
        let shares = readback.texture(shares, 0, size_px);
        let encoded = readback.encode(&self.gpu, &mut encoder);
        self.gpu.queue.submit([encoder.finish()]);
        Ok(encoded.map().wait(&self.gpu)?.values(shares))
    }

    /// The shares of the lights that cast in the last frame, the strongest first, that arrived at each pixel, 0 to 255; `None` where none
    /// casts.
    pub fn light_shares(&self, camera: &Pinhole) -> anyhow::Result<Option<Vec<[u8; 4]>>> {
        let Some(shares) = self.frames.light_shares() else { return Ok(None) };
        let mut encoder = self.gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let mut readback = Readback::default();
        let shares = readback.texture(shares, 0, (camera.width_px, camera.height_px));
        let encoded = readback.encode(&self.gpu, &mut encoder);
        self.gpu.queue.submit([encoder.finish()]);
        Ok(Some(encoded.map().wait(&self.gpu)?.values(shares)))
    }

    /// What the last frame was drawn into, by what it holds.
    pub fn buffers(&self) -> Vec<(&'static str, &wgpu::Texture)> {
        self.frames.buffers()
    }

    /// What surfaces looked like in the last frame.
    pub fn gbuffer(&self) -> Option<&surface::GBuffer> {
        self.frames.gbuffer()
    }

    /// Draws and waits; gives the wall time in ms.
    pub fn draw(&mut self, set: &HeldSet, camera: &Pinhole, options: Options) -> anyhow::Result<f64> {
        self.draw_reflecting(set, None, camera, options)
    }

    /// The same with what mirrors and glass show.
    pub fn draw_reflecting(
        &mut self,
        set: &HeldSet,
        impostors: Option<&Impostors>,
        camera: &Pinhole,
        options: Options,
    ) -> anyhow::Result<f64> {
        self.draw_shown(set.shown(impostors), camera, options)
    }

    fn draw_shown(&mut self, shown: Shown<'_>, camera: &Pinhole, options: Options) -> anyhow::Result<f64> {
        let started = Instant::now();
        let mut encoder = self.gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        self.frames.draw(&mut encoder, shown, camera, &self.output_view, options);
        self.gpu.queue.submit([encoder.finish()]);
        self.frames.submitted(false);
        self.gpu.wait_idle()?;
        Ok(started.elapsed().as_secs_f64() * 1000.0)
    }

    /// What the rays of the last frame cost, where [`client::draw::reflect::Settings::count_steps`] was set.
    pub fn steps(&self) -> anyhow::Result<Option<StepSum>> {
        Ok(self.frames.steps()?)
    }

    /// Draws a frame and reads it back.
    pub fn frame(&mut self, set: &HeldSet, camera: &Pinhole, options: Options) -> anyhow::Result<Drawn> {
        self.frame_reflecting(set, None, camera, options)
    }

    /// The same with what mirrors and glass show.
    pub fn frame_reflecting(
        &mut self,
        set: &HeldSet,
        impostors: Option<&Impostors>,
        camera: &Pinhole,
        options: Options,
    ) -> anyhow::Result<Drawn> {
        self.frame_shown(set.shown(impostors), camera, options)
    }

    /// The same of all that is held, also of what lights see.
    pub fn frame_shown(&mut self, shown: Shown<'_>, camera: &Pinhole, options: Options) -> anyhow::Result<Drawn> {
        let frame_ms = self.draw_shown(shown, camera, options)?;
        let size_px = (camera.width_px, camera.height_px);
        let gbuffer = self.frames.gbuffer().expect("a frame was drawn");
        let mut encoder = self.gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let mut readback = Readback::default();
        let (colour, w) = (readback.texture(&self.output, 0, size_px), readback.texture(&gbuffer.w, 0, size_px));
        let encoded = readback.encode(&self.gpu, &mut encoder);
        self.gpu.queue.submit([encoder.finish()]);
        let mapped = encoded.map().wait(&self.gpu)?;
        let w: Vec<f32> = mapped.values(w);
        let mut picture = Picture::from_rgba(size_px.0, size_px.1, &mapped.bytes(colour));
        picture.covered = Some(w.iter().map(|&w| w > 0.0).collect());
        Ok(Drawn { picture, w, frame_ms })
    }
}
