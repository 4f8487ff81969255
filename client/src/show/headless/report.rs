//! What a run writes down: `stats.json`.

use camera::Rigid;
use serde::{Deserialize, Serialize};

use crate::receive::traffic::Traffic;

/// `stats.json`: what was run, and a row a frame.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Summary {
    /// What was run.
    #[serde(flatten)]
    pub header: Header,
    /// Those that were drawn, in order.
    pub frames: Vec<FrameRow>,
}

/// What was run, and on what.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Header {
    /// Name of the graphics adapter; milliseconds mean nothing without it.
    pub adapter: String,
    /// Whether that adapter is the CPU.
    pub software: bool,
    /// The scene's name.
    pub scene: String,
    /// Width of the pictures.
    pub width_px: u32,
    /// Height of the pictures.
    pub height_px: u32,
    /// Vertical field of view, in degrees.
    pub fov_y_deg: f64,
    /// Nearest distance drawn, in metres.
    pub near_m: f64,
    /// Seconds between two updates, as the server announced it.
    pub update_interval_s: f64,
    /// Updates applied during the run.
    pub updates: u64,
    /// On the run's clock, from the start until the first update was held, with a warm-up; `null` without.
    pub first_picture_ms: Option<f64>,
    /// Virtual clock: real milliseconds of each step in which the server sent an update, from asking for the step to having all
    /// of it. Empty on the wall clock.
    pub server_ms: Vec<f64>,
    /// All messages of the run, those of the warm-up included.
    pub traffic: Traffic,
    /// What the run was told.
    pub settings: Settings,
}

/// What the run was told.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Settings {
    /// `wall` or `virtual`.
    pub clock: String,
    /// Pictures a second of the trace's time.
    pub fps: f64,
    /// The emulated network as `--network` takes it, empty without.
    pub network: String,
    /// Whether frame 0 waited for the first update.
    pub warm_up: bool,
    /// Where corners come from.
    pub corners: String,
    /// Whether pixels without a sample were filled.
    pub fill: bool,
}

/// One picture.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FrameRow {
    /// Counts from 0; the number in the picture's name.
    pub frame: usize,
    /// The trace's time, in seconds.
    pub t_s: f64,
    /// Scene time shown, in seconds; the session's first scene time while nothing is shown.
    pub scene_time_s: f64,
    /// Scene time at the server now less scene time shown; `null` while nothing is shown.
    pub age_ms: Option<f64>,
    /// The last measured time from a pose's sending to the first picture that used what it brought.
    pub round_trip_ms: Option<f64>,
    /// The eye: x right, y down, z forward; quaternion `x, y, z, w` and metres.
    pub world_from_eye: Rigid,
    /// Share of all pixels that no sample covers, before filling.
    pub uncovered_share: f64,
    /// Bytes of messages that have arrived in this session so far.
    pub bytes_received: u64,
    /// Bytes of updates that the server has sent so far, those among them that are still on their way.
    pub update_bytes_sent: u64,
    /// Number of the last update shown, 0 before any.
    pub update: u64,
    /// Samples held.
    pub samples: u64,
    /// What it took.
    pub ms: RowMs,
}

/// Real milliseconds of a picture, on either clock.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct RowMs {
    /// Decoding the updates that this picture is the first to show.
    pub decode: f64,
    /// Building and drawing their surfaces.
    pub surface: f64,
    /// Filling and lighting.
    pub light: f64,
    /// From the pose to the finished picture.
    pub frame: f64,
}
