//! Where the eye is, frame by frame: from a trace, from a viewer's `stats.json`, or an orbit of our own.

use std::f64::consts::TAU;
use std::path::Path;

use anyhow::{Context, bail};
use camera::{Rigid, Trace, TracePose};
use glam::{DQuat, DVec3};
use scene::Scene;
use serde::{Deserialize, Serialize};

/// One frame: the fields that the viewer's `stats.json` and the truth's `truth.json` share.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct PoseRow {
    /// Counts from 0; the number in the picture's name.
    pub frame: u32,
    /// Seconds since the start.
    pub t_s: f64,
    /// Scene time shown.
    pub scene_time_s: f64,
    /// The eye.
    pub world_from_eye: Rigid,
    /// Share of all pixels that the viewer had no sample for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub uncovered_share: Option<f64>,
}

/// What a file of poses says: rows, and the view where it says so.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(untagged)]
enum StatsFile {
    Rows(Vec<PoseRow>),
    Object { frames: Vec<PoseRow> },
}

/// Reads a list of frames: a JSON array, or an object that holds one as `frames`.
pub fn read_stats(path: &Path) -> anyhow::Result<Vec<PoseRow>> {
    let text = std::fs::read_to_string(path).with_context(|| path.display().to_string())?;
    let file: StatsFile = serde_json::from_str(&text).with_context(|| {
        format!("{}: no list of frames with frame, t_s, scene_time_s, world_from_eye", path.display())
    })?;
    let rows = match file {
        StatsFile::Rows(rows) | StatsFile::Object { frames: rows } => rows,
    };
    if let Some(row) = rows.iter().find(|row| !row.world_from_eye.is_valid() || !row.scene_time_s.is_finite()) {
        bail!("{}: frame {} has no valid pose or time", path.display(), row.frame);
    }
    Ok(rows)
}

/// Every pose of a trace, at its own time; the scene's time is the trace's.
pub fn from_trace(trace: &Trace) -> Vec<PoseRow> {
    let row = |(index, pose): (usize, &TracePose)| PoseRow {
        frame: index as u32,
        t_s: pose.t_s,
        scene_time_s: pose.t_s,
        world_from_eye: pose.world_from_eye,
        uncovered_share: None,
    };
    trace.poses.iter().enumerate().map(row).collect()
}

/// Seconds of [`orbit`]: as long as the traces of other systems that we compare with.
const ORBIT_S: f64 = 2.5;

/// A full turn around the scene, at the distance at which it just fits into a view of `size_px` with the vertical field of
/// view `fov_y_rad`.
pub fn orbit(scene: &Scene, size_px: (u32, u32), fov_y_rad: f64) -> Vec<PoseRow> {
    let aspect = f64::from(size_px.0) / f64::from(size_px.1);
    let fov_x_rad = 2.0 * ((fov_y_rad / 2.0).tan() * aspect).atan();
    from_trace(&Trace::orbit(scene.bounds.min, scene.bounds.max, fov_x_rad.min(fov_y_rad), ORBIT_S))
}

/// A person for 2.5 s, sampled 60 times a second, from where the scene begins. In a scene to walk in: sways sideways by
/// 0.4 m at up to 1.2 m/s, and turns the head by up to 20 degrees at up to 60 degrees a second. Otherwise: goes round the
/// middle of the scene at 30 degrees a second.
pub fn stroll(scene: &Scene) -> Trace {
    const POSES_PER_S: f64 = 60.0;
    const SWAY_M: f64 = 0.4;
    const SWAYS_PER_S: f64 = 1.2 / (TAU * SWAY_M);
    const TURN_RAD: f64 = 20.0 / 360.0 * TAU;
    const ROUND_RAD_S: f64 = 30.0 / 360.0 * TAU;
    let start = server::start::start_pose(scene);
    let centre = scene.bounds.centre();
    let pose = |t_s: f64| {
        if scene.walk {
            let swing = (TAU * SWAYS_PER_S * t_s).sin();
            let rotation = DQuat::from_rotation_y(-TURN_RAD * swing) * start.rotation;
            Rigid { translation: start.transform_point(DVec3::X * (SWAY_M * swing)), rotation }
        } else {
            let round = DQuat::from_rotation_y(ROUND_RAD_S * t_s);
            let translation = centre + round * (start.translation - centre);
            Rigid { translation, rotation: round * start.rotation }
        }
    };
    let times = (0..=(ORBIT_S * POSES_PER_S) as usize).map(|index| index as f64 / POSES_PER_S);
    Trace { poses: times.map(|t_s| TracePose { t_s, world_from_eye: pose(t_s) }).collect() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stats_are_read_as_a_list_or_inside_of_an_object() {
        let folder = crate::report::scratch_folder("poses");
        let path = folder.join("stats.json");
        let rows = vec![PoseRow {
            frame: 7,
            t_s: 0.5,
            scene_time_s: 1.5,
            world_from_eye: Rigid::look_along(DVec3::new(1.0, 2.0, 3.0), DVec3::X),
            uncovered_share: Some(0.125),
        }];
        let list = serde_json::to_string(&rows).unwrap();
        for text in [list.clone(), format!("{{\"settings\": {{}}, \"frames\": {list}}}")] {
            std::fs::write(&path, text).unwrap();
            assert_eq!(read_stats(&path).unwrap(), rows);
        }
        std::fs::write(&path, list.replace("1.5", "null")).unwrap();
        assert!(read_stats(&path).is_err());
        std::fs::remove_dir_all(folder).unwrap();
    }

    #[test]
    fn a_trace_gives_a_row_a_line() {
        let trace = Trace::parse("0 1 0 0 0 0 0\n1 1 0 0 90 0 500\n").unwrap();
        let rows = from_trace(&trace);
        assert_eq!((rows.len(), rows[1].frame, rows[1].t_s), (2, 1, 0.5));
        assert_eq!(rows[1].world_from_eye.translation, DVec3::new(1.0, 1.0, 0.0));
    }
}
