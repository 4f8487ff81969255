//! What a viewer counts of its pictures, bytes and updates.

use crate::receive::history::{Arrival, History};
use crate::receive::stats::{Mean, Rate, StageMs, Stats};

/// See the module.
#[derive(Debug, Default)]
pub(super) struct Figures {
    /// The last minute.
    pub history: History,
    /// Of the last picture that was counted, the share that no sample covers.
    pub uncovered_share: Option<f64>,
    frames: u64,
    frame_rate: Rate,
    bit_rate: Rate,
    decode_ms: Mean,
    surface_ms: Mean,
    light_ms: Mean,
    last_decode_ms: f64,
}

impl Figures {
    /// A message came.
    pub fn received(&mut self, bytes: usize, now_s: f64) {
        self.bit_rate.add(bytes as f64 * 8.0, now_s);
    }

    /// An update was decoded.
    pub fn decoded(&mut self, decode_ms: f64) {
        self.decode_ms.add(decode_ms);
        self.last_decode_ms += decode_ms;
    }

    /// An update is held.
    pub fn arrived(&mut self, bytes: usize, decode_ms: f64, now_s: f64) {
        self.history.arrived(Arrival { at_s: now_s, bytes, decode_ms });
    }

    /// A picture was drawn; `None` where a time is not known.
    pub fn drawn(&mut self, now_s: f64, surface_ms: Option<f64>, light_ms: Option<f64>) {
        self.frames += 1;
        self.frame_rate.add(1.0, now_s);
        self.history.drawn(now_s);
        for (mean, value) in [(&mut self.surface_ms, surface_ms), (&mut self.light_ms, light_ms)] {
            value.into_iter().for_each(|value| mean.add(value));
        }
    }

    /// What decoding took since this was last asked, in milliseconds.
    pub fn take_decode_ms(&mut self) -> f64 {
        std::mem::take(&mut self.last_decode_ms)
    }

    /// The panel's figures: these, beside those of what is held and of the session.
    pub fn with(&mut self, others: Stats, now_s: f64) -> Stats {
        let mean = |of: &Mean| of.get().unwrap_or(0.0);
        let stats = Stats {
            fps: self.frame_rate.per_s(now_s),
            mbit_per_s: self.bit_rate.per_s(now_s) / 1e6,
            uncovered_share: self.uncovered_share,
            ms: StageMs { decode: mean(&self.decode_ms), surface: mean(&self.surface_ms), light: mean(&self.light_ms) },
            frames: self.frames,
            ..others
        };
        self.history.see(&stats, now_s);
        stats
    }
}
