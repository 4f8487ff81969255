use glam::{DQuat, DVec3, EulerRot};
use thiserror::Error;

use crate::Rigid;

/// A pose of a camera trace.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TracePose {
    /// Seconds from the trace's start.
    pub t_s: f64,
    /// The eye then.
    pub world_from_eye: Rigid,
}

/// A recorded walk: poses in order of time, at least one.
#[derive(Debug, Clone, PartialEq)]
pub struct Trace {
    /// Never empty; times never decrease.
    pub poses: Vec<TracePose>,
}

/// Why a trace file was refused.
#[derive(Debug, Error, PartialEq)]
pub enum TraceError {
    /// A line does not hold seven finite numbers, or its time runs backwards.
    #[error("trace line {line}: {why}")]
    Line {
        /// Counted from 1.
        line: usize,
        /// What is wrong with it.
        why: &'static str,
    },
    /// The file holds no pose.
    #[error("the trace holds no pose")]
    Empty,
}

impl Trace {
    /// Reads lines `px py pz rx ry rz t_ms`: metres, degrees, milliseconds. The camera of such a trace looks along -z with y
    /// up, turned by `Ry(ry) Rx(rx) Rz(rz)`. Empty lines and lines that start with `#` are skipped.
    pub fn parse(text: &str) -> Result<Trace, TraceError> {
        let mut poses: Vec<TracePose> = Vec::new();
        for (index, line) in text.lines().enumerate() {
            let line_number = index + 1;
            if line.trim().is_empty() || line.trim_start().starts_with('#') {
                continue;
            }
            let pose =
                parse_line(line).ok_or(TraceError::Line { line: line_number, why: "not seven finite numbers" })?;
            if poses.last().is_some_and(|last| pose.t_s < last.t_s) {
                return Err(TraceError::Line { line: line_number, why: "its time runs backwards" });
            }
            poses.push(pose);
        }
        if poses.is_empty() { Err(TraceError::Empty) } else { Ok(Trace { poses }) }
    }

    /// The same lines, to the digits that bring back a place to a micrometre, an angle to a millionth of a degree, and a time to a microsecond.
    pub fn to_text(&self) -> String {
        let line = |TracePose { t_s, world_from_eye }: &TracePose| {
            let (ry, rx, rz) = world_from_eye.gl_rotation().to_euler(EulerRot::YXZ);
            let DVec3 { x, y, z } = world_from_eye.translation;
            let [rx, ry, rz] = [rx, ry, rz].map(f64::to_degrees);
            format!("{x:.6} {y:.6} {z:.6} {rx:.6} {ry:.6} {rz:.6} {:.3}\n", t_s * 1000.0)
        };
        self.poses.iter().map(line).collect()
    }

    /// One turn around bounds within `duration_s`, sampled 60 times a second: the eye looks at their middle from 20 degrees
    /// above, as far away as it takes for the bounding sphere to fit into `fov_rad`, the narrower field of view.
    pub fn orbit(bounds_min_world: DVec3, bounds_max_world: DVec3, fov_rad: f64, duration_s: f64) -> Trace {
        const POSES_PER_S: f64 = 60.0;
        const ELEVATION_RAD: f64 = 20.0 / 180.0 * std::f64::consts::PI;
        let middle = (bounds_min_world + bounds_max_world) / 2.0;
        let radius_m = (bounds_max_world - bounds_min_world).length() / 2.0;
        // Bounds that are a point are looked at from the least distance that is not 0. Nothing divides by it, and sums round it away.
        let distance_m = radius_m.max(f64::MIN_POSITIVE) / (fov_rad / 2.0).sin();
        let steps = (duration_s * POSES_PER_S).round().max(1.0);
        let pose = |step: f64| {
            let angle_rad = std::f64::consts::TAU * step / steps;
            let out = DVec3::new(
                angle_rad.sin() * ELEVATION_RAD.cos(),
                ELEVATION_RAD.sin(),
                angle_rad.cos() * ELEVATION_RAD.cos(),
            );
            TracePose { t_s: step / POSES_PER_S, world_from_eye: Rigid::look_along(middle + out * distance_m, -out) }
        };
        Trace { poses: (0..=steps as usize).map(|step| pose(step as f64)).collect() }
    }

    /// The trace's length in seconds.
    pub fn duration_s(&self) -> f64 {
        self.poses.last().map_or(0.0, |pose| pose.t_s)
    }

    /// The pose at `t_s`, interpolated between recorded ones and held at both ends.
    pub fn at(&self, t_s: f64) -> Rigid {
        let after = self.poses.partition_point(|pose| pose.t_s <= t_s);
        let (before, after) = (&self.poses[after.saturating_sub(1)], &self.poses[after.min(self.poses.len() - 1)]);
        if before.world_from_eye == after.world_from_eye {
            // Who stands still does so to the last bit: rounding would be another place at every look.
            return before.world_from_eye;
        }
        let span_s = after.t_s - before.t_s;
        let share = if span_s > 0.0 { ((t_s - before.t_s) / span_s).clamp(0.0, 1.0) } else { 0.0 };
        Rigid {
            rotation: before.world_from_eye.rotation.slerp(after.world_from_eye.rotation, share),
            translation: before.world_from_eye.translation.lerp(after.world_from_eye.translation, share),
        }
    }
}

fn parse_line(line: &str) -> Option<TracePose> {
    let numbers: Vec<f64> = line.split_whitespace().map(str::parse).collect::<Result<_, _>>().ok()?;
    let &[px, py, pz, rx, ry, rz, t_ms] = numbers.as_slice() else { return None };
    if !numbers.iter().all(|number| number.is_finite()) {
        return None;
    }
    let world_from_gl = DQuat::from_rotation_y(ry.to_radians())
        * DQuat::from_rotation_x(rx.to_radians())
        * DQuat::from_rotation_z(rz.to_radians());
    Some(TracePose { t_s: t_ms / 1000.0, world_from_eye: Rigid::from_gl(DVec3::new(px, py, pz), world_from_gl) })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_is_read_again() {
        let orbit = Trace::orbit(DVec3::splat(-1.0), DVec3::new(1.0, 3.0, 2.0), 1.0, 0.5);
        let steep = [DVec3::Y, DVec3::NEG_Y, DVec3::new(1e-3, 1.0, 0.0)].map(|forward| TracePose {
            t_s: 0.5,
            world_from_eye: Rigid::look_along(DVec3::new(1e5, -2.0, 0.25), forward),
        });
        let trace = Trace { poses: orbit.poses.into_iter().chain(steep).collect() };
        let again = Trace::parse(&trace.to_text()).expect("a trace");
        assert_eq!(again.poses.len(), trace.poses.len());
        for (a, b) in trace.poses.iter().zip(&again.poses) {
            assert!((a.t_s - b.t_s).abs() < 1e-6);
            assert!(a.world_from_eye.translation.distance(b.world_from_eye.translation) < 1e-6);
            let turned = crate::turn_between(a.world_from_eye.rotation, b.world_from_eye.rotation).length();
            assert!(turned < 1e-7, "{turned}");
        }
    }

    #[test]
    fn an_orbit_frames_the_bounds() {
        let (min, max) = (DVec3::new(1.0, 0.0, -3.0), DVec3::new(3.0, 2.0, 1.0));
        let trace = Trace::orbit(min, max, 60_f64.to_radians(), 2.0);
        assert_eq!((trace.poses.len(), trace.duration_s()), (121, 2.0));
        for pose in &trace.poses {
            let view = crate::Pinhole::symmetric(pose.world_from_eye, (100, 100), 60_f64.to_radians(), 0.01);
            for corner in 0..8 {
                let pick = |axis: usize| if corner >> axis & 1 == 0 { min[axis] } else { max[axis] };
                let point = view.image_from_world(DVec3::new(pick(0), pick(1), pick(2))).expect("in front");
                assert!(view.contains(point), "{point:?}");
            }
        }
    }
}
