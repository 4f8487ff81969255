//! What a case must keep, what was found, and how much of it that is.

use super::judge::{DEPTH_PX, Errors};
use crate::report::{Bar, Report, Row};

/// A figure with its bound.
#[derive(Debug, Clone)]
pub struct Check {
    pub what: &'static str,
    pub at_most: f64,
    /// `None` where there is nothing to judge, which is a miss.
    pub found: Option<f64>,
    pub unit: &'static str,
    /// Where the bound comes from.
    pub from: &'static str,
}

/// Of the pixels of a picture that must look like another one: an edge that runs through a pixel's middle falls to either side.
const ALIKE_SHARE: f64 = 0.001;
/// Of the pixels inside of surfaces.
const HOLES_SHARE: f64 = 0.001;
/// See [`Check::colours`].
const COLOURS: f64 = 4.0;

impl Check {
    pub fn new(
        what: &'static str,
        (at_most, found): (f64, Option<f64>),
        unit: &'static str,
        from: &'static str,
    ) -> Check {
        Check { what, at_most, found, unit, from }
    }

    pub fn unfit(found: Option<f64>) -> Check {
        let from = "whatever is drawn, every float of every buffer is a number, and no depth lies below 0";
        Check::new("values of buffers that are unfit", (0.0, found), "", from)
    }

    pub fn holes(found: Option<f64>) -> Check {
        let from = "samples of one surface share the corners between them, so none may gape; a thousandth is left to what hides itself within a pixel";
        Check::new("holes inside of surfaces", (HOLES_SHARE, found), "share", from)
    }

    pub fn depth(found: Option<f64>) -> Check {
        let from = "half a step of inverse depth, whose whole moves a sample by a tenth of a pixel for an eye at the rim, and, chosen, as much again for \
                    corners between samples, whose planes come from normals of 8 + 8 bits";
        Check::new("depths inside of surfaces", (DEPTH_PX, found), "px", from)
    }

    /// [`Check::depth`], or where the near plane is so near that 16 bits are coarser, what they leave.
    pub fn depth_of(errors: &Errors) -> Check {
        let found = errors.worst_px();
        if errors.finest_px <= DEPTH_PX {
            return Check::depth(found);
        }
        let from = "half a step of the finest depth that 16 bits have from the near plane on, for an eye at the rim, and, chosen, as much again";
        Check::new("depths inside of surfaces", (errors.finest_px, found), "px", from)
    }

    /// Samples stay held while a viewer walks on, so servers take steps for an eye four times as far away: a code moves a sample by a fortieth of a pixel.
    pub fn mean(found: Option<f64>) -> Check {
        let from = "half a step of inverse depth as servers plan it, for an eye four times as far away: surfaces of one depth are rounded alike, others to both sides";
        Check::new("mean of depths inside of surfaces", (DEPTH_PX / 8.0, found), "px", from)
    }

    /// [`Check::mean`], or what 16 bits leave from the near plane on where that is coarser.
    fn mean_of(errors: &Errors) -> Check {
        let found = errors.mean_px();
        if errors.finest_px <= DEPTH_PX / 4.0 {
            return Check::mean(found);
        }
        let from = "half a step of the finest depth that 16 bits have from the near plane on";
        Check::new("mean of depths inside of surfaces", (errors.finest_px / 2.0, found), "px", from)
    }

    /// Of surfaces whose planes rise by more than two footprints a pixel, which are seen at less than 27 degrees.
    pub fn steep(found: Option<f64>) -> Check {
        let from = "a tenth of a pixel, half of what the plane of a surface rises a pixel beyond two footprints, which nobody believes that no neighbour \
                    shows, and what the error of its normal moves a corner by";
        Check::new("depths inside of steep surfaces, of what each may be off", (1.0, found), "share", from)
    }

    pub fn colours(found: Option<f64>) -> Check {
        let from = "a normal of 8 + 8 bits is off by 0.83 degrees at most, which two lights show as 2.5 of 255; base colours and pictures are rounded to \
                    half a step each";
        Check::new("colours inside of flat surfaces", (COLOURS, found), "of 255", from)
    }

    pub fn alike(found: Option<f64>) -> Check {
        let from = "what looks the same in exact arithmetic looks the same, but for edges through the middles of pixels, which fall to either side";
        Check::new("pixels that look otherwise", (ALIKE_SHARE, found), "share", from)
    }

    /// What all surfaces must keep.
    pub fn of_all(errors: &Errors) -> Vec<Check> {
        let some = |is_some: bool, found: f64| is_some.then_some(found);
        let mut checks = vec![
            Check::unfit(some(errors.unfit.buffers > 0, errors.unfit.values as f64)),
            Check::holes(some(errors.inside > 0, errors.holes_share())),
        ];
        // What is steep everywhere has nothing else to be judged by, and most has nothing steep.
        if errors.worst_px().is_some() || errors.steep().is_none() {
            checks.extend([Check::depth_of(errors), Check::mean_of(errors)]);
        }
        checks.extend(errors.steep().map(|steep| Check::steep(Some(steep))));
        checks
    }

    /// What flat ones must keep beside.
    pub fn of_flat(errors: &Errors) -> Vec<Check> {
        let mut checks = Check::of_all(errors);
        checks.push(Check::colours((!errors.colours.is_empty()).then(|| errors.worst_colour())));
        checks
    }

    #[cfg(test)]
    pub fn is_missed(&self) -> bool {
        self.bar("").is_missed()
    }

    /// The share of the bound that was used; of a bound of 0 there is none but all or nothing.
    fn used(&self) -> Option<f64> {
        self.found.filter(|_| self.at_most > 0.0).map(|found| found / self.at_most)
    }

    fn bar(&self, case: &str) -> Bar {
        Bar::at_most(format!("{case}: {}", self.what), self.at_most, self.found, self.unit)
    }

    /// A row of a table, a bar, and the bound's reason once.
    pub fn tell(&self, (table, case): (&str, &str), report: &mut Report) {
        let mut row = Row::new(table, &format!("{case}: {}", self.what));
        row.counts.set("at_most", self.at_most);
        self.found.into_iter().for_each(|found| row.counts.set("found", found));
        self.used().into_iter().for_each(|used| row.counts.set("used", used));
        report.rows.push(row);
        report.bars.push(self.bar(case));
        let note = format!("{}, at most {} {}: {}.", self.what, self.at_most, self.unit, self.from)
            .replace("  ", " ")
            .replace(" :", ":");
        if !report.notes.contains(&note) {
            report.notes.push(note);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_check_tells_how_much_of_its_bound_was_used() {
        let mut report = Report::new("stability", "");
        for found in [Some(0.5), Some(f64::NAN), None, Some(3.0)] {
            Check::new("shifts", (2.0, found), "px", "a reason").tell(("table", "case"), &mut report);
        }
        assert_eq!(report.rows[0].figure("counts.used"), Some(0.25));
        let missed: Vec<bool> = report.bars.iter().map(Bar::is_missed).collect();
        assert_eq!(missed, [false, true, true, true]);
        assert_eq!(report.notes, ["shifts, at most 2 px: a reason."]);
    }
}
