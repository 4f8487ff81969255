//! Sets of images, made and timed.

use std::time::Instant;

use camera::Pinhole;
use gpu::Gpu;
use server::discretize::{Capture, Discretization};

use super::metrics::{self, Bench};

/// Runs of which times are medians.
const REPEATS: usize = 3;

/// A set of images by a method.
pub(super) struct Made {
    pub name: String,
    pub method: Discretization,
    pub captures: Vec<Capture>,
    /// Wall time of the set without readback; of its first image alone.
    pub set_ms: f64,
    pub first_ms: f64,
    /// Of choosing views, where they were chosen.
    pub choice_ms: f64,
}

/// Makes a set, and times it.
pub(super) fn make(
    gpu: &Gpu,
    bench: &mut Bench<'_>,
    name: String,
    method: Discretization,
    cameras: &[Pinhole],
) -> anyhow::Result<Made> {
    let mut timed = |cameras: &[Pinhole]| {
        let mut times_ms = Vec::new();
        let mut captures = Vec::new();
        // The first run warms up.
        for _ in 0..=REPEATS {
            let started = Instant::now();
            let pending = bench.discretizer.run(&bench.stage.renderer, cameras, method)?;
            gpu.wait_idle()?;
            times_ms.push(started.elapsed().as_secs_f64() * 1000.0);
            captures = pending.wait()?;
        }
        times_ms.remove(0);
        times_ms.sort_by(f64::total_cmp);
        anyhow::Ok((times_ms[times_ms.len() / 2], captures))
    };
    let (first_ms, _) = timed(&cameras[..1])?;
    let (set_ms, captures) = timed(cameras)?;
    Ok(Made { name, method, captures, set_ms, first_ms, choice_ms: 0.0 })
}

/// Samples of a set.
pub(super) fn sample_count(set: &[Capture]) -> usize {
    set.iter().map(metrics::samples).sum()
}
