//! Topic `relay`: what an audience costs its server when it follows at relays, and what it gets there: processor time and bytes of the publisher, age of updates.
//!
//! A server whose images cost nothing, a real broker (`nats-server`), two relays, and clients over sockets, all on loopback. Server, relays and load run in this process, each on
//! threads of its own names, so that processor time is told apart in one run.

mod broker;
mod wall;

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Duration;

use anyhow::Context;
use protocol::message::Clock;
use server::broker::Broker;
use server::relay;
use tokio::runtime::Runtime;

use crate::load::{self, Behaviour, ClientReport, Limits, Load, Script};
use crate::report::progress::Progress;
use crate::report::{Bar, Report, Row};
use crate::spent::{self, Spent};
use crate::spread::{Better, Spread};
use crate::topic::{Run, Topic};
use broker::RunningBroker;
use wall::Wall;

/// See the module.
pub struct Relay;

/// Followers of one presenter.
const FOLLOWERS: [usize; 4] = [0, 10, 100, 1000];
const QUICK_FOLLOWERS: [usize; 2] = [0, 4];
const RELAYS: usize = 2;
/// How long each run takes.
const RUN: Duration = Duration::from_secs(20);
const QUICK_RUN: Duration = Duration::from_secs(5);
/// The name of what is presented.
const SCENE: &str = "wall";
/// Side of the server's images, in pixels.
const PRESENTER_PX: u32 = 32;
/// Names of threads: of the server's sockets and what it publishes, and of the relays.
const SOCKETS: &str = "sockets";
const RELAYING: &str = "relaying";
/// Of the largest audience at relays, by the smallest one there.
const MOST_GROWTH: f64 = 1.25;
const MOST_LAG_MS: f64 = 100.0;

/// Where followers connect.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum At {
    Server,
    Relays,
}

impl Topic for Relay {
    fn name(&self) -> &'static str {
        "relay"
    }

    fn about(&self) -> &'static str {
        "What followers of one presenter cost his server, and how old updates are when they come, where they follow at two relays behind a NATS broker and where \
         they follow at the server."
    }

    fn default_scenes(&self, _: bool) -> Vec<String> {
        // None is drawn.
        Vec::new()
    }

    fn run(&self, run: &Run, report: &mut Report) -> anyhow::Result<()> {
        let followers: &[usize] = if run.quick { &QUICK_FOLLOWERS } else { &FOLLOWERS };
        describe(report, run.quick);
        run.read_trace()?;
        let progress = Progress::new("relay", 2 * followers.len() as u64);
        for at in [At::Server, At::Relays] {
            for &count in followers {
                let method = method(at, count);
                progress.say(&method);
                let row = followed(run, (at, count));
                report.rows.push(row.unwrap_or_else(|error| Row::failed(SCENE, &method, &error)));
                progress.step();
            }
        }
        bars(followers, report);
        Ok(())
    }
}

fn method(at: At, followers: usize) -> String {
    match at {
        At::Server => format!("{followers} at the server"),
        At::Relays => format!("{followers} at {RELAYS} relays"),
    }
}

fn describe(report: &mut Report, quick: bool) {
    report.settings.set("run", format!("{} s", if quick { QUICK_RUN } else { RUN }.as_secs()));
    report.settings.set("images", format!("{PRESENTER_PX} px a side"));
    report.notes = [
        "Everything runs on this machine: load, broker and relays share its cores. Nothing is drawn: what is presented is a wall of noise that changes at every tick.",
        "sockets_ms_per_update: processor time of the server's threads for sockets and publishing, by the updates that the presenter was sent; published: bytes that the server \
         gave the broker, by the same. Both hold what the presenter's own session takes.",
        "relays_cores, broker_cores: processor seconds a second. Relays hand updates to their followers, as the server does to its own.",
        "lag: from the server's stamp of an update to its last byte at the follower. At relays it goes by the relay's clock, which is the server's but for the time that the \
         first word of it took.",
        "gaps: updates that neither followed the one before nor began anew; strays: updates that came to another digest than the same number did elsewhere. Five followers decode \
         what they get, and hold the digest against it; the others acknowledge it by its head.",
    ]
    .map(str::to_owned)
    .to_vec();
}

/// Two relays, on threads of their own.
struct Relays {
    runtime: Runtime,
    running: Vec<relay::Running>,
}

impl Relays {
    fn start(broker: &Broker, clients: usize) -> anyhow::Result<Relays> {
        let runtime = tokio::runtime::Builder::new_multi_thread().thread_name(RELAYING).enable_all().build()?;
        let mut config = server::Config { port: 0, ..server::Config::default() };
        config.limits.clients = clients.max(1);
        let start = || runtime.block_on(relay::serve(config.clone(), broker.clone()));
        let running = (0..RELAYS).map(|_| start()).collect::<Result<_, _>>()?;
        Ok(Relays { runtime, running })
    }

    fn urls(&self) -> Vec<String> {
        self.running.iter().map(|relay| format!("ws://{}", relay.addr)).collect()
    }

    /// Waits until they know their server.
    fn know(&self) -> anyhow::Result<()> {
        let known = || self.running.iter().all(|relay| relay.relay.knows_a_server());
        for _ in 0..1000 {
            if known() {
                return Ok(());
            }
            std::thread::sleep(Duration::from_millis(10));
        }
        anyhow::bail!("the relays hear of no server")
    }

    fn stop(self) {
        for relay in self.running {
            self.runtime.block_on(relay.stop());
        }
    }
}

/// Serves one presenter and those who follow him for a time.
fn followed(run: &Run, (at, followers): (At, usize)) -> anyhow::Result<Row> {
    // Both ends of each connection are here.
    load::allow_files(2 * followers + 64)?;
    let (broker, named) = RunningBroker::start()?;
    let relays = Relays::start(&named, followers)?;
    let sockets = tokio::runtime::Builder::new_multi_thread().thread_name(SOCKETS).enable_all().build()?;
    let publish = Some(named);
    let mut config = server::Config { port: 0, image_size_px: PRESENTER_PX, publish, ..server::Config::default() };
    config.limits.clients = followers + 1;
    let running = sockets.block_on(server::serve(config, Arc::new(wall::room()), Box::new(Wall)))?;
    relays.know()?;
    let runtime = load::runtime()?;
    let options = Load {
        server: format!("ws://{}", running.addr),
        clients: followers + 1,
        duration: if run.quick { QUICK_RUN } else { RUN },
        tells_progress: false,
        ramp: Duration::ZERO,
        traces: run.trace_file().map(Path::to_owned).into_iter().collect(),
        script: Script::all(Behaviour::Walk),
        clock: Clock::Wall,
        audience: true,
        followed_at: if at == At::Relays { relays.urls() } else { Vec::new() },
        decoding: None,
        limits: Limits::default(),
        scene: None,
    };
    let stats = running.stats.clone();
    let spent_s = || spent::spent([SOCKETS, RELAYING]).zip(broker.spent_s());
    let before = spent_s();
    let found = runtime.block_on(load::run(&options));
    let spent = spent_s().zip(before).map(|((after, broker_after_s), (before, broker_before_s))| {
        (after.since(&before), broker_after_s - broker_before_s)
    });
    let gaps: u64 = relays.running.iter().map(|relay| relay.relay.heard.gaps.load(Ordering::Relaxed)).sum();
    relays.stop();
    let published = &stats.published;
    let bytes = published.bytes.load(Ordering::Relaxed) as f64;
    let wholes = published.wholes.load(Ordering::Relaxed) as f64;
    sockets.block_on(running.stop());
    let found = found?;
    anyhow::ensure!(found.errors == 0, "{} of {followers} followers ended by an error", found.errors);
    let mut row = measured(&method(at, followers), &found, spent)?;
    row.bytes.set("published", bytes / row.figure("counts.updates").unwrap_or(f64::NAN));
    row.counts.set("wholes", wholes);
    row.counts.set("gaps_at_relays", gaps as f64);
    Ok(row)
}

/// The figures of a run.
fn measured(method: &str, found: &load::Report, spent: Option<(Spent<2>, f64)>) -> anyhow::Result<Row> {
    let (presenter, followers) = found.clients.split_first().context("no presenter")?;
    let mut row = Row::new(SCENE, method);
    let updates = presenter.updates as f64;
    let lags_ms: Vec<f64> = followers.iter().flat_map(|client| client.lags.iter().map(|lag| lag.ms)).collect();
    Spread::of(&lags_ms, Better::Lower).into_iter().for_each(|spread| row.time_ms.set("lag", spread));
    let sum = |of: fn(&ClientReport) -> u64| followers.iter().map(of).sum::<u64>() as f64;
    row.counts.set("followers", followers.len() as f64);
    row.counts.set("updates", updates);
    row.counts.set("updates_per_s", updates / found.seconds);
    if !followers.is_empty() {
        row.counts.set("lag_p99_ms", load::Percentiles::of(lags_ms).p99);
        row.counts.set("received_per_follower", sum(|client| client.updates) / followers.len() as f64);
    }
    row.counts.set("gaps", sum(|client| client.gaps));
    row.counts.set("strays", sum(|client| client.strays));
    if let Some((Spent { named_s: [on_sockets_s, relaying_s], .. }, broker_s)) = spent {
        row.counts.set("sockets_ms_per_update", on_sockets_s * 1e3 / updates);
        row.counts.set("relays_cores", relaying_s / found.seconds);
        row.counts.set("broker_cores", broker_s / found.seconds);
    }
    Ok(row)
}

/// The largest audience at relays beside the smallest one there.
fn bars(followers: &[usize], report: &mut Report) {
    let figure = |count: Option<&usize>, path: &str| {
        let method = method(At::Relays, *count?);
        report.rows.iter().find(|row| row.method == method)?.figure(path)
    };
    let (least, most) = (followers.iter().find(|count| **count > 0), followers.last());
    let growth = |path| figure(most, path).zip(figure(least, path)).map(|(most, least)| most / least);
    let many = method(At::Relays, most.copied().unwrap_or(0));
    let few = least.copied().unwrap_or(0);
    let bars = [
        Bar::at_most(
            format!("{many}: the server's processor time for an update, by that for {few}"),
            MOST_GROWTH,
            growth("counts.sockets_ms_per_update"),
            "",
        ),
        Bar::at_most(
            format!("{many}: bytes published of an update, by those for {few}"),
            MOST_GROWTH,
            growth("bytes.published"),
            "",
        ),
        Bar::at_most(format!("{many}: lag of 99 of 100 updates"), MOST_LAG_MS, figure(most, "counts.lag_p99_ms"), "ms"),
        Bar::at_most(
            format!("{many}: gaps and strays"),
            0.0,
            figure(most, "counts.gaps").zip(figure(most, "counts.strays")).map(|(gaps, strays)| gaps + strays),
            "",
        ),
    ];
    report.bars.extend(bars);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn followers_at_relays_get_what_is_presented_and_are_counted() {
        if RunningBroker::start().is_err() {
            return println!("skipped: there is no nats-server on the PATH");
        }
        let mut run = Run::new(Vec::new(), std::env::temp_dir());
        run.quick = true;
        let row = followed(&run, (At::Relays, 4)).expect("a run");
        let figure = |path: &str| row.figure(path).unwrap_or(f64::NAN);
        assert!(figure("counts.received_per_follower") > 2.0 && figure("bytes.published") > 100.0, "{row:?}");
        assert_eq!((figure("counts.gaps"), figure("counts.strays")), (0.0, 0.0), "{row:?}");
        let idle = followed(&run, (At::Relays, 0)).expect("a run");
        assert_eq!(idle.figure("bytes.published"), Some(0.0), "nobody follows");
    }
}
