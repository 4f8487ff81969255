//! The table and the bars of motions.

use super::arguments::Arguments;
use super::outcome::Who;
use super::setup::Network;
use crate::motion::Motion;
use crate::report::table::{Table, number};
use crate::report::{Bar, Report, Row};

/// The figures of a part of a motion.
pub struct PartRow {
    /// Whose it is.
    pub who: Who,
    /// Of the motion.
    pub part: String,
    /// Over which network.
    pub network: Network,
    /// The figures.
    pub row: Row,
}

impl PartRow {
    fn is_without_delay(&self) -> bool {
        self.network.link == network::Link::default()
    }
}

/// A second after stopping: FLIP over covered pixels against the plain truth, and of antialiased pictures against the smooth one.
const AT_REST: f64 = 0.012;
const AT_REST_SMOOTH: f64 = 0.02;
/// As a multiple of the same run without delay: scenes that move, at rest; and the second round of an orbit.
const TO_NO_DELAY: f64 = 1.3;
/// Of covered pixels, in any frame after a first round.
const FLICK_HOLES: f64 = 0.015;

/// What a reader must know of motions.
pub fn describe(report: &mut Report, arguments: &Arguments) {
    report.settings.set("motion", motion_names(arguments));
    report.settings.set("orbit_s", arguments.orbit_s);
    if let Some(time_s) = arguments.held_at {
        report.settings.set("held_at_s", time_s);
    }
    report.notes.push(
        "Motions are scored in neighbouring frames: two of ten, more of a flick, and those that are named at rest. In motions.csv is a line \
         for each part."
            .to_owned(),
    );
    report.notes.push(
        "predicted_off: where the server's predictor expected the eye, by the poses it had heard over this network, against where it was in \
         the middle of the time for which what was made for it is shown. Age: scene time when a picture was drawn, less that of the newest \
         update in it."
            .to_owned(),
    );
    report.notes.push(
        "bytes_after_1_s_of_rest: of updates that the server sent from a second after stopping to the end. Mbit/s are those of the whole \
         motion. A row without delay is the same motion over a link without round trip."
            .to_owned(),
    );
}

fn motion_names(arguments: &Arguments) -> String {
    let names: Vec<_> =
        arguments.motion.iter().flat_map(|motions| motions.iter()).map(|motion| motion.name()).collect();
    names.join(", ")
}

/// Adds the rows of a scene's motion to the report, with their table and bars.
pub fn show(report: &mut Report, label: &str, motion: Motion, rows: Vec<PartRow>) {
    if rows.is_empty() {
        return;
    }
    report.tables.push((format!("{label}: {}", motion.name()), table(&rows)));
    report.bars.extend(bars(label, &rows));
    report.rows.extend(rows.into_iter().map(|row| row.row));
}

fn table(rows: &[PartRow]) -> Table {
    let mut table = Table::new([
        "motion",
        "network",
        "system",
        "FLIP",
        "covered",
        "p95",
        "worst",
        "band",
        "16x covered",
        "16x band",
        "holes %",
        "worst %",
        "false cover %",
        "flicker",
        "off m",
        "off deg",
        "age p95 ms",
        "Mbit/s",
        "B after 1 s",
    ]);
    for PartRow { part, network, row, .. } in rows {
        let figure = |path: &str, decimals: usize, factor: f64| {
            row.figure(path).map_or(String::new(), |value| format!("{:.decimals$}", value * factor))
        };
        table.row([
            part.clone(),
            network.name.clone(),
            row.method.clone(),
            figure("error.flip.mean", 4, 1.0),
            figure("error.flip_covered.mean", 4, 1.0),
            figure("error.flip_covered.p95", 4, 1.0),
            figure("error.flip_covered.worst", 4, 1.0),
            figure("error.flip_band.mean", 4, 1.0),
            figure("error.flip_16x_covered.mean", 4, 1.0),
            figure("error.flip_16x_band.mean", 4, 1.0),
            figure("error.holes_share.mean", 3, 100.0),
            figure("error.holes_share.worst", 3, 100.0),
            figure("error.false_cover_share.mean", 3, 100.0),
            figure("error.flicker.mean", 2, 1.0),
            row.figure("error.predicted_off_m.mean").map_or(String::new(), number),
            figure("error.predicted_off_deg.mean", 2, 1.0),
            figure("error.age_ms.p95", 0, 1.0),
            figure("counts.mbit_s", 2, 1.0),
            figure("counts.bytes_after_1_s_of_rest", 0, 1.0),
        ]);
    }
    table
}

/// The figures that are kept: a name a path.
const SUMMARY: [(&str, &str); 24] = [
    ("flip", "error.flip.mean"),
    ("flip_covered", "error.flip_covered.mean"),
    ("flip_covered_p95", "error.flip_covered.p95"),
    ("flip_covered_worst", "error.flip_covered.worst"),
    ("flip_band", "error.flip_band.mean"),
    ("flip_band_worst", "error.flip_band.worst"),
    ("flip_16x_covered", "error.flip_16x_covered.mean"),
    ("flip_16x_covered_worst", "error.flip_16x_covered.worst"),
    ("flip_16x_band", "error.flip_16x_band.mean"),
    ("psnr_db", "error.psnr_db.mean"),
    ("holes_share", "error.holes_share.mean"),
    ("holes_share_worst", "error.holes_share.worst"),
    ("false_cover_share", "error.false_cover_share.mean"),
    ("flicker", "error.flicker.mean"),
    ("predicted_off_m", "error.predicted_off_m.mean"),
    ("predicted_off_deg", "error.predicted_off_deg.mean"),
    ("predicted_off_deg_p95", "error.predicted_off_deg.p95"),
    ("age_ms_median", "error.age_ms.median"),
    ("age_ms_p95", "error.age_ms.p95"),
    ("age_ms_worst", "error.age_ms.worst"),
    ("mbit_s", "counts.mbit_s"),
    ("bytes_after_1_s_of_rest", "counts.bytes_after_1_s_of_rest"),
    ("samples_held", "counts.samples_held"),
    ("frames", "counts.frames"),
];

/// A line a part of a motion, with the figures that are compared between one state of the program and another.
pub fn summary(rows: &[Row]) -> Table {
    let mut table =
        Table::new(["scene", "motion", "network", "system"].into_iter().chain(SUMMARY.map(|(name, _)| name)));
    for row in rows {
        let parameter =
            |name: &str| row.parameters.get(name).and_then(|value| value.as_str()).unwrap_or_default().to_owned();
        let figure = |(_, path): (&str, &str)| row.figure(path).map_or(String::new(), |value| format!("{value:.6}"));
        let named = [row.scene.clone(), parameter("motion"), parameter("network"), row.method.clone()];
        table.row(named.into_iter().chain(SUMMARY.map(figure)));
    }
    table
}

/// What motions must reach, misses included.
fn bars(label: &str, rows: &[PartRow]) -> Vec<Bar> {
    let mut bars = Vec::new();
    let antialias = rows.iter().any(|row| row.row.parameters.get("antialias").is_some());
    let measure = if antialias { "error.flip_16x_covered.mean" } else { "error.flip_covered.mean" };
    for ours in rows.iter().filter(|row| row.who == Who::Ours && !row.is_without_delay()) {
        let what = |what: &str| format!("{label}, {}, {}: {what}", ours.part, ours.network.name);
        let flip = ours.row.figure(measure);
        let same = |other: &&PartRow| other.part == ours.part;
        let without_delay = rows.iter().filter(same).find(|row| row.who == Who::Ours && row.is_without_delay());
        let of_no_delay = without_delay.and_then(|row| Some(flip? / row.row.figure(measure)?));
        let at_rest = ours.part == "rest, after 1 s";
        if ours.part == "orbit, round 2" || (at_rest && without_delay.is_some()) {
            bars.push(Bar::at_most(what("FLIP covered, of that without delay"), TO_NO_DELAY, of_no_delay, ""));
        } else if at_rest {
            let at_most = if antialias { AT_REST_SMOOTH } else { AT_REST };
            bars.push(Bar::at_most(what("FLIP covered"), at_most, flip, ""));
            let bytes = ours.row.figure("counts.bytes_after_1_s_of_rest");
            bars.push(Bar::at_most(what("sent after that"), 0.0, bytes, "bytes"));
        }
        if ours.part == "flick" {
            let holes = ours.row.figure("error.holes_share.worst");
            bars.push(Bar::at_most(what("worst holes"), FLICK_HOLES, holes, "share"));
        }
        let videos = rows.iter().filter(same).filter(|row| row.who == Who::Video && row.network == ours.network);
        for video in videos.filter_map(|video| video.row.figure(measure)) {
            bars.push(Bar::at_most(what("FLIP covered against video of the same bytes"), video, flip, ""));
        }
    }
    bars
}
