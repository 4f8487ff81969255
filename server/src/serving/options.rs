//! The part of the command line that is about scenes of a folder.

use std::path::PathBuf;
use std::time::Duration;

use clap::Args;

use crate::limits::SceneLimits;

/// See the module.
#[derive(Debug, Clone, Args)]
pub struct FolderOptions {
    /// A folder of scene files, each shown to who asks for it (?scene=NAME in the page's address) and loaded then. Who names none gets SCENE, or the first of
    /// the folder
    #[arg(long, value_name = "FOLDER", conflicts_with = "publish")]
    pub scenes: Option<PathBuf>,
    /// Scenes of the folder that are open at one time at most
    #[arg(long, value_name = "N", default_value_t = SceneLimits::default().open as u64, value_parser = clap::value_parser!(u64).range(1..=1024))]
    pub max_scenes: u64,
    /// Memory that meshes and images of open scenes take at most; the GPU has a copy of its own beside that
    #[arg(long, value_name = "MIB", default_value_t = SceneLimits::default().bytes >> 20, value_parser = clap::value_parser!(u64).range(1..=1 << 24))]
    pub scene_memory: u64,
    /// A scene of the folder is put away when nobody has been there for so long
    #[arg(long, value_name = "SECONDS", default_value_t = SceneLimits::default().idle.as_secs_f64(), value_parser = seconds)]
    pub scene_idle_s: f64,
}

impl FolderOptions {
    /// As plain values.
    pub fn limits(&self) -> SceneLimits {
        SceneLimits {
            open: usize::try_from(self.max_scenes).unwrap_or(usize::MAX),
            bytes: self.scene_memory << 20,
            idle: Duration::try_from_secs_f64(self.scene_idle_s).unwrap_or(Duration::MAX),
        }
    }
}

fn seconds(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value >= 0.0 && value.is_finite() => Ok(value),
        _ => Err("a number of seconds is needed".to_owned()),
    }
}
