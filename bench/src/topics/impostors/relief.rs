//! Objects that many share the shape of, drawn by rays against one image: time by how many there are, and bytes, beside sampling each.

use std::sync::Arc;

use camera::Pinhole;
use client::draw::frame::Options;
use gpu::Gpu;
use protocol::codec::{Coding, encode_patch};
use protocol::{Held, Look, Purpose};

use super::settings::Settings;
use crate::client_view::ClientView;
use crate::compare::score;
use crate::report::{Report, Row};
use crate::spread::{Better, Spread};
use crate::stage::{Stage, load_scene, picture};
use crate::topics::sent_once::walk::{Setup, UPDATE_HZ, Walker};

/// What the papers draw: cars and barrels.
const SCENES: [&str; 2] = ["cars", "barrels"];
/// How many cars or barrels.
pub(super) const COUNTS: [usize; 4] = [usize::MAX, 20, 10, 1];
/// The papers' output, and a small one.
const OUTPUT_PX: [(u32, u32); 2] = [(640, 480), (160, 120)];
/// Frames that a time is the median of.
const REPEATS: usize = 5;
/// Looks of a viewer who stands still.
const LOOKS: usize = 6;

/// One viewer of each scene where it begins, with and without reliefs.
pub(super) fn measure(gpu: &Gpu, settings: &Settings, report: &mut Report) -> anyhow::Result<()> {
    let (width, height) = OUTPUT_PX[usize::from(settings.quick)];
    let image_px = if settings.quick { 160 } else { 512 };
    for name in SCENES {
        let scene = Arc::new(load_scene(name, 1.0)?);
        let start = server::start::start_pose(&scene);
        let view = Pinhole::symmetric(start, (width, height), 1.0, server::start::near_m(&scene));
        let mut truths = Stage::new(gpu, (*scene).clone(), Look::Plain)?;
        truths.show(0.0, start.translation)?;
        let truth = picture(&truths.truth(&view)?);
        let mut client = ClientView::new(gpu, (width, height))?;
        for relief in [true, false] {
            let setup = Setup { relief, output_px: height, ..Setup::usual(image_px) };
            let mut walker = Walker::new(gpu, scene.clone(), &setup)?;
            let mut bytes = 0;
            for look in 0..LOOKS {
                bytes += walker.tick(start, look as f64 / UPDATE_HZ)?.bytes;
            }
            let mut row = Row::new(&scene.name, if relief { "relief" } else { "relief, none" });
            row.bytes.set("session", bytes as f64);
            row.bytes.set("reliefs", relief_bytes(&walker.set.held) as f64);
            row.counts.set("objects", objects(&walker.set.held).len() as f64);
            let drawn = client.frame_reflecting(&walker.set, Some(&walker.impostors), &view, Options::default())?;
            if let Some(flip) = score(&drawn.picture, &truth, None)?.flip_covered {
                row.error.set("flip_covered", Spread::single(flip));
            }
            for count in COUNTS.into_iter().filter(|_| relief) {
                let ms = frame_ms(&mut client, &mut walker, count, &view)?;
                if let Some(spread) = Spread::of(&ms, Better::Lower) {
                    row.time_ms.set(column(count), spread);
                }
            }
            report.rows.push(row);
        }
    }
    Ok(())
}

/// The column of a time.
pub(super) fn column(count: usize) -> String {
    if count == usize::MAX { "frame_of_all".to_owned() } else { format!("frame_of_{count}") }
}

fn objects(held: &Held) -> Vec<u16> {
    let mut objects: Vec<u16> = held.instances.keys().map(|(object, _)| *object).collect();
    objects.dedup();
    objects
}

fn relief_bytes(held: &Held) -> usize {
    let reliefs = held.patches.values().filter(|held| matches!(held.patch.purpose, Purpose::Relief(_)));
    reliefs.map(|held| encode_patch(&held.patch, Coding::default()).len()).sum()
}

/// Frames of no more objects than `count`.
fn frame_ms(client: &mut ClientView, walker: &mut Walker, count: usize, view: &Pinhole) -> anyhow::Result<Vec<f64>> {
    let all = walker.set.held.instances.clone();
    if let Some(&last) = objects(&walker.set.held).get(count) {
        walker.set.held.instances.retain(|(object, _), _| *object < last);
    }
    let mut draw = || client.draw_reflecting(&walker.set, Some(&walker.impostors), view, Options::default());
    draw()?;
    let times = (0..REPEATS).map(|_| draw()).collect();
    walker.set.held.instances = all;
    times
}
