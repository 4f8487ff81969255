//! Topic `others`: whether those who behave notice those who do not. Fifty clients of one server: first all honest, then half of them alone, then the same half
//! beside as many who are stalled or hostile (`hostile`), in turn, several times.
//!
//! Server, honest and hostile ones run in this process on loopback, each on threads of its own names. Everybody has addresses of his own, and what one address may take is counted on
//! loopback too.

mod hostile;

use std::net::SocketAddr;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use anyhow::Context;
use gpu::Gpu;
use protocol::message::Clock;
use server::imager::GpuImager;

use crate::load::{self, Behaviour, ClientReport, Limits, Load, Percentiles, Script};
use crate::report::plot::{Axes, Scatter, Series, draw_curves};
use crate::report::progress::Progress;
use crate::report::{Bar, Report, Row};
use crate::spent;
use crate::spread::{Better, Spread};
use crate::topic::{Run, Topic, scene_label};
use hostile::{Done, Kind, Pace, Peer};

/// See the module.
pub struct Others;

/// Of all clients half stay honest.
const CLIENTS: usize = 50;
const QUICK_CLIENTS: usize = 10;
const ROUNDS: usize = 5;
const QUICK_ROUNDS: usize = 1;
const RUN: Duration = Duration::from_secs(30);
const QUICK_RUN: Duration = Duration::from_secs(6);
/// What comes before everybody holds something is left out.
const SETTLES_S: f64 = 5.0;
/// In all rounds together.
const MALFORMED: f64 = 1e5;
const CONNECTIONS: f64 = 1e4;
/// Small images twice a second: a machine that has time left, so that who is late is late by others' doing.
const IMAGE_PX: u32 = 64;
const UPDATE_HZ: f64 = 2.0;
/// Between two looks at how old what a client shows is.
const LOOKS_EVERY_S: f64 = 0.05;
/// What is to be reached.
const LEAST_SHARE: f64 = 0.99;
const MOST_AGE_RATIO: f64 = 1.2;
const SOCKETS: &str = "sockets";
const HOSTILE: &str = "hostile";

impl Topic for Others {
    fn name(&self) -> &'static str {
        "others"
    }

    fn about(&self) -> &'static str {
        "Whether honest clients notice hostile ones: updates and age of half of fifty clients, beside as many honest ones, alone, and beside as many who stall, send bytes one by one, \
         break handshakes and messages, and open connections by the thousand."
    }

    fn default_scenes(&self, _: bool) -> Vec<String> {
        // Everything moves, so that there is an update at every tick, and what is shown grows old.
        vec!["pillars-moving".to_owned()]
    }

    fn run(&self, run: &Run, report: &mut Report) -> anyhow::Result<()> {
        let gpu = run.gpu(report)?.clone();
        let size = if run.quick { (QUICK_CLIENTS, QUICK_ROUNDS, QUICK_RUN) } else { (CLIENTS, ROUNDS, RUN) };
        describe(report, size);
        let scene = run.scenes.first().context("no scene")?;
        let (_, rounds, _) = size;
        let progress = Progress::new("others", (rounds * Beside::ALL.len()) as u64);
        let mut found = Vec::new();
        for round in 0..rounds {
            // Another order each time: what the machine does meanwhile falls on all alike.
            for place in 0..Beside::ALL.len() {
                let beside = Beside::ALL[(place + round) % Beside::ALL.len()];
                progress.say(format!("round {}: half of them {}", round + 1, beside.name()));
                found.push((round, beside, shown(&gpu, run, scene, beside, size)?));
                progress.step();
            }
        }
        rows(&found, &scene_label(scene), report);
        plot(&found, run, report)
    }
}

/// What half of the clients are beside.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Beside {
    Honest,
    Nobody,
    Hostile,
}

impl Beside {
    const ALL: [Beside; 3] = [Beside::Honest, Beside::Nobody, Beside::Hostile];

    fn name(self) -> &'static str {
        match self {
            Beside::Honest => "beside honest ones",
            Beside::Nobody => "alone",
            Beside::Hostile => "beside hostile ones",
        }
    }
}

fn describe(report: &mut Report, (clients, rounds, duration): (usize, usize, Duration)) {
    report.settings.set(
        "run",
        format!("{} s, of which the first {SETTLES_S} s are left out; {rounds} rounds", duration.as_secs()),
    );
    report.settings.set("clients", format!("{clients}, of which half are measured"));
    report.settings.set("images", format!("{IMAGE_PX} px a side, {UPDATE_HZ} updates a second at most"));
    report.notes = [
        "age: time now less the server's stamp of what a client holds, every 0.05 s, by the clock that pings agree on. Only the half that is honest in every run is measured.",
        "Hostile: a fifth each greet and read nothing any more; send a request byte by byte; ask for websockets as nobody may; send damaged messages; and open idle connections from many \
         addresses. Bars are of medians over the rounds; the spread of the rounds is that of the rows.",
        "Everything runs on this machine: hostile_cores is what making the attack takes of it, which honest clients lack, too.",
    ]
    .map(str::to_owned)
    .to_vec();
}

/// What a run showed.
struct Shown {
    ages_ms: Vec<f64>,
    updates_per_s: f64,
    errors: usize,
    done: Arc<Done>,
    cores: Option<[f64; 3]>,
    /// What the server says of itself.
    faults: u64,
    cut_off: u64,
}

impl Shown {
    fn age_p99_ms(&self) -> f64 {
        Percentiles::of(self.ages_ms.clone()).p99
    }
}

fn shown(
    gpu: &Gpu,
    run: &Run,
    scene: &str,
    beside: Beside,
    (clients, rounds, duration): (usize, usize, Duration),
) -> anyhow::Result<Shown> {
    let scene = run.load(scene)?;
    let named = |name: &str| {
        tokio::runtime::Builder::new_multi_thread().thread_name(name).worker_threads(2).enable_all().build()
    };
    let (sockets, attackers) = (named(SOCKETS)?, named(HOSTILE)?);
    let mut config =
        server::Config { port: 0, image_size_px: IMAGE_PX, update_hz: UPDATE_HZ, ..server::Config::default() };
    config.limits.peers.loopback = true;
    let imager = GpuImager::new(gpu, &scene, &config)?;
    let running = sockets.block_on(server::serve(config, Arc::new(scene), Box::new(imager)))?;
    let measured = clients / 2;
    let options = Load {
        server: format!("ws://{}", running.addr),
        clients: if beside == Beside::Honest { clients } else { measured },
        duration,
        tells_progress: false,
        ramp: Duration::from_secs(1),
        traces: run.trace_file().map(Path::to_owned).into_iter().collect(),
        script: Script::all(Behaviour::Walk),
        clock: Clock::Wall,
        audience: false,
        followed_at: Vec::new(),
        decoding: None,
        limits: Limits::default(),
        scene: None,
    };
    let done = Arc::<Done>::default();
    let before = spent::spent([SOCKETS, load::THREADS, HOSTILE]);
    if beside == Beside::Hostile {
        attack(&attackers, running.addr, (clients - measured, rounds, duration), &done);
    }
    let found = load::runtime()?.block_on(load::run(&options))?;
    let spent = spent::spent([SOCKETS, load::THREADS, HOSTILE]).zip(before).map(|(after, before)| after.since(&before));
    attackers.shutdown_background();
    let (faults, cut_off) =
        (running.stats.faults.load(Ordering::Relaxed), running.stats.cut_off.load(Ordering::Relaxed));
    sockets.block_on(running.stop());
    let honest = &found.clients[..measured];
    let ages_ms = honest.iter().flat_map(|client| ages_ms(client, duration.as_secs_f64())).collect();
    let updates: usize =
        honest.iter().map(|client| client.lags.iter().filter(|lag| lag.at_s >= SETTLES_S).count()).sum();
    let errors = honest.iter().filter(|client| client.error.is_some()).count();
    let updates_per_s = updates as f64 / (duration.as_secs_f64() - SETTLES_S) / measured as f64;
    let cores = spent.map(|spent| spent.named_s.map(|seconds| seconds / found.seconds));
    Ok(Shown { ages_ms, updates_per_s, errors, done, cores, faults, cut_off })
}

/// Sets hostile peers on a server, of all kinds alike.
fn attack(
    on: &tokio::runtime::Runtime,
    to: SocketAddr,
    (peers, rounds, duration): (usize, usize, Duration),
    done: &Arc<Done>,
) {
    let of_kind = peers as f64 / Kind::ALL.len() as f64;
    let each = |in_all: f64| in_all / rounds as f64 / duration.as_secs_f64() / of_kind;
    let pace = Pace {
        handshakes: each(MALFORMED / 4.0),
        messages: each(MALFORMED * 3.0 / 4.0),
        connections: each(CONNECTIONS),
    };
    let until = Instant::now() + duration;
    for index in 0..peers {
        let kind = Kind::ALL[index % Kind::ALL.len()];
        on.spawn(Peer { to, kind, index: index + 1, until, pace, done: done.clone() }.run());
    }
}

/// How old what a client shows is, from when all have settled.
fn ages_ms(client: &ClientReport, until_s: f64) -> Vec<f64> {
    let mut ages = Vec::new();
    let mut shown = client.lags.iter().peekable();
    let mut newest = None;
    for look in 0.. {
        let at_s = f64::from(look) * LOOKS_EVERY_S;
        if at_s >= until_s {
            break;
        }
        while let Some(lag) = shown.next_if(|lag| lag.at_s <= at_s) {
            newest = Some(lag);
        }
        if let Some(lag) = newest.filter(|_| at_s >= SETTLES_S) {
            ages.push((at_s - lag.at_s) * 1e3 + lag.ms);
        }
    }
    ages
}

fn median(values: impl Iterator<Item = f64>) -> Option<f64> {
    Spread::of(&values.collect::<Vec<_>>(), Better::Lower).map(|spread| spread.median)
}

fn rows(found: &[(usize, Beside, Shown)], scene: &str, report: &mut Report) {
    for (round, beside, shown) in found {
        let mut row = Row::new(scene, beside.name());
        row.parameters.set("round", *round as u64 + 1);
        Spread::of(&shown.ages_ms, Better::Lower).into_iter().for_each(|spread| row.time_ms.set("age", spread));
        row.counts.set("age_p99_ms", shown.age_p99_ms());
        row.counts.set("updates_per_s", shown.updates_per_s);
        row.counts.set("errors", shown.errors as f64);
        row.counts.set("cut_off", shown.cut_off as f64);
        row.counts.set("faults", shown.faults as f64);
        let count = |of: &std::sync::atomic::AtomicU64| of.load(Ordering::Relaxed) as f64;
        row.counts.set("malformed_handshakes", count(&shown.done.handshakes));
        row.counts.set("malformed_messages", count(&shown.done.messages));
        row.counts.set("hostile_connections", count(&shown.done.connections));
        if let Some([sockets, load, hostile]) = shown.cores {
            row.counts.set("sockets_cores", sockets);
            row.counts.set("load_cores", load);
            row.counts.set("hostile_cores", hostile);
        }
        report.rows.push(row);
    }
    let of = |beside: Beside, figure: fn(&Shown) -> f64| {
        median(found.iter().filter(|(_, was, _)| *was == beside).map(|(_, _, shown)| figure(shown)))
    };
    let ratio =
        |over: Beside, figure: fn(&Shown) -> f64| of(Beside::Hostile, figure).zip(of(over, figure)).map(|(a, b)| a / b);
    for over in [Beside::Honest, Beside::Nobody] {
        let than = over.name();
        report.bars.push(Bar::at_most(
            format!("updates of honest clients {than} over beside hostile ones"),
            1.0 / LEAST_SHARE,
            ratio(over, |shown| shown.updates_per_s).map(|share| 1.0 / share),
            "",
        ));
        report.bars.push(Bar::at_most(
            format!("age of 99 of 100 looks beside hostile ones over {than}"),
            MOST_AGE_RATIO,
            ratio(over, Shown::age_p99_ms),
            "",
        ));
    }
    let sum = |of: fn(&Shown) -> f64| Some(found.iter().map(|(_, _, shown)| of(shown)).sum::<f64>());
    report.bars.push(Bar::at_most("honest clients that ended by an error", 0.0, sum(|shown| shown.errors as f64), ""));
    report.bars.push(Bar::at_most("faults of the server", 0.0, sum(|shown| shown.faults as f64), ""));
}

/// Ages by share of the looks, of all rounds of a kind together.
fn plot(found: &[(usize, Beside, Shown)], run: &Run, report: &mut Report) -> anyhow::Result<()> {
    let series = Beside::ALL.map(|beside| {
        let mut ages: Vec<f64> =
            found.iter().filter(|(_, was, _)| *was == beside).flat_map(|(_, _, shown)| shown.ages_ms.clone()).collect();
        ages.sort_by(f64::total_cmp);
        let points = (0..=100).filter_map(|percent| {
            let age = ages.get((ages.len().saturating_sub(1)) * percent / 100)?;
            Some((percent as f64, *age))
        });
        Series { name: beside.name().to_owned(), points: points.collect() }
    });
    let path =
        run.figure(report, "others.svg", "Age of what honest clients show, by the share of looks that see less.");
    let (x_label, y_label) = ("% of looks".to_owned(), "ms".to_owned());
    let plot = Scatter { title: "age".into(), x_label, y_label, series: series.to_vec() };
    draw_curves(&plot, Axes { log_x: false, front: false }, &path)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::load::Timed;

    #[test]
    fn what_is_shown_grows_old_between_updates() {
        let lags = vec![Timed { at_s: 5.0, ms: 100.0 }, Timed { at_s: 6.0, ms: 50.0 }];
        let ages = ages_ms(&ClientReport { lags, ..ClientReport::default() }, 6.5);
        assert_eq!(ages.len(), 30);
        let near = |found: f64, expected: f64| assert!((found - expected).abs() < 1e-6, "{found} for {expected}");
        near(ages[0], 100.0);
        near(ages[19], 1050.0);
        near(ages[20], 50.0);
    }

    #[test]
    fn the_bars_are_of_medians_and_missed_where_honest_clients_suffer() {
        let shown = |updates_per_s: f64, age_ms: f64| Shown {
            ages_ms: vec![age_ms; 10],
            updates_per_s,
            errors: 0,
            done: Arc::default(),
            cores: None,
            faults: 0,
            cut_off: 0,
        };
        let missed = |hostile: (f64, f64)| {
            let runs = [(Beside::Honest, (2.0, 500.0)), (Beside::Nobody, (2.0, 500.0)), (Beside::Hostile, hostile)];
            let found: Vec<_> =
                runs.into_iter().map(|(beside, (updates, age))| (0, beside, shown(updates, age))).collect();
            let mut report = Report::new("others", "");
            rows(&found, "pillars-moving", &mut report);
            report.bars.iter().map(Bar::is_missed).collect::<Vec<_>>()
        };
        assert_eq!(missed((1.99, 590.0)), [false; 6]);
        assert_eq!(missed((1.9, 610.0)), [true, true, true, true, false, false]);
    }
}
