//! Closed ways on the ground, driven or walked along at an even pace.

use glam::{DAffine3, DQuat, DVec2, dvec3};

/// Points that round one corner.
const CORNER_POINTS: usize = 12;

/// A closed way with rounded corners, by the length gone.
#[derive(Debug, Clone)]
pub(super) struct Track {
    points: Vec<DVec2>,
    /// Metres from the start to each point, and to the start again.
    along_m: Vec<f64>,
}

impl Track {
    /// Through corners (x, z), each rounded from `radius_m` before to `radius_m` after it (at most half an edge).
    pub fn around(corners: &[DVec2], radius_m: f64) -> Self {
        let count = corners.len();
        let mut points = Vec::with_capacity(count * CORNER_POINTS);
        for (k, &corner) in corners.iter().enumerate() {
            let shorten = |to: DVec2| {
                let length = to.length();
                to / length * radius_m.min(length * 0.49)
            };
            let enter = corner + shorten(corners[(k + count - 1) % count] - corner);
            let leave = corner + shorten(corners[(k + 1) % count] - corner);
            for i in 0..CORNER_POINTS {
                let t = i as f64 / (CORNER_POINTS - 1) as f64;
                points.push(enter.lerp(corner, t).lerp(corner.lerp(leave, t), t));
            }
        }
        let mut along_m = vec![0.0];
        for (k, point) in points.iter().enumerate() {
            let next = points[(k + 1) % points.len()];
            along_m.push(along_m[k] + point.distance(next));
        }
        Track { points, along_m }
    }

    /// Around a rectangle, corners rounded, clockwise seen from above when `clockwise`.
    pub fn rectangle(centre: DVec2, half: DVec2, radius_m: f64, clockwise: bool) -> Self {
        let mut corners =
            [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(x, z)| centre + half * DVec2::new(x, z));
        if !clockwise {
            corners.reverse();
        }
        Track::around(&corners, radius_m)
    }

    pub fn length_m(&self) -> f64 {
        self.along_m[self.points.len()]
    }

    fn at(&self, gone_m: f64) -> DVec2 {
        let gone = gone_m.rem_euclid(self.length_m());
        let k = self.along_m.partition_point(|&along| along <= gone).clamp(1, self.points.len()) - 1;
        let step = self.along_m[k + 1] - self.along_m[k];
        let t = if step > 0.0 { (gone - self.along_m[k]) / step } else { 0.0 };
        self.points[k].lerp(self.points[(k + 1) % self.points.len()], t)
    }

    /// Standing on the way at height `y`, +z forward; `reach_m` before and after decide what forward is.
    pub fn pose(&self, gone_m: f64, y: f64, reach_m: f64) -> DAffine3 {
        let (back, front) = (self.at(gone_m - reach_m), self.at(gone_m + reach_m));
        let (at, forward) = ((back + front) / 2.0, front - back);
        DAffine3::from_rotation_translation(DQuat::from_rotation_y(forward.x.atan2(forward.y)), dvec3(at.x, y, at.y))
    }
}
