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

mod corner;
mod ends;
mod planes;
mod rules;

pub use corner::{Corner, from_offset_image, own_plane};
pub use planes::{Plane, planes};
pub use rules::{CornerRules, Corners, Rim};

/// Groups and averages the predictions of the samples around a corner. Samples are one surface when a chain of pairs links
/// them, so every member comes to the same group.
pub fn averaged(around: [Option<&Plane>; 4], rules: &CornerRules) -> Corner {
    let w = corner::predictions(around, rules);
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
    ends::place_ends(&mut corner, around, rules);
    corner
}

#[cfg(test)]
mod tests {
    use glam::Vec3;
    use protocol::{Purpose, ends};

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
