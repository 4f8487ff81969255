//! Pictures: how much of the lamp each pixel sees, and how wrong that is.

use super::bench::Bench;
use super::cell::Cell;
use super::hidden::Hidden;
use super::settings::USUAL_LAMP;
use super::truths::Truths;
use crate::compare::Picture;
use crate::compare::flip::error_picture;
use crate::report::Report;

/// A picture's file, and what it shows.
type Named = (String, String);

/// How much of the lamp a pixel sees.
fn shown(cell: &Cell, bench: &Bench<'_>) -> Named {
    let caption = format!("{}: what each pixel sees of the lamp, {}.", cell.scene, cell.label());
    (file(cell, &cell.label(), &format!("-{}", cell.image_px), bench), caption)
}

/// How wrong that is.
fn errors(cell: &Cell, bench: &Bench<'_>) -> Named {
    let caption = format!("{}: intensity error of {}, black 0 to pale yellow 255.", cell.scene, cell.label());
    (file(cell, &format!("{} error", cell.label()), &format!("-{}", cell.image_px), bench), caption)
}

/// How much of it a pixel sees in truth.
fn truths(cell: &Cell, bench: &Bench<'_>) -> [Named; 2] {
    ["truth by rays", "truth by maps"].map(|name| {
        let caption = format!("{}: what each pixel sees of the lamp, {name}.", cell.scene);
        (file(cell, name, &format!("-{}", cell.image_px), bench), caption)
    })
}

fn file(cell: &Cell, what: &str, image: &str, bench: &Bench<'_>) -> String {
    let (points, (width_px, height_px)) = (bench.settings.points, bench.settings.size_px);
    let name = format!("{}-{what}{image}-{}-{points}-{width_px}x{height_px}.png", cell.scene, cell.lamp);
    name.replace(", ", "-").replace([' ', '/'], "-")
}

/// Errors are shown where images and lamp have their usual size.
fn has_errors(cell: &Cell, bench: &Bench<'_>) -> bool {
    (cell.lamp, cell.image_px) == (USUAL_LAMP, bench.settings.usual_px)
}

/// Writes the pictures of a cell.
pub(super) fn write(cell: &Cell, hidden: &Hidden, truth: &Truths, bench: &Bench<'_>) -> anyhow::Result<()> {
    let (width_px, height_px) = bench.settings.size_px;
    let [by_rays, by_maps] = truths(cell, bench);
    for ((file, _), hidden) in [(shown(cell, bench), hidden), (by_rays, &truth.rays), (by_maps, &truth.maps)] {
        let rgb = hidden.seen().iter().flat_map(|&seen| [seen; 3]).collect();
        Picture { width_px, height_px, rgb, covered: None }.write(&bench.run.out.join(file))?;
    }
    if has_errors(cell, bench) {
        let off = error_picture(&hidden.intensity_errors(&truth.maps), width_px, height_px);
        off.write(&bench.run.out.join(errors(cell, bench).0))?;
    }
    Ok(())
}

/// Adds the pictures of a cell that are there to the report; an earlier run may have written them.
pub(super) fn list(cell: &Cell, bench: &Bench<'_>, report: &mut Report) {
    let wrong = has_errors(cell, bench).then(|| errors(cell, bench));
    for (file, caption) in truths(cell, bench).into_iter().chain([shown(cell, bench)]).chain(wrong) {
        let is_known = report.figures.iter().any(|figure| figure.file == file);
        if !is_known && bench.run.out.join(&file).exists() {
            bench.run.figure(report, file, caption);
        }
    }
}
