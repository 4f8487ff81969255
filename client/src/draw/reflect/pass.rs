//! The passes of a picture with reflectors: rays; and in rounds, walks in all impostors and what the rays do there; the composite.

use camera::Pinhole;
use gpu::{Gpu, MaterialUniform, PinholeUniform, SkyTexture};
use protocol::Held;
use shaders::ShaderError;
use wgpu::{BindingResource, CommandEncoder, TextureFormat, TextureView};

use super::inputs::ReflectInputs;
use super::uniforms::RoundUniform;
use super::walks::{Followed, WORDS, WalkTargets, Walks};
use super::{Bounces, EdgeRays, Reflectors, Settings, fades};
use crate::draw::fullscreen::{Binding, FullscreenPass, Onto, Target, begin, uniform};
use crate::draw::impostors::{ImpostorKind, Placed};
use crate::draw::light::lighting_of;
use crate::draw::lit::Lit;

#[cfg(not(target_arch = "wasm32"))]
use super::StepSum;

/// Colours of the rays of a pixel, and how many there were: sums that WebGL2 draws.
const SUM: TextureFormat = TextureFormat::Rgba16Float;
/// 1 where more rays are sent.
const EDGES: TextureFormat = TextureFormat::R8Unorm;

/// Where the rays of a pixel pass, from its centre: the first one of all pixels, the others where neighbours show something else. No
/// two are in one row or column.
const OFFSETS_PX: [[f32; 2]; 5] = [[0.0, 0.0], [0.2, 0.4], [0.4, -0.2], [-0.2, -0.4], [-0.4, 0.2]];

/// See the module.
#[derive(Debug)]
pub(crate) struct ReflectPass {
    gpu: Gpu,
    rays: FullscreenPass,
    rays_at_edges: FullscreenPass,
    walks: Walks,
    bounce: FullscreenPass,
    gather: FullscreenPass,
    /// Made when something rough is first reflected.
    gather_rough: Option<FullscreenPass>,
    edges: FullscreenPass,
    composite: FullscreenPass,
    sky: SkyTexture,
    targets: Option<Targets>,
}

#[derive(Debug)]
struct Targets {
    /// The rays of a round, and those of the next one: two texels each.
    rays: [[Target; 2]; 2],
    walks: WalkTargets,
    sum: Target,
    edges: Target,
}

impl Targets {
    fn new(gpu: &Gpu, size_px: (u32, u32), settings: Settings) -> Targets {
        let target = |label, format| Target::new(gpu, label, size_px, format);
        let rays = || [target("ray origins", WORDS), target("ray directions", WORDS)];
        Targets {
            rays: [rays(), rays()],
            walks: WalkTargets::new(gpu, size_px, settings),
            sum: target("sum of rays", SUM),
            edges: target("edges in reflectors", EDGES),
        }
    }

    fn rays(&self, round: usize) -> [&TextureView; 2] {
        self.rays[round % 2].each_ref().map(|target| &target.view)
    }
}

/// The uniforms of a picture.
struct Frame {
    camera: wgpu::Buffer,
    lighting: wgpu::Buffer,
    materials: wgpu::Buffer,
    /// With the rough mirrors marked that rays leave.
    leaving_materials: wgpu::Buffer,
    sky: TextureView,
}

impl Frame {
    fn new(
        gpu: &Gpu,
        held: &Held,
        (camera, exposure): (&Pinhole, f32),
        reflectors: Reflectors,
        sky: &mut SkyTexture,
    ) -> Frame {
        let leaving = if reflectors.rough { MaterialUniform::table_with_rays } else { MaterialUniform::table };
        let eye_world = camera.world_from_eye.translation;
        let lighting = lighting_of(held, eye_world, exposure);
        let table = |table: &[MaterialUniform]| uniform(gpu, "materials", bytemuck::cast_slice(table));
        Frame {
            camera: uniform(gpu, "camera", bytemuck::bytes_of(&PinholeUniform::new(camera, eye_world))),
            lighting: uniform(gpu, "lighting", bytemuck::bytes_of(&lighting)),
            materials: table(&MaterialUniform::table(&held.materials)),
            leaving_materials: table(&leaving(&held.materials)),
            sky: sky.of(gpu, held.sky.as_ref()),
        }
    }
}

impl ReflectPass {
    /// Sums of rays, and how far each went, by what they hold.
    pub(crate) fn buffers(&self) -> impl Iterator<Item = (&'static str, &wgpu::Texture)> {
        self.targets
            .iter()
            .flat_map(|targets| [("sum of rays", &targets.sum.texture), ("found by rays at", targets.walks.depth())])
    }

    pub(crate) fn new(gpu: &Gpu) -> Result<ReflectPass, ShaderError> {
        use Binding::{FloatTexture, UintTexture, Uniform};
        let pass =
            |path, fragment, bindings: &[Binding]| FullscreenPass::new(gpu, path, fragment, bindings, &[WORDS, WORDS]);
        let of_rays =
            [Uniform, Uniform, Uniform, FloatTexture, UintTexture, FloatTexture, Uniform, FloatTexture, FloatTexture];
        let of_bounce = [Uniform, Uniform, Uniform, UintTexture, UintTexture, UintTexture, FloatTexture];
        let gather = ("client/reflect/gather.wgsl", "gather");
        let of_sum = |onto, fragment, format| {
            FullscreenPass::onto(onto, gpu, ("client/reflect/composite.wgsl", fragment), &[FloatTexture], &[format])
        };
        Ok(ReflectPass {
            gpu: gpu.clone(),
            rays: pass("client/reflect/rays.wgsl", "rays", &of_rays[..8])?,
            rays_at_edges: pass("client/reflect/rays.wgsl", "rays_at_edges", &of_rays)?,
            walks: Walks::new(gpu)?,
            bounce: pass("client/reflect/bounce.wgsl", "bounce", &of_bounce)?,
            gather: FullscreenPass::onto(Onto::Sum, gpu, gather, &[UintTexture, UintTexture, Uniform], &[SUM])?,
            gather_rough: None,
            edges: of_sum(Onto::Nothing, "edges", EDGES)?,
            composite: of_sum(Onto::Picture, "composite", Lit::COLOUR)?,
            sky: SkyTexture::default(),
            targets: None,
        })
    }

    /// Frees what is as large as the picture, while nothing is reflected.
    pub(crate) fn rest(&mut self) {
        self.targets = None;
    }

    /// What the rays of the last picture cost, where it was counted.
    #[cfg(not(target_arch = "wasm32"))]
    pub(crate) fn steps(&self) -> Result<Option<StepSum>, gpu::ReadbackError> {
        let Some(targets) = &self.targets else { return Ok(None) };
        let mut sum: Option<StepSum> = None;
        for texture in targets.walks.counts() {
            let mut encoder = self.gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            let mut readback = gpu::Readback::default();
            let slot = readback.texture(texture, 0, (texture.width(), texture.height()));
            let encoded = readback.encode(&self.gpu, &mut encoder);
            self.gpu.queue.submit([encoder.finish()]);
            let texels = encoded.map().wait(&self.gpu)?.values::<[u32; 2]>(slot);
            // Of each pixel the steps, and the walks.
            let add = |sum: StepSum, pixel: &[u32; 2]| {
                let [steps, walks] = [pixel[0], pixel[0] >> 16].map(f64_from_half);
                StepSum { steps: sum.steps + steps, walks: sum.walks + walks }
            };
            sum = Some(texels.iter().fold(sum.unwrap_or_default(), add));
        }
        Ok(sum)
    }

    /// Draws the reflectors of a picture over `lit`.
    pub(crate) fn encode(
        &mut self,
        encoder: &mut CommandEncoder,
        inputs: &ReflectInputs<'_>,
        reflectors: Reflectors,
        lit: &Lit,
    ) -> Result<(), ShaderError> {
        let (size_px, settings) = (inputs.gbuffer.size_px, inputs.settings);
        let targets = self.targets.take().filter(|targets| targets.walks.fit(size_px, settings));
        let targets = targets.unwrap_or_else(|| Targets::new(&self.gpu, size_px, settings));
        let drawn = self.encode_rounds(encoder, inputs, reflectors, &targets, lit);
        self.targets = Some(targets);
        drawn
    }

    fn encode_rounds(
        &mut self,
        encoder: &mut CommandEncoder,
        inputs: &ReflectInputs<'_>,
        reflectors: Reflectors,
        targets: &Targets,
        lit: &Lit,
    ) -> Result<(), ShaderError> {
        let frame = Frame::new(&self.gpu, inputs.held, (inputs.camera, inputs.exposure), reflectors, &mut self.sky);
        targets.walks.begin(encoder);
        let sum = BindingResource::TextureView(&targets.sum.view);
        let rays = match inputs.settings.edges {
            EdgeRays::Always => OFFSETS_PX.len(),
            EdgeRays::OnGpu if !self.gpu.caps.software => OFFSETS_PX.len(),
            EdgeRays::OnGpu | EdgeRays::Never => 1,
        };
        for (index, offset_px) in OFFSETS_PX.into_iter().take(rays).enumerate() {
            if index == 1 {
                self.edges.encode(encoder, std::slice::from_ref(&sum), &[&targets.edges.view]);
            }
            self.encode_rays(encoder, inputs, &frame, targets, offset_px, index > 0);
            let last = self.follow(encoder, inputs, reflectors, &frame, targets, index == 0)?;
            if index == 0 && reflectors.rough {
                self.gather_rough(encoder, (inputs, &frame), targets.rays(last), lit, &targets.sum.view)?;
                continue;
            }
            let mut gather = begin(encoder, "gather", index == 0, &[&targets.sum.view], None);
            let [first, second] = targets.rays(last).map(BindingResource::TextureView);
            self.gather.draw(&mut gather, &[first, second, frame.lighting.as_entire_binding()]);
        }
        self.composite.encode(encoder, &[sum], &[&lit.colour.view]);
        Ok(())
    }

    /// Begins the sum with what the first rays of pixels have brought, some of which left what is rough: that goes over `lit`.
    fn gather_rough(
        &mut self,
        encoder: &mut CommandEncoder,
        (inputs, frame): (&ReflectInputs<'_>, &Frame),
        [first, second]: [&TextureView; 2],
        lit: &Lit,
        sum: &TextureView,
    ) -> Result<(), ShaderError> {
        let pass = match self.gather_rough.take() {
            Some(pass) => pass,
            None => rough_pass(&self.gpu)?,
        };
        let views = &inputs.gbuffer.views;
        let rays = [first, second].map(BindingResource::TextureView);
        let buffers = [&frame.lighting, &frame.camera, &frame.materials].map(wgpu::Buffer::as_entire_binding);
        let surfaces = [&views.colour, &views.normal_ids, &lit.colour.view].map(BindingResource::TextureView);
        let resources: Vec<_> = rays.into_iter().chain(buffers).chain(surfaces).collect();
        pass.draw(&mut begin(encoder, "gather", true, &[sum], None), &resources);
        self.gather_rough = Some(pass);
        Ok(())
    }

    /// Follows the rays of round 0 to their ends; gives the round that holds these.
    fn follow(
        &mut self,
        encoder: &mut CommandEncoder,
        inputs: &ReflectInputs<'_>,
        reflectors: Reflectors,
        frame: &Frame,
        targets: &Targets,
        of_all_pixels: bool,
    ) -> Result<usize, ShaderError> {
        let rounds = rounds(reflectors, inputs);
        for round in 0..rounds {
            let is_last = round + 1 == rounds;
            let walks_in = |placed: &&Placed| match placed.kind {
                // What is found inside in the last round changes nothing any more.
                ImpostorKind::Inside(_) => reflectors.glass && !is_last,
                // Without mirrors all rays begin inside.
                ImpostorKind::Object(_) | ImpostorKind::Environment => {
                    reflectors.mirrors || reflectors.rough || round > 0
                }
                ImpostorKind::Relief(_) => false,
            };
            let placed: Vec<&Placed> = inputs.impostors.reflected().filter(walks_in).collect();
            let followed = Followed { inputs, impostors: &placed, rays: targets.rays(round), of_all_pixels };
            self.walks.encode(encoder, &followed, &targets.walks)?;
            let uniform = self.round(inputs.settings, is_last, [0.0; 2]);
            let [first, second] = targets.rays(round).map(BindingResource::TextureView);
            let found = BindingResource::TextureView(&targets.walks.found.view);
            let (lighting, materials) = (frame.lighting.as_entire_binding(), frame.materials.as_entire_binding());
            let sky = BindingResource::TextureView(&frame.sky);
            let resources = [uniform.as_entire_binding(), lighting, materials, first, second, found, sky];
            self.bounce.encode(encoder, &resources, &targets.rays(round + 1));
        }
        Ok(rounds)
    }

    fn encode_rays(
        &self,
        encoder: &mut CommandEncoder,
        inputs: &ReflectInputs<'_>,
        frame: &Frame,
        targets: &Targets,
        offset_px: [f32; 2],
        at_edges: bool,
    ) {
        let round = self.round(inputs.settings, false, offset_px);
        let mut resources = vec![
            frame.camera.as_entire_binding(),
            round.as_entire_binding(),
            frame.leaving_materials.as_entire_binding(),
            BindingResource::TextureView(&inputs.gbuffer.views.colour),
            BindingResource::TextureView(&inputs.gbuffer.views.normal_ids),
            BindingResource::TextureView(&inputs.gbuffer.views.w),
            frame.lighting.as_entire_binding(),
            BindingResource::TextureView(&frame.sky),
        ];
        let mut pass = &self.rays;
        if at_edges {
            resources.push(BindingResource::TextureView(&targets.edges.view));
            pass = &self.rays_at_edges;
        }
        pass.encode(encoder, &resources, &targets.rays(0));
    }

    fn round(&self, settings: Settings, is_last: bool, offset_px: [f32; 2]) -> wgpu::Buffer {
        let contents = RoundUniform { bounces: bounces(settings) as u32, is_last: u32::from(is_last), offset_px };
        uniform(&self.gpu, "round", bytemuck::bytes_of(&contents))
    }
}

fn rough_pass(gpu: &Gpu) -> Result<FullscreenPass, ShaderError> {
    use Binding::{FloatTexture, UintTexture, Uniform};
    let bindings = [UintTexture, UintTexture, Uniform, Uniform, Uniform, FloatTexture, UintTexture, FloatTexture];
    FullscreenPass::onto(Onto::Sum, gpu, ("client/reflect/gather_rough.wgsl", "gather_rough"), &bindings, &[SUM])
}

/// The value of a half, in the low bits: a count, so neither negative nor tiny nor infinite.
#[cfg(not(target_arch = "wasm32"))]
fn f64_from_half(bits: u32) -> f64 {
    let (exponent, mantissa) = ((bits >> 10) & 31, bits & 1023);
    if exponent == 0 { 0.0 } else { f64::from(1024 + mantissa) * f64::from(exponent as i32 - 25).exp2() }
}

fn bounces(settings: Settings) -> usize {
    match settings.bounces {
        Bounces::One => 1,
        Bounces::Two => 2,
    }
}

/// As many as a ray may need: one a mirror; within glass, once more where light was totally reflected, and outside; and one
/// behind a sample that counts in part.
fn rounds(reflectors: Reflectors, inputs: &ReflectInputs<'_>) -> usize {
    let of_mirrors = if reflectors.mirrors { bounces(inputs.settings) } else { usize::from(reflectors.rough) };
    let of_glass = if reflectors.glass { 3 } else { 0 };
    let fades = inputs.impostors.reflected().any(|placed| fades(placed, inputs.settings));
    of_mirrors.max(of_glass) + usize::from(fades)
}
