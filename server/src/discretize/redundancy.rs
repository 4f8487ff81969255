//! The redundancy test: what the shader needs for it, and its twin on the CPU.

use bytemuck::{Pod, Zeroable};
use camera::Pinhole;
use glam::{DVec3, Vec3, Vec4};

use super::{Capture, TexelTest};

/// How many earlier images one image is tested against at most.
pub const MAX_EARLIER: usize = 15;

/// `EarlierImage` of `server/image.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub(crate) struct EarlierImage {
    pub eye_from_this_x: [f32; 4],
    pub eye_from_this_y: [f32; 4],
    pub eye_from_this_z: [f32; 4],
    pub centre_px: [f32; 2],
    pub size_px: [f32; 2],
    pub focal_px: f32,
    pub near_m: f32,
    pub padding: [f32; 2],
}

/// `EarlierImages` of `server/image.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub(crate) struct EarlierImages {
    pub count: u32,
    pub padding: [u32; 3],
    pub images: [EarlierImage; MAX_EARLIER],
}

impl EarlierImages {
    /// How to reproject from `this` into each of `earlier`, at most [`MAX_EARLIER`].
    pub(crate) fn new(this: &Pinhole, earlier: &[Pinhole]) -> EarlierImages {
        let mut images = [EarlierImage::zeroed(); MAX_EARLIER];
        for (image, camera) in images.iter_mut().zip(earlier) {
            *image = EarlierImage::new(this, camera);
        }
        EarlierImages { count: earlier.len().min(MAX_EARLIER) as u32, padding: [0; 3], images }
    }
}

impl EarlierImage {
    fn new(this: &Pinhole, earlier: &Pinhole) -> EarlierImage {
        // In f64: the eyes may be far from the world's origin and close to each other.
        let earlier_from_this = earlier.world_from_eye.inverse() * this.world_from_eye;
        let affine = earlier_from_this.to_affine();
        let rows = affine.matrix3.transpose();
        let row = |row: DVec3, offset: f64| row.as_vec3().extend(offset as f32).to_array();
        EarlierImage {
            eye_from_this_x: row(rows.x_axis, affine.translation.x),
            eye_from_this_y: row(rows.y_axis, affine.translation.y),
            eye_from_this_z: row(rows.z_axis, affine.translation.z),
            centre_px: earlier.centre_px.as_vec2().to_array(),
            size_px: [earlier.width_px as f32, earlier.height_px as f32],
            focal_px: earlier.focal_px as f32,
            near_m: earlier.near_m as f32,
            padding: [0.0; 2],
        }
    }
}

/// An earlier image, ready to be asked by samples of a later one: the twin of `holds` in `server/image.wgsl`, in f32 like it.
pub struct Earlier<'a> {
    image: EarlierImage,
    capture: &'a Capture,
}

impl<'a> Earlier<'a> {
    /// For samples of images of the camera `this`.
    pub fn new(this: &Pinhole, capture: &'a Capture) -> Earlier<'a> {
        Earlier { image: EarlierImage::new(this, &capture.camera), capture }
    }

    /// Whether the earlier image has `triangle` where the point lands.
    pub fn holds(&self, p_eye: Vec3, triangle: u32, texel_test: TexelTest) -> bool {
        let image = &self.image;
        let p = p_eye.extend(1.0);
        let [x, y, z] =
            [image.eye_from_this_x, image.eye_from_this_y, image.eye_from_this_z].map(|row| Vec4::from(row).dot(p));
        if z < image.near_m {
            return false;
        }
        let scale = image.focal_px / z;
        let (u, v) = (image.centre_px[0] + scale * x, image.centre_px[1] + scale * y);
        if !(u >= 0.0 && v >= 0.0 && u < image.size_px[0] && v < image.size_px[1]) {
            return false;
        }
        let radius = texel_test.radius_px();
        let (u, v) = (u as i32, v as i32);
        (v - radius..=v + radius).any(|y| (u - radius..=u + radius).any(|x| self.capture.triangle_at(x, y) == triangle))
    }
}

/// Whether each occupied pixel of `capture` (row-major) is redundant with one of `earlier`.
pub fn redundant_samples(capture: &Capture, earlier: &[Capture], texel_test: TexelTest) -> Vec<bool> {
    let earlier: Vec<Earlier<'_>> = earlier.iter().map(|other| Earlier::new(&capture.camera, other)).collect();
    let near_m = capture.camera.near_m as f32;
    let (focal_px, centre_px) = (capture.camera.focal_px as f32, capture.camera.centre_px.as_vec2());
    let width = capture.camera.width_px as usize;
    let occupied = capture.ids.iter().enumerate().filter(|(_, ids)| ids[0] != 0);
    occupied
        .map(|(index, ids)| {
            let (x, y) = ((index % width) as f32 + 0.5, (index / width) as f32 + 0.5);
            let ray = Vec3::new((x - centre_px.x) / focal_px, (y - centre_px.y) / focal_px, 1.0);
            let p_eye = ray / (capture.depth[index] / near_m);
            earlier.iter().any(|other| other.holds(p_eye, ids[0], texel_test))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn records_are_laid_out_as_in_wgsl() {
        let path = "server/image.wgsl";
        shaders::assert_layout!(
            EarlierImage,
            path,
            "EarlierImage",
            eye_from_this_x,
            eye_from_this_y,
            eye_from_this_z,
            centre_px,
            size_px,
            focal_px,
            near_m
        );
        shaders::assert_layout!(EarlierImages, path, "EarlierImages", count, images);
    }
}
