//! A light with an area, and the views from its points: plain maths that both ends need.

use camera::{Bounds, Pinhole, parallel_views};
use glam::DVec3;

use crate::look::{Area, Light};

/// A light with an area.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lamp {
    /// Its middle.
    pub middle_world: DVec3,
    /// What shines around it.
    pub area: Area,
}

impl Lamp {
    /// `None` of a light without an area, or where numbers of it are not finite.
    pub fn of(light: &Light) -> Option<Lamp> {
        let Light::Point { position_world, area: Some(area), .. } = light else { return None };
        let lamp = Lamp { middle_world: DVec3::from(*position_world), area: *area };
        (lamp.middle_world.is_finite() && area.is_finite()).then_some(lamp)
    }

    /// The views of its points that hold a box, face by face, all of them in each.
    pub fn views(&self, bounds: Bounds, points: u32, map_px: u32) -> Vec<Vec<Pinhole>> {
        let eyes: Vec<DVec3> = self.area.points_world(self.middle_world, points).collect();
        self.views_from(&eyes, bounds, map_px)
    }

    /// The same of its four corners: what its points see together, but for what only the inner ones do.
    pub fn corner_views(&self, bounds: Bounds, side_px: u32) -> Vec<Vec<Pinhole>> {
        self.views_from(&self.area.corners_world(self.middle_world), bounds, side_px)
    }

    /// The same of any of its points, as shares of [`Area::half_world`].
    pub fn views_at(&self, points: &[[f64; 2]], bounds: Bounds, side_px: u32) -> Vec<Vec<Pinhole>> {
        let eyes: Vec<DVec3> = points.iter().map(|[s, t]| self.area.at(self.middle_world, *s, *t)).collect();
        self.views_from(&eyes, bounds, side_px)
    }

    fn views_from(&self, eyes: &[DVec3], bounds: Bounds, side_px: u32) -> Vec<Vec<Pinhole>> {
        parallel_views(eyes, self.area.half_world.map(DVec3::from), bounds, side_px)
    }
}
