//! The truth of reflections, refractions, shadows and ambient occlusion: rays through the scene's own triangles, on the CPU, in
//! f64.
//!
//! What clients draw from samples is measured against it, so it shares no code with them, nor with the crate of
//! impostors: the look is written anew from its words ([`protocol::Lighting`]), and where nothing reflects, tests hold
//! it equal to the plain truth that [`server::truth`] draws on a GPU. Space: pictures are taken by any [`Pinhole`],
//! pixel centres at +0.5; points are in world space, in metres.
//!
//! # What reflects
//!
//! - A material is a **mirror** where `metallic >= 0.9` and `roughness <= 0.1`. It shows its linear base colour times
//!   the light that arrives along the mirrored ray.
//! - Else it is **glass** where `transmission >= 0.5`. The ray is refracted at the front, goes through the body, and is
//!   refracted again where it leaves, by the material's `ior`; the base colour tints once. No light is reflected at the
//!   front (there is no Fresnel term). Inside, nothing but the body itself is there. Where all light is reflected
//!   inside, the ray is followed up to two times; after that it ends at the background. A ray that finds no way out of
//!   an open body goes on as it is.
//!
//! - Else it is **blended** where the material says so, or a **pane** where it is `thin` and transmits. With [`Effects::blending`] rays go on behind
//!   these: what is blended adds its colour by its alpha; a pane adds what it does not let pass, and tints the rest. Shown colours are mixed, in linear light. Without, what
//!   is blended is cut out, and panes are not there.
//!
//! *Light* is exposed light `c` before the transfer to the screen, `shown = sRGB(tone(c))`, which is made once, at
//! the end. A ray that leaves the scene brings the light that is shown as the lighting's background, and a surface
//! without lights the light that is shown as its base colour. The look itself has no shadows; with [`Effects::shadows`] a light arrives
//! where a ray to it meets nothing, from either side and whatever its material.
//!
//! Rays are mirrored and refracted about the interpolated normals, as in Popescu and others 2009 (*Non-pinhole
//! impostors*). Where such a normal sends a ray to the wrong side of the triangle, which happens at silhouettes, the
//! triangle's own normal is used: otherwise the ray would enter a mirror. Mirrored rays see what a camera sees:
//! single-sided triangles from their front only; normals of double-sided materials face the ray.
//!
//! A *bounce* is one reflection, or one passage through a body. After [`Effects::max_bounces`], a reflector shows its
//! base colour lit as that of any other surface. Without [`Effects::self_reflection`], a ray that leaves a reflector
//! passes through that reflector's object: clients that look reflections up in impostors of the surroundings do the
//! same.
//!
//! In the *full look* ([`RayTruth::under`]) materials are those of glTF, and what they send back is summed over directions; see `full`. Mirrors and glass
//! are what they are in the plain one. A metal (0.9 and more) whose roughness is above 0.1 and up to 0.5 is a *rough mirror* where reflections are
//! followed: what its lobe mirrors is the first surface along each of its directions, lit as one that does not reflect, or the sky.
//!
//! Textures are read between four texels of the full image; distant ones alias where the GPU's mip-maps do
//! not, which more samples a pixel mend.

mod effects;
mod errors;
mod full;
mod geometry;
mod light;
mod occlusion;
mod path;
mod srgb;
mod surface;
mod texture;
mod tone;

#[cfg(test)]
mod tests;

use camera::Pinhole;
use glam::{DVec2, DVec3};
use protocol::Lighting;
use rayon::prelude::*;
use scene::environment::Environment;
use scene::{Scene, Snapshot};

pub use effects::Effects;
pub use errors::masked_errors;

use crate::compare::Picture;
use geometry::Ray;
use light::Lights;
use path::{Arrived, follow};
use srgb::code_from_linear;
use surface::{Kind, Surface, Surfaces};

/// Where a camera's ray first met the scene.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfacePoint {
    /// In world space.
    pub p_world: DVec3,
    /// The interpolated unit normal; that of a double-sided material faces the camera.
    pub normal_world: DVec3,
    /// The triangle's own.
    pub facet_normal_world: DVec3,
}

/// What a camera sees; planes are row-major, one value a pixel. All but the colours are those of the ray through the
/// pixel's centre.
#[derive(Debug, Clone, PartialEq)]
pub struct TracedPicture {
    /// Width and height.
    pub size_px: (u32, u32),
    /// sRGB-encoded.
    pub rgb: Vec<[u8; 3]>,
    /// The object that is hit first; `None` where the ray leaves the scene.
    pub first_object: Vec<Option<u16>>,
    /// What the last mirrored or refracted ray hit; `None` where the first hit is no reflector or that ray leaves the
    /// scene.
    pub reflected_object: Vec<Option<u16>>,
    /// How often the ray was mirrored or passed through glass.
    pub bounces: Vec<u8>,
    /// How many blended surfaces it was seen through, see [`Effects::blending`].
    pub seen_through: Vec<u8>,
    /// The first hit.
    pub first: Vec<Option<SurfacePoint>>,
}

impl TracedPicture {
    /// Where the camera's ray hits one of `objects` first.
    pub fn mask(&self, objects: &[u16]) -> Vec<bool> {
        self.first_object.iter().map(|object| object.is_some_and(|object| objects.contains(&object))).collect()
    }

    /// The colours, and where there is a surface.
    pub fn picture(&self) -> Picture {
        let (width_px, height_px) = self.size_px;
        let covered = self.first_object.iter().map(Option::is_some).collect();
        Picture { width_px, height_px, rgb: self.rgb.as_flattened().to_vec(), covered: Some(covered) }
    }
}

/// A scene at a time, for rays.
pub struct RayTruth {
    surfaces: Surfaces,
    lights: Lights,
}

impl RayTruth {
    /// All triangles of a snapshot of `scene`, and what lights them. The sky of a full look does not.
    pub fn new(scene: &Scene, snapshot: &Snapshot, lighting: &Lighting) -> RayTruth {
        RayTruth { surfaces: Surfaces::new(scene, snapshot), lights: Lights::new(lighting, None) }
    }

    /// The same in the full look, under the environment that its sky was made of.
    pub fn under(scene: &Scene, snapshot: &Snapshot, lighting: &Lighting, environment: &Environment) -> RayTruth {
        RayTruth { surfaces: Surfaces::new(scene, snapshot), lights: Lights::new(lighting, Some(environment)) }
    }

    /// What a camera sees, with `samples_per_side` times as many rays for each pixel, in a grid, whose colours as shown
    /// are averaged in linear light. One ray goes through the pixel's centre. Nothing nearer than the camera's near
    /// plane is seen.
    pub fn picture(&self, camera: &Pinhole, effects: &Effects, samples_per_side: u32) -> TracedPicture {
        let size_px = (camera.width_px, camera.height_px);
        let pixels: Vec<(Arrived, [u8; 3])> = (0..size_px.0 * size_px.1)
            .into_par_iter()
            .map(|pixel| {
                let corner_px = DVec2::new((pixel % size_px.0).into(), (pixel / size_px.0).into());
                self.pixel(camera, effects, corner_px, samples_per_side.max(1))
            })
            .collect();
        let point = |surface: Surface| SurfacePoint {
            p_world: self.surfaces.geometry.anchor_world + surface.p,
            normal_world: surface.shading,
            facet_normal_world: surface.geometric,
        };
        TracedPicture {
            size_px,
            rgb: pixels.iter().map(|(_, rgb)| *rgb).collect(),
            first_object: pixels.iter().map(|(arrived, _)| arrived.first.map(|surface| surface.object)).collect(),
            reflected_object: pixels.iter().map(|(arrived, _)| arrived.reflected_object).collect(),
            bounces: pixels.iter().map(|(arrived, _)| arrived.bounces).collect(),
            seen_through: pixels.iter().map(|(arrived, _)| arrived.seen_through).collect(),
            first: pixels.iter().map(|(arrived, _)| arrived.first.map(point)).collect(),
        }
    }

    fn pixel(&self, camera: &Pinhole, effects: &Effects, corner_px: DVec2, side: u32) -> (Arrived, [u8; 3]) {
        let at = |offset: DVec2| self.along(camera, effects, corner_px + offset);
        let centre = at(DVec2::splat(0.5));
        if side == 1 {
            return (centre, code_from_linear(self.lights.shown(centre.light)));
        }
        let offset = |index: u32| (DVec2::new((index % side).into(), (index / side).into()) + 0.5) / f64::from(side);
        let sum: DVec3 = (0..side * side).map(|index| self.lights.shown(at(offset(index)).light)).sum();
        (centre, code_from_linear(sum / f64::from(side * side)))
    }

    /// What arrives at an image point, in pixels.
    fn along(&self, camera: &Pinhole, effects: &Effects, place_px: DVec2) -> Arrived {
        // In eye space the ray has z = 1, so that distances along it are depths.
        let direction = camera.world_from_eye.transform_vector(camera.ray_eye_from_image(place_px.x, place_px.y));
        let origin = camera.world_from_eye.translation - self.surfaces.geometry.anchor_world;
        follow(&self.surfaces, &self.lights, effects, Ray { origin, direction }, camera.near_m)
    }

    /// Of each pixel of a camera, which of `points_world` the first hit at its centre does not see: bits, 64 a word, in order; `None` where
    /// the ray leaves the scene. A point behind the surface, by its interpolated normal, is not seen. Everything hides, from both
    /// sides; what lies in a point itself does not.
    pub fn hidden_points(&self, camera: &Pinhole, points_world: &[DVec3]) -> Vec<Option<Vec<u64>>> {
        let hidden = |pixel: u32| {
            let place_px = DVec2::new((pixel % camera.width_px).into(), (pixel / camera.width_px).into()) + 0.5;
            let first = self.along(camera, &Effects::PLAIN, place_px).first?;
            let mut words = vec![0u64; points_world.len().div_ceil(64)];
            for (index, point) in points_world.iter().enumerate() {
                let direction = *point - self.surfaces.geometry.anchor_world - first.p;
                if first.shading.dot(direction) <= 0.0 || !self.surfaces.reaches(&first, direction) {
                    words[index / 64] |= 1 << (index % 64);
                }
            }
            Some(words)
        };
        (0..camera.width_px * camera.height_px).into_par_iter().map(hidden).collect()
    }

    /// How far one comes from a point along a unit direction before something, seen from either side, is in the way; at most `reach_m`.
    pub fn free_m(&self, from_world: DVec3, along_world: DVec3, reach_m: f64) -> f64 {
        let ray = Ray { origin: from_world - self.surfaces.geometry.anchor_world, direction: along_world };
        self.surfaces.free_m(&ray, reach_m)
    }

    /// Ambient occlusion: the share of the directions around `normal_world`, weighted by their cosine, along which
    /// nothing lies within `reach_m`, by `rays` rays that are the same at every call. Everything hides, from both
    /// sides. Rays begin a thousandth of the reach above the surface.
    pub fn occlusion(&self, p_world: DVec3, normal_world: DVec3, reach_m: f64, rays: u32) -> f64 {
        let p = p_world - self.surfaces.geometry.anchor_world;
        occlusion::free_share(&self.surfaces, p, normal_world, reach_m, rays)
    }

    /// [`RayTruth::occlusion`] at the first hits of a picture; 1 where there is none.
    pub fn occlusions(&self, picture: &TracedPicture, reach_m: f64, rays: u32) -> Vec<f64> {
        let at = |point: &SurfacePoint| self.occlusion(point.p_world, point.normal_world, reach_m, rays);
        picture.first.par_iter().map(|point| point.as_ref().map_or(1.0, at)).collect()
    }
}

/// The objects of a scene that are mirrors or glass, by [the definitions](self).
pub fn reflectors(scene: &Scene) -> Vec<u16> {
    let reflects = |instance: &scene::Instance| {
        let material = scene.meshes[instance.mesh as usize].material;
        surface::kind(&scene.materials[material as usize]) != Kind::Plain
    };
    let objects = scene.instances.iter().enumerate().filter(|(_, instance)| reflects(instance));
    objects.map(|(object, _)| object as u16).collect()
}
