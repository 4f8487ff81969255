//! Builds meshes out of simple solids: boxes, surfaces of revolution, tubes along curves.
//!
//! Every part is placed by the current frame and painted with the current colour; triangles face outwards.

use glam::{Affine3A, Mat3A, Quat, Vec2, Vec3, vec2, vec3};
use std::f32::consts::{FRAC_PI_2, PI, TAU};

use crate::model::{Mesh, Vertex};

/// Neighbouring faces that meet at more than this are shaded with an edge between them.
const CREASE_COS: f32 = 0.8;
/// Triangles with less area (m^2) relative to their longest edge squared are not made. The cross product of two edges, which is twice the area, is off by
/// four roundings of 2^-24, 2.4e-7 of that square: about twice this.
const FLAT: f32 = 1e-7;

/// A point of a parametric surface, in the part's space.
pub(super) struct Point {
    pub position: Vec3,
    pub normal: Vec3,
    pub uv: Vec2,
}

/// A mesh under construction.
#[derive(Debug, Clone)]
pub(super) struct Mesher {
    vertices: Vec<Vertex>,
    indices: Vec<u32>,
    mesh_from_part: Affine3A,
    normal_from_part: Mat3A,
    colour: [u8; 4],
    uv_per_m: f32,
}

/// A vertex colour (linear, 8 bits) of an sRGB colour written `0xRRGGBB`.
pub(super) fn linear(srgb: u32) -> [u8; 4] {
    let channel = |shift: u32| {
        let s = ((srgb >> shift) & 255) as f32 / 255.0;
        let l = if s <= 0.040_45 { s / 12.92 } else { ((s + 0.055) / 1.055).powf(2.4) };
        (l * 255.0).round() as u8
    };
    [channel(16), channel(8), channel(0), 255]
}

impl Mesher {
    pub fn new() -> Self {
        Mesher {
            vertices: Vec::new(),
            indices: Vec::new(),
            mesh_from_part: Affine3A::IDENTITY,
            normal_from_part: Mat3A::IDENTITY,
            colour: [255; 4],
            uv_per_m: 1.0,
        }
    }

    /// Places what follows.
    pub fn frame(&mut self, mesh_from_part: Affine3A) -> &mut Self {
        self.mesh_from_part = mesh_from_part;
        self.normal_from_part = mesh_from_part.matrix3.inverse().transpose();
        self
    }

    /// Places what follows, upright.
    pub fn at(&mut self, x: f32, y: f32, z: f32) -> &mut Self {
        self.frame(Affine3A::from_translation(vec3(x, y, z)))
    }

    /// Paints what follows, sRGB `0xRRGGBB`.
    pub fn paint(&mut self, srgb: u32) -> &mut Self {
        self.colour = linear(srgb);
        self
    }

    /// How many times the texture repeats over a metre in what follows.
    pub fn uv_per_m(&mut self, repeats: f32) -> &mut Self {
        self.uv_per_m = repeats;
        self
    }

    /// Adds one vertex of the part; its index.
    pub fn vertex(&mut self, point: &Point) -> u32 {
        let position = self.mesh_from_part.transform_point3(point.position);
        let normal = (self.normal_from_part * point.normal).normalize_or(Vec3::Y);
        let uv = point.uv.to_array();
        let index = self.vertices.len() as u32;
        self.vertices.push(Vertex { position: position.into(), normal: normal.into(), uv, colour: self.colour });
        index
    }

    /// Adds a triangle of made vertices, unless it has no area.
    pub fn triangle(&mut self, [a, b, c]: [u32; 3]) {
        let at = |i: u32| Vec3::from(self.vertices[i as usize].position);
        let (ab, ac) = (at(b) - at(a), at(c) - at(a));
        let longest = ab.length_squared().max(ac.length_squared()).max((ac - ab).length_squared());
        if ab.cross(ac).length() > 2.0 * FLAT * longest {
            self.indices.extend([a, b, c]);
        }
    }

    /// A grid of `cells` over the unit square; `du x dv` must point along the normal.
    pub fn surface(&mut self, cells: [usize; 2], at: impl Fn(f32, f32) -> Point) {
        let first = self.vertices.len() as u32;
        for j in 0..=cells[1] {
            for i in 0..=cells[0] {
                self.vertex(&at(i as f32 / cells[0] as f32, j as f32 / cells[1] as f32));
            }
        }
        let row = cells[0] as u32 + 1;
        for j in 0..cells[1] as u32 {
            for i in 0..cells[0] as u32 {
                let a = first + j * row + i;
                self.triangle([a, a + 1, a + row + 1]);
                self.triangle([a, a + row + 1, a + row]);
            }
        }
    }

    /// A flat parallelogram cut into `cells`; `u x v` points outwards. Texture coordinates are lengths.
    pub fn panel(&mut self, origin: Vec3, u: Vec3, v: Vec3, cells: [usize; 2]) {
        let normal = u.cross(v).normalize_or(Vec3::Y);
        let scale = vec2(u.length(), v.length()) * self.uv_per_m;
        self.surface(cells, |s, t| Point { position: origin + u * s + v * t, normal, uv: vec2(s, 1.0 - t) * scale });
    }

    /// An upright rectangle in the part's xy plane that faces +z; texture coordinates are its place in the part, so that
    /// neighbours continue each other's pattern.
    pub fn upright(&mut self, low: Vec2, high: Vec2) {
        let uv_per_m = self.uv_per_m;
        self.surface([1, 1], |u, v| {
            let at = low + (high - low) * vec2(u, v);
            Point { position: at.extend(0.0), normal: Vec3::Z, uv: vec2(at.x, -at.y) * uv_per_m }
        });
    }

    /// A flat quadrilateral, counter-clockwise from outside, its texture coordinates lengths along its first edges.
    pub fn quad(&mut self, corners: [Vec3; 4]) {
        let [a, b, c, d] = corners;
        let normal = (c - a).cross(d - b).normalize_or(Vec3::Y);
        let (x, y) = ((b - a).normalize_or(Vec3::X), normal.cross((b - a).normalize_or(Vec3::X)));
        let made = corners.map(|position| {
            let uv = vec2((position - a).dot(x), -(position - a).dot(y)) * self.uv_per_m;
            self.vertex(&Point { position, normal, uv })
        });
        self.triangle([made[0], made[1], made[2]]);
        self.triangle([made[0], made[2], made[3]]);
    }

    /// A flat convex polygon, counter-clockwise from outside.
    pub fn polygon(&mut self, corners: &[Vec3]) {
        let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize_or(Vec3::Y);
        let x = (corners[1] - corners[0]).normalize_or(Vec3::X);
        let y = normal.cross(x);
        let first = self.vertices.len() as u32;
        for &position in corners {
            let from_first = position - corners[0];
            let uv = vec2(from_first.dot(x), -from_first.dot(y)) * self.uv_per_m;
            self.vertex(&Point { position, normal, uv });
        }
        for i in 1..corners.len() as u32 - 1 {
            self.triangle([first, first + i, first + i + 1]);
        }
    }

    /// A box between two corners.
    pub fn cuboid(&mut self, min: Vec3, max: Vec3) {
        self.cuboid_cells(min, max, [1; 3]);
    }

    /// A box between two corners whose faces are cut into cells along x, y and z.
    pub fn cuboid_cells(&mut self, min: Vec3, max: Vec3, [nx, ny, nz]: [usize; 3]) {
        let size = max - min;
        let (x, y, z) = (Vec3::X * size.x, Vec3::Y * size.y, Vec3::Z * size.z);
        self.panel(min + z, x, y, [nx, ny]);
        self.panel(min + x, -x, y, [nx, ny]);
        self.panel(min + x + z, -z, y, [nz, ny]);
        self.panel(min, z, y, [nz, ny]);
        self.panel(min + y + z, x, -z, [nx, nz]);
        self.panel(min, x, z, [nx, nz]);
    }

    /// A surface of revolution around y: `profile` holds (radius, height) from the bottom up. Sharp bends stay sharp.
    /// The texture goes `around` times around.
    pub fn lathe(&mut self, profile: &[Vec2], sides: usize, around: f32) {
        let outward = |k: usize| (profile[k + 1] - profile[k]).perp().normalize_or_zero() * -1.0;
        let blend = |k: usize, other: Option<usize>| match other.map(outward) {
            Some(n) if n.dot(outward(k)) > CREASE_COS => (n + outward(k)).normalize_or_zero(),
            _ => outward(k),
        };
        let segments = profile.len() - 1;
        let mut length = 0.0;
        for k in 0..segments {
            let (a, b) = (profile[k], profile[k + 1]);
            let (na, nb) = (blend(k, k.checked_sub(1)), blend(k, (k + 1 < segments).then_some(k + 1)));
            let (from, step) = (length, (b - a).length());
            length += step;
            let uv_per_m = self.uv_per_m;
            self.surface([sides, 1], |u, v| {
                let (sin, cos) = turn(u);
                let (at, n) = (a.lerp(b, v), na.lerp(nb, v));
                Point {
                    position: vec3(at.x * cos, at.y, -at.x * sin),
                    normal: vec3(n.x * cos, n.y, -n.x * sin),
                    uv: vec2(u * around, -(from + step * v) * uv_per_m),
                }
            });
        }
    }

    /// An ellipsoid around the origin.
    pub fn ellipsoid(&mut self, radii: Vec3, [slices, stacks]: [usize; 2]) {
        self.surface([slices, stacks], |u, v| {
            let (sin, cos) = turn(u);
            let (up, out) = ((v - 0.5) * PI).sin_cos();
            // The poles and the seam must close exactly.
            let out = if v <= 0.0 || v >= 1.0 { 0.0 } else { out };
            let on_unit = vec3(out * cos, up, -out * sin);
            Point { position: on_unit * radii, normal: on_unit / radii, uv: vec2(u, 1.0 - v) }
        });
    }

    /// A rod with round ends from `a` to `b`.
    pub fn capsule(&mut self, [a, b]: [Vec3; 2], [radius_a, radius_b]: [f32; 2], [sides, rings]: [usize; 2]) {
        let before = self.mesh_from_part;
        let length = (b - a).length();
        let turned = Quat::from_rotation_arc(Vec3::Y, (b - a).normalize_or(Vec3::Y));
        self.frame(before * Affine3A::from_rotation_translation(turned, a));
        let cap = |k: usize, lower: bool| {
            let angle = k as f32 / rings as f32 * FRAC_PI_2;
            if lower { -FRAC_PI_2 + angle } else { angle }
        };
        let arc = |angle: f32, radius: f32, y: f32| {
            // A pole: three roundings of an angle of up to a quarter turn make 2e-7, and the next ring is a degree away and more.
            let out = if angle.abs() >= FRAC_PI_2 - 1e-6 { 0.0 } else { angle.cos() };
            vec2(radius * out, y + radius * angle.sin())
        };
        let lower = (0..=rings).map(|k| arc(cap(k, true), radius_a, 0.0));
        let upper = (0..=rings).map(|k| arc(cap(k, false), radius_b, length));
        let profile: Vec<Vec2> = lower.chain(upper).collect();
        self.lathe(&profile, sides, 1.0);
        self.frame(before);
    }

    /// A tube along `spine`, closed at both ends; one radius for each point of the spine. A radius of zero makes a tip.
    pub fn tube(&mut self, spine: &[Vec3], radii: &[f32], sides: usize) {
        let last = spine.len() - 1;
        let tangent = |k: usize| (spine[(k + 1).min(last)] - spine[k.saturating_sub(1)]).normalize_or(Vec3::Y);
        let mut across = tangent(0).any_orthonormal_vector();
        let mut length = 0.0;
        let first = self.vertices.len() as u32;
        let row = sides as u32 + 1;
        for k in 0..=last {
            // Parallel transport: the frame turns with the curve and never twists.
            across = across.reject_from(tangent(k)).normalize_or(tangent(k).any_orthonormal_vector());
            let side = tangent(k).cross(across);
            length += if k == 0 { 0.0 } else { spine[k].distance(spine[k - 1]) };
            for i in 0..=sides {
                let (sin, cos) = turn(i as f32 / sides as f32);
                let normal = across * cos + side * sin;
                let uv = vec2(i as f32 / sides as f32, -length * self.uv_per_m);
                self.vertex(&Point { position: spine[k] + normal * radii[k], normal, uv });
            }
        }
        for k in 0..last as u32 {
            for i in 0..sides as u32 {
                let a = first + k * row + i;
                self.triangle([a, a + 1, a + row + 1]);
                self.triangle([a, a + row + 1, a + row]);
            }
        }
        self.cap(first, sides, -tangent(0));
        self.cap(first + last as u32 * row, sides, tangent(last));
    }

    /// Closes a ring of `sides + 1` vertices from `ring` on, facing `normal`; the ring runs counter-clockwise around
    /// the tube's direction.
    fn cap(&mut self, ring: u32, sides: usize, normal: Vec3) {
        let normal_mesh = (self.normal_from_part * normal).normalize_or(Vec3::Y);
        let first = self.vertices.len() as u32;
        let rim: Vec<Vertex> = self.vertices[ring as usize..ring as usize + sides].to_vec();
        let (p, q, r) = (rim[0].position, rim[1].position, rim[2].position);
        let along = (Vec3::from(q) - Vec3::from(p)).cross(Vec3::from(r) - Vec3::from(p)).dot(normal_mesh);
        self.vertices.extend(rim.into_iter().map(|vertex| Vertex { normal: normal_mesh.into(), ..vertex }));
        for i in 1..sides as u32 - 1 {
            let [b, c] = if along >= 0.0 { [i, i + 1] } else { [i + 1, i] };
            self.triangle([first, first + b, first + c]);
        }
    }

    /// The mesh, with its bounds.
    pub fn finish(self, material: u32) -> Mesh {
        let mut bounds = [[f32::INFINITY; 3], [f32::NEG_INFINITY; 3]];
        for vertex in &self.vertices {
            for (axis, &x) in vertex.position.iter().enumerate() {
                bounds[0][axis] = bounds[0][axis].min(x);
                bounds[1][axis] = bounds[1][axis].max(x);
            }
        }
        Mesh { vertices: self.vertices, indices: self.indices, material, bounds, ..Mesh::default() }
    }
}

/// Sine and cosine of a share of a full turn; the seam closes exactly.
fn turn(share: f32) -> (f32, f32) {
    if share >= 1.0 { (0.0, 1.0) } else { (share * TAU).sin_cos() }
}
