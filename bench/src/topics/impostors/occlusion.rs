//! How steady ambient occlusion is while the eye moves, and how near the truth: from the view's own z-buffer, and with that of a
//! graph camera.
//!
//! Nothing moves but the eye, so a point's occlusion should not change. An eye goes round an object that is held as conventional images from
//! around; some hundred points of its surface are followed by the pixels that show them. What a point's occlusion spreads over the frames
//! that show it is the measure (*Non-pinhole approximations for interactive rendering*, section 6.3, names the flicker and
//! gives no figure). The truth is ray traced through the scene itself.

use std::f64::consts::TAU;

use camera::{ImagePoint, Pinhole, Rigid};
use client::draw::occlusion::{Occlusion, Settings};
use glam::DVec3;
use gpu::Gpu;
use protocol::{DepthImage, Look};
use scene::Scene;
use server::discretize::{Discretization, Discretizer};

use crate::client_view::{ClientView, HeldSet};
use crate::sets::{self, SetPlan};
use crate::stage::Stage;
use crate::topics::occlusion::points::{Point, bilinear, mean, points, shown_at, traced};

/// What is measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StabilityPlan {
    /// Of the frames.
    pub size_px: (u32, u32),
    /// Frames.
    pub poses: usize,
    /// How far the eye goes round in all of them, radians.
    pub arc_rad: f64,
    /// How far above the horizon it stands, radians.
    pub elevation_rad: f64,
    /// How far from the middle, in bounding radii.
    pub distance: f64,
    /// Conventional images that the client holds: two in three around, from above and level, and the rest from the top.
    pub images: usize,
    /// Side of each.
    pub image_px: u32,
    /// Reach of occlusion in bounding radii.
    pub reach: f64,
    /// As in [`Settings`].
    pub taps: u32,
    /// Surface points that are tried.
    pub points: usize,
}

impl StabilityPlan {
    /// What the report shows.
    pub const FULL: StabilityPlan = StabilityPlan {
        size_px: (512, 512),
        poses: 120,
        arc_rad: TAU / 4.0,
        elevation_rad: TAU / 15.0,
        distance: 2.0,
        images: 12,
        image_px: 512,
        reach: 0.2,
        taps: 128,
        points: 20_000,
    };
    /// What continuous integration can afford.
    pub const QUICK: StabilityPlan =
        StabilityPlan { size_px: (256, 256), poses: 24, image_px: 256, ..StabilityPlan::FULL };
}

/// What was found for one kind of occlusion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StabilityRow {
    /// Which.
    pub occlusion: Occlusion,
    /// Standard deviation of a point's share of ambient light over the frames that show it: mean over the points.
    pub deviation: f64,
    /// Difference of a point's mean share to the ray-traced one: mean of the absolutes over the points.
    pub error: f64,
    /// The same with its sign; positive: too bright.
    pub bias: f64,
    /// Median wall time of a frame, from encoding to the end of the GPU's work.
    pub frame_ms: f64,
}

/// What was found for a scene.
#[derive(Debug, Clone, PartialEq)]
pub struct StabilityTable {
    /// Points that at least nine in ten frames show.
    pub points: usize,
    /// Mean of the ray-traced shares.
    pub traced: f64,
    /// None, plain and graph; the first has no deviation and the error of full light everywhere.
    pub rows: Vec<StabilityRow>,
}

/// Share of the frames that must show a point.
const LEAST_SHOWN: f64 = 0.9;
/// Field of view of frames and images.
const FOV_Y_RAD: f64 = TAU / 6.0;

/// Measures a scene that stands still at its time 0.
pub fn stability(gpu: &Gpu, scene: Scene, plan: &StabilityPlan) -> anyhow::Result<StabilityTable> {
    let mut stage = Stage::new(gpu, scene, Look::default())?.with_rays();
    let centre = stage.scene.bounds.centre();
    stage.show(0.0, centre)?;
    let images = images(&stage, plan)?;
    let points = points(&images, plan.points);
    let set = HeldSet::new(gpu, &images, (stage.renderer.materials(), &stage.lighting))?;
    let views: Vec<Pinhole> = (0..plan.poses).map(|pose| view(&stage.scene, plan, pose)).collect();
    let shown = shown(gpu, &set, &views, &points, plan)?;
    let is_followed = |index: &usize| {
        shown.iter().filter(|frame| frame[*index].is_some()).count() as f64 >= LEAST_SHOWN * views.len() as f64
    };
    let followed: Vec<usize> = (0..points.len()).filter(is_followed).collect();
    anyhow::ensure!(!followed.is_empty(), "no point of {} is seen often enough", stage.scene.name);
    let reach_m = plan.reach * stage.scene.bounds.radius_m();
    let rays = stage.renderer.rays().expect("asked for above");
    let anchor_world = stage.renderer.anchor_world();
    let traced: Vec<f64> = followed.iter().map(|&index| traced(rays, anchor_world, &points[index], reach_m)).collect();
    let rows = [Occlusion::None, Occlusion::Plain, Occlusion::Graph].map(|occlusion| {
        let settings = Settings { occlusion, reach_m, taps: plan.taps };
        row(gpu, (&set, &views), settings, (&shown, &followed, &traced))
    });
    let rows = rows.into_iter().collect::<anyhow::Result<_>>()?;
    Ok(StabilityTable { points: followed.len(), traced: mean(traced.iter().copied()), rows })
}

/// The pose of a frame.
fn view(scene: &Scene, plan: &StabilityPlan, pose: usize) -> Pinhole {
    let share = (pose as f64 + 0.5) / plan.poses as f64 - 0.5;
    let yaw_rad = plan.arc_rad * share;
    around(scene, (yaw_rad, plan.elevation_rad, plan.distance), plan.size_px)
}

fn around(scene: &Scene, (yaw_rad, elevation_rad, distance): (f64, f64, f64), size_px: (u32, u32)) -> Pinhole {
    let (up, along) = elevation_rad.sin_cos();
    let out = DVec3::new(yaw_rad.sin() * along, up, yaw_rad.cos() * along);
    let centre = scene.bounds.centre();
    let eye = Rigid::look_at(centre + out * distance * scene.bounds.radius_m(), centre);
    Pinhole::symmetric(eye, size_px, FOV_Y_RAD, server::start::near_m(scene))
}

/// What the client holds.
fn images(stage: &Stage, plan: &StabilityPlan) -> anyhow::Result<Vec<DepthImage>> {
    let size_px = (plan.image_px, plan.image_px);
    let ring = plan.images * 2 / 3;
    let view = |index: usize| {
        let (count, place, elevation_rad) = match index.checked_sub(ring) {
            None => (ring, index, [TAU / 10.0, TAU / 36.0][index % 2]),
            Some(place) => (plan.images - ring, place, TAU / 5.0),
        };
        around(&stage.scene, (TAU * place as f64 / count as f64, elevation_rad, plan.distance), size_px)
    };
    let views: Vec<Pinhole> = (0..plan.images).map(view).collect();
    let set = SetPlan { discretization: Discretization::Conventional, images: plan.images, image_px: plan.image_px };
    let (_, precision) = sets::planned(&stage.scene, views[0].world_from_eye, &views[0], &set);
    let mut discretizer = Discretizer::new(&stage.renderer)?;
    Ok(sets::make(stage, &mut discretizer, &views, set.discretization, precision)?.images)
}

/// For each frame and point where the image shows it, where it does.
type Shown = Vec<Vec<Option<ImagePoint>>>;

fn shown(gpu: &Gpu, set: &HeldSet, views: &[Pinhole], points: &[Point], plan: &StabilityPlan) -> anyhow::Result<Shown> {
    let mut client = ClientView::new(gpu, plan.size_px)?;
    let mut frame = |view: &Pinhole| -> anyhow::Result<Vec<Option<ImagePoint>>> {
        let w = client.frame(set, view, Default::default())?.w;
        Ok(points.iter().map(|point| shown_at(point, view, &w)).collect())
    };
    views.iter().map(&mut frame).collect()
}

fn row(
    gpu: &Gpu,
    (set, views): (&HeldSet, &[Pinhole]),
    settings: Settings,
    (shown, followed, traced): (&Shown, &[usize], &[f64]),
) -> anyhow::Result<StabilityRow> {
    let mut client = ClientView::new(gpu, (views[0].width_px, views[0].height_px))?;
    client.set_occlusion(settings);
    let mut read: Vec<Vec<f64>> = vec![Vec::new(); followed.len()];
    let mut times_ms = Vec::with_capacity(views.len());
    for (view, shown) in views.iter().zip(shown) {
        times_ms.push(client.draw(set, view, Default::default())?);
        let shares = client.ambient_shares(view)?;
        for (read, &point) in read.iter_mut().zip(followed) {
            read.extend(shown[point].map(|image| bilinear(&shares, view, image)));
        }
    }
    times_ms.sort_by(f64::total_cmp);
    let means: Vec<f64> = read.iter().map(|values| mean(values.iter().copied())).collect();
    let deviation = |(values, middle): (&Vec<f64>, &f64)| mean(values.iter().map(|v| (v - middle).powi(2))).sqrt();
    let differences = || means.iter().zip(traced).map(|(mean, traced)| mean - traced);
    Ok(StabilityRow {
        occlusion: settings.occlusion,
        deviation: mean(read.iter().zip(&means).map(deviation)),
        error: mean(differences().map(f64::abs)),
        bias: mean(differences()),
        frame_ms: times_ms[times_ms.len() / 2],
    })
}
