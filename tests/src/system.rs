//! The whole system in one process: a real server on a loopback port, a headless viewer that talks to it over a real
//! websocket, and the plain renderer for the truth.

use std::sync::Arc;

use anyhow::Context;
use bench::compare::{Picture, Scores, score};
use camera::{Pinhole, Rigid, Trace, TracePose};
use client::show::headless::{self, FrameRow, Way};
use gpu::Gpu;
use protocol::Look;
use protocol::message::Clock;
use scene::Scene;
use server::imager::GpuImager;
use server::{Config, Running};
use tokio::runtime::Runtime;

/// A server of a scene, on the virtual clock, and the means to look at it.
pub struct System {
    /// What is served.
    pub scene: Arc<Scene>,
    /// One device for everything.
    pub gpu: Gpu,
    runtime: Runtime,
    server: Option<Running>,
}

/// A picture that the viewer showed, with what it says about it.
pub struct Shown {
    /// As in `stats.json`.
    pub row: FrameRow,
    /// Its covered pixels are those with a sample.
    pub picture: Picture,
}

impl System {
    /// Starts a server on a free port.
    pub fn start(scene: Scene, configure: impl FnOnce(&mut Config)) -> anyhow::Result<System> {
        let mut config = Config { port: 0, clock: Clock::Virtual, ..Config::default() };
        configure(&mut config);
        let gpu = Gpu::block_on(Gpu::new_headless())?;
        let scene = Arc::new(scene);
        let imager = Box::new(GpuImager::new(&gpu, &scene, &config)?);
        let runtime = Runtime::new()?;
        let server = runtime.block_on(server::serve(config, scene.clone(), imager))?;
        Ok(System { scene, gpu, runtime, server: Some(server) })
    }

    /// Where clients connect, as a websocket's address.
    pub fn url(&self) -> anyhow::Result<String> {
        let addr = self.server.as_ref().context("the server runs until it is dropped")?.addr;
        Ok(format!("ws://{addr}"))
    }

    /// The pose where a viewer begins.
    pub fn start_pose(&self) -> Rigid {
        server::start::start_pose(&self.scene)
    }

    /// A viewer's run on the virtual clock along a trace: 384x384 pixels, nothing filled.
    pub fn view(&self, trace: Trace, configure: impl FnOnce(&mut headless::Options)) -> anyhow::Result<Vec<Shown>> {
        let mut options = headless::Options::new(self.url()?, Way::Trace(trace));
        options.clock = Clock::Virtual;
        options.size_px = (384, 384);
        options.picture.frame.fill = false;
        configure(&mut options);
        let (width_px, height_px) = options.size_px;
        let mut shown = Vec::new();
        headless::run_on(&self.gpu, &options, &mut |drawn| {
            shown.push(Shown { row: drawn.row.clone(), picture: Picture::from_rgba(width_px, height_px, drawn.rgba) });
        })?;
        Ok(shown)
    }

    /// Scores pictures against the truth at the very poses and scene times that they show.
    pub fn scores(&self, shown: &[Shown]) -> anyhow::Result<Vec<Scores>> {
        self.scores_against(shown, bench::stage::Stage::truth)
    }

    /// The same against the truth with 16 samples a pixel.
    pub fn smooth_scores(&self, shown: &[Shown]) -> anyhow::Result<Vec<Scores>> {
        self.scores_against(shown, bench::stage::Stage::smooth_truth)
    }

    fn scores_against(
        &self,
        shown: &[Shown],
        truth: impl Fn(&bench::stage::Stage, &Pinhole) -> anyhow::Result<server::truth::Truth>,
    ) -> anyhow::Result<Vec<Scores>> {
        let mut stage = bench::stage::Stage::new(&self.gpu, (*self.scene).clone(), Look::Plain)?;
        let near_m = server::start::near_m(&self.scene);
        let goes_on = !self.scene.animation.rigs().is_empty();
        let mut scores = Vec::new();
        for Shown { row, picture } in shown {
            let size_px = (picture.width_px, picture.height_px);
            let camera = Pinhole::symmetric(row.world_from_eye, size_px, 60_f64.to_radians(), near_m);
            // What clips move is shown as it is now, whatever the last update was of.
            let since_s = if goes_on { row.age_ms.unwrap_or(0.0) / 1e3 } else { 0.0 };
            stage.show(row.scene_time_s + since_s, row.world_from_eye.translation)?;
            let truth = bench::stage::picture(&truth(&stage, &camera)?);
            if let Some(dir) = std::env::var_os("VANTAGE_TEST_PICTURES") {
                let base = std::path::Path::new(&dir).join(format!("{}-{:03}", self.scene.name, row.frame));
                picture.write(&base.with_extension("shown.png"))?;
                truth.write(&base.with_extension("truth.png"))?;
            }
            scores.push(score(picture, &truth, None)?);
        }
        Ok(scores)
    }
}

impl Drop for System {
    fn drop(&mut self) {
        if let Some(server) = self.server.take() {
            self.runtime.block_on(server.stop());
        }
    }
}

/// Poses at 60 a second.
pub fn trace(poses: impl IntoIterator<Item = Rigid>) -> Trace {
    let poses = poses.into_iter().enumerate();
    Trace { poses: poses.map(|(i, world_from_eye)| TracePose { t_s: i as f64 / 60.0, world_from_eye }).collect() }
}

/// An eye moved in its own space: x right, y down, z forward, metres.
pub fn moved(eye: Rigid, offset_eye: glam::DVec3) -> Rigid {
    Rigid { translation: eye.transform_point(offset_eye), ..eye }
}
