//! How far a viewer is from where it was expected, by what its client says of its motion.

use camera::Rigid;
use client::receive::viewer::MotionEstimator;

/// What predictions were off by.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PredictionErrors {
    /// Metres, mean.
    pub mean_m: f64,
    /// Metres, of one in twenty at least.
    pub p95_m: f64,
    /// Degrees, mean.
    pub mean_deg: f64,
    /// Degrees, of one in twenty at least.
    pub p95_deg: f64,
}

/// Lays poses beside those that were predicted `ahead_s` before, at each of `times_s`, in order, at which a client looks where its eye is
/// (`at`).
pub fn prediction_errors(at: impl Fn(f64) -> Rigid, times_s: &[f64], ahead_s: f64) -> PredictionErrors {
    let mut estimator = MotionEstimator::default();
    let (mut off_m, mut off_deg) = (Vec::new(), Vec::new());
    for &now_s in times_s {
        let pose = at(now_s);
        let expected = estimator.see(pose, now_s).pose_after(&pose, ahead_s);
        let truth = at(now_s + ahead_s);
        off_m.push(expected.translation.distance(truth.translation));
        off_deg.push(expected.rotation.angle_between(truth.rotation).to_degrees());
    }
    let ([mean_m, p95_m], [mean_deg, p95_deg]) = (mean_and_p95(off_m), mean_and_p95(off_deg));
    PredictionErrors { mean_m, p95_m, mean_deg, p95_deg }
}

fn mean_and_p95(mut values: Vec<f64>) -> [f64; 2] {
    values.sort_by(f64::total_cmp);
    let mean = values.iter().sum::<f64>() / values.len().max(1) as f64;
    [mean, values.get(values.len() * 95 / 100).copied().unwrap_or(0.0)]
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use glam::{DQuat, DVec3};

    use super::*;

    const EYE_HEIGHT: DVec3 = DVec3::new(0.0, 1.7, 0.0);
    /// Update intervals ten times a second: half of one, and the round trip, is what a server predicts over.
    const HALF_INTERVAL_S: f64 = 0.05;

    fn line(t_s: f64) -> Rigid {
        Rigid::look_along(EYE_HEIGHT + DVec3::new(1.5, 0.0, -0.5) * t_s, DVec3::NEG_Z)
    }

    /// 144 degrees a second at 5 m from an object.
    fn orbit(t_s: f64) -> Rigid {
        let angle = 144_f64.to_radians() * t_s;
        Rigid::look_at(DVec3::new(5.0 * angle.sin(), 2.0, 5.0 * angle.cos()), DVec3::ZERO)
    }

    /// An object is turned by 360 degrees a second, and runs out.
    fn flick(t_s: f64) -> Rigid {
        let angle = TAU * 0.3 * (1.0 - (-t_s.max(0.0) / 0.3).exp());
        Rigid::look_at(DVec3::new(5.0 * angle.sin(), 2.0, 5.0 * angle.cos()), DVec3::ZERO)
    }

    /// A walker looks left and right, 35 degrees each way, once in two seconds.
    fn looking_around(t_s: f64) -> Rigid {
        let yaw = 35_f64.to_radians() * (TAU / 2.0 * t_s).sin();
        Rigid::look_along(EYE_HEIGHT + DVec3::NEG_Z * 1.4 * t_s, DQuat::from_rotation_y(yaw) * DVec3::NEG_Z)
    }

    /// What a mouse does to a drag round an object: angles are whole pixels (of half a degree, as on 360 lines), and events come as they like.
    fn dragged(t_s: f64) -> Rigid {
        let event_s = (t_s * 90.0).floor() / 90.0 + 0.003 * (t_s * 90.0).floor().sin();
        let angle = (144.0 * event_s / 0.5).round() * 0.5_f64.to_radians();
        Rigid::look_at(DVec3::new(5.0 * angle.sin(), 2.0, 5.0 * angle.cos()), DVec3::ZERO)
    }

    #[test]
    fn a_viewer_is_where_it_was_expected() {
        let frames: Vec<f64> = (0..180).map(|frame| f64::from(frame) / 60.0).collect();
        // The mean error that is allowed, in metres and in degrees, at 20, 100 and 200 ms.
        type Bars = [(f64, f64); 3];
        type PoseAt = fn(f64) -> Rigid;
        let motions: [(&str, PoseAt, Bars); 5] = [
            ("line", line, [(0.003, 0.001); 3]),
            ("orbit", orbit, [(0.02, 0.2), (0.04, 0.4), (0.06, 0.6)]),
            ("flick", flick, [(0.03, 0.4), (0.06, 0.8), (0.1, 1.2)]),
            ("walk, head turns", looking_around, [(0.01, 1.5), (0.01, 5.0), (0.01, 12.0)]),
            ("dragged", dragged, [(0.1, 1.0), (0.16, 1.8), (0.25, 3.0)]),
        ];
        let mut misses = Vec::new();
        for (name, at, bars) in motions {
            for (round_trip_s, (most_m, most_deg)) in [0.02, 0.1, 0.2].into_iter().zip(bars) {
                let found = prediction_errors(at, &frames, round_trip_s + HALF_INTERVAL_S);
                println!(
                    "| {name} | {} ms | {:.3} m ({:.3}) | {:.2} degrees ({:.2}) |",
                    round_trip_s * 1e3,
                    found.mean_m,
                    found.p95_m,
                    found.mean_deg,
                    found.p95_deg
                );
                if !(found.mean_m <= most_m && found.mean_deg <= most_deg) {
                    misses.push(format!("{name} at {round_trip_s} s: {found:?}"));
                }
            }
        }
        assert!(misses.is_empty(), "{misses:#?}");
    }

    #[test]
    fn who_stops_is_expected_where_he_is() {
        let stopping = |t_s: f64| orbit(t_s.min(1.0));
        let after: Vec<f64> = (0..120).map(|frame| f64::from(frame) / 60.0).collect();
        let all = prediction_errors(stopping, &after, 0.15);
        // Nine poses before the stop lead past it, the one at the stop too; all others are right.
        assert!(all.p95_m > 0.0 && all.p95_m < 5.0 * 144_f64.to_radians() * 0.15, "{all:?}");
        let still = prediction_errors(stopping, &after[61..], 0.15);
        assert_eq!(still.p95_m, 0.0);
    }
}
