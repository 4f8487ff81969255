//! What a run must keep to, and what of it was missed.

use std::time::Duration;

use thiserror::Error;

use super::Report;
use crate::report::Bar;
use crate::report::rows::bar_cells;

/// Limits that a run is given; `None` asks for nothing.
#[derive(Debug, Clone, Copy, Default)]
pub struct Limits {
    /// From a pose to its update, 99 of 100.
    pub latency_p99: Option<Duration>,
    /// Between two updates of a client, 99 of 100.
    pub interval_p99: Option<Duration>,
}

impl Limits {
    /// What a run was to reach beside what it found. That every client gets something and ends well is always asked for.
    pub(super) fn bars(&self, report: &Report) -> Vec<Bar> {
        let none = |what: &str, found: usize| Bar::at_most(what, 0.0, Some(found as f64), "");
        let time = |what: &str, limit: Option<Duration>, found_ms: f64| {
            let found_ms = Some(found_ms).filter(|found_ms| found_ms.is_finite());
            limit.map(|limit| Bar::at_most(what, limit.as_secs_f64() * 1e3, found_ms, "ms"))
        };
        let mut bars = vec![
            none("clients that ended by an error", report.errors),
            none("clients that got no update", report.empty_handed),
        ];
        bars.extend(time("from a pose to its update, p99", self.latency_p99, report.latency_ms.p99));
        bars.extend(time("between two updates, p99", self.interval_p99, report.interval_ms.p99));
        bars
    }
}

/// What a missed limit is told as: its name, what was found, and how much may be.
pub fn missed(bar: &Bar) -> Option<String> {
    let [what, at_most, found, _] = bar_cells(bar);
    bar.is_missed().then(|| format!("{what}: {found}, the limit is {at_most}"))
}

/// A text that is no time.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("`{0}` is no time: write 500ms, 2s, or a number of milliseconds")]
pub struct NoTime(String);

/// A time as people type it: `500ms`, `2s`, or a bare number of milliseconds.
pub fn time(text: &str) -> Result<Duration, NoTime> {
    let (number, unit_s) = match (text.strip_suffix("ms"), text.strip_suffix('s')) {
        (Some(number), _) => (number, 1e-3),
        (None, Some(number)) => (number, 1.0),
        (None, None) => (text, 1e-3),
    };
    let seconds = number.trim_end().parse::<f64>().ok().map(|number| number * unit_s);
    seconds.and_then(|seconds| Duration::try_from_secs_f64(seconds).ok()).ok_or_else(|| NoTime(text.to_owned()))
}

#[cfg(test)]
mod tests {
    use super::super::Percentiles;
    use super::*;

    #[test]
    fn times_have_units() {
        let cases =
            [("500ms", 500), ("2s", 2000), ("1.5s", 1500), ("500", 500), ("0", 0), ("20 ms", 20), ("3 s", 3000)];
        for (text, ms) in cases {
            assert_eq!(time(text), Ok(Duration::from_millis(ms)), "{text}");
        }
        for text in ["", "s", "ms", "fast", "-1s", "nan", "inf", "1e300s", "2m", "5us"] {
            assert_eq!(time(text), Err(NoTime(text.to_owned())), "{text}");
        }
    }

    fn missed_of(limits: Limits, report: &Report) -> Vec<String> {
        limits.bars(report).iter().filter_map(missed).collect()
    }

    fn run(latency_p99_ms: f64, interval_p99_ms: f64) -> Report {
        let of = |p99| Percentiles { p99, ..Percentiles::default() };
        Report { latency_ms: of(latency_p99_ms), interval_ms: of(interval_p99_ms), ..Report::default() }
    }

    #[test]
    fn a_limit_that_is_passed_is_named_with_its_figure() {
        let limits =
            Limits { latency_p99: Some(Duration::from_millis(500)), interval_p99: Some(Duration::from_secs(1)) };
        assert!(missed_of(limits, &run(500.0, 999.0)).is_empty());
        assert_eq!(
            missed_of(limits, &run(612.0, 10.0)),
            ["from a pose to its update, p99: 612 ms, the limit is 500 ms"]
        );
        assert_eq!(missed_of(limits, &run(1.0, 1250.0)), ["between two updates, p99: 1250 ms, the limit is 1000 ms"]);
        assert!(missed_of(Limits::default(), &run(1e6, 1e6)).is_empty(), "nothing was asked");
    }

    #[test]
    fn what_was_not_measured_keeps_no_limit() {
        let limits = Limits { latency_p99: Some(Duration::from_secs(2)), interval_p99: None };
        let expected = "from a pose to its update, p99: not measured, the limit is 2000 ms";
        assert_eq!(missed_of(limits, &run(f64::NAN, f64::NAN)), [expected]);
    }

    #[test]
    fn errors_and_empty_hands_miss_without_being_asked() {
        let report = Report { errors: 3, empty_handed: 2, ..run(1.0, 1.0) };
        let expected =
            ["clients that ended by an error: 3, the limit is 0", "clients that got no update: 2, the limit is 0"];
        assert_eq!(missed_of(Limits::default(), &report), expected);
    }
}
