//! `vantage-report`: reports with figures, the truth of a scene, and scores of frames.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Args, FromArgMatches};
use vantage_bench::compare::folder::compare_folders;
use vantage_bench::render::{RenderArgs, render};
use vantage_bench::report::write::terminal_text;
use vantage_bench::topic::{Run, Topic, run_topic};
use vantage_bench::{options, topics};

/// What a process says with its exit code beside 0 (done) and 2 (wrong arguments).
const FAILED: u8 = 1;
/// `EX_UNAVAILABLE` of sysexits.h: there is no graphics adapter.
const NO_ADAPTER: u8 = 69;

/// Scores a folder of frames against their truths, as `vantage-report render` draws them.
#[derive(Args)]
struct CompareArgs {
    /// Folder with frame_00000.png and so on, and the viewer's stats.json if there is one.
    #[arg(long, value_name = "DIR")]
    frames: PathBuf,
    /// Folder with the truth of each frame under the same name, and covered_00000.png if there is one.
    #[arg(long, value_name = "DIR")]
    truth: PathBuf,
    /// Write the figures as JSON, and as CSV beside it.
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

/// What every topic takes.
#[derive(Args)]
struct TopicArgs {
    /// A built-in scene or a scene file (glTF, GLB, OBJ, PLY); may be given several times. Default: the topic's own.
    #[arg(long, value_name = "FILE|NAME")]
    scene: Vec<String>,
    /// A camera trace, one line `px py pz rx ry rz t_ms` a pose, for topics that follow one; `auto`: one of the topic's own.
    #[arg(long, value_name = "FILE|auto")]
    trace: Option<PathBuf>,
    /// Size of the output in pixels. Default: the topic's own.
    #[arg(long, value_name = "WxH", value_parser = options::size)]
    size: Option<(u32, u32)>,
    /// Where the files go. Default: target/report/TOPIC.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Fewer runs, for continuous integration; the report says which.
    #[arg(long)]
    quick: bool,
}

fn command() -> clap::Command {
    let compare = CompareArgs::augment_args(clap::Command::new("compare"));
    let render = RenderArgs::augment_args(clap::Command::new("render"));
    let topic = |topic: &&dyn Topic| {
        topic.arguments(TopicArgs::augment_args(clap::Command::new(topic.name())).about(topic.about()))
    };
    clap::Command::new("vantage-report")
        .about("Reports with figures, the truth of a scene, and scores of frames.")
        .after_help("Exit code: 0 done, 1 a run could not be made, 2 wrong arguments, 69 no graphics adapter.")
        .version(env!("CARGO_PKG_VERSION"))
        .subcommand_required(true)
        .arg_required_else_help(true)
        .subcommands(topics::ALL.iter().map(topic))
        .subcommand(render)
        .subcommand(compare)
}

fn main() -> ExitCode {
    tracing_subscriber::fmt()
        .with_env_filter(tracing_subscriber::EnvFilter::try_from_default_env().unwrap_or_else(|_| "warn".into()))
        .with_writer(std::io::stderr)
        .init();
    let matches = command().get_matches();
    let (name, matches) = matches.subcommand().expect("a subcommand is required");
    let outcome = match name {
        "compare" => CompareArgs::from_arg_matches(matches).map_err(Into::into).and_then(|args| compare(&args)),
        "render" => RenderArgs::from_arg_matches(matches).map_err(Into::into).and_then(|args| render(&args)),
        name => {
            let topic = topics::ALL.iter().find(|topic| topic.name() == name).expect("clap knows the topics only");
            TopicArgs::from_arg_matches(matches).map_err(Into::into).and_then(|args| report(*topic, args, matches))
        }
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error:#}");
            let no_adapter = |cause: &(dyn std::error::Error + 'static)| {
                matches!(cause.downcast_ref(), Some(gpu::GpuError::NoAdapter))
            };
            ExitCode::from(if error.chain().any(no_adapter) { NO_ADAPTER } else { FAILED })
        }
    }
}

fn compare(args: &CompareArgs) -> anyhow::Result<()> {
    let comparison = compare_folders(&args.frames, &args.truth)?;
    let table = comparison.table();
    print!("{}", table.text());
    if let Some(json) = &args.json {
        std::fs::write(json, serde_json::to_string_pretty(&comparison)?)?;
        std::fs::write(json.with_extension("csv"), table.csv())?;
    }
    Ok(())
}

fn report(topic: &dyn Topic, args: TopicArgs, matches: &clap::ArgMatches) -> anyhow::Result<()> {
    let out = args.out.unwrap_or_else(|| ["target", "report", topic.name()].iter().collect());
    let scenes = if args.scene.is_empty() { topic.default_scenes(args.quick) } else { args.scene };
    let mut run = Run::new(scenes, out).with_matches(matches.clone());
    (run.trace, run.size_px, run.quick) = (args.trace, args.size, args.quick);
    let report = run_topic(topic, &run)?;
    println!("{}", terminal_text(&report));
    println!("{}", run.out.join("index.html").display());
    anyhow::ensure!(!report.has_failures(), "a run could not be made: see the rows that failed");
    Ok(())
}
