//! `vantage-server`: renders a scene as depth images and streams their samples to viewers.

// Whether a pipeline of wgpu may go from thread to thread is asked through all that it consists of.
#![recursion_limit = "256"]

use std::io::{stderr, stdout};
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;
use std::time::Duration;

use anyhow::Context;
use clap::CommandFactory;
use gpu::{Gpu, GpuError};
use scene::load::is_scene_file;
use vantage_server::app::Attendance;
use vantage_server::notify::{self, notify};
use vantage_server::operate::{Prepare, operate};
use vantage_server::options::{Command, Options};
use vantage_server::port_options::PortOptions;
use vantage_server::prepare::{Prepared, Preparer};
use vantage_server::relay::options::RelayOptions;
use vantage_server::serving::within::{SceneFile, Within};
use vantage_server::serving::{Folder, Stock};
use vantage_server::settings::{self, SettingsError};
use vantage_server::signals::Signals;
use vantage_server::uploads::Uploads;
use vantage_server::uploads::options::UploadOptions;
use vantage_server::{Config, agones, app, log, relay};

/// `EX_UNAVAILABLE` of sysexits.h: a service that is needed is not there, here a graphics adapter.
const EXIT_NO_ADAPTER: u8 = 69;
/// What clap exits with for wrong usage.
const EXIT_USAGE: u8 = 2;

fn main() -> ExitCode {
    if let Some(ends) = manual::answered(Options::command()) {
        return ends;
    }
    let settings = match settings::read::<Options>(std::env::args_os()) {
        Ok(settings) => settings,
        Err(SettingsError::Usage(error)) => error.exit(),
        Err(error) => {
            eprintln!("error: {error}");
            return ExitCode::from(EXIT_USAGE);
        }
    };
    let options = &settings.options;
    let port = match &options.command {
        Some(Command::Relay(relay)) => &relay.port,
        None => &options.port,
    };
    if port.print_config {
        print!("{}", settings.print());
        return ExitCode::SUCCESS;
    }
    if options.list {
        scene::builtin::offered().for_each(|name| println!("{name}"));
        return ExitCode::SUCCESS;
    }
    if options.list_gpus {
        pollster::block_on(Gpu::names()).iter().enumerate().for_each(|(number, name)| println!("{number} {name}"));
        return ExitCode::SUCCESS;
    }
    let _log = log::start(port.log_format);
    let ran = match &options.command {
        Some(Command::Relay(relay)) => port.config().map(|config| relayed(relay, config)),
        None => options.config().map(|config| run(options, config)),
    };
    match ran {
        Ok(Ok(())) => ExitCode::SUCCESS,
        Ok(Err(error)) => {
            log::say(stderr(), format_args!("error: {error:#}"));
            let has_adapter = !matches!(error.downcast_ref(), Some(GpuError::NoAdapter));
            if has_adapter { ExitCode::FAILURE } else { ExitCode::from(EXIT_NO_ADAPTER) }
        }
        // Of options that do not go together.
        Err(message) => {
            log::say(stderr(), format_args!("error: {message}"));
            ExitCode::from(EXIT_USAGE)
        }
    }
}

/// With the certificate that its port is served by. Before anything that takes its time.
fn with_tls(port: &PortOptions, config: Config) -> anyhow::Result<Config> {
    let tls = port.tls()?;
    if port.tls_self_signed {
        tls.iter().for_each(|tls| tracing::info!("SHA-256 fingerprint of the certificate: {}", tls.fingerprint()));
    }
    Ok(Config { tls, ..config })
}

fn relayed(options: &RelayOptions, config: Config) -> anyhow::Result<()> {
    let config = with_tls(&options.port, config)?;
    tokio::runtime::Builder::new_multi_thread().enable_all().build()?.block_on(async {
        let mut signals = Signals::new()?;
        let running = relay::serve(config, options.broker()).await?;
        log::say(stdout(), running.url());
        notify(notify::READY);
        signals.stop().await;
        ends(running.stop(), &mut signals).await;
        Ok(())
    })
}

/// Waits until sessions have ended, or somebody has asked twice.
async fn ends(stopped: impl Future<Output = ()>, signals: &mut Signals) {
    tracing::info!("no one is let in any more, and sessions end");
    notify(notify::STOPPING);
    tokio::select! {
        () = stopped => {}
        () = signals.stop() => tracing::warn!("asked once more: it ends at once"),
    }
}

fn run(options: &Options, config: Config) -> anyhow::Result<()> {
    let config = with_tls(&options.port, config)?;
    let gpu = pollster::block_on(Gpu::new_headless_on(options.gpu.as_deref()))?;
    tracing::info!("draws on {}", gpu.caps.name);
    let runtime = tokio::runtime::Builder::new_multi_thread().enable_all().build()?;
    let ended = runtime.block_on(serve(options.clone(), config, gpu));
    // What is still loaded or cleared away is for nobody.
    runtime.shutdown_background();
    ended
}

/// In the background, from before the scene is loaded on, as that may take longer than Agones waits for a sign.
fn tend_for_agones(options: &Options, attendance: Attendance) {
    let port = std::env::var("AGONES_SDK_HTTP_PORT").ok().and_then(|port| port.parse().ok());
    if options.agones || port.is_some() {
        let idle = Duration::try_from_secs_f64(options.agones_idle_s).unwrap_or(Duration::MAX);
        tokio::spawn(agones::tend(port.unwrap_or(agones::DEFAULT_PORT), idle, move || attendance.sessions()));
    }
}

/// The folder of scenes, if any, and what the one is called there that is shown to who names none.
fn opened_folder(options: &mut Options) -> anyhow::Result<(Option<Folder>, Option<String>)> {
    let Some(path) = &options.folder.scenes else { return Ok((None, None)) };
    let folder = Folder::open(path)?;
    if options.scene.is_some() {
        return Ok((Some(folder), None));
    }
    let (name, file) = folder.files().pop_first().context("the folder of scenes is empty by now")?;
    options.scene = Some(file.to_string_lossy().into_owned());
    Ok((Some(folder), Some(name)))
}

/// Where people bring files of their own, if they may.
fn opened_uploads(options: &UploadOptions) -> anyhow::Result<Option<Arc<Uploads>>> {
    if !options.allow_uploads {
        return Ok(None);
    }
    let within = options.upload_folder.clone().unwrap_or_else(std::env::temp_dir);
    let opened = Uploads::open(&within, options.limits());
    let uploads = opened.with_context(|| format!("no folder for uploads can be made in {}", within.display()))?;
    Ok(Some(Arc::new(uploads)))
}

async fn serve(mut options: Options, config: Config, gpu: Gpu) -> anyhow::Result<()> {
    let (folder, first_name) = opened_folder(&mut options)?;
    let mut stock = Stock::new(folder, opened_uploads(&options.uploads)?);
    let mut signals = Signals::new()?;
    let listening = app::listen(&config).await?;
    log::say(stdout(), listening.url());
    tend_for_agones(&options, listening.attendance());
    let progress = listening.progress();
    let first_file = options.scene.as_ref().map(PathBuf::from).filter(|path| is_scene_file(path) && path.is_file());
    let within = Within { scene: options.file_scene.clone(), variant: options.variant.clone() };
    let preparer = Arc::new(Preparer::new(options, config, gpu));
    let loads = preparer.clone();
    let prepare: Prepare = Arc::new(move || loads.first(&progress));
    let first = prepare.clone();
    let loading = tokio::task::spawn_blocking(move || first());
    let Prepared { config, scene, imager } = tokio::select! {
        // Nothing is lost with what is loaded so far, and nobody waits for the rest.
        () = signals.stop() => return Ok(()),
        loaded = loading => loaded??,
    };
    if let Some(path) = first_file.filter(|_| scene.offer.scenes.len() + scene.offer.variants.len() > 0) {
        let name = first_name.clone().unwrap_or_else(|| scene.name.clone());
        stock = stock.with_first(name, SceneFile { path, within });
    }
    if !stock.is_none() {
        listening.offer(stock, first_name, Arc::new(move |file, says| preparer.file(file, says)));
    }
    let running = listening.serve(config, scene, imager)?;
    tracing::info!("ready");
    notify(notify::READY);
    let failure = operate(&running, &mut signals, prepare).await;
    ends(running.stop(), &mut signals).await;
    match failure {
        None => Ok(()),
        Some(failure) => Err(anyhow::anyhow!(failure)),
    }
}
