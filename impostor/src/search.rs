use ::camera::ImagePoint;
use glam::DVec3;

use crate::crossing::{Crossing, Side};
use crate::image::Impostor;
use crate::ray::Ray;
use crate::walk::{Method, StepCount, Walk};

/// How to look for an intersection.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Steps {
    /// How to walk.
    pub method: Method,
    /// An upper bound of a fine step's length in pixels, from 1/256 to 1: the papers take 1, 1/2 or 1/4.
    pub fine_px: f64,
}

/// Where a ray meets an impostor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hit {
    /// The ray's parameter.
    pub t: f64,
    /// The place in world space.
    pub p_world: DVec3,
    /// Its image.
    pub point: ImagePoint,
    /// Column and row of the sample that is met: what to take colour and normal from.
    pub pixel: (u32, u32),
    /// Which side is met.
    pub side: Side,
}

/// What a search came to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Search {
    /// The first intersection, or `None` if the ray meets nothing that the impostor holds.
    pub hit: Option<Hit>,
    /// What it cost.
    pub count: StepCount,
}

impl Impostor {
    /// The first intersection of a ray with what the impostor shows, from either side. A ray with a number missing, or without
    /// a direction, meets nothing.
    pub fn hit(&self, ray: &Ray, steps: Steps) -> Search {
        let mut walk = Walk::new(self, steps.fine_px);
        let clipped = self.bounds_world().and_then(|bounds| ray.clip(&bounds));
        let crossing = clipped.and_then(|clipped| walk.first_crossing(&clipped, steps.method));
        let hit = |Crossing { t, point, texel, side }: Crossing| Hit {
            t,
            p_world: ray.at(t),
            point,
            pixel: self.pixel(texel),
            side,
        };
        Search { hit: crossing.map(hit), count: walk.count() }
    }
}
