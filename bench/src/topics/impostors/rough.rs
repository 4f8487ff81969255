//! Rough mirrors in the full look: what a client shows of what is near, beside rays, and beside the sky alone.

use camera::Pinhole;
use client::draw::frame::Options;
use client::draw::reflect::{Search, Settings as Drawing};
use gpu::Gpu;
use protocol::Look;
use scene::Scene;
use scene::environment::Environment;

use super::reflect::{Images, Maker, Path, TRUTH_RAYS_A_SIDE, held_view, put_up};
use super::settings::Settings;
use crate::client_view::ClientView;
use crate::compare::Picture;
use crate::compare::flip::error_picture;
use crate::compare::flip_map;
use crate::raytrace::{Effects, RayTruth, masked_errors};
use crate::report::progress::Progress;
use crate::report::{Bar, Report, Row};
use crate::spread::{Better, Spread};
use crate::stage::Stage;
use crate::topic::Run;

const NEAR: &str = "rough mirrors, rays of lobes";
const MAPS: &str = "rough mirrors, environment map";
const SKY: &str = "rough mirrors, sky alone";
/// How rays find what is near; not at all, by the sky alone.
pub(super) const METHODS: [(&str, Option<Search>); 3] =
    [(NEAR, Some(Search::Whole)), (MAPS, Some(Search::EnvironmentMap)), (SKY, None)];
/// Of the error of the sky alone, as the papers' claims have it of environment maps.
const BAR: f64 = 0.25;
const GAP_PX: u32 = 4;

#[derive(Default)]
struct Found {
    error: Vec<f64>,
    frame_ms: Vec<f64>,
    bytes: Vec<f64>,
}

/// Draws a scene with rough mirrors by every method at every pose.
pub(super) fn measure(
    gpu: &Gpu,
    scene: &Scene,
    path: &Path,
    settings: &Settings,
    run: &Run,
    report: &mut Report,
) -> anyhow::Result<()> {
    let mut stage = Stage::new(gpu, scene.clone(), Look::Full)?;
    let mut maker = Maker::new(&stage)?;
    let mut client = ClientView::new(gpu, settings.size_px)?;
    let label = scene.name.clone();
    let views: Vec<(f64, Pinhole)> = path.views(scene, settings.size_px).collect();
    let progress = Progress::new(format!("{label}: rough mirrors"), views.len() as u64);
    let mut found: [Found; METHODS.len()] = Default::default();
    let mut share = 0.0;
    for (pose, (time_s, view)) in views.iter().enumerate() {
        stage.show(*time_s, view.world_from_eye.translation)?;
        let rays = RayTruth::under(scene, stage.snapshot(), &stage.lighting, &Environment::studio());
        let traced = rays.picture(view, &Effects::ONE_BOUNCE, TRUTH_RAYS_A_SIDE);
        let mask: Vec<bool> = traced.bounces.iter().map(|&bounces| bounces > 0).collect();
        share += mask.iter().filter(|on| **on).count() as f64 / mask.len() as f64 / views.len() as f64;
        let mut held = held_view(gpu, &stage, view)?;
        held.held.sky = stage.sky().cloned();
        let mut pictures = vec![traced.picture()];
        for ((_, search), found) in METHODS.iter().zip(&mut found) {
            let made = search.map(|_| maker.make(&stage, view, Images::Decided)).transpose()?;
            let impostors = made.as_ref().map(|made| put_up(gpu, made, None)).transpose()?;
            let reflect = Drawing { search: search.unwrap_or(Search::Whole), ..Drawing::default() };
            let options = Options { fill: false, reflect, ..Options::default() };
            let drawn = client.frame_reflecting(&held, impostors.as_ref(), view, options)?;
            let result = drawn.picture.rgb.as_chunks().0;
            found.error.extend(masked_errors(&traced.rgb, result, &mask, &mask)?.map(|spread| spread.mean));
            found.frame_ms.push(drawn.frame_ms);
            found.bytes.push(made.map_or(0, |made| made.bytes) as f64);
            pictures.push(drawn.picture);
        }
        if pose == views.len() / 2 {
            show(&label, &pictures, run, report)?;
        }
        progress.step();
    }
    let rows = METHODS.iter().zip(&found).map(|((name, _), found)| row(&label, name, found, share));
    report.rows.extend(rows);
    let mean = |found: &Found| found.error.iter().sum::<f64>() / found.error.len().max(1) as f64;
    let what = format!("{label}: error over rough mirrors, a quarter of that of the sky alone");
    report.bars.push(Bar::at_most(what, BAR * mean(&found[2]), Some(mean(&found[0])), ""));
    Ok(())
}

fn row(label: &str, method: &str, found: &Found, share: f64) -> Row {
    let mut row = Row::new(label, method);
    if let Some(spread) = Spread::of(&found.error, Better::Lower) {
        row.error.set("rgb_reflecting", spread);
    }
    if let Some(spread) = Spread::of(&found.frame_ms, Better::Lower) {
        row.time_ms.set("frame", spread);
    }
    row.bytes.set("impostors", found.bytes.iter().sum::<f64>() / found.bytes.len().max(1) as f64);
    row.counts.set("reflecting", share);
    row
}

fn show(label: &str, pictures: &[Picture], run: &Run, report: &mut Report) -> anyhow::Result<()> {
    let [traced, ours, maps, sky] = pictures else { return Ok(()) };
    let error = error_picture(&flip_map(ours, traced)?, traced.width_px, traced.height_px);
    let caption = format!("{label}: traced; {NEAR}; {MAPS}; {SKY}; FLIP of the second.");
    let path = run.figure(report, format!("{label}-rough.png"), caption);
    Ok(Picture::beside(&[traced, ours, maps, sky, &error], GAP_PX).write(&path)?)
}
