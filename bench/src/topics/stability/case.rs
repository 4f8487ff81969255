//! A case: a scene, and who looks at it.

use camera::{Pinhole, Rigid};
use glam::DVec3;
use scene::Scene;

use crate::sets;

/// Side of a picture.
pub const PICTURE_PX: u32 = 160;
pub const FOV_Y_RAD: f64 = std::f64::consts::TAU / 6.0;

/// A scene and who looks at it.
#[derive(Clone)]
pub struct Case {
    pub scene: Scene,
    /// The middle of the region that the set is made for.
    pub middle: Rigid,
    pub near_m: f64,
}

impl Case {
    /// An eye that looks at a target.
    pub fn look(scene: Scene, eye: DVec3, target: DVec3, near_m: f64) -> Case {
        Case { scene, middle: Rigid::look_at(eye, target), near_m }
    }

    /// The picture of an eye that looks the same way.
    pub fn camera(&self, eye_world: DVec3) -> Pinhole {
        let eye = Rigid { translation: eye_world, ..self.middle };
        Pinhole::symmetric(eye, (PICTURE_PX, PICTURE_PX), FOV_Y_RAD, self.near_m)
    }

    /// The middle of the region, and a place on its rim, above to the right.
    pub fn eyes(&self) -> [DVec3; 2] {
        let to_rim = self.middle.rotation * DVec3::new(1.0, -1.0, 0.0).normalize() * sets::region_radius_m(&self.scene);
        [self.middle.translation, self.middle.translation + to_rim]
    }
}
