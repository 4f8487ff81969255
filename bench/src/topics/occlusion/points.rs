//! Points of a scene's surface, how much of the sky each sees in truth, and what a frame says of it.

use std::f64::consts::TAU;

use camera::{ImagePoint, Pinhole};
use glam::DVec3;
use protocol::DepthImage;
use protocol::image::{Ranks, octahedral_normal};
use server::render::RayScene;

use crate::rng::Rng;

/// A followed point of the surface.
pub struct Point {
    /// Where it is.
    pub world: DVec3,
    /// Of the surface.
    pub normal: DVec3,
    /// What a pixel spans there, in the image that it comes from.
    pub footprint_m: f64,
}

/// How far a pixel's point may be from a followed one that it shows, in footprints of the pixel: half a diagonal within the
/// pixel, on a surface that is tilted by up to 60 degrees.
const SHOWN_FOOTPRINTS: f64 = 1.5;
/// Cosine of the angle by which normals two pixels beside a followed point may differ from its own: 18 degrees.
const SMOOTH_COSINE: f64 = 0.95;
/// Rays a point, in a square number of strata.
const RAYS_A_SIDE: usize = 16;
/// Samples of the images, drawn by a seed, that lie on smooth parts: beside an edge, a pixel shows now one surface and now
/// the other, and their occlusion differs whatever it is measured from.
pub fn points(images: &[DepthImage], count: usize) -> Vec<Point> {
    let mut rng = Rng::new(1);
    let ranks: Vec<Ranks> = images.iter().map(|image| Ranks::new(&image.mask)).collect();
    let pick = |_| {
        let index = (rng.bits() % images.len() as u64) as usize;
        let image = &images[index];
        let (width, height) = image.mask.size_px();
        let [x, y] = [width, height].map(|side| (rng.bits() % u64::from(side)) as i64);
        let point = point_at(image, &ranks[index], (x, y))?;
        let is_smooth = [(-2, 0), (2, 0), (0, -2), (0, 2)].into_iter().all(|(right, down)| {
            let beside = point_at(image, &ranks[index], (x + right, y + down));
            beside.is_some_and(|beside| {
                let above_m = (beside.world - point.world).dot(point.normal);
                beside.normal.dot(point.normal) > SMOOTH_COSINE && above_m.abs() < point.footprint_m
            })
        });
        is_smooth.then_some(point)
    };
    (0..count).filter_map(pick).collect()
}

/// The sample at a pixel.
fn point_at(image: &DepthImage, ranks: &Ranks, (x, y): (i64, i64)) -> Option<Point> {
    let sample = ranks.of(&image.mask, u16::try_from(x).ok()?, u16::try_from(y).ok()?)?;
    let camera = *image.camera.root();
    let w = f64::from(image.depth_scale.w(image.depth[sample]));
    let world = camera.world_from_image(ImagePoint { u: x as f64 + 0.5, v: y as f64 + 0.5, w });
    let normal = octahedral_normal(image.normal[sample]).as_dvec3();
    Some(Point { world, normal, footprint_m: 1.0 / (w * camera.focal_px) })
}

/// Where a view shows a point, by the inverse depths of its pixels; `None` where something else is there.
pub fn shown_at(point: &Point, view: &Pinhole, w: &[f32]) -> Option<ImagePoint> {
    let image = view.image_from_world(point.world).filter(|image| view.contains(*image))?;
    let (x, y) = (image.u as usize, image.v as usize);
    let pixel = y * view.width_px as usize + x;
    let pixel_w = f64::from(w[pixel]);
    let seen = ImagePoint { u: x as f64 + 0.5, v: y as f64 + 0.5, w: pixel_w };
    let footprint_m = 1.0 / (image.w * view.focal_px);
    let is_near = pixel_w > 0.0 && view.world_from_image(seen).distance(point.world) <= SHOWN_FOOTPRINTS * footprint_m;
    is_near.then_some(image)
}

/// The share of a cosine-weighted sky that nothing hides within reach; what hides counts less with the square of its distance, as
/// the client measures it.
pub fn traced(rays: &RayScene, anchor_world: DVec3, point: &Point, reach_m: f64) -> f64 {
    let mut rng = Rng::new(point.world.x.to_bits() ^ point.world.y.to_bits() ^ point.world.z.to_bits());
    let (x, y) = point.normal.any_orthonormal_pair();
    // A footprint above the surface: a sample's depth is coded so exactly.
    let origin = (point.world + point.normal * point.footprint_m - anchor_world).as_vec3();
    let mut hidden = 0.0;
    for stratum in 0..RAYS_A_SIDE * RAYS_A_SIDE {
        let within = |cell: usize, rng: &mut Rng| (cell as f64 + rng.range(0.0, 1.0)) / RAYS_A_SIDE as f64;
        let azimuth_rad = TAU * within(stratum % RAYS_A_SIDE, &mut rng);
        // Uniform in the square of the sine: weighted by the cosine.
        let sine_squared = within(stratum / RAYS_A_SIDE, &mut rng);
        let (sine, cosine) = (sine_squared.sqrt(), (1.0 - sine_squared).sqrt());
        let direction = (x * azimuth_rad.cos() + y * azimuth_rad.sin()) * sine + point.normal * cosine;
        if let Some(hit) = rays.first_hit(origin, direction.as_vec3(), 0.0, reach_m as f32) {
            hidden += 1.0 - (f64::from(hit.t) / reach_m).powi(2);
        }
    }
    1.0 - hidden / (RAYS_A_SIDE * RAYS_A_SIDE) as f64
}

/// Between the four pixels around: a pixel's own value is that of a point up to half a pixel beside.
pub fn bilinear(values: &[f32], view: &Pinhole, image: ImagePoint) -> f64 {
    let at = |x: f64, y: f64| {
        let [x, y] = [(x, view.width_px), (y, view.height_px)].map(|(at, size)| (at as usize).min(size as usize - 1));
        f64::from(values[y * view.width_px as usize + x])
    };
    let (u, v) = ((image.u - 0.5).max(0.0), (image.v - 0.5).max(0.0));
    let (right, down) = (u.fract(), v.fract());
    let row = |y: f64| at(u, y) * (1.0 - right) + at(u + 1.0, y) * right;
    row(v) * (1.0 - down) + row(v + 1.0) * down
}

/// Of values.
pub fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0.0), |(sum, count), value| (sum + value, count + 1.0));
    sum / count
}
