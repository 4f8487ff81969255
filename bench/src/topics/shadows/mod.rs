//! Topic `shadows`: soft shadows of an area light, drawn by a client from images of the light's own, against two truths.
//!
//! Xie, Wang, Popescu 2016, section 6.2: a square lamp over the scene is sampled from its corners (depth peeling: from its middle), a client
//! rebuilds surfaces, and tells for each pixel which of the lamp's points it sees. The truths are shadow maps of the full geometry from the
//! same points, which the paper's errors are against, and rays. Pixels are those of the full geometry, for a client that holds
//! an image of the very view: shadows alone differ.

mod bars;
mod bench;
mod cell;
mod full;
mod growth;
pub(super) mod hidden;
mod lamp;
mod methods;
mod output;
mod paper;
mod pictures;
mod plots;
mod sets;
mod settings;
mod subject;
mod tables;
mod truths;
mod undrawn;

use clap::Args;
use serde_json::json;

use crate::report::kept::Kept;
use crate::report::progress::Progress;
use crate::report::{Report, Row};
use crate::topic::{Run, Topic, scene_label};
use bench::Bench;
use cell::{Cell, source_of};
use settings::{Arguments, Settings};
use subject::Subject;

/// See the module.
pub struct Shadows;

impl Topic for Shadows {
    fn name(&self) -> &'static str {
        "shadows"
    }

    fn about(&self) -> &'static str {
        "Soft shadows of an area light, drawn by a client from images of the light's corners: errors against shadow maps of the full \
         geometry and against rays, time of each step, by set of images, their size and the light's, and by the scene's triangles, beside \
         the paper's figures."
    }

    fn arguments(&self, command: clap::Command) -> clap::Command {
        Arguments::augment_args(command)
    }

    fn default_scenes(&self, _quick: bool) -> Vec<String> {
        ["birdnest", "grass", "urban", "tree"].map(str::to_owned).to_vec()
    }

    fn run(&self, run: &Run, report: &mut Report) -> anyhow::Result<()> {
        let arguments: Arguments = run.arguments()?;
        let settings = Settings::of(run, &arguments)?;
        let gpu = run.gpu(report)?.clone();
        let kept = Kept::open(&run.out, self.name(), arguments.taken())?;
        output::describe(report, &settings);
        let machine = json!({"adapter": report.adapter, "cpu": report.cpu});
        let mut bench = Bench { gpu, settings, run, kept, machine };
        for name in &run.scenes {
            if let Err(error) = scene(&mut bench, name, report) {
                report.rows.push(Row::failed(&scene_label(name), "all", &error));
            }
        }
        growth::measure(&mut bench, report);
        output::add(report, &bench)
    }
}

/// The cells of a scene, each from an earlier run or measured now. The scene is loaded where one has to be measured.
fn scene(bench: &mut Bench<'_>, name: &str, report: &mut Report) -> anyhow::Result<()> {
    let label = scene_label(name);
    let cells = bench.settings.cells(&label);
    let progress = Progress::new(format!("{label}: shadows"), cells.len() as u64);
    let mut subject: Option<Subject> = None;
    for cell in cells {
        let key = cell.key("errors and times", &source_of(name), &bench.machine, &bench.settings);
        let row = match bench.resumed(&key) {
            Some(row) => Ok(row),
            None => {
                let subject = match &mut subject {
                    Some(subject) => subject,
                    None => subject.insert(bench.subject(name)?),
                };
                progress.say(format!(
                    "{label}: {}, images of {}, a lamp of {}",
                    cell.label(),
                    cell.image_px,
                    cell.lamp
                ));
                judge(bench, subject, &cell).and_then(|row| bench.keep(&key, row))
            }
        };
        report.rows.push(row.unwrap_or_else(|error| Row::failed(&label, &cell.label(), &error)));
        pictures::list(&cell, bench, report);
        progress.step();
    }
    Ok(())
}

/// Measures a cell and draws its pictures.
fn judge(bench: &Bench<'_>, subject: &mut Subject, cell: &Cell) -> anyhow::Result<Row> {
    let (row, hidden) = subject.judged(cell)?;
    pictures::write(cell, &hidden, &subject.truths(cell)?, bench)?;
    Ok(row)
}

#[cfg(test)]
mod tests;
