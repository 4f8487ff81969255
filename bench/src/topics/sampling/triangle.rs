//! The triangle of viewpoints that a scene is sampled from (Xie, Wang, Popescu 2016, §6.1.2): reference images are taken at its corners,
//! output frames between them.

use camera::{Pinhole, Rigid};
use glam::DVec3;
use scene::Scene;

use crate::rng::Rng;

/// Field of view of all images and frames.
pub const FOV_Y_RAD: f64 = std::f64::consts::TAU / 6.0;
/// Side of the triangle over the distance of its middle from what is looked at, where nothing else is asked for.
const SIDE_OVER_DISTANCE: f64 = 0.25;
/// How far ahead of an eye lies what it looks at, in a scene to walk in, in metres.
const AHEAD_M: f64 = 8.0;
/// The side of the triangle in metres for the paper's scenes, chosen once so that conventional images are about as redundant as in the
/// paper.
const SIDES: [(&str, f64); 4] = [("birdnest", 0.5), ("grass", 0.6), ("urban", 9.0), ("tree", 15.0)];
/// Those of them that are seen whole, from above; from there blades of grass hide nothing but soil.
const WHOLE: [&str; 3] = ["birdnest", "urban", "tree"];
/// From where a whole scene is seen, and from how many bounding radii away: its corners are cut off, so that it fills the images.
const BACK: DVec3 = DVec3::new(0.5, 0.8, 1.0);
const WHOLE_RADII: f64 = 1.4;

/// Three viewpoints around a middle, all looking at one point.
#[derive(Debug, Clone, Copy)]
pub struct ViewTriangle {
    /// Of the equilateral triangle, which faces `target_world`.
    pub corners_world: [DVec3; 3],
    /// What every eye looks at.
    pub target_world: DVec3,
    /// Metres.
    pub side_m: f64,
}

impl ViewTriangle {
    /// Around `middle`, or where nothing is given around the place where the scene begins; some scenes are seen whole.
    pub fn of(scene: &Scene, middle: Option<Rigid>, side_m: Option<f64>) -> ViewTriangle {
        let whole = middle.is_none() && WHOLE.contains(&scene.name.as_str());
        let usual_side = SIDES.iter().find(|(name, _)| *name == scene.name && middle.is_none());
        let centre = scene.bounds.centre();
        let start = match (middle, whole) {
            (Some(middle), _) => middle,
            (None, false) => server::start::start_pose(scene),
            (None, true) => Rigid::look_at(centre + BACK.normalize() * (WHOLE_RADII * scene.bounds.radius_m()), centre),
        };
        let walks = scene.walk && !whole;
        let target_world =
            if walks || middle.is_some() { start.translation + AHEAD_M * (start.rotation * DVec3::Z) } else { centre };
        let distance_m = target_world.distance(start.translation);
        let side_m = side_m.or(usual_side.map(|(_, side_m)| *side_m)).unwrap_or(SIDE_OVER_DISTANCE * distance_m);
        // The radius of the circle through the corners.
        let radius_m = side_m / 3.0_f64.sqrt();
        let corners_world = [90.0_f64, 210.0, 330.0].map(|angle_deg| {
            let (up, right) = angle_deg.to_radians().sin_cos();
            start.translation + radius_m * (start.rotation * DVec3::new(right, -up, 0.0))
        });
        ViewTriangle { corners_world, target_world, side_m }
    }

    /// The eye with these weights of the corners, whose sum is 1.
    pub fn camera(&self, weights: [f64; 3], size_px: (u32, u32), near_m: f64) -> Pinhole {
        let eye_world = self.corners_world.iter().zip(weights).map(|(&corner, weight)| weight * corner).sum();
        Pinhole::symmetric(Rigid::look_at(eye_world, self.target_world), size_px, FOV_Y_RAD, near_m)
    }

    /// The eyes at the corners.
    pub fn corners(&self, size_px: (u32, u32), near_m: f64) -> Vec<Pinhole> {
        let weights = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        weights.map(|weights| self.camera(weights, size_px, near_m)).to_vec()
    }

    /// The eye in the middle.
    pub fn middle(&self, size_px: (u32, u32), near_m: f64) -> Pinhole {
        self.camera([1.0 / 3.0; 3], size_px, near_m)
    }

    /// Eyes all over the triangle: the middle, then `rows * (rows + 1) / 2` on a grid.
    pub fn grid(&self, rows: u32, size_px: (u32, u32), near_m: f64) -> Vec<Pinhole> {
        let last = rows - 1;
        let weights = (0..=last).flat_map(|a| (0..=last - a).map(move |b| [a, b, last - a - b]));
        let eyes = weights.map(|weights| weights.map(|weight| f64::from(weight) / f64::from(last.max(1))));
        let eyes = eyes.map(|weights| self.camera(weights, size_px, near_m));
        std::iter::once(self.middle(size_px, near_m)).chain(eyes).collect()
    }

    /// Seeded eyes, spread evenly.
    pub fn between(&self, count: usize, seed: u64, size_px: (u32, u32), near_m: f64) -> Vec<Pinhole> {
        let mut rng = Rng::new(seed);
        let mut eye = || {
            let (a, b) = (rng.range(0.0, 1.0), rng.range(0.0, 1.0));
            // The half of a parallelogram.
            let (a, b) = if a + b > 1.0 { (1.0 - a, 1.0 - b) } else { (a, b) };
            self.camera([a, b, 1.0 - a - b], size_px, near_m)
        };
        (0..count).map(|_| eye()).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn corners_are_a_side_apart_and_the_rest_lies_between() {
        let scene = scene::builtin::load("pillars").expect("built in");
        let triangle = ViewTriangle::of(&scene, None, None);
        let [a, b, c] = triangle.corners_world;
        for distance_m in [a.distance(b), b.distance(c), c.distance(a)] {
            assert!((distance_m - triangle.side_m).abs() < 1e-9);
        }
        let middle = triangle.middle((8, 8), 0.1).world_from_eye.translation;
        let grid = triangle.grid(4, (8, 8), 0.1);
        assert_eq!(grid.len(), 11);
        assert!(grid[1].world_from_eye.translation.distance(c) < 1e-9, "a corner");
        for eye in triangle.between(50, 1, (8, 8), 0.1).iter().chain(&grid) {
            assert!(eye.world_from_eye.translation.distance(middle) <= triangle.side_m / 3.0_f64.sqrt() + 1e-9);
        }
    }
}
