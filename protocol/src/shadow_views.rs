//! Where a light's shadow maps are seen from: plain maths that both ends need, in f64. Clients draw maps from there, and servers look
//! from there for what casts.
//!
//! - A **directional light** stands at the distance `D = N R / 2` before a ball of the radius `R` that `N` texels span, `2 R /
//!   N` each. A ray through a point at the distance `r` from the axis leans by `r / D`, which over the way `h` from caster to
//!   receiver moves a shadow by `h r / D`. Within the ball `h r <= R²`, so by up to a texel; what comes from further away errs
//!   by more texels, but up to one of the widest map. The widest ball holds all; up to two narrower ones, each a
//!   quarter as wide, lie around the point of that which is nearest to the viewer, so that large scenes are finely shadowed
//!   near by. Balls move in steps of whole texels, so shadows do not crawl, and seldom.
//! - A **spot** is one map, a **point light**, or a spot wider than 120 degrees, the faces of a cube.

use camera::{Bounds, Pinhole, Rigid};
use glam::{DVec2, DVec3};

use crate::look::Light;

/// Frames of a directional light: of all that is held, and two around the viewer.
const FRAMES: usize = 3;
/// How many times narrower each is than the one before.
const NARROWER: f64 = 4.0;
/// A frame moves in steps of one in so many parts of its side: the widest so finely that little of it is lost, the others so
/// coarsely that they seldom move.
const WIDEST_STEPS: f64 = 64.0;
const NARROW_STEPS: f64 = 8.0;
/// Frames grow by this factor at least: the fourth root of two.
const GROWTH: f64 = 1.189_207_115_002_721;

/// The widest half angle of a spot that one map holds, 60 degrees; a wider one is seen like a point light.
const WIDEST_SPOT_COS: f64 = 0.5;
/// How near to a light of a place casters are seen, as a share of the distance of the farthest. WebGL2's clip space keeps 24 bits of the
/// depth, so at the far end depths are told apart that differ by 2^-12 of the distance: less than what a texel spans.
const NEAREST: f64 = 1.0 / 4096.0;

/// Where a viewer is, and how fine its pixels are.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Viewpoint {
    /// Its eye.
    pub eye_world: DVec3,
    /// Of its output.
    pub focal_px: f64,
}

impl Viewpoint {
    /// That of an output.
    pub fn of(view: &Pinhole) -> Viewpoint {
        Viewpoint { eye_world: view.world_from_eye.translation, focal_px: view.focal_px }
    }
}

/// The views of a light's shadow maps of what lies within `bounds`. Of several that have a point the first counts. Each is `side_px` wide and
/// high.
pub fn shadow_views(light: &Light, bounds: Bounds, viewer: Viewpoint, side_px: u32) -> Vec<Pinhole> {
    match light {
        Light::Directional { direction_world, .. } => from_afar(axis(*direction_world), bounds, viewer, side_px),
        Light::Point { position_world, direction_world, spot_cos, .. } => {
            from_place((*position_world).into(), axis(*direction_world), spot_cos[1].into(), bounds, side_px)
        }
    }
}

fn axis(direction: [f32; 3]) -> DVec3 {
    DVec3::from(direction.map(f64::from)).normalize_or(DVec3::NEG_Y)
}

/// Frames of a directional light, the narrowest first. The widest holds all of `bounds`; the narrower ones lie around the point of it that is
/// nearest to the viewer, as long as a texel of the last is wider than what a pixel spans there.
fn from_afar(along: DVec3, bounds: Bounds, viewer: Viewpoint, side_px: u32) -> Vec<Pinhole> {
    let half_m = bounds.min.distance(bounds.max) / 2.0;
    if half_m <= 0.0 || !half_m.is_finite() {
        return Vec::new();
    }
    // The frame's middle is at most half a step beside that of the bounds along each axis.
    let radius_m = GROWTH.powf((half_m / (1.0 - 3_f64.sqrt() / WIDEST_STEPS)).log(GROWTH).ceil());
    let mut frames = vec![frame(along, (bounds.middle(), radius_m), WIDEST_STEPS, bounds, side_px)];
    let nearest_world = viewer.eye_world.clamp(bounds.min, bounds.max);
    let pixel_m = viewer.eye_world.distance(nearest_world) / viewer.focal_px;
    for index in 1..FRAMES {
        let radius_m = radius_m / NARROWER.powi(index as i32);
        if texel_m(radius_m * NARROWER, side_px) <= pixel_m {
            break;
        }
        frames.push(frame(along, (nearest_world, radius_m), NARROW_STEPS, bounds, side_px));
    }
    frames.reverse();
    frames
}

/// What a texel spans in the middle of a frame, with one beside the ball on each side.
fn texel_m(radius_m: f64, side_px: u32) -> f64 {
    radius_m / (f64::from(side_px) / 2.0 - 1.0)
}

/// A pinhole far before a ball, see the module for how far. It moves by whole texels.
fn frame(along: DVec3, (middle_world, radius_m): (DVec3, f64), steps: f64, bounds: Bounds, side_px: u32) -> Pinhole {
    let rotation = Rigid::look_along(DVec3::ZERO, along).rotation;
    let step_m = texel_m(radius_m, side_px) * (f64::from(side_px) / steps).round();
    let middle_light = ((rotation.conjugate() * middle_world) / step_m).round() * step_m;
    let middle_world = rotation * middle_light;
    let reach_m = bounds.corners().map(|corner| corner.distance(middle_world)).into_iter().fold(radius_m, f64::max);
    let distance_m = (f64::from(side_px) / 2.0 * radius_m).max(2.0 * reach_m);
    Pinhole {
        world_from_eye: Rigid { rotation, translation: middle_world - along * distance_m },
        width_px: side_px,
        height_px: side_px,
        focal_px: distance_m / texel_m(radius_m, side_px),
        centre_px: DVec2::splat(f64::from(side_px) / 2.0),
        near_m: distance_m / 2.0,
    }
}

/// One view along a spot's axis, or those of the six faces of a cube that it shines into; `outer_cos` is that of its outer half angle.
fn from_place(place_world: DVec3, along: DVec3, outer_cos: f64, bounds: Bounds, side_px: u32) -> Vec<Pinhole> {
    let farthest_m = bounds.corners().map(|corner| corner.distance(place_world)).into_iter().fold(0.0, f64::max);
    if farthest_m <= 0.0 || !farthest_m.is_finite() {
        return Vec::new();
    }
    let half_px = f64::from(side_px) / 2.0;
    let view = |along: DVec3, half_tan: f64| Pinhole {
        world_from_eye: Rigid::look_along(place_world, along),
        width_px: side_px,
        height_px: side_px,
        focal_px: (half_px - 1.0) / half_tan,
        centre_px: DVec2::splat(half_px),
        near_m: NEAREST * farthest_m,
    };
    if outer_cos >= WIDEST_SPOT_COS {
        // Not narrower than a texel of a face.
        let half_tan = (1.0 - outer_cos * outer_cos).max(0.0).sqrt() / outer_cos;
        return vec![view(along, half_tan.max(1.0 / half_px))];
    }
    // A face's corners are 1/sqrt(3) from its axis, as a cosine.
    let within_rad = outer_cos.max(-1.0).acos() + (1.0 / 3_f64.sqrt()).acos();
    let faces = [DVec3::X, DVec3::NEG_X, DVec3::Y, DVec3::NEG_Y, DVec3::Z, DVec3::NEG_Z];
    faces.into_iter().filter(|face| face.angle_between(along) < within_rad).map(|face| view(face, 1.0)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIDE_PX: u32 = 256;
    const BOUNDS: Bounds = Bounds { min: DVec3::new(-40.0, -1.0, -30.0), max: DVec3::new(40.0, 12.0, 30.0) };

    fn sun() -> Light {
        Light::Directional { direction_world: [0.48, -0.8, 0.36], irradiance: [1.0; 3] }
    }

    fn lamp(spot_cos: [f32; 2]) -> Light {
        Light::Point {
            position_world: [3.0, 5.0, -2.0],
            intensity: [1.0; 3],
            direction_world: [0.0, -1.0, 0.0],
            spot_cos,
            range_m: f32::INFINITY,
            area: None,
        }
    }

    fn eye(place: DVec3) -> Viewpoint {
        Viewpoint { eye_world: place, focal_px: 240.0 / 0.5_f64.tan() }
    }

    /// In texels, of a map that has it.
    fn texel(map: &Pinhole, p_world: DVec3) -> Option<DVec2> {
        let image = map.image_from_world(p_world)?;
        map.contains(image).then_some(DVec2::new(image.u, image.v))
    }

    #[test]
    fn rays_of_a_directional_light_are_parallel_to_a_texel() {
        let Light::Directional { direction_world, .. } = sun() else { unreachable!() };
        let along = axis(direction_world);
        let frames = shadow_views(&sun(), BOUNDS, eye(DVec3::new(3.0, 1.7, 4.0)), SIDE_PX);
        assert_eq!(frames.len(), FRAMES);
        let widest = frames.last().expect("three");
        assert!(BOUNDS.corners().iter().all(|corner| texel(widest, *corner).is_some()), "the widest holds all");
        for frame in &frames {
            let centre = frame.world_from_eye.transform_point(DVec3::Z * frame.near_m * 2.0);
            let radius_m = f64::from(SIDE_PX / 2 - 1) * 2.0 * frame.near_m / frame.focal_px;
            let right = frame.world_from_eye.transform_vector(DVec3::X);
            for share in [0.0, 0.3, 0.7, 0.95] {
                // Both ends of a chord of the ball along the light.
                let (aside, half) = (share * radius_m, (1.0 - share * share).sqrt() * radius_m);
                let ends = [-half, half].map(|way| texel(frame, centre + right * aside + along * way).expect("inside"));
                let apart = ends[0].distance(ends[1]);
                assert!(apart <= 1.0 + 1e-6, "{apart} texels");
            }
        }
    }

    #[test]
    fn frames_stay_while_the_eye_moves_a_little_and_go_on_by_whole_texels() {
        let at = |x: f64| shadow_views(&sun(), BOUNDS, eye(DVec3::new(x, 1.7, 4.0)), SIDE_PX);
        let texels = |map: &Pinhole| texel(map, DVec3::new(3.0, 1.7, 4.0)).map(|texel| texel.fract_gl());
        let first = at(3.0);
        let mut moves = 0;
        for step in 1..100 {
            let (before, after) = (at(3.0 + 0.01 * f64::from(step - 1)), at(3.0 + 0.01 * f64::from(step)));
            assert_eq!(before.len(), after.len());
            moves += before.iter().zip(&after).filter(|(before, after)| before != after).count();
            for (first, after) in first.iter().zip(&after) {
                let (Some(a), Some(b)) = (texels(first), texels(after)) else { continue };
                // The parts of a texel are the same up to what rays lean; 0.99 and 0 are the same.
                let apart = (a - b + 0.5).fract_gl() - 0.5;
                assert!(apart.abs().max_element() < 0.05, "{a} {b}");
            }
        }
        assert!((1..10).contains(&moves), "{moves} moves of three frames in one metre");
    }

    #[test]
    fn every_direction_from_a_lamp_has_a_face_and_a_spot_needs_one() {
        let everywhere = Bounds { min: DVec3::splat(-50.0), max: DVec3::splat(50.0) };
        let place = DVec3::new(3.0, 5.0, -2.0);
        let far = eye(DVec3::new(0.0, 0.0, 200.0));
        let faces = shadow_views(&lamp([-1.0, -2.0]), everywhere, far, SIDE_PX);
        assert_eq!(faces.len(), 6);
        for index in 0..1000 {
            let (z, turn) = (f64::from(index) / 499.5 - 1.0, f64::from(index) * 2.399_963);
            let aside = (1.0 - z * z).sqrt();
            let p = place + DVec3::new(aside * turn.cos(), aside * turn.sin(), z);
            let has = |face: &Pinhole| {
                texel(face, p).is_some_and(|at| at.min_element() >= 0.5 && at.max_element() <= f64::from(SIDE_PX) - 0.5)
            };
            assert!(faces.iter().any(has), "{p}");
        }
        assert_eq!(shadow_views(&lamp([0.9, 0.6]), everywhere, far, SIDE_PX).len(), 1);
        // A wide spot downwards has no face upwards.
        assert_eq!(shadow_views(&lamp([0.5, 0.3]), everywhere, far, SIDE_PX).len(), 5);
    }
}
