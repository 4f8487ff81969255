//! A run on the virtual clock, in lock-step with the server.

use std::sync::Arc;

use camera::Rigid;
use network::LinkModel;
use protocol::Limits;
use protocol::message::Clock;

use super::error::HeadlessError;
use super::options::Options;
use super::poses::{ANSWER_WITHIN_S, Poses, view};
use super::stage::{Drawn, Moment, Ran, Stage};
use crate::receive::address;
use crate::receive::pump::Pump;
use crate::receive::socket::Sockets;
use crate::receive::viewer::{Decoder, SocketEvent, Viewer};

/// A warm-up that takes longer than this brings nothing any more, in seconds of virtual time.
const LONGEST_WARM_UP_S: f64 = 60.0;

struct Lockstep<'a> {
    pump: Pump<'a>,
    viewer: Viewer,
    up: LinkModel,
    down: LinkModel,
    patience_s: f64,
    server_ms: Vec<f64>,
}

pub(super) fn run(
    options: &Options,
    sockets: &Sockets,
    url: &str,
    stage: &mut Stage,
    on_frame: &mut dyn FnMut(&Drawn<'_>),
) -> Result<Ran, HeadlessError> {
    let link = options.link.unwrap_or_default();
    let decoder = Decoder::inline(Limits::default());
    let mut run = Lockstep {
        pump: Pump::new(sockets, url, Arc::new(|| {})),
        viewer: Viewer::new(address::shown(&options.server), Clock::Virtual, options.view(), decoder, 0.0)
            .with_budget(options.budget_bytes)
            .with_draws(options.told.unwrap_or_else(|| options.picture.draws()))
            .with_role(options.role.clone()),
        up: LinkModel::new(link, options.seed),
        down: LinkModel::new(link, !options.seed),
        patience_s: options.patience_s,
        server_ms: Vec::new(),
    };
    run.greet()?;
    let welcome = run.viewer.welcome().expect("an open session was welcomed").clone();
    let poses = Poses::new(options, &welcome);
    let warm_up = if options.warm_up { Some(run.warm_up(&poses, stage)?) } else { None };
    let begin_s = warm_up.as_ref().map_or(0.0, |warm_up| warm_up.end_s);
    let mut frames = Vec::with_capacity(poses.count);
    for frame in 0..poses.count {
        let real_begin_s = run.pump.now_s();
        let now_s = begin_s + poses.t_s(frame);
        let world_from_eye = poses.at(frame);
        let waited_s = run.step(world_from_eye, now_s, stage)?;
        if !(options.drawn)(frame) {
            run.viewer.drawn(now_s, None, None);
            continue;
        }
        let drawn = stage.draw(&run.viewer, &view(options, world_from_eye, &welcome), now_s)?;
        let frame_ms = (run.pump.now_s() - real_begin_s - waited_s) * 1e3;
        let update_bytes = run.pump.traffic().update_bytes();
        let moment = Moment { frame, t_s: poses.t_s(frame), now_s, frame_ms, update_bytes };
        frames.push(stage.record(&mut run.viewer, &moment, poses.count, world_from_eye, drawn, on_frame)?);
    }
    let first_picture_ms = warm_up.map(|warm_up| warm_up.first_picture_s * 1e3);
    Ok(Ran { frames, first_picture_ms, server_ms: run.server_ms, traffic: run.pump.traffic().clone() })
}

/// When a warm-up had its first picture, and when it ended.
struct WarmUp {
    first_picture_s: f64,
    end_s: f64,
}

impl Lockstep<'_> {
    /// Connects, at virtual time 0.
    fn greet(&mut self) -> Result<(), HeadlessError> {
        let begin_s = self.pump.now_s();
        while !self.viewer.is_open() {
            self.flush(0.0);
            match self.pump.event_within(self.patience_s) {
                Some(SocketEvent::Message(bytes)) => self.receive(bytes, 0.0),
                Some(SocketEvent::Closed(said)) if self.pump.now_s() - begin_s > self.patience_s => {
                    return Err(HeadlessError::Server(format!("cannot reach the server: {said}")));
                }
                Some(event @ SocketEvent::Closed(_)) => {
                    // The server may be starting.
                    self.viewer.handle(event, 0.0);
                }
                Some(event) => self.viewer.handle(event, 0.0),
                None => return Err(self.trouble("the server did not answer")),
            }
            if let Some(refusal) = self.viewer.refusal() {
                return Err(HeadlessError::Server(format!("the server refused: {refusal}")));
            }
            if self.viewer.is_waiting() {
                // It said to come again: it may be loading its scene.
                if self.pump.now_s() - begin_s > self.patience_s {
                    return Err(self.trouble("the server let nobody in"));
                }
                std::thread::sleep(std::time::Duration::from_millis(200));
                self.viewer.retry_now(0.0);
            }
        }
        Ok(())
    }

    /// Lets time pass at the first pose until something is held that was made for it. A server whose first images are good
    /// for that pose too sends none, so a second after the first picture is the end in any case.
    fn warm_up(&mut self, poses: &Poses, stage: &mut Stage) -> Result<WarmUp, HeadlessError> {
        let mut step = 0_u32;
        let mut first_picture_s = None;
        loop {
            let now_s = f64::from(step) / poses.fps;
            self.step(poses.at(0), now_s, stage)?;
            if self.viewer.has_picture() {
                let first_picture_s = *first_picture_s.get_or_insert(now_s);
                if self.viewer.has_answer() || now_s - first_picture_s >= ANSWER_WITHIN_S {
                    return Ok(WarmUp { first_picture_s, end_s: now_s });
                }
            }
            if now_s > LONGEST_WARM_UP_S {
                return Err(self.trouble("no picture came"));
            }
            step += 1;
        }
    }

    /// To `now_s` with the eye at a pose. Returns the real seconds that the server took.
    fn step(&mut self, world_from_eye: Rigid, now_s: f64, stage: &mut Stage) -> Result<f64, HeadlessError> {
        self.viewer.run_until(now_s);
        stage.take_in(&mut self.viewer, now_s);
        self.viewer.set_pose(world_from_eye, now_s);
        self.viewer.request_advance(now_s);
        self.flush(now_s);
        let (asked_s, updates_before) = (self.pump.now_s(), self.update_messages());
        while self.viewer.advanced_to_s() < now_s {
            match self.pump.event_within(self.patience_s) {
                Some(SocketEvent::Message(bytes)) => self.receive(bytes, now_s),
                Some(event) => self.viewer.handle(event, now_s),
                None => return Err(self.trouble("the server did not answer")),
            }
            if !self.viewer.is_open() {
                return Err(self.trouble("the session ended"));
            }
        }
        let waited_s = self.pump.now_s() - asked_s;
        if self.update_messages() > updates_before {
            self.server_ms.push(waited_s * 1e3);
        }
        self.viewer.run_until(now_s);
        stage.take_in(&mut self.viewer, now_s);
        if self.viewer.is_open() { Ok(waited_s) } else { Err(self.trouble("the session ended")) }
    }

    fn update_messages(&self) -> u64 {
        self.pump.traffic().received.get("update").map_or(0, |count| count.messages)
    }

    fn receive(&mut self, bytes: Vec<u8>, now_s: f64) {
        let down = &mut self.down;
        self.viewer.receive_virtual(bytes, now_s, |at_s, bytes| down.deliver(at_s, bytes));
    }

    fn flush(&mut self, now_s: f64) {
        let up = &mut self.up;
        while let Some(command) = self.viewer.poll_socket_stamped(now_s, |at_s, bytes| up.deliver(at_s, bytes)) {
            self.pump.obey(command);
        }
    }

    fn trouble(&self, what: &str) -> HeadlessError {
        let status = self.viewer.status(f64::INFINITY).map_or_else(String::new, |status| format!(" ({status})"));
        HeadlessError::Server(format!("{what}{status}"))
    }
}
