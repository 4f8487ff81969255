use crate::Link;

/// One direction of a [`Link`]: says when bytes that leave at a time arrive. Seeded and free of I/O, so the same calls give the
/// same answers on every machine.
///
/// Bytes wait for the bandwidth (a token bucket of one packet: each message starts when the one before it has left), then
/// for the delay with its jitter, then for the end of a stall; never do they overtake one another.
#[derive(Debug, Clone)]
pub struct LinkModel {
    link: Link,
    random: u64,
    free_at_s: f64,
    last_arrival_s: f64,
}

impl LinkModel {
    /// A direction of `link`; give the two directions, and every connection, seeds of their own.
    pub fn new(link: Link, seed: u64) -> LinkModel {
        LinkModel { link, random: seed, free_at_s: f64::NEG_INFINITY, last_arrival_s: f64::NEG_INFINITY }
    }

    /// When the last of `bytes` bytes arrives that leave together at `at_s`. Calls come in order of `at_s`; an earlier time counts
    /// as the latest one before it.
    pub fn deliver(&mut self, at_s: f64, bytes: usize) -> f64 {
        let start_s = self.free_at_s.max(at_s);
        self.free_at_s = start_s + self.link.mbit.map_or(0.0, |mbit| bytes as f64 * 8.0 / (mbit * 1e6));
        let jitter_s = (self.next_share() - 0.5) * self.link.jitter_s;
        let delay_s = (self.link.rtt_s / 2.0 + jitter_s).max(0.0);
        let arrival_s = self.after_stall_s(self.free_at_s + delay_s).max(self.last_arrival_s);
        self.last_arrival_s = arrival_s;
        arrival_s
    }

    /// When the path takes the next byte: `at_s` or later.
    pub fn free_at_s(&self, at_s: f64) -> f64 {
        self.free_at_s.max(at_s)
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

    /// Even in [0, 1): splitmix64 (Steele, Lea, Flood, Fast Splittable Pseudorandom Number Generators, 2014).
    fn next_share(&mut self) -> f64 {
        self.random = self.random.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.random;
        z = (z ^ z >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^= z >> 31;
        (z >> 11) as f64 / (1_u64 << 53) as f64
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
    fn the_same_seed_repeats() {
        let run = |seed| {
            let mut model = LinkModel::new("rtt=40,jitter=20,mbit=20".parse().unwrap(), seed);
            (0..100).map(|i| model.deliver(f64::from(i) * 0.01, 5000)).collect::<Vec<_>>()
        };
        assert_eq!(run(1), run(1));
        assert_ne!(run(1), run(2));
    }
}
