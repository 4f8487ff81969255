//! The eyes that a reconstruction is seen from: seeded places near where the images were made.

use std::f64::consts::TAU;

use camera::{Pinhole, Rigid, Trace};
use glam::DVec3;
use scene::Scene;
use server::truth::Truth;

use crate::rng::Rng;
use crate::sets;
use crate::stage::Stage;

/// Field of view of the output.
pub const FOV_Y_RAD: f64 = TAU / 6.0;
/// Share of the output that the truth should cover; other views are drawn again.
pub const LEAST_COVERED: f64 = 0.6;
/// Views that are tried for one eye.
const TRIES: usize = 64;
/// A walker looks up and down by at most this.
const WALK_PITCH_RAD: f64 = 0.2;
/// An object is looked at from this far above the horizon.
const ELEVATION_RAD: std::ops::Range<f64> = 0.1..0.6;
/// How much nearer an object is looked at while it covers too little.
const NEARER: f64 = 0.85;

/// One eye.
pub struct Eye {
    /// What it sees.
    pub output: Pinhole,
    /// The middle of the region that it lies in, looking the same way.
    pub middle: Rigid,
    /// What it should see.
    pub truth: Truth,
}

/// `count` seeded eyes whose truth covers at least [`LEAST_COVERED`] of the output, or as much as [`TRIES`] views of a scene that shows
/// much sky; along `trace`, where there is one, whatever they see.
pub fn choose(
    stage: &mut Stage,
    trace: Option<&Trace>,
    count: usize,
    size_px: (u32, u32),
    seed: u64,
) -> anyhow::Result<Vec<Eye>> {
    let places = scene::builtin::walk_eyes(&stage.scene.name);
    let mut rng = Rng::new(seed);
    let radius_m = sets::region_radius_m(&stage.scene);
    let near_m = server::start::near_m(&stage.scene);
    let mut eyes = Vec::with_capacity(count);
    for index in 0..count {
        let place = places.get(index % places.len().max(1)).map(|place| place.eye_world);
        let mut nearer = 1.0;
        let mut best: Option<(usize, Eye)> = None;
        for _ in 0..TRIES {
            let recorded = trace.map(|trace| trace.at(trace.duration_s() * (index as f64 + 0.5) / count as f64));
            let middle = recorded.unwrap_or_else(|| middle(&stage.scene, place, nearer, &mut rng));
            let eye = Rigid { translation: middle.translation + rng.in_ball() * radius_m, ..middle };
            let output = Pinhole::symmetric(eye, size_px, FOV_Y_RAD, near_m);
            stage.show(0.0, eye.translation)?;
            let truth = stage.truth(&output)?;
            let covered = truth.w.iter().filter(|&&w| w > 0.0).count();
            let enough = if trace.is_some() { 1.0 } else { LEAST_COVERED * truth.w.len() as f64 };
            if best.as_ref().is_none_or(|(most, _)| covered > *most) {
                best = Some((covered, Eye { output, middle, truth }));
            }
            if covered as f64 >= enough {
                break;
            }
            nearer *= NEARER;
        }
        let sees_nothing = || anyhow::anyhow!("eye {index} sees nothing of {}", stage.scene.name);
        let (_, eye) = best.filter(|(covered, _)| *covered > 0).ok_or_else(sees_nothing)?;
        eyes.push(eye);
    }
    Ok(eyes)
}

/// A region's middle with a direction: at a place to stand, or around an object, `nearer` times as far as it just fits.
fn middle(scene: &Scene, place: Option<DVec3>, nearer: f64, rng: &mut Rng) -> Rigid {
    let yaw = rng.range(0.0, TAU);
    let level = DVec3::new(yaw.sin(), 0.0, yaw.cos());
    if scene.walk {
        let start = place.or(scene.start.map(|start| start.eye_world));
        let centre = scene.bounds.centre();
        let ground = DVec3::new(centre.x, scene.bounds.min.y + scene::builtin::EYE_HEIGHT_M, centre.z);
        let (up, along) = rng.range(-WALK_PITCH_RAD, WALK_PITCH_RAD).sin_cos();
        Rigid::look_along(start.unwrap_or(ground), level * along + DVec3::Y * up)
    } else {
        let (up, along) = rng.range(ELEVATION_RAD.start, ELEVATION_RAD.end).sin_cos();
        let distance_m = nearer * scene.bounds.radius_m() / (FOV_Y_RAD / 2.0).sin();
        let centre = scene.bounds.centre();
        Rigid::look_at(centre + (level * along + DVec3::Y * up) * distance_m, centre)
    }
}
