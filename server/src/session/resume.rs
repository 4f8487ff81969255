//! Going on with a session after its connection was cut off.

use protocol::message::{Resume, Role};

use super::Connection;
use super::end::End;
use super::kept::{GIVES_WAY_WITHIN, Left};
use crate::worker::Served;

impl Connection<'_> {
    /// Goes on with the session that a client was cut off from, or begins anew where nothing is left of it.
    pub(super) async fn resume(&mut self, held: Resume) {
        let left = self.shared.house.kept.take_over(&mut self.name, held.secret).await;
        let (now_s, secret) = (self.shared.now_s(), self.name.secret);
        // What a presenter was sent his followers hold too: he begins anew, as soon as the session that was cut off has let his name go.
        let Some(Left { client, trail }) = left.filter(|_| *self.link.session.role() == Role::Viewer) else {
            tracing::info!(peer = %self.link.peer, "comes back, and nothing is left of its session");
            self.link.session.resume(secret, None, now_s);
            return;
        };
        let bytes = trail.bytes();
        if self.link.session.resume(secret, Some(trail), now_s) {
            tracing::info!(peer = %self.link.peer, bytes, "comes back and goes on");
            self.shared.house.stats.resumed.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
            self.link.audit.resumed = true;
            self.client = Some(client);
        } else {
            tracing::info!(peer = %self.link.peer, "comes back with another copy: it begins anew");
        }
    }

    /// Leaves what there is of the session to whoever goes on with it.
    pub(super) async fn leave(&mut self, end: End) -> End {
        let shared = self.shared;
        let is_resumed = matches!(end, End::Resumed(_));
        if is_resumed || end.may_come_back() {
            // Whoever comes back needs them before this connection's goodbye is through.
            (self.link.place, self.presenting) = (None, None);
        }
        let left = if is_resumed || end.may_come_back() { self.left_over().await } else { None };
        match (end, left) {
            (End::Resumed(gives), left) => {
                if let Some(left) = left {
                    // Where it waits no longer, nobody does.
                    drop(gives.send(left));
                }
                End::Closed
            }
            (end, Some(left)) => {
                if let Some(left) = shared.house.kept.keep(&self.name, left)
                    && let Ok(Ok(gives)) = tokio::time::timeout(GIVES_WAY_WITHIN, &mut self.give_way).await
                {
                    drop(gives.send(left));
                }
                end
            }
            (end, None) => {
                shared.house.kept.forget(&self.name);
                end
            }
        }
    }

    /// What is left of a viewer's session, with the update that is being made; `None` where that leads nowhere.
    async fn left_over(&mut self) -> Option<Left> {
        let mut leads_on = !self.start_anew && *self.link.session.role() == Role::Viewer;
        if let Some(turn) = self.turn.take() {
            let Served { client, update } = turn.await.ok()?;
            if let Some(made) = update {
                leads_on &= self.link.session.missed(&made.update.packed(self.shared.now_s()));
            }
            self.client = Some(client);
        }
        let client = self.client.take().filter(|client| client.asked.is_none() && client.account.held().number > 0)?;
        leads_on.then(|| Left { client, trail: self.link.session.take_trail() })
    }
}
