//! Our sets: views of our own choice, as many as are of use, for as many samples as another set has.

use std::time::Instant;

use glam::DVec2;
use gpu::Gpu;
use server::discretize::Discretization;
use server::discretize::placement::{Budget, place, probe};

use super::metrics::Bench;
use super::triangle::ViewTriangle;
use super::{Made, make, sample_count};

/// What the set is called.
pub(super) const NAME: &str = "footprint, placed";
/// Rows of places on a side of the triangle.
const GRID_ROWS: u32 = 4;
/// Images at most.
const IMAGES: usize = 6;
/// How near to the samples to spend a set must come.
const NEAR_ENOUGH: f64 = 0.03;
/// Sizes that are tried for it.
const TRIES: usize = 4;

/// A set of `samples` samples at most: its views are chosen first, then images are made as large as that allows.
pub(super) fn make_set(
    gpu: &Gpu,
    bench: &mut Bench<'_>,
    triangle: &ViewTriangle,
    near_m: f64,
    image_px: u32,
    samples: usize,
) -> anyhow::Result<Made> {
    let started = Instant::now();
    let views = triangle.grid(GRID_ROWS, (image_px, image_px), near_m);
    let probes: Vec<_> = views.iter().map(probe).collect();
    let captures = bench.captures(&probes, Discretization::Conventional)?;
    let chosen = place(&captures, DVec2::INFINITY, Budget::of(IMAGES));
    let choice_ms = started.elapsed().as_secs_f64() * 1000.0;
    let method = Discretization::FOOTPRINT;
    let cameras = |side_px: u32| {
        let all = triangle.grid(GRID_ROWS, (side_px, side_px), near_m);
        chosen.views.iter().map(|&view| all[view]).collect::<Vec<_>>()
    };
    let mut side_px = image_px;
    for _ in 0..TRIES {
        let found = sample_count(&bench.captures(&cameras(side_px), method)?);
        let ratio = samples as f64 / found.max(1) as f64;
        if (1.0 - NEAR_ENOUGH..=1.0).contains(&(1.0 / ratio)) {
            break;
        }
        // Samples grow with the square of the side; aim a little below.
        side_px = ((f64::from(side_px) * (ratio * (1.0 - NEAR_ENOUGH / 2.0)).sqrt()) as u32).clamp(16, 4096);
    }
    Ok(Made { choice_ms, ..make(gpu, bench, NAME.to_owned(), method, &cameras(side_px))? })
}
