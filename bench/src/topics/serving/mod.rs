//! Topic `serving`: what many viewers of one server get, and what they cost it: walkers who each go their own way, and an audience that follows one.
//!
//! Server, load and plain axum run in this process on loopback, each on threads of its own names, so that processor time is told apart in one run.

mod host;
mod plain;

use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use anyhow::Context;
use gpu::Gpu;
use protocol::message::Clock;
use server::config::ComparesOn;
use server::imager::GpuImager;
use server::look_times::Part;
use server::pool::Pool;
use server::stats::Stats;

use crate::load::{self, Behaviour, ClientReport, Limits, Load, Script, Timed};
use crate::report::plot::{Axes, Scatter, Series, draw_curves};
use crate::report::progress::Progress;
use crate::report::{Bar, Report, Row};
use crate::spent::{self, Spent};
use crate::spread::{Better, Spread};
use crate::topic::{Run, Topic, scene_label};

/// See the module.
pub struct Serving;

/// The name of the threads of the server's sockets.
const SOCKETS: &str = "sockets";
/// Walkers, and followers of one presenter.
const WALKERS: [usize; 4] = [1, 4, 16, 50];
const QUICK_WALKERS: [usize; 1] = [2];
const FOLLOWERS: [usize; 4] = [1, 10, 100, 500];
const QUICK_FOLLOWERS: [usize; 1] = [3];
/// How long each run takes.
const RUN: Duration = Duration::from_secs(30);
const QUICK_RUN: Duration = Duration::from_secs(3);
/// Sides of the server's images, in pixels: of walkers, and of a presenter.
const WALKERS_PX: u32 = 256;
const PRESENTER_PX: u32 = 128;
/// Of the largest audience.
const MOST_LAG_MS: f64 = 100.0;
/// What plain axum sends by core-second, over what is sent to followers: 0.8 of it is to be reached.
const PLAIN_OVER_OURS: f64 = 1.25;

impl Topic for Serving {
    fn name(&self) -> &'static str {
        "serving"
    }

    fn about(&self) -> &'static str {
        "What many viewers of one server get, and what they cost it: updates a second, intervals, lag and processor time, of walkers who each go their \
         own way and of an audience that follows one presenter, beside a plain websocket server."
    }

    fn default_scenes(&self, _: bool) -> Vec<String> {
        // What is presented moves, so that there is an update at every tick.
        vec!["pillars".to_owned(), "pillars-moving".to_owned()]
    }

    fn run(&self, run: &Run, report: &mut Report) -> anyhow::Result<()> {
        let gpu = run.gpu(report)?.clone();
        describe(report, run.quick);
        let walkers: &[usize] = if run.quick { &QUICK_WALKERS } else { &WALKERS };
        let followers: &[usize] = if run.quick { &QUICK_FOLLOWERS } else { &FOLLOWERS };
        // The last scene is presented; where there are others, people walk in those.
        let (presented, others) = run.scenes.split_last().context("no scene")?;
        let walked = if others.is_empty() { std::slice::from_ref(presented) } else { others };
        let progress = Progress::new("serving", (walked.len() * (walkers.len() + 1) + followers.len()) as u64);
        for name in walked {
            for &clients in walkers {
                progress.say(format!("{clients} walkers in {}", scene_label(name)));
                let row = served(&gpu, run, name, (WALKERS_PX, ComparesOn::Faster), (clients, false))
                    .map(|served| served.row);
                report.rows.push(row.unwrap_or_else(|error| Row::failed(&scene_label(name), "walkers", &error)));
                progress.step();
            }
            progress.say(format!("a walker for the model in {}", scene_label(name)));
            match served(&gpu, run, name, (host::IMAGE_PX, ComparesOn::Gpu), (1, false)) {
                Ok(served) => host::rows(&served.row, report),
                Err(error) => report.rows.push(Row::failed(&scene_label(name), "a walker for the model", &error)),
            }
            progress.step();
        }
        let mut last = None;
        for &clients in followers {
            progress.say(format!("{clients} followers"));
            match served(&gpu, run, presented, (PRESENTER_PX, ComparesOn::Faster), (clients + 1, true)) {
                Ok(served) => {
                    report.rows.push(served.row.clone());
                    last = Some(served);
                }
                Err(error) => report.rows.push(Row::failed(&scene_label(presented), "followers", &error)),
            }
            progress.step();
        }
        if let Some(last) = last {
            bars(last, run, report)?;
        }
        plots(run, report)
    }
}

fn describe(report: &mut Report, quick: bool) {
    let duration = if quick { QUICK_RUN } else { RUN };
    report.settings.set("run", format!("{} s", duration.as_secs()));
    report.settings.set("images", format!("{WALKERS_PX} px a side for walkers, {PRESENTER_PX} for a presenter"));
    report.notes = [
        "Everything runs on this machine: the load takes a part of the cores. updates_per_s is of all clients together, without the presenter's; the others \
         are means a second.",
        "lag: from the server's stamp of an update to its last byte at the client, by the clock that pings agree on; interval: between two updates of a client.",
        "sockets_cores: processor seconds a second of the threads that sockets live on; looks_cores: of all others but the load's, which look, draw and encode; \
         mb_per_core_s: what clients got for a second of the sockets' threads.",
        "look_..._ms: means of a look's parts by the wall: views of the scene, the same of the copy, both laid beside each other (gpu: \
         waiting for that there), edits made and followed by the copy, all else, and bytes made of the edits, on a thread of its own. Where threads wait for cores, that is in it.",
        "GPU host: a model, see bench/README.md; its gpu_ms are assumed, all else is of one walker with larger images whose views are compared on the GPU, \
         though that is software here.",
        "Of an audience five clients decode what they get, and all others acknowledge it by its head.",
        "plain axum: messages of the same sizes to as many clients at the same rate, which only read them and say nothing.",
    ]
    .map(str::to_owned)
    .to_vec();
}

/// One run.
struct Served {
    row: Row,
    clients: usize,
    update_bytes: f64,
    updates_per_s: f64,
    lag_p99_ms: f64,
}

/// Serves clients of a scene for a time: walkers, or a presenter and those who follow him.
fn served(
    gpu: &Gpu,
    run: &Run,
    name: &str,
    (image_size_px, compares_on): (u32, ComparesOn),
    (clients, is_audience): (usize, bool),
) -> anyhow::Result<Served> {
    let scene = run.load(name)?;
    let sockets = tokio::runtime::Builder::new_multi_thread().thread_name(SOCKETS).enable_all().build()?;
    let mut config = server::Config { port: 0, image_size_px, compares_on, ..server::Config::default() };
    config.limits.clients = clients + 1;
    let imager = GpuImager::new(gpu, &scene, &config)?;
    let label = scene.name.clone();
    let running = sockets.block_on(server::serve(config, Arc::new(scene), Box::new(imager)))?;
    let runtime = load::runtime()?;
    let duration = if run.quick { QUICK_RUN } else { RUN };
    let options = Load {
        server: format!("ws://{}", running.addr),
        clients,
        duration,
        tells_progress: false,
        ramp: Duration::ZERO,
        traces: run.trace_file().map(Path::to_owned).into_iter().collect(),
        script: Script::all(Behaviour::Walk),
        clock: Clock::Wall,
        audience: is_audience,
        followed_at: Vec::new(),
        decoding: None,
        limits: Limits::default(),
        scene: None,
    };
    let (stats, pool) = (running.stats.clone(), running.pool().unwrap_or_default());
    let before = spent::spent([SOCKETS, load::THREADS]);
    let found = runtime.block_on(load::run(&options));
    let spent = spent::spent([SOCKETS, load::THREADS]).zip(before).map(|(after, before)| after.since(&before));
    sockets.block_on(running.stop());
    let found = found?;
    anyhow::ensure!(found.errors == 0, "{} of {clients} clients ended by an error", found.errors);
    Ok(measured(&label, &found, is_audience, (spent, &stats, &pool)))
}

/// The figures of a run; the presenter of an audience is not counted.
fn measured(
    label: &str,
    found: &load::Report,
    is_audience: bool,
    (spent, stats, pool): (Option<Spent<2>>, &Stats, &Pool),
) -> Served {
    let counted: Vec<&ClientReport> = found.clients.iter().skip(usize::from(is_audience)).collect();
    let method =
        if is_audience { format!("{} followers", counted.len()) } else { format!("{} walkers", counted.len()) };
    let mut row = Row::new(label, &method);
    let values = |of: fn(&ClientReport) -> &Vec<Timed>| -> Vec<f64> {
        counted.iter().flat_map(|client| of(client).iter().map(|timed| timed.ms)).collect()
    };
    let mut time = |name: &str, values: &[f64]| {
        Spread::of(values, Better::Lower).into_iter().for_each(|spread| row.time_ms.set(name, spread));
    };
    time("lag", &values(|client| &client.lags));
    time("interval", &values(|client| &client.intervals));
    time("pose_to_update", &values(|client| &client.latencies));
    let (updates, bytes) =
        counted.iter().fold((0, 0), |(updates, bytes), client| (updates + client.updates, bytes + client.bytes));
    let update_bytes = bytes as f64 / updates.max(1) as f64;
    row.bytes.set("update", update_bytes);
    row.counts.set("clients", counted.len() as f64);
    row.counts.set("updates_per_s", updates as f64 / found.seconds);
    if let Some(Spent { named_s: [on_sockets_s, on_load_s], all_s }) = spent {
        row.counts.set("sockets_cores", on_sockets_s / found.seconds);
        row.counts.set("looks_cores", (all_s - on_sockets_s - on_load_s) / found.seconds);
        row.counts.set("mb_per_core_s", bytes as f64 / 1e6 / on_sockets_s);
    }
    let look_times = &stats.look_times;
    row.counts.set("images_drawn", pool.drawn() as f64);
    row.counts.set("images_shared", pool.shared() as f64);
    row.counts.set("looks_shared", pool.looks_shared() as f64);
    row.counts.set("looks_per_s", look_times.looks() as f64 / found.seconds);
    for part in Part::ALL {
        row.counts.set(format!("look_{}_ms", part.name()), look_times.mean_ms(part));
    }
    let updates_per_s = updates as f64 / found.seconds / counted.len().max(1) as f64;
    Served { row, clients: counted.len(), update_bytes, updates_per_s, lag_p99_ms: found.lag_ms.p99 }
}

/// The largest audience beside what websockets alone cost.
fn bars(last: Served, run: &Run, report: &mut Report) -> anyhow::Result<()> {
    let duration = if run.quick { QUICK_RUN } else { RUN } / 3;
    let load = load::runtime()?;
    let size = (last.update_bytes.round().max(1.0) as usize, last.updates_per_s.max(0.1));
    let plain = plain::bytes_per_core_s(&load, last.clients, size, duration)? / 1e6;
    let mut row = Row::new(&last.row.scene, "plain axum");
    row.counts.set("clients", last.clients as f64);
    row.counts.set("mb_per_core_s", plain);
    let figure = |name: &str| last.row.figure(&format!("counts.{name}"));
    let of = format!("{} followers", last.clients);
    let ratio = figure("mb_per_core_s").map(|ours| plain / ours);
    report.bars.extend([
        Bar::at_most(format!("{of}: lag of 99 of 100 updates"), MOST_LAG_MS, Some(last.lag_p99_ms), "ms"),
        Bar::at_most(
            format!("{of}: cores for their sockets over those for the presenter's looks"),
            1.0,
            figure("sockets_cores").zip(figure("looks_cores")).map(|(sockets, looks)| sockets / looks),
            "",
        ),
        Bar::at_most(
            format!("{of}: what plain axum sends by core-second over what they get"),
            PLAIN_OVER_OURS,
            ratio,
            "",
        ),
    ]);
    report.rows.push(row);
    Ok(())
}

/// Updates and cores against the number of clients.
fn plots(run: &Run, report: &mut Report) -> anyhow::Result<()> {
    let kinds = [("walkers", "walkers who go their own ways"), ("followers", "followers of one presenter")];
    for (kind, who) in kinds {
        let points = |figure: &str| -> Vec<(f64, f64)> {
            let rows = report.rows.iter().filter(|row| row.method.ends_with(kind));
            rows.filter_map(|row| row.figure("counts.clients").zip(row.figure(figure))).collect()
        };
        let series: Vec<Series> = ["counts.sockets_cores", "counts.looks_cores"]
            .into_iter()
            .map(|figure| Series {
                name: figure.trim_start_matches("counts.").replace('_', " "),
                points: points(figure),
            })
            .collect();
        if series.iter().all(|series| series.points.is_empty()) {
            continue;
        }
        let path =
            run.figure(report, format!("{kind}.svg"), format!("Cores of the server against the number of {who}."));
        let plot =
            Scatter { title: format!("{kind}: cores"), x_label: "clients".into(), y_label: "cores".into(), series };
        draw_curves(&plot, Axes { log_x: true, front: false }, &path)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::scratch_folder;

    #[test]
    fn followers_get_what_is_presented_and_are_counted() {
        let out = scratch_folder("serving");
        let mut run = Run::new(vec!["pillars".to_owned()], out.clone());
        run.quick = true;
        let gpu = pollster::block_on(Gpu::new_headless()).expect("a GPU adapter, software or not");
        let served = served(&gpu, &run, "pillars-moving", (64, ComparesOn::Faster), (4, true)).expect("a run");
        assert_eq!((served.clients, served.row.method.as_str()), (3, "3 followers"));
        assert!(served.updates_per_s > 0.5 && served.update_bytes > 100.0, "{:?}", served.row);
        assert!(served.lag_p99_ms.is_finite());
        std::fs::remove_dir_all(out).expect("was written");
    }
}
