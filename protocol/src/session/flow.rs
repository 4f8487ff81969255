//! What is on its way to a client, and how much may be.
//!
//! The estimates follow BBR (Cardwell et al., BBR: Congestion-Based Congestion Control, ACM Queue 14(5), 2016): bandwidth is the
//! largest delivery rate of the last seconds, the delay is the smallest time from sending to acknowledgement, and their
//! product, grown a little so that a faster path is found, is what may be unacknowledged. Only *decoded* updates are
//! acknowledged, so a slow decoder holds the server back just as a slow path does.

use std::collections::VecDeque;

/// What may be unacknowledged before anything is known: a first picture at low resolution.
const FIRST_WINDOW_BYTES: f64 = 64.0 * 1024.0;
/// What may be unacknowledged at least, once the path is known: a few small updates, so that their rate can still grow.
const LEAST_WINDOW_BYTES: f64 = 16.0 * 1024.0;
/// BBR's probing gain.
const GAIN: f64 = 1.25;
/// BBR's window for both estimates.
const REMEMBER_S: f64 = 10.0;
/// Share of a new delay in the smoothed one (RFC 6298).
const SMOOTHING: f64 = 0.125;

/// An update that is not acknowledged yet.
#[derive(Debug, Clone)]
struct InFlight {
    number: u64,
    digest: u64,
    /// Bytes of bulk sent up to its end.
    end_bytes: u64,
    sent_at_s: f64,
    /// Acknowledged when it was sent, and when that was.
    acked_bytes: u64,
    acked_at_s: f64,
    /// Whether the path could have taken more.
    source_limited: bool,
}

/// What an acknowledgement turned out to be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Acked {
    /// In order.
    Update {
        /// Seconds from its sending.
        delay_s: f64,
    },
    /// Of something acknowledged or given up before.
    Old,
    /// The client's copy differs.
    DigestDiffers,
    /// Of something never sent.
    NeverSent,
}

#[derive(Debug, Default)]
pub(super) struct Flow {
    sent_bytes: u64,
    last_number: u64,
    acked_bytes: u64,
    acked_at_s: f64,
    in_flight: VecDeque<InFlight>,
    smoothed_delay_s: Option<f64>,
    last_delay_s: f64,
    fastest_s: Option<f64>,
    delays_s: VecDeque<(f64, f64)>,
    rates: VecDeque<(f64, f64)>,
}

impl Flow {
    pub fn sent(&mut self, number: u64, digest: u64, bytes: usize, now_s: f64) {
        if self.in_flight.is_empty() {
            self.acked_at_s = now_s;
        }
        self.sent_bytes += bytes as u64;
        self.last_number = number;
        self.in_flight.push_back(InFlight {
            number,
            digest,
            end_bytes: self.sent_bytes,
            sent_at_s: now_s,
            acked_bytes: self.acked_bytes,
            acked_at_s: self.acked_at_s,
            source_limited: (self.in_flight_bytes() as f64) < self.window_bytes(),
        });
    }

    pub fn acked(&mut self, number: u64, digest: u64, bytes_received: u64, now_s: f64) -> Acked {
        if number > self.last_number || bytes_received > self.sent_bytes {
            return Acked::NeverSent;
        }
        let Some(index) = self.in_flight.iter().position(|update| update.number == number) else { return Acked::Old };
        let update = self.in_flight.drain(..=index).next_back().expect("its own index is in range");
        if update.digest != digest {
            return Acked::DigestDiffers;
        }
        self.acked_bytes = self.acked_bytes.max(update.end_bytes);
        self.acked_at_s = now_s;
        let delay_s = (now_s - update.sent_at_s).max(0.0);
        self.smoothed_delay_s = Some(self.smoothed_delay_s.map_or(delay_s, |old| old + SMOOTHING * (delay_s - old)));
        self.last_delay_s = delay_s;
        self.fastest_s = Some(self.fastest_s.map_or(delay_s, |fastest_s| fastest_s.min(delay_s)));
        remember(&mut self.delays_s, now_s, delay_s);
        // Never divides by 0: what is read at once is acknowledged at one time. Chosen: no update goes there, is decoded and is answered in less than 0.1 ms. With a tenth of
        // it 64 KiB might count as 50 Gbit/s for as long as rates are remembered; with ten times it paths that answer within a millisecond count as too slow.
        let rate = (self.acked_bytes - update.acked_bytes) as f64 / (now_s - update.acked_at_s).max(1e-4);
        if !update.source_limited || self.bytes_per_s().is_none_or(|known| rate > known) {
            remember(&mut self.rates, now_s, rate);
        }
        Acked::Update { delay_s }
    }

    /// Nothing was sent yet, and the client holds the updates up to this one.
    pub fn goes_on_after(&mut self, number: u64) {
        self.last_number = number;
    }

    /// Gives up what is in flight: the client begins anew.
    pub fn forget(&mut self) {
        self.in_flight.clear();
        self.acked_bytes = self.sent_bytes;
    }

    pub fn in_flight_bytes(&self) -> u64 {
        self.sent_bytes - self.acked_bytes
    }

    /// What may be in flight; at least one update whatever its size.
    pub fn window_bytes(&self) -> f64 {
        let delay_s = self.delays_s.iter().map(|&(_, delay_s)| delay_s).reduce(f64::min);
        match (self.bytes_per_s(), delay_s) {
            (Some(bytes_per_s), Some(delay_s)) => (GAIN * bytes_per_s * delay_s).max(LEAST_WINDOW_BYTES),
            _ => FIRST_WINDOW_BYTES,
        }
    }

    pub fn has_credit(&self) -> bool {
        self.in_flight.is_empty() || (self.in_flight_bytes() as f64) < self.window_bytes()
    }

    /// The path's throughput; `None` before the first acknowledgement.
    pub fn bytes_per_s(&self) -> Option<f64> {
        self.rates.iter().map(|&(_, rate)| rate).reduce(f64::max)
    }

    /// How much longer the last update took than the fastest of all: on a path that is always full, none of the last seconds was fast.
    pub fn queue_s(&self) -> f64 {
        self.fastest_s.map_or(0.0, |fastest_s| self.last_delay_s - fastest_s)
    }

    /// From the sending of an update to its acknowledgement, smoothed.
    pub fn round_trip_s(&self) -> Option<f64> {
        self.smoothed_delay_s
    }

    /// Whether something waits to be acknowledged, and since when nothing was.
    pub fn waiting_since_s(&self) -> Option<f64> {
        self.in_flight.front().map(|oldest| oldest.sent_at_s.max(self.acked_at_s))
    }
}

fn remember(values: &mut VecDeque<(f64, f64)>, now_s: f64, value: f64) {
    while values.len() > 1 && values[0].0 < now_s - REMEMBER_S {
        values.pop_front();
    }
    values.push_back((now_s, value));
}
