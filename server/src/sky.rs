//! Light from far around, filtered once for all clients: [`protocol::Sky`] from an environment.
//!
//! What a rough surface mirrors is a mean over the GGX lobe of a surface that is seen and lit from straight above (Karis, *Real shading in Unreal
//! Engine 4*, 2013): directions are drawn from the lobe, and each is looked up in a copy of the environment whose pixels are about as large as
//! the directions are apart (Krivanek, Colbert, *Real-time shading with filtered importance sampling*, 2008), so few are enough.

use std::f64::consts::{PI, TAU};

use glam::{DVec2, DVec3, Vec2, Vec3};
use protocol::Sky;
use protocol::sky::{SkyLevel, direction_at, harmonics};
use rayon::prelude::*;
use scene::environment::{Environment, direction_from_uv};

/// Directions a texel.
const DIRECTIONS: u32 = 256;

/// The sky of an environment, for materials that are as smooth as `smoothest` at most: their roughness, 0 to 1.
pub fn sky(environment: &Environment, smoothest: f32) -> Sky {
    let copies = Copies::of(environment);
    let first_level = Sky::first_level(smoothest);
    let levels = (usize::from(first_level)..Sky::LEVELS).map(|level| level_of(&copies, level)).collect();
    Sky { diffuse: diffuse(&copies), first_level, levels }
}

/// An environment, and copies of it, each with half of the pixels along both sides.
struct Copies(Vec<Environment>);

impl Copies {
    fn of(environment: &Environment) -> Copies {
        let mut copies = vec![environment.clone()];
        while let Some(last) = copies.last().filter(|last| last.width_px.min(last.height_px) > 1) {
            copies.push(halved(last));
        }
        Copies(copies)
    }

    /// What comes from around a direction, within so many steradians.
    fn radiance(&self, direction: DVec3, solid_angle: f64) -> DVec3 {
        let first = &self.0[0];
        let pixel = 4.0 * PI / (f64::from(first.width_px) * f64::from(first.height_px));
        let copy = (0.5 * (solid_angle / pixel).log2()).clamp(0.0, (self.0.len() - 1) as f64);
        let finer = copy as usize;
        let of = |copy: usize| self.0[copy.min(self.0.len() - 1)].radiance(direction).as_dvec3();
        of(finer).lerp(of(finer + 1), copy.fract())
    }
}

/// Each pixel the mean of four, or of two where only one side has any to spare. An odd last row or column counts twice.
fn halved(environment: &Environment) -> Environment {
    let half = |side: u32| side.div_ceil(2);
    let (width_px, height_px) = (half(environment.width_px), half(environment.height_px));
    let at = |x: u32, y: u32| {
        let (x, y) = (x.min(environment.width_px - 1), y.min(environment.height_px - 1));
        Vec3::from(environment.radiance[(y * environment.width_px + x) as usize])
    };
    let mean = |x: u32, y: u32| (at(x, y) + at(x + 1, y) + at(x, y + 1) + at(x + 1, y + 1)) / 4.0;
    let rows = (0..height_px).into_par_iter();
    let radiance = rows.flat_map_iter(|y| (0..width_px).map(move |x| mean(2 * x, 2 * y).to_array())).collect();
    Environment { width_px, height_px, radiance }
}

/// The harmonics of the light, each order times what the cosine leaves of it, over pi: 1, 2/3 and 1/4.
fn diffuse(copies: &Copies) -> [[f32; 3]; Sky::HARMONICS] {
    const LEFT: [f64; Sky::HARMONICS] = [1.0, 2.0 / 3.0, 2.0 / 3.0, 2.0 / 3.0, 0.25, 0.25, 0.25, 0.25, 0.25];
    // The second order needs no more than this.
    let small = copies.0.iter().find(|copy| copy.width_px <= 128).unwrap_or(&copies.0[0]);
    let (width, height) = (f64::from(small.width_px), f64::from(small.height_px));
    let mut sums = [DVec3::ZERO; Sky::HARMONICS];
    for (index, &radiance) in small.radiance.iter().enumerate() {
        let (x, y) = (index as u32 % small.width_px, index as u32 / small.width_px);
        let (u, v) = ((f64::from(x) + 0.5) / width, 1.0 - (f64::from(y) + 0.5) / height);
        let solid_angle = ((v - 0.5) * PI).cos() * (PI / height) * (TAU / width);
        let values = harmonics(direction_from_uv(DVec2::new(u, v)).as_vec3());
        for (sum, value) in sums.iter_mut().zip(values) {
            *sum += Vec3::from(radiance).as_dvec3() * (f64::from(value) * solid_angle);
        }
    }
    std::array::from_fn(|index| (sums[index] * LEFT[index]).as_vec3().to_array())
}

fn level_of(copies: &Copies, level: usize) -> SkyLevel {
    let side_px = Sky::side_px(level);
    let alpha = f64::from(Sky::roughness(level)).powi(2);
    let texel = |index: usize| {
        let place = Vec2::new((index % side_px) as f32, (index / side_px) as f32) + 0.5;
        let direction = direction_at(place / side_px as f32 * 2.0 - 1.0).as_dvec3();
        let radiance = if level == 0 {
            copies.radiance(direction, 4.0 * PI / (side_px * side_px) as f64)
        } else {
            mirrored(copies, direction.normalize(), alpha)
        };
        radiance.to_array().map(|channel| half(channel as f32))
    };
    SkyLevel { texels: (0..side_px * side_px).into_par_iter().map(texel).collect() }
}

/// What a surface of roughness `sqrt(alpha)` mirrors that faces its normal's direction.
fn mirrored(copies: &Copies, normal: DVec3, alpha: f64) -> DVec3 {
    let (x, y) = normal.any_orthonormal_pair();
    let (mut sum, mut weight) = (DVec3::ZERO, 0.0);
    for index in 0..DIRECTIONS {
        // Hammersley's points.
        let around = TAU * (f64::from(index) + 0.5) / f64::from(DIRECTIONS);
        let share = f64::from(index.reverse_bits()) / 2f64.powi(32);
        let cos_squared = (1.0 - share) / (1.0 + (alpha * alpha - 1.0) * share);
        let (cos, sin) = (cos_squared.sqrt(), (1.0 - cos_squared).max(0.0).sqrt());
        let half_way = (x * around.cos() + y * around.sin()) * sin + normal * cos;
        let to_light = half_way * (2.0 * cos) - normal;
        let n_l = normal.dot(to_light);
        if n_l <= 0.0 {
            continue;
        }
        // Of the lobe as seen along the normal, the density of lights is a quarter of the half vectors'.
        let narrow = cos_squared * (alpha * alpha - 1.0) + 1.0;
        let density = alpha * alpha / (PI * narrow * narrow) / 4.0;
        sum += copies.radiance(to_light, 1.0 / (density * f64::from(DIRECTIONS))) * n_l;
        weight += n_l;
    }
    sum / weight
}

/// The bits of a half float of a number from 0 on, cut as a sky's texels are: rounded to a 128th.
fn half(number: f32) -> u16 {
    const CUT: u32 = 13 + Sky::CUT_BITS;
    const LARGEST: f32 = 65504.0;
    // The least half that is no subnormal; less is none.
    const LEAST: f32 = 6.104e-5;
    if number.is_nan() || number < LEAST {
        return 0;
    }
    let bits = number.min(LARGEST).to_bits() + (1 << (CUT - 1));
    let half = ((bits >> CUT) - ((127 - 15) << (10 - Sky::CUT_BITS))) << Sky::CUT_BITS;
    half.min(0x7bf0) as u16
}

#[cfg(test)]
mod tests {
    use super::*;

    fn environment(radiance: impl Fn(DVec3) -> f32) -> Environment {
        let (width_px, height_px) = (128, 64);
        let pixel = |index: u32| {
            let place = DVec2::new(f64::from(index % width_px), f64::from(index / width_px)) + 0.5;
            let uv = place / DVec2::new(f64::from(width_px), f64::from(height_px));
            [radiance(direction_from_uv(DVec2::new(uv.x, 1.0 - uv.y))); 3]
        };
        Environment { width_px, height_px, radiance: (0..width_px * height_px).map(pixel).collect() }
    }

    fn from_half(half: u16) -> f32 {
        if half == 0 { 0.0 } else { f32::from_bits((u32::from(half) << 13) + ((127 - 15) << 23)) }
    }

    #[test]
    fn halves_are_within_a_128th() {
        for number in [6.2e-5, 0.001, 0.3, 0.999, 1.0, 1.004, 17.0, 65000.0] {
            let near = from_half(half(number));
            assert!((near / number - 1.0).abs() <= 1.0 / 127.0, "{number}: {near}");
        }
        assert_eq!([0.0, -1.0, f32::NAN, 1e-6].map(half), [0; 4]);
        assert_eq!(half(1e9), 0x7bf0);
    }

    #[test]
    fn even_light_is_mirrored_and_scattered_evenly() {
        let sky = sky(&environment(|_| 0.5), 0.3);
        assert_eq!((sky.first_level, sky.is_whole()), (1, true));
        assert!(
            sky.levels
                .iter()
                .flat_map(|level| &level.texels)
                .flatten()
                .all(|&half| (from_half(half) - 0.5).abs() < 0.005)
        );
        let even: f32 = sky.diffuse[0][0] * harmonics(Vec3::Y)[0];
        assert!((even - 0.5).abs() < 0.005, "{even}");
        assert!(sky.diffuse[1..].iter().flatten().all(|order| order.abs() < 0.005));
    }

    #[test]
    fn light_from_above_lights_what_faces_it() {
        let sky = sky(&environment(|direction| direction.y.max(0.0) as f32), 0.0);
        let shown =
            |n: Vec3| -> f32 { sky.diffuse.iter().zip(harmonics(n)).map(|(order, value)| order[0] * value).sum() };
        // The integral of y * y over the upper half sphere is 2/3 pi.
        assert!((shown(Vec3::Y) - 2.0 / 3.0).abs() < 0.02, "{}", shown(Vec3::Y));
        assert!(shown(Vec3::NEG_Y).abs() < 0.05, "{}", shown(Vec3::NEG_Y));
        // Mirrored straight up: all of it, less and less of it.
        let up = |level: usize| {
            let side_px = Sky::side_px(level);
            // +y is the middle of the lower edge.
            from_half(sky.levels[level].texels[(side_px - 1) * side_px + side_px / 2][0])
        };
        assert!((up(0) - 1.0).abs() < 0.01, "{}", up(0));
        assert!((1..Sky::LEVELS).all(|level| up(level) < up(level - 1)), "{:?}", [0, 1, 2, 3, 4].map(up));
    }
}
