//! What a server needs from whatever makes depth images: the seam between sessions and the GPU.

use std::sync::Arc;

use camera::{Bounds, Camera, Pinhole};
use glam::DVec3;
use gpu::Gpu;
use protocol::staging::Excerpt;
use protocol::{DepthImage, Lighting, Mask, Material, Purpose, Sky};
use scene::{Scene, Snapshot};
use surface::{AddressPass, AddressView, HeldSurfaces, SurfaceError};
use thiserror::Error;

use crate::account::Account;
use crate::beside::{Asked, BesidePass, Found, KeptView};
use crate::config::{ComparesOn, Config};
use crate::devices::{self, Devices};
use crate::discretize::{Capture, DepthPrecision, Discretization, Discretizer, EndsPass};
use crate::impostors::draw::{ImpostorDrawer, Subject};
use crate::impostors::{Drawn, Shot};
use crate::look::SceneLook;
use crate::render::{Blended, Detail, Faces, Kinds, Layer, LeftOut, RenderError, SceneRenderer};
use crate::rest::parts;
use crate::truth::TruthRenderer;

/// Why no images could be made.
#[derive(Debug, Error)]
pub enum ImagerError {
    /// The scene does not fit, or the GPU or its driver gave up; the server cannot go on.
    #[error(transparent)]
    Render(#[from] RenderError),
    /// A client's copy cannot be drawn.
    #[error(transparent)]
    Surface(#[from] SurfaceError),
}

/// Lays views of the scene beside the same views of copies on the GPU, and reads back only what comes of it.
pub trait Comparer {
    /// Where that happens.
    fn gpu(&self) -> &Gpu;

    /// Whether it can compare views with a copy, whose facts are kept from now on; see [`BesidePass::takes`].
    fn takes(&mut self, account: &mut Account, views: &[Pinhole]) -> bool;

    /// Draws what each view sees of the scene, and leaves it on the GPU, until the next images are made.
    fn keep(&mut self, snapshot: &Snapshot, views: &[Pinhole]) -> Result<Vec<KeptView>, ImagerError>;

    /// What a view lacks, and more; see [`BesidePass::compare`].
    fn compare(&mut self, account: &Account, view: &KeptView, asked: &Asked<'_>) -> Result<Option<Found>, ImagerError>;
}

/// What images are drawn for: whether anybody else may ask for the same.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Occasion {
    /// A viewer on the move: nobody else will be just there.
    #[default]
    Passing,
    /// A viewer who stands, where others may: where the scene begins, above all.
    Standing,
    /// The same one, of whom it is not known yet where it will go.
    Ahead,
}

/// Sees one scene, and what clients hold of it. One thread owns it.
pub trait Imager: Send {
    /// What compares views on the GPU; `None` where the processor does.
    fn comparer(&mut self) -> Option<&mut dyn Comparer> {
        None
    }

    /// Another imager of the same scene, for another thread; `None` where there can be only one.
    fn twin(&self) -> Option<Box<dyn Imager>> {
        None
    }

    /// Another imager of the same scene in place of this one, which failed: on another device where its own is lost; `None` where there can be only one.
    fn anew(&self) -> Result<Option<Box<dyn Imager>>, ImagerError> {
        Ok(self.twin())
    }

    /// Whether its device is lost, so that whatever it does fails.
    fn is_lost(&self) -> bool {
        false
    }

    /// Counts the devices that were lost before this imager's: what lies on one cannot be drawn by another's.
    fn device(&self) -> u32 {
        0
    }

    /// What draws, for people: the adapter's name and kind.
    fn adapter(&self) -> String;

    /// The table that the samples' material codes index.
    fn materials(&self) -> Vec<Material>;

    /// Which codes of the samples' materials belong together.
    fn kinds(&self) -> Kinds {
        Kinds::default()
    }

    /// The lights of a snapshot, as clients shade with them.
    fn lighting(&self, snapshot: &Snapshot) -> Lighting;

    /// Light from all around; `None` of a look without, and where it falls on nothing.
    fn sky(&self) -> Option<Arc<Sky>> {
        None
    }

    /// Says what is drawn from now on for.
    fn draw_for(&mut self, _: Occasion) {}

    /// What each view sees of the scene, in order, less what the method leaves out.
    fn captures(
        &mut self,
        snapshot: &Snapshot,
        views: &[Pinhole],
        method: Discretization,
    ) -> Result<Vec<Capture>, ImagerError>;

    /// What a viewer at rest sees: everything that there is, with as much kept of it as is wanted.
    fn own_view(&mut self, snapshot: &Snapshot, view: &Pinhole, _: Detail) -> Result<Vec<Capture>, ImagerError> {
        self.captures(snapshot, &[*view], Discretization::Conventional)
    }

    /// The images of rows of a view at rest: one, or in parts as many as pixels have.
    fn view_at_rest(
        &mut self,
        snapshot: &Snapshot,
        view: &Pinhole,
        in_parts: bool,
        precision: DepthPrecision,
    ) -> Result<Vec<DepthImage>, ImagerError> {
        let (camera, detail) = if in_parts { (parts::fine(view), Detail::Parts) } else { (*view, Detail::Fine) };
        let captures = self.own_view(snapshot, &camera, detail)?;
        let kinds = self.kinds();
        let images = |capture: &Capture| {
            if in_parts {
                parts::layers(view, capture, &kinds, precision)
            } else {
                vec![capture.depth_image(precision)]
            }
        };
        Ok(captures.iter().flat_map(images).collect())
    }

    /// The longest side that a view may have: at least what WebGPU promises.
    fn largest_side_px(&self) -> u32 {
        8192
    }

    /// Gets ready to tell of captures from about here that another imager drew.
    fn place(&mut self, _: &Snapshot, _eye_world: DVec3) -> Result<(), ImagerError> {
        Ok(())
    }

    /// Tells of the samples of a mask of a capture's where their surfaces end within a pixel, with everything as it was at the last
    /// [`Imager::captures`]. Says nothing where this imager cannot tell.
    fn tell_ends(&mut self, _: &mut Capture, _: &Mask) -> Result<(), ImagerError> {
        Ok(())
    }

    /// Leaves normal maps out of [`Imager::captures`] from now on, or no longer.
    fn smooth(&mut self, _: bool) {}

    /// By material of the scene, its index into [`Imager::materials`]; `None` where it, or its normal, is told place by place.
    fn material_codes(&self) -> Vec<Option<u8>> {
        Vec::new()
    }

    /// Makes no samples of objects in [`Imager::captures`] from now on.
    fn leave_out(&mut self, _: LeftOut) {}

    /// Draws this part of the scene alone from now on.
    fn show(&mut self, _: &Excerpt) {}

    /// The layers that what is blended is sent in.
    fn layers(&self) -> Vec<Layer> {
        Vec::new()
    }

    /// A box around all that is in a layer, in world space; `None` where nothing is.
    fn layer_bounds(&mut self, _: &Snapshot, _: Layer) -> Result<Option<Bounds>, ImagerError> {
        Ok(None)
    }

    /// Draws what is blended so in [`Imager::captures`] from now on.
    fn blend(&mut self, _: Blended) {}

    /// A picture for rays, of what is there now; `None` where this imager draws none.
    fn impostor(&mut self, _: &Snapshot, _: &Shot<'_>) -> Result<Option<DepthImage>, ImagerError> {
        Ok(None)
    }

    /// A picture of a view as clients would show it, of sRGB with alpha; `None` where this imager draws none.
    fn picture(&mut self, _: &Snapshot, _: &Pinhole) -> Result<Option<Vec<[u8; 4]>>, ImagerError> {
        Ok(None)
    }

    /// All that any camera sees, with normals and colours as finely as they are coded; `None` where this imager draws none.
    fn camera_image(&mut self, _: &Snapshot, _: &Camera) -> Result<Option<DepthImage>, ImagerError> {
        Ok(None)
    }

    /// What a new client's copy is drawn with; `None` where [`Imager::copy_view`] needs nothing.
    fn new_surfaces(&self) -> Option<HeldSurfaces>;

    /// What a view shows of a client's copy, as far as that is for a purpose.
    fn copy_view(&mut self, account: &Account, purpose: Purpose, view: &Pinhole) -> Result<AddressView, ImagerError>;
}

/// The imager of a real server.
pub struct GpuImager {
    renderer: SceneRenderer,
    discretizer: Discretizer,
    ends: EndsPass,
    addresses: AddressPass,
    /// Compares views, where that is done on the GPU.
    beside: Option<BesidePass>,
    /// Built with the first impostor.
    impostors: Option<ImpostorDrawer>,
    look: SceneLook,
    adapter: String,
    /// Scene time and anchor of what is on the GPU now.
    placed: Option<(f64, DVec3)>,
    /// Where another device is to be had.
    devices: Option<Arc<Devices>>,
    /// Devices before this one.
    device: u32,
}

/// The GPU works in f32 relative to an anchor; closer than this, positions near the eye keep 10 micrometres.
const MAX_ANCHOR_DISTANCE_M: f64 = 64.0;

impl GpuImager {
    /// Uploads a scene.
    pub fn new(gpu: &Gpu, scene: &Scene, config: &Config) -> Result<GpuImager, ImagerError> {
        GpuImager::of(devices::prepared(gpu, scene, config)?, scene, config)
    }

    /// The same, which is made anew on another device where its own is lost.
    pub fn on(self, devices: Devices) -> GpuImager {
        GpuImager { devices: Some(Arc::new(devices)), ..self }
    }

    fn of(renderer: SceneRenderer, scene: &Scene, config: &Config) -> Result<GpuImager, ImagerError> {
        let gpu = &renderer.gpu().clone();
        let mut discretizer = Discretizer::new(&renderer)?;
        discretizer.prepare(&renderer, config.discretization)?;
        let ends = EndsPass::new(&renderer)?;
        let shown_by = (config.tone, config.exposure);
        let look = SceneLook::under(config.environment.as_deref(), shown_by, scene, config.look);
        let kind = if gpu.caps.software { "software" } else { "hardware" };
        let adapter = format!("{} ({kind})", gpu.caps.name);
        let on_gpu = match config.compares_on {
            ComparesOn::Faster => !gpu.caps.software,
            ComparesOn::Gpu => true,
            ComparesOn::Processor => false,
        };
        let on_gpu = on_gpu && BesidePass::is_possible(gpu);
        let beside = if on_gpu { Some(BesidePass::new(gpu)?) } else { None };
        let addresses = if on_gpu { AddressPass::on_gpu(gpu)? } else { AddressPass::new(gpu)? };
        Ok(GpuImager {
            renderer,
            discretizer,
            ends,
            addresses,
            beside,
            look,
            adapter,
            impostors: None,
            placed: None,
            devices: None,
            device: 0,
        })
    }
}

impl Comparer for GpuImager {
    fn gpu(&self) -> &Gpu {
        self.renderer.gpu()
    }

    fn takes(&mut self, account: &mut Account, views: &[Pinhole]) -> bool {
        account.know_on(self.renderer.gpu());
        account.refresh();
        self.beside.as_ref().is_some_and(|beside| beside.takes(account, views))
    }

    fn keep(&mut self, snapshot: &Snapshot, views: &[Pinhole]) -> Result<Vec<KeptView>, ImagerError> {
        let Some(first) = views.first() else { return Ok(Vec::new()) };
        self.place(snapshot, first.world_from_eye.translation)?;
        let planes = self.discretizer.keep(&self.renderer, views)?;
        Ok(views.iter().zip(planes).map(|(camera, planes)| KeptView { camera: *camera, planes }).collect())
    }

    fn compare(&mut self, account: &Account, view: &KeptView, asked: &Asked<'_>) -> Result<Option<Found>, ImagerError> {
        let Some(beside) = &mut self.beside else { return Ok(None) };
        Ok(beside.compare((&self.renderer, &mut self.ends), account, view, asked)?)
    }
}

impl Imager for GpuImager {
    fn comparer(&mut self) -> Option<&mut dyn Comparer> {
        if self.beside.is_some() { Some(self) } else { None }
    }

    fn twin(&self) -> Option<Box<dyn Imager>> {
        Some(Box::new(GpuImager {
            renderer: self.renderer.twin()?,
            discretizer: self.discretizer.twin(),
            ends: self.ends.twin(),
            addresses: self.addresses.twin().ok()?,
            beside: self.beside.as_ref().map(BesidePass::twin).transpose().ok()?,
            impostors: None,
            look: self.look.clone(),
            adapter: self.adapter.clone(),
            placed: None,
            devices: self.devices.clone(),
            device: self.device,
        }))
    }

    fn anew(&self) -> Result<Option<Box<dyn Imager>>, ImagerError> {
        let Some(devices) = self.devices.as_ref().filter(|_| self.is_lost()) else {
            return Ok(self.twin());
        };
        let (device, renderer) = devices.after(self.device)?;
        let anew = GpuImager::of(renderer, &devices.scene, &devices.config)?;
        Ok(Some(Box::new(GpuImager { devices: Some(devices.clone()), device, ..anew })))
    }

    fn is_lost(&self) -> bool {
        self.renderer.gpu().check().is_err()
    }

    fn device(&self) -> u32 {
        self.device
    }

    fn adapter(&self) -> String {
        self.adapter.clone()
    }

    fn materials(&self) -> Vec<Material> {
        self.renderer.materials().to_vec()
    }

    fn kinds(&self) -> Kinds {
        self.renderer.kinds().clone()
    }

    fn lighting(&self, snapshot: &Snapshot) -> Lighting {
        self.look.lighting(snapshot)
    }

    fn sky(&self) -> Option<Arc<Sky>> {
        let is_lit = self.renderer.materials().iter().any(|material| !material.unlit);
        self.look.sky().filter(|_| is_lit).cloned()
    }

    fn captures(
        &mut self,
        snapshot: &Snapshot,
        views: &[Pinhole],
        method: Discretization,
    ) -> Result<Vec<Capture>, ImagerError> {
        let Some(first) = views.first() else { return Ok(Vec::new()) };
        self.place(snapshot, first.world_from_eye.translation)?;
        Ok(self.discretizer.run(&self.renderer, views, method)?.wait()?)
    }

    fn own_view(&mut self, snapshot: &Snapshot, view: &Pinhole, detail: Detail) -> Result<Vec<Capture>, ImagerError> {
        // What reliefs show to an eye that moves is seen as it is.
        self.renderer.leave_out(LeftOut::default());
        // Layers lie over it.
        self.renderer.blend(Blended::LeftOut);
        self.renderer.keep(detail);
        let captures = self.captures(snapshot, &[*view], Discretization::Conventional);
        self.renderer.keep(Detail::Motion);
        captures
    }

    fn largest_side_px(&self) -> u32 {
        self.renderer.gpu().device.limits().max_texture_dimension_2d
    }

    fn place(&mut self, snapshot: &Snapshot, eye_world: DVec3) -> Result<(), ImagerError> {
        let near = |&(time_s, anchor): &(f64, DVec3)| {
            time_s == snapshot.time_s && anchor.distance(eye_world) < MAX_ANCHOR_DISTANCE_M
        };
        if !self.placed.as_ref().is_some_and(near) {
            self.renderer.update(snapshot, eye_world)?;
            self.placed = Some((snapshot.time_s, eye_world));
        }
        Ok(())
    }

    fn tell_ends(&mut self, capture: &mut Capture, mask: &Mask) -> Result<(), ImagerError> {
        Ok(self.ends.tell(&self.renderer, capture, mask)?)
    }

    fn smooth(&mut self, is_smooth: bool) {
        self.renderer.smooth(is_smooth);
    }

    fn material_codes(&self) -> Vec<Option<u8>> {
        self.renderer.material_codes()
    }

    fn leave_out(&mut self, left_out: LeftOut) {
        self.renderer.leave_out(left_out);
    }

    fn show(&mut self, excerpt: &Excerpt) {
        self.renderer.show(excerpt);
    }

    fn layers(&self) -> Vec<Layer> {
        self.renderer.layers().to_vec()
    }

    fn layer_bounds(&mut self, snapshot: &Snapshot, layer: Layer) -> Result<Option<Bounds>, ImagerError> {
        let anchor = self.placed.map_or(DVec3::ZERO, |(_, anchor)| anchor);
        self.place(snapshot, anchor)?;
        Ok(self.renderer.layer_bounds(layer))
    }

    fn blend(&mut self, blended: Blended) {
        self.renderer.blend(blended);
    }

    fn impostor(&mut self, snapshot: &Snapshot, shot: &Shot<'_>) -> Result<Option<DepthImage>, ImagerError> {
        self.place(snapshot, shot.camera.eye_world())?;
        self.renderer.blend(Blended::CutOut);
        // Rays meet everything.
        let left_out = self.renderer.leave_out(LeftOut::default());
        let panes = self.renderer.panes().clone();
        let drawer = match &mut self.impostors {
            Some(drawer) => drawer,
            None => self.impostors.insert(ImpostorDrawer::new(&self.renderer)?),
        };
        let is_drawn = |object| shot.drawn.contains(object) && !panes.contains(&object);
        let subject = Subject { objects: &is_drawn, faces: shot.faces };
        let untinted = match shot.drawn {
            Drawn::Only(object) if !shot.is_tinted => Some(*object),
            _ => None,
        };
        let tint = untinted.map(|object| self.renderer.set_tint(object, [255; 3]));
        let capture = drawer.draw(&self.renderer, shot.camera, subject);
        self.renderer.leave_out(left_out);
        if let (Some(object), Some(tint)) = (untinted, tint) {
            self.renderer.set_tint(object, tint);
        }
        Ok(Some(capture?.depth_image(DepthPrecision::Finest)))
    }

    fn picture(&mut self, snapshot: &Snapshot, view: &Pinhole) -> Result<Option<Vec<[u8; 4]>>, ImagerError> {
        self.place(snapshot, view.world_from_eye.translation)?;
        let drawn = TruthRenderer::new(&self.renderer)?.with_sky(self.sky());
        Ok(Some(drawn.render_smooth(&self.renderer, view, &self.lighting(snapshot))?.colour))
    }

    fn camera_image(&mut self, snapshot: &Snapshot, camera: &Camera) -> Result<Option<DepthImage>, ImagerError> {
        let everything = Drawn::AllBut(Vec::new());
        let shot = Shot { camera, drawn: &everything, faces: Faces::Front, is_tinted: true };
        self.renderer.leave_out(LeftOut::default());
        self.renderer.blend(Blended::CutOut);
        self.renderer.keep(Detail::Fine);
        let image = self.impostor(snapshot, &shot);
        self.renderer.keep(Detail::Motion);
        image
    }

    fn new_surfaces(&self) -> Option<HeldSurfaces> {
        Some(self.addresses.new_surfaces())
    }

    fn copy_view(&mut self, account: &Account, purpose: Purpose, view: &Pinhole) -> Result<AddressView, ImagerError> {
        let Some(surfaces) = account.surfaces(purpose) else {
            return Ok(AddressView::empty((view.width_px, view.height_px)));
        };
        Ok(self.addresses.view(surfaces, view).map_err(RenderError::from)?)
    }
}
