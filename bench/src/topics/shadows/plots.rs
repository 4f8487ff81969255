//! Error against run time of every set and method.

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
    Ok(())
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
