//! Rows, bars, table and sheets of the report.

use std::path::Path;

use serde_json::json;

use super::explained::{self, UNEXPLAINED};
use super::pairs::Pairs;
use super::score::Scored;
use crate::compare::Picture;
use crate::report::table::Table;
use crate::report::{Bar, Figure, Report, Row};
use crate::spread::{Better, Spread};

/// Mean of all models at most.
const MEAN: f64 = 0.06;
/// Of any model at most.
const WORST: f64 = 0.12;
/// Pixels of silhouettes that are off by more than a pixel, as a share, at most: a pixel of the outline here and there.
const SILHOUETTES_OFF: f64 = 0.01;
const GAP_PX: u32 = 4;

/// Settings and notes.
pub(super) fn describe(report: &mut Report, pairs: &Pairs) {
    report.scene = pairs.pairs.iter().map(|pair| pair.name.clone()).collect();
    report.adapter = "that of the browser".to_owned();
    report.settings.set("three.js", json!(pairs.three));
    report.settings.set("environment", json!(pairs.environment));
    report.settings.set("pictures", format!("{0}x{0}", pairs.side_px));
    report.notes = [
        "Covered: where three.js shows anything of the model, the pixels of its outline included. FLIP is the mean over these.",
        "three.js: WebGLRenderer, antialiased, tone curve Khronos PBR Neutral at exposure 1, the environment filtered by PMREMGenerator, the file's own lights, animations at time 0.",
        "Ours: the browser client on WebGL2, a viewer at rest, antialiased, the server with --hold 0.",
        "Fine: three.js at 16 shaded samples a pixel, what it shows on a finer display seen from afar. How far its own plain picture is from that is what one shaded sample a pixel costs.",
        "Silhouettes: both, as a share of either; and what of one lies further than a pixel from the other, as a share of three.js's. Ours is where the picture differs from its background, so what \
         has the background's very colour is missing from it.",
        "Sheets: three.js, the same finely, ours, FLIP of ours to the first (black 0, pale yellow 1).",
    ]
    .map(str::to_owned)
    .to_vec();
}

/// What was found of all pairs.
pub(super) fn add(report: &mut Report, out: &Path, found: &[Scored]) -> anyhow::Result<()> {
    let mut table = Table::new([
        "model",
        "FLIP, covered",
        "to fine",
        "three.js to fine",
        "covered %",
        "silhouettes, both %",
        "off %",
        "verdict",
    ]);
    let mut worst_first: Vec<&Scored> = found.iter().collect();
    worst_first.sort_by(|a, b| b.flip_covered.total_cmp(&a.flip_covered));
    for scored in &worst_first {
        let percent = |share: f64| format!("{:.2}", share * 100.0);
        table.row([
            scored.name.clone(),
            format!("{:.4}", scored.flip_covered),
            format!("{:.4}", scored.ours_to_fine),
            format!("{:.4}", scored.three_to_fine),
            percent(scored.covered_share),
            percent(scored.silhouettes.iou),
            percent(scored.silhouettes.off_share),
            verdict(scored),
        ]);
        let caption =
            format!("{}: FLIP {:.4} over covered pixels; {}", scored.name, scored.flip_covered, verdict(scored));
        add_figure(report, out, &scored.sheet, format!("{}.png", scored.name), caption)?;
        report.rows.push(row(scored));
    }
    let mean = |of: fn(&Scored) -> f64| format!("{:.4}", found.iter().map(of).sum::<f64>() / found.len().max(1) as f64);
    let means =
        [mean(|scored| scored.flip_covered), mean(|scored| scored.ours_to_fine), mean(|scored| scored.three_to_fine)];
    let [flip, to_fine, of_three] = means;
    table.row(["mean".to_owned(), flip, to_fine, of_three, String::new(), String::new(), String::new(), String::new()]);
    report.tables.push(("Models, the worst first".to_owned(), table));
    if !found.is_empty() {
        let halves: Vec<Picture> = worst_first.iter().map(|scored| half(&scored.sheet)).collect();
        let all = Picture::below(&halves.iter().collect::<Vec<_>>(), GAP_PX);
        add_figure(report, out, &all, "all.png".into(), "All of them, in that order, half as large.".into())?;
    }
    report.bars = bars(found);
    Ok(())
}

fn add_figure(report: &mut Report, out: &Path, picture: &Picture, file: String, caption: String) -> anyhow::Result<()> {
    picture.write(&out.join(&file))?;
    report.figures.push(Figure { file, caption });
    Ok(())
}

fn verdict(scored: &Scored) -> String {
    match explained::why(scored) {
        _ if scored.flip_covered <= UNEXPLAINED => "ok".to_owned(),
        Some(why) => format!("explained: {why}"),
        None => "not explained".to_owned(),
    }
}

fn row(scored: &Scored) -> Row {
    let mut row = Row::new(&scored.name, "beside");
    let errors = [
        ("flip_covered", scored.flip_covered),
        ("flip_to_fine", scored.ours_to_fine),
        ("three_flip_to_fine", scored.three_to_fine),
    ];
    for (name, error) in errors {
        if let Some(spread) = Spread::of(&[error], Better::Lower) {
            row.error.set(name, spread);
        }
    }
    row.counts.set("covered_share", scored.covered_share);
    row.counts.set("silhouettes_iou", scored.silhouettes.iou);
    row.counts.set("silhouettes_off_share", scored.silhouettes.off_share);
    row.parameters.set("verdict", verdict(scored));
    row
}

fn bars(found: &[Scored]) -> Vec<Bar> {
    let worst = |values: &dyn Fn(&Scored) -> f64| found.iter().map(values).max_by(f64::total_cmp);
    let sum: f64 = found.iter().map(|scored| scored.flip_covered).sum();
    let mean = (!found.is_empty()).then(|| sum / found.len() as f64);
    let is_open = |scored: &&Scored| scored.flip_covered > UNEXPLAINED && explained::why(scored).is_none();
    let open = found.iter().filter(is_open).count();
    vec![
        Bar::at_most(format!("mean FLIP over covered pixels, {} models", found.len()), MEAN, mean, ""),
        Bar::at_most("the same of the worst model", WORST, worst(&|scored| scored.flip_covered), ""),
        Bar::at_most(format!("models above {UNEXPLAINED} without an explanation"), 0.0, Some(open as f64), ""),
        Bar::at_most(
            "silhouettes off by more than a pixel, the worst model",
            SILHOUETTES_OFF,
            worst(&|scored| scored.silhouettes.off_share),
            "share",
        ),
    ]
}

/// Half as large: each pixel the mean of four.
fn half(picture: &Picture) -> Picture {
    let (width_px, height_px) = (picture.width_px / 2, picture.height_px / 2);
    let byte = |x: u32, y: u32, c: usize| u32::from(picture.rgb[(y * picture.width_px + x) as usize * 3 + c]);
    let places = (0..height_px).flat_map(|y| (0..width_px).map(move |x| (2 * x, 2 * y)));
    let mean = |(x, y): (u32, u32)| {
        [0, 1, 2]
            .map(|c| ((byte(x, y, c) + byte(x + 1, y, c) + byte(x, y + 1, c) + byte(x + 1, y + 1, c) + 2) / 4) as u8)
    };
    Picture { width_px, height_px, rgb: places.flat_map(mean).collect(), covered: None }
}
