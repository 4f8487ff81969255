//! Topic `network`: what a viewer has through networks that are slow, lose packets, queue for a second, or go away: age, goodput, and how soon all is there again.
//!
//! A real server, the client's own library, and between them a proxy that shows loss and blackouts as TCP does ([`network::LinkModel`]). Nothing is drawn.

mod kernel;
mod visit;

use std::sync::Arc;

use anyhow::Context;
use clap::Args;
use gpu::Gpu;
use network::Link;
use server::imager::GpuImager;

use crate::load::Percentiles;
use crate::report::plot::{Axes, Scatter, Series, draw_curves};
use crate::report::progress::Progress;
use crate::report::{Bar, Report, Row};
use crate::spread::{Better, Spread};
use crate::topic::{Run, Topic, scene_label};
use kernel::KernelPath;
use visit::{Visit, Way, visit};

/// See the module.
pub struct Network;

/// A path, and how large the images are that the server draws for who comes by it.
#[derive(Debug, Clone, Copy)]
struct Path {
    name: &'static str,
    link: &'static str,
    image_px: u32,
}

const fn path(name: &'static str, link: &'static str, image_px: u32) -> Path {
    Path { name, link, image_px }
}

/// Delays and rates are those of the kinds of access that they name; how bandwidth changes while one drives is as recorded ([`network::Fading`]).
const PATHS: [Path; 13] = [
    path("none", "", SMALL_PX),
    path("fibre", "rtt=20,mbit=100", SMALL_PX),
    path("cable", "rtt=20,jitter=5,mbit=20", SMALL_PX),
    path("mobile", "rtt=100,jitter=30,mbit=10", SMALL_PX),
    path("far and slow", "rtt=300,mbit=2", SMALL_PX),
    path("1 % lost, near", "rtt=20,mbit=20,loss=1", SMALL_PX),
    path("1 % lost", "rtt=100,mbit=20,loss=1", SMALL_PX),
    path("5 % lost", "rtt=100,mbit=20,loss=5", SMALL_PX),
    path("5 % lost, far", "rtt=300,mbit=20,loss=5", SMALL_PX),
    path("a queue of 1 s", "rtt=40,mbit=2,queue=1000", SMALL_PX),
    path(FULL, "rtt=40,mbit=0.1,queue=1000", LARGE_PX),
    path("LTE, driving", "rtt=60,jitter=20,mbit=6,queue=1000,fading=1.2@5000", LARGE_PX),
    path("3G, driving", "rtt=120,jitter=40,mbit=1.9,queue=1000,fading=1.3@6000", LARGE_PX),
];
/// The one that the kernel makes; a round trip takes it less than a millisecond.
const KERNEL: Path = path("the kernel's queue of 1 s", "rtt=1,mbit=0.1,queue=1000", LARGE_PX);
const QUICK_PATHS: [Path; 2] = [PATHS[0], PATHS[9]];
/// The path that carries less than the scene takes.
const FULL: &str = "a full queue of 1 s";
/// Of what a full path carries, what the messages of updates are at least.
const GOODPUT_SHARE: f64 = 0.9;
/// Seconds without any network.
const BLACKOUTS_S: [f64; 3] = [3.0, 10.0, 30.0];
const QUICK_BLACKOUTS_S: [f64; 1] = [8.0];
/// A visit: without what comes before the first pictures are there.
const VISIT_S: f64 = 30.0;
const QUICK_VISIT_S: f64 = 14.0;
const SETTLES_S: f64 = 8.0;
/// With a blackout: it stands until its first set is there, walks, and stands when the network goes away, until all must be there again.
const WALKS_S: std::ops::Range<f64> = 5.0..9.0;
const BLACKOUT_BEGINS_S: f64 = 11.0;
const AFTER_S: f64 = 10.0;
/// Sides of the server's images, in pixels: small, as the network is measured and not the renderer; and so large that what they show fills a slow path.
const SMALL_PX: u32 = 128;
const LARGE_PX: u32 = 384;
/// All is there again after so long, for this share of a first set.
const FULL_WITHIN_S: f64 = 3.0;
const RESUME_SHARE: f64 = 0.1;
/// Until nothing more came for so long a set is not whole.
const QUIET_S: f64 = 2.0;

/// What only this topic takes.
#[derive(Debug, Default, clap::Args)]
struct Arguments {
    /// Only the path of this name, and no blackouts; may be given several times.
    #[arg(long, value_name = "NAME")]
    path: Vec<String>,
    /// Also a path that the kernel makes, of 100 kbit/s with a queue of a second: takes Linux and root.
    #[arg(long)]
    kernel: bool,
}

impl Topic for Network {
    fn name(&self) -> &'static str {
        "network"
    }

    fn about(&self) -> &'static str {
        "What a viewer has through networks that are slow, lose packets, queue for a second or go away: age, goodput, and how soon and for how many bytes all is there \
         again. A real server and the client's own library, without drawing."
    }

    fn arguments(&self, command: clap::Command) -> clap::Command {
        Arguments::augment_args(command)
    }

    fn default_scenes(&self, _: bool) -> Vec<String> {
        // In what moves there is always something to send; what stands is whole at some time.
        vec!["pillars".to_owned(), "pillars-moving".to_owned()]
    }

    fn run(&self, run: &Run, report: &mut Report) -> anyhow::Result<()> {
        let gpu = run.gpu(report)?.clone();
        describe(report, run.quick);
        let moving = run.scenes.last().context("no scene")?;
        let still = run.scenes.first().context("no scene")?;
        let Arguments { path: asked, kernel } = run.arguments()?;
        let known: &[_] = if run.quick { &QUICK_PATHS } else { &PATHS };
        let paths: Vec<&Path> =
            known.iter().filter(|path| asked.is_empty() || asked.iter().any(|name| name == path.name)).collect();
        let names = || known.iter().map(|path| path.name).collect::<Vec<_>>().join("; ");
        anyhow::ensure!(!paths.is_empty(), "no path is called so; there are: {}", names());
        let blackouts_s: &[f64] = match () {
            () if !asked.is_empty() => &[],
            () if run.quick => &QUICK_BLACKOUTS_S,
            () => &BLACKOUTS_S,
        };
        let progress = Progress::new("network", (paths.len() + blackouts_s.len()) as u64);
        let mut ages = Vec::new();
        for path in paths {
            let name = path.name;
            progress.say(format!("{name} in {}", scene_label(moving)));
            let way = (WALKS_S.start..f64::INFINITY, duration_s(run.quick));
            match visited(&gpu, run, moving, (path.link.parse()?, path.image_px), way) {
                Ok(visit) => {
                    ages.push(Series { name: name.to_owned(), points: ages_over_time(&visit) });
                    steady(path, &visit, &scene_label(moving), report);
                }
                Err(error) => report.rows.push(Row::failed(&scene_label(moving), name, &error)),
            }
            progress.step();
        }
        for &length_s in blackouts_s {
            let name = format!("no network for {length_s} s");
            progress.say(format!("{name} in {}", scene_label(still)));
            let text = format!("rtt=40,mbit=20,blackout={}@{}", length_s * 1e3, BLACKOUT_BEGINS_S * 1e3);
            let end_s = BLACKOUT_BEGINS_S + length_s;
            match visited(&gpu, run, still, (text.parse()?, SMALL_PX), (WALKS_S, end_s + AFTER_S)) {
                Ok(visit) => came_back(&name, &text, end_s, &visit, &scene_label(still), report),
                Err(error) => report.rows.push(Row::failed(&scene_label(still), &name, &error)),
            }
            progress.step();
        }
        if kernel {
            progress.say(format!("{} in {}", KERNEL.name, scene_label(moving)));
            match visited_through_kernel(run, moving) {
                Ok(visit) => {
                    ages.push(Series { name: KERNEL.name.to_owned(), points: ages_over_time(&visit) });
                    steady(&KERNEL, &visit, &scene_label(moving), report);
                }
                Err(error) => report.rows.push(Row::failed(&scene_label(moving), KERNEL.name, &error)),
            }
        }
        let path = run.figure(
            report,
            "ages.svg",
            "Age of what is shown over the time of a visit, each through another network.",
        );
        let (title, x_label, y_label) = ("age".to_owned(), "s".to_owned(), "ms".to_owned());
        draw_curves(&Scatter { title, x_label, y_label, series: ages }, Axes { log_x: false, front: false }, &path)
    }
}

fn duration_s(quick: bool) -> f64 {
    if quick { QUICK_VISIT_S } else { VISIT_S }
}

fn describe(report: &mut Report, quick: bool) {
    report.settings.set("visit", format!("{} s, of which the first {SETTLES_S} s are left out", duration_s(quick)));
    report
        .settings
        .set("images", format!("{SMALL_PX} px a side; {LARGE_PX} px, and no bodies, where the path is to be full"));
    report.notes = [
        "age: scene time now less scene time shown, at every frame of 60 Hz; with none between them, what this machine takes for an update is all of it.",
        "interval: between two updates that are held. goodput: bytes of messages a second, where the scene has no more to send.",
        "Lost packets come later, and all behind them wait: a round trip after they would have, or a timeout. The rate is at most what Mathis et al. (1997) give for a sender \
         that takes loss for congestion.",
        "no network: what is sent meanwhile is lost, and repeated by TCP after ever longer pauses; back: from its end to an open session; full: to the last update that the eye, \
         which stands, lacked; resume: bytes for that, by those of the first set at the start. turn: the longest that the network took of a frame.",
    ]
    .map(str::to_owned)
    .to_vec();
}

fn visited(
    gpu: &Gpu,
    run: &Run,
    name: &str,
    (link, image_px): (Link, u32),
    (walks_s, duration_s): (std::ops::Range<f64>, f64),
) -> anyhow::Result<Visit> {
    let scene = run.load(name)?;
    let runtime = tokio::runtime::Runtime::new()?;
    // What goes as triangles takes hardly anything of a path once it is there.
    let bodies = image_px < LARGE_PX;
    let defaults = server::Config::default();
    let config = server::Config { port: 0, image_size_px: image_px, anticipation: false, bodies, ..defaults };
    let imager = GpuImager::new(gpu, &scene, &config)?;
    let running = runtime.block_on(server::serve(config, Arc::new(scene), Box::new(imager)))?;
    let trace = run.read_trace()?;
    let way = Way { trace: trace.as_ref(), walks_s };
    let visit = visit(&format!("ws://{}/ws", running.addr), Some(link), &way, duration_s);
    runtime.block_on(running.stop());
    visit
}

fn visited_through_kernel(run: &Run, name: &str) -> anyhow::Result<Visit> {
    let path = KernelPath::start(name, KERNEL.image_px, (100, 1000))?;
    let trace = run.read_trace()?;
    let way = Way { trace: trace.as_ref(), walks_s: WALKS_S.start..f64::INFINITY };
    visit(&path.url(), None, &way, duration_s(run.quick))
}

/// Age by second of a visit.
fn ages_over_time(visit: &Visit) -> Vec<(f64, f64)> {
    let every_tenth = visit.moments.iter().step_by(10);
    every_tenth.filter_map(|moment| Some((moment.at_s, moment.age_ms?))).collect()
}

/// The row of a path that stays as it is.
fn steady(&Path { name, link, .. }: &Path, visit: &Visit, scene: &str, report: &mut Report) {
    let mut row = row(name, link, scene, visit);
    let (ages_ms, updates_s) = (visit.ages_ms(SETTLES_S), visit.updates_s(SETTLES_S));
    let intervals_ms: Vec<f64> = updates_s.windows(2).map(|pair| (pair[1] - pair[0]) * 1e3).collect();
    let mut set = |name: &str, values: &[f64]| {
        Spread::of(values, Better::Lower).into_iter().for_each(|spread| row.time_ms.set(name, spread));
    };
    set("age", &ages_ms);
    set("interval", &intervals_ms);
    let last_s = visit.moments.last().map_or(0.0, |moment| moment.at_s);
    let bytes = (visit.bytes_at(last_s) - visit.bytes_at(SETTLES_S)) as f64;
    let goodput_mbit = bytes * 8.0 / 1e6 / (last_s - SETTLES_S).max(1.0);
    row.counts.set("goodput_mbit_per_s", goodput_mbit);
    let p99_ms = (!ages_ms.is_empty()).then(|| Percentiles::of(ages_ms).p99);
    p99_ms.into_iter().for_each(|value| row.counts.set("age_p99_ms", value));
    let Ok(link) = link.parse::<Link>() else { return };
    if let Some(mbit) = link.mbit.filter(|_| name == FULL || name == KERNEL.name) {
        let what = format!("{name}: what it carries over goodput");
        report.bars.push(Bar::at_most(what, 1.0 / GOODPUT_SHARE, Some(mbit / goodput_mbit), ""));
    }
    if let (Some(p99_ms), Some(interval)) = (p99_ms, row.time_ms.get("interval"))
        && link.queue_s.is_some()
        && link.fading.is_none()
    {
        let most_ms = 2.0 * link.rtt_s * 1e3 + 2.0 * interval.median;
        report.bars.push(Bar::at_most(
            format!("{name}: age of 99 of 100 frames over 2 round trips and 2 updates"),
            1.0,
            Some(p99_ms / most_ms),
            "",
        ));
    }
    report.rows.push(row);
}

/// The row of a path that goes away and comes back at `end_s`.
fn came_back(name: &str, link: &str, end_s: f64, visit: &Visit, scene: &str, report: &mut Report) {
    let mut row = row(name, link, scene, visit);
    let last_s = visit.moments.last().map_or(0.0, |moment| moment.at_s);
    let open_s = visit.open_since_s();
    let full_s = visit.updates_s(BLACKOUT_BEGINS_S).last().copied().into_iter().chain(open_s).reduce(f64::max);
    let is_whole = |full_s: &f64| last_s - full_s >= QUIET_S;
    let back_s = open_s.map(|open_s| (open_s - end_s).max(0.0));
    let full_s = full_s.filter(is_whole).map(|full_s| (full_s - end_s).max(0.0));
    // A session that lived through it has its bytes counted on.
    let is_another = open_s.is_some_and(|open_s| open_s > BLACKOUT_BEGINS_S);
    let before = if is_another { 0 } else { visit.bytes_at(BLACKOUT_BEGINS_S) };
    let (first, again) = (visit.bytes_at(WALKS_S.start) as f64, visit.bytes_at(last_s).saturating_sub(before) as f64);
    row.bytes.set("first_set", first);
    row.bytes.set("resume", again);
    back_s.into_iter().for_each(|value| row.counts.set("back_s", value));
    full_s.into_iter().for_each(|value| row.counts.set("full_s", value));
    let share = (first > 0.0).then(|| again / first);
    share.into_iter().for_each(|value| row.counts.set("resume_share", value));
    report.bars.push(Bar::at_most(format!("{name}: all is there again"), FULL_WITHIN_S, full_s, "s"));
    report.bars.push(Bar::at_most(format!("{name}: bytes for that, of a first set"), RESUME_SHARE, share, "share"));
    report.rows.push(row);
}

fn row(name: &str, link: &str, scene: &str, visit: &Visit) -> Row {
    let mut row = Row::new(scene, name);
    row.parameters.set("link", link);
    row.counts.set("turn_ms", visit.longest_turn_ms);
    row
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::scratch_folder;

    #[test]
    fn a_network_that_goes_away_is_survived_for_few_bytes() {
        let mut run = Run::new(vec!["pillars".to_owned()], scratch_folder("network"));
        run.quick = true;
        let gpu = pollster::block_on(Gpu::new_headless()).expect("a GPU adapter, software or not");
        let link = "rtt=40,blackout=8000@4000".parse().expect("a link");
        let visit = visited(&gpu, &run, "pillars", (link, SMALL_PX), (1.0..1.0, 18.0)).expect("a visit");
        let open_s = visit.open_since_s().expect("open at the end");
        assert!(open_s > 12.0, "another session since {open_s} s");
        assert!(
            visit.bytes_at(17.9) * 10 < visit.bytes_at(4.0),
            "{} after {}",
            visit.bytes_at(17.9),
            visit.bytes_at(4.0)
        );
        let mut report = Report::new("network", "");
        came_back("away", "", 12.0, &visit, "pillars", &mut report);
        assert!(report.rows[0].figure("counts.back_s").is_some_and(|back_s| back_s < 4.0), "{:?}", report.rows[0]);
        std::fs::remove_dir_all(&run.out).expect("was written");
    }
}
