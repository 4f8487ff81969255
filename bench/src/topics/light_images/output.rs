//! Rows, bars and pictures of the topic.

use serde_json::json;

use super::settings::Settings;
use super::truth::Seen;
use super::way::{Found, WAYS, Walked, Way};
use crate::compare::Picture;
use crate::compare::flip::error_picture;
use crate::report::{Bar, Report, Row};
use crate::spread::{Better, Spread};
use crate::topic::{Run, scene_label};
use crate::topics::sent_once::walk::UPDATE_HZ;

/// The most error by lights' images, as a share of that by the eye's samples alone.
const OF_BEFORE: f64 = 0.5;
/// The most error of objects by reliefs, as a share of that of the same objects as samples.
const OF_SAMPLES: f64 = 1.1;

/// Settings and notes.
pub(super) fn describe(report: &mut Report, settings: &Settings) {
    let Settings { half_s, poses, image_px, output_px } = settings;
    report.settings.set("walk", format!("{half_s} s out and {half_s} s back, {UPDATE_HZ} updates a second"));
    report.settings.set("views compared", json!(poses));
    report.settings.set("server views", format!("{image_px}x{image_px}"));
    report.settings.set("output", format!("{output_px}x{output_px} at 69 degrees"));
    report.notes = [
        "Errors: mean absolute difference of the share of the strongest light that arrives, 0 to 255, over the pixels whose surface faces it; \"all\": of every light that casts; those behind which the client shows \
         nothing are left out. Maps of clients have 1024 texels a side.",
        "Truths: a ray to the light; a shadow map of the full geometry of 4096x4096, for a light from afar one of the whole scene.",
        "A map of the full geometry shows surfaces of one side from their front only, as lights' images do; rays are stopped from either side, so they differ where a light shines \
         through a ground from below.",
        "The eye's samples: what is held for the eye casts, as where a server sends nothing of lights.",
    ]
    .map(str::to_owned)
    .to_vec();
}

/// The figures of a way.
pub(super) fn row(label: &str, way: &Way, walked: &Walked) -> Row {
    let mut row = Row::new(label, way.name);
    let all = |value: fn(&Found) -> f64| walked.views.iter().map(value).collect::<Vec<_>>();
    let mut set = |name: &str, values: Vec<f64>| {
        if let Some(spread) = Spread::of(&values, Better::Lower) {
            row.error.set(name, spread);
        }
    };
    set("by_map", all(|view| view.strongest.by_map));
    set("by_rays", all(|view| view.strongest.by_rays));
    set("by_map_all", all(|view| view.all.by_map));
    set("by_rays_all", all(|view| view.all.by_rays));
    for (name, values) in [("frame", all(|view| view.frame_ms)), ("look", all(|view| view.look_ms))] {
        if let Some(spread) = Spread::of(&values, Better::Lower) {
            row.time_ms.set(name, spread);
        }
    }
    row.bytes.set("session", walked.bytes as f64);
    row.bytes.set("lights", walked.light_bytes as f64);
    row.counts.set("objects_by_reliefs", walked.objects as f64);
    row
}

/// The view with the greatest error, as the way draws it, in truth, and how wrong that is.
pub(super) fn pictures(
    name: &str,
    way: &Way,
    walked: &Walked,
    seen: &[(usize, Seen)],
    run: &Run,
    report: &mut Report,
) -> anyhow::Result<()> {
    let worst =
        walked.views.iter().zip(seen).max_by(|(a, _), (b, _)| a.strongest.by_rays.total_cmp(&b.strongest.by_rays));
    let Some((found, (_, seen))) = worst else { return Ok(()) };
    let Some(light) = seen.lights.first() else { return Ok(()) };
    let (width_px, height_px) = (seen.view.width_px, seen.view.height_px);
    let grey = |values: Vec<u8>| {
        let rgb = values.into_iter().flat_map(|value| [value; 3]).collect();
        Picture { width_px, height_px, rgb, covered: None }
    };
    let truth = |hidden: &[bool]| {
        let arrives = |(&faces, &hidden): (&bool, &bool)| if faces && hidden { 0 } else { 255 };
        grey(light.facing.iter().zip(hidden).map(arrives).collect())
    };
    let (by_rays, by_map) = (truth(&light.hidden_by_rays), truth(&light.hidden_by_map));
    let wrong = error_picture(&found.off, width_px, height_px);
    let sheet = [&grey(found.arriving.clone()), &by_rays, &by_map, &wrong];
    let file = format!("{}-{}.png", scene_label(name), way.name.replace(", ", "-").replace([' ', '\''], "-"));
    let caption = format!(
        "{}: what arrives of the strongest light by {}, by rays, by a map of the full geometry, and the difference from rays; the worst view.",
        scene_label(name),
        way.name
    );
    Picture::beside(&sheet, 4).write(&run.figure(report, file, caption))?;
    Ok(())
}

/// Bars of every scene.
pub(super) fn add(report: &mut Report) {
    let mut bars = Vec::new();
    for scene in report.scene.clone() {
        let error = |way: &Way, figure: &str| {
            let row = report.rows.iter().find(|row| row.scene == scene_label(&scene) && row.method == way.name);
            row.and_then(|row| row.figure(figure))
        };
        let [before, ours, _, reliefs] = &WAYS;
        for (figure, truth) in [("error.by_map.mean", "full-geometry maps"), ("error.by_rays.mean", "rays")] {
            if let Some(before) = error(before, figure) {
                let what = format!("{scene}: shadow error against {truth}, half of that by the eye's samples");
                bars.push(Bar::at_most(what, OF_BEFORE * before, error(ours, figure), ""));
            }
            if let (Some(samples), Some(reliefs)) = (error(ours, figure), error(reliefs, figure)) {
                let what = format!("{scene}: objects by reliefs against {truth}, {OF_SAMPLES} of the same as samples");
                bars.push(Bar::at_most(what, OF_SAMPLES * samples, Some(reliefs), ""));
            }
        }
    }
    report.bars.extend(bars);
}
