//! Holes, cracks, false cover and leaks: where a rebuilt surface and the truth disagree about what is there.
//!
//! At each pixel, with `z` the depth of the truth and `f` the focal length in pixels, two depths count as the same when they
//! differ by at most **two pixel footprints and a depth step**: `2 z/f + z^2 dw`, where `dw` is the step of the coarsest image.
//! The footprint is that of a surface that faces the eye; a grazing surface gets no more, so the measure is on the strict
//! side there.
//!
//! - **hole**: the truth has a surface, the client has none;
//! - **crack**: a hole whose surface point the client holds: in some image of the set, the pixel where the point lands has a
//!   sample of the same object whose plane the point lies on, within the same bound at that image;
//! - **false cover**: the client's surface lies in front of the truth, or where the truth is empty;
//! - **leak**: it lies behind.
//!
//! All are shares of the pixels where the truth has a surface.

use camera::{ImagePoint, Pinhole};
use glam::DVec3;
use protocol::DepthImage;
use protocol::image::octahedral_normal;
use server::truth::Truth;

/// What a pixel turned out to be.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// Both empty, or the same surface.
    Right,
    /// No surface where the truth has one.
    Hole,
    /// A hole whose point is held.
    Crack,
    /// In front of the truth, or where it is empty.
    FalseCover,
    /// Behind the truth.
    Leak,
}

/// Shares of the covered pixels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shares {
    /// Holes, cracks among them.
    pub holes: f64,
    /// Holes whose point is held.
    pub cracks: f64,
    /// Surfaces in front of the truth, or where it is empty.
    pub false_cover: f64,
    /// Surfaces behind the truth.
    pub leaks: f64,
}

/// The footprints of [`same_depth_m`].
const FOOTPRINTS: f64 = 2.0;

/// How far two depths at `z_m` may differ and be the same.
fn same_depth_m(z_m: f64, focal_px: f64, w_step: f64) -> f64 {
    FOOTPRINTS * z_m / focal_px + z_m * z_m * w_step
}

/// Judges a pixel by inverse depths, 0 where there is no surface; a hole is not yet told from a crack.
fn judge(truth_w: f32, drawn_w: f32, focal_px: f64, w_step: f64) -> Verdict {
    match (truth_w > 0.0, drawn_w > 0.0) {
        (false, false) => Verdict::Right,
        (false, true) => Verdict::FalseCover,
        (true, false) => Verdict::Hole,
        (true, true) => {
            let (truth_m, drawn_m) = (1.0 / f64::from(truth_w), 1.0 / f64::from(drawn_w));
            let bound_m = same_depth_m(truth_m, focal_px, w_step);
            if truth_m - drawn_m > bound_m {
                Verdict::FalseCover
            } else if drawn_m - truth_m > bound_m {
                Verdict::Leak
            } else {
                Verdict::Right
            }
        }
    }
}

/// Judges every pixel of a frame that shows `images` from `camera`.
pub fn verdicts(truth: &Truth, drawn_w: &[f32], camera: &Pinhole, images: &[HeldImage]) -> Vec<Verdict> {
    let w_step = images.iter().map(|image| image.w_step).fold(0.0, f64::max);
    let pixel = |index: usize| {
        let verdict = judge(truth.w[index], drawn_w[index], camera.focal_px, w_step);
        if verdict == Verdict::Hole {
            let (x, y) = (index as u32 % camera.width_px, index as u32 / camera.width_px);
            let point = ImagePoint { u: f64::from(x) + 0.5, v: f64::from(y) + 0.5, w: f64::from(truth.w[index]) };
            let p_world = camera.world_from_image(point);
            if images.iter().any(|image| image.holds(p_world, truth.object[index])) {
                return Verdict::Crack;
            }
        }
        verdict
    };
    (0..truth.w.len()).map(pixel).collect()
}

/// Counts verdicts; `None` where the truth is empty.
pub fn shares(verdicts: &[Verdict], truth: &Truth) -> Option<Shares> {
    let covered = truth.w.iter().filter(|&&w| w > 0.0).count();
    let share =
        |wanted: &[Verdict]| verdicts.iter().filter(|verdict| wanted.contains(verdict)).count() as f64 / covered as f64;
    (covered > 0).then(|| Shares {
        holes: share(&[Verdict::Hole, Verdict::Crack]),
        cracks: share(&[Verdict::Crack]),
        false_cover: share(&[Verdict::FalseCover]),
        leaks: share(&[Verdict::Leak]),
    })
}

/// An image of the set, laid out for questions about points.
pub struct HeldImage {
    camera: Pinhole,
    w_step: f64,
    /// Index into the planes a pixel, `u32::MAX` where there is no sample.
    index_at: Vec<u32>,
    w: Vec<f32>,
    object: Vec<u16>,
    normal: Vec<[u8; 2]>,
}

impl HeldImage {
    /// Takes the planes of an image.
    pub fn new(image: &DepthImage) -> HeldImage {
        let camera = *image.camera.root();
        let mut index_at = vec![u32::MAX; camera.width_px as usize * camera.height_px as usize];
        for ((x, y), index) in image.mask.occupied().zip(0..) {
            index_at[(y * camera.width_px + x) as usize] = index;
        }
        HeldImage {
            camera,
            w_step: f64::from(image.depth_scale.w_step),
            index_at,
            w: image.depth.iter().map(|&code| image.depth_scale.w(code)).collect(),
            object: image.object.clone(),
            normal: image.normal.clone(),
        }
    }

    /// Whether the pixel where a point lands has a sample of the same object whose plane the point lies on.
    fn holds(&self, p_world: DVec3, object: u16) -> bool {
        let Some(point) = self.camera.image_from_world(p_world).filter(|point| self.camera.contains(*point)) else {
            return false;
        };
        let (x, y) = (point.u as u32, point.v as u32);
        let index = self.index_at[(y * self.camera.width_px + x) as usize] as usize;
        if index >= self.w.len() || self.object[index] != object {
            return false;
        }
        let w = f64::from(self.w[index]);
        let sample = ImagePoint { u: f64::from(x) + 0.5, v: f64::from(y) + 0.5, w };
        let offset = p_world - self.camera.world_from_image(sample);
        let normal = octahedral_normal(self.normal[index]).as_dvec3();
        offset.dot(normal).abs() <= same_depth_m(1.0 / w, self.camera.focal_px, self.w_step)
    }
}

#[cfg(test)]
mod tests {
    use camera::Rigid;
    use protocol::{DepthScale, Mask};

    use super::*;

    #[test]
    fn two_footprints_and_a_depth_step_are_the_bound() {
        let (z, f, step): (f32, f64, f64) = (10.0, 500.0, 1e-4);
        let bound = 2.0 * 10.0 / 500.0 + 100.0 * 1e-4;
        let at = |offset_m: f64| judge(1.0 / z, (1.0 / (10.0 + offset_m)) as f32, f, step);
        assert_eq!(at(-bound * 0.98), Verdict::Right);
        assert_eq!(at(-bound * 1.02), Verdict::FalseCover);
        assert_eq!(at(bound * 0.98), Verdict::Right);
        assert_eq!(at(bound * 1.02), Verdict::Leak);
        assert_eq!(judge(0.0, 0.1, f, step), Verdict::FalseCover);
        assert_eq!(judge(0.1, 0.0, f, step), Verdict::Hole);
        assert_eq!(judge(0.0, 0.0, f, step), Verdict::Right);
    }

    #[test]
    fn a_hole_is_a_crack_where_the_point_is_held() {
        let camera = Pinhole::symmetric(Rigid::IDENTITY, (4, 4), 1.0, 0.1);
        let mut mask = Mask::empty(4, 4);
        (0..4).for_each(|x| mask.set(x, 0, true));
        let facing = protocol::image::octahedral_code(glam::Vec3::NEG_Z);
        let image = DepthImage {
            camera: camera::Camera::Pinhole(camera),
            depth_scale: DepthScale { w_min: 0.5, w_step: 0.0 },
            mask,
            depth: vec![0; 4],
            normal: vec![facing; 4],
            normal_rest: Vec::new(),
            colour_rest: Vec::new(),
            share: Vec::new(),
            ends: Vec::new(),
            colour: vec![[9; 3]; 4],
            object: vec![7, 7, 7, 8],
            material: vec![0; 4],
        };
        let truth = Truth {
            size_px: (4, 4),
            colour: vec![[0, 0, 0, 255]; 16],
            w: vec![0.5; 16],
            object: vec![7; 16],
            triangle: vec![1; 16],
        };
        let mut drawn = vec![0.5; 16];
        drawn[..8].fill(0.0);
        let found = verdicts(&truth, &drawn, &camera, &[HeldImage::new(&image)]);
        assert_eq!(found[..4], [Verdict::Crack, Verdict::Crack, Verdict::Crack, Verdict::Hole]);
        let shares = shares(&found, &truth).unwrap();
        assert_eq!((shares.holes, shares.cracks, shares.false_cover), (0.5, 3.0 / 16.0, 0.0));
    }
}
