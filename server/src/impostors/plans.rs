//! Floor plans around reflectors, where a scene's maker tells of no corridors.

use std::sync::{Arc, Mutex, PoisonError};

use camera::CorridorMap;
use glam::DVec3;
use scene::Scene;

use super::reflector::Reflector;

/// Where a reflector of this many radii away found no corridors, there are none for it either.
const NEAR_RADII: f64 = 4.0;
/// Plans that are remembered, the latest ones: a reflector that is carried through an open country finds none in many places.
const MAX_FOUND: usize = 64;

/// The plans found so far: one a storey, and places without any.
#[derive(Debug, Clone)]
pub(super) struct Plans {
    told: Option<Arc<CorridorMap>>,
    found: Arc<Mutex<Vec<Found>>>,
}

#[derive(Debug)]
struct Found {
    plan: Option<Arc<CorridorMap>>,
    centre_world: DVec3,
    radius_m: f64,
}

impl Plans {
    pub fn of(scene: &Scene) -> Plans {
        Plans { told: scene.corridors.clone().map(Arc::new), found: Arc::default() }
    }

    /// The corridors that a reflector stands in: those told, or those of a plan of its storey; `None` where it stands in none.
    pub fn around(&self, reflector: &Reflector<'_>) -> Option<Arc<CorridorMap>> {
        let centre_world = reflector.ball.centre;
        let holds = |map: &Arc<CorridorMap>| {
            (0.0..map.height_m).contains(&(centre_world.y - map.origin_world.y)) && map.cell_of(centre_world).is_some()
        };
        if self.told.is_some() {
            return self.told.clone().filter(holds);
        }
        let mut found = self.found.lock().unwrap_or_else(PoisonError::into_inner);
        let known = found.iter().find(|found| match &found.plan {
            Some(plan) => holds(plan),
            None => found.centre_world.distance(centre_world) <= NEAR_RADII * found.radius_m,
        });
        if let Some(known) = known {
            return known.plan.clone();
        }
        let radius_m = reflector.ball.radius_m;
        let plan = scene::floor_plan(reflector.scene, reflector.snapshot, reflector.id, (centre_world, radius_m));
        let plan = plan.map(Arc::new);
        if found.len() == MAX_FOUND {
            found.remove(0);
        }
        found.push(Found { plan: plan.clone(), centre_world, radius_m });
        plan
    }
}
