//! Tables of the topic, with the paper's figures beside ours.

use super::bench::Bench;
use super::growth;
use super::methods::{METHODS, PAPERS, SAME_MAPS};
use super::paper;
use super::settings::Settings;
use super::settings::USUAL_LAMP;
use crate::report::table::{Table, number};
use crate::report::{Report, Row};

/// What a row says of itself.
pub(super) fn text<'a>(row: &'a Row, name: &str) -> &'a str {
    row.parameters.get(name).and_then(|value| value.as_str()).unwrap_or_default()
}

/// The same, a number.
pub(super) fn parameter(row: &Row, name: &str) -> f64 {
    row.parameters.get(name).and_then(|value| value.as_f64()).unwrap_or(f64::NAN)
}

/// Rows of scenes that did not fail, without those of growth.
pub(super) fn rows(report: &Report) -> impl Iterator<Item = &Row> {
    report.rows.iter().filter(|row| row.failed.is_none() && !growth::is_of(row))
}

/// The row of a set, drawn in a way, with a lamp and images of some size.
pub(super) fn found<'a>(
    report: &'a Report,
    scene: &str,
    (set, method): (&str, &str),
    (lamp, image_px): (f64, u32),
) -> Option<&'a Row> {
    rows(report).find(|row| {
        let is_of_size = parameter(row, "lamp") == lamp && parameter(row, "image_px") == f64::from(image_px);
        row.scene == scene && text(row, "set") == set && text(row, "method") == method && is_of_size
    })
}

/// The row of a set with a lamp and images of some size that tells the errors of the set itself: the paper's, or that of the same maps
/// drawn in another way, which differ from them by what quads differ from parallelograms.
pub(super) fn of_set<'a>(report: &'a Report, scene: &str, set: &str, size: (f64, u32)) -> Option<&'a Row> {
    [PAPERS, SAME_MAPS].iter().find_map(|method| found(report, scene, (set, method), size))
}

fn cell(found: Option<f64>, paper: Option<f64>) -> String {
    let found = found.map_or("-".to_owned(), number);
    paper.map_or(found.clone(), |paper| format!("{found} (paper {paper})"))
}

/// All of them.
pub(super) fn add(report: &mut Report, bench: &Bench<'_>) {
    let settings = &bench.settings;
    let mut tables = vec![
        ("Errors by the size of the images (Table 3)", by_size(report, settings, Changing::Images)),
        ("Errors by the size of the lamp (Table 4)", by_size(report, settings, Changing::Lamp)),
        ("Steps of the paper's algorithm, ms (Table 5)", steps(report, settings)),
        ("Every way of drawing", every_way(report, settings)),
    ];
    tables.retain(|(_, table)| !table.is_empty());
    report.tables.extend(tables.into_iter().map(|(title, table)| (title.to_owned(), table)));
    growth::tables(report);
}

/// What changes from row to row.
#[derive(Clone, Copy, PartialEq)]
enum Changing {
    Images,
    Lamp,
}

/// Errors of the sets.
fn by_size(report: &Report, settings: &Settings, changing: Changing) -> Table {
    let size = if changing == Changing::Images { "images" } else { "lamp" };
    let head = ["scene", size, "set", "intensity", "visibility", "greatest intensity"];
    let mut table = Table::new(head.into_iter().chain([
        "by rays: intensity",
        "visibility",
        "images",
        "samples",
        "bytes",
        "drawn by",
    ]));
    let mut sizes: Vec<(f64, u32)> = settings.sizes.clone();
    sizes.retain(|(lamp, image_px)| match changing {
        Changing::Images => *lamp == USUAL_LAMP,
        Changing::Lamp => *image_px == settings.usual_px,
    });
    sizes.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    // One lamp alone is in the table of images.
    if changing == Changing::Lamp && sizes.len() < 2 {
        return table;
    }
    for (scene, &(lamp, image_px)) in report.scene.iter().flat_map(|scene| sizes.iter().map(move |size| (scene, size)))
    {
        for (set, _) in &settings.sets {
            let Some(row) = of_set(report, scene, set, (lamp, image_px)) else { continue };
            let figure = |path: &str| row.figure(path);
            let paper = match changing {
                Changing::Images => paper::by_image(scene, set, image_px),
                Changing::Lamp => paper::by_lamp(scene, set, lamp),
            };
            let paper = paper.filter(|_| settings.are_the_papers());
            let is_papers = settings.are_the_papers() && lamp == USUAL_LAMP && image_px == 1024;
            let greatest = paper::of(scene, set).filter(|_| is_papers).map(|(paper, set)| paper.greatest[set]);
            let size = if changing == Changing::Images { image_px.to_string() } else { lamp.to_string() };
            table.row([
                scene.clone(),
                size,
                set.clone(),
                cell(figure("error.intensity.mean"), paper.map(|[intensity, _]| intensity)),
                cell(figure("error.visibility.mean"), paper.map(|[_, visibility]| visibility)),
                cell(figure("error.intensity.worst"), greatest),
                cell(figure("error.intensity_rays.mean"), None),
                cell(figure("error.visibility_rays.mean"), None),
                cell(figure("counts.images"), None),
                cell(figure("counts.samples"), None),
                cell(figure("counts.bytes"), None),
                text(row, "method").to_owned(),
            ]);
        }
    }
    table
}

fn steps(report: &Report, settings: &Settings) -> Table {
    let mut table = Table::new(["scene", "set", "images px", "images", "surfaces", "shadows", "all"]);
    for (scene, (set, _)) in report.scene.iter().flat_map(|scene| settings.sets.iter().map(move |set| (scene, set))) {
        let size = (USUAL_LAMP, settings.usual_px);
        let Some(row) = found(report, scene, (set, PAPERS), size) else { continue };
        let is_papers = settings.are_the_papers() && settings.usual_px == 1024;
        let paper = paper::of(scene, set).filter(|_| is_papers).map(|(paper, set)| paper.steps_ms[set]);
        let step = |index: usize, name: &str| {
            cell(row.figure(&format!("time_ms.{name}.median")), paper.map(|steps| steps[index]))
        };
        let all = cell(row.figure("time_ms.all.median"), paper.map(|steps| steps.iter().sum()));
        let cells = [step(0, "images"), step(1, "surfaces"), step(2, "shadows"), all];
        table.row([scene.clone(), set.clone(), settings.usual_px.to_string()].into_iter().chain(cells));
    }
    table
}

fn every_way(report: &Report, settings: &Settings) -> Table {
    let head = ["scene", "set", "way", "images", "lamp", "intensity", "visibility", "greatest intensity"];
    let mut table = Table::new(head.into_iter().chain(["shadows, ms", "of maps' time", "all, ms", "resumed"]));
    for row in rows(report) {
        let (set, way) = (text(row, "set"), text(row, "method"));
        let size = (parameter(row, "lamp"), parameter(row, "image_px") as u32);
        let ms = |row: &Row| row.figure("time_ms.shadows.median");
        let maps = found(report, &row.scene, (set, PAPERS), size).and_then(ms);
        let ratio = ms(row).zip(maps).map(|(own, maps)| own / maps);
        let is_resumed = row.parameters.get("resumed").is_some_and(|value| value == true);
        let resumed = format!("{}, {:.10}", text(row, "measured"), text(row, "commit"));
        table.row([
            row.scene.clone(),
            set.to_owned(),
            way.to_owned(),
            size.1.to_string(),
            size.0.to_string(),
            cell(row.figure("error.intensity.mean"), None),
            cell(row.figure("error.visibility.mean"), None),
            cell(row.figure("error.intensity.worst"), None),
            cell(ms(row), None),
            cell(ratio, None),
            cell(row.figure("time_ms.all.median"), None),
            if is_resumed { resumed } else { "no".to_owned() },
        ]);
    }
    // The paper's alone is in the tables before.
    if settings.ways.len() == 1 && settings.ways[0].name == METHODS[0].name { Table::default() } else { table }
}
