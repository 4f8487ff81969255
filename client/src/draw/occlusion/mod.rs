//! Ambient occlusion: how much of the sky each point sees past what stands around it, from z-buffers of what is held.
//!
//! Method: Rosen, Popescu, Hayward, Wyman, *Non-pinhole approximations for interactive rendering*, section 6.3. Occlusion from
//! the z-buffer of the view alone comes and goes as occluders are hidden behind nearer surfaces. A graph camera of three frusta,
//! one eye up to a plane in the middle of what is seen and two further left and right behind it, sees round nearer surfaces;
//! its z-buffer is drawn from what the client holds: what its eye saw, and beside it what a server sends that no eye saw
//! ([`protocol::Purpose::Occluders`]). The latter has a z-buffer of its own, so that nothing which the eye saw hides it. It is drawn for nothing
//! else.
//!
//! | paper | here |
//! |---|---|
//! | one graph camera that goes with the view | four that stand around all that is held, or, with the eye inside of it, around the eye in coarse steps ([`protocol::Ball`]), whatever the view: what a moving camera sees, split or not, changes with it |
//! | its z-buffer takes the place of the view's | the view's own stands in for points that no graph camera shows, as long as a server sends no occluders; with them, for points that no graph camera looks at |
//! | lines of the image through a pixel, each for a plane in space | places around the point in space, the same in every view, looked up where the z-buffer has them; what is found belongs to a slice around the normal |
//! | depths, unprojected at every look | points, unprojected once (`surface::PointBuffer`) |
//! | a split point on a curve designed by hand | the middle of what they stand around |
//! | 6 directions with 6 steps each, or 32 with 20 | as many looks by 36 or 640 taps; always 16 slices, and a blur 5 pixels wide, not 21 |
//!
//! In a slice, what is found at the elevation `e` above the tangent plane hides `sin² e` of the cosine-weighted sky, less with
//! the square of its distance, nothing at [`Settings::reach_m`]; the greatest counts. Slices close to a wall get few looks, so
//! contacts come out too light.

mod camera;
mod pass;

use ::camera::{Bounds, Pinhole};
use glam::DVec3;
use gpu::{Gpu, MaterialUniform, PinholeUniform};
use protocol::message::Welcome;
use protocol::{Held, Lighting, Purpose};
use surface::{CornerRules, Corners, GBuffer, HeldSurfaces, PointBuffer, PointPass, SurfaceError};
use wgpu::{BindingResource, TextureFormat};

use self::camera::Lookers;
use crate::draw::fullscreen::{Binding, FullscreenPass, Target, uniform};
use crate::draw::held_pass;
use crate::draw::shown::Shown;
use pass::OcclusionUniform;

/// Where occluders are looked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Occlusion {
    /// Nowhere: ambient light arrives everywhere.
    #[default]
    None,
    /// In the view's own z-buffer.
    Plain,
    /// Also in those of graph cameras, and of what a server sends of occluders.
    Graph,
}

/// How occlusion is measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// Where.
    pub occlusion: Occlusion,
    /// What is further away hides nothing, metres.
    pub reach_m: f64,
    /// Looks into z-buffers a pixel, 1 to 640: all into the view's own, half of them into that of each graph camera where several
    /// stand around.
    pub taps: u32,
}

impl Settings {
    /// Where occlusion has to come in time: six each way, as the paper's small setting.
    pub const IN_TIME_TAPS: u32 = 36;
}

impl Default for Settings {
    fn default() -> Settings {
        Settings { occlusion: Occlusion::None, reach_m: 0.5, taps: 128 }
    }
}

/// How far occluders count by default in what a server shows: half a metre for who walks in it, a twentieth of the size of what is turned.
pub fn reach_m(welcome: &Welcome) -> f64 {
    if welcome.walk {
        return Settings::default().reach_m;
    }
    let [min, max] = [welcome.bounds_min_world, welcome.bounds_max_world].map(DVec3::from);
    min.distance(max) * OBJECT_REACH
}

/// Measures occlusion of the surfaces in a G-buffer. What a z-buffer needs is made when it is first asked for.
#[derive(Debug)]
pub(crate) struct OcclusionRenderer {
    gpu: Gpu,
    settings: Settings,
    points: FullscreenPass,
    occlude: FullscreenPass,
    smooth: FullscreenPass,
    graph: Option<PointPass>,
    targets: Option<Targets>,
    graph_points: Option<GraphPoints>,
}

/// What graph cameras see.
#[derive(Debug)]
struct GraphPoints {
    lookers: Lookers,
    /// Of what the eye saw.
    seen: PointBuffer,
    /// Of what only occludes, where there is any.
    occluders: Option<PointBuffer>,
    /// Of the surfaces of both.
    revisions: (u64, Option<u64>),
}

/// Of the view's size.
#[derive(Debug)]
struct Targets {
    size_px: (u32, u32),
    points: Target,
    /// As measured.
    rough: Target,
    /// Smoothed along surfaces.
    occlusion: Target,
}

/// Whether occlusion changes anything: light comes from all around, and something is lit.
pub(crate) fn changes(held: &Held) -> bool {
    held.lighting.as_ref().is_some_and(Lighting::is_around) && held.materials.iter().any(|material| !material.unlit)
}

/// Of the size of an object that is turned.
const OBJECT_REACH: f64 = 0.05;

/// Holds what only occludes; nothing yet.
pub fn occluders(gpu: &Gpu, corners: Corners) -> HeldSurfaces {
    HeldSurfaces::with_corners(gpu, corners, CornerRules::default()).of(Purpose::Occluders)
}

impl OcclusionRenderer {
    /// Of the share of ambient light that arrives.
    pub(crate) const FORMAT: TextureFormat = TextureFormat::R32Float;

    /// `None` where nothing is to be measured.
    pub(crate) fn new(gpu: &Gpu, settings: Settings) -> Result<Option<OcclusionRenderer>, SurfaceError> {
        use Binding::{FloatTexture, UintTexture, Uniform};
        if settings.occlusion == Occlusion::None {
            return Ok(None);
        }
        let from = [Uniform, FloatTexture];
        let points = FullscreenPass::new(gpu, "client/occlusion_points.wgsl", "points", &from, &[PointBuffer::POINTS])?;
        let from = [Uniform, Uniform, UintTexture, FloatTexture, FloatTexture, FloatTexture];
        let formats = [OcclusionRenderer::FORMAT];
        let occlude = FullscreenPass::new(gpu, "client/occlusion.wgsl", "occlude", &from, &formats)?;
        let from = [FloatTexture, UintTexture, FloatTexture];
        let smooth = FullscreenPass::new(gpu, "client/occlusion_smooth.wgsl", "smooth_shares", &from, &formats)?;
        let graph = (settings.occlusion == Occlusion::Graph).then(|| PointPass::new(gpu)).transpose()?;
        let (targets, graph_points) = (None, None);
        let gpu = gpu.clone();
        Ok(Some(OcclusionRenderer { gpu, settings, points, occlude, smooth, graph, targets, graph_points }))
    }

    /// Measures what the G-buffer shows, as seen by `view`.
    pub(crate) fn encode(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        shown: Shown<'_>,
        view: &Pinhole,
        gbuffer: &GBuffer,
    ) {
        self.draw_graph(encoder, shown, view);
        let size_px = gbuffer.size_px;
        let targets = self.targets.take().filter(|targets| targets.size_px == size_px);
        let targets = targets.unwrap_or_else(|| Targets::new(&self.gpu, size_px));
        let pinhole = PinholeUniform::new(view, view.world_from_eye.translation);
        let pinhole = uniform(&self.gpu, "camera", bytemuck::bytes_of(&pinhole));
        let from = [pinhole.as_entire_binding(), BindingResource::TextureView(&gbuffer.views.w)];
        self.points.encode(encoder, &from, &[&targets.points.view]);
        let Settings { reach_m, taps, .. } = self.settings;
        let graph = self.graph_points.as_ref();
        let lookers = graph.map(|graph| (&graph.lookers, graph.occluders.is_some()));
        let occlusion = OcclusionUniform::new(view, lookers, reach_m, taps);
        let occlusion = uniform(&self.gpu, "occlusion", bytemuck::bytes_of(&occlusion));
        let materials = MaterialUniform::table(&shown.held.materials);
        let materials = uniform(&self.gpu, "materials", bytemuck::cast_slice(&materials));
        let graph_points = graph.map_or(&targets.points.view, |graph| &graph.seen.view);
        let occluders = graph.and_then(|graph| graph.occluders.as_ref());
        let occluder_points = occluders.map_or(&targets.points.view, |occluders| &occluders.view);
        let from = [
            occlusion.as_entire_binding(),
            materials.as_entire_binding(),
            BindingResource::TextureView(&gbuffer.views.normal_ids),
            BindingResource::TextureView(&targets.points.view),
            BindingResource::TextureView(graph_points),
            BindingResource::TextureView(occluder_points),
        ];
        self.occlude.encode(encoder, &from, &[&targets.rough.view]);
        let from = [
            BindingResource::TextureView(&targets.points.view),
            BindingResource::TextureView(&gbuffer.views.normal_ids),
            BindingResource::TextureView(&targets.rough.view),
        ];
        self.smooth.encode(encoder, &from, &[&targets.occlusion.view]);
        self.targets = Some(targets);
    }

    /// The z-buffers of graph cameras, where they are asked for and there is something to see: drawn anew where the cameras stand elsewhere
    /// than in the last frame, or surfaces changed.
    fn draw_graph(&mut self, encoder: &mut wgpu::CommandEncoder, shown: Shown<'_>, view: &Pinhole) {
        let last = self.graph_points.take();
        let occluders = shown.occluders.filter(|occluders| occluders.bounds_world().is_some());
        let all = held_pass::bounds_world(shown).into_iter().chain(occluders.and_then(HeldSurfaces::bounds_world));
        let Some((pass, bounds)) = self.graph.as_ref().zip(all.reduce(Bounds::union)) else { return };
        let Some(lookers) = Lookers::new(view, bounds, self.settings.reach_m) else { return };
        let revisions = (shown.surfaces.revision(), occluders.map(HeldSurfaces::revision));
        if last.as_ref().is_some_and(|last| last.lookers.ball == lookers.ball && last.revisions == revisions) {
            self.graph_points = last;
            return;
        }
        let (seen, behind) = last.map_or((None, None), |last| (Some(last.seen), last.occluders));
        let mut drawn = |surfaces: &HeldSurfaces, buffer: Option<PointBuffer>| {
            let buffer = buffer.filter(|buffer| buffer.size_px == lookers.size_px);
            let buffer = buffer.unwrap_or_else(|| PointBuffer::new(&self.gpu, lookers.size_px));
            pass.encode(encoder, surfaces, &lookers.cameras, lookers.anchor_world(), &buffer);
            buffer
        };
        let seen = drawn(shown.surfaces, seen);
        let occluders = occluders.map(|occluders| drawn(occluders, behind));
        self.graph_points = Some(GraphPoints { lookers, seen, occluders, revisions });
    }

    /// Points and shares by what they hold.
    pub(crate) fn buffers(&self) -> impl Iterator<Item = (&'static str, &wgpu::Texture)> {
        let of_view = self.targets.iter().flat_map(|targets| {
            let Targets { points, rough, occlusion, .. } = targets;
            [("view points", points), ("rough occlusion", rough), ("occlusion", occlusion)]
        });
        let of_graph = self.graph_points.iter().flat_map(|graph| [Some(&graph.seen), graph.occluders.as_ref()]);
        let of_graph = of_graph.flatten().map(|buffer| ("graph points", &buffer.points));
        of_view.map(|(name, target)| (name, &target.texture)).chain(of_graph)
    }

    /// The share of ambient light that arrives at each pixel of the last frame: 1 in the open and where there is no surface.
    pub(crate) fn measured(&self) -> Option<&Target> {
        self.targets.as_ref().map(|targets| &targets.occlusion)
    }
}

impl Targets {
    fn new(gpu: &Gpu, size_px: (u32, u32)) -> Targets {
        Targets {
            size_px,
            points: Target::new(gpu, "view points", size_px, PointBuffer::POINTS),
            rough: Target::new(gpu, "rough occlusion", size_px, OcclusionRenderer::FORMAT),
            occlusion: Target::new(gpu, "occlusion", size_px, OcclusionRenderer::FORMAT),
        }
    }
}
