//! [`Viewer`]: everything between the socket and the picture, without either.
//!
//! The way of the data: socket events go in by [`Viewer::handle`]; updates are decoded beside the drawing ([`Decoder`]), applied
//! to [`Held`] and to the surfaces by [`Viewer::advance`]; poses go in by [`Viewer::set_pose`]; what the socket must do comes
//! out of [`Viewer::poll_socket`]. The frame never waits for any of it. Times are of one clock of the caller's, in seconds:
//! real on the wall clock, the trace's on the virtual one.
//!
//! When a connection ends, the picture stays. A new session goes on with what is held, where the server still knows what that is; else it begins with an update
//! that clears it.

mod decoder;
mod figures;
mod motion;
mod round_trips;
mod staged;
#[cfg(test)]
mod tests;
mod tracks;

use camera::{Motion, Rigid};
use protocol::message::{Clock, Draws, Resume, Role, ViewSize, Welcome};
use protocol::session::{ClientConfig, ClientEvent, ClientSession, DEFAULT_BUDGET_BYTES, SceneClock, SessionError};
use protocol::staging::{Excerpt, Parts, Playback, SceneMotion, Section, Staging};
use protocol::{Held, Inventory, Limits};
use surface::Build;

use crate::receive::connection::{Command, Connection, Ended};
use crate::receive::follow::Follow;
use crate::receive::history::History;
use crate::receive::moment::Moment;
use crate::receive::stats::Stats;

use figures::Figures;
use staged::Staged;

pub use decoder::{DecodeWorker, Decoded, Decoder, answer_in_parts};
pub use motion::MotionEstimator;
pub use round_trips::RoundTrips;
pub use tracks::Tracks;

/// What a socket reports.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum SocketEvent {
    /// It is open.
    Opened,
    /// A binary message came.
    Message(Vec<u8>),
    /// It is closed or could not be opened; what was said about it, possibly nothing. The last event.
    Closed(String),
}

/// What a socket must do.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum SocketCommand {
    /// Open a new one; one that is there is dropped.
    Open,
    /// Send a binary message.
    Send(Vec<u8>),
    /// Close it and report nothing more.
    Close,
}

/// How far the way to the first picture is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Progress {
    /// Bytes of the first update that are here.
    pub bytes: usize,
    /// Of so many; 0 while that is not known.
    pub of_bytes: usize,
}

/// See the module.
#[derive(Debug)]
pub struct Viewer {
    clock: Clock,
    limits: Limits,
    view: ViewSize,
    budget_bytes: u64,
    draws: Draws,
    role: Role,
    connection: Connection,
    /// Counts sessions, so that what an earlier one left in the decoder is told apart.
    session_number: u64,
    session: Option<ClientSession>,
    closing: bool,
    decoder: Decoder,
    /// The next update, which waits for its surfaces to be uploaded, or for the picture.
    next: Option<Decoded>,
    is_uploading: bool,
    held: Held,
    /// The session that `held` is of.
    held_session: u64,
    /// How far that got, for the next one to go on with.
    resume: Option<Resume>,
    /// Where the eye is, as soon as that is known.
    eye: Option<Rigid>,
    /// The eye that this session's first picture is for, where the server was told.
    began_at: Option<Rigid>,
    welcome: Option<Welcome>,
    scene_clock: Option<SceneClock>,
    trips: RoundTrips,
    motion: MotionEstimator,
    tracks: Tracks,
    /// How the scene is put before it.
    staged: Staged,
    /// Where the presenter's eye is, of a follower.
    presenter: Option<Rigid>,
    /// As the server said last.
    inventory: Inventory,
    advanced_to_s: f64,
    bytes: u64,
    updates: u64,
    figures: Figures,
}

impl Viewer {
    /// Connects to `address` (for a person to read; the socket's owner knows the way) as soon as [`Viewer::poll_socket`] is
    /// asked.
    pub fn new(address: &str, clock: Clock, view: ViewSize, decoder: Decoder, now_s: f64) -> Viewer {
        Viewer {
            clock,
            limits: Limits::default(),
            view,
            budget_bytes: DEFAULT_BUDGET_BYTES,
            draws: Draws::default(),
            role: Role::Viewer,
            connection: Connection::new(address, now_s),
            session_number: 0,
            session: None,
            closing: false,
            decoder,
            next: None,
            is_uploading: false,
            held: Held::default(),
            held_session: 0,
            resume: None,
            eye: None,
            began_at: None,
            welcome: None,
            scene_clock: None,
            trips: RoundTrips::default(),
            motion: MotionEstimator::default(),
            tracks: Tracks::default(),
            staged: Staged::default(),
            presenter: None,
            inventory: Inventory::default(),
            advanced_to_s: f64::NEG_INFINITY,
            bytes: 0,
            updates: 0,
            figures: Figures::default(),
        }
    }

    /// What the held copy may take of this machine's memory, in bytes, from the next session on.
    pub fn with_budget(self, budget_bytes: u64) -> Viewer {
        Viewer { budget_bytes, ..self }
    }

    /// What is drawn, and so wanted, from the next session on.
    pub fn with_draws(self, draws: Draws) -> Viewer {
        Viewer { draws, ..self }
    }

    /// What is drawn, and so wanted, from now on.
    pub fn set_draws(&mut self, draws: Draws, now_s: f64) {
        self.draws = draws;
        self.session.iter_mut().for_each(|session| session.set_draws(draws, now_s));
    }

    /// How surfaces are built beside the drawing, of updates that come from now on; none before. What was uploaded so far is uploaded anew, as whoever draws may be another.
    pub fn set_build(&mut self, build: Build) {
        self.decoder.set_build(build);
        self.next.iter_mut().for_each(|next| next.built.forget_uploads());
    }

    /// What it is there for, from the next session on.
    pub fn with_role(self, role: Role) -> Viewer {
        Viewer { role, ..self }
    }

    /// Where the eye is at first, instead of where the server says.
    pub fn with_eye(self, world_from_eye: Rigid) -> Viewer {
        Viewer { eye: Some(world_from_eye), ..self }
    }

    /// Takes what the socket reports.
    pub fn handle(&mut self, event: SocketEvent, now_s: f64) {
        match event {
            SocketEvent::Opened => {
                self.connection.opened(now_s);
                self.begin_session(now_s);
            }
            SocketEvent::Message(bytes) => {
                self.bytes += bytes.len() as u64;
                self.figures.received(bytes.len(), now_s);
                if let Some(session) = &mut self.session {
                    let result = session.handle(&bytes, now_s);
                    self.after_session(result, now_s);
                }
            }
            SocketEvent::Closed(said) => {
                self.session = None;
                self.connection.ended(Ended::Closed(said), now_s);
            }
        }
    }

    /// Virtual clock: takes a message off the socket; `deliver(sent_at_s, bytes)` gives its time of arrival.
    pub fn receive_virtual(&mut self, bytes: Vec<u8>, now_s: f64, deliver: impl FnOnce(f64, usize) -> f64) {
        if let Some(session) = &mut self.session {
            let result = session.receive_virtual(bytes, deliver);
            self.after_session(result, now_s);
        }
    }

    /// Virtual clock: takes in what arrived up to `now_s`.
    pub fn run_until(&mut self, now_s: f64) {
        if let Some(session) = &mut self.session {
            let result = session.run_until(now_s);
            self.after_session(result, now_s);
        }
    }

    /// Virtual clock: asks the server to run up to `to_s`.
    pub fn request_advance(&mut self, to_s: f64) {
        if let Some(session) = &mut self.session {
            session.advance(to_s);
        }
    }

    /// Virtual clock: the server has run up to this time.
    pub fn advanced_to_s(&self) -> f64 {
        self.advanced_to_s
    }

    fn begin_session(&mut self, now_s: f64) {
        self.session_number += 1;
        let Viewer { budget_bytes, draws, .. } = *self;
        let role = self.role.clone();
        self.began_at = self.eye.filter(|_| self.role.is_asking());
        let (world_from_eye, resume) = (self.began_at, self.resume.filter(|_| self.role.is_asking()));
        let config = ClientConfig {
            budget_bytes,
            draws,
            role,
            world_from_eye,
            resume,
            staging: self.staged.staging.clone(),
            ..ClientConfig::new(self.clock, self.view)
        };
        self.session = Some(ClientSession::new(config, now_s));
        self.trips = RoundTrips::default();
        self.advanced_to_s = f64::NEG_INFINITY;
        self.bytes = 0;
        self.updates = 0;
    }

    fn after_session(&mut self, result: Result<(), SessionError>, now_s: f64) {
        let shown_s = self.scene_time_now_s(now_s);
        let mut is_anew = false;
        let Some(session) = &mut self.session else { return };
        while let Some(event) = session.poll_event() {
            match event {
                ClientEvent::Welcome(welcome) => {
                    self.connection.welcomed(now_s);
                    if welcome.resumed {
                        self.held_session = self.session_number;
                        self.resume.iter_mut().for_each(|resume| resume.secret = welcome.secret);
                    } else {
                        self.resume = None;
                        is_anew = true;
                    }
                    self.welcome = Some(*welcome);
                    self.staged.forget_names();
                    // It may have changed since the greeting.
                    session.set_staging(&self.staged.staging, now_s);
                    // The server learns the pose anew.
                    self.motion = MotionEstimator::default();
                }
                ClientEvent::Update(update) => self.decoder.push(self.session_number, update),
                ClientEvent::Presenter(world_from_eye, playback) => {
                    (self.presenter, self.staged.presented) = (Some(world_from_eye), Some(playback));
                }
                ClientEvent::Name { object, name } => self.staged.called(object, name),
                ClientEvent::Inventory(inventory) => self.inventory = inventory,
                ClientEvent::Advanced { to_s } => self.advanced_to_s = to_s,
            }
        }
        self.trips.sent(session.pose_seq(), now_s);
        if let Some(round_trip_s) = session.round_trip_s() {
            self.connection.measured(round_trip_s);
        }
        // What is shown stays, and its time, when a session ends.
        self.scene_clock = session.scene_clock().or(self.scene_clock);
        if is_anew {
            self.go_on_from(shown_s, now_s);
        }
        if let Err(error) = result {
            self.session = None;
            self.closing = true;
            let why = match error {
                SessionError::Goodbye { reason, again: true } => Ended::Goodbye(reason),
                SessionError::Goodbye { reason, again: false } => Ended::Refused(reason),
                SessionError::Silent { after_s } => Ended::Closed(format!("nothing heard for {after_s:.0} s")),
                // The same bytes would only break it again.
                other => {
                    self.resume = None;
                    Ended::Fault(other.to_string())
                }
            };
            self.connection.ended(why, now_s);
        }
    }

    /// What the socket must do next; ask until it is `None`.
    pub fn poll_socket(&mut self, now_s: f64) -> Option<SocketCommand> {
        self.poll_socket_stamped(now_s, |at_s, _| at_s)
    }

    /// As [`Viewer::poll_socket`]; on the virtual clock `stamp(made_at_s, bytes)` is when the emulated network delivers.
    pub fn poll_socket_stamped(&mut self, now_s: f64, stamp: impl FnOnce(f64, usize) -> f64) -> Option<SocketCommand> {
        if std::mem::take(&mut self.closing) {
            return Some(SocketCommand::Close);
        }
        if let Some(bytes) = self.session.as_mut().and_then(|session| session.poll_transmit_stamped(stamp)) {
            return Some(SocketCommand::Send(bytes));
        }
        match self.connection.poll(now_s)? {
            Command::Open => Some(SocketCommand::Open),
            Command::Close => {
                self.session = None;
                Some(SocketCommand::Close)
            }
        }
    }

    /// Where the eye is now; how it moves is told from its last poses. Call it once a frame, moved or not.
    pub fn set_pose(&mut self, world_from_eye: Rigid, now_s: f64) {
        self.set_steered_pose(world_from_eye, None, now_s);
    }

    /// The same of an eye that is known to move in a way, as controls may know.
    pub fn set_steered_pose(&mut self, world_from_eye: Rigid, known: Option<Motion>, now_s: f64) {
        if !self.role.is_asking() {
            return; // What it is sent does not depend on its eye.
        }
        let seen = self.motion.see(world_from_eye, now_s);
        self.eye = self.welcome.is_some().then_some(world_from_eye).or(self.eye);
        let Some(session) = self.session.as_mut().filter(|session| session.is_open()) else { return };
        session.set_pose(world_from_eye, known.filter(Motion::is_valid).unwrap_or(seen), now_s);
        self.trips.sent(session.pose_seq(), now_s);
    }

    /// The output's size or field of view changed.
    pub fn set_view(&mut self, view: ViewSize, now_s: f64) {
        self.view = view;
        if let Some(session) = self.session.as_mut().filter(|session| session.is_open()) {
            session.set_view(view, now_s);
        }
    }

    /// How the scene is put before it from the next session on.
    pub fn with_staging(mut self, staging: Staging) -> Viewer {
        self.staged.staging = staging;
        self
    }

    /// How the scene is put before it.
    pub fn staging(&self) -> &Staging {
        &self.staged.staging
    }

    /// Has the scene put before it so from now on; not as none is, and not for who follows.
    fn put(&mut self, staging: Staging, now_s: f64) {
        let is_valid = staging.playback.is_valid() && staging.excerpt.is_valid();
        if !is_valid || matches!(self.role, Role::Follower(_)) {
            return;
        }
        self.staged.staging = staging;
        if let Some(session) = self.session.as_mut().filter(|session| session.is_open()) {
            session.set_staging(&self.staged.staging, now_s);
        }
    }

    /// How the scene moves by itself; not at all before Welcome.
    pub fn scene_motion(&self) -> SceneMotion {
        self.welcome.as_ref().map_or(SceneMotion::Still, |welcome| welcome.motion)
    }

    /// How scene time goes: who follows goes by the presenter's.
    pub fn playback(&self) -> Playback {
        match self.role {
            Role::Follower(_) => self.staged.presented.unwrap_or_default(),
            _ => self.staged.staging.playback,
        }
    }

    /// Scene time goes on so many times as fast from now on; 0 stops it.
    pub fn play(&mut self, rate: f64, now_s: f64) {
        let moves = self.scene_motion() != SceneMotion::Still;
        if let Some(server_s) = self.server_time_now_s(now_s).filter(|_| moves) {
            let playback = self.playback().at_rate(rate.clamp(0.0, Playback::FASTEST), server_s);
            self.put(Staging { playback, ..self.staging().clone() }, now_s);
        }
    }

    /// Scene time is this one now, in seconds.
    pub fn seek(&mut self, scene_time_s: f64, now_s: f64) {
        if let Some(server_s) = self.server_time_now_s(now_s) {
            let playback = self.playback().from(scene_time_s, server_s);
            self.put(Staging { playback, ..self.staging().clone() }, now_s);
        }
    }

    /// Shows these parts alone from now on.
    pub fn show_parts(&mut self, parts: Parts, now_s: f64) {
        let Staging { playback, excerpt } = self.staging().clone();
        self.put(Staging { playback, excerpt: Excerpt { parts, ..excerpt } }, now_s);
    }

    /// Cuts the scene open from now on, or no longer.
    pub fn cut(&mut self, section: Option<Section>, now_s: f64) {
        let Staging { playback, excerpt } = self.staging().clone();
        self.put(Staging { playback, excerpt: Excerpt { section, ..excerpt } }, now_s);
    }

    /// What an object is called, which is asked where it is not known; `None` until there is an answer.
    pub fn name_of(&mut self, object: u16, now_s: f64) -> Option<String> {
        let session = self.session.as_mut().filter(|session| session.is_open())?;
        self.staged.name_of(object, || session.ask_name(object, now_s))
    }

    /// The server's clock may have begun anew: the scene goes on from where it was, in seconds.
    fn go_on_from(&mut self, scene_time_s: Option<f64>, now_s: f64) {
        let goes_otherwise = self.staging().playback != Playback::default();
        if let Some(scene_time_s) = scene_time_s.filter(|_| goes_otherwise) {
            self.seek(scene_time_s, now_s);
        }
    }

    /// Asks the server what it makes for this client, see [`Viewer::inventory`].
    pub fn ask_inventory(&mut self, now_s: f64) {
        if let Some(session) = self.session.as_mut().filter(|session| session.is_open()) {
            session.ask(now_s);
        }
    }

    /// What the server makes for this client, and what it leaves out, as it said last; nothing before.
    pub fn inventory(&self) -> &Inventory {
        &self.inventory
    }

    /// Does what is due, and uploads what was built of decoded updates and applies them until `budget_s` is spent (at least a piece, or one that is whole). Returns whether
    /// the picture changed.
    pub fn advance(&mut self, follower: &mut dyn Follow, now_s: f64, budget_s: f64) -> bool {
        if self.clock == Clock::Wall
            && let Some(session) = &mut self.session
        {
            let result = session.handle_timeout(now_s);
            self.after_session(result, now_s);
        }
        let begin = web_time::Instant::now();
        let mut changed = false;
        while let Some(mut next) = self.next.take().or_else(|| self.decoder.poll()) {
            self.is_uploading = !follower.upload(&mut next.built);
            let waits = !self.is_uploading && !follower.is_ready();
            if self.is_uploading || waits {
                self.next = Some(next);
            } else {
                changed |= self.take_in(next, follower, now_s);
            }
            if waits || begin.elapsed().as_secs_f64() >= budget_s {
                break;
            }
        }
        changed
    }

    /// Whether [`Viewer::advance`] has more to upload before the picture changes.
    pub fn is_uploading(&self) -> bool {
        self.is_uploading
    }

    fn take_in(&mut self, mut decoded: Decoded, follower: &mut dyn Follow, now_s: f64) -> bool {
        let Some(session) = self.session.as_mut().filter(|_| decoded.session == self.session_number) else {
            return false;
        };
        self.figures.decoded(decoded.decode_ms);
        // On the virtual clock decoding takes no time: the update is held from its arrival on.
        let held_at_s = if self.clock == Clock::Virtual { decoded.arrived_at_s } else { now_s };
        let anew = decoded.head.clears || self.held_session != self.session_number;
        let applied = decoded.result.and_then(|update| {
            let applied = if self.held_session == self.session_number {
                self.held.apply_within(&update, &self.limits)
            } else {
                // The old copy, and with it the picture, stays until the new session has something to show.
                let mut held = Held::default();
                held.apply_within(&update, &self.limits).map(|()| self.held = held)
            };
            applied.map(|()| update).map_err(|error| error.to_string())
        });
        match applied {
            Ok(update) => {
                self.held_session = self.session_number;
                session.applied(update.number, update.digest, held_at_s);
                let secret = self.welcome.as_ref().map_or(0, |welcome| welcome.secret);
                self.resume = Some(Resume { secret, number: update.number, digest: update.digest });
                self.updates += 1;
                self.figures.arrived(decoded.bytes, decoded.decode_ms, now_s);
                // Others' poses are not answered here.
                if self.role.is_asking() {
                    self.trips.answered(update.pose_seq);
                }
                if anew {
                    self.tracks.clear();
                }
                self.tracks.follow(&self.held.poses_now, self.held.scene_time_s, &update.next);
                follower.follow(&self.held, &update, anew, &mut decoded.built);
                true
            }
            Err(error) => {
                log_broken(&error);
                self.resume = None;
                session.broken(held_at_s);
                false
            }
        }
    }

    /// A picture of what is held was drawn; `None` where a time is not known.
    pub fn drawn(&mut self, now_s: f64, surface_ms: Option<f64>, light_ms: Option<f64>) {
        self.figures.drawn(now_s, surface_ms, light_ms);
        if self.has_picture() {
            self.trips.shown(now_s);
        }
    }

    /// Nothing is to be drawn now, so that the next picture is not late.
    pub fn rests(&mut self) {
        self.figures.history.rests();
    }

    /// The last minute, as far as [`Viewer::stats`] was asked for then.
    pub fn history(&self) -> &History {
        &self.figures.history
    }

    /// The share of a picture that no sample covers was counted.
    pub fn set_uncovered_share(&mut self, share: f64) {
        self.figures.uncovered_share = Some(share);
    }

    /// What decoding took since this was last asked, in milliseconds.
    pub fn take_decode_ms(&mut self) -> f64 {
        self.figures.take_decode_ms()
    }

    /// Whether updates are decoded beside the drawing; see [`Decoder::is_beside`].
    pub fn decodes_beside(&self) -> bool {
        self.decoder.is_beside()
    }

    /// The held copy.
    pub fn held(&self) -> &Held {
        &self.held
    }

    /// What the server said at first; of the last session while there is none.
    pub fn welcome(&self) -> Option<&Welcome> {
        self.welcome.as_ref()
    }

    /// Where the presenter's eye is whom this viewer follows; `None` where it follows nobody, or none has come yet.
    pub fn presenter(&self) -> Option<Rigid> {
        self.presenter
    }

    /// What it is there for.
    pub fn role(&self) -> &Role {
        &self.role
    }

    /// Whether there is something to show.
    pub fn has_picture(&self) -> bool {
        self.held.number > 0
    }

    /// Whether something is held that the server made for a pose of this session, and not only for where the scene begins.
    pub fn has_answer(&self) -> bool {
        self.has_picture() && (!self.role.is_asking() || self.began_at.is_some() || self.trips.is_answered())
    }

    /// Whether the session is open.
    pub fn is_open(&self) -> bool {
        self.connection.is_working()
    }

    /// How far the first update is; `None` once there is a picture, or where none will come.
    pub fn progress(&self) -> Option<Progress> {
        if self.has_picture() || self.connection.is_refused() {
            return None;
        }
        let (bytes, of_bytes) = self.session.as_ref().map_or((0, 0), ClientSession::progress_bytes);
        Some(Progress { bytes, of_bytes })
    }

    /// What a person should know, or `None` while all is well.
    pub fn status(&self, now_s: f64) -> Option<String> {
        let waits = || match &self.role {
            Role::Follower(name) if self.is_open() && !self.has_picture() && self.presenter.is_none() => {
                Some(format!("waiting for {name} to present"))
            }
            _ => None,
        };
        self.connection.status(now_s).or_else(waits)
    }

    /// The server's reason not to let it in, however often it comes.
    pub fn refusal(&self) -> Option<&str> {
        self.connection.goodbye().filter(|_| self.connection.is_refused())
    }

    /// Whether it waits to connect again.
    pub fn is_waiting(&self) -> bool {
        self.connection.is_waiting()
    }

    /// Tries to connect now instead of waiting.
    pub fn retry_now(&mut self, now_s: f64) {
        self.connection.retry_now(now_s);
    }

    /// The server's clock now; `None` before Welcome.
    fn server_time_now_s(&self, now_s: f64) -> Option<f64> {
        self.scene_clock.map(|clock| clock.scene_time_s(now_s))
    }

    /// Scene time now; `None` before Welcome.
    pub fn scene_time_now_s(&self, now_s: f64) -> Option<f64> {
        self.server_time_now_s(now_s).map(|server_s| self.playback().scene_time_s(server_s))
    }

    /// What is shown now: rigid objects not only where the last update left them, see [`Tracks`].
    pub fn moment_at(&self, now_s: f64) -> Moment {
        let scene_time_s = self.scene_time_now_s(now_s).unwrap_or(self.held.scene_time_s);
        let changes = self.scene_motion() != SceneMotion::Still;
        Moment { scene_time_s, changes, world_from_objects: self.tracks.at(scene_time_s) }
    }

    /// How long ago what is shown was so; `None` while nothing is shown, and where scene time stands.
    pub fn age_ms(&self, now_s: f64) -> Option<f64> {
        let rate = self.playback().rate;
        let shown = (self.has_picture() && rate > 0.0).then_some(self.held.scene_time_s)?;
        self.scene_time_now_s(now_s).map(|now| (now - shown) / rate * 1e3)
    }

    /// The last round trip of a pose to its picture.
    pub fn round_trip_ms(&self) -> Option<f64> {
        self.trips.last_s().map(|round_trip_s| round_trip_s * 1e3)
    }

    /// Bytes of messages that have arrived in this session.
    pub fn bytes_received(&self) -> u64 {
        match (self.clock, &self.session) {
            (Clock::Virtual, Some(session)) => session.bytes_received_and_sent().0,
            _ => self.bytes,
        }
    }

    /// The panel's figures.
    pub fn stats(&mut self, now_s: f64) -> Stats {
        let ping_ms = self.session.as_ref().and_then(ClientSession::round_trip_s).map(|s| s * 1e3);
        let others = Stats {
            bytes_received: self.bytes_received(),
            round_trip_ms: self.round_trip_ms(),
            ping_ms,
            samples: samples_of_surfaces(&self.held) as u64,
            patches: self.held.patches.len(),
            age_ms: self.age_ms(now_s).map(|age_ms| age_ms.max(0.0)),
            update_interval_s: self.welcome.as_ref().map(|welcome| welcome.update_interval_s),
            scene: self.welcome.as_ref().map_or_else(String::new, |welcome| welcome.scene_name.clone()),
            updates: self.updates,
            ..Stats::default()
        };
        self.figures.with(others, now_s)
    }
}

#[cfg(not(target_arch = "wasm32"))]
fn log_broken(error: &str) {
    tracing::warn!("an update was refused, the copy begins anew: {error}");
}

/// A browser has no log that a person reads; the panel's figures go on.
#[cfg(target_arch = "wasm32")]
fn log_broken(_: &str) {}

/// Pixels of the images of bodies are no samples of surfaces.
fn samples_of_surfaces(held: &Held) -> usize {
    let of_bodies = held.bodies.keys().filter_map(|id| held.patches.get(id));
    held.sample_count() - of_bodies.map(|held| held.patch.image.sample_count()).sum::<usize>()
}
