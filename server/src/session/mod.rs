//! One client's connection: the socket, the sans-IO session, and the turns it takes at the worker.
//!
//! What all sessions of a scene share is [`Shared`], and what all scenes of a server share is [`House`]; each runs as one task until it ends for one of the reasons of `End`, which
//! makes one log line that names the client. A session that ends takes nothing else with it.

mod audit;
pub(crate) mod end;
pub mod kept;
pub(crate) mod link;
mod outlet;
mod resume;
mod shared;
mod virtual_clock;
mod wall_clock;

use std::convert::Infallible;
use std::future::Future;
use std::pin::Pin;
use std::sync::{Arc, Mutex, PoisonError};

use axum::extract::ws::WebSocket;
use protocol::message::{Clock, Role, Welcome};
use protocol::session::{ServerConfig, ServerEvent, SessionError};
use tokio::sync::oneshot;

use crate::account::Account;
use crate::asked::Asked;
use crate::audience::{Following, Presenting};
use crate::client::Client;
use crate::host::Guest;
use crate::plan;
use crate::viewer::Viewer;
use crate::worker::{Made, NotServed, Served, Wish};
use crate::{anticipate, rest};
use end::End;
pub(crate) use end::Over;
use kept::{GiveWay, Name};
use link::{Counted, Link, ended, refuse};
pub use shared::{House, Shared};

/// How often the scene may be put before a client otherwise, in seconds: as often as a slider that is dragged asks for it.
const STAGED_EVERY_S: f64 = 0.1;
/// A virtual session hears nothing while its client works through a step of its own time.
const VIRTUAL_SILENCE_S: f64 = 300.0;

/// One session while it runs.
struct Connection<'a> {
    shared: &'a Shared,
    link: Link<'a>,
    /// Read by the worker when this session's turn comes.
    viewer: Arc<Mutex<Viewer>>,
    /// Away while a turn is taken.
    client: Option<Box<Client>>,
    /// The client asked to begin anew while the copy was away.
    start_anew: bool,
    /// Server time when the scene was put before the client otherwise; negative infinity before.
    staged_at_s: f64,
    /// While others may follow this session.
    presenting: Option<Arc<Presenting>>,
    /// A follower's, until it begins.
    following: Option<Following>,
    /// At the worker.
    turn: Option<Turn<'a>>,
    name: Name,
    /// Told when another connection goes on with the session.
    give_way: oneshot::Receiver<GiveWay>,
}

type Turn<'a> = Pin<Box<dyn Future<Output = Result<Served, NotServed>> + Send + 'a>>;

/// Runs a session until it ends. A fault of its own ends it, and nothing else.
pub(crate) async fn run(shared: &Shared, socket: WebSocket, guest: Guest) {
    let _present = shared.enter();
    let counted = Counted::new(&shared.house.stats, &shared.house.ended);
    // On the virtual clock every run is the same, and nobody is cut off.
    let begun = match shared.config.clock {
        Clock::Wall => shared.house.kept.begin(shared.number),
        Clock::Virtual => Ok((Name::default(), oneshot::channel().1)),
    };
    let (name, give_way) = match begun {
        Ok(begun) => begun,
        Err(error) => return refuse(socket, &format!("the server has no random bytes: {error}"), true).await,
    };
    let clock = shared.config.clock;
    let scene_time_s = if clock == Clock::Wall { shared.now_s() } else { 0.0 };
    let limits = &shared.config.limits;
    let config = ServerConfig {
        greeting_s: limits.hello.as_secs_f64(),
        silence_s: if clock == Clock::Wall { limits.silence.as_secs_f64() } else { VIRTUAL_SILENCE_S },
        stall_s: limits.stall.as_secs_f64(),
        cameras: shared.camera_names.clone(),
        ..ServerConfig::new(clock, Welcome { scene_time_s, secret: name.secret, ..shared.welcome().clone() })
    };
    let view = protocol::message::ViewSize { width_px: 1, height_px: 1, fov_y_rad: 1.0 };
    let (terms, stats, number) = ((shared.clock, limits.stall), &shared.house.stats, counted.number);
    let mut connection = Connection {
        shared,
        link: Link::new(socket, (number, guest), config, terms, shared.over(), stats),
        viewer: Arc::new(Mutex::new(Viewer::at_start(view, shared.welcome().start_world_from_eye, scene_time_s))),
        client: Some(Box::default()),
        start_anew: false,
        staged_at_s: f64::NEG_INFINITY,
        presenting: None,
        following: None,
        turn: None,
        name,
        give_way,
    };
    let end = ended(connection.run(), stats).await;
    shared.plans.end(number);
    let end = ended(async { Err(connection.leave(end).await) }, stats).await;
    if matches!(end, End::Fault) {
        shared.house.kept.forget(&connection.name);
    }
    connection.link.farewell(end).await;
}

impl Connection<'_> {
    async fn run(&mut self) -> Result<Infallible, End> {
        match self.shared.config.clock {
            Clock::Wall => self.run_on_wall_clock().await,
            Clock::Virtual => self.run_on_virtual_clock().await,
        }
    }

    /// Takes in an event other than `Advance`.
    fn event(&mut self, event: ServerEvent) -> Result<(), End> {
        let mut viewer = self.viewer.lock().unwrap_or_else(PoisonError::into_inner);
        match event {
            ServerEvent::Opened => {
                if let Some(view) = self.link.session.view() {
                    viewer.view = view;
                    if let Some(world_from_eye) = self.link.session.start_world_from_eye() {
                        *viewer = Viewer::at_start(view, world_from_eye, self.shared.now_s());
                    }
                    let budget_bytes = self.link.session.budget_bytes().min(self.shared.config.limits.budget_bytes);
                    let (draws, staging) = (self.link.session.draws(), self.link.session.staging());
                    let cameras = &self.shared.scene.named_cameras;
                    let asked = self.link.session.camera().and_then(|place| cameras.get(place));
                    self.client.iter_mut().for_each(|client| {
                        client.budget_bytes = budget_bytes;
                        client.set_draws(draws);
                        client.stage(staging);
                        client.asked = asked.map(|named| Asked::of(named.camera.clone()));
                    });
                    tracing::debug!(peer = %self.link.peer, "opened with {}x{} pixels", view.width_px, view.height_px);
                }
                drop(viewer);
                self.link.take_place(&self.shared.house.places, self.shared.config.limits.clients)?;
                self.take_seat()?;
            }
            ServerEvent::Resume(_) => {}
            ServerEvent::View(view) => viewer.view = view,
            ServerEvent::Draws => {
                let draws = self.link.session.draws();
                self.client.iter_mut().for_each(|client| client.set_draws(draws));
            }
            ServerEvent::Stages => {
                drop(viewer);
                self.tell_followers();
            }
            ServerEvent::Pose => {
                if let Some(pose) = self.link.session.pose() {
                    viewer.hear(pose.seq, pose.sampled_at_s, pose.world_from_eye, pose.motion, pose.received_at_s);
                    drop(viewer);
                    self.tell_followers();
                }
            }
            ServerEvent::Acked { .. } => {
                viewer.round_trip_s = self.link.session.round_trip_s().unwrap_or(0.0);
                viewer.bytes_per_s = self.link.session.throughput_bytes_per_s();
                viewer.queue_s = self.link.session.queue_s();
                viewer.one_way_s = self.link.session.one_way_s().unwrap_or(0.0);
                viewer.taken_s = self.link.session.taken_s().unwrap_or(0.0);
            }
            ServerEvent::Restart => {
                tracing::info!(peer = %self.link.peer, "the client's copy is broken: starting anew");
                match &mut self.client {
                    Some(client) => client.start_anew(),
                    None => self.start_anew = true,
                }
            }
            ServerEvent::Inventory => {
                drop(viewer);
                let inventory = self.shared.plans.of(self.link.number);
                self.link.session.tell(&inventory.unwrap_or_default(), self.shared.now_s());
            }
            ServerEvent::AskName { object } => {
                drop(viewer);
                let name = self.shared.scene.instances.get(usize::from(object)).map_or("", |instance| &instance.name);
                self.link.session.name(object, name, self.shared.now_s());
            }
            ServerEvent::Advance { .. } => {}
        }
        Ok(())
    }

    /// Tells who follows where this session's eye is, and how its time goes.
    fn tell_followers(&self) {
        if let (Some(presenting), Some(pose)) = (&self.presenting, self.link.session.pose()) {
            presenting.look_from(pose.world_from_eye, self.link.session.staging().playback, pose.received_at_s);
        }
    }

    /// Takes the place in an audience that the client greeted for.
    fn take_seat(&mut self) -> Result<(), End> {
        let audiences = &self.shared.audiences;
        match self.link.session.role() {
            Role::Viewer | Role::Camera(_) => {}
            Role::Follower(name) => {
                tracing::info!(peer = %self.link.peer, "follows {name:?}");
                self.following = Some(audiences.follow(name));
                self.client = None;
            }
            Role::Presenter(name) => {
                let taken = || SessionError::Presented { name: name.clone() };
                let presenting = audiences.present(name).ok_or_else(taken)?;
                tracing::info!(peer = %self.link.peer, "presents as {name:?}");
                let last = presenting.last();
                if last > 0 {
                    self.client.iter_mut().for_each(|client| client.account = Account::after(last));
                }
                self.presenting = Some(Arc::new(presenting));
            }
        }
        Ok(())
    }

    fn viewer(&self) -> Viewer {
        *self.viewer.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Has the scene put before the client as it asked for last, where its copy is here and that was not just done: each time it may begin anew.
    fn put_before(&mut self, now_s: f64) {
        let Some(client) = self.client.as_mut().filter(|_| now_s - self.staged_at_s >= STAGED_EVERY_S) else { return };
        if client.stage(self.link.session.staging()) {
            self.staged_at_s = now_s;
        }
    }

    /// What a turn at the worker would be for now; `None` where it would bring nothing. What will be needed next waits for all that is
    /// in flight, and in real time for all other sessions too.
    fn wish(&self, now_s: f64) -> Option<Wish> {
        let viewer = self.viewer();
        // What is made long before the path takes it shows what was.
        let is_soon = self.shared.config.clock == Clock::Virtual
            || self.link.session.frees_in_s(now_s) <= self.shared.rules.update_interval_s;
        let client = self.client.as_ref().filter(|_| is_soon && self.link.session.can_send_update())?;
        let rules = &client.rules(&self.shared.rules);
        if let Some(asked) = &client.asked {
            let is_due = asked.is_due(rules.animated, self.link.session.in_flight_and_window_bytes().0);
            return is_due.then_some(Wish::Now);
        }
        let lacks = plan::plan(rules, &viewer, now_s, client.focus.as_ref()).is_some()
            || rest::lacking(rules, client, &viewer, now_s).is_some();
        if lacks {
            return Some(Wish::Now);
        }
        let nobody_waits = self.shared.config.clock == Clock::Virtual || self.shared.worker.is_idle();
        let is_spare = nobody_waits && self.link.session.in_flight_and_window_bytes().0 == 0;
        (is_spare && anticipate::may(rules, client, &viewer, now_s)).then_some(Wish::Next)
    }

    /// Takes the client's account back from the worker and sends what was made.
    fn served(&mut self, served: Served, now_s: f64) {
        let Served { mut client, update } = served;
        if std::mem::take(&mut self.start_anew) {
            // What was made builds on a copy that the client no longer has.
            client.start_anew();
        } else if let Some(Made { update, reason, counts, light_bytes, look, encode }) = update {
            let (bytes, packed) = (update.bytes.len(), update.packed(now_s));
            match self.link.session.send_packed(&packed, now_s) {
                Ok(()) => {
                    if let Some(presenting) = &self.presenting {
                        presenting.publish(packed);
                    }
                    self.link.count_update();
                    tracing::debug!(
                        peer = %self.link.peer, reason = reason.name(), number = update.number, ?counts, bytes, light_bytes,
                        look_ms = look.as_millis() as u64, encode_ms = encode.as_millis() as u64, "update"
                    );
                }
                Err(error) => {
                    tracing::warn!(peer = %self.link.peer, "update {} not sent: {error}", update.number);
                    client.start_anew();
                }
            }
        }
        client.set_draws(self.link.session.draws());
        self.shared.plans.put(self.link.number, &client.inventory);
        self.client = Some(client);
    }
}
