//! What the bones of a rig do over a period, as numbers at moments.
//!
//! A client has the maps between two moments change evenly. Moments become denser until, halfway between them, no corner of the box of what a bone
//! moves is off by more than the tolerance; what a vertex is off by lies between what its bones' boxes are. Clips that jump never
//! come to that: they stop at the most moments a second, and their jumps take as long as a step.

use std::collections::BTreeMap;

use glam::{DAffine3, DVec3, Vec3};
use protocol::body::Clip;
use scene::{Rig, Scene};

use super::made::Unfit;

/// Moments a second at first.
const LEAST_HZ: f64 = 15.0;
/// Moments a second at most: as many as the fastest screens show pictures. What turns fast comes no nearer.
const MOST_HZ: f64 = 240.0;
/// Numbers of a clip at most: four minutes of fifty bones at the fewest moments.
const MOST_NUMBERS: usize = 1 << 21;
/// The tolerance, as a share of the figure's radius: a tenth of a pixel of one that is a thousand pixels high.
const TOLERANCE: f64 = 2e-4;
/// Numbers are rounded to an eighth of that.
const ROUNDING: f64 = 0.125;

/// The bones that move anything, ascending, each with the box of that: smallest and largest corner, before anything is bent.
pub(super) type Moved = BTreeMap<u32, [Vec3; 2]>;

pub(super) fn moved(rig: &Rig, positions: &[Vec3]) -> Moved {
    let mut moved = Moved::new();
    for (influences, &p) in rig.influences.iter().zip(positions) {
        for &(bone, share) in influences {
            if share > 0.0 {
                let [low, high] = *moved.entry(bone).or_insert([p, p]);
                moved.insert(bone, [low.min(p), high.max(p)]);
            }
        }
    }
    moved
}

/// A clip of the bones that move anything, and the box of all that it moves: smallest and largest corner.
pub(super) fn clip(
    scene: &Scene,
    rig: &Rig,
    (origin_world, radius_m): (DVec3, f64),
    moved: &Moved,
) -> Result<(Clip, [Vec3; 2]), Unfit> {
    if moved.len() > protocol::Body::MOST_BONES {
        return Err(Unfit::Bones);
    }
    let tolerance_m = TOLERANCE * radius_m;
    let body_from_world = DAffine3::from_translation(-origin_world);
    let at = |time_s: f64| -> Vec<DAffine3> {
        let bones = scene.animation.bones(rig, time_s);
        moved.keys().filter_map(|&bone| Some(body_from_world * *bones.get(bone as usize)?)).collect()
    };
    let mut moments = if rig.period_s > 0.0 {
        let steps = (rig.period_s * LEAST_HZ).ceil().max(1.0);
        sampled(rig.period_s, (steps as usize, moved.len()), &at)?
    } else {
        vec![at(0.0)]
    };
    while moments.len() > 1 && ((moments.len() - 1) as f64) < rig.period_s * MOST_HZ {
        let denser = sampled(rig.period_s, (2 * (moments.len() - 1), moved.len()), &at)?;
        let is_done = denser.windows(3).step_by(2).all(|three| off_m(three, moved) <= tolerance_m);
        if is_done {
            break;
        }
        moments = denser;
    }
    let reach_m = moved.values().flatten().map(|corner| f64::from(corner.length())).fold(radius_m, f64::max);
    let offset_step = (ROUNDING * tolerance_m) as f32;
    let linear_step = (ROUNDING * tolerance_m / reach_m) as f32;
    let mut codes = Vec::with_capacity(moments.len() * moved.len() * Clip::NUMBERS);
    for bone in moments.iter().flatten() {
        let rows = bone.matrix3.transpose();
        for (row, offset) in [rows.x_axis, rows.y_axis, rows.z_axis].into_iter().zip(bone.translation.to_array()) {
            let linear = row.to_array().map(|number| (number, linear_step));
            for (number, step) in linear.into_iter().chain([(offset, offset_step)]) {
                let code = (number / f64::from(step)).round();
                if code.is_nan() || code.abs() >= f64::from(i32::MAX) {
                    return Err(Unfit::NotFinite);
                }
                codes.push(code as i32);
            }
        }
    }
    let period_s = if rig.period_s > 0.0 { rig.period_s } else { 1.0 };
    let clip = Clip { period_s, bones: moved.len() as u16, linear_step, offset_step, codes };
    let corners = moments.iter().flat_map(|bones| bones.iter().zip(moved.values())).flat_map(|(bone, around)| {
        corners_of(around).map(|corner| bone.transform_point3(corner).as_vec3()).collect::<Vec<_>>()
    });
    let bounds = corners.fold([Vec3::INFINITY, Vec3::NEG_INFINITY], |[low, high], p| [low.min(p), high.max(p)]);
    if bounds.iter().all(|corner| corner.is_finite()) { Ok((clip, bounds)) } else { Err(Unfit::NotFinite) }
}

/// Maps of all bones at so many moments and one more, which is just before everything begins again.
fn sampled(
    period_s: f64,
    (steps, bones): (usize, usize),
    at: &dyn Fn(f64) -> Vec<DAffine3>,
) -> Result<Vec<Vec<DAffine3>>, Unfit> {
    // A file may name any time: a step count that is out of range is all that fits.
    if steps.saturating_add(1).saturating_mul(bones * Clip::NUMBERS) > MOST_NUMBERS {
        return Err(Unfit::Long);
    }
    let time_s = |moment: usize| (period_s * moment as f64 / steps as f64).min(period_s.next_down());
    Ok((0..=steps).map(|moment| at(time_s(moment))).collect())
}

/// By how much the mean of the first and the last of three moments is off the middle one, at the corners of what bones move.
fn off_m(three: &[Vec<DAffine3>], moved: &Moved) -> f64 {
    let [before, now, after] = three else { return 0.0 };
    let of_bone = |(bone, around): (usize, &[Vec3; 2])| {
        let off = |corner: DVec3| {
            let [before, now, after] = [before, now, after].map(|bones| bones[bone].transform_point3(corner));
            ((before + after) / 2.0).distance(now)
        };
        corners_of(around).map(off).fold(0.0, f64::max)
    };
    moved.values().enumerate().map(of_bone).fold(0.0, f64::max)
}

fn corners_of([low, high]: &[Vec3; 2]) -> impl Iterator<Item = DVec3> + use<> {
    let (low, high) = (low.as_dvec3(), high.as_dvec3());
    (0..8).map(move |corner| {
        let end = |axis: usize| if corner >> axis & 1 == 0 { low[axis] } else { high[axis] };
        DVec3::new(end(0), end(1), end(2))
    })
}
