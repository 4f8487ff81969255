//! Rows, bars and plots of the topic.

use serde_json::json;
use server::discretize::Discretization;

use super::made::Made;
use super::metrics::Worth;
use super::placed;
use super::settings::{IMAGES, SEED, Settings};
use super::tables::found;
use crate::report::plot::{Axes, Scatter, Series, draw_curves, draw_scatter};
use crate::report::{Bar, Report, Row};
use crate::spread::{Better, Spread};
use crate::topic::Run;

/// Settings and notes.
pub(super) fn describe(report: &mut Report, settings: &Settings) {
    let Settings { size_px, image_px, frames, convergence_px, .. } = settings;
    report.settings.set("seed", SEED);
    report.settings.set("frames", *frames);
    report.settings.set("output", format!("{}x{} at 60 degrees", size_px.0, size_px.1));
    report.settings.set("images", format!("{IMAGES} of {image_px}x{image_px}"));
    report.settings.set("convergence_px", json!(convergence_px));
    report.notes = [
        "A sample is held by images that it is redundant with by the paper's pixel test, on the GPU, before anything is quantized: the \
         reprojected pixel holds the same triangle. Missing: of an output frame's samples, those that no image holds. By surface: a \
         sample of the same object on the same plane counts as well, within a footprint.",
        "The paper's scenes are not ours, nor are its viewpoints, which it does not print; its figures show what to expect of \
         scenes of the kind.",
        "Useful: of the disoccluded samples, those that some output frame holds; with fewer frames fewer are found.",
        "peeled from three eyes: three layers of each corner, no layer holding what another does (the 2016 paper's future work).",
        "footprint, placed: our set, aware of surfaces and footprints, of views that probes chose, with images as large as the samples \
         of the non-redundant set at the corners allow.",
        "Rays know no pixels: they hold what a pixel's centre misses, so sets by rays have fewer samples and more holes at one size.",
        "covered-triangle: redundant only where all four pixels around hold the triangle, so that nothing is lost at its edges.",
        "covered, as many as it takes: the server's method at views that probes choose, three at most, none for less than 0.05 %.",
        "Times are wall times of this machine, medians; choice: drawing and comparing the probes.",
    ]
    .map(str::to_owned)
    .to_vec();
}

/// One count for each image.
pub(super) fn set_each(row: &mut Row, name: &str, values: &[f64]) {
    for (index, &value) in values.iter().enumerate() {
        row.counts.set(format!("{name}_{index}"), value);
    }
}

/// Errors by name, where there are any.
pub(super) fn errors(row: &mut Row, errors: &[(&str, &[f64])]) {
    for (name, values) in errors {
        if let Some(spread) = Spread::of(values, Better::Lower) {
            row.error.set(*name, spread);
        }
    }
}

/// The figures of a set.
pub(super) fn row(label: &str, set: &Made, worth: &Worth) -> Row {
    let mut row = Row::new(label, &set.name);
    row.parameters.set("images", json!(set.captures.len()));
    row.parameters.set("image_px", json!(set.captures[0].camera.width_px));
    errors(&mut row, &[("missing_share", &worth.missing), ("missing_by_surface_share", &worth.missing_by_surface)]);
    row.counts.set("images", set.captures.len() as f64);
    row.counts.set("samples", worth.samples.iter().sum::<usize>() as f64);
    set_each(&mut row, "redundant", &worth.redundant);
    set_each(&mut row, "disoccluded", &worth.disoccluded);
    set_each(&mut row, "useful", &worth.useful);
    row.time_ms.set("set", Spread::single(set.set_ms));
    row.time_ms.set("choice", Spread::single(set.choice_ms));
    row
}

/// A scene that one image covers.
const ONE_IMAGE: &str = "mural";

/// What the tables must show.
pub(super) fn bars(report: &mut Report) {
    let mut bars = Vec::new();
    for scene in &report.scene {
        let figure = |method: &str, path: &str| found(report, scene, method).and_then(|row| row.figure(path));
        if *scene == ONE_IMAGE {
            let images = figure(placed::ENOUGH, "counts.images");
            bars.push(Bar::at_most(format!("{scene}: images, where one is enough"), 1.0, images, ""));
            continue;
        }
        let mut beats = |(ours, others): (&str, &str), what: &str, path: &str| {
            if let (Some(own), Some(other)) = (figure(ours, path), figure(others, path)) {
                let what = format!("{scene}: {what}, {ours} against {others}");
                let unit = if path.starts_with("error") { "share" } else { "" };
                bars.push(Bar::at_most(what, other, Some(own), unit));
            }
        };
        let (mean, worst) = ("error.missing_share.mean", "error.missing_share.worst");
        // The paper's test, and ours that loses nothing at edges.
        for ours in ["non-redundant", "covered-triangle"] {
            beats((ours, "conventional"), "missing on average", mean);
            beats((ours, "conventional"), "missing at worst", worst);
        }
        beats(("non-redundant", "depth-peeling"), "missing at worst", worst);
        let by_surface = "error.missing_by_surface_share.mean";
        let served = Discretization::default().to_string();
        for (what, path) in [
            ("missing by surface on average", "error.missing_by_surface_share.mean"),
            ("missing by surface at worst", "error.missing_by_surface_share.worst"),
            ("samples", "counts.samples"),
        ] {
            beats((&served, "conventional"), what, path);
        }
        beats((placed::NAME, "non-redundant"), "missing by surface at equal samples", by_surface);
        let ratio = figure("non-redundant", "counts.later_images_ms_over_conventional");
        bars.push(Bar::at_most(format!("{scene}: time of images 1 and 2 over conventional"), 2.5, ratio, ""));
    }
    report.bars.extend(bars);
}

/// Error against time and bytes, and convergence.
pub(super) fn plots(label: &str, run: &Run, report: &mut Report) -> anyhow::Result<()> {
    let axes = [
        ("missing-time", "error.missing_by_surface_share.mean", 100.0, "missing by surface, %", "time_ms.set.median"),
        ("missing-bytes", "error.missing_by_surface_share.mean", 100.0, "missing by surface, %", "bytes.encoded_set"),
        ("flip-time", "error.flip_covered.mean", 1.0, "FLIP over covered pixels", "time_ms.set.median"),
        ("flip-bytes", "error.flip_covered.mean", 1.0, "FLIP over covered pixels", "bytes.encoded_set"),
    ];
    for (name, y_path, y_factor, y_label, x_path) in axes {
        let (x_factor, x_label) =
            if x_path.starts_with("bytes") { (1e-3, "encoded set, kB") } else { (1.0, "set, ms (median)") };
        let rows = report.rows.iter().filter(|row| row.scene == label);
        let series = rows.filter_map(|row| {
            let point = (row.figure(x_path)? * x_factor, row.figure(y_path)? * y_factor);
            Some(Series { name: row.method.clone(), points: vec![point] })
        });
        let plot = Scatter {
            title: format!("{label}: {y_label}, mean"),
            x_label: x_label.to_owned(),
            y_label: y_label.to_owned(),
            series: series.collect(),
        };
        let caption = format!("{label}: {y_label} against {x_label}, every method, with the Pareto front.");
        let path = run.figure(report, format!("{label}-{name}.svg"), caption);
        draw_scatter(&plot, &path)?;
    }
    convergence_plot(label, run, report)
}

fn convergence_plot(label: &str, run: &Run, report: &mut Report) -> anyhow::Result<()> {
    let mut series: Vec<Series> = Vec::new();
    for row in report.rows.iter().filter(|row| row.scene == label && row.method.starts_with("metrics")) {
        let Some(px) = row.parameters.get("image_px").and_then(serde_json::Value::as_f64) else { continue };
        for what in ["redundant", "disoccluded", "useful"] {
            let Some(share) = row.figure(&format!("counts.{what}_1")) else { continue };
            let name = format!("{what}, {}", row.method.trim_start_matches("metrics "));
            match series.iter_mut().find(|series| series.name == name) {
                Some(series) => series.points.push((px, 100.0 * share)),
                None => series.push(Series { name, points: vec![(px, 100.0 * share)] }),
            }
        }
    }
    if series.is_empty() {
        return Ok(());
    }
    let plot = Scatter {
        title: format!("{label}: metrics of image 1 by the size of images"),
        x_label: "side of an image, pixels".to_owned(),
        y_label: "share of samples, %".to_owned(),
        series,
    };
    let caption = format!("{label}: the metrics by pixels and by rays approach each other as images grow.");
    let path = run.figure(report, format!("{label}-convergence.svg"), caption);
    draw_curves(&plot, Axes { log_x: true, front: false }, &path)
}
