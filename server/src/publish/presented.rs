//! One presenter, published while relays ask for him.

use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use async_nats::Client;
use bytes::Bytes;
use protocol::wire::PackedUpdate;
use tokio::sync::Notify;

use crate::audience::Following;
use crate::broker::pieces::{LARGEST_BYTES, piece};
use crate::broker::{Kind, Subjects};
use crate::session::link::EYE_INTERVAL_S;
use crate::stats::Stats;

/// Between two whole copies at least.
const WHOLE_EVERY: Duration = Duration::from_secs(1);

/// What relays want of him beside all that is new.
#[derive(Debug, Default)]
pub(super) struct Wants {
    whole: Notify,
}

impl Wants {
    /// The whole copy of now. Who asks too early asks again.
    pub fn whole(&self) {
        self.whole.notify_one();
    }
}

/// Who is published, and where.
pub(super) struct Presented {
    pub name: String,
    /// This run of the server.
    pub origin: u64,
    pub client: Client,
    pub subjects: Subjects,
    pub stats: Arc<Stats>,
}

impl Presented {
    /// Publishes until the connection is given up.
    pub async fn publish(self, mut following: Following, wants: Arc<Wants>) {
        let [updates, whole, eye] =
            [Kind::Updates, Kind::Whole, Kind::Eye].map(|kind| self.subjects.of(&self.name, kind));
        let counts = &self.stats.published;
        let (mut whole_at, mut awaits_whole) = (None::<Instant>, false);
        let (mut eye_at, eye_every) = (None::<Instant>, Duration::from_secs_f64(EYE_INTERVAL_S));
        // Who asks first asks for the whole copy, too.
        following.skip();
        loop {
            while let Some(update) = following.next_update() {
                counts.updates.fetch_add(1, Ordering::Relaxed);
                if self.update(&updates, &update).await.is_none() {
                    return;
                }
            }
            if awaits_whole && let Some(copy) = following.whole() {
                (whole_at, awaits_whole) = (Some(Instant::now()), false);
                counts.wholes.fetch_add(1, Ordering::Relaxed);
                if self.update(&whole, &copy).await.is_none() {
                    return;
                }
            }
            let eye_in = eye_at.map_or(Duration::ZERO, |at| eye_every.saturating_sub(at.elapsed()));
            if eye_in.is_zero()
                && let Some(messages) = following.eye()
            {
                eye_at = Some(Instant::now());
                if self.messages(&eye, &messages).await.is_none() {
                    return;
                }
            }
            tokio::select! {
                () = following.changed() => {}
                () = tokio::time::sleep(eye_in), if !eye_in.is_zero() => {}
                () = wants.whole.notified() => {
                    if !awaits_whole && whole_at.is_none_or(|at| at.elapsed() >= WHOLE_EVERY) {
                        awaits_whole = true;
                        following.ask_whole();
                    }
                }
            }
        }
    }

    async fn update(&self, subject: &str, update: &PackedUpdate) -> Option<()> {
        self.messages(subject, &update.fragments).await
    }

    /// Publishes messages of the protocol; `None` where the connection is given up.
    async fn messages(&self, subject: &str, messages: &[Bytes]) -> Option<()> {
        let most = self.client.max_payload();
        if most < LARGEST_BYTES {
            tracing::warn!(
                "nothing is published: the broker takes messages of {most} bytes, {LARGEST_BYTES} are needed"
            );
            return Some(());
        }
        for message in messages {
            let piece = piece(self.origin, message);
            self.stats.published.bytes.fetch_add(piece.len() as u64, Ordering::Relaxed);
            self.client.publish(subject.to_owned(), piece).await.ok()?;
        }
        Some(())
    }
}
