//! The scene that who names none gets: nothing while it is loaded, then that, later perhaps another one in its place.

use std::sync::{Arc, Mutex, PoisonError};

use tokio::sync::watch;

use super::not_open::loading;
use crate::session::{Over, Shared};

/// See the module.
#[derive(Default)]
pub(super) struct Slot {
    /// What sessions of the scene share; `None` before there is one.
    shown: watch::Sender<Option<Arc<Shared>>>,
    /// How far loading the first one is.
    said: Mutex<String>,
}

impl Slot {
    /// Says how far loading is.
    pub fn says(&self, said: String) {
        *self.said.lock().unwrap_or_else(PoisonError::into_inner) = said;
    }

    /// New sessions are of this scene. Those of the one before are told to come again.
    pub fn show(&self, shared: Arc<Shared>) {
        if let Some(before) = self.shown.send_replace(Some(shared)) {
            before.end(Over::Replaced);
        }
    }

    /// Tells all sessions that they are over.
    pub fn end(&self, over: Over) {
        self.shown.borrow().iter().for_each(|shared| shared.end(over));
    }

    /// The scene, or what to tell who comes too early.
    pub fn shared(&self) -> Result<Arc<Shared>, String> {
        let said = || loading(&self.said.lock().unwrap_or_else(PoisonError::into_inner));
        self.shown.borrow().clone().ok_or_else(said)
    }

    /// Waits until the scene that is shown can be drawn no more, and says why.
    pub async fn failed(&self) -> String {
        let mut shown = self.shown.subscribe();
        loop {
            let Some(mut failure) = shown.borrow_and_update().as_ref().map(|shared| shared.worker.failure()) else {
                std::future::pending().await
            };
            let reason = tokio::select! {
                changed = shown.changed() => match changed {
                    Ok(()) => continue,
                    Err(_) => std::future::pending().await,
                },
                reason = failure.wait_for(Option::is_some) => reason.ok().and_then(|reason| reason.clone()),
            };
            return reason.unwrap_or_else(|| "the rendering thread ended".to_owned());
        }
    }
}
