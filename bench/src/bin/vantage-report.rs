//! `vantage-report`: reports with figures, the truth of a scene, and scores of frames.

use std::path::Path;
use std::process::ExitCode;

use clap::FromArgMatches;
use vantage_bench::all::{AllArgs, all};
use vantage_bench::beside::{BesideArgs, beside};
use vantage_bench::command::{CompareArgs, StudioArgs, TopicArgs, command};
use vantage_bench::compare::folder::compare_folders;
use vantage_bench::render::{RenderArgs, render};
use vantage_bench::report::Report;
use vantage_bench::report::write::terminal_text;
use vantage_bench::topic::{Run, Topic, run_topic};
use vantage_bench::topics;

/// What a process says with its exit code beside 0 (done) and 2 (wrong arguments).
const FAILED: u8 = 1;
/// `EX_UNAVAILABLE` of sysexits.h: there is no graphics adapter.
const NO_ADAPTER: u8 = 69;

fn main() -> ExitCode {
    tracing_subscriber::fmt()
        .with_env_filter(tracing_subscriber::EnvFilter::try_from_default_env().unwrap_or_else(|_| "warn".into()))
        .with_writer(std::io::stderr)
        .init();
    let matches = command().get_matches();
    let (name, matches) = matches.subcommand().expect("a subcommand is required");
    let outcome = match name {
        "all" => AllArgs::from_arg_matches(matches).map_err(Into::into).and_then(|args| all(&args)),
        "beside" => BesideArgs::from_arg_matches(matches).map_err(Into::into).and_then(|args| show_beside(&args)),
        "compare" => CompareArgs::from_arg_matches(matches).map_err(Into::into).and_then(|args| compare(&args)),
        "render" => RenderArgs::from_arg_matches(matches).map_err(Into::into).and_then(|args| render(&args)),
        "studio" => StudioArgs::from_arg_matches(matches).map_err(Into::into).and_then(|args| studio(&args)),
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

fn studio(args: &StudioArgs) -> anyhow::Result<()> {
    Ok(scene::Environment::studio().write_hdr(&args.file)?)
}

fn report(topic: &dyn Topic, args: TopicArgs, matches: &clap::ArgMatches) -> anyhow::Result<()> {
    let out = args.out.unwrap_or_else(|| ["target", "report", topic.name()].iter().collect());
    let scenes = if args.scene.is_empty() { topic.default_scenes(args.quick) } else { args.scene };
    let mut run = Run::new(scenes, out).with_matches(matches.clone());
    (run.trace, run.size_px, run.quick) = (args.trace, args.size, args.quick);
    show(&run_topic(topic, &run)?, &run.out)
}

fn show_beside(args: &BesideArgs) -> anyhow::Result<()> {
    show(&beside(args)?, &args.out)
}

fn show(report: &Report, out: &Path) -> anyhow::Result<()> {
    println!("{}", terminal_text(report));
    println!("{}", out.join("index.html").display());
    anyhow::ensure!(!report.has_failures(), "a run could not be made: see the rows that failed");
    Ok(())
}
