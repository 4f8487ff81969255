//! Checks against published figures, which need the folder that `VANTAGE_ASSETS` names; without it they count as ignored.

use std::path::{Path, PathBuf};

use libtest_mimic::{Arguments, Failed, Trial};
use vantage_bench::compare::{Picture, score};

/// A picture with the reference on its left and another system's frame on its right, and that frame's published FLIP.
const EXAMPLES: [(&str, &str, usize); 3] = [
    ("pillars-frame090-reference-quasar.png", "pillars_qr", 90),
    ("interior-frame070-reference-quasar.png", "interior_qr", 70),
    ("city-frame055-reference-quasar.png", "city_qr", 55),
];

/// Published figures have four decimals; implementations differ in the last.
const TOLERANCE: f64 = 1e-3;

fn main() {
    let assets = std::env::var_os("VANTAGE_ASSETS").map(PathBuf::from);
    let trials = EXAMPLES.iter().map(|&(file, run, frame)| {
        let folder = assets.clone();
        Trial::test(format!("flip_equals_the_published_figure::{run}::{frame}"), move || {
            flip_equals_the_published_figure(
                &folder.ok_or("VANTAGE_ASSETS is not set")?.join("peers"),
                file,
                run,
                frame,
            )
        })
        .with_ignored_flag(assets.is_none())
    });
    libtest_mimic::run(&Arguments::from_args(), trials.collect()).exit();
}

fn flip_equals_the_published_figure(peers: &Path, file: &str, run: &str, frame: usize) -> Result<(), Failed> {
    let both = Picture::read(&peers.join("examples").join(file))?;
    let width_px = both.width_px / 2;
    let (truth, shown) = (both.columns(0, width_px), both.columns(width_px, width_px));
    let figures: serde_json::Value = serde_json::from_str(&std::fs::read_to_string(peers.join("per_frame.json"))?)?;
    let published = figures[run]["flip"][frame].as_f64().ok_or("no such figure")?;
    let found = score(&shown, &truth, None)?.flip;
    if (found - published).abs() > TOLERANCE {
        return Err(format!("FLIP {found} is published as {published}").into());
    }
    println!("{run} frame {frame}: {found:.4}, published {published:.4}");
    Ok(())
}
