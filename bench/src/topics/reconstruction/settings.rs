//! What a run of the topic measures.

use server::discretize::Discretization;

use crate::sets::SetPlan;
use crate::topic::Run;

/// Output where `--size` gives none.
const OUTPUT_PX: (u32, u32) = (512, 512);
/// Of the product's set.
pub(super) const IMAGES: usize = 4;
const IMAGE_PX: u32 = 512;
/// Eyes of a full and of a quick run.
const EYES: usize = 64;
const QUICK_EYES: usize = 6;
pub(super) const SEED: u64 = 1;

/// What only this topic takes.
#[derive(Debug, Default, clap::Args)]
pub(super) struct Arguments {
    /// Eyes that look at each scene [default: 64, with --quick 6].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=4096))]
    pub eyes: Option<u64>,
    /// Only what the bars are about, with conventional images of the same views beside it.
    #[arg(long)]
    pub only_bars: bool,
}

/// What a run of the topic measures.
#[derive(Debug, Clone, Copy)]
pub(super) struct Settings {
    pub size_px: (u32, u32),
    pub eyes: usize,
    /// Side of the images of the product's set.
    pub image_px: u32,
    /// Whether other sizes and counts of images are measured too.
    pub curves: bool,
    /// Whether other corners, and sets that were completed, are left out.
    pub only_bars: bool,
}

impl Settings {
    pub fn of(run: &Run, arguments: &Arguments) -> Settings {
        let usual = if run.quick { QUICK_EYES } else { EYES };
        Settings {
            size_px: run.size_px.unwrap_or(OUTPUT_PX),
            eyes: arguments.eyes.map_or(usual, |eyes| eyes as usize),
            image_px: IMAGE_PX,
            curves: !run.quick && !arguments.only_bars,
            only_bars: arguments.only_bars,
        }
    }

    pub fn product(&self) -> SetPlan {
        SetPlan { discretization: Discretization::default(), images: IMAGES, image_px: self.image_px }
    }
}
