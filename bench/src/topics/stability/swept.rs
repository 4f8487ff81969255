//! A sweep: every value of a stiff parameter, and where its bounds end to hold.

use super::case::Case;
use super::check::Check;
use super::judge::{Errors, differing_share};
use super::lab::Lab;
use super::sweeps::Sweep;
use super::way::{Shown, shown};
use crate::report::plot::{Axes, Scatter, Series, draw_curves};
use crate::report::progress::Progress;
use crate::report::{Report, Row};
use crate::spread::{Better, Spread};
use crate::topic::Run;

/// The values of a sweep; quickly, its ends and where its bounds must hold.
pub fn values([first, last]: [i32; 2], holds_to: i32, quick: bool) -> Vec<i32> {
    (first..=last).filter(|decade| !quick || [first, last, holds_to].contains(decade)).collect()
}

/// Powers of ten as such, others as they are.
pub fn told(value: f64) -> String {
    let decade = value.log10().round();
    if value == 10_f64.powi(decade as i32) { format!("1e{decade}") } else { value.to_string() }
}

/// What is bounded, by the greatest that was found where it must hold, and the first decade at which it did not.
pub struct Bound {
    check: Check,
    broken_at: Option<f64>,
}

impl Bound {
    /// Of what a check asks for, whatever it found.
    pub fn new(check: Check) -> Bound {
        Bound { check: Check { found: None, ..check }, broken_at: None }
    }

    pub fn what(&self) -> &'static str {
        self.check.what
    }

    /// What was found at a value, and whether it must hold there.
    pub fn add(&mut self, (value, must_hold): (f64, bool), found: Option<f64>) {
        let Some(found) = found else { return };
        if must_hold {
            // What is no number must not be lost.
            let worst = self.check.found.unwrap_or(found);
            self.check.found = Some(if found > worst || found.is_nan() { found } else { worst });
        }
        let holds = found <= self.check.at_most;
        if self.broken_at.is_none() && !holds {
            self.broken_at = Some(value);
        }
    }

    /// Of a sweep of a parameter from a decade to where it must hold.
    pub fn tell(&self, label: &str, (parameter, [from, to]): (&str, [f64; 2]), report: &mut Report) {
        let range = format!("{label}, {parameter} from {} to {}", told(from), told(to));
        self.check.tell((&format!("{label}, bounds"), &range), report);
        if let Some(value) = self.broken_at {
            let (what, value) = (self.check.what, told(value));
            report.notes.push(format!("{label}, {parameter}: {what} are out of bounds at {value} first."));
        }
    }
}

/// Runs a sweep.
pub fn swept(
    lab: &mut Lab,
    (label, sweep): (&str, &Sweep),
    case: &dyn Fn(f64) -> Case,
    run: &Run,
    report: &mut Report,
) -> anyhow::Result<()> {
    let values = values(sweep.decades, sweep.holds_to, run.quick);
    let progress = Progress::new(format!("{label}: {}", sweep.name), values.len() as u64);
    let mut first: Option<Vec<Shown>> = None;
    let mut points: [Vec<(f64, f64)>; 3] = Default::default();
    let mut bounds = [Check::unfit, Check::holes, Check::depth, Check::mean, Check::steep, Check::alike]
        .map(|check| Bound::new(check(None)));
    for decade in values {
        let value = 10_f64.powi(decade);
        let method = format!("{} = 1e{decade}", sweep.parameter);
        progress.say(format!("{label}: {method}"));
        let found = shown(lab, &case(value));
        progress.step();
        let shown = match found {
            Ok(shown) => shown,
            Err(error) => {
                report.rows.push(Row::failed(label, &method, &error));
                continue;
            }
        };
        let errors = Errors::of(&shown);
        let parallax = Spread::of(&errors.parallax_px, Better::Lower);
        let differing = first.as_ref().filter(|_| sweep.looks_alike).map(|first| differing_share(first, &shown));
        let mut row = Row::new(label, &method);
        if let Some(parallax) = parallax {
            row.error.set("parallax_px", parallax);
            points[0].push((value, parallax.worst));
            points[1].push((value, parallax.p95));
        }
        points[2].push((value, errors.holes_share()));
        row.counts.set("inside", errors.inside as f64);
        row.counts.set("holes_share", errors.holes_share());
        row.counts.set("unfit", errors.unfit.values as f64);
        differing.into_iter().for_each(|share| row.counts.set("differing_share", share));
        report.rows.push(row);
        let (unfit, holes) = (Some(errors.unfit.values as f64), Some(errors.holes_share()));
        let found = [unfit, holes, errors.worst_px(), errors.mean_px(), errors.steep(), differing];
        let at = (value, decade <= sweep.holds_to);
        bounds.iter_mut().zip(found).for_each(|(bound, found)| bound.add(at, found));
        first.get_or_insert(shown);
    }
    // Of steep surfaces and others a sweep has one or both.
    let [depth, steep] = [2, 4].map(|check: usize| sweep.bounds_depth && bounds[check].check.found.is_some());
    let is_told = [true, sweep.bounds_depth, depth, depth, steep, sweep.looks_alike];
    let range = (sweep.parameter, [sweep.decades[0], sweep.holds_to].map(|decade| 10_f64.powi(decade)));
    let told = bounds.iter().zip(is_told).filter(|(_, is_told)| *is_told);
    told.for_each(|(bound, _)| bound.tell(label, range, report));
    let names = ["depth, worst pixel, in px", "depth, 95 of 100 pixels, in px", "share of holes"];
    let series = names.into_iter().zip(points).map(|(name, points)| Series { name: name.to_owned(), points }).collect();
    let file = format!("{label}-{}.svg", sweep.parameter).replace([' ', '/'], "-");
    let path = run.figure(report, file, format!("Errors against {}.", sweep.parameter));
    let plot =
        Scatter { title: label.to_owned(), x_label: sweep.parameter.to_owned(), y_label: "error".to_owned(), series };
    draw_curves(&plot, Axes { log_x: true, front: false }, &path)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bound_tells_its_worst_where_it_must_hold_and_where_it_breaks() {
        let mut bound = Bound::new(Check::depth(None));
        let found =
            [(1e0, Some(0.02)), (1e1, None), (1e6, Some(0.07)), (1e7, Some(0.04)), (1e8, Some(3.0)), (1e9, None)];
        found.into_iter().for_each(|(value, found)| bound.add((value, value <= 1e7), found));
        assert_eq!((bound.check.found, bound.broken_at), (Some(0.07), Some(1e8)));
        bound.add((1e3, true), Some(f64::NAN));
        bound.add((1e4, true), Some(0.01));
        let mut report = Report::new("stability", "");
        bound.tell("far", ("distance", [1e0, 1e7]), &mut report);
        assert!(report.bars[0].is_missed() && report.notes[1].contains("1e8"), "{:?}", report.notes);
    }
}
