//! Which of a light's shadow maps a view has a use for.

use camera::{Bounds, Pinhole};
use glam::DVec3;
use protocol::{Light, Viewpoint, shadow_views};

/// The views of a light's maps, which show what `view` may see of what is held within `bounds`. Of several that have a point the first
/// counts. Each is `side_px` wide and high.
pub(super) fn views(light: &Light, bounds: Bounds, view: &Pinhole, side_px: u32) -> Vec<Pinhole> {
    let all = shadow_views(light, bounds, Viewpoint::of(view), side_px);
    let receivers = [bounds.corners().to_vec(), pyramid(view, bounds)];
    all.into_iter().filter(|map| !receivers.iter().any(|points| lie_beside(map, points))).collect()
}

/// The eye of a view and the corners of its image, as far away as the farthest of `bounds`.
fn pyramid(view: &Pinhole, bounds: Bounds) -> Vec<DVec3> {
    let eye_world = view.world_from_eye.translation;
    let far_m = bounds.corners().map(|corner| corner.distance(eye_world)).into_iter().fold(view.near_m, f64::max);
    let (width, height) = (f64::from(view.width_px), f64::from(view.height_px));
    let at = |(u, v): (f64, f64)| view.world_from_eye.transform_point(view.ray_eye_from_image(u, v) * far_m);
    let image = [(0.0, 0.0), (width, 0.0), (0.0, height), (width, height)].map(at);
    std::iter::once(eye_world).chain(image).collect()
}

/// Whether all points lie beyond one side of what a map shows, so that nothing between them is in it.
fn lie_beside(map: &Pinhole, points: &[DVec3]) -> bool {
    let map_from_world = map.world_from_eye.inverse();
    let tangent = f64::from(map.width_px) / 2.0 / map.focal_px;
    let points: Vec<DVec3> = points.iter().map(|point| map_from_world.transform_point(*point)).collect();
    let beyond = |side: &dyn Fn(&DVec3) -> f64| points.iter().all(|p| side(p) > tangent * p.z);
    beyond(&|p| p.x) || beyond(&|p| -p.x) || beyond(&|p| p.y) || beyond(&|p| -p.y)
}

#[cfg(test)]
mod tests {
    use camera::Rigid;

    use super::*;

    const SIDE_PX: u32 = 256;
    const BOUNDS: Bounds = Bounds { min: DVec3::new(-40.0, -1.0, -30.0), max: DVec3::new(40.0, 12.0, 30.0) };

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

    fn eye(place: DVec3, along: DVec3) -> Pinhole {
        Pinhole::symmetric(Rigid::look_along(place, along), (640, 480), 1.0, 0.05)
    }

    #[test]
    fn what_the_view_cannot_show_has_no_map() {
        let within = eye(DVec3::new(20.0, 5.0, -2.0), DVec3::X);
        let faces = views(&lamp([-1.0, -2.0]), BOUNDS, &within, SIDE_PX);
        assert!(faces.len() < 6, "the face away from what is seen");
        let beyond = Bounds { min: DVec3::new(-40.0, -30.0, -30.0), max: DVec3::new(40.0, -25.0, 30.0) };
        assert!(views(&lamp([0.99, 0.98]), beyond, &eye(DVec3::new(39.0, -26.0, 0.0), DVec3::X), SIDE_PX).is_empty());
    }
}
