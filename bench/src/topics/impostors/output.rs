//! Notes, tables, bars and plots of the topic.

use super::occlusion::{StabilityPlan, StabilityTable};
use super::settings::Settings;
use client::draw::occlusion::Occlusion;

use super::reflect::{CANDIDATES, DECIDED, MAPS, METHODS, PINHOLES};
use super::relief::{self, COUNTS};
use super::rough;
use super::steps::FINE_PX;
use super::times::{IMAGE_PX, OUTPUT_PX, SEARCHES};
use super::walks;
use crate::report::plot::{Scatter, Series, draw_scatter};
use crate::report::table::{Table, number, percent};
use crate::report::{Bar, Report, Row};
use crate::spread::Spread;
use crate::topic::Run;

/// Settings and notes.
pub(super) fn describe(report: &mut Report, settings: &Settings) {
    report.settings.set("output", format!("{}x{} at 60 degrees", settings.size_px.0, settings.size_px.1));
    report.settings.set("poses", settings.poses);
    report.settings.set("rays_a_pixel", if settings.one_ray { "one, on both sides" } else { "nine in the truth" });
    report.notes = [
        "Truth: rays on the CPU in f64, nine a pixel or as the settings say, two bounces at most; what a reflector shows of itself is in neither. Clients hold a conventional \
         image of the very view, so that reflections alone differ; normals are those of the wire, of 12 + 12 bits.",
        "Error: mean absolute difference of sRGB values, 0 to 1, over the pixels where the truth or the result shows the object in question: \
         of the result, those that change without its image. In a maze: over all of the reflector.",
        "depth images: the same views by pinholes of the same eye, size and field, surroundings as a cube. environment map: those, looked \
         up by direction. All other figures are of images as the server decides.",
        "Times are wall times of this machine, medians. The papers' (GeForce 8800, outputs of 1,024 x 1,024, impostors of 512 x 512) were \
         32 frames a second for reflections by fine steps of a pixel, and steps a ray 48, 31 and 22 at 1/4, 1/2 and 1 pixel for single-pole \
         impostors; in the maze 155 without coarse stepping and 27 with it.",
        "Objects shown by reliefs: a viewer stands where the scene begins; the papers draw 40 cars, 20, 10 and one at 14, 26, 51 and 219 frames a \
         second and 60 barrels at 18, in 640 x 480 pixels, reliefs of 512 x 512, with shadows.",
    ]
    .map(str::to_owned)
    .to_vec();
}

fn found<'a>(report: &'a Report, scene: &str, method: &str) -> Option<&'a Row> {
    report.rows.iter().find(|row| row.scene == scene && row.method == method)
}

fn cell(value: Option<f64>) -> String {
    value.map_or_else(|| "-".to_owned(), number)
}

/// The tables of the terminal and the page.
pub(super) fn tables(report: &mut Report) {
    let tables = [
        ("Errors of what reflectors show", errors(report)),
        ("Frame times, ms", times(report)),
        ("Mean steps of a ray (CPU)", steps_table(report)),
        ("Ways to walk, by fine steps of 1/4, 1/2 and 1 pixel", walks_table(report)),
        ("A session along the path", sessions(report)),
        ("How much of the teapot an image holds", coverage(report)),
        ("Objects shown by reliefs", reliefs(report)),
        ("Ambient occlusion while an eye goes round", occlusion_table(report)),
    ];
    report.tables =
        tables.into_iter().filter(|(_, table)| !table.is_empty()).map(|(t, table)| (t.to_owned(), table)).collect();
}

fn errors(report: &Report) -> Table {
    let headings = [
        "scene",
        "method",
        "error",
        "p95",
        "of all",
        "first order",
        "second order",
        "reflecting",
        "pixels",
        "frame ms",
        "made in ms",
        "kB",
    ];
    let mut table = Table::new(headings);
    let names = || METHODS.iter().map(|method| method.name).chain(rough::METHODS.map(|(name, _)| name));
    for row in report.rows.iter().filter(|row| names().any(|name| name == row.method)) {
        let figure = |path: &str| cell(row.figure(path));
        table.row([
            row.scene.clone(),
            row.method.clone(),
            figure("error.rgb.mean"),
            figure("error.rgb_p95.mean"),
            figure("error.rgb_reflecting.mean"),
            figure("error.rgb_first_order.mean"),
            figure("error.rgb_second_order.mean"),
            row.figure("counts.reflecting").map_or_else(|| "-".to_owned(), percent),
            figure("counts.pixels"),
            figure("time_ms.frame.median"),
            figure("time_ms.construction.median"),
            cell(row.figure("bytes.impostors").map(|bytes| bytes / 1e3)),
        ]);
    }
    table
}

fn times(report: &Report) -> Table {
    let steps = SEARCHES.map(|(name, _)| format!("steps of a {name} pixel"));
    let mut table = Table::new(
        ["scene", "what"]
            .map(str::to_owned)
            .into_iter()
            .chain(steps)
            .chain(["none", "steps a walk"].map(str::to_owned)),
    );
    for scene in &report.scene {
        for side_px in OUTPUT_PX {
            let Some(row) = found(report, scene, &format!("frame, output {side_px}x{side_px}")) else { continue };
            let by = SEARCHES.map(|(name, _)| cell(row.figure(&format!("time_ms.frame_at_{name}_px.median"))));
            let walked = SEARCHES.map(|(name, _)| cell(row.figure(&format!("counts.steps_a_walk_at_{name}_px"))));
            let rest = [cell(row.figure("time_ms.frame_without.median")), walked.join(", ")];
            table.row([scene.clone(), format!("output {side_px}")].into_iter().chain(by).chain(rest));
        }
        for side_px in IMAGE_PX {
            let name = format!("frame, single-pole image {side_px}x{side_px}");
            let Some(row) = found(report, scene, &name) else { continue };
            let made = format!("all images made in {}", cell(row.figure("time_ms.construction.median")));
            let cells =
                ["-".to_owned(), "-".to_owned(), cell(row.figure("time_ms.frame.median")), "-".to_owned(), made];
            table.row([scene.clone(), format!("image {side_px}")].into_iter().chain(cells));
        }
    }
    table
}

fn steps_table(report: &Report) -> Table {
    let headings = ["scene", "walk"].map(str::to_owned).into_iter();
    let mut table = Table::new(headings.chain(FINE_PX.map(|fine_px| format!("{fine_px} px"))));
    for row in report.rows.iter().filter(|row| row.method.starts_with("steps, ")) {
        let counts = FINE_PX.map(|fine_px| cell(row.figure(&format!("counts.steps_at_{fine_px}_px"))));
        let walk = row.method.trim_start_matches("steps, ").to_owned();
        table.row([row.scene.clone(), walk].into_iter().chain(counts));
    }
    table
}

fn walks_table(report: &Report) -> Table {
    let headings = [
        "scene",
        "walk",
        "step",
        "images",
        "error",
        "differ",
        "walks a pixel",
        "steps a pixel",
        "frame ms",
        "CPU ms",
        "of hierarchy",
    ];
    let mut table = Table::new(headings);
    let sizes = || walks::IMAGE_PX.into_iter().flat_map(|px| SEARCHES.map(|(step, _)| (px, step)));
    for (scene, (side_px, step)) in report.scene.iter().flat_map(|scene| sizes().map(move |size| (scene, size))) {
        let row = |way: &str| found(report, scene, &walks::label(way, step, side_px));
        let ms = |row: &Row| row.figure("time_ms.frame_cpu.mean").or_else(|| row.figure("time_ms.frame.median"));
        let of_hierarchy = row(walks::HIERARCHY).and_then(ms);
        for way in walks::WAYS {
            let Some(row) = row(way.name) else { continue };
            let figure = |path: &str| cell(row.figure(path));
            let ratio = ms(row).zip(of_hierarchy).map(|(ms, of_hierarchy)| ms / of_hierarchy);
            table.row([
                scene.clone(),
                way.name.to_owned(),
                step.to_owned(),
                side_px.to_string(),
                figure("error.rgb_reflecting.mean"),
                row.figure("counts.differ").map_or_else(|| "-".to_owned(), percent),
                figure("counts.walks_a_pixel"),
                figure("counts.steps_a_pixel"),
                figure("time_ms.frame.median"),
                figure("time_ms.frame_cpu.mean"),
                cell(ratio),
            ]);
        }
    }
    table
}

fn sessions(report: &Report) -> Table {
    let mut table = Table::new(["scene", "what", "seconds", "kB", "of impostors, kB", "images"]);
    for row in report.rows.iter().filter(|row| row.method.starts_with("session")) {
        let kilobytes = |path: &str| cell(row.figure(path).map(|bytes| bytes / 1e3));
        table.row([
            row.scene.clone(),
            row.method.clone(),
            cell(row.figure("counts.seconds")),
            kilobytes("bytes.session"),
            kilobytes("bytes.impostors"),
            cell(row.figure("counts.images")),
        ]);
    }
    table
}

fn reliefs(report: &Report) -> Table {
    let times = COUNTS.map(relief::column);
    let headings = ["scene", "what", "objects", "kB", "of reliefs, kB", "FLIP"].map(str::to_owned);
    let mut table = Table::new(headings.into_iter().chain(times.iter().map(|time| time.replace('_', " "))));
    for row in report.rows.iter().filter(|row| row.method.starts_with("relief")) {
        let kilobytes = |path: &str| cell(row.figure(path).map(|bytes| bytes / 1e3));
        let cells = [
            row.scene.clone(),
            row.method.clone(),
            cell(row.figure("counts.objects")),
            kilobytes("bytes.session"),
            kilobytes("bytes.reliefs"),
            cell(row.figure("error.flip_covered.mean")),
        ];
        let times = times.iter().map(|time| cell(row.figure(&format!("time_ms.{time}.median"))));
        table.row(cells.into_iter().chain(times));
    }
    table
}

fn coverage(report: &Report) -> Table {
    let mut table = Table::new(["image", "pinhole", "single pole", "times"]);
    for row in report.rows.iter().filter(|row| row.method.starts_with("coverage")) {
        let share = |path: &str| row.figure(path).map_or_else(|| "-".to_owned(), percent);
        let cells = [share("counts.covered_by_pinhole"), share("counts.covered")];
        let times = cell(row.figure("counts.covered_over_pinhole"));
        table.row([row.method.clone()].into_iter().chain(cells).chain([times]));
    }
    table
}

/// What the figures must show.
pub(super) fn bars(report: &mut Report) {
    let mut bars = Vec::new();
    for scene in &report.scene {
        let error = |method: &str| found(report, scene, method).and_then(|row| row.figure("error.rgb.mean"));
        let [ours, images, maps] = [DECIDED, PINHOLES, MAPS].map(error);
        let parameters = found(report, scene, DECIDED).map(|row| &row.parameters);
        let by_graphs = parameters.and_then(|all| all.get("graph_cameras")).is_some_and(|value| value == true);
        let mut bar = |what: &str, at_most: Option<f64>| {
            if let Some(at_most) = at_most {
                bars.push(Bar::at_most(format!("{scene}: {what}"), at_most, ours, ""));
            }
        };
        if by_graphs {
            bar("error by graph cameras, the environment map's", maps);
        } else {
            bar("error by single-pole images, half of depth images'", images.map(|error| error / 2.0));
            bar("error by single-pole images, a quarter of environment maps'", maps.map(|error| error / 4.0));
        }
        bars.extend(order_bars(report, scene));
        bars.extend(candidates(report, scene));
        if let Some(row) = found(report, scene, "session, nothing reflects") {
            let what = format!("{scene}: bytes of impostors where nothing reflects");
            bars.push(Bar::at_most(what, 0.0, row.figure("bytes.impostors"), "B"));
        }
    }
    report.bars.extend(bars);
}

/// Over all that reflects: at most half of depth images' and a quarter of environment maps' error, in each order that the scene shows.
fn order_bars(report: &Report, scene: &str) -> Vec<Bar> {
    let mut bars = Vec::new();
    for (order, path) in [("first", "error.rgb_first_order.mean"), ("second", "error.rgb_second_order.mean")] {
        let error = |method: &str| found(report, scene, method).and_then(|row| row.figure(path));
        let [ours, images, maps] = [DECIDED, PINHOLES, MAPS].map(error);
        for (what, at_most) in [
            ("half of depth images'", images.map(|error| error / 2.0)),
            ("a quarter of environment maps'", maps.map(|error| error / 4.0)),
        ] {
            let label = format!("{scene}: {order} order error over reflecting pixels, {what}");
            bars.extend(at_most.map(|at_most| Bar::at_most(label, at_most, ours, "")));
        }
    }
    bars
}

/// Bars of what was decided, beside what else might have been.
fn candidates(report: &Report, scene: &str) -> Vec<Bar> {
    let figure = |method: &str, path: &str| found(report, scene, method).and_then(|row| row.figure(path));
    let error = |method: &str| figure(method, "error.rgb_reflecting.mean");
    let others = || CANDIDATES.iter().filter_map(|method| error(method));
    let ours = error(DECIDED);
    let Some(best) = others().chain(ours).min_by(f64::total_cmp) else { return Vec::new() };
    if others().next().is_none() {
        return Vec::new();
    }
    let mut bars = vec![Bar::at_most(
        format!("{scene}: error of what is decided, 1.05 of the least of all candidates at equal bytes"),
        1.05 * best,
        ours,
        "",
    )];
    let is_corridor = found(report, scene, DECIDED).and_then(|row| row.parameters.get("graph_cameras")).cloned();
    if is_corridor.is_some_and(|value| value == true) {
        let [six, bent] = [CANDIDATES[0], CANDIDATES[1]];
        let what = format!("{scene}: error of six images bent round corners, that of six images at equal bytes");
        bars.extend(error(six).map(|error_of_six| Bar::at_most(what, error_of_six, error(bent), "")));
        let [of_six, of_bent] = [six, bent].map(|method| figure(method, "time_ms.construction.median"));
        let what = format!("{scene}: time to make them, five times as long");
        bars.extend(of_six.map(|of_six| Bar::at_most(what, 5.0 * of_six, of_bent, "ms")));
    }
    bars
}

/// The name of a row of ambient occlusion.
fn occlusion_name(occlusion: Occlusion) -> Option<&'static str> {
    match occlusion {
        Occlusion::None => None,
        Occlusion::Plain => Some("occlusion, view's z-buffer"),
        Occlusion::Graph => Some("occlusion, graph z-buffers"),
    }
}

/// Rows and bars of ambient occlusion while the eye moves.
pub(super) fn occlusion(scene: &str, found: &StabilityTable, plan: &StabilityPlan, report: &mut Report) {
    for measured in &found.rows {
        let Some(name) = occlusion_name(measured.occlusion) else { continue };
        let mut row = Row::new(scene, name);
        row.parameters.set("poses", plan.poses);
        row.error.set("deviation", Spread::single(measured.deviation));
        row.error.set("traced", Spread::single(measured.error));
        row.time_ms.set("frame", Spread::single(measured.frame_ms));
        row.counts.set("points", found.points as f64);
        report.rows.push(row);
    }
    let figure = |wanted: Occlusion| found.rows.iter().find(|row| row.occlusion == wanted);
    let (plain, graph) = (figure(Occlusion::Plain), figure(Occlusion::Graph));
    if let (Some(plain), Some(graph)) = (plain, graph) {
        let half = format!("{scene}: deviation of occlusion by graph cameras, half of the view's own");
        report.bars.push(Bar::at_most(half, plain.deviation / 2.0, Some(graph.deviation), ""));
        let nearer = format!("{scene}: error of occlusion by graph cameras, the view's own");
        report.bars.push(Bar::at_most(nearer, plain.error, Some(graph.error), ""));
    }
}

fn occlusion_table(report: &Report) -> Table {
    let mut table = Table::new(["scene", "occlusion", "deviation over poses", "off traced", "points", "frame ms"]);
    for row in report.rows.iter().filter(|row| row.method.starts_with("occlusion")) {
        let figures = ["error.deviation.mean", "error.traced.mean", "counts.points", "time_ms.frame.median"];
        let cells = figures.map(|path| cell(row.figure(path)));
        table.row([row.scene.clone(), row.method.clone()].into_iter().chain(cells));
    }
    table
}

/// Error against run time.
pub(super) fn plot(label: &str, run: &Run, report: &mut Report) -> anyhow::Result<()> {
    let rows = report.rows.iter().filter(|row| row.scene == label);
    let series = rows.filter_map(|row| {
        let point = (row.figure("time_ms.frame.median")?, row.figure("error.rgb.mean")?);
        Some(Series { name: row.method.clone(), points: vec![point] })
    });
    let plot = Scatter {
        title: format!("{label}: error of what reflectors show"),
        x_label: "client frame, ms (median)".to_owned(),
        y_label: "mean absolute RGB error".to_owned(),
        series: series.collect(),
    };
    let caption = format!("{label}: error against a client's frame time, every method, with the Pareto front.");
    let path = run.figure(report, format!("{label}-error-time.svg"), caption);
    draw_scatter(&plot, &path)
}
