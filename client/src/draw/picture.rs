//! The picture of what is held: surfaces and the frame that is drawn from them, as windows, pages and headless runs use it.

use camera::{Bounds, Pinhole};
use glam::{DVec2, DVec3};
use gpu::Gpu;
use protocol::message::{self, Draws, Welcome};
use protocol::{Held, Update};
use surface::{Build, BuiltSurfaces, CornerRules, Corners, HeldSurfaces, SurfaceError, Tint};
use thiserror::Error;
use web_time::Instant;

use crate::draw::antialiasing::Antialias;
use crate::draw::bodies::Bodies;
use crate::draw::camera_image::{CameraImage, CameraImagePass, Showing};
use crate::draw::effects::{Drawn, Effects, InTime};
use crate::draw::feel::{Feel, Wall};
use crate::draw::frame::{self, FrameRenderer};
use crate::draw::fullscreen::EMBEDDED;
use crate::draw::held_pass;
use crate::draw::impostors::Impostors;
use crate::draw::layers::Layers;
use crate::draw::light_images::LightImages;
use crate::draw::occlusion::{self, Occlusion};
use crate::draw::pick::{Pick, Picked};
use crate::draw::rest::RestView;
use crate::draw::shadow::{self, SoftProgress};
use crate::draw::shown::Shown;
use crate::draw::steady::{self, FrameRate, Resolution, Steady};
use crate::receive::follow::Follow;
use crate::receive::moment::Moment;

/// How pictures are drawn.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct PictureOptions {
    /// Where a sample's corners come from.
    pub corners: Corners,
    /// How the frame is drawn.
    pub frame: frame::Options,
    /// How ambient occlusion is measured; not at all by default.
    pub occlusion: occlusion::Settings,
    /// How shadows are drawn; not at all by default.
    pub shadow: shadow::Settings,
    /// Which of both are drawn only as long as frames come in time with them.
    pub in_time: InTime,
    /// Whether frames come in time where drawing all that is held takes too long.
    pub frame_rate: FrameRate,
}

impl PictureOptions {
    /// What a server may send for it, as long as nothing is drawn that has to come in time.
    pub fn draws(&self) -> Draws {
        self.draws_with(InTime::default())
    }

    /// The same, and for those that come in time.
    fn draws_with(&self, kept: InTime) -> Draws {
        let occludes = self.occlusion.occlusion == Occlusion::Graph && (kept.occlusion || !self.in_time.occlusion);
        let casts = kept.shadows || !self.in_time.shadows;
        Draws {
            shadows: if casts { self.shadow.shadows.into() } else { message::Shadows::None },
            antialiased: self.frame.antialias.is_wanted(),
            occlusion_reach_m: if occludes { self.occlusion.reach_m } else { 0.0 },
        }
    }
}

/// Why nothing can be drawn.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum PictureError {
    /// The surfaces.
    #[error(transparent)]
    Surface(#[from] SurfaceError),
    /// The device.
    #[error(transparent)]
    Gpu(#[from] gpu::GpuError),
    /// The way back from the GPU.
    #[error(transparent)]
    Readback(#[from] gpu::ReadbackError),
}

/// Real milliseconds of a picture whose stages were waited for.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Timing {
    /// Drawing the surfaces.
    pub surface_ms: f64,
    /// Lighting, reflecting, filling and showing.
    pub light_ms: f64,
}

/// See the module.
#[derive(Debug)]
pub struct Picture {
    gpu: Gpu,
    surfaces: HeldSurfaces,
    impostors: Impostors,
    bodies: Bodies,
    /// `None` where no shadows are drawn.
    lights: Option<LightImages>,
    /// `None` where what the eye never saw occludes nothing.
    occluders: Option<HeldSurfaces>,
    layers: Layers,
    rest: RestView,
    camera_image: CameraImage,
    /// Made when an image of a camera first comes.
    camera_image_pass: Option<CameraImagePass>,
    format: wgpu::TextureFormat,
    renderer: FrameRenderer,
    options: PictureOptions,
    effects: Effects,
    /// Of those that have to come in time, what the renderer is set to draw.
    drawn: InTime,
    /// `None` where each frame is drawn as a whole.
    steady: Option<Steady>,
    /// When an object last moved.
    moved: Option<Instant>,
    /// Scene time that is shown, in seconds.
    scene_time_s: f64,
    pick: Pick,
    feel: Feel,
    build_ms: f64,
}

impl Picture {
    /// For targets of `format`.
    pub fn new(gpu: &Gpu, format: wgpu::TextureFormat, options: PictureOptions) -> Result<Picture, PictureError> {
        let mut renderer = FrameRenderer::new(gpu, format)?;
        let InTime { shadows, occlusion } = options.in_time;
        if options.occlusion.occlusion != Occlusion::None && !occlusion {
            renderer.set_occlusion(options.occlusion);
        }
        if !shadows {
            renderer.set_shadows(options.shadow);
        }
        let draws = options.draws();
        Ok(Picture {
            gpu: gpu.clone(),
            surfaces: HeldSurfaces::with_corners(gpu, options.corners, CornerRules::default()),
            impostors: Impostors::new(gpu),
            bodies: Bodies::new(gpu),
            lights: (draws.shadows != message::Shadows::None).then(|| LightImages::new(gpu, options.corners)),
            occluders: (draws.occlusion_reach_m > 0.0).then(|| occlusion::occluders(gpu, options.corners)),
            layers: Layers::new(gpu, options.corners),
            rest: RestView::new(gpu),
            camera_image: CameraImage::new(gpu),
            camera_image_pass: None,
            format,
            renderer,
            effects: Effects::new(options.in_time),
            drawn: InTime::default(),
            steady: (options.frame_rate == FrameRate::Held).then(|| Steady::new(gpu, format)),
            moved: None,
            scene_time_s: 0.0,
            pick: Pick::default(),
            feel: Feel::default(),
            options,
            build_ms: 0.0,
        })
    }

    /// How it is drawn.
    pub fn options_mut(&mut self) -> &mut frame::Options {
        &mut self.options.frame
    }

    /// Puts what moves where it is when the next picture is seen, as soon as what is being drawn is; whether that changes it. Where updates leave them they
    /// are put by each of these.
    pub fn show_moment(&mut self, moment: &Moment) -> bool {
        let Moment { scene_time_s, changes, world_from_objects } = moment;
        if !self.is_ready() {
            return self.surfaces.poses_now() != world_from_objects || self.bodies.is_other_at(*scene_time_s);
        }
        self.scene_time_s = *scene_time_s;
        let before = self.surfaces.revision();
        self.surfaces.set_poses(world_from_objects);
        self.lights.iter_mut().for_each(|lights| lights.move_objects(world_from_objects));
        self.occluders.iter_mut().for_each(|occluders| occluders.set_poses(world_from_objects));
        let layers_moved = self.layers.move_objects(world_from_objects);
        let bodies_moved = self.bodies.show_at(*scene_time_s);
        self.rest.show_at(changes.then_some(*scene_time_s));
        let moved = layers_moved || bodies_moved || self.surfaces.revision() != before;
        if moved {
            self.moved = Some(Instant::now());
        }
        moved
    }

    /// Draws and submits; does not wait. Where the image of a camera is held, that is the picture, and of `camera` only the size counts.
    pub fn draw(&mut self, held: &Held, camera: &Pinhole, output: &wgpu::TextureView) {
        if self.camera_image.is_there() {
            return self.draw_camera_image(held, (camera.width_px, camera.height_px), output);
        }
        self.follow_effects(held);
        let tint = self.options.frame.tint;
        self.surfaces.set_tint(tint, self.scene_time_s);
        let (impostors, bodies, lights) = (Some(&self.impostors), Some(&self.bodies), self.lights.as_ref());
        // A view at rest is shown in place of what is held.
        let rest = Some(&self.rest).filter(|_| tint == Tint::Own);
        let (occluders, layers) = (self.occluders.as_ref(), Some(&self.layers));
        let shown = Shown { surfaces: &self.surfaces, held, impostors, bodies, lights, occluders, layers, rest };
        // Pixels are to be those of the picture where they are counted.
        let antialias = if tint == Tint::Own { self.options.frame.antialias } else { Antialias::Off };
        let options = frame::Options { antialias, strengths: self.effects.strengths(), ..self.options.frame };
        if let Some(steady) = &mut self.steady {
            let has_effects = self.drawn != InTime::default();
            let frame = steady::Frame { shown, camera, options, has_effects, moved: self.moved };
            steady.draw(&mut self.renderer, &frame, output);
        } else {
            let mut encoder = self.gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            self.renderer.draw(&mut encoder, shown, camera, output, options);
            self.gpu.queue.submit([encoder.finish()]);
            self.renderer.submitted(true);
        }
        match self.resolution() {
            Resolution::Whole => self.effects.submitted(&self.gpu),
            Resolution::Keys(_) => self.effects.missed(),
        }
    }

    /// The same camera with its near plane half as far as anything held, where that is further. Whoever has no depth range from 0 to 1, as
    /// WebGL2, rounds depths to 2^-25 of where they begin, so that surfaces must lie `2^-25 z² / near` apart: of a model of a kilometre and a near plane
    /// of a centimetre it would be 3 m.
    pub fn begun_far(&self, held: &Held, camera: &Pinhole) -> Pinhole {
        let impostors = Some(&self.impostors);
        let shown = Shown { impostors, bodies: Some(&self.bodies), ..(&self.surfaces, held).into() };
        let layers = self.layers.surfaces().filter_map(HeldSurfaces::bounds_world);
        let bounds = layers.chain(held_pass::bounds_world(shown)).reduce(Bounds::union);
        let eye_from_world = camera.world_from_eye.inverse();
        let depth_m = |corner: DVec3| eye_from_world.transform_point(corner).z;
        let least_m = bounds.into_iter().flat_map(|bounds| bounds.corners()).map(depth_m).reduce(f64::min);
        Pinhole { near_m: camera.near_m.max(0.5 * least_m.filter(|m| m.is_finite()).unwrap_or(0.0)), ..*camera }
    }

    /// How frames are drawn now.
    pub fn resolution(&self) -> Resolution {
        self.steady.as_ref().map_or(Resolution::Whole, Steady::resolution)
    }

    /// Switches on or off what is drawn as long as it comes in time.
    fn follow_effects(&mut self, held: &Held) {
        self.effects.step(Instant::now());
        let (drawn, corners) = (self.effects.drawn(), self.options.corners);
        let before = std::mem::replace(&mut self.drawn, drawn);
        if drawn.shadows != before.shadows {
            let off = shadow::Settings::default();
            self.renderer.set_shadows(if drawn.shadows { self.options.shadow } else { off });
            self.lights = drawn.shadows.then(|| LightImages::new(&self.gpu, corners));
            self.lights.iter_mut().for_each(|lights| lights.rebuild(held));
        }
        if drawn.occlusion != before.occlusion {
            let off = occlusion::Settings::default();
            let settings = if drawn.occlusion { self.options.occlusion } else { off };
            self.renderer.set_occlusion(settings);
            let occludes = drawn.occlusion && settings.occlusion == Occlusion::Graph;
            self.occluders = occludes.then(|| occlusion::occluders(&self.gpu, corners));
            self.occluders.iter_mut().for_each(|occluders| occluders.rebuild(held));
        }
    }

    /// What a server may send for what is drawn now.
    pub fn draws(&self) -> Draws {
        self.options.draws_with(self.effects.kept())
    }

    /// Fits occlusion that has to come in time to what a server shows: a place that people walk in, or an object that they turn.
    pub fn fit_to(&mut self, welcome: &Welcome) {
        if self.options.in_time.occlusion && !self.drawn.occlusion {
            self.options.occlusion.reach_m = occlusion::reach_m(welcome);
        }
    }

    /// What became of shadows and of ambient occlusion.
    pub fn effects(&self) -> [Drawn; 2] {
        let asked = |is: bool| if is { Drawn::Always } else { Drawn::Never };
        let PictureOptions { occlusion, shadow, .. } = self.options;
        let [shadows, ambient] = self.effects.told();
        [shadows.unwrap_or(asked(shadow.casts())), ambient.unwrap_or(asked(occlusion.occlusion != Occlusion::None))]
    }

    /// Draws, waiting for each stage: slower as a whole than [`Picture::draw`], but each stage's time is known.
    #[cfg(not(target_arch = "wasm32"))]
    pub fn draw_measured(
        &mut self,
        held: &Held,
        camera: &Pinhole,
        output: &wgpu::TextureView,
    ) -> Result<Timing, PictureError> {
        if self.camera_image.is_there() {
            let begin = Instant::now();
            self.draw_camera_image(held, (camera.width_px, camera.height_px), output);
            self.gpu.wait_idle()?;
            return Ok(Timing { surface_ms: 0.0, light_ms: begin.elapsed().as_secs_f64() * 1e3 });
        }
        let encoder = || self.gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let begin = Instant::now();
        let mut first = encoder();
        let (impostors, bodies, lights) = (Some(&self.impostors), Some(&self.bodies), self.lights.as_ref());
        let (occluders, layers, rest) = (self.occluders.as_ref(), Some(&self.layers), Some(&self.rest));
        let shown = Shown { surfaces: &self.surfaces, held, impostors, bodies, lights, occluders, layers, rest };
        self.renderer.draw_surfaces(&mut first, shown, camera, self.options.frame);
        self.gpu.queue.submit([first.finish()]);
        self.gpu.wait_idle()?;
        let middle = Instant::now();
        let mut second = encoder();
        self.renderer.draw_light(&mut second, shown, camera, output, self.options.frame);
        self.gpu.queue.submit([second.finish()]);
        self.renderer.submitted(true);
        self.gpu.wait_idle()?;
        let ms = |from: Instant, to: Instant| (to - from).as_secs_f64() * 1e3;
        Ok(Timing { surface_ms: ms(begin, middle), light_ms: ms(middle, Instant::now()) })
    }

    fn draw_camera_image(&mut self, held: &Held, size_px: (u32, u32), output: &wgpu::TextureView) {
        let made = || CameraImagePass::new(&self.gpu, self.format).expect(EMBEDDED);
        let pass = self.camera_image_pass.get_or_insert_with(made);
        let mut encoder = self.gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let frame::Options { mark_uncovered, coverage_in_alpha, exposure, .. } = self.options.frame;
        let showing = Showing { size_px, mark: mark_uncovered.then_some(frame::MARK), coverage_in_alpha, exposure };
        pass.encode(&mut encoder, (&self.camera_image, held), showing, output);
        self.gpu.queue.submit([encoder.finish()]);
        pass.submitted();
    }

    /// How surfaces that it draws are built beside it.
    pub fn build(&self) -> Build {
        self.surfaces.build()
    }

    /// Builds the surfaces of everything held, on a device that has none of them yet.
    pub fn rebuild(&mut self, held: &Held) {
        self.surfaces.rebuild(held);
        self.impostors.rebuild(held);
        self.bodies.rebuild(held);
        self.lights.iter_mut().for_each(|lights| lights.rebuild(held));
        self.occluders.iter_mut().for_each(|occluders| occluders.rebuild(held));
        self.layers.rebuild(held);
        self.rest.rebuild(held);
        self.camera_image.rebuild(held);
    }

    /// How many impostors there are: for what mirrors and glass show, and of objects that are drawn by them.
    pub fn impostors(&self) -> usize {
        self.impostors.len()
    }

    /// Whether a camera is that of a viewer at rest, and all that it sees is here.
    pub fn is_at_rest(&self, camera: &Pinhole) -> bool {
        self.rest.shows_all_of(camera)
    }

    /// Asks what a camera sees at a place of its picture; whether that can be asked now, which is not so while a picture is drawn in parts.
    pub fn pick(&mut self, held: &Held, camera: &Pinhole, at_px: DVec2) -> bool {
        if !self.is_ready() {
            return false;
        }
        let (impostors, bodies) = (Some(&self.impostors), Some(&self.bodies));
        let shown = Shown { impostors, bodies, ..(&self.surfaces, held).into() };
        self.renderer.pick(&mut self.pick, shown, camera, at_px);
        true
    }

    /// What was found there, once: `Some(None)` where nothing is. `None` as long as it is not known.
    pub fn picked(&mut self) -> Option<Option<Picked>> {
        self.pick.take()
    }

    /// Asks what would stop a body of a radius on its way from an eye, along a unit vector, where that can be asked now.
    pub fn feel(&mut self, held: &Held, way: (DVec3, DVec3), body: (f64, f64)) {
        if self.is_ready() {
            let (impostors, bodies) = (Some(&self.impostors), Some(&self.bodies));
            let shown = Shown { impostors, bodies, ..(&self.surfaces, held).into() };
            self.renderer.feel(&mut self.feel, shown, way, body);
        }
    }

    /// What stops it, once: `Some(None)` where the way is free. `None` as long as it is not known.
    pub fn felt(&mut self) -> Option<Option<Wall>> {
        self.feel.take()
    }

    /// Whether the next picture may show more than the last one, though nothing moves.
    pub fn goes_on(&self) -> bool {
        self.soft_progress().is_some_and(SoftProgress::goes_on)
            || self.options.frame.tint == Tint::Age
            || self.effects.go_on()
            || self.steady.as_ref().is_some_and(Steady::goes_on)
    }

    /// How far soft shadows got in the last picture. `None` where no light casts any.
    pub fn soft_progress(&self) -> Option<SoftProgress> {
        self.renderer.soft_progress()
    }

    /// Share of pixels without a surface in the newest picture that was counted; `None` before the first.
    pub fn uncovered_share(&mut self) -> Option<f64> {
        match &mut self.camera_image_pass {
            Some(pass) if self.camera_image.is_there() => pass.uncovered_share(),
            _ => self.renderer.uncovered_share(),
        }
    }

    /// What building surfaces took since this was last asked, in milliseconds.
    pub fn take_build_ms(&mut self) -> f64 {
        std::mem::take(&mut self.build_ms)
    }
}

impl Follow for Picture {
    fn follow(&mut self, held: &Held, update: &Update, anew: bool, built: &mut BuiltSurfaces) {
        let begin = Instant::now();
        self.surfaces.follow(held, update, anew, built);
        self.impostors.follow(held, update, anew, built);
        self.bodies.follow(held, update, anew, built);
        self.lights.iter_mut().for_each(|lights| lights.follow(held, update, anew, built));
        self.occluders.iter_mut().for_each(|occluders| occluders.follow(held, update, anew, built));
        self.layers.follow(held, update, anew, built);
        self.rest.follow(held, update, anew, built);
        self.camera_image.follow(held, update, anew, built);
        self.build_ms += begin.elapsed().as_secs_f64() * 1e3;
    }

    fn upload(&mut self, built: &mut BuiltSurfaces) -> bool {
        built.upload(&self.gpu)
    }

    fn is_ready(&self) -> bool {
        self.steady.as_ref().is_none_or(|steady| !steady.is_drawing(Instant::now()))
    }
}
