//! Everything held, drawn from a camera: what views and shadow maps begin with.

use camera::{Bounds, Pinhole};
use glam::DAffine3;
use gpu::Gpu;
use protocol::held::HeldInstance;
use protocol::{Held, PatchId};
use surface::{GBuffer, SETBACK_FOOTPRINTS, Slices, Smoothing, SurfaceError, SurfacePass, Tint};

use crate::draw::bodies::{self, Bodies, BodyInputs, BodyPass};
use crate::draw::fullscreen::EMBEDDED;
use crate::draw::impostors::Impostors;
use crate::draw::relief::{ReliefInputs, ReliefPass};
use crate::draw::shown::Shown;

/// Draws surfaces, and objects shown by reliefs and bodies, into a [`GBuffer`]; the nearest wins.
#[derive(Debug)]
pub(crate) struct HeldPass {
    gpu: Gpu,
    surface: SurfacePass,
    /// Made when what samples are is first shown, in place of what they saw.
    tinted: Option<SurfacePass>,
    /// Made when a relief first shows something.
    relief: Option<ReliefPass>,
    /// Made when a body first shows something.
    body: Option<BodyPass>,
    casts: bool,
}

impl HeldPass {
    pub(crate) fn new(gpu: &Gpu) -> Result<HeldPass, SurfaceError> {
        Ok(HeldPass::of(gpu, SurfacePass::new(gpu)?, false))
    }

    /// Draws what casts shadows, as seen from a light: see [`SurfacePass::casting`]. Bodies lie back by as much, of the map's
    /// own texels: adapters interpolate depth as they like, and a floor that is nearer by a millionth would be in its own shadow. Reliefs as views see them.
    pub(crate) fn casting(gpu: &Gpu) -> Result<HeldPass, SurfaceError> {
        Ok(HeldPass::of(gpu, SurfacePass::casting(gpu)?, true))
    }

    fn of(gpu: &Gpu, surface: SurfacePass, casts: bool) -> HeldPass {
        HeldPass { gpu: gpu.clone(), surface, tinted: None, relief: None, body: None, casts }
    }

    /// Clears the targets and draws everything held as seen by `camera`, whose size is the targets'.
    pub(crate) fn encode(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        shown: Shown<'_>,
        camera: &Pinhole,
        smoothing: Smoothing,
        target: &GBuffer,
    ) {
        self.encode_slice(encoder, (shown, &mut Slices::default(), usize::MAX), camera, smoothing, target);
    }

    /// The next slice of the same: see [`SurfacePass::encode_slice`]. The last one has bodies and reliefs.
    pub(crate) fn encode_slice(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        (shown, slices, most_quads): (Shown<'_>, &mut Slices, usize),
        camera: &Pinhole,
        smoothing: Smoothing,
        target: &GBuffer,
    ) {
        let Shown { surfaces, held, impostors, bodies, .. } = shown;
        let surface = if self.casts || surfaces.tint() == Tint::Own {
            &self.surface
        } else {
            self.tinted.get_or_insert_with(|| SurfacePass::tinted(&self.gpu).expect(EMBEDDED))
        };
        surface.encode_slice(encoder, (surfaces, slices, most_quads), camera, smoothing, target);
        if !slices.are_all() {
            return;
        }
        let poses_now = surfaces.poses_now();
        if let Some(bodies) = bodies.filter(|bodies| !bodies.is_empty()) {
            let body = self.body.get_or_insert_with(|| BodyPass::new(&self.gpu).expect(EMBEDDED));
            let setback = if self.casts { (SETBACK_FOOTPRINTS / camera.focal_px) as f32 } else { 0.0 };
            body.encode(encoder, &BodyInputs { bodies, held, poses_now, camera, setback }, target);
        }
        let Some(impostors) = impostors.filter(|impostors| show_reliefs(impostors, held)) else { return };
        let relief = self.relief.get_or_insert_with(|| ReliefPass::new(&self.gpu).expect(EMBEDDED));
        relief.encode(encoder, &ReliefInputs { impostors, held, poses_now, camera }, target);
    }

    /// Whether a relief ever showed something, and so a pipeline for it exists.
    pub(crate) fn draws_reliefs(&self) -> bool {
        self.relief.is_some()
    }
}

/// A box around all that is drawn, as it was captured, but objects shown by reliefs and bodies where they are now; `None` where nothing is.
pub(crate) fn bounds_world(Shown { surfaces, held, impostors, bodies, .. }: Shown<'_>) -> Option<Bounds> {
    let of_instance = |(&(object, relief), instance): (&(u16, PatchId), &HeldInstance)| {
        let relief = impostors?.relief(relief.0)?;
        let capture_from_object = relief.pose.map_or(DAffine3::IDENTITY, |(_, at_capture)| at_capture);
        let world_from_object = *surfaces.poses_now().get(&object).unwrap_or(&instance.world_from_object);
        let world_from_anchor =
            world_from_object * capture_from_object.inverse() * DAffine3::from_translation(relief.anchor_world);
        let bounds = Bounds::around(relief.bounds_anchor().corners().map(|p| world_from_anchor.transform_point3(p)))?;
        (bounds.min.is_finite() && bounds.max.is_finite()).then_some(bounds)
    };
    let of_bodies = bodies.and_then(|bodies| bodies::bounds_world(bodies, held, surfaces.poses_now()));
    let of_reliefs = held.instances.iter().filter_map(of_instance);
    surfaces.bounds_world().into_iter().chain(of_bodies).chain(of_reliefs).reduce(Bounds::union)
}

/// Whether any object is shown by a relief.
fn show_reliefs(impostors: &Impostors, held: &Held) -> bool {
    held.instances.keys().any(|(_, id)| impostors.relief(id.0).is_some())
}

/// See [`revision`].
pub(crate) type Revision = (u64, u64, u64);

/// Three numbers that are equal only where the same is drawn: where reliefs show something, every update counts as a change.
pub(crate) fn revision(Shown { surfaces, held, impostors, bodies, .. }: Shown<'_>) -> Revision {
    let has_reliefs = impostors.is_some_and(|impostors| show_reliefs(impostors, held));
    (surfaces.revision(), if has_reliefs { held.number } else { 0 }, bodies.map_or(0, Bodies::revision))
}
