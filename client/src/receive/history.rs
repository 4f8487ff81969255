//! The last minute of a session, for curves beside the figures of the panel, and its last updates.

use std::collections::VecDeque;

use super::stats::Stats;

/// How far back curves go.
const CURVES_S: f64 = 60.0;
/// How far back updates go, and how many of them are kept at most.
const UPDATES_S: f64 = 10.0;
const MOST_UPDATES: usize = 512;
/// Between two points of a curve at least.
const INTERVAL_S: f64 = 0.2;

/// An update that is held.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Arrival {
    /// When it was there.
    pub at_s: f64,
    /// What it took of the path.
    pub bytes: usize,
    /// What decoding it took, in milliseconds.
    pub decode_ms: f64,
}

/// What there are curves of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Figure {
    /// Pictures a second.
    Pictures,
    /// Megabits a second that came.
    Received,
    /// From a pose to its picture.
    RoundTrip,
    /// Of what is shown.
    Age,
    /// The longest between two pictures.
    LongestFrame,
}

impl Figure {
    /// All of them.
    pub const ALL: [Figure; 5] =
        [Figure::Pictures, Figure::Received, Figure::RoundTrip, Figure::Age, Figure::LongestFrame];
}

/// See the module.
#[derive(Debug, Default)]
pub struct History {
    /// With a value for each of [`Figure::ALL`], where it is known.
    moments: VecDeque<(f64, [Option<f64>; Figure::ALL.len()])>,
    arrivals: VecDeque<Arrival>,
    frame_at_s: Option<f64>,
    longest_frame_s: Option<f64>,
}

impl History {
    /// A picture was drawn.
    pub fn drawn(&mut self, now_s: f64) {
        if let Some(before_s) = self.frame_at_s.replace(now_s) {
            let took_s = now_s - before_s;
            self.longest_frame_s = Some(self.longest_frame_s.map_or(took_s, |longest_s| longest_s.max(took_s)));
        }
    }

    /// Nothing is to be drawn: the next picture is late for nobody.
    pub fn rests(&mut self) {
        self.frame_at_s = None;
    }

    /// An update is held.
    pub fn arrived(&mut self, arrival: Arrival) {
        self.arrivals.push_back(arrival);
        while self.arrivals.len() > MOST_UPDATES {
            self.arrivals.pop_front();
        }
    }

    /// What the panel shows now.
    pub fn see(&mut self, stats: &Stats, now_s: f64) {
        if self.moments.back().is_some_and(|&(last_s, _)| now_s - last_s < INTERVAL_S) {
            return;
        }
        let longest_ms = self.longest_frame_s.take().map(|longest_s| longest_s * 1e3);
        let round_trip_ms = stats.round_trip_ms.or(stats.ping_ms);
        let values = [Some(stats.fps), Some(stats.mbit_per_s), round_trip_ms, stats.age_ms, longest_ms];
        self.moments.push_back((now_s, values));
        while self.moments.front().is_some_and(|&(at_s, _)| now_s - at_s > CURVES_S) {
            self.moments.pop_front();
        }
        while self.arrivals.front().is_some_and(|arrival| now_s - arrival.at_s > UPDATES_S) {
            self.arrivals.pop_front();
        }
    }

    /// A figure now; of the longest between two pictures, of those since the moment before.
    pub fn now(&self, figure: Figure) -> Option<f64> {
        self.moments.back()?.1[figure as usize]
    }

    /// A figure's curve: from a minute ago (x is 0) to now (1), from 0 to the largest value of that time (y is 1). Empty where all of it is 0, or nothing is known.
    pub fn curve(&self, figure: Figure) -> Vec<[f64; 2]> {
        let values = || self.moments.iter().filter_map(|(at_s, values)| Some((*at_s, values[figure as usize]?)));
        let (Some(&(now_s, _)), largest) = (self.moments.back(), values().map(|(_, value)| value).fold(0.0, f64::max))
        else {
            return Vec::new();
        };
        if largest <= 0.0 {
            return Vec::new();
        }
        values().map(|(at_s, value)| [1.0 - (now_s - at_s) / CURVES_S, value / largest]).collect()
    }

    /// The last updates: when, from ten seconds ago (0) to now (1), and how large, by the logarithm of bytes, from 100 B (0) to 1 MB (1).
    pub fn updates(&self) -> Vec<[f64; 2]> {
        let Some(&(now_s, _)) = self.moments.back() else { return Vec::new() };
        let height = |bytes: usize| ((bytes.max(1) as f64).log10() - 2.0) / 4.0;
        let place = |arrival: &Arrival| {
            [(1.0 - (now_s - arrival.at_s) / UPDATES_S).min(1.0), height(arrival.bytes).clamp(0.05, 1.0)]
        };
        self.arrivals.iter().filter(|arrival| now_s - arrival.at_s <= UPDATES_S).map(place).collect()
    }

    /// The last updates in words: how many of so many seconds, and the largest.
    pub fn updates_in_words(&self) -> String {
        let Some(&(now_s, _)) = self.moments.back() else { return String::new() };
        let of_late = || self.arrivals.iter().filter(|arrival| now_s - arrival.at_s <= UPDATES_S);
        match of_late().max_by_key(|arrival| arrival.bytes) {
            None => format!("none in {UPDATES_S} s"),
            Some(largest) => {
                let kilobytes = largest.bytes as f64 / 1e3;
                format!(
                    "{} in {UPDATES_S} s, up to {kilobytes:.1} kB and {:.1} ms",
                    of_late().count(),
                    largest.decode_ms
                )
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn curves_go_back_a_minute_and_begin_at_nothing() {
        let mut history = History::default();
        assert_eq!(history.curve(Figure::Pictures), Vec::<[f64; 2]>::new());
        for second in 0..=90 {
            let now_s = f64::from(second);
            history.drawn(now_s - 0.03);
            history.drawn(now_s);
            history.rests();
            history.see(&Stats { fps: if second == 60 { 60.0 } else { 30.0 }, ..Stats::default() }, now_s);
        }
        let curve = history.curve(Figure::Pictures);
        assert_eq!((curve.len(), curve[0], curve[60]), (61, [0.0, 0.5], [1.0, 0.5]));
        assert_eq!(curve[30], [0.5, 1.0]);
        assert!(history.curve(Figure::Received).is_empty(), "nothing came");
        assert!(history.curve(Figure::Age).is_empty(), "nothing is known of it");
        let longest_ms = history.now(Figure::LongestFrame).expect("known");
        assert!((longest_ms - 30.0).abs() < 1e-6, "a rest is no late frame: {longest_ms}");
    }

    #[test]
    fn updates_are_those_of_ten_seconds() {
        let mut history = History::default();
        for (at_s, bytes) in [(1.0, 1_000_000), (5.0, 10_000), (12.0, 100)] {
            history.arrived(Arrival { at_s, bytes, decode_ms: 2.0 });
        }
        history.see(&Stats::default(), 12.0);
        assert_eq!(history.updates(), [[0.3, 0.5], [1.0, 0.05]].map(|[x, y]: [f64; 2]| [1.0 - (1.0 - x), y]));
        assert_eq!(history.updates_in_words(), "2 in 10 s, up to 10.0 kB and 2.0 ms");
        (0..2_000).for_each(|_| history.arrived(Arrival { at_s: 12.0, bytes: 1, decode_ms: 0.0 }));
        assert_eq!(history.updates().len(), MOST_UPDATES);
    }
}
