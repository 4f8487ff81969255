//! What impostors are held against: solids that rays are intersected with in closed form, and images of them made ray by ray.
#![allow(dead_code, reason = "each test file uses its part")]

pub mod scenes;

use camera::{Camera, GraphCamera, ImagePoint, Pinhole, Spoc};
use glam::DVec3;
use vantage_impostor::{Impostor, Sample};

#[derive(Debug, Clone, Copy)]
pub enum Solid {
    Ball { centre: DVec3, radius: f64 },
    Block { min: DVec3, max: DVec3 },
}

/// A point of a surface.
#[derive(Debug, Clone, Copy)]
pub struct Point {
    pub t: f64,
    pub p_world: DVec3,
    pub normal: DVec3,
}

impl Solid {
    /// Where the line `origin + t direction` enters and leaves.
    fn span(&self, origin: DVec3, direction: DVec3) -> Option<(f64, f64)> {
        match *self {
            Solid::Ball { centre, radius } => {
                let (offset, squared) = (origin - centre, direction.length_squared());
                let middle = -offset.dot(direction) / squared;
                let nearest = offset + direction * middle;
                let half = ((radius.powi(2) - nearest.length_squared()) / squared).sqrt();
                (!half.is_nan()).then_some((middle - half, middle + half))
            }
            Solid::Block { min, max } => {
                let (mut enter, mut leave) = (f64::NEG_INFINITY, f64::INFINITY);
                for axis in 0..3 {
                    if direction[axis] == 0.0 && !(min[axis]..max[axis]).contains(&origin[axis]) {
                        return None;
                    }
                    if direction[axis] != 0.0 {
                        let (a, b) = (
                            (min[axis] - origin[axis]) / direction[axis],
                            (max[axis] - origin[axis]) / direction[axis],
                        );
                        (enter, leave) = (enter.max(a.min(b)), leave.min(a.max(b)));
                    }
                }
                (enter < leave).then_some((enter, leave))
            }
        }
    }

    fn normal(&self, p: DVec3) -> DVec3 {
        match *self {
            Solid::Ball { centre, .. } => (p - centre).normalize(),
            Solid::Block { min, max } => {
                let middle = min.midpoint(max);
                let share = (p - middle) / (max - middle);
                let axis = share.abs().max_position();
                DVec3::AXES[axis] * share[axis].signum()
            }
        }
    }

    /// Negative inside.
    pub fn distance(&self, p: DVec3) -> f64 {
        match *self {
            Solid::Ball { centre, radius } => p.distance(centre) - radius,
            Solid::Block { min, max } => {
                let out = (min - p).max(p - max);
                out.max(DVec3::ZERO).length() + out.max_element().min(0.0)
            }
        }
    }
}

#[derive(Debug, Clone)]
pub struct Scene(pub Vec<Solid>);

impl Scene {
    /// All points of surfaces on a line with `from <= t <= to`, in order.
    pub fn points(&self, origin: DVec3, direction: DVec3, from: f64, to: f64) -> Vec<Point> {
        let mut points: Vec<Point> = Vec::new();
        for solid in &self.0 {
            if let Some((enter, leave)) = solid.span(origin, direction) {
                let point = |t: f64| {
                    let p_world = origin + direction * t;
                    Point { t, p_world, normal: solid.normal(p_world) }
                };
                points.extend([enter, leave].into_iter().filter(|t| (from..=to).contains(t)).map(point));
            }
        }
        points.sort_by(|a, b| a.t.total_cmp(&b.t));
        points
    }

    fn first_between(&self, a: DVec3, b: DVec3) -> Option<Point> {
        self.points(a, b - a, 0.0, 1.0).into_iter().next()
    }

    /// How far a point is from the nearest surface.
    pub fn distance(&self, p: DVec3) -> f64 {
        self.0.iter().map(|solid| solid.distance(p).abs()).fold(f64::INFINITY, f64::min)
    }
}

/// What a pixel's centre shows, as it was found.
#[derive(Debug, Clone, Copy)]
pub struct Shown {
    pub p_world: DVec3,
    pub normal: DVec3,
    pub w: f64,
    /// How far a pixel's width is at this depth.
    pub footprint_m: f64,
    /// The cosine of the angle between the camera's ray and the normal.
    pub cosine: f64,
}

pub struct Image {
    pub impostor: Impostor,
    pub scene: Scene,
    pub shown: Vec<Option<Shown>>,
    pub size: (usize, usize),
}

impl Image {
    pub fn take(camera: Camera, scene: Scene) -> Image {
        let (width, height) = camera.size_px();
        let size = (width as usize, height as usize);
        let centre = |place: usize| ((place % size.0) as f64 + 0.5, (place / size.0) as f64 + 0.5);
        let shown: Vec<Option<Shown>> = (0..size.0 * size.1)
            .map(|place| {
                let (u, v) = centre(place);
                match &camera {
                    Camera::Pinhole(camera) => by_pinhole(camera, &scene, u, v),
                    Camera::Spoc(camera) => by_spoc(camera, &scene, u, v),
                    Camera::Graph(camera) => by_graph(camera, &scene, u, v),
                }
            })
            .collect();
        let sample = |shown: &Option<Shown>| shown.map_or(Sample::EMPTY, |s| Sample { w: s.w, normal_world: s.normal });
        let samples: Vec<Sample> = shown.iter().map(sample).collect();
        let impostor = Impostor::new(camera, &samples).expect("a sample for each pixel");
        Image { impostor, scene, shown, size }
    }

    pub fn at(&self, x: i64, y: i64) -> Option<&Shown> {
        let (width, height) = self.size;
        let inside = (0..width as i64).contains(&x) && (0..height as i64).contains(&y);
        inside.then(|| self.shown[y as usize * width + x as usize].as_ref()).flatten()
    }

    /// The 3x3 pixels around one, if all of them show something.
    pub fn around(&self, x: i64, y: i64) -> Option<Vec<Shown>> {
        (0..9).map(|i| self.at(x + i % 3 - 1, y + i / 3 - 1).copied()).collect()
    }
}

const FAR_M: f64 = 1e3;

fn shown(point: Point, w: f64, footprint_m: f64, ray: DVec3) -> Shown {
    let cosine = point.normal.dot(ray.normalize()).abs();
    Shown { p_world: point.p_world, normal: point.normal, w, footprint_m, cosine }
}

fn by_pinhole(camera: &Pinhole, scene: &Scene, u: f64, v: f64) -> Option<Shown> {
    let (eye, ray) =
        (camera.world_from_eye.translation, camera.world_from_eye.transform_vector(camera.ray_eye_from_image(u, v)));
    let point = scene.points(eye, ray, camera.near_m, FAR_M).into_iter().next()?;
    Some(shown(point, 1.0 / point.t, point.t / camera.focal_px, ray))
}

/// Along the camera ray's own pieces; a curved one in 256 chords, and on the curve between the ends of the chord that hits.
fn by_spoc(camera: &Spoc, scene: &Scene, u: f64, v: f64) -> Option<Shown> {
    let ray = camera.ray(u, v);
    for piece in ray.pieces() {
        let (from, to) = (piece.from_m, piece.to_m.min(FAR_M));
        let chords = if piece.is_straight { 1 } else { 256 };
        let depth = |i: u32| from + (to - from) * f64::from(i) / f64::from(chords);
        for chord in 0..chords {
            let (mut near, mut far) = (depth(chord), depth(chord + 1));
            let (a, b) = (ray.world_at(near), ray.world_at(far));
            let Some(point) = scene.first_between(a, b) else { continue };
            let inside = |z: f64| scene.0.iter().any(|solid| solid.distance(ray.world_at(z)) < 0.0);
            let mut z = near + (far - near) * point.t;
            if !piece.is_straight && !inside(near) && inside(far) {
                while far - near > 1e-12 * far {
                    z = near.midpoint(far);
                    if inside(z) { far = z } else { near = z }
                }
            }
            let point = Point { p_world: ray.world_at(z), ..point };
            return Some(shown(point, 1.0 / z, z / camera.pinhole.focal_px, b - a));
        }
    }
    None
}

/// Along the bent ray, to a hair behind its end: walls stand where frusta end.
fn by_graph(camera: &GraphCamera, scene: &Scene, u: f64, v: f64) -> Option<Shown> {
    let pieces = camera.ray(u, v);
    let last = pieces.len().checked_sub(1)?;
    for (place, piece) in pieces.iter().enumerate() {
        let frustum = camera.frustum(piece.frustum)?;
        let beyond = if place == last { 1e-9 } else { 0.0 };
        let end = piece.to_world + (piece.to_world - piece.from_world) * beyond;
        let Some(point) = scene.first_between(piece.from_world, end) else { continue };
        let w = frustum.image_from_world(point.p_world)?.w;
        let beside = |u: f64, v: f64| frustum.world_from_image(ImagePoint { u, v, w }).distance(point.p_world);
        let footprint_m = beside(u + 1.0, v).max(beside(u, v + 1.0));
        return Some(shown(point, w, footprint_m, piece.to_world - piece.from_world));
    }
    None
}
