//! Where ambient occlusion is looked for from, around what a viewer sees: plain maths that both ends need, in f64. Clients draw z-buffers
//! of occluders as seen from there, and servers look from there for what the eye does not see.
//!
//! Four views stand around a [`Ball`], a quarter turn apart, and see nothing that is not in it: their near plane touches it. From outside
//! of all that is held the ball holds everything; from within it lies around the eye, and goes along in steps of a quarter of its
//! radius. So what is seen from there does not change while the view turns, and seldom while the eye moves.

use camera::{Bounds, Pinhole, Rigid};
use glam::DVec3;

/// Views around a ball.
pub const AROUND: usize = 4;
/// Their distance from the middle, in radii.
const DISTANCE_RADII: f64 = 3.0;
/// How high they stand over the horizon, and how far they are turned from the axes, in radians.
const ELEVATION_RAD: f64 = 0.7;
const TURN_RAD: f64 = std::f64::consts::FRAC_PI_8;
/// The radius of a ball around an eye, in reaches of occlusion: with images of 512 pixels a reach spans 16 of them.
const RADIUS_REACHES: f64 = 16.0;
/// A ball moves in steps of one in so many parts of its radius: one around everything so finely that it is hardly larger than that.
const STEPS_AROUND_ALL: f64 = 16.0;
const STEPS_AROUND_EYE: f64 = 4.0;
/// Balls around everything grow by this factor at least: the fourth root of two.
const GROWTH: f64 = 1.189_207_115_002_721;

/// What is looked at.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ball {
    /// Its middle.
    pub middle_world: DVec3,
    /// Above zero.
    pub radius_m: f64,
}

impl Ball {
    /// What an eye needs that looks at what lies within `bounds`, where what is `reach_m` away occludes. `None` where there is nothing.
    pub fn new(bounds: Bounds, eye_world: DVec3, reach_m: f64) -> Option<Ball> {
        let all = Ball::around(bounds)?;
        let near_m = RADIUS_REACHES * reach_m;
        if eye_world.distance(all.middle_world) > all.radius_m || near_m >= all.radius_m {
            return Some(all);
        }
        let is_there = near_m > 0.0 && near_m.is_finite();
        is_there.then(|| Ball { middle_world: snapped(eye_world, near_m / STEPS_AROUND_EYE), radius_m: near_m })
    }

    fn around(bounds: Bounds) -> Option<Ball> {
        let half_m = bounds.min.distance(bounds.max) / 2.0;
        if half_m <= 0.0 || !half_m.is_finite() {
            return None;
        }
        // The ball's middle is at most half a step beside that of the bounds along each axis.
        let radius_m = GROWTH.powf((half_m / (1.0 - 3_f64.sqrt() / 2.0 / STEPS_AROUND_ALL)).log(GROWTH).ceil());
        Some(Ball { middle_world: snapped(bounds.middle(), radius_m / STEPS_AROUND_ALL), radius_m })
    }

    /// Whether a place lies in it.
    pub fn has(&self, place_world: DVec3) -> bool {
        place_world.distance_squared(self.middle_world) <= self.radius_m * self.radius_m
    }

    /// The views around it, each of `side_px` a side.
    pub fn views(&self, side_px: u32) -> [Pinhole; AROUND] {
        let distance_m = DISTANCE_RADII * self.radius_m;
        let fov_rad = 2.0 * (1.0 / DISTANCE_RADII).asin();
        std::array::from_fn(|index| {
            let yaw_rad = std::f64::consts::TAU * index as f64 / AROUND as f64 + TURN_RAD;
            let (up, along) = ELEVATION_RAD.sin_cos();
            let out = DVec3::new(yaw_rad.sin() * along, up, yaw_rad.cos() * along);
            let eye = Rigid::look_at(self.middle_world + out * distance_m, self.middle_world);
            Pinhole::symmetric(eye, (side_px, side_px), fov_rad, distance_m - self.radius_m)
        })
    }

    /// What is not in it any more lies so far from the eye of each view.
    pub fn far_m(&self) -> f64 {
        (DISTANCE_RADII + 1.0) * self.radius_m
    }

    /// How far each view's eye stands from the middle.
    pub fn distance_m(&self) -> f64 {
        DISTANCE_RADII * self.radius_m
    }
}

fn snapped(place_world: DVec3, step_m: f64) -> DVec3 {
    (place_world / step_m).round() * step_m
}

#[cfg(test)]
mod tests {
    use super::*;

    const BOUNDS: Bounds = Bounds { min: DVec3::new(-40.0, -1.0, -30.0), max: DVec3::new(40.0, 12.0, 30.0) };

    #[test]
    fn from_outside_every_view_holds_everything() {
        let ball = Ball::new(BOUNDS, DVec3::new(0.0, 20.0, 200.0), 0.5).expect("a ball");
        for view in ball.views(256) {
            for corner in BOUNDS.corners() {
                let image = view.image_from_world(corner).expect("before the near plane");
                assert!(view.contains(image), "{corner}");
            }
        }
    }

    #[test]
    fn from_within_it_goes_along_in_steps_and_holds_what_is_near() {
        let at = |x: f64| Ball::new(BOUNDS, DVec3::new(x, 1.7, 4.0), 0.5).expect("a ball");
        let mut moves = 0;
        for step in 0..100 {
            let (x, next) = (0.05 * f64::from(step), 0.05 * f64::from(step + 1));
            moves += usize::from(at(x) != at(next));
            assert!(at(x).middle_world.distance(DVec3::new(x, 1.7, 4.0)) < 0.25 * at(x).radius_m);
        }
        assert!((1..=3).contains(&moves), "{moves} moves in five metres");
    }

    #[test]
    fn it_stays_while_what_is_held_grows_a_little() {
        let eye = DVec3::new(0.0, 20.0, 200.0);
        let grown = Bounds { max: BOUNDS.max + 0.5, ..BOUNDS };
        assert_eq!(Ball::new(BOUNDS, eye, 0.5), Ball::new(grown, eye, 0.5));
        let nothing = Bounds { min: DVec3::ONE, max: DVec3::ONE };
        assert_eq!(Ball::new(nothing, eye, 0.5), None);
    }
}
