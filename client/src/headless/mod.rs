//! The viewer without a window: follows a camera trace, one picture a pose, and writes down what happened.
//!
//! On the wall clock poses leave in real time (through `network::Proxy` where a link is asked for), and a picture that takes
//! longer than its slot delays the next, never drops it. On the virtual clock the run is in lock-step with the server: messages
//! carry the times at which the emulated link delivers them, rendering and coding take no time, and the same run gives the
//! same pictures on every machine.
//!
//! Before a first update has arrived there is nothing to draw: such frames are empty and their age is unknown. With
//! [`Options::warm_up`] (the default) frame 0 is held until an update has arrived that was made for the trace's first pose, or
//! until a second after the first update where none comes; the trace's time starts then.

mod lockstep;
mod output;
mod report;
mod stage;
mod wall;

use std::path::PathBuf;

use camera::{Pinhole, Rigid, Trace};
use glam::DVec3;
use gpu::{Gpu, GpuError};
use network::Link;
use protocol::message::{Clock, ViewSize, Welcome};
use thiserror::Error;

use crate::address::{self, AddressError};
use crate::picture::{PictureError, PictureOptions};
use crate::socket::Sockets;

pub use report::{FrameRow, Header, RowMs, Settings, Summary};
use stage::Stage;

/// How long a warm-up waits, after the first picture, for one that was made for the trace's first pose, in seconds.
const ANSWER_WITHIN_S: f64 = 1.0;
/// Seconds of the orbit that stands for a trace.
const ORBIT_S: f64 = 2.5;

/// Where the eye goes.
#[derive(Debug, Clone, PartialEq)]
pub enum Way {
    /// An orbit that frames the scene.
    Auto,
    /// As recorded.
    Trace(Trace),
}

/// What a run is told.
#[derive(Debug, Clone)]
pub struct Options {
    /// The server, as people type it.
    pub server: String,
    /// Where the eye goes.
    pub way: Way,
    /// Folder for the pictures and `stats.json`; `None` writes nothing.
    pub out: Option<PathBuf>,
    /// Width and height of the pictures.
    pub size_px: (u32, u32),
    /// Vertical field of view.
    pub fov_y_rad: f64,
    /// What the held copy may take of this machine's memory.
    pub budget_bytes: u64,
    /// Which clock to ask the server for.
    pub clock: Clock,
    /// Pictures a second of the trace's time.
    pub fps: f64,
    /// How many pictures; `None` for the whole trace. Past its end the trace's last pose holds.
    pub frames: Option<usize>,
    /// The emulated network.
    pub link: Option<Link>,
    /// Seed of the link's jitter on the virtual clock.
    pub seed: u64,
    /// Holds frame 0 until the first update has arrived.
    pub warm_up: bool,
    /// Which frames are drawn; the others pass by as undrawn, which on the virtual clock changes none that is drawn.
    pub drawn: fn(usize) -> bool,
    /// How pictures are drawn.
    pub picture: PictureOptions,
    /// How long the server may take to answer, in seconds of real time.
    pub patience_s: f64,
}

impl Options {
    /// 640x360 at 60 degrees and 60 pictures a second on the wall clock, without an emulated network.
    pub fn new(server: impl Into<String>, way: Way) -> Options {
        Options {
            server: server.into(),
            way,
            out: None,
            size_px: (640, 360),
            fov_y_rad: 60_f64.to_radians(),
            budget_bytes: protocol::session::DEFAULT_BUDGET_BYTES,
            clock: Clock::Wall,
            fps: 60.0,
            frames: None,
            link: None,
            seed: 1,
            warm_up: true,
            drawn: |_| true,
            picture: PictureOptions::default(),
            patience_s: 60.0,
        }
    }

    fn view(&self) -> ViewSize {
        ViewSize { width_px: self.size_px.0, height_px: self.size_px.1, fov_y_rad: self.fov_y_rad }
    }
}

/// Why a run failed.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum HeadlessError {
    /// The address.
    #[error(transparent)]
    Address(#[from] AddressError),
    /// No GPU, or it went away.
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// Drawing.
    #[error(transparent)]
    Picture(#[from] PictureError),
    /// The server did not answer, hung up, or broke the protocol.
    #[error("{0}")]
    Server(String),
    /// The emulated network could not be set up.
    #[error("cannot start the emulated network: {0}")]
    Network(std::io::Error),
    /// The network thread could not be started.
    #[error("cannot start the network thread: {0}")]
    Thread(std::io::Error),
    /// A file could not be written.
    #[error("cannot write {path}: {why}")]
    Write {
        /// Which.
        path: PathBuf,
        /// The system's or the encoder's reason.
        why: String,
    },
}

/// Runs on the machine's adapter.
pub fn run(options: &Options) -> Result<Summary, HeadlessError> {
    let gpu = Gpu::block_on(Gpu::new_headless())?;
    run_on(&gpu, options, &mut |_| {})
}

/// A picture that a run has drawn.
#[derive(Debug)]
pub struct Drawn<'a> {
    /// What is known of it.
    pub row: &'a FrameRow,
    /// How many there will be.
    pub of: usize,
    /// RGBA, rows top to bottom, sRGB-encoded; alpha is 255 where there is a sample and 0 elsewhere, filled or not.
    pub rgba: &'a [u8],
}

/// Runs on a given device and shows every picture to `on_frame`.
pub fn run_on(gpu: &Gpu, options: &Options, on_frame: &mut dyn FnMut(&Drawn<'_>)) -> Result<Summary, HeadlessError> {
    let url = address::websocket_url(&options.server)?;
    let sockets = Sockets::new().map_err(HeadlessError::Thread)?;
    // The virtual clock emulates the network by stamps instead.
    let link = options.link.filter(|_| options.clock == Clock::Wall);
    let proxy = link.map(|link| sockets.start_proxy(&url, link)).transpose().map_err(HeadlessError::Network)?;
    let url = proxy
        .as_ref()
        .map_or_else(|| url.clone(), |proxy| address::with_authority(&url, &proxy.local_addr().to_string()));
    let mut stage = Stage::new(gpu, options)?;
    let rows = match options.clock {
        Clock::Wall => wall::run(options, &sockets, &url, &mut stage, on_frame),
        Clock::Virtual => lockstep::run(options, &sockets, &url, &mut stage, on_frame),
    }?;
    stage.finish(rows)
}

/// The poses of a run, known once the scene is.
struct Poses {
    trace: Trace,
    fps: f64,
    count: usize,
}

impl Poses {
    fn new(options: &Options, welcome: &Welcome) -> Poses {
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
        // A frame that the rounding of milliseconds puts just past the end still counts.
        let whole = (trace.duration_s() * options.fps + 0.01).floor() as usize + 1;
        Poses { trace, fps: options.fps, count: options.frames.unwrap_or(whole) }
    }

    fn t_s(&self, frame: usize) -> f64 {
        frame as f64 / self.fps
    }

    fn at(&self, frame: usize) -> Rigid {
        self.trace.at(self.t_s(frame))
    }
}

/// The view of a pose.
fn view(options: &Options, world_from_eye: Rigid, welcome: &Welcome) -> Pinhole {
    Pinhole::symmetric(world_from_eye, options.size_px, options.fov_y_rad, welcome.near_m)
}
