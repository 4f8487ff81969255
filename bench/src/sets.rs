//! Sets of depth images as the server makes them for a viewer, and their bytes.

use std::time::Instant;

use camera::{Pinhole, Rigid};
use protocol::DepthImage;
use protocol::codec::{Coding, encode_patch};
use protocol::held::{Patch, PatchId, Purpose};
use protocol::message::ViewSize;
use scene::Scene;
use server::discretize::{Capture, DepthPrecision, Discretization, Discretizer, EndsPass};
use server::plan::Rules;
use server::viewer::Viewer;

use crate::stage::Stage;

/// Which set to make.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SetPlan {
    /// How.
    pub discretization: Discretization,
    /// How many images.
    pub images: usize,
    /// Width and height of each.
    pub image_px: u32,
}

/// A set, with what it took.
pub struct ImageSet {
    /// In order.
    pub images: Vec<DepthImage>,
    /// Inverse depths of their samples before they were quantized.
    pub exact_w: Vec<Vec<f32>>,
    /// Wall time of all images with their readback, in ms.
    pub images_ms: f64,
}

/// Radius of the region that a set is made for around a standing viewer: 0.25 m to walk in, 5 % of the bounding radius
/// around objects.
pub fn region_radius_m(scene: &Scene) -> f64 {
    Rules::margin_m(scene.walk, scene.bounds.radius_m())
}

/// The server's rules for viewers of a scene, ten updates a second.
pub fn rules(scene: &Scene, plan: &SetPlan) -> Rules {
    Rules {
        images: plan.images,
        image_size_px: plan.image_px,
        update_interval_s: 0.1,
        near_m: server::start::near_m(scene),
        margin_m: region_radius_m(scene),
        animated: scene.is_animated(),
        rests: false,
        anticipates: false,
        parallax_error_px: server::plan::PARALLAX_ERROR_PX,
    }
}

/// The cameras and the precision that the server plans for a viewer who stands in the region's middle.
pub fn planned(scene: &Scene, middle: Rigid, output: &Pinhole, plan: &SetPlan) -> (Vec<Pinhole>, DepthPrecision) {
    let rules = Rules { near_m: output.near_m, ..rules(scene, plan) };
    let view = ViewSize { width_px: output.width_px, height_px: output.height_px, fov_y_rad: output.fov_y_rad() };
    let planned = server::plan::plan(&rules, &Viewer::at_start(view, middle, 0.0), 0.0, None);
    let planned = planned.expect("a viewer who holds nothing gets a set");
    (planned.views, planned.precision)
}

/// The same views one pixel larger, with pixel centres on the corners of the views' pixels.
pub fn offset_views(views: &[Pinhole]) -> Vec<Pinhole> {
    let offset = |view: &Pinhole| Pinhole {
        width_px: view.width_px + 1,
        height_px: view.height_px + 1,
        centre_px: view.centre_px + 0.5,
        ..*view
    };
    views.iter().map(offset).collect()
}

/// Makes the images of `views`.
pub fn make(
    stage: &Stage,
    discretizer: &mut Discretizer,
    views: &[Pinhole],
    discretization: Discretization,
    precision: DepthPrecision,
) -> anyhow::Result<ImageSet> {
    let started = Instant::now();
    let mut captures = discretizer.run(&stage.renderer, views, discretization)?.wait()?;
    let mut ends = EndsPass::new(&stage.renderer)?;
    for capture in &mut captures {
        let mask = capture.mask();
        ends.tell(&stage.renderer, capture, &mask)?;
    }
    let images_ms = started.elapsed().as_secs_f64() * 1000.0;
    let exact_w = |capture: &Capture| {
        let occupied = (0..capture.ids.len()).filter(|&index| capture.ids[index][0] != 0);
        occupied.map(|index| capture.w(index)).collect()
    };
    Ok(ImageSet {
        exact_w: captures.iter().map(exact_w).collect(),
        images: captures.iter().map(|capture| capture.depth_image(precision)).collect(),
        images_ms,
    })
}

/// Images as patches of a set.
pub fn patches(images: &[DepthImage]) -> impl Iterator<Item = Patch> {
    let patch = |(image, id): (&DepthImage, u32)| Patch {
        id: PatchId(id),
        purpose: Purpose::Eye,
        capture_time_s: 0.0,
        objects: Vec::new(),
        image: image.clone(),
    };
    images.iter().zip(1..).map(patch)
}

/// The bytes of images on the wire, each as a patch; colours must be settled by `coding`.
pub fn encoded(images: &[DepthImage], coding: Coding) -> Vec<Vec<u8>> {
    patches(images).map(|patch| encode_patch(&patch, coding)).collect()
}

/// The samples at wire width, plane after plane; planes of one value are left out. Its length is [`DepthImage::raw_bytes`].
pub fn raw_planes(image: &DepthImage) -> Vec<u8> {
    fn push<T: PartialEq>(bytes: &mut Vec<u8>, values: &[T], put: impl Fn(&mut Vec<u8>, &T)) {
        if values.iter().any(|value| *value != values[0]) {
            values.iter().for_each(|value| put(bytes, value));
        }
    }
    let mut bytes = Vec::with_capacity(image.raw_bytes());
    push(&mut bytes, &image.depth, |bytes, code| bytes.extend(code.to_le_bytes()));
    push(&mut bytes, &image.normal, |bytes, code| bytes.extend(code));
    push(&mut bytes, &image.ends, |bytes, ends| bytes.extend(ends.to_le_bytes()));
    push(&mut bytes, &image.colour, |bytes, colour| bytes.extend(colour));
    push(&mut bytes, &image.object, |bytes, object| bytes.extend(object.to_le_bytes()));
    push(&mut bytes, &image.material, |bytes, material| bytes.push(*material));
    bytes
}

#[cfg(test)]
mod tests {
    use camera::Camera;
    use protocol::{DepthScale, Mask};

    use super::*;

    #[test]
    fn raw_planes_leave_out_what_is_constant() {
        let mut mask = Mask::empty(2, 1);
        mask.set(0, 0, true);
        mask.set(1, 0, true);
        let image = DepthImage {
            camera: Camera::Pinhole(Pinhole::symmetric(Rigid::IDENTITY, (2, 1), 1.0, 0.1)),
            depth_scale: DepthScale { w_min: 0.0, w_step: 1.0 },
            mask,
            depth: vec![1, 515],
            normal: vec![[5, 6]; 2],
            normal_rest: Vec::new(),
            colour_rest: Vec::new(),
            share: Vec::new(),
            ends: Vec::new(),
            colour: vec![[1, 2, 3], [4, 5, 6]],
            object: vec![3; 2],
            material: vec![0; 2],
        };
        assert_eq!(raw_planes(&image), [1, 0, 3, 2, 1, 2, 3, 4, 5, 6]);
        assert_eq!(image.raw_bytes(), 10);
    }

    #[test]
    fn offset_pixels_have_their_centres_on_corners() {
        let view = Pinhole::symmetric(Rigid::IDENTITY, (8, 8), 1.0, 0.1);
        let offset = offset_views(&[view])[0];
        let corner_ray = view.ray_eye_from_image(3.0, 5.0);
        assert_eq!(offset.ray_eye_from_image(3.5, 5.5), corner_ray);
        assert_eq!((offset.width_px, offset.height_px), (9, 9));
    }
}
