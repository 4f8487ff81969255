//! The threads that make bytes of updates.

use std::sync::{Mutex, PoisonError, mpsc};
use std::time::Instant;

use super::turn::{Made, NotServed, Served, Unencoded};
use crate::fault::caught;
use crate::frame;
use crate::look_times::Part;
use crate::plan::Reason;
use crate::stats::Stats;

/// The next update to encode; `None` once no thread looks any more.
fn next_to_encode(queue: &Mutex<mpsc::Receiver<Unencoded>>) -> Option<Unencoded> {
    // Who panics while he waits leaves the queue as it is.
    queue.lock().unwrap_or_else(PoisonError::into_inner).recv().ok()
}

/// Encodes until no thread looks any more.
pub(super) fn encode_updates(queue: &Mutex<mpsc::Receiver<Unencoded>>, stats: &Stats) {
    while let Some(Unencoded { made, look, mut client, reply }) = next_to_encode(queue) {
        let started = Instant::now();
        let update = match caught(|| made.encoded()) {
            Ok(update) => update,
            Err(fault) => {
                stats.count_fault(&fault);
                drop(reply.send(Err(NotServed::Fault(fault))));
                continue;
            }
        };
        let frame::Made { reason, counts, pixels, lights, .. } = made;
        stats.look_times.add(Part::Encode, started.elapsed());
        let light_bytes = update.bytes_of(lights.edits);
        stats.count_look(reason);
        stats.lights.count(&counts.lights, light_bytes, lights.took);
        if reason.is_passing() {
            client.pace.made(update.bytes.len(), pixels);
        } else if reason == Reason::Rest {
            client.rest.coded(update.bytes.len());
        } else if reason == Reason::Ahead {
            client.ahead.sent(update.bytes.len(), pixels);
            stats.ahead.count(counts.ahead, update.bytes.len());
        }
        let made = Made { update, reason, counts, light_bytes, look, encode: started.elapsed() };
        // A client that left meanwhile needs no answer.
        drop(reply.send(Ok(Served { client, update: Some(made) })));
    }
}
