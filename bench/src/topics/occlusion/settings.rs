//! What a run of the topic is asked to measure.

use camera::{Pinhole, Rigid};
use client::draw::occlusion;
use scene::Scene;

use crate::topic::Run;

/// Seconds out, and as many back.
const HALF_S: f64 = 4.0;
const QUICK_HALF_S: f64 = 0.8;
/// Frames along the walk.
const POSES: usize = 40;
const QUICK_POSES: usize = 8;
/// Sides of server views and of the output.
const SIDES_PX: (u32, u32) = (512, 256);
const QUICK_SIDES_PX: (u32, u32) = (256, 128);
/// Reach of occlusion around an object that one turns, in bounding radii; where one walks it is the client's own.
const REACH_RADII: f64 = 0.2;
/// Surface points that are tried.
const POINTS: usize = 6_000;

/// What only this topic takes.
#[derive(Debug, Default, clap::Args)]
pub(super) struct Arguments {
    /// Frames along the walk [default: 40, with --quick 8].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(4..=1000))]
    poses: Option<u32>,
    /// Seconds out, and as many back [default: 4, with --quick 0.8].
    #[arg(long, value_name = "S", value_parser = seconds)]
    seconds: Option<f64>,
    /// Side of the server's images in pixels [default: 512, with --quick 256].
    #[arg(long, value_name = "PX", value_parser = clap::value_parser!(u32).range(128..=4096))]
    image_size: Option<u32>,
    /// Looks into z-buffers a pixel; may be given again [default: 128].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=640))]
    taps: Vec<u32>,
}

fn seconds(text: &str) -> Result<f64, String> {
    text.parse().ok().filter(|seconds| (0.1..=600.0).contains(seconds)).ok_or_else(|| "from 0.1 to 600".to_owned())
}

/// What is walked, and how it is looked at.
pub(super) struct Settings {
    pub half_s: f64,
    pub poses: usize,
    pub image_px: u32,
    pub output_px: u32,
    pub taps: Vec<u32>,
    pub points: usize,
}

impl Settings {
    pub fn of(run: &Run) -> anyhow::Result<Settings> {
        let arguments: Arguments = run.arguments()?;
        let (image_px, output_px) = if run.quick { QUICK_SIDES_PX } else { SIDES_PX };
        let taps = if arguments.taps.is_empty() { vec![occlusion::Settings::default().taps] } else { arguments.taps };
        Ok(Settings {
            half_s: arguments.seconds.unwrap_or(if run.quick { QUICK_HALF_S } else { HALF_S }),
            poses: arguments.poses.map_or(if run.quick { QUICK_POSES } else { POSES }, |poses| poses as usize),
            image_px: arguments.image_size.unwrap_or(image_px),
            output_px: run.size_px.map_or(output_px, |(_, height_px)| height_px),
            taps,
            points: POINTS,
        })
    }

    /// The output at a pose.
    pub fn output(&self, scene: &Scene, pose: Rigid) -> Pinhole {
        Pinhole::symmetric(pose, (self.output_px, self.output_px), 1.2, server::start::near_m(scene))
    }
}

/// How far what occludes may be, metres.
pub(super) fn reach_m(scene: &Scene) -> f64 {
    if scene.walk { occlusion::Settings::default().reach_m } else { REACH_RADII * scene.bounds.radius_m() }
}
