//! Samples as planes in their image.

use camera::Pinhole;
use glam::{DVec2, Vec3};
use protocol::DepthImage;
use protocol::ends::Ends;

use super::rules::CornerRules;

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
        // No less than the square of 0.01: seen at a smaller angle than that, which is less than the normal's own error, a normal tells nothing of the slope.
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

    pub(super) fn is_one_surface_with(&self, other: &Plane, own_w: f32, other_w: f32, rules: &CornerRules) -> bool {
        self.object == other.object
            && (own_w - other_w).abs() <= self.tolerance.max(other.tolerance)
            && self.normal.dot(other.normal) >= rules.normal_cos
    }
}
