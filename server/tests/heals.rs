//! A client whose copy went wrong says so, and shows the scene again within a second: the session state machines of both
//! ends over a path with delay, with real updates between them.

mod common;

use std::collections::VecDeque;

use camera::{Motion, Rigid};
use common::session::{INTERVAL_S, Session, VIEW};
use common::{moving_ball, swing};
use glam::DVec3;
use protocol::message::{Clock, VERSION, Welcome};
use protocol::session::{ClientConfig, ClientEvent, ClientSession, ServerConfig, ServerEvent, ServerSession};
use protocol::staging::SceneMotion;
use protocol::wire::{decode_update, encode_update};
use protocol::{Edit, Held, Limits, Look, Update};

/// One way.
const DELAY_S: f64 = 0.04;
const STEP_S: f64 = 0.01;
/// From the fault to a copy that agrees again.
const HEALS_WITHIN_S: f64 = 1.0;

/// What goes wrong, once.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Fault {
    /// Bits of samples change on their way.
    Damage,
    /// The client forgets a patch that later edits name.
    Loss,
    /// The client takes an update that the server never made.
    Stranger,
    /// The client acknowledges another digest than the server's.
    Digest,
}

/// Messages on their way, each with the time at which it comes.
#[derive(Default)]
struct Path(VecDeque<(f64, Vec<u8>)>);

impl Path {
    fn send(&mut self, bytes: Vec<u8>, now_s: f64) {
        self.0.push_back((now_s + DELAY_S, bytes));
    }

    fn arrived(&mut self, now_s: f64) -> Option<Vec<u8>> {
        self.0.pop_front_if(|(at_s, _)| *at_s <= now_s).map(|(_, bytes)| bytes)
    }
}

/// Both ends of a session, with the server's stage behind one and a copy behind the other.
struct Pair {
    stage: Session,
    server: ServerSession,
    client: ClientSession,
    up: Path,
    down: Path,
    held: Held,
    steps: u64,
    fault: Option<Fault>,
    restarts: usize,
    /// When the client last began anew.
    cleared_at_s: f64,
    /// When an acknowledgement last agreed with the server's digest.
    agreed_at_s: f64,
    /// Digests by update number, as the server made them.
    digests: Vec<(u64, u64)>,
}

impl Pair {
    fn new() -> Pair {
        let stage = Session::new(moving_ball(|time_s| swing(time_s, 4.0)));
        let welcome = Welcome {
            version: VERSION,
            scene_name: "test".into(),
            bounds_min_world: [-10.0; 3],
            bounds_max_world: [10.0; 3],
            start_world_from_eye: stage.viewer.world_from_eye,
            walk: true,
            near_m: stage.rules.near_m,
            look: Look::Plain,
            update_interval_s: INTERVAL_S,
            scene_time_s: 0.0,
            motion: SceneMotion::Still,
            secret: 0,
            resumed: false,
        };
        Pair {
            stage,
            server: ServerSession::new(ServerConfig::new(Clock::Wall, welcome), 0.0),
            client: ClientSession::new(ClientConfig::new(Clock::Wall, VIEW), 0.0),
            up: Path::default(),
            down: Path::default(),
            held: Held::default(),
            steps: 0,
            fault: None,
            restarts: 0,
            cleared_at_s: f64::NEG_INFINITY,
            agreed_at_s: f64::NEG_INFINITY,
            digests: Vec::new(),
        }
    }

    fn now_s(&self) -> f64 {
        self.steps as f64 * STEP_S
    }

    fn step(&mut self) {
        self.steps += 1;
        let now_s = self.now_s();
        // Along the wall and towards it, so that every update sends something and replaces something.
        let velocity = DVec3::new(0.6, 0.0, -0.2);
        let pose = Rigid::look_along(DVec3::new(-3.0, 0.0, 1.0) + velocity * now_s, DVec3::NEG_Z);
        self.client.set_pose(pose, Motion::along(velocity), now_s);
        while let Some(bytes) = self.up.arrived(now_s) {
            self.server.handle(&bytes, now_s).expect("a sound message");
        }
        while let Some(bytes) = self.down.arrived(now_s) {
            self.client.handle(&bytes, now_s).expect("a sound message");
        }
        self.serve(now_s);
        self.take(now_s);
        self.client.handle_timeout(now_s).expect("an open session");
        self.server.handle_timeout(now_s).expect("an open session");
        while let Some(bytes) = self.client.poll_transmit() {
            self.up.send(bytes, now_s);
        }
        while let Some(bytes) = self.server.poll_transmit(now_s) {
            self.down.send(bytes.into(), now_s);
        }
    }

    /// The server's side, as its session does it.
    fn serve(&mut self, now_s: f64) {
        while let Some(event) = self.server.poll_event() {
            match event {
                ServerEvent::Pose => {
                    let pose = self.server.pose().expect("a pose");
                    self.stage.viewer.hear(pose.seq, pose.sampled_at_s, pose.world_from_eye, pose.motion, now_s);
                }
                ServerEvent::Restart => {
                    self.restarts += 1;
                    self.stage.client.start_anew();
                }
                ServerEvent::Opened
                | ServerEvent::Resume(_)
                | ServerEvent::View(_)
                | ServerEvent::Draws
                | ServerEvent::Acked { .. }
                | ServerEvent::Inventory
                | ServerEvent::Stages
                | ServerEvent::AskName { .. }
                | ServerEvent::Advance { .. } => {}
            }
        }
        let is_tick = self.steps.is_multiple_of((INTERVAL_S / STEP_S).round() as u64);
        if is_tick && self.server.can_send_update() {
            let Session { stage, viewer, client, .. } = &mut self.stage;
            let made = stage.update(viewer, client, now_s).expect("an update").expect("the scene moves on");
            self.digests.push((made.update.number, made.update.digest));
            self.server.send_update(&encode_update(&made.update, made.coding), now_s).expect("credit");
        }
    }

    /// The client's side.
    fn take(&mut self, now_s: f64) {
        while let Some(event) = self.client.poll_event() {
            let ClientEvent::Update(received) = event else { continue };
            let mut bytes = received.bytes;
            let mut decoded = decode_update(&bytes, &Limits::default()).ok();
            let adds = |update: &Update| update.edits.iter().any(|edit| matches!(edit, Edit::Add(_)));
            if self.fault == Some(Fault::Damage) && decoded.as_ref().is_some_and(adds) {
                // More than one: a coder's last byte may say nothing. Towards the end, where samples are: before them are the numbers of cameras, and behind
                // them the next steps of what moves, of which nobody is told whether they came whole.
                let place = bytes.len() - 56;
                bytes[place..place + 16].iter_mut().for_each(|byte| *byte ^= 0x55);
                decoded = decode_update(&bytes, &Limits::default()).ok();
                self.fault = None;
            }
            let applied = decoded.filter(|update| self.held.apply(update).is_ok());
            match applied {
                Some(update) => self.applied(&update, now_s),
                None => self.client.broken(now_s),
            }
        }
    }

    fn applied(&mut self, update: &Update, now_s: f64) {
        if matches!(update.edits.first(), Some(Edit::Clear)) {
            self.cleared_at_s = now_s;
        }
        let mut digest = self.held.digest();
        if self.fault == Some(Fault::Digest) {
            digest ^= 1;
            self.fault = None;
        }
        if self.digests.contains(&(update.number, digest)) {
            self.agreed_at_s = now_s;
        }
        self.client.applied(update.number, digest, now_s);
    }

    fn run(&mut self, seconds: f64) {
        let end = self.steps + (seconds / STEP_S).round() as u64;
        while self.steps < end {
            self.step();
        }
    }

    fn strike(&mut self, fault: Fault) {
        match fault {
            Fault::Damage | Fault::Digest => self.fault = Some(fault),
            Fault::Loss => self.held.patches.clear(),
            Fault::Stranger => drop(self.held.commit(Vec::new(), 0.0, 0).expect("an update")),
        }
    }
}

#[test]
fn a_copy_that_went_wrong_heals_within_a_second() {
    let mut pair = Pair::new();
    pair.run(2.0);
    assert_eq!(pair.restarts, 0);
    for (index, fault) in [Fault::Damage, Fault::Loss, Fault::Stranger, Fault::Digest].into_iter().enumerate() {
        let struck_at_s = pair.now_s();
        pair.strike(fault);
        pair.run(HEALS_WITHIN_S);
        let cleared_s = pair.cleared_at_s - struck_at_s;
        eprintln!("{fault:?}: cleared after {cleared_s:.2} s, agreed {:.2}", pair.agreed_at_s - struck_at_s);
        assert!(cleared_s > 0.0, "{fault:?}: no fresh start within {HEALS_WITHIN_S} s");
        assert!(pair.agreed_at_s >= pair.cleared_at_s, "{fault:?}: the copies agree again");
        assert_eq!(pair.restarts, index + 1, "{fault:?}: one fresh start");
        pair.run(1.0);
        assert_eq!(pair.restarts, index + 1, "{fault:?}: and no more");
        assert!(pair.agreed_at_s > pair.now_s() - 2.0 * INTERVAL_S, "{fault:?}: updates go on");
    }
}
