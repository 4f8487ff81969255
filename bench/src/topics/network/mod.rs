//! Topic `network`: what a viewer has through networks that are slow, lose packets, queue for a second, or go away: age, goodput, and how soon all is there again.
//!
//! A real server, the client's own library, and between them a proxy that shows loss and blackouts as TCP does ([`network::LinkModel`]). Nothing is drawn.

mod visit;

use std::sync::Arc;

use anyhow::Context;
use gpu::Gpu;
use network::Link;
use server::imager::GpuImager;

use crate::load::Percentiles;
use crate::report::plot::{Axes, Scatter, Series, draw_curves};
use crate::report::progress::Progress;
use crate::report::{Bar, Report, Row};
use crate::spread::{Better, Spread};
use crate::topic::{Run, Topic, scene_label};
use visit::{Visit, Way, visit};

/// See the module.
pub struct Network;

/// Paths, and what they are called. Delays and rates are those of the kinds of access that they name; none is a recording.
const LINKS: [(&str, &str); 9] = [
    ("none", ""),
    ("fibre", "rtt=20,mbit=100"),
    ("cable", "rtt=20,jitter=5,mbit=20"),
    ("mobile", "rtt=100,jitter=30,mbit=10"),
    ("far and slow", "rtt=300,mbit=2"),
    ("1 % lost", "rtt=100,mbit=20,loss=1"),
    ("5 % lost", "rtt=100,mbit=20,loss=5"),
    ("5 % lost, far", "rtt=300,mbit=20,loss=5"),
    ("a queue of 1 s", "rtt=40,mbit=2,queue=1000"),
];
const QUICK_LINKS: [(&str, &str); 2] = [("none", ""), ("a queue of 1 s", "rtt=40,mbit=2,queue=1000")];
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
/// Sides of the server's images, in pixels: small, as the network is measured and not the renderer.
const IMAGE_PX: u32 = 128;
/// All is there again after so long, for this share of a first set.
const FULL_WITHIN_S: f64 = 3.0;
const RESUME_SHARE: f64 = 0.1;
/// Until nothing more came for so long a set is not whole.
const QUIET_S: f64 = 2.0;

impl Topic for Network {
    fn name(&self) -> &'static str {
        "network"
    }

    fn about(&self) -> &'static str {
        "What a viewer has through networks that are slow, lose packets, queue for a second or go away: age, goodput, and how soon and for how many bytes all is there \
         again. A real server and the client's own library, without drawing."
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
        let links: &[_] = if run.quick { &QUICK_LINKS } else { &LINKS };
        let blackouts_s: &[f64] = if run.quick { &QUICK_BLACKOUTS_S } else { &BLACKOUTS_S };
        let progress = Progress::new("network", (links.len() + blackouts_s.len()) as u64);
        let mut ages = Vec::new();
        for &(name, text) in links {
            progress.say(format!("{name} in {}", scene_label(moving)));
            let link: Link = text.parse()?;
            match visited(&gpu, run, moving, link, (WALKS_S.start..f64::INFINITY, duration_s(run.quick))) {
                Ok(visit) => {
                    ages.push(Series { name: name.to_owned(), points: ages_over_time(&visit) });
                    steady(name, text, &visit, &scene_label(moving), report);
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
            match visited(&gpu, run, still, text.parse()?, (WALKS_S, end_s + AFTER_S)) {
                Ok(visit) => came_back(&name, &text, end_s, &visit, &scene_label(still), report),
                Err(error) => report.rows.push(Row::failed(&scene_label(still), &name, &error)),
            }
            progress.step();
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
    report.settings.set("images", format!("{IMAGE_PX} px a side"));
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
    link: Link,
    (walks_s, duration_s): (std::ops::Range<f64>, f64),
) -> anyhow::Result<Visit> {
    let scene = run.load(name)?;
    let runtime = tokio::runtime::Runtime::new()?;
    let config = server::Config { port: 0, image_size_px: IMAGE_PX, anticipation: false, ..server::Config::default() };
    let imager = GpuImager::new(gpu, &scene, &config)?;
    let running = runtime.block_on(server::serve(config, Arc::new(scene), Box::new(imager)))?;
    let trace = run.read_trace()?;
    let way = Way { trace: trace.as_ref(), walks_s };
    let visit = visit(&format!("ws://{}/ws", running.addr), link, &way, duration_s);
    runtime.block_on(running.stop());
    visit
}

/// Age by second of a visit.
fn ages_over_time(visit: &Visit) -> Vec<(f64, f64)> {
    let every_tenth = visit.moments.iter().step_by(10);
    every_tenth.filter_map(|moment| Some((moment.at_s, moment.age_ms?))).collect()
}

/// The row of a path that stays as it is.
fn steady(name: &str, link: &str, visit: &Visit, scene: &str, report: &mut Report) {
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
    row.counts.set("goodput_mbit_per_s", bytes * 8.0 / 1e6 / (last_s - SETTLES_S).max(1.0));
    let p99_ms = (!ages_ms.is_empty()).then(|| Percentiles::of(ages_ms).p99);
    p99_ms.into_iter().for_each(|value| row.counts.set("age_p99_ms", value));
    let Ok(link) = link.parse::<Link>() else { return };
    if let (Some(p99_ms), Some(interval)) = (p99_ms, row.time_ms.get("interval"))
        && link.queue_s.is_some()
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
        let visit = visited(&gpu, &run, "pillars", link, (1.0..1.0, 18.0)).expect("a visit");
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
