//! The error of what reflectors show, along a path.

use std::time::Instant;

use camera::{Camera, Pinhole, Rigid, Trace};
use client::draw::impostors::{ImpostorImage, ImpostorKind, Impostors};
use client::draw::reflect::{EdgeRays, Search, Settings as Drawing};
use gpu::Gpu;
use protocol::codec::{Coding, encode_patch};
use protocol::held::{ObjectPose, Patch, PatchId};
use protocol::{DepthImage, Effect, Look};
use scene::Scene;
use serde_json::json;
use server::discretize::{DepthPrecision, Discretization, Discretizer, depth_images};
use server::impostors::draw::{ImpostorDrawer, Subject};
use server::impostors::{Choices, Needs, Rule, Shot, Wanted};

use super::settings::Settings;
use crate::client_view::{ClientView, HeldSet};
use crate::compare::Picture;
use crate::raytrace::{Effects, RayTruth, TracedPicture, masked_errors, reflectors};
use crate::report::progress::Progress;
use crate::report::{Report, Row};
use crate::spread::{Better, Spread};
use crate::stage::Stage;
use crate::topic::Run;

/// Poses of a path follow each other after this time.
const POSE_S: f64 = 0.1;
/// Rays of a pixel of the truth, squared: clients average colours over what a pixel shows.
pub(super) const TRUTH_RAYS_A_SIDE: u32 = 3;
const FOV_Y_RAD: f64 = std::f64::consts::FRAC_PI_3;
/// How often sizes are corrected on the way to equal bytes: bytes grow nearly with pixels, so each leaves a few percent of what was off.
const EQUAL_BYTES_TRIES: usize = 3;

/// Where a viewer looks from, and when.
pub(super) struct Path {
    poses: Vec<(f64, Rigid)>,
}

impl Path {
    /// `count` poses spread evenly over a recorded trace, over the path that belongs to a built-in scene, or over an orbit.
    pub fn of(scene: &Scene, trace: Option<Trace>, count: usize) -> Path {
        let trace = trace.or_else(|| scene::builtin::reflection_path(&scene.name));
        let Some(trace) = trace else {
            let rows = crate::poses::orbit(scene, (16, 9), FOV_Y_RAD);
            let step = rows.len() as f64 / count as f64;
            let pose = |index: usize| (0.0, rows[(index as f64 * step) as usize % rows.len()].world_from_eye);
            return Path { poses: (0..count).map(pose).collect() };
        };
        let length_s = (trace.poses.len().max(1) - 1) as f64 * POSE_S;
        let at = |index: usize| if count > 1 { length_s * index as f64 / (count - 1) as f64 } else { 0.0 };
        Path { poses: (0..count).map(|index| (at(index), trace.at(at(index)))).collect() }
    }

    /// The scene time and the view of each pose.
    pub fn views(&self, scene: &Scene, size_px: (u32, u32)) -> impl Iterator<Item = (f64, Pinhole)> {
        let near_m = server::start::near_m(scene);
        let is_animated = scene.is_animated();
        self.poses.iter().map(move |&(time_s, world_from_eye)| {
            let view = Pinhole::symmetric(world_from_eye, size_px, FOV_Y_RAD, near_m);
            (if is_animated { time_s } else { 0.0 }, view)
        })
    }
}

/// What reflections are drawn from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Images {
    /// What the server decides.
    Decided,
    /// What it decides where nobody tells of a scene's corridors.
    Planned,
    /// By a rule, untried; [`Rule::Plain`] are conventional depth images, the surroundings as a cube.
    By(Rule),
}

/// A way to draw reflections.
#[derive(Debug, Clone, Copy)]
pub(super) struct Method {
    pub name: &'static str,
    pub images: Images,
    pub search: Search,
    /// Whether edges get more rays.
    pub edges: bool,
    /// Whether images are made larger or smaller, until they cost what is decided costs.
    pub equal_bytes: bool,
}

pub(super) const DECIDED: &str = "non-pinhole";
pub(super) const PINHOLES: &str = "depth images";
/// For scenes that tell of their corridors.
pub(super) const PLANNED: &str = "non-pinhole, own floor plan";
pub(super) const MAPS: &str = "environment map";

/// What may be decided, at the bytes of what is.
pub(super) const CANDIDATES: [&str; 4] = [
    "at equal bytes: six images",
    "at equal bytes: six images, bent",
    "at equal bytes: depth images of objects",
    "at equal bytes: past silhouettes",
];

pub(super) const METHODS: [Method; 12] = [
    Method::new(DECIDED, Images::Decided, Search::Whole),
    Method::new("non-pinhole, steps of 1/2", Images::Decided, Search::Half),
    Method::new("non-pinhole, steps of 1/4", Images::Decided, Search::Quarter),
    Method::new(PINHOLES, Images::By(Rule::Plain), Search::Whole),
    Method::new(MAPS, Images::By(Rule::Plain), Search::EnvironmentMap),
    Method::new("non-pinhole, five rays at edges", Images::Decided, Search::Whole).with_edges(),
    Method::new("depth images, five rays at edges", Images::By(Rule::Plain), Search::Whole).with_edges(),
    Method::new(PLANNED, Images::Planned, Search::Whole),
    Method::new(CANDIDATES[0], Images::By(Rule::Around), Search::Whole).at_equal_bytes(),
    Method::new(CANDIDATES[1], Images::By(Rule::Bent), Search::Whole).at_equal_bytes(),
    Method::new(CANDIDATES[2], Images::By(Rule::Plain), Search::Whole).at_equal_bytes(),
    Method::new(CANDIDATES[3], Images::By(Rule::Finest), Search::Whole).at_equal_bytes(),
];

impl Method {
    const fn new(name: &'static str, images: Images, search: Search) -> Method {
        Method { name, images, search, edges: false, equal_bytes: false }
    }

    const fn with_edges(self) -> Method {
        Method { edges: true, ..self }
    }

    const fn at_equal_bytes(self) -> Method {
        Method { equal_bytes: true, ..self }
    }
}

/// The impostors of a pose, ready for a client, and what they took.
pub(super) struct Made {
    pub images: Vec<(Wanted, ImpostorImage)>,
    pub draw_ms: f64,
    pub bytes: usize,
}

/// Makes what clients would be sent.
pub(super) struct Maker {
    needs: Needs,
    choices: Choices,
    /// As if nobody had told of the scene's corridors.
    planned: Needs,
    planned_choices: Choices,
    drawer: ImpostorDrawer,
}

impl Maker {
    pub fn new(stage: &Stage) -> anyhow::Result<Maker> {
        let of = |scene: &Scene| if stage.sky().is_some() { Needs::under_sky(scene) } else { Needs::new(scene) };
        let needs = of(&stage.scene);
        let planned = of(&Scene { corridors: None, ..stage.scene.clone() });
        let none = Choices::default();
        let drawer = ImpostorDrawer::new(&stage.renderer)?;
        Ok(Maker { needs, choices: none.clone(), planned, planned_choices: none, drawer })
    }

    pub fn make(&mut self, stage: &Stage, view: &Pinhole, images: Images) -> anyhow::Result<Made> {
        self.make_by(stage, view, images, Camera::clone)
    }

    /// The same, all larger or smaller, until they cost `bytes` within two percent, or have the sizes that come next to it.
    pub fn make_of_bytes(
        &mut self,
        stage: &Stage,
        view: &Pinhole,
        images: Images,
        bytes: usize,
    ) -> anyhow::Result<Made> {
        let mut share = 1.0;
        let mut made = self.make(stage, view, images)?;
        for _ in 0..EQUAL_BYTES_TRIES {
            let ratio = bytes as f64 / made.bytes.max(1) as f64;
            if (ratio - 1.0).abs() < 0.02 {
                break;
            }
            share *= ratio.sqrt();
            made = self.make_by(stage, view, images, |camera| super::sizes::scaled(camera, share))?;
        }
        Ok(made)
    }

    /// The same, each by another camera.
    pub fn make_by(
        &mut self,
        stage: &Stage,
        view: &Pinhole,
        images: Images,
        by: impl Fn(&Camera) -> Camera,
    ) -> anyhow::Result<Made> {
        let eye_world = view.world_from_eye.translation;
        let (scene, snapshot) = (&stage.scene, stage.snapshot());
        let drawer = &mut self.drawer;
        let mut draw = |shot: &Shot<'_>| -> anyhow::Result<Option<DepthImage>> {
            let subject = Subject { objects: &|object| shot.drawn.contains(object), faces: shot.faces };
            Ok(Some(drawer.draw(&stage.renderer, shot.camera, subject)?.depth_image(DepthPrecision::Finest)))
        };
        let decision = match images {
            Images::Decided => {
                self.needs.choose((scene, snapshot), eye_world, &mut self.choices, &mut draw)?;
                self.needs.decide(scene, snapshot, eye_world, &self.choices)
            }
            Images::Planned => {
                self.planned.choose((scene, snapshot), eye_world, &mut self.planned_choices, &mut draw)?;
                self.planned.decide(scene, snapshot, eye_world, &self.planned_choices)
            }
            Images::By(rule) => {
                self.needs.clone().with_rule(rule).decide(scene, snapshot, eye_world, &Choices::default())
            }
        };
        let mut made = Made { images: Vec::new(), draw_ms: 0.0, bytes: 0 };
        for (wanted, number) in decision.wanted.into_iter().zip(1..) {
            let camera = by(&wanted.camera);
            let started = Instant::now();
            let Some(image) = draw(&Shot { camera: &camera, ..wanted.shot() })? else { continue };
            made.draw_ms += started.elapsed().as_secs_f64() * 1e3;
            let objects = wanted.key.shown.filter(|&object| stage.scene.instances[usize::from(object)].moves);
            let pose = |object: u16| ObjectPose {
                object,
                world_from_object: stage.snapshot().world_from_mesh[usize::from(object)],
            };
            let patch = Patch {
                id: PatchId(number),
                purpose: wanted.purpose,
                capture_time_s: 0.0,
                objects: objects.into_iter().map(pose).collect(),
                image,
            };
            made.bytes += encode_patch(&patch, Coding::default()).len();
            if let Some(image) = ImpostorImage::of_patch(&patch) {
                made.images.push((wanted, image));
            }
        }
        Ok(made)
    }
}

/// Puts images up; `but` leaves out those of an object.
pub(super) fn put_up(gpu: &Gpu, made: &Made, but: Option<u16>) -> anyhow::Result<Impostors> {
    let mut impostors = Impostors::new(gpu);
    for (id, (_, image)) in (0..).zip(&made.images) {
        if but.is_none_or(|object| image.kind != ImpostorKind::Object(object)) {
            impostors.insert(id, image)?;
        }
    }
    Ok(impostors)
}

/// What a client sees of a scene without any error but reflections': a conventional image of the very view.
pub(super) fn held_view(gpu: &Gpu, stage: &Stage, view: &Pinhole) -> anyhow::Result<HeldSet> {
    let mut discretizer = Discretizer::new(&stage.renderer)?;
    let captures = discretizer.run(&stage.renderer, &[*view], Discretization::Conventional)?.wait()?;
    let images = depth_images(&captures, DepthPrecision::Finest);
    HeldSet::new(gpu, &images, (stage.renderer.materials(), &stage.lighting))
}

/// Errors and costs of a method, a value a pose.
#[derive(Default)]
struct Found {
    error: Vec<f64>,
    p95: Vec<f64>,
    /// Over all that reflects.
    reflecting: Vec<f64>,
    /// Where the first mirrored ray meets what does not reflect.
    first_order: Vec<f64>,
    /// Where it meets another reflector.
    second_order: Vec<f64>,
    /// The share of pixels that reflect.
    shares: Vec<f64>,
    frame_ms: Vec<f64>,
    draw_ms: Vec<f64>,
    bytes: Vec<f64>,
    pixels: f64,
}

impl Found {
    /// Adds a pose's errors over all that reflects, by how often the traced ray was reflected.
    fn by_order(&mut self, traced: &TracedPicture, result: &[[u8; 3]], reflecting: &[u16]) -> anyhow::Result<()> {
        let on_reflector = traced.mask(reflecting);
        let of = |is_order: fn(u8) -> bool| -> Vec<bool> {
            on_reflector.iter().zip(&traced.bounces).map(|(on, bounces)| *on && is_order(*bounces)).collect()
        };
        let orders =
            [(of(|bounces| bounces == 1), &mut self.first_order), (of(|bounces| bounces > 1), &mut self.second_order)];
        for (mask, errors) in orders {
            errors.extend(masked_errors(&traced.rgb, result, &mask, &mask)?.map(|spread| spread.mean));
        }
        let over_all = masked_errors(&traced.rgb, result, &on_reflector, &on_reflector)?;
        self.reflecting.extend(over_all.map(|spread| spread.mean));
        let count = on_reflector.iter().filter(|on| **on).count();
        self.shares.push(count as f64 / on_reflector.len() as f64);
        Ok(())
    }
}

/// The object whose reflection is looked at: that which rules would send an image past the silhouette of; `None` where they send none, or
/// all of the surroundings count.
fn subject_of(stage: &Stage, view: &Pinhole) -> Option<u16> {
    let eye_world = view.world_from_eye.translation;
    let needs = Needs::new(&stage.scene);
    let decision = needs.decide(&stage.scene, stage.snapshot(), eye_world, &Choices::default());
    let is_object = |wanted: &&Wanted| matches!(wanted.camera, Camera::Spoc(_)) && stage.scene.corridors.is_none();
    decision.wanted.iter().find(is_object).and_then(|wanted| wanted.key.shown)
}

/// Draws every method at every pose, and compares.
pub(super) fn measure(
    gpu: &Gpu,
    scene: &Scene,
    path: &Path,
    settings: &Settings,
    run: &Run,
    report: &mut Report,
) -> anyhow::Result<()> {
    let mut stage = Stage::new(gpu, scene.clone(), Look::Plain)?;
    let label = scene.name.clone();
    let mut maker = Maker::new(&stage)?;
    let mut client = ClientView::new(gpu, settings.size_px)?;
    let progress = Progress::new(format!("{label}: reflections"), path.poses.len() as u64);
    // One ray a pixel is asked for, or nobody tells of corridors anyway: then some would say the same again.
    let is_other = |method: &&Method| {
        (method.images != Images::Planned || scene.corridors.is_some())
            && !(method.edges && settings.one_ray)
            && (!settings.few_methods || [DECIDED, PINHOLES, MAPS].contains(&method.name))
    };
    let methods: &'static [Method] = &METHODS;
    let mut found: Vec<(&Method, Found)> = methods.iter().filter(is_other).map(|m| (m, Found::default())).collect();
    let mut truth: Option<(f64, RayTruth)> = None;
    let reflecting = reflectors(scene);
    let mut decided_bytes = 0;
    for (pose, (time_s, view)) in path.views(scene, settings.size_px).enumerate() {
        stage.show(time_s, view.world_from_eye.translation)?;
        if truth.as_ref().is_none_or(|(shown_s, _)| *shown_s != time_s) {
            truth = Some((time_s, RayTruth::new(scene, stage.snapshot(), &stage.lighting)));
        }
        let Some((_, tracer)) = &truth else { continue };
        let effects = Effects { max_bounces: 2, ..Effects::ONE_BOUNCE };
        let traced = tracer.picture(&view, &effects, if settings.one_ray { 1 } else { TRUTH_RAYS_A_SIDE });
        let subject = subject_of(&stage, &view);
        let held = held_view(gpu, &stage, &view)?;
        let mut pictures = vec![("traced", traced.picture())];
        for (method, found) in &mut found {
            let made = if method.equal_bytes {
                maker.make_of_bytes(&stage, &view, method.images, decided_bytes)?
            } else {
                maker.make(&stage, &view, method.images)?
            };
            if method.name == DECIDED {
                decided_bytes = made.bytes;
            }
            let options = client::draw::frame::Options {
                fill: false,
                reflect: Drawing {
                    search: method.search,
                    filter: !settings.one_ray,
                    edges: if method.edges { EdgeRays::Always } else { EdgeRays::Never },
                    ..Drawing::default()
                },
                ..Default::default()
            };
            let impostors = put_up(gpu, &made, None)?;
            let drawn = client.frame_reflecting(&held, Some(&impostors), &view, options)?;
            let without = match subject {
                Some(object) => {
                    let impostors = put_up(gpu, &made, Some(object))?;
                    Some(client.frame_reflecting(&held, Some(&impostors), &view, options)?.picture)
                }
                None => None,
            };
            let masks = masks(&traced, &drawn.picture, without.as_ref(), subject, &reflecting);
            let result: Vec<[u8; 3]> = drawn.picture.rgb.as_chunks().0.to_vec();
            if let Some(spread) = masked_errors(&traced.rgb, &result, &masks.0, &masks.1)? {
                found.error.push(spread.mean);
                found.p95.push(spread.p95);
                found.pixels += spread.count as f64;
            }
            found.by_order(&traced, &result, &reflecting)?;
            found.frame_ms.push(drawn.frame_ms);
            found.draw_ms.push(made.draw_ms);
            found.bytes.push(made.bytes as f64);
            pictures.push((method.name, drawn.picture));
        }
        if pose == path.poses.len() / 2 {
            show(&label, &pictures, run, report)?;
        }
        progress.step();
    }
    for (method, found) in found {
        report.rows.push(row(&label, method, scene, &found));
    }
    Ok(())
}

/// Where the truth, and where the result, shows the object in question: of the result, what changes without its image; or all of
/// the reflector.
fn masks(
    traced: &TracedPicture,
    drawn: &Picture,
    without: Option<&Picture>,
    subject: Option<u16>,
    reflecting: &[u16],
) -> (Vec<bool>, Vec<bool>) {
    let on_reflector = traced.mask(reflecting);
    let (Some(without), Some(subject)) = (without, subject) else {
        return (on_reflector.clone(), on_reflector);
    };
    let truth = traced.reflected_object.iter().zip(&on_reflector).map(|(object, on)| *on && *object == Some(subject));
    let differ = drawn.rgb.as_chunks::<3>().0.iter().zip(without.rgb.as_chunks::<3>().0).map(|(a, b)| a != b);
    (truth.collect(), differ.zip(&on_reflector).map(|(differ, on)| differ && *on).collect())
}

fn row(label: &str, method: &Method, scene: &Scene, found: &Found) -> Row {
    let mut row = Row::new(label, method.name);
    row.parameters.set("refracts", json!(Needs::new(scene).has(Effect::Glass)));
    row.parameters.set("graph_cameras", json!(scene.corridors.is_some()));
    let errors = [
        ("rgb", &found.error),
        ("rgb_p95", &found.p95),
        ("rgb_reflecting", &found.reflecting),
        ("rgb_first_order", &found.first_order),
        ("rgb_second_order", &found.second_order),
    ];
    for (name, values) in errors {
        if let Some(spread) = Spread::of(values, Better::Lower) {
            row.error.set(name, spread);
        }
    }
    for (name, values) in [("frame", &found.frame_ms), ("construction", &found.draw_ms)] {
        if let Some(spread) = Spread::of(values, Better::Lower) {
            row.time_ms.set(name, spread);
        }
    }
    row.bytes.set("impostors", found.bytes.iter().sum::<f64>() / found.bytes.len().max(1) as f64);
    row.counts.set("reflecting", found.shares.iter().sum::<f64>() / found.shares.len().max(1) as f64);
    row.counts.set("pixels", found.pixels / found.error.len().max(1) as f64);
    row
}

fn show(label: &str, pictures: &[(&str, Picture)], run: &Run, report: &mut Report) -> anyhow::Result<()> {
    let named = |name: &str| pictures.iter().find(|(of, _)| *of == name).map(|(_, picture)| picture);
    let shown: Vec<&Picture> = ["traced", DECIDED, PINHOLES, MAPS].into_iter().filter_map(named).collect();
    let caption = format!("{label}: traced; {DECIDED}; {PINHOLES}; {MAPS}.");
    let path = run.figure(report, format!("{label}-reflections.png"), caption);
    Ok(Picture::beside(&shown, 4).write(&path)?)
}
