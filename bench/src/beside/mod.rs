//! `vantage-report beside`: models as the web client shows them, beside three.js.
//!
//! It takes a folder of pairs, which `cargo xtask beside` makes: of each model two pictures at one camera, in one environment, on
//! one background. The score is FLIP over the pixels where three.js shows something ("covered"). That two cameras are one is seen
//! by the silhouettes: our own is where our picture differs from its background.

mod explained;
mod output;
mod pairs;
mod score;

use std::path::{Path, PathBuf};

use clap::Args;
use rayon::prelude::*;

use crate::report::progress::Progress;
use crate::report::{Report, Row, write};
use pairs::Pairs;
use score::Scored;

/// Compares pictures of models with three.js's, as `cargo xtask beside` makes them.
#[derive(Args)]
pub struct BesideArgs {
    /// Folder with pairs.json and a folder of pictures for each pair.
    #[arg(long, value_name = "DIR", default_value = "target/report/beside/pairs")]
    pub pairs: PathBuf,
    /// Where the report goes.
    #[arg(long, value_name = "DIR", default_value = "target/report/beside")]
    pub out: PathBuf,
}

const ABOUT: &str = "Models as the web client shows them at rest, beside three.js: the same camera, environment and background; FLIP over the \
                     pixels where three.js shows something.";

/// Scores all pairs and writes the report. A pair that could not be made or read is a failed row.
pub fn beside(args: &BesideArgs) -> anyhow::Result<Report> {
    std::fs::create_dir_all(&args.out)?;
    let pairs = Pairs::read(&args.pairs)?;
    let mut report = Report::new("beside", ABOUT);
    output::describe(&mut report, &pairs);
    let mut found = Vec::new();
    for (pair, scored) in pairs.pairs.iter().zip(scored(&pairs, &args.pairs)) {
        match scored {
            Ok(scored) => found.push(scored),
            Err(error) => report.rows.push(Row::failed(&pair.name, "beside", &error)),
        }
    }
    output::add(&mut report, &args.out, &found)?;
    write::write_all(&report, &args.out)?;
    Ok(report)
}

fn scored(pairs: &Pairs, folder: &Path) -> Vec<anyhow::Result<Scored>> {
    let progress = Progress::new("comparing", pairs.pairs.len() as u64);
    let score = |pair| {
        let scored = Scored::of(pair, folder);
        progress.step();
        scored
    };
    pairs.pairs.par_iter().map(score).collect()
}
