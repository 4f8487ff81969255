//! Images that cost next to nothing: what followers are sent is measured here, not what makes it.

use std::sync::Arc;

use camera::{Camera, Pinhole};
use glam::{DAffine3, DVec3};
use protocol::{Lighting, Material, Purpose};
use scene::model::Animation;
use scene::{Bounds, Instance, Scene, Snapshot};
use server::account::Account;
use server::discretize::{Capture, Discretization};
use server::imager::{Imager, ImagerError};
use surface::{AddressTexel, AddressView, HeldSurfaces};

/// Nothing is where it was, so that each tick samples anew.
struct Still;

impl Animation for Still {
    fn at(&self, scene: &Scene, time_s: f64) -> Snapshot {
        let world_from_mesh = vec![DAffine3::IDENTITY; scene.instances.len()];
        Snapshot { time_s, world_from_mesh, deformed: Vec::new(), lights: Vec::new() }
    }
}

/// A room of 20 m with a wall wherever one looks.
pub(super) fn room() -> Scene {
    Scene {
        name: "wall".to_owned(),
        meshes: Vec::new(),
        materials: vec![scene::Material::default()],
        textures: Vec::new(),
        instances: vec![Instance { mesh: 0, name: "wall".to_owned(), moves: true, deforms: false, tint: [255; 3] }],
        cameras: Vec::new(),
        bounds: Bounds { min: DVec3::splat(-10.0), max: DVec3::splat(10.0) },
        walk: true,
        start: None,
        corridors: None,
        named_cameras: Vec::new(),
        offer: scene::load::Offer::default(),
        lights_move: false,
        warnings: Vec::new(),
        animation: Arc::new(Still),
    }
}

/// See the module.
pub(super) struct Wall;

impl Imager for Wall {
    fn adapter(&self) -> String {
        "none".to_owned()
    }

    fn materials(&self) -> Vec<Material> {
        vec![Material::default()]
    }

    fn lighting(&self, _: &Snapshot) -> Lighting {
        Lighting { ambient: [1.0; 3], lights: Vec::new(), background: [0; 3], burley: false, ..Lighting::default() }
    }

    fn captures(&mut self, _: &Snapshot, views: &[Pinhole], _: Discretization) -> Result<Vec<Capture>, ImagerError> {
        Ok(views.iter().map(capture).collect())
    }

    fn new_surfaces(&self) -> Option<HeldSurfaces> {
        None
    }

    /// A copy shows a view where a patch was taken from that very one, else nothing.
    fn copy_view(&mut self, account: &Account, _: Purpose, view: &Pinhole) -> Result<AddressView, ImagerError> {
        let size_px = (view.width_px, view.height_px);
        let held = account.held().patches.values().find(|held| held.patch.image.camera == Camera::Pinhole(*view));
        let Some(held) = held else { return Ok(AddressView::empty(size_px)) };
        let image = &held.patch.image;
        let texel = |((x, y), index): ((u32, u32), usize)| AddressTexel {
            patch: held.patch.id.0,
            pixel: x | y << 16,
            normal_object: u32::from(u16::from_le_bytes(image.normal[index])) | u32::from(image.object[index]) << 16,
            w_bits: image.depth_scale.w(image.depth[index]).to_bits(),
        };
        Ok(AddressView { size_px, texels: image.mask.occupied().zip(0..).map(texel).collect() })
    }
}

/// A wall whose inverse depths and colours are noise that the place decides, so that updates have the size of real ones.
fn capture(view: &Pinhole) -> Capture {
    let count = view.width_px as usize * view.height_px as usize;
    let mut state = view.world_from_eye.translation.to_array().map(f64::to_bits).iter().fold(1, |a, b| a ^ b) | 1;
    let codes: Vec<u16> = (0..count)
        .map(|_| {
            // Marsaglia's xorshift of 64 bits, 2003.
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            state as u16
        })
        .collect();
    let normal = u32::from(u16::from_le_bytes([127, 127])) << 16;
    Capture {
        camera: *view,
        ids: (1..=count as u32).map(|triangle| [triangle, normal]).collect(),
        colour: codes.iter().map(|code| [*code as u8, (*code >> 8) as u8, 7, 0]).collect(),
        rests: vec![[0; 2]; count],
        hides: Vec::new(),
        depth: codes.iter().map(|&code| (0.1 + f32::from(code) * 1e-5) * view.near_m as f32).collect(),
        ends: Vec::new(),
        gpu_s: None,
    }
}
