//! Depth images of any camera of an [`impostor::Impostor`], drawn from the scene each time they are asked for: moving
//! objects are made anew as they move.
//!
//! Method: Rosen, Popescu, Hayward, Wyman, *Non-pinhole approximations for interactive rendering*, sections 4 and 5;
//! Popescu, Hayward, Rosen, Wyman, *Non-pinhole impostors* (2009), sections 4 and 5. Their images are made
//! feed-forward: vertices are projected, and triangles rasterized between them. A pinhole needs no more. [`spoc`] says
//! how triangles are cut where a straight line between vertices is too far from the curve that the single-pole camera
//! sees, [`graph`] how a scene is drawn through many frusta into one image.
//!
//! Which side of a triangle faces the camera is decided in its image, by the order of the corners: a single-pole camera
//! sees the front of triangles that face away from its eye, and a graph camera has no one eye.

mod capture;
pub mod coverage;
mod frame;
pub mod graph;
pub mod spoc;

pub use crate::render::Faces;
pub use capture::ImpostorCapture;
pub use frame::Subject;

use camera::Camera;
use std::time::Instant;

use gpu::{Gpu, Readback};

use crate::render::{Pass, Pipelines, RenderError, SceneKind, SceneRenderer, check_camera};
use crate::targets::{self, Attachments, planes};
use crate::timer::Timer;
use frame::Frame;
use graph::GraphPass;
use spoc::SpocPass;

/// Makes depth images of any camera.
pub struct ImpostorDrawer {
    gpu: Gpu,
    spoc: Option<SpocPass>,
    graph: GraphPass,
    /// Built when first asked for.
    pipelines: Vec<((Kind, Faces, SceneKind), Pipelines)>,
    /// Kept for the next image of the same size.
    attachments: Option<Attachments>,
}

/// Cameras that are drawn alike.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    Pinhole,
    Spoc,
    Graph,
}

impl Kind {
    fn of(camera: &Camera) -> Kind {
        match camera {
            Camera::Pinhole(_) => Kind::Pinhole,
            Camera::Spoc(_) => Kind::Spoc,
            Camera::Graph(_) => Kind::Graph,
        }
    }
}

impl ImpostorDrawer {
    /// A drawer of scenes of `scene`'s kind ([`SceneRenderer::kind`]).
    ///
    /// # Errors
    /// [`RenderError`] where the GPU fails.
    pub fn new(scene: &SceneRenderer) -> Result<ImpostorDrawer, RenderError> {
        let gpu = scene.gpu().clone();
        Ok(ImpostorDrawer { spoc: None, graph: GraphPass::new(&gpu), pipelines: Vec::new(), attachments: None, gpu })
    }

    /// Draws and reads back one image of what `subject` says of the scene as it is now.
    ///
    /// # Errors
    /// [`RenderError::Camera`] for a camera that is not valid or too large for this GPU; [`RenderError::TooLarge`]
    /// where a camera that is not a pinhole draws more than this GPU's vertex stage can read;
    /// [`RenderError::NoCompute`] for a single-pole camera on a GPU without; others where the GPU fails.
    pub fn draw(
        &mut self,
        scene: &SceneRenderer,
        camera: &Camera,
        subject: Subject<'_>,
    ) -> Result<ImpostorCapture, RenderError> {
        let started = Instant::now();
        let near_m = self.check(camera)?;
        let kind = Kind::of(camera);
        self.prepare(scene, kind, subject.faces)?;
        let Some((_, pipelines)) = self.pipelines.iter().find(|(key, _)| *key == (kind, subject.faces, scene.kind()))
        else {
            unreachable!("prepared")
        };
        let size_px = camera.size_px();
        let kept = self.attachments.take().filter(|kept| kept.size_px == size_px);
        let attachments = kept.unwrap_or_else(|| Attachments::new(&self.gpu, size_px, 1));
        let mut frame = Frame {
            encoder: self.gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default()),
            timer: Timer::new(&self.gpu, if kind == Kind::Spoc { 2 } else { 1 }),
            attachments,
            scene,
            pipelines,
            subject,
        };
        match (camera, &self.spoc) {
            (Camera::Pinhole(camera), _) => frame.draw_pinhole(camera),
            (Camera::Spoc(camera), Some(pass)) => pass.draw(&mut frame, camera)?,
            (Camera::Spoc(_), None) => unreachable!("prepared"),
            (Camera::Graph(camera), _) => self.graph.draw(&mut frame, camera)?,
        }
        let Frame { mut encoder, timer, attachments, .. } = frame;
        let mut readback = Readback::default();
        let slots = attachments.read(&mut readback, 0, size_px);
        let times = timer.map(|timer| timer.read(&mut encoder, &mut readback));
        let encoded = readback.encode(&self.gpu, &mut encoder);
        self.gpu.queue.submit([encoder.finish()]);
        let mapped = encoded.map().wait(&self.gpu)?;
        self.attachments = Some(attachments);
        let targets::Planes { ids, colour, rests, depth } = planes(&mapped, slots);
        let ticks: Option<Vec<u64>> = times.map(|slot| mapped.values(slot));
        let gpu_ticks = ticks.and_then(|ticks| Some(ticks.last()?.saturating_sub(*ticks.first()?)));
        let period_s = f64::from(self.gpu.queue.get_timestamp_period()) * 1e-9;
        Ok(ImpostorCapture {
            camera: camera.clone(),
            ids,
            colour,
            rests,
            w: depth.into_iter().map(|depth| depth / near_m).collect(),
            gpu_s: gpu_ticks.map(|ticks| ticks as f64 * period_s),
            wall_s: started.elapsed().as_secs_f64(),
        })
    }

    /// Where the image's greatest `w` lies: the depth buffer holds `near_m * w` of every camera.
    fn check(&self, camera: &Camera) -> Result<f32, RenderError> {
        let (width_px, height_px) = camera.size_px();
        let pinhole = match camera {
            Camera::Pinhole(camera) => camera,
            Camera::Spoc(camera) if !camera.is_valid() => {
                return Err(RenderError::Camera { width_px, height_px });
            }
            Camera::Spoc(camera) => &camera.pinhole,
            Camera::Graph(camera) => camera.root(),
        };
        check_camera(&self.gpu, pinhole)?;
        Ok(pinhole.near_m as f32)
    }

    /// Builds what a kind of camera needs.
    fn prepare(&mut self, scene: &SceneRenderer, kind: Kind, faces: Faces) -> Result<(), RenderError> {
        let key = (kind, faces, scene.kind());
        if self.pipelines.iter().any(|(known, _)| *known == key) {
            return Ok(());
        }
        let pulled = SceneKind { native: false, ..scene.kind() };
        let formats = &targets::FORMATS;
        let pass = |own_layout| Pass { fragment: "plain", formats, own_layout, constants: &[], faces };
        let built = match kind {
            Kind::Pinhole => Pipelines::new(&self.gpu, scene.kind(), &pass(None))?,
            Kind::Spoc => {
                let spoc = match self.spoc.take() {
                    Some(spoc) => spoc,
                    None => SpocPass::new(&self.gpu)?,
                };
                let spoc = self.spoc.insert(spoc);
                Pipelines::of_file(&self.gpu, "server/raster_spoc.wgsl", pulled, &pass(Some(spoc.layout())))?
            }
            Kind::Graph => {
                Pipelines::of_file(&self.gpu, "server/raster_graph.wgsl", pulled, &pass(Some(self.graph.layout())))?
            }
        };
        self.pipelines.push((key, built));
        Ok(())
    }
}
