//! Topic `timing`: milliseconds by stage on both ends, and the bytes between them.
//!
//! Times are wall times, medians of several runs, of this machine and adapter; a software adapter works on the processor.

mod first_picture;
mod stages;
mod timed;

use anyhow::Context;
use gpu::Gpu;
use protocol::Look;
use scene::Scene;

use crate::report::plot::{Bars, draw_bars};
use crate::report::progress::Progress;
use crate::report::{Bar, Report, Row};
use crate::stage::Stage;
use crate::topic::{Run, Topic, scene_label};

/// See the module.
pub struct Timing;

/// A client's output where `--size` gives none.
const OUTPUT_PX: (u32, u32) = (640, 360);
/// Runs of each stage, of a full and of a quick report.
const REPEATS: usize = 7;
const QUICK_REPEATS: usize = 3;
/// The codec's bytes against zstd at level 1 on the raw planes, summed over the scenes.
const CODEC_BAR: f64 = 0.5;
/// Milliseconds until the first good picture of `urban`.
const FIRST_PICTURE_BAR_MS: f64 = 1500.0;

impl Topic for Timing {
    fn name(&self) -> &'static str {
        "timing"
    }

    fn about(&self) -> &'static str {
        "Milliseconds by stage on both ends: a server's images, non-redundant beside conventional, readback, encoding, \
         decoding, a client's frame, and the time to the first picture; and the codec's bytes."
    }

    fn default_scenes(&self, quick: bool) -> Vec<String> {
        let still = scene::builtin::names().filter(|name| !name.ends_with("-moving"));
        if quick { vec!["urban".to_owned(), "birdnest".to_owned()] } else { still.map(str::to_owned).collect() }
    }

    fn run(&self, run: &Run, report: &mut Report) -> anyhow::Result<()> {
        let gpu = run.gpu(report)?.clone();
        let size_px = run.size_px.unwrap_or(OUTPUT_PX);
        let repeats = if run.quick { QUICK_REPEATS } else { REPEATS };
        describe(report, size_px, repeats);
        let progress = Progress::new("timing", run.scenes.len() as u64 + 1);
        let mut totals = stages::CodecTotals::default();
        for name in &run.scenes {
            progress.say(format!("timing {}", scene_label(name)));
            if let Err(error) = scene(&gpu, run.load(name), size_px, repeats, &mut totals, report) {
                report.rows.push(Row::failed(&scene_label(name), "all stages", &error));
            }
            progress.step();
        }
        codec_bars(&totals, report);
        progress.say("timing the first picture");
        let name = run.scenes.iter().find(|name| *name == "urban").or(run.scenes.first()).context("no scene")?;
        let first = run.load(name).and_then(|scene| first_picture::measure(&gpu, scene, size_px, repeats.div_ceil(2)));
        match first {
            Ok(row) => {
                if row.scene == "urban" {
                    let found = row.figure("time_ms.good_picture.median");
                    let what = "urban: websocket open to first good picture, median (reported, not asserted)";
                    report.bars.push(Bar::at_most(what, FIRST_PICTURE_BAR_MS, found, "ms"));
                }
                report.rows.push(row);
            }
            Err(error) => report.rows.push(Row::failed(&scene_label(name), first_picture::METHOD, &error)),
        }
        plots(run, report)
    }
}

fn describe(report: &mut Report, size_px: (u32, u32), repeats: usize) {
    let profile = if cfg!(debug_assertions) { "development: CPU stages are slower than in release" } else { "release" };
    report.settings.set("build", profile);
    report.settings.set("output", format!("{}x{} at 60 degrees", size_px.0, size_px.1));
    report.settings.set("images", format!("{} of {1}x{1}", stages::IMAGES, stages::IMAGE_PX));
    report.settings.set("repeats", repeats);
    report.notes = [
        "Wall times, medians; software adapters work on the processor, so that their milliseconds are processor time.",
        "image: the GPU's part of one image of a set of 4 (a quarter of the set's time); readback: from the end of the GPU's \
         work to the planes in memory, a set.",
        "encode, decode: a set of 4 on one thread; MB/s count raw bytes at wire width (depth 2, normal 2, colour 3, object 2, \
         material 1 a sample, constant planes left out).",
        "of_zstd: the codec's bytes, with masks and headers, over those of zstd at level 1 on the raw planes, which has neither.",
        "build: surfaces of everything held; frame: drawing, lighting and filling a frame.",
        "good picture: at most 2 % holes and FLIP at most 0.15 over covered pixels; the time is from the websocket's opening \
         until the frame was drawn. Server and client share this machine.",
    ]
    .map(str::to_owned)
    .to_vec();
}

fn scene(
    gpu: &Gpu,
    scene: anyhow::Result<Scene>,
    size_px: (u32, u32),
    repeats: usize,
    totals: &mut stages::CodecTotals,
    report: &mut Report,
) -> anyhow::Result<()> {
    let stage = Stage::new(gpu, scene?, Look::Plain)?;
    report.rows.extend(stages::measure(gpu, stage, size_px, repeats, totals)?);
    Ok(())
}

fn codec_bars(totals: &stages::CodecTotals, report: &mut Report) {
    for (kind, total) in [("conventional", totals.conventional), ("non-redundant", totals.non_redundant)] {
        let found = (total.zstd_bytes > 0.0).then(|| total.encoded_bytes / total.zstd_bytes);
        let what = format!("codec's bytes over zstd-1's, {kind} images, summed over the scenes");
        report.bars.push(Bar::at_most(what, CODEC_BAR, found, ""));
    }
}

/// Stages and bytes of each scene.
fn plots(run: &Run, report: &mut Report) -> anyhow::Result<()> {
    let mut scenes: Vec<String> = report.rows.iter().map(|row| row.scene.clone()).collect();
    scenes.sort();
    scenes.dedup();
    for scene in scenes {
        let rows = || report.rows.iter().filter(|row| row.scene == scene && row.method != first_picture::METHOD);
        let stages: Vec<_> = rows()
            .flat_map(|row| row.time_ms.0.iter().map(move |(stage, spread)| (row, stage, spread.median)))
            .map(|(row, stage, ms)| (stage.replace('_', " "), ms, row.method.clone()))
            .collect();
        let sizes: Vec<_> = rows()
            .flat_map(|row| row.bytes.0.iter().map(move |(kind, bytes)| (row, kind, *bytes)))
            .map(|(row, kind, bytes)| (kind.replace('_', " "), bytes / 1000.0, row.method.clone()))
            .collect();
        let plots = [
            ("stages", "time by stage", "ms, median", stages, "milliseconds of each stage"),
            (
                "bytes",
                "bytes of a set of four images",
                "kB",
                sizes,
                "a set's bytes: raw, by zstd at level 1, by the codec",
            ),
        ];
        for (kind, title, x_label, bars, caption) in plots.into_iter().filter(|(_, _, _, bars, _)| !bars.is_empty()) {
            let path = run.figure(report, format!("{kind}-{scene}.svg"), format!("{scene}: {caption}."));
            draw_bars(&Bars { title: format!("{scene}: {title}"), x_label: x_label.to_owned(), bars }, &path)?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::scratch_folder;

    #[test]
    fn every_stage_of_a_scene_is_timed() {
        let out = scratch_folder("timing");
        let mut run = Run::new(vec!["pillars".to_owned()], out.clone());
        (run.size_px, run.quick) = (Some((96, 64)), true);
        let mut report = Report::new("timing", "");
        Timing.run(&run, &mut report).expect("a GPU adapter, software or not");
        assert!(!report.has_failures(), "{:?}", report.rows);
        let [conventional, non_redundant, finer, first_picture] = &report.rows[..] else { panic!("{:?}", report.rows) };
        for stage in ["image", "readback", "encode", "decode", "build_4_images", "frame_4_images"] {
            let median = |row: &Row| row.figure(&format!("time_ms.{stage}.median")).expect(stage);
            assert!(median(conventional) > 0.0 && median(non_redundant) > 0.0, "{stage}");
        }
        let figure = |row: &Row, path: &str| row.figure(path).expect(path);
        assert!(figure(non_redundant, "counts.samples") < figure(conventional, "counts.samples"));
        assert!(figure(finer, "counts.samples_finer") > 4.0 * figure(finer, "counts.samples_usual"));
        assert!(figure(first_picture, "error.holes_share.worst") <= 0.02);
        assert_eq!(report.bars.len(), 2, "the codec's");
        for figure in &report.figures {
            assert!(out.join(&figure.file).exists(), "{}", figure.file);
        }
        std::fs::remove_dir_all(out).expect("was written");
    }
}
