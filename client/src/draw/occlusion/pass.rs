//! The pass that measures occlusion, and its uniforms.

use std::f64::consts::TAU;

use bytemuck::{Pod, Zeroable};
use camera::{Frustum, HalfSpace, Pinhole};
use glam::{DMat3, DVec3, Mat3, Vec3};
use surface::Projection;

use super::camera::Lookers;

/// The most frusta with the output view's; the twin of the constant in `client/occlusion.wgsl`.
pub(super) const FRUSTA: usize = 16;
/// Planes of each; the same.
const PLANES: usize = surface::FRUSTUM_PLANES;
/// The most taps into a z-buffer; the same.
pub(super) const TAPS: usize = 640;

/// `OcclusionFrustum` of `client/occlusion.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub(super) struct FrustumUniform {
    image_from_offset: [[f32; 4]; 3],
    centre: [f32; 3],
    footprint: f32,
    planes: [[f32; 4]; PLANES],
}

/// `Occlusion` of `client/occlusion.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub(super) struct OcclusionUniform {
    reach_m: f32,
    tap_count: u32,
    frustum_count: u32,
    graph_stride: u32,
    eye_anchor: [f32; 3],
    has_occluders: u32,
    frusta: [FrustumUniform; FRUSTA],
    taps: [[f32; 4]; TAPS],
}

impl OcclusionUniform {
    /// For a view, and the graph cameras beside it where there are any; whether these have a z-buffer of what only occludes.
    pub(super) fn new(view: &Pinhole, graph: Option<(&Lookers, bool)>, reach_m: f64, taps: u32) -> OcclusionUniform {
        let tap_count = taps.clamp(1, TAPS as u32);
        let mut uniform: OcclusionUniform = Zeroable::zeroed();
        uniform.reach_m = reach_m as f32;
        uniform.tap_count = tap_count;
        uniform.frusta[0] = of_view(view);
        (uniform.frustum_count, uniform.graph_stride) = (1, 1);
        if let Some((lookers, has_occluders)) = graph {
            uniform.has_occluders = has_occluders.into();
            let all = lookers.cameras.iter().flat_map(|(camera, from_px)| {
                camera
                    .frusta()
                    .iter()
                    .map(|frustum| of_frustum(frustum, *from_px, lookers.anchor_world(), camera.root()))
            });
            for (slot, frustum) in uniform.frusta[1..].iter_mut().zip(all) {
                *slot = frustum;
                uniform.frustum_count += 1;
            }
            // Where several cameras stand around, at least two of them hold a point.
            uniform.graph_stride = if lookers.cameras.len() > 1 { 2 } else { 1 };
            uniform.eye_anchor = (view.world_from_eye.translation - lookers.anchor_world()).as_vec3().to_array();
        }
        for (index, tap) in uniform.taps.iter_mut().enumerate().take(tap_count as usize) {
            *tap = tap_place(index, tap_count as usize).extend(0.0).as_vec4().to_array();
        }
        uniform
    }
}

/// A place in the upper half of the unit ball. Elevations and radii are spread evenly by additive recurrences (Roberts, *The
/// unreasonable effectiveness of quasirandom sequences*, 2018), azimuths by the golden angle: no two taps lie in one place.
fn tap_place(index: usize, count: usize) -> DVec3 {
    const GOLDEN: f64 = 0.618_033_988_749_894_9;
    const PLASTIC: f64 = 0.754_877_666_246_692_8;
    let radius = (index as f64 + 0.5) / count as f64;
    let azimuth_rad = TAU * (index as f64 * GOLDEN).fract();
    let sine = ((index as f64 + 0.5) * PLASTIC).fract();
    let cosine = (1.0 - sine * sine).sqrt();
    DVec3::new(azimuth_rad.cos() * cosine, azimuth_rad.sin() * cosine, sine) * radius
}

fn of_view(view: &Pinhole) -> FrustumUniform {
    let eye_from_world = DMat3::from_quat(view.world_from_eye.rotation.conjugate());
    let image_from_eye = DMat3::from_cols(
        DVec3::X * view.focal_px,
        DVec3::Y * view.focal_px,
        DVec3::new(view.centre_px.x, view.centre_px.y, 1.0),
    );
    let matrix = (image_from_eye * eye_from_world).as_mat3();
    frustum(matrix, DVec3::ZERO, view.focal_px, &[])
}

fn of_frustum(of: &Frustum, from_px: [u32; 2], anchor_world: DVec3, root: &Pinhole) -> FrustumUniform {
    let planes: Vec<HalfSpace> = of.half_spaces_world().iter().map(|plane| relative(plane, anchor_world)).collect();
    let [left, top] = from_px.map(|px| px as f32);
    let place = Mat3::from_cols(Vec3::X, Vec3::Y, Vec3::new(left, top, 1.0));
    let matrix = place * Projection::new(of).image_from_offset;
    frustum(matrix, of.centre_world() - anchor_world, root.focal_px, &planes)
}

fn relative(plane: &HalfSpace, anchor_world: DVec3) -> HalfSpace {
    HalfSpace { point: plane.point - anchor_world, ..*plane }
}

fn frustum(image_from_offset: Mat3, centre: DVec3, focal_px: f64, planes: &[HalfSpace]) -> FrustumUniform {
    let mut uniform = FrustumUniform {
        image_from_offset: gpu::columns(image_from_offset),
        centre: centre.as_vec3().to_array(),
        footprint: (1.0 / focal_px) as f32,
        planes: [[0.0, 0.0, 0.0, 1.0]; PLANES],
    };
    for (slot, plane) in uniform.planes.iter_mut().zip(planes) {
        *slot = (-plane.outward).extend(plane.outward.dot(plane.point)).as_vec4().to_array();
    }
    uniform
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn uniforms_are_laid_out_as_in_wgsl() {
        let path = "client/occlusion.wgsl";
        shaders::assert_layout!(FrustumUniform, path, "OcclusionFrustum", image_from_offset, centre, footprint, planes);
        shaders::assert_layout!(
            OcclusionUniform,
            path,
            "Occlusion",
            reach_m,
            tap_count,
            frustum_count,
            graph_stride,
            eye_anchor,
            has_occluders,
            frusta,
            taps
        );
    }

    #[test]
    fn taps_fill_the_upper_half_ball_evenly() {
        let places: Vec<DVec3> = (0..64).map(|index| tap_place(index, 64)).collect();
        assert!(places.iter().all(|place| place.z >= 0.0 && place.length() < 1.0));
        let mean = places.iter().sum::<DVec3>() / 64.0;
        // Evenly spread directions and radii have the mean (0, 0, 1/4).
        assert!(mean.distance(DVec3::Z / 4.0) < 0.05, "{mean}");
        for octant in 0..8 {
            let from_rad = TAU * f64::from(octant) / 8.0;
            let within =
                |place: &&DVec3| (place.y.atan2(place.x).rem_euclid(TAU) - from_rad).rem_euclid(TAU) < TAU / 8.0;
            assert!((6..=10).contains(&places.iter().filter(within).count()), "octant {octant}");
        }
    }
}
