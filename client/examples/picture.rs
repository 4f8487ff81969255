//! The client as a library: looks at a server's scene from where it begins, until all that is seen there has come, and saves a picture.
//!
//!     cargo run --release --package vantage-client --example picture -- ws://127.0.0.1:8080 picture.png

use std::sync::Arc;

use anyhow::{Context, bail};
use camera::Pinhole;
use gpu::{Gpu, Readback};
use protocol::Limits;
use protocol::message::{Clock, ViewSize};
use vantage_client::draw::picture::{Picture, PictureOptions};
use vantage_client::receive::address::websocket_url;
use vantage_client::receive::pump::Pump;
use vantage_client::receive::socket::Sockets;
use vantage_client::receive::viewer::{Decoder, Viewer};

const SIZE_PX: (u32, u32) = (960, 600);
const VIEW: ViewSize = ViewSize { width_px: SIZE_PX.0, height_px: SIZE_PX.1, fov_y_rad: 1.0 };

fn main() -> anyhow::Result<()> {
    let mut arguments = std::env::args().skip(1);
    let (server, file) = (arguments.next().context("which server?")?, arguments.next().context("which file?")?);
    let gpu = Gpu::block_on(Gpu::new_headless())?;
    let mut picture = Picture::new(&gpu, wgpu::TextureFormat::Rgba8Unorm, PictureOptions::default())?;
    let url = websocket_url(&server)?;
    let sockets = Sockets::new()?.ready_for(&url, None)?;
    let mut pump = Pump::new(&sockets, &url, Arc::new(|| ()));
    let decoder = Decoder::on_thread(Limits::default(), Arc::new(|| ()))?;
    let mut viewer = Viewer::new(&server, Clock::Wall, VIEW, decoder, pump.now_s());
    viewer.set_build(picture.build());

    let camera = loop {
        let soon_s = pump.now_s() + 0.02;
        pump.turn_until(&mut viewer, soon_s);
        viewer.advance(&mut picture, soon_s, f64::INFINITY);
        if let Some(why) = viewer.refusal() {
            bail!("{server} does not let us in: {why}");
        }
        let Some((eye, near_m)) = viewer.welcome().map(|said| (said.start_world_from_eye, said.near_m)) else {
            continue;
        };
        viewer.set_pose(eye, soon_s);
        let camera = Pinhole::symmetric(eye, SIZE_PX, VIEW.fov_y_rad, near_m);
        if picture.is_at_rest(&camera) {
            break camera;
        }
    };

    let target = gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: None,
        size: wgpu::Extent3d { width: SIZE_PX.0, height: SIZE_PX.1, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: wgpu::TextureFormat::Rgba8Unorm,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
        view_formats: &[],
    });
    picture.draw(viewer.held(), &camera, &target.create_view(&wgpu::TextureViewDescriptor::default()));
    let mut readback = Readback::default();
    let pixels = readback.texture(&target, 0, SIZE_PX);
    let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    let encoded = readback.encode(&gpu, &mut encoder);
    gpu.queue.submit([encoder.finish()]);
    let rgba = encoded.map().wait(&gpu)?.bytes(pixels);
    image::save_buffer(&file, &rgba, SIZE_PX.0, SIZE_PX.1, image::ExtendedColorType::Rgba8)?;
    Ok(())
}
