//! What a relay asks for at the broker, and what it hears there.

use std::collections::HashMap;
use std::sync::Arc;
use std::sync::atomic::Ordering;

use async_nats::Client;
use futures_util::StreamExt;
use tokio::time::MissedTickBehavior;

use super::feed::Feed;
use super::origin::Origin;
use super::state::Relay;
use crate::broker::ASK_EVERY;
use crate::broker::notes::{Ask, Followed, MAX_NAMES, Notice};
use crate::fault;
use crate::session::link::is_over;

/// Asks and hears until the relay is to stop.
pub(super) async fn run(relay: Arc<Relay>) {
    let mut over = relay.over.subscribe();
    let hearing = async {
        // What met a fault is made anew, and with it all that is listened to.
        while let Err(fault) = fault::caught_in(hear_on(&relay)).await {
            relay.stats.count_fault(&fault);
            tokio::time::sleep(ASK_EVERY).await;
        }
    };
    tokio::select! {
        () = hearing => {}
        _ = is_over(&mut over) => {}
    }
}

async fn hear_on(relay: &Arc<Relay>) {
    if let Err(error) = hear(relay).await {
        tracing::error!("nothing is relayed: {error}");
    }
}

async fn hear(relay: &Arc<Relay>) -> anyhow::Result<()> {
    let client = relay.broker.connect("vantage-server relay").await?;
    let subjects = relay.broker.subjects();
    let mut notices = client.subscribe(subjects.server()).await?;
    let mut ticks = tokio::time::interval(ASK_EVERY);
    ticks.set_missed_tick_behavior(MissedTickBehavior::Delay);
    let mut feeds = Feeds::default();
    loop {
        tokio::select! {
            message = notices.next() => {
                let Some(message) = message else { anyhow::bail!("the connection was given up") };
                match Notice::read(&message.payload) {
                    Ok(notice) => feeds.told(relay, notice),
                    Err(error) => {
                        relay.heard.refused.fetch_add(1, Ordering::Relaxed);
                        tracing::debug!("a server that cannot be understood: {error}");
                    }
                }
                continue;
            }
            () = relay.asks.notified() => {}
            _ = ticks.tick() => {}
        }
        let ask = feeds.asks(relay, &client);
        client.publish(subjects.asks(), ask.bytes().into()).await?;
    }
}

/// Who is listened to, of one server.
#[derive(Default)]
struct Feeds {
    of: u64,
    by_name: HashMap<String, Feed>,
    is_puzzled: bool,
}

impl Feeds {
    /// Takes in what a server says of itself.
    fn told(&mut self, relay: &Relay, notice: Notice) {
        let mut origin = relay.origin();
        match &*origin {
            Some(known) if known.id() == notice.origin => {
                self.is_puzzled = false;
                for (name, last) in known.hear(notice) {
                    self.by_name.get(&name).into_iter().for_each(|feed| feed.should_hold(last));
                }
            }
            Some(known) if !known.is_silent() => {
                if !std::mem::replace(&mut self.is_puzzled, true) {
                    let channel = &relay.broker.channel;
                    tracing::warn!("two servers publish as {channel:?}: give each a --channel of its own");
                }
            }
            known => {
                known.iter().for_each(|known| known.replace());
                tracing::info!(scene = notice.welcome.scene_name, "relays a server");
                *origin = Some(Arc::new(Origin::new(notice)));
            }
        }
    }

    /// Listens to those who are followed here, and to nobody else; says whom.
    fn asks(&mut self, relay: &Arc<Relay>, client: &Client) -> Ask {
        let Some(origin) = relay.origin().clone() else { return Ask::new(Vec::new()) };
        if std::mem::replace(&mut self.of, origin.id()) != origin.id() {
            self.by_name.clear();
        }
        let mut followed = origin.audiences.followed();
        followed.truncate(MAX_NAMES);
        self.by_name.retain(|name, feed| followed.contains(name) && !feed.has_ended());
        for name in &followed {
            if !self.by_name.contains_key(name)
                && let Some(feed) = Feed::start(relay, &origin, client, name)
            {
                self.by_name.insert(name.clone(), feed);
            }
        }
        relay.heard.followed.store(self.by_name.len(), Ordering::Relaxed);
        let asked = |(name, feed): (&String, &Feed)| Followed { name: name.clone(), whole: feed.needs_whole() };
        Ask::new(self.by_name.iter().map(asked).collect())
    }
}
