//! A run's report for a terminal.

use std::fmt::Write;

use super::{Mode, Report};

/// The report as lines of text.
pub fn table(report: &Report) -> String {
    let mut text = String::new();
    let mut line = |name: &str, value: String| writeln!(text, "{name:<34} {value}").expect("a string takes all");
    let readers = report.clients.iter().filter(|client| client.mode == Mode::Reads).count();
    let adapter = report.health["adapter"].as_str().unwrap_or("unknown");
    let scene = report.health["scene"].as_str().unwrap_or("unknown");
    line("server", format!("{}, scene {scene}, on {adapter}", report.server));
    line("clients that read / stall", format!("{readers} / {}", report.clients.len() - readers));
    line("seconds", format!("{:.1}", report.seconds));
    line("updates (frames)", format!("{}, {:.2} a second a client", report.updates, per_client(report, readers)));
    line("bytes", format!("{}, {:.2} Mbit/s in all", report.bytes, report.bytes as f64 * 8e-6 / report.seconds));
    let latency = report.latency_ms;
    line(
        "pose to its update, p50 / p99 ms",
        format!("{:.0} / {:.0}, worst {:.0}", latency.p50, latency.p99, latency.max),
    );
    let lag = report.lag_ms;
    line("sent to received, p50 / p99 ms", format!("{:.0} / {:.0}, worst {:.0}", lag.p50, lag.p99, lag.max));
    let interval = report.interval_ms;
    line("interval, mean / p99 / max ms", format!("{:.0} / {:.0} / {:.0}", interval.mean, interval.p99, interval.max));
    line("worst client's max by its mean", format!("{:.2}", report.worst_interval_by_mean));
    if let Some(memory) = report.server_memory {
        let mib = |bytes: u64| bytes as f64 / f64::from(1 << 20);
        line(
            "server memory before / during MiB",
            format!("{:.0} / {:.0}", mib(memory.before_bytes), mib(memory.during_bytes)),
        );
        line("server memory a client MiB", format!("{:.2}", mib(memory.per_client_bytes)));
    }
    if !report.flip_covered.is_empty() {
        let mean = report.flip_covered.iter().sum::<f64>() / report.flip_covered.len() as f64;
        let worst = report.flip_covered.iter().copied().fold(0.0, f64::max);
        line("FLIP over covered, mean / worst", format!("{mean:.3} / {worst:.3}"));
    }
    line("errors", report.errors.to_string());
    for client in report.clients.iter().filter(|client| client.error.is_some()) {
        let error = client.error.as_deref().unwrap_or_default();
        writeln!(text, "  client {} ({:?}): {error}", client.index, client.mode).expect("a string takes all");
    }
    text
}

fn per_client(report: &Report, readers: usize) -> f64 {
    report.updates as f64 / report.seconds / readers.max(1) as f64
}
