//! Topic `stability`: stiff parameters swept over their decades, and stiff cases, through the whole way from a scene to a client's picture, beside rays in f64.
//!
//! Each is a small scene made by code. Its set of images is made as the server makes it, goes through the codec, is held, rebuilt and drawn by the
//! client's own library, from the middle of the region that it is made for and from its rim. The truth are rays through the scene's
//! triangles on the CPU ([`crate::raytrace`]). Judged is what numbers may do: depth inside of surfaces, as the shift that its error
//! makes for an eye at the rim, holes inside of surfaces, colours of flat ones, and values of any buffer that are no numbers. What moves, and effects, go
//! through a server's own stage (`served.rs`).
//!
//! `--break NAME` breaks what goes from one stage to the next (`lab.rs`): then bounds must be missed.

mod buffers;
mod build;
mod case;
mod cases;
mod check;
mod judge;
mod lab;
mod moved;
mod offered;
mod served;
mod sweeps;
mod swept;
mod way;

use std::path::PathBuf;

use clap::{Args, Command};

use crate::report::progress::Progress;
use crate::report::{Report, Row};
use crate::topic::{Run, Topic, scene_label};
use case::PICTURE_PX;
use cases::{GROUPS, Group, effects};
use lab::{Break, Lab};
use offered::Offer;
use sweeps::{BY_CODE, OF_SCENES};
use swept::swept;

/// See the module.
pub struct Stability;

#[derive(Debug, Args)]
struct Arguments {
    /// Breaks what goes from one stage to the next on purpose, so that bounds are missed.
    #[arg(long = "break", value_name = "NAME", hide = true)]
    broken: Option<Break>,
    /// Judges nothing: serves each case that stands still on a port, for other clients (`cargo xtask stiff`).
    #[arg(long, value_name = "PORT", hide = true)]
    offer: Option<u16>,
    /// Folder of the built web client, for `--offer`.
    #[arg(long, value_name = "DIR", hide = true)]
    web: Option<PathBuf>,
    /// Offers only cases whose names hold this; may be given several times.
    #[arg(long, value_name = "WORDS", hide = true)]
    only: Vec<String>,
}

impl Topic for Stability {
    fn name(&self) -> &'static str {
        "stability"
    }

    fn about(&self) -> &'static str {
        "Stiff parameters swept over their decades, and stiff cases, through the whole way from a scene to a client's picture: the error of depth, the holes \
         inside of surfaces, and numbers that are none, beside rays in double precision; how much of each bound is used, and where it ends to hold."
    }

    fn default_scenes(&self, _: bool) -> Vec<String> {
        let sweeps = BY_CODE.iter().map(|(sweep, _)| sweep.name);
        let cases = GROUPS.iter().map(|group| group.name).chain(effects().map(|effect| effect.name));
        sweeps.chain(cases).map(str::to_owned).collect()
    }

    fn arguments(&self, command: Command) -> Command {
        Arguments::augment_args(command)
    }

    fn run(&self, run: &Run, report: &mut Report) -> anyhow::Result<()> {
        let Arguments { broken, offer, web, only } = run.arguments()?;
        let mut lab = Lab::new(run.gpu(report)?, broken)?;
        if let Some(port) = offer {
            return offered::offer(&mut lab, &Offer { port, web, out: run.out.clone() }, &only);
        }
        describe(report, broken);
        for name in &run.scenes {
            if let Some((sweep, case)) = BY_CODE.iter().find(|(sweep, _)| sweep.name == name) {
                swept(&mut lab, (sweep.name, sweep), case, run, report)?;
                continue;
            }
            if let Some(group) = GROUPS.iter().find(|group| group.name == name) {
                judge(&mut lab, group, report);
                continue;
            }
            if let Some(effect) = effects().find(|effect| effect.name == name) {
                effect.swept(&mut lab, run.quick, report);
                continue;
            }
            match run.load(name) {
                Ok(scene) => {
                    for (sweep, case) in OF_SCENES {
                        swept(&mut lab, (&scene.name, sweep), &|value| case(&scene, value), run, report)?;
                    }
                }
                Err(error) => report.rows.push(Row::failed(&scene_label(name), "all sweeps", &error)),
            }
        }
        Ok(())
    }
}

fn judge(lab: &mut Lab, group: &Group, report: &mut Report) {
    let progress = Progress::new(group.name, group.cases.len() as u64);
    for case in group.cases {
        progress.say(format!("{}: {}", group.name, case.name));
        match (case.judge)(lab) {
            Ok(checks) => checks.iter().for_each(|check| check.tell((group.name, case.name), report)),
            Err(error) => report.rows.push(Row::failed(group.name, case.name, &error)),
        }
        progress.step();
    }
}

fn describe(report: &mut Report, broken: Option<Break>) {
    report.settings.set("picture", format!("{PICTURE_PX}x{PICTURE_PX}"));
    if let Some(broken) = broken {
        report.settings.set("broken", format!("{broken:?}"));
        report.notes.push(format!("Broken on purpose: {broken:?}."));
    }
    let notes = [
        "parallax_px: how far a sample moves in the picture of an eye at the rim of the region by what its depth is wrong; inside of surfaces, where the pixel and the eight around it show one object.",
        "holes_share: of the pixels inside of surfaces, those without a surface. unfit: values of any buffer that a frame is drawn into that are no numbers, infinite, or depths below 0.",
        "differing_share: pixels that differ by more than 1 of 255 from the sweep's first case, which looks the same in exact arithmetic. used: found over at most.",
    ];
    report.notes.extend(notes.map(str::to_owned));
    report.notes.extend(BY_CODE.iter().map(|(sweep, _)| format!("{}: {}.", sweep.name, sweep.why)));
}

#[cfg(test)]
mod tests;
