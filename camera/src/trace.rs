use glam::{DQuat, DVec3};
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

    /// The trace's length in seconds.
    pub fn duration_s(&self) -> f64 {
        self.poses.last().map_or(0.0, |pose| pose.t_s)
    }

    /// The pose at `t_s`, interpolated between recorded ones and held at both ends.
    pub fn at(&self, t_s: f64) -> Rigid {
        let after = self.poses.partition_point(|pose| pose.t_s <= t_s);
        let (before, after) = (&self.poses[after.saturating_sub(1)], &self.poses[after.min(self.poses.len() - 1)]);
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
