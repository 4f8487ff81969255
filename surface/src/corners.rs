//! Where the corners of a sample's quad lie: the inverse depth `w` that each sample gives each of its four pixel corners.
//!
//! Alg. 4 of Xie, Wang, Popescu 2016 (§4) reads a corner from a second image `H`, offset by half a pixel, and where `H` has
//! none cuts the corner's ray with the plane through the sample `s` with its normal `n`: in eye space, with the corner's ray
//! `r` and the sample's ray `r_s`, `w_corner = w_s (n.r)/(n.r_s)`, linear in the image. [`Corners::Averaged`] needs no `H`:
//! the up to four samples around a corner predict it by their own planes, predictions of one surface are averaged, and all
//! of its samples take the very same value, which makes the surface watertight. Depth steps and the errors of coded normals
//! average out with it.
//!
//! All of it works in the image: a [`Plane`] is `w` at the pixel's centre with its slopes in 1/m a pixel.

use camera::Pinhole;
use glam::{DVec2, Vec3};
use protocol::ends::{self, Ends};
use protocol::{DepthImage, Purpose};

/// Where corners come from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Corners {
    /// The mean of what the samples of one surface around the corner predict.
    #[default]
    Averaged,
    /// The offset image of the paper where it agrees, else the sample's own plane.
    OffsetImage,
    /// The sample's own plane.
    OwnPlane,
}

/// What counts as one surface around a corner.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CornerRules {
    /// Predictions further apart than this many pixel footprints (`w/f` in w) belong to two surfaces.
    pub gap_footprints: f32,
    /// Error of a coded normal in radians: a grazing surface's predictions err by `0.7 w/f sec^2(theta)` times it, half a
    /// pixel's diagonal from the sample.
    pub normal_error_rad: f32,
    /// Depth steps that two predictions may be apart by coding alone.
    pub depth_steps: f32,
    /// Least cosine between the normals of two samples of one surface.
    pub normal_cos: f32,
    /// A corner's `w` stays within this factor of its sample's, both ways: the plane of a sample seen edge-on has any slope.
    pub max_ratio: f32,
    /// A slope of more than this many footprints a pixel is believed only where a neighbour of the same object shows it. At a
    /// silhouette a shading normal is as good as edge-on, and its plane would stick out of the surface as a spike.
    pub free_slope_footprints: f32,
    /// Where a surface ends and does not say where: before a farther one, or where the image has no sample.
    pub rim: Rim,
    /// Where a surface ends, its corners rise towards the eye by no more than this many footprints over its samples. A surface seen edge-on that
    /// ends within a pixel would otherwise stand out of itself by all that its plane rises on the rest of it.
    pub end_rise_footprints: f32,
}

/// How far a surface's corners draw back where it ends and does not say where, in pixels along both axes, by how many of the four samples around the
/// corner are of it. Pixels are squares and outlines are not: drawing corners in at one and out at three cuts the steps of a
/// slanted outline, as the contour through the middles between samples does (marching squares). And where several images show an outline, the farthest one out is what is seen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rim {
    /// One sample: the surface's own corner juts out.
    pub convex_px: f32,
    /// Two: its side.
    pub straight_px: f32,
    /// Three: a notch; below zero it is filled.
    pub concave_px: f32,
}

impl Rim {
    /// Of what is looked at: what does not say that it ends goes on.
    const NONE: Rim = Rim { convex_px: 0.0, straight_px: 0.0, concave_px: 0.0 };

    /// Of what casts: where several images show an outline, the union of their pixels does, and a hole in a shadow is as wrong as a shadow beside it.
    /// So corners draw back until about as much is covered as in truth: see [`CornerRules::of`].
    const CASTING: Rim = Rim { convex_px: 0.26, straight_px: 0.16, concave_px: -0.1 };

    /// How far a corner of the sample `index` draws back, if its surface ends there before what is farther or before nothing.
    fn shift(&self, corner: &Corner, around: [Option<&Plane>; 4], index: usize) -> [f32; 2] {
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
            1 => self.convex_px,
            3 => self.concave_px,
            _ => self.straight_px,
        };
        // Two samples across from each other have no side to draw back to.
        towards.map(|sum| px * f32::from(sum.signum()))
    }
}

impl Default for CornerRules {
    fn default() -> CornerRules {
        CornerRules {
            gap_footprints: 1.5,
            // The largest error of 8 + 8 bits; the mean is 0.34 degrees.
            normal_error_rad: 0.0145,
            depth_steps: 1.5,
            normal_cos: 0.5,
            // A floor doubles its w within a pixel only at the very horizon.
            max_ratio: 2.0,
            free_slope_footprints: 2.0,
            rim: Rim::NONE,
            end_rise_footprints: f32::INFINITY,
        }
    }
}

impl CornerRules {
    /// What surfaces for a purpose are rebuilt by. Those of a light's images cover no more than there is: their rims draw back further, none
    /// ends above itself by more than a footprint, and what is one surface is decided more strictly, as the light's images show every outline, each with its own
    /// pixels. Errors of soft shadows of `grass` (0 to 255; 2016 paper, section 6.2; four images of 1024², 16 x 16 points): intensity 3.17
    /// and visibility 9.7; by rims of 0.28 and 0.18 intensity is 3.30, of 0.3 and 0.2 3.61; with gaps, normals and slopes as of what is looked at visibility is 10.0 by the latter, not 9.5.
    pub fn of(purpose: Purpose) -> CornerRules {
        let Purpose::Light(_) = purpose else { return CornerRules::default() };
        CornerRules {
            gap_footprints: 1.0,
            normal_cos: 0.8,
            free_slope_footprints: 0.75,
            rim: Rim::CASTING,
            end_rise_footprints: 1.0,
            ..CornerRules::default()
        }
    }
}

/// A sample as a plane in the image.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plane {
    /// Inverse depth at the pixel's centre, 1/m.
    pub w: f32,
    /// Change of `w` a pixel to the right and down, 1/m; zero where the normal gives none.
    pub slope: [f32; 2],
    /// What [`CornerRules::end_rise_footprints`] comes to, 1/m.
    pub end_rise: f32,
    /// Predictions of one surface may be this far apart, 1/m.
    pub tolerance: f32,
    /// Where the surface ends at the sample's sides.
    pub ends: Ends,
    /// Unit normal, in the axes of the world at capture.
    pub normal: Vec3,
    /// The sample's object.
    pub object: u16,
}

/// The image's samples as planes, in the order of its samples, and how many slopes had to be guarded. `exact_w`: inverse depths
/// as they were before they were quantized, in place of the image's codes.
pub fn planes(
    image: &DepthImage,
    camera: &Pinhole,
    rules: &CornerRules,
    exact_w: Option<&[f32]>,
) -> (Vec<Plane>, usize) {
    let eye_from_world = camera.world_from_eye.rotation.inverse().as_quat();
    let (focal, centre) = (camera.focal_px as f32, camera.centre_px);
    let mut guarded = 0;
    let coded_w: Vec<f32> = image.depth.iter().map(|&code| image.depth_scale.w(code)).collect();
    let (w_of, w_step) = exact_w.map_or((&*coded_w, image.depth_scale.w_step), |exact_w| (exact_w, 0.0));
    let neighbours = Neighbours::new(image, w_of);
    let planes = image.mask.occupied().enumerate().map(|(index, (x, y))| {
        let normal = image.normal_at(index);
        let n = eye_from_world * normal;
        let offset = (DVec2::new(f64::from(x), f64::from(y)) + 0.5 - centre).as_vec2() / focal;
        let ray = Vec3::new(offset.x, offset.y, 1.0);
        let w = w_of[index];
        let facing = n.dot(ray);
        let footprint = w / focal;
        let limit = rules.free_slope_footprints * footprint;
        let from_normal = [w * n.x / facing / focal, w * n.y / facing / focal];
        let gap = rules.gap_footprints * footprint;
        let believed = |slope: f32, step| {
            let shown = slope.abs() <= limit || neighbours.show(index, (x, y), step, slope, gap);
            // `max` and `min` rather than `clamp`, as the slope may be no number.
            if shown { slope } else { slope.max(-limit).min(limit) }
        };
        let slope = [believed(from_normal[0], (1, 0)), believed(from_normal[1], (0, 1))];
        let steepest = 0.5 * (slope[0].abs() + slope[1].abs());
        let usable = slope == from_normal && steepest <= w * (1.0 - 1.0 / rules.max_ratio);
        guarded += usize::from(!usable);
        let cos_squared = (facing * facing / ray.length_squared()).max(1e-4);
        // An error of more than half of the slope would tie a surface to whatever lies behind it.
        let slope_error = (footprint * 0.7 * rules.normal_error_rad / cos_squared).min(steepest);
        let tolerance = footprint * rules.gap_footprints + slope_error + rules.depth_steps * w_step;
        Plane {
            w,
            slope: if steepest.is_finite() { slope } else { [0.0; 2] },
            end_rise: rules.end_rise_footprints * footprint,
            tolerance: tolerance.min(0.5 * w),
            ends: image.ends.get(index).copied().unwrap_or(0),
            normal,
            object: image.object[index],
        }
    });
    (planes.collect(), guarded)
}

/// The samples by pixel.
struct Neighbours<'a> {
    width_px: u32,
    samples: Vec<u32>,
    object: &'a [u16],
    w: &'a [f32],
}

impl<'a> Neighbours<'a> {
    fn new(image: &'a DepthImage, w: &'a [f32]) -> Neighbours<'a> {
        let (width_px, height_px) = image.mask.size_px();
        let mut samples = vec![u32::MAX; width_px as usize * height_px as usize];
        for ((x, y), sample) in image.mask.occupied().zip(0..) {
            samples[(y * width_px + x) as usize] = sample;
        }
        Neighbours { width_px, samples, object: &image.object, w }
    }

    /// Whether the sample one `step` further or back lies on the slope, by half of it or `gap`.
    fn show(&self, index: usize, (x, y): (u32, u32), step: (u32, u32), slope: f32, gap: f32) -> bool {
        let on_slope = |x: Option<u32>, y: Option<u32>, expected: f32| {
            let (Some(x), Some(y)) = (x, y) else { return false };
            let at = (x < self.width_px).then(|| self.samples.get((y * self.width_px + x) as usize)).flatten();
            at.is_some_and(|&other| {
                let other = other as usize;
                self.object.get(other) == Some(&self.object[index])
                    && (self.w[other] - expected).abs() <= gap.max(0.5 * slope.abs())
            })
        };
        let w = self.w[index];
        on_slope(x.checked_add(step.0), y.checked_add(step.1), w + slope)
            || on_slope(x.checked_sub(step.0), y.checked_sub(step.1), w - slope)
    }
}

impl Plane {
    /// `w` half a pixel right (`right`, else left) and down (`below`, else up) of the centre, kept within the ratio.
    pub fn at_corner(&self, right: bool, below: bool, rules: &CornerRules) -> f32 {
        let half = |positive: bool| if positive { 0.5 } else { -0.5 };
        let w = self.w + half(right) * self.slope[0] + half(below) * self.slope[1];
        w.clamp(self.w / rules.max_ratio, self.w * rules.max_ratio)
    }

    fn is_one_surface_with(&self, other: &Plane, own_w: f32, other_w: f32, rules: &CornerRules) -> bool {
        self.object == other.object
            && (own_w - other_w).abs() <= self.tolerance.max(other.tolerance)
            && self.normal.dot(other.normal) >= rules.normal_cos
    }
}

/// What the samples around one corner make of it. Index 0 to 3: the pixel above left, above right, below left, below right.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Corner {
    /// `w` for each sample; samples with one `group` have one value.
    pub w: [f32; 4],
    /// The lowest index of the sample's group.
    pub group: [u8; 4],
    /// How far the corner lies beside the pixels' own, in pixels; the same within a group.
    pub shift_px: [[f32; 2]; 4],
    /// Whether the group says that its surface ends here.
    pub ends: [bool; 4],
}

/// Groups and averages the predictions of the samples around a corner. Samples are one surface when a chain of pairs links
/// them, so every member comes to the same group.
pub fn averaged(around: [Option<&Plane>; 4], rules: &CornerRules) -> Corner {
    let w = predictions(around, rules);
    let mut group = [0, 1, 2, 3];
    for (first, second) in [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)] {
        let (Some(a), Some(b)) = (around[first], around[second]) else { continue };
        if group[first] != group[second] && a.is_one_surface_with(b, w[first], w[second], rules) {
            let (low, high) = (group[first].min(group[second]), group[first].max(group[second]));
            group.iter_mut().filter(|member| **member == high).for_each(|member| *member = low);
        }
    }
    let mut corner = Corner { w, group, shift_px: [[0.0; 2]; 4], ends: [false; 4] };
    for (index, member) in group.iter().enumerate() {
        let members = || (0..4).filter(|&other| group[other] == *member && around[other].is_some());
        let count = members().count().max(1) as f32;
        corner.w[index] = members().map(|other| w[other]).sum::<f32>() / count;
    }
    place_ends(&mut corner, around, rules);
    corner
}

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
fn place_ends(corner: &mut Corner, around: [Option<&Plane>; 4], rules: &CornerRules) {
    if corner.group == [0; 4] && around[0].is_some() {
        return;
    }
    let whole = *corner;
    let endings: [Ending; 4] = std::array::from_fn(|group| Ending::of(group as u8, &whole, around));
    for index in 0..4 {
        let Some(own) = around[index] else { continue };
        let group = whole.group[index];
        let ending = &endings[usize::from(group)];
        let said = ending.place != [None; 2];
        let shift = if said || rules.rim == Rim::NONE {
            [0, 1].map(|axis| ending.place[axis].map_or_else(|| behind(axis, group, &whole, &endings), |at| at - 0.5))
        } else {
            rules.rim.shift(&whole, around, index)
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

/// Every sample by its own plane; nothing is shared.
pub fn own_plane(around: [Option<&Plane>; 4], rules: &CornerRules) -> Corner {
    Corner { w: predictions(around, rules), group: [0, 1, 2, 3], shift_px: [[0.0; 2]; 4], ends: [false; 4] }
}

/// The offset image's sample at the corner, `(object, w)`, for every sample that no discontinuity separates from it.
pub fn from_offset_image(around: [Option<&Plane>; 4], offset: Option<(u16, f32)>, rules: &CornerRules) -> Corner {
    let mut corner = own_plane(around, rules);
    let Some((object, offset_w)) = offset else { return corner };
    let mut first = None;
    for (index, plane) in around.iter().enumerate() {
        let Some(plane) = plane else { continue };
        if plane.object == object && (corner.w[index] - offset_w).abs() <= plane.tolerance {
            corner.w[index] = offset_w;
            corner.group[index] = *first.get_or_insert(index as u8);
        }
    }
    corner
}

fn predictions(around: [Option<&Plane>; 4], rules: &CornerRules) -> [f32; 4] {
    std::array::from_fn(|index| {
        let (sample_is_left, sample_is_above) = (index % 2 == 0, index < 2);
        around[index].map_or(0.0, |plane| plane.at_corner(sample_is_left, sample_is_above, rules))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plane(w: f32, slope: f32, object: u16) -> Plane {
        Plane { w, slope: [slope, 0.0], end_rise: f32::INFINITY, tolerance: 0.01, ends: 0, normal: Vec3::Z, object }
    }

    #[test]
    fn one_surface_shares_its_corner_and_another_does_not() {
        let (near, far) = (plane(1.0, 0.0, 1), plane(0.5, 0.0, 1));
        let corner = averaged([Some(&near), Some(&near), Some(&near), Some(&far)], &CornerRules::default());
        assert_eq!(corner.group, [0, 0, 0, 3]);
        assert_eq!(corner.w[..3], [1.0; 3]);
        assert_eq!(corner.w[3], 0.5);
    }

    #[test]
    fn objects_do_not_share_corners() {
        let (one, other) = (plane(1.0, 0.0, 1), plane(1.0, 0.0, 2));
        let corner = averaged([Some(&one), Some(&other), Some(&one), Some(&other)], &CornerRules::default());
        assert_eq!(corner.group, [0, 1, 0, 1]);
        assert_eq!(corner.shift_px, [[0.0; 2]; 4], "neither is behind the other");
    }

    /// The same plane, which ends at some sides: right 0, below 1, left 2, above 3.
    fn ending(plane: Plane, sides: &[(usize, u16)]) -> Plane {
        Plane { ends: sides.iter().fold(0, |all, &(side, level)| ends::with_level(all, side, level)), ..plane }
    }

    /// How far beside the middle a level puts an outline.
    fn beside(level: u16) -> f32 {
        (f32::from(level) + 0.5) / 9.0 - 0.5
    }

    #[test]
    fn a_side_lies_between_the_crossings_that_its_samples_say() {
        let rules = CornerRules::default();
        let (near, far) = (plane(1.0, 0.1, 1), plane(0.5, 0.0, 2));
        // The near surface is on the left, above and below.
        let (upper, lower) = (ending(near, &[(0, 1)]), ending(near, &[(0, 2)]));
        let corner = averaged([Some(&upper), Some(&far), Some(&lower), Some(&far)], &rules);
        let shift = 0.5 * (beside(1) + beside(2));
        let is_at = |found: [f32; 2], wanted: [f32; 2]| found.iter().zip(wanted).all(|(a, b)| (a - b).abs() < 1e-6);
        assert!(is_at(corner.shift_px[0], [shift, 0.0]) && corner.shift_px[2] == corner.shift_px[0]);
        // Half a pixel to the right of the centre, less what it drew back, along the slope.
        assert!((corner.w[0] - (1.0 + (0.5 + shift) * 0.1)).abs() < 1e-6 && corner.w[0] == corner.w[2]);
        // What is behind goes on as far as that; behind what reaches far it stays.
        assert_eq!(corner.shift_px[1], corner.shift_px[0]);
        let wide = ending(near, &[(0, 7)]);
        let corner = averaged([Some(&wide), None, Some(&wide), Some(&far)], &rules);
        assert!(is_at(corner.shift_px[0], [beside(7), 0.0]) && corner.shift_px[3] == [0.0; 2]);
        // Mirrored, before nothing.
        let left = ending(near, &[(2, 1)]);
        let corner = averaged([None, Some(&left), None, Some(&left)], &rules);
        assert!(is_at(corner.shift_px[1], [-beside(1), 0.0]));
    }

    #[test]
    fn what_says_nothing_goes_on_but_casts_no_farther_than_there_is() {
        let (near, far) = (plane(1.0, 0.0, 1), plane(0.5, 0.0, 2));
        let around = [Some(&near), Some(&far), Some(&near), None];
        assert_eq!(averaged(around, &CornerRules::default()).shift_px, [[0.0; 2]; 4]);
        let casting = averaged(around, &CornerRules::of(Purpose::Light(0)));
        assert_eq!(casting.shift_px, [[-0.16, 0.0], [0.26, -0.26], [-0.16, 0.0], [0.0; 2]]);
    }

    #[test]
    fn what_ends_does_not_stand_out_of_itself() {
        let rules = CornerRules::default();
        let steep = Plane { end_rise: 0.02, ..plane(1.0, 0.4, 1) };
        let next = Plane { w: 1.4, ..steep };
        // The surface rises to the right and ends there: its right corners stay, those that it shares rise, and nothing keeps them from sinking.
        let end = averaged([Some(&next), None, Some(&next), None], &rules);
        assert!((end.w[0] - 1.42).abs() < 1e-6 && end.w[2] == end.w[0]);
        let within = averaged([Some(&steep), Some(&next), Some(&steep), Some(&next)], &rules);
        assert!((within.w[0] - 1.2).abs() < 1e-6);
        let start = averaged([None, Some(&steep), None, Some(&steep)], &rules);
        assert!((start.w[1] - 0.8).abs() < 1e-6);
        // What is looked at rises as it will.
        let image = averaged([Some(&plane(1.4, 0.4, 1)), None, Some(&plane(1.4, 0.4, 1)), None], &rules);
        assert!((image.w[0] - 1.6).abs() < 1e-6);
    }

    #[test]
    fn only_surfaces_that_lights_see_are_rebuilt_for_casting() {
        assert_eq!(CornerRules::of(Purpose::Eye), CornerRules::default());
        let casting = CornerRules::of(Purpose::Light(3));
        assert!(
            casting.end_rise_footprints.is_finite() && casting.rim.convex_px > CornerRules::default().rim.convex_px
        );
    }

    #[test]
    fn a_quad_covers_as_much_as_the_triangle_that_an_outline_cuts_off() {
        let rules = CornerRules::default();
        let (near, far) = (plane(1.0, 0.0, 1), plane(0.5, 0.0, 2));
        // Its corner juts out to the right and down: with crossings at a and b the triangle has the area of a b / 2.
        let jutting = ending(near, &[(0, 3), (1, 5)]);
        let corner = averaged([Some(&jutting), Some(&far), Some(&far), Some(&far)], &rules);
        let covered = corner.shift_px[0].map(|shift| shift + 0.5);
        let crossings = [3, 5].map(|level| beside(level) + 0.5);
        assert!((covered[0] * covered[1] - 0.5 * crossings[0] * crossings[1]).abs() < 1e-6);
        assert!((covered[0] / covered[1] - crossings[0] / crossings[1]).abs() < 1e-6, "towards the crossings");
        assert_eq!(corner.shift_px[1..], [corner.shift_px[0]; 3], "what is behind meets it");
        // A notch below on the right, by what it leaves of the square.
        let (above, left) = (ending(near, &[(1, 3)]), ending(near, &[(0, 5)]));
        let notch = averaged([Some(&near), Some(&above), Some(&left), Some(&far)], &rules);
        let left_out = notch.shift_px[0].map(|shift| 0.5 - shift);
        assert!((left_out[0] * left_out[1] - 0.5 * (1.0 - crossings[0]) * (1.0 - crossings[1])).abs() < 1e-6);
        assert_eq!(notch.shift_px, [notch.shift_px[0], notch.shift_px[0], notch.shift_px[0], [0.0; 2]]);
    }

    #[test]
    fn the_offset_image_counts_where_no_discontinuity_lies_between() {
        let rules = CornerRules::default();
        let (near, far) = (plane(1.0, 0.0, 1), plane(0.5, 0.0, 1));
        let corner = from_offset_image([Some(&near), Some(&far), Some(&near), None], Some((1, 1.005)), &rules);
        assert_eq!((corner.w[0], corner.w[1], corner.w[2]), (1.005, 0.5, 1.005));
        assert_eq!((corner.group[0], corner.group[2]), (0, 0));
        assert_eq!(from_offset_image([Some(&near), None, None, None], None, &rules).w[0], 1.0);
    }
}
