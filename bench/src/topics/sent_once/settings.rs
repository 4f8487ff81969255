//! The walk at one setting after another: what each number that trades bytes for error is worth.
//!
//! One knob is turned at a time and all others stay as a server has them, so each knob gives a curve through the same point; the
//! Pareto front is that of all of them together.

use std::sync::Arc;

use gpu::Gpu;
use protocol::Look;
use protocol::codec::ColourSteps;
use server::account::AccountRules;
use server::coding::CodingRule;

use super::walk::{Setup, UPDATE_HZ, Walk};
use super::walked::{STAND_S, Walked, walked};
use crate::report::plot::{Axes, Scatter, Series, draw_curves};
use crate::report::{Report, Row};
use crate::spread::{Better, Spread};
use crate::stage::Stage;
use crate::topic::{Run, scene_label};

/// See [`AccountRules::density_factor`].
const DENSITY_FACTORS: [f32; 4] = [1.5, 2.5, 4.0, 8.0];
/// Views of a look at most; of who walks at most three are taken.
const VIEWS: [usize; 3] = [1, 2, 4];
/// Sides of the views over that of the usual ones.
const SIDES: [f64; 3] = [0.5, 0.75, 1.5];
/// See [`server::plan::Rules::parallax_error_px`].
const PARALLAX_ERRORS_PX: [f64; 4] = [0.05, 0.1, 0.2, 0.4];

/// A knob, and its settings with names.
struct Knob {
    name: &'static str,
    settings: Vec<(String, Setup)>,
}

fn knobs(image_px: u32) -> Vec<Knob> {
    let usual = Setup::usual(image_px);
    let density = |factor: f32| {
        let rules = AccountRules { density_factor: factor, ..usual.rules };
        (format!("{factor} x as dense"), Setup { rules, ..usual })
    };
    let views = |images: usize| (format!("{images} views"), Setup { images, ..usual });
    let side = |share: f64| {
        let image_px = (f64::from(image_px) * share).round() as u32;
        (format!("{image_px} px"), Setup { image_px, ..usual })
    };
    let precision = |error: f64| (format!("{error} px of parallax"), Setup { parallax_error_px: error, ..usual });
    let colour = |colour: ColourSteps| {
        (format!("{colour:?} colours").to_lowercase(), Setup { coding: CodingRule { colour, ..usual.coding }, ..usual })
    };
    let knob = |name, settings: Vec<(String, Setup)>| Knob { name, settings };
    vec![
        knob("density factor", DENSITY_FACTORS.map(density).to_vec()),
        knob("views", VIEWS.map(views).to_vec()),
        knob("size", SIDES.map(side).to_vec()),
        knob("depth precision", PARALLAX_ERRORS_PX.map(precision).to_vec()),
        knob("colour steps", ColourSteps::ALL.map(colour).to_vec()),
    ]
}

/// Every setting of a scene: a row and a point each.
pub fn scene(gpu: &Gpu, name: &str, image_px: u32, half_s: f64, run: &Run, report: &mut Report) -> anyhow::Result<()> {
    let label = scene_label(name);
    let scene = Arc::new(run.load(name)?);
    let walk = Walk::new(&scene, run.read_trace()?, half_s);
    let mut truths = Stage::new(gpu, (*scene).clone(), Look::Plain)?;
    let usual = walked(gpu, &scene, &Setup::usual(image_px), &walk, &mut truths)?;
    let usual = Point::of(&usual, half_s);
    report.rows.push(usual.row(&label, &format!("{image_px} px, as a server does by itself")));
    let mut series = Vec::new();
    for knob in knobs(image_px) {
        let mut points = Vec::new();
        for (setting, setup) in knob.settings {
            let point = if setup == Setup::usual(image_px) {
                usual.clone()
            } else {
                let point = Point::of(&walked(gpu, &scene, &setup, &walk, &mut truths)?, half_s);
                report.rows.push(point.row(&label, &setting));
                point
            };
            points.extend(point.at());
        }
        // The size's own point is the usual one.
        if knob.name == "size" {
            points.extend(usual.at());
            points.sort_by(|a, b| a.0.total_cmp(&b.0));
        }
        series.push(Series { name: knob.name.to_owned(), points });
    }
    let path =
        run.figure(report, format!("{label}-{image_px}-settings.svg"), format!("{label}: FLIP over Mbit/s by setting"));
    let plot = Scatter {
        title: format!("{label}, views of {image_px}² and others: error against bytes"),
        x_label: "Mbit/s along the walk".to_owned(),
        y_label: "FLIP over covered pixels".to_owned(),
        series,
    };
    draw_curves(&plot, Axes { log_x: true, front: true }, &path)
}

/// What a setting came to.
#[derive(Clone)]
struct Point {
    mbit_s: f64,
    look_ms: Option<Spread>,
    flip: Option<Spread>,
    holes: Option<Spread>,
    false_cover: Option<Spread>,
}

impl Point {
    fn of(walked: &Walked, half_s: f64) -> Point {
        let standing = (STAND_S * UPDATE_HZ).round() as usize;
        let walking = walked.ticks.iter().skip(standing);
        let bytes = walking.map(|tick| tick.bytes).sum::<usize>() as f64;
        let looks: Vec<f64> = walked.ticks.iter().map(|tick| tick.look_ms).collect();
        let of = |values: &[f64]| Spread::of(values, Better::Lower);
        Point {
            mbit_s: bytes * 8.0 / 1e6 / (2.0 * half_s),
            look_ms: of(&looks),
            flip: of(&walked.flip),
            holes: of(&walked.holes),
            false_cover: of(&walked.false_cover),
        }
    }

    fn at(&self) -> Option<(f64, f64)> {
        self.flip.map(|flip| (self.mbit_s, flip.mean))
    }

    fn row(&self, label: &str, setting: &str) -> Row {
        let mut row = Row::new(label, setting);
        row.counts.set("mbit_s", self.mbit_s);
        for (name, spread) in
            [("flip_covered", self.flip), ("holes_share", self.holes), ("false_cover_share", self.false_cover)]
        {
            spread.into_iter().for_each(|spread| row.error.set(name, spread));
        }
        self.look_ms.into_iter().for_each(|spread| row.time_ms.set("look", spread));
        row
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_knob_turns_one_number() {
        let usual = Setup::usual(256);
        for knob in knobs(256) {
            let turned: Vec<_> = knob.settings.iter().filter(|(_, setup)| *setup != usual).collect();
            assert!(turned.len() >= 2, "{}", knob.name);
            for (index, (name, setup)) in turned.iter().enumerate() {
                assert!(turned[..index].iter().all(|(other, before)| other != name && before != setup), "{name}");
            }
        }
    }
}
