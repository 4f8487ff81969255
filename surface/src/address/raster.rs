//! The pass on the processor: the twin of the vertex stage and of `address` in `surface/quads.wgsl`.
//!
//! Quads are about as large as pixels, and most of a software driver's time for such goes into what a triangle costs before its first
//! pixel. Here most end at once, beside the view or with no pixel's centre in their box. As GPUs do, corners are
//! snapped to 1/256 of a pixel and edges are exact integers with the top left rule, so neighbours leave no gap. First only the
//! nearest triangle of each pixel is found; what it shows is worked out once a pixel at the end.

use std::ops::Range;

use camera::Pinhole;
use glam::{DVec2, DVec3, Vec3};
use protocol::PatchId;
use protocol::image::{octahedral_code, octahedral_normal};
use rayon::prelude::*;

use super::{AddressTexel, AddressView};
use crate::held::{HeldSurfaces, PatchSurface, QUAD_INDICES, QuadBuffers};
use crate::mesh::{PatchMesh, Vertex};
use crate::pass::{Placement, setback};

/// Steps a pixel is divided into.
const SUBPIXELS: f32 = 256.0;
/// Triangles that reach further out than this many half widths or heights from the middle are cut: edges stay exact in 64 bits.
const GUARD: f32 = 4.0;
/// Quads that one thread takes at once.
const CHUNK_QUADS: usize = 4096;

/// Which triangle a pixel shows, and how near.
#[derive(Debug, Clone, Copy)]
struct Seen {
    /// `near * w`, set back; 0 for nothing.
    depth: f32,
    /// Place among the drawn patches.
    patch: u32,
    /// Place of its first index.
    first_index: u32,
}

const NOTHING: Seen = Seen { depth: 0.0, patch: 0, first_index: 0 };

impl Seen {
    /// The nearer one; of two as near, the one that is drawn first.
    fn or(self, other: Seen) -> Seen {
        let first = (other.patch, other.first_index) < (self.patch, self.first_index);
        if other.depth > self.depth || (other.depth == self.depth && first) { other } else { self }
    }
}

/// A patch that the view may see.
struct Drawn<'a> {
    id: PatchId,
    /// See [`setback`].
    setback: f32,
    mesh: &'a PatchMesh,
    surface: &'a PatchSurface,
    placement: Placement,
    corners: Vec<Projected>,
    /// See [`HeldSurfaces::is_one_sided`].
    is_one_sided: bool,
}

/// A corner on the screen.
#[derive(Debug, Clone, Copy)]
struct Projected {
    /// In 1/256 of a pixel; `None` where it is not in front of the near plane, or far off the screen.
    at: Option<[i32; 2]>,
    depth: f32,
    /// A bit a plane of the view's pyramid that it lies outside of. A triangle whose corners share one is not seen.
    outside: u8,
}

/// The output's projection.
struct Screen {
    camera: Pinhole,
    scale: [f32; 2],
    shift: [f32; 2],
    near_m: f32,
    size_px: [f32; 2],
}

/// What everything held looks like from `camera`. Patches that lie on a GPU are left out.
pub(super) fn view(surfaces: &HeldSurfaces, camera: &Pinhole) -> AddressView {
    let screen = Screen::new(camera);
    let eye_from_world = camera.world_from_eye.inverse().to_affine();
    let patches: Vec<_> = surfaces.patches().filter(|(_, surface)| surface.may_be_seen_from(camera)).collect();
    let drawn: Vec<Drawn<'_>> = patches
        .into_par_iter()
        .filter_map(|(id, surface)| {
            let QuadBuffers::Host(mesh) = &surface.quads else { return None };
            let placement = Placement::new(surfaces, surface, &eye_from_world);
            let setback = setback(surface);
            let project =
                |vertex: &Vertex| screen.projected(set_back(screen.clip(vertex, surface, &placement), setback));
            let corners = mesh.vertices.par_iter().with_min_len(CHUNK_QUADS).map(project).collect();
            Some(Drawn { id, setback, mesh, surface, placement, corners, is_one_sided: surfaces.is_one_sided(surface) })
        })
        .collect();
    let seen = nearest(&drawn, &screen);
    let width = camera.width_px as usize;
    let texel = |(index, seen): (usize, &Seen)| {
        let pixel = DVec2::new((index % width) as f64, (index / width) as f64) + 0.5;
        if seen.depth > 0.0 {
            drawn[seen.patch as usize].texel(seen.first_index as usize, pixel, &screen)
        } else {
            AddressTexel::default()
        }
    };
    let texels = seen.par_iter().enumerate().with_min_len(CHUNK_QUADS).map(texel).collect();
    AddressView { size_px: (camera.width_px, camera.height_px), texels }
}

/// The nearest triangle of every pixel. Each thread draws every so manieth chunk of quads into an image of its own.
fn nearest(drawn: &[Drawn<'_>], screen: &Screen) -> Vec<Seen> {
    let chunks: Vec<(u32, Range<usize>)> = drawn
        .iter()
        .zip(0..)
        .flat_map(|(patch, index)| {
            let quads = patch.mesh.indices.len() / QUAD_INDICES;
            (0..quads).step_by(CHUNK_QUADS).map(move |first| (index, first..quads.min(first + CHUNK_QUADS)))
        })
        .collect();
    let threads = rayon::current_num_threads().min(chunks.len().max(1));
    let pixels = screen.camera.width_px as usize * screen.camera.height_px as usize;
    let draw = |thread: usize| {
        let mut image = Image { screen, seen: vec![NOTHING; pixels] };
        for (patch, quads) in chunks.iter().skip(thread).step_by(threads) {
            image.draw(&drawn[*patch as usize], *patch, quads.clone());
        }
        image.seen
    };
    let merge = |mut a: Vec<Seen>, b: Vec<Seen>| {
        a.iter_mut().zip(b).for_each(|(a, b)| *a = a.or(b));
        a
    };
    (0..threads).into_par_iter().map(draw).reduce_with(merge).unwrap_or_else(|| vec![NOTHING; pixels])
}

impl Screen {
    fn new(camera: &Pinhole) -> Screen {
        let clip_from_eye = camera.clip_from_eye();
        Screen {
            camera: *camera,
            scale: [clip_from_eye.x_axis.x, clip_from_eye.y_axis.y],
            shift: [clip_from_eye.z_axis.x, clip_from_eye.z_axis.y],
            near_m: camera.near_m as f32,
            size_px: [camera.width_px as f32, camera.height_px as f32],
        }
    }

    /// A corner in clip space, as the vertex stage computes it.
    fn clip(&self, vertex: &Vertex, surface: &PatchSurface, placement: &Placement) -> [f32; 4] {
        let mover = mover_of(vertex).and_then(|index| placement.movers.get(index));
        let rows = mover.map_or(&placement.eye_from_patch, |mover| &mover.eye_from_patch);
        let (centre_px, focal_px) = (surface.camera.centre_px.as_vec2(), surface.camera.focal_px as f32);
        let point = [(vertex.u_px - centre_px.x) / focal_px, (vertex.v_px - centre_px.y) / focal_px, 1.0, vertex.w];
        let [x, y, z] = rows.map(|row| row[0] * point[0] + row[1] * point[1] + row[2] * point[2] + row[3] * point[3]);
        [self.scale[0] * x + self.shift[0] * z, self.scale[1] * y + self.shift[1] * z, self.near_m * vertex.w, z]
    }

    fn projected(&self, [x, y, z, w]: [f32; 4]) -> Projected {
        let is_inside = z <= w && x.abs() <= GUARD * w && y.abs() <= GUARD * w && z > 0.0;
        // Rounds, without a call into the maths library.
        let snapped = |value: f32| (value * SUBPIXELS + 0.5_f32.copysign(value)) as i32;
        let on_screen =
            || [snapped((x / w + 1.0) / 2.0 * self.size_px[0]), snapped((1.0 - y / w) / 2.0 * self.size_px[1])];
        let outside = [z > w, x > w, -x > w, y > w, -y > w].into_iter().fold(0, |bits, is| bits << 1 | u8::from(is));
        Projected { at: is_inside.then(on_screen), depth: z / w, outside }
    }

    /// A pixel's point in normalized device coordinates.
    fn ndc(&self, pixel: DVec2) -> DVec2 {
        let size_px = DVec2::new(self.size_px[0].into(), self.size_px[1].into());
        (pixel / size_px * 2.0 - 1.0) * DVec2::new(1.0, -1.0)
    }
}

/// The place of a corner's moving object in its patch.
fn mover_of(vertex: &Vertex) -> Option<usize> {
    ((vertex.corner_normal_mover >> 16) as usize).checked_sub(1)
}

/// What one thread drew.
struct Image<'a> {
    screen: &'a Screen,
    seen: Vec<Seen>,
}

impl Image<'_> {
    fn draw(&mut self, drawn: &Drawn<'_>, patch: u32, quads: Range<usize>) {
        for first_index in (quads.start * QUAD_INDICES..quads.end * QUAD_INDICES).step_by(3) {
            let indices = drawn.triangle(first_index);
            if indices[0] == indices[1] {
                continue; // Deleted.
            }
            let corners = indices.map(|index| drawn.corners[index]);
            if corners[0].outside & corners[1].outside & corners[2].outside != 0 {
                continue;
            }
            let of = Seen { depth: 0.0, patch, first_index: first_index as u32 };
            if let [Some(a), Some(b), Some(c)] = corners.map(|corner| corner.at) {
                self.triangle([a, b, c], corners.map(|corner| corner.depth), drawn.is_one_sided, of);
            } else {
                self.cut(
                    indices.map(|index| set_back(drawn.clip(index, self.screen), drawn.setback)),
                    drawn.is_one_sided,
                    of,
                );
            }
        }
    }

    /// Draws what of a triangle lies in front of the near plane and not far off the screen.
    fn cut(&mut self, triangle: [[f32; 4]; 3], is_one_sided: bool, of: Seen) {
        // Inside where not negative.
        let planes: [fn(&[f32; 4]) -> f32; 5] = [
            |[_, _, z, w]| w - z,
            |[x, _, _, w]| GUARD * w - x,
            |[x, _, _, w]| GUARD * w + x,
            |[_, y, _, w]| GUARD * w - y,
            |[_, y, _, w]| GUARD * w + y,
        ];
        let mut polygon = triangle.to_vec();
        for distance in planes {
            let next = polygon.iter().cycle().skip(1);
            let mut kept = Vec::with_capacity(polygon.len() + 1);
            for (a, b) in polygon.iter().zip(next) {
                let (from, to) = (distance(a), distance(b));
                if from >= 0.0 {
                    kept.push(*a);
                }
                if (from >= 0.0) != (to >= 0.0) {
                    let share = from / (from - to);
                    kept.push(std::array::from_fn(|i| a[i] + share * (b[i] - a[i])));
                }
            }
            polygon = kept;
        }
        // A corner on a plane may have been rounded to the other side of it.
        let corner = |[x, y, z, w]: [f32; 4]| {
            let w = w.max(z);
            self.screen.projected([x.clamp(-GUARD * w, GUARD * w), y.clamp(-GUARD * w, GUARD * w), z, w])
        };
        let corners: Vec<Projected> = polygon.into_iter().map(corner).collect();
        for index in 2..corners.len() {
            let fan = [corners[0], corners[index - 1], corners[index]];
            if let [Some(a), Some(b), Some(c)] = fan.map(|corner| corner.at) {
                self.triangle([a, b, c], fan.map(|corner| corner.depth), is_one_sided, of);
            }
        }
    }

    fn triangle(&mut self, [a, mut b, mut c]: [[i32; 2]; 3], depths: [f32; 3], is_one_sided: bool, of: Seen) {
        let [depth_a, mut depth_b, mut depth_c] = depths;
        let (width, height) = (self.screen.camera.width_px as i32, self.screen.camera.height_px as i32);
        // Pixels whose centres, at 128 of 256, lie within the box.
        let first = |axis: usize| ((a[axis].min(b[axis]).min(c[axis]) + 127) >> 8).max(0);
        let end = |axis: usize, length: i32| (((a[axis].max(b[axis]).max(c[axis]) + 128) >> 8).min(length)).max(0);
        let (xs, ys) = (first(0)..end(0, width), first(1)..end(1, height));
        if xs.is_empty() || ys.is_empty() {
            return;
        }
        let area = edge(a, b, c);
        // As y points down, the area is negative where the corners run counter-clockwise: seen from the front.
        if area == 0 || (is_one_sided && area > 0) {
            return;
        }
        if area < 0 {
            std::mem::swap(&mut b, &mut c);
            std::mem::swap(&mut depth_b, &mut depth_c);
        }
        let edges = [(b, c), (c, a), (a, b)];
        let bias = edges.map(|(from, to)| if owns_its_line(from, to) { 0 } else { -1 });
        let [to_a, to_b, to_c] = [depth_a, depth_b, depth_c].map(|depth| depth / area.abs() as f32);
        for y in ys {
            for x in xs.clone() {
                let centre = [(x << 8) + 128, (y << 8) + 128];
                let inside = edges.map(|(from, to)| edge(from, to, centre));
                if (0..3).all(|side| inside[side] + bias[side] >= 0) {
                    let depth = inside[0] as f32 * to_a + inside[1] as f32 * to_b + inside[2] as f32 * to_c;
                    let seen = &mut self.seen[(y * width + x) as usize];
                    if depth > seen.depth {
                        *seen = Seen { depth, ..of };
                    }
                }
            }
        }
    }
}

/// A corner in clip space with the depth that is tested, see `set_back` in `surface/quads.wgsl`.
fn set_back([x, y, z, w]: [f32; 4], setback: f32) -> [f32; 4] {
    if w <= 0.0 {
        return [x, y, z, w];
    }
    [x, y, z * (1.0 - (setback / w).min(0.5) * (1.0 - z / w)), w]
}

/// Twice the area of the triangle from an edge to a point: positive to the right of the edge, as y points down.
fn edge(from: [i32; 2], to: [i32; 2], point: [i32; 2]) -> i64 {
    let along = [i64::from(to[0]) - i64::from(from[0]), i64::from(to[1]) - i64::from(from[1])];
    let across = [i64::from(point[0]) - i64::from(from[0]), i64::from(point[1]) - i64::from(from[1])];
    along[0] * across[1] - along[1] * across[0]
}

/// Whether pixel centres on an edge belong to its triangle: on top and left edges.
fn owns_its_line(from: [i32; 2], to: [i32; 2]) -> bool {
    to[1] < from[1] || (to[1] == from[1] && to[0] > from[0])
}

impl Drawn<'_> {
    fn triangle(&self, first_index: usize) -> [usize; 3] {
        std::array::from_fn(|corner| self.mesh.indices[first_index + corner] as usize)
    }

    fn clip(&self, index: usize, screen: &Screen) -> [f32; 4] {
        screen.clip(&self.mesh.vertices[index], self.surface, &self.placement)
    }

    /// What a triangle shows at a pixel's centre.
    fn texel(&self, first_index: usize, pixel: DVec2, screen: &Screen) -> AddressTexel {
        let indices = self.triangle(first_index);
        let shares = perspective_shares(indices.map(|index| self.clip(index, screen)), screen.ndc(pixel));
        let vertices = indices.map(|index| &self.mesh.vertices[index]);
        let mean = |of: fn(&Vertex) -> f32| (0..3).map(|i| shares.of_corners[i] * of(vertices[i])).sum::<f32>();
        let quad = &self.mesh.vertices[self.mesh.indices[first_index - first_index % QUAD_INDICES] as usize];
        let (x, y) = (quad.pixel & 0xffff, quad.pixel >> 16);
        // 1 at the centre of the quad, 0 on its border.
        let tent = |at: f32, first: u32| (1.0 - (2.0 * (at - first as f32) - 1.0).abs()).clamp(0.0, 1.0);
        let tent = tent(mean(|vertex| vertex.u_px), x) * tent(mean(|vertex| vertex.v_px), y);
        let of_corners: Vec3 =
            (0..3).map(|i| shares.of_corners[i] * self.normal_now(vertices[i], vertices[i].corner_normal_mover)).sum();
        let normal = of_corners.lerp(self.normal_now(quad, quad.normal_object), tent);
        let code = u32::from(u16::from_le_bytes(octahedral_code(normal)));
        AddressTexel {
            patch: self.id.0,
            pixel: quad.pixel,
            normal_object: code | (quad.normal_object & 0xffff_0000),
            w_bits: ((shares.depth / f64::from(screen.near_m)) as f32).to_bits(),
        }
    }

    /// The normal of a code, turned with the moving object of its corner.
    fn normal_now(&self, vertex: &Vertex, code: u32) -> Vec3 {
        let normal = octahedral_normal((code as u16).to_le_bytes());
        let mover = mover_of(vertex).and_then(|index| self.placement.movers.get(index));
        mover.map_or(normal, |mover| Vec3::from_array(mover.turn.map(|row| Vec3::from_slice(&row[..3]).dot(normal))))
    }
}

/// What the corners of a triangle contribute to a point of it, and the depth there.
struct Shares {
    of_corners: [f32; 3],
    depth: f64,
}

/// With the corners `c = (x, y, w)` of clip space a point `p = (x/w, y/w, 1)` has shares proportional to `p . (c_j × c_k)`. In f64:
/// corners of a small quad are nearly parallel.
fn perspective_shares(corners: [[f32; 4]; 3], ndc: DVec2) -> Shares {
    let homogeneous = corners.map(|[x, y, _, w]| DVec3::new(x.into(), y.into(), w.into()));
    let [a, b, c] = homogeneous;
    let shares = [b.cross(c), c.cross(a), a.cross(b)].map(|normal| ndc.extend(1.0).dot(normal));
    let sum: f64 = shares.iter().sum();
    let shares = if sum == 0.0 { [1.0, 0.0, 0.0] } else { shares.map(|share| share / sum) };
    let mean = |of: [f64; 3]| (0..3).map(|i| shares[i] * of[i]).sum::<f64>();
    let depth = mean(corners.map(|corner| corner[2].into())) / mean(homogeneous.map(|corner| corner.z));
    Shares { of_corners: shares.map(|share| share as f32), depth }
}
