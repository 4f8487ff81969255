//! The figures of a run for people.

use std::fmt::Write;

use super::percentiles::Percentiles;
use super::{Memory, Report};
use crate::report::table::Table;

/// The figures as lines of text, and why clients ended early.
pub fn text(report: &Report) -> String {
    let mut text = figures(report).text();
    for (cause, count) in report.errors_by_cause() {
        writeln!(text, "  {count} clients: {cause}").expect("a string takes all");
    }
    text
}

/// The figures with their names and units.
pub(super) fn figures(report: &Report) -> Table {
    let mut table = Table::new(["figure", "value"]);
    let mut line = |name: &str, value: String| table.row([name.to_owned(), value]);
    let adapter = report.health["adapter"].as_str().unwrap_or("unknown");
    let scene = report.welcome.as_ref().map_or("unknown", |welcome| &welcome.scene_name);
    line("server", format!("{}, scene {scene}, on {adapter}", report.server));
    line("clients", format!("{}, {}", report.clients.len(), report.script));
    line("seconds", format!("{:.1}", report.seconds));
    let per_client = report.updates as f64 / report.seconds / report.clients.len().max(1) as f64;
    line("updates", format!("{}, {per_client:.2} a second a client", report.updates));
    line("bytes", format!("{}, {:.2} Mbit/s in all", report.bytes, report.bytes as f64 * 8e-6 / report.seconds));
    line("connected to first update", spread(report.first_update_ms));
    line("pose to its update", spread(report.latency_ms));
    line("sent to received", spread(report.lag_ms));
    line("between two updates", spread(report.interval_ms));
    if report.worst_interval_by_mean.is_finite() {
        line("worst client's longest interval by its mean", format!("{:.2}", report.worst_interval_by_mean));
    }
    let mut memory = |who: &str, memory: Option<Memory>| {
        let mib = |bytes: u64| bytes as f64 / f64::from(1 << 20);
        if let Some(Memory { before_bytes, during_bytes, per_client_bytes }) = memory {
            let (before, during, per_client) = (mib(before_bytes), mib(during_bytes), mib(per_client_bytes));
            line(who, format!("{before:.0} MiB before, {during:.0} MiB during, {per_client:.3} MiB a client"));
        }
    };
    memory("server's memory", report.server_memory);
    memory("load's memory", report.load_memory);
    if let Some(cores) = report.load_cores {
        let share = cores / report.clients.len().max(1) as f64;
        line("load's processor time", format!("{cores:.2} cores, {:.3} % of a core a client", share * 100.0));
    }
    if !report.flip_covered.is_empty() {
        let mean = report.flip_covered.iter().sum::<f64>() / report.flip_covered.len() as f64;
        let worst = report.flip_covered.iter().copied().fold(0.0, f64::max);
        line("FLIP over covered", format!("mean {mean:.3}, worst {worst:.3}"));
    }
    line("reconnections", report.reconnections.to_string());
    line("errors", report.errors.to_string());
    line("clients without an update", report.empty_handed.to_string());
    table
}

fn spread(of: Percentiles) -> String {
    if of.max.is_nan() {
        return "not measured".to_owned();
    }
    format!("mean {:.0} ms, median {:.0} ms, p99 {:.0} ms, worst {:.0} ms", of.mean, of.p50, of.p99, of.max)
}
