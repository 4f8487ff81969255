//! Rays from mirror to mirror and through glass, to the surface that is shown.

use glam::DVec3;

use super::effects::Effects;
use super::geometry::{Among, Query, Ray};
use super::light::Lights;
use super::surface::{Kind, Surface, Surfaces};

/// Total reflections within glass; a ray that meets another one ends at the background.
const TOTAL_REFLECTIONS: usize = 2;

/// What came along a ray.
#[derive(Debug, Clone, Copy)]
pub(super) struct Arrived {
    /// Exposed light.
    pub light: DVec3,
    /// The first surface that was hit.
    pub first: Option<Surface>,
    /// What the last bounced or refracted ray hit.
    pub reflected_object: Option<u16>,
    /// How often it was reflected or passed through glass.
    pub bounces: u8,
    /// How many surfaces were seen through where they are blended.
    pub seen_through: u8,
}

/// A ray that leaves a surface.
#[derive(Debug, Clone, Copy)]
struct Leaving {
    ray: Ray,
    facet: u32,
}

/// The light along a camera's ray, beyond `t_least` lengths of its direction.
pub(super) fn follow(surfaces: &Surfaces, lights: &Lights, effects: &Effects, ray: Ray, t_least: f64) -> Arrived {
    let mut query = Query { among: Among::Shown, without: None, leaves: None, t_range: [t_least, f64::INFINITY] };
    let (mut ray, mut tint) = (ray, DVec3::ONE);
    // What was seen through, from the nearest on: linear light of its own, and the share of what lies behind that is seen.
    let mut through: Vec<(DVec3, DVec3)> = Vec::new();
    let mut arrived =
        Arrived { light: lights.background, first: None, reflected_object: None, bounces: 0, seen_through: 0 };
    loop {
        let blending = effects.blending && arrived.bounces == 0;
        let Some(surface) = surfaces.first_of(&ray, &query, blending) else {
            arrived.light = behind(lights, &through, tint * lights.background);
            arrived.reflected_object = None;
            return arrived;
        };
        arrived.first = arrived.first.or(Some(surface));
        if blending && (surface.hides < 1.0 || surface.passing > 0.0) {
            let shown = lights.shown(surfaces.lit(&surface, ray.direction, lights, effects.shadows));
            let passing = DVec3::ONE.lerp(surfaces.passing(&surface, ray.direction, lights), surface.hides);
            through.push((shown * surface.hides, passing));
            query.t_range[0] = ray.t_of(surface.p) + surfaces.geometry.skip_m / ray.direction.length();
            arrived.seen_through = arrived.seen_through.saturating_add(1);
            continue;
        }
        arrived.reflected_object = (arrived.bounces > 0).then_some(surface.object);
        let kind = surfaces.kind(&surface);
        let is_rough = effects.reflections && lights.is_full() && surfaces.is_rough_mirror(&surface);
        if is_rough && arrived.bounces == 0 {
            let light = surfaces.lit_rough(&surface, ray.direction, lights, effects);
            arrived.light = behind(lights, &through, light);
            arrived.bounces = 1;
            return arrived;
        }
        if kind == Kind::Plain || !effects.reflections || arrived.bounces >= effects.max_bounces {
            let light = tint * surfaces.lit(&surface, ray.direction, lights, effects.shadows);
            arrived.light = behind(lights, &through, light);
            return arrived;
        }
        arrived.bounces += 1;
        tint *= surface.base;
        let direction = ray.direction.normalize_or_zero();
        let leaving = match kind {
            Kind::Glass { ior } => through_glass(surfaces, &surface, direction, ior),
            _ => Some(leaving(&surface, reflected(direction, &surface))),
        };
        let Some(leaving) = leaving else {
            arrived.light = behind(lights, &through, tint * lights.background);
            arrived.reflected_object = None;
            return arrived;
        };
        ray = leaving.ray;
        query.leaves = Some(leaving.facet);
        query.without = (!effects.self_reflection).then_some(surface.object);
        query.t_range[0] = surfaces.geometry.skip_m;
    }
}

/// The light that is shown where light lies behind what is seen through: shown colours are mixed, in linear light.
fn behind(lights: &Lights, through: &[(DVec3, DVec3)], light: DVec3) -> DVec3 {
    if through.is_empty() {
        return light;
    }
    let shown = through.iter().rev().fold(lights.shown(light), |below, (own, passing)| own + passing * below);
    lights.shown_as(shown)
}

fn leaving(surface: &Surface, direction: DVec3) -> Leaving {
    Leaving { ray: Ray { origin: surface.p, direction }, facet: surface.facet }
}

/// About the shading normal; about the triangle's own where that would go below the triangle.
fn reflected(direction: DVec3, surface: &Surface) -> DVec3 {
    let about = |normal: DVec3| direction - normal * (2.0 * direction.dot(normal));
    let smooth = about(surface.shading);
    if smooth.dot(surface.geometric) > 0.0 { smooth } else { about(surface.geometric) }
}

/// By Snell's law at an interface from index `ior_from` to `ior_to`; `None` where all light is reflected. The
/// triangle's own normal decides where the shading normal would send the ray back to the side that it came from.
fn refracted(direction: DVec3, surface: &Surface, ior_from: f64, ior_to: f64) -> Option<DVec3> {
    let eta = ior_from / ior_to;
    let across = |normal: DVec3| {
        let cos_in = -direction.dot(normal);
        let squared = 1.0 - eta * eta * (1.0 - cos_in * cos_in);
        (cos_in > 0.0 && squared >= 0.0).then(|| direction * eta + normal * (eta * cos_in - squared.sqrt()))
    };
    let normal = surface.facing();
    let is_total = |normal: DVec3| eta * eta * (1.0 - direction.dot(normal).powi(2)) > 1.0;
    if direction.dot(normal) < 0.0 && is_total(normal) {
        return None;
    }
    let smooth = across(normal).filter(|direction| direction.dot(surface.geometric) < 0.0);
    smooth.or_else(|| across(surface.geometric))
}

/// Into a body of glass and out of it; inside, nothing but the body itself is there. A ray that finds no way out of an
/// open body goes on as it is. `None` where it stays inside.
fn through_glass(surfaces: &Surfaces, front: &Surface, direction: DVec3, ior: f64) -> Option<Leaving> {
    let mut inside = leaving(front, refracted(direction, front, 1.0, ior)?);
    for _ in 0..=TOTAL_REFLECTIONS {
        let query = Query {
            among: Among::Object(front.object),
            without: None,
            leaves: Some(inside.facet),
            t_range: [surfaces.geometry.skip_m, f64::INFINITY],
        };
        let Some(back) = surfaces.first(&inside.ray, &query) else { return Some(inside) };
        if let Some(out) = refracted(inside.ray.direction, &back, ior, 1.0) {
            return Some(leaving(&back, out));
        }
        inside = leaving(&back, reflected(inside.ray.direction, &back));
    }
    None
}

#[cfg(test)]
mod tests {
    use glam::dvec3;

    use super::super::tests::{cuboid, glass, scene};
    use super::*;

    /// Where a ray leaves a body of glass, of index 1.5, that is a box around the origin.
    fn through(half: [f32; 3], origin: DVec3, direction: DVec3) -> Option<Ray> {
        let scene = scene(vec![(cuboid(half), glass(1.5), DVec3::ZERO)]);
        let surfaces = Surfaces::new(&scene, &scene.at(0.0));
        let query = Query { among: Among::Shown, without: None, leaves: None, t_range: [0.0, f64::INFINITY] };
        let front = surfaces.first(&Ray { origin, direction }, &query).expect("meets the box");
        through_glass(&surfaces, &front, direction, 1.5).map(|leaving| leaving.ray)
    }

    #[test]
    fn a_slab_shifts_a_ray_as_snell_says() {
        for degrees in [0.0_f64, 20.0, 45.0, 70.0] {
            let (sin, cos) = degrees.to_radians().sin_cos();
            let direction = dvec3(sin, 0.0, -cos);
            let out = through([100.0, 100.0, 0.25], dvec3(0.3, 0.1, 2.0), direction).expect("leaves");
            assert!(out.direction.distance(direction) < 1e-12, "parallel to what it was: {}", out.direction);
            let aside_m = (out.origin - dvec3(0.3, 0.1, 2.0)).reject_from(direction).length();
            let inside = (sin / 1.5).asin();
            // Born, Wolf, Principles of Optics, 1999, section 4.7 for the plate: d sin(a - b) / cos(b).
            let wanted_m = 0.5 * (degrees.to_radians() - inside).sin() / inside.cos();
            assert!((aside_m - wanted_m).abs() < 1e-9, "{aside_m} m for {wanted_m} m at {degrees} degrees");
        }
    }

    #[test]
    fn a_ray_is_reflected_within_glass_where_it_cannot_leave() {
        // Down into the top of a cube near its side: at 62 degrees, beyond the critical 41.8, it is thrown back there,
        // and leaves through the bottom as it came, mirrored.
        let direction = dvec3(1.0, -1.0, 0.0).normalize();
        let out = through([1.0, 1.0, 1.0], dvec3(0.3, 1.5, 0.0), direction).expect("leaves");
        assert!(out.direction.distance(dvec3(-1.0, -1.0, 0.0).normalize()) < 1e-12, "{}", out.direction);
        assert!((out.origin.y + 1.0).abs() < 1e-12);
    }
}
