//! Topic `sent-once`: what a walk costs when only what a viewer lacks is sent, beside sending every view anew.
//!
//! A viewer walks a loop for ten seconds and the same way back, at 1.4 m/s with ten updates a second, served by the real
//! stage without a network: the same views, size and codec for both methods. Holes and FLIP are those of the client's own
//! library, drawing the copy that was decoded from the bytes, at the eye's true place one update later.

mod cost;
mod settings;
pub(crate) mod walk;
mod walked;

use std::sync::Arc;

use clap::Args;
use gpu::Gpu;
use protocol::Look;
use server::account::Counts;
use server::discretize::Discretization;

use crate::report::plot::{Scatter, Series, draw_scatter};
use crate::report::progress::Progress;
use crate::report::{Bar, Report, Row};
use crate::spread::{Better, Spread};
use crate::stage::Stage;
use crate::topic::{Run, Topic, scene_label};
use cost::{Costs, median};
use walk::{Setup, Tick, UPDATE_HZ, Walk};
use walked::{STAND_S, Walked, walked};

/// See the module.
pub struct SentOnce;

/// Seconds on the way out, and as many on the way back.
const HALF_S: f64 = 10.0;
const QUICK_HALF_S: f64 = 2.0;
/// Server views: pixels of a side, where `--size` gives none.
const IMAGES_PX: [u32; 2] = [256, 512];
/// What only this topic takes.
#[derive(Debug, Default, clap::Args)]
struct Arguments {
    /// Instead: the same walk at one setting after another, error against bytes.
    #[arg(long)]
    settings: bool,
    /// Beside: the same walk where one image shows all objects of a shape.
    #[arg(long, conflicts_with = "settings")]
    relief: bool,
}

impl Topic for SentOnce {
    fn name(&self) -> &'static str {
        "sent-once"
    }

    fn about(&self) -> &'static str {
        "What a walk out and back costs when only what the viewer lacks is sent, beside sending every view anew: samples, \
         bytes, holes, FLIP and the server's time, update by update."
    }

    fn default_scenes(&self, quick: bool) -> Vec<String> {
        let scenes: &[&str] = if quick { &["urban"] } else { &["urban", "pillars", "tree"] };
        scenes.iter().map(|&name| name.to_owned()).collect()
    }

    fn arguments(&self, command: clap::Command) -> clap::Command {
        Arguments::augment_args(command)
    }

    fn run(&self, run: &Run, report: &mut Report) -> anyhow::Result<()> {
        let gpu = run.gpu(report)?.clone();
        let arguments: Arguments = run.arguments()?;
        let half_s = if run.quick { QUICK_HALF_S } else { HALF_S };
        let sizes_px = match run.size_px {
            Some((side_px, _)) => vec![side_px],
            None if run.quick => IMAGES_PX[..1].to_vec(),
            None => IMAGES_PX.to_vec(),
        };
        describe(report, half_s);
        let progress = Progress::new("sent-once", (run.scenes.len() * sizes_px.len()) as u64);
        for name in &run.scenes {
            let label = scene_label(name);
            for &image_px in &sizes_px {
                progress.say(format!("walking in {label}, {image_px} px"));
                let walked = if arguments.settings {
                    settings::scene(&gpu, name, image_px, half_s, run, report)
                } else {
                    scene(&gpu, name, image_px, half_s, (run, arguments.relief), report)
                };
                if let Err(error) = walked {
                    report.rows.push(Row::failed(&label, "walk", &error));
                }
                progress.step();
            }
        }
        Ok(())
    }
}

fn describe(report: &mut Report, half_s: f64) {
    report.settings.set("walk", format!("{half_s} s out and {half_s} s back, {UPDATE_HZ} updates a second"));
    report.notes = [
        "samples_share: samples sent over the first hits of the same views, which is what sending each anew would cost; the \
         set that a viewer gets before the walk is counted on both sides.",
        "back_share: bytes on the way back over bytes on the way out.",
        "holes, false cover and FLIP: at the eye's true place one update later, on the way; anew: the same with every view sent \
         whole and nothing kept.",
        "up to N held: the same walk's ticks in four groups by what the client holds; look_over_anew: the server's median look \
         over that of sending every view anew, both without coding; client_frame: drawing the copy at the size of the views.",
    ]
    .map(str::to_owned)
    .to_vec();
}

fn scene(
    gpu: &Gpu,
    name: &str,
    image_px: u32,
    half_s: f64,
    (run, relief): (&Run, bool),
    report: &mut Report,
) -> anyhow::Result<()> {
    let label = scene_label(name);
    let scene = Arc::new(run.load(name)?);
    let walk = Walk::new(&scene, run.read_trace()?, half_s);
    let mut truths = Stage::new(gpu, (*scene).clone(), Look::Plain)?;
    let usual = Setup::usual(image_px);
    let once = walked(gpu, &scene, &usual, &walk, &mut truths)?;
    let anew = walked(gpu, &scene, &Setup { method: Discretization::Conventional, ..usual }, &walk, &mut truths)?;
    let row = row(&label, &format!("sent once, {image_px} px"), &once, half_s);
    let at_most = if label == "tree" { 0.16 } else { 0.10 };
    let bar =
        |what: &str, at_most, found| Bar::at_most(format!("{label}, {image_px} px: {what}"), at_most, found, "share");
    report.bars.push(bar("samples sent of anew", at_most, row.figure("counts.samples_share")));
    report.bars.push(bar("bytes back of out", 0.5, row.figure("counts.back_share")));
    report.rows.push(row);
    report.rows.push(self::row(&label, &format!("anew, {image_px} px"), &anew, half_s));
    if relief {
        let by_relief = walked(gpu, &scene, &Setup { relief, ..usual }, &walk, &mut truths)?;
        report.rows.push(self::row(&label, &format!("sent once, reliefs, {image_px} px"), &by_relief, half_s));
    }
    let series = |name: &str, walked: &Walked| Series {
        name: name.to_owned(),
        points: walked.ticks.iter().enumerate().map(|(i, t)| (i as f64 / UPDATE_HZ, t.bytes as f64 / 1000.0)).collect(),
    };
    let path =
        run.figure(report, format!("{label}-{image_px}.svg"), format!("{label}: kilobytes an update along the walk"));
    let plot = Scatter {
        title: format!("{label}, views of {image_px}²: bytes along the walk"),
        x_label: "seconds".to_owned(),
        y_label: "kB an update".to_owned(),
        series: vec![series("sent once", &once), series("anew", &anew)],
    };
    draw_scatter(&plot, &path)?;
    let costs = Costs { ticks: &once.ticks, frames: &once.frames, anew_ms: median(&anew.ticks) };
    report.rows.extend(costs.rows(&label, image_px));
    let path = run.figure(
        report,
        format!("{label}-{image_px}-cost.svg"),
        format!("{label}: milliseconds of a server's look and of a client's frame, by what is held"),
    );
    draw_scatter(&costs.plot(&label, image_px), &path)
}

fn row(label: &str, method: &str, walked: &Walked, half_s: f64) -> Row {
    let mut row = Row::new(label, method);
    let ticks = &walked.ticks;
    let sum = |of: fn(&Counts) -> usize| ticks.iter().map(|tick| of(&tick.counts)).sum::<usize>() as f64;
    let at = |s: f64| (((STAND_S + s) * UPDATE_HZ).round() as usize).min(ticks.len());
    let bytes = |ticks: &[Tick]| ticks.iter().map(|tick| tick.bytes).sum::<usize>() as f64;
    let (standing, out) = (bytes(&ticks[..at(0.0)]), bytes(&ticks[at(0.0)..at(half_s)]));
    let back = bytes(&ticks[at(half_s)..at(2.0 * half_s)]);
    row.counts.set("samples_share", sum(|counts| counts.added) / sum(|counts| counts.anew).max(1.0));
    row.counts.set("back_share", back / out.max(1.0));
    row.counts.set("added", sum(|counts| counts.added));
    row.counts.set("border", sum(|counts| counts.border));
    row.counts.set("deleted", sum(|counts| counts.deleted));
    row.counts.set("trimmed", sum(|counts| counts.trimmed));
    row.counts.set("anew", sum(|counts| counts.anew));
    row.counts.set("held", ticks.last().map_or(0.0, |tick| tick.held as f64));
    row.counts.set("patches", ticks.last().map_or(0.0, |tick| tick.patches as f64));
    row.bytes.set("standing", standing);
    row.bytes.set("out", out);
    row.bytes.set("back", back);
    row.bytes.set("after", bytes(&ticks[at(2.0 * half_s)..]));
    for (name, values) in
        [("holes_share", &walked.holes), ("false_cover_share", &walked.false_cover), ("flip_covered", &walked.flip)]
    {
        if let Some(spread) = Spread::of(values, Better::Lower) {
            row.error.set(name, spread);
        }
        if let (Some(first), Some(last)) = (values.first(), values.last()) {
            row.error.set(format!("{name}_start"), Spread::single(*first));
            row.error.set(format!("{name}_end"), Spread::single(*last));
        }
    }
    let ms = |of: fn(&Tick) -> f64| Spread::of(&ticks.iter().map(of).collect::<Vec<_>>(), Better::Lower);
    if let (Some(look), Some(build)) = (ms(|tick| tick.look_ms), ms(|tick| tick.build_ms)) {
        row.time_ms.set("look", look);
        row.time_ms.set("build", build);
    }
    row
}
