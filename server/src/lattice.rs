//! Where rigid objects may be: on a lattice so fine that nobody sees it.
//!
//! What a scene composes of its transforms has noise in its last bits, which takes most bytes of a pose and shows nothing. So whatever is rigid and moves is put on the nearest
//! point of a lattice, for images and for what is said alike. A way from point to point is then whole steps ([`protocol::ObjectShift`]).
//!
//! A step of an object's origin is 2^-17 of the nearest distance that is drawn, or less. Its axes have steps that move none of its points farther than that. A point is then off by
//! `(1/2 + 3/2) sqrt(3)` steps at most, which is 3e-5 of that distance: a twentieth of a pixel where it is drawn nearest, in a picture 2,000 pixels high. And axes have steps of 2^-24 of
//! their lengths at most, so that what only turned is known to have only turned ([`camera::turn_of`]).

use std::sync::Arc;

use glam::{DAffine3, DMat3, DVec3, Vec3};
use protocol::Step;
use scene::Scene;

/// The step of an origin, by the nearest distance that is drawn: its exponent.
const ORIGIN_BITS: i32 = 17;
/// The largest step of an axis, by its length.
const AXIS_BITS: i32 = 24;
/// What is shown between two updates may be off by so many times as much: it is a moment on its way.
const STEP_SLACK_BITS: i32 = 3;

/// See the module.
#[derive(Debug, Clone, Default)]
pub struct Lattice {
    /// By instance; `None` of what never moves, or bends.
    of: Arc<[Option<Exponents>]>,
}

/// Of the steps, as powers of two.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Exponents {
    origin: i32,
    axes: i32,
    /// Of a turn, in radians.
    turn: i32,
}

impl Lattice {
    /// For a scene of which nothing nearer than `near_m` is drawn.
    pub fn new(scene: &Scene, near_m: f64) -> Lattice {
        let moves = scene.instances.iter().any(|instance| instance.moves && !instance.deforms);
        if !moves {
            return Lattice::default();
        }
        let places = scene.places(0.0);
        let of = scene.instances.iter().zip(places).map(|(instance, place)| {
            let [least, most] =
                scene.meshes.get(instance.mesh as usize)?.bounds.map(|corner| Vec3::from(corner).as_dvec3());
            let reach_m = least.abs().max(most.abs()).length();
            let [x, y, z] = [place.matrix3.x_axis, place.matrix3.y_axis, place.matrix3.z_axis].map(DVec3::length);
            let shortest = x.min(y).min(z);
            let exponents = Exponents::new(near_m, reach_m, (shortest, x.max(y).max(z)));
            exponents.filter(|_| instance.moves && !instance.deforms)
        });
        Lattice { of: of.collect() }
    }

    /// Places of all instances, on the lattice.
    pub fn settled(&self, mut places: Vec<DAffine3>) -> Vec<DAffine3> {
        self.settle(&mut places);
        places
    }

    /// Puts places of all instances on the lattice.
    pub fn settle(&self, places: &mut [DAffine3]) {
        for (place, exponents) in places.iter_mut().zip(&*self.of) {
            if let Some(Exponents { origin, axes, .. }) = *exponents {
                place.translation = DVec3::from_array(place.translation.to_array().map(|number| on(number, origin)));
                place.matrix3 = DMat3::from_cols_array(&place.matrix3.to_cols_array().map(|number| on(number, axes)));
            }
        }
    }

    /// Steps that an object goes next, on a coarser lattice.
    pub fn settled_steps(&self, object: u16, steps: [Step; 3]) -> [Step; 3] {
        let Some(Exponents { origin, turn, .. }) = self.of.get(usize::from(object)).copied().flatten() else {
            return steps;
        };
        let on_all = |vector: Vec3, exponent: i32| {
            Vec3::from_array(vector.to_array().map(|number| on(f64::from(number), exponent) as f32))
        };
        let settled = |step: Step| Step {
            way_world: on_all(step.way_world, origin + STEP_SLACK_BITS),
            turn_world: on_all(step.turn_world, turn + STEP_SLACK_BITS),
        };
        steps.map(settled)
    }
}

impl Exponents {
    /// Of an object that reaches so far from its origin, in its own units, with axes of such lengths, the shortest and the longest; `None` where there is no such lattice.
    fn new(near_m: f64, reach: f64, (shortest, longest): (f64, f64)) -> Option<Exponents> {
        let origin = floor_log2(near_m)? - ORIGIN_BITS;
        let by_length = floor_log2(shortest)? - AXIS_BITS;
        let by_reach = |reach: f64| floor_log2(2f64.powi(origin) / reach);
        let axes = if reach > 0.0 { by_reach(reach)?.min(by_length) } else { by_length };
        let reach_m = reach * longest;
        let turn = if reach_m > 0.0 { by_reach(reach_m)? } else { -AXIS_BITS };
        Some(Exponents { origin, axes, turn })
    }
}

/// `None` where there is none that is an ordinary number.
fn floor_log2(number: f64) -> Option<i32> {
    (number.is_normal() && number > 0.0).then(|| number.log2().floor() as i32)
}

/// The nearest whole number of steps. What is so large that it has no finer bits stays as it is.
fn on(number: f64, exponent: i32) -> f64 {
    let step = 2f64.powi(exponent);
    let steps = (number / step).round();
    if steps.abs() < 2f64.powi(53) { steps * step } else { number }
}

#[cfg(test)]
mod tests {
    use camera::turn_of;

    use super::*;

    fn at(angle_rad: f64, scale: f64, far_m: f64) -> DAffine3 {
        let turned = DMat3::from_axis_angle(DVec3::new(0.48, 0.6, 0.64), angle_rad) * scale;
        DAffine3 { matrix3: turned, translation: DVec3::new(far_m, -0.3, far_m / 7.0) }
    }

    #[test]
    fn nobody_sees_it_and_ways_on_it_are_short() {
        for (near_m, reach, scale, far_m) in [
            (0.1, 1.0, 1.0, 30.0),
            (1e-7, 1e-6, 1.0, 1e-5),
            (0.1, 100.0, 1.0, 1e5),
            (0.05, 1e-3, 1e3, 10.0),
            (0.1, 0.0, 1.0, 1e9),
        ] {
            let exponents = Exponents::new(near_m, reach, (scale, scale)).expect("a lattice");
            let lattice = Lattice { of: [Some(exponents)].into() };
            let poses = [0.0, 0.1].map(|angle_rad| at(angle_rad, scale, far_m + 10.0 * angle_rad * near_m));
            let [from, to] = poses.map(|pose| lattice.settled(vec![pose])[0]);
            let corner = DVec3::new(0.0, reach, 0.0);
            let off_m = from.transform_point3(corner).distance(poses[0].transform_point3(corner));
            assert!(off_m <= 3.0e-5 * near_m + far_m * f64::EPSILON * 4.0, "{off_m} of {near_m}");
            assert!(turn_of(&from.matrix3, &to.matrix3).is_some());
            assert_eq!(lattice.settled(vec![from])[0], from, "once is enough");
            if far_m < 1e9 && reach < 100.0 {
                protocol::ObjectShift::between(0, &from, &to).expect("whole steps");
            }
        }
        assert_eq!(Exponents::new(0.0, 1.0, (1.0, 1.0)), None);
        assert_eq!(Exponents::new(0.1, 1.0, (0.0, 1.0)), None);
    }

    #[test]
    fn steps_are_settled_and_what_stands_goes_nowhere() {
        let exponents = Exponents::new(0.1, 1.0, (1.0, 1.0)).expect("a lattice");
        let lattice = Lattice { of: [None, Some(exponents)].into() };
        let step = Step { way_world: Vec3::new(0.05, 1e-9, 0.0), turn_world: Vec3::new(0.0, 0.03, 1e-9) };
        assert_eq!(lattice.settled_steps(0, [step; 3]), [step; 3], "it never moves");
        let [settled, ..] = lattice.settled_steps(1, [step; 3]);
        assert!((settled.way_world - step.way_world).length() < 1e-5 && settled.way_world.y == 0.0);
        assert!((settled.turn_world - step.turn_world).length() < 1e-5 && settled.turn_world.z == 0.0);
    }
}
