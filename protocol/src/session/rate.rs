//! A token bucket.

/// Allows `per_s` events a second on average and `burst` at once.
#[derive(Debug, Clone)]
pub struct TokenBucket {
    per_s: f64,
    burst: f64,
    tokens: f64,
    filled_at_s: f64,
}

impl TokenBucket {
    /// Full.
    pub fn new(per_s: f64, burst: f64, now_s: f64) -> TokenBucket {
        TokenBucket { per_s, burst, tokens: burst, filled_at_s: now_s }
    }

    /// Whether one more event is allowed now.
    pub fn take(&mut self, now_s: f64) -> bool {
        let passed_s = (now_s - self.filled_at_s).max(0.0);
        self.filled_at_s = self.filled_at_s.max(now_s);
        self.tokens = (self.tokens + passed_s * self.per_s).min(self.burst);
        let allowed = self.tokens >= 1.0;
        if allowed {
            self.tokens -= 1.0;
        }
        allowed
    }
}
