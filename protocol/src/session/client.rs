//! The client's end. See [the module](super) for the states.

use std::collections::VecDeque;

use camera::{Motion, Rigid};

use super::SessionError;
use super::scene_clock::SceneClock;
use crate::inventory::Inventory;
use crate::limits::Limits;
use crate::message::{ClientMessage, Clock, Draws, Hello, Resume, Role, ServerMessage, VERSION, ViewSize, Welcome};
use crate::staging::{Playback, Staging};
use crate::wire::{self, Assembler, Envelope, ServerPacket, UpdateHead};

/// Seconds between two poses at least.
const POSE_INTERVAL_S: f64 = 1.0 / 60.0;
/// And at most, while the eye moves. On a path that is full one goes up in the time that an update takes of it or waits: a packet up has one answered that goes down, and sixty a
/// second take a sixth of a path of 100 kbit/s from updates.
const LONGEST_POSE_INTERVAL_S: f64 = 0.2;
/// Where no update came for so long the path is not full of them.
const FULL_FOR_S: f64 = 1.0;
/// A frame that comes this much early still counts as the next one. Chosen: frames of a screen at 60 Hz come early by less. With a tenth of it their jitter would
/// make poses wait for the frame after; with ten times it two poses might go within 7 ms.
const POSE_TOLERANCE_S: f64 = 1e-3;
/// Pings at first, until the round trip is known.
const FIRST_PINGS: u32 = 3;
/// Between the first pings.
const FIRST_PING_INTERVAL_S: f64 = 0.25;
/// Between pings while something happens.
const PING_INTERVAL_S: f64 = 2.0;
/// Between pings at rest: with 43 bytes of ping, pong and frame headers, 9 bytes a second.
const REST_PING_INTERVAL_S: f64 = 5.0;
/// Without a pose or an update for this long, the session is at rest.
const REST_AFTER_S: f64 = 3.0;
/// An unanswered ping, and no other word, for so many round trips: the path is cut, and another connection may be through sooner than what is repeated on this one ...
const PATIENCE_ROUND_TRIPS: f64 = 8.0;
/// ... but not before this long, which other traffic on the path may take.
const LEAST_PATIENCE_S: f64 = 6.0;
/// Share of a new round trip in the smoothed one (RFC 6298).
const SMOOTHING: f64 = 0.125;

/// What a client session starts with.
#[derive(Debug, Clone)]
pub struct ClientConfig {
    /// The clock to ask for.
    pub clock: Clock,
    /// The output.
    pub view: ViewSize,
    /// What the held copy may take, in bytes.
    pub budget_bytes: u64,
    /// What is drawn.
    pub draws: Draws,
    /// What it is there for.
    pub role: Role,
    /// The eye, where it is known already.
    pub world_from_eye: Option<Rigid>,
    /// What is held of a session that was cut off.
    pub resume: Option<Resume>,
    /// How the scene is put before it.
    pub staging: Staging,
    /// Caps on what the server sends.
    pub limits: Limits,
    /// Without a word from the server for this long, it is gone. Several pings; sooner where one is not answered.
    pub silence_s: f64,
}

/// What a held copy may take where nobody says: six million samples.
pub const DEFAULT_BUDGET_BYTES: u64 = 512 << 20;

impl ClientConfig {
    /// The usual limits.
    pub fn new(clock: Clock, view: ViewSize) -> ClientConfig {
        let (budget_bytes, limits) = (DEFAULT_BUDGET_BYTES, Limits::default());
        let (draws, role, silence_s) = (Draws::default(), Role::Viewer, 20.0);
        let (world_from_eye, resume, staging) = (None, None, Staging::default());
        ClientConfig { clock, view, budget_bytes, draws, role, world_from_eye, resume, staging, limits, silence_s }
    }
}

/// What happened.
#[derive(Debug, Clone, PartialEq)]
pub enum ClientEvent {
    /// The session is open.
    Welcome(Box<Welcome>),
    /// An update came in whole: decode and apply it, then call [`ClientSession::applied`] or [`ClientSession::broken`].
    Update(ReceivedUpdate),
    /// A follower's: where the presenter's eye is, and how the time goes.
    Presenter(Rigid, Playback),
    /// What an object is called, as [it asked](ClientSession::ask_name).
    Name {
        /// By its id.
        object: u16,
        /// Empty where there is no such object.
        name: String,
    },
    /// What is made for it, as [it asked](ClientSession::ask).
    Inventory(Inventory),
    /// Virtual clock: everything up to `to_s` has come.
    Advanced {
        /// Seconds.
        to_s: f64,
    },
}

/// The bytes of an update, for [`wire::decode_update`].
#[derive(Debug, Clone, PartialEq)]
pub struct ReceivedUpdate {
    /// What its first bytes say.
    pub head: UpdateHead,
    /// The server's stamp.
    pub sent_at_s: f64,
    /// When its last fragment came.
    pub arrived_at_s: f64,
    /// Head and edits.
    pub bytes: Vec<u8>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum State {
    Greeting,
    Open,
    Closed,
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct EyePose {
    world_from_eye: Rigid,
    motion: Motion,
    sampled_at_s: f64,
}

/// The client's end of a session.
#[derive(Debug)]
pub struct ClientSession {
    config: ClientConfig,
    state: State,
    outbox: VecDeque<Envelope<ClientMessage>>,
    events: VecDeque<ClientEvent>,
    assembler: Assembler,
    /// Updates given out and neither applied nor dropped: number and bytes.
    undecided: VecDeque<(u64, u64)>,
    bytes_decided: u64,
    broken: bool,
    pose_seq: u64,
    pose_sent: Option<EyePose>,
    pose_waiting: Option<EyePose>,
    next_pose_at_s: f64,
    ping: Ping,
    scene_clock: Option<SceneClock>,
    /// How much longer than a ping the last two updates were on their way: one alone may have lost a packet, or be large.
    late_s: [f64; 2],
    updated_at_s: f64,
    heard_at_s: f64,
    busy_at_s: f64,
    bytes_received: u64,
    bytes_sent: u64,
    inbox: VecDeque<(f64, Vec<u8>)>,
}

#[derive(Debug, Default)]
struct Ping {
    number: u32,
    sent_at_s: f64,
    waiting: bool,
    round_trip_s: Option<f64>,
    /// The least of all.
    least_s: Option<f64>,
}

impl ClientSession {
    /// Begins with Hello.
    pub fn new(config: ClientConfig, now_s: f64) -> ClientSession {
        let hello = ClientMessage::Hello(Box::new(Hello {
            version: VERSION,
            clock: config.clock,
            view: config.view,
            budget_bytes: config.budget_bytes,
            draws: config.draws,
            role: config.role.clone(),
            world_from_eye: config.world_from_eye,
            resume: config.resume,
            staging: Some(&config.staging).filter(|staging| **staging != Staging::default()).cloned().map(Box::new),
        }));
        ClientSession {
            config,
            state: State::Greeting,
            outbox: VecDeque::from([Envelope { at_s: now_s, message: hello }]),
            events: VecDeque::new(),
            assembler: Assembler::default(),
            undecided: VecDeque::new(),
            bytes_decided: 0,
            broken: false,
            pose_seq: 0,
            pose_sent: None,
            pose_waiting: None,
            next_pose_at_s: now_s,
            ping: Ping::default(),
            scene_clock: None,
            late_s: [0.0; 2],
            updated_at_s: now_s,
            heard_at_s: now_s,
            busy_at_s: now_s,
            bytes_received: 0,
            bytes_sent: 0,
            inbox: VecDeque::new(),
        }
    }

    /// Takes a message that came now. After an error the session is closed.
    pub fn handle(&mut self, bytes: &[u8], now_s: f64) -> Result<(), SessionError> {
        if self.state == State::Closed {
            return Err(SessionError::Closed);
        }
        let result = self.take(bytes, now_s);
        self.close_on_error(result)
    }

    fn take(&mut self, bytes: &[u8], now_s: f64) -> Result<(), SessionError> {
        self.heard_at_s = now_s;
        self.bytes_received += bytes.len() as u64;
        let Envelope { at_s, message } = wire::decode_server(bytes, &self.config.limits)?;
        let message = match (self.state, message) {
            (_, ServerPacket::Control(message @ ServerMessage::Goodbye { .. }))
            | (State::Greeting, ServerPacket::Control(message @ ServerMessage::Welcome(_))) => message,
            (State::Greeting, _) => return Err(SessionError::Unexpected("a message before Welcome")),
            (_, ServerPacket::Control(ServerMessage::Welcome(_))) => {
                return Err(SessionError::Unexpected("a second Welcome"));
            }
            (_, ServerPacket::Control(message)) => message,
            (_, ServerPacket::Fragment(fragment)) => {
                self.busy_at_s = now_s;
                return match self.assembler.push(fragment, &self.config.limits)? {
                    Some(bytes) => self.assembled(bytes, at_s, now_s),
                    None => Ok(()),
                };
            }
        };
        match message {
            ServerMessage::Welcome(welcome) => {
                check_welcome(&welcome)?;
                self.state = State::Open;
                self.send_ping(now_s);
                self.scene_clock = Some(match self.config.clock {
                    Clock::Wall => SceneClock::said(welcome.scene_time_s, at_s, now_s),
                    Clock::Virtual => SceneClock::shared(welcome.scene_time_s - at_s),
                });
                self.events.push_back(ClientEvent::Welcome(Box::new(welcome)));
            }
            ServerMessage::Pong(number) => self.pong(number, at_s, now_s)?,
            ServerMessage::Advanced { to_s } => self.events.push_back(ClientEvent::Advanced { to_s }),
            ServerMessage::Presenter { world_from_eye, playback }
                if world_from_eye.is_valid() && playback.is_valid() =>
            {
                self.events.push_back(ClientEvent::Presenter(world_from_eye, playback));
            }
            ServerMessage::Presenter { .. } => return Err(SessionError::Range("the presenter's eye or time")),
            ServerMessage::Name { object, name } => self.events.push_back(ClientEvent::Name { object, name }),
            ServerMessage::Inventory(inventory) => self.events.push_back(ClientEvent::Inventory(inventory)),
            ServerMessage::Goodbye { reason, again } => return Err(SessionError::Goodbye { reason, again }),
            ServerMessage::Update(_) => unreachable!("updates come in fragments"),
        }
        Ok(())
    }

    fn close_on_error(&mut self, result: Result<(), SessionError>) -> Result<(), SessionError> {
        if result.is_err() {
            self.state = State::Closed;
        }
        result
    }

    fn assembled(&mut self, bytes: Vec<u8>, sent_at_s: f64, arrived_at_s: f64) -> Result<(), SessionError> {
        let head = UpdateHead::peek(&bytes)?;
        if self.broken && !head.clears {
            self.bytes_decided += bytes.len() as u64;
            return Ok(());
        }
        self.broken = false;
        let ping_s = self.ping.least_s.zip(self.scene_clock);
        let late_s = ping_s.map_or(0.0, |(least_s, clock)| clock.on_its_way_s(sent_at_s, arrived_at_s) - least_s / 2.0);
        (self.late_s, self.updated_at_s) = ([self.late_s[1], late_s], arrived_at_s);
        self.undecided.push_back((head.number, bytes.len() as u64));
        self.events.push_back(ClientEvent::Update(ReceivedUpdate { head, sent_at_s, arrived_at_s, bytes }));
        Ok(())
    }

    fn pong(&mut self, number: u32, stamped_at_s: f64, now_s: f64) -> Result<(), SessionError> {
        if !self.ping.waiting || number != self.ping.number {
            return Err(SessionError::Unexpected("a pong without a ping"));
        }
        self.ping.waiting = false;
        if let Some(clock) = &mut self.scene_clock {
            clock.answered(self.ping.sent_at_s, stamped_at_s, now_s);
        }
        let sample_s = (now_s - self.ping.sent_at_s).max(0.0);
        let smoothed_s = self.ping.round_trip_s.map_or(sample_s, |old_s| old_s + SMOOTHING * (sample_s - old_s));
        self.ping.round_trip_s = Some(smoothed_s);
        self.ping.least_s = Some(self.ping.least_s.map_or(sample_s, |least_s| least_s.min(sample_s)));
        Ok(())
    }

    /// The next message to send.
    pub fn poll_transmit(&mut self) -> Option<Vec<u8>> {
        self.poll_transmit_stamped(|at_s, _| at_s)
    }

    /// The next message to send, stamped with `stamp(made_at_s, bytes)`: on the virtual clock, the time at which the emulated
    /// network delivers a message of that size. Hello and Advance, which take no time, are not asked for.
    pub fn poll_transmit_stamped(&mut self, stamp: impl FnOnce(f64, usize) -> f64) -> Option<Vec<u8>> {
        let mut envelope = self.outbox.pop_front()?;
        let mut bytes = wire::encode_client(&envelope);
        if !matches!(envelope.message, ClientMessage::Hello(_) | ClientMessage::Advance { .. }) {
            envelope.at_s = stamp(envelope.at_s, bytes.len());
            bytes = wire::encode_client(&envelope);
        }
        self.bytes_sent += bytes.len() as u64;
        Some(bytes)
    }

    /// The next event.
    pub fn poll_event(&mut self) -> Option<ClientEvent> {
        self.events.pop_front()
    }

    /// When [`ClientSession::handle_timeout`] wants to be called next.
    pub fn next_deadline_s(&self) -> Option<f64> {
        let silence_s = self.silent_from_s();
        let pose_s = self.pose_waiting.map_or(f64::INFINITY, |_| self.next_pose_at_s);
        match self.state {
            State::Closed => None,
            State::Greeting => Some(silence_s),
            State::Open => Some(silence_s.min(pose_s).min(self.next_ping_at_s().unwrap_or(f64::INFINITY))),
        }
    }

    /// Does what is due: a pose or a ping is sent, or the server is given up.
    pub fn handle_timeout(&mut self, now_s: f64) -> Result<(), SessionError> {
        if self.state == State::Closed {
            return Err(SessionError::Closed);
        }
        if now_s >= self.silent_from_s() {
            return self.close_on_error(Err(SessionError::Silent { after_s: now_s - self.heard_at_s }));
        }
        if self.state == State::Open {
            self.send_waiting_pose(now_s);
            if self.next_ping_at_s().is_some_and(|at_s| now_s >= at_s) {
                self.send_ping(now_s);
            }
        }
        Ok(())
    }

    /// When the server counts as gone, if nothing is heard until then.
    fn silent_from_s(&self) -> f64 {
        let ClientConfig { silence_s, .. } = self.config;
        match self.ping.round_trip_s.filter(|_| self.ping.waiting) {
            Some(round_trip_s) => {
                let patience_s = (PATIENCE_ROUND_TRIPS * round_trip_s).max(LEAST_PATIENCE_S).min(silence_s);
                (self.ping.sent_at_s.max(self.heard_at_s) + patience_s).min(self.heard_at_s + silence_s)
            }
            None => self.heard_at_s + silence_s,
        }
    }

    fn next_ping_at_s(&self) -> Option<f64> {
        let at_s = |interval_s: f64| self.ping.sent_at_s + interval_s;
        if self.ping.waiting {
            None
        } else if self.ping.number < FIRST_PINGS {
            Some(at_s(FIRST_PING_INTERVAL_S))
        } else if at_s(PING_INTERVAL_S) <= self.busy_at_s + REST_AFTER_S {
            Some(at_s(PING_INTERVAL_S))
        } else {
            Some(at_s(REST_PING_INTERVAL_S))
        }
    }

    fn send_ping(&mut self, now_s: f64) {
        self.ping = Ping { number: self.ping.number + 1, sent_at_s: now_s, waiting: true, ..self.ping };
        self.send(ClientMessage::Ping(self.ping.number), now_s);
    }

    fn send(&mut self, message: ClientMessage, now_s: f64) {
        if self.state != State::Closed {
            self.outbox.push_back(Envelope { at_s: now_s, message });
        }
    }

    /// The output changed.
    pub fn set_view(&mut self, view: ViewSize, now_s: f64) {
        if view != self.config.view {
            self.config.view = view;
            self.send(ClientMessage::View(view), now_s);
        }
    }

    /// What is drawn changed.
    pub fn set_draws(&mut self, draws: Draws, now_s: f64) {
        if draws != self.config.draws {
            self.config.draws = draws;
            self.send(ClientMessage::Draws(draws), now_s);
        }
    }

    /// How the scene is put before it changed.
    pub fn set_staging(&mut self, staging: &Staging, now_s: f64) {
        if *staging != self.config.staging {
            self.config.staging = staging.clone();
            self.send(ClientMessage::Stages(Box::new(staging.clone())), now_s);
        }
    }

    /// Asks what an object is called, see [`ClientEvent::Name`].
    pub fn ask_name(&mut self, object: u16, now_s: f64) {
        self.send(ClientMessage::AskName { object }, now_s);
    }

    /// Asks what is made for it, see [`ClientEvent::Inventory`].
    pub fn ask(&mut self, now_s: f64) {
        self.send(ClientMessage::Inventory, now_s);
    }

    /// Where the eye is now, and how it moves. Sent only when that changed, and at most 60 times a second: the newest wins.
    pub fn set_pose(&mut self, world_from_eye: Rigid, motion: Motion, now_s: f64) {
        let same = |pose: &EyePose| pose.world_from_eye == world_from_eye && pose.motion == motion;
        if self.pose_waiting.as_ref().or(self.pose_sent.as_ref()).is_some_and(same) {
            return;
        }
        self.pose_waiting = Some(EyePose { world_from_eye, motion, sampled_at_s: now_s });
        self.send_waiting_pose(now_s);
    }

    fn send_waiting_pose(&mut self, now_s: f64) {
        if now_s < self.next_pose_at_s - POSE_TOLERANCE_S {
            return;
        }
        let Some(pose) = self.pose_waiting.take() else { return };
        // Early ones are made up for, so that the mean keeps the rate.
        let is_full = now_s - self.updated_at_s < FULL_FOR_S;
        let late_s = if is_full { self.late_s[0].min(self.late_s[1]) } else { 0.0 };
        let interval_s = late_s.clamp(POSE_INTERVAL_S, LONGEST_POSE_INTERVAL_S);
        self.next_pose_at_s = (self.next_pose_at_s + interval_s).max(now_s + interval_s - POSE_TOLERANCE_S);
        self.pose_seq += 1;
        self.busy_at_s = now_s;
        self.pose_sent = Some(pose);
        let EyePose { world_from_eye, motion, sampled_at_s } = pose;
        self.send(ClientMessage::Pose { seq: self.pose_seq, sampled_at_s, world_from_eye, motion }, now_s);
    }

    /// An update given out by [`ClientEvent::Update`] is decoded and held: acknowledges it and all before it.
    pub fn applied(&mut self, number: u64, digest: u64, now_s: f64) {
        while let Some((_, bytes)) = self.undecided.pop_front_if(|(undecided, _)| *undecided <= number) {
            self.bytes_decided += bytes;
        }
        self.send(ClientMessage::Ack { number, digest, bytes_received: self.bytes_decided }, now_s);
    }

    /// An update could not be decoded or applied: asks the server to begin anew, once, and drops everything until it does.
    pub fn broken(&mut self, now_s: f64) {
        self.bytes_decided += self.undecided.drain(..).map(|(_, bytes)| bytes).sum::<u64>();
        let cleared =
            self.events.iter().position(|event| matches!(event, ClientEvent::Update(update) if update.head.clears));
        match cleared {
            // A fresh start is here already.
            Some(index) => {
                let mut place = 0;
                self.events.retain(|event| {
                    place += 1;
                    place > index || !matches!(event, ClientEvent::Update(_))
                });
            }
            None => {
                self.events.retain(|event| !matches!(event, ClientEvent::Update(_)));
                if !self.broken {
                    self.broken = true;
                    self.send(ClientMessage::Restart, now_s);
                }
            }
        }
    }

    /// What time it is in the scene; `None` before Welcome.
    pub fn scene_clock(&self) -> Option<SceneClock> {
        self.scene_clock
    }

    /// The smoothed round trip; `None` before the first pong.
    pub fn round_trip_s(&self) -> Option<f64> {
        self.ping.round_trip_s
    }

    /// The number of the newest pose sent, 0 before any: an update that answers it carries it as
    /// [`UpdateHead::pose_seq`].
    pub fn pose_seq(&self) -> u64 {
        self.pose_seq
    }

    /// Bytes of messages received and sent so far, without the transport's own.
    pub fn bytes_received_and_sent(&self) -> (u64, u64) {
        (self.bytes_received, self.bytes_sent)
    }

    /// Bytes here and in all of the update that is on its way, for a progress bar.
    pub fn progress_bytes(&self) -> (usize, usize) {
        self.assembler.progress_bytes()
    }

    /// Whether the session is open: welcomed, and not closed.
    pub fn is_open(&self) -> bool {
        self.state == State::Open
    }

    /// Virtual clock: asks the server to run up to `to_s`. One [`ClientEvent::Advanced`] answers it.
    pub fn advance(&mut self, to_s: f64) {
        self.send(ClientMessage::Advance { to_s }, to_s);
    }

    /// Virtual clock: takes a message off the socket; `deliver(sent_at_s, bytes)` is the emulated network's time of arrival. What
    /// takes no time (Welcome, Advanced, Goodbye) is handled at once, the rest by [`ClientSession::run_until`].
    pub fn receive_virtual(
        &mut self,
        bytes: Vec<u8>,
        deliver: impl FnOnce(f64, usize) -> f64,
    ) -> Result<(), SessionError> {
        if self.state == State::Closed {
            return Err(SessionError::Closed);
        }
        match wire::travel(&bytes) {
            Ok(Some(at_s)) => self.inbox.push_back((deliver(at_s, bytes.len()), bytes)),
            Ok(None) => return self.handle(&bytes, self.heard_at_s),
            Err(error) => return self.close_on_error(Err(error.into())),
        }
        Ok(())
    }

    /// Virtual clock: takes in what arrived up to `now_s`, in order, and does what is due.
    pub fn run_until(&mut self, now_s: f64) -> Result<(), SessionError> {
        while let Some((arrival_s, bytes)) = self.inbox.pop_front_if(|(arrival_s, _)| *arrival_s <= now_s) {
            self.handle(&bytes, arrival_s)?;
        }
        // Nothing to hear is no silence here: the server says what it says, and Advanced ends each step.
        self.heard_at_s = now_s;
        self.handle_timeout(now_s)
    }
}

fn check_welcome(welcome: &Welcome) -> Result<(), SessionError> {
    if welcome.version != VERSION {
        return Err(SessionError::Version { ours: VERSION, theirs: welcome.version });
    }
    if welcome.is_sound() { Ok(()) } else { Err(SessionError::Range("a value of Welcome")) }
}
