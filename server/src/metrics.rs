//! What a server counts, as Prometheus reads it (its text format, version 0.0.4).

use std::fmt::Write;
use std::sync::atomic::Ordering;

use crate::log;
use crate::peers::Peers;
use crate::plan::Reason;
use crate::session::Shared;
use crate::stats::resident_bytes;

/// Of the text.
pub(crate) const CONTENT_TYPE: &str = "text/plain; version=0.0.4";

/// All figures of a server.
pub(crate) fn text(shared: &Shared, peers: &Peers) -> String {
    let mut text = Text::default();
    let stats = &shared.house.stats;
    let count = |of: &std::sync::atomic::AtomicU64| of.load(Ordering::Relaxed) as f64;
    let info = [("version", env!("CARGO_PKG_VERSION")), ("scene", &shared.scene.name), ("adapter", &shared.adapter)];
    text.figure("vantage_info", "gauge", "What is served, and what draws it.", &[(&info, 1.0)]);
    let clients = stats.clients.load(Ordering::Relaxed) as f64;
    text.one("vantage_sessions", "gauge", "Sessions now.", clients);
    text.one("vantage_sessions_most", "gauge", "Sessions at one time at most.", shared.config.limits.clients as f64);
    text.one("vantage_sessions_total", "counter", "Sessions ever.", count(&stats.connected));
    text.one(
        "vantage_sessions_cut_off_total",
        "counter",
        "Sessions that the server ended for what their clients did.",
        count(&stats.cut_off),
    );
    text.one(
        "vantage_sessions_resumed_total",
        "counter",
        "Sessions that went on after their connection was cut off.",
        count(&stats.resumed),
    );
    text.one("vantage_sessions_kept", "gauge", "Sessions that were cut off and may go on.", shared.kept.count() as f64);
    text.one(
        "vantage_faults_total",
        "counter",
        "Faults of the server; each ended a session at most.",
        count(&stats.faults),
    );
    text.one(
        "vantage_renewals_total",
        "counter",
        "Times that what draws was made anew, after a fault or a lost GPU.",
        count(&stats.renewals),
    );
    let refused = peers.refused().map(|(crowded, times)| ([("what", crowded.name())], times as f64));
    let refused: Vec<_> = refused.iter().map(|(labels, value)| (&labels[..], *value)).collect();
    text.figure(
        "vantage_refused_total",
        "counter",
        "Connections and handshakes refused, by what there was too much of.",
        &refused,
    );
    text.one("vantage_addresses", "gauge", "Addresses of peers that are remembered.", peers.known() as f64);
    text.one("vantage_log_lines_lost_total", "counter", "Lines of the log that nobody took.", log::lost_lines() as f64);
    text.one("vantage_updates_total", "counter", "Updates handed to sessions.", count(&stats.updates));
    text.one("vantage_sent_bytes_total", "counter", "Bytes handed to sockets.", count(&stats.sent_bytes));
    let looks: Vec<_> =
        Reason::ALL.iter().map(|&reason| ([("reason", reason.name())], stats.looks(reason) as f64)).collect();
    let looks: Vec<_> = looks.iter().map(|(labels, value)| (&labels[..], *value)).collect();
    text.figure("vantage_looks_total", "counter", "Looks at what clients lack, by why they were made.", &looks);
    text.one(
        "vantage_scene_reloads_total",
        "counter",
        "Times that the scene was to be loaded anew.",
        count(&stats.reloads),
    );
    let failed = f64::from(u8::from(stats.reload_failed.load(Ordering::Relaxed)));
    text.one("vantage_scene_reload_failed", "gauge", "Whether that failed the last time.", failed);
    if let Some(bytes) = resident_bytes() {
        text.one("vantage_resident_bytes", "gauge", "Memory of the process that is in RAM.", bytes as f64);
    }
    text.0
}

type Labels<'a> = &'a [(&'a str, &'a str)];

#[derive(Default)]
struct Text(String);

impl Text {
    fn one(&mut self, name: &str, kind: &str, help: &str, value: f64) {
        self.figure(name, kind, help, &[(&[], value)]);
    }

    fn figure(&mut self, name: &str, kind: &str, help: &str, values: &[(Labels<'_>, f64)]) {
        let mut write = |line: std::fmt::Arguments<'_>| self.0.write_fmt(line).expect("a string takes all");
        write(format_args!("# HELP {name} {help}\n# TYPE {name} {kind}\n"));
        for (labels, value) in values {
            let labels: Vec<_> = labels.iter().map(|(name, value)| format!("{name}=\"{}\"", escaped(value))).collect();
            let labels = if labels.is_empty() { String::new() } else { format!("{{{}}}", labels.join(",")) };
            write(format_args!("{name}{labels} {value}\n"));
        }
    }
}

/// As a label's value may be.
fn escaped(value: &str) -> String {
    value.replace('\\', "\\\\").replace('"', "\\\"").replace('\n', "\\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_are_written_as_prometheus_reads_them() {
        let mut text = Text::default();
        text.one("a_total", "counter", "Some.", 3.0);
        text.figure("b", "gauge", "Others.", &[(&[("why", "a \"b\"\\\n"), ("x", "")], 0.5)]);
        let expected = "# HELP a_total Some.\n# TYPE a_total counter\na_total 3\n\
            # HELP b Others.\n# TYPE b gauge\nb{why=\"a \\\"b\\\"\\\\\\n\",x=\"\"} 0.5\n";
        assert_eq!(text.0, expected);
    }
}
