//! How many of a lamp's points a frame draws: what moves is drawn with few, and who looks on sees the rest added frame by frame.
//!
//! Points come in the order of a (0, 2)-sequence (Sobol 1967; its second component as in Kollig and Keller, *Efficient multidimensional
//! sampling*, 2002): any first few of them lie evenly in the light, and of a power of two a side each has its turn once.

use std::str::FromStr;

use web_time::{Duration, Instant};

use super::choice::{Choice, Chooser};
use super::method::Method;

/// Which share of a lamp's points a frame draws.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Pace {
    /// All at once.
    #[default]
    All,
    /// So many, and as many more in each frame in which nothing moves.
    Points(u32),
    /// As many as frames come in time with.
    Measured,
}

impl FromStr for Pace {
    type Err = String;

    fn from_str(text: &str) -> Result<Pace, String> {
        match (text, text.parse()) {
            ("measured", _) => Ok(Pace::Measured),
            ("all", _) => Ok(Pace::All),
            (_, Ok(points)) if points > 0 => Ok(Pace::Points(points)),
            _ => Err(format!("{text} is no pace of soft shadows: use measured, all, or how many points a frame draws")),
        }
    }
}

/// Frames that take longer than this (25 a second) are given fewer points.
const SLOW: Duration = Duration::from_millis(40);
/// Frames that take less than this (45 a second) are given more. Half of [`SLOW`] and a little: twice the points are not too slow then.
const FAST: Duration = Duration::from_millis(22);
/// What the first frame gets.
const FIRST_POINTS: u32 = 4;

/// Chooses by the time from frame to frame: how many points are drawn, and by which method.
#[derive(Debug)]
pub(crate) struct Pacer {
    pace: Pace,
    points: u32,
    chooser: Chooser,
    /// When the last frame drew points.
    drawn_at: Option<Instant>,
}

impl Pacer {
    pub(crate) fn new(pace: Pace, choice: Choice, has_compute: bool) -> Pacer {
        Pacer { pace, points: FIRST_POINTS, chooser: Chooser::new(choice, has_compute), drawn_at: None }
    }

    /// What a frame draws that begins now, of `all`, and by which method.
    pub(crate) fn next(&mut self, now: Instant, all: u32) -> (u32, Method) {
        let took = self.drawn_at.replace(now).map(|drawn_at| now.duration_since(drawn_at));
        if let Some(took) = took {
            self.chooser.drew(took, self.points, all);
        }
        self.points = match (self.pace, took) {
            (Pace::All, _) => all,
            (Pace::Points(points), _) => points,
            (Pace::Measured, _) if self.chooser.is_trying() => self.points,
            (Pace::Measured, Some(took)) if took > SLOW => self.points / 2,
            (Pace::Measured, Some(took)) if took < FAST => self.points.saturating_mul(2),
            (Pace::Measured, _) => self.points,
        }
        .clamp(1, all.max(1));
        (self.points, self.chooser.method)
    }

    /// A frame drew none: the time to the next says nothing.
    pub(crate) fn rest(&mut self) {
        self.drawn_at = None;
    }

    /// Frames show another number of lamps, or have another size: a method that was slower may be the faster now.
    pub(crate) fn begin_again(&mut self) {
        self.chooser.begin_again();
    }
}

/// The places of `side * side` points, by rows, in their order.
pub(super) fn order(side: u32) -> Vec<usize> {
    // The sequence fills squares of a power of two; what lies beside ours is left out.
    let whole = side.next_power_of_two();
    let cell = |number: u32| {
        let coordinate = |bits: u32| ((u64::from(bits) * u64::from(whole)) >> 32) as u32;
        let (column, row) = (coordinate(number.reverse_bits()), coordinate(second_component(number)));
        (column < side && row < side).then_some((row * side + column) as usize)
    };
    (0..whole * whole).filter_map(cell).collect()
}

/// Of Sobol's sequence, in units of 2^-32.
fn second_component(mut number: u32) -> u32 {
    let (mut direction, mut sum) = (1u32 << 31, 0);
    while number != 0 {
        if number & 1 == 1 {
            sum ^= direction;
        }
        number >>= 1;
        direction ^= direction >> 1;
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paces_have_names() {
        assert_eq!(
            ["measured", "all", "12"].map(str::parse),
            [Ok(Pace::Measured), Ok(Pace::All), Ok(Pace::Points(12))]
        );
        for wrong in ["", "0", "-3", "fast"] {
            assert!(wrong.parse::<Pace>().is_err_and(|why| why.contains("measured")), "{wrong}");
        }
    }

    #[test]
    fn every_point_has_its_turn_once() {
        for side in [1, 2, 3, 7, 8, 16, 32] {
            let mut order = order(side);
            order.sort_unstable();
            assert_eq!(order, (0..(side * side) as usize).collect::<Vec<_>>());
        }
    }

    #[test]
    fn the_first_few_lie_evenly() {
        let order = order(16);
        // Each of the first 4^k squares of the light has one of the first 4^k points, each of 16 columns and rows one of the first 16.
        for squares in [2, 4, 8] {
            let square = |point: &usize| (point / 16 * squares / 16, point % 16 * squares / 16);
            let mut seen: Vec<_> = order[..squares * squares].iter().map(square).collect();
            seen.sort_unstable();
            seen.dedup();
            assert_eq!(seen.len(), squares * squares);
        }
        let mut columns: Vec<_> = order[..16].iter().map(|point| point % 16).collect();
        columns.sort_unstable();
        assert_eq!(columns, (0..16).collect::<Vec<_>>());
    }

    #[test]
    fn slow_frames_get_fewer_points_and_fast_ones_more() {
        let pacer = |pace| Pacer::new(pace, Choice::default(), true);
        let mut measured = pacer(Pace::Measured);
        let begin = Instant::now();
        let mut at = |ms: u64| measured.next(begin + Duration::from_millis(ms), 64).0;
        assert_eq!((at(0), at(10), at(40), at(140)), (FIRST_POINTS, 8, 8, 4));
        measured.rest();
        let mut at = |ms: u64| measured.next(begin + Duration::from_millis(ms), 64).0;
        assert_eq!(at(9_000), 4, "nothing was drawn meanwhile");
        assert_eq!((1..20).map(|ms| at(9_000 + ms)).max(), Some(64));
        assert_eq!((1..20).map(|frame| at(20_000 + 100 * frame)).last(), Some(1));
        assert_eq!(pacer(Pace::Points(100)).next(begin, 64).0, 64);
        assert_eq!(pacer(Pace::All).next(begin, 64).0, 64);
    }

    #[test]
    fn a_method_is_tried_with_as_many_points_and_they_are_more_where_it_is_faster() {
        let mut pacer = Pacer::new(Pace::Measured, Choice::Measured, true);
        let mut now = Instant::now();
        // A point takes 30 ms by one method and 4 by the other.
        let mut frames = vec![];
        for _ in 0..24 {
            let (points, method) = pacer.next(now, 64);
            let point_ms = if method == Method::Warp { 30 } else { 4 };
            now += Duration::from_millis(point_ms * u64::from(points));
            frames.push((points, method));
        }
        assert_eq!(frames[..3], [(4, Method::Warp), (2, Method::Warp), (1, Method::Warp)]);
        let tried = frames.iter().position(|(_, method)| *method == Method::March).expect("tried");
        assert!(frames[tried..tried + 4].iter().all(|frame| *frame == (1, Method::March)), "{frames:?}");
        assert_eq!(frames.last(), Some(&(8, Method::March)));
    }
}
