//! What a picture is wrong by.

use glam::DVec3;
use surface::corners::CornerRules;

use super::buffers::Unfit;
use super::way::Shown;

/// What depth inside of surfaces may shift a sample by for an eye at the region's rim.
pub const DEPTH_PX: f64 = 0.1;

/// The errors of some pictures.
#[derive(Debug, Clone, Default)]
pub struct Errors {
    /// How far a sample shifts for an eye at the region's rim by what its depth is wrong, in pixels; inside of surfaces.
    pub parallax_px: Vec<f64>,
    /// Those of what is not seen at a steep angle.
    gentle_px: Vec<f64>,
    /// The sum of the latter, each with its sign.
    shift_px: f64,
    /// Those of what is, over what each may be off ([`steep_px`]).
    steep: Vec<f64>,
    /// Pixels inside of surfaces without a surface in the picture.
    pub holes: usize,
    /// Pixels inside of surfaces.
    pub inside: usize,
    /// Values of the frames' buffers that are no numbers, infinite or out of their range.
    pub unfit: Unfit,
    /// The most that a step of 16 bits shifts a sample by.
    pub finest_px: f64,
    /// By how many of 255 a pixel inside of a surface differs from the truth in its worst channel.
    pub colours: Vec<f64>,
}

impl Errors {
    pub fn of(shown: &[Shown]) -> Errors {
        let mut errors = Errors::default();
        shown.iter().for_each(|shown| errors.add(shown));
        errors
    }

    fn add(&mut self, shown: &Shown) {
        let (width, height) = shown.truth.size_px;
        self.unfit.add(shown.unfit);
        let margin = shown.margin_px as u32;
        self.finest_px = self.finest_px.max(shown.finest_px());
        for y in margin..height - margin {
            for x in margin..width - margin {
                let pixel = (y * width + x) as usize;
                if !is_inside(shown, pixel) {
                    continue;
                }
                self.inside += 1;
                let w = f64::from(shown.drawn.w[pixel]);
                let Some(true_w) = shown.true_w(pixel).filter(|_| w > 0.0) else {
                    self.holes += 1;
                    continue;
                };
                let shift_px = shown.parallax_px(w - true_w);
                self.parallax_px.push(shift_px);
                match steep_px(shown, pixel) {
                    Some(bound_px) => self.steep.push(shift_px / bound_px),
                    None => {
                        self.gentle_px.push(shift_px);
                        self.shift_px += shift_px.copysign(w - true_w);
                    }
                }
                let colours = (&shown.drawn.picture.rgb[3 * pixel..][..3], &shown.truth.rgb[pixel]);
                let off = colours.0.iter().zip(colours.1).map(|(a, b)| a.abs_diff(*b)).max();
                self.colours.push(off.unwrap_or(0).into());
            }
        }
    }

    /// The greatest shift of what is not steep; `None` where all is.
    pub fn worst_px(&self) -> Option<f64> {
        (!self.gentle_px.is_empty()).then(|| worst(&self.gentle_px))
    }

    /// The mean shift of the same, in which what errs to both sides makes good for each other; without its sign.
    pub fn mean_px(&self) -> Option<f64> {
        (!self.gentle_px.is_empty()).then(|| (self.shift_px / self.gentle_px.len() as f64).abs())
    }

    /// The greatest share of what something steep may be off; `None` where nothing is steep.
    pub fn steep(&self) -> Option<f64> {
        (!self.steep.is_empty()).then(|| worst(&self.steep))
    }

    /// The colour that is furthest off.
    pub fn worst_colour(&self) -> f64 {
        worst(&self.colours)
    }

    /// Share of the pixels inside of surfaces that show nothing.
    pub fn holes_share(&self) -> f64 {
        self.holes as f64 / self.inside.max(1) as f64
    }
}

/// The greatest value, or one that is no number where there is any.
fn worst(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |worst: f64, &value| if value > worst || value.is_nan() { value } else { worst })
}

/// By how much what is seen at a steep angle may shift; `None` of what is not.
///
/// A plane whose normal has the angle `t` with the way to the eye rises by `tan t` footprints a pixel. Whoever rebuilds it believes no more than
/// [`CornerRules::free_slope_footprints`] where no neighbour shows it, and a corner is half a pixel away: it is off by half of the rest at most. And a normal that is off by an
/// angle, by its code and by how far the shading normal is from the triangle's, moves a corner half a diagonal away by that times `0.7 / cos^2 t`.
fn steep_px(shown: &Shown, pixel: usize) -> Option<f64> {
    let rules = CornerRules::default();
    let point = shown.truth.first[pixel]?;
    let to_eye = (shown.camera.world_from_eye.translation - point.p_world).normalize_or_zero();
    let cosine = to_eye.dot(point.facet_normal_world).abs();
    let slope = (1.0 - cosine * cosine).max(0.0).sqrt() / cosine;
    let unbelieved = slope - f64::from(rules.free_slope_footprints);
    let bent_rad = point.facet_normal_world.dot(point.normal_world).abs().min(1.0).acos();
    let turned = 0.7 * (f64::from(rules.normal_error_rad) + bent_rad) / (cosine * cosine);
    let footprint_px = shown.parallax_px(shown.true_w(pixel)? / shown.camera.focal_px);
    (unbelieved > 0.0).then(|| DEPTH_PX.max(shown.finest_px()) + footprint_px * (0.5 * unbelieved + turned))
}

/// Samples whose normals turn by more are of two surfaces to who rebuilds them (`surface::CornerRules`).
const CREASE_COS: f64 = 0.5;

/// Whether a pixel and those around it show one surface of one object: at outlines and creases a picture of samples is wrong by up to a pixel whatever its
/// numbers are.
fn is_inside(shown: &Shown, pixel: usize) -> bool {
    let width = shown.truth.size_px.0 as usize;
    let object = shown.truth.first_object[pixel];
    let reach = -(shown.margin_px as isize)..=shown.margin_px as isize;
    let offsets = reach.clone().flat_map(|y| reach.clone().map(move |x| y * width as isize + x));
    let mut around = offsets.map(|offset| pixel.wrapping_add_signed(offset));
    let normal = |pixel: usize| shown.truth.first[pixel].map_or(DVec3::ZERO, |point| point.normal_world);
    let turns = |beside: usize| normal(beside).dot(normal(pixel)) < CREASE_COS;
    object.is_some() && around.all(|beside| shown.truth.first_object[beside] == object && !turns(beside))
}

/// The share of pixels in which two pictures of the same differ by more than one step of 255 in any channel.
pub fn differing_share(a: &[Shown], b: &[Shown]) -> f64 {
    let pixels = |shown: &[Shown]| {
        shown.iter().flat_map(|shown| shown.drawn.picture.rgb.as_chunks::<3>().0.to_vec()).collect::<Vec<_>>()
    };
    let (a, b) = (pixels(a), pixels(b));
    let differs = |(a, b): &(&[u8; 3], &[u8; 3])| a.iter().zip(*b).any(|(a, b)| a.abs_diff(*b) > 1);
    a.iter().zip(&b).filter(differs).count() as f64 / a.len().max(1) as f64
}

#[cfg(test)]
mod tests {
    use camera::{Pinhole, Rigid};
    use glam::DVec3;

    use super::*;
    use crate::client_view::Drawn;
    use crate::compare::Picture;
    use crate::raytrace::{SurfacePoint, TracedPicture};

    const SIDE_PX: u32 = 8;

    /// A wall two metres before the eye, drawn as far away as `w` says of each pixel.
    fn wall(w: impl Fn(usize) -> f32) -> Shown {
        let camera = Pinhole::symmetric(Rigid::IDENTITY, (SIDE_PX, SIDE_PX), 1.0, 0.1);
        let pixels = (SIDE_PX * SIDE_PX) as usize;
        let point =
            SurfacePoint { p_world: DVec3::Z * 2.0, normal_world: DVec3::NEG_Z, facet_normal_world: DVec3::NEG_Z };
        let truth = TracedPicture {
            size_px: (SIDE_PX, SIDE_PX),
            rgb: vec![[0; 3]; pixels],
            first_object: vec![Some(0); pixels],
            reflected_object: vec![None; pixels],
            bounces: vec![0; pixels],
            seen_through: vec![0; pixels],
            first: vec![Some(point); pixels],
        };
        let picture = Picture { width_px: SIDE_PX, height_px: SIDE_PX, rgb: vec![9; 3 * pixels], covered: None };
        let drawn = Drawn { picture, w: (0..pixels).map(w).collect(), frame_ms: 0.0 };
        Shown { camera, drawn, truth, region_m: 0.5, unfit: Unfit::default(), margin_px: 1 }
    }

    #[test]
    fn what_depth_is_wrong_by_is_a_shift_and_nothing_is_a_hole() {
        let right = Errors::of(&[wall(|_| 0.5)]);
        assert_eq!((right.inside, right.holes), (36, 0), "all but the rim");
        assert!(right.parallax_px.iter().all(|&shift| shift == 0.0));
        let wrong = Errors::of(&[wall(|pixel| [0.5, 0.6, 0.0, f32::NAN][pixel % 4])]);
        assert_eq!(wrong.holes, 18);
        let focal_px = wall(|_| 0.5).camera.focal_px;
        let shifts = wrong.parallax_px.iter().filter(|shift| (**shift - focal_px * 0.5 * 0.1).abs() < 1e-5).count();
        assert_eq!((shifts, wrong.parallax_px.len()), (12, 18));
    }

    #[test]
    fn what_is_steep_has_a_bound_of_its_own() {
        let mut shown = wall(|_| 0.6);
        let steep = DVec3::new(0.0, 1.0, -0.1).normalize();
        for point in shown.truth.first.iter_mut().flatten() {
            (point.normal_world, point.facet_normal_world) = (steep, steep);
        }
        let errors = Errors::of(&[shown]);
        assert_eq!((errors.worst_px(), errors.mean_px(), errors.parallax_px.len()), (None, None, 36));
        // Ten footprints a pixel, on the middle's ray: eight of them need not be believed.
        let middle = wall(|_| 0.6).parallax_px(0.1)
            / (0.1 + wall(|_| 0.5).parallax_px(0.5) / wall(|_| 0.5).camera.focal_px * (4.0 + 0.7 * 0.0145 * 101.0));
        assert!(
            errors.steep().is_some_and(|steep| (steep / middle - 1.0).abs() < 0.5),
            "{:?} {middle}",
            errors.steep()
        );
        assert_eq!(Errors::of(&[wall(|_| 0.5)]).steep(), None);
    }

    #[test]
    fn pictures_differ_by_more_than_a_step() {
        let (grey, mut other) = (wall(|_| 0.5), wall(|_| 0.5));
        other.drawn.picture.rgb[0] += 1;
        other.drawn.picture.rgb[5] += 2;
        assert_eq!(differing_share(&[grey], &[other]), 1.0 / 64.0);
    }
}
