//! What this server's presenters are sent, published for relays: beyond one host, an audience is as large as relays make it.
//!
//! A publisher is a follower whose client is a broker ([`crate::broker`]): each update goes there once, however many listen. Relays say twice a second whom
//! they follow; while none does, nothing is published. The whole copy of a moment is made when one asks for it, once a second at most, and is for all.
//!
//! The broker may be away or slow. What it does not take waits in the audience's log, within that log's bounds; what is dropped there is made up for by a whole
//! copy, as for any slow follower. Sessions never wait for it.

pub mod options;
mod presented;

use std::collections::HashMap;
use std::sync::Arc;
use std::time::{Duration, Instant};

use async_nats::Message;
use futures_util::StreamExt;
use tokio::task::AbortHandle;

use crate::broker::notes::{Ask, MAX_NAMES, Notice};
use crate::broker::{ASK_EVERY, Broker};
use crate::fault;
use crate::session::Shared;
use crate::session::link::is_over;
use presented::{Presented, Wants};

/// A relay that has not asked for so long is gone: it missed several.
const ASKED_FOR: Duration = ASK_EVERY.saturating_mul(10);
/// What is asked for is told again after this at the soonest, however many ask.
const NOTICE_EVERY: Duration = ASK_EVERY.checked_div(2).expect("two is not zero");

/// Publishes until the scene is no longer shown.
pub async fn run(shared: Arc<Shared>, broker: Broker) {
    let mut over = shared.over();
    let publishing = async {
        // What met a fault is made anew: to relays it is another server.
        while let Err(fault) = fault::caught_in(publish_on(&shared, &broker)).await {
            shared.house.stats.count_fault(&fault);
            tokio::time::sleep(ASK_EVERY).await;
        }
    };
    tokio::select! {
        () = publishing => {}
        _ = is_over(&mut over) => {}
    }
}

async fn publish_on(shared: &Arc<Shared>, broker: &Broker) {
    if let Err(error) = publish(shared, broker).await {
        tracing::error!("nothing is published: {error}");
    }
}

/// One whom relays follow.
struct Asked {
    at: Instant,
    wants: Arc<Wants>,
    task: AbortHandle,
}

impl Drop for Asked {
    fn drop(&mut self) {
        self.task.abort();
    }
}

async fn publish(shared: &Arc<Shared>, broker: &Broker) -> anyhow::Result<()> {
    let mut origin = [0; 8];
    getrandom::fill(&mut origin)?;
    let origin = u64::from_le_bytes(origin);
    let client = broker.connect(&format!("vantage-server of {}", shared.scene.name)).await?;
    let subjects = broker.subjects();
    let mut asks = client.subscribe(subjects.asks()).await?;
    tracing::info!(broker = %broker.address, channel = broker.channel, "what is presented is published where relays ask for it");
    let mut by_name: HashMap<String, Asked> = HashMap::new();
    let mut told_at: Option<Instant> = None;
    loop {
        let message = tokio::time::timeout(ASKED_FOR, asks.next()).await;
        by_name.retain(|_, asked| asked.at.elapsed() < ASKED_FOR && !asked.task.is_finished());
        let ask = match message {
            Err(_) => continue,
            Ok(None) => anyhow::bail!("the connection was given up"),
            Ok(Some(Message { payload, .. })) => match Ask::read(&payload) {
                Ok(ask) => ask,
                Err(error) => {
                    tracing::debug!("an ask that cannot be read: {error}");
                    continue;
                }
            },
        };
        for followed in ask.follows {
            let is_new = !by_name.contains_key(&followed.name);
            if is_new && (by_name.len() >= MAX_NAMES || !shared.audiences.has_presenter(&followed.name)) {
                continue;
            }
            let asked = by_name.entry(followed.name).or_insert_with_key(|name| {
                let (client, subjects, wants) = (client.clone(), subjects.clone(), Arc::<Wants>::default());
                let following = shared.audiences.follow(name);
                let presented =
                    Presented { name: name.clone(), origin, client, subjects, stats: shared.house.stats.clone() };
                let task = tokio::spawn(presented.publish(following, wants.clone())).abort_handle();
                Asked { at: Instant::now(), wants, task }
            });
            asked.at = Instant::now();
            if followed.whole {
                asked.wants.whole();
            }
        }
        if told_at.is_none_or(|at| at.elapsed() >= NOTICE_EVERY) {
            told_at = Some(Instant::now());
            let notice = Notice::new((origin, shared.now_s()), shared.welcome(), shared.audiences.presenters());
            client.publish(subjects.server(), notice.bytes().into()).await?;
        }
    }
}
