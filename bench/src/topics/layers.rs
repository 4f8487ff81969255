//! Topic `layers`: what is blended, in a session, against rays that go through it.
//!
//! A viewer goes round a scene and back, served by the real stage without a network, and sees layers blended with what lies behind them
//! ([`client::draw::layers`]). The truth of each view are rays on the CPU that go on behind what hides only a part, in order, at every pixel's centre. Beside it in the
//! same run: the same truth with all that is blended cut out where its alpha is below a half, which is as good as a picture without layers can be.

use std::sync::Arc;

use clap::Args;
use client::draw::frame::Options;
use gpu::Gpu;
use protocol::Purpose;
use protocol::codec::{Coding, encode_patch};
use server::look::SceneLook;

use crate::client_view::ClientView;
use crate::compare::Picture;
use crate::compare::flip::{error_picture, flip_map};
use crate::raytrace::{Effects, RayTruth, TracedPicture};
use crate::report::progress::Progress;
use crate::report::{Bar, Report, Row};
use crate::spread::{Better, Spread};
use crate::topic::{Run, Topic, scene_label};
use crate::topics::sent_once::walk::{Setup, UPDATE_HZ, Walk, Walker};

/// See the module.
pub struct Layers;

/// Seconds out, and as many back.
const HALF_S: f64 = 3.0;
const QUICK_HALF_S: f64 = 0.4;
const POSES: usize = 8;
const QUICK_POSES: usize = 2;
/// Sides of server views and of the output.
const SIDES_PX: (u32, u32) = (512, 384);
const QUICK_SIDES_PX: (u32, u32) = (256, 128);
/// The most mean error over covered pixels.
const FLIP_BAR: f64 = 0.03;

/// What only this topic takes.
#[derive(Debug, Default, clap::Args)]
struct Arguments {
    /// Views that are compared [default: 8, with --quick 2].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=1000))]
    poses: Option<u64>,
}

impl Topic for Layers {
    fn name(&self) -> &'static str {
        "layers"
    }

    fn about(&self) -> &'static str {
        "What is blended, sent in layers and seen through by a viewer who moves: error against rays that go on behind it, bytes and times."
    }

    fn arguments(&self, command: clap::Command) -> clap::Command {
        Arguments::augment_args(command)
    }

    fn default_scenes(&self, _quick: bool) -> Vec<String> {
        ["alpha-boards-moving", "window-moving"].map(str::to_owned).to_vec()
    }

    fn run(&self, run: &Run, report: &mut Report) -> anyhow::Result<()> {
        let arguments: Arguments = run.arguments()?;
        let poses = arguments.poses.map_or(if run.quick { QUICK_POSES } else { POSES }, |poses| poses as usize);
        let half_s = if run.quick { QUICK_HALF_S } else { HALF_S };
        let (image_px, output_px) = if run.quick { QUICK_SIDES_PX } else { SIDES_PX };
        let output_px = run.size_px.map_or(output_px, |(_, height_px)| height_px);
        report.settings.set("walk", format!("{half_s} s out and {half_s} s back, {UPDATE_HZ} updates a second"));
        report.settings.set("views compared", poses);
        report.settings.set("server views", format!("{image_px}x{image_px}"));
        report.settings.set("output", format!("{output_px}x{output_px} at 69 degrees, one sample a pixel"));
        report.notes = [
            "FLIP over the pixels where the truth shows a surface; \"through\" over those whose ray goes on behind something that is blended.",
            "Cut out: the truth with what is blended cut out at a half, against the truth; no session and no samples.",
            "Times are wall times of this machine; a look includes layers.",
        ]
        .map(str::to_owned)
        .to_vec();
        let gpu = run.gpu(report)?.clone();
        for name in &run.scenes {
            if let Err(error) = scene(&gpu, name, &Size { poses, half_s, image_px, output_px }, run, report) {
                report.rows.push(Row::failed(&scene_label(name), "walk", &error));
            }
        }
        Ok(())
    }
}

struct Size {
    poses: usize,
    half_s: f64,
    image_px: u32,
    output_px: u32,
}

/// A view that was compared.
struct Found {
    covered: f64,
    through: f64,
    cut_covered: f64,
    cut_through: f64,
    frame_ms: f64,
    look_ms: f64,
    sheet: Picture,
}

fn scene(gpu: &Gpu, name: &str, size: &Size, run: &Run, report: &mut Report) -> anyhow::Result<()> {
    let scene = Arc::new(run.load(name)?);
    let label = scene_label(name);
    let walk = Walk::new(&scene, run.read_trace()?, size.half_s);
    let setup = Setup { output_px: size.output_px, ..Setup::usual(size.image_px) };
    let mut walker = Walker::new(gpu, scene.clone(), &setup)?;
    let mut client = ClientView::new(gpu, (size.output_px, size.output_px))?;
    let look = SceneLook::new(&scene, protocol::Look::default());
    let ticks = (2.0 * size.half_s * UPDATE_HZ) as usize;
    let every = (ticks / size.poses).max(1);
    let progress = Progress::new(label.clone(), ticks as u64);
    let (mut bytes, mut layer_bytes, mut found) = (0, 0, Vec::new());
    let mut known = std::collections::BTreeSet::new();
    for tick in 0..=ticks {
        let at_s = tick as f64 / UPDATE_HZ;
        let pose = walk.at(at_s);
        let done = walker.tick(pose, at_s)?;
        progress.step();
        bytes += done.bytes;
        for (id, held) in &walker.set.held.patches {
            if known.insert(*id) && matches!(held.patch.purpose, Purpose::Layer(_)) {
                layer_bytes += encode_patch(&held.patch, Coding::default()).len();
            }
        }
        if tick == 0 || !tick.is_multiple_of(every) {
            continue;
        }
        let view = walker.output(pose, server::start::near_m(&scene));
        let drawn = client.frame_shown(walker.shown(), &view, Options::default())?;
        // Objects are where the last update left them.
        let snapshot = scene.at(walker.set.held.scene_time_s);
        let truth = RayTruth::new(&scene, &snapshot, &look.lighting(&snapshot));
        let blended = truth.picture(&view, &Effects::BLENDED, 1);
        let cut = truth.picture(&view, &Effects::PLAIN, 1);
        found.push(compare(&drawn.picture, &blended, &cut, (drawn.frame_ms, done.look_ms))?);
    }
    let worst = found.iter().max_by(|a, b| a.covered.total_cmp(&b.covered));
    if let Some(worst) = worst {
        let caption = format!(
            "{label}: what the client shows, rays, their difference, and what is blended cut out; the worst view."
        );
        worst.sheet.write(&run.figure(report, format!("{label}.png"), caption))?;
    }
    let rows = rows(&label, &found, (bytes, layer_bytes));
    let flip = rows[0].figure("error.flip_covered.mean");
    report.bars.push(Bar::at_most(format!("{label}: FLIP over covered pixels, mean"), FLIP_BAR, flip, ""));
    report.rows.extend(rows);
    Ok(())
}

fn compare(
    drawn: &Picture,
    blended: &TracedPicture,
    cut: &TracedPicture,
    (frame_ms, look_ms): (f64, f64),
) -> anyhow::Result<Found> {
    let (truth, cut) = (blended.picture(), cut.picture());
    let errors = flip_map(drawn, &truth)?;
    let cut_errors = flip_map(&cut, &truth)?;
    let mean = |errors: &[f32], is_meant: &dyn Fn(usize) -> bool| {
        let meant = (0..errors.len()).filter(|&pixel| is_meant(pixel));
        let (sum, count) = meant.fold((0.0, 0.0), |(sum, count), pixel| (sum + f64::from(errors[pixel]), count + 1.0));
        sum / f64::max(count, 1.0)
    };
    let covered = |pixel: usize| blended.first_object[pixel].is_some();
    let through = |pixel: usize| blended.seen_through[pixel] > 0;
    let wrong = error_picture(&errors, truth.width_px, truth.height_px);
    Ok(Found {
        covered: mean(&errors, &covered),
        through: mean(&errors, &through),
        cut_covered: mean(&cut_errors, &covered),
        cut_through: mean(&cut_errors, &through),
        frame_ms,
        look_ms,
        sheet: Picture::beside(&[drawn, &truth, &wrong, &cut], 4),
    })
}

fn rows(label: &str, found: &[Found], (bytes, layer_bytes): (usize, usize)) -> [Row; 2] {
    let (mut ours, mut cut) = (Row::new(label, "layers"), Row::new(label, "cut out"));
    let spread = |value: fn(&Found) -> f64| Spread::of(&found.iter().map(value).collect::<Vec<_>>(), Better::Lower);
    let error = |row: &mut Row, name: &str, value: fn(&Found) -> f64| {
        if let Some(spread) = spread(value) {
            row.error.set(name, spread);
        }
    };
    error(&mut ours, "flip_covered", |found| found.covered);
    error(&mut ours, "flip_through", |found| found.through);
    error(&mut cut, "flip_covered", |found| found.cut_covered);
    error(&mut cut, "flip_through", |found| found.cut_through);
    for (name, spread) in [("frame", spread(|found| found.frame_ms)), ("look", spread(|found| found.look_ms))] {
        if let Some(spread) = spread {
            ours.time_ms.set(name, spread);
        }
    }
    ours.bytes.set("session", bytes as f64);
    ours.bytes.set("layers", layer_bytes as f64);
    [ours, cut]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::scratch_folder;

    #[test]
    fn layers_come_nearer_to_rays_than_what_is_cut_out() {
        let out = scratch_folder("layers");
        let mut run = Run::new(vec!["alpha-boards-moving".to_owned()], out.clone());
        run.quick = true;
        let mut report = Report::new("layers", "");
        Layers.run(&run, &mut report).expect("a GPU adapter, software or not");
        assert!(!report.has_failures(), "{:?}", report.rows);
        let [ours, cut] = [0, 1].map(|row| report.rows[row].figure("error.flip_through.mean").expect("seen through"));
        println!("seen through: {ours}, cut out: {cut}");
        assert!(ours < 0.25 * cut, "seen through: {ours}, cut out: {cut}");
        assert!(report.rows[0].figure("bytes.layers").is_some_and(|bytes| bytes > 100.0));
        std::fs::remove_dir_all(out).expect("was written");
    }
}
