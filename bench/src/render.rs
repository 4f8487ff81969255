//! `vantage-report render`: the truth. The full scene at given poses and scene times, by the plain renderer.
//!
//! Writes `frame_00000.png` (as shown) and `covered_00000.png` (255 where there is a surface) for each pose, and a
//! `truth.json` with the rows' poses and times, which `--poses` takes as it takes a viewer's `stats.json`.

use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use camera::{Pinhole, Trace};
use clap::Args;
use gpu::Gpu;
use protocol::Look;
use serde::Serialize;
use server::start::near_m;

use crate::options;
use crate::poses::{PoseRow, from_trace, orbit, read_stats};
use crate::report::progress::Progress;
use crate::stage::{Stage, load_scene, picture};

/// Draws the truth: the full scene at given poses, by a plain renderer that shares no code with the reconstruction.
#[derive(Args, Debug)]
pub struct RenderArgs {
    /// A built-in scene or a scene file (glTF, GLB, OBJ, PLY, STL).
    #[arg(long, value_name = "FILE|NAME")]
    pub scene: String,
    /// A camera trace, one line `px py pz rx ry rz t_ms` a pose; `auto`: an orbit that frames the scene.
    #[arg(long, value_name = "FILE|auto", conflicts_with = "poses", required_unless_present = "poses")]
    pub trace: Option<String>,
    /// A viewer's stats.json: the very poses and scene times that it showed.
    #[arg(long, value_name = "FILE")]
    pub poses: Option<PathBuf>,
    /// Size of the pictures in pixels.
    #[arg(long, value_name = "WxH", default_value = "640x360", value_parser = options::size)]
    pub size: (u32, u32),
    /// Where the pictures go.
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    /// `plain`: the scene's own lights; `full`: metallic and rough materials under a studio, too; `flat`: base colour under constant light; `flat-lit`: the same, with a directional
    /// light on steep faces.
    #[arg(long, default_value = "plain", value_parser = options::look)]
    pub look: Look,
    /// Makes the scene larger or smaller, about the world's origin.
    #[arg(long, default_value = "1", value_parser = options::scale)]
    pub scale: f64,
    /// Vertical field of view in degrees.
    #[arg(long, default_value = "60", value_parser = options::fov_y_deg)]
    pub fov_y_deg: f64,
    /// 16: writes smooth_00000.png too, with 16 samples a pixel averaged in linear light.
    #[arg(long, default_value = "1", value_parser = clap::value_parser!(u32).range(1..=16))]
    pub supersample: u32,
}

/// The rows and how they were drawn.
#[derive(Serialize)]
struct TruthFile<'a> {
    scene: &'a str,
    size_px: (u32, u32),
    fov_y_deg: f64,
    scale: f64,
    look: Look,
    near_m: f64,
    adapter: String,
    commit: String,
    frames: &'a [PoseRow],
}

/// Runs the command.
pub fn render(args: &RenderArgs) -> anyhow::Result<()> {
    if ![1, 16].contains(&args.supersample) {
        bail!("--supersample is 1 or 16");
    }
    let scene = load_scene(&args.scene, args.scale)?;
    let fov_y_rad = args.fov_y_deg.to_radians();
    let rows = match (&args.poses, args.trace.as_deref()) {
        (Some(stats), _) => read_stats(stats)?,
        (None, Some("auto") | None) => orbit(&scene, args.size, fov_y_rad),
        (None, Some(trace)) => from_trace(&read_trace(Path::new(trace))?),
    };
    std::fs::create_dir_all(&args.out).with_context(|| args.out.display().to_string())?;
    let gpu = pollster::block_on(Gpu::new_headless())?;
    let near_m = near_m(&scene);
    let mut stage = Stage::new(&gpu, scene, args.look)?;
    let progress = Progress::new("drawing the truth", rows.len() as u64);
    for row in &rows {
        let camera = Pinhole::symmetric(row.world_from_eye, args.size, fov_y_rad, near_m);
        stage.show(row.scene_time_s, row.world_from_eye.translation)?;
        let shown = picture(&stage.truth(&camera)?);
        shown.write(&args.out.join(format!("frame_{:05}.png", row.frame)))?;
        shown.write_covered(&args.out.join(format!("covered_{:05}.png", row.frame)))?;
        if args.supersample == 16 {
            picture(&stage.smooth_truth(&camera)?).write(&args.out.join(format!("smooth_{:05}.png", row.frame)))?;
        }
        progress.step();
    }
    let file = TruthFile {
        scene: &args.scene,
        size_px: args.size,
        fov_y_deg: args.fov_y_deg,
        scale: args.scale,
        look: args.look,
        near_m,
        adapter: adapter_name(&gpu),
        commit: crate::report::machine::commit(),
        frames: &rows,
    };
    std::fs::write(args.out.join("truth.json"), serde_json::to_string_pretty(&file)?)?;
    println!("{} frames in {}", rows.len(), args.out.display());
    Ok(())
}

/// Name and driver of an adapter, for people.
pub fn adapter_name(gpu: &Gpu) -> String {
    let info = gpu.adapter.get_info();
    let driver = [info.driver.as_str(), info.driver_info.as_str()].join(" ").trim().to_owned();
    if driver.is_empty() { info.name } else { format!("{} ({driver})", info.name) }
}

/// Reads a trace file.
pub fn read_trace(path: &Path) -> anyhow::Result<Trace> {
    let text = std::fs::read_to_string(path).with_context(|| path.display().to_string())?;
    Trace::parse(&text).with_context(|| path.display().to_string())
}
