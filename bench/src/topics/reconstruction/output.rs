//! Rows, plots and pictures of the topic.

use serde_json::json;

use super::cover::Verdict;
use super::eyes::Eye;
use super::found::{Found, STAGES, Shown};
use super::method::Method;
use super::settings::{IMAGES, SEED, Settings};
use crate::compare::flip::error_picture;
use crate::compare::{Picture, flip_map};
use crate::report::plot::{Scatter, Series, draw_scatter};
use crate::report::{Report, Row};
use crate::spread::{Better, Spread};
use crate::stage::picture;
use crate::topic::Run;

/// Settings and notes.
pub(super) fn describe(report: &mut Report, settings: &Settings) {
    let Settings { size_px, eyes, image_px, .. } = *settings;
    report.settings.set("eyes", eyes);
    report.settings.set("seed", SEED);
    report.settings.set("output", format!("{}x{} at 60 degrees", size_px.0, size_px.1));
    report.settings.set("images", format!("{IMAGES} of {image_px}x{image_px}"));
    report.settings.set("fill", true);
    report.notes = [
        "Truth: the full scene, one sample at each pixel's centre, by a renderer that shares nothing with the reconstruction.",
        "Eyes lie in a ball of 0.25 m at 1.7 m height around places to stand (objects: 5 % of the bounding radius); every \
         eye has its own set of images, made for the ball's middle looking the same way, and sees a surface in at least \
         60 % of its pixels, or in as many as one of 64 tries does.",
        "Holes, cracks, false cover and leaks are shares of the pixels where the truth has a surface, before any filling. Depths \
         are the same within two pixel footprints z/f and a depth step; grazing surfaces get no more.",
        "A crack is a hole whose point some image of the set holds: same object, on the plane of the sample of its pixel.",
        "FLIP, SSIM and PSNR are of the picture as shown: lit, holes filled.",
        "Floor: nothing is hidden from an image of the eye itself, so its errors are those of drawing samples on another grid of \
         pixels. Images are wider than the view and so coarser: 0.84 of its pixels a radian at the default sizes.",
        "Times are wall times of this machine, medians: images = all images of the set with readback, build = the surfaces' \
         meshes, frame = drawing, lighting and filling.",
        "Settings beside 4 images of 512 are seen from every fourth eye: compare them as curves.",
    ]
    .map(str::to_owned)
    .to_vec();
}

/// The figures of a method.
pub(super) fn row(label: &str, method: &Method, found: &[(usize, Found)]) -> Row {
    let mut row = Row::new(label, &method.name());
    row.parameters.set("images", json!(method.plan.images));
    row.parameters.set("image_px", json!(method.plan.image_px));
    let values = |f: &dyn Fn(&Found) -> f64| found.iter().map(|(_, found)| f(found)).collect::<Vec<_>>();
    let mut error = |name: &str, better, f: &dyn Fn(&Found) -> f64| {
        if let Some(spread) = Spread::of(&values(f), better) {
            row.error.set(name, spread);
        }
    };
    error("holes_share", Better::Lower, &|found| found.shares.holes);
    error("cracks_share", Better::Lower, &|found| found.shares.cracks);
    error("false_cover_share", Better::Lower, &|found| found.shares.false_cover);
    error("leaks_share", Better::Lower, &|found| found.shares.leaks);
    error("flip_covered", Better::Lower, &|found| found.scores.flip_covered.unwrap_or(f64::NAN));
    error("flip", Better::Lower, &|found| found.scores.flip);
    error("ssim", Better::Higher, &|found| found.scores.ssim);
    error("psnr_db", Better::Higher, &|found| found.scores.psnr_db);
    for (index, stage) in STAGES.into_iter().enumerate() {
        if let Some(spread) = Spread::of(&values(&|found| found.times_ms[index]), Better::Lower) {
            row.time_ms.set(stage, spread);
        }
    }
    let mean = |f: &dyn Fn(&Found) -> f64| values(f).iter().sum::<f64>() / found.len().max(1) as f64;
    row.bytes.set("encoded_set", mean(&|found| found.encoded_bytes));
    row.bytes.set("raw_set", mean(&|found| found.raw_bytes));
    row.counts.set("samples", mean(&|found| found.samples).round());
    row.counts.set("eyes", found.len() as f64);
    row
}

/// Holes, false cover and FLIP against a client's frame time and against bytes.
pub(super) fn plots(label: &str, run: &Run, report: &mut Report) -> anyhow::Result<()> {
    let axes = [
        ("holes", "error.holes_share.mean", 100.0, "holes, % of covered pixels (mean)", "time_ms.frame.median"),
        (
            "false-cover",
            "error.false_cover_share.mean",
            100.0,
            "false cover, % of covered pixels (mean)",
            "time_ms.frame.median",
        ),
        ("flip", "error.flip_covered.mean", 1.0, "FLIP over covered pixels (mean)", "time_ms.frame.median"),
        ("flip-bytes", "error.flip_covered.mean", 1.0, "FLIP over covered pixels (mean)", "bytes.encoded_set"),
    ];
    for (name, y_path, y_factor, y_label, x_path) in axes {
        let (x_factor, x_label) = if x_path.starts_with("bytes") {
            (1e-3, "encoded set, kB (mean)")
        } else {
            (1.0, "client frame, ms (median)")
        };
        let mut series: Vec<Series> = Vec::new();
        for row in report.rows.iter().filter(|row| row.scene == label) {
            let (Some(x), Some(y)) = (row.figure(x_path), row.figure(y_path)) else { continue };
            let point = (x * x_factor, y * y_factor);
            match series.iter_mut().find(|series| series.name == row.method) {
                Some(series) => series.points.push(point),
                None => series.push(Series { name: row.method.clone(), points: vec![point] }),
            }
        }
        // A line joins a method's settings from cheap to dear.
        series.iter_mut().for_each(|series| series.points.sort_by(|a, b| a.0.total_cmp(&b.0)));
        let plot = Scatter {
            title: format!("{label}: {y_label}"),
            x_label: x_label.to_owned(),
            y_label: y_label.to_owned(),
            series,
        };
        let caption = format!("{label}: {y_label} against {x_label}; each point is a setting of a method.");
        let path = run.figure(report, format!("{label}-{name}.svg"), caption);
        draw_scatter(&plot, &path)?;
    }
    Ok(())
}

/// The worst frame of the product: truth, what is shown, FLIP, and where surfaces disagree.
pub(super) fn picture_of(shown: &Shown, eye: &Eye, label: &str, run: &Run, report: &mut Report) -> anyhow::Result<()> {
    let truth = picture(&eye.truth);
    let errors = error_picture(&flip_map(&shown.drawn, &truth)?, truth.width_px, truth.height_px);
    let disagreement = disagreement(&shown.verdicts, &truth);
    let caption = format!(
        "{label}, the eye with the largest FLIP (number {}): truth, shown, FLIP (black 0 to yellow 1), and where surfaces \
         disagree: holes red, cracks orange, false cover blue, leaks green.",
        shown.eye
    );
    let path = run.figure(report, format!("{label}-worst.png"), caption);
    Picture::beside(&[&truth, &shown.drawn, &errors, &disagreement], 4).write(&path)?;
    Ok(())
}

fn disagreement(verdicts: &[Verdict], truth: &Picture) -> Picture {
    let mut map = truth.clone();
    for (pixel, verdict) in map.rgb.chunks_exact_mut(3).zip(verdicts) {
        let grey = (pixel.iter().map(|&value| u32::from(value)).sum::<u32>() / 3) as u8;
        let colour = match verdict {
            Verdict::Right => [grey / 2 + 100; 3],
            Verdict::Hole => [220, 0, 0],
            Verdict::Crack => [255, 140, 0],
            Verdict::FalseCover => [0, 60, 255],
            Verdict::Leak => [0, 170, 60],
        };
        pixel.copy_from_slice(&colour);
    }
    map
}
