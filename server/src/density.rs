//! How finely a scene is sampled: an image spends its pixels where something is.
//!
//! An image as wide as a view has fewer pixels a radian than the view, for it is wider. Of a scene that fills the view there is no more to have
//! at that price. But of a small object most of such an image shows nothing: the part around the object, with as many pixels, shows it more finely,
//! costs the same to draw, and its samples are few. Up to [`DENSEST`]: each step gains less and costs as much again (of a machine full of
//! ribs in a fast orbit FLIP is 0.113, 0.098 and 0.090 with 1, 1.5 and 2 samples a pixel, at 0.41, 0.61 and 0.87 Mbit/s).

use camera::{Bounds, ImageBounds, ImagePoint, Pinhole};
use glam::{DVec2, DVec3};
use protocol::message::ViewSize;
use protocol::staging::Parts;
use scene::{Deformed, Scene, Snapshot};

use crate::plan::{SIZE_STEP_PX, output_focal_px};

/// Samples a pixel of the output at most, along each axis.
pub const DENSEST: f64 = 2.0;
/// The same where something deforms: that is sent anew wherever it moves. Of a running figure in a fast orbit FLIP is 0.10 with 1 and 0.09 with
/// 1.5, for 3.2 and 5.3 Mbit/s for as long as it runs.
pub const DENSEST_DEFORMING: f64 = 1.0;
/// Pixels around what is seen, so that its outlines are outlines within the image.
const RIM_PX: f64 = 2.0;
/// Densities come in steps of this factor: an object that comes a little nearer is not sent anew.
const STEP: f64 = std::f64::consts::SQRT_2;

/// The part of a view in which `bounds` are seen, with no more pixels along either side than the view has; the view itself where no part of it
/// is enough, or where its eye is among what is bounded. `output` is what it is looked at for, with `densest`
/// samples a pixel at most, along each axis.
pub fn around(view: &Pinhole, bounds: &Bounds, output: ViewSize, densest: f64) -> Pinhole {
    let size_px = DVec2::new(view.width_px.into(), view.height_px.into());
    let corners: Option<Vec<ImagePoint>> =
        bounds.corners().map(|corner| view.image_from_world(corner)).into_iter().collect();
    let Some(seen) = corners.and_then(ImageBounds::around) else { return *view };
    let (min_px, max_px) = ((seen.min_px - RIM_PX).max(DVec2::ZERO), (seen.max_px + RIM_PX).min(size_px));
    if min_px.cmpge(max_px).any() {
        return *view;
    }
    let most = (size_px / (max_px - min_px)).min_element().min(densest * output_focal_px(output) / view.focal_px);
    let finer = STEP.powf((most.ln() / STEP.ln()).floor()).max(1.0);
    let whole = |side_px: f64, most_px: f64| ((side_px / SIZE_STEP_PX).ceil() * SIZE_STEP_PX).min(most_px) as u32;
    let part_px = finer * (max_px - min_px);
    Pinhole {
        width_px: whole(part_px.x, size_px.x),
        height_px: whole(part_px.y, size_px.y),
        focal_px: finer * view.focal_px,
        centre_px: finer * (view.centre_px - min_px),
        ..*view
    }
}

/// The box around the parts of a scene that a snapshot shows: around the boxes of meshes, and the vertices of what deforms; `None` of nothing.
pub fn extent(scene: &Scene, snapshot: &Snapshot, parts: &Parts) -> Option<Bounds> {
    let rigid = scene.instances.iter().zip(0..).filter(|(instance, id)| !instance.deforms && parts.shows(*id));
    let is_shown = |deformed: &&Deformed| u16::try_from(deformed.instance).is_ok_and(|id| parts.shows(id));
    let deformed = snapshot.deformed.iter().filter(is_shown).filter_map(|deformed| {
        let place = snapshot.world_from_mesh.get(deformed.instance as usize)?;
        let vertices = deformed.vertices.iter().map(|vertex| DVec3::from(vertex.position.map(f64::from)));
        Bounds::around(vertices.map(|vertex| place.transform_point3(vertex)))
    });
    rigid.filter_map(|(_, instance)| scene.bounds_of(snapshot, instance)).chain(deformed).reduce(Bounds::union)
}

#[cfg(test)]
mod tests {
    use camera::Rigid;

    use super::*;

    const OUTPUT: ViewSize = ViewSize { width_px: 640, height_px: 360, fov_y_rad: 1.0 };

    /// An image at the origin that looks along z, with 0.8 of the output's pixels a radian.
    fn view() -> Pinhole {
        let view = Pinhole::symmetric(Rigid::IDENTITY, (680, 384), 1.0, 0.1);
        Pinhole { focal_px: 0.8 * output_focal_px(OUTPUT), ..view }
    }

    fn cube(centre: DVec3, half_m: f64) -> Bounds {
        Bounds { min: centre - half_m, max: centre + half_m }
    }

    #[test]
    fn a_small_object_is_sampled_as_finely_as_is_of_use() {
        let bounds = cube(DVec3::new(0.4, -0.2, 8.0), 0.3);
        let part = around(&view(), &bounds, OUTPUT, DENSEST);
        let density = part.focal_px / output_focal_px(OUTPUT);
        assert!(density <= DENSEST && density > DENSEST / STEP, "{density}");
        assert!(part.width_px * part.height_px < 680 * 384 / 8, "{}x{}", part.width_px, part.height_px);
        for corner in bounds.corners() {
            assert!(part.contains(part.image_from_world(corner).expect("before the eye")));
        }
        // The same rays, but for their pixels.
        let at_centre = part.image_from_world(DVec3::new(0.4, -0.2, 8.0)).expect("before the eye");
        let ray = part.ray_eye_from_image(at_centre.u, at_centre.v);
        assert!((ray - DVec3::new(0.05, -0.025, 1.0)).length() < 1e-12);
    }

    #[test]
    fn what_fills_the_view_or_is_all_around_leaves_it_as_it_is() {
        assert_eq!(around(&view(), &cube(DVec3::ZERO, 5.0), OUTPUT, DENSEST), view(), "the eye is inside");
        assert_eq!(around(&view(), &cube(DVec3::new(0.0, 0.0, 8.0), 5.0), OUTPUT, DENSEST), view(), "fills it");
        assert_eq!(around(&view(), &cube(DVec3::new(90.0, 0.0, 8.0), 1.0), OUTPUT, DENSEST), view(), "beside it");
    }

    #[test]
    fn an_image_never_gets_larger() {
        for distance_m in [1.2, 1.5, 2.0, 3.0, 5.0, 9.0, 40.0] {
            let part = around(&view(), &cube(DVec3::new(0.1, 0.0, distance_m), 0.5), OUTPUT, DENSEST);
            assert!(part.width_px <= 680 && part.height_px <= 384, "{}x{}", part.width_px, part.height_px);
            assert!(part.focal_px >= view().focal_px);
        }
    }
}
