//! What a viewer who stands still comes to hold: the server's own looks, until it finds nothing lacking.

use std::sync::Arc;
use std::time::Instant;

use client::draw::frame::Options;
use gpu::Gpu;
use protocol::DepthImage;
use protocol::message::ViewSize;
use scene::Scene;
use server::client::Client;
use server::frame::Stage;
use server::imager::GpuImager;
use server::viewer::Viewer;
use surface::HeldSurfaces;

use super::cover::{HeldImage, verdicts};
use super::eyes::Eye;
use super::found::Shown;
use crate::client_view::{ClientView, HeldSet};
use crate::sets::{self, SetPlan};

/// A server's stage for one scene.
pub(super) struct Server {
    gpu: Gpu,
    stage: Stage,
}

impl Server {
    /// Of a scene, with as many images and as large ones as `plan` says.
    pub fn new(gpu: &Gpu, scene: Scene, plan: &SetPlan) -> anyhow::Result<Server> {
        let scene = Arc::new(scene);
        let rules = sets::rules(&scene, plan);
        let imager = Box::new(GpuImager::new(gpu, &scene, &server::Config::default())?);
        Ok(Server { gpu: gpu.clone(), stage: Stage::new(scene, rules, plan.discretization, imager) })
    }

    /// What an eye sees of what a viewer in its region's middle holds.
    pub fn show(&mut self, view: &mut ClientView, index: usize, eye: &Eye) -> anyhow::Result<Shown> {
        let output = &eye.output;
        let size = ViewSize { width_px: output.width_px, height_px: output.height_px, fov_y_rad: output.fov_y_rad() };
        let viewer = Viewer::at_start(size, eye.middle, 0.0);
        let mut client = Client::default();
        let started = Instant::now();
        while client.focus.is_none_or(|focus| !focus.settled) {
            self.stage.update(&viewer, &mut client, 0.0)?;
        }
        let images_ms = started.elapsed().as_secs_f64() * 1000.0;
        let held = client.account.held().clone();
        let started = Instant::now();
        let mut surfaces = HeldSurfaces::new(&self.gpu);
        surfaces.rebuild(&held);
        let build_ms = started.elapsed().as_secs_f64() * 1000.0;
        let images: Vec<DepthImage> = held.patches.values().map(|held| held.patch.image.clone()).collect();
        let set = HeldSet { build_ms, ..HeldSet::of(&self.gpu, held, surfaces) };
        let drawn = view.frame(&set, output, Options::default())?;
        let of_held: Vec<HeldImage> = images.iter().map(HeldImage::new).collect();
        Ok(Shown {
            eye: index,
            verdicts: verdicts(&eye.truth, &drawn.w, output, &of_held),
            drawn: drawn.picture,
            times_ms: [images_ms, build_ms, drawn.frame_ms],
            images,
        })
    }
}
