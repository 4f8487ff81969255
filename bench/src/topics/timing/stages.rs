//! Every stage but the network: images, readback, codec, surfaces, frames.

use camera::Pinhole;
use client::draw::frame::Options;
use gpu::Gpu;
use protocol::codec::decode_patch;
use protocol::{DepthImage, Limits};
use serde_json::json;
use server::coding::CodingRule;
use server::discretize::{Discretization, Discretizer};
use server::start::{near_m, start_pose};

use super::timed::{spread, timed};
use crate::client_view::{ClientView, HeldSet};
use crate::report::Row;
use crate::sets::{self, SetPlan};
use crate::stage::Stage;

/// Of a set.
pub(super) const IMAGES: usize = 4;
pub(super) const IMAGE_PX: u32 = 512;
/// How many times as fine the samples are that are far finer than a frame's pixels.
const FINER: u32 = 3;
/// Field of view of the output.
const FOV_Y_RAD: f64 = std::f64::consts::TAU / 6.0;
/// zstd's level in the comparison: the codec's own.
const ZSTD_LEVEL: i32 = 1;

/// Bytes of one kind of images, summed over the scenes.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct CodecTotal {
    pub encoded_bytes: f64,
    pub zstd_bytes: f64,
}

/// Both kinds.
#[derive(Debug, Default)]
pub(super) struct CodecTotals {
    pub conventional: CodecTotal,
    pub non_redundant: CodecTotal,
}

/// A row for each kind of images.
pub(super) fn measure(
    gpu: &Gpu,
    mut stage: Stage,
    size_px: (u32, u32),
    repeats: usize,
    totals: &mut CodecTotals,
) -> anyhow::Result<Vec<Row>> {
    let output = Pinhole::symmetric(start_pose(&stage.scene), size_px, FOV_Y_RAD, near_m(&stage.scene));
    stage.show(0.0, output.world_from_eye.translation)?;
    let mut discretizer = Discretizer::new(&stage.renderer)?;
    let mut view = ClientView::new(gpu, size_px)?;
    let kinds = [
        ("conventional images", Discretization::Conventional, &mut totals.conventional),
        ("non-redundant images", Discretization::default(), &mut totals.non_redundant),
    ];
    let mut rows: Vec<Row> = Vec::new();
    for (method, discretization, total) in kinds {
        let mut row = Row::new(&stage.scene.name, method);
        row.parameters.set("triangles", json!(stage.scene.triangle_count()));
        let images = images(gpu, &stage, &mut discretizer, &output, discretization, repeats, &mut row)?;
        if let Some(conventional) = rows.first().and_then(|row| row.figure("time_ms.image.median"))
            && let Some(own) = row.figure("time_ms.image.median")
        {
            row.counts.set("image_ms_over_conventional", own / conventional);
        }
        codec(&images, repeats, total, &mut row)?;
        client(gpu, &stage, &mut view, &output, &images, repeats, &mut row)?;
        rows.push(row);
    }
    rows.push(held_finely(gpu, &stage, (&mut discretizer, &mut view), &output, repeats)?);
    Ok(rows)
}

/// A frame of samples far finer than its pixels, over one of the usual ones: drawing is to cost by pixels, not by what is held.
fn held_finely(
    gpu: &Gpu,
    stage: &Stage,
    (discretizer, view): (&mut Discretizer, &mut ClientView),
    output: &Pinhole,
    repeats: usize,
) -> anyhow::Result<Row> {
    let look = (stage.renderer.materials(), &stage.lighting);
    let mut row = Row::new(&stage.scene.name, &format!("samples {FINER} times as fine"));
    let mut medians = Vec::new();
    for (name, image_px) in [("usual", IMAGE_PX), ("finer", IMAGE_PX * FINER)] {
        let discretization = Discretization::default();
        let plan = SetPlan { discretization, images: IMAGES, image_px };
        let (views, precision) = sets::planned(&stage.scene, output.world_from_eye, output, &plan);
        let captures = discretizer.run(&stage.renderer, &views, discretization)?.wait()?;
        let images: Vec<DepthImage> = captures.iter().map(|capture| capture.depth_image(precision)).collect();
        let set = HeldSet::new(gpu, &images, look)?;
        let frames: Result<Vec<f64>, _> = (0..=repeats).map(|_| view.draw(&set, output, Options::default())).collect();
        let frame_ms = spread(&frames?[1..]);
        medians.push(frame_ms.median);
        row.time_ms.set(format!("frame_{name}"), frame_ms);
        row.counts.set(format!("samples_{name}"), set.surfaces.stats().samples as f64);
        row.counts.set(format!("quads_drawn_{name}"), set.surfaces.quads_drawn(output) as f64);
    }
    row.counts.set("frame_finer_over_usual", medians[1] / medians[0]);
    Ok(row)
}

fn images(
    gpu: &Gpu,
    stage: &Stage,
    discretizer: &mut Discretizer,
    output: &Pinhole,
    discretization: Discretization,
    repeats: usize,
    row: &mut Row,
) -> anyhow::Result<Vec<DepthImage>> {
    let plan = SetPlan { discretization, images: IMAGES, image_px: IMAGE_PX };
    let (views, precision) = sets::planned(&stage.scene, output.world_from_eye, output, &plan);
    let (mut image_ms, mut readback_ms, mut captures) = (Vec::new(), Vec::new(), Vec::new());
    // The first run warms up.
    for _ in 0..=repeats {
        let (gpu_ms, pending) = timed(|| {
            let pending = discretizer.run(&stage.renderer, &views, discretization)?;
            gpu.wait_idle()?;
            Ok(pending)
        })?;
        image_ms.push(gpu_ms / IMAGES as f64);
        let (waited_ms, made) = timed(|| Ok(pending.wait()?))?;
        readback_ms.push(waited_ms);
        captures = made;
    }
    row.time_ms.set("image", spread(&image_ms[1..]));
    row.time_ms.set("readback", spread(&readback_ms[1..]));
    Ok(captures.iter().map(|capture| capture.depth_image(precision)).collect())
}

fn codec(images: &[DepthImage], repeats: usize, total: &mut CodecTotal, row: &mut Row) -> anyhow::Result<()> {
    // As a server codes for a client of which it knows nothing yet.
    let coding = CodingRule::default().coding(None);
    let (mut encode_ms, mut decode_ms, mut patches) = (Vec::new(), Vec::new(), Vec::new());
    for _ in 0..=repeats {
        let (ms, encoded) = timed(|| Ok(sets::encoded(images, coding)))?;
        encode_ms.push(ms);
        patches = encoded;
        let decode = || {
            let limits = Limits::default();
            patches.iter().map(|bytes| Ok(decode_patch(bytes, &limits)?.image)).collect::<anyhow::Result<Vec<_>>>()
        };
        let (ms, decoded) = timed(decode)?;
        decode_ms.push(ms);
        anyhow::ensure!(decoded == images, "the codec is not lossless");
    }
    row.time_ms.set("encode", spread(&encode_ms[1..]));
    row.time_ms.set("decode", spread(&decode_ms[1..]));
    let raw: usize = images.iter().map(DepthImage::raw_bytes).sum();
    let encoded: usize = patches.iter().map(Vec::len).sum();
    let mut zstd_bytes = 0;
    for image in images {
        zstd_bytes += zstd::bulk::compress(&sets::raw_planes(image), ZSTD_LEVEL)?.len();
    }
    row.bytes.set("raw", raw as f64);
    row.bytes.set("zstd", zstd_bytes as f64);
    row.bytes.set("encoded", encoded as f64);
    let mb_s = |name: &str, row: &Row| row.figure(&format!("time_ms.{name}.median")).map(|ms| raw as f64 / ms / 1000.0);
    for name in ["encode", "decode"] {
        if let Some(rate) = mb_s(name, row) {
            row.counts.set(format!("{name}_mb_s"), rate);
        }
    }
    row.counts.set("of_zstd", encoded as f64 / zstd_bytes.max(1) as f64);
    row.counts.set("samples", images.iter().map(DepthImage::sample_count).sum::<usize>() as f64);
    total.encoded_bytes += encoded as f64;
    total.zstd_bytes += zstd_bytes as f64;
    Ok(())
}

fn client(
    gpu: &Gpu,
    stage: &Stage,
    view: &mut ClientView,
    output: &Pinhole,
    images: &[DepthImage],
    repeats: usize,
    row: &mut Row,
) -> anyhow::Result<()> {
    let look = (stage.renderer.materials(), &stage.lighting);
    for (count, build, frame) in [(1, "build_1_image", "frame_1_image"), (IMAGES, "build_4_images", "frame_4_images")] {
        let (mut build_ms, mut frame_ms) = (Vec::new(), Vec::new());
        let mut set = HeldSet::new(gpu, &images[..count], look)?;
        for _ in 0..=repeats {
            set = HeldSet::new(gpu, &images[..count], look)?;
            build_ms.push(set.build_ms);
        }
        for _ in 0..=repeats {
            frame_ms.push(view.draw(&set, output, Options::default())?);
        }
        row.time_ms.set(build, spread(&build_ms[1..]));
        row.time_ms.set(frame, spread(&frame_ms[1..]));
    }
    Ok(())
}
