//! Where the eye is in a run.

use camera::{Pinhole, Rigid, Trace};
use glam::DVec3;
use protocol::message::Welcome;

use super::options::{Options, Way};

/// How long a warm-up waits, after the first picture, for one that was made for the trace's first pose, in seconds.
pub(super) const ANSWER_WITHIN_S: f64 = 1.0;
/// Seconds of the orbit that stands for a trace.
const ORBIT_S: f64 = 2.5;

/// The poses of a run, known once the scene is.
pub(super) struct Poses {
    trace: Trace,
    pub fps: f64,
    pub count: usize,
}

impl Poses {
    pub fn new(options: &Options, welcome: &Welcome) -> Poses {
        let aspect = f64::from(options.size_px.0) / f64::from(options.size_px.1);
        let fov_x_rad = 2.0 * ((options.fov_y_rad / 2.0).tan() * aspect).atan();
        let trace = match &options.way {
            Way::Trace(trace) => trace.clone(),
            Way::Auto => Trace::orbit(
                DVec3::from(welcome.bounds_min_world),
                DVec3::from(welcome.bounds_max_world),
                fov_x_rad.min(options.fov_y_rad),
                ORBIT_S,
            ),
        };
        // A frame that the rounding of milliseconds puts just past the end still counts. Times with one decimal are off by 0.05 ms, which at 60 frames a second is
        // 0.003 of a frame: this is three times that.
        let whole = (trace.duration_s() * options.fps + 0.01).floor() as usize + 1;
        Poses { trace, fps: options.fps, count: options.frames.unwrap_or(whole) }
    }

    pub fn t_s(&self, frame: usize) -> f64 {
        frame as f64 / self.fps
    }

    pub fn at(&self, frame: usize) -> Rigid {
        self.trace.at(self.t_s(frame))
    }
}

/// The view of a pose.
pub(super) fn view(options: &Options, world_from_eye: Rigid, welcome: &Welcome) -> Pinhole {
    Pinhole::symmetric(world_from_eye, options.size_px, options.fov_y_rad, welcome.near_m)
}
