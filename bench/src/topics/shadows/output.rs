//! Settings, tables and pictures of the topic.

use super::Settings;
use super::hidden::Hidden;
use super::sets::SETS;
use crate::compare::Picture;
use crate::report::table::{Table, number};
use crate::report::{Report, Row};
use crate::topic::Run;

/// Settings and notes.
pub(super) fn describe(report: &mut Report, settings: &Settings) {
    let Settings { size_px, points, truth_px, .. } = settings;
    report.settings.set("output", format!("{}x{} at 60 degrees", size_px.0, size_px.1));
    report.settings.set("points of the lamp", format!("{points}x{points}"));
    report.settings.set("truth's shadow maps", format!("{truth_px}x{truth_px}"));
    report.notes = [
        "A square lamp hangs over the middle of the scene, half a diagonal of the scene's box above its top; its own diagonal is given in \
         those of the box. The paper prints neither its lamps' places nor its views; its scenes are not ours.",
        "Errors are the paper's, over the pixels that show a surface, 0 to 255: visibility counts every point that is resolved wrongly, \
         intensity what is left where wrong ones of both kinds make good for each other.",
        "Truths: shadow maps of the full geometry from the same points, a triangle never hiding itself; and rays.",
        "Times are wall times of this machine: images with their readback, surfaces with their upload, shadows of all points.",
    ]
    .map(str::to_owned)
    .to_vec();
}

/// All tables.
pub(super) fn add(report: &mut Report) {
    let mut table = Table::new([
        "scene",
        "set",
        "images",
        "lamp",
        "intensity",
        "visibility",
        "by rays: intensity",
        "visibility",
        "samples",
        "images, ms",
        "surfaces, ms",
        "shadows, ms",
    ]);
    for row in report.rows.iter().filter(|row| row.failed.is_none()) {
        let figure = |path: &str| row.figure(path).map_or("-".to_owned(), number);
        let parameter = |name: &str| row.parameters.get(name).map_or("-".to_owned(), |value| value.to_string());
        table.row([
            row.scene.clone(),
            row.method.clone(),
            parameter("image_px"),
            parameter("lamp"),
            figure("error.intensity.mean"),
            figure("error.visibility.mean"),
            figure("error.intensity_rays.mean"),
            figure("error.visibility_rays.mean"),
            figure("counts.samples"),
            figure("time_ms.images.median"),
            figure("time_ms.surfaces.median"),
            figure("time_ms.shadows.median"),
        ]);
    }
    report.tables.push((format!("Soft shadows, {}", SETS.join(", ")), table));
}

/// How much of the lamp each pixel sees.
pub(super) fn picture(
    row: &Row,
    hidden: &Hidden,
    (width_px, height_px): (u32, u32),
    run: &Run,
    report: &mut Report,
) -> anyhow::Result<()> {
    let rgb = hidden.shares().iter().flat_map(|&share| [share; 3]).collect();
    let picture = Picture { width_px, height_px, rgb, covered: None };
    let parameter = |name: &str| row.parameters.get(name).map_or(String::new(), |value| format!("-{value}"));
    let name =
        format!("{}-{}{}{}.png", row.scene, row.method, parameter("image_px"), parameter("lamp")).replace(' ', "-");
    let caption = format!("{}: what each pixel sees of the lamp, {}.", row.scene, row.method);
    let path = run.figure(report, name, caption);
    Ok(picture.write(&path)?)
}
