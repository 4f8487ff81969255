//! What is on its way to a client, and how much may be.
//!
//! The estimates follow BBR (Cardwell et al., BBR: Congestion-Based Congestion Control, ACM Queue 14(5), 2016): bandwidth is the
//! largest delivery rate of the last seconds, the delay is the smallest time from sending to acknowledgement, and their
//! product, and an update, both grown a little so that a faster path is found, are what may be unacknowledged. An update is much to a slow path: the delay is less what the
//! update itself took of it. Only *decoded* updates are
//! acknowledged, so a slow decoder holds the server back just as a slow path does.
//!
//! On a path that is always full every update waits for those before it, and the smallest delay of the last seconds is that of the queue. So now and then nothing is sent until
//! all is acknowledged, as BBR does (its ProbeRTT): the next update waits for nothing, and tells what the path itself takes.
//!
//! Many paths let some bytes through at once and only then keep to their rate (token buckets, of shapers and of radios). Small updates then tell of a bandwidth that there is not,
//! and a large one would take seconds. So where an update took long lately, bandwidth is what came in a second and a half at least.

use std::collections::VecDeque;

/// What may be unacknowledged before anything is known: a first picture at low resolution.
const FIRST_WINDOW_BYTES: f64 = 64.0 * 1024.0;
/// What may be unacknowledged at least, once the path is known: a few small updates, so that their rate can still grow.
const LEAST_WINDOW_BYTES: f64 = 8.0 * 1024.0;
/// Not where the last update took so much longer than the fastest: of a path of 100 kbit/s that window would be most of a second, and all of it would be filled.
const LEAST_WINDOW_WITHIN_S: f64 = 0.1;
/// BBR's probing gain.
const GAIN: f64 = 1.25;
/// How much faster than its bandwidth the path is tried with, update after update: BBR's cycle. What the first one queues, the second one lets go.
const PROBING: [f64; 8] = [GAIN, 1.0 / GAIN, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0];
/// BBR's window for the delay.
const REMEMBER_S: f64 = 10.0;
/// Its window for the bandwidth, in round trips; and what it is at least and at most: a radio's bandwidth halves within seconds.
const REMEMBER_ROUND_TRIPS: f64 = 10.0;
const REMEMBER_RATES_S: std::ops::RangeInclusive<f64> = 2.0..=10.0;
/// The path is let run empty when it was not for so many seconds: at a round trip of 0.3 s it stands idle for a twenty-fifth of the time. Less than delays are remembered for.
const DRAIN_AFTER_S: f64 = 8.0;
/// An update that took longer, about what one may take, says that the path is slow, for so many seconds.
const SLOW_S: f64 = 0.5;
const SLOW_FOR_S: f64 = 60.0;
/// Its bandwidth is then taken over such a time at least: over less, one update more or less counts for too much, and the largest of many rates is that of the most.
const SPELL_S: f64 = 1.5;
/// Share of a new delay in the smoothed one (RFC 6298).
const SMOOTHING: f64 = 0.125;
/// The same of an update's size.
const SIZE_SMOOTHING: f64 = 0.25;

/// After so many acknowledgements a path's rate counts as known.
const LEAST_DELAYS: usize = 4;

/// An update that is not acknowledged yet.
#[derive(Debug, Clone)]
struct InFlight {
    number: u64,
    digest: u64,
    bytes: usize,
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
    /// With the sizes of their updates.
    delays_s: VecDeque<(f64, (f64, usize))>,
    rates: VecDeque<(f64, f64)>,
    /// Bytes that were acknowledged by then, for [`SPELL_S`] and the update before that.
    acks: VecDeque<(f64, u64)>,
    /// When the path was slow last.
    slow_at_s: Option<f64>,
    /// Of an update, smoothed.
    size_bytes: Option<f64>,
    /// When an update was sent last that waited for none before it.
    alone_at_s: f64,
    drains: bool,
    /// When the path has taken all that was sent, at the rate that it is tried with.
    frees_at_s: f64,
}

impl Flow {
    pub fn sent(&mut self, number: u64, digest: u64, bytes: usize, now_s: f64) {
        if self.in_flight.is_empty() {
            (self.acked_at_s, self.alone_at_s, self.frees_at_s, self.drains) = (now_s, now_s, now_s, false);
        }
        let size_bytes = bytes as f64;
        let gain = PROBING[(number % PROBING.len() as u64) as usize];
        let taken_s = self.bytes_per_s().map_or(0.0, |bytes_per_s| size_bytes / (gain * bytes_per_s));
        self.frees_at_s = self.frees_at_s.max(now_s) + taken_s;
        self.size_bytes = Some(self.size_bytes.map_or(size_bytes, |old| old + SIZE_SMOOTHING * (size_bytes - old)));
        self.sent_bytes += bytes as u64;
        self.last_number = number;
        self.in_flight.push_back(InFlight {
            number,
            digest,
            bytes,
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
        remember(&mut self.delays_s, now_s, (delay_s, update.bytes), REMEMBER_S);
        let delays_s = self.delays_s.iter().map(|&(_, (delay_s, _))| delay_s);
        let least_s = delays_s.reduce(f64::min).unwrap_or(delay_s);
        self.drains = now_s - self.alone_at_s > DRAIN_AFTER_S;
        if delay_s > SLOW_S {
            self.slow_at_s = Some(now_s);
        }
        let rate = self.rate(&update, now_s);
        remember(&mut self.acks, now_s, self.acked_bytes, 2.0 * SPELL_S);
        if !update.source_limited || self.bytes_per_s().is_none_or(|known| rate > known) {
            let remember_s = (REMEMBER_ROUND_TRIPS * least_s).clamp(*REMEMBER_RATES_S.start(), *REMEMBER_RATES_S.end());
            remember(&mut self.rates, now_s, rate, remember_s);
        }
        Acked::Update { delay_s }
    }

    /// What the path carried a second while an update was on its way that was acknowledged now.
    fn rate(&self, update: &InFlight, now_s: f64) -> f64 {
        let (mut since_s, mut before_bytes) = (update.acked_at_s, update.acked_bytes);
        // Never divides by 0: what is read at once is acknowledged at one time. Chosen: no update goes there, is decoded and is answered in less than 0.1 ms. With a tenth of
        // it 64 KiB might count as 50 Gbit/s for as long as rates are remembered; with ten times it paths that answer within a millisecond count as too slow.
        let mut least_s = 1e-4;
        let is_slow = self.slow_at_s.is_some_and(|at_s| now_s - at_s < SLOW_FOR_S);
        if is_slow && now_s - since_s < SPELL_S {
            least_s = SPELL_S;
            let long_ago = self.acks.iter().rev().find(|(at_s, _)| now_s - at_s >= SPELL_S);
            long_ago.into_iter().for_each(|&(at_s, bytes)| (since_s, before_bytes) = (at_s, bytes));
        }
        (self.acked_bytes - before_bytes) as f64 / (now_s - since_s).max(least_s)
    }

    /// Nothing was sent yet, and the client holds the updates up to this one.
    pub fn goes_on_after(&mut self, number: u64) {
        self.last_number = number;
    }

    /// Gives up what is in flight: the client begins anew.
    pub fn forget(&mut self) {
        self.in_flight.clear();
        self.acks.clear();
        self.acked_bytes = self.sent_bytes;
    }

    pub fn in_flight_bytes(&self) -> u64 {
        self.sent_bytes - self.acked_bytes
    }

    /// What may be in flight; at least one update whatever its size.
    pub fn window_bytes(&self) -> f64 {
        let (Some(bytes_per_s), Some(size_bytes)) = (self.bytes_per_s(), self.size_bytes) else {
            return FIRST_WINDOW_BYTES;
        };
        let least_bytes = if self.queue_s() > LEAST_WINDOW_WITHIN_S { 0.0 } else { LEAST_WINDOW_BYTES };
        (GAIN * (bytes_per_s * self.path_s(bytes_per_s) + size_bytes)).max(least_bytes)
    }

    /// A round trip of the path itself, without what updates take of it and wait.
    fn path_s(&self, bytes_per_s: f64) -> f64 {
        let of_path_s = self.delays_s.iter().map(|&(_, (delay_s, bytes))| delay_s - bytes as f64 / bytes_per_s);
        of_path_s.reduce(f64::min).unwrap_or(0.0).max(0.0)
    }

    /// From the sending of an update to when all of it is there: what most of the last ones took till their acknowledgement, less its way back, half of what the path itself takes.
    /// No more than the way, the update, and one that it waits for: acknowledgements may be late, too, as on paths that are full both ways or lose packets.
    pub fn one_way_s(&self) -> Option<f64> {
        let (s_per_byte, taken_s) = (self.s_per_byte()?, self.taken_s()?);
        let mut delays_s: Vec<f64> = self.delays_s.iter().map(|&(_, (delay_s, _))| delay_s).collect();
        let middle = delays_s.len() / 2;
        let (_, &mut median_s, _) =
            (!delays_s.is_empty()).then(|| delays_s.select_nth_unstable_by(middle, f64::total_cmp))?;
        let half_s = self.path_s(s_per_byte.recip()) / 2.0;
        Some((median_s - half_s).clamp(0.0, half_s + 2.0 * taken_s))
    }

    /// How long the path takes for an update, so that no two follow each other sooner.
    pub fn taken_s(&self) -> Option<f64> {
        Some(self.size_bytes? * self.s_per_byte()?)
    }

    /// What a byte takes of the path, by its rate. The first updates are few for what it carries, so that their rate would take a long path for a slow one: half as much as they say is
    /// never far off.
    fn s_per_byte(&self) -> Option<f64> {
        let most = self.bytes_per_s()?.recip();
        Some(if self.delays_s.len() < LEAST_DELAYS { most / 2.0 } else { most })
    }

    /// Whether another update may be sent. While one is acknowledged the next one is on its way, however large they are.
    pub fn has_credit(&self) -> bool {
        let has_room = || self.in_flight.len() < 2 || (self.in_flight_bytes() as f64) < self.window_bytes();
        self.in_flight.is_empty() || !self.drains && has_room()
    }

    /// How long the path still takes for what was sent, as far as it is known: an update that is made sooner waits for that, and shows what was.
    /// Where the last one waited for hardly anything, the path may carry more than it was given.
    pub fn frees_in_s(&self, now_s: f64) -> f64 {
        let least_s = self.delays_s.iter().map(|&(_, (delay_s, _))| delay_s).reduce(f64::min);
        let waits = least_s.is_some_and(|least_s| self.last_delay_s > GAIN * least_s);
        if waits && !self.in_flight.is_empty() { (self.frees_at_s - now_s).max(0.0) } else { 0.0 }
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

fn remember<T>(values: &mut VecDeque<(f64, T)>, now_s: f64, value: T, for_s: f64) {
    while values.len() > 1 && values[0].0 < now_s - for_s {
        values.pop_front();
    }
    values.push_back((now_s, value));
}

#[cfg(test)]
mod tests {
    use super::*;

    /// So long before the path is free the next update is made.
    const AHEAD_S: f64 = 0.05;

    /// A path that carries so many bytes a second after half of a round trip, and a sender that always has an update of so many bytes.
    struct Path {
        flow: Flow,
        bytes_per_s: f64,
        rtt_s: f64,
        /// What it lets through at once after it stood idle.
        burst_bytes: f64,
        /// When the path is free, and what is acknowledged when.
        free_at_s: f64,
        acks: VecDeque<(f64, u64)>,
        number: u64,
        now_s: f64,
    }

    impl Path {
        /// Runs for some seconds with updates of one size.
        fn run(&mut self, for_s: f64, bytes: usize) -> (Vec<f64>, f64) {
            self.run_with(for_s, |_| bytes)
        }

        /// Runs for some seconds; the delays of all updates that were acknowledged then, and their bytes a second.
        fn run_with(&mut self, for_s: f64, bytes_of: impl Fn(u64) -> usize) -> (Vec<f64>, f64) {
            let (end_s, mut delays_s, mut acked_bytes) = (self.now_s + for_s, Vec::new(), 0);
            while self.now_s < end_s {
                self.now_s += 0.001;
                while let Some((_, number)) = self.acks.pop_front_if(|(at_s, _)| *at_s <= self.now_s) {
                    let total = self.flow.sent_bytes;
                    if let Acked::Update { delay_s } = self.flow.acked(number, 0, total, self.now_s) {
                        delays_s.push(delay_s);
                        acked_bytes += bytes_of(number);
                    }
                }
                if self.flow.has_credit() && self.flow.frees_in_s(self.now_s) <= AHEAD_S {
                    self.send(bytes_of(self.number + 1));
                }
            }
            (delays_s, acked_bytes as f64 / for_s)
        }

        fn send(&mut self, bytes: usize) {
            self.number += 1;
            self.flow.sent(self.number, 0, bytes, self.now_s);
            // A bucket that is full is as if the path had been free for a while.
            let free_at_s = self.free_at_s.max(self.now_s - self.burst_bytes / self.bytes_per_s);
            self.free_at_s = free_at_s + bytes as f64 / self.bytes_per_s;
            self.acks.push_back((self.free_at_s.max(self.now_s) + self.rtt_s, self.number));
        }

        /// Sends an update at a time, each when the one before is acknowledged and some time has passed.
        fn send_every(&mut self, interval_s: f64, updates: usize, bytes: usize) {
            for _ in 0..updates {
                self.send(bytes);
                let (at_s, number) = self.acks.pop_front().expect("sent");
                self.flow.acked(number, 0, self.flow.sent_bytes, at_s);
                self.now_s = at_s.max(self.now_s + interval_s);
            }
        }
    }

    fn path(bytes_per_s: f64, rtt_s: f64) -> Path {
        let (flow, acks) = (Flow::default(), VecDeque::new());
        Path { flow, bytes_per_s, rtt_s, burst_bytes: 0.0, free_at_s: 0.0, acks, number: 0, now_s: 0.0 }
    }

    /// What at least so many of a hundred are below.
    fn percentile(mut delays_s: Vec<f64>, share: f64) -> f64 {
        delays_s.sort_by(f64::total_cmp);
        delays_s[((delays_s.len() - 1) as f64 * share) as usize]
    }

    #[test]
    fn an_update_is_on_its_way_for_what_the_path_takes_and_what_it_takes_of_the_path() {
        let mut flow = Flow::default();
        assert_eq!((flow.one_way_s(), flow.taken_s()), (None, None));
        // 10 kB a second after a tenth of a second; one of ten is a second late.
        let (bytes, mut now_s) = (2_000, 0.0);
        for number in 1..=100 {
            flow.sent(number, 0, bytes, now_s);
            let late_s = if number % 10 == 0 { 1.0 } else { 0.0 };
            flow.acked(number, 0, number * bytes as u64, now_s + 0.1 + 0.2 + late_s);
            now_s += 0.3 + late_s;
        }
        let (one_way_s, taken_s) = (flow.one_way_s().expect("known"), flow.taken_s().expect("known"));
        // One at a time the path takes no more of them than one in three tenths of a second.
        assert!((0.2..0.301).contains(&taken_s), "{taken_s}");
        assert!((0.25..0.301).contains(&one_way_s), "{one_way_s}");
    }

    #[test]
    fn a_long_path_that_is_given_little_is_not_slow() {
        // Ten a second, five at once on their way, half a second each.
        let (mut flow, mut acks) = (Flow::default(), VecDeque::new());
        for number in 1..=100_u64 {
            let now_s = 0.1 * number as f64;
            while let Some((at_s, number)) = acks.pop_front_if(|(at_s, _)| *at_s <= now_s) {
                flow.acked(number, 0, 0, at_s);
            }
            flow.sent(number, 0, 1_000, now_s);
            acks.push_back((now_s + 0.5, number));
        }
        let (one_way_s, taken_s) = (flow.one_way_s().expect("known"), flow.taken_s().expect("known"));
        assert!((0.2..0.35).contains(&one_way_s) && (0.08..0.12).contains(&taken_s), "{one_way_s}, {taken_s}");
    }

    #[test]
    fn the_first_update_may_be_of_a_long_path_or_of_a_slow_one() {
        let mut flow = Flow::default();
        flow.sent(1, 0, 10_000, 0.0);
        flow.acked(1, 0, 10_000, 0.5);
        let (one_way_s, taken_s) = (flow.one_way_s().expect("known"), flow.taken_s().expect("known"));
        assert!((0.25..0.4).contains(&one_way_s) && (0.2..0.3).contains(&taken_s), "{one_way_s}, {taken_s}");
    }

    #[test]
    fn a_full_path_holds_what_it_carries_and_hardly_more() {
        for (bytes_per_s, rtt_s, bytes) in [
            (250e3, 0.04, 20_000),
            (250e3, 0.3, 20_000),
            (26e3, 0.3, 6_000),
            (2.5e6, 0.1, 50_000),
            (250e3, 0.04, 100_000),
        ] {
            let mut path = path(bytes_per_s, rtt_s);
            path.run(5.0, bytes);
            let (delays_s, carried) = path.run(30.0, bytes);
            let most_s = 2.0 * (rtt_s + bytes as f64 / bytes_per_s);
            let (p99_s, goodput) = (percentile(delays_s, 0.99), carried / bytes_per_s);
            assert!(p99_s <= most_s, "{bytes_per_s} {rtt_s} {bytes}: {p99_s} of {most_s}");
            assert!(goodput >= 0.9, "{bytes_per_s} {rtt_s} {bytes}: {goodput}");
        }
    }

    #[test]
    fn an_update_waits_for_less_than_another_one() {
        let mut path = path(250e3, 0.04);
        path.run(5.0, 100_000);
        let median_s = percentile(path.run(60.0, 100_000).0, 0.5);
        // One takes 0.4 s; with two on their way at all times it would be 0.80 s.
        assert!(median_s <= 0.04 + 1.75 * 0.4, "{median_s}");
    }

    #[test]
    fn a_path_is_full_however_different_updates_are() {
        let mut path = path(26e3, 0.3);
        path.run(5.0, 6_000);
        let sizes = |number: u64| if number.is_multiple_of(3) { 39_000 } else { 6_000 };
        let (delays_s, carried) = path.run_with(60.0, sizes);
        assert!(carried >= 0.9 * 26e3, "{carried}");
        let p99_s = percentile(delays_s, 0.99);
        assert!(p99_s <= 2.0 * (0.3 + 39.0 / 26.0), "{p99_s}");
    }

    #[test]
    fn a_queue_that_large_updates_left_is_gone_when_they_are_small() {
        let mut path = path(26e3, 0.3);
        path.run(20.0, 40_000);
        path.run(12.0, 6_000);
        let (delays_s, _) = path.run(20.0, 6_000);
        let (least_s, p99_s) = (0.3 + 6.0 / 26.0, percentile(delays_s, 0.99));
        assert!(p99_s <= 2.0 * least_s + LEAST_WINDOW_BYTES / 26e3, "{p99_s}");
    }

    #[test]
    fn what_a_bucket_lets_through_at_once_is_no_bandwidth() {
        let mut bucket = path(31e3, 0.001);
        bucket.burst_bytes = 16e3;
        bucket.send_every(0.1, 1, 48_000);
        bucket.send_every(0.1, 20, 16_000);
        bucket.send_every(0.25, 80, 6_000);
        let known = bucket.flow.bytes_per_s().expect("updates came");
        assert!(known < 2.5 * 31e3, "{known}");
        // Where nothing ever took long, small updates tell what there is.
        let mut fast = path(12e6, 0.02);
        fast.send_every(0.1, 20, 200_000);
        assert!(fast.flow.bytes_per_s().is_some_and(|known| known > 4e6));
        // And a path that was slow is found out when it is not.
        bucket.bytes_per_s = 3e6;
        for _ in 0..12 {
            let bytes = bucket.flow.bytes_per_s().expect("updates came");
            bucket.send_every(0.1, 1, bytes as usize);
        }
        assert!(bucket.flow.bytes_per_s().is_some_and(|known| known > 1e6), "{:?}", bucket.flow.bytes_per_s());
    }

    #[test]
    fn a_path_that_carries_less_than_it_did_is_found_out() {
        let mut path = path(1e6, 0.06);
        path.run(10.0, 20_000);
        path.bytes_per_s = 100e3;
        path.run(5.0, 20_000);
        let (delays_s, _) = path.run(20.0, 20_000);
        assert!(percentile(delays_s, 0.99) <= 2.0 * (0.06 + 0.2) + 0.1);
        path.bytes_per_s = 1e6;
        path.run(5.0, 20_000);
        assert!(path.run(20.0, 20_000).1 >= 0.85e6, "and one that carries more again");
    }
}
