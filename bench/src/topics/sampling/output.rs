//! Rows, tables beside the paper's, bars and plots of the topic.

use serde_json::json;

use super::{IMAGES, Made, SEED, Settings, Worth};
use crate::report::plot::{Axes, Scatter, Series, draw_curves, draw_scatter};
use crate::report::table::{Table, percent};
use crate::report::{Bar, Report, Row};
use crate::spread::{Better, Spread};
use crate::topic::Run;

/// What Xie, Wang and Popescu 2016 print for a scene, in per cent.
struct Paper {
    scene: &'static str,
    /// Table 1: redundant samples of conventional images 1 and 2.
    redundant: [u32; 2],
    /// Table 1: disoccluded, and useful ones of those, of non-redundant images 1 and 2.
    non_redundant: [[u32; 2]; 2],
    /// Table 1: the same of layers 0, 1 and 2.
    peeled: [[u32; 2]; 3],
    /// Table 2: average and least of conventional, non-redundant and peeled sets.
    available: [[u32; 2]; 3],
}

const PAPER: [Paper; 4] = [
    Paper {
        scene: "birdnest",
        redundant: [70, 80],
        non_redundant: [[62, 89], [76, 86]],
        peeled: [[10, 99], [46, 2], [52, 71]],
        available: [[90, 89], [93, 92], [92, 89]],
    },
    Paper {
        scene: "grass",
        redundant: [54, 69],
        non_redundant: [[56, 85], [75, 80]],
        peeled: [[15, 99], [51, 4], [71, 79]],
        available: [[86, 81], [96, 91], [93, 88]],
    },
    Paper {
        scene: "urban",
        redundant: [82, 84],
        non_redundant: [[73, 40], [80, 23]],
        peeled: [[1, 100], [78, 7], [88, 8]],
        available: [[97, 96], [98, 97], [96, 91]],
    },
    Paper {
        scene: "tree",
        redundant: [23, 35],
        non_redundant: [[84, 99], [88, 98]],
        peeled: [[44, 99], [63, 98], [72, 97]],
        available: [[55, 53], [59, 57], [55, 48]],
    },
];

/// The paper's three methods, in its order.
pub(super) const THREE: [&str; 3] = ["conventional", "non-redundant", "depth-peeling"];

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
        "footprint, placed: our set, aware of surfaces and footprints, of views that probes chose, with images as large as the samples \
         of the non-redundant set at the corners allow.",
        "Rays know no pixels: they hold what a pixel's centre misses, so sets by rays have fewer samples and more holes at one size.",
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
    row.counts.set("samples", worth.samples.iter().sum::<usize>() as f64);
    set_each(&mut row, "redundant", &worth.redundant);
    set_each(&mut row, "disoccluded", &worth.disoccluded);
    set_each(&mut row, "useful", &worth.useful);
    row.time_ms.set("set", Spread::single(set.set_ms));
    row.time_ms.set("choice", Spread::single(set.choice_ms));
    row
}

fn found<'a>(report: &'a Report, scene: &str, method: &str) -> Option<&'a Row> {
    report.rows.iter().find(|row| row.scene == scene && row.method == method && row.failed.is_none())
}

fn cell(found: Option<f64>, paper: Option<u32>) -> String {
    let found = found.map_or("-".to_owned(), |share| format!("{:.0}", 100.0 * share));
    paper.map_or(found.clone(), |paper| format!("{found} (paper {paper})"))
}

fn pair(found: [Option<f64>; 2], paper: Option<[u32; 2]>) -> String {
    let text = |values: [Option<f64>; 2]| {
        let [a, b] = values.map(|share| share.map_or("-".to_owned(), |share| format!("{:.0}", 100.0 * share)));
        format!("{a}, {b}")
    };
    paper.map_or(text(found), |[a, b]| format!("{} (paper {a}, {b})", text(found)))
}

/// The counterparts of the paper's tables 1 and 2, and what the other methods give.
pub(super) fn tables(report: &mut Report) {
    let scenes: Vec<String> = report.scene.clone();
    let paper = |scene: &str| PAPER.iter().find(|paper| paper.scene == scene);
    let mut redundant = Table::new(["scene", "image 1", "image 2"]);
    let mut disoccluded = Table::new(["scene", "method", "image 0", "image 1", "image 2"]);
    let mut available = Table::new(["scene", "method", "average", "least"]);
    let mut all = Table::new([
        "scene",
        "method",
        "images",
        "px",
        "samples",
        "missing",
        "by surface",
        "worst",
        "holes",
        "false cover",
        "FLIP",
        "kB",
        "set ms",
        "x conv.",
    ]);
    let mut converge = Table::new(["scene", "metrics", "px", "redundant 1, 2", "disoccluded 1, 2", "useful 1, 2"]);
    for scene in &scenes {
        let paper = paper(scene);
        let figure = |method: &str, path: &str| found(report, scene, method).and_then(|row| row.figure(path));
        redundant.row([
            scene.clone(),
            cell(figure("conventional", "counts.redundant_1"), paper.map(|paper| paper.redundant[0])),
            cell(figure("conventional", "counts.redundant_2"), paper.map(|paper| paper.redundant[1])),
        ]);
        for method in &THREE[1..] {
            let of_image = |image: usize| {
                let figures = ["disoccluded", "useful"].map(|what| figure(method, &format!("counts.{what}_{image}")));
                let paper = paper.and_then(|paper| match *method {
                    "depth-peeling" => Some(paper.peeled[image]),
                    _ if image > 0 => Some(paper.non_redundant[image - 1]),
                    _ => None,
                });
                pair(figures, paper)
            };
            disoccluded.row([scene.clone(), (*method).to_owned(), of_image(0), of_image(1), of_image(2)]);
        }
        for (method, index) in THREE.iter().zip(0..) {
            let share = |part: &str| figure(method, &format!("error.missing_share.{part}")).map(|share| 1.0 - share);
            let paper = |part: usize| paper.map(|paper| paper.available[index][part]);
            available.row([
                scene.clone(),
                (*method).to_owned(),
                cell(share("mean"), paper(0)),
                cell(share("worst"), paper(1)),
            ]);
        }
        for row in report.rows.iter().filter(|row| row.scene == *scene && row.failed.is_none()) {
            let text = |path: &str| row.figure(path);
            let share = |path: &str| text(path).map_or("-".to_owned(), percent);
            let plain = |path: &str, digits: usize, factor: f64| {
                text(path).map_or("-".to_owned(), |value| format!("{:.digits$}", value * factor))
            };
            let parameter = |name: &str| row.parameters.get(name).map_or("-".to_owned(), ToString::to_string);
            if row.method.starts_with("metrics") {
                let both = |what: &str| pair([1, 2].map(|image| text(&format!("counts.{what}_{image}"))), None);
                let (redundant, disoccluded, useful) = (both("redundant"), both("disoccluded"), both("useful"));
                let (method, px) = (row.method.clone(), parameter("image_px"));
                converge.row([scene.clone(), method, px, redundant, disoccluded, useful]);
                continue;
            }
            all.row([
                scene.clone(),
                row.method.clone(),
                parameter("images"),
                parameter("image_px"),
                plain("counts.samples", 0, 1.0),
                share("error.missing_share.mean"),
                share("error.missing_by_surface_share.mean"),
                share("error.missing_by_surface_share.worst"),
                share("error.holes_share.mean"),
                share("error.false_cover_share.mean"),
                plain("error.flip_covered.mean", 4, 1.0),
                plain("bytes.encoded_set", 0, 1e-3),
                plain("time_ms.set.median", 0, 1.0),
                plain("counts.later_images_ms_over_conventional", 2, 1.0),
            ]);
        }
    }
    let titled = [
        ("Table 1: redundant samples of conventional images, %", redundant),
        ("Table 1: disoccluded samples and the useful ones of them, %", disoccluded),
        ("Table 2: available samples of output frames, %", available),
        ("Every method", all),
        ("Fig. 7: metrics by pixels and by rays, %", converge),
    ];
    report
        .tables
        .extend(titled.into_iter().filter(|(_, table)| !table.is_empty()).map(|(t, table)| (t.to_owned(), table)));
}

/// What the tables must show.
pub(super) fn bars(report: &mut Report) {
    let mut bars = Vec::new();
    for scene in &report.scene {
        let figure = |method: &str, path: &str| found(report, scene, method).and_then(|row| row.figure(path));
        let mut beats = |what: &str, (ours, others): (&str, &str), path: &str| {
            if let Some(other) = figure(others, path) {
                bars.push(Bar::at_most(format!("{scene}: {what}"), other, figure(ours, path), "share"));
            }
        };
        let against = ("non-redundant", "conventional");
        beats("missing on average, non-redundant against conventional", against, "error.missing_share.mean");
        beats("missing at worst, non-redundant against conventional", against, "error.missing_share.worst");
        let against = ("non-redundant", "depth-peeling");
        beats("missing at worst, non-redundant against depth peeling", against, "error.missing_share.worst");
        let against = ("footprint, placed", "non-redundant");
        beats("missing by surface, ours against the corners", against, "error.missing_by_surface_share.mean");
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
