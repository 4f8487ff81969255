//! One run of the real system: a server on a loopback port, a proxy that counts what crosses, and the headless viewer.

use std::sync::Arc;
use std::time::Instant;

use client::draw::antialiasing::Antialias;
use client::draw::frame;
use client::draw::picture::PictureOptions;
use client::show::headless::{self, FrameRow, Summary, Way};
use gpu::Gpu;
use network::{Link, Proxy};
use protocol::codec::Profile;
use protocol::message::{Clock, Draws};
use server::Config;
use server::coding::CodingRule;
use server::imager::GpuImager;
use tokio::runtime::Runtime;

use super::setup::{CLIENT_HZ, Replay, SERVER_HZ};
use crate::compare::Picture;

/// Which pictures are drawn and scored.
pub type Drawn = fn(usize) -> bool;

/// Two neighbours of every ten pictures: few enough to be quick, and flicker is still known.
pub fn two_of_ten(frame: usize) -> bool {
    frame % 10 < 2
}

/// How the server samples and what lies between it and the viewer.
#[derive(Debug, Clone, Copy)]
pub struct Operation {
    /// Images a set.
    pub images: usize,
    /// An image has as many pixels as a square of this side.
    pub image_px: u32,
    /// The network.
    pub link: Link,
    /// Which clock to run on.
    pub clock: Clock,
    /// Which pictures are drawn.
    pub drawn: Drawn,
    /// Which of them are given back, to be scored.
    pub scored: Drawn,
    /// Whether what a viewer will need next is sent while nobody needs anything.
    pub anticipates: bool,
    /// Whether what is less as its triangles than as samples is sent so.
    pub bodies: bool,
    /// Whether many objects of one shape are shown by one image.
    pub relief: bool,
    /// What the server is told that the client draws, where that is not what it draws.
    pub told: Option<Draws>,
    /// Whether pictures are to be antialiased.
    pub antialias: bool,
}

/// How a viewer draws.
fn picture_options(antialias: bool) -> PictureOptions {
    let antialias = if antialias { Antialias::On } else { Antialias::Off };
    PictureOptions { frame: frame::Options { antialias, ..frame::Options::default() }, ..PictureOptions::default() }
}

/// A picture that the viewer showed, given back.
pub struct Shown {
    /// What the viewer says of it.
    pub row: FrameRow,
    /// Its covered pixels are those with a sample, filled or not.
    pub picture: Picture,
}

/// What a run gave.
pub struct Lived {
    /// The pictures that were drawn.
    pub shown: Vec<Shown>,
    /// The viewer's statistics.
    pub summary: Summary,
    /// All bytes that crossed the socket from the opening of its connection on, with those of HTTP and websocket frames: from
    /// the client, and to it.
    pub socket_bytes: (u64, u64),
    /// Real milliseconds until the server listened, its scene loaded before.
    pub start_ms: f64,
    /// Memory of this process that the server and the client took, in bytes, once all was shown.
    pub memory_bytes: u64,
}

fn resident_bytes() -> u64 {
    server::stats::resident_bytes().unwrap_or_default()
}

/// Runs the whole of a replay. The server begins at the trace's first pose, and the trace at the first set's arrival: all of
/// its bytes count.
pub fn run(gpu: &Gpu, replay: &Replay, operation: &Operation) -> anyhow::Result<Lived> {
    // A device of its own, as a server has.
    let server_gpu = pollster::block_on(Gpu::new_headless())?;
    let config = Config {
        port: 0,
        clock: operation.clock,
        look: replay.look,
        images: operation.images,
        image_size_px: operation.image_px,
        update_hz: SERVER_HZ,
        anticipation: operation.anticipates,
        bodies: operation.bodies,
        relief: operation.relief,
        // Coding takes no time on the virtual clock: there error is judged against bytes.
        coding: CodingRule {
            profile: (operation.clock == Clock::Virtual).then_some(Profile::Dense),
            ..CodingRule::default()
        },
        ..Config::default()
    };
    let mut scene = replay.scene.clone();
    let (started, before_bytes) = (Instant::now(), resident_bytes());
    scene.start = crate::topic::start_of(&replay.trace);
    let imager = Box::new(GpuImager::new(&server_gpu, &scene, &config)?);
    let runtime = Runtime::new()?;
    let server = runtime.block_on(server::serve(config, Arc::new(scene), imager))?;
    let start_ms = started.elapsed().as_secs_f64() * 1000.0;
    let counter = runtime.block_on(Proxy::start(([127, 0, 0, 1], 0).into(), server.addr, Link::default()))?;

    let mut options =
        headless::Options::new(format!("ws://{}", counter.local_addr()), Way::Trace(replay.trace.clone()));
    options.clock = operation.clock;
    options.size_px = replay.size_px;
    options.fov_y_rad = replay.fov_y_rad;
    options.fps = CLIENT_HZ;
    options.link = Some(operation.link);
    options.drawn = operation.drawn;
    options.picture = picture_options(operation.antialias);
    options.told = operation.told;
    let (width_px, height_px) = replay.size_px;
    let mut shown = Vec::new();
    let summary = headless::run_on(gpu, &options, &mut |drawn| {
        if (operation.scored)(drawn.row.frame) {
            shown.push(Shown { row: drawn.row.clone(), picture: Picture::from_rgba(width_px, height_px, drawn.rgba) });
        }
    });
    let memory_bytes = resident_bytes().saturating_sub(before_bytes);
    let socket_bytes = counter.forwarded_bytes();
    runtime.block_on(async {
        counter.shutdown().await;
        server.stop().await;
    });
    Ok(Lived { shown, summary: summary?, socket_bytes, start_ms, memory_bytes })
}
