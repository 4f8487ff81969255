//! Measures sets of images: which samples of an image others hold (Xie, Wang, Popescu 2016, §6.1.2), on the GPU by the very test that
//! makes images, from what the images hold before anything is quantized. The twin is [`super::redundancy::redundant_samples`].

use bytemuck::cast_slice;
use camera::Pinhole;
use gpu::{Gpu, PinholeUniform, Readback};
use wgpu::util::DeviceExt;

use super::earlier::{self, EarlierLayout, EarlierPlanes};
use super::redundancy::MAX_EARLIER;
use super::{Capture, Redundancy};
use crate::render::{RenderError, SceneRenderer, buffer_entry};
use crate::targets::IDS_FORMAT;

/// Pixels of a workgroup along each side: `measure` of `server/meter.wgsl`.
const GROUP_PX: u32 = 8;

/// Asks images of a set for the samples of others, by one test.
pub struct Meter {
    gpu: Gpu,
    redundancy: Redundancy,
    view_layout: wgpu::BindGroupLayout,
    sample_layout: wgpu::BindGroupLayout,
    earlier: EarlierLayout,
    pipeline: wgpu::ComputePipeline,
}

/// Images on the GPU, ready to be asked for many others' samples.
pub struct MeterImages {
    /// At most [`MAX_EARLIER`] together.
    groups: Vec<MeterGroup>,
}

struct MeterGroup {
    cameras: Vec<Pinhole>,
    /// Ids and depth, a layer an image; `None` for rays, which ask where images are, not what they show.
    planes: Option<[wgpu::Texture; 2]>,
}

impl Meter {
    /// A meter for scenes on `gpu`.
    pub fn new(gpu: &Gpu, redundancy: Redundancy) -> Result<Meter, RenderError> {
        let compute = wgpu::ShaderStages::COMPUTE;
        let layout = |label, entries: &[wgpu::BindGroupLayoutEntry]| {
            gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: Some(label), entries })
        };
        let texture = |binding, sample_type| wgpu::BindGroupLayoutEntry {
            binding,
            visibility: compute,
            ty: wgpu::BindingType::Texture {
                sample_type,
                view_dimension: wgpu::TextureViewDimension::D2,
                multisampled: false,
            },
            count: None,
        };
        let view_layout = layout("camera", &[buffer_entry(0, compute, wgpu::BufferBindingType::Uniform)]);
        let sample_layout = layout(
            "samples",
            &[
                texture(0, wgpu::TextureSampleType::Uint),
                texture(1, wgpu::TextureSampleType::Float { filterable: false }),
                buffer_entry(2, compute, wgpu::BufferBindingType::Storage { read_only: false }),
            ],
        );
        let earlier = EarlierLayout::new(gpu, compute);
        let module = gpu.shader("server/meter.wgsl")?;
        let groups = [Some(&view_layout), Some(&sample_layout), None, Some(&earlier.layout)];
        let pipeline_layout = gpu.device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some("meter"),
            bind_group_layouts: &groups,
            immediate_size: 0,
        });
        let constants = redundancy.constants();
        let pipeline = gpu.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some("meter"),
            layout: Some(&pipeline_layout),
            module: &module,
            entry_point: Some("measure"),
            compilation_options: wgpu::PipelineCompilationOptions { constants: &constants, ..Default::default() },
            cache: None,
        });
        Ok(Meter { gpu: gpu.clone(), redundancy, view_layout, sample_layout, earlier, pipeline })
    }

    /// Takes images to the GPU; any number. By [`super::RedundancyTest::Visibility`] at most [`MAX_EARLIER`] make a set, as each is asked
    /// about those before it.
    pub fn images(&self, images: &[Capture]) -> MeterImages {
        let group = |images: &[Capture]| {
            let largest = |side: fn(&Capture) -> u32| images.iter().map(side).max().unwrap_or(1);
            let size_px = (largest(|image| image.camera.width_px), largest(|image| image.camera.height_px));
            MeterGroup {
                cameras: images.iter().map(|image| image.camera).collect(),
                planes: (!self.redundancy.test.needs_rays()).then(|| self.planes(images, size_px)),
            }
        };
        MeterImages { groups: images.chunks(MAX_EARLIER).map(group).collect() }
    }

    /// Whether each pixel of `capture` (row-major) is a sample that one of `images` holds, of the scene as it is now.
    pub fn redundant(
        &self,
        scene: &SceneRenderer,
        capture: &Capture,
        images: &MeterImages,
    ) -> Result<Vec<bool>, RenderError> {
        let device = &self.gpu.device;
        let view = device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
            label: Some("camera"),
            contents: bytemuck::bytes_of(&PinholeUniform::new(&capture.camera, scene.anchor_world())),
            usage: wgpu::BufferUsages::UNIFORM,
        });
        let view_group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("camera"),
            layout: &self.view_layout,
            entries: &[wgpu::BindGroupEntry { binding: 0, resource: view.as_entire_binding() }],
        });
        let size_px = (capture.camera.width_px, capture.camera.height_px);
        let flags = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("redundant"),
            size: u64::from(size_px.0) * u64::from(size_px.1) * 4,
            usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC,
            mapped_at_creation: false,
        });
        let [ids, depth] = self.planes(std::slice::from_ref(capture), size_px);
        let plane = |texture: &wgpu::Texture| {
            texture.create_view(&wgpu::TextureViewDescriptor {
                dimension: Some(wgpu::TextureViewDimension::D2),
                ..Default::default()
            })
        };
        let sample_group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("samples"),
            layout: &self.sample_layout,
            entries: &[
                wgpu::BindGroupEntry { binding: 0, resource: wgpu::BindingResource::TextureView(&plane(&ids)) },
                wgpu::BindGroupEntry { binding: 1, resource: wgpu::BindingResource::TextureView(&plane(&depth)) },
                wgpu::BindGroupEntry { binding: 2, resource: flags.as_entire_binding() },
            ],
        });
        let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        for group in &images.groups {
            let own = self.earlier_group(scene, capture, group)?;
            let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
            pass.set_pipeline(&self.pipeline);
            pass.set_bind_group(0, &view_group, &[]);
            pass.set_bind_group(1, &sample_group, &[]);
            pass.set_bind_group(3, &own, &[]);
            pass.dispatch_workgroups(size_px.0.div_ceil(GROUP_PX), size_px.1.div_ceil(GROUP_PX), 1);
        }
        let mut readback = Readback::default();
        let slot = readback.buffer(&flags, 0, flags.size() as u32);
        let encoded = readback.encode(&self.gpu, &mut encoder);
        self.gpu.queue.submit([encoder.finish()]);
        let mapped = encoded.map().wait(&self.gpu)?;
        Ok(mapped.values::<u32>(slot).into_iter().map(|flag| flag != 0).collect())
    }

    fn earlier_group(
        &self,
        scene: &SceneRenderer,
        capture: &Capture,
        group: &MeterGroup,
    ) -> Result<wgpu::BindGroup, RenderError> {
        let [ids, depth] = [0, 1].map(|plane| group.planes.as_ref().map(|planes| &planes[plane]));
        let depth = depth.filter(|_| self.redundancy.test.needs_depth());
        let planes = EarlierPlanes { cameras: &group.cameras, ids, depth };
        self.earlier.group(scene, &capture.camera, &planes, Some(self.redundancy))
    }

    /// Ids and depth of images, a layer each.
    fn planes(&self, images: &[Capture], size_px: (u32, u32)) -> [wgpu::Texture; 2] {
        let texture = |label, format| earlier::array(&self.gpu, label, format, size_px, images.len() as u32);
        let (ids, depth) = (texture("ids", IDS_FORMAT), texture("depths", earlier::DEPTH_FORMAT));
        for (image, layer) in images.iter().zip(0..) {
            let size_px = (image.camera.width_px, image.camera.height_px);
            self.write(&ids, layer, size_px, cast_slice(&image.ids));
            self.write(&depth, layer, size_px, cast_slice(&image.depth));
        }
        [ids, depth]
    }

    fn write(&self, texture: &wgpu::Texture, layer: u32, (width, height): (u32, u32), bytes: &[u8]) {
        let to = wgpu::TexelCopyTextureInfo {
            texture,
            mip_level: 0,
            origin: wgpu::Origin3d { x: 0, y: 0, z: layer },
            aspect: wgpu::TextureAspect::All,
        };
        let bytes_per_row = Some(bytes.len() as u32 / height.max(1));
        let layout = wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row, rows_per_image: Some(height) };
        self.gpu.queue.write_texture(to, bytes, layout, wgpu::Extent3d { width, height, depth_or_array_layers: 1 });
    }
}
