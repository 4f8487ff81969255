//! What a run is told.

use std::path::PathBuf;

use camera::Trace;
use network::Link;
use protocol::message::{Clock, Draws, Role, ViewSize};

use crate::draw::picture::PictureOptions;

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
    /// PEM file of certificates to trust beside those that are trusted anyway, for servers over TLS.
    pub tls_ca: Option<PathBuf>,
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
    /// What the viewer is there for.
    pub role: Role,
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
    /// What the server is told that they are drawn with, for who measures what that costs; `None`: what they are.
    pub told: Option<Draws>,
    /// How long the server may take to answer, in seconds of real time.
    pub patience_s: f64,
}

impl Options {
    /// 640x360 at 60 degrees and 60 pictures a second on the wall clock, without an emulated network.
    pub fn new(server: impl Into<String>, way: Way) -> Options {
        Options {
            server: server.into(),
            tls_ca: None,
            way,
            out: None,
            size_px: (640, 360),
            fov_y_rad: 60_f64.to_radians(),
            budget_bytes: protocol::session::DEFAULT_BUDGET_BYTES,
            role: Role::Viewer,
            clock: Clock::Wall,
            fps: 60.0,
            frames: None,
            link: None,
            seed: 1,
            warm_up: true,
            drawn: |_| true,
            picture: PictureOptions::default(),
            told: None,
            patience_s: 60.0,
        }
    }

    pub(super) fn view(&self) -> ViewSize {
        ViewSize { width_px: self.size_px.0, height_px: self.size_px.1, fov_y_rad: self.fov_y_rad }
    }
}
