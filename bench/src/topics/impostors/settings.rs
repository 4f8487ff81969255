//! What a run of the topic measures.

use super::occlusion::StabilityPlan;
use crate::topic::Run;

/// What only this topic takes.
#[derive(Debug, Default, clap::Args)]
pub(super) struct Arguments {
    /// Poses along the path [default: 60, with --quick 6; of occlusion 120 and 24].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=10_000))]
    pub poses: Option<u64>,
    /// Leaves out how much an image holds, what rays cost, and what a session spends.
    #[arg(long)]
    pub only_errors: bool,
    /// Only compares ways of rays to walk, by fine steps and sizes of images.
    #[arg(long, conflicts_with = "only_errors")]
    pub walks: bool,
    /// Compares one ray through each pixel's centre, in the truth and by the client: what smooths edges and averages colours is in neither.
    #[arg(long)]
    pub one_ray: bool,
    /// Draws reflections only as is decided, by depth images and by environment maps, which bars of all that reflects compare: a third of the time.
    #[arg(long)]
    pub few_methods: bool,
}

/// What a run of the topic measures.
#[derive(Debug, Clone)]
pub(super) struct Settings {
    pub size_px: (u32, u32),
    pub poses: usize,
    pub only_errors: bool,
    pub walks: bool,
    pub one_ray: bool,
    pub few_methods: bool,
    pub quick: bool,
    pub occlusion: StabilityPlan,
}

impl Settings {
    pub fn of(run: &Run, arguments: &Arguments) -> Settings {
        let size_px = run.size_px.unwrap_or(if run.quick { (128, 128) } else { (512, 512) });
        let poses = arguments.poses.map_or(if run.quick { 6 } else { 60 }, |poses| poses as usize);
        let plan = if run.quick { StabilityPlan::QUICK } else { StabilityPlan::FULL };
        let occlusion = StabilityPlan {
            size_px: run.size_px.unwrap_or(plan.size_px),
            poses: arguments.poses.map_or(plan.poses, |poses| poses as usize),
            ..plan
        };
        Settings {
            size_px,
            poses,
            only_errors: arguments.only_errors,
            walks: arguments.walks,
            one_ray: arguments.one_ray,
            few_methods: arguments.few_methods,
            quick: run.quick,
            occlusion,
        }
    }
}
