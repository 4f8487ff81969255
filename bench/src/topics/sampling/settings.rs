//! What a run of the topic measures.

use super::paper;
use crate::topic::Run;

/// Images at the corners.
pub(super) const IMAGES: usize = 3;
pub(super) const SEED: u64 = 1;

/// What only this topic takes.
#[derive(Debug, Default, clap::Args)]
pub(super) struct Arguments {
    /// Output frames between the corners [default: 1000, with --quick 40].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=100_000))]
    pub frames: Option<u64>,
    /// Side of the reference images in pixels [default: 1024, with --quick 512].
    #[arg(long, value_name = "PX", value_parser = clap::value_parser!(u32).range(16..=4096))]
    pub image_size: Option<u32>,
    /// Side of the triangle of viewpoints in metres.
    #[arg(long, value_name = "M")]
    pub side: Option<f64>,
    /// Only these methods beside conventional and non-redundant images and depth peeling; `all` names every one.
    #[arg(long, value_name = "NAME", default_value = "all")]
    pub method: Vec<String>,
    /// Leaves out how the metrics converge with the size of images.
    #[arg(long)]
    pub no_convergence: bool,
}

/// What a run of the topic measures.
#[derive(Debug, Clone)]
pub(super) struct Settings {
    pub size_px: (u32, u32),
    pub image_px: u32,
    pub frames: usize,
    pub side_m: Option<f64>,
    /// Names of methods, or `all`.
    pub methods: Vec<String>,
    /// Sizes of images at which the metrics are compared, by pixels and by rays.
    pub convergence_px: Vec<u32>,
}

impl Settings {
    pub fn of(run: &Run, arguments: &Arguments) -> Settings {
        let (frames, image_px, sizes): (_, _, &[u32]) =
            if run.quick { (40, 512, &[256, 512, 1024]) } else { (1000, 1024, &[512, 1024, 2048, 4096]) };
        Settings {
            size_px: run.size_px.unwrap_or(if run.quick { (256, 256) } else { (512, 512) }),
            image_px: arguments.image_size.unwrap_or(image_px),
            frames: arguments.frames.map_or(frames, |frames| frames as usize),
            side_m: arguments.side,
            methods: arguments.method.clone(),
            convergence_px: if arguments.no_convergence { Vec::new() } else { sizes.to_vec() },
        }
    }

    /// Whether a method is measured; the paper's three always are.
    pub fn wants(&self, name: &str) -> bool {
        paper::THREE.contains(&name) || self.methods.iter().any(|wanted| wanted == "all" || wanted == name)
    }
}
