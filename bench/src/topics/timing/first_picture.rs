//! From the websocket's opening to the first good picture: a real server and the client's own library on this machine.

use std::sync::Arc;
use std::time::{Duration, Instant};

use anyhow::{Context, bail};
use camera::Pinhole;
use client::draw::frame::Options;
use client::receive::socket::Sockets;
use client::receive::viewer::{Decoder, SocketCommand, SocketEvent, Viewer};
use gpu::Gpu;
use protocol::message::{Clock, ViewSize};
use protocol::{Limits, Look};
use scene::Scene;
use server::imager::GpuImager;
use server::start::{near_m, start_pose};
use surface::HeldSurfaces;

use super::timed::spread;
use crate::client_view::{ClientView, HeldSet};
use crate::compare::{Picture, score};
use crate::report::Row;
use crate::stage::{Stage, picture};

/// The row's method.
pub(super) const METHOD: &str = "first picture over a websocket";
/// What a picture must keep to count.
const MOST_HOLES: f64 = 0.02;
const MOST_FLIP: f64 = 0.15;
/// After this the run counts as failed.
const PATIENCE: Duration = Duration::from_secs(60);
const FOV_Y_RAD: f64 = std::f64::consts::TAU / 6.0;

/// One connection.
struct First {
    any_ms: f64,
    good_ms: f64,
    bytes: u64,
    holes: f64,
    flip: f64,
}

/// A row with the times of `repeats` connections to one server.
pub(super) fn measure(gpu: &Gpu, scene: Scene, size_px: (u32, u32), repeats: usize) -> anyhow::Result<Row> {
    let camera = Pinhole::symmetric(start_pose(&scene), size_px, FOV_Y_RAD, near_m(&scene));
    let label = scene.name.clone();
    let mut stage = Stage::new(gpu, scene.clone(), Look::Plain)?;
    stage.show(0.0, camera.world_from_eye.translation)?;
    let truth = picture(&stage.truth(&camera)?);

    let runtime = tokio::runtime::Runtime::new()?;
    // A device of its own, as a server has.
    let server_gpu = pollster::block_on(Gpu::new_headless())?;
    let config = server::Config { port: 0, ..server::Config::default() };
    let imager = GpuImager::new(&server_gpu, &scene, &config)?;
    let running = runtime.block_on(server::serve(config, Arc::new(scene), Box::new(imager)))?;
    let url = format!("ws://{}/ws", running.addr);
    let mut view = ClientView::new(gpu, size_px)?;
    let firsts = (0..repeats).map(|_| connect(gpu, &url, &camera, &truth, &mut view)).collect::<Result<Vec<_>, _>>();
    runtime.block_on(running.stop());

    let firsts = firsts?;
    let values = |f: fn(&First) -> f64| firsts.iter().map(f).collect::<Vec<_>>();
    let mut row = Row::new(&label, METHOD);
    row.time_ms.set("any_picture", spread(&values(|first| first.any_ms)));
    row.time_ms.set("good_picture", spread(&values(|first| first.good_ms)));
    row.error.set("holes_share", spread(&values(|first| first.holes)));
    row.error.set("flip_covered", spread(&values(|first| first.flip)));
    row.bytes.set("received", spread(&values(|first| first.bytes as f64)).median);
    Ok(row)
}

fn connect(gpu: &Gpu, url: &str, camera: &Pinhole, truth: &Picture, view: &mut ClientView) -> anyhow::Result<First> {
    let sockets = Sockets::new()?;
    let decoder = Decoder::on_thread(Limits::default(), Arc::new(|| {}))?;
    let output = ViewSize { width_px: camera.width_px, height_px: camera.height_px, fov_y_rad: camera.fov_y_rad() };
    let begin = Instant::now();
    let now_s = || begin.elapsed().as_secs_f64();
    let mut viewer = Viewer::new(url, Clock::Wall, output, decoder, 0.0);
    let mut surfaces = HeldSurfaces::new(gpu);
    let mut socket = None;
    let (mut opened_s, mut any_ms) = (None, None);
    while begin.elapsed() < PATIENCE {
        while let Some(command) = viewer.poll_socket(now_s()) {
            match (command, &socket) {
                (SocketCommand::Open, _) => {
                    socket = Some(sockets.open(url.to_owned(), MESSAGE_BYTES, Arc::new(|| {})));
                }
                (SocketCommand::Send(bytes), Some(socket)) => client::receive::socket::Socket::send(socket, bytes),
                (SocketCommand::Send(_), None) => {}
                (SocketCommand::Close, _) => bail!("the connection ended: {:?}", viewer.status(now_s())),
            }
        }
        // Short: a decoded update is looked for as often.
        let event = socket.as_mut().and_then(|socket| socket.event_within(Duration::from_millis(1)));
        if let Some(event) = event {
            if event == SocketEvent::Opened {
                opened_s = Some(now_s());
            }
            viewer.handle(event, now_s());
        }
        viewer.set_pose(camera.world_from_eye, now_s());
        if !viewer.advance(&mut surfaces, now_s(), 0.0) || !viewer.has_picture() {
            continue;
        }
        let opened_s = opened_s.context("a picture before the socket was open")?;
        let set = HeldSet::of(gpu, viewer.held().clone(), surfaces);
        view.draw(&set, camera, Options::default())?;
        let shown_ms = (now_s() - opened_s) * 1000.0;
        let any_ms = *any_ms.get_or_insert(shown_ms);
        let drawn = view.frame(&set, camera, Options::default())?;
        surfaces = set.surfaces;
        let scores = score(&drawn.picture, truth, None)?;
        let (holes, flip) = (scores.holes_share.unwrap_or(1.0), scores.flip_covered.unwrap_or(1.0));
        if holes <= MOST_HOLES && flip <= MOST_FLIP {
            return Ok(First { any_ms, good_ms: shown_ms, bytes: viewer.bytes_received(), holes, flip });
        }
    }
    bail!("no good picture within {} s", PATIENCE.as_secs())
}

/// The largest message of a server, and room for a frame's header.
const MESSAGE_BYTES: usize = 64 * 1024;
