//! What a server shows: nothing while its first scene is loaded, then that, later perhaps another one in its place, and nothing new once it is to stop.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use tokio::sync::watch;

use crate::session::{Over, Shared};

/// See the module.
#[derive(Default)]
pub(crate) struct Serving {
    /// What sessions of the scene share; `None` before there is one.
    shown: watch::Sender<Option<Arc<Shared>>>,
    /// How far loading the first one is.
    said: Mutex<String>,
    drains: AtomicBool,
}

impl Serving {
    /// Says how far loading is.
    pub(crate) fn says(&self, said: String) {
        *self.said.lock().unwrap_or_else(PoisonError::into_inner) = said;
    }

    /// New sessions are of this scene. Those of the one before are told to come again.
    pub(crate) fn show(&self, shared: Arc<Shared>) {
        if let Some(before) = self.shown.send_replace(Some(shared)) {
            before.end(Over::Replaced);
        }
    }

    /// Lets nobody in any more, and tells all sessions that they are over.
    pub(crate) fn drain(&self) {
        self.drains.store(true, Ordering::SeqCst);
        self.shown.borrow().iter().for_each(|shared| shared.end(Over::Stops));
    }

    /// The scene, or what to tell who comes too early.
    pub(crate) fn shared(&self) -> Result<Arc<Shared>, String> {
        self.shown.borrow().clone().ok_or_else(|| {
            let said = self.said.lock().unwrap_or_else(PoisonError::into_inner);
            if said.is_empty() {
                "the scene is being loaded".to_owned()
            } else {
                format!("the scene is being loaded: {said}")
            }
        })
    }

    /// The scene for a new session, or what to tell who comes too early, or too late.
    pub(crate) fn open(&self) -> Result<Arc<Shared>, String> {
        if self.drains.load(Ordering::SeqCst) { Err(DRAINING.to_owned()) } else { self.shared() }
    }

    /// Waits until the scene that is shown can be drawn no more, and says why.
    pub(crate) async fn failed(&self) -> String {
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

/// What is said once nobody is let in any more.
pub(crate) const DRAINING: &str = "draining: the server stops";
