//! The redundancy tests: what the shader needs for them, and their twin on the CPU.

use bytemuck::{Pod, Zeroable};
use camera::Pinhole;
use glam::{DVec3, IVec2, Mat3, Vec2, Vec3, Vec4};
use protocol::image::octahedral_normal;
use rayon::prelude::*;

use super::method::Asked;
use super::{Capture, Redundancy, RedundancyTest};
use crate::render::RayScene;

/// How many earlier images one image is tested against at most.
pub const MAX_EARLIER: usize = 15;

/// Of one surface, normals differ by less than 45 degrees: `LEAST_COSINE` of `server/redundancy.wgsl`.
const LEAST_COSINE: f32 = 0.7;
/// Hits that are looked past along one sample's rays: `MOST_HITS` of `server/redundancy.wgsl`.
const MOST_HITS: usize = 256;

/// `EarlierImage` of `server/redundancy.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub(crate) struct EarlierImage {
    pub eye_from_this_x: [f32; 4],
    pub eye_from_this_y: [f32; 4],
    pub eye_from_this_z: [f32; 4],
    pub eye_anchor: [f32; 3],
    pub near_m: f32,
    pub centre_px: [f32; 2],
    pub size_px: [f32; 2],
    pub focal_px: f32,
    pub padding: [f32; 3],
}

/// `EarlierImages` of `server/redundancy.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub(crate) struct EarlierImages {
    pub count: u32,
    pub padding: [u32; 3],
    pub images: [EarlierImage; MAX_EARLIER],
}

impl EarlierImages {
    /// How to reproject from `this` into each of `earlier`, at most [`MAX_EARLIER`].
    pub(crate) fn new(this: &Pinhole, earlier: &[Pinhole], anchor_world: DVec3) -> EarlierImages {
        let mut images = [EarlierImage::zeroed(); MAX_EARLIER];
        for (image, camera) in images.iter_mut().zip(earlier) {
            *image = EarlierImage::new(this, camera, anchor_world);
        }
        EarlierImages { count: earlier.len().min(MAX_EARLIER) as u32, padding: [0; 3], images }
    }
}

impl EarlierImage {
    fn new(this: &Pinhole, earlier: &Pinhole, anchor_world: DVec3) -> EarlierImage {
        // In f64: the eyes may be far from the world's origin and close to each other.
        let earlier_from_this = earlier.world_from_eye.inverse() * this.world_from_eye;
        let affine = earlier_from_this.to_affine();
        let rows = affine.matrix3.transpose();
        let row = |row: DVec3, offset: f64| row.as_vec3().extend(offset as f32).to_array();
        EarlierImage {
            eye_from_this_x: row(rows.x_axis, affine.translation.x),
            eye_from_this_y: row(rows.y_axis, affine.translation.y),
            eye_from_this_z: row(rows.z_axis, affine.translation.z),
            eye_anchor: (earlier.world_from_eye.translation - anchor_world).as_vec3().to_array(),
            near_m: earlier.near_m as f32,
            centre_px: earlier.centre_px.as_vec2().to_array(),
            size_px: [earlier.width_px as f32, earlier.height_px as f32],
            focal_px: earlier.focal_px as f32,
            padding: [0.0; 3],
        }
    }

    fn eye_from_this(&self, p_eye: Vec3) -> Vec3 {
        let p = p_eye.extend(1.0);
        let rows = [self.eye_from_this_x, self.eye_from_this_y, self.eye_from_this_z];
        Vec3::from(rows.map(|row| Vec4::from(row).dot(p)))
    }

    /// The pixel of a point in this image's eye space.
    fn place(&self, q: Vec3) -> Option<Vec2> {
        if q.z < self.near_m {
            return None;
        }
        let place = Vec2::from(self.centre_px) + self.focal_px / q.z * q.truncate();
        let inside = place.cmpge(Vec2::ZERO).all() && place.cmplt(Vec2::from(self.size_px)).all();
        inside.then_some(place)
    }
}

/// A sample that is tested.
#[derive(Debug, Clone, Copy)]
struct Sample {
    /// In the eye space of its image.
    p_eye: Vec3,
    /// Unit length, world axes.
    normal_world: Vec3,
    triangle: u32,
    object: u16,
}

/// The images of a set before one image, ready to be asked by its samples: the twin of `is_redundant` in `server/redundancy.wgsl`,
/// in f32 like it.
pub struct Earlier<'a> {
    images: Vec<(EarlierImage, &'a Capture)>,
    redundancy: Redundancy,
    rays: Option<&'a RayScene>,
    /// Of the image whose samples ask.
    focal_px: f32,
    eye_anchor: Vec3,
    anchor_from_eye: Mat3,
}

impl<'a> Earlier<'a> {
    /// For samples of images of the camera `this`. `rays` where the test follows them; they are relative to `anchor_world`.
    pub fn new(
        this: &Pinhole,
        earlier: &'a [Capture],
        redundancy: Redundancy,
        anchor_world: DVec3,
        rays: Option<&'a RayScene>,
    ) -> Earlier<'a> {
        assert!(rays.is_some() || !redundancy.test.needs_rays(), "{:?} follows rays", redundancy.test);
        Earlier {
            images: earlier.iter().map(|image| (EarlierImage::new(this, &image.camera, anchor_world), image)).collect(),
            redundancy,
            rays,
            focal_px: this.focal_px as f32,
            eye_anchor: (this.world_from_eye.translation - anchor_world).as_vec3(),
            anchor_from_eye: Mat3::from_quat(this.world_from_eye.rotation.as_quat()),
        }
    }

    fn is_redundant(&self, sample: &Sample) -> bool {
        if self.redundancy.test.needs_rays() {
            let p_anchor = self.anchor_from_eye * sample.p_eye + self.eye_anchor;
            return self.holds_by_rays(p_anchor, sample.triangle, self.images.len(), &mut 0);
        }
        self.images.iter().any(|(image, capture)| self.holds_pixel(image, capture, sample))
    }

    fn is_dense_enough(&self, image: &EarlierImage, sample: &Sample, q: Vec3) -> bool {
        let factor = self.redundancy.density_factor;
        if factor <= 0.0 {
            return true;
        }
        let p_anchor = self.anchor_from_eye * sample.p_eye + self.eye_anchor;
        let facing = sample.normal_world.dot(p_anchor - self.eye_anchor).abs();
        let facing_earlier = sample.normal_world.dot(p_anchor - Vec3::from(image.eye_anchor)).abs();
        let (ratio, nearer) = (self.focal_px / image.focal_px, q.z / sample.p_eye.z);
        ratio * ratio * facing * nearer * nearer * nearer <= factor * facing_earlier
    }

    fn holds_pixel(&self, image: &EarlierImage, capture: &Capture, sample: &Sample) -> bool {
        let q = image.eye_from_this(sample.p_eye);
        let Some(place) = image.place(q) else { return false };
        if !self.is_dense_enough(image, sample, q) {
            return false;
        }
        let last = Vec2::from(image.size_px).as_ivec2() - 1;
        let holds = |texel: IVec2| self.holds_texel(image, capture, (texel.x, texel.y), sample, q);
        match self.redundancy.test.asked() {
            Asked::Own => holds(place.as_ivec2()),
            Asked::AnyOfNine => {
                let own = place.as_ivec2();
                let around = (-1..=1).flat_map(|down| (-1..=1).map(move |right| own + IVec2::new(right, down)));
                around.filter(|texel| texel.cmpge(IVec2::ZERO).all() && texel.cmple(last).all()).any(holds)
            }
            Asked::AllOfFour => {
                let first = (place - 0.5).floor().as_ivec2();
                let corners = [(0, 0), (1, 0), (0, 1), (1, 1)].map(|corner| first + IVec2::from(corner));
                corners.map(|corner| corner.clamp(IVec2::ZERO, last)).into_iter().all(holds)
            }
        }
    }

    fn holds_texel(
        &self,
        image: &EarlierImage,
        capture: &Capture,
        (x, y): (i32, i32),
        sample: &Sample,
        q: Vec3,
    ) -> bool {
        let triangle = capture.triangle_at(x, y);
        if triangle == sample.triangle {
            return true;
        }
        if !self.redundancy.test.needs_depth() || triangle == 0 {
            return false;
        }
        let index = y as usize * capture.camera.width_px as usize + x as usize;
        let normal = octahedral_normal(capture.normal_code(index));
        if capture.object(index) != sample.object || normal.dot(sample.normal_world) < LEAST_COSINE {
            return false;
        }
        let ray = (Vec2::new(x as f32, y as f32) + 0.5 - Vec2::from(image.centre_px)) / image.focal_px;
        let held = ray.extend(1.0) / capture.w(index);
        let earlier_from_world = Mat3::from_quat(capture.camera.world_from_eye.rotation.conjugate().as_quat());
        (earlier_from_world * normal).dot(q - held).abs() <= held.z / image.focal_px
    }

    /// Whether the first `limit` images hold a point of a triangle: each what its eye reaches, through what those before it hold.
    fn holds_by_rays(&self, p_anchor: Vec3, triangle: u32, limit: usize, hits: &mut usize) -> bool {
        (0..limit).any(|image| self.reaches(image, p_anchor, triangle, hits))
    }

    fn reaches(&self, index: usize, p_anchor: Vec3, triangle: u32, hits: &mut usize) -> bool {
        let (image, _) = &self.images[index];
        let rays = self.rays.expect("checked when it was made");
        let q = image.eye_from_this(self.anchor_from_eye.transpose() * (p_anchor - self.eye_anchor));
        if image.place(q).is_none() {
            return false;
        }
        let origin = Vec3::from(image.eye_anchor);
        let direction = p_anchor - origin;
        let unsure = unsure(origin, direction);
        let mut t = image.near_m / q.z;
        loop {
            *hits += 1;
            let Some(hit) = rays.first_hit(origin, direction, t, 1.0 + unsure) else { return false };
            if hit.triangle == triangle || hit.t >= 1.0 - unsure {
                return true;
            }
            let recursive = self.redundancy.test == RedundancyTest::Visibility && index > 0 && *hits < MOST_HITS;
            if !recursive || !self.holds_by_rays(origin + hit.t * direction, hit.triangle, index, hits) {
                return false;
            }
            t = hit.t;
        }
    }
}

/// How much of a ray's length positions are unsure by: eight roundings of the coordinates at its ends. Each is 2^-23 of them at most, what one f32 is from
/// the next; 2^-20 is eight times that. 1e-30 keeps a ray without length from dividing by 0, and any number does that is shorter than every ray.
fn unsure(origin: Vec3, direction: Vec3) -> f32 {
    let sizes = origin.abs() + (origin + direction).abs();
    (-20.0_f32).exp2() * sizes.max_element() / direction.length().max(1e-30)
}

/// Whether each occupied pixel of `capture` (row-major) is redundant with one of `earlier`. `rays`, relative to `anchor_world`, where
/// the test follows them.
pub fn redundant_samples(
    capture: &Capture,
    earlier: &[Capture],
    redundancy: Redundancy,
    anchor_world: DVec3,
    rays: Option<&RayScene>,
) -> Vec<bool> {
    let earlier = Earlier::new(&capture.camera, earlier, redundancy, anchor_world, rays);
    let near_m = capture.camera.near_m as f32;
    let (focal_px, centre_px) = (capture.camera.focal_px as f32, capture.camera.centre_px.as_vec2());
    let width = capture.camera.width_px as usize;
    let sample = |index: usize| {
        let place = Vec2::new((index % width) as f32 + 0.5, (index / width) as f32 + 0.5);
        Sample {
            p_eye: ((place - centre_px) / focal_px).extend(1.0) / (capture.depth[index] / near_m),
            normal_world: octahedral_normal(capture.normal_code(index)),
            triangle: capture.ids[index][0],
            object: capture.object(index),
        }
    };
    let occupied: Vec<usize> = (0..capture.ids.len()).filter(|&index| capture.ids[index][0] != 0).collect();
    occupied.into_par_iter().map(|index| earlier.is_redundant(&sample(index))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn records_are_laid_out_as_in_wgsl() {
        let path = "server/redundancy.wgsl";
        shaders::assert_layout!(
            EarlierImage,
            path,
            "EarlierImage",
            eye_from_this_x,
            eye_from_this_y,
            eye_from_this_z,
            eye_anchor,
            near_m,
            centre_px,
            size_px,
            focal_px
        );
        shaders::assert_layout!(EarlierImages, path, "EarlierImages", count, images);
    }
}
