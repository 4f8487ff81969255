//! A scene made ready to be served: loaded as options say, with its light and its cameras, and uploaded.

use std::sync::{Arc, Mutex, PoisonError};

use gpu::{Gpu, GpuError};
use indicatif::{ProgressBar, ProgressStyle};
use scene::Scene;
use scene::environment::{Environment, EnvironmentError};
use scene::load::{Choice, Progress, Stage};
use thiserror::Error;

use crate::cameras::{self, CameraFileError};
use crate::config::Config;
use crate::devices::Devices;
use crate::imager::{GpuImager, Imager, ImagerError};
use crate::options::Options;
use crate::serving::within::SceneFile;
use crate::source::{self, SourceError};

/// Steps of the bar.
const BAR_STEPS: u64 = 1000;

/// Why there is nothing to serve.
#[derive(Debug, Error)]
pub enum PrepareError {
    /// No scene.
    #[error(transparent)]
    Scene(#[from] SourceError),
    /// Its cameras are wrong.
    #[error(transparent)]
    Cameras(#[from] CameraFileError),
    /// No light from all around.
    #[error(transparent)]
    Environment(#[from] EnvironmentError),
    /// The GPU does not take it.
    #[error(transparent)]
    Imager(#[from] ImagerError),
    /// The GPU was lost, and there is no other.
    #[error(transparent)]
    Gpu(#[from] GpuError),
}

/// What a server needs to serve a scene.
pub struct Prepared {
    /// All options.
    pub config: Config,
    /// What is shown.
    pub scene: Arc<Scene>,
    /// What draws it.
    pub imager: Box<dyn Imager>,
}

/// Makes scenes ready, by one server's options, on its GPU. Each takes as long as that takes. Says how far it is: on the terminal, and to `says`.
pub struct Preparer {
    options: Options,
    config: Config,
    /// The newest one: a device may be lost.
    gpu: Mutex<Gpu>,
}

impl Preparer {
    /// `config` must be of the options.
    pub fn new(options: Options, config: Config, gpu: Gpu) -> Preparer {
        Preparer { options, config, gpu: Mutex::new(gpu) }
    }

    /// The scene that the options name.
    pub fn first(&self, says: &(dyn Fn(String) + Sync)) -> Result<Prepared, PrepareError> {
        self.prepare(&self.options, says)
    }

    /// A scene file, as the options say that do not choose within one.
    pub fn file(&self, file: &SceneFile, says: &(dyn Fn(String) + Sync)) -> Result<Prepared, PrepareError> {
        self.prepare(&self.options.of_file(file), says)
    }

    fn prepare(&self, options: &Options, says: &(dyn Fn(String) + Sync)) -> Result<Prepared, PrepareError> {
        let scene = Arc::new(load(options, says)?);
        let environment = options.environment.as_deref().map(Environment::load).transpose()?;
        let config = Config { environment: environment.map(Arc::new), look: options.look(), ..self.config.clone() };
        let devices = Devices::new(options.gpu.clone(), scene.clone(), config.clone());
        let imager = Box::new(GpuImager::new(&self.gpu()?, &scene, &config)?.on(devices));
        Ok(Prepared { config, scene, imager })
    }

    /// One that is not lost.
    fn gpu(&self) -> Result<Gpu, GpuError> {
        let mut gpu = self.gpu.lock().unwrap_or_else(PoisonError::into_inner);
        if gpu.check().is_err() {
            *gpu = pollster::block_on(Gpu::new_headless_on(self.options.gpu.as_deref()))?;
        }
        Ok(gpu.clone())
    }
}

fn load(options: &Options, says: &(dyn Fn(String) + Sync)) -> Result<Scene, PrepareError> {
    let name = options.scene.as_deref().unwrap_or(scene::builtin::DEFAULT);
    let style = ProgressStyle::with_template("{msg:>24} [{bar:40}] {percent:>3} %").expect("the template is sound");
    let bar = ProgressBar::new(BAR_STEPS).with_style(style.progress_chars("=> "));
    bar.set_message(format!("loading {name}"));
    let Options { file_scene, variant, file_camera, .. } = options;
    let up = options.up.into();
    let choice = Choice { scene: file_scene.clone(), variant: variant.clone(), camera: file_camera.clone(), up };
    let scene = source::load_chosen(name, &choice, options.scale, &|progress: Progress| {
        let stage = match progress.stage {
            Stage::Read => "reading files",
            Stage::Textures => "decoding images",
            Stage::Meshes => "building meshes",
            Stage::Finish => "measuring the scene",
        };
        bar.set_message(stage);
        says(format!("{stage}, {:.0} %", progress.share * 100.0));
        bar.set_position((progress.share * BAR_STEPS as f64) as u64);
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
