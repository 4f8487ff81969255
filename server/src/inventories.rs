//! What is made for each session, for `/plan` and for who asks.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use protocol::Inventory;

/// Of each session that runs, by its number.
#[derive(Debug, Default)]
pub struct Inventories {
    of_sessions: Mutex<BTreeMap<u64, Arc<Inventory>>>,
}

impl Inventories {
    /// What is made for a session now.
    pub fn put(&self, session: u64, inventory: &Arc<Inventory>) {
        self.lock().insert(session, inventory.clone());
    }

    /// A session ended.
    pub fn end(&self, session: u64) {
        self.lock().remove(&session);
    }

    /// What is made for a session; `None` before its first look.
    pub fn of(&self, session: u64) -> Option<Inventory> {
        self.lock().get(&session).map(|inventory| (**inventory).clone())
    }

    /// As JSON, for `/plan`.
    pub fn json(&self) -> serde_json::Value {
        let session = |(number, inventory): (&u64, &Arc<Inventory>)| serde_json::json!({ "session": number, "parts": inventory.parts });
        self.lock().iter().map(session).collect()
    }

    fn lock(&self) -> MutexGuard<'_, BTreeMap<u64, Arc<Inventory>>> {
        self.of_sessions.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
