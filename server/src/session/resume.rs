//! Going on with a session after its connection was cut off.

use protocol::message::{Resume, Role};
use protocol::session::SessionError;

use super::kept::{GIVES_WAY_WITHIN, Left};
use super::{Connection, End};
use crate::worker::Served;

impl End {
    /// Whether the client may be one that was cut off.
    fn may_come_back(&self) -> bool {
        matches!(
            self,
            End::Closed
                | End::Lost(_)
                | End::NotReading
                | End::Session(SessionError::Silent { .. } | SessionError::Stalled { .. })
        )
    }
}

impl Connection<'_> {
    /// Goes on with the session that a client was cut off from, or begins anew where nothing is left of it.
    pub(super) async fn resume(&mut self, held: Resume) {
        let left = self.shared.kept.take(held.secret).await;
        let now_s = self.shared.now_s();
        let Some(Left { client, trail }) = left else {
            tracing::info!(peer = %self.peer, "comes back, and nothing is left of its session");
            self.session.resume(None, now_s);
            return;
        };
        let bytes = trail.bytes();
        if self.session.resume(Some(trail), now_s) {
            tracing::info!(peer = %self.peer, bytes, "comes back and goes on");
            self.shared.stats.resumed.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
            self.client = Some(client);
        } else {
            tracing::info!(peer = %self.peer, "comes back with another copy: it begins anew");
        }
    }

    /// Leaves what there is of the session to whoever goes on with it.
    pub(super) async fn leave(&mut self, end: End) -> End {
        let kept = &self.shared.kept;
        if !(end.may_come_back() || matches!(end, End::Resumed(_))) || *self.session.role() != Role::Viewer {
            kept.forget(self.secret);
            return end;
        }
        match (end, self.left_over().await) {
            (End::Resumed(gives), Some(left)) => {
                // Where it waits no longer, nobody does.
                drop(gives.send(left));
                End::Closed
            }
            (end, Some(left)) => {
                if let Some(left) = kept.keep(self.secret, left)
                    && let Ok(Ok(gives)) = tokio::time::timeout(GIVES_WAY_WITHIN, &mut self.give_way).await
                {
                    drop(gives.send(left));
                }
                end
            }
            (end, None) => {
                kept.forget(self.secret);
                end
            }
        }
    }

    /// What is left of the session, with the update that is being made; `None` where that leads nowhere.
    async fn left_over(&mut self) -> Option<Left> {
        if let Some(turn) = self.turn.take() {
            let Served { client, update } = turn.await.ok()?;
            if let Some(made) = update {
                self.session.missed(&made.update.packed(self.shared.now_s()));
            }
            self.client = Some(client);
        }
        let client = self.client.take().filter(|client| client.asked.is_none() && client.account.held().number > 0)?;
        (!self.start_anew).then(|| Left { client, trail: self.session.take_trail() })
    }
}
