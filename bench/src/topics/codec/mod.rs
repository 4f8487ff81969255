//! Topic `codec`: bytes a sample by plane and by method, the speed of both directions on one thread, and what steps of colour
//! cost.
//!
//! A plane's bytes are found by taking it away: they are what the patch costs with that plane, less what it costs with every
//! plane but the mask and the objects made constant.

mod scale;

use std::collections::BTreeMap;
use std::time::Instant;

use anyhow::Context;
use camera::Pinhole;
use clap::Args;
use gpu::Gpu;
use image::ImageEncoder;
use protocol::codec::{Coding, ColourSteps, Profile, decode_patch};
use protocol::held::{Edit, NextSteps, Update};
use protocol::wire::encode_update;
use protocol::{DepthImage, Limits, Look};
use server::coding::CodingRule;
use server::discretize::{Discretization, Discretizer};
use server::start::{near_m, start_pose};

use crate::report::plot::{Bars, draw_bars};
use crate::report::progress::Progress;
use crate::report::{Bar, Report, Row};
use crate::sets::{self, SetPlan};
use crate::spread::{Better, Spread};
use crate::stage::Stage;
use crate::topic::{Run, Topic, scene_label};

/// See the module.
pub struct Codec;

const IMAGES: usize = 4;
const IMAGE_PX: u32 = 512;
/// The eye's output, for which the server plans the set.
const OUTPUT_PX: (u32, u32) = (640, 360);
const FOV_Y_RAD: f64 = std::f64::consts::TAU / 6.0;
const REPEATS: usize = 7;
const QUICK_REPEATS: usize = 3;
/// Bytes over those of zstd at level 1 on the raw planes.
const SIZE_BAR: f64 = 0.5;
/// Bytes of the dense profile over those of the fast one.
const DENSE_BAR: f64 = 0.85;
/// 300 MB/s and 500 MB/s of raw bytes, as milliseconds a megabyte.
const ENCODE_BAR_MS_PER_MB: f64 = 1000.0 / 300.0;
const DECODE_BAR_MS_PER_MB: f64 = 1000.0 / 500.0;

const KINDS: [(&str, Discretization); 2] =
    [("conventional", Discretization::Conventional), ("non-redundant", Discretization::SURFACE)];

/// Sums over the scenes, by kind and method.
#[derive(Debug, Clone, Copy, Default)]
struct Total {
    bytes: f64,
    raw_bytes: f64,
    encode_ms: f64,
    decode_ms: f64,
}

/// What only this topic takes.
#[derive(Debug, Default, clap::Args)]
struct Arguments {
    /// Also writes each set as an update in the default coding, and `updates.json`, for bench/wasm-decode.mjs.
    #[arg(long)]
    write_updates: bool,
}

/// An update that was written.
#[derive(Debug, serde::Serialize)]
struct Written {
    file: String,
    raw_bytes: usize,
}

type Totals = BTreeMap<(&'static str, String), Total>;

impl Topic for Codec {
    fn name(&self) -> &'static str {
        "codec"
    }

    fn about(&self) -> &'static str {
        "Bytes a sample by plane and by method, megabytes of samples a second in both directions, and what steps of colour \
         save and cost."
    }

    fn arguments(&self, command: clap::Command) -> clap::Command {
        Arguments::augment_args(command)
    }

    fn default_scenes(&self, quick: bool) -> Vec<String> {
        let still = scene::builtin::names().filter(|name| !name.ends_with("-moving"));
        if quick { vec!["urban".to_owned(), "birdnest".to_owned()] } else { still.map(str::to_owned).collect() }
    }

    fn run(&self, run: &Run, report: &mut Report) -> anyhow::Result<()> {
        let gpu = run.gpu(report)?.clone();
        let repeats = if run.quick { QUICK_REPEATS } else { REPEATS };
        describe(report, repeats);
        let progress = Progress::new("codec", run.scenes.len() as u64);
        let mut totals = Totals::new();
        let arguments: Arguments = run.arguments()?;
        let mut updates = arguments.write_updates.then(Vec::new);
        for name in &run.scenes {
            progress.say(format!("coding {}", scene_label(name)));
            match scene(&gpu, name, repeats, &mut totals, (run, &mut updates)) {
                Ok(rows) => report.rows.extend(rows),
                Err(error) => report.rows.push(Row::failed(&scene_label(name), "all methods", &error)),
            }
            progress.step();
        }
        if let Some(updates) = updates {
            std::fs::write(run.out.join("updates.json"), serde_json::to_string_pretty(&updates)?)?;
        }
        bars(&totals, report);
        plot(run, &totals, report)
    }
}

fn describe(report: &mut Report, repeats: usize) {
    let profile = if cfg!(debug_assertions) { "development" } else { "release" };
    report.settings.set("build", profile);
    report.settings.set("images", format!("{IMAGES} of {IMAGE_PX}x{IMAGE_PX}"));
    report.settings.set("repeats", repeats);
    report.notes = [
        "Raw bytes: depth 2, normal 2, colour 3, object 2, material 1 a sample; planes of one value are left out on both sides.",
        "Our bytes hold mask and header; those of zstd on the raw planes hold neither. PNG holds the colour plane alone.",
        "The memory copy, zstd and RVL (which codes the depths of all pixels, holes too) give the scale of speeds.",
        "MB/s count raw bytes, on one thread, medians. per_sample figures are bytes a sample by plane; outline is mask and header.",
        "Luma and chroma steps: lossless 1/1, fine 2/4, coarse 4/8; the PSNR is of base colours over all samples.",
    ]
    .map(str::to_owned)
    .to_vec();
}

fn scene(
    gpu: &Gpu,
    name: &str,
    repeats: usize,
    totals: &mut Totals,
    (run, updates): (&Run, &mut Option<Vec<Written>>),
) -> anyhow::Result<Vec<Row>> {
    let mut stage = Stage::new(gpu, run.load(name)?, Look::Plain)?;
    let output = Pinhole::symmetric(start_pose(&stage.scene), OUTPUT_PX, FOV_Y_RAD, near_m(&stage.scene));
    stage.show(0.0, output.world_from_eye.translation)?;
    let mut discretizer = Discretizer::new(&stage.renderer)?;
    let mut rows = Vec::new();
    for (kind, discretization) in KINDS {
        let plan = SetPlan { discretization, images: IMAGES, image_px: IMAGE_PX };
        let (views, precision) = sets::planned(&stage.scene, output.world_from_eye, &output, &plan);
        let images = sets::make(&stage, &mut discretizer, &views, discretization, precision)?.images;
        if let Some(updates) = updates {
            updates.push(write_update(&format!("{}-{kind}.update", stage.scene.name), &images, run)?);
        }
        let mut add = |method: String, row: &mut Row| {
            let total = totals.entry((kind, method)).or_default();
            total.bytes += row.figure("bytes.coded").unwrap_or_default();
            total.raw_bytes += row.figure("bytes.raw").unwrap_or_default();
            total.encode_ms += row.figure("time_ms.encode.median").unwrap_or_default();
            total.decode_ms += row.figure("time_ms.decode.median").unwrap_or_default();
        };
        let row = |method: &str| Row::new(&stage.scene.name, &format!("{kind}: {method}"));
        for profile in [Profile::Fast, Profile::Dense] {
            for colour in ColourSteps::ALL {
                let coding = Coding { profile, colour };
                let mut row = row(&label(coding));
                ours(&images, coding, repeats, &mut row)?;
                add(label(coding), &mut row);
                rows.push(row);
            }
        }
        // The slow one for its bytes alone.
        for (level, repeats) in [(1, repeats), (19, 1)] {
            let mut row = row(&format!("zstd-{level} raw"));
            scale::zstd_raw(&images, level, repeats, &mut row)?;
            row.counts.set("per_sample", row.figure("bytes.coded").unwrap_or_default() / sample_count(&images));
            add(format!("zstd-{level} raw"), &mut row);
            rows.push(row);
        }
        let mut copied = row("memory copy of the raw planes");
        scale::copied_raw(&images, repeats, &mut copied)?;
        let mut rvl = row("RVL, depths alone");
        scale::rvl_depths(&images, repeats, &mut rvl)?;
        rows.extend([copied, rvl]);
        let mut row = row("PNG colour");
        let png = images.iter().map(png_bytes).sum::<anyhow::Result<usize>>()?;
        row.bytes.set("coded", png as f64);
        row.counts.set("colour_per_sample", png as f64 / sample_count(&images));
        rows.push(row);
    }
    Ok(rows)
}

/// Writes images as one update.
fn write_update(file: &str, images: &[DepthImage], run: &Run) -> anyhow::Result<Written> {
    let edits = sets::patches(images).map(|patch| Edit::Add(Box::new(patch))).collect();
    let update = Update { number: 1, scene_time_s: 0.0, pose_seq: 0, edits, next: NextSteps::default(), digest: 0 };
    let coding = CodingRule::default().coding(None);
    std::fs::write(run.out.join(file), encode_update(&update, coding).bytes)?;
    Ok(Written { file: file.to_owned(), raw_bytes: images.iter().map(DepthImage::raw_bytes).sum() })
}

fn label(Coding { profile, colour }: Coding) -> String {
    let colour = match colour {
        ColourSteps::Lossless => "lossless",
        ColourSteps::Fine => "fine",
        ColourSteps::Coarse => "coarse",
    };
    format!("{} {colour}", if profile == Profile::Fast { "fast" } else { "dense" })
}

fn sample_count(images: &[DepthImage]) -> f64 {
    images.iter().map(DepthImage::sample_count).sum::<usize>() as f64
}

fn ours(images: &[DepthImage], coding: Coding, repeats: usize, row: &mut Row) -> anyhow::Result<()> {
    let mut settled = images.to_vec();
    settled.iter_mut().for_each(|image| coding.colour.settle_all(&mut image.colour));
    let (mut encode_ms, mut decode_ms, mut bytes) = (Vec::new(), Vec::new(), 0);
    for _ in 0..=repeats {
        let started = Instant::now();
        let patches = sets::encoded(&settled, coding);
        encode_ms.push(started.elapsed().as_secs_f64() * 1000.0);
        let started = Instant::now();
        let decode = |bytes: &Vec<u8>| Ok(decode_patch(bytes, &Limits::default())?.image);
        let decoded = patches.iter().map(decode).collect::<anyhow::Result<Vec<_>>>()?;
        decode_ms.push(started.elapsed().as_secs_f64() * 1000.0);
        anyhow::ensure!(decoded == settled, "settled images do not come back");
        bytes = patches.iter().map(Vec::len).sum();
    }
    let raw: usize = images.iter().map(DepthImage::raw_bytes).sum();
    row.bytes.set("raw", raw as f64);
    row.bytes.set("coded", bytes as f64);
    for (name, ms) in [("encode", encode_ms), ("decode", decode_ms)] {
        // The first run warms up.
        let spread = Spread::of(&ms[1..], Better::Lower).context("at least one run")?;
        row.counts.set(format!("{name}_mb_s"), raw as f64 / spread.median / 1000.0);
        row.time_ms.set(name, spread);
    }
    row.counts.set("per_sample", bytes as f64 / sample_count(images));
    for (plane, bytes) in plane_bytes(&settled, coding) {
        row.counts.set(format!("{plane}_per_sample"), bytes / sample_count(images));
    }
    row.counts.set("colour_psnr_db", psnr_db(images, &settled));
    Ok(())
}

/// The bytes of each plane, see the module.
fn plane_bytes(images: &[DepthImage], coding: Coding) -> [(&'static str, f64); 7] {
    /// Keeps the objects and one more plane.
    fn keep(image: &DepthImage, plane: &str) -> DepthImage {
        let mut kept = image.clone();
        if plane != "depth" {
            kept.depth.fill(0);
        }
        if plane != "normal" {
            kept.normal.fill([127; 2]);
            kept.normal_rest.clear();
        }
        if plane != "colour" {
            kept.colour.fill([0; 3]);
        }
        if plane != "material" {
            kept.material.fill(0);
        }
        if plane == "outline" {
            kept.object.fill(0);
        }
        if plane == "ends" {
            // What ends is told by depths.
            kept.depth.clone_from(&image.depth);
        } else {
            kept.ends.clear();
        }
        kept
    }
    let bytes = |plane: &str| {
        let kept: Vec<DepthImage> = images.iter().map(|image| keep(image, plane)).collect();
        sets::encoded(&kept, coding).iter().map(Vec::len).sum::<usize>() as f64
    };
    let (outline, object) = (bytes("outline"), bytes("object"));
    let plane = |plane: &'static str| (plane, bytes(plane) - object);
    let [depth, normal, colour, material] = ["depth", "normal", "colour", "material"].map(plane);
    let ends = ("ends", bytes("ends") - object - depth.1);
    [("outline", outline), ("object", object - outline), depth, normal, ends, colour, material]
}

fn psnr_db(images: &[DepthImage], settled: &[DepthImage]) -> f64 {
    let channels = |images: &[DepthImage]| {
        images.iter().flat_map(|image| image.colour.as_flattened().to_vec()).map(f64::from).collect::<Vec<f64>>()
    };
    let (exact, moved) = (channels(images), channels(settled));
    let squares: f64 = exact.iter().zip(&moved).map(|(a, b)| (a - b) * (a - b)).sum();
    (10.0 * (255.0_f64.powi(2) * exact.len() as f64 / squares).log10()).min(100.0)
}

/// The colour plane as a PNG, holes black.
fn png_bytes(depth_image: &DepthImage) -> anyhow::Result<usize> {
    let (width_px, height_px) = depth_image.mask.size_px();
    let mut picture = image::RgbImage::new(width_px, height_px);
    for ((x, y), &colour) in depth_image.mask.occupied().zip(&depth_image.colour) {
        picture.put_pixel(x, y, image::Rgb(colour));
    }
    let mut bytes = Vec::new();
    image::codecs::png::PngEncoder::new(&mut bytes).write_image(
        picture.as_raw(),
        width_px,
        height_px,
        image::ExtendedColorType::Rgb8,
    )?;
    Ok(bytes.len())
}

fn bars(totals: &Totals, report: &mut Report) {
    for (kind, _) in KINDS {
        let total = |method: &str| totals.get(&(kind, method.to_owned())).copied();
        let ratio = |a: &str, b: &str| Some(total(a)?.bytes / total(b)?.bytes);
        for method in ["dense lossless", "fast lossless", "fast fine", "fast coarse"] {
            let what = format!("{kind}, {method}: bytes over zstd-1's on the raw planes, summed over the scenes");
            report.bars.push(Bar::at_most(what, SIZE_BAR, ratio(method, "zstd-1 raw"), ""));
        }
        for colour in ["lossless", "fine"] {
            let found = ratio(&format!("dense {colour}"), &format!("fast {colour}"));
            report.bars.push(Bar::at_most(format!("{kind}, {colour}: dense bytes over fast"), DENSE_BAR, found, ""));
        }
        let mut speed = |what: &str, most: f64, ms: fn(&Total) -> f64| {
            let per_mb = total("fast lossless").map(|total| ms(&total) / total.raw_bytes * 1e6);
            report.bars.push(Bar::at_most(format!("{kind}: fast, {what}"), most, per_mb, "ms"));
        };
        speed("encoding a MB of samples (300 MB/s)", ENCODE_BAR_MS_PER_MB, |total| total.encode_ms);
        speed("decoding a MB of samples (500 MB/s)", DECODE_BAR_MS_PER_MB, |total| total.decode_ms);
    }
}

fn plot(run: &Run, totals: &Totals, report: &mut Report) -> anyhow::Result<()> {
    let bar = |((kind, method), total): (&(&str, String), &Total)| {
        (format!("{kind}, {method}"), total.bytes / 1000.0, (*kind).to_owned())
    };
    let bars: Vec<_> = totals.iter().map(bar).collect();
    if bars.is_empty() {
        return Ok(());
    }
    let path = run.figure(report, "codec-bytes.svg", "Bytes of all sets, by kind of images and method.");
    draw_bars(&Bars { title: "bytes of all sets".to_owned(), x_label: "kB".to_owned(), bars }, &path)
}
