//! What a run of the topic is asked to measure.

use super::methods::{self, Way};
use super::sets::{Images, PLACED, SETS};
use crate::report::kept::Taken;
use crate::topic::Run;

/// What only this topic takes.
#[derive(Debug, Default, clap::Args)]
pub(super) struct Arguments {
    /// Sides of the lamp's images in pixels [default: 512, 1024 and 1536, with --quick 256].
    #[arg(long, value_name = "PX", value_parser = clap::value_parser!(u32).range(16..=4096))]
    pub image_size: Vec<u32>,
    /// Diagonals of the lamp, in those of the scene's box [default: 1, and 1/4, 1/2, 2 and 4 for images of 1024].
    #[arg(long, value_name = "SIZE")]
    pub lamp: Vec<f64>,
    /// The lamp is N x N points [default: 16, with --quick 4].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=32))]
    pub points: Option<u32>,
    /// Only these sets of images: placed (as a server makes them), placed-N (from N points), covered (from the corners), conventional,
    /// depth-peeling or any other method by its name.
    #[arg(long, value_name = "NAME")]
    pub set: Vec<String>,
    /// Only these ways of drawing, of every set: maps, or one of the faster ones by its whole name [default: all of them of covered sets,
    /// and of others where images and lamp have their usual size, with --quick none of others but maps].
    #[arg(long, value_name = "NAME")]
    pub method: Vec<String>,
    /// Blades a tuft of the meadows by which frame times grow with the number of triangles [default: 9, 36, 144, 576 and 2304, with --quick 9
    /// and 144].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=2304))]
    pub blades: Vec<u32>,
    /// Leaves out how frame times grow with the number of triangles.
    #[arg(long)]
    pub no_growth: bool,
    /// Measures everything anew: rows that an earlier run of this program kept in the folder are not taken.
    #[arg(long, conflicts_with = "any_build")]
    pub fresh: bool,
    /// Takes rows that other builds of this program kept in the folder too: what changed does not concern them.
    #[arg(long)]
    pub any_build: bool,
}

impl Arguments {
    pub fn taken(&self) -> Taken {
        match (self.fresh, self.any_build) {
            (true, _) => Taken::Nothing,
            (_, true) => Taken::AnyBuild,
            _ => Taken::SameBuild,
        }
    }
}

/// See the module.
#[derive(Clone)]
pub(super) struct Settings {
    pub size_px: (u32, u32),
    pub points: u32,
    /// Pairs of lamp and images.
    pub sizes: Vec<(f64, u32)>,
    pub sets: Vec<(String, Images)>,
    pub ways: Vec<Way>,
    /// Which sets are drawn in all of them, rather than in the paper's alone.
    pub in_all_ways: InAllWays,
    /// What images have while the lamp changes.
    pub usual_px: u32,
    /// What they have while the number of triangles grows.
    pub growth_px: u32,
    /// Blades a tuft; none: growth is left out.
    pub blades: Vec<u32>,
    /// Times are medians of as many, of fewer where one takes long.
    pub runs: usize,
}

/// What is drawn in all ways.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum InAllWays {
    /// Sets without redundancy.
    Ours,
    /// Those, and all sets where images and lamp have their usual size.
    Usual,
    /// All sets.
    Everything,
}

/// The paper's sizes of images, of lamps, and what is kept while the other changes.
const IMAGES_PX: [u32; 3] = [512, 1024, 1536];
pub(super) const LAMPS: [f64; 5] = [0.25, 0.5, 1.0, 2.0, 4.0];
const USUAL_PX: u32 = 1024;
pub(super) const USUAL_LAMP: f64 = 1.0;
/// The scene that growth is measured on.
const GROWING: &str = "grass";

impl Settings {
    pub fn of(run: &Run, arguments: &Arguments) -> anyhow::Result<Settings> {
        let Arguments { image_size, lamp, points, set, method, blades, no_growth, .. } = arguments;
        let quick_px: &[u32] = if run.quick { &[256] } else { &[USUAL_PX] };
        let sizes: Vec<(f64, u32)> = if run.quick || !image_size.is_empty() || !lamp.is_empty() {
            let images: &[u32] = if image_size.is_empty() { quick_px } else { image_size };
            let lamps: &[f64] = if lamp.is_empty() { &[USUAL_LAMP] } else { lamp };
            lamps.iter().flat_map(|&lamp| images.iter().map(move |&image_px| (lamp, image_px))).collect()
        } else {
            let by_image = IMAGES_PX.map(|image_px| (USUAL_LAMP, image_px));
            let by_lamp = LAMPS.into_iter().filter(|lamp| *lamp != USUAL_LAMP).map(|lamp| (lamp, USUAL_PX));
            by_image.into_iter().chain(by_lamp).collect()
        };
        let usual = || [PLACED].into_iter().chain(SETS).map(str::to_owned).collect();
        let names: Vec<String> = if set.is_empty() { usual() } else { set.clone() };
        let named =
            |name: &String| Images::named(name).map(|images| (name.clone(), images)).map_err(anyhow::Error::msg);
        let has_usual = sizes.iter().any(|(_, image_px)| *image_px == USUAL_PX);
        let grows = !no_growth && (!run.names_scenes() || run.scenes.iter().any(|scene| scene == GROWING));
        let by_default: &[u32] = if run.quick { &[9, 144] } else { &[9, 36, 144, 576, 2304] };
        let blades = if blades.is_empty() { by_default } else { blades };
        let usual_px = if has_usual { USUAL_PX } else { sizes[0].1 };
        let in_all_ways = match (method.is_empty(), run.quick) {
            (false, _) => InAllWays::Everything,
            (true, false) => InAllWays::Usual,
            (true, true) => InAllWays::Ours,
        };
        Ok(Settings {
            size_px: run.size_px.unwrap_or(if run.quick { (256, 256) } else { (512, 512) }),
            points: points.unwrap_or(if run.quick { 4 } else { 16 }),
            usual_px,
            growth_px: if run.quick { usual_px / 2 } else { usual_px },
            sizes,
            sets: names.iter().map(named).collect::<anyhow::Result<_>>()?,
            ways: methods::named(method).map_err(anyhow::Error::msg)?,
            in_all_ways,
            blades: if grows { blades.to_vec() } else { Vec::new() },
            runs: if run.quick { 1 } else { 5 },
        })
    }

    /// Whether points and output are as many as in the paper's tables.
    pub fn are_the_papers(&self) -> bool {
        (self.points, self.size_px) == (16, (512, 512))
    }
}
