//! What a relay counts, for people and for Prometheus.

use std::sync::atomic::{AtomicU64, Ordering};

use super::state::Relay;
use crate::figures::Text;
use crate::host::Host;
use crate::peers::Peers;
use crate::stats::resident_bytes;

/// For `/healthz`.
pub(super) fn health(relay: &Relay) -> serde_json::Value {
    let (stats, heard) = (&relay.stats, &relay.heard);
    let count = |of: &AtomicU64| of.load(Ordering::Relaxed);
    serde_json::json!({
        "ok": relay.ready().is_ok(),
        "relays": relay.relayed().map(|origin| origin.welcome.scene_name.clone()).ok(),
        "clients": stats.clients.load(Ordering::Relaxed),
        "connected": count(&stats.connected),
        "cut_off": count(&stats.cut_off),
        "faults": count(&stats.faults),
        "updates": count(&stats.updates),
        "sent_bytes": count(&stats.sent_bytes),
        "heard": {
            "updates": count(&heard.updates),
            "wholes": count(&heard.wholes),
            "bytes": count(&heard.bytes),
            "gaps": count(&heard.gaps),
            "refused": count(&heard.refused),
            "followed": heard.followed.load(Ordering::Relaxed),
        },
        "resident_bytes": resident_bytes(),
    })
}

/// For `/metrics`.
pub(super) fn metrics(relay: &Relay, peers: &Peers) -> String {
    let mut text = Text::default();
    let heard = &relay.heard;
    let mut one = |name: &str, kind: &str, help: &str, value: f64| text.one(name, kind, help, value);
    let relayed = relay.relayed().ok();
    let is_heard = relayed.as_ref().is_some_and(|origin| !origin.is_silent());
    one(
        "vantage_relay_up",
        "gauge",
        "Whether the server that is relayed was heard in the last seconds.",
        f64::from(u8::from(is_heard)),
    );
    let presenters = relayed.as_ref().map_or(0, |origin| origin.presenters().len());
    one("vantage_relay_presenters", "gauge", "Who presents at the server.", presenters as f64);
    let followed = heard.followed.load(Ordering::Relaxed);
    one("vantage_relay_followed", "gauge", "Who of them is followed here.", followed as f64);
    for (name, help, of) in [
        ("updates", "Updates heard and passed on.", &heard.updates),
        ("wholes", "Whole copies heard.", &heard.wholes),
        ("bytes", "Bytes of messages heard.", &heard.bytes),
        ("gaps", "Updates before which others were lost.", &heard.gaps),
        ("refused", "Messages that made no sense.", &heard.refused),
    ] {
        one(&format!("vantage_relay_{name}_total"), "counter", help, of.load(Ordering::Relaxed) as f64);
    }
    text.sessions(&relay.stats, relay.limits.clients);
    text.refusals(peers);
    text.into_string()
}
