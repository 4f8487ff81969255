//! `vantage-server`: renders a scene as depth images and streams their samples to viewers.

// Whether a pipeline of wgpu may go from thread to thread is asked through all that it consists of.
#![recursion_limit = "256"]

use std::io::IsTerminal;
use std::process::ExitCode;
use std::sync::Arc;

use clap::Parser;
use gpu::{Gpu, GpuError};
use indicatif::{ProgressBar, ProgressStyle};
use scene::Scene;
use scene::environment::Environment;
use scene::load::{Choice, Stage};
use tracing_subscriber::EnvFilter;
use vantage_server::imager::GpuImager;
use vantage_server::options::{LogFormat, Options};
use vantage_server::{app, cameras, source};

/// `EX_UNAVAILABLE` of sysexits.h: a service that is needed is not there, here a graphics adapter.
const EXIT_NO_ADAPTER: u8 = 69;
/// What clap exits with for wrong usage.
const EXIT_USAGE: u8 = 2;

fn main() -> ExitCode {
    let options = Options::parse();
    if options.list {
        scene::builtin::offered().for_each(|name| println!("{name}"));
        return ExitCode::SUCCESS;
    }
    if options.list_gpus {
        pollster::block_on(Gpu::names()).iter().enumerate().for_each(|(number, name)| println!("{number} {name}"));
        return ExitCode::SUCCESS;
    }
    let filter = EnvFilter::try_from_default_env()
        .unwrap_or_else(|_| EnvFilter::new("info,wgpu=error,wgpu_core=error,wgpu_hal=off,naga=error"));
    let log = tracing_subscriber::fmt()
        .with_env_filter(filter)
        .with_target(false)
        .with_ansi(std::io::stderr().is_terminal())
        .with_writer(std::io::stderr);
    match options.log_format {
        LogFormat::Text => log.init(),
        LogFormat::Json => log.json().flatten_event(true).init(),
    }
    let config = match options.config() {
        Ok(config) => config,
        Err(message) => {
            eprintln!("error: {message}");
            return ExitCode::from(EXIT_USAGE);
        }
    };
    match run(&options, config) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) if matches!(error.downcast_ref(), Some(GpuError::NoAdapter)) => {
            eprintln!("error: {error:#}");
            ExitCode::from(EXIT_NO_ADAPTER)
        }
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::FAILURE
        }
    }
}

fn run(options: &Options, config: vantage_server::Config) -> anyhow::Result<()> {
    // Before the scene, which may take minutes to load.
    let tls = options.tls()?;
    if options.tls_self_signed {
        tls.iter().for_each(|tls| tracing::info!("SHA-256 fingerprint of the certificate: {}", tls.fingerprint()));
    }
    let config = vantage_server::Config { tls, ..config };
    let gpu = pollster::block_on(Gpu::new_headless_on(options.gpu.as_deref()))?;
    tracing::info!("draws on {}", gpu.caps.name);
    tokio::runtime::Builder::new_multi_thread().enable_all().build()?.block_on(async {
        let listening = app::listen(&config).await?;
        println!("{}", listening.url());
        let (options, progress) = (options.clone(), listening.progress());
        let loading = tokio::task::spawn_blocking(move || -> anyhow::Result<_> {
            let scene = Arc::new(load(&options, &progress)?);
            let environment = options.environment.as_deref().map(Environment::load).transpose()?;
            let config = vantage_server::Config { environment: environment.map(Arc::new), ..config };
            let imager = Box::new(GpuImager::new(&gpu, &scene, &config)?);
            Ok((config, scene, imager))
        });
        let (config, scene, imager) = tokio::select! {
            signal = asked_to_stop() => {
                signal?;
                // Nothing is lost with what is loaded so far, and nobody waits for the rest.
                std::process::exit(0);
            }
            loaded = loading => loaded??,
        };
        let running = listening.serve(config, scene, imager)?;
        tracing::info!("ready");
        let failure = tokio::select! {
            signal = asked_to_stop() => { signal?; None }
            failure = running.failed() => Some(failure),
        };
        running.stop().await;
        match failure {
            None => Ok(()),
            Some(failure) => Err(anyhow::anyhow!(failure)),
        }
    })
}

/// Loads the scene, and says how far it is: on the terminal, and to who comes.
fn load(options: &Options, says: &(dyn Fn(String) + Sync)) -> anyhow::Result<Scene> {
    let name = options.scene.as_deref().unwrap_or(scene::builtin::DEFAULT);
    let style = ProgressStyle::with_template("{msg:>24} [{bar:40}] {percent:>3} %")?.progress_chars("=> ");
    let bar = ProgressBar::new(1000).with_style(style);
    bar.set_message(format!("loading {name}"));
    let Options { file_scene, variant, file_camera, .. } = options;
    let choice = Choice { scene: file_scene.clone(), variant: variant.clone(), camera: file_camera.clone() };
    let scene = source::load_chosen(name, &choice, options.scale, &|progress| {
        let stage = match progress.stage {
            Stage::Read => "reading files",
            Stage::Textures => "decoding images",
            Stage::Meshes => "building meshes",
            Stage::Finish => "measuring the scene",
        };
        bar.set_message(stage);
        says(format!("{stage}, {:.0} %", progress.share * 100.0));
        bar.set_position((progress.share * 1000.0) as u64);
    });
    bar.finish_and_clear();
    let mut scene = scene?;
    if let Some(time_s) = options.hold {
        scene = scene.held_at(time_s);
    }
    for file in &options.graph_camera {
        cameras::add(&mut scene, file)?;
    }
    for warning in &scene.warnings {
        tracing::warn!("{}: {warning}", scene.name);
    }
    tracing::info!("{}: {} objects, {} triangles", scene.name, scene.instances.len(), scene.triangle_count());
    Ok(scene)
}

/// Waits for ctrl-c or, where there is such a thing, SIGTERM.
async fn asked_to_stop() -> std::io::Result<()> {
    #[cfg(unix)]
    {
        let mut terminate = tokio::signal::unix::signal(tokio::signal::unix::SignalKind::terminate())?;
        tokio::select! {
            interrupted = tokio::signal::ctrl_c() => interrupted,
            _ = terminate.recv() => Ok(()),
        }
    }
    #[cfg(not(unix))]
    tokio::signal::ctrl_c().await
}
