use crate::Link;
use crate::fade::Fade;
use crate::random::Random;

/// One direction of a [`Link`]: says when bytes that leave at a time arrive. Seeded and free of I/O, so the same calls give the
/// same answers on every machine.
///
/// Bytes wait for the bandwidth (a token bucket of one packet: each message starts when the one before it has left), then
/// for the delay with its jitter, then for the end of a stall; never do they overtake one another.
///
/// Loss is seen as TCP shows it. A packet that is lost comes a round trip later where three follow it (RFC 5681, fast retransmit), two later where they do not
/// (RFC 8985, tail loss probe), and after the retransmission timeout, doubled each time, where what is sent again is lost too (RFC 6298). All that follows waits for
/// it. The bandwidth is at most what a sender that takes loss for congestion reaches: 1.22 packets a round trip over the root of the loss (Mathis, Semke, Mahdavi,
/// Ott, *The macroscopic behavior of the TCP congestion avoidance algorithm*, 1997). In a blackout all is lost, and comes with the first repetition after its end.
#[derive(Debug, Clone)]
pub struct LinkModel {
    link: Link,
    random: Random,
    fade: Option<Fade>,
    free_at_s: f64,
    last_arrival_s: f64,
}

/// What a packet carries, in bytes: that of an Ethernet frame.
const PACKET_BYTES: usize = 1448;
/// The retransmission timeout beyond the round trip: Linux's least; and that of a connection which knows no round trip yet (RFC 6298).
const TIMEOUT_S: f64 = 0.2;
const FIRST_TIMEOUT_S: f64 = 1.0;
/// A timeout grows no further than this (Linux).
const LONGEST_TIMEOUT_S: f64 = 120.0;
/// So many packets that come after a lost one make its sender notice.
const DUPLICATES: usize = 3;
/// Of Mathis et al.: packets a round trip, times the root of the loss.
const MATHIS: f64 = 1.22;

impl LinkModel {
    /// A direction of `link`; give the two directions, and every connection, seeds of their own.
    pub fn new(link: Link, seed: u64) -> LinkModel {
        LinkModel {
            link,
            random: Random::new(seed),
            fade: link.fading.map(Fade::new),
            free_at_s: f64::NEG_INFINITY,
            last_arrival_s: f64::NEG_INFINITY,
        }
    }

    /// When the last of `bytes` bytes arrives that leave together at `at_s`. Calls come in order of `at_s`; an earlier time counts
    /// as the latest one before it.
    pub fn deliver(&mut self, at_s: f64, bytes: usize) -> f64 {
        self.free_at_s = self.left_at_s(self.free_at_s.max(at_s), bytes);
        let jitter_s = (self.random.next_share() - 0.5) * self.link.jitter_s;
        let delay_s = (self.link.rtt_s / 2.0 + jitter_s).max(0.0);
        let left_s = self.after_blackout_s(self.free_at_s) + self.repeated_s(bytes);
        let arrival_s = self.after_stall_s(left_s + delay_s).max(self.last_arrival_s);
        self.last_arrival_s = arrival_s;
        arrival_s
    }

    /// When the path takes the next byte: `at_s` or later.
    pub fn free_at_s(&self, at_s: f64) -> f64 {
        self.free_at_s.max(at_s)
    }

    /// What the path, as it mostly is, and its sender let through; `None` without a bound.
    pub fn bits_per_s(&self) -> Option<f64> {
        self.bits_per_s_at(1.0)
    }

    /// The same where the path lets through so many times what it mostly does.
    fn bits_per_s_at(&self, fade: f64) -> Option<f64> {
        let Link { loss, rtt_s, mbit, .. } = self.link;
        let of_sender = (loss > 0.0 && rtt_s > 0.0).then(|| MATHIS * PACKET_BYTES as f64 * 8.0 / (rtt_s * loss.sqrt()));
        let of_path = mbit.map(|mbit| mbit * 1e6 * fade);
        of_sender.into_iter().chain(of_path).reduce(f64::min)
    }

    /// When the last of so many bytes has left that begin to leave at a time.
    fn left_at_s(&mut self, mut at_s: f64, bytes: usize) -> f64 {
        let mut bits = bytes as f64 * 8.0;
        loop {
            let (fade, until_s) = self.fade.as_mut().map_or((1.0, f64::INFINITY), |fade| fade.at(at_s));
            let Some(bits_per_s) = self.bits_per_s_at(fade) else { return at_s };
            let left_s = at_s + bits / bits_per_s;
            if left_s <= until_s {
                return left_s;
            }
            bits -= (until_s - at_s) * bits_per_s;
            at_s = until_s;
        }
    }

    /// The timeout before something is sent again: of a connection that has delivered nothing yet, or of one that runs.
    fn timeout_s(&self) -> f64 {
        if self.last_arrival_s.is_finite() { self.link.rtt_s + TIMEOUT_S } else { FIRST_TIMEOUT_S }
    }

    /// When what leaves at a time leaves for the last time, of all that are repetitions in a blackout.
    fn after_blackout_s(&self, left_s: f64) -> f64 {
        let Some(blackout) = self.link.blackout.filter(|blackout| left_s >= blackout.begin_s) else { return left_s };
        let (mut at_s, mut timeout_s) = (left_s, self.timeout_s());
        while at_s < blackout.end_s() {
            at_s += timeout_s;
            timeout_s = (2.0 * timeout_s).min(LONGEST_TIMEOUT_S);
        }
        at_s
    }

    /// How much later the last of so many bytes is there, as packets of it are lost.
    fn repeated_s(&mut self, bytes: usize) -> f64 {
        if self.link.loss <= 0.0 {
            return 0.0;
        }
        let packets = bytes.div_ceil(PACKET_BYTES).max(1);
        let mut latest_s: f64 = 0.0;
        for packet in 0..packets {
            let is_noticed = packets - packet > DUPLICATES;
            let (mut later_s, mut timeout_s) = (0.0, self.timeout_s());
            let mut wait_s = if is_noticed { self.link.rtt_s } else { 2.0 * self.link.rtt_s };
            while self.random.next_share() < self.link.loss {
                later_s += wait_s;
                wait_s = timeout_s;
                timeout_s = (2.0 * timeout_s).min(LONGEST_TIMEOUT_S);
            }
            latest_s = latest_s.max(later_s);
        }
        latest_s
    }

    fn after_stall_s(&self, arrival_s: f64) -> f64 {
        let Some(stall) = self.link.stall.filter(|stall| stall.period_s > 0.0) else { return arrival_s };
        let into_period_s = arrival_s.rem_euclid(stall.period_s);
        if arrival_s >= stall.period_s && into_period_s < stall.length_s {
            arrival_s - into_period_s + stall.length_s
        } else {
            arrival_s
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn model(text: &str) -> LinkModel {
        LinkModel::new(text.parse().unwrap(), 7)
    }

    #[test]
    fn delay_is_half_the_round_trip() {
        assert!((model("rtt=40").deliver(1.0, 1000) - 1.02).abs() < 1e-12);
        assert_eq!(model("").deliver(3.0, 1 << 20), 3.0);
    }

    #[test]
    fn bandwidth_spaces_messages() {
        let mut model = model("mbit=8"); // a megabyte a second
        assert!((model.deliver(0.0, 100_000) - 0.1).abs() < 1e-9);
        assert!((model.deliver(0.0, 100_000) - 0.2).abs() < 1e-9);
        assert!((model.deliver(5.0, 100_000) - 5.1).abs() < 1e-9, "an idle path saves nothing up");
    }

    #[test]
    fn a_fading_path_carries_what_it_does_step_by_step() {
        let mut model = model("mbit=8,fading=1@2000");
        let mut fade = Fade::new(model.link.fading.unwrap());
        let carried: f64 = (0..20).map(|step| fade.at(f64::from(step) * 0.5).0 * 0.5e6).sum();
        // As many bytes as ten seconds let through, in pieces.
        let pieces = (carried / 1000.0) as usize;
        let end_s = (0..pieces).map(|_| model.deliver(0.0, 1000)).last().unwrap();
        assert!(end_s <= 10.0 && end_s > 9.5, "{end_s}");
        let lone = self::model("mbit=8,fading=1@2000").deliver(0.0, pieces * 1000);
        assert!((lone - end_s).abs() < 1e-6, "{lone} in one piece");
    }

    #[test]
    fn jitter_varies_within_its_bounds_and_keeps_the_order() {
        let mut model = model("rtt=40,jitter=20");
        let delays: Vec<f64> = (0..1000).map(|i| model.deliver(f64::from(i), 100) - f64::from(i)).collect();
        assert!(delays.iter().all(|delay| (0.01..=0.03).contains(delay)));
        let mean = delays.iter().sum::<f64>() / 1000.0;
        assert!((mean - 0.02).abs() < 0.001, "{mean}");
        let arrivals: Vec<f64> = (0..1000).map(|i| model.deliver(2000.0 + f64::from(i) * 0.001, 100)).collect();
        assert!(arrivals.is_sorted());
    }

    #[test]
    fn nothing_arrives_in_a_stall() {
        let mut model = model("stall=300@1000");
        assert_eq!(model.deliver(0.1, 1), 0.1, "no stall at the very start");
        for i in 100..5000 {
            let arrival_s = model.deliver(f64::from(i) * 0.001, 1);
            let into_period_s = arrival_s.rem_euclid(1.0);
            assert!(arrival_s < 1.0 || into_period_s >= 0.3 - 1e-9, "{arrival_s}");
        }
    }

    #[test]
    fn what_is_lost_comes_later() {
        let mut model = model("rtt=100,loss=5");
        let delays: Vec<f64> =
            (0..4000).map(|i| model.deliver(f64::from(i) * 10.0, 100) - f64::from(i) * 10.0).collect();
        let late = delays.iter().filter(|delay| **delay > 0.06).count() as f64 / 4000.0;
        assert!((late - 0.05).abs() < 0.01, "{late} of single packets");
        assert!(delays.iter().any(|delay| *delay > 0.5), "none was lost twice");
        let mut whole = self::model("rtt=100,loss=1");
        // Eight megabytes at 1.22 packets a round trip over a tenth: 1.4 Mbit/s.
        let end_s = (0..1000).map(|_| whole.deliver(0.0, 8192)).last().unwrap();
        let mbit = 8192e3 * 8.0 / end_s / 1e6;
        assert!((mbit - 1.41).abs() < 0.05, "{mbit}");
    }

    #[test]
    fn after_a_blackout_comes_what_is_repeated() {
        let mut model = model("rtt=100,blackout=10000@5000");
        assert!((model.deliver(1.0, 100) - 1.05).abs() < 1e-12);
        assert!((model.deliver(4.9, 100) - 4.95).abs() < 1e-12);
        // Timeouts of 0.3, 0.6, 1.2, 2.4, 4.8 and 9.6 s from 5.1 s on.
        let arrival_s = model.deliver(5.1, 100);
        assert!((arrival_s - (5.1 + 0.3 * 63.0 + 0.05)).abs() < 1e-9, "{arrival_s}");
        assert!(model.deliver(16.0, 100) >= arrival_s, "nothing overtakes it");
        let mut fresh = LinkModel::new("rtt=100,blackout=10000@5000".parse().unwrap(), 9);
        let arrival_s = fresh.deliver(14.5, 100);
        assert!((arrival_s - 15.55).abs() < 1e-9, "a new connection is through after a second: {arrival_s}");
    }

    #[test]
    fn the_same_seed_repeats() {
        let run = |seed| {
            let mut model = LinkModel::new("rtt=40,jitter=20,mbit=20".parse().unwrap(), seed);
            (0..100).map(|i| model.deliver(f64::from(i) * 0.01, 5000)).collect::<Vec<_>>()
        };
        assert_eq!(run(1), run(1));
        assert_ne!(run(1), run(2));
    }
}
