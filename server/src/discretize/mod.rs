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
//! | PixelRedundancyTest | `holds_pixel` in `server/redundancy.wgsl`, [`redundancy::Earlier`] |
//! | VisibilityRedundancyTest | `holds_by_rays` there |
//!
//! [`RedundancyTest::Neighbourhood`] also looks at the eight pixels around (ours): where two triangles meet, the paper's test keeps
//! a line of samples one pixel wide because the reprojected point rounds to the other side of the edge. Without looking whether the
//! neighbour is of the same surface, that leaves holes. [`RedundancyTest::Surface`], the default, drops such lines only inside of
//! surfaces; [`RedundancyTest::Covered`] drops none beside outlines. Means over five scenes (urban, pillars, birdnest, grass, a
//! room), four images of 384 x 384, five views between them, drawn with averaged corners:
//!
//! | set | pixels without a surface | samples | coded |
//! |---|---|---|---|
//! | 1 conventional image | 6.40 % | 93,000 | 174 kB |
//! | 4 conventional | 0.31 % | 368,000 | 682 kB |
//! | 4 non-redundant, pixel | 0.38 % | 216,000 | 551 kB |
//! | 4 non-redundant, neighbourhood | 2.78 % | 186,000 | 427 kB |

mod capture;
mod earlier;
mod ends;
mod meter;
mod method;
pub mod placement;
pub mod redundancy;

pub use capture::{Capture, DepthPrecision};
pub(crate) use capture::{Planes, normal_code, object};
pub use ends::EndsPass;
pub(crate) use ends::Part;
pub use meter::{Meter, MeterImages};
pub use method::{Discretization, Redundancy, RedundancyTest};

use camera::Pinhole;
use gpu::{Gpu, Pending, Readback, Slot};
use rayon::prelude::*;

use crate::render::{Faces, Pass, Pipelines, RenderError, SceneRenderer, check_camera};
use crate::targets::{self, Attachments, Slots, planes};
use crate::timer::Timer;
use earlier::{EarlierLayout, EarlierPlanes};

/// Images of one set at most: the last is tested against all but itself.
pub const MAX_IMAGES: usize = redundancy::MAX_EARLIER + 1;

/// Makes depth images.
pub struct Discretizer {
    gpu: Gpu,
    earlier: EarlierLayout,
    conventional: Pipelines,
    /// Built when a method is first asked for.
    by_redundancy: Vec<(Redundancy, Pipelines)>,
    /// Kept for the next set of the same size; work on the queue runs in order, so sets in flight may share them.
    attachments: Option<Attachments>,
    depths: Option<wgpu::Texture>,
}

impl Discretizer {
    /// Pipelines for scenes of `scene`'s kind.
    pub fn new(scene: &SceneRenderer) -> Result<Discretizer, RenderError> {
        let gpu = scene.gpu().clone();
        let earlier = EarlierLayout::new(&gpu, wgpu::ShaderStages::FRAGMENT);
        let conventional = pipelines(scene, &earlier, None)?;
        Ok(Discretizer { gpu, earlier, conventional, by_redundancy: Vec::new(), attachments: None, depths: None })
    }

    /// Another one that shares its pipelines: sets of both may be in the making at once.
    pub fn twin(&self) -> Discretizer {
        let (gpu, earlier) = (self.gpu.clone(), self.earlier.clone());
        let (conventional, by_redundancy) = (self.conventional.clone(), self.by_redundancy.clone());
        Discretizer { gpu, earlier, conventional, by_redundancy, attachments: None, depths: None }
    }

    /// Submits the images of `cameras`, in order, of the scene as it is now: those that the method uses
    /// ([`Discretization::cameras`]). Several sets may be in flight.
    pub fn run(
        &mut self,
        scene: &SceneRenderer,
        cameras: &[Pinhole],
        method: Discretization,
    ) -> Result<PendingCaptures, RenderError> {
        let cameras = self.checked(cameras, method)?;
        self.prepare(scene, method)?;
        let timer = Timer::new(&self.gpu, cameras.len() as u32);
        let mut encoder = self.gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let attachments = self.encode(scene, &cameras, method, (&mut encoder, timer.as_ref()))?;
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
            cameras,
            slots,
            times,
            period_s: f64::from(self.gpu.queue.get_timestamp_period()) * 1e-9,
            of_layer: scene.shows_layer(),
            pending: encoded.map(),
        })
    }

    /// Submits conventional images and leaves them on the GPU: of each its ids, colour, rests and depth. They hold until the next images are made.
    pub(crate) fn keep(
        &mut self,
        scene: &SceneRenderer,
        cameras: &[Pinhole],
    ) -> Result<Vec<[wgpu::TextureView; 4]>, RenderError> {
        let cameras = self.checked(cameras, Discretization::Conventional)?;
        let mut encoder = self.gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let attachments = self.encode(scene, &cameras, Discretization::Conventional, (&mut encoder, None))?;
        self.gpu.queue.submit([encoder.finish()]);
        let views = (0..cameras.len() as u32).map(|layer| attachments.views(layer)).collect();
        self.attachments = Some(attachments);
        Ok(views)
    }

    /// Those of some cameras that a method uses, all of which can be drawn.
    fn checked(&self, cameras: &[Pinhole], method: Discretization) -> Result<Vec<Pinhole>, RenderError> {
        if cameras.is_empty() || cameras.len() > MAX_IMAGES {
            return Err(RenderError::ImageCount { images: cameras.len(), most: MAX_IMAGES });
        }
        let cameras = method.cameras(cameras);
        cameras.iter().try_for_each(|camera| check_camera(&self.gpu, camera))?;
        Ok(cameras)
    }

    /// Draws images by a method that is prepared, each into a layer.
    fn encode(
        &mut self,
        scene: &SceneRenderer,
        cameras: &[Pinhole],
        method: Discretization,
        (encoder, timer): (&mut wgpu::CommandEncoder, Option<&Timer>),
    ) -> Result<Attachments, RenderError> {
        let redundancy = method.redundancy();
        let attachments = self.take_attachments(cameras);
        let depths = redundancy.filter(|redundancy| redundancy.test.needs_depth());
        let depths = depths.map(|_| self.take_depths(&attachments));
        for (index, camera) in cameras.iter().enumerate() {
            let tested = if redundancy.is_some() { index } else { 0 };
            let planes =
                EarlierPlanes { cameras: &cameras[..tested], ids: Some(&attachments.ids), depth: depths.as_ref() };
            let own = self.earlier.group(scene, camera, &planes, redundancy)?;
            let view = scene.view_group(camera);
            let writes = timer.map(|timer| timer.writes(index as u32));
            let mut pass = attachments.begin(encoder, index as u32, [0.0; 3], writes);
            pass.set_bind_group(3, &own, &[]);
            let pipelines = redundancy.filter(|_| tested > 0).and_then(|redundancy| self.built(redundancy));
            scene.draw(&mut pass, pipelines.unwrap_or(&self.conventional), camera, &view);
            drop(pass);
            if let Some(depths) = &depths {
                attachments.copy_depth(&self.gpu, encoder, index as u32, depths);
            }
        }
        self.depths = depths;
        Ok(attachments)
    }

    fn built(&self, redundancy: Redundancy) -> Option<&Pipelines> {
        self.by_redundancy.iter().find(|(built, _)| *built == redundancy).map(|(_, pipelines)| pipelines)
    }

    /// Builds what a method needs, so that its first set need not wait for it.
    pub fn prepare(&mut self, scene: &SceneRenderer, method: Discretization) -> Result<(), RenderError> {
        match method.redundancy() {
            Some(redundancy) if self.built(redundancy).is_none() => {
                self.by_redundancy.push((redundancy, pipelines(scene, &self.earlier, Some(redundancy))?));
                Ok(())
            }
            _ => Ok(()),
        }
    }

    fn take_attachments(&mut self, cameras: &[Pinhole]) -> Attachments {
        let width = cameras.iter().map(|camera| camera.width_px).max().unwrap_or(1);
        let height = cameras.iter().map(|camera| camera.height_px).max().unwrap_or(1);
        let layers = cameras.len() as u32;
        self.attachments
            .take()
            .filter(|kept| kept.holds((width, height), layers))
            .unwrap_or_else(|| Attachments::new(&self.gpu, (width, height), layers))
    }

    fn take_depths(&mut self, attachments: &Attachments) -> wgpu::Texture {
        let (width, height) = attachments.size_px;
        let fits = |kept: &wgpu::Texture| {
            (kept.width(), kept.height(), kept.depth_or_array_layers()) == (width, height, attachments.layers)
        };
        self.depths.take().filter(fits).unwrap_or_else(|| {
            earlier::array(&self.gpu, "earlier depths", earlier::DEPTH_FORMAT, attachments.size_px, attachments.layers)
        })
    }
}

/// The pipelines of a test, or of none.
fn pipelines(
    scene: &SceneRenderer,
    earlier: &EarlierLayout,
    redundancy: Option<Redundancy>,
) -> Result<Pipelines, RenderError> {
    let non_redundant = ("non_redundant", f64::from(u8::from(redundancy.is_some())));
    let constants: Vec<_> = redundancy.iter().flat_map(Redundancy::constants).chain([non_redundant]).collect();
    let pass = Pass {
        fragment: "image",
        formats: &targets::FORMATS,
        own_layout: Some(&earlier.layout),
        constants: &constants,
        faces: Faces::Front,
    };
    Pipelines::new(scene.gpu(), scene.kind(), &pass)
}

/// Images on their way from the GPU.
pub struct PendingCaptures {
    gpu: Gpu,
    cameras: Vec<Pinhole>,
    slots: Vec<Slots>,
    times: Option<Slot>,
    period_s: f64,
    /// Whether they tell what samples of a layer hide.
    of_layer: bool,
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
            let targets::Planes { ids, colour, mut rests, depth } = planes(&mapped, *slots);
            let hides = if self.of_layer {
                rests.iter_mut().map(|rest| std::mem::take(&mut rest[1])).collect()
            } else {
                Vec::new()
            };
            let span = ticks.get(2 * index..2 * index + 2);
            let gpu_s = span.map(|span| span[1].saturating_sub(span[0]) as f64 * self.period_s);
            Capture { camera: *camera, ids, colour, rests, hides, depth, ends: Vec::new(), gpu_s }
        });
        Ok(captures.collect())
    }
}

/// The captures as depth images, all samples, packed in parallel.
pub fn depth_images(captures: &[Capture], precision: DepthPrecision) -> Vec<protocol::DepthImage> {
    captures.par_iter().map(|capture| capture.depth_image(precision)).collect()
}
