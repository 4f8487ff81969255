//! How much of each light arrives at the pixels of a view, in truth.

use std::sync::Arc;

use camera::Pinhole;
use glam::DVec3;
use gpu::Gpu;
use protocol::{Light, Lighting, Look, Viewpoint, shadow_views};
use scene::Scene;
use server::discretize::{Discretization, Discretizer};

use crate::raytrace::{Effects, RayTruth};
use crate::stage::Stage;
use crate::topics::shadows::hidden::{Hidden, MapTruth, receivers};

/// Side of the maps of the full geometry.
const MAP_PX: u32 = 4096;
/// How far a light from afar is taken to be, in radii of the scene: over the scene, its direction changes by a hundred-thousandth.
const AFAR_RADII: f64 = 1e5;

/// See the module.
pub(super) struct Truths {
    stage: Stage,
    discretizer: Discretizer,
}

/// A view, and what arrives in it.
pub(super) struct Seen {
    pub view: Pinhole,
    /// Of each light that casts, the strongest first.
    pub lights: Vec<Arriving>,
}

/// Of one light: which pixels face it, and which of these it does not reach.
pub(super) struct Arriving {
    /// Whether a pixel's surface faces the light.
    pub facing: Vec<bool>,
    /// By rays.
    pub hidden_by_rays: Vec<bool>,
    /// By a map of the full geometry.
    pub hidden_by_map: Vec<bool>,
}

impl Truths {
    pub fn new(gpu: &Gpu, scene: &Arc<Scene>) -> anyhow::Result<Truths> {
        let stage = Stage::new(gpu, (**scene).clone(), Look::Plain)?;
        let discretizer = Discretizer::new(&stage.renderer)?;
        Ok(Truths { stage, discretizer })
    }

    /// What arrives at a time.
    pub fn at(&mut self, time_s: f64, view: &Pinhole) -> anyhow::Result<Seen> {
        let eye_world = view.world_from_eye.translation;
        self.stage.show(time_s, eye_world)?;
        let lighting = self.stage.lighting.clone();
        let rays = RayTruth::new(&self.stage.scene, self.stage.snapshot(), &lighting);
        let first = rays.picture(view, &Effects::PLAIN, 1).first;
        let casting = lighting.strongest_at(eye_world).into_iter().take(Lighting::MAX_CASTING);
        let mut lights = Vec::new();
        for light in casting.map(|light| &lighting.lights[light]) {
            let place_world = self.place_world(light);
            let faces =
                |point: &crate::raytrace::SurfacePoint| point.normal_world.dot(place_world - point.p_world) > 0.0;
            let hidden = rays.hidden_points(view, &[place_world]);
            lights.push(Arriving {
                facing: first.iter().map(|point| point.as_ref().is_some_and(faces)).collect(),
                hidden_by_rays: flags(&Hidden::new(1, hidden)),
                hidden_by_map: flags(&self.by_maps(light, view)?),
            });
        }
        Ok(Seen { view: *view, lights })
    }

    fn place_world(&self, light: &Light) -> DVec3 {
        match light {
            Light::Point { position_world, .. } => (*position_world).into(),
            Light::Directional { direction_world, .. } => {
                let bounds = &self.stage.scene.bounds;
                bounds.centre()
                    - DVec3::from(direction_world.map(f64::from)).normalize() * AFAR_RADII * bounds.radius_m()
            }
        }
    }

    /// By the widest frame of a light from afar, or all faces of one of a place: no pixel lies in two of those.
    fn by_maps(&mut self, light: &Light, view: &Pinhole) -> anyhow::Result<Hidden> {
        let shown =
            self.discretizer.run(&self.stage.renderer, &[*view], Discretization::Conventional)?.wait()?.remove(0);
        let double_sided: Vec<bool> =
            self.stage.renderer.materials().iter().map(|material| material.double_sided).collect();
        let bounds = camera::Bounds { min: self.stage.scene.bounds.min, max: self.stage.scene.bounds.max };
        let mut views = shadow_views(light, bounds, Viewpoint::of(view), MAP_PX);
        if matches!(light, Light::Directional { .. }) {
            views = views.pop().into_iter().collect();
        }
        let mut map = MapTruth::new(receivers(&shown, &double_sided), 1);
        for face in views {
            let seen = self.discretizer.run(&self.stage.renderer, &[face], Discretization::Conventional)?.wait()?;
            map.add(0, &seen[0]);
        }
        Ok(map.done())
    }
}

fn flags(hidden: &Hidden) -> Vec<bool> {
    hidden.pixels.iter().map(|words| words.as_ref().is_some_and(|words| words[0] != 0)).collect()
}
