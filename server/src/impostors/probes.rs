//! Rays that leave a reflector, what they meet in the scene, and what they would meet in images.
//!
//! Where a viewer looks at a reflector, small pictures of the scene are taken from points of its surface, each along the ray that the
//! surface sends on there. Every pixel of them is a ray with a known answer.

use std::collections::BTreeMap;
use std::sync::Arc;

use camera::{Camera, ImagePoint, Pinhole, Rigid, Spoc};
use glam::{DVec3, Vec3};
use impostor::{Hit, Impostor, Method, Ray, Side, Steps};
use protocol::codec::{Coding, encode_patch};
use protocol::held::{Patch, PatchId};
use protocol::{DepthImage, Purpose};
use rayon::prelude::*;

use super::group::Shows;
use super::reflector::Reflector;
use super::relief::picture::impostor;
use super::wanted::{Drawn, Shot, Wanted};
use crate::render::Faces;

/// Draws what a reflector needs; `None` where nothing can be drawn.
pub(super) type Draw<'a, E> = dyn FnMut(&Shot<'_>) -> Result<Option<DepthImage>, E> + 'a;

/// Points of the reflector that pictures are taken from, and the side and the field of view of each: many narrow ones, as rays of neighbouring pixels
/// leave a curved reflector far apart. By twelve of 40 degrees an ellipsoid of glass seemed as well served without the image that takes a third of its error.
const POINTS: usize = 32;
const POINT_PX: u32 = 8;
const POINT_FOV_RAD: f64 = 0.1;
/// The side of the image that the points are found in.
const SURFACE_PX: u32 = 64;
/// Rays begin this part of a radius off the surface.
const NEAR_RADII: f64 = 1.0 / 64.0;
/// As `client/reflect/walk.wgsl` has them.
const LEGS: usize = 4;
const START_FOOTPRINTS: f64 = 2.0;
/// Colours are compared as a light from above and beside would show them, so that a wrong surface of the same colour counts too.
const LIGHT: Vec3 = Vec3::new(0.48, 0.8, 0.36);

/// What a ray meets.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Seen {
    rgb: Vec3,
    object: u16,
}

/// An image that rays can be held against.
pub(super) struct Picture {
    /// `None` where it shows nothing.
    impostor: Option<Impostor>,
    width_px: u32,
    camera: Camera,
    seen: Vec<Option<Seen>>,
    normals: Vec<Vec3>,
    /// Inverse depths; 0 where nothing is shown.
    w: Vec<f64>,
    footprints_m: Vec<f64>,
    /// What a client would be sent.
    pub bytes: usize,
}

impl Picture {
    pub fn of(image: DepthImage, purpose: Purpose) -> Picture {
        let (width_px, height_px) = image.mask.size_px();
        let count = width_px as usize * height_px as usize;
        let (mut seen, mut normals, mut w) = (vec![None; count], vec![Vec3::ZERO; count], vec![0.0; count]);
        for (index, (x, y)) in image.mask.occupied().enumerate() {
            let place = (y * width_px + x) as usize;
            let (colour, normal) = (image.colour[index], image.normal_at(index));
            let rgb = Vec3::from(colour.map(f32::from)) / 255.0 * (0.5 + 0.5 * normal.dot(LIGHT));
            seen[place] = Some(Seen { rgb, object: image.object[index] });
            normals[place] = normal;
            w[place] = image.depth_scale.w(image.depth[index]).into();
        }
        let (impostor, camera) = (impostor(&image), image.camera.clone());
        let footprints_m = impostor.iter().flat_map(|impostor| impostor.sample_shapes().map(|shape| shape.footprint_m));
        let footprints_m = footprints_m.collect();
        let patch = Patch { id: PatchId(1), purpose, capture_time_s: 0.0, objects: Vec::new(), image };
        let bytes = encode_patch(&patch, Coding::default()).len();
        Picture { impostor, width_px, camera, seen, normals, w, footprints_m, bytes }
    }

    /// The first sample that a ray of unit speed meets as clients have it: from either side, and no nearer to its start than samples tell.
    fn hit(&self, mut ray: Ray) -> Option<Hit> {
        for _ in 0..LEGS {
            let hit = self.impostor.as_ref()?.hit(&ray, Steps { method: Method::Hierarchy, fine_px: 1.0 }).hit?;
            let start_m = START_FOOTPRINTS * self.footprints_m[self.place(&hit)];
            if hit.t >= start_m {
                return Some(hit);
            }
            ray.t_from = start_m;
        }
        None
    }

    /// What stands before a point that this does not show.
    fn hider(&self, point_world: DVec3) -> Option<u16> {
        let point = self.camera.image_from_world(point_world)?;
        let (width_px, height_px) = self.camera.size_px();
        let is_inside = (0.0..f64::from(width_px)).contains(&point.u) && (0.0..f64::from(height_px)).contains(&point.v);
        let place = || point.v as usize * width_px as usize + point.u as usize;
        let place = is_inside.then(place).filter(|&place| self.w[place] > point.w)?;
        self.seen[place].map(|seen| seen.object)
    }

    fn place(&self, hit: &Hit) -> usize {
        (hit.pixel.1 * self.width_px + hit.pixel.0) as usize
    }
}

/// A ray of unit speed, and what it meets in the scene, if it meets anything.
struct ProbeRay {
    ray: Ray,
    met: Option<(Seen, DVec3)>,
}

/// Rays with what they meet in the scene.
pub(super) struct Probes {
    rays: Vec<ProbeRay>,
    /// Of all that they meet.
    mean_rgb: Vec3,
}

/// What images get wrong.
#[derive(Debug, Default)]
pub(super) struct Wrong {
    /// Mean absolute difference of what rays show, 0 to 1.
    pub error: f64,
    /// The part of it in rays that meet an object, or what is hidden behind it: at most what an image of its own would mend.
    by_object: BTreeMap<u16, f64>,
    /// The part of that in rays that meet the object where the images do not show it: what lies past its silhouette.
    past_silhouette: BTreeMap<u16, f64>,
}

impl Wrong {
    /// In rays that have to do with an object.
    pub fn of(&self, object: u16) -> f64 {
        self.by_object.get(&object).copied().unwrap_or(0.0)
    }

    /// In rays that meet it past its silhouette.
    pub fn past_silhouette_of(&self, object: u16) -> f64 {
        self.past_silhouette.get(&object).copied().unwrap_or(0.0)
    }
}

impl Probes {
    /// Of what a viewer sees in a reflector; `None` where he sees none of it, or nothing can be drawn.
    pub fn new<E>(reflector: &Reflector<'_>, eye_world: DVec3, draw: &mut Draw<'_, E>) -> Result<Option<Probes>, E> {
        let Some(starts) = starts(reflector, eye_world, draw)? else { return Ok(None) };
        let drawn = Drawn::AllBut(reflector.members.clone());
        let near_m = NEAR_RADII * reflector.ball.radius_m;
        let mut rays = Vec::new();
        for (point_world, direction_world) in starts {
            let world_from_eye = Rigid::look_along(point_world, direction_world);
            let view = Pinhole::symmetric(world_from_eye, (POINT_PX, POINT_PX), POINT_FOV_RAD, near_m);
            let camera = Camera::Pinhole(view);
            let shot = Shot { camera: &camera, drawn: &drawn, faces: Faces::Front, is_tinted: true };
            let Some(image) = draw(&shot)? else { return Ok(None) };
            let picture = Picture::of(image, Purpose::Environment);
            let pixels = (0..POINT_PX).flat_map(|y| (0..POINT_PX).map(move |x| (x, y)));
            rays.extend(pixels.zip(picture.seen.iter().zip(&picture.w)).map(|((x, y), (seen, &w))| {
                let (u, v) = (f64::from(x) + 0.5, f64::from(y) + 0.5);
                let direction_world = world_from_eye.transform_vector(view.ray_eye_from_image(u, v)).normalize();
                let met = seen.map(|seen| (seen, camera.world_from_image(ImagePoint { u, v, w })));
                ProbeRay { ray: Ray { t_from: near_m, ..Ray::endless(point_world, direction_world) }, met }
            }));
        }
        let met = rays.iter().filter_map(|ray| ray.met);
        let (sum, count) = met.fold((Vec3::ZERO, 0), |(sum, count), (seen, _)| (sum + seen.rgb, count + 1));
        Ok((count > 0).then(|| Probes { rays, mean_rgb: sum / count as f32 }))
    }

    /// What images of the scene, taken by a choice, get wrong. A ray that meets nothing shows what is beside, which may be anything.
    pub fn wrong(&self, pictures: &[Arc<Picture>]) -> Wrong {
        let rgb = |seen: Option<Seen>| seen.map_or(self.mean_rgb, |seen| seen.rgb);
        let answers = self.rays.par_iter().map(|ProbeRay { ray, met: truth }| {
            let met = first_met(pictures, ray);
            let shown = met.map(|(seen, _)| seen);
            let error = f64::from((rgb(shown) - rgb(truth.map(|(seen, _)| seen))).abs().element_sum()) / 3.0;
            let is_right = |seen: Seen| met.is_some_and(|(met, side)| met.object == seen.object && side == Side::Front);
            let hidden = truth.filter(|(seen, _)| !is_right(*seen));
            let hider = hidden.and_then(|(_, point)| pictures.iter().find_map(|picture| picture.hider(point)));
            (error, truth.map(|(seen, _)| seen.object), hidden.is_some(), hider)
        });
        let mut wrong = Wrong::default();
        let count = self.rays.len() as f64;
        for (error, truth, is_hidden, hider) in answers.collect::<Vec<_>>() {
            let error = error / count;
            wrong.error += error;
            for object in [truth, hider.filter(|_| hider != truth)].into_iter().flatten() {
                *wrong.by_object.entry(object).or_default() += error;
            }
            if let Some(object) = truth.filter(|_| is_hidden) {
                *wrong.past_silhouette.entry(object).or_default() += error;
            }
        }
        wrong
    }
}

/// What a ray meets first in any of some images, and from which side.
fn first_met(pictures: &[Arc<Picture>], ray: &Ray) -> Option<(Seen, Side)> {
    let hits = pictures.iter().filter_map(|picture| Some((picture, picture.hit(*ray)?)));
    let (picture, hit) = hits.min_by(|(_, a), (_, b)| a.t.total_cmp(&b.t))?;
    picture.seen[picture.place(&hit)].map(|seen| (seen, hit.side))
}

/// Where rays that a viewer sees leave the reflector, and which way.
fn starts<E>(
    reflector: &Reflector<'_>,
    eye_world: DVec3,
    draw: &mut Draw<'_, E>,
) -> Result<Option<Vec<(DVec3, DVec3)>>, E> {
    let Some(bounds) = reflector.bounds[usize::from(reflector.id)] else { return Ok(None) };
    let Some(spoc) = Spoc::around(&bounds, eye_world, (SURFACE_PX, SURFACE_PX), 0.0) else { return Ok(None) };
    let (camera, drawn) = (Camera::Pinhole(spoc.pinhole), Drawn::Only(reflector.id));
    let Some(surface) = draw(&Shot { camera: &camera, drawn: &drawn, faces: Faces::Front, is_tinted: true })? else {
        return Ok(None);
    };
    let inside = match reflector.inside(eye_world).filter(|_| reflector.shows == Shows::Glass) {
        Some(inside) => draw(&inside.shot())?.map(|image| Picture::of(image, inside.purpose)),
        None => None,
    };
    let samples: Vec<(usize, (u32, u32))> = surface.mask.occupied().enumerate().collect();
    let spread = (0..POINTS.min(samples.len())).map(|k| samples[(2 * k + 1) * samples.len() / (2 * POINTS)]);
    let starts = spread.filter_map(|(index, (x, y))| {
        let w = surface.depth_scale.w(surface.depth[index]).into();
        let point = camera.world_from_image(ImagePoint { u: f64::from(x) + 0.5, v: f64::from(y) + 0.5, w });
        let along = (point - eye_world).normalize_or_zero();
        let normal = facing(surface.normal_at(index), along);
        match (reflector.shows, &inside) {
            (Shows::Mirror | Shows::RoughMirror, _) => Some((point, along.reflect(normal))),
            (Shows::Glass, Some(inside)) => through(inside, reflector.ior(), (point, along, normal)),
            (Shows::Glass, None) => None,
        }
    });
    Ok(Some(starts.collect()))
}

/// A ray through glass, by the image of its back faces; `None` where it stays inside.
fn through(inside: &Picture, ior: f64, (point, along, normal): (DVec3, DVec3, DVec3)) -> Option<(DVec3, DVec3)> {
    let refracted = |along: DVec3, normal: DVec3, ratio: f64| {
        Some(along.refract(normal, ratio)).filter(|direction| *direction != DVec3::ZERO)
    };
    let within = refracted(along, normal, ior.recip())?;
    let hit = inside.hit(Ray::endless(point, within))?;
    let normal = facing(inside.normals[inside.place(&hit)], within);
    Some((hit.p_world, refracted(within, normal, ior)?))
}

/// A normal on the side that a ray comes from.
fn facing(normal: Vec3, along: DVec3) -> DVec3 {
    let normal = normal.as_dvec3().normalize_or_zero();
    if normal.dot(along) > 0.0 { -normal } else { normal }
}

impl Reflector<'_> {
    fn ior(&self) -> f64 {
        let mesh = self.scene.instances[usize::from(self.id)].mesh as usize;
        f64::from(self.scene.materials[self.scene.meshes[mesh].material as usize].ior)
    }
}

/// The picture of an image that a client should hold; `None` where it cannot be drawn.
pub(super) fn picture_of<E>(wanted: &Wanted, draw: &mut Draw<'_, E>) -> Result<Option<Arc<Picture>>, E> {
    Ok(draw(&wanted.shot())?.map(|image| Arc::new(Picture::of(image, wanted.purpose))))
}
