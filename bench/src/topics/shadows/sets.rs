//! The lamp's images, and a client that draws shadows from them.

use std::ops::Range;
use std::time::Instant;

use camera::{Bounds, Pinhole};
use client::draw::soft::{self, Count, Lamp, Pace, Receivers, Settings, SoftShadows};
use gpu::{Gpu, Readback};
use protocol::codec::Coding;
use protocol::held::{Held, HeldPatch};
use protocol::{DepthImage, Lighting, Material, Purpose};
use server::discretize::placement::Budget;
use server::discretize::{DepthPrecision, Discretization, Discretizer};
use server::lights::{
    self,
    places::{self, Places},
};
use surface::mesh::{self, MeshOptions};
use surface::{CornerRules, GBuffer, HeldSurfaces, PatchMesh};
use wgpu::TextureView;

use super::hidden::{Hidden, pixel_count};
use super::lamp::{self, corner_views, middle_view};
use super::undrawn::Neighbours;
use crate::client_view::{ClientView, HeldSet};
use crate::sets::{self, ImageSet};
use crate::spread::{Better, Spread};
use crate::stage::Stage;

/// The counterparts of the paper's: of the corners without redundancy ([`Discretization::COVERED`]), conventional, peeled.
pub(super) const SETS: [&str; 3] = ["covered", "conventional", "depth-peeling"];
/// As a server makes them.
pub(super) const PLACED: &str = "placed";
/// Images of a set of the corners, or of layers.
const IMAGES: usize = 4;

/// The images of a lamp, and the times that it took, of `runs` times at most; the first run warms up.
pub(super) fn make(
    stage: &Stage,
    discretizer: &mut Discretizer,
    images: Images,
    (lamp, image_px): (&Lamp, u32),
    runs: usize,
) -> anyhow::Result<(ImageSet, Spread)> {
    let views = images.views(stage, discretizer, (lamp, image_px))?;
    let mut make = || sets::make(stage, discretizer, &views, images.discretization(), DepthPrecision::Finest);
    let mut made = make()?;
    let times = repeated(runs, || {
        made = make()?;
        Ok([made.images_ms])
    })?;
    Ok((made, times[0]))
}

/// The images of a lamp.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Images {
    /// By a method: of its corners, or layers from its middle.
    By(Discretization),
    /// Without redundancy from the points that probes choose: as many as a server takes, or just so many.
    Placed(Option<usize>),
}

impl Images {
    /// By the name of a method, "placed", or "placed-N".
    pub fn named(name: &str) -> Result<Images, String> {
        match name.split_once(PLACED) {
            Some(("", "")) => Ok(Images::Placed(None)),
            Some(("", count)) => {
                let count = count.strip_prefix('-').and_then(|count| count.parse().ok());
                let is_possible = |count: &usize| (1..=places::POINTS.len()).contains(count);
                let count = count
                    .filter(is_possible)
                    .ok_or_else(|| format!("{name}: a lamp is looked from 1 to {} points", places::POINTS.len()))?;
                Ok(Images::Placed(Some(count)))
            }
            _ => name.parse().map(Images::By),
        }
    }

    /// The counterpart of the paper's own.
    pub const CORNERS: Images = Images::By(Discretization::COVERED);

    fn discretization(self) -> Discretization {
        match self {
            Images::By(discretization) => discretization,
            Images::Placed(_) => lights::METHOD,
        }
    }

    fn views(
        self,
        stage: &Stage,
        discretizer: &mut Discretizer,
        (lamp, image_px): (&Lamp, u32),
    ) -> anyhow::Result<Vec<Pinhole>> {
        let budget = match self {
            Images::By(Discretization::DepthPeeling) => {
                return Ok(vec![middle_view(lamp, &stage.scene, image_px)?; IMAGES]);
            }
            Images::By(_) => return corner_views(lamp, &stage.scene, image_px),
            Images::Placed(None) => places::BUDGET,
            Images::Placed(Some(images)) => Budget { images, missing: 0.0 },
        };
        let bounds = lamp::bounds(&stage.scene);
        let probes = places::all_views(lamp, bounds, places::PROBE_PX);
        let look =
            |face: &Vec<Pinhole>| Ok(discretizer.run(&stage.renderer, face, Discretization::Conventional)?.wait()?);
        let probes = probes.iter().map(look).collect::<anyhow::Result<Vec<_>>>()?;
        let faces = Places::by_probes(&probes, budget).views(lamp, bounds, image_px);
        lamp::only_face(faces)
    }
}

/// What a client is sent of such images: surfaces alone, as samples of lights have no colours.
pub(super) fn bytes(images: &[DepthImage]) -> usize {
    let colourless = |image: &DepthImage| DepthImage { colour: vec![[0; 3]; image.colour.len()], ..image.clone() };
    let images: Vec<DepthImage> = images.iter().map(colourless).collect();
    sets::encoded(&images, Coding::default()).iter().map(Vec::len).sum()
}

/// Measures no longer than this where once is enough: what takes seconds several times, and once what takes half a minute.
const ENOUGH_MS: f64 = 8000.0;

/// Times of what is done `runs` times, or as often as there is time for.
pub(super) fn repeated<const N: usize>(
    runs: usize,
    mut measure: impl FnMut() -> anyhow::Result<[f64; N]>,
) -> anyhow::Result<[Spread; N]> {
    let mut all: [Vec<f64>; N] = std::array::from_fn(|_| Vec::new());
    let mut spent_ms = 0.0;
    for run in 0..runs.max(1) {
        if run > 0 && spent_ms > ENOUGH_MS {
            break;
        }
        for (times, ms) in all.iter_mut().zip(measure()?) {
            times.push(ms);
            spent_ms += ms;
        }
    }
    Ok(all.map(|times| Spread::of(&times, Better::Lower).expect("it ran once at least")))
}

/// Surfaces that cast.
pub(super) struct Casters {
    surfaces: HeldSurfaces,
    bounds_world: Bounds,
    pub build_ms: f64,
}

impl Casters {
    pub fn get(&self) -> soft::Casters<'_> {
        soft::Casters { surfaces: &self.surfaces, bounds_world: self.bounds_world }
    }
}

/// A client that holds an image of a view.
pub(super) struct Client {
    gpu: Gpu,
    view: Pinhole,
    /// Of the scene: maps lie as the truth's do ([`super::truths`]).
    bounds_world: Bounds,
    set: HeldSet,
    materials: Vec<Material>,
    lighting: Lighting,
    frames: ClientView,
}

impl Client {
    pub fn new(gpu: &Gpu, stage: &Stage, shown: &DepthImage, view: &Pinhole) -> anyhow::Result<Client> {
        let look = (stage.renderer.materials(), &stage.lighting);
        let set = HeldSet::new(gpu, std::slice::from_ref(shown), look)?;
        let mut frames = ClientView::new(gpu, (view.width_px, view.height_px))?;
        frames.draw(&set, view, client::draw::frame::Options::default())?;
        let (materials, lighting) = (look.0.to_vec(), stage.lighting.clone());
        Ok(Client {
            gpu: gpu.clone(),
            view: *view,
            bounds_world: lamp::bounds(&stage.scene),
            set,
            materials,
            lighting,
            frames,
        })
    }

    /// Rebuilds the surfaces of images.
    pub fn casters(&self, images: &[DepthImage]) -> anyhow::Result<Casters> {
        let rules = CornerRules::of(Purpose::Light(0));
        self.casters_with(images, |surfaces, held, _| {
            mesh::build(held, &MeshOptions { rules, ..surfaces.mesh_options() })
        })
    }

    /// The same with meshes of one's own.
    pub fn casters_with(
        &self,
        images: &[DepthImage],
        mesh: impl Fn(&HeldSurfaces, &HeldPatch, usize) -> PatchMesh,
    ) -> anyhow::Result<Casters> {
        let look = (&*self.materials, &self.lighting);
        let HeldSet { surfaces, build_ms, .. } = HeldSet::with_meshes(&self.gpu, images, look, mesh)?;
        Ok(Casters { surfaces, bounds_world: self.bounds_world, build_ms })
    }

    fn gbuffer(&self) -> &GBuffer {
        self.frames.gbuffer().expect("a frame was drawn")
    }

    fn held(&self) -> &Held {
        &self.set.held
    }

    /// Times of the surfaces of a lamp's images and of drawing its shadows from them. Both are cold: surfaces that nobody drew yet, of which
    /// nothing can be kept; only the pipelines are warm, from drawing `tiny`, small images of the same lamp.
    pub fn cold(
        &self,
        lamp: &Lamp,
        (images, tiny): (&[DepthImage], &[DepthImage]),
        settings: Settings,
        runs: usize,
    ) -> anyhow::Result<[Spread; 2]> {
        let tiny = self.casters(tiny)?;
        repeated(runs, || {
            let casters = self.casters(images)?;
            Ok([casters.build_ms, self.shadows(lamp, (&casters, &tiny), settings)?])
        })
    }

    /// What drawing a lamp's shadows takes, in ms, after those of `others` were drawn.
    pub fn shadows(
        &self,
        lamp: &Lamp,
        (casters, others): (&Casters, &Casters),
        settings: Settings,
    ) -> anyhow::Result<f64> {
        let mut shadows = SoftShadows::new(&self.gpu, settings);
        let turns = first_frame(&shadows, settings);
        self.timed(&mut shadows, lamp, others, turns.clone())?;
        self.timed(&mut shadows, lamp, casters, turns)
    }

    fn timed(
        &self,
        shadows: &mut SoftShadows,
        lamp: &Lamp,
        casters: &Casters,
        turns: Range<usize>,
    ) -> anyhow::Result<f64> {
        let started = Instant::now();
        let mut encoder = self.gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        self.shown(&mut encoder, shadows, (lamp, casters), turns)?;
        self.gpu.queue.submit([encoder.finish()]);
        self.gpu.wait_idle()?;
        Ok(started.elapsed().as_secs_f64() * 1e3)
    }

    /// The share of a lamp that a picture shows as hidden after some of its points were drawn.
    fn shown(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        shadows: &mut SoftShadows,
        (lamp, casters): (&Lamp, &Casters),
        turns: Range<usize>,
    ) -> anyhow::Result<TextureView> {
        let hidden = shadows.target(encoder, self.gbuffer().size_px).create_view(&Default::default());
        let count = Count::Share { hidden: &hidden, channel: 0 };
        shadows.encode(encoder, (lamp, casters.get()), self.receivers(), (count, turns.clone()))?;
        Ok(shadows.shown(encoder, (&hidden, turns.end), self.receivers())?)
    }

    fn receivers(&self) -> Receivers<'_> {
        Receivers { gbuffer: self.gbuffer(), held: self.held(), view: &self.view }
    }

    /// Which points of a lamp each pixel does not see, by the first frame; those that it does not draw are guessed.
    pub fn hidden(&self, lamp: &Lamp, casters: &Casters, settings: Settings) -> anyhow::Result<Hidden> {
        let mut shadows = SoftShadows::new(&self.gpu, settings);
        let points = settings.points.pow(2) as usize;
        let size_px = self.gbuffer().size_px;
        let mut encoder = self.gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let targets: Vec<wgpu::Texture> =
            (0..points.div_ceil(Count::POINTS_A_TARGET)).map(|_| shadows.target(&mut encoder, size_px)).collect();
        let views: Vec<TextureView> = targets.iter().map(|target| target.create_view(&Default::default())).collect();
        let turns = first_frame(&shadows, settings);
        let count = Count::Each(&views);
        shadows.encode(&mut encoder, (lamp, casters.get()), self.receivers(), (count, turns.clone()))?;
        let drawn = shadows.numbers(turns.clone());
        let neighbours = Neighbours::new(&drawn, settings.points as usize);
        let is_part = drawn.len() < points;
        // Of all points the share is what they say.
        let shown = is_part.then(|| self.shown(&mut encoder, &mut shadows, (lamp, casters), turns)).transpose()?;
        let mut readback = Readback::default();
        let slots: Vec<_> = targets.iter().map(|target| readback.texture(target, 0, size_px)).collect();
        let shown = shown.map(|shown| readback.texture(shown.texture(), 0, size_px));
        let w = readback.texture(&self.gbuffer().w, 0, size_px);
        let encoded = readback.encode(&self.gpu, &mut encoder);
        self.gpu.queue.submit([encoder.finish()]);
        let mapped = encoded.map().wait(&self.gpu)?;
        let w: Vec<f32> = mapped.values(w);
        let planes: Vec<Vec<[u16; 4]>> = slots.into_iter().map(|slot| mapped.values(slot)).collect();
        let words = |pixel: usize| {
            let mut words = vec![0u64; points.div_ceil(64)];
            for (target, plane) in planes.iter().enumerate() {
                for (channel, half) in plane[pixel].iter().enumerate() {
                    let first = target * Count::POINTS_A_TARGET + channel * 8;
                    words[first / 64] |= (from_half(*half) as u64) << (first % 64);
                }
            }
            neighbours.vote(&words)
        };
        let pixels = (0..pixel_count(&self.view)).map(|pixel| (w[pixel] > 0.0).then(|| words(pixel))).collect();
        let mut hidden = Hidden::new(points, pixels);
        if let Some(shown) = shown {
            let all_of_drawn = points as f32 / drawn.len() as f32;
            let share = |channels: [u16; 4]| all_of_drawn * from_half(channels[0]);
            hidden.shares = mapped.values(shown).into_iter().map(share).collect();
        }
        Ok(hidden)
    }
}

/// The points that the first frame draws.
fn first_frame(shadows: &SoftShadows, settings: Settings) -> Range<usize> {
    let all = shadows.points();
    0..if let Pace::Points(points) = settings.pace { all.min(points as usize) } else { all }
}

/// A number above or at zero from a 16-bit float: 1 + 15 at the exponent, ten bits after the point.
fn from_half(half: u16) -> f32 {
    let (exponent, mantissa) = (i32::from(half >> 10 & 31), f32::from(half & 0x3ff) / 1024.0);
    if exponent == 0 { mantissa * 2f32.powi(-14) } else { (1.0 + mantissa) * 2f32.powi(exponent - 15) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_takes_long_is_measured_once() {
        let of =
            |runs: usize, ms: f64| repeated(runs, || Ok([ms, 2.0])).expect("nothing fails").map(|times| times.count);
        let long = ENOUGH_MS - 1.0;
        assert_eq!((of(5, 1.0), of(5, long), of(1, 0.0), of(0, 0.0)), ([5, 5], [1, 1], [1, 1], [1, 1]));
    }

    #[test]
    fn numbers_come_back_from_halves() {
        for whole in 1u16..256 {
            let exponent = whole.ilog2() as u16;
            let half = (exponent + 15) << 10 | (whole << (10 - exponent) & 0x3ff);
            assert_eq!(from_half(half), f32::from(whole));
        }
        // Zero, the least and the greatest below the least exponent, 1/256, 0.75.
        let halves = [0, 1, 0x3ff, 0x1c00, 0x3a00];
        assert_eq!(halves.map(from_half), [0.0, 2f32.powi(-24), 2f32.powi(-14) - 2f32.powi(-24), 1.0 / 256.0, 0.75]);
    }
}
