//! Topic `frame-rate`: how often a client shows a picture while somebody walks, and how far what is on the screen is from what the eye should see at that very
//! moment: frames that are drawn as a whole, however long they take, beside frames that come in time.
//!
//! A walker's copy is held; then the same way is walked in real time, without a network. A picture is on the screen from when the device is done with it until the
//! next one is, so one that took long shows where the eye was long ago.

use std::sync::Arc;
use std::time::{Duration, Instant};

use camera::Pinhole;
use client::draw::picture::{Picture as ClientPicture, PictureOptions};
use client::draw::steady::{FrameRate, Resolution};
use gpu::{Gpu, Readback};
use protocol::{Held, Look};
use serde_json::json;

use crate::client_view::{SCREEN, screen};
use crate::compare::{Picture, flip, score};
use crate::report::plot::{Scatter, Series, draw_scatter};
use crate::report::progress::Progress;
use crate::report::{Bar, Report, Row};
use crate::spread::{Better, Spread};
use crate::stage::{Stage, picture};
use crate::topic::{Run, Topic, scene_label};
use crate::topics::sent_once::walk::{Setup, UPDATE_HZ, Walk, Walker};

/// See the module.
pub struct FrameRateTopic;

/// The client's output where `--size` gives none.
const OUTPUTS_PX: [(u32, u32); 2] = [(480, 300), (960, 600)];
const QUICK_OUTPUT_PX: (u32, u32) = (240, 150);
/// Seconds of the walk.
const WALK_S: f64 = 5.0;
const QUICK_WALK_S: f64 = 1.5;
/// What is on the screen is compared so often.
const COMPARED_HZ: f64 = 4.0;
/// Not before: a device that is too slow is found out first.
const BEGIN_S: f64 = 0.6;
/// No display shows pictures more often.
const SHORTEST_FRAME_S: f64 = 1.0 / 60.0;
/// Server views: pixels of a side.
const IMAGE_PX: u32 = 512;
const FOV_Y_RAD: f64 = std::f64::consts::FRAC_PI_3;
/// `None`: as if drawing took no time.
const WAYS: [(&str, Option<FrameRate>); 3] =
    [("no delay", None), ("whole", Some(FrameRate::Free)), ("held", Some(FrameRate::Held))];
/// Of frames that come in time, at 960x600 or less on two cores.
const FEWEST_PER_S: f64 = 10.0;
const LONGEST_MS: f64 = 1000.0;

impl Topic for FrameRateTopic {
    fn name(&self) -> &'static str {
        "frame-rate"
    }

    fn about(&self) -> &'static str {
        "Frames a second while somebody walks, and the error of what is on the screen against what the eye should see at that moment: frames drawn as a \
         whole, and frames that show the last picture as the eye sees it by now while the next one is drawn in slices."
    }

    fn default_scenes(&self, _quick: bool) -> Vec<String> {
        vec!["pillars".to_owned()]
    }

    fn run(&self, run: &Run, report: &mut Report) -> anyhow::Result<()> {
        let gpu = run.gpu(report)?.clone();
        let sizes_px = match run.size_px {
            Some(size_px) => vec![size_px],
            None if run.quick => vec![QUICK_OUTPUT_PX],
            None => OUTPUTS_PX.to_vec(),
        };
        let walk_s = if run.quick { QUICK_WALK_S } else { WALK_S };
        report.settings.set("walk", format!("{walk_s} s, compared {COMPARED_HZ} times a second"));
        report.notes = [
            "no delay: as if drawing took no time. whole: each frame is drawn as a whole. held: where that takes too long, frames show the last key picture as the eye sees it by now.",
            "flip_covered: of what is on the screen against the full scene at the eye's place at that very moment, over the pixels where that shows a surface; \
             a picture that took long to draw is of where the eye was. as_drawn: the same at the eye's place that it was drawn for. interval: between two pictures on the screen.",
        ]
        .map(str::to_owned)
        .to_vec();
        let progress = Progress::new("frame-rate", (run.scenes.len() * sizes_px.len()) as u64);
        for name in &run.scenes {
            progress.say(format!("a walk in {}", scene_label(name)));
            let mut place = match Place::new(&gpu, name, walk_s, run) {
                Ok(place) => place,
                Err(error) => {
                    report.rows.push(Row::failed(&scene_label(name), "walk", &error));
                    continue;
                }
            };
            for &size_px in &sizes_px {
                progress.say(format!("walking in {}, {}x{}", scene_label(name), size_px.0, size_px.1));
                if let Err(error) = walk(&mut place, size_px, run, report) {
                    report.rows.push(Row::failed(&scene_label(name), "walk", &error));
                }
                progress.step();
            }
        }
        plot(run, report)
    }
}

/// A scene with what somebody holds at the end of a walk through it.
struct Place {
    gpu: Gpu,
    label: String,
    walk: Walk,
    walk_s: f64,
    near_m: f64,
    held: Held,
    truths: Stage,
}

impl Place {
    fn new(gpu: &Gpu, name: &str, walk_s: f64, run: &Run) -> anyhow::Result<Place> {
        let scene = Arc::new(run.load(name)?);
        let walk = Walk::new(&scene, run.read_trace()?, walk_s);
        let mut walker = Walker::new(gpu, scene.clone(), &Setup::usual(IMAGE_PX))?;
        for tick in 0..=(walk_s * UPDATE_HZ) as usize {
            let now_s = tick as f64 / UPDATE_HZ;
            walker.tick(walk.at(now_s), now_s)?;
        }
        let mut truths = Stage::new(gpu, run.load(name)?, Look::Plain)?;
        truths.show(0.0, walk.at(0.0).translation)?;
        let near_m = server::start::near_m(&scene);
        Ok(Place { gpu: gpu.clone(), label: scene_label(name), walk, walk_s, near_m, held: walker.set.held, truths })
    }
}

/// Walks once by each way.
fn walk(place: &mut Place, size_px: (u32, u32), run: &Run, report: &mut Report) -> anyhow::Result<()> {
    let Place { gpu, label, walk, walk_s, near_m, held, truths } = place;
    let (walk_s, near_m) = (*walk_s, *near_m);
    let camera = |at_s: f64| Pinhole::symmetric(walk.at(at_s), size_px, FOV_Y_RAD, near_m);
    let compared: Vec<(f64, Picture)> = compared_at(walk_s)
        .map(|at_s| Ok((at_s, picture(&truths.smooth_truth(&camera(at_s))?))))
        .collect::<anyhow::Result<_>>()?;
    let mut of_held: Vec<(usize, f64)> = Vec::new();
    let mut walked = Vec::new();
    for (way, frame_rate) in WAYS {
        let shown = show(gpu, held, (frame_rate, walk_s), &compared, &camera)?;
        let (mut flips, mut as_drawn) = (Vec::new(), Vec::new());
        for (index, (at_s, truth)) in compared.iter().enumerate() {
            let Some(on_screen) = shown.on_screen(*at_s) else { continue };
            if frame_rate.is_some() {
                let drawn_truth = picture(&truths.smooth_truth(&camera(on_screen.drawn_s))?);
                as_drawn.extend(score(&on_screen.picture, &drawn_truth, None)?.flip_covered);
            }
            if let Some(flip) = score(&on_screen.picture, truth, None)?.flip_covered {
                if way == "held" {
                    of_held.push((index, flip));
                }
                flips.push(flip);
            }
        }
        let row = row(label, way, size_px, &shown, (&flips, &as_drawn));
        report.bars.extend(bars(&row, label, way, size_px));
        report.rows.push(row);
        walked.push(shown);
    }
    of_held.sort_by(|a, b| a.1.total_cmp(&b.1));
    let moments = [("median", of_held.get(of_held.len() / 2)), ("worst", of_held.last())];
    for (which, moment) in moments.into_iter().filter_map(|(which, moment)| moment.map(|(index, _)| (which, *index))) {
        let (at_s, truth) = &compared[moment];
        let file = format!("{label}-{}x{}-{which}.png", size_px.0, size_px.1);
        let caption = format!(
            "{label}: what is on the screen {at_s:.2} s into the walk, the {which} moment of held frames: as if drawing took no time, whole frames, held ones, the full scene; below, the \
             differences."
        );
        sheet(&walked, *at_s, truth)?.write(&run.figure(report, file, caption))?;
    }
    Ok(())
}

fn compared_at(walk_s: f64) -> impl Iterator<Item = f64> {
    (0..).map(|index| BEGIN_S + f64::from(index) / COMPARED_HZ).take_while(move |&at_s| at_s < walk_s)
}

/// A picture; times in seconds of the walk.
struct OnScreen {
    /// When the eye was where it is drawn from.
    drawn_s: f64,
    from_s: f64,
    picture: Picture,
}

/// The pictures of a walk.
struct Shown {
    /// By time.
    pictures: Vec<OnScreen>,
    resolution: Resolution,
}

impl Shown {
    fn on_screen(&self, at_s: f64) -> Option<&OnScreen> {
        self.pictures.iter().rev().find(|shown| shown.from_s <= at_s)
    }

    /// Milliseconds between two pictures.
    fn intervals_ms(&self) -> Vec<f64> {
        self.pictures.windows(2).map(|pair| (pair[1].from_s - pair[0].from_s) * 1e3).collect()
    }
}

/// Walks in real time, or from one compared moment to the next. Reading pictures back costs none: the walk stands still meanwhile.
fn show(
    gpu: &Gpu,
    held: &Held,
    (frame_rate, walk_s): (Option<FrameRate>, f64),
    compared: &[(f64, Picture)],
    camera: &dyn Fn(f64) -> Pinhole,
) -> anyhow::Result<Shown> {
    let options = PictureOptions { frame_rate: frame_rate.unwrap_or_default(), ..PictureOptions::default() };
    let mut client = ClientPicture::new(gpu, SCREEN, options)?;
    client.rebuild(held);
    let Pinhole { width_px, height_px, .. } = camera(0.0);
    let target = screen(gpu, (width_px, height_px));
    let view = target.create_view(&wgpu::TextureViewDescriptor::default());
    let mut pictures = Vec::new();
    if frame_rate.is_none() {
        for &(at_s, _) in compared {
            client.draw(held, &camera(at_s), &view);
            pictures.push(OnScreen { drawn_s: at_s, from_s: at_s, picture: read(gpu, &target)? });
        }
        return Ok(Shown { pictures, resolution: client.resolution() });
    }
    let mut now_s = 0.0;
    while now_s < walk_s {
        let begin = Instant::now();
        client.draw(held, &camera(now_s), &view);
        gpu.wait_idle()?;
        let took_s = begin.elapsed().as_secs_f64();
        if took_s < SHORTEST_FRAME_S {
            std::thread::sleep(Duration::from_secs_f64(SHORTEST_FRAME_S - took_s));
        }
        let drawn_s = now_s;
        now_s += took_s.max(SHORTEST_FRAME_S);
        pictures.push(OnScreen { drawn_s, from_s: now_s, picture: read(gpu, &target)? });
    }
    Ok(Shown { pictures, resolution: client.resolution() })
}

fn read(gpu: &Gpu, target: &wgpu::Texture) -> anyhow::Result<Picture> {
    let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    let mut readback = Readback::default();
    let slot = readback.texture(target, 0, (target.width(), target.height()));
    let encoded = readback.encode(gpu, &mut encoder);
    gpu.queue.submit([encoder.finish()]);
    Ok(Picture::from_rgba(target.width(), target.height(), &encoded.map().wait(gpu)?.bytes(slot)))
}

fn row(
    label: &str,
    way: &str,
    (width_px, height_px): (u32, u32),
    shown: &Shown,
    (flips, as_drawn): (&[f64], &[f64]),
) -> Row {
    let mut row = Row::new(label, &format!("{way}, {width_px}x{height_px}"));
    if let Some(spread) = Spread::of(flips, Better::Lower) {
        row.error.set("flip_covered", spread);
    }
    if let Some(spread) = Spread::of(as_drawn, Better::Lower) {
        row.error.set("as_drawn", spread);
    }
    if way == "no delay" {
        return row;
    }
    let intervals_ms = shown.intervals_ms();
    let frames_per_s = 1e3 * intervals_ms.len() as f64 / intervals_ms.iter().sum::<f64>();
    row.counts.set("frames_per_s", frames_per_s);
    if let Some(spread) = Spread::of(&intervals_ms, Better::Lower) {
        row.time_ms.set("interval", spread);
    }
    row.parameters.set("resolution", json!(shown.resolution.to_string()));
    row
}

fn bars(row: &Row, label: &str, way: &str, (width_px, height_px): (u32, u32)) -> Vec<Bar> {
    if way != "held" || width_px * height_px > 960 * 600 {
        return Vec::new();
    }
    let of = format!("{label}, {width_px}x{height_px}");
    let per_s = row.figure("counts.frames_per_s");
    let longest_ms = row.figure("time_ms.interval.worst");
    vec![
        Bar::at_most(format!("{of}: milliseconds a frame"), 1e3 / FEWEST_PER_S, per_s.map(|per_s| 1e3 / per_s), "ms"),
        Bar::at_most(format!("{of}: longest frame"), LONGEST_MS, longest_ms, "ms"),
    ]
}

fn sheet(walked: &[Shown], at_s: f64, truth: &Picture) -> anyhow::Result<Picture> {
    let pictures: Vec<&Picture> =
        walked.iter().filter_map(|shown| shown.on_screen(at_s)).map(|shown| &shown.picture).collect();
    let difference = |shown: &&Picture| -> anyhow::Result<Picture> {
        Ok(flip::error_picture(&flip::flip_map(shown, truth)?, truth.width_px, truth.height_px))
    };
    let differences: Vec<Picture> = pictures.iter().map(difference).collect::<anyhow::Result<_>>()?;
    let above: Vec<&Picture> = pictures.iter().copied().chain([truth]).collect();
    let empty = Picture::filled(truth.width_px, truth.height_px, [255; 3]);
    let below: Vec<&Picture> = differences.iter().chain([&empty]).collect();
    Ok(Picture::below(&[&Picture::beside(&above, 4), &Picture::beside(&below, 4)], 4))
}

/// Error against frames a second.
fn plot(run: &Run, report: &mut Report) -> anyhow::Result<()> {
    let series = WAYS.iter().map(|(way, _)| {
        let rows = report.rows.iter().filter(|row| row.method.starts_with(way));
        let point = |row: &Row| row.figure("time_ms.interval.median").zip(row.figure("error.flip_covered.mean"));
        Series { name: (*way).to_owned(), points: rows.filter_map(point).collect() }
    });
    let series: Vec<Series> = series.collect();
    if series.iter().all(|series| series.points.is_empty()) {
        return Ok(());
    }
    let scatter = Scatter {
        title: "What is on the screen while somebody walks".to_owned(),
        x_label: "ms between two pictures, median".to_owned(),
        y_label: "FLIP over covered pixels".to_owned(),
        series,
    };
    draw_scatter(&scatter, &run.figure(report, "frame-rate.svg", "Error against the time between two pictures."))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::scratch_folder;

    #[test]
    fn what_is_on_the_screen_is_compared_whole_and_held() {
        let out = scratch_folder("frame-rate");
        let mut run = Run::new(vec!["pillars".to_owned()], out.clone());
        run.quick = true;
        let mut report = Report::new("frame-rate", "");
        FrameRateTopic.run(&run, &mut report).expect("a GPU adapter, software or not");
        assert!(!report.has_failures(), "{:?}", report.rows);
        let error = |row: usize, name: &str| report.rows[row].figure(&format!("error.{name}.mean")).expect("compared");
        // Where the eye was, whole frames show what they would at once; they are late.
        assert!((error(0, "flip_covered") - error(1, "as_drawn")).abs() < 0.02, "{:?}", report.rows);
        assert!(error(0, "flip_covered") < 0.5 * error(1, "flip_covered"), "{:?}", report.rows);
        assert!(report.rows[2].figure("counts.frames_per_s").is_some_and(|rate| rate > 1.0));
        std::fs::remove_dir_all(out).expect("was written");
    }
}
