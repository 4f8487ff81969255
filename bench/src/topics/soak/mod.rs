//! Topic `soak`: what a server's process takes of a machine over a long time, and whether that grows: memory, open files, threads.
//!
//! The server is `vantage-server`, a process of its own, which stands beside this one. Its clients are of all kinds: [`crate::load`]'s walkers, those who turn, stand, come back without
//! a word and stop reading, a presenter with followers, and those who are cut off and go on (`comer`).

mod comer;
mod process;
mod slope;

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use anyhow::Context;
use clap::{Args, Command};
use protocol::message::Clock;

use crate::load::{self, Limits, Load};
use crate::report::plot::{Axes, Scatter, Series, draw_curves};
use crate::report::progress::Progress;
use crate::report::table::Table;
use crate::report::{Bar, Report, Row};
use crate::topic::{Run, Topic, scene_label};
use comer::Comings;
use process::{Sample, Server};
use slope::Slope;

/// See the module.
pub struct Soak;

/// What `soak` takes beside what every topic does.
#[derive(Debug, Args)]
struct SoakArgs {
    /// How long, in minutes
    #[arg(long, default_value_t = 30.0)]
    minutes: f64,
}

const QUICK_MINUTES: f64 = 0.3;
/// Between two looks at the process.
const EVERY: Duration = Duration::from_secs(5);
const QUICK_EVERY: Duration = Duration::from_millis(500);
/// This share of the run is left out: until then pools fill, and everybody is there.
const WARM_UP: f64 = 0.25;
/// Of 20 clients: each goes his own way, and those who do this are of all kinds.
const SCRIPT: &str = "walk:4,orbit:3,idle:2,arrive:1,reconnect:2,stall:2";
const OWN_WAYS: usize = 14;
/// One presenter and those who follow him.
const AUDIENCE: usize = 4;
const COMERS: usize = 2;
/// Side of the server's images, in pixels: small, so that many sessions come and go on a small machine.
const IMAGE_PX: u32 = 128;

impl Topic for Soak {
    fn name(&self) -> &'static str {
        "soak"
    }

    fn about(&self) -> &'static str {
        "What a server's process takes over a long time, with twenty clients that walk, stand, present, follow, stop reading, vanish, come back and go on: memory, open files and \
         threads, and how fast each grows."
    }

    fn default_scenes(&self, _: bool) -> Vec<String> {
        vec!["pillars".to_owned()]
    }

    fn arguments(&self, command: Command) -> Command {
        SoakArgs::augment_args(command)
    }

    fn run(&self, run: &Run, report: &mut Report) -> anyhow::Result<()> {
        run.gpu(report)?;
        let minutes = if run.quick { QUICK_MINUTES } else { run.arguments::<SoakArgs>()?.minutes };
        let (duration, every) = (Duration::from_secs_f64(minutes * 60.0), if run.quick { QUICK_EVERY } else { EVERY });
        describe(report, duration, every);
        let scene = run.scenes.first().context("no scene")?;
        // What is wrong with it is said before a server runs for half an hour.
        run.read_trace()?;
        let traces = run.trace_file().map(Path::to_owned).into_iter().collect();
        let found = soaked(scene, traces, (duration, every), &run.out.join("server.log"))?;
        let path = run.out.join("samples.csv");
        std::fs::write(&path, table(&found.samples).csv()).with_context(|| path.display().to_string())?;
        rows(&found, &scene_label(scene), report);
        plot(&found.samples, run, report)
    }
}

fn describe(report: &mut Report, duration: Duration, every: Duration) {
    report
        .settings
        .set("run", format!("{} s, of which the first {} % are left out", duration.as_secs(), WARM_UP * 100.0));
    report.settings.set(
        "clients",
        format!("{SCRIPT} of {OWN_WAYS}, {AUDIENCE} of an audience, {COMERS} who are cut off and go on"),
    );
    report.settings.set("sampled", format!("every {} s", every.as_secs_f64()));
    report.settings.set("images", format!("{IMAGE_PX} px a side"));
    report.notes = [
        "Slopes are by least squares. Their standard errors are those of independent residuals times sqrt((1 + r) / (1 - r)), where r is how residuals go with those before them: a \
         process that moves slowly tells less by many samples than by as many that have nothing to do with each other (Bayley and Hammersley 1946).",
        "Clients run in a process of their own, on the same machine. ..._per_h: of slopes.",
    ]
    .map(str::to_owned)
    .to_vec();
}

/// What a run found.
struct Found {
    samples: Vec<Sample>,
    own_ways: load::Report,
    audience: load::Report,
    comings: Comings,
    health: serde_json::Value,
}

fn soaked(
    scene: &str,
    traces: Vec<PathBuf>,
    (duration, every): (Duration, Duration),
    log: &Path,
) -> anyhow::Result<Found> {
    let image_px = IMAGE_PX.to_string();
    let mut server = Server::start(&[scene, "--port", "0", "--image-size", &image_px], log)?;
    let runtime = load::runtime()?;
    let options = |clients: usize, script: &str, audience: bool| -> anyhow::Result<Load> {
        Ok(Load {
            server: server.websocket(),
            clients,
            duration,
            tells_progress: false,
            ramp: duration.mul_f64(WARM_UP / 4.0),
            traces: traces.clone(),
            script: script.parse()?,
            clock: Clock::Wall,
            audience,
            followed_at: Vec::new(),
            decoding: None,
            limits: Limits::default(),
            scene: None,
        })
    };
    let (own_ways, audience) = (options(OWN_WAYS, SCRIPT, false)?, options(AUDIENCE, "walk", true)?);
    let progress = Progress::new("soak", (duration.as_secs_f64() / every.as_secs_f64()).ceil() as u64);
    let (begun, url) = (Instant::now(), server.websocket() + "/ws");
    let sampled = async {
        let mut samples = Vec::new();
        while begun.elapsed() < duration {
            tokio::time::sleep(every).await;
            samples.push(server.sample(begun.elapsed().as_secs_f64())?);
            progress.step();
        }
        anyhow::Ok(samples)
    };
    let comers = async {
        let comers: Vec<_> = (0..COMERS)
            .map(|index| tokio::spawn(comer::comes_and_goes(url.clone(), index, begun + duration)))
            .collect();
        let mut all = Comings::default();
        for comer in comers {
            all.add(comer.await.context("a client task failed")?);
        }
        anyhow::Ok(all)
    };
    let (own_ways, audience, comings, samples) =
        runtime.block_on(async { tokio::join!(load::run(&own_ways), load::run(&audience), comers, sampled) });
    let own_ways = own_ways?;
    let health = own_ways.health.clone();
    server.stop()?;
    Ok(Found { samples: samples?, own_ways, audience: audience?, comings: comings?, health })
}

/// Reads one figure.
type Reads = fn(&Sample) -> f64;

/// What is sampled: its name, which ends in its unit, and how it is read.
const SAMPLED: [(&str, Reads); 3] = [
    ("resident_mb", |sample| sample.resident_bytes as f64 / 1e6),
    ("descriptors", |sample| sample.descriptors as f64),
    ("threads", |sample| sample.threads as f64),
];

fn table(samples: &[Sample]) -> Table {
    let mut table = Table::new(std::iter::once("at_s".to_owned()).chain(SAMPLED.map(|(name, _)| name.to_owned())));
    for sample in samples {
        let cells = SAMPLED.map(|(_, of)| of(sample).to_string());
        table.row(std::iter::once(format!("{:.1}", sample.at_s)).chain(cells));
    }
    table
}

fn rows(found: &Found, scene: &str, report: &mut Report) {
    let warm_s = found.samples.last().map_or(0.0, |sample| sample.at_s) * WARM_UP;
    let warm: Vec<&Sample> = found.samples.iter().filter(|sample| sample.at_s >= warm_s).collect();
    for (name, of) in SAMPLED {
        let points: Vec<(f64, f64)> = warm.iter().map(|sample| (sample.at_s / 3600.0, of(sample))).collect();
        let mut row = Row::new(scene, name);
        let (first, last) =
            (points.first().map_or(f64::NAN, |point| point.1), points.last().map_or(f64::NAN, |point| point.1));
        row.counts.set("samples", points.len() as f64);
        row.counts.set("first", first);
        row.counts.set("last", last);
        let values = || points.iter().map(|point| point.1);
        row.counts.set("least", values().fold(f64::INFINITY, f64::min));
        row.counts.set("most", values().fold(f64::NEG_INFINITY, f64::max));
        let slope = Slope::of(&points);
        if let Some(slope) = slope {
            row.counts.set("slope_per_h", slope.per_x);
            row.counts.set("standard_error_per_h", slope.standard_error);
            row.counts.set("residuals_correlation", slope.correlation);
        }
        report.rows.push(row);
        report.bars.push(Bar::at_most(
            format!("{name}: slope an hour, less two standard errors"),
            0.0,
            slope.map(|slope| slope.per_x - 2.0 * slope.standard_error),
            "",
        ));
    }
    let mut row = Row::new(scene, "clients");
    let of_load = |of: fn(&load::Report) -> f64| of(&found.own_ways) + of(&found.audience);
    row.counts.set("updates", of_load(|load| load.updates as f64) + found.comings.updates as f64);
    row.counts.set("sessions", found.health["connected"].as_f64().unwrap_or(f64::NAN));
    row.counts.set("resumed", found.comings.resumed as f64);
    row.counts.set("left", found.comings.left as f64);
    let errors = of_load(|load| load.errors as f64) + found.comings.errors as f64;
    row.counts.set("errors", errors);
    row.counts.set("faults", found.health["faults"].as_f64().unwrap_or(f64::NAN));
    report.rows.push(row);
    report.bars.push(Bar::at_most("clients that ended by an error", 0.0, Some(errors), ""));
    report.bars.push(Bar::at_most("faults of the server", 0.0, found.health["faults"].as_f64(), ""));
}

/// Each by what it was at the end of the warm-up.
fn plot(samples: &[Sample], run: &Run, report: &mut Report) -> anyhow::Result<()> {
    let warm_s = samples.last().map_or(0.0, |sample| sample.at_s) * WARM_UP;
    let series = SAMPLED.map(|(name, of)| {
        let base = samples.iter().find(|sample| sample.at_s >= warm_s).map_or(1.0, of);
        let points = samples.iter().map(|sample| (sample.at_s / 60.0, of(sample) / base.max(1.0))).collect();
        Series { name: name.to_owned(), points }
    });
    let path = run.figure(
        report,
        "soak.svg",
        "Memory, open files and threads over time, each by what it was after the warm-up.",
    );
    let (x_label, y_label) = ("min".to_owned(), "of what it was".to_owned());
    let plot = Scatter { title: "soak".into(), x_label, y_label, series: series.to_vec() };
    draw_curves(&plot, Axes { log_x: false, front: false }, &path)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn growth_is_told_from_what_comes_and_goes() {
        let sample = |index: u32, bytes: u64| Sample {
            at_s: f64::from(index),
            resident_bytes: bytes,
            descriptors: 20 + u64::from(index % 3),
            threads: 9,
        };
        let samples = (0..400).map(|index| sample(index, 100_000_000 + u64::from(index) * 10_000)).collect();
        let found = Found {
            samples,
            own_ways: load::Report::default(),
            audience: load::Report::default(),
            comings: Comings::default(),
            health: serde_json::json!({ "connected": 20, "faults": 0 }),
        };
        let mut report = Report::new("soak", "");
        rows(&found, "pillars", &mut report);
        let missed: Vec<bool> = report.bars.iter().map(Bar::is_missed).collect();
        assert_eq!(
            missed,
            [true, false, false, false, false],
            "memory grows by 36 MB an hour, and nothing else: {:?}",
            report.bars
        );
        let slope = report.rows[0].figure("counts.slope_per_h").expect("a slope");
        assert!((slope - 36.0).abs() < 0.1, "{slope}");
        assert_eq!(table(&found.samples).csv().lines().next(), Some("at_s,resident_mb,descriptors,threads"));
    }
}
