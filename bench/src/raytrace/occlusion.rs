//! Ambient occlusion by rays.

use std::f64::consts::TAU;

use glam::DVec3;

use super::geometry::Ray;
use super::surface::Surfaces;

/// How far from the surface rays begin, as a share of the reach: points that were stored with little precision may lie
/// that far below it, and what is nearer than that hides hardly anything else.
const LIFT: f64 = 1e-3;

/// The share of directions around a normal, weighted by cosine, that is free within `reach_m`. `p` is relative to the
/// anchor.
pub(super) fn free_share(surfaces: &Surfaces, p: DVec3, normal: DVec3, reach_m: f64, rays: u32) -> f64 {
    let normal = normal.normalize_or(DVec3::Y);
    let (tangent, bitangent) = normal.any_orthonormal_pair();
    let origin = p + normal * (LIFT * reach_m);
    let is_free = |index: u32| {
        let out = cosine_direction(index, rays);
        let direction = tangent * out.x + bitangent * out.y + normal * out.z;
        surfaces.is_free(&Ray { origin, direction }, reach_m)
    };
    let rays = rays.max(1);
    f64::from((0..rays).filter(|&index| is_free(index)).count() as u32) / f64::from(rays)
}

/// One of `count` directions around z, spread evenly over the disc below them, so that their density goes with the
/// cosine (Malley's method: Pharr, Jakob, Humphreys, Physically Based Rendering, section 13.6.3). Hammersley's points
/// stratify the disc's area; the first bit of the angle alternates, so that half-spaces get half of an even number.
fn cosine_direction(index: u32, count: u32) -> DVec3 {
    let (area, turn) = ((f64::from(index) + 0.5) / f64::from(count), radical_inverse(index));
    let (sin, cos) = (TAU * turn).sin_cos();
    DVec3::new(area.sqrt() * cos, area.sqrt() * sin, (1.0 - area).sqrt())
}

/// The digits of a number in base two, mirrored about the point.
fn radical_inverse(index: u32) -> f64 {
    f64::from(index.reverse_bits()) / 2f64.powi(32)
}
