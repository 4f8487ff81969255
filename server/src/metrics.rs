//! What a server counts, for Prometheus.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use crate::figures::Text;
use crate::peers::Peers;
use crate::plan::Reason;
use crate::session::Shared;

/// All figures of a server, of whose scenes those are open; the first one always is. `has_others`: whether it loads others as they are asked for.
pub(crate) fn text(open: &[(String, Arc<Shared>)], has_others: bool, peers: &Peers) -> String {
    let mut text = Text::default();
    let Some((name, shared)) = open.first() else { return text.into_string() };
    let stats = &shared.house.stats;
    let count = |of: &AtomicU64| of.load(Ordering::Relaxed) as f64;
    let info = [("version", env!("CARGO_PKG_VERSION")), ("scene", name), ("adapter", &shared.adapter)];
    text.figure("vantage_info", "gauge", "What is served, and what draws it.", &[(&info, 1.0)]);
    if has_others {
        scenes(&mut text, open);
    }
    text.sessions(stats, shared.config.limits.clients);
    text.one(
        "vantage_sessions_resumed_total",
        "counter",
        "Sessions that went on after their connection was cut off.",
        count(&stats.resumed),
    );
    text.one(
        "vantage_sessions_kept",
        "gauge",
        "Sessions that were cut off and may go on.",
        shared.house.kept.count() as f64,
    );
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

/// Of several scenes: what each takes, and how they come and go.
fn scenes(text: &mut Text, open: &[(String, Arc<Shared>)]) {
    let mut of_each = |name: &str, help: &str, of: &dyn Fn(&Shared) -> f64| {
        let values: Vec<_> = open.iter().map(|(scene, shared)| ([("scene", scene.as_str())], of(shared))).collect();
        let values: Vec<_> = values.iter().map(|(labels, value)| (&labels[..], *value)).collect();
        text.figure(name, "gauge", help, &values);
    };
    of_each("vantage_scene_sessions", "Sessions of each scene that is open.", &|shared| shared.session_count() as f64);
    of_each("vantage_scene_bytes", "Bytes of its meshes and images.", &|shared| shared.scene.bytes() as f64);
    let Some((_, shared)) = open.first() else { return };
    let stats = &shared.house.stats.scenes;
    for (name, help, of) in [
        ("opened", "Times that a scene was opened, as somebody asked for it.", &stats.opened),
        ("put_away", "Times that a scene was put away, as nobody wanted it, or for another one.", &stats.put_away),
        ("failed", "Times that a scene which somebody asked for could not be loaded.", &stats.failed),
    ] {
        text.one(&format!("vantage_scenes_{name}_total"), "counter", help, of.load(Ordering::Relaxed) as f64);
    }
}
