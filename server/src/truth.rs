//! The picture that a reconstruction is compared with: the whole scene, drawn forward and shaded by the same look as the
//! client's, with no reconstruction in between.

use std::sync::Arc;

use camera::Pinhole;
use glam::DVec3;
use gpu::{Gpu, LightingUniform, MaterialUniform, Readback, SkyTexture};
use protocol::{Lighting, Sky};
use wgpu::util::DeviceExt;

use crate::render::{Faces, Pass, Pipelines, RenderError, SceneRenderer, check_camera};
use crate::targets::{self, Attachments, Planes, planes};

/// A rendered picture; planes are row-major, one value a pixel.
#[derive(Debug, Clone, PartialEq)]
pub struct Truth {
    /// Width and height.
    pub size_px: (u32, u32),
    /// sRGB-encoded; alpha is 255 where there is a surface, else 0 over the background colour.
    pub colour: Vec<[u8; 4]>,
    /// Inverse depth `1/z` in 1/m; 0 where there is no surface.
    pub w: Vec<f32>,
    /// Object ids; 0 also where there is no surface.
    pub object: Vec<u16>,
    /// Triangle ids as [`crate::render`] counts them; 0 where there is no surface.
    pub triangle: Vec<u32>,
}

/// Draws [`Truth`].
pub struct TruthRenderer {
    gpu: Gpu,
    own_layout: wgpu::BindGroupLayout,
    pipelines: Pipelines,
    sky: Option<Arc<Sky>>,
    sky_view: wgpu::TextureView,
}

impl TruthRenderer {
    /// Pipelines for scenes of `scene`'s kind.
    pub fn new(scene: &SceneRenderer) -> Result<TruthRenderer, RenderError> {
        let gpu = scene.gpu().clone();
        let buffer = |binding, kind| crate::render::buffer_entry(binding, wgpu::ShaderStages::FRAGMENT, kind);
        let storage = wgpu::BufferBindingType::Storage { read_only: true };
        let own_layout = gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some("truth"),
            entries: &[
                buffer(2, storage),
                buffer(3, wgpu::BufferBindingType::Uniform),
                crate::render::texture_entry(4),
            ],
        });
        let pass = Pass {
            fragment: "truth",
            formats: &targets::FORMATS,
            own_layout: Some(&own_layout),
            constants: &[],
            faces: Faces::Front,
        };
        let pipelines = Pipelines::new(&gpu, scene.kind(), &pass)?;
        let sky_view = SkyTexture::default().of(&gpu, None);
        Ok(TruthRenderer { gpu, own_layout, pipelines, sky: None, sky_view })
    }

    /// Under a sky, or none.
    pub fn with_sky(mut self, sky: Option<Arc<Sky>>) -> TruthRenderer {
        self.sky_view = SkyTexture::default().of(&self.gpu, sky.as_ref());
        self.sky = sky;
        self
    }

    /// One sample a pixel, at its centre: what a reconstruction without antialiasing should show.
    pub fn render(&self, scene: &SceneRenderer, camera: &Pinhole, lighting: &Lighting) -> Result<Truth, RenderError> {
        check_camera(&self.gpu, camera)?;
        let size_px = (camera.width_px, camera.height_px);
        let attachments = Attachments::new(&self.gpu, size_px, 1);
        let view = scene.view_group(camera);
        let own = self.own_group(scene, lighting, camera.world_from_eye.translation);
        let mut encoder = self.gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        {
            let background = lighting.background.map(|value| f64::from(value) / 255.0);
            let mut pass = attachments.begin(&mut encoder, 0, background, None);
            pass.set_bind_group(3, &own, &[]);
            scene.draw(&mut pass, &self.pipelines, camera, &view);
        }
        let mut readback = Readback::default();
        let slots = attachments.read(&mut readback, 0, size_px);
        let encoded = readback.encode(&self.gpu, &mut encoder);
        self.gpu.queue.submit([encoder.finish()]);
        let mapped = encoded.map().wait(&self.gpu)?;
        let Planes { ids, colour, depth, .. } = planes(&mapped, slots);
        let near_m = camera.near_m as f32;
        Ok(Truth {
            size_px,
            colour,
            w: depth.into_iter().map(|depth| depth / near_m).collect(),
            object: ids.iter().map(|id| id[1] as u16).collect(),
            triangle: ids.iter().map(|id| id[0]).collect(),
        })
    }

    /// Colour from 4 x 4 samples a pixel, averaged in linear light (what a camera would see); the other planes as
    /// [`TruthRenderer::render`] gives them. For the eye; comparisons use one sample.
    pub fn render_smooth(
        &self,
        scene: &SceneRenderer,
        camera: &Pinhole,
        lighting: &Lighting,
    ) -> Result<Truth, RenderError> {
        let mut truth = self.render(scene, camera, lighting)?;
        let fine_camera = Pinhole {
            width_px: camera.width_px * 4,
            height_px: camera.height_px * 4,
            focal_px: camera.focal_px * 4.0,
            centre_px: camera.centre_px * 4.0,
            ..*camera
        };
        let fine = self.render(scene, &fine_camera, lighting)?;
        for (index, colour) in truth.colour.iter_mut().enumerate() {
            let (x, y) = (index % camera.width_px as usize * 4, index / camera.width_px as usize * 4);
            let texels = (0..16).map(|tap| fine.colour[(y + tap / 4) * fine_camera.width_px as usize + x + tap % 4]);
            *colour = crate::look::average_srgb(texels);
        }
        Ok(truth)
    }

    fn own_group(&self, scene: &SceneRenderer, lighting: &Lighting, eye_world: DVec3) -> wgpu::BindGroup {
        let buffer = |label, contents: &[u8]| {
            self.gpu.device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
                label: Some(label),
                contents,
                usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::STORAGE,
            })
        };
        let lights =
            buffer("lighting", bytemuck::bytes_of(&LightingUniform::new(lighting, self.sky.as_deref(), eye_world)));
        let table = buffer("material table", bytemuck::cast_slice(&MaterialUniform::table(scene.materials())));
        self.gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("truth"),
            layout: &self.own_layout,
            entries: &[
                wgpu::BindGroupEntry { binding: 2, resource: lights.as_entire_binding() },
                wgpu::BindGroupEntry { binding: 3, resource: table.as_entire_binding() },
                wgpu::BindGroupEntry { binding: 4, resource: wgpu::BindingResource::TextureView(&self.sky_view) },
            ],
        })
    }
}
