//! Images for tests, ray-cast on the CPU.
#![allow(dead_code, reason = "each test file uses a part")]

use camera::{Camera, Pinhole, Rigid};
use glam::{DVec3, Vec3};
use vantage_protocol::ends::{SIDES, with_level};
use vantage_protocol::image::{octahedral_code, octahedral_rest};
use vantage_protocol::{DepthImage, DepthScale, Mask, Patch, PatchId, Purpose};

/// Spheres over a textured floor with a sky of holes; `keep(x, y)` thins the image out as redundancy does.
pub fn cast(size_px: (u32, u32), keep: impl Fn(u32, u32) -> bool) -> DepthImage {
    cast_mirroring(size_px, keep, u16::MAX)
}

/// The same, one of whose spheres is a mirror.
pub fn cast_with_mirror(size_px: (u32, u32), keep: impl Fn(u32, u32) -> bool) -> DepthImage {
    cast_mirroring(size_px, keep, MIRROR)
}

/// The mirror: the one in the middle, whose material nothing else has.
pub const MIRROR: u16 = 0;

fn cast_mirroring((width_px, height_px): (u32, u32), keep: impl Fn(u32, u32) -> bool, mirror: u16) -> DepthImage {
    let camera = camera((width_px, height_px));
    let mut mask = Mask::empty(width_px, height_px);
    let mut samples = Vec::new();
    for (y, x) in (0..height_px).flat_map(|y| (0..width_px).map(move |x| (y, x))) {
        if let Some(hit) = seen(&camera, f64::from(x) + 0.5, f64::from(y) + 0.5).filter(|_| keep(x, y)) {
            mask.set(x, y, true);
            samples.push(hit);
        }
    }
    let w = |sample: &Hit| (1.0 / sample.z) as f32;
    let (w_min, w_max) =
        samples.iter().map(w).fold((f32::INFINITY, 0.0_f32), |(least, most), w| (least.min(w), most.max(w)));
    let w_min = if samples.is_empty() { 0.0 } else { w_min };
    let depth_scale = DepthScale { w_min, w_step: ((w_max - w_min) / 4095.0).max(0.0) };
    DepthImage {
        camera: Camera::Pinhole(camera),
        depth_scale,
        mask,
        depth: samples.iter().map(|sample| depth_scale.code(w(sample))).collect(),
        normal: samples.iter().map(|sample| octahedral_code(sample.normal)).collect(),
        ends: Vec::new(),
        colour_rest: Vec::new(),
        normal_rest: if samples.iter().any(|sample| sample.object == mirror) {
            samples
                .iter()
                .map(|sample| if sample.object == mirror { octahedral_rest(sample.normal) } else { 0 })
                .collect()
        } else {
            Vec::new()
        },
        colour: samples.iter().map(|sample| sample.colour).collect(),
        object: samples.iter().map(|sample| sample.object).collect(),
        material: samples.iter().map(|sample| (sample.object % 3) as u8).collect(),
        share: Vec::new(),
    }
}

fn camera(size_px: (u32, u32)) -> Pinhole {
    let pose = Rigid::look_at(DVec3::new(0.3, 1.7, 4.0), DVec3::new(0.0, 0.5, 0.0));
    Pinhole::symmetric(pose, size_px, 1.0, 0.05)
}

fn seen(camera: &Pinhole, u: f64, v: f64) -> Option<Hit> {
    let pose = &camera.world_from_eye;
    hit(pose.translation, pose.transform_vector(camera.ray_eye_from_image(u, v)))
}

/// The same image, whose samples say where their surfaces end.
pub fn with_ends(mut image: DepthImage) -> DepthImage {
    let camera = camera(image.mask.size_px());
    let ends = image.mask.occupied().zip(&image.object).map(|((x, y), &object)| {
        let is_own = |side: usize, way: f64| {
            let [right, down] = SIDES[side].map(|step| 0.5 + way * f64::from(step));
            seen(&camera, f64::from(x) + right, f64::from(y) + down).is_some_and(|hit| hit.object == object)
        };
        let level = |side: usize| (0..7).filter(|&part| is_own(side, (f64::from(part) + 1.5) / 9.0)).count() as u16;
        (0..4).filter(|&side| !is_own(side, 1.0)).fold(0, |all, side| with_level(all, side, level(side).max(1)))
    });
    let ends = ends.collect();
    image.settle_ends(ends);
    image
}

pub struct Hit {
    z: f64,
    normal: Vec3,
    colour: [u8; 3],
    object: u16,
}

fn hit(eye: DVec3, ray: DVec3) -> Option<Hit> {
    let mut nearest: Option<Hit> = None;
    let mut offer = |hit: Hit| {
        if hit.z > 0.05 && nearest.as_ref().is_none_or(|nearest| hit.z < nearest.z) {
            nearest = Some(hit);
        }
    };
    if ray.y < 0.0 {
        let z = -eye.y / ray.y;
        let p = eye + ray * z;
        let tile = ((p.x * 2.0).floor() as i64 + (p.z * 2.0).floor() as i64).rem_euclid(2) as u8;
        let grain = ((p.x * 40.0).sin() * (p.z * 40.0).sin() * 20.0) as i16;
        let channel = |base: i16| (base + grain + i16::from(tile) * 60) as u8;
        if z < 30.0 {
            offer(Hit { z, normal: Vec3::Y, colour: [channel(90), channel(80), channel(60)], object: 7 });
        }
    }
    for (object, centre) in
        [DVec3::new(0.0, 0.5, 0.0), DVec3::new(0.9, 0.4, 0.5), DVec3::new(-1.0, 0.6, -0.5)].iter().enumerate()
    {
        let (a, b, c) = (ray.length_squared(), ray.dot(eye - centre), (eye - centre).length_squared() - 0.25);
        let root = b * b - a * c;
        if root > 0.0 {
            let z = (-b - root.sqrt()) / a;
            let normal = ((eye + ray * z - centre) * 2.0).as_vec3();
            offer(Hit { z, normal, colour: [200, 40 * object as u8, 30], object: object as u16 });
        }
    }
    nearest
}

/// A patch of an image.
pub fn patch(id: u32, image: DepthImage) -> Patch {
    Patch { id: PatchId(id), purpose: Purpose::Eye, capture_time_s: 0.5, objects: Vec::new(), image }
}

/// Keeps a pseudo-random share of runs, as a residual image does.
pub fn fragments(x: u32, y: u32) -> bool {
    let cell = (x / 3).wrapping_mul(0x9e37_79b9) ^ (y / 2).wrapping_mul(0x85eb_ca6b);
    (cell ^ cell >> 15).wrapping_mul(0x2c1b_3c6d) >> 29 < 2
}
