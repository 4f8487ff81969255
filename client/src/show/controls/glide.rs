//! What a drag that is let go leaves: the view glides on, and comes to rest. Speeds of keys have the same in [`super::SMOOTHING_S`].

use glam::DVec2;

/// How fast a drag was is what it did lately: older moves count by this time constant, in seconds. Who holds still before letting go throws nothing.
const LATELY_S: f64 = 0.03;
/// With this time constant a glide fades, in seconds: after a third of a second a tenth of its speed is left.
const FADES_S: f64 = 0.15;
/// Pixels a second that are no glide any more: what is left of its way is under a pixel.
const STILL_PX_S: f64 = 4.0;
/// And at most, as mice report many moves at once now and then: two screens' widths a second.
const MOST_PX_S: f64 = 4000.0;

/// See the module.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Glide {
    /// Dragged since the last frame.
    dragged_px: DVec2,
    px_s: DVec2,
    is_down: bool,
}

impl Glide {
    /// A pointer took the view along.
    pub fn drag(&mut self, moved_px: DVec2) {
        self.dragged_px += moved_px;
        self.is_down = true;
    }

    /// It was let go.
    pub fn let_go(&mut self) {
        self.is_down = false;
    }

    /// The view is held, or goes elsewhere.
    pub fn stop(&mut self) {
        *self = Glide::default();
    }

    /// How far the view glides in so many seconds, in pixels of a drag.
    pub fn advance(&mut self, dt_s: f64) -> DVec2 {
        if dt_s <= 0.0 {
            return DVec2::ZERO;
        }
        let dragged_px = std::mem::take(&mut self.dragged_px);
        if self.is_down || dragged_px != DVec2::ZERO {
            let share = 1.0 - (-dt_s / LATELY_S).exp();
            let now_px_s = (dragged_px / dt_s).clamp_length_max(MOST_PX_S);
            self.px_s += (now_px_s - self.px_s) * share;
            if dragged_px == DVec2::ZERO && self.px_s.length() < STILL_PX_S {
                self.px_s = DVec2::ZERO;
            }
            return DVec2::ZERO;
        }
        if self.px_s.length() < STILL_PX_S {
            self.px_s = DVec2::ZERO;
        }
        let decay = (-dt_s / FADES_S).exp();
        let way_px = self.px_s * FADES_S * (1.0 - decay);
        self.px_s *= decay;
        way_px
    }

    /// Whether time changes something yet: a glide, or what letting go would throw.
    pub fn goes_on(&self) -> bool {
        self.px_s != DVec2::ZERO || self.dragged_px != DVec2::ZERO
    }
}
