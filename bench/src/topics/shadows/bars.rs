//! What the figures must show, at the paper's own settings.

use super::methods::PAPERS;
use super::paper;
use super::sets::{PLACED, SETS};
use super::settings::{Settings, USUAL_LAMP};
use super::tables::{found, of_set, rows, text};
use crate::report::{Bar, Report, Row};

/// Images of the bars of errors, and of those of times.
const ERRORS_PX: u32 = 1024;
const TIMES_PX: u32 = 512;
/// Scenes whose errors the paper prints.
const PRINTED: [&str; 2] = ["grass", "urban"];
/// An error of the paper's set may be as many times its own.
const OF_PAPER: f64 = 2.0;
/// Scenes on which images from where they are needed must be better than those of the corners, and by how much: intensity errors.
const PLACED_AT_MOST: [(&str, f64); 2] = [("tree", 3.5), ("grass", 2.6)];
/// Such images of a lamp of this size must take no more bytes than this part of four that show all they see: two of them.
const SMALL_LAMP: f64 = 0.25;
const OF_CONVENTIONAL: f64 = 0.5;
/// A faster way may be as many times as wrong as the paper's.
const AS_WRONG: f64 = 1.1;
/// And must take this part of its time.
const OF_TIME: f64 = 1.0 / 20.0;

/// Adds the bars of what was asked for; a row that failed is a miss.
pub(super) fn add(report: &mut Report, settings: &Settings) {
    if !settings.are_the_papers() {
        report.notes.push("No bars: they are of 16 x 16 points and an output of 512 x 512.".to_owned());
        return;
    }
    let mut bars = Vec::new();
    for scene in &report.scene {
        if settings.sizes.contains(&(USUAL_LAMP, ERRORS_PX)) {
            bars.extend(of_errors(report, scene, settings));
        }
        bars.extend(of_placed(report, scene, settings));
        if settings.sizes.contains(&(USUAL_LAMP, TIMES_PX)) && PRINTED.contains(&scene.as_str()) {
            bars.push(of_time(report, scene));
        }
    }
    report.bars.extend(bars);
}

/// The paper's set against its own figure and against the other sets.
fn of_errors(report: &Report, scene: &str, settings: &Settings) -> Vec<Bar> {
    let [ours, others @ ..] = SETS;
    let is_asked_for = |set: &str| settings.sets.iter().any(|(name, _)| name == set);
    if !is_asked_for(ours) {
        return Vec::new();
    }
    let error = |set: &str| {
        of_set(report, scene, set, (USUAL_LAMP, ERRORS_PX)).and_then(|row| row.figure("error.intensity.mean"))
    };
    let mut bars = Vec::new();
    if let Some([intensity, _]) = paper::by_image(scene, ours, ERRORS_PX).filter(|_| PRINTED.contains(&scene)) {
        let what = format!("{scene}: intensity error of {ours}, twice the paper's {intensity}");
        bars.push(Bar::at_most(what, OF_PAPER * intensity, error(ours), ""));
    }
    for other in others.into_iter().filter(|other| is_asked_for(other)) {
        let what = format!("{scene}: intensity error of {ours}, that of {other}");
        // Without what it is compared with nothing is shown.
        let found = error(other).and(error(ours));
        bars.push(Bar::at_most(what, error(other).unwrap_or_default(), found, ""));
    }
    bars
}

/// Images from where probes want them.
fn of_placed(report: &Report, scene: &str, settings: &Settings) -> Vec<Bar> {
    let is_asked_for = |set: &str| settings.sets.iter().any(|(name, _)| name == set);
    let figure = |set: &str, lamp: f64, path: &str| {
        of_set(report, scene, set, (lamp, ERRORS_PX)).and_then(|row| row.figure(path))
    };
    let mut bars = Vec::new();
    if !is_asked_for(PLACED) {
        return bars;
    }
    if let Some((_, most)) = PLACED_AT_MOST.iter().find(|(name, _)| *name == scene)
        && settings.sizes.contains(&(USUAL_LAMP, ERRORS_PX))
    {
        let what = format!("{scene}: intensity error of {PLACED}");
        bars.push(Bar::at_most(what, *most, figure(PLACED, USUAL_LAMP, "error.intensity.mean"), ""));
    }
    if settings.sizes.contains(&(SMALL_LAMP, ERRORS_PX)) && is_asked_for("conventional") {
        let bytes = |set: &str| figure(set, SMALL_LAMP, "counts.bytes");
        let share = bytes(PLACED).zip(bytes("conventional")).map(|(placed, four)| placed / four);
        let what = format!("{scene}: bytes of {PLACED}, a lamp of a quarter, of four conventional images'");
        bars.push(Bar::at_most(what, OF_CONVENTIONAL, share, "share"));
    }
    bars
}

/// The fastest way that is hardly more wrong than the paper's, by its share of that one's time. Both were measured by one program on one adapter.
fn of_time(report: &Report, scene: &str) -> Bar {
    let bar = |what: &str, found| {
        Bar::at_most(format!("{scene}: shadows, {what}, of the paper's time"), OF_TIME, found, "share")
    };
    let Some(maps) = found(report, scene, (SETS[0], PAPERS), (USUAL_LAMP, TIMES_PX)) else {
        return bar("fastest way", None);
    };
    let figure = |row: &Row, path: &str| row.figure(path).unwrap_or(f64::NAN);
    let is_of_size = |row: &Row| {
        ["lamp", "image_px", "set", "build"].iter().all(|name| row.parameters.get(name) == maps.parameters.get(name))
    };
    let is_as_good = |row: &Row| {
        let errors = ["error.intensity.mean", "error.visibility.mean"];
        errors.iter().all(|path| figure(row, path) <= AS_WRONG * figure(maps, path))
    };
    let ms = |row: &Row| figure(row, "time_ms.shadows.median");
    let others = rows(report).filter(|row| row.scene == scene && text(row, "method") != PAPERS && is_of_size(row));
    let best = others.filter(|row| is_as_good(row)).min_by(|a, b| ms(a).total_cmp(&ms(b)));
    match best {
        Some(best) => bar(text(best, "method"), Some(ms(best) / ms(maps))),
        None => bar("no way keeps its errors by 10 %", None),
    }
}

#[cfg(test)]
mod tests {
    use super::super::methods::METHODS;
    use super::*;
    use crate::report::Verdict;
    use crate::spread::Spread;
    use crate::topic::Run;

    fn settings() -> Settings {
        Settings::of(&Run::new(Vec::new(), std::path::PathBuf::new()), &Default::default()).expect("the usual ones")
    }

    fn row(set: &str, method: &str, image_px: u32, [intensity, visibility, ms]: [f64; 3]) -> Row {
        let mut row = Row::new("grass", set);
        for (name, value) in [("set", set), ("method", method), ("build", "this")] {
            row.parameters.set(name, value);
        }
        row.parameters.set("image_px", image_px);
        row.parameters.set("lamp", 1.0);
        row.error.set("intensity", Spread::single(intensity));
        row.error.set("visibility", Spread::single(visibility));
        row.time_ms.set("shadows", Spread::single(ms));
        row
    }

    /// Bars of some rows of grass: what they are about, verdict, figure.
    fn bars(rows: Vec<Row>) -> Vec<(String, Verdict, Option<f64>)> {
        let mut report = Report::new("shadows", "");
        report.scene = vec!["grass".to_owned()];
        report.rows = rows;
        add(&mut report, &settings());
        report.bars.into_iter().map(|bar| (bar.what, bar.verdict, bar.found)).collect()
    }

    #[test]
    fn errors_are_held_against_the_paper_and_the_other_sets() {
        use Verdict::{Miss, Pass};
        let of = |ours: f64, peeled: Option<f64>| {
            let mut rows = vec![row("covered", "maps", 1024, [ours, 9.0, 1.0])];
            rows.push(row("conventional", "maps", 1024, [3.0, 9.0, 1.0]));
            rows.extend(peeled.map(|error| row("depth-peeling", "maps", 1024, [error, 9.0, 1.0])));
            bars(rows)[..3].iter().map(|bar| bar.1).collect::<Vec<_>>()
        };
        // The paper's intensity error is 1.71.
        assert_eq!(of(2.9, Some(4.0)), [Pass, Pass, Pass]);
        assert_eq!(of(3.41, Some(4.0)), [Pass, Miss, Pass]);
        assert_eq!(of(3.43, Some(2.0)), [Miss, Miss, Miss]);
        assert_eq!(of(2.9, None), [Pass, Pass, Miss]);
    }

    #[test]
    fn the_fastest_way_that_is_hardly_more_wrong_counts() {
        let fast = |name: &str, figures| row("covered", name, 512, figures);
        let of = |others: Vec<Row>| {
            let maps = row("covered", METHODS[0].name, 512, [2.0, 4.0, 1000.0]);
            let (what, verdict, found) = bars([vec![maps], others].concat()).pop().expect("the bar of time comes last");
            (what.contains("quick"), verdict, found)
        };
        let slow = fast("warp", [2.0, 4.0, 51.0]);
        assert_eq!(of(vec![slow.clone()]), (false, Verdict::Miss, Some(0.051)));
        assert_eq!(of(vec![slow.clone(), fast("quick", [2.19, 4.39, 50.0])]), (true, Verdict::Pass, Some(0.05)));
        assert_eq!(of(vec![slow.clone(), fast("quick", [1.0, 4.41, 9.0])]), (false, Verdict::Miss, Some(0.051)));
        assert_eq!(of(vec![slow.clone(), fast("quick", [2.21, 4.0, 9.0])]), (false, Verdict::Miss, Some(0.051)));
        assert_eq!(of(Vec::new()), (false, Verdict::Miss, None));
        // What another program measured, elsewhere or at another time, is not compared.
        let mut other = fast("quick", [1.0, 1.0, 1.0]);
        other.parameters.set("build", "another");
        assert_eq!(of(vec![slow, other]), (false, Verdict::Miss, Some(0.051)));
    }
}
