//! Scene and cameras to depth images: conventional, or without the samples that earlier images of the set hold.
//!
//! Xie, Wang, Popescu 2016, §3, Algorithms 1 and 3. Image 0 is a conventional depth image. A fragment of a later image is
//! dropped when it reprojects, in any earlier image, to a pixel that holds the **same triangle**; a dropped fragment writes no
//! depth, so it cannot hide a new one behind it. Triangle ids count through the whole scene, instances included.
//!
//! | paper | here |
//! |---|---|
//! | `s`, a sample | a fragment: pixel centre and `w` |
//! | `t` | triangle id |
//! | `PPC_i`, `I_i` | [`Pinhole`] `i`, layer `i` of the id texture |
//! | PixelRedundancyTest | `holds` in `server/image.wgsl`, [`redundancy::Earlier::holds`] |
//!
//! [`TexelTest::Neighbourhood`] also looks at the eight pixels around (ours): where two triangles meet, the paper's test keeps
//! a line of samples one pixel wide because the reprojected point rounds to the other side of the edge. Those lines turn out
//! to be worth their bytes, so the paper's test is the default. Means over five scenes (urban, pillars, birdnest, grass, a
//! room), four images of 384 x 384, five views between them, drawn with averaged corners:
//!
//! | set | pixels without a surface | samples | coded |
//! |---|---|---|---|
//! | 1 conventional image | 6.40 % | 93,000 | 174 kB |
//! | 4 conventional | 0.31 % | 368,000 | 682 kB |
//! | 4 non-redundant, pixel | 0.38 % | 216,000 | 551 kB |
//! | 4 non-redundant, neighbourhood | 2.78 % | 186,000 | 427 kB |

mod capture;
pub mod redundancy;

pub use capture::{Capture, DepthPrecision};

use camera::Pinhole;
use gpu::{Gpu, Pending, Readback, Slot};
use rayon::prelude::*;
use wgpu::util::DeviceExt;

use crate::render::{Pass, Pipelines, RenderError, SceneRenderer, check_camera};
use crate::targets::{Attachments, COLOUR_FORMAT, IDS_FORMAT, Slots, planes};
use redundancy::EarlierImages;

/// Images of one set at most: the last is tested against all but itself.
pub const MAX_IMAGES: usize = redundancy::MAX_EARLIER + 1;

/// Which method makes the images.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Discretization {
    /// Every image holds all that its camera sees.
    Conventional,
    /// No image holds what an earlier one does.
    #[default]
    NonRedundant,
}

/// Where the redundancy test looks for the triangle.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum TexelTest {
    /// At the reprojected pixel, as the paper does.
    #[default]
    Single,
    /// At the 3 x 3 pixels around it.
    Neighbourhood,
}

impl TexelTest {
    /// Pixels around the reprojected one.
    pub(crate) fn radius_px(self) -> i32 {
        match self {
            TexelTest::Single => 0,
            TexelTest::Neighbourhood => 1,
        }
    }
}

/// Makes depth images.
pub struct Discretizer {
    gpu: Gpu,
    texel_test: TexelTest,
    own_layout: wgpu::BindGroupLayout,
    conventional: Pipelines,
    non_redundant: Pipelines,
    /// Kept for the next set of the same size; work on the queue runs in order, so sets in flight may share it.
    attachments: Option<Attachments>,
    /// Bound where nothing is tested: a layer must not be sampled while it is drawn into.
    nothing: Attachments,
}

impl Discretizer {
    /// Pipelines for scenes of `scene`'s kind.
    pub fn new(scene: &SceneRenderer, texel_test: TexelTest) -> Result<Discretizer, RenderError> {
        let gpu = scene.gpu().clone();
        let fragment = wgpu::ShaderStages::FRAGMENT;
        let own_layout = gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some("earlier images"),
            entries: &[
                crate::render::buffer_entry(0, fragment, wgpu::BufferBindingType::Uniform),
                wgpu::BindGroupLayoutEntry {
                    binding: 1,
                    visibility: fragment,
                    ty: wgpu::BindingType::Texture {
                        sample_type: wgpu::TextureSampleType::Uint,
                        view_dimension: wgpu::TextureViewDimension::D2Array,
                        multisampled: false,
                    },
                    count: None,
                },
            ],
        });
        let build = |non_redundant: bool| {
            let constants = [
                ("non_redundant", f64::from(u8::from(non_redundant))),
                ("texel_radius", texel_test.radius_px().into()),
            ];
            let pass = Pass {
                fragment: "image",
                formats: &[IDS_FORMAT, COLOUR_FORMAT],
                own_layout: Some(&own_layout),
                constants: &constants,
            };
            Pipelines::new(&gpu, scene.is_native(), &pass)
        };
        let (conventional, non_redundant) = (build(false)?, build(true)?);
        let nothing = Attachments::new(&gpu, (1, 1), 1);
        Ok(Discretizer { gpu, texel_test, own_layout, conventional, non_redundant, attachments: None, nothing })
    }

    /// Where the redundancy test looks.
    pub fn texel_test(&self) -> TexelTest {
        self.texel_test
    }

    /// Submits the images of `cameras`, in order, of the scene as it is now. Several sets may be in flight.
    pub fn run(
        &mut self,
        scene: &SceneRenderer,
        cameras: &[Pinhole],
        method: Discretization,
    ) -> Result<PendingCaptures, RenderError> {
        if cameras.is_empty() || cameras.len() > MAX_IMAGES {
            return Err(RenderError::ImageCount(cameras.len()));
        }
        cameras.iter().try_for_each(|camera| check_camera(&self.gpu, camera))?;
        let attachments = self.take_attachments(cameras);
        let timer = Timer::new(&self.gpu, cameras.len() as u32);
        let mut encoder = self.gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        for (index, camera) in cameras.iter().enumerate() {
            let tested = if method == Discretization::NonRedundant { index } else { 0 };
            let own = self.own_group(&attachments, camera, &cameras[..tested]);
            let view = scene.view_group(camera);
            let writes = timer.as_ref().map(|timer| timer.writes(index as u32));
            let mut pass = attachments.begin(&mut encoder, index as u32, [0.0; 3], writes);
            pass.set_bind_group(3, &own, &[]);
            let pipelines = if tested > 0 { &self.non_redundant } else { &self.conventional };
            scene.draw(&mut pass, pipelines, camera, &view);
        }
        let mut readback = Readback::default();
        let slots = cameras
            .iter()
            .zip(0..)
            .map(|(camera, layer)| attachments.read(&mut readback, layer, (camera.width_px, camera.height_px)))
            .collect();
        let times = timer.map(|timer| timer.read(&mut encoder, &mut readback));
        let encoded = readback.encode(&self.gpu, &mut encoder);
        self.gpu.queue.submit([encoder.finish()]);
        self.attachments = Some(attachments);
        Ok(PendingCaptures {
            gpu: self.gpu.clone(),
            cameras: cameras.to_vec(),
            slots,
            times,
            period_s: f64::from(self.gpu.queue.get_timestamp_period()) * 1e-9,
            pending: encoded.map(),
        })
    }

    fn take_attachments(&mut self, cameras: &[Pinhole]) -> Attachments {
        let width = cameras.iter().map(|camera| camera.width_px).max().unwrap_or(1);
        let height = cameras.iter().map(|camera| camera.height_px).max().unwrap_or(1);
        let layers = cameras.len() as u32;
        self.attachments
            .take()
            .filter(|kept| kept.size_px == (width, height) && kept.layers == layers)
            .unwrap_or_else(|| Attachments::new(&self.gpu, (width, height), layers))
    }

    /// Group 3: how to reproject into the earlier images, and their ids.
    fn own_group(&self, attachments: &Attachments, camera: &Pinhole, earlier: &[Pinhole]) -> wgpu::BindGroup {
        let uniform = self.gpu.device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
            label: Some("earlier images"),
            contents: bytemuck::bytes_of(&EarlierImages::new(camera, earlier)),
            usage: wgpu::BufferUsages::UNIFORM,
        });
        let tested = if earlier.is_empty() { &self.nothing } else { attachments };
        let ids = tested.ids.create_view(&wgpu::TextureViewDescriptor {
            dimension: Some(wgpu::TextureViewDimension::D2Array),
            base_array_layer: 0,
            array_layer_count: Some(earlier.len().max(1) as u32),
            ..Default::default()
        });
        self.gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("earlier images"),
            layout: &self.own_layout,
            entries: &[
                wgpu::BindGroupEntry { binding: 0, resource: uniform.as_entire_binding() },
                wgpu::BindGroupEntry { binding: 1, resource: wgpu::BindingResource::TextureView(&ids) },
            ],
        })
    }
}

/// Images on their way from the GPU.
pub struct PendingCaptures {
    gpu: Gpu,
    cameras: Vec<Pinhole>,
    slots: Vec<Slots>,
    times: Option<Slot>,
    period_s: f64,
    pending: Pending,
}

impl PendingCaptures {
    /// Whether [`PendingCaptures::wait`] would return at once.
    pub fn is_ready(&self) -> bool {
        self.gpu.poll();
        self.pending.is_ready()
    }

    /// The images, in the order of their cameras.
    pub fn wait(self) -> Result<Vec<Capture>, RenderError> {
        let mapped = self.pending.wait(&self.gpu)?;
        let ticks: Vec<u64> = self.times.map(|slot| mapped.values(slot)).unwrap_or_default();
        let captures = self.cameras.iter().zip(&self.slots).enumerate().map(|(index, (camera, slots))| {
            let (ids, colour, depth) = planes(&mapped, *slots);
            let span = ticks.get(2 * index..2 * index + 2);
            let gpu_s = span.map(|span| span[1].saturating_sub(span[0]) as f64 * self.period_s);
            Capture { camera: *camera, ids, colour, depth, gpu_s }
        });
        Ok(captures.collect())
    }
}

/// The captures as depth images, all samples, packed in parallel.
pub fn depth_images(captures: &[Capture], precision: DepthPrecision) -> Vec<protocol::DepthImage> {
    captures.par_iter().map(|capture| capture.depth_image(precision)).collect()
}

/// Two timestamps an image.
struct Timer {
    queries: wgpu::QuerySet,
    resolved: wgpu::Buffer,
    count: u32,
}

impl Timer {
    fn new(gpu: &Gpu, images: u32) -> Option<Timer> {
        let count = images * 2;
        gpu.caps.timestamps.then(|| Timer {
            queries: gpu.device.create_query_set(&wgpu::QuerySetDescriptor {
                label: Some("image times"),
                ty: wgpu::QueryType::Timestamp,
                count,
            }),
            resolved: gpu.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("image times"),
                size: u64::from(count) * 8,
                usage: wgpu::BufferUsages::QUERY_RESOLVE | wgpu::BufferUsages::COPY_SRC,
                mapped_at_creation: false,
            }),
            count,
        })
    }

    fn writes(&self, image: u32) -> wgpu::RenderPassTimestampWrites<'_> {
        wgpu::RenderPassTimestampWrites {
            query_set: &self.queries,
            beginning_of_pass_write_index: Some(2 * image),
            end_of_pass_write_index: Some(2 * image + 1),
        }
    }

    fn read(&self, encoder: &mut wgpu::CommandEncoder, readback: &mut Readback) -> Slot {
        encoder.resolve_query_set(&self.queries, 0..self.count, &self.resolved, 0);
        readback.buffer(&self.resolved, 0, self.count * 8)
    }
}
