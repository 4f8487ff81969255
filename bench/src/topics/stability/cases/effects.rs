//! A sweep of a parameter of an effect: every decade judged as a case is, and the worst of each bound.

use crate::report::progress::Progress;
use crate::report::{Report, Row};
use crate::topics::stability::check::Check;
use crate::topics::stability::lab::Lab;
use crate::topics::stability::swept::{Bound, told};

/// What is swept.
pub struct Effect {
    pub name: &'static str,
    /// With its unit.
    pub parameter: &'static str,
    /// Bounds must hold at all of them.
    pub values: &'static [f64],
    pub judge: fn(&mut Lab, f64) -> anyhow::Result<Vec<Check>>,
}

impl Effect {
    /// Runs it; quickly, its ends alone.
    pub fn swept(&self, lab: &mut Lab, quick: bool, report: &mut Report) {
        let [first, .., last] = self.values else { return };
        let values: Vec<f64> = if quick { vec![*first, *last] } else { self.values.to_vec() };
        let progress = Progress::new(self.name, values.len() as u64);
        let mut bounds: Vec<Bound> = Vec::new();
        for value in values {
            let method = format!("{} = {}", self.parameter, told(value));
            progress.say(format!("{}: {method}", self.name));
            match (self.judge)(lab, value) {
                Ok(checks) => {
                    let mut row = Row::new(self.name, &method);
                    for check in checks {
                        check.found.into_iter().for_each(|found| row.counts.set(check.what, found));
                        let found = check.found;
                        let known = bounds.iter().position(|bound| bound.what() == check.what);
                        let place = known.unwrap_or_else(|| {
                            bounds.push(Bound::new(check));
                            bounds.len() - 1
                        });
                        bounds[place].add((value, true), found);
                    }
                    report.rows.push(row);
                }
                Err(error) => report.rows.push(Row::failed(self.name, &method, &error)),
            }
            progress.step();
        }
        bounds.iter().for_each(|bound| bound.tell(self.name, (self.parameter, [*first, *last]), report));
    }
}
