//! Cases for other clients: a real server of each, one after another, beside the picture that the native client shows of it.
//!
//! A line of JSON a case goes to the standard output; when a line comes to the standard input, the next case takes its place. The browsers' script
//! (`tests/browser/stiff.mjs`) opens each and compares what it shows. Offered is what stands still: what moves would be at another place in each picture.

use std::io::Write;
use std::path::PathBuf;
use std::sync::Arc;

use camera::{Trace, TracePose};
use client::draw::shadow::{self, Shadows};
use client::show::headless::{self, Way};
use gpu::Gpu;
use protocol::Look;
use scene::Scene;
use scene::model::SceneCamera;
use server::imager::GpuImager;
use server::start::start_pose;

use super::case::{Case, FOV_Y_RAD};
use super::cases::{GROUPS, effects};
use super::lab::Lab;
use super::sweeps::BY_CODE;
use crate::compare::Picture;
use crate::report::progress::Progress;

/// How it is served, and where the native client's pictures go.
pub struct Offer {
    pub port: u16,
    /// Folder of the built web client, where it is not built in.
    pub web: Option<PathBuf>,
    pub out: PathBuf,
}

/// As many samples as pixels, and large enough for a browser's page.
const SIZE_PX: (u32, u32) = (400, 250);
/// Side of the server's images.
const IMAGE_PX: u32 = 256;
/// How long the native client stands before its picture counts: looks of so little end sooner.
const STANDS_S: f64 = 5.0;
const FPS: f64 = 4.0;

/// A case by its name, and how to come by it.
type Named<'a> = (String, Box<dyn Fn(&mut Lab) -> anyhow::Result<Option<Case>> + 'a>);

/// All cases, and of each sweep its ends.
fn all() -> Vec<Named<'static>> {
    let cases = GROUPS.iter().flat_map(|group| group.cases.iter().map(move |case| (group.name, case)));
    let cases = cases.map(|(group, case)| -> Named<'static> {
        (format!("{group}: {}", case.name), Box::new(|lab| Ok(looked_at(lab, |lab| (case.judge)(lab).map(drop)))))
    });
    let swept = BY_CODE.iter().flat_map(|(sweep, case)| {
        let ends = [sweep.decades[0], sweep.holds_to].map(|decade| 10_f64.powi(decade));
        ends.map(|value| -> Named<'static> {
            (format!("{}: {value:e}", sweep.name), Box::new(move |_| Ok(Some(case(value)))))
        })
    });
    let effects = effects().flat_map(|effect| {
        let ends = [effect.values.first(), effect.values.last()].into_iter().flatten();
        ends.map(move |&value| -> Named<'static> {
            let look = move |lab: &mut Lab| Ok(looked_at(lab, |lab| (effect.judge)(lab, value).map(drop)));
            (format!("{}: {value:e}", effect.name), Box::new(look))
        })
    });
    cases.chain(swept).chain(effects).collect()
}

/// The first case that a judge looks at; whether it holds is told elsewhere.
fn looked_at(lab: &mut Lab, judge: impl FnOnce(&mut Lab) -> anyhow::Result<()>) -> Option<Case> {
    lab.case.take();
    let _ = judge(lab);
    lab.case.take()
}

/// Offers all cases whose names hold one of some words; all where there is none.
pub fn offer(lab: &mut Lab, offer: &Offer, words: &[String]) -> anyhow::Result<()> {
    let all = all();
    let is_asked = |name: &str| words.is_empty() || words.iter().any(|word| name.contains(word.as_str()));
    let asked: Vec<_> = all.iter().filter(|(name, _)| is_asked(name)).collect();
    let progress = Progress::new("offering cases", asked.len() as u64);
    for (place, (name, case)) in asked.into_iter().enumerate() {
        progress.say(name.clone());
        match case(lab)?.filter(|case| stands_still(&case.scene)) {
            Some(case) => one(lab, offer, (place, name), case)?,
            None => println!("not offered: {name}"),
        }
        progress.step();
    }
    Ok(())
}

fn stands_still(scene: &Scene) -> bool {
    !scene.lights_move && scene.instances.iter().all(|instance| !instance.moves && !instance.deforms)
}

fn one(lab: &Lab, offer: &Offer, (place, name): (usize, &str), case: Case) -> anyhow::Result<()> {
    let mut scene = case.scene;
    let forward_world = case.middle.rotation * glam::DVec3::Z;
    scene.start = Some(SceneCamera { eye_world: case.middle.translation, forward_world, fov_y_rad: FOV_Y_RAD });
    let config = server::Config {
        port: offer.port,
        image_size_px: IMAGE_PX,
        // Samples are judged, not pictures that are sent whole.
        rest: false,
        anticipation: false,
        look: Look::Plain,
        web: offer.web.clone(),
        ..server::Config::default()
    };
    // A device of its own, as a server has.
    let server_gpu = pollster::block_on(Gpu::new_headless())?;
    let imager = Box::new(GpuImager::new(&server_gpu, &scene, &config)?);
    let start = start_pose(&scene);
    let runtime = tokio::runtime::Runtime::new()?;
    let running = runtime.block_on(server::serve(config, Arc::new(scene), imager))?;

    let poses = [0.0, STANDS_S].map(|t_s| TracePose { t_s, world_from_eye: start });
    let way = Way::Trace(Trace { poses: poses.to_vec() });
    let mut options = headless::Options::new(format!("ws://{}", running.addr), way);
    (options.size_px, options.fov_y_rad, options.fps) = (SIZE_PX, FOV_Y_RAD, FPS);
    options.picture.shadow = shadow::Settings { shadows: Shadows::Maps, ..shadow::Settings::default() };
    let mut last = None;
    headless::run_on(&lab.gpu, &options, &mut |drawn| last = Some(drawn.rgba.to_vec()))?;
    if let Some(rgba) = last {
        let path = offer.out.join(format!("{place:02}.png"));
        Picture::from_rgba(SIZE_PX.0, SIZE_PX.1, &rgba).write(&path)?;
        println!("{}", serde_json::json!({ "case": name, "place": place, "picture": std::path::absolute(&path)? }));
        std::io::stdout().flush()?;
        std::io::stdin().read_line(&mut String::new())?;
    }
    runtime.block_on(running.stop());
    Ok(())
}
