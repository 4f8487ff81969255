//! Figures as Prometheus reads them (its text format, version 0.0.4).

use std::fmt::Write;
use std::sync::atomic::{AtomicU64, Ordering};

use crate::log;
use crate::peers::Peers;
use crate::stats::{Stats, resident_bytes};

/// Of the text.
pub(crate) const CONTENT_TYPE: &str = "text/plain; version=0.0.4";

/// Names and values.
pub(crate) type Labels<'a> = &'a [(&'a str, &'a str)];

/// Figures one after the other.
#[derive(Default)]
pub(crate) struct Text(String);

impl Text {
    /// As it is sent.
    pub fn into_string(self) -> String {
        self.0
    }

    /// What servers and relays count alike, of sessions and of the process.
    pub fn sessions(&mut self, stats: &Stats, most: usize) {
        let count = |of: &AtomicU64| of.load(Ordering::Relaxed) as f64;
        self.one("vantage_sessions", "gauge", "Sessions now.", stats.clients.load(Ordering::Relaxed) as f64);
        self.one("vantage_sessions_most", "gauge", "Sessions at one time at most.", most as f64);
        self.one("vantage_sessions_total", "counter", "Sessions ever.", count(&stats.connected));
        self.one(
            "vantage_sessions_cut_off_total",
            "counter",
            "Sessions that the server ended for what their clients did.",
            count(&stats.cut_off),
        );
        self.one(
            "vantage_faults_total",
            "counter",
            "Faults of the server; each ended a session at most.",
            count(&stats.faults),
        );
        self.one("vantage_updates_total", "counter", "Updates handed to sessions.", count(&stats.updates));
        self.one("vantage_sent_bytes_total", "counter", "Bytes handed to sockets.", count(&stats.sent_bytes));
        if let Some(bytes) = resident_bytes() {
            self.one("vantage_resident_bytes", "gauge", "Memory of the process that is in RAM.", bytes as f64);
        }
    }

    /// The same, of peers that were turned away and of the log.
    pub fn refusals(&mut self, peers: &Peers) {
        let refused = peers.refused().map(|(crowded, times)| ([("what", crowded.name())], times as f64));
        let refused: Vec<_> = refused.iter().map(|(labels, value)| (&labels[..], *value)).collect();
        self.figure(
            "vantage_refused_total",
            "counter",
            "Connections and handshakes refused, by what there was too much of.",
            &refused,
        );
        self.one("vantage_addresses", "gauge", "Addresses of peers that are remembered.", peers.known() as f64);
        let lost = log::lost_lines() as f64;
        self.one("vantage_log_lines_lost_total", "counter", "Lines of the log that nobody took.", lost);
    }

    /// One without labels.
    pub fn one(&mut self, name: &str, kind: &str, help: &str, value: f64) {
        self.figure(name, kind, help, &[(&[], value)]);
    }

    /// One for each set of labels.
    pub fn figure(&mut self, name: &str, kind: &str, help: &str, values: &[(Labels<'_>, f64)]) {
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
