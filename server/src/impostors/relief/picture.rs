//! Pictures of one object, and how they are taken.

use camera::{Camera, Spoc};
use glam::{DAffine3, DVec3};
use impostor::{Impostor, Sample};
use protocol::DepthImage;
use protocol::image::octahedral_normal;
use scene::{Scene, Snapshot};

use crate::imager::{Imager, ImagerError};
use crate::impostors::{Drawn, Faces, Shot};

/// The sides of images, in pixels: powers of two between these.
pub(super) const SIDE_PX: [u32; 2] = [32, 256];
/// Images are taken from this many radii away.
pub(super) const DISTANCE_RADII: f64 = 3.0;
/// From how far beside they see, see [`Spoc::around`]. Straight sides, as of a barrel, lie a quarter of a right angle to its rays then, and the image still has
/// four tenths of its width for what faces it.
pub(super) const RING_RADII: f64 = 2.0;
/// The sine of the least angle between a camera ray and a surface that is kept: ten degrees, where a sample's footprint is six times as
/// long as wide.
pub(super) const LEAST_FACING: f64 = 0.17;

/// Looks at an object from where its axis points.
pub(super) fn camera(
    scene: &Scene,
    snapshot: &Snapshot,
    object: u16,
    axis_mesh: DVec3,
    side_px: u32,
) -> Option<Camera> {
    let bounds = scene.bounds_of(snapshot, object)?;
    let radius_m = bounds.min.distance(bounds.max) / 2.0;
    let axis_world = (snapshot.world_from_mesh[usize::from(object)].matrix3 * axis_mesh).normalize_or_zero();
    let eye_world = bounds.middle() + axis_world * DISTANCE_RADII * radius_m;
    Spoc::around(&bounds, eye_world, (side_px, side_px), RING_RADII * radius_m).map(Camera::Spoc)
}

/// What a camera sees of one object, untinted.
pub(super) fn picture(
    imager: &mut dyn Imager,
    snapshot: &Snapshot,
    object: u16,
    camera: &Camera,
) -> Result<Option<DepthImage>, ImagerError> {
    imager.impostor(snapshot, &Shot { camera, drawn: &Drawn::Only(object), faces: Faces::Front, is_tinted: false })
}

/// A picture without what its camera's rays graze: there one sample would stand for a long piece of surface, before and behind itself.
pub(super) fn relief(
    imager: &mut dyn Imager,
    snapshot: &Snapshot,
    object: u16,
    camera: &Camera,
) -> Result<Option<DepthImage>, ImagerError> {
    let Some(mut image) = picture(imager, snapshot, object, camera)? else { return Ok(None) };
    let Some(impostor) = impostor(&image) else { return Ok(None) };
    let facing: Vec<f64> = impostor.sample_shapes().map(|shape| shape.facing).collect();
    let (width_px, _) = image.mask.size_px();
    let at = |(x, y): (u32, u32)| facing[(y * width_px + x) as usize];
    let keep: Vec<bool> = image.mask.occupied().map(|pixel| at(pixel) >= LEAST_FACING).collect();
    image.retain(&keep);
    Ok(Some(image))
}

/// A depth image as rays meet it; `None` of an empty one.
pub(in crate::impostors) fn impostor(image: &DepthImage) -> Option<Impostor> {
    let (width_px, height_px) = image.mask.size_px();
    let mut samples = vec![Sample::EMPTY; width_px as usize * height_px as usize];
    for (index, (x, y)) in image.mask.occupied().enumerate() {
        let normal_world = octahedral_normal(image.normal[index]).as_dvec3();
        let w = image.depth_scale.w(image.depth[index]).into();
        samples[(y * width_px + x) as usize] = Sample { w, normal_world };
    }
    Impostor::new(image.camera.clone(), &samples).ok()
}

/// A direction of the world in an object's space, unit length.
pub(super) fn turned_back(world_from_object: &DAffine3, direction_world: DVec3) -> DVec3 {
    (world_from_object.matrix3.inverse() * direction_world).normalize_or_zero()
}
