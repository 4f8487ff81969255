//! What a server counts, for Prometheus.

use std::sync::atomic::{AtomicU64, Ordering};

use crate::figures::Text;
use crate::peers::Peers;
use crate::plan::Reason;
use crate::session::Shared;

/// All figures of a server.
pub(crate) fn text(shared: &Shared, peers: &Peers) -> String {
    let mut text = Text::default();
    let stats = &shared.house.stats;
    let count = |of: &AtomicU64| of.load(Ordering::Relaxed) as f64;
    let info = [("version", env!("CARGO_PKG_VERSION")), ("scene", &shared.scene.name), ("adapter", &shared.adapter)];
    text.figure("vantage_info", "gauge", "What is served, and what draws it.", &[(&info, 1.0)]);
    text.sessions(stats, shared.config.limits.clients);
    text.one(
        "vantage_sessions_resumed_total",
        "counter",
        "Sessions that went on after their connection was cut off.",
        count(&stats.resumed),
    );
    text.one("vantage_sessions_kept", "gauge", "Sessions that were cut off and may go on.", shared.kept.count() as f64);
    text.one(
        "vantage_renewals_total",
        "counter",
        "Times that what draws was made anew, after a fault or a lost GPU.",
        count(&stats.renewals),
    );
    text.refusals(peers);
    text.one(
        "vantage_scene_reloads_total",
        "counter",
        "Times that the scene was to be loaded anew.",
        count(&stats.reloads),
    );
    let failed = f64::from(u8::from(stats.reload_failed.load(Ordering::Relaxed)));
    text.one("vantage_scene_reload_failed", "gauge", "Whether that failed the last time.", failed);
    let published = &stats.published;
    for (name, help, of) in [
        ("updates", "Updates published for relays.", &published.updates),
        ("wholes", "Whole copies published for relays.", &published.wholes),
        ("bytes", "Bytes of messages published for relays.", &published.bytes),
    ] {
        text.one(&format!("vantage_published_{name}_total"), "counter", help, count(of));
    }
    let looks: Vec<_> =
        Reason::ALL.iter().map(|&reason| ([("reason", reason.name())], stats.looks(reason) as f64)).collect();
    let looks: Vec<_> = looks.iter().map(|(labels, value)| (&labels[..], *value)).collect();
    text.figure("vantage_looks_total", "counter", "Looks at what clients lack, by why they were made.", &looks);
    text.into_string()
}
