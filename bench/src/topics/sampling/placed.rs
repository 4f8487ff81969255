//! Sets of views of our own choice: as many as are of use.

use std::time::Instant;

use camera::Pinhole;
use glam::DVec2;
use gpu::Gpu;
use server::discretize::Discretization;
use server::discretize::placement::{Budget, PROBE_PX, place, probe};

use super::made::{Made, make, sample_count};
use super::metrics::Bench;
use super::triangle::ViewTriangle;

/// A set for as many samples as the non-redundant one at the corners has.
pub(super) const NAME: &str = "footprint, placed";
/// A set by the server's own method that ends when probes miss little, with images as large as at the corners.
pub(super) const ENOUGH: &str = "covered, as many as it takes";
/// What [`ENOUGH`] is compared with: the same method at all corners.
pub(super) const ALL: &str = "covered";
/// Rows of places on a side of the triangle.
const GRID_ROWS: u32 = 4;
/// Images of [`NAME`] at most.
const IMAGES: usize = 6;
/// How near to the samples to spend a set must come.
const NEAR_ENOUGH: f64 = 0.03;
/// Sizes that are tried for it.
const TRIES: usize = 4;

/// Views that probes chose.
struct Choice {
    /// On the grid of places.
    views: Vec<usize>,
    /// Of drawing and comparing the probes.
    ms: f64,
}

impl Choice {
    fn new(bench: &mut Bench<'_>, (triangle, near_m): (&ViewTriangle, f64), images: usize) -> anyhow::Result<Choice> {
        let started = Instant::now();
        // A probe has a size of its own.
        let probes: Vec<_> =
            triangle.grid(GRID_ROWS, (1024, 1024), near_m).iter().map(|view| probe(view, PROBE_PX)).collect();
        let captures = bench.captures(&probes, Discretization::Conventional)?;
        let chosen = place(&captures, DVec2::INFINITY, Budget::of(images));
        Ok(Choice { views: chosen.views, ms: started.elapsed().as_secs_f64() * 1000.0 })
    }

    fn cameras(&self, (triangle, near_m): (&ViewTriangle, f64), side_px: u32) -> Vec<Pinhole> {
        let all = triangle.grid(GRID_ROWS, (side_px, side_px), near_m);
        self.views.iter().map(|&view| all[view]).collect()
    }
}

/// [`ENOUGH`], of `images` images at most.
pub(super) fn make_enough(
    gpu: &Gpu,
    bench: &mut Bench<'_>,
    places: (&ViewTriangle, f64),
    image_px: u32,
    images: usize,
) -> anyhow::Result<Made> {
    let choice = Choice::new(bench, places, images)?;
    let cameras = choice.cameras(places, image_px);
    Ok(Made { choice_ms: choice.ms, ..make(gpu, bench, ENOUGH.to_owned(), Discretization::default(), &cameras)? })
}

/// [`NAME`], of `samples` samples at most: its views are chosen first, then images are made as large as that allows.
pub(super) fn make_set(
    gpu: &Gpu,
    bench: &mut Bench<'_>,
    places: (&ViewTriangle, f64),
    image_px: u32,
    samples: usize,
) -> anyhow::Result<Made> {
    let choice = Choice::new(bench, places, IMAGES)?;
    let method = Discretization::FOOTPRINT;
    let mut side_px = image_px;
    for _ in 0..TRIES {
        let found = sample_count(&bench.captures(&choice.cameras(places, side_px), method)?);
        let ratio = samples as f64 / found.max(1) as f64;
        if (1.0 - NEAR_ENOUGH..=1.0).contains(&(1.0 / ratio)) {
            break;
        }
        // Samples grow with the square of the side; aim a little below.
        side_px = ((f64::from(side_px) * (ratio * (1.0 - NEAR_ENOUGH / 2.0)).sqrt()) as u32).clamp(16, 4096);
    }
    let cameras = choice.cameras(places, side_px);
    Ok(Made { choice_ms: choice.ms, ..make(gpu, bench, NAME.to_owned(), method, &cameras)? })
}
