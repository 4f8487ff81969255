//! Error against run time of every set and method, and against the number of images.

use super::bench::Bench;
use super::methods::method_of;
use super::settings::USUAL_LAMP;
use super::tables::{parameter, rows, text};
use crate::report::Report;
use crate::report::plot::{Axes, Scatter, Series, draw_curves};

/// A plot of each error for each scene. A series is a method with a set, its points are sizes of images and what else is set.
pub(super) fn add(report: &mut Report, bench: &Bench<'_>) -> anyhow::Result<()> {
    for scene in report.scene.clone() {
        for (name, label) in [("intensity", "intensity error, 0 to 255"), ("visibility", "visibility error, 0 to 255")]
        {
            let series = series(report, &scene, &format!("error.{name}.mean"));
            if series.is_empty() {
                continue;
            }
            let plot = Scatter {
                title: format!("{scene}: {name} error against run time"),
                x_label: "images, surfaces and shadows, ms".to_owned(),
                y_label: label.to_owned(),
                series,
            };
            let caption = format!("{scene}: {name} error against the time of all steps, with the Pareto front.");
            let path = bench.run.figure(report, format!("{scene}-{name}-time.svg"), caption);
            draw_curves(&plot, Axes { log_x: true, front: true }, &path)?;
        }
    }
    by_images(report, bench)
}

/// What one more image of a lamp is worth: a series is a lamp over a scene.
fn by_images(report: &mut Report, bench: &Bench<'_>) -> anyhow::Result<()> {
    let mut series: Vec<Series> = Vec::new();
    for row in rows(report).filter(|row| text(row, "set").starts_with("placed-")) {
        let (Some(images), Some(error)) = (row.figure("counts.images"), row.figure("error.intensity.mean")) else {
            continue;
        };
        let name = format!("{}, lamp of {}, {} px", row.scene, parameter(row, "lamp"), parameter(row, "image_px"));
        match series.iter_mut().find(|series| series.name == name) {
            Some(series) => series.points.push((images, error)),
            None => series.push(Series { name, points: vec![(images, error)] }),
        }
    }
    series.retain(|series| series.points.len() > 1);
    if series.is_empty() {
        return Ok(());
    }
    series.iter_mut().for_each(|series| series.points.sort_by(|a, b| a.0.total_cmp(&b.0)));
    let plot = Scatter {
        title: "intensity error against the number of images".to_owned(),
        x_label: "images, from the points that probes choose".to_owned(),
        y_label: "intensity error, 0 to 255".to_owned(),
        series,
    };
    let path = bench.run.figure(report, "images.svg".to_owned(), "What one more image of a lamp is worth.".to_owned());
    draw_curves(&plot, Axes { log_x: false, front: false }, &path)
}

fn series(report: &Report, scene: &str, error: &str) -> Vec<Series> {
    let mut series: Vec<Series> = Vec::new();
    for row in rows(report).filter(|row| row.scene == scene && parameter(row, "lamp") == USUAL_LAMP) {
        let (Some(ms), Some(error)) = (row.figure("time_ms.all.median"), row.figure(error)) else { continue };
        let name = format!("{}, {}", text(row, "set"), method_of(text(row, "method")));
        match series.iter_mut().find(|series| series.name == name) {
            Some(series) => series.points.push((ms, error)),
            None => series.push(Series { name, points: vec![(ms, error)] }),
        }
    }
    series.iter_mut().for_each(|series| series.points.sort_by(|a, b| a.0.total_cmp(&b.0)));
    series
}
