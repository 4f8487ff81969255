//! Rows and bars of the topic.

use client::draw::occlusion::Occlusion;
use serde_json::json;

use super::points::mean;
use super::settings::Settings;
use super::way::{SESSIONS, Session, Sessions, Way, figures};
use crate::report::{Bar, Report, Row};
use crate::spread::Spread;
use crate::topic::scene_label;
use crate::topics::sent_once::walk::UPDATE_HZ;

/// The most deviation with what is served, as a share of that by the view's own z-buffer.
const OF_DEVIATION: f64 = 0.5;
/// The most distance to rays, as a share of the same.
const OF_ERROR: f64 = 0.7;

/// Settings and notes.
pub(super) fn describe(report: &mut Report, settings: &Settings) {
    let Settings { half_s, poses, image_px, output_px, taps, .. } = settings;
    report.settings.set("walk", format!("{half_s} s out and {half_s} s back, {UPDATE_HZ} updates a second"));
    report.settings.set("frames", json!(poses));
    report.settings.set("server views", format!("{image_px}x{image_px}"));
    report.settings.set("output", format!("{output_px}x{output_px} at 69 degrees"));
    report.settings.set("taps", json!(taps));
    report.notes = [
        "Deviation: standard deviation of a point's share of ambient light (0 to 1) over the frames that show it, mean over the points. Distance: of a point's mean share from the \
         ray-traced one, mean of the absolutes; bias: the same with its sign, positive where it is too bright.",
        "Points: from what the walk sees, on smooth parts, such that a quarter of the frames show them in every session.",
        "By the view's own z-buffer; by graph cameras of what the eye saw; by the same with what a server sends of occluders.",
    ]
    .map(str::to_owned)
    .to_vec();
}

/// The figures of all ways.
pub(super) fn rows(
    label: &str,
    (walked, traced, followed): (&Sessions, &[f64], &[usize]),
    reach_m: f64,
    report: &mut Report,
) {
    let mut none = Row::new(label, "none");
    none.error.set("distance", Spread::single(mean(followed.iter().map(|&point| 1.0 - traced[point]))));
    none.counts.set("points", followed.len() as f64);
    none.counts.set("reach_mm", (1000.0 * reach_m).round());
    report.rows.push(none);
    for (ways, of) in walked {
        for ((way, of_points), frame_ms) in ways.iter().zip(&of.shares).zip(&of.frame_ms) {
            let found = figures(of_points, traced, followed);
            let mut row = Row::new(label, &way.name());
            row.error.set("deviation", Spread::single(found.deviation));
            row.error.set("distance", Spread::single(found.error));
            row.error.set("bias", Spread::single(found.bias));
            row.time_ms.set("frame", Spread::single(median(frame_ms)));
            row.time_ms.set("look", Spread::single(mean(of.look_ms.iter().copied())));
            row.bytes.set("session", of.bytes as f64);
            row.bytes.set("occluders", of.occluder_bytes as f64);
            row.counts.set("occluder_samples", of.occluder_samples as f64);
            report.rows.push(row);
        }
    }
}

fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted.get(sorted.len() / 2).copied().unwrap_or_default()
}

/// Bars of every scene.
pub(super) fn add(report: &mut Report, settings: &Settings) {
    let mut bars = Vec::new();
    for scene in report.scene.clone() {
        for &taps in &settings.taps {
            let figure = |session: Session, occlusion, name: &str| {
                let way = Way { session, occlusion, taps }.name();
                let row = report.rows.iter().find(|row| row.scene == scene_label(&scene) && row.method == way);
                row.and_then(|row| row.figure(name))
            };
            let [seen, served, reliefs] = SESSIONS;
            for session in [served, reliefs] {
                for (name, what, share) in
                    [("error.deviation", "deviation", OF_DEVIATION), ("error.distance", "distance to rays", OF_ERROR)]
                {
                    let ours = figure(session, Occlusion::Graph, name);
                    let (Some(plain), Some(ours)) = (figure(seen, Occlusion::Plain, name), ours) else { continue };
                    let what = format!("{scene}, {}, {taps} taps: {what}, {share} of the view's own", session.name);
                    bars.push(Bar::at_most(what, share * plain, Some(ours), ""));
                }
            }
        }
    }
    report.bars.extend(bars);
}
