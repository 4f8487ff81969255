//! From which of its points a lamp is looked from (ours).
//!
//! Xie, Wang, Popescu 2016, section 5, take its four corners whatever the scene is; section 6.3 leaves to trial and error how many images are
//! needed. Here probes tell ([`placement`]): small images from thirteen points, of which those are taken, the middle first, that
//! see most of what the ones before do not, until next to nothing is missing. A lamp so small that its middle sees what all of it does is
//! looked from there alone; of a tree, whose leaves hide each other otherwise from every point, some inner ones see what no corner does.

use camera::{Bounds, Pinhole};
use glam::DVec2;
use protocol::Lamp;

use crate::discretize::Capture;
use crate::discretize::placement::{self, Budget};

/// The points that come into question: the middle, the corners, the middles of the sides, and the middles of the quarters, as shares of
/// [`protocol::Area::half_world`].
pub const POINTS: [[f64; 2]; 13] = [
    [0.0, 0.0],
    [-1.0, -1.0],
    [1.0, -1.0],
    [-1.0, 1.0],
    [1.0, 1.0],
    [0.0, -1.0],
    [-1.0, 0.0],
    [1.0, 0.0],
    [0.0, 1.0],
    [-0.5, -0.5],
    [0.5, -0.5],
    [-0.5, 0.5],
    [0.5, 0.5],
];
/// The corners among them.
const CORNERS: [usize; 4] = [1, 2, 3, 4];
/// Probes have as many pixels as a square of this side.
pub const PROBE_PX: u32 = 128;
/// At most eight images of a face, and none for less than 0.05 % of what its points see.
pub const BUDGET: Budget = Budget { images: 8, missing: 0.0005 };

/// For each face that a lamp sees a scene by, the points that it is looked from, by their numbers in [`POINTS`].
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Places(Vec<Vec<usize>>);

impl Places {
    /// What is needed of what each point sees of a scene, small: for each face the probes of all [`POINTS`].
    pub fn by_probes(faces: &[Vec<Capture>], budget: Budget) -> Places {
        Places(faces.iter().map(|probes| placement::place(probes, DVec2::INFINITY, budget).views).collect())
    }

    /// The views of them that hold a box, face by face; of a face that was not seen before, those of the corners.
    pub fn views(&self, lamp: &Lamp, bounds: Bounds, side_px: u32) -> Vec<Vec<Pinhole>> {
        let of_face = |(face, views): (usize, Vec<Pinhole>)| {
            let points = self.0.get(face).map_or(&CORNERS[..], Vec::as_slice);
            points.iter().map(|&point| views[point]).collect()
        };
        all_views(lamp, bounds, side_px).into_iter().enumerate().map(of_face).collect()
    }
}

/// The views of all [`POINTS`] that hold a box, face by face.
pub fn all_views(lamp: &Lamp, bounds: Bounds, side_px: u32) -> Vec<Vec<Pinhole>> {
    lamp.views_at(&POINTS, bounds, side_px)
}

#[cfg(test)]
mod tests {
    use glam::DVec3;
    use protocol::{Area, AreaShape};

    use super::*;

    const BOUNDS: Bounds = Bounds { min: DVec3::new(-2.0, -1.0, -2.0), max: DVec3::new(2.0, 0.5, 2.0) };

    fn lamp() -> Lamp {
        let half_world = [[0.5, 0.0, 0.0], [0.0, 0.0, 0.25]];
        Lamp { middle_world: DVec3::Y * 3.0, area: Area { half_world, shape: AreaShape::Rectangle } }
    }

    #[test]
    fn a_face_that_nothing_was_chosen_for_is_seen_from_the_corners() {
        assert_eq!(Places::default().views(&lamp(), BOUNDS, 64), lamp().corner_views(BOUNDS, 64));
    }

    #[test]
    fn views_are_those_of_the_points_in_their_order() {
        let all = all_views(&lamp(), BOUNDS, 64);
        let [views] = &*Places(vec![vec![0, 12, 4]]).views(&lamp(), BOUNDS, 64) else { panic!("one face") };
        assert_eq!(*views, [all[0][0], all[0][12], all[0][4]]);
        let eyes: Vec<DVec3> = views.iter().map(|view| view.world_from_eye.translation).collect();
        assert_eq!(eyes, [[0.0, 3.0, 0.0], [0.25, 3.0, 0.125], [0.5, 3.0, 0.25]].map(DVec3::from));
    }
}
