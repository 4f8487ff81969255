//! How frame times grow with the number of triangles, against drawing the maps straight from the full geometry (Fig. 9 of the paper).
//!
//! A meadow keeps its size and gets more blades. A frame of a set is all three steps; one of the full geometry, which is on the adapter
//! already, is the maps of all points with their lookups.

use super::bench::Bench;
use super::cell::FULL_GEOMETRY;
use super::paper::CROSSOVER_TRIANGLES;
use super::subject::Subject;
use crate::report::plot::{Axes, Scatter, Series, draw_curves};
use crate::report::progress::Progress;
use crate::report::table::{Table, number};
use crate::report::{Report, Row};

/// The parameter that marks rows of this part.
const MARK: &str = "blades";

/// Measures every meadow.
pub(super) fn measure(bench: &mut Bench<'_>, report: &mut Report) {
    for blades in bench.settings.blades.clone() {
        let name = format!("grass-{blades}-blades");
        if let Err(error) = meadow(bench, (&name, blades), report) {
            report.rows.push(Row::failed(&name, "all", &error));
        }
    }
}

fn meadow(bench: &mut Bench<'_>, (name, blades): (&str, u32), report: &mut Report) -> anyhow::Result<()> {
    let cells = bench.settings.growth_cells(name);
    let progress = Progress::new(format!("{name}: frame times"), cells.len() as u64);
    let mut subject: Option<Subject> = None;
    for cell in cells {
        let key = cell.key("times", name, &bench.machine, &bench.settings);
        let row = match bench.resumed(&key) {
            Some(row) => Ok(row),
            None => {
                let subject = match &mut subject {
                    Some(subject) => subject,
                    None => subject.insert(bench.subject(name)?),
                };
                progress.say(format!("{name}: frame times, {}", cell.label()));
                let is_full = cell.set == FULL_GEOMETRY;
                let row = if is_full { subject.full_geometry(&cell) } else { subject.timed(&cell) };
                row.and_then(|row| bench.keep(&key, row))
            }
        };
        let mut row = row.unwrap_or_else(|error| Row::failed(name, &cell.label(), &error));
        row.parameters.set(MARK, blades);
        report.rows.push(row);
        progress.step();
    }
    Ok(())
}

/// Whether a row is of this part.
pub(super) fn is_of(row: &Row) -> bool {
    row.parameters.get(MARK).is_some()
}

/// (triangles, frame time in ms) by methods, in the order of the rows.
fn curves(report: &Report) -> Vec<Series> {
    let mut curves: Vec<Series> = Vec::new();
    for row in report.rows.iter().filter(|row| is_of(row)) {
        let (Some(triangles), Some(ms)) = (row.figure("counts.triangles"), row.figure("time_ms.all.median")) else {
            continue;
        };
        match curves.iter_mut().find(|series| series.name == row.method) {
            Some(series) => series.points.push((triangles, ms)),
            None => curves.push(Series { name: row.method.clone(), points: vec![(triangles, ms)] }),
        }
    }
    curves.iter_mut().for_each(|series| series.points.sort_by(|a, b| a.0.total_cmp(&b.0)));
    curves
}

/// Where the maps of the full geometry become slower than a method.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Crossover {
    /// At this number of triangles, between two that were measured.
    At(f64),
    /// They are slower with the fewest triangles already, this many.
    Before(f64),
    /// They are not slower with the most triangles, this many.
    Beyond(f64),
}

/// From (triangles, frame time) by growing triangles; where the order changes more than once, beyond the last change. Between two
/// measurements both times are taken to grow as powers of the number. `None` without a number that both were measured at.
pub(super) fn crossover(method: &[(f64, f64)], full: &[(f64, f64)]) -> Option<Crossover> {
    // Logarithms of how many triangles there are, and of how much slower the full geometry is.
    let both = method.iter().filter_map(|(triangles, ms)| {
        let (_, full_ms) = full.iter().find(|(of, _)| of == triangles)?;
        Some((triangles.ln(), (full_ms / ms).ln()))
    });
    let both: Vec<(f64, f64)> = both.collect();
    let (first, last) = (both.first()?, both.last()?);
    if last.1 <= 0.0 {
        return Some(Crossover::Beyond(last.0.exp().round()));
    }
    let Some(below) = both.iter().rposition(|(_, slower)| *slower <= 0.0) else {
        return Some(Crossover::Before(first.0.exp().round()));
    };
    let (a, b) = (both[below], both[below + 1]);
    Some(Crossover::At((a.0 + (b.0 - a.0) * -a.1 / (b.1 - a.1)).exp()))
}

/// Frame times by triangles, and where the order changes.
pub(super) fn tables(report: &mut Report) {
    let curves = curves(report);
    let Some(full) = curves.iter().find(|series| series.name == FULL_GEOMETRY).map(|series| series.points.clone())
    else {
        return;
    };
    let mut times = Table::new(["triangles".to_owned()].into_iter().chain(curves.iter().map(|s| s.name.clone())));
    let mut triangles: Vec<f64> = curves.iter().flat_map(|series| series.points.iter().map(|p| p.0)).collect();
    triangles.sort_by(f64::total_cmp);
    triangles.dedup();
    for count in triangles {
        let at = |series: &Series| series.points.iter().find(|p| p.0 == count).map_or("-".to_owned(), |p| number(p.1));
        times.row([number(count)].into_iter().chain(curves.iter().map(at)));
    }
    let mut orders = Table::new(["method", "slower than it are maps of the full geometry", "paper"]);
    for series in curves.iter().filter(|series| series.name != FULL_GEOMETRY) {
        let found = match crossover(&series.points, &full) {
            Some(Crossover::At(count)) => format!("beyond {} triangles", number(count.round())),
            Some(Crossover::Before(count)) => format!("with {} triangles already", number(count)),
            Some(Crossover::Beyond(count)) => format!("never up to {} triangles", number(count)),
            None => "not measured".to_owned(),
        };
        orders.row([series.name.clone(), found, format!("beyond {}", number(CROSSOVER_TRIANGLES))]);
    }
    report.tables.push(("A meadow with more and more blades (Fig. 9): all steps of a frame, ms".to_owned(), times));
    report.tables.push(("From where on sets are faster than the full geometry".to_owned(), orders));
}

/// The paper's Figure 9.
pub(super) fn plot(bench: &Bench<'_>, report: &mut Report) -> anyhow::Result<()> {
    let series = curves(report);
    if series.is_empty() {
        return Ok(());
    }
    let plot = Scatter {
        title: "A meadow: frame time by the number of triangles".to_owned(),
        x_label: "triangles".to_owned(),
        y_label: "frame time, ms".to_owned(),
        series,
    };
    let caption = "Frame time by the number of triangles; full geometry: its maps from all points, with their lookups.";
    let path = bench.run.figure(report, "growth.svg", caption);
    draw_curves(&plot, Axes { log_x: true, front: false }, &path)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_crossover_lies_where_powers_meet() {
        // 100 ms against 1 ms a thousand triangles: they meet at 100,000.
        let full: Vec<(f64, f64)> = [10e3, 40e3, 160e3].map(|count| (count, count / 1000.0)).to_vec();
        let method: Vec<(f64, f64)> = full.iter().map(|(count, _)| (*count, 100.0)).collect();
        let Some(Crossover::At(count)) = crossover(&method, &full) else { panic!("they cross") };
        assert!((count - 100e3).abs() < 1e-3, "{count}");
        // Only numbers that both were measured at count.
        assert_eq!(crossover(&method[..2], &full), Some(Crossover::Beyond(40e3)));
        assert_eq!(crossover(&[(10e3, 1.0), (40e3, 1.0)], &full), Some(Crossover::Before(10e3)));
        assert_eq!(crossover(&[(11e3, 1.0)], &full), None);
    }

    #[test]
    fn the_last_change_of_the_order_counts() {
        let full = [(1e3, 2.0), (2e3, 1.0), (4e3, 1.0), (8e3, 4.0)];
        let method = [(1e3, 1.0), (2e3, 2.0), (4e3, 2.0), (8e3, 2.0)];
        let Some(Crossover::At(count)) = crossover(&method, &full) else { panic!("they cross") };
        assert!((count / 4e3 - 2f64.sqrt()).abs() < 1e-9, "{count}");
    }
}
