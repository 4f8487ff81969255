//! What a topic is. A new one is a file in [`crate::topics`] that implements [`Topic`], and a line in its list.

use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use anyhow::Context;
use camera::Trace;
use clap::{ArgMatches, Args, Command, FromArgMatches};
use glam::DVec3;
use gpu::Gpu;
use scene::Scene;
use scene::model::SceneCamera;

use crate::render::{adapter_name, read_trace};
use crate::report::{Figure, Report};
use crate::stage::load_scene;

/// One question that a report answers with figures.
pub trait Topic: Sync {
    /// What people type, and the name of the files.
    fn name(&self) -> &'static str;

    /// What it shows, in a sentence or two.
    fn about(&self) -> &'static str;

    /// What it runs on where nobody named a scene. `quick`: what continuous integration can afford.
    fn default_scenes(&self, quick: bool) -> Vec<String>;

    /// Adds what it takes beside what every topic takes; [`Run::arguments`] gives it back.
    fn arguments(&self, command: Command) -> Command {
        command
    }

    /// Fills the report. A scene or method that cannot be run becomes a failed row; an error ends the whole topic.
    fn run(&self, run: &Run, report: &mut Report) -> anyhow::Result<()>;
}

/// What a topic was asked to do, and what it may use.
pub struct Run {
    /// Names of built-in scenes, or files.
    pub scenes: Vec<String>,
    /// A camera trace, or `auto`.
    pub trace: Option<PathBuf>,
    /// Output size; `None`: the topic's own.
    pub size_px: Option<(u32, u32)>,
    /// Where the files go.
    pub out: PathBuf,
    /// Few enough runs for continuous integration.
    pub quick: bool,
    /// Everything that was typed.
    matches: Option<ArgMatches>,
    gpu: OnceLock<Gpu>,
}

impl Run {
    /// A run that writes into `out`, which exists.
    pub fn new(scenes: Vec<String>, out: PathBuf) -> Run {
        Run { scenes, trace: None, size_px: None, out, quick: false, matches: None, gpu: OnceLock::new() }
    }

    /// The same with what was typed.
    pub fn with_matches(self, matches: ArgMatches) -> Run {
        Run { matches: Some(matches), ..self }
    }

    /// A topic's own arguments, as its [`Topic::arguments`] declared them; their defaults where nothing was typed.
    pub fn arguments<A: Args + FromArgMatches>(&self) -> anyhow::Result<A> {
        let typed = self.matches.clone();
        let matches = typed.unwrap_or_else(|| A::augment_args(Command::new("defaults")).get_matches_from(["defaults"]));
        Ok(A::from_arg_matches(&matches)?)
    }

    /// The file of the camera trace, where one was named.
    pub fn trace_file(&self) -> Option<&Path> {
        self.trace.as_deref().filter(|path| path.as_os_str() != "auto")
    }

    /// The camera trace, where a file was named.
    pub fn read_trace(&self) -> anyhow::Result<Option<Trace>> {
        self.trace_file().map(read_trace).transpose()
    }

    /// Loads a scene; it begins where the trace does.
    pub fn load(&self, name: &str) -> anyhow::Result<Scene> {
        let mut scene = load_scene(name, 1.0)?;
        if let Some(trace) = self.read_trace()? {
            scene.start = start_of(&trace);
        }
        Ok(scene)
    }

    /// Whether somebody named the scenes, rather than the topic itself.
    pub fn names_scenes(&self) -> bool {
        self.matches.as_ref().is_some_and(|matches| matches.try_get_raw("scene").is_ok_and(|scenes| scenes.is_some()))
    }

    /// The graphics adapter, opened when first asked for.
    pub fn gpu(&self, report: &mut Report) -> anyhow::Result<&Gpu> {
        if self.gpu.get().is_none() {
            let opened = pollster::block_on(Gpu::new_headless())?;
            let _ = self.gpu.set(opened);
        }
        let gpu = self.gpu.get().context("the adapter was opened above")?;
        report.adapter = adapter_name(gpu);
        Ok(gpu)
    }

    /// Where a figure's file goes; its caption joins the report.
    pub fn figure(&self, report: &mut Report, file: impl Into<String>, caption: impl Into<String>) -> PathBuf {
        let file = file.into();
        let path = self.out.join(&file);
        report.figures.push(Figure { file, caption: caption.into() });
        path
    }
}

/// Where a scene begins whose viewer begins where the trace does.
pub fn start_of(trace: &Trace) -> Option<SceneCamera> {
    let eye = trace.poses.first()?.world_from_eye;
    Some(SceneCamera {
        eye_world: eye.translation,
        forward_world: eye.transform_vector(DVec3::Z),
        fov_y_rad: std::f64::consts::FRAC_PI_3,
    })
}

/// Runs a topic and writes its files; the report tells what was found.
pub fn run_topic(topic: &dyn Topic, run: &Run) -> anyhow::Result<Report> {
    std::fs::create_dir_all(&run.out).with_context(|| run.out.display().to_string())?;
    let mut report = Report::new(topic.name(), topic.about());
    report.scene = run.scenes.iter().map(|scene| scene_label(scene)).collect();
    report.settings.set("quick", run.quick);
    topic.run(run, &mut report)?;
    crate::report::write::write_all(&report, &run.out)?;
    Ok(report)
}

/// The short name of a scene: a built-in name as it is, a file by its stem, also where it is a part of a built-in scene.
pub fn scene_label(scene: &str) -> String {
    if let Some((name, file)) = scene.split_once('+').filter(|_| !Path::new(scene).exists()) {
        return format!("{name}+{}", scene_label(file));
    }
    let path = Path::new(scene);
    let stem = if path.extension().is_some() { path.file_stem() } else { path.file_name() };
    stem.map_or_else(|| scene.to_owned(), |stem| stem.to_string_lossy().into_owned())
}
