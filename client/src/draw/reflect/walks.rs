//! The walks of rays in impostors, tile by tile: in all impostors wherever rays are followed; or, in two passes, where rays of a low
//! resolution meet one impostor, in it alone and between their depths (`client/reflect/guided.wgsl`).

use std::collections::BTreeMap;

use gpu::Gpu;
use shaders::ShaderError;
use wgpu::{BindingResource, CommandEncoder, TextureFormat, TextureView};

use super::inputs::ReflectInputs;
use super::uniforms::PlacedUniform;
use super::{Search, Settings, Walk};
use crate::draw::fullscreen::{Binding, FULLSCREEN, FullscreenPass, Onto, Program, Target, begin, uniform};
use crate::draw::impostors::{ImpostorKind, Placed, PlacedCamera};

/// Integers are what WebGL2 draws in 16 bytes without an extension.
pub(super) const WORDS: TextureFormat = TextureFormat::Rgba32Uint;
/// Steps and rays; exact up to 2048, and WebGL2 adds in it.
const COUNT: TextureFormat = TextureFormat::Rgba16Float;

/// Pixels of a tile's side, and from one ray of the low resolution to the next: those of `client/reflect/tile.wgsl`.
const TILE_PX: u32 = 8;
const GUIDE_PX: u32 = 4;

/// Columns and rows of a picture's tiles: the first one begins outside of it.
fn tiles_of((width_px, height_px): (u32, u32)) -> (u32, u32) {
    (width_px.div_ceil(TILE_PX) + 1, height_px.div_ceil(TILE_PX) + 1)
}

/// Which rays walk.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Rays {
    /// Those of tiles that are walked in all impostors.
    All,
    /// Of the low resolution.
    Guides,
    /// Those of tiles that these guide.
    Guided,
}

/// A pipeline that walks, or counts the steps of doing so.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Walker {
    path: &'static str,
    rays: Rays,
    counts: bool,
    walk: Walk,
}

impl Walker {
    /// The entry points for vertices and fragments.
    fn entries(self) -> (&'static str, &'static str) {
        match (self.rays, self.counts) {
            (Rays::All, false) => ("rayed_tiles", "walk"),
            (Rays::All, true) => ("rayed_tiles", "count"),
            (Rays::Guides, false) => (FULLSCREEN, "guide"),
            (Rays::Guides, true) => (FULLSCREEN, "count_guide"),
            (Rays::Guided, false) => ("guided_tiles", "walk_guided"),
            (Rays::Guided, true) => ("guided_tiles", "count_guided"),
        }
    }

    /// The `override` constants of `impostor/walk.wgsl`.
    fn constants(self) -> [(&'static str, f64); 2] {
        let (method, coarse_px) = match self.walk {
            Walk::Fine => (0, 0),
            Walk::Coarse { coarse_px } => (1, coarse_px),
            Walk::Hierarchy | Walk::TwoPass => (2, 0),
        };
        [("impostor_method", f64::from(method)), ("impostor_coarse_px", f64::from(coarse_px))]
    }
}

/// What walks are drawn into.
#[derive(Debug)]
pub(super) struct WalkTargets {
    size_px: (u32, u32),
    tiles: Target,
    /// What rays have met.
    pub found: Target,
    depth: Target,
    /// Steps, where they are counted.
    pub count: Option<Target>,
    guides: Option<GuideTargets>,
}

/// What only two passes need.
#[derive(Debug)]
struct GuideTargets {
    found: Target,
    depth: Target,
    tiles_left: Target,
    count: Option<Target>,
}

impl WalkTargets {
    pub fn new(gpu: &Gpu, size_px: (u32, u32), settings: Settings) -> WalkTargets {
        let target = |label, size_px, format| Target::new(gpu, label, size_px, format);
        let count = |size_px| settings.count_steps.then(|| target("steps of rays", size_px, COUNT));
        let guides_px = (size_px.0.div_ceil(GUIDE_PX), size_px.1.div_ceil(GUIDE_PX));
        let guides = || GuideTargets {
            found: target("met by guides", guides_px, WORDS),
            depth: target("met by guides at", guides_px, Onto::DEPTH),
            tiles_left: target("tiles left by guides", tiles_of(size_px), WORDS),
            count: count(guides_px),
        };
        WalkTargets {
            size_px,
            tiles: target("tiles of rays", tiles_of(size_px), WORDS),
            found: target("found by rays", size_px, WORDS),
            depth: target("found by rays at", size_px, Onto::DEPTH),
            count: count(size_px),
            guides: (settings.walk == Walk::TwoPass).then(guides),
        }
    }

    /// Where rays met what they have found.
    pub fn depth(&self) -> &wgpu::Texture {
        &self.depth.texture
    }

    /// Whether a picture of these settings is drawn into them.
    pub fn fit(&self, size_px: (u32, u32), settings: Settings) -> bool {
        let is_two_pass = settings.walk == Walk::TwoPass;
        self.size_px == size_px && self.count.is_some() == settings.count_steps && self.guides.is_some() == is_two_pass
    }

    /// Where steps were counted, and the sizes.
    #[cfg(not(target_arch = "wasm32"))]
    pub fn counts(&self) -> impl Iterator<Item = &wgpu::Texture> {
        let of_guides = self.guides.as_ref().and_then(|guides| guides.count.as_ref());
        self.count.iter().chain(of_guides).map(|target| &target.texture)
    }

    /// Forgets the counts of the last picture.
    pub fn begin(&self, encoder: &mut CommandEncoder) {
        let of_guides = self.guides.as_ref().and_then(|guides| guides.count.as_ref());
        for count in self.count.iter().chain(of_guides) {
            drop(begin(encoder, "count", true, &[&count.view], None));
        }
    }
}

/// The rays of a round, and what they may meet.
pub(super) struct Followed<'a> {
    pub inputs: &'a ReflectInputs<'a>,
    pub impostors: &'a [&'a Placed],
    /// Two texels each.
    pub rays: [&'a TextureView; 2],
    /// Whether all pixels sent one, so that a few tell of the others.
    pub of_all_pixels: bool,
}

impl Followed<'_> {
    fn first(&self) -> BindingResource<'_> {
        BindingResource::TextureView(self.rays[0])
    }

    /// `Placed` and `Impostor` of each impostor.
    fn uniforms(&self, gpu: &Gpu) -> Vec<[wgpu::Buffer; 2]> {
        let (settings, eye_world) = (self.inputs.settings, self.inputs.camera.world_from_eye.translation);
        let of_one = |(placed, number): (&&Placed, u32)| {
            let place = PlacedUniform::new(placed, eye_world, self.inputs.poses_now, settings);
            let place = PlacedUniform { number, ..place };
            let image = placed.walked_by(settings.search.fine_px());
            [uniform(gpu, "placed", bytemuck::bytes_of(&place)), uniform(gpu, "impostor", bytemuck::bytes_of(&image))]
        };
        self.impostors.iter().zip(1..).map(of_one).collect()
    }
}

/// Where some rays of a round are drawn.
struct Onward<'a> {
    rays: Rays,
    tiles: &'a Target,
    found: &'a Target,
    depth: &'a Target,
    count: Option<&'a Target>,
    /// Whether what was found before is forgotten.
    clears: bool,
}

/// See the module.
#[derive(Debug)]
pub(super) struct Walks {
    gpu: Gpu,
    tiles: FullscreenPass,
    guided: Option<GuidedPasses>,
    /// Made when an impostor first needs them: a browser takes long for loops.
    walks: BTreeMap<Walker, FullscreenPass>,
}

#[derive(Debug)]
struct GuidedPasses {
    tiles: FullscreenPass,
    tiles_left: FullscreenPass,
}

impl Walks {
    pub fn new(gpu: &Gpu) -> Result<Walks, ShaderError> {
        let tiles = FullscreenPass::new(gpu, "client/reflect/tiles.wgsl", "tiles", &[Binding::UintTexture], &[WORDS])?;
        Ok(Walks { gpu: gpu.clone(), tiles, guided: None, walks: BTreeMap::new() })
    }

    /// Walks in all impostors; `targets.found` holds what is met first.
    pub fn encode(
        &mut self,
        encoder: &mut CommandEncoder,
        followed: &Followed<'_>,
        targets: &WalkTargets,
    ) -> Result<(), ShaderError> {
        let uniforms = followed.uniforms(&self.gpu);
        let WalkTargets { tiles, found, depth, count, .. } = targets;
        let all = Onward { rays: Rays::All, tiles, found, depth, count: count.as_ref(), clears: true };
        let Some(guides) = targets.guides.as_ref().filter(|_| followed.of_all_pixels) else {
            self.tiles.encode(encoder, &[followed.first()], &[&tiles.view]);
            return self.walk(encoder, followed, &uniforms, &all);
        };
        let GuideTargets { found: met, depth, count, tiles_left } = guides;
        let low = Onward { rays: Rays::Guides, tiles, found: met, depth, count: count.as_ref(), clears: true };
        self.walk(encoder, followed, &uniforms, &low)?;
        self.make_guided()?;
        let [met, seen] = [&met.view, &found.view].map(BindingResource::TextureView);
        if let Some(guided) = &self.guided {
            guided.tiles.encode(encoder, &[followed.first(), met], &[&tiles.view]);
        }
        self.walk(encoder, followed, &uniforms, &Onward { rays: Rays::Guided, ..all })?;
        if let Some(guided) = &self.guided {
            let before = BindingResource::TextureView(&tiles.view);
            guided.tiles_left.encode(encoder, &[followed.first(), seen, before], &[&tiles_left.view]);
        }
        self.walk(encoder, followed, &uniforms, &Onward { tiles: tiles_left, clears: false, ..all })
    }

    fn walk(
        &mut self,
        encoder: &mut CommandEncoder,
        followed: &Followed<'_>,
        uniforms: &[[wgpu::Buffer; 2]],
        onward: &Onward<'_>,
    ) -> Result<(), ShaderError> {
        let settings = followed.inputs.settings;
        for counts in [false, true].into_iter().take(1 + usize::from(settings.count_steps)) {
            let walker = |placed: &Placed| Walker {
                path: path(placed, settings),
                rays: onward.rays,
                counts,
                walk: settings.walk,
            };
            for placed in followed.impostors {
                self.make_walk(walker(placed), &placed.camera)?;
            }
            let (target, depth) = match onward.count.filter(|_| counts) {
                Some(count) => (count, None),
                None => (onward.found, Some(&onward.depth.view)),
            };
            let mut pass = begin(encoder, "walk", onward.clears && !counts, &[&target.view], depth);
            for (placed, [place, image]) in followed.impostors.iter().zip(uniforms) {
                let mut resources = vec![place.as_entire_binding(), image.as_entire_binding()];
                resources.extend(followed.rays.map(BindingResource::TextureView));
                resources.extend(placed.textures());
                resources.push(placed.camera.binding());
                resources.push(BindingResource::TextureView(&onward.tiles.view));
                match (self.walks.get(&walker(placed)), onward.rays) {
                    (Some(walk), Rays::Guides) => walk.draw(&mut pass, &resources),
                    (Some(walk), Rays::All | Rays::Guided) => {
                        let size = onward.tiles.texture.size();
                        walk.draw_squares(&mut pass, &resources, size.width * size.height);
                    }
                    (None, _) => {}
                }
            }
        }
        Ok(())
    }

    fn make_guided(&mut self) -> Result<(), ShaderError> {
        if self.guided.is_none() {
            let pass = |fragment, textures| {
                let bindings = vec![Binding::UintTexture; textures];
                FullscreenPass::new(&self.gpu, "client/reflect/guided.wgsl", fragment, &bindings, &[WORDS])
            };
            self.guided = Some(GuidedPasses { tiles: pass("guided_tiles", 2)?, tiles_left: pass("tiles_left", 3)? });
        }
        Ok(())
    }

    fn make_walk(&mut self, walker: Walker, camera: &PlacedCamera) -> Result<(), ShaderError> {
        use Binding::{FloatTexture, UintTexture, Uniform};
        if self.walks.contains_key(&walker) {
            return Ok(());
        }
        let of_camera = if matches!(camera, PlacedCamera::Graph(_)) { FloatTexture } else { Uniform };
        let bindings = [
            Uniform,
            Uniform,
            UintTexture,
            UintTexture,
            FloatTexture,
            FloatTexture,
            UintTexture,
            FloatTexture,
            of_camera,
            UintTexture,
        ];
        let (vertex, fragment) = walker.entries();
        let (onto, format) = if walker.counts { (Onto::Sum, COUNT) } else { (Onto::Depth, WORDS) };
        let program = Program { path: walker.path, vertex, fragment, constants: &walker.constants() };
        let pass = FullscreenPass::of(&self.gpu, program, onto, &bindings, &[format])?;
        self.walks.insert(walker, pass);
        Ok(())
    }
}

fn path(placed: &Placed, settings: Settings) -> &'static str {
    match &placed.camera {
        _ if is_map(placed, settings.search) => "client/reflect/map.wgsl",
        PlacedCamera::Pinhole(_) | PlacedCamera::Spoc(_) => "client/reflect/pinhole.wgsl",
        PlacedCamera::Graph(_) => "client/reflect/graph.wgsl",
    }
}

/// Whether directions alone look an impostor up.
fn is_map(placed: &Placed, search: Search) -> bool {
    let is_walked = matches!(placed.kind, ImpostorKind::Inside(_)) || matches!(placed.camera, PlacedCamera::Graph(_));
    search == Search::EnvironmentMap && !is_walked
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tiles_and_methods_are_those_of_wgsl() {
        let text = shaders::source("client/reflect/walk.wgsl").expect("it is there");
        let of = |walk| Walker { path: "", rays: Rays::All, counts: false, walk }.constants()[0].1;
        for line in [
            format!("const TILE_PX = {TILE_PX};"),
            format!("const GUIDE_PX = {GUIDE_PX};"),
            format!("const IMPOSTOR_FINE = {}u;", of(Walk::Fine)),
            format!("const IMPOSTOR_COARSE = {}u;", of(Walk::Coarse { coarse_px: 6 })),
            format!("const IMPOSTOR_HIERARCHY = {}u;", of(Walk::Hierarchy)),
        ] {
            assert!(text.contains(&line), "{line}");
        }
    }
}
