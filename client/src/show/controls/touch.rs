//! Pointers that are down, and what their moves mean together.

use glam::DVec2;

/// More fingers than this are ignored.
const MAX_POINTERS: usize = 3;
/// Two fingers nearer than this count as this far apart, so that the ratio of distances stays sane.
const NEAREST_FINGERS_PX: f64 = 24.0;

/// What a pointer does while it is down.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Drag {
    /// The main button, or a finger.
    Look,
    /// Any other button.
    Pan,
}

/// What a move of one pointer asks for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Gesture {
    /// One pointer's way.
    pub look_px: DVec2,
    /// The way of the middle of two, or of another button's drag.
    pub pan_px: DVec2,
    /// The way of the middle of three.
    pub lift_px: DVec2,
    /// The ratio of the distances of two fingers, now over before; 1 without two.
    pub pinch: f64,
}

impl Gesture {
    const NONE: Gesture = Gesture { look_px: DVec2::ZERO, pan_px: DVec2::ZERO, lift_px: DVec2::ZERO, pinch: 1.0 };
}

#[derive(Debug, Clone, Copy)]
struct Pointer {
    id: u64,
    drag: Drag,
    at_px: DVec2,
}

/// At most three.
#[derive(Debug, Clone, Default)]
pub(super) struct Pointers {
    down: Vec<Pointer>,
}

impl Pointers {
    pub fn down(&mut self, id: u64, drag: Drag, at_px: DVec2) {
        self.up(id);
        if self.down.len() < MAX_POINTERS && at_px.is_finite() {
            self.down.push(Pointer { id, drag, at_px });
        }
    }

    pub fn up(&mut self, id: u64) {
        self.down.retain(|pointer| pointer.id != id);
    }

    pub fn moved(&mut self, id: u64, to_px: DVec2) -> Gesture {
        let (before, middle_of_three) = (self.middle_and_spread(), self.middle_of_three());
        let Some(pointer) = self.down.iter_mut().find(|pointer| pointer.id == id && to_px.is_finite()) else {
            return Gesture::NONE;
        };
        let way_px = to_px - pointer.at_px;
        pointer.at_px = to_px;
        let drag = pointer.drag;
        if let (Some(middle), Some(middle_now)) = (middle_of_three, self.middle_of_three()) {
            return Gesture { lift_px: middle_now - middle, ..Gesture::NONE };
        }
        match (before, self.middle_and_spread()) {
            (Some((middle, spread)), Some((middle_now, spread_now))) => {
                Gesture { pan_px: middle_now - middle, pinch: spread_now / spread, ..Gesture::NONE }
            }
            _ if drag == Drag::Look => Gesture { look_px: way_px, ..Gesture::NONE },
            _ => Gesture { pan_px: way_px, ..Gesture::NONE },
        }
    }

    pub fn is_any_down(&self) -> bool {
        !self.down.is_empty()
    }

    fn middle_of_three(&self) -> Option<DVec2> {
        let [a, b, c] = self.down.as_slice() else { return None };
        Some((a.at_px + b.at_px + c.at_px) / 3.0)
    }

    fn middle_and_spread(&self) -> Option<(DVec2, f64)> {
        let [a, b] = self.down.as_slice() else { return None };
        Some(((a.at_px + b.at_px) / 2.0, a.at_px.distance(b.at_px).max(NEAREST_FINGERS_PX)))
    }
}
