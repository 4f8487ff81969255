//! A path that the eye goes: written down while a person moves, or gone again.

use camera::{Rigid, Trace, TracePose};

/// Poses a second at most: more than any screen shows between two of which an eye goes straight.
const MOST_HZ: f64 = 120.0;
/// An hour.
const MOST_POSES: usize = 3600 * MOST_HZ as usize;

/// One that is written down.
#[derive(Debug)]
pub struct Recording {
    begun_s: f64,
    poses: Vec<TracePose>,
}

impl Recording {
    /// Begins now.
    pub fn begin(now_s: f64) -> Recording {
        Recording { begun_s: now_s, poses: Vec::new() }
    }

    /// The eye is here. Of a stand only the beginning and the end are kept.
    pub fn see(&mut self, world_from_eye: Rigid, now_s: f64) {
        let t_s = now_s - self.begun_s;
        let pose = TracePose { t_s, world_from_eye };
        let is_full = self.poses.len() >= MOST_POSES;
        match self.poses.as_mut_slice() {
            [.., before, last] if [*before, *last].iter().all(|pose| pose.world_from_eye == world_from_eye) => {
                *last = pose;
            }
            [.., last] if t_s - last.t_s < 1.0 / MOST_HZ => {}
            _ if is_full => {}
            _ => self.poses.push(pose),
        }
    }

    /// As reports and the native viewer follow it; `None` where no eye was seen.
    pub fn end(self) -> Option<Trace> {
        if self.poses.is_empty() { None } else { Some(Trace { poses: self.poses }) }
    }
}

/// One that is gone again.
#[derive(Debug)]
pub struct Replay {
    begun_s: f64,
    trace: Trace,
}

impl Replay {
    /// Begins now.
    pub fn begin(trace: Trace, now_s: f64) -> Replay {
        Replay { begun_s: now_s, trace }
    }

    /// Where the eye is now, and whether that is the end.
    pub fn at(&self, now_s: f64) -> (Rigid, bool) {
        let t_s = now_s - self.begun_s;
        (self.trace.at(t_s), t_s >= self.trace.duration_s())
    }
}
