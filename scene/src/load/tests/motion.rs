//! Keyframes at random: what moves stays between its keyframes, repeats, and is somewhere at any time.

use glam::{DAffine3, DMat3};
use proptest::prelude::*;
use serde_json::json;

use super::build::{Builder, TRIANGLE};
use super::{first_triangle, load_gltf};
use crate::Scene;

/// Ages of a scene, the time before its begin, and what is no time.
const ODD_TIMES_S: [f64; 9] =
    [1e9, -1e9, 1e9 + 0.37, -0.0, f64::MIN_POSITIVE, -f64::MIN_POSITIVE, 1e300, f64::INFINITY, f64::NAN];

/// Keyframes of a few numbers each, at growing times.
#[derive(Debug, Clone)]
struct Keys {
    times_s: Vec<f32>,
    values: Vec<f32>,
}

fn keys(width: usize, value: impl Strategy<Value = f32> + Clone) -> impl Strategy<Value = Keys> {
    let steps = prop::collection::vec(prop_oneof![1e-3..1e-2_f32, 0.1..3.0_f32], 1..6);
    (prop_oneof![Just(0.0), 0.0..1.0_f32], steps).prop_flat_map(move |(begin_s, steps)| {
        let times_s: Vec<f32> = std::iter::once(begin_s)
            .chain(steps.iter().scan(begin_s, |at_s, step_s| {
                *at_s += step_s;
                Some(*at_s)
            }))
            .collect();
        let values = prop::collection::vec(value.clone(), width * times_s.len());
        values.prop_map(move |values| Keys { times_s: times_s.clone(), values })
    })
}

impl Keys {
    fn period_s(&self) -> f64 {
        self.times_s.last().copied().unwrap_or_default().into()
    }

    /// The least and the greatest of a number of all keyframes.
    fn hull(&self, width: usize, at: usize) -> (f64, f64) {
        let values = self.values.iter().skip(at).step_by(width).map(|&value| f64::from(value));
        values.fold((f64::INFINITY, f64::NEG_INFINITY), |(least, most), value| (least.min(value), most.max(value)))
    }

    /// A triangle whose node one property of moves.
    fn moves(&self, path: &str, interpolation: &str, shape: &str) -> Scene {
        let mut builder = Builder::of_positions(&TRIANGLE);
        builder.animate(path, interpolation, &self.times_s, &self.values, shape);
        load_gltf(&builder.glb()).unwrap()
    }
}

/// A period later, times have rounded: how far that moves at most what goes so fast.
fn rounding(keys: &Keys, time_s: f64, range: f64) -> f64 {
    let shortest_s = keys.times_s.windows(2).map(|pair| f64::from(pair[1] - pair[0])).fold(1.0, f64::min);
    1e-5 + range * 8.0 * f64::EPSILON * (time_s.abs() + 1.0) / shortest_s
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 256, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn what_moves_stays_between_its_keyframes_and_repeats(
        keys in keys(3, -100.0..100.0_f32),
        interpolation in prop_oneof![Just("LINEAR"), Just("STEP")],
        share in 0.0..1.0_f64,
        rounds in -3..1000_i32,
    ) {
        let scene = keys.moves("translation", interpolation, "VEC3");
        let period_s = keys.period_s();
        let (once_s, later_s) = (share * period_s, (share + f64::from(rounds)) * period_s);
        let (once, later) = (first_triangle(&scene, once_s)[0], first_triangle(&scene, later_s)[0]);
        for at in 0..3 {
            let (least, most) = keys.hull(3, at);
            prop_assert!(once[at] >= least - 1e-4 && once[at] <= most + 1e-4, "{} of {least} to {most}", once[at]);
            let slack = rounding(&keys, later_s, most - least);
            // A step may be taken a hair sooner.
            let near_step = keys.times_s.iter().any(|&t| (f64::from(t) - once_s).abs() < 1e-9 * (1.0 + later_s.abs()));
            prop_assert!((once[at] - later[at]).abs() <= slack || near_step, "{} and {} a period later", once[at], later[at]);
        }
    }

    #[test]
    fn keyframes_are_met(keys in keys(3, -100.0..100.0_f32), key in any::<prop::sample::Index>()) {
        // The last one is where it begins again.
        let key = key.index(keys.times_s.len() - 1);
        for interpolation in ["LINEAR", "STEP"] {
            let scene = keys.moves("translation", interpolation, "VEC3");
            let found = first_triangle(&scene, f64::from(keys.times_s[key]))[0];
            let wanted = glam::Vec3::from_slice(&keys.values[3 * key..]).as_dvec3();
            prop_assert!(found.distance(wanted) < 1e-4, "{found} instead of {wanted}");
        }
    }

    #[test]
    fn what_turns_keeps_its_shape_and_scale_its_range(
        turns in keys(4, -1.0..1.0_f32),
        scales in keys(3, 0.01..100.0_f32),
        share in -2.0..3.0_f64,
    ) {
        let place = |scene: &Scene, time_s: f64| scene.at(time_s).world_from_mesh[0];
        let turn = place(&turns.moves("rotation", "LINEAR", "VEC4"), share * turns.period_s());
        let off = turn.matrix3 * turn.matrix3.transpose() - DMat3::IDENTITY;
        prop_assert!(off.to_cols_array().iter().all(|number| number.abs() < 1e-5), "{turn:?}");
        prop_assert!((turn.matrix3.determinant() - 1.0).abs() < 1e-5);
        let scale = place(&scales.moves("scale", "LINEAR", "VEC3"), share * scales.period_s());
        for at in 0..3 {
            let ((least, most), found) = (scales.hull(3, at), scale.matrix3.col(at).length());
            prop_assert!(found >= least * 0.9999 && found <= most * 1.0001, "{found} of {least} to {most}");
        }
    }

    #[test]
    fn whatever_is_animated_is_somewhere_at_any_time(
        keys in keys(9, prop_oneof![Just(0.0), -100.0..100.0_f32]),
        path in prop_oneof![Just("translation"), Just("scale")],
        odd in any::<f64>(),
    ) {
        // In-tangent, value and out-tangent of three numbers each: splines may leave their keyframes, and a scale may vanish.
        let scene = keys.moves(path, "CUBICSPLINE", "VEC3");
        for time_s in ODD_TIMES_S.into_iter().chain([odd]) {
            let place: DAffine3 = scene.at(time_s).world_from_mesh[0];
            prop_assert!(place.is_finite() && place.matrix3.determinant() != 0.0, "{place:?} at {time_s}");
            prop_assert_eq!(scene.places(time_s), vec![place]);
        }
    }

    #[test]
    fn what_morphs_stays_between_its_shapes(
        keys in keys(1, 0.0..1.0_f32),
        lift in -50.0..50.0_f32,
        share in -2.0..3.0_f64,
    ) {
        let mut builder = Builder::of_positions(&TRIANGLE);
        let target = builder.floats(&[0.0, 0.0, lift].repeat(3), "VEC3");
        builder.json["meshes"][0]["primitives"][0]["targets"] = json!([{"POSITION": target}]);
        builder.animate("weights", "LINEAR", &keys.times_s, &keys.values, "SCALAR");
        let scene = load_gltf(&builder.glb()).unwrap();
        let ends = (f64::from(lift).min(0.0), f64::from(lift).max(0.0));
        for time_s in ODD_TIMES_S.into_iter().chain([share * keys.period_s()]) {
            let lifted = first_triangle(&scene, time_s)[0].z;
            prop_assert!(lifted >= ends.0 - 1e-4 && lifted <= ends.1 + 1e-4, "{lifted} of {ends:?} at {time_s}");
        }
    }
}
