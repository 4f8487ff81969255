//! A run in real time.

use std::sync::Arc;

use protocol::Limits;
use protocol::message::Clock;

use super::error::HeadlessError;
use super::options::Options;
use super::poses::{ANSWER_WITHIN_S, Poses, view};
use super::stage::{Drawn, Moment, Ran, Stage};
use crate::receive::address;
use crate::receive::pump::Pump;
use crate::receive::socket::Sockets;
use crate::receive::viewer::{Decoder, Viewer};

/// While waiting for a picture, seconds between two looks.
const LOOK_INTERVAL_S: f64 = 0.01;

pub(super) fn run(
    options: &Options,
    sockets: &Sockets,
    url: &str,
    stage: &mut Stage,
    on_frame: &mut dyn FnMut(&Drawn<'_>),
) -> Result<Ran, HeadlessError> {
    let decoder = Decoder::on_thread(Limits::default(), Arc::new(|| {})).map_err(HeadlessError::Thread)?;
    let mut viewer = Viewer::new(address::shown(&options.server), Clock::Wall, options.view(), decoder, 0.0)
        .with_budget(options.budget_bytes)
        .with_draws(options.told.unwrap_or_else(|| options.picture.draws()))
        .with_role(options.role.clone());
    viewer.set_build(stage.build());
    let mut pump = Pump::new(sockets, url, Arc::new(|| {}));
    wait(options, &mut pump, &mut viewer, stage, Viewer::is_open)?;
    let welcome = viewer.welcome().expect("an open session was welcomed").clone();
    let poses = Poses::new(options, &welcome);
    let mut first_picture_ms = None;
    if options.warm_up {
        viewer.set_pose(poses.at(0), pump.now_s());
        wait(options, &mut pump, &mut viewer, stage, Viewer::has_picture)?;
        first_picture_ms = Some(pump.now_s() * 1e3);
        let last_s = pump.now_s() + ANSWER_WITHIN_S;
        while !viewer.has_answer() && pump.now_s() < last_s {
            pump.turn_until(&mut viewer, pump.now_s() + LOOK_INTERVAL_S);
            let now_s = pump.now_s();
            stage.take_in(&mut viewer, now_s);
        }
    }
    let begin_s = pump.now_s();
    let mut frames = Vec::with_capacity(poses.count);
    for frame in 0..poses.count {
        pump.turn_until(&mut viewer, begin_s + poses.t_s(frame));
        let frame_begin_s = pump.now_s();
        let world_from_eye = poses.at(frame);
        viewer.set_pose(world_from_eye, frame_begin_s);
        pump.turn(&mut viewer);
        stage.take_in(&mut viewer, frame_begin_s);
        pump.turn(&mut viewer);
        if !(options.drawn)(frame) {
            viewer.drawn(frame_begin_s, None, None);
            continue;
        }
        let drawn = stage.draw(&viewer, &view(options, world_from_eye, &welcome), frame_begin_s)?;
        let now_s = pump.now_s();
        let (frame_ms, update_bytes) = ((now_s - frame_begin_s) * 1e3, pump.traffic().update_bytes());
        let moment = Moment { frame, t_s: poses.t_s(frame), now_s, frame_ms, update_bytes };
        frames.push(stage.record(&mut viewer, &moment, poses.count, world_from_eye, drawn, on_frame)?);
    }
    Ok(Ran { frames, first_picture_ms, server_ms: Vec::new(), traffic: pump.traffic().clone() })
}

/// Turns until `done`, or fails with what the viewer says is wrong. Reconnects meanwhile, as a person's viewer would.
fn wait(
    options: &Options,
    pump: &mut Pump<'_>,
    viewer: &mut Viewer,
    stage: &mut Stage,
    done: fn(&Viewer) -> bool,
) -> Result<(), HeadlessError> {
    let give_up_s = pump.now_s() + options.patience_s;
    loop {
        pump.turn(viewer);
        stage.take_in(viewer, pump.now_s());
        if done(viewer) {
            return Ok(());
        }
        if let Some(refusal) = viewer.refusal() {
            return Err(HeadlessError::Server(format!("the server refused: {refusal}")));
        }
        if pump.now_s() > give_up_s {
            let status = viewer.status(pump.now_s()).unwrap_or_else(|| "no picture came".to_owned());
            return Err(HeadlessError::Server(format!("gave up after {} s: {status}", options.patience_s)));
        }
        pump.turn_until(viewer, pump.now_s() + LOOK_INTERVAL_S);
    }
}
