//! The full look, written anew: materials of glTF 2.0 (appendix B) with its extensions of specular, clear coat and sheen, under an environment.
//!
//! Where clients look up means that were filtered beforehand, and fits of integrals, here the integrals themselves are summed over directions: some
//! hundred of each lobe, drawn in proportion to it, each looked up in the environment as the file has it. What light loses between the facets of a
//! rough surface comes back as Kulla and Conty have it (*Revisiting physically based shading at Imageworks*, 2017). Everything of the environment
//! arrives, but for what a material's occlusion takes.

mod lobes;
mod shaded;
#[cfg(test)]
mod tests;

use glam::{DMat3, DVec2, DVec3};
use scene::environment::Environment;

use lobes::{Albedo, Pair, hammersley};
pub(super) use shaded::Shaded;

/// Directions of a lobe: with twice as many, pictures of the tests differ by less than a step of 8 bits.
const DIRECTIONS: u32 = 512;

/// The same of a rough mirror, along each of which a ray is followed.
const NEAR_DIRECTIONS: u32 = 128;
/// The same of what these rays meet: that many times as many are averaged.
const FEW_DIRECTIONS: u32 = 32;

/// What arrives from a direction of what is near; `None` of the sky.
pub(super) type Near<'a> = &'a dyn Fn(DVec3) -> Option<DVec3>;

/// How a surface is lit from all around.
#[derive(Clone, Copy)]
pub(super) enum Around<'a> {
    /// By the sky alone.
    Sky,
    /// The same, by fewer directions.
    FewOfSky,
    /// By the sky, in whose place the mirrored lobe shows what is near.
    Near(Near<'a>),
}

/// Interpolated normals lean away from the eye at outlines. A surface counts as seen from this cosine at least: 0.06 degrees above it, where facets
/// as rough as squares of roughness of 1e-4 still send light back.
const LEAST_COSINE: f64 = 1e-3;

/// The sky of the full look.
pub(super) struct FullSky {
    environment: Environment,
    /// What its light is multiplied by.
    strength: f64,
    /// Evenly strewn over the unit square.
    points: Vec<DVec2>,
    near_points: Vec<DVec2>,
    few_points: Vec<DVec2>,
    albedo: Albedo,
}

impl FullSky {
    pub fn new(environment: &Environment, strength: f64) -> FullSky {
        let [points, near_points, few_points] = [DIRECTIONS, NEAR_DIRECTIONS, FEW_DIRECTIONS]
            .map(|count| (0..count).map(|index| hammersley(index, count)).collect());
        FullSky { environment: environment.clone(), strength, points, near_points, few_points, albedo: Albedo::new() }
    }

    fn radiance(&self, direction: DVec3) -> DVec3 {
        self.environment.radiance(direction).as_dvec3() * self.strength
    }

    /// What a surface sends back towards the eye of the light from all around; both directions of unit length.
    pub fn leaving(&self, surface: &Shaded, normal: DVec3, to_eye: DVec3, around: Around<'_>) -> DVec3 {
        let world_from_local = frame(normal);
        let mut eye = world_from_local.transpose() * to_eye;
        eye.z = eye.z.max(LEAST_COSINE);
        let eye = eye.normalize();
        let from = |local: DVec3| self.radiance(world_from_local * local);
        let points = match around {
            Around::Sky => &self.points,
            Around::FewOfSky => &self.few_points,
            Around::Near(_) => &self.near_points,
        };
        // Few directions of their own for each eye: a bright lamp that some miss is a matter of chance, which means out.
        let shift = if matches!(around, Around::FewOfSky) { scattered_point(to_eye) } else { DVec2::ZERO };
        let points: Vec<DVec2> = points.iter().map(|&point| (point + shift).fract()).collect();
        let count = points.len() as f64;
        // What is near hides what a texture of occlusion stands for.
        let (share, near): (f64, Near<'_>) = match around {
            Around::Near(near) => (1.0, near),
            Around::Sky | Around::FewOfSky => (mirrored_share(surface.occlusion, eye.z, surface.roughness), &|_| None),
        };
        let mut scattered = DVec3::ZERO;
        let mut by_fibres = DVec3::ZERO;
        for &point in &points {
            let light = lobes::cosine_direction(point);
            let pair = Pair::new(eye, light);
            let radiance = from(light);
            scattered += (surface.diffuse(&pair) + surface.lost(&pair, &self.albedo)) * radiance;
            if surface.sheen != DVec3::ZERO {
                by_fibres +=
                    surface.sheen * (lobes::fibres(surface.sheen_roughness, &pair) * std::f64::consts::PI) * radiance;
            }
        }
        let mirrored = |roughness: f64, fresnel: &dyn Fn(f64) -> DVec3, near: Near<'_>| {
            let arriving = |light: DVec3| near(world_from_local * light).unwrap_or_else(|| from(light));
            let of = |&point: &DVec2| {
                lobes::facet_direction(roughness, eye, point).map_or(DVec3::ZERO, |(light, weight)| {
                    fresnel(Pair::new(eye, light).l_h) * weight * arriving(light)
                })
            };
            points.iter().map(of).sum::<DVec3>() / count
        };
        let of_lobe = mirrored(surface.roughness, &|l_h| surface.fresnel(l_h), near);
        let mut leaving = scattered / count * surface.occlusion + of_lobe * share;
        if surface.sheen != DVec3::ZERO {
            leaving *= 1.0 - surface.sheen.max_element() * self.albedo.fibres(surface.sheen_roughness, eye.z);
            leaving += by_fibres / count * surface.occlusion;
        }
        if surface.coat > 0.0 {
            let coat = mirrored(surface.coat_roughness, &|l_h| DVec3::splat(shaded::coat_fresnel(l_h)), &|_| None);
            leaving =
                leaving * (1.0 - surface.coat * shaded::coat_fresnel(eye.z)) + coat * surface.coat * surface.occlusion;
        }
        leaving
    }

    /// What a surface sends back towards the eye of a light's irradiance on what faces it.
    pub fn of_lamp(&self, surface: &Shaded, normal: DVec3, to_eye: DVec3, to_light: DVec3) -> DVec3 {
        let local_from_world = frame(normal).transpose();
        let (mut eye, light) = (local_from_world * to_eye, local_from_world * to_light);
        if light.z <= 0.0 {
            return DVec3::ZERO;
        }
        eye.z = eye.z.max(LEAST_COSINE);
        let pair = Pair::new(eye.normalize(), light);
        let per_cosine = (surface.diffuse(&pair) + surface.lost(&pair, &self.albedo)) / std::f64::consts::PI;
        let mut leaving = per_cosine * light.z + surface.fresnel(pair.l_h) * lobes::ggx(surface.roughness, &pair);
        if surface.sheen != DVec3::ZERO {
            leaving *= 1.0 - surface.sheen.max_element() * self.albedo.fibres(surface.sheen_roughness, pair.n_v);
            leaving += surface.sheen * (lobes::fibres(surface.sheen_roughness, &pair) * light.z);
        }
        if surface.coat > 0.0 {
            leaving *= 1.0 - surface.coat * shaded::coat_fresnel(pair.n_v);
            leaving +=
                DVec3::splat(surface.coat * shaded::coat_fresnel(pair.l_h) * lobes::ggx(surface.coat_roughness, &pair));
        }
        leaving
    }
}

/// A point of the unit square for a direction, next to another one for the next direction (Steele and others, *Fast splittable pseudorandom number
/// generators*, 2014).
fn scattered_point(direction: DVec3) -> DVec2 {
    let mix = |mut bits: u64| {
        bits = (bits ^ (bits >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        bits = (bits ^ (bits >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        bits ^ (bits >> 31)
    };
    let bits = direction.to_array().iter().fold(0, |bits, value| mix(bits ^ value.to_bits()));
    DVec2::new((bits >> 32) as f64, (bits & 0xffff_ffff) as f64) / 2f64.powi(32)
}

/// World axes of a frame whose z is the normal (Duff and others, *Building an orthonormal basis, revisited*, 2017).
fn frame(normal: DVec3) -> DMat3 {
    let sign = 1.0_f64.copysign(normal.z);
    let a = -1.0 / (sign + normal.z);
    let b = normal.x * normal.y * a;
    let across = DVec3::new(1.0 + sign * normal.x * normal.x * a, sign * b, -sign * normal.x);
    DMat3::from_cols(across, DVec3::new(b, sign + normal.y * normal.y * a, -normal.y), normal)
}

/// The look's share of mirrored light that a texture of occlusion lets arrive: there is no truth of it but the look's own words (Lagarde, de
/// Rousiers, *Moving Frostbite to physically based rendering*, 2014, 4.10.2).
fn mirrored_share(occlusion: f64, n_v: f64, roughness: f64) -> f64 {
    ((n_v + occlusion).powf((-16.0 * roughness - 1.0).exp2()) - 1.0 + occlusion).clamp(0.0, 1.0)
}
