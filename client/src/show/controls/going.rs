//! Going to another view by itself: see [`super::flight`].

use camera::Rigid;
use glam::DVec3;

use super::flight::{FRAME_SHARE, Flight, NEARER, SMOOTHING_S, Side};
use super::{Controls, Mode};

impl Controls {
    /// Goes to where all of the scene is seen from a side.
    pub fn go_to(&mut self, side: Side) {
        let forward = match side {
            Side::Same => self.forward(),
            Side::Front => DVec3::NEG_Z,
            Side::Right => DVec3::NEG_X,
            // As steeply as eyes look: straight down there is no telling where the top of the picture is.
            Side::Top => DVec3::new(0.0, -1.0, -0.021).normalize(),
        };
        let middle = (self.bounds_world[0] + self.bounds_world[1]) / 2.0;
        let distance_m = self.framing_distance_m(forward, middle);
        self.fly(Rigid::look_along(middle - forward * distance_m, forward), distance_m);
    }

    /// Goes to a view, whose eye looks at what is so far before it.
    pub fn go_to_view(&mut self, world_from_eye: Rigid, distance_m: f64) {
        self.fly(world_from_eye, distance_m.clamp(self.nearest_m, self.farthest_m));
    }

    /// Goes nearer to a point, which the eye then looks at.
    fn go_near(&mut self, point_world: DVec3) {
        let eye = self.pose().translation;
        let distance_m = (eye.distance(point_world) * NEARER).clamp(self.nearest_m, self.farthest_m);
        let Some(forward) = (point_world - eye).try_normalize() else { return };
        self.fly(Rigid::look_along(point_world - forward * distance_m, forward), distance_m);
    }

    /// Who walks goes nearer to a point; who turns an object turns about it from now on, with it in the middle of the view.
    pub fn visit(&mut self, point_world: DVec3) {
        match self.mode {
            Mode::Walk => self.go_near(point_world),
            Mode::Orbit => {
                let (eye, forward) = (self.pose().translation, self.forward());
                let distance_m = (point_world - eye).dot(forward).clamp(self.nearest_m, self.farthest_m);
                self.fly(Rigid::look_along(point_world - forward * distance_m, forward), distance_m);
            }
        }
    }

    fn fly(&mut self, world_from_eye: Rigid, distance_m: f64) {
        self.let_go();
        self.velocity = DVec3::ZERO;
        self.flight = Some(Flight { world_from_eye, distance_m });
    }

    /// The scene's corners: from how far before its middle an eye sees them all.
    fn framing_distance_m(&self, forward: DVec3, middle: DVec3) -> f64 {
        let right = DVec3::Y.cross(-forward).normalize_or(DVec3::X);
        let up = right.cross(forward);
        let tan_y = (self.fov_y_rad / 2.0).tan() * FRAME_SHARE;
        let tan_x = tan_y * self.size_px.x / self.size_px.y;
        let [min, max] = self.bounds_world;
        let corner = |index: usize| {
            let pick = |axis: usize| if index >> axis & 1 == 0 { min[axis] } else { max[axis] };
            DVec3::new(pick(0), pick(1), pick(2)) - middle
        };
        let distance_m = |corner: DVec3| {
            let beside = (corner.dot(right).abs() / tan_x).max(corner.dot(up).abs() / tan_y);
            beside - corner.dot(forward)
        };
        (0..8).map(corner).map(distance_m).fold(self.nearest_m, f64::max).min(self.farthest_m)
    }

    /// Lets `dt_s` seconds of a flight pass; whether there is one.
    pub(super) fn advance_flight(&mut self, dt_s: f64) -> bool {
        let Some(Flight { world_from_eye, distance_m }) = self.flight else { return false };
        let share = 1.0 - (-dt_s / SMOOTHING_S).exp();
        self.distance_m += (distance_m - self.distance_m) * share;
        self.approach(world_from_eye, share);
        if self.is_near(world_from_eye) {
            self.distance_m = distance_m;
            self.approach(world_from_eye, 1.0);
            self.flight = None;
        }
        true
    }
}
