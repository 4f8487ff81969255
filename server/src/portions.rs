//! A look at what a viewer who stands lacks, portion by portion, where his path carries little (see [`Allowance`]).
//!
//! What he sees comes first: rows of the first view, as many as hold about what the path carries. Then what is shown beside samples: impostors, what lights see, occluders,
//! one after the other. Then rows of the other views, which show what motion would uncover. A round in which something was found is followed by another one.

use camera::Pinhole;
use glam::DVec2;

use crate::allowance::Allowance;

/// About what a sample costs on the wire, in bytes (report `codec`, the fast profile).
pub const BYTES_PER_SAMPLE: f64 = 3.0;
/// Things that a look may begin beside samples: as many as there are.
pub const ALL: usize = usize::MAX;
/// Rows may lack much more than those above them: at most so many times as many follow at once.
const GROWTH: f64 = 4.0;

/// Bands of a view at most: each look costs some time whatever it finds.
const MOST_BANDS: usize = 4;

/// What of a look is done next.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Portion {
    /// Rows of a view of the plan, by its number.
    Rows {
        /// The view.
        view: usize,
        /// The uppermost.
        first: u32,
        /// How many.
        rows: u32,
    },
    /// One thing more of what is shown beside samples.
    Beside,
}

/// How far a look has come.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Portions {
    /// The plan's.
    views: Vec<Pinhole>,
    view: usize,
    row: u32,
    is_beside_done: bool,
    has_found: bool,
    /// Of this round.
    looked_px: u64,
    /// Of this round, in samples.
    found: u64,
}

impl Portions {
    /// The next portion of a look from views; `None` at the end of a round.
    pub fn next(&mut self, views: &[Pinhole], allowance: Allowance) -> Option<Portion> {
        if self.views != views {
            *self = Portions { views: views.to_vec(), ..Portions::default() };
        }
        if self.view > 0 && !self.is_beside_done {
            return Some(Portion::Beside);
        }
        let view = views.get(self.view)?;
        let width_px = u64::from(view.width_px.max(1));
        let samples_per_px = if self.looked_px == 0 { 1.0 } else { self.found as f64 / self.looked_px as f64 };
        let carried_rows = allowance.bytes() / BYTES_PER_SAMPLE / samples_per_px / width_px as f64;
        let most_rows = if self.looked_px == 0 { f64::INFINITY } else { GROWTH * (self.looked_px / width_px) as f64 };
        let left = view.height_px.saturating_sub(self.row);
        let rows = (carried_rows.min(most_rows) as u32).clamp(1, left.max(1));
        Some(Portion::Rows { view: self.view, first: self.row, rows })
    }

    /// A portion was looked at, which found so many samples lacking, or so many things that are shown beside them.
    pub fn looked(&mut self, portion: Portion, found: usize) {
        self.has_found |= found > 0;
        let Portion::Rows { view, first, rows } = portion else {
            self.is_beside_done |= found == 0;
            return;
        };
        let Some(camera) = self.views.get(view) else { return };
        self.looked_px += u64::from(camera.width_px) * u64::from(rows);
        self.found += found as u64;
        self.row = first + rows;
        if self.row >= camera.height_px {
            (self.view, self.row) = (view + 1, 0);
        }
    }

    /// A round has ended; whether it found nothing. The next one begins.
    pub fn end_round(&mut self) -> bool {
        let has_found = self.has_found;
        *self = Portions { views: std::mem::take(&mut self.views), ..Portions::default() };
        !has_found
    }
}

/// Rows of a view that are looked at at once.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Band {
    /// The uppermost.
    pub first: u32,
    /// How many.
    pub rows: u32,
    /// Where the next one begins, as a share of the view's height.
    pub end: f64,
}

/// A view as bands of about so many pixels, but no more bands than looks are worth, once around from the one that begins at a share of its height or holds it.
pub fn bands(view: &Pinhole, most_px: usize, begin: f64) -> impl Iterator<Item = Band> + use<> {
    let height_px = view.height_px;
    let pixels = view.width_px as usize * height_px as usize;
    let count = pixels.div_ceil(most_px.max(1)).clamp(1, MOST_BANDS.min(height_px.max(1) as usize)) as u32;
    let row = move |band: u32| (u64::from(height_px) * u64::from(band) / u64::from(count)) as u32;
    // Views may change their size between looks.
    let begin = (begin * f64::from(count)) as u32 % count;
    (begin..begin + count).map(move |band| {
        let (band, next) = (band % count, band % count + 1);
        Band { first: row(band), rows: row(next) - row(band), end: f64::from(next % count) / f64::from(count) }
    })
}

/// Rows of a view.
pub fn rows_of(view: &Pinhole, first: u32, rows: u32) -> Pinhole {
    let height_px = rows.min(view.height_px.saturating_sub(first));
    Pinhole { height_px, centre_px: view.centre_px - DVec2::new(0.0, f64::from(first)), ..*view }
}

#[cfg(test)]
mod tests {
    use camera::Rigid;

    use super::*;
    use crate::viewer::Viewer;

    fn view(height_px: u32) -> Pinhole {
        Pinhole::symmetric(Rigid::IDENTITY, (100, height_px), 1.0, 0.1)
    }

    /// Of 8 KiB: 2,730 samples.
    fn little() -> Allowance {
        let view = protocol::message::ViewSize { width_px: 640, height_px: 360, fov_y_rad: 1.0 };
        let mut viewer = Viewer::at_start(view, Rigid::IDENTITY, 0.0);
        (viewer.bytes_per_s, viewer.queue_s) = (Some(17e3), 1.0);
        Allowance::of(&viewer)
    }

    /// The portions of a round, of which rows lack a share of their pixels and so many things are shown beside.
    fn round(portions: &mut Portions, views: &[Pinhole], share: f64, mut beside: usize) -> Vec<Portion> {
        let mut taken = Vec::new();
        while let Some(portion) = portions.next(views, little()) {
            let found = match portion {
                Portion::Rows { rows, .. } => (f64::from(rows * 100) * share) as usize,
                Portion::Beside => {
                    let found = beside.min(1);
                    beside -= found;
                    found
                }
            };
            portions.looked(portion, found);
            taken.push(portion);
            assert!(taken.len() < 100, "no end");
        }
        taken
    }

    #[test]
    fn what_is_seen_comes_first_and_as_much_as_the_path_carries() {
        let mut portions = Portions::default();
        let (views, rows) = ([view(60), view(20)], |view, first, rows| Portion::Rows { view, first, rows });
        let taken = round(&mut portions, &views, 1.0, 2);
        let [one, two] = [rows(0, 0, 27), rows(0, 27, 27)];
        let beside = Portion::Beside;
        assert_eq!(taken, [one, two, rows(0, 54, 6), beside, beside, beside, rows(1, 0, 20)]);
        assert!(!portions.end_round(), "much was found");
        assert_eq!(round(&mut portions, &views, 0.0, 0), [one, rows(0, 27, 33), beside, rows(1, 0, 20)]);
        assert!(portions.end_round());
    }

    #[test]
    fn bands_go_once_around_a_view() {
        for (height_px, most_px, count) in
            [(60, 6000, 1), (60, 3000, 2), (60, 2000, 3), (61, 2000, 4), (61, 1, 4), (2, 0, 2), (1, 1, 1)]
        {
            for begin in [0.0, 0.25, 0.5, 0.7, 0.999] {
                let taken: Vec<Band> = bands(&view(height_px), most_px, begin).collect();
                assert_eq!(taken.len(), count, "{height_px} rows, {most_px} pixels at most");
                let mut rows: Vec<u32> = taken.iter().flat_map(|band| band.first..band.first + band.rows).collect();
                rows.sort_unstable();
                assert!(rows.into_iter().eq(0..height_px), "{taken:?}");
                let begins = f64::from(taken[0].first) / f64::from(height_px);
                assert!(
                    begins <= begin && begin - begins < 1.01 / count as f64 + 1.0 / f64::from(height_px),
                    "{taken:?}"
                );
                // The next look goes on where this one ended.
                let on = bands(&view(height_px), most_px, taken[0].end).next().expect("a band");
                assert_eq!(on.first, taken[1 % count].first);
            }
        }
    }

    #[test]
    fn another_view_begins_anew() {
        let mut portions = Portions::default();
        let first = portions.next(&[view(60)], little()).expect("rows");
        portions.looked(first, 1);
        assert_eq!(portions.next(&[view(61)], little()), Some(Portion::Rows { view: 0, first: 0, rows: 27 }));
    }

    #[test]
    fn rows_are_the_same_pixels() {
        let whole = view(60);
        let part = rows_of(&whole, 50, 20);
        assert_eq!((part.height_px, part.centre_px.y), (10, whole.centre_px.y - 50.0));
    }
}
