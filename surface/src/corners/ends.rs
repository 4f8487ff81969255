//! Where the corners of surfaces lie that end there.

use protocol::ends;

use super::corner::Corner;
use super::planes::Plane;
use super::rules::{CornerRules, Rim};

/// The square between the centres of the four pixels around a corner has two edges along each axis: the samples at their ends.
const EDGES: [[[usize; 2]; 2]; 2] = [[[0, 1], [2, 3]], [[0, 2], [1, 3]]];

/// What a corner's surfaces, named by their groups, say of where they end: places in the square, from 0 at the left or upper pixels' centres to 1.
#[derive(Debug, Clone, Copy, Default)]
struct Ending {
    /// By axis; `None` where nothing is said.
    place: [Option<f32>; 2],
    members: usize,
}

impl Ending {
    /// The surface's outline crosses an edge of the square where the sample at the one end says it. On a straight side the corner lies in the middle of both
    /// crossings. Where a corner juts out, the outline cuts a triangle off the square with both crossings as its corners: a rectangle as large
    /// has sides shorter by the square root of two. A notch is the same of what is not of the surface.
    fn of(group: u8, corner: &Corner, around: [Option<&Plane>; 4]) -> Ending {
        let is_member = |index: usize| around[index].is_some() && corner.group[index] == group;
        let members = (0..4).filter(|&index| is_member(index)).count();
        let mut place = [0, 1].map(|axis| {
            let (mut sum, mut said, mut edges) = (0.0, false, 0.0);
            for [low, high] in EDGES[axis] {
                let (member, side) = match [low, high].map(is_member) {
                    [true, false] => (low, axis),
                    [false, true] => (high, axis + 2),
                    _ => continue,
                };
                let reach = around[member].and_then(|plane| ends::reach(plane.ends, side));
                let from_low = |reach: f32| if member == low { reach } else { 1.0 - reach };
                sum += reach.map_or(0.5, from_low);
                said |= reach.is_some();
                edges += 1.0;
            }
            said.then(|| sum / edges)
        });
        // The pixel that is the only one of the surface, or the only one that is not.
        let single = (0..4).find(|&index| is_member(index) == (members == 1)).filter(|_| members == 1 || members == 3);
        if let (Some(single), [Some(right), Some(down)]) = (single, place) {
            let centre = [(single % 2) as f32, (single / 2) as f32];
            let nearer = |place: f32, centre: f32| centre + (place - centre) * std::f32::consts::FRAC_1_SQRT_2;
            place = [Some(nearer(right, centre[0])), Some(nearer(down, centre[1]))];
        }
        Ending { place, members }
    }
}

/// Moves the corners of surfaces that end here to where they end, along their own mean planes.
pub(super) fn place_ends(corner: &mut Corner, around: [Option<&Plane>; 4], rules: &CornerRules) {
    if corner.group == [0; 4] && around[0].is_some() {
        return;
    }
    let whole = *corner;
    let endings: [Ending; 4] = std::array::from_fn(|group| Ending::of(group as u8, &whole, around));
    for index in 0..4 {
        let Some(own) = around[index] else { continue };
        let group = whole.group[index];
        let first = usize::from(group);
        if first < index {
            // One place for all of a surface, though each of its samples would have it kept near to itself.
            (corner.w[index], corner.shift_px[index], corner.ends[index]) =
                (corner.w[first], corner.shift_px[first], corner.ends[first]);
            continue;
        }
        let ending = &endings[first];
        let said = ending.place != [None; 2];
        let shift = if said || rules.rim == Rim::NONE {
            [0, 1].map(|axis| ending.place[axis].map_or_else(|| behind(axis, group, &whole, &endings), |at| at - 0.5))
        } else {
            drawn_back(&rules.rim, &whole, around, index)
        };
        let members = (0..4).filter(|&other| around[other].is_some() && whole.group[other] == group);
        let (mut slope, mut highest_w) = ([0.0; 2], f32::INFINITY);
        for plane in members.filter_map(|member| around[member]) {
            slope[0] += plane.slope[0];
            slope[1] += plane.slope[1];
            highest_w = highest_w.min(plane.w + plane.end_rise);
        }
        corner.shift_px[index] = shift;
        corner.ends[index] = said;
        let w = whole.w[index] + (shift[0] * slope[0] + shift[1] * slope[1]) / ending.members as f32;
        corner.w[index] = w.clamp(own.w / rules.max_ratio, own.w * rules.max_ratio).min(highest_w);
    }
}

/// How far a surface that does not say where it ends goes on behind others that do: as far as they draw back.
fn behind(axis: usize, group: u8, corner: &Corner, endings: &[Ending; 4]) -> f32 {
    let mut shift = 0.0_f32;
    for [low, high] in EDGES[axis] {
        let (other, outwards) = match [low, high].map(|index| corner.group[index] == group) {
            [true, false] => (high, 1.0),
            [false, true] => (low, -1.0),
            _ => continue,
        };
        let of_other = endings[usize::from(corner.group[other])].place[axis].map_or(0.0, |at| at - 0.5);
        if of_other * outwards > shift.abs() {
            shift = of_other;
        }
    }
    shift
}

/// How far a corner of the sample `index` draws back, if its surface ends there before what is farther or before nothing.
fn drawn_back(rim: &Rim, corner: &Corner, around: [Option<&Plane>; 4], index: usize) -> [f32; 2] {
    let is_member = |other: usize| around[other].is_some() && corner.group[other] == corner.group[index];
    let tolerance = around[index].map_or(0.0, |own| own.tolerance);
    let is_open = |other: usize| around[other].is_none() || corner.w[other] < corner.w[index] - tolerance;
    if !(0..4).any(|other| !is_member(other) && is_open(other)) {
        return [0.0; 2];
    }
    let (mut towards, mut samples) = ([0_i8; 2], 0);
    for member in (0..4).filter(|&other| is_member(other)) {
        towards[0] += if member % 2 == 0 { -1 } else { 1 };
        towards[1] += if member < 2 { -1 } else { 1 };
        samples += 1;
    }
    let px = match samples {
        1 => rim.convex_px,
        3 => rim.concave_px,
        _ => rim.straight_px,
    };
    // Two samples across from each other have no side to draw back to.
    towards.map(|sum| px * f32::from(sum.signum()))
}
