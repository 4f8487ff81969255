//! `vantage-load`: many clients of one server, without drawing.

use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Duration;

use anyhow::Context;
use clap::Parser;
use protocol::message::Clock;
use vantage_bench::load::{self, Load, Report};

/// Connects many clients that move, decode and acknowledge without drawing, and prints what they got.
#[derive(Debug, Parser)]
#[command(
    name = "vantage-load",
    version,
    after_help = "Exit codes: 0 all clients ran, 1 one failed or a limit was passed, 2 wrong usage."
)]
struct Options {
    /// The server, ws://HOST:PORT; add ?token=... where it asks for one
    #[arg(long, default_value = "ws://127.0.0.1:8080")]
    server: String,
    /// How many clients
    #[arg(long, default_value_t = 10, value_parser = clap::value_parser!(u32).range(1..=10_000))]
    clients: u32,
    /// How long, in seconds
    #[arg(long, default_value_t = 10.0)]
    seconds: f64,
    /// Over how many seconds the clients come; all stay to the end
    #[arg(long, default_value_t = 0.0, conflicts_with = "clock")]
    ramp: f64,
    /// Fail where 99 of 100 updates are not there within so many milliseconds of the pose that they answer
    #[arg(long, value_name = "MS")]
    max_p99: Option<f64>,
    /// Fail where 99 of 100 intervals between two updates of a client are longer than so many milliseconds
    #[arg(long, value_name = "MS")]
    max_interval_p99: Option<f64>,
    /// A camera trace, one line `px py pz rx ry rz t_ms` a pose; given several times, clients take them in turn.
    /// Without: eight made paths
    #[arg(long)]
    trace: Vec<PathBuf>,
    /// The first client presents and all others follow it; of those five decode what they get, the others only acknowledge it
    #[arg(long, conflicts_with = "clock")]
    audience: bool,
    /// Share of the clients, in percent, that stop reading after a quarter of the time
    #[arg(long, default_value_t = 0.0)]
    stall: f64,
    /// The clock that the server runs; virtual: seconds are of it, and nothing stalls
    #[arg(long, value_enum, default_value_t)]
    clock: ClockName,
    /// The still built-in scene or file that the server shows: pictures of what the first five clients held at three moments are compared with it
    /// after the run
    #[arg(long, value_name = "FILE|NAME", conflicts_with = "audience")]
    quality: Option<String>,
    /// Write the figures as JSON
    #[arg(long)]
    json: Option<PathBuf>,
}

#[derive(Debug, Clone, Copy, Default, clap::ValueEnum)]
enum ClockName {
    #[default]
    Wall,
    Virtual,
}

fn main() -> ExitCode {
    match run(&Options::parse()) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::FAILURE
        }
    }
}

/// Whether every client that reads ran to its end.
fn run(options: &Options) -> anyhow::Result<bool> {
    anyhow::ensure!(options.seconds > 0.0 && options.seconds < 1e6, "--seconds must be positive");
    anyhow::ensure!((0.0..=100.0).contains(&options.stall), "--stall is a share in percent");
    anyhow::ensure!((0.0..options.seconds).contains(&options.ramp), "--ramp is shorter than --seconds");
    let load = Load {
        server: options.server.clone(),
        clients: options.clients as usize,
        duration: Duration::from_secs_f64(options.seconds),
        ramp: Duration::from_secs_f64(options.ramp),
        traces: options.trace.clone(),
        stall: options.stall / 100.0,
        clock: match options.clock {
            ClockName::Wall => Clock::Wall,
            ClockName::Virtual => Clock::Virtual,
        },
        tells_progress: true,
        audience: options.audience,
        scene: options.quality.clone(),
    };
    let report = tokio::runtime::Builder::new_multi_thread().enable_all().build()?.block_on(load::run(&load))?;
    print!("{}", load::table(&report));
    if let Some(path) = &options.json {
        let json = serde_json::to_string_pretty(&report)?;
        std::fs::write(path, json).with_context(|| format!("cannot write {}", path.display()))?;
    }
    Ok(report.errors == 0 && keeps_limits(options, &report))
}

/// Whether a run stayed within what was asked; says what did not. What was not measured did not.
fn keeps_limits(options: &Options, report: &Report) -> bool {
    let limits = [
        ("from a pose to its update, 99 of 100", report.latency_ms.p99, options.max_p99),
        ("between two updates, 99 of 100", report.interval_ms.p99, options.max_interval_p99),
    ];
    let passed = limits.into_iter().filter_map(|(what, found, limit)| Some((what, found, limit?)));
    let passed: Vec<_> = passed.filter(|(_, found, limit)| found.is_nan() || found > limit).collect();
    for (what, found, limit) in &passed {
        eprintln!("error: {what}: {found:.0} ms, at most {limit:.0} were asked for");
    }
    passed.is_empty()
}
