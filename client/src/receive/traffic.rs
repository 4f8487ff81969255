//! What crosses a socket, by kind of message.

use std::collections::BTreeMap;

use protocol::wire;
use serde::{Deserialize, Serialize};

/// Messages of one kind.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Count {
    /// How many; an update counts once for each of its fragments.
    pub messages: u64,
    /// Their bytes, without the websocket's own.
    pub bytes: u64,
}

/// Everything that a client has sent and received so far, by kind: `pose`, `update` and so on.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Traffic {
    /// To the server.
    pub sent: BTreeMap<String, Count>,
    /// From the server.
    pub received: BTreeMap<String, Count>,
}

/// What a malformed message counts as.
const MALFORMED: &str = "malformed";

impl Traffic {
    /// Counts a message to the server.
    pub fn send(&mut self, bytes: &[u8]) {
        add(&mut self.sent, wire::client_message_kind(bytes), bytes);
    }

    /// Counts a message from the server.
    pub fn receive(&mut self, bytes: &[u8]) {
        add(&mut self.received, wire::server_message_kind(bytes), bytes);
    }

    /// Bytes of all updates received.
    pub fn update_bytes(&self) -> u64 {
        self.received.get("update").map_or(0, |count| count.bytes)
    }

    /// Bytes of all messages: sent, and received.
    pub fn total_bytes(&self) -> (u64, u64) {
        let total = |counts: &BTreeMap<String, Count>| counts.values().map(|count| count.bytes).sum();
        (total(&self.sent), total(&self.received))
    }
}

fn add(counts: &mut BTreeMap<String, Count>, kind: Option<&str>, bytes: &[u8]) {
    let count = counts.entry(kind.unwrap_or(MALFORMED).to_owned()).or_default();
    count.messages += 1;
    count.bytes += bytes.len() as u64;
}
