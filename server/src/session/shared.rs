//! What all sessions of a scene share, and what all scenes of a server do.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};

use bytes::Bytes;
use glam::DVec3;
use protocol::message::{Clock, VERSION, Welcome};
use protocol::staging::SceneMotion;
use scene::Scene;
use tokio::sync::{Notify, Semaphore, watch};

use super::end::Over;
use super::kept::{KeptSessions, SceneNumber};
use super::link::SessionClock;
use crate::audience::Audiences;
use crate::config::Config;
use crate::frame::Stage;
use crate::imager::Imager;
use crate::impostors::relief::Judged;
use crate::inventories::Inventories;
use crate::limits::ServerLimits;
use crate::plan::{self, Rules};
use crate::pool::Pool;
use crate::stats::Stats;
use crate::worker::Worker;
use crate::{memory, start, thumbnail};

/// How many threads look for what clients lack.
struct Looking {
    /// At most: each keeps its own targets on the GPU, some 60 MB with images of 512 pixels.
    most: usize,
    /// Cores for each of them.
    cores: usize,
}

/// Where the processor compares: that takes several cores at a time, and so does a software renderer. On two cores a second thread made 7 % more updates for a
/// third more processor time.
const COMPARING_HERE: Looking = Looking { most: 4, cores: 2 };
/// Where the GPU does, and a thread waits for it for a part of its time.
const COMPARING_ON_GPU: Looking = Looking { most: 16, cores: 1 };

/// What all scenes of a server share.
#[derive(Clone)]
pub struct House {
    /// What it counts.
    pub stats: Arc<Stats>,
    /// One permit a session.
    pub places: Arc<Semaphore>,
    /// Told when a session has ended, and when what was kept of one is dropped.
    pub ended: Arc<Notify>,
    /// Sessions that were cut off.
    pub kept: KeptSessions,
    /// Scenes that were opened.
    opened: Arc<AtomicU64>,
}

impl House {
    /// Empty.
    pub fn new(limits: &ServerLimits) -> House {
        let ended = Arc::<Notify>::default();
        House {
            stats: Arc::default(),
            places: Arc::new(Semaphore::new(limits.clients)),
            kept: KeptSessions::new(limits.resume, ended.clone()),
            ended,
            opened: Arc::default(),
        }
    }
}

/// What all sessions of a scene share.
pub struct Shared {
    /// The server's options.
    pub config: Config,
    /// What it shows.
    pub scene: Arc<Scene>,
    /// What draws it, for people.
    pub adapter: String,
    /// What it shares with other scenes.
    pub house: House,
    /// What was drawn of it.
    pub pool: Arc<Pool>,
    /// What makes updates.
    pub worker: Worker,
    /// Who follows whom.
    pub audiences: Arc<Audiences>,
    /// Among all scenes that were opened.
    pub(super) number: SceneNumber,
    sessions: AtomicUsize,
    /// A small picture of it, where people choose among scenes.
    pub(crate) thumbnail: Option<Bytes>,
    /// What is made for each session.
    pub(crate) plans: Inventories,
    pub(super) rules: Rules,
    pub(super) camera_names: Arc<[String]>,
    welcome: Welcome,
    over: watch::Sender<Option<Over>>,
    pub(super) clock: SessionClock,
}

impl Shared {
    /// Starts the worker for a scene, and what gives back what it keeps for others.
    pub fn open(
        config: Config,
        scene: Arc<Scene>,
        mut imager: Box<dyn Imager>,
        house: House,
    ) -> std::io::Result<Arc<Shared>> {
        let thumbnail = if config.thumbnails { thumbnail::of(&scene, &mut *imager) } else { None };
        let rules = Rules {
            images: config.images,
            image_size_px: config.image_size_px,
            update_interval_s: 1.0 / config.update_hz,
            near_m: start::near_m(&scene),
            margin_m: Rules::margin_m(scene.walk, scene.bounds.radius_m()),
            animated: scene.is_animated(),
            rests: config.rest,
            anticipates: config.anticipation && !scene.is_animated(),
            parallax_error_px: plan::PARALLAX_ERROR_PX,
        };
        let pool = Arc::<Pool>::default();
        let adapter = imager.adapter();
        // On the virtual clock drawing and coding take no time, and a trace begins with the first picture: the set.
        let stage = Stage::new(scene.clone(), rules, config.discretization, imager)
            .coded_by(config.coding)
            .placed(config.placement)
            .coarse_first(config.clock == Clock::Wall)
            .shed_load(config.clock == Clock::Wall);
        let judged = if config.clock == Clock::Wall { Judged::Aside } else { Judged::AtOnce };
        let stage = if config.relief { stage.with_reliefs(judged) } else { stage };
        let stage = if config.bodies { stage.with_bodies() } else { stage };
        // Nor does it matter there what was drawn before.
        let mut stage = if config.clock == Clock::Wall { stage.sharing(pool.clone()) } else { stage };
        // On the virtual clock every run is the same, whatever the machine.
        let threads = if stage.compares_on_hardware() { COMPARING_ON_GPU } else { COMPARING_HERE };
        let cores = std::thread::available_parallelism().map_or(1, usize::from);
        let looking = if config.clock == Clock::Wall { (cores / threads.cores).clamp(1, threads.most) } else { 1 };
        let twins = std::iter::from_fn(|| stage.twin()).take(looking - 1).collect::<Vec<_>>();
        let worker = Worker::start(std::iter::once(stage).chain(twins).collect(), house.stats.clone())?;
        let welcome = welcome(&scene, &config, &rules);
        let camera_names = scene.named_cameras.iter().map(|named| named.name.clone()).collect();
        let number = house.opened.fetch_add(1, Ordering::Relaxed);
        tokio::spawn(memory::give_back_unasked(Arc::downgrade(&pool)));
        Ok(Arc::new(Shared {
            config,
            scene,
            adapter,
            house,
            pool,
            worker,
            audiences: Arc::default(),
            thumbnail: thumbnail.map(Bytes::from),
            number,
            sessions: AtomicUsize::new(0),
            plans: Inventories::default(),
            rules,
            camera_names,
            welcome,
            over: watch::Sender::default(),
            clock: SessionClock::at(0.0),
        }))
    }

    /// Tells all sessions that they are over, now and of those to come. Nobody comes back to what was kept of others.
    pub(crate) fn end(&self, over: Over) {
        self.over.send_replace(Some(over));
        self.house.kept.forget_all(self.number);
    }

    /// One more session.
    pub(super) fn enter(&self) -> Present<'_> {
        self.sessions.fetch_add(1, Ordering::Relaxed);
        Present(&self.sessions)
    }

    /// Sessions now.
    pub(crate) fn session_count(&self) -> usize {
        self.sessions.load(Ordering::Relaxed)
    }

    /// Whether anybody is here, or may come back.
    pub(crate) fn is_wanted(&self) -> bool {
        self.session_count() > 0 || self.house.kept.has_some_of(self.number)
    }

    /// Said to every client, but for the time.
    pub fn welcome(&self) -> &Welcome {
        &self.welcome
    }

    /// Tells when all sessions are over.
    pub(crate) fn over(&self) -> watch::Receiver<Option<Over>> {
        self.over.subscribe()
    }

    /// Seconds since the server started: scene time and session time under the wall clock.
    pub fn now_s(&self) -> f64 {
        self.clock.now_s()
    }
}

fn motion(scene: &Scene) -> SceneMotion {
    match scene.animation.period_s() {
        _ if !scene.is_animated() => SceneMotion::Still,
        Some(period_s) => SceneMotion::Loop { period_s },
        None => SceneMotion::Endless,
    }
}

fn welcome(scene: &Scene, config: &Config, rules: &Rules) -> Welcome {
    let bounds = if scene.bounds.is_empty() { [DVec3::ZERO; 2] } else { [scene.bounds.min, scene.bounds.max] };
    Welcome {
        version: VERSION,
        scene_name: scene.name.clone(),
        bounds_min_world: bounds[0].to_array(),
        bounds_max_world: bounds[1].to_array(),
        start_world_from_eye: start::start_pose(scene),
        walk: scene.walk,
        near_m: rules.near_m,
        look: config.look,
        update_interval_s: rules.update_interval_s,
        scene_time_s: 0.0,
        motion: motion(scene),
        secret: 0,
        resumed: false,
    }
}

/// A session of a scene as long as it is there.
pub(super) struct Present<'a>(&'a AtomicUsize);

impl Drop for Present<'_> {
    fn drop(&mut self) {
        self.0.fetch_sub(1, Ordering::Relaxed);
    }
}
