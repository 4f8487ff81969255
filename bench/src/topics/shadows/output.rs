//! Settings and notes of the topic, and everything that is made of its rows.

use super::bench::Bench;
use super::settings::Settings;
use super::{bars, growth, plots, tables};
use crate::report::Report;

/// Settings and notes.
pub(super) fn describe(report: &mut Report, settings: &Settings) {
    let Settings { size_px, points, runs, .. } = settings;
    report.settings.set("output", format!("{}x{} at 60 degrees", size_px.0, size_px.1));
    report.settings.set("points of the lamp", format!("{points}x{points}"));
    report.settings.set("runs", *runs);
    report.notes = [
        "A square lamp hangs over the middle of the scene, half a diagonal of the scene's box above its top; its own diagonal is given in \
         those of the box. The paper prints neither its lamps' places nor its views; its scenes are not ours.",
        "Errors are the paper's, over the pixels that show a surface, 0 to 255: visibility counts every point that is resolved wrongly, \
         intensity what is left where wrong ones of both kinds make good for each other; greatest: of a pixel. Where fewer points were drawn, intensity \
         is of what a picture shows then, evened out along surfaces; for visibility each of the others is taken to be as most of those nearest to it.",
        "Truths: shadow maps of the full geometry from the same points, with the texels of those that are drawn from the images, a triangle never hiding \
         itself: what the paper approximates, and what its errors are of; and rays, of which what texels cost is in the errors too.",
        "Times are wall times of this machine: images with their readback, surfaces with their upload, shadows of all points; a still frame's, cold: nothing \
         but pipelines is kept from before. Medians of several, of fewer where one takes seconds. The paper's are of a GeForce GTX 570.",
        "Full geometry: maps of all points drawn from the scene's triangles by the pipelines that draw rebuilt surfaces, with the same lookups; the triangles \
         are on the adapter already.",
        "The paper's greatest errors are in the order in which its tables have the scenes; it names none.",
        "Rows are kept as they are measured. A later run into the same folder takes those of its own program, adapter and settings; --fresh measures all anew.",
    ]
    .map(str::to_owned)
    .to_vec();
}

/// Tables, bars and plots.
pub(super) fn add(report: &mut Report, bench: &Bench<'_>) -> anyhow::Result<()> {
    let is_resumed = |row: &&crate::report::Row| row.parameters.get("resumed").is_some_and(|value| value == true);
    let resumed = report.rows.iter().filter(is_resumed).count();
    report.settings.set("rows of earlier runs", format!("{resumed} of {}", report.rows.len()));
    tables::add(report, bench);
    bars::add(report, &bench.settings);
    plots::add(report, bench)?;
    growth::plot(bench, report)
}
