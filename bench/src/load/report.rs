//! What came of a run, for programs and people.

use std::collections::BTreeMap;

use protocol::message::Welcome;
use serde::Serialize;
use serde_json::Value;

use super::client::ClientReport;
use super::percentiles::Percentiles;
use super::script::Behaviour;
use super::series::{self, Counts, Second, Timed, values_ms};
use super::watch::Cost;
use crate::report::Bar;

/// What came of a run.
#[derive(Debug, Default, Serialize)]
pub struct Report {
    /// The server.
    pub server: String,
    /// What the clients did.
    pub script: String,
    /// What the server's `/healthz` said at the end; null where it could not be asked.
    pub health: Value,
    /// What the server greeted its first client with.
    pub welcome: Option<Welcome>,
    /// How long the clients ran.
    pub seconds: f64,
    /// Updates held or, by who does not decode, acknowledged, by all clients.
    pub updates: u64,
    /// Bytes received, by all clients.
    pub bytes: u64,
    /// From an open connection to the first update held, of all visits but those of clients that stall.
    pub first_update_ms: Percentiles,
    /// From sending a pose to having decoded the update that answers it, of all clients but those that stall.
    pub latency_ms: Percentiles,
    /// From the server's stamp of an update to its last byte at the client, of the same; on the wall clock.
    pub lag_ms: Percentiles,
    /// Time between two updates, of the same.
    pub interval_ms: Percentiles,
    /// The worst client's longest interval by its own mean.
    pub worst_interval_by_mean: f64,
    /// Resident memory of the server when nobody was connected, and its growth a client; where it tells.
    pub server_memory: Option<Memory>,
    /// The same of this process; where the system tells.
    pub load_memory: Option<Memory>,
    /// Processor seconds a second of this process while clients ran; where the system tells.
    pub load_cores: Option<f64>,
    /// FLIP over covered pixels of what the first clients held at moments of the run, where the scene is told.
    pub flip_covered: Vec<f64>,
    /// How many clients ended by an error.
    pub errors: usize,
    /// How many ended well, but got no update.
    pub empty_handed: usize,
    /// How often clients came back.
    pub reconnections: u64,
    /// What the run was to reach.
    pub bars: Vec<Bar>,
    /// The run second by second.
    pub over_time: Vec<Second>,
    /// Every client.
    pub clients: Vec<ClientReport>,
}

/// Memory of a process.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct Memory {
    /// Before the clients came.
    pub before_bytes: u64,
    /// While all were served.
    pub during_bytes: u64,
    /// The difference by the number of clients.
    pub per_client_bytes: u64,
}

impl Memory {
    pub(super) fn of(before_bytes: Option<u64>, during_bytes: Option<u64>, clients: usize) -> Option<Memory> {
        let (before_bytes, during_bytes) = before_bytes.zip(during_bytes)?;
        let per_client_bytes = during_bytes.saturating_sub(before_bytes) / clients.max(1) as u64;
        Some(Memory { before_bytes, during_bytes, per_client_bytes })
    }
}

impl Report {
    /// The figures that clients give.
    pub(super) fn of(clients: Vec<ClientReport>) -> Report {
        let sum = |of: fn(&ClientReport) -> u64| clients.iter().map(of).sum();
        let values = |of| values_ms(&measured(&clients, of)).collect();
        Report {
            updates: sum(|client| client.updates),
            bytes: sum(|client| client.bytes),
            first_update_ms: Percentiles::of(values(|client| &client.first_updates)),
            latency_ms: Percentiles::of(values(|client| &client.latencies)),
            lag_ms: Percentiles::of(values(|client| &client.lags)),
            interval_ms: Percentiles::of(values(|client| &client.intervals)),
            worst_interval_by_mean: undisturbed(&clients)
                .map(ClientReport::longest_interval_by_mean)
                .fold(f64::NAN, f64::max),
            errors: clients.iter().filter(|client| client.error.is_some()).count(),
            empty_handed: clients.iter().filter(|client| client.error.is_none() && client.updates == 0).count(),
            reconnections: sum(|client| client.reconnections),
            clients,
            ..Report::default()
        }
    }

    /// What the run cost the server and this process.
    pub(super) fn tell_costs(&mut self, before: &Cost, during: Cost) {
        let clients = self.clients.len();
        self.server_memory = Memory::of(before.server_bytes(), during.server_bytes(), clients);
        self.load_memory = Memory::of(before.load_bytes, during.load_bytes, clients);
        self.load_cores = during.cores_since(before);
        self.health = during.health;
    }

    /// What was measured in each second.
    pub(super) fn tell_seconds(&mut self, counts: &[Counts]) {
        let measured = |of| measured(&self.clients, of);
        self.over_time =
            series::seconds(counts, measured(|client| &client.latencies), measured(|client| &client.intervals));
    }

    /// Why clients ended early: what, and how many; the most frequent first.
    pub fn errors_by_cause(&self) -> Vec<(&str, usize)> {
        let mut counts = BTreeMap::new();
        for cause in self.clients.iter().filter_map(|client| client.error.as_deref()) {
            *counts.entry(cause).or_default() += 1;
        }
        let mut counts: Vec<_> = counts.into_iter().collect();
        counts.sort_by_key(|(_, count)| std::cmp::Reverse(*count));
        counts
    }
}

/// Those whose updates are late by the server's or the network's doing alone.
fn undisturbed(clients: &[ClientReport]) -> impl Iterator<Item = &ClientReport> {
    clients.iter().filter(|client| client.behaviour != Behaviour::Stall)
}

/// A measure of all of them.
fn measured(clients: &[ClientReport], of: fn(&ClientReport) -> &Vec<Timed>) -> Vec<Timed> {
    undisturbed(clients).flat_map(|client| of(client).iter().copied()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn client(behaviour: Behaviour, interval_ms: f64, updates: u64, error: Option<&str>) -> ClientReport {
        let intervals = vec![Timed { at_s: 1.0, ms: interval_ms }];
        let error = error.map(str::to_owned);
        ClientReport { behaviour, intervals, updates, error, bytes: 10, reconnections: 2, ..ClientReport::default() }
    }

    #[test]
    fn who_stalls_is_counted_but_not_timed() {
        let clients = vec![
            client(Behaviour::Walk, 50.0, 7, None),
            client(Behaviour::Stall, 3000.0, 3, None),
            client(Behaviour::Idle, 70.0, 0, None),
            client(Behaviour::Reconnect, 60.0, 0, Some("gone")),
            client(Behaviour::Walk, 60.0, 1, Some("full")),
            client(Behaviour::Walk, 60.0, 1, Some("gone")),
        ];
        let report = Report::of(clients);
        assert_eq!((report.interval_ms.p50, report.interval_ms.max), (60.0, 70.0));
        assert!(report.latency_ms.p99.is_nan());
        assert_eq!((report.updates, report.bytes, report.reconnections), (12, 60, 12));
        assert_eq!((report.errors, report.empty_handed), (3, 1));
        assert_eq!(report.errors_by_cause(), [("gone", 2), ("full", 1)]);
    }

    #[test]
    fn memory_is_shared_by_clients() {
        let memory = Memory::of(Some(1000), Some(5000), 4).expect("both are known");
        assert_eq!(memory.per_client_bytes, 1000);
        assert_eq!(Memory::of(Some(5000), Some(1000), 0).map(|memory| memory.per_client_bytes), Some(0));
        assert!(Memory::of(None, Some(1), 1).is_none());
    }
}
