//! One frame of the client, from what it holds to the picture.

mod buffers;

use bytemuck::{Pod, Zeroable};
use camera::Pinhole;
use glam::{DVec2, DVec3};
use gpu::Gpu;
use protocol::{Held, Update};
use surface::{BuiltSurfaces, GBuffer, HeldSurfaces, Slices, Smoothing, SurfaceError, Tint};
use wgpu::{BindingResource, TextureFormat, TextureView};

use crate::draw::antialiasing::{Antialias, FrameTimes};
use crate::draw::coverage::{self, Coverage};
use crate::draw::effects::Strengths;
use crate::draw::feel::Feel;
use crate::draw::fill::{FillPass, Pyramid};
use crate::draw::fullscreen::{EMBEDDED, FullscreenPass, Target, uniform};
use crate::draw::held_pass::HeldPass;
use crate::draw::impostors::Impostors;
use crate::draw::layers::{Over, Seen};
use crate::draw::light::{LightPass, Lighten};
use crate::draw::lit::Lit;
use crate::draw::occlusion::{self, OcclusionRenderer};
use crate::draw::parts::PartsPass;
use crate::draw::pick::Pick;
#[cfg(not(target_arch = "wasm32"))]
use crate::draw::reflect::StepSum;
use crate::draw::reflect::{ReflectInputs, ReflectPass, Reflectors, Settings};
use crate::draw::rest::RowsOf;
use crate::draw::shadow::{self, ShadowRenderer};
use crate::draw::shares::Shares;
use crate::draw::shown::Shown;
use crate::draw::through::{Through, present_bindings};
use crate::receive::follow::Follow;

/// How a frame is drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// Fill holes of a few pixels from around them, the farther surface first.
    pub fill: bool,
    /// Draw four samples a pixel, averaged in linear light once they are lit; at rest, all that a pixel shows.
    pub antialias: Antialias,
    /// Show every pixel without a surface as [`MARK`].
    pub mark_uncovered: bool,
    /// Write 1 to the output's alpha where there is a surface and 0 elsewhere, for who reads the picture back; otherwise
    /// alpha is 1 everywhere.
    pub coverage_in_alpha: bool,
    /// What colours are between samples.
    pub smoothing: Smoothing,
    /// What colours tell: what samples saw, or what they are.
    pub tint: Tint,
    /// How mirrors and glass are drawn, where there are impostors.
    pub reflect: Settings,
    /// What all light is multiplied by before it is shown.
    pub exposure: f32,
    /// How much of what hides light counts, where occlusion or shadows are drawn.
    pub strengths: Strengths,
}

/// Magenta, sRGB-encoded: no scene's own colour.
pub const MARK: [u8; 3] = [255, 0, 255];

impl Default for Options {
    fn default() -> Options {
        Options {
            fill: true,
            antialias: Antialias::Off,
            mark_uncovered: false,
            coverage_in_alpha: false,
            smoothing: Smoothing::default(),
            tint: Tint::default(),
            reflect: Settings::default(),
            exposure: 1.0,
            strengths: Strengths::default(),
        }
    }
}

/// `Present` of `client/present_uniform.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
struct PresentUniform {
    background: [f32; 3],
    fill: u32,
    mark: [f32; 3],
    mark_uncovered: u32,
    target_encodes: u32,
    coverage_in_alpha: u32,
    samples: u32,
    padding: u32,
}

/// Samples of a pixel along each side, where pictures are antialiased and pixels do not come in parts.
const SAMPLES: u32 = 2;
/// Larger pictures get one sample a pixel: a sample takes 31 bytes of targets, so this many are half a gigabyte. 2560 x 1440 fits.
const MOST_SAMPLES: u64 = 1 << 24;

/// Draws frames: surfaces and reliefs, occlusion, shadows, light, reflections, fill, present. The targets follow the camera's size.
#[derive(Debug)]
pub struct FrameRenderer {
    gpu: Gpu,
    held: HeldPass,
    occlusion_settings: occlusion::Settings,
    /// `None` while ambient light arrives everywhere, or there is none.
    occlusion: Option<OcclusionRenderer>,
    /// `None` while every light arrives everywhere.
    shadows: Option<ShadowRenderer>,
    light: LightPass,
    /// Made when something is first reflected.
    reflect: Option<ReflectPass>,
    fill: FillPass,
    present: FullscreenPass,
    /// Made when a layer first shows something.
    through: Option<Through>,
    /// Made when a view at rest first comes in parts.
    parts: Option<PartsPass>,
    coverage: Coverage,
    targets: Option<Targets>,
    /// Of a pixel along each side, in the last frame.
    samples: u32,
    times: FrameTimes,
    output_format: TextureFormat,
}

#[derive(Debug)]
struct Targets {
    gbuffer: GBuffer,
    lit: Lit,
    pyramid: Pyramid,
    tiles: Target,
}

impl FrameRenderer {
    /// For targets of `output_format`, which may be one that encodes sRGB itself or one that does not.
    pub fn new(gpu: &Gpu, output_format: TextureFormat) -> Result<FrameRenderer, SurfaceError> {
        Ok(FrameRenderer {
            gpu: gpu.clone(),
            held: HeldPass::new(gpu)?,
            occlusion_settings: occlusion::Settings::default(),
            occlusion: None,
            shadows: None,
            light: LightPass::new(gpu),
            reflect: None,
            fill: FillPass::new(gpu)?,
            present: FullscreenPass::new(gpu, "client/present.wgsl", "show", &present_bindings(), &[output_format])?,
            through: None,
            parts: None,
            coverage: Coverage::new(gpu)?,
            targets: None,
            samples: 1,
            times: FrameTimes::default(),
            output_format,
        })
    }

    /// How ambient occlusion is measured from now on; not at all before this is first called. What it needs is made when it is first drawn, and dropped
    /// when it is switched off or changes nothing.
    pub fn set_occlusion(&mut self, settings: occlusion::Settings) {
        self.occlusion_settings = settings;
        self.occlusion = None;
    }

    /// How shadows are drawn from now on; none are before this is first called. What they need is made when a light first casts, and dropped
    /// when they are switched off.
    pub fn set_shadows(&mut self, settings: shadow::Settings) {
        self.shadows = ShadowRenderer::new(&self.gpu, settings);
    }

    /// The share of each casting light that arrived at each pixel of the last frame ([`TextureFormat::Rgba8Unorm`]), a channel a light, the strongest
    /// first. `None` where none casts.
    pub fn light_shares(&self) -> Option<&wgpu::Texture> {
        self.shadows.as_ref()?.shares().map(|shares| &shares.target.texture)
    }

    /// How far soft shadows got in the last frame, where pictures get theirs by and by; `None` where no light casts any.
    pub fn soft_progress(&self) -> Option<shadow::SoftProgress> {
        self.shadows.as_ref()?.soft_progress()
    }

    /// The share of ambient light that arrived at each pixel of the last frame ([`TextureFormat::R32Float`]): 1 in the open and
    /// where there is no surface. `None` where none was measured.
    pub fn ambient_shares(&self) -> Option<&wgpu::Texture> {
        self.occlusion.as_ref()?.measured().map(|target| &target.texture)
    }

    /// Encodes a frame as seen by `camera` into `output`, which has the camera's size. Call [`FrameRenderer::submitted`] once
    /// the encoder's commands are submitted.
    pub fn draw<'a>(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        shown: impl Into<Shown<'a>>,
        camera: &Pinhole,
        output: &TextureView,
        options: Options,
    ) {
        let shown = shown.into();
        self.draw_surfaces(encoder, shown, camera, options);
        self.draw_light(encoder, shown, camera, output, options);
    }

    /// The first half of [`FrameRenderer::draw`]: surfaces and reliefs, without light.
    pub fn draw_surfaces<'a>(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        shown: impl Into<Shown<'a>>,
        camera: &Pinhole,
        options: Options,
    ) {
        let shown = shown.into();
        let at_rest = shown.rows_of(camera);
        self.samples = self.samples_for(camera, &at_rest, options.antialias);
        let drawn = drawn_camera(camera, self.samples);
        let targets = self.targets_of(&drawn);
        if !at_rest.are_all() {
            self.held.encode(encoder, shown, &drawn, options.smoothing, &targets.gbuffer);
        }
        if drawn == *camera {
            at_rest.encode(encoder, &targets.gbuffer, 0);
        }
        self.targets = Some(targets);
    }

    /// The next slice of the first half, of so many quads at most, of a view with one sample a pixel that nobody stands still at. Until all are drawn nothing else may be.
    pub(crate) fn draw_slice(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        shown: Shown<'_>,
        camera: &Pinhole,
        options: Options,
        (slices, most_quads): (&mut Slices, usize),
    ) {
        self.samples = 1;
        let targets = self.targets_of(camera);
        self.held.encode_slice(encoder, (shown, slices, most_quads), camera, options.smoothing, &targets.gbuffer);
        self.targets = Some(targets);
    }

    /// Asks what a camera sees at a place of its picture; not while slices are drawn.
    pub(crate) fn pick(&mut self, pick: &mut Pick, shown: Shown<'_>, camera: &Pinhole, at_px: DVec2) {
        pick.ask(&self.gpu, &mut self.held, shown, camera, at_px);
    }

    /// Asks what a body meets on its way, see [`Feel::ask`]; not while slices are drawn.
    pub(crate) fn feel(&mut self, feel: &mut Feel, shown: Shown<'_>, way: (DVec3, DVec3), body: (f64, f64)) {
        feel.ask(&self.gpu, &mut self.held, shown, way, body);
    }

    /// Those of the last picture, where they are of this size.
    fn targets_of(&mut self, drawn: &Pinhole) -> Targets {
        let size_px = (drawn.width_px, drawn.height_px);
        let targets = self.targets.take().filter(|targets| targets.size_px() == size_px);
        targets.unwrap_or_else(|| Targets::new(&self.gpu, size_px))
    }

    /// Samples of a pixel along each side in the last picture.
    pub(crate) fn samples(&self) -> u32 {
        self.samples
    }

    /// The inverse depths of the last picture, of as many samples a pixel as it was drawn with.
    pub(crate) fn lit_w(&self) -> Option<&TextureView> {
        self.targets.as_ref().map(|targets| &targets.lit.w.view)
    }

    /// The second half of [`FrameRenderer::draw`]: occlusion, light, reflections, fill and output of the surfaces drawn last.
    pub fn draw_light<'a>(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        shown: impl Into<Shown<'a>>,
        camera: &Pinhole,
        output: &TextureView,
        options: Options,
    ) {
        let shown = shown.into();
        let held = shown.held;
        let targets = self.targets.take().expect("surfaces are drawn first");
        let at_rest = shown.rows_of(camera);
        let drawn = drawn_camera(camera, self.samples);
        self.occlusion = match self.occlusion.take() {
            _ if !occlusion::changes(held) => None,
            None => OcclusionRenderer::new(&self.gpu, self.occlusion_settings).expect(EMBEDDED),
            made => made,
        };
        if let Some(occlusion) = &mut self.occlusion {
            occlusion.encode(encoder, shown, &drawn, &targets.gbuffer);
        }
        if let Some(shadows) = &mut self.shadows {
            shadows.encode(encoder, shown, &drawn, &targets.gbuffer).expect(EMBEDDED);
        }
        let (parts, is_at_rest) = (at_rest.parts(), at_rest.are_all());
        // Of a view at rest, too, what is seen through has several samples a pixel.
        let of_layers = drawn_camera(camera, if parts > 0 { self.most_samples(camera) } else { self.samples });
        let seen = Seen { held, camera: &of_layers, smoothing: options.smoothing, exposure: options.exposure };
        let is_through = self.draw_layers(encoder, shown, &seen);
        let shares = Shares {
            ambient: self.occlusion.as_ref().and_then(OcclusionRenderer::measured),
            lights: self.shadows.as_ref().and_then(ShadowRenderer::shares),
            strengths: options.strengths,
        };
        let reflected = Reflected::of(shown);
        // What is beside the largest part of a pixel gets that part's shares of light; the largest comes last, and stays.
        for part in (0..parts.max(1)).rev() {
            if parts > 1 {
                at_rest.encode(encoder, &targets.gbuffer, part);
            }
            let surfaces = (&targets.gbuffer, shares);
            let rays_of_mirrors = reflected.as_ref().is_some_and(|reflected| reflected.reflectors.rough);
            let how = Lighten { camera: &drawn, at_rest: is_at_rest, exposure: options.exposure, rays_of_mirrors };
            self.light.encode(encoder, surfaces, held, how, &targets.lit);
            let reflecting = (&self.gpu, &mut self.reflect);
            reflect(reflecting, encoder, shown, reflected.as_ref(), &drawn, &targets, options);
            if parts > 0 {
                let through = self.through.as_ref().filter(|_| is_through);
                let over = through.and_then(|through| through.over(encoder, &of_layers, Some(&targets.gbuffer)));
                let made = || PartsPass::new(&self.gpu, self.output_format).expect(EMBEDDED);
                let pass = self.parts.get_or_insert_with(made);
                if is_through {
                    pass.prepare_through().expect(EMBEDDED);
                }
                pass.add(encoder, (&targets.lit, &targets.gbuffer, over), part + 1 == parts);
            }
        }
        // Where nothing is in a view at rest, there is nothing.
        let options = Options { fill: options.fill && !is_at_rest, ..options };
        let present = self.present_uniform(held, options, self.samples);
        let through = self.through.as_ref().filter(|_| is_through);
        match &self.parts {
            Some(pass) if parts > 0 => {
                let over = through.and_then(|through| through.over(encoder, &of_layers, None));
                pass.show(encoder, (&present, over), output);
            }
            _ => {
                let over = through.and_then(|through| through.over(encoder, &of_layers, Some(&targets.gbuffer)));
                self.show(encoder, &targets, (&present, over), output, options.fill);
            }
        }
        self.coverage.encode(&self.gpu, encoder, &targets.lit, &targets.tiles);
        self.targets = Some(targets);
    }

    /// Tells that the commands of the last [`FrameRenderer::draw`] were submitted; `is_timed`: whether they say what a frame takes while the view changes.
    pub fn submitted(&mut self, is_timed: bool) {
        self.coverage.submitted();
        if is_timed && self.times.are_open() {
            self.times.submitted(&self.gpu, self.samples > 1);
        }
    }

    /// Share of pixels without a surface, of the newest frame that was counted; `None` before the first. A client alone
    /// cannot tell the sky from a hole.
    pub fn uncovered_share(&mut self) -> Option<f64> {
        self.coverage.share()
    }

    /// Whether an object was ever drawn by a relief, and so a pipeline for it exists.
    pub fn draws_reliefs(&self) -> bool {
        self.held.draws_reliefs()
    }

    /// Whether anything was ever reflected, and so pipelines for it exist.
    pub fn reflects(&self) -> bool {
        self.reflect.is_some()
    }

    /// Whether anything was ever seen through, and so pipelines for it exist.
    pub fn sees_through(&self) -> bool {
        self.through.is_some()
    }

    /// Whether shadows are switched on and a light ever cast since, and so pipelines for them exist.
    pub fn casts(&self) -> bool {
        self.shadows.as_ref().is_some_and(ShadowRenderer::is_made)
    }

    /// What the rays of the last picture cost, where [`Settings::count_steps`] was set. Waits for the GPU; natively only.
    #[cfg(not(target_arch = "wasm32"))]
    pub fn steps(&self) -> Result<Option<StepSum>, gpu::ReadbackError> {
        self.reflect.as_ref().map_or(Ok(None), ReflectPass::steps)
    }

    /// What the surfaces looked like in the last frame, before light.
    pub fn gbuffer(&self) -> Option<&GBuffer> {
        self.targets.as_ref().map(|targets| &targets.gbuffer)
    }

    /// Samples of a pixel along each side: one where its parts are there already, the picture is too large, or frames are to come in time and did not.
    fn samples_for(&self, camera: &Pinhole, at_rest: &RowsOf<'_>, antialias: Antialias) -> u32 {
        let comes_in_time = antialias == Antialias::On || self.times.allow_several();
        if antialias.is_wanted() && comes_in_time && !at_rest.are_all() { self.most_samples(camera) } else { 1 }
    }

    /// Samples of a pixel along each side for which a picture is not too large.
    fn most_samples(&self, camera: &Pinhole) -> u32 {
        let (width_px, height_px) = (SAMPLES * camera.width_px, SAMPLES * camera.height_px);
        let fits = width_px.max(height_px) <= self.gpu.device.limits().max_texture_dimension_2d
            && u64::from(width_px) * u64::from(height_px) <= MOST_SAMPLES;
        if fits { SAMPLES } else { 1 }
    }

    fn present_uniform(&self, held: &Held, options: Options, samples: u32) -> wgpu::Buffer {
        let unit = |bytes: [u8; 3]| bytes.map(|value| f32::from(value) / 255.0);
        let present = PresentUniform {
            background: held.lighting.as_ref().map_or([0.0; 3], |lighting| unit(lighting.background)),
            fill: u32::from(options.fill),
            mark: unit(MARK),
            mark_uncovered: u32::from(options.mark_uncovered),
            target_encodes: u32::from(self.output_format.is_srgb()),
            coverage_in_alpha: u32::from(options.coverage_in_alpha),
            samples,
            padding: 0,
        };
        uniform(&self.gpu, "present", bytemuck::bytes_of(&present))
    }

    /// Draws what is seen through, if anything is.
    fn draw_layers(&mut self, encoder: &mut wgpu::CommandEncoder, shown: Shown<'_>, seen: &Seen<'_>) -> bool {
        let Some(layers) = shown.layers.filter(|_| shown.is_seen_through()) else { return false };
        let made = || Through::new(&self.gpu, self.output_format).expect(EMBEDDED);
        let through = self.through.get_or_insert_with(made);
        through.layers.draw(encoder, layers, &mut self.light, seen);
        true
    }

    fn show(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        targets: &Targets,
        (present, over): (&wgpu::Buffer, Option<&Over>),
        output: &TextureView,
        fill: bool,
    ) {
        if fill {
            self.fill.encode(encoder, &targets.lit, &targets.gbuffer, &targets.pyramid);
        }
        let mut inputs = vec![present.as_entire_binding(), BindingResource::TextureView(&targets.lit.colour.view)];
        inputs.extend(targets.pyramid.views());
        match self.through.as_ref().zip(over) {
            Some((through, over)) => {
                inputs.extend(over.inputs());
                through.present.encode(encoder, &inputs, &[output]);
            }
            None => self.present.encode(encoder, &inputs, &[output]),
        }
    }
}

/// What is reflected, and by what.
struct Reflected<'a> {
    impostors: &'a Impostors,
    reflectors: Reflectors,
}

impl<'a> Reflected<'a> {
    /// `None` where there are no impostors or no material reflects.
    fn of(Shown { held, impostors, .. }: Shown<'a>) -> Option<Reflected<'a>> {
        let impostors = impostors.filter(|impostors| impostors.reflected().next().is_some())?;
        let under_sky = held.sky.is_some() && held.lighting.as_ref().is_some_and(|lighting| lighting.sky > 0.0);
        Some(Reflected { impostors, reflectors: Reflectors::among(&held.materials, under_sky)? })
    }
}

/// Draws nothing, and makes nothing, where nothing is reflected.
fn reflect(
    (gpu, pass): (&Gpu, &mut Option<ReflectPass>),
    encoder: &mut wgpu::CommandEncoder,
    Shown { surfaces, held, .. }: Shown<'_>,
    reflected: Option<&Reflected<'_>>,
    camera: &Pinhole,
    Targets { gbuffer, lit, .. }: &Targets,
    Options { reflect: settings, exposure, .. }: Options,
) {
    let Some(&Reflected { impostors, reflectors }) = reflected else {
        if let Some(pass) = pass {
            pass.rest();
        }
        return;
    };
    let pass = pass.get_or_insert_with(|| ReflectPass::new(gpu).expect(EMBEDDED));
    let poses_now = surfaces.poses_now();
    let inputs = ReflectInputs { gbuffer, held, poses_now, camera, exposure, impostors, settings };
    pass.encode(encoder, &inputs, reflectors, lit).expect(EMBEDDED);
}

/// The camera that is drawn for a picture of several samples a pixel.
fn drawn_camera(camera: &Pinhole, samples: u32) -> Pinhole {
    Pinhole {
        width_px: samples * camera.width_px,
        height_px: samples * camera.height_px,
        focal_px: f64::from(samples) * camera.focal_px,
        centre_px: f64::from(samples) * camera.centre_px,
        ..*camera
    }
}

impl Targets {
    fn new(gpu: &Gpu, size_px: (u32, u32)) -> Targets {
        Targets {
            gbuffer: GBuffer::new(gpu, size_px),
            lit: Lit::new(gpu, size_px),
            pyramid: Pyramid::new(gpu, size_px),
            tiles: coverage::tiles(gpu, size_px),
        }
    }

    fn size_px(&self) -> (u32, u32) {
        self.gbuffer.size_px
    }
}

impl Follow for HeldSurfaces {
    fn follow(&mut self, held: &Held, update: &Update, anew: bool, built: &mut BuiltSurfaces) {
        if anew {
            self.clear();
        }
        self.apply_built(held, update, built);
    }
}
