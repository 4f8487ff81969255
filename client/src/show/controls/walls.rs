//! Walls that stop who walks, and along which he slides.

use glam::DVec3;

use crate::draw::feel::Wall;

/// A person's radius, in metres; in scenes that are smaller than he would be, what he goes there in so many seconds.
const BODY_M: f64 = 0.24;
const BODY_S: f64 = 0.15;
/// A wall counts so far beside the point where it was met, in bodies: it may end there.
const REACH_BODIES: f64 = 4.0;

/// What was met, and whether it counts.
#[derive(Debug, Clone, Default)]
pub(super) struct Walls {
    /// Whether walls stop anybody.
    pub are_on: bool,
    /// The last one that was met; `None` where the way is free.
    pub wall: Option<Wall>,
}

/// The radius of who walks at a speed, in metres.
pub(super) fn body_m(speed_m_s: f64) -> f64 {
    (speed_m_s * BODY_S).min(BODY_M)
}

impl Walls {
    /// A way from a point as far as a wall lets it: along the wall it goes on. Who is behind a wall already is not held there.
    pub fn stop(&self, eye_world: DVec3, way_m: DVec3, body_m: f64) -> DVec3 {
        let Some(Wall { point_world, normal_world }) = self.wall.filter(|_| self.are_on) else { return way_m };
        let from_wall = eye_world - point_world;
        let distance_m = from_wall.dot(normal_world);
        let beside_m = (from_wall - normal_world * distance_m).length();
        let towards_m = -way_m.dot(normal_world);
        let free_m = (distance_m - body_m).max(0.0);
        let is_met = distance_m > 0.0 && beside_m <= REACH_BODIES * body_m && towards_m > free_m;
        if is_met { way_m + normal_world * (towards_m - free_m) } else { way_m }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A wall a metre ahead of the origin, along -z.
    fn ahead() -> Walls {
        let wall = Wall { point_world: DVec3::NEG_Z, normal_world: DVec3::Z };
        Walls { are_on: true, wall: Some(wall) }
    }

    #[test]
    fn a_wall_stops_who_goes_towards_it_and_lets_him_slide_along() {
        let walls = ahead();
        assert_eq!(walls.stop(DVec3::ZERO, DVec3::NEG_Z * 0.5, BODY_M), DVec3::NEG_Z * 0.5, "not there yet");
        assert!((walls.stop(DVec3::ZERO, DVec3::NEG_Z * 5.0, BODY_M).z + 1.0 - BODY_M).abs() < 1e-12);
        let slid = walls.stop(DVec3::NEG_Z * (1.0 - BODY_M), DVec3::new(0.1, 0.0, -0.1), BODY_M);
        assert!(slid.distance(DVec3::X * 0.1) < 1e-12, "{slid}");
        assert_eq!(walls.stop(DVec3::NEG_Z * (1.0 - BODY_M), DVec3::Z, BODY_M), DVec3::Z, "away from it");
    }

    #[test]
    fn nobody_is_wider_than_a_person_however_large_the_scene() {
        assert_eq!(body_m(30.0), BODY_M);
        assert!(body_m(0.01) < 0.01, "nor wider than a doll's house");
    }

    #[test]
    fn a_wall_that_ends_or_lies_behind_holds_nobody() {
        let walls = ahead();
        let way = DVec3::NEG_Z * 2.0;
        assert_eq!(walls.stop(DVec3::X * 1.5, way, BODY_M), way, "past its end");
        assert_eq!(walls.stop(DVec3::NEG_Z * 1.5, way, BODY_M), way, "behind it");
        assert_eq!(Walls { are_on: false, ..ahead() }.stop(DVec3::ZERO, way, BODY_M), way);
    }
}
