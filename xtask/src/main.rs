//! `cargo xtask`: the commands of this repository, and everything that CI and the README call.
//!
//! Small on purpose: a bare machine builds it first, and it installs what the rest needs.

mod architecture;
mod beside;
mod circles;
mod commands;
mod fuzz;
mod package;
mod packaging;
mod pages;
mod run;
mod scripts;
mod setup;
mod test;
mod web;

use std::ffi::OsString;
use std::path::{Path, PathBuf};

use anyhow::Context;
use clap::{Parser, Subcommand};

use run::{Profile, built};
use setup::Need;

/// The commands of the Vantage repository.
#[derive(Parser)]
#[command(name = "cargo xtask", bin_name = "cargo xtask")]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Set up what is missing, build server and web client, and serve a scene on http://127.0.0.1:PORT.
    Serve {
        /// A scene file (glTF, GLB, OBJ, PLY, STL) or a built-in scene; without it, a built-in moving one.
        scene: Option<OsString>,
        /// A folder of scene files, each at `?scene=NAME`.
        #[arg(long, value_name = "FOLDER")]
        scenes: Option<OsString>,
        /// The port to listen on.
        #[arg(long, default_value_t = 8080)]
        port: u16,
        /// Passed on to vantage-server.
        #[arg(last = true)]
        server_arguments: Vec<OsString>,
    },
    /// Set up what is missing and run every check and test; ends with `N passed, N failed, N skipped`.
    Test {
        /// Run only the steps whose name holds one of these words.
        only: Vec<String>,
    },
    /// Build vantage-report in release and run a topic, e.g. `report timing --quick`, or `all`.
    Report {
        /// Passed on to vantage-report.
        #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
        arguments: Vec<OsString>,
    },
    /// Show models beside three.js: the same camera and environment, FLIP, a table and contact sheets.
    Beside(beside::BesideArgs),
    /// Look for bytes that break a promise: LLVM's fuzzer around a target of the fuzz crate, e.g. `fuzz wire --seconds 600`.
    Fuzz(fuzz::FuzzArgs),
    /// Walk in a browser beside a server on this machine: pictures a second, and the intervals between them.
    Frames {
        /// Passed on to tests/browser/frames.mjs, e.g. `--scene urban webgl2`.
        #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
        arguments: Vec<OsString>,
    },
    /// Show the cases of report `stability` that stand still in browsers, beside the native client's pictures.
    Stiff {
        /// Passed on to tests/browser/stiff.mjs, e.g. `--only mirror webgl2`.
        #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
        arguments: Vec<OsString>,
    },
    /// Build the native viewer in release and run it.
    View {
        /// Passed on to vantage-view.
        #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
        arguments: Vec<OsString>,
    },
    /// Build the web client into target/web.
    Web {
        /// Build the small, optimized client that is served; otherwise the one that builds fast.
        #[arg(long)]
        release: bool,
    },
    /// Build a folder to copy to a GPU host, target/package: the server in release with the web client in it, a systemd unit, settings, how to.
    Package,
    /// Install what building, serving and testing need, and nothing else.
    Setup,
}

fn main() -> anyhow::Result<()> {
    let (root, here) = (root()?, std::env::current_dir()?);
    std::env::set_current_dir(&root).with_context(|| format!("entering {}", root.display()))?;
    match Arguments::parse().command {
        Command::Serve { scene, scenes, port, server_arguments } => {
            let scenes = scenes.into_iter().flat_map(|folder| ["--scenes".into(), folder]);
            serve(&here, scene, port, scenes.chain(server_arguments).collect())
        }
        Command::Test { only } => test::run_all(&only),
        Command::Report { arguments } => report(&arguments),
        Command::Beside(arguments) => beside::beside(&arguments),
        Command::Fuzz(arguments) => fuzz::fuzz(&arguments),
        Command::Frames { arguments } => scripts::FRAMES.run(&arguments),
        Command::Stiff { arguments } => scripts::STIFF.run(&arguments),
        Command::View { arguments } => run_release(&here, "vantage-client", "vantage-view", &arguments),
        Command::Web { release } => {
            setup::install(&[Need::WasmTarget, Need::Clang])?;
            web::build(if release { web::Profile::Release } else { web::Profile::Fast }).map(|_| ())
        }
        Command::Package => package::package(),
        Command::Setup => setup::install(Need::USUAL),
    }
}

/// `here`: paths are as seen from there.
fn serve(here: &Path, scene: Option<OsString>, port: u16, mut server_arguments: Vec<OsString>) -> anyhow::Result<()> {
    // On this machine for whoever sits at it, who may as well drop a model of his own on the page.
    if !server_arguments.iter().any(|part| part == "--bind" || part == "--publish" || part == "--allow-uploads") {
        server_arguments.push("--allow-uploads".into());
    }
    setup::install(&[Need::Vulkan, Need::WasmTarget, Need::Clang])?;
    let (server, web_dir) = web::build_with_server()?;
    let web_dir = std::path::absolute(web_dir)?;
    run::Tool::new(server)
        .dir(here)
        .args(scene)
        .args(["--port".into(), port.to_string(), "--web".into(), web_dir.display().to_string()])
        .args(server_arguments)
        .replace_this_process()
}

fn report(arguments: &[OsString]) -> anyhow::Result<()> {
    let shows_video = |topic: &OsString| topic == "novel-views" || topic == "all";
    if arguments.first().is_some_and(shows_video)
        && let Err(error) = setup::install(&[Need::Ffmpeg])
    {
        println!("the report goes on without video: {error:#}");
    }
    if arguments.first().is_some_and(|topic| topic == "relay" || topic == "all")
        && let Err(error) = setup::install(&[Need::Nats])
    {
        println!("the report goes on without a broker: {error:#}");
    }
    // It runs the server as a process of its own, which stands beside it.
    let takes_server =
        |topic: &OsString| topic == "soak" || topic == "all" || arguments.iter().any(|part| part == "--kernel");
    if arguments.first().is_some_and(takes_server) {
        built(Profile::Release, "vantage-server", "vantage-server")?;
    }
    run_release(Path::new("."), "vantage-bench", "vantage-report", arguments)
}

fn run_release(here: &Path, package: &str, binary: &str, arguments: &[OsString]) -> anyhow::Result<()> {
    setup::install(&[Need::Vulkan])?;
    run::Tool::new(built(Profile::Release, package, binary)?).dir(here).args(arguments).replace_this_process()
}

/// The repository's root: the parent of this package.
fn root() -> anyhow::Result<PathBuf> {
    let manifest = PathBuf::from(env!("CARGO_MANIFEST_DIR"));
    manifest.parent().map(PathBuf::from).context("xtask lies in the repository")
}
