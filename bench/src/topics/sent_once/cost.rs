//! What a look costs the server and a frame the client, by how many samples are held.

use super::walk::Tick;
use crate::report::Row;
use crate::report::plot::{Scatter, Series};
use crate::spread::{Better, Spread};

/// The walk is parted into so many groups of equal size.
const GROUPS: usize = 4;

/// What is known of a walk's costs.
pub struct Costs<'a> {
    /// The walk's ticks.
    pub ticks: &'a [Tick],
    /// Samples held, and wall milliseconds of a client's frame that draws them.
    pub frames: &'a [(usize, f64)],
    /// Median wall milliseconds of a tick that sends every view anew.
    pub anew_ms: f64,
}

impl Costs<'_> {
    /// A row a group, from few held samples to many.
    pub fn rows(&self, label: &str, image_px: u32) -> Vec<Row> {
        let mut ticks: Vec<&Tick> = self.ticks.iter().collect();
        ticks.sort_by_key(|tick| tick.held);
        let groups = ticks.chunks(ticks.len().div_ceil(GROUPS).max(1));
        groups.filter_map(|group| self.row(label, image_px, group)).collect()
    }

    fn row(&self, label: &str, image_px: u32, group: &[&Tick]) -> Option<Row> {
        let (least, most) = (group.first()?.held, group.last()?.held);
        let mut row = Row::new(label, &format!("{image_px} px, up to {} k held", most / 1000));
        let looks = Spread::of(&group.iter().map(|tick| tick.look_ms).collect::<Vec<_>>(), Better::Lower)?;
        row.counts.set("held", group.iter().map(|tick| tick.held).sum::<usize>() as f64 / group.len() as f64);
        row.counts.set("look_over_anew", median(group.iter().copied()) / self.anew_ms);
        row.time_ms.set("look", looks);
        let among = |held: &usize| (least..=most).contains(held);
        let frames: Vec<f64> = self.frames.iter().filter(|(held, _)| among(held)).map(|&(_, ms)| ms).collect();
        Spread::of(&frames, Better::Lower).into_iter().for_each(|frames| row.time_ms.set("client_frame", frames));
        Some(row)
    }

    /// Looks and frames over held samples.
    pub fn plot(&self, label: &str, image_px: u32) -> Scatter {
        let series = |name: &str, points| Series { name: name.to_owned(), points };
        let thousands = |held: usize| held as f64 / 1000.0;
        let looks = self.ticks.iter().map(|tick| (thousands(tick.held), tick.look_ms)).collect();
        let frames = self.frames.iter().map(|&(held, ms)| (thousands(held), ms)).collect();
        let most = self.ticks.iter().map(|tick| tick.held).max().unwrap_or(0);
        let anew = vec![(0.0, self.anew_ms), (thousands(most), self.anew_ms)];
        Scatter {
            title: format!("{label}, views of {image_px}²: time by what is held"),
            x_label: "thousand samples held".to_owned(),
            y_label: "ms".to_owned(),
            series: vec![series("server's look", looks), series("client's frame", frames), series("anew", anew)],
        }
    }
}

/// The median time of a look.
pub(super) fn median<'a>(ticks: impl IntoIterator<Item = &'a Tick>) -> f64 {
    let mut sorted: Vec<f64> = ticks.into_iter().map(|tick| tick.look_ms).collect();
    sorted.sort_by(f64::total_cmp);
    sorted.get(sorted.len() / 2).copied().unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_walk_is_grouped_by_what_is_held() {
        let tick = |thousand: usize| Tick { held: thousand * 1000, look_ms: thousand as f64, ..Tick::default() };
        let ticks: Vec<Tick> = (1..=8).rev().map(tick).collect();
        let costs = Costs { ticks: &ticks, frames: &[(1500, 5.0), (7500, 9.0)], anew_ms: 2.0 };
        let rows = costs.rows("room", 256);
        let figures = |path| rows.iter().map(|row| row.figure(path)).collect::<Vec<_>>();
        assert_eq!(figures("counts.held"), [1500.0, 3500.0, 5500.0, 7500.0].map(Some));
        assert_eq!(figures("counts.look_over_anew"), [1.0, 2.0, 3.0, 4.0].map(Some));
        assert_eq!(figures("time_ms.client_frame.mean"), [Some(5.0), None, None, Some(9.0)]);
    }
}
