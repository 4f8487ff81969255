//! Times of several runs.

use std::time::Instant;

use crate::spread::{Better, Spread};

/// Times `work` and keeps its result.
pub(super) fn timed<T>(work: impl FnOnce() -> anyhow::Result<T>) -> anyhow::Result<(f64, T)> {
    let started = Instant::now();
    let result = work()?;
    Ok((started.elapsed().as_secs_f64() * 1000.0, result))
}

pub(super) fn spread(values: &[f64]) -> Spread {
    Spread::of(values, Better::Lower).expect("at least one run")
}
