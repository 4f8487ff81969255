//! Environments: the light that comes from far away, from every direction, as an equirectangular picture.
//!
//! An environment is read from a Radiance (`.hdr`) or OpenEXR (`.exr`) file, or made by code ([`Environment::studio`]). It gives
//! linear radiance in RGB of Rec. 709; a directional mean of 1 lights a white matte surface to 1 on average.
//!
//! **Directions.** World space: right-handed, y up. A unit direction `d` is seen at
//!
//! ```text
//! u = atan2(d.z, d.x) / 2π + 0.5     from the left edge, 0, to the right one, 1
//! v = asin(d.y) / π + 0.5            from the lower edge, 0, to the upper one, 1
//! ```
//!
//! so +y is the whole upper edge and the first row lies below it. The middle of the picture looks along +x, three quarters of
//! its width along +z, one quarter along -z, and both side edges along -x. Seen from inside nothing is mirrored: who looks
//! along +x has +z at his right. `equirectUv` of three.js is the same map, so one file lights both alike.
//!
//! Pixel `(x, y)`, from the upper left, has its middle at `u = (x + 0.5) / width`, `v = 1 - (y + 0.5) / height`.

mod error;
mod file;
mod studio;
#[cfg(test)]
mod tests;

use std::f64::consts::{PI, TAU};

use glam::{DVec2, DVec3, Vec3};

pub use error::EnvironmentError;

/// Light from far away. See the module for what the pixels mean.
#[derive(Debug, Clone, PartialEq)]
pub struct Environment {
    /// Pixels around, at least 1.
    pub width_px: u32,
    /// Pixels from above to below, at least 1.
    pub height_px: u32,
    /// Linear RGB, finite, from 0 to [`Environment::MAX_RADIANCE`]; rows from the top, each from the left.
    pub radiance: Vec<[f32; 3]>,
}

impl Environment {
    /// The largest radiance: the largest finite half float, as GPUs filter it. Suns in files are brighter, and are cut.
    pub const MAX_RADIANCE: f32 = 65504.0;
    /// Pixels of a file at most: 8192 x 4096, which takes 400 MB.
    pub const MAX_PIXELS: u64 = 8192 * 4096;

    /// What comes from a direction of any length but 0: bilinear between the middles of four pixels. It goes on around the side
    /// edges, and past the upper and lower ones with the outermost row.
    pub fn radiance(&self, direction: DVec3) -> Vec3 {
        let uv = uv_from_direction(direction);
        let at = DVec2::new(uv.x * f64::from(self.width_px), (1.0 - uv.y) * f64::from(self.height_px)) - 0.5;
        let floor = at.floor();
        let share = (at - floor).as_vec2();
        let row = |y: i64| {
            let [left, right] = [0, 1].map(|step| self.pixel(floor.x as i64 + step, y));
            left.lerp(right, share.x)
        };
        row(floor.y as i64).lerp(row(floor.y as i64 + 1), share.y)
    }

    /// The mean over all directions, each pixel by its solid angle.
    pub fn mean_radiance(&self) -> Vec3 {
        let width = self.width_px as usize;
        let rows = self.radiance.chunks_exact(width).enumerate();
        let sum: DVec3 = rows
            .map(|(y, row)| {
                let row_sum: DVec3 = row.iter().map(|&pixel| Vec3::from(pixel).as_dvec3()).sum();
                row_sum * self.row_share(y) / width as f64
            })
            .sum();
        sum.as_vec3()
    }

    /// The share of all directions that a row of pixels sees.
    fn row_share(&self, y: usize) -> f64 {
        let height_of = |row: usize| (PI * (0.5 - row as f64 / f64::from(self.height_px))).sin();
        (height_of(y) - height_of(y + 1)) / 2.0
    }

    fn pixel(&self, x: i64, y: i64) -> Vec3 {
        let x = x.rem_euclid(i64::from(self.width_px));
        let y = y.clamp(0, i64::from(self.height_px) - 1);
        Vec3::from(self.radiance[(y * i64::from(self.width_px) + x) as usize])
    }
}

/// Where a direction of any length but 0 is seen; see the module.
pub fn uv_from_direction(direction: DVec3) -> DVec2 {
    let d = direction.normalize_or(DVec3::X);
    DVec2::new(d.z.atan2(d.x) / TAU + 0.5, d.y.clamp(-1.0, 1.0).asin() / PI + 0.5)
}

/// The unit direction that is seen at a place of the picture; the inverse of [`uv_from_direction`].
pub fn direction_from_uv(uv: DVec2) -> DVec3 {
    let (azimuth_rad, elevation_rad) = ((uv.x - 0.5) * TAU, (uv.y - 0.5) * PI);
    let (up, level) = elevation_rad.sin_cos();
    DVec3::new(level * azimuth_rad.cos(), up, level * azimuth_rad.sin())
}
