//! A viewer who walks a loop and the same way back, served by the real stage, tick by tick, without a network.

use std::f64::consts::TAU;
use std::sync::Arc;
use std::time::Instant;

use camera::{Pinhole, Rigid, Trace};
use client::draw::impostors::Impostors;
use client::draw::layers::Layers;
use client::draw::light_images::LightImages;
use client::draw::occlusion;
use client::draw::shown::Shown;
use client::receive::follow::Follow;
use client::receive::viewer::MotionEstimator;
use glam::{DQuat, DVec3};
use gpu::Gpu;
use protocol::message::{Draws, Shadows, ViewSize};
use protocol::{Held, Limits, wire};
use scene::Scene;
use server::account::{AccountRules, Counts};
use server::client::Client;
use server::coding::CodingRule;
use server::discretize::Discretization;
use server::frame::Stage;
use server::imager::GpuImager;
use server::impostors::relief::Judged;
use server::plan::{PARALLAX_ERROR_PX, Rules};
use server::viewer::Viewer;
use surface::{BuiltSurfaces, Corners, HeldSurfaces};

use crate::client_view::HeldSet;
use crate::sets::{self, SetPlan};

/// Pace of a walking person.
pub const PACE_M_S: f64 = 1.4;
/// Ticks a second.
pub const UPDATE_HZ: f64 = 10.0;
/// The head turns by this much to both sides of the way, once in four seconds.
const SWING_RAD: f64 = 0.3;
/// A walker's loop stays within this distance of its middle.
const LOOP_RADIUS_M: f64 = 2.2;

/// A way out, and the same way back.
#[derive(Debug, Clone)]
pub struct Walk {
    /// Seconds out, and as many back.
    pub half_s: f64,
    way: Way,
}

#[derive(Debug, Clone)]
enum Way {
    Loop(Loop),
    /// As recorded, from its beginning on; its end is waited at.
    Trace(Trace),
}

impl Walk {
    /// Along `trace`, or along a loop in the scene.
    pub fn new(scene: &Scene, trace: Option<Trace>, half_s: f64) -> Walk {
        Walk { half_s, way: trace.map_or_else(|| Way::Loop(Loop::of(scene)), Way::Trace) }
    }

    /// The eye at `t_s`.
    pub fn at(&self, t_s: f64) -> Rigid {
        let out_s = if t_s <= self.half_s { t_s } else { 2.0 * self.half_s - t_s };
        match &self.way {
            Way::Loop(around) => around.at(out_s),
            Way::Trace(trace) => trace.at(out_s),
        }
    }
}

/// A loop in a scene: a circle on the ground, or around an object, looked along or at.
#[derive(Debug, Clone, Copy)]
struct Loop {
    centre_world: DVec3,
    radius_m: f64,
    turn_rad_s: f64,
    walk: bool,
    start_angle: f64,
}

impl Loop {
    /// The loop of a scene: in a scene to walk in from the place where a viewer begins, else around the object as seen from
    /// there, at a pace that takes a third of a round in ten seconds.
    fn of(scene: &Scene) -> Loop {
        let start = server::start::start_pose(scene);
        let forward = start.transform_vector(DVec3::Z);
        if scene.walk {
            let extent = scene.bounds.max - scene.bounds.min;
            let radius_m = LOOP_RADIUS_M.min(extent.x.min(extent.z) / 6.0);
            let right = forward.cross(DVec3::Y).normalize_or(DVec3::X);
            let centre_world = start.translation - right * radius_m;
            let out = right;
            let start_angle = out.x.atan2(out.z);
            return Loop { centre_world, radius_m, turn_rad_s: PACE_M_S / radius_m, walk: true, start_angle };
        }
        let centre = scene.bounds.centre();
        let out = start.translation - centre;
        Loop {
            centre_world: DVec3::new(centre.x, start.translation.y, centre.z),
            radius_m: DVec3::new(out.x, 0.0, out.z).length(),
            turn_rad_s: TAU / 30.0,
            walk: false,
            start_angle: out.x.atan2(out.z),
        }
    }

    fn at(&self, out_s: f64) -> Rigid {
        let angle = self.start_angle + self.turn_rad_s * out_s;
        let out = DVec3::new(angle.sin(), 0.0, angle.cos());
        let eye = self.centre_world + out * self.radius_m;
        if !self.walk {
            return Rigid::look_at(eye, self.centre_world);
        }
        let along = DVec3::new(angle.cos(), 0.0, -angle.sin());
        let swing = DQuat::from_rotation_y(SWING_RAD * (TAU * out_s / 4.0).sin());
        Rigid::look_along(eye, swing * along)
    }
}

/// What one tick cost.
#[derive(Debug, Clone, Copy, Default)]
pub struct Tick {
    /// Samples.
    pub counts: Counts,
    /// Coded, with everything.
    pub bytes: usize,
    /// Wall time of the server's look, without coding.
    pub look_ms: f64,
    /// Wall time of building what changed of the client's surfaces.
    pub build_ms: f64,
    /// Samples held afterwards.
    pub held: usize,
    /// Patches held afterwards.
    pub patches: usize,
}

/// How the server looks and codes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Setup {
    /// What is sent: what lacks, or every view anew.
    pub method: Discretization,
    /// Views of a look at most.
    pub images: usize,
    /// Server views have this many pixels squared.
    pub image_px: u32,
    /// The viewer's output is as large as this squared.
    pub output_px: u32,
    /// See [`Rules::parallax_error_px`].
    pub parallax_error_px: f64,
    /// What decides what is sent.
    pub rules: AccountRules,
    /// How samples are coded.
    pub coding: CodingRule,
    /// Whether objects of one shape are shown by one image.
    pub relief: bool,
    /// Which shadows the client says that it draws.
    pub shadows: Shadows,
    /// How far occluders reach that it says that it draws, in metres; 0: none.
    pub occlusion_reach_m: f64,
}

impl Setup {
    /// As a server does by itself.
    pub fn usual(image_px: u32) -> Setup {
        Setup {
            method: Discretization::default(),
            images: 4,
            image_px,
            output_px: image_px,
            parallax_error_px: PARALLAX_ERROR_PX,
            rules: AccountRules::default(),
            coding: CodingRule::default(),
            relief: false,
            shadows: Shadows::None,
            occlusion_reach_m: 0.0,
        }
    }
}

/// A server's stage and one client of it, whose copy is decoded from the bytes.
pub struct Walker {
    stage: Stage,
    client: Client,
    viewer: Viewer,
    /// The client's own copy, with its surfaces.
    pub set: HeldSet,
    /// Its images for rays.
    pub impostors: Impostors,
    /// What its lights see.
    pub lights: LightImages,
    /// What only occludes.
    pub occluders: HeldSurfaces,
    /// What is blended.
    pub layers: Layers,
    tick: u64,
    motion: MotionEstimator,
    last: Option<Rigid>,
}

impl Walker {
    /// A client of `scene` whose server views see about 90 degrees.
    pub fn new(gpu: &Gpu, scene: Arc<Scene>, setup: &Setup) -> anyhow::Result<Walker> {
        let &Setup { method, images, image_px, output_px, parallax_error_px, .. } = setup;
        let plan = SetPlan { discretization: method, images, image_px };
        let rules = Rules { update_interval_s: 1.0 / UPDATE_HZ, parallax_error_px, ..sets::rules(&scene, &plan) };
        let imager = Box::new(GpuImager::new(gpu, &scene, &server::Config::default())?);
        let start = server::start::start_pose(&scene);
        // With a turn's margin of 0.1 on each side the images see 90 degrees.
        let view = ViewSize { width_px: output_px, height_px: output_px, fov_y_rad: TAU / 4.0 - 0.2 };
        let stage = Stage::new(scene, rules, method, imager).judged_by(setup.rules).coded_by(setup.coding);
        let draws = Draws { shadows: setup.shadows, occlusion_reach_m: setup.occlusion_reach_m, ..Draws::default() };
        Ok(Walker {
            stage: if setup.relief { stage.with_reliefs(Judged::AtOnce) } else { stage },
            client: Client { draws, ..Client::default() },
            viewer: Viewer::at_start(view, start, 0.0),
            set: HeldSet::of(gpu, Held::default(), HeldSurfaces::new(gpu)),
            impostors: Impostors::new(gpu),
            lights: LightImages::new(gpu, Corners::default()),
            occluders: occlusion::occluders(gpu, Corners::default()),
            layers: Layers::new(gpu, Corners::default()),
            tick: 0,
            motion: MotionEstimator::default(),
            last: None,
        })
    }

    /// One tick with the eye at `pose`, at scene time `now_s`.
    pub fn tick(&mut self, pose: Rigid, now_s: f64) -> anyhow::Result<Tick> {
        self.tick += 1;
        let motion = self.motion.see(pose, now_s);
        if self.last != Some(pose) {
            self.viewer.hear(self.tick, now_s, pose, motion, now_s);
        }
        self.last = Some(pose);
        let started = Instant::now();
        let made = self.stage.update(&self.viewer, &mut self.client, now_s)?;
        let look_ms = started.elapsed().as_secs_f64() * 1000.0;
        let mut tick = Tick { look_ms, ..Tick::default() };
        if let Some(made) = made {
            let encoded = wire::encode_update(&made.update, made.coding);
            let update = wire::decode_update(&encoded.bytes, &Limits::default())?;
            let HeldSet { held, surfaces, build_ms, bodies } = &mut self.set;
            held.apply(&update)?;
            let started = Instant::now();
            surfaces.apply(held, &update);
            let built = &mut BuiltSurfaces::default();
            bodies.follow(held, &update, false, built);
            self.impostors.follow(held, &update, false, built);
            self.lights.follow(held, &update, false, built);
            self.occluders.follow(held, &update, false, built);
            self.layers.follow(held, &update, false, built);
            *build_ms = started.elapsed().as_secs_f64() * 1000.0;
            tick.build_ms = *build_ms;
            (tick.counts, tick.bytes) = (made.counts, encoded.bytes.len());
        } else {
            tick.counts = self.client.account.counts();
        }
        (tick.held, tick.patches) = (self.set.held.sample_count(), self.set.held.patches.len());
        Ok(tick)
    }

    /// All that the client shows.
    pub fn shown(&self) -> Shown<'_> {
        let (lights, occluders, layers) = (Some(&self.lights), Some(&self.occluders), Some(&self.layers));
        Shown { lights, occluders, layers, ..self.set.shown(Some(&self.impostors)) }
    }

    /// What a viewer sees from `pose`: 90 degrees less the margin.
    pub fn output(&self, pose: Rigid, near_m: f64) -> Pinhole {
        let view = self.viewer.view;
        Pinhole::symmetric(pose, (view.width_px, view.height_px), view.fov_y_rad, near_m)
    }
}
