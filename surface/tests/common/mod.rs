//! Patches and truth by ray casting on the CPU, for scenes with a closed form.
#![allow(dead_code)] // each test file uses its part

use camera::{Camera, Pinhole, Rigid};
use glam::{DVec3, Vec3};
use gpu::{Gpu, Readback};
use protocol::held::HeldPatch;
use protocol::image::octahedral_code;
use protocol::{DepthImage, DepthScale, Mask, Patch, PatchId, Purpose};
use vantage_surface::{GBuffer, HeldSurfaces, Smoothing, SurfacePass};

/// Where a ray meets something.
#[derive(Debug, Clone, Copy)]
pub struct Hit {
    /// Multiples of the ray.
    pub t: f64,
    pub normal: DVec3,
    pub object: u16,
    pub colour: [u8; 3],
}

/// A sphere or a plane, in world space.
#[derive(Debug, Clone, Copy)]
pub enum Shape {
    Plane { point: DVec3, normal: DVec3 },
    Sphere { centre: DVec3, radius: f64 },
}

/// Shapes are objects 1, 2, …
pub fn cast(shapes: &[Shape], origin: DVec3, ray: DVec3) -> Option<Hit> {
    let hits = shapes.iter().enumerate().filter_map(|(index, shape)| {
        let (t, normal) = match *shape {
            Shape::Plane { point, normal } => ((point - origin).dot(normal) / ray.dot(normal), normal),
            Shape::Sphere { centre, radius } => {
                let offset = origin - centre;
                let (a, b, c) = (ray.length_squared(), offset.dot(ray), offset.length_squared() - radius * radius);
                let t = (-b - (b * b - a * c).sqrt()) / a;
                (t, (offset + t * ray) / radius)
            }
        };
        let p = origin + t * ray;
        let shade = |value: f64| ((value * 40.0).rem_euclid(256.0)) as u8;
        let colour = [shade(p.x), shade(p.y), shade(p.z)];
        (t > 0.0 && normal.dot(ray) < 0.0).then_some(Hit { t, normal, object: index as u16 + 1, colour })
    });
    hits.min_by(|a, b| a.t.total_cmp(&b.t))
}

pub fn truth(shapes: &[Shape], camera: &Pinhole) -> Vec<Option<Hit>> {
    let pixels = (0..camera.height_px).flat_map(|y| (0..camera.width_px).map(move |x| (x, y)));
    let ray =
        |(x, y)| camera.world_from_eye.transform_vector(camera.ray_eye_from_image(x as f64 + 0.5, y as f64 + 0.5));
    pixels.map(|pixel| cast(shapes, camera.world_from_eye.translation, ray(pixel))).collect()
}

/// 12 bits of depth over what is there, as a server codes it.
pub fn capture(shapes: &[Shape], camera: &Pinhole) -> HeldPatch {
    let hits = truth(shapes, camera);
    let w = |hit: &Hit| (1.0 / hit.t) as f32;
    let (w_min, w_max) =
        hits.iter().flatten().map(w).fold((f32::MAX, 0.0_f32), |(low, high), w| (low.min(w), high.max(w)));
    let depth_scale = DepthScale { w_min, w_step: ((w_max - w_min) / 4095.0).max(0.0) };
    let mut mask = Mask::empty(camera.width_px, camera.height_px);
    for (index, hit) in hits.iter().enumerate() {
        mask.set(index as u32 % camera.width_px, index as u32 / camera.width_px, hit.is_some());
    }
    let hits: Vec<Hit> = hits.into_iter().flatten().collect();
    let image = DepthImage {
        camera: Camera::Pinhole(*camera),
        depth_scale,
        mask,
        depth: hits.iter().map(|hit| depth_scale.code(w(hit))).collect(),
        normal: hits.iter().map(|hit| octahedral_code(hit.normal.as_vec3())).collect(),
        normal_rest: Vec::new(),
        colour_rest: Vec::new(),
        share: Vec::new(),
        ends: Vec::new(),
        colour: hits.iter().map(|hit| hit.colour).collect(),
        object: hits.iter().map(|hit| hit.object).collect(),
        material: hits.iter().map(|hit| hit.object as u8 + 7).collect(),
    };
    held(image)
}

pub fn held(image: DepthImage) -> HeldPatch {
    let patch = Patch { id: PatchId(1), purpose: Purpose::Eye, capture_time_s: 0.0, objects: Vec::new(), image };
    HeldPatch { patch, trims: Vec::new() }
}

pub fn view(eye: DVec3, target: DVec3, size: u32, fov_deg: f64) -> Pinhole {
    Pinhole::symmetric(Rigid::look_at(eye, target), (size, size), fov_deg.to_radians(), 0.05)
}

/// What was drawn.
pub struct Drawn {
    pub colour: Vec<[u8; 4]>,
    pub normal_ids: Vec<[u32; 2]>,
    pub w: Vec<f32>,
}

impl Drawn {
    pub fn object(&self, pixel: usize) -> u16 {
        self.normal_ids[pixel][1] as u16
    }

    pub fn material(&self, pixel: usize) -> u8 {
        (self.normal_ids[pixel][1] >> 16) as u8
    }

    pub fn normal(&self, pixel: usize) -> Vec3 {
        let part = |half: u32| f32::from(half as u16 as i16) / 32767.0;
        let (x, y) = (part(self.normal_ids[pixel][0] & 0xffff), part(self.normal_ids[pixel][0] >> 16));
        let z = 1.0 - x.abs() - y.abs();
        let fold = |a: f32, b: f32| (1.0 - b.abs()) * 1.0_f32.copysign(a);
        if z < 0.0 { Vec3::new(fold(x, y), fold(y, x), z).normalize() } else { Vec3::new(x, y, z).normalize() }
    }

    pub fn covered(&self) -> usize {
        self.colour.iter().filter(|colour| colour[3] == 255).count()
    }
}

pub struct Stage {
    pub gpu: Gpu,
    pass: SurfacePass,
}

impl Stage {
    pub fn new() -> Stage {
        let gpu = Gpu::block_on(Gpu::new_headless()).expect("an adapter");
        let pass = SurfacePass::new(&gpu).expect("the shaders compile");
        Stage { gpu, pass }
    }

    pub fn draw(&self, surfaces: &HeldSurfaces, camera: &Pinhole, smoothing: Smoothing) -> Drawn {
        let size = (camera.width_px, camera.height_px);
        let target = GBuffer::new(&self.gpu, size);
        let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
        self.pass.encode(&mut encoder, surfaces, camera, smoothing, &target);
        let mut readback = Readback::default();
        let colour = readback.texture(&target.colour, 0, size);
        let normal_ids = readback.texture(&target.normal_ids, 0, size);
        let w = readback.texture(&target.w, 0, size);
        let encoded = readback.encode(&self.gpu, &mut encoder);
        self.gpu.queue.submit([encoder.finish()]);
        let mapped = encoded.map().wait(&self.gpu).expect("a readback");
        Drawn { colour: mapped.values(colour), normal_ids: mapped.values(normal_ids), w: mapped.values(w) }
    }

    /// The same that draws what casts.
    pub fn casting() -> Stage {
        let Stage { gpu, .. } = Stage::new();
        let pass = SurfacePass::casting(&gpu).expect("the shaders compile");
        Stage { gpu, pass }
    }

    /// The same that draws what samples are.
    pub fn tinted() -> Stage {
        let Stage { gpu, .. } = Stage::new();
        let pass = SurfacePass::tinted(&gpu).expect("the shaders compile");
        Stage { gpu, pass }
    }

    pub fn draw_patch(&self, patch: &HeldPatch, camera: &Pinhole) -> Drawn {
        let mut surfaces = HeldSurfaces::new(&self.gpu);
        surfaces.insert(patch);
        self.draw(&surfaces, camera, Smoothing::default())
    }
}

/// Points in the unit ball, the same every time.
pub fn ball(count: usize) -> Vec<DVec3> {
    let mut state = 0x9e37_79b9_7f4a_7c15_u64;
    let mut next = move || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 11) as f64 / (1_u64 << 53) as f64 * 2.0 - 1.0
    };
    let mut points = Vec::new();
    while points.len() < count {
        let p = DVec3::new(next(), next(), next());
        if p.length_squared() <= 1.0 {
            points.push(p);
        }
    }
    points
}
