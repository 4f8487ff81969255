//! One viewer of a server behind an emulated network, as the client's own library does it, without drawing.

use std::sync::Arc;
use std::time::Duration;

use anyhow::{Context, ensure};
use camera::Trace;
use client::receive::address;
use client::receive::pump::Pump;
use client::receive::socket::Sockets;
use client::receive::viewer::{Decoder, Viewer};
use network::Link;
use protocol::Limits;
use protocol::message::{Clock, ViewSize};

use crate::load::Path;

/// Between two looks at what is held: the frames of a screen.
const FRAME_S: f64 = 1.0 / 60.0;
/// The output.
const VIEW: ViewSize = ViewSize { width_px: 640, height_px: 360, fov_y_rad: std::f64::consts::FRAC_PI_3 };

/// What a viewer had at a time.
#[derive(Debug, Clone, Copy)]
pub(super) struct Moment {
    /// Seconds since the network began.
    pub at_s: f64,
    /// Of what is shown; `None` before the first picture.
    pub age_ms: Option<f64>,
    /// Whether a session is open.
    pub open: bool,
    /// The last update that is held.
    pub number: u64,
    /// Bytes of the session so far.
    pub bytes: u64,
}

/// A visit to a server.
#[derive(Debug)]
pub(super) struct Visit {
    /// At every frame.
    pub moments: Vec<Moment>,
    /// The longest that the network's part took of a frame, in milliseconds: so long a picture waited for it.
    pub longest_turn_ms: f64,
}

/// Where the eye goes: along a trace or a made path in some seconds of a visit, and it stands before and after.
pub(super) struct Way<'a> {
    pub trace: Option<&'a Trace>,
    pub walks_s: std::ops::Range<f64>,
}

/// Visits the server at `url` for some seconds, through a network where there is none already.
pub(super) fn visit(url: &str, link: Option<Link>, way: &Way<'_>, duration_s: f64) -> anyhow::Result<Visit> {
    let sockets = Sockets::new()?;
    let proxy = link.map(|link| sockets.start_proxy(url, link)).transpose()?;
    let authority = proxy.as_ref().map(|proxy| proxy.local_addr().to_string());
    let url = authority.map_or_else(|| url.to_owned(), |authority| address::with_authority(url, &authority));
    let decoder = Decoder::on_thread(Limits::default(), Arc::new(|| {}))?;
    let mut viewer = Viewer::new(&url, Clock::Wall, VIEW, decoder, 0.0);
    let mut pump = Pump::new(&sockets, &url, Arc::new(|| {}));
    let (mut moments, mut longest_turn_ms, mut path) = (Vec::new(), 0.0_f64, None);
    while pump.now_s() < duration_s {
        let begin_s = pump.now_s();
        pump.turn(&mut viewer);
        if path.is_none()
            && let Some(welcome) = viewer.welcome()
        {
            path = Some(way.trace.map_or_else(|| Path::made(welcome, 0), |trace| Path::Trace(trace.clone(), 0.0)));
        }
        if let Some(path) = &path {
            let along_s = begin_s.clamp(way.walks_s.start, way.walks_s.end) - way.walks_s.start;
            viewer.set_pose(path.at(along_s), begin_s);
        }
        viewer.advance(&mut (), begin_s, FRAME_S / 4.0);
        viewer.drawn(begin_s, None, None);
        pump.turn(&mut viewer);
        moments.push(Moment {
            at_s: begin_s,
            age_ms: viewer.age_ms(begin_s),
            open: viewer.is_open(),
            number: viewer.held().number,
            bytes: viewer.bytes_received(),
        });
        let took_s = pump.now_s() - begin_s;
        longest_turn_ms = longest_turn_ms.max(took_s * 1e3);
        std::thread::sleep(Duration::from_secs_f64((FRAME_S - took_s).max(0.0)));
    }
    let last = moments.last().context("no time for a visit")?;
    ensure!(last.number > 0, "nothing came within {duration_s} s: {:?}", viewer.status(duration_s));
    Ok(Visit { moments, longest_turn_ms })
}

impl Visit {
    /// Ages from a time on, in milliseconds.
    pub fn ages_ms(&self, from_s: f64) -> Vec<f64> {
        self.moments.iter().filter(|moment| moment.at_s >= from_s).filter_map(|moment| moment.age_ms).collect()
    }

    /// When updates were held from a time on.
    pub fn updates_s(&self, from_s: f64) -> Vec<f64> {
        let pairs = self.moments.windows(2).filter(|pair| pair[1].number != pair[0].number);
        pairs.map(|pair| pair[1].at_s).filter(|at_s| *at_s >= from_s).collect()
    }

    /// Bytes of the session at a time.
    pub fn bytes_at(&self, at_s: f64) -> u64 {
        self.moments.iter().rev().find(|moment| moment.at_s <= at_s).map_or(0, |moment| moment.bytes)
    }

    /// Since when a session is open that is open at the end; `None` where none is.
    pub fn open_since_s(&self) -> Option<f64> {
        let from = self.moments.iter().rposition(|moment| !moment.open).map_or(0, |last| last + 1);
        self.moments.get(from).map(|moment| moment.at_s)
    }
}
