//! The server's end. See [the module](super) for the states.

use std::collections::VecDeque;
use std::sync::Arc;

use bytes::Bytes;
use camera::written::WrittenCamera;
use camera::{Motion, Rigid};
use thiserror::Error;

use super::flow::{Acked, Flow};
use super::rate::TokenBucket;
use super::trail::Trail;
use super::{AUDIENCE_BUDGET_BYTES, SessionError};
use crate::inventory::Inventory;
use crate::limits::Limits;
use crate::message::{ClientMessage, Clock, Draws, Hello, Resume, Role, ServerMessage, VERSION, ViewSize, Welcome};
use crate::staging::Staging;
use crate::wire::{self, EncodedUpdate, Envelope, PackedUpdate};

/// Largest output side that is believed.
const MAX_VIEW_PX: u32 = 16384;
/// The longest step of virtual time in one message.
const MAX_ADVANCE_S: f64 = 60.0;
/// Messages of the future that a virtual session keeps: a minute of poses, acks and pings.
const MAX_INBOX: usize = 16 * 1024;
/// Longest text sent to a client.
const MAX_TEXT_CHARS: usize = 256;
/// Messages that wait for the socket at most when a name is added to them: who asks and does not listen is not answered.
const MAX_WAITING_NAMES: usize = 64;
/// Fresh starts that are not a nuisance: a few at once, then one in ten seconds.
const RESTARTS_PER_S: f64 = 0.1;
const RESTART_BURST: f64 = 5.0;

/// What a server session starts with.
#[derive(Debug, Clone)]
pub struct ServerConfig {
    /// The clock that the server runs.
    pub clock: Clock,
    /// Said to every client; its scene time is that of when the session begins.
    pub welcome: Welcome,
    /// The names of the cameras that a client may ask for.
    pub cameras: Arc<[String]>,
    /// Caps on what the client sends.
    pub limits: Limits,
    /// A client must greet within this time.
    pub greeting_s: f64,
    /// A client that says nothing for this long is gone; it pings every few seconds.
    pub silence_s: f64,
    /// A client that neither takes nor acknowledges anything for this long, while something is in flight, is cut off.
    pub stall_s: f64,
    /// Messages a second; poses at 60 a second, an ack an update and pings make less than 150.
    pub messages_per_s: f64,
    /// Messages at once, after a network's stall.
    pub message_burst: f64,
}

impl ServerConfig {
    /// The usual limits.
    pub fn new(clock: Clock, welcome: Welcome) -> ServerConfig {
        ServerConfig {
            clock,
            welcome,
            cameras: Arc::default(),
            limits: Limits::default(),
            greeting_s: 10.0,
            silence_s: 20.0,
            stall_s: 30.0,
            messages_per_s: 200.0,
            message_burst: 2000.0,
        }
    }
}

/// What happened.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ServerEvent {
    /// The client greeted, and holds what an earlier session sent: call [`ServerSession::resume`] with what is left of that one.
    Resume(Resume),
    /// The client greeted; the session is open and has a view.
    Opened,
    /// The client's output changed, see [`ServerSession::view`].
    View(ViewSize),
    /// The client draws something else from now on, see [`ServerSession::draws`].
    Draws,
    /// A new pose, see [`ServerSession::pose`].
    Pose,
    /// The client asks what is made for it: answer by [`ServerSession::tell`].
    Inventory,
    /// The client has the scene put before it otherwise from now on, see [`ServerSession::staging`].
    Stages,
    /// The client asks what an object is called: answer by [`ServerSession::name`].
    AskName {
        /// By its id.
        object: u16,
    },
    /// The client holds an update.
    Acked {
        /// Its number.
        number: u64,
        /// Seconds from its sending to here.
        delay_s: f64,
    },
    /// The client's copy is broken: forget what it holds; the next update must begin with [`crate::Edit::Clear`].
    Restart,
    /// Virtual clock: run every tick up to `to_s`, then call [`ServerSession::advanced`].
    Advance {
        /// Seconds.
        to_s: f64,
    },
}

/// Where a client's eye is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ClientPose {
    /// The client's count of poses.
    pub seq: u64,
    /// Client clock when it was sampled.
    pub sampled_at_s: f64,
    /// This end's clock when it came (virtual clock: when it counts as having come).
    pub received_at_s: f64,
    /// The eye.
    pub world_from_eye: Rigid,
    /// How it moves on.
    pub motion: Motion,
}

/// Why an update was not sent: the caller's fault, or the session is over.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
pub enum SendError {
    /// The client did not greet yet, or the session has ended.
    #[error("the session is not open")]
    NotOpen,
    /// The socket has not taken the last one. What [`ServerSession::can_send_update`] says counts when an update is begun: one that is made is sent, though the path
    /// turned out to hold less meanwhile, or is to run empty. It would have to be made good by a whole copy.
    #[error("the socket has not taken the last update")]
    NoCredit,
    /// The client begins anew, and the update does not start with [`crate::Edit::Clear`].
    #[error("the next update must clear the client's copy")]
    MustClear,
    /// The update is larger than the client accepts.
    #[error("the update has {bytes} bytes, the client accepts {limit}")]
    TooLarge {
        /// Its size.
        bytes: usize,
        /// [`Limits::update_bytes`].
        limit: usize,
    },
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum State {
    Greeting,
    /// Greeted by a client that holds this.
    Resuming(Resume),
    Open,
    Closed,
}

/// The server's end of a session with one client.
#[derive(Debug)]
pub struct ServerSession {
    config: ServerConfig,
    state: State,
    control: VecDeque<Bytes>,
    bulk: VecDeque<Bytes>,
    events: VecDeque<ServerEvent>,
    view: Option<ViewSize>,
    budget_bytes: u64,
    draws: Draws,
    staging: Staging,
    role: Role,
    camera: Option<usize>,
    start_world_from_eye: Option<Rigid>,
    pose: Option<ClientPose>,
    flow: Flow,
    trail: Trail,
    must_clear: bool,
    rate: TokenBucket,
    restarts: TokenBucket,
    begun_at_s: f64,
    heard_at_s: f64,
    taken_at_s: f64,
    /// Virtual clock: messages stamped later than the last tick.
    inbox: VecDeque<Envelope<ClientMessage>>,
    stamped_at_s: f64,
    advancing_to_s: Option<f64>,
    advanced_to_s: f64,
    bytes_received: u64,
    bytes_sent: u64,
}

impl ServerSession {
    /// Waits for Hello.
    pub fn new(mut config: ServerConfig, now_s: f64) -> ServerSession {
        config.welcome.version = VERSION;
        config.welcome.scene_name = shortened(&config.welcome.scene_name);
        ServerSession {
            rate: TokenBucket::new(config.messages_per_s, config.message_burst, now_s),
            restarts: TokenBucket::new(RESTARTS_PER_S, RESTART_BURST, now_s),
            config,
            state: State::Greeting,
            control: VecDeque::new(),
            bulk: VecDeque::new(),
            events: VecDeque::new(),
            view: None,
            budget_bytes: 0,
            draws: Draws::default(),
            staging: Staging::default(),
            role: Role::Viewer,
            camera: None,
            start_world_from_eye: None,
            pose: None,
            flow: Flow::default(),
            trail: Trail::default(),
            must_clear: false,
            begun_at_s: now_s,
            heard_at_s: now_s,
            taken_at_s: now_s,
            inbox: VecDeque::new(),
            stamped_at_s: f64::NEG_INFINITY,
            advancing_to_s: None,
            advanced_to_s: f64::NEG_INFINITY,
            bytes_received: 0,
            bytes_sent: 0,
        }
    }

    /// Takes a message that came now; `now_s` is the wall clock on either clock. After an error the session is closed, with a
    /// Goodbye to send.
    pub fn handle(&mut self, bytes: &[u8], now_s: f64) -> Result<(), SessionError> {
        if self.state == State::Closed {
            return Err(SessionError::Closed);
        }
        let result = self.receive(bytes, now_s);
        self.close_on_error(result, now_s)
    }

    fn receive(&mut self, bytes: &[u8], now_s: f64) -> Result<(), SessionError> {
        self.heard_at_s = now_s;
        self.bytes_received += bytes.len() as u64;
        let envelope = wire::decode_client(bytes, &self.config.limits)?;
        let on_virtual = self.config.clock == Clock::Virtual;
        if on_virtual && envelope.at_s < self.stamped_at_s && !matches!(envelope.message, ClientMessage::Advance { .. })
        {
            return Err(SessionError::Range("a stamp that runs backwards"));
        }
        if !self.rate.take(if on_virtual { envelope.at_s } else { now_s }) {
            return Err(SessionError::TooMany("messages"));
        }
        match (self.state, envelope.message) {
            (State::Greeting, ClientMessage::Hello(hello)) => self.take_hello(*hello, envelope.at_s, now_s),
            (State::Greeting, _) => Err(SessionError::Unexpected("a message before Hello")),
            (State::Resuming(_), _) => Err(SessionError::Unexpected("a message before Welcome")),
            (_, ClientMessage::Hello(_)) => Err(SessionError::Unexpected("a second Hello")),
            (_, ClientMessage::Advance { to_s }) => self.ask_advance(to_s),
            (_, message) if on_virtual => {
                self.stamped_at_s = envelope.at_s;
                if self.inbox.len() >= MAX_INBOX {
                    return Err(SessionError::TooMany("messages ahead of time"));
                }
                self.inbox.push_back(Envelope { at_s: envelope.at_s, message });
                Ok(())
            }
            (_, message) => self.take(message, now_s),
        }
    }

    fn take_hello(&mut self, hello: Hello, at_s: f64, now_s: f64) -> Result<(), SessionError> {
        let Hello { version, clock, view, budget_bytes, draws, role, world_from_eye, resume, staging } = hello;
        (self.budget_bytes, self.draws) = (budget_bytes, draws);
        check_ends(version, (clock, self.config.clock))?;
        self.take_role(role)?;
        check_view(&view)?;
        if world_from_eye.is_some_and(|eye| !eye.is_valid()) {
            return Err(SessionError::Range("the eye of Hello"));
        }
        self.staging = staging.map_or(Ok(Staging::default()), |staging| checked(*staging))?;
        (self.view, self.start_world_from_eye) = (Some(view), world_from_eye);
        match resume.filter(|_| clock == Clock::Wall && self.role.is_asking()) {
            Some(held) => {
                self.state = State::Resuming(held);
                self.events.push_back(ServerEvent::Resume(held));
            }
            None => self.open(if clock == Clock::Virtual { at_s } else { now_s }, false, now_s),
        }
        Ok(())
    }

    fn take_role(&mut self, role: Role) -> Result<(), SessionError> {
        match &role {
            Role::Viewer => {}
            Role::Camera(name) => self.camera = Some(self.known_camera(name)?),
            Role::Presenter(_) | Role::Follower(_) if self.config.clock == Clock::Virtual => {
                return Err(SessionError::Unexpected("an audience on the virtual clock"));
            }
            Role::Follower(_) if self.budget_bytes < AUDIENCE_BUDGET_BYTES => {
                return Err(SessionError::NoRoom { mib: AUDIENCE_BUDGET_BYTES >> 20 });
            }
            Role::Presenter(name) | Role::Follower(name) => {
                if name.is_empty() || name.len() > Role::MAX_NAME_BYTES {
                    return Err(SessionError::Range("the length of a presenter's name"));
                }
            }
        }
        self.role = role;
        Ok(())
    }

    /// The place of a camera among [`ServerConfig::cameras`].
    fn known_camera(&self, name: &str) -> Result<usize, SessionError> {
        let cameras = &self.config.cameras;
        let place = cameras.iter().position(|known| known == name);
        // What it asked for leaves room for what there is.
        let asked = || name.chars().take(WrittenCamera::MAX_NAME_BYTES).collect();
        place.ok_or_else(|| SessionError::Camera { asked: asked(), known: cameras.join(", ") })
    }

    /// Goes on where the session ended that the client still holds something of; `None`, or a trail that does not lead on from there, begins anew. The client is told
    /// this secret. Returns
    /// whether it goes on: then the server's copy must be that of the earlier session.
    pub fn resume(&mut self, secret: u128, trail: Option<Trail>, now_s: f64) -> bool {
        let State::Resuming(held) = self.state else { return false };
        self.config.welcome.secret = secret;
        let trail = trail.and_then(|trail| trail.after(held));
        self.open(now_s, trail.is_some(), now_s);
        let Some(trail) = trail else { return false };
        self.flow.goes_on_after(held.number);
        for update in trail.updates() {
            self.put(update, now_s);
        }
        self.trail = trail;
        true
    }

    /// What was sent and not acknowledged, for a client that comes back after its connection was cut off.
    pub fn take_trail(&mut self) -> Trail {
        std::mem::take(&mut self.trail)
    }

    /// An update was made for a client that is cut off by now: it is part of what it lacks. Returns whether it may ever be sent.
    pub fn missed(&mut self, update: &PackedUpdate) -> bool {
        self.trail.sent(update);
        update.bytes <= self.config.limits.update_bytes
    }

    fn open(&mut self, at_s: f64, resumed: bool, now_s: f64) {
        self.state = State::Open;
        let mut welcome = Welcome { resumed, ..self.config.welcome.clone() };
        if self.config.clock == Clock::Virtual {
            self.advanced_to_s = at_s;
        } else {
            // It is stamped now, and may have been waited for.
            welcome.scene_time_s += now_s - self.begun_at_s;
        }
        self.say(ServerMessage::Welcome(welcome), at_s);
        self.events.push_back(ServerEvent::Opened);
    }

    fn ask_advance(&mut self, to_s: f64) -> Result<(), SessionError> {
        if self.config.clock != Clock::Virtual {
            return Err(SessionError::Unexpected("Advance on the wall clock"));
        }
        if self.advancing_to_s.is_some() {
            return Err(SessionError::Unexpected("Advance before the last one was answered"));
        }
        if !(to_s >= self.advanced_to_s && to_s <= self.advanced_to_s + MAX_ADVANCE_S) {
            return Err(SessionError::Range("a step of virtual time"));
        }
        self.advancing_to_s = Some(to_s);
        self.events.push_back(ServerEvent::Advance { to_s });
        Ok(())
    }

    fn take(&mut self, message: ClientMessage, now_s: f64) -> Result<(), SessionError> {
        match message {
            ClientMessage::View(view) => {
                check_view(&view)?;
                self.view = Some(view);
                self.events.push_back(ServerEvent::View(view));
            }
            ClientMessage::Pose { seq, sampled_at_s, world_from_eye, motion } => {
                if !world_from_eye.is_valid() || !sampled_at_s.is_finite() || !motion.is_valid() {
                    return Err(SessionError::Range("a value of a pose"));
                }
                if self.pose.is_some_and(|pose| seq <= pose.seq) {
                    return Err(SessionError::Range("the number of a pose"));
                }
                let pose = ClientPose { seq, sampled_at_s, received_at_s: now_s, world_from_eye, motion };
                // One event stands for all poses since the last poll: the newest counts.
                if !self.events.contains(&ServerEvent::Pose) {
                    self.events.push_back(ServerEvent::Pose);
                }
                self.pose = Some(pose);
            }
            ClientMessage::Ack { number, digest, bytes_received } => {
                match self.flow.acked(number, digest, bytes_received, now_s) {
                    Acked::Update { delay_s } => {
                        self.trail.acknowledged(number);
                        self.events.push_back(ServerEvent::Acked { number, delay_s });
                    }
                    Acked::Old => {}
                    Acked::DigestDiffers => self.restart(now_s)?,
                    Acked::NeverSent => return Err(SessionError::Range("an ack of what was never sent")),
                }
            }
            ClientMessage::Restart => self.restart(now_s)?,
            ClientMessage::Draws(draws) => {
                self.draws = draws;
                self.events.push_back(ServerEvent::Draws);
            }
            ClientMessage::Ping(number) => self.say(ServerMessage::Pong(number), now_s),
            // An answer is longer than a question: one for all questions since the last poll.
            ClientMessage::Inventory => {
                if !self.events.contains(&ServerEvent::Inventory) {
                    self.events.push_back(ServerEvent::Inventory);
                }
            }
            ClientMessage::Stages(staging) => {
                self.staging = checked(*staging)?;
                self.events.push_back(ServerEvent::Stages);
            }
            ClientMessage::AskName { object } => self.events.push_back(ServerEvent::AskName { object }),
            ClientMessage::Hello(_) | ClientMessage::Advance { .. } => unreachable!("taken on receipt"),
        }
        Ok(())
    }

    fn restart(&mut self, now_s: f64) -> Result<(), SessionError> {
        if !self.restarts.take(now_s) {
            return Err(SessionError::TooMany("fresh starts"));
        }
        self.flow.forget();
        self.trail.forget();
        self.must_clear = true;
        self.events.push_back(ServerEvent::Restart);
        Ok(())
    }

    fn close_on_error(&mut self, result: Result<(), SessionError>, now_s: f64) -> Result<(), SessionError> {
        if let Err(error) = &result {
            self.close(&error.to_string(), error.may_come_again(), now_s);
        }
        result
    }

    /// Ends the session: nothing but a Goodbye is left to send. `again`: whether it may be otherwise for a client that comes again just as it did.
    pub fn close(&mut self, reason: &str, again: bool, now_s: f64) {
        if self.state != State::Closed {
            self.bulk.clear();
            self.say(ServerMessage::Goodbye { reason: shortened(reason), again }, now_s);
            self.state = State::Closed;
        }
    }

    /// Says what is made for the client, which asked; not while an earlier message waits.
    pub fn tell(&mut self, inventory: &Inventory, now_s: f64) {
        if self.state == State::Open && self.control.is_empty() {
            self.say(ServerMessage::Inventory(inventory.clone()), now_s);
        }
    }

    /// Says what an object is called; not while many earlier messages wait.
    pub fn name(&mut self, object: u16, name: &str, now_s: f64) {
        if self.state == State::Open && self.control.len() < MAX_WAITING_NAMES {
            self.say(ServerMessage::Name { object, name: shortened(name) }, now_s);
        }
    }

    fn say(&mut self, message: ServerMessage, now_s: f64) {
        let bytes = wire::encode_server(&Envelope { at_s: now_s, message });
        // On the virtual clock stamps must ascend, so nothing overtakes bulk there.
        let queue = if self.config.clock == Clock::Virtual { &mut self.bulk } else { &mut self.control };
        queue.extend(bytes);
    }

    /// Whether an update may be sent now: the session is open, the socket has taken the last one, and less is in flight than
    /// the path holds (or nothing at all).
    pub fn can_send_update(&self) -> bool {
        self.state == State::Open && self.has_taken_last() && self.flow.has_credit()
    }

    /// Whether the socket has taken the last update.
    fn has_taken_last(&self) -> bool {
        self.config.clock == Clock::Virtual || self.bulk.is_empty()
    }

    /// How long the path still takes for what was sent, in seconds, as far as it is known: an update that is made sooner waits for that, and shows what was.
    pub fn frees_in_s(&self, now_s: f64) -> f64 {
        self.flow.frees_in_s(now_s)
    }

    /// Sends an update, stamped `now_s` (virtual clock: the tick).
    pub fn send_update(&mut self, update: &EncodedUpdate, now_s: f64) -> Result<(), SendError> {
        self.send_packed(&update.packed(now_s), now_s)
    }

    /// The same of an update whose messages are made, as others may send them too.
    pub fn send_packed(&mut self, update: &PackedUpdate, now_s: f64) -> Result<(), SendError> {
        let limit = self.config.limits.update_bytes;
        if self.state != State::Open {
            Err(SendError::NotOpen)
        } else if !self.has_taken_last() {
            Err(SendError::NoCredit)
        } else if self.must_clear && !update.clears {
            Err(SendError::MustClear)
        } else if update.bytes > limit {
            Err(SendError::TooLarge { bytes: update.bytes, limit })
        } else {
            self.must_clear = false;
            self.put(update, now_s);
            self.trail.sent(update);
            Ok(())
        }
    }

    fn put(&mut self, update: &PackedUpdate, now_s: f64) {
        self.taken_at_s = now_s;
        self.flow.sent(update.number, update.digest, update.bytes, now_s);
        self.bulk.extend(update.fragments.iter().cloned());
    }

    /// Says something for which [`wire::encode_server`] made the messages, as others may say it too.
    pub fn say_packed(&mut self, messages: &[Bytes]) {
        if self.state == State::Open {
            self.control.extend(messages.iter().cloned());
        }
    }

    /// The next message to send: control before bulk. Take it only when the socket can write it: what is not taken yet holds
    /// back [`ServerSession::can_send_update`].
    pub fn poll_transmit(&mut self, now_s: f64) -> Option<Bytes> {
        let bytes = self.control.pop_front().or_else(|| self.bulk.pop_front())?;
        self.taken_at_s = now_s;
        self.bytes_sent += bytes.len() as u64;
        Some(bytes)
    }

    /// The next event.
    pub fn poll_event(&mut self) -> Option<ServerEvent> {
        self.events.pop_front()
    }

    /// When [`ServerSession::handle_timeout`] wants to be called next, on the wall clock.
    pub fn next_deadline_s(&self) -> Option<f64> {
        match self.state {
            State::Closed => None,
            State::Greeting | State::Resuming(_) => Some(self.begun_at_s + self.config.greeting_s),
            State::Open => {
                let silence_s = self.heard_at_s + self.config.silence_s;
                Some(self.stalled_at_s().map_or(silence_s, |stalled_s| silence_s.min(stalled_s)))
            }
        }
    }

    fn stalled_at_s(&self) -> Option<f64> {
        let waiting_since_s = self.flow.waiting_since_s().filter(|_| self.config.clock == Clock::Wall)?;
        Some(waiting_since_s.max(self.taken_at_s) + self.config.stall_s)
    }

    /// Gives the client up when it is due; `now_s` is the wall clock on either clock.
    pub fn handle_timeout(&mut self, now_s: f64) -> Result<(), SessionError> {
        let result = match self.state {
            State::Closed => return Err(SessionError::Closed),
            State::Greeting | State::Resuming(_) if now_s >= self.begun_at_s + self.config.greeting_s => {
                Err(SessionError::NoGreeting { after_s: self.config.greeting_s })
            }
            State::Open if now_s >= self.heard_at_s + self.config.silence_s => {
                Err(SessionError::Silent { after_s: self.config.silence_s })
            }
            State::Open if self.stalled_at_s().is_some_and(|at_s| now_s >= at_s) => {
                Err(SessionError::Stalled { after_s: self.config.stall_s })
            }
            State::Greeting | State::Resuming(_) | State::Open => Ok(()),
        };
        self.close_on_error(result, now_s)
    }

    /// Virtual clock: takes in what is stamped up to `tick_s`, in order. Each message is handled, and a ping answered, at its
    /// own stamp.
    pub fn run_until(&mut self, tick_s: f64) -> Result<(), SessionError> {
        while self.state == State::Open
            && let Some(envelope) = self.inbox.pop_front_if(|envelope| envelope.at_s <= tick_s)
        {
            let result = self.take(envelope.message, envelope.at_s);
            self.close_on_error(result, envelope.at_s)?;
        }
        Ok(())
    }

    /// Virtual clock: every tick up to the last [`ServerEvent::Advance`] was run and its updates sent.
    pub fn advanced(&mut self) {
        if let Some(to_s) = self.advancing_to_s.take() {
            self.advanced_to_s = to_s;
            self.say(ServerMessage::Advanced { to_s }, to_s);
        }
    }

    /// What the client's copy may take of its memory, in bytes; 0 before Hello. A presenter's is one that any follower has room for.
    pub fn budget_bytes(&self) -> u64 {
        match self.role {
            Role::Presenter(_) => self.budget_bytes.min(AUDIENCE_BUDGET_BYTES),
            _ => self.budget_bytes,
        }
    }

    /// What the client draws; nothing before Hello.
    pub fn draws(&self) -> Draws {
        self.draws
    }

    /// How the client has the scene put before it.
    pub fn staging(&self) -> &Staging {
        &self.staging
    }

    /// What the client is there for; a viewer before Hello.
    pub fn role(&self) -> &Role {
        &self.role
    }

    /// The camera that the client asked for, by its place among [`ServerConfig::cameras`]; `None` where its viewer looks around.
    pub fn camera(&self) -> Option<usize> {
        self.camera
    }

    /// The client's output; `None` before Hello.
    pub fn view(&self) -> Option<ViewSize> {
        self.view
    }

    /// Where the client said at first that its eye is; `None` where it did not.
    pub fn start_world_from_eye(&self) -> Option<Rigid> {
        self.start_world_from_eye
    }

    /// The newest pose; `None` before any.
    pub fn pose(&self) -> Option<ClientPose> {
        self.pose
    }

    /// From the sending of an update to its acknowledgement (both ways, transmission and decoding), smoothed; `None` before the
    /// first one.
    pub fn round_trip_s(&self) -> Option<f64> {
        self.flow.round_trip_s()
    }

    /// The path's throughput as far as it was used; `None` before the first acknowledgement.
    pub fn throughput_bytes_per_s(&self) -> Option<f64> {
        self.flow.bytes_per_s()
    }

    /// How much longer the last acknowledged update took than the fastest one of the session: what it waited, and its own transmission.
    /// While that is short, the path may carry more than its throughput says.
    pub fn queue_s(&self) -> f64 {
        self.flow.queue_s()
    }

    /// From the sending of an update to when all of it is there; `None` before the first acknowledgement.
    pub fn one_way_s(&self) -> Option<f64> {
        self.flow.one_way_s()
    }

    /// How long the path takes for an update; `None` before the first acknowledgement.
    pub fn taken_s(&self) -> Option<f64> {
        self.flow.taken_s()
    }

    /// Bytes of updates sent and not acknowledged, and how many may be.
    pub fn in_flight_and_window_bytes(&self) -> (u64, u64) {
        (self.flow.in_flight_bytes(), self.flow.window_bytes() as u64)
    }

    /// Bytes of messages received and sent so far, without the transport's own.
    pub fn bytes_received_and_sent(&self) -> (u64, u64) {
        (self.bytes_received, self.bytes_sent)
    }

    /// The clock that the session runs on.
    pub fn clock(&self) -> Clock {
        self.config.clock
    }

    /// Whether the session is open: greeted, and not closed.
    pub fn is_open(&self) -> bool {
        self.state == State::Open
    }

    /// Whether the session is over and everything is sent.
    pub fn is_drained(&self) -> bool {
        self.state == State::Closed && self.control.is_empty() && self.bulk.is_empty()
    }
}

fn check_ends(version: u16, (client, server): (Clock, Clock)) -> Result<(), SessionError> {
    if version != VERSION {
        Err(SessionError::Version { ours: VERSION, theirs: version })
    } else if client != server {
        Err(SessionError::Clock { server, client })
    } else {
        Ok(())
    }
}

fn checked(staging: Staging) -> Result<Staging, SessionError> {
    let is_valid = staging.playback.is_valid() && staging.excerpt.is_valid();
    if is_valid { Ok(staging) } else { Err(SessionError::Range("how the scene is put before the client")) }
}

fn check_view(view: &ViewSize) -> Result<(), SessionError> {
    let sides = 1..=MAX_VIEW_PX;
    let opens = view.fov_y_rad > 0.0 && view.fov_y_rad < std::f64::consts::PI;
    if sides.contains(&view.width_px) && sides.contains(&view.height_px) && opens {
        Ok(())
    } else {
        Err(SessionError::Range("the view's size or field of view"))
    }
}

fn shortened(text: &str) -> String {
    text.chars().take(MAX_TEXT_CHARS).collect()
}
