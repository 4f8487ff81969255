//! What a client does from when it comes to when the run ends: one visit, or several.

use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Duration;

use super::client::{Client, ClientReport, Shared};
use super::series::values_ms;
use super::visit::{Left, Visit};

/// Whoever left in a storm is away for at least this long, and for at most as long again.
const AWAY: Duration = Duration::from_millis(250);

/// Runs one client from when it comes to its end; a failure is part of its report.
pub(super) async fn run(shared: Arc<Shared>, client: Client) -> ClientReport {
    tokio::time::sleep(Duration::from_secs_f64(client.comes_s)).await;
    let mut seen = ClientReport { index: client.index, behaviour: client.behaviour, ..ClientReport::default() };
    if let Err(error) = visits(&shared, client, &mut seen).await {
        shared.counters.errors.fetch_add(1, Ordering::Relaxed);
        seen.error = Some(format!("{error:#}"));
    }
    seen.mean_interval_ms = values_ms(&seen.intervals).sum::<f64>() / seen.intervals.len() as f64;
    seen.max_interval_ms = values_ms(&seen.intervals).fold(f64::NAN, f64::max);
    seen
}

/// One visit after the other, as storms will have it.
async fn visits(shared: &Shared, client: Client, seen: &mut ClientReport) -> anyhow::Result<()> {
    while Visit::run(shared, client, seen).await? == Left::InStorm {
        // The same clients come back in the same order, spread over the time.
        let share = (client.index as f64 * 0.618).fract();
        tokio::time::sleep(AWAY + AWAY.mul_f64(share)).await;
        if shared.now_s() >= client.ends_s {
            break;
        }
        seen.reconnections += 1;
    }
    Ok(())
}
