//! `vantage-load`: many clients of one server, without drawing.

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Duration;

use anyhow::Context;
use clap::{CommandFactory, Parser};
use protocol::message::Clock;
use vantage_bench::load::{self, Limits, Load, Report, Script};

/// Connects many clients that move, decode and acknowledge without drawing, and prints what they got.
#[derive(Debug, Parser)]
#[command(
    name = "vantage-load",
    version,
    after_help = "Behaviours: walk (made paths or traces), orbit (a round in 10 s), idle (stands still, each elsewhere), arrive (stands where the scene begins), reconnect (all leave without a word every 5 s \
                  and come back within half a second), stall (reads nothing in the last 3 s of every 8 s).\n\n\
                  Exit codes: 0 all clients got updates and every limit was kept; 1 a client ended by an error or got nothing, or a limit was passed; \
                  2 wrong usage.\n\n\
                  --completions SHELL prints completions for a shell, --manual the manual page."
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
    /// What the clients do: a behaviour, or several with the parts of the clients that they get, as walk:4,idle:1
    #[arg(long, default_value = "walk", value_name = "NAME[:PART],...")]
    script: Script,
    /// Over how many seconds the clients come; all stay to the end
    #[arg(long, default_value_t = 0.0, conflicts_with = "clock")]
    ramp: f64,
    /// Fail where 99 of 100 updates are not there within this time of the pose that they answer: 500ms, 2s, or a number of milliseconds
    #[arg(long, value_name = "TIME", value_parser = load::time)]
    max_p99: Option<Duration>,
    /// Fail where 99 of 100 intervals between two updates of a client are longer than this time
    #[arg(long, value_name = "TIME", value_parser = load::time)]
    max_interval_p99: Option<Duration>,
    /// A camera trace, one line `px py pz rx ry rz t_ms` a pose; given several times, clients that walk take them in turn.
    /// Without: eight made paths
    #[arg(long)]
    trace: Vec<PathBuf>,
    /// The first client presents and all others follow it
    #[arg(long, conflicts_with = "clock")]
    audience: bool,
    /// A relay where followers connect, in place of the server; may be given several times, and they take them in turn
    #[arg(long, value_name = "URL", requires = "audience")]
    follow_at: Vec<String>,
    /// So many clients decode what they get, the others only acknowledge it. Without: all, of an audience the presenter and five followers
    #[arg(long, value_name = "COUNT")]
    decode: Option<usize>,
    /// The clock that the server runs; virtual: seconds are of it, and nobody stalls or reconnects
    #[arg(long, value_enum, default_value_t)]
    clock: ClockName,
    /// The still built-in scene or file that the server shows: pictures of what the first five clients held at three moments are compared with it
    /// after the run
    #[arg(long, value_name = "FILE|NAME", conflicts_with = "audience")]
    quality: Option<String>,
    /// Write the figures as JSON
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Write limits, figures and plots over the time of the run as one page
    #[arg(long, value_name = "FILE")]
    html: Option<PathBuf>,
}

#[derive(Debug, Clone, Copy, Default, clap::ValueEnum)]
enum ClockName {
    #[default]
    Wall,
    Virtual,
}

fn main() -> ExitCode {
    if let Some(ends) = manual::answered(Options::command()) {
        return ends;
    }
    match run(&Options::parse()) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::FAILURE
        }
    }
}

/// Whether every limit was kept.
fn run(options: &Options) -> anyhow::Result<bool> {
    anyhow::ensure!(options.seconds > 0.0 && options.seconds < 1e6, "--seconds must be positive");
    anyhow::ensure!((0.0..options.seconds).contains(&options.ramp), "--ramp is shorter than --seconds");
    let clients = options.clients as usize;
    let decoding = options.decode.map_or(clients, |count| count.min(clients));
    anyhow::ensure!(
        options.quality.is_none() || decoding >= clients.min(load::LOOKED_AT),
        "--quality looks at what the first {} clients hold: --decode at least as many",
        load::LOOKED_AT
    );
    let report = load::runtime()?.block_on(load::run(&what_to_run(options)))?;
    print!("{}", load::text(&report));
    write(options, &report)?;
    let missed: Vec<String> = report.bars.iter().filter_map(load::missed).collect();
    for missed in &missed {
        eprintln!("error: {missed}");
    }
    Ok(missed.is_empty())
}

fn what_to_run(options: &Options) -> Load {
    Load {
        server: options.server.clone(),
        clients: options.clients as usize,
        duration: Duration::from_secs_f64(options.seconds),
        tells_progress: true,
        ramp: Duration::from_secs_f64(options.ramp),
        traces: options.trace.clone(),
        script: options.script.clone(),
        clock: match options.clock {
            ClockName::Wall => Clock::Wall,
            ClockName::Virtual => Clock::Virtual,
        },
        audience: options.audience,
        followed_at: options.follow_at.clone(),
        decoding: options.decode,
        scene: options.quality.clone(),
        limits: Limits { latency_p99: options.max_p99, interval_p99: options.max_interval_p99 },
    }
}

fn write(options: &Options, report: &Report) -> anyhow::Result<()> {
    let write = |path: &Path, text: String| {
        std::fs::write(path, text).with_context(|| format!("cannot write {}", path.display()))
    };
    if let Some(path) = &options.json {
        write(path, serde_json::to_string_pretty(report)?)?;
    }
    if let Some(path) = &options.html {
        let arguments: Vec<String> = std::env::args().skip(1).collect();
        let arguments = shlex::try_join(arguments.iter().map(String::as_str))?;
        write(path, load::page(report, &format!("vantage-load {arguments}"))?)?;
    }
    Ok(())
}
