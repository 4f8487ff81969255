//! The picture of a run: drawn into a texture, read back, recorded.

use camera::{Pinhole, Rigid};
use gpu::{Gpu, Readback};
use surface::Build;

use super::error::HeadlessError;
use super::options::Options;
use super::output::Writer;
use super::report::{FrameRow, Header, RowMs, Settings, Summary};
use crate::draw::picture::Picture;
use crate::receive::traffic::Traffic;
use crate::receive::viewer::Viewer;

/// sRGB bytes are written as they are.
const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;

/// A picture that a run has drawn.
#[derive(Debug)]
pub struct Drawn<'a> {
    /// What is known of it.
    pub row: &'a FrameRow,
    /// How many there will be.
    pub of: usize,
    /// RGBA, rows top to bottom, sRGB-encoded; alpha is 255 where there is a sample and 0 elsewhere, filled or not.
    pub rgba: &'a [u8],
}

/// Which frame, and when.
pub(super) struct Moment {
    pub frame: usize,
    /// The trace's time.
    pub t_s: f64,
    /// On the run's clock, when the picture is finished.
    pub now_s: f64,
    /// Real milliseconds that the frame took.
    pub frame_ms: f64,
    /// Of all updates so far.
    pub update_bytes: u64,
}

/// A finished picture.
pub(super) struct Finished {
    rgba: Vec<u8>,
    uncovered_share: f64,
    surface_ms: f64,
    light_ms: f64,
}

pub(super) struct Stage {
    gpu: Gpu,
    options: Options,
    picture: Picture,
    target: wgpu::Texture,
    writer: Option<Writer>,
    header: Option<Header>,
    updates: u64,
}

/// What a run knows of itself once it is over.
pub(super) struct Ran {
    pub frames: Vec<FrameRow>,
    pub first_picture_ms: Option<f64>,
    pub server_ms: Vec<f64>,
    pub traffic: Traffic,
}

impl Stage {
    pub fn new(gpu: &Gpu, options: &Options) -> Result<Stage, HeadlessError> {
        let target = gpu.device.create_texture(&wgpu::TextureDescriptor {
            label: Some("picture"),
            size: wgpu::Extent3d { width: options.size_px.0, height: options.size_px.1, depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: FORMAT,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
            view_formats: &[],
        });
        let mut look = options.picture;
        look.frame.coverage_in_alpha = true;
        let writer = options.out.as_deref().map(|out| Writer::start(out, options.size_px)).transpose()?;
        Ok(Stage {
            gpu: gpu.clone(),
            options: options.clone(),
            picture: Picture::new(gpu, FORMAT, look)?,
            target,
            writer,
            header: None,
            updates: 0,
        })
    }

    /// How surfaces are built beside it.
    pub fn build(&self) -> Build {
        self.picture.build()
    }

    /// Applies every update that is there.
    pub fn take_in(&mut self, viewer: &mut Viewer, now_s: f64) {
        viewer.advance(&mut self.picture, now_s, f64::INFINITY);
    }

    /// Draws what is held, with objects where they are now, and waits for it.
    pub fn draw(&mut self, viewer: &Viewer, camera: &Pinhole, now_s: f64) -> Result<Finished, HeadlessError> {
        if self.header.is_none() {
            self.header = self.describe(viewer);
        }
        let view = self.target.create_view(&wgpu::TextureViewDescriptor::default());
        self.picture.show_moment(&viewer.moment_at(now_s));
        let timing = self.picture.draw_measured(viewer.held(), camera, &view)?;
        let mut encoder = self.gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let mut readback = Readback::default();
        let slot = readback.texture(&self.target, 0, self.options.size_px);
        let encoded = readback.encode(&self.gpu, &mut encoder);
        self.gpu.queue.submit([encoder.finish()]);
        let mapped = encoded.map().wait(&self.gpu).map_err(crate::draw::picture::PictureError::from)?;
        Ok(Finished {
            rgba: mapped.bytes(slot),
            uncovered_share: self.picture.uncovered_share().unwrap_or(1.0),
            surface_ms: timing.surface_ms + self.picture.take_build_ms(),
            light_ms: timing.light_ms,
        })
    }

    /// Writes a picture and its row down.
    pub fn record(
        &mut self,
        viewer: &mut Viewer,
        moment: &Moment,
        of: usize,
        world_from_eye: Rigid,
        finished: Finished,
        on_frame: &mut dyn FnMut(&Drawn<'_>),
    ) -> Result<FrameRow, HeadlessError> {
        viewer.drawn(moment.now_s, Some(finished.surface_ms), Some(finished.light_ms));
        viewer.set_uncovered_share(finished.uncovered_share);
        let first_scene_time_s = viewer.welcome().map_or(0.0, |welcome| welcome.scene_time_s);
        let row = FrameRow {
            frame: moment.frame,
            t_s: moment.t_s,
            scene_time_s: if viewer.has_picture() { viewer.held().scene_time_s } else { first_scene_time_s },
            age_ms: viewer.age_ms(moment.now_s),
            round_trip_ms: viewer.round_trip_ms(),
            world_from_eye,
            uncovered_share: finished.uncovered_share,
            bytes_received: viewer.bytes_received(),
            update_bytes_sent: moment.update_bytes,
            update: viewer.held().number,
            samples: viewer.held().sample_count() as u64,
            ms: RowMs {
                decode: viewer.take_decode_ms(),
                surface: finished.surface_ms,
                light: finished.light_ms,
                frame: moment.frame_ms,
            },
        };
        self.updates = viewer.stats(moment.now_s).updates;
        on_frame(&Drawn { row: &row, of, rgba: &finished.rgba });
        if let Some(writer) = &self.writer {
            writer.push(moment.frame, finished.rgba);
        }
        Ok(row)
    }

    fn describe(&self, viewer: &Viewer) -> Option<Header> {
        let (options, welcome) = (&self.options, viewer.welcome()?);
        Some(Header {
            adapter: self.gpu.caps.name.clone(),
            software: self.gpu.caps.software,
            scene: welcome.scene_name.clone(),
            width_px: options.size_px.0,
            height_px: options.size_px.1,
            fov_y_deg: options.fov_y_rad.to_degrees(),
            near_m: welcome.near_m,
            update_interval_s: welcome.update_interval_s,
            updates: 0,
            first_picture_ms: None,
            server_ms: Vec::new(),
            traffic: Traffic::default(),
            settings: Settings {
                clock: format!("{:?}", options.clock).to_lowercase(),
                fps: options.fps,
                network: options.link.map_or_else(String::new, |link| link.to_string()),
                warm_up: options.warm_up,
                corners: format!("{:?}", options.picture.corners),
                fill: options.picture.frame.fill,
            },
        })
    }

    /// Ends the run.
    pub fn finish(self, ran: Ran) -> Result<Summary, HeadlessError> {
        let header = self.header.ok_or_else(|| HeadlessError::Server("no frame was asked for".to_owned()))?;
        let Ran { frames, first_picture_ms, server_ms, traffic } = ran;
        let header = Header { updates: self.updates, first_picture_ms, server_ms, traffic, ..header };
        let summary = Summary { header, frames };
        if let Some(writer) = self.writer {
            writer.finish(&summary)?;
        }
        Ok(summary)
    }
}
