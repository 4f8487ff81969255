//! One client of a scene, driven tick by tick without a network: every update goes through the wire's bytes into a copy of
//! its own, which must agree with the server's.

use std::sync::Arc;

use camera::{Motion, Rigid};
use glam::DVec3;
use gpu::Gpu;
use protocol::message::ViewSize;
use protocol::wire::{decode_update, encode_update};
use protocol::{DepthImage, Edit, Held, Limits, ObjectPose, Update};
use scene::Scene;
use vantage_server::Config;
use vantage_server::account::Counts;
use vantage_server::client::Client;
use vantage_server::config::ComparesOn;
use vantage_server::discretize::Discretization;
use vantage_server::frame::{Made, Stage};
use vantage_server::imager::GpuImager;
use vantage_server::impostors::relief::Judged;
use vantage_server::plan::{PARALLAX_ERROR_PX, Reason, Rules};
use vantage_server::pool::Pool;
use vantage_server::start::{near_m, start_pose};
use vantage_server::viewer::Viewer;

use super::witness::Witness;

pub const VIEW: ViewSize = ViewSize { width_px: 96, height_px: 96, fov_y_rad: 1.2 };
/// Ten updates a second.
pub const INTERVAL_S: f64 = 0.1;
pub const TICKS_PER_S: usize = 10;

/// See the module.
pub struct Session {
    pub stage: Stage,
    pub client: Client,
    pub viewer: Viewer,
    pub held: Held,
    pub now_s: f64,
    /// Of all updates so far.
    pub sent_bytes: usize,
    /// Of these, what is for lights.
    pub light_bytes: usize,
    pub scene: Arc<Scene>,
    pub gpu: Gpu,
    pub rules: Rules,
    seq: u64,
}

impl Session {
    /// A viewer at the origin who looks along -z, with a walker's margin.
    pub fn new(scene: Scene) -> Session {
        Session::at_origin(scene, 3, 96)
    }

    /// The same with smaller images, and `images` of them at most: for long runs.
    pub fn small(scene: Scene, images: usize) -> Session {
        Session::at_origin(scene, images, 64)
    }

    fn at_origin(scene: Scene, images: usize, image_size_px: u32) -> Session {
        let rules = Rules {
            images,
            image_size_px,
            update_interval_s: INTERVAL_S,
            near_m: 0.1,
            margin_m: 0.25,
            animated: scene.is_animated(),
            rests: false,
            anticipates: false,
            parallax_error_px: PARALLAX_ERROR_PX,
        };
        Session::starting(scene, Rigid::look_along(DVec3::ZERO, DVec3::NEG_Z), rules)
    }

    /// A viewer where a built-in scene begins, served as a server would.
    pub fn built_in(name: &str) -> Session {
        Session::with_rests(name, false)
    }

    /// The same; who stands still is sent his own view.
    pub fn resting(name: &str) -> Session {
        Session::with_rests(name, true)
    }

    /// A viewer where a built-in scene begins, who is sent what he will need next while he needs nothing.
    pub fn anticipating(name: &str) -> Session {
        let mut session = Session::with_rests(name, false);
        let rules = Rules { anticipates: true, ..session.rules };
        let imager = Box::new(GpuImager::new(&session.gpu, &session.scene, &Config::default()).expect("it uploads"));
        session.stage = Stage::new(session.scene.clone(), rules, Discretization::default(), imager);
        Session { rules, ..session }
    }

    fn with_rests(name: &str, rests: bool) -> Session {
        let scene = scene::builtin::load(name).expect("a built-in scene");
        let rules = Rules {
            images: 3,
            image_size_px: 64,
            update_interval_s: INTERVAL_S,
            near_m: near_m(&scene),
            margin_m: Rules::margin_m(scene.walk, scene.bounds.radius_m()),
            animated: scene.is_animated(),
            rests,
            anticipates: false,
            parallax_error_px: PARALLAX_ERROR_PX,
        };
        let start = start_pose(&scene);
        Session::starting(scene, start, rules)
    }

    fn starting(scene: Scene, start: Rigid, rules: Rules) -> Session {
        let gpu = super::gpu();
        let scene = Arc::new(scene);
        let imager = Box::new(GpuImager::new(&gpu, &scene, &Config::default()).expect("the scene uploads"));
        Session {
            stage: Stage::new(scene.clone(), rules, Discretization::default(), imager),
            client: Client::default(),
            viewer: Viewer::at_start(VIEW, start, 0.0),
            held: Held::default(),
            now_s: 0.0,
            sent_bytes: 0,
            light_bytes: 0,
            scene,
            gpu,
            rules,
            seq: 0,
        }
    }

    /// The same by a server that compares views on the GPU, whatever that is.
    pub fn comparing_on_gpu(self) -> Session {
        let config = Config { compares_on: ComparesOn::Gpu, ..Config::default() };
        let imager = Box::new(GpuImager::new(&self.gpu, &self.scene, &config).expect("the scene uploads"));
        Session { stage: Stage::new(self.scene.clone(), self.rules, Discretization::default(), imager), ..self }
    }

    /// The same by a server that sends what bones bend as it is.
    pub fn with_bodies(self) -> Session {
        Session { stage: self.stage.with_bodies(), ..self }
    }

    /// The same by a server that shows many objects of a shape by one image.
    pub fn with_reliefs(self) -> Session {
        self.with_reliefs_judged(Judged::AtOnce)
    }

    /// The same, whose shapes are judged at a time.
    pub fn with_reliefs_judged(self, judged: Judged) -> Session {
        Session { stage: self.stage.with_reliefs(judged), ..self }
    }

    /// The same by a server that shares what it does.
    pub fn sharing(self, pool: Arc<Pool>) -> Session {
        Session { stage: self.stage.sharing(pool), ..self }
    }

    /// A pause in which nobody waits; whether there was work to do.
    pub fn pause(&mut self) -> bool {
        self.stage.work_aside().expect("it draws")
    }

    /// One update, where there is one, and an interval's time.
    pub fn tick(&mut self) -> Option<Made> {
        let made = self.stage.update(&self.viewer, &mut self.client, self.now_s).expect("an update");
        let made =
            made.or_else(|| self.stage.anticipate(&self.viewer, &mut self.client, self.now_s).expect("an update"));
        self.now_s += INTERVAL_S;
        if let Some(made) = &made {
            self.take(made);
        }
        made
    }

    fn take(&mut self, made: &Made) {
        let encoded = encode_update(&made.update, made.coding);
        self.light_bytes += encoded.bytes_of(made.lights.edits.clone());
        let bytes = encoded.bytes;
        if made.reason == Reason::Ahead {
            self.client.ahead.sent(bytes.len(), made.pixels);
        }
        self.sent_bytes += bytes.len();
        let update = decode_update(&bytes, &Limits::default()).expect("a sound update");
        assert_finite(&update, self.rules.near_m);
        self.held.apply(&update).expect("the digest agrees");
        let account = self.client.account.held();
        assert_eq!((self.held.digest(), self.held.number), (account.digest(), account.number));
        assert!(self.held.patches == account.patches && self.held.poses_now == account.poses_now);
        assert!(self.held.instances == account.instances);
    }

    /// Some ticks; what those that made an update did.
    pub fn ticks(&mut self, count: usize) -> Vec<Counts> {
        (0..count).filter_map(|_| self.tick()).map(|made| made.counts).collect()
    }

    /// The viewer is somewhere, and says how fast it goes along a line.
    pub fn hear(&mut self, pose: Rigid, velocity_world: DVec3) {
        self.hear_motion(pose, Motion::along(velocity_world));
    }

    /// The viewer is somewhere, and says how it moves on.
    pub fn hear_motion(&mut self, pose: Rigid, motion: Motion) {
        self.seq += 1;
        self.viewer.hear(self.seq, self.now_s, pose, motion, self.now_s);
    }

    /// The viewer stands somewhere and looks along -z.
    pub fn stand_at(&mut self, eye: DVec3) {
        self.hear(Rigid::look_along(eye, DVec3::NEG_Z), DVec3::ZERO);
    }

    /// A walk to another place at an even pace, one tick a step; what each step did.
    pub fn walk_to(&mut self, target: Rigid, steps: usize) -> Vec<Counts> {
        let from = self.viewer.world_from_eye;
        let velocity = (target.translation - from.translation) / (steps as f64 * INTERVAL_S);
        let mut all = Vec::new();
        for step in 1..=steps {
            let share = step as f64 / steps as f64;
            let pose = Rigid {
                rotation: from.rotation.slerp(target.rotation, share).normalize(),
                translation: from.translation.lerp(target.translation, share),
            };
            self.hear(pose, if step == steps { DVec3::ZERO } else { velocity });
            all.extend(self.tick().map(|made| made.counts));
        }
        all
    }

    /// Ticks until nothing lacks; what was done.
    pub fn settle(&mut self) -> Vec<Counts> {
        let mut all = Vec::new();
        for _ in 0..20 {
            match self.tick() {
                Some(made) => all.push(made.counts),
                None if self.client.focus.is_some_and(|focus| focus.settled) => return all,
                None => {}
            }
        }
        panic!("the viewer stands still, but edits go on: {all:?}");
    }

    /// The client lost its copy, and is served anew with the same account.
    pub fn start_anew(&mut self) {
        self.client.start_anew();
        self.held = Held::default();
    }

    /// The client comes back as another session.
    pub fn reconnect(&mut self) {
        self.client = Client { budget_bytes: self.client.budget_bytes, ..Client::default() };
        self.held = Held::default();
    }

    /// Somebody who sees both the scene and the copy.
    pub fn witness(&self) -> Witness {
        Witness::new(&self.gpu, &self.scene, self.rules.near_m)
    }
}

/// Samples that updates added.
pub fn added(counts: &[Counts]) -> usize {
    counts.iter().map(|counts| counts.added).sum()
}

/// Every number that an update carries; lights and tables, which are small, by what they print as.
fn assert_finite(update: &Update, near_m: f64) {
    assert!(update.scene_time_s.is_finite());
    let finite = |poses: &[ObjectPose]| poses.iter().all(|pose| pose.world_from_object.is_finite());
    for edit in &update.edits {
        let sound = match edit {
            Edit::Add(patch) => {
                patch.capture_time_s.is_finite() && finite(&patch.objects) && has_sound_depths(&patch.image, near_m)
            }
            Edit::Move(poses) => finite(poses),
            Edit::Shift(_) => true,
            Edit::Materials(_) | Edit::Light(_) | Edit::Sky(_) => {
                // A light may reach without end.
                let text = format!("{edit:?}").replace("range_m: inf", "");
                !text.contains("NaN") && !text.contains("inf")
            }
            Edit::Place(_, instances) => instances.iter().all(|instance| finite(&[instance.pose])),
            Edit::Body(_, body) => body.is_whole(),
            Edit::Clear | Edit::Remove(_) | Edit::Delete(..) | Edit::Trim(..) | Edit::Withdraw(_) | Edit::Join(_) => {
                true
            }
        };
        assert!(sound, "a number that is not finite: {edit:?}");
    }
}

/// Every sample lies between the nearest distance that is drawn and the far end of f32.
fn has_sound_depths(image: &DepthImage, near_m: f64) -> bool {
    let nearest = 1.001 / near_m as f32;
    image.camera.is_valid() && image.depth.iter().map(|&code| image.depth_scale.w(code)).all(|w| w > 0.0 && w < nearest)
}
