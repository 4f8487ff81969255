//! The counterparts of the paper's tables 1 and 2 and figure 7, with its figures beside ours, and what the other methods give.

use super::paper::{PAPER, Paper, THREE};
use super::placed;
use crate::report::table::{Table, percent};
use crate::report::{Report, Row};

/// The row of a method that did not fail.
pub(super) fn found<'a>(report: &'a Report, scene: &str, method: &str) -> Option<&'a Row> {
    report.rows.iter().find(|row| row.scene == scene && row.method == method && row.failed.is_none())
}

/// Adds all tables.
pub(super) fn add(report: &mut Report) {
    let tables = [
        ("Table 1: redundant samples of conventional images, %", redundant(report)),
        ("Table 1: disoccluded samples and the useful ones of them, %", disoccluded(report)),
        ("Table 2: available samples of output frames, %", available(report)),
        ("Every method", every_method(report)),
        ("Images that probes leave out (conventional -> at the corners -> as many as it takes)", left_out(report)),
        ("Fig. 7: metrics by pixels and by rays, %", convergence(report)),
    ];
    let filled = tables.into_iter().filter(|(_, table)| !table.is_empty());
    report.tables.extend(filled.map(|(title, table)| (title.to_owned(), table)));
}

fn paper(scene: &str) -> Option<&'static Paper> {
    PAPER.iter().find(|paper| paper.scene == scene)
}

fn cell(found: Option<f64>, paper: Option<u32>) -> String {
    let found = found.map_or("-".to_owned(), |share| format!("{:.0}", 100.0 * share));
    paper.map_or(found.clone(), |paper| format!("{found} (paper {paper})"))
}

fn pair(found: [Option<f64>; 2], paper: Option<[u32; 2]>) -> String {
    let [a, b] = found.map(|share| share.map_or("-".to_owned(), |share| format!("{:.0}", 100.0 * share)));
    paper.map_or(format!("{a}, {b}"), |[c, d]| format!("{a}, {b} (paper {c}, {d})"))
}

fn redundant(report: &Report) -> Table {
    let mut table = Table::new(["scene", "image 1", "image 2"]);
    for scene in &report.scene {
        let figure = |path: &str| found(report, scene, "conventional").and_then(|row| row.figure(path));
        let paper = |image: usize| paper(scene).map(|paper| paper.redundant[image]);
        let cells = [0, 1].map(|image| cell(figure(&format!("counts.redundant_{}", image + 1)), paper(image)));
        table.row([scene.clone()].into_iter().chain(cells));
    }
    table
}

fn disoccluded(report: &Report) -> Table {
    let mut table = Table::new(["scene", "method", "image 0", "image 1", "image 2"]);
    for (scene, method) in report.scene.iter().flat_map(|scene| THREE[1..].iter().map(move |method| (scene, *method))) {
        let figure = |path: &str| found(report, scene, method).and_then(|row| row.figure(path));
        let of_image = |image: usize| {
            let figures = ["disoccluded", "useful"].map(|what| figure(&format!("counts.{what}_{image}")));
            let paper = paper(scene).and_then(|paper| match method {
                "depth-peeling" => Some(paper.peeled[image]),
                _ if image > 0 => Some(paper.non_redundant[image - 1]),
                _ => None,
            });
            pair(figures, paper)
        };
        table.row([scene.clone(), method.to_owned(), of_image(0), of_image(1), of_image(2)]);
    }
    table
}

fn available(report: &Report) -> Table {
    let mut table = Table::new(["scene", "method", "average", "least"]);
    for scene in &report.scene {
        for (method, index) in THREE.iter().zip(0..) {
            let figure = |part: &str| {
                let path = format!("error.missing_share.{part}");
                found(report, scene, method).and_then(|row| row.figure(&path)).map(|share| 1.0 - share)
            };
            let paper = |part: usize| paper(scene).map(|paper| paper.available[index][part]);
            let (average, least) = (cell(figure("mean"), paper(0)), cell(figure("worst"), paper(1)));
            table.row([scene.clone(), (*method).to_owned(), average, least]);
        }
    }
    table
}

/// Figures of a row as text.
struct Cells<'a>(&'a Row);

impl Cells<'_> {
    fn share(&self, path: &str) -> String {
        self.0.figure(path).map_or("-".to_owned(), percent)
    }

    fn plain(&self, path: &str, digits: usize, factor: f64) -> String {
        self.0.figure(path).map_or("-".to_owned(), |value| format!("{:.digits$}", value * factor))
    }

    fn parameter(&self, name: &str) -> String {
        self.0.parameters.get(name).map_or("-".to_owned(), ToString::to_string)
    }
}

/// Rows of scenes, scene by scene, that did not fail.
fn rows(report: &Report, of_metrics: bool) -> impl Iterator<Item = &Row> {
    let of_scene = |scene: &String| {
        report.rows.iter().filter(|row| row.scene == *scene && row.failed.is_none()).collect::<Vec<_>>()
    };
    report.scene.iter().flat_map(of_scene).filter(move |row| row.method.starts_with("metrics") == of_metrics)
}

fn every_method(report: &Report) -> Table {
    let head = ["scene", "method", "images", "px", "samples", "missing", "by surface", "worst", "holes", "false cover"];
    let mut table = Table::new(head.into_iter().chain(["FLIP", "kB", "set ms", "x conv."]));
    for row in rows(report, false) {
        let cells = Cells(row);
        table.row([
            row.scene.clone(),
            row.method.clone(),
            cells.parameter("images"),
            cells.parameter("image_px"),
            cells.plain("counts.samples", 0, 1.0),
            cells.share("error.missing_share.mean"),
            cells.share("error.missing_by_surface_share.mean"),
            cells.share("error.missing_by_surface_share.worst"),
            cells.share("error.holes_share.mean"),
            cells.share("error.false_cover_share.mean"),
            cells.plain("error.flip_covered.mean", 4, 1.0),
            cells.plain("bytes.encoded_set", 0, 1e-3),
            cells.plain("time_ms.set.median", 0, 1.0),
            cells.plain("counts.later_images_ms_over_conventional", 2, 1.0),
        ]);
    }
    table
}

/// Conventional and the server's images at the corners, and as many as probes find to be of use.
fn left_out(report: &Report) -> Table {
    let head = ["scene", "images", "missing by surface, %", "kB", "kB saved of conventional", "ms", "of it choosing"];
    let mut table = Table::new(head.into_iter().chain(["ms saved of conventional"]));
    for scene in &report.scene {
        let sets = ["conventional", placed::ALL, placed::ENOUGH].map(|method| found(report, scene, method));
        let [Some(conventional), Some(all), Some(enough)] = sets else { continue };
        let figure = |row: &Row, path: &str| row.figure(path).unwrap_or_default();
        let ms = |row: &Row| figure(row, "time_ms.set.median") + figure(row, "time_ms.choice.median");
        let kb = |row: &Row| figure(row, "bytes.encoded_set") / 1000.0;
        let missing = |row: &Row| 100.0 * figure(row, "error.missing_by_surface_share.mean");
        let three = |of: &dyn Fn(&Row) -> f64, digits: usize| {
            [conventional, all, enough].map(|row| format!("{:.digits$}", of(row))).join(" -> ")
        };
        table.row([
            scene.clone(),
            three(&|row| figure(row, "counts.images"), 0),
            three(&missing, 2),
            three(&kb, 0),
            format!("{:.0}", kb(conventional) - kb(enough)),
            three(&ms, 0),
            format!("{:.0}", figure(enough, "time_ms.choice.median")),
            format!("{:.0}", ms(conventional) - ms(enough)),
        ]);
    }
    table
}

fn convergence(report: &Report) -> Table {
    let mut table = Table::new(["scene", "metrics", "px", "redundant 1, 2", "disoccluded 1, 2", "useful 1, 2"]);
    for row in rows(report, true) {
        let both = |what: &str| pair([1, 2].map(|image| row.figure(&format!("counts.{what}_{image}"))), None);
        let px = Cells(row).parameter("image_px");
        let what = ["redundant", "disoccluded", "useful"].map(both);
        table.row([row.scene.clone(), row.method.clone(), px].into_iter().chain(what));
    }
    table
}
