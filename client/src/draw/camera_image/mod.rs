//! The image of a camera that was asked for by its name ([`Purpose::Camera`]): one continuous picture, whatever its rays do on their
//! way, shown as it is.
//!
//! It is lit as surfaces are, by the scene's own lights. A view's position follows from its pixel; here it comes with every sample, as
//! its ray may be bent or curved: it is unprojected once, in f64, when the image arrives.

mod pass;

pub(crate) use pass::{CameraImagePass, Showing};

use camera::{Camera, ImagePoint};
use glam::{DVec3, Vec4};
use gpu::Gpu;
use protocol::{DepthImage, Held, PatchId, Purpose, Update};
use surface::BuiltSurfaces;
use wgpu::{Extent3d, TextureFormat, TextureView, TextureViewDescriptor};

use crate::draw::planes;
use crate::receive::follow::Follow;

/// `centres` of `client/light_places.wgsl`: as many as a camera on the wire may have frusta.
const MAX_CENTRES: usize = protocol::wire::GRAPH_MAX_FRUSTA;

/// The newest image that is held of a camera.
#[derive(Debug)]
pub struct CameraImage {
    gpu: Gpu,
    image: Option<Image>,
}

/// An image on the GPU.
#[derive(Debug)]
struct Image {
    id: PatchId,
    size_px: (u32, u32),
    /// What places and lights are relative to.
    anchor_world: DVec3,
    /// Where rays come from, relative to the anchor.
    centres: Vec<Vec4>,
    /// As [`planes::of`], and places relative to the anchor with the number of a centre.
    views: [TextureView; 4],
}

impl CameraImage {
    /// Holds nothing yet.
    pub fn new(gpu: &Gpu) -> CameraImage {
        CameraImage { gpu: gpu.clone(), image: None }
    }

    /// Takes in what is held, on a device that has none of it yet.
    pub fn rebuild(&mut self, held: &Held) {
        self.image = None;
        self.take_in(held);
    }

    /// Whether there is one.
    pub fn is_there(&self) -> bool {
        self.image.is_some()
    }

    fn take_in(&mut self, held: &Held) {
        let newest = held.patches.values().rfind(|held| held.patch.purpose == Purpose::Camera);
        if self.image.as_ref().map(|image| image.id) != newest.map(|held| held.patch.id) {
            self.image = newest.and_then(|held| Image::new(&self.gpu, held.patch.id, &held.patch.image));
        }
    }
}

impl Follow for CameraImage {
    fn follow(&mut self, held: &Held, _: &Update, anew: bool, _: &mut BuiltSurfaces) {
        if anew { self.rebuild(held) } else { self.take_in(held) }
    }
}

impl Image {
    /// `None` of one that is larger than the GPU takes.
    fn new(gpu: &Gpu, id: PatchId, image: &DepthImage) -> Option<Image> {
        let (width, height) = image.mask.size_px();
        let centres_world = centres_world(&image.camera);
        if width.max(height) > gpu.device.limits().max_texture_dimension_2d || centres_world.len() > MAX_CENTRES {
            return None;
        }
        let anchor_world = image.camera.eye_world();
        let size = Extent3d { width, height, depth_or_array_layers: 1 };
        let places = places(image, anchor_world);
        let places = planes::texture(gpu, size, TextureFormat::Rgba32Float, bytemuck::cast_slice(&places));
        let [colour, normal_ids, w] = planes::of(gpu, image);
        let views = [colour, normal_ids, w, places].map(|plane| plane.create_view(&TextureViewDescriptor::default()));
        let relative = |centre: DVec3| (centre - anchor_world).as_vec3().extend(0.0);
        let centres = centres_world.into_iter().map(relative).collect();
        Some(Image { id, size_px: (width, height), anchor_world, centres, views })
    }
}

/// Where a camera's rays come from: those of a single-pole camera before they are pushed, those of a graph camera in each frustum.
fn centres_world(camera: &Camera) -> Vec<DVec3> {
    match camera {
        Camera::Pinhole(_) | Camera::Spoc(_) => vec![camera.eye_world()],
        Camera::Graph(camera) => camera.frusta().iter().map(|frustum| frustum.centre_world()).collect(),
    }
}

/// Row by row, where each sample is relative to the anchor, and the number of its centre; zero where there is none.
fn places(image: &DepthImage, anchor_world: DVec3) -> Vec<Vec4> {
    let (width, height) = image.mask.size_px();
    let mut places = vec![Vec4::ZERO; width as usize * height as usize];
    for (index, (x, y)) in image.mask.occupied().enumerate() {
        let w = image.depth_scale.w(image.depth[index]).into();
        let point = ImagePoint { u: f64::from(x) + 0.5, v: f64::from(y) + 0.5, w };
        let (centre, world) = match &image.camera {
            Camera::Graph(camera) => {
                let Some(frustum) = camera.frustum_at(point) else { continue };
                let Some(world) = camera.world_from_image(point, frustum) else { continue };
                (frustum.place(), world)
            }
            camera => (0, camera.world_from_image(point)),
        };
        places[y as usize * width as usize + x as usize] = (world - anchor_world).as_vec3().extend(centre as f32);
    }
    places
}
