//! Light from far around, filtered for rough and matte surfaces: what a client lights by where no lamp does.
//!
//! A matte surface is lit by nine numbers a channel, the spherical harmonics of the light convolved with the cosine (Ramamoorthi, Hanrahan, *An
//! efficient representation for irradiance environment maps*, 2001). What a shiny one mirrors is a picture of the whole sphere for each of five
//! roughnesses, as wide as its lobe allows: the first factor of the split sum (Karis, *Real shading in Unreal Engine 4*, 2013). Levels that are
//! smoother than every material of a scene are left out.
//!
//! **Directions.** World space. A level is a square that holds the octahedron unfolded ([`direction_at`]), rows from the top.

use glam::{Vec2, Vec2Swizzles as _, Vec3};

/// See the module.
#[derive(Debug, Clone, PartialEq)]
pub struct Sky {
    /// Of the nine harmonics up to the second order, in the order of [`harmonics`], linear RGB: their sum is the light that a matte white surface
    /// of that normal shows.
    pub diffuse: [[f32; 3]; Sky::HARMONICS],
    /// Number of the first level, 0 to [`Sky::LEVELS`] less one.
    pub first_level: u8,
    /// The levels from the first one to the last.
    pub levels: Vec<SkyLevel>,
}

/// What surfaces of one roughness mirror.
#[derive(Debug, Clone, PartialEq)]
pub struct SkyLevel {
    /// Linear RGB as half floats of which the lowest four bits are zero, rows of a square.
    pub texels: Vec<[u16; 3]>,
}

impl Sky {
    /// Harmonics up to the second order.
    pub const HARMONICS: usize = 9;
    /// Levels of every roughness from 0 to 1, evenly.
    pub const LEVELS: usize = 5;
    /// The side of the smoothest level; each next one has half of it.
    pub const SIDE_PX: usize = 256;
    /// The bits that a texel's half floats leave off.
    pub const CUT_BITS: u32 = 4;

    /// The side of a level.
    pub fn side_px(level: usize) -> usize {
        Sky::SIDE_PX >> level
    }

    /// The roughness of a level.
    pub fn roughness(level: usize) -> f32 {
        level as f32 / (Sky::LEVELS - 1) as f32
    }

    /// The first level that a scene needs whose smoothest material is so rough: the last one that is no rougher.
    pub fn first_level(smoothest: f32) -> u8 {
        (smoothest.clamp(0.0, 1.0) * (Sky::LEVELS - 1) as f32) as u8
    }

    /// Whether the levels are as many and as large as they say, and all numbers finite.
    pub fn is_whole(&self) -> bool {
        let first = usize::from(self.first_level);
        let is_finite = |half: u16| half < 0x7c00 && half & ((1 << Sky::CUT_BITS) - 1) == 0;
        let fits = |(level, number): (&SkyLevel, usize)| {
            level.texels.len() == Sky::side_px(number).pow(2)
                && level.texels.iter().flatten().all(|&half| is_finite(half))
        };
        first + self.levels.len() == Sky::LEVELS
            && self.levels.iter().zip(first..).all(fits)
            && self.diffuse.iter().flatten().all(|number| number.is_finite())
    }
}

/// The direction that a place of a level shows; the square is `[-1, 1]²`, x to the right and y down.
pub fn direction_at(place: Vec2) -> Vec3 {
    let z = 1.0 - place.x.abs() - place.y.abs();
    let folded = if z < 0.0 { (Vec2::ONE - place.yx().abs()) * place.signum() } else { place };
    folded.extend(z).normalize_or(Vec3::Z)
}

/// The real spherical harmonics up to the second order at a unit direction.
pub fn harmonics(n: Vec3) -> [f32; Sky::HARMONICS] {
    let Vec3 { x, y, z } = n;
    [
        0.282_095,
        0.488_603 * y,
        0.488_603 * z,
        0.488_603 * x,
        1.092_548 * x * y,
        1.092_548 * y * z,
        0.315_392 * (3.0 * z * z - 1.0),
        1.092_548 * x * z,
        0.546_274 * (x * x - y * y),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grey() -> Sky {
        let level = |number: usize| SkyLevel { texels: vec![[0x3c00; 3]; Sky::side_px(number).pow(2)] };
        Sky { diffuse: [[0.5; 3]; Sky::HARMONICS], first_level: 2, levels: (2..Sky::LEVELS).map(level).collect() }
    }

    #[test]
    fn a_sky_that_lacks_anything_is_not_whole() {
        assert!(grey().is_whole());
        let mut fewer = grey();
        fewer.levels.pop();
        let mut smaller = grey();
        smaller.levels[1].texels.pop();
        let mut endless = grey();
        endless.levels[0].texels[7] = [0x7c00, 0, 0];
        let mut unknown = grey();
        unknown.diffuse[3][1] = f32::NAN;
        for broken in [fewer, smaller, endless, unknown] {
            assert!(!broken.is_whole());
        }
    }

    #[test]
    fn levels_are_left_out_that_nothing_is_smooth_enough_for() {
        assert_eq!([0.0, 0.24, 0.25, 0.6, 1.0, f32::INFINITY].map(Sky::first_level), [0, 0, 1, 2, 4, 4]);
    }

    #[test]
    fn the_square_shows_every_axis() {
        let at = |x, y| direction_at(Vec2::new(x, y));
        assert_eq!(
            [at(0.0, 0.0), at(1.0, 0.0), at(0.0, -1.0), at(1.0, 1.0)],
            [Vec3::Z, Vec3::X, Vec3::NEG_Y, Vec3::NEG_Z]
        );
    }

    #[test]
    fn harmonics_are_orthonormal() {
        // The mean over evenly spread directions, times the sphere's area.
        let count = 4000;
        let mut products = [[0.0_f64; Sky::HARMONICS]; Sky::HARMONICS];
        for index in 0..count {
            let z = 1.0 - (2.0 * index as f32 + 1.0) / count as f32;
            let (sin, cos) = (index as f32 * 2.399_963).sin_cos();
            let values = harmonics(Vec3::new((1.0 - z * z).sqrt() * cos, (1.0 - z * z).sqrt() * sin, z));
            for (row, a) in products.iter_mut().zip(values) {
                row.iter_mut().zip(values).for_each(|(sum, b)| *sum += f64::from(a * b));
            }
        }
        for (i, row) in products.iter().enumerate() {
            for (j, sum) in row.iter().enumerate() {
                let expected = f64::from(u8::from(i == j));
                assert!((sum * 4.0 * std::f64::consts::PI / f64::from(count) - expected).abs() < 0.01, "{i} {j}");
            }
        }
    }
}
