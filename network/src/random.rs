/// Even random numbers that are the same on every machine: splitmix64 (Steele, Lea, Flood, *Fast splittable pseudorandom number generators*, OOPSLA 2014).
#[derive(Debug, Clone)]
pub(crate) struct Random(u64);

impl Random {
    pub fn new(seed: u64) -> Random {
        Random(seed)
    }

    /// Even in [0, 1).
    pub fn next_share(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ z >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^= z >> 31;
        (z >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Normal with mean 0 and deviation 1 (Box, Muller 1958).
    pub fn next_normal(&mut self) -> f64 {
        // The logarithm of 0 is not asked for.
        let radius = (-2.0 * (1.0 - self.next_share()).ln()).sqrt();
        radius * (std::f64::consts::TAU * self.next_share()).cos()
    }
}
