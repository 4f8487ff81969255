//! Ambient occlusion: how much of the sky each point sees past what stands around it, from z-buffers of what is held.
//!
//! Method: Rosen, Popescu, Hayward, Wyman, *Non-pinhole approximations for interactive rendering*, section 6.3. Occlusion from
//! the z-buffer of the view alone comes and goes as occluders are hidden behind nearer surfaces. A graph camera of three frusta,
//! one eye up to a plane in the middle of what is seen and two further left and right behind it, sees round nearer surfaces;
//! its z-buffer is drawn from the same surfaces that the client holds.
//!
//! | paper | here |
//! |---|---|
//! | one graph camera that goes with the view | so where the eye is inside of what is held; around an object stand four, whatever the view: what a moving camera sees, split or not, changes with it |
//! | its z-buffer takes the place of the view's | the view's own stands in for points that no graph camera shows |
//! | lines of the image through a pixel, each for a plane in space | places around the point in space, the same in every view, looked up where the z-buffer has them; what is found belongs to a slice around the normal |
//! | depths, unprojected at every look | points, unprojected once (`surface::PointBuffer`) |
//! | a split point on a curve designed by hand | the middle of what is held |
//!
//! In a slice, what is found at the elevation `e` above the tangent plane hides `sin² e` of the cosine-weighted sky, less with
//! the square of its distance, nothing at [`Settings::reach_m`]; the greatest counts. Slices close to a wall get few looks, so
//! contacts come out too light.

mod camera;
mod pass;

use ::camera::Pinhole;
use gpu::{Gpu, MaterialUniform, PinholeUniform};
use protocol::Held;
use surface::{GBuffer, HeldSurfaces, PointBuffer, PointPass, SurfaceError};
use wgpu::{BindingResource, TextureFormat};

use self::camera::Lookers;
use crate::draw::fullscreen::{Binding, FullscreenPass, Target, uniform};
use pass::OcclusionUniform;

/// Where occluders are looked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Occlusion {
    /// Nowhere: ambient light arrives everywhere.
    #[default]
    None,
    /// In the view's own z-buffer.
    Plain,
    /// Also in that of a graph camera.
    Graph,
}

/// How occlusion is measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// Where.
    pub occlusion: Occlusion,
    /// What is further away hides nothing, metres.
    pub reach_m: f64,
    /// Looks into z-buffers a pixel, 1 to 128: all into the view's own, half of them into that of each graph camera where several
    /// stand around.
    pub taps: u32,
}

impl Default for Settings {
    fn default() -> Settings {
        Settings { occlusion: Occlusion::None, reach_m: 0.5, taps: 128 }
    }
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
    buffer: PointBuffer,
    /// Of the surfaces.
    revision: u64,
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
        let from = [Uniform, Uniform, UintTexture, FloatTexture, FloatTexture];
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
        (surfaces, held): (&HeldSurfaces, &Held),
        view: &Pinhole,
        gbuffer: &GBuffer,
    ) {
        self.draw_graph(encoder, surfaces, view);
        let size_px = gbuffer.size_px;
        let targets = self.targets.take().filter(|targets| targets.size_px == size_px);
        let targets = targets.unwrap_or_else(|| Targets::new(&self.gpu, size_px));
        let pinhole = PinholeUniform::new(view, view.world_from_eye.translation);
        let pinhole = uniform(&self.gpu, "camera", bytemuck::bytes_of(&pinhole));
        let from = [pinhole.as_entire_binding(), BindingResource::TextureView(&gbuffer.views.w)];
        self.points.encode(encoder, &from, &[&targets.points.view]);
        let Settings { reach_m, taps, .. } = self.settings;
        let occlusion =
            OcclusionUniform::new(view, self.graph_points.as_ref().map(|graph| &graph.lookers), reach_m, taps);
        let occlusion = uniform(&self.gpu, "occlusion", bytemuck::bytes_of(&occlusion));
        let materials = MaterialUniform::table(&held.materials);
        let materials = uniform(&self.gpu, "materials", bytemuck::cast_slice(&materials));
        let graph_points = self.graph_points.as_ref().map_or(&targets.points.view, |graph| &graph.buffer.view);
        let from = [
            occlusion.as_entire_binding(),
            materials.as_entire_binding(),
            BindingResource::TextureView(&gbuffer.views.normal_ids),
            BindingResource::TextureView(&targets.points.view),
            BindingResource::TextureView(graph_points),
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

    /// The z-buffers of graph cameras, where they are asked for and there is something to see: drawn anew unless the cameras
    /// stand and the surfaces are those of the last frame.
    fn draw_graph(&mut self, encoder: &mut wgpu::CommandEncoder, surfaces: &HeldSurfaces, view: &Pinhole) {
        let last = self.graph_points.take();
        let Some((pass, bounds)) = self.graph.as_ref().zip(surfaces.bounds_world()) else { return };
        let Ok(lookers) = Lookers::new(view, bounds) else { return };
        let revision = surfaces.revision();
        let is_drawn = |last: &GraphPoints| lookers.standing && last.lookers.standing && last.revision == revision;
        if last.as_ref().is_some_and(is_drawn) {
            self.graph_points = last;
            return;
        }
        let buffer = last.map(|last| last.buffer).filter(|buffer| buffer.size_px == lookers.size_px);
        let buffer = buffer.unwrap_or_else(|| PointBuffer::new(&self.gpu, lookers.size_px));
        pass.encode(encoder, surfaces, &lookers.cameras, lookers.anchor_world, &buffer);
        self.graph_points = Some(GraphPoints { lookers, buffer, revision });
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
