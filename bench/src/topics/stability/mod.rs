//! Topic `stability`: stiff parameters swept over their decades, through the whole way from a scene to a client's picture, beside rays in f64.
//!
//! Each case is a small scene made by code. Its set of images is made as the server makes it, goes through the codec, is held, rebuilt and drawn by the
//! client's own library, from the middle of the region that it is made for and from its rim. The truth are rays through the scene's
//! triangles on the CPU ([`crate::raytrace`]). Judged is what numbers may do: depth inside of surfaces, as the shift that its error
//! makes for an eye at the rim, holes inside of surfaces, and values that are no numbers.

mod build;
mod judge;
mod moved;
mod sweeps;
mod way;

use gpu::Gpu;

use crate::client_view::ClientView;
use crate::report::plot::{Axes, Scatter, Series, draw_curves};
use crate::report::progress::Progress;
use crate::report::{Bar, Report, Row};
use crate::spread::{Better, Spread};
use crate::topic::{Run, Topic, scene_label};
use judge::{Errors, differing_share};
use sweeps::{BOUND_PX, BY_CODE, OF_SCENES, Sweep};
use way::{Case, PICTURE_PX, Shown, shown};

/// See the module.
pub struct Stability;

/// Pixels that may differ where two cases must look alike: an edge that runs through a pixel's middle falls to either side.
const ALIKE_SHARE: f64 = 0.001;
/// Of the pixels inside of surfaces.
const HOLES_SHARE: f64 = 0.001;

impl Topic for Stability {
    fn name(&self) -> &'static str {
        "stability"
    }

    fn about(&self) -> &'static str {
        "Stiff parameters swept over their decades, through the whole way from a scene to a client's picture: the error of depth and the holes inside of \
         surfaces, beside rays in double precision, and where each bound ends to hold."
    }

    fn default_scenes(&self, _: bool) -> Vec<String> {
        BY_CODE.iter().map(|(sweep, _)| sweep.name.to_owned()).collect()
    }

    fn run(&self, run: &Run, report: &mut Report) -> anyhow::Result<()> {
        let gpu = run.gpu(report)?.clone();
        let mut view = ClientView::new(&gpu, (PICTURE_PX, PICTURE_PX))?;
        describe(report);
        for name in &run.scenes {
            if let Some((sweep, case)) = BY_CODE.iter().find(|(sweep, _)| sweep.name == name) {
                swept(&gpu, (sweep.name, sweep), case, (run, &mut view), report)?;
                continue;
            }
            match run.load(name) {
                Ok(scene) => {
                    for (sweep, case) in OF_SCENES {
                        swept(&gpu, (&scene.name, sweep), &|value| case(&scene, value), (run, &mut view), report)?;
                    }
                }
                Err(error) => report.rows.push(Row::failed(&scene_label(name), "all sweeps", &error)),
            }
        }
        Ok(())
    }
}

fn describe(report: &mut Report) {
    report.settings.set("picture", format!("{PICTURE_PX}x{PICTURE_PX}"));
    report.notes = [
        "parallax_px: how far a sample moves in the picture of an eye at the rim of the region by what its depth is wrong; inside of surfaces, where the pixel and the eight around it show one object.",
        "holes_share: of the pixels inside of surfaces, those without a surface. not_finite: depths in pictures that are no numbers or infinite.",
        "differing_share: pixels that differ by more than 1 of 255 from the sweep's first case, which looks the same in exact arithmetic.",
    ]
    .map(str::to_owned)
    .to_vec();
    report.notes.extend(BY_CODE.iter().map(|(sweep, _)| format!("{}: {}.", sweep.name, sweep.why)));
}

/// The values of a sweep; quickly, its ends and where its bounds must hold.
fn values(sweep: &Sweep, quick: bool) -> Vec<i32> {
    let [first, last] = sweep.decades;
    let all = first..=last;
    all.filter(|decade| !quick || [first, last, sweep.holds_to].contains(decade)).collect()
}

/// What is bounded, by the greatest that was found where it must hold, and the first decade at which it did not.
struct Bound {
    what: &'static str,
    at_most: f64,
    unit: &'static str,
    found: Option<f64>,
    broken_at: Option<i32>,
}

impl Bound {
    fn new(what: &'static str, at_most: f64, unit: &'static str) -> Bound {
        Bound { what, at_most, unit, found: None, broken_at: None }
    }

    fn add(&mut self, sweep: &Sweep, decade: i32, found: Option<f64>) {
        let Some(found) = found else { return };
        if decade <= sweep.holds_to {
            // What is no number must not be lost.
            let worst = self.found.unwrap_or(found);
            self.found = Some(if found > worst || found.is_nan() { found } else { worst });
        }
        let holds = found <= self.at_most;
        if self.broken_at.is_none() && !holds {
            self.broken_at = Some(decade);
        }
    }

    fn tell(&self, (label, sweep): (&str, &Sweep), report: &mut Report) {
        let range = format!("{} from 1e{} to 1e{}", sweep.parameter, sweep.decades[0], sweep.holds_to);
        let what = format!("{label}, {range}: {}", self.what);
        report.bars.push(Bar::at_most(what, self.at_most, self.found, self.unit));
        if let Some(decade) = self.broken_at {
            report
                .notes
                .push(format!("{label}, {}: {} are out of bounds at 1e{decade} first.", sweep.parameter, self.what));
        }
    }
}

fn swept(
    gpu: &Gpu,
    (label, sweep): (&str, &Sweep),
    case: &dyn Fn(f64) -> Case,
    (run, view): (&Run, &mut ClientView),
    report: &mut Report,
) -> anyhow::Result<()> {
    let values = values(sweep, run.quick);
    let progress = Progress::new(format!("{label}: {}", sweep.name), values.len() as u64);
    let mut first: Option<Vec<Shown>> = None;
    let mut points: [Vec<(f64, f64)>; 3] = Default::default();
    let mut bounds = [
        Bound::new("depths that are no numbers", 0.0, ""),
        Bound::new("holes inside of surfaces", HOLES_SHARE, "share"),
        Bound::new("depths inside of surfaces", BOUND_PX, "px"),
        Bound::new("pixels that look otherwise", ALIKE_SHARE, "share"),
    ];
    for decade in values {
        let value = 10_f64.powi(decade);
        let method = format!("{} = 1e{decade}", sweep.parameter);
        progress.say(format!("{label}: {method}"));
        let found = shown(gpu, &case(value), view);
        progress.step();
        let shown = match found {
            Ok(shown) => shown,
            Err(error) => {
                report.rows.push(Row::failed(label, &method, &error));
                continue;
            }
        };
        let errors = Errors::of(&shown);
        let parallax = Spread::of(&errors.parallax_px, Better::Lower);
        let differing = first.as_ref().filter(|_| sweep.looks_alike).map(|first| differing_share(first, &shown));
        let mut row = Row::new(label, &method);
        if let Some(parallax) = parallax {
            row.error.set("parallax_px", parallax);
            points[0].push((value, parallax.worst));
            points[1].push((value, parallax.p95));
        }
        points[2].push((value, errors.holes_share()));
        row.counts.set("inside", errors.inside as f64);
        row.counts.set("holes_share", errors.holes_share());
        row.counts.set("not_finite", errors.not_finite as f64);
        differing.into_iter().for_each(|share| row.counts.set("differing_share", share));
        report.rows.push(row);
        let worst_px = parallax.map(|parallax| parallax.worst);
        let found = [Some(errors.not_finite as f64), Some(errors.holes_share()), worst_px, differing];
        bounds.iter_mut().zip(found).for_each(|(bound, found)| bound.add(sweep, decade, found));
        first.get_or_insert(shown);
    }
    let is_told = [true, sweep.bounds_depth, sweep.bounds_depth, sweep.looks_alike];
    bounds
        .iter()
        .zip(is_told)
        .filter(|(_, is_told)| *is_told)
        .for_each(|(bound, _)| bound.tell((label, sweep), report));
    let names = ["depth, worst pixel, in px", "depth, 95 of 100 pixels, in px", "share of holes"];
    let series = names.into_iter().zip(points).map(|(name, points)| Series { name: name.to_owned(), points }).collect();
    let file = format!("{label}-{}.svg", sweep.parameter).replace([' ', '/'], "-");
    let path = run.figure(report, file, format!("Errors against {}.", sweep.parameter));
    let plot =
        Scatter { title: label.to_owned(), x_label: sweep.parameter.to_owned(), y_label: "error".to_owned(), series };
    draw_curves(&plot, Axes { log_x: true, front: false }, &path)
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;

    #[test]
    fn a_still_life_far_away_is_drawn_as_at_the_origin_and_a_wrong_place_is_seen() {
        let gpu = pollster::block_on(Gpu::new_headless()).expect("a GPU adapter, software or not");
        let mut view = ClientView::new(&gpu, (PICTURE_PX, PICTURE_PX)).expect("pipelines");
        let [near, far] =
            [0, 7].map(|decade| shown(&gpu, &BY_CODE[0].1(10_f64.powi(decade)), &mut view).expect("drawn"));
        assert!(differing_share(&near, &far) <= ALIKE_SHARE);
        let worst = |shown: &[Shown]| Errors::of(shown).parallax_px.into_iter().fold(0.0, f64::max);
        let errors = Errors::of(&far);
        assert!(errors.inside > 1000 && errors.not_finite == 0 && errors.holes_share() <= HOLES_SHARE);
        assert!(worst(&far) <= BOUND_PX, "{}", worst(&far));
        // Two centimetres off the truth, as f32 would be there.
        let mut off = far;
        off.iter_mut().for_each(|shown| shown.camera.world_from_eye.translation += DVec3::new(0.0, 0.0, 0.02));
        assert!(worst(&off) > BOUND_PX, "{}", worst(&off));
    }

    #[test]
    fn a_bound_tells_its_worst_where_it_must_hold_and_where_it_breaks() {
        let sweep = &BY_CODE[0].0;
        let mut bound = Bound::new("errors", 1.0, "px");
        let found = [(0, Some(0.2)), (1, None), (6, Some(0.7)), (7, Some(0.4)), (8, Some(3.0)), (9, Some(f64::NAN))];
        found.into_iter().for_each(|(decade, found)| bound.add(sweep, decade, found));
        assert_eq!((bound.found, bound.broken_at), (Some(0.7), Some(8)));
        bound.add(sweep, 3, Some(f64::NAN));
        bound.add(sweep, 4, Some(0.1));
        let mut report = Report::new("stability", "");
        bound.tell(("far", sweep), &mut report);
        assert!(report.bars[0].is_missed() && report.notes[0].contains("1e8"), "{:?}", report.bars);
    }

    #[test]
    fn every_case_is_made_of_numbers() {
        for (sweep, case) in BY_CODE {
            assert!((sweep.decades[0]..=sweep.decades[1]).contains(&sweep.holds_to));
            for decade in values(sweep, false) {
                let case = case(10_f64.powi(decade));
                let snapshot = case.scene.at(0.0);
                assert!(snapshot.world_from_mesh.iter().all(|pose| pose.is_finite()), "{} {decade}", sweep.name);
                assert!(case.middle.translation.is_finite() && case.near_m > 0.0 && !case.scene.bounds.is_empty());
            }
        }
    }
}
