//! The pass on the processor: the twin of the vertex stage and of `address` in `surface/quads.wgsl`.
//!
//! Quads are about as large as pixels, and most of a software driver's time for such goes into what a triangle costs before its first
//! pixel. Here most end at once, beside the view or with no pixel's centre in their box. As GPUs do, corners are
//! snapped to 1/256 of a pixel and edges are exact integers with the top left rule, so neighbours leave no gap. First only the
//! nearest triangle of each pixel is found; what it shows is worked out once a pixel at the end.

use std::ops::Range;

use camera::Pinhole;
use glam::{DVec2, DVec3, Vec3, Vec4};
use protocol::PatchId;
use protocol::image::{octahedral_code, octahedral_normal_with_rest};
use rayon::prelude::*;

use super::view::{AddressTexel, AddressView};
use crate::held::HeldSurfaces;
use crate::mesh::QUAD_INDICES;
use crate::mesh::{PatchMesh, Vertex};
use crate::pass::setback;
use crate::patch::{PatchSurface, QuadBuffers};
use crate::placement::Placement;
use crate::tiles::Pyramid;

/// Steps a pixel is divided into.
const SUBPIXELS: f32 = 256.0;
/// Triangles that reach further out than this many half widths or heights from the middle are cut: edges stay exact in 64 bits.
const GUARD: f32 = 4.0;
/// Pixels that one thread takes at once.
const CHUNK_PX: usize = 4096;

/// An interpolated depth may be greater than that of the nearest corner by rounding: by a few of the 2^-24 of an f32.
const ROUNDED_UP: f32 = 1.0 + 1e-6;

/// Columns and rows.
type Pixels = (Range<usize>, Range<usize>);

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
    /// See [`HeldSurfaces::is_one_sided`].
    is_one_sided: bool,
}

/// Corners in clip space, one a lane; `z` may be set back.
#[derive(Debug, Clone, Copy)]
struct Clip {
    x: Vec4,
    y: Vec4,
    z: Vec4,
    w: Vec4,
}

/// The output's projection.
struct Screen {
    camera: Pinhole,
    scale: [f32; 2],
    shift: [f32; 2],
    near_m: f32,
    size_px: [f32; 2],
}

/// Samples of a tile that the view may see, of a patch by its place among the drawn ones.
type Rows<'a> = (u32, &'a [Range<usize>]);

/// What everything held looks like from `camera`. Patches that lie on a GPU are left out.
pub(super) fn view(surfaces: &HeldSurfaces, camera: &Pinhole) -> AddressView {
    let screen = Screen::new(camera);
    let eye_from_world = camera.world_from_eye.inverse().to_affine();
    let (mut drawn, mut rows) = (Vec::new(), Vec::new());
    for (id, surface) in surfaces.patches().filter(|(_, surface)| surface.may_be_seen_from(camera)) {
        let QuadBuffers::Host { mesh, tiles, .. } = &surface.quads else { continue };
        // What moves may have come into view.
        let pyramid = surface.objects.is_empty().then(|| Pyramid::new(&surface.camera, camera));
        rows.extend(tiles.rows_in(pyramid).map(|rows| (drawn.len() as u32, rows)));
        drawn.push(Drawn {
            id,
            setback: setback(surface, surfaces.is_for_eyes().then_some(camera)),
            mesh,
            surface,
            placement: Placement::new(surfaces, surface, &eye_from_world),
            is_one_sided: surfaces.is_one_sided(surface),
        });
    }
    let seen = nearest(&drawn, &rows, &screen);
    let width = camera.width_px as usize;
    let texel = |(index, seen): (usize, &Seen)| {
        let pixel = DVec2::new((index % width) as f64, (index / width) as f64) + 0.5;
        if seen.depth > 0.0 {
            drawn[seen.patch as usize].texel(seen.first_index as usize, pixel, &screen)
        } else {
            AddressTexel::default()
        }
    };
    let texels = seen.par_iter().enumerate().with_min_len(CHUNK_PX).map(texel).collect();
    AddressView { size_px: (camera.width_px, camera.height_px), texels }
}

/// The nearest triangle of every pixel. Each thread draws every so manieth tile into an image of its own.
fn nearest(drawn: &[Drawn<'_>], tiles: &[Rows<'_>], screen: &Screen) -> Vec<Seen> {
    let threads = rayon::current_num_threads().min(tiles.len().max(1));
    let pixels = screen.camera.width_px as usize * screen.camera.height_px as usize;
    let draw = |thread: usize| {
        let mut image = Image { screen, seen: vec![NOTHING; pixels] };
        // The latest are mostly the finest, which hide the others.
        for (patch, rows) in tiles.iter().rev().skip(thread).step_by(threads) {
            rows.iter().for_each(|row| image.draw(&drawn[*patch as usize], *patch, row.clone()));
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

    /// Corners of one quad in clip space, as the vertex stage computes them: all of them are of one object.
    fn clip(&self, corners: [&Vertex; 4], drawn: &Drawn<'_>) -> Clip {
        let mover = mover_of(corners[0]).and_then(|index| drawn.placement.movers.get(index));
        let rows = mover.map_or(&drawn.placement.eye_from_patch, |mover| &mover.eye_from_patch);
        let camera = &drawn.surface.camera;
        let (centre_px, focal_px) = (camera.centre_px.as_vec2(), camera.focal_px as f32);
        let [a, b, c, d] = corners;
        let across = (Vec4::new(a.u_px, b.u_px, c.u_px, d.u_px) - centre_px.x) / focal_px;
        let down = (Vec4::new(a.v_px, b.v_px, c.v_px, d.v_px) - centre_px.y) / focal_px;
        let w = Vec4::new(a.w, b.w, c.w, d.w);
        let [x, y, z] = rows.map(|row| row[0] * across + row[1] * down + row[2] + row[3] * w);
        Clip {
            x: self.scale[0] * x + self.shift[0] * z,
            y: self.scale[1] * y + self.shift[1] * z,
            z: self.near_m * w,
            w: z,
        }
    }

    /// Where on the screen corners are, in 1/256 of a pixel; all of them must be [`Clip::is_inside`].
    fn snapped(&self, clip: &Clip) -> [[i32; 2]; 4] {
        // Rounds, without a call into the maths library.
        let snapped = |at: Vec4| {
            let at = at * SUBPIXELS;
            (at + Vec4::splat(0.5).copysign(at)).to_array().map(|at| at as i32)
        };
        let x = snapped((clip.x / clip.w + 1.0) / 2.0 * self.size_px[0]);
        let y = snapped((1.0 - clip.y / clip.w) / 2.0 * self.size_px[1]);
        std::array::from_fn(|corner| [x[corner], y[corner]])
    }

    /// The pixels whose centres, at 128 of 256, lie within the box of some corners.
    fn pixels_in<const CORNERS: usize>(&self, corners: &[[i32; 2]; CORNERS]) -> Pixels {
        let pixels = |axis: usize, length: u32| {
            let (low, high) = corners
                .iter()
                .fold((i32::MAX, i32::MIN), |(low, high), corner| (low.min(corner[axis]), high.max(corner[axis])));
            ((low + 127) >> 8).max(0) as usize..((high + 128) >> 8).clamp(0, length as i32) as usize
        };
        (pixels(0, self.camera.width_px), pixels(1, self.camera.height_px))
    }

    /// A pixel's point in normalized device coordinates.
    fn ndc(&self, pixel: DVec2) -> DVec2 {
        let size_px = DVec2::new(self.size_px[0].into(), self.size_px[1].into());
        (pixel / size_px * 2.0 - 1.0) * DVec2::new(1.0, -1.0)
    }
}

impl Clip {
    fn new(corners: [[f32; 4]; 4]) -> Clip {
        let [x, y, z, w] = std::array::from_fn(|axis| Vec4::from_array(corners.map(|corner| corner[axis])));
        Clip { x, y, z, w }
    }

    /// By the depth that is tested, see `set_back` in `surface/quads.wgsl`.
    fn set_back(self, setback: f32) -> Clip {
        let nearer = 1.0 - (setback / self.w).min(Vec4::splat(0.5)) * (1.0 - self.z / self.w);
        Clip { z: Vec4::select(self.w.cmpgt(Vec4::ZERO), self.z * nearer, self.z), ..self }
    }

    /// Whether all corners lie in front of the near plane and not far off the screen.
    fn is_inside(&self) -> bool {
        let far_off = GUARD * self.w;
        let is_inside =
            self.z.cmple(self.w) & self.x.abs().cmple(far_off) & self.y.abs().cmple(far_off) & self.z.cmpgt(Vec4::ZERO);
        is_inside.all()
    }

    /// Whether some corners, of those in `lanes`, all lie outside of one plane of the view's pyramid.
    fn is_outside(&self, lanes: u32) -> bool {
        let outside = [
            self.z.cmpgt(self.w),
            self.x.cmpgt(self.w),
            (-self.x).cmpgt(self.w),
            self.y.cmpgt(self.w),
            (-self.y).cmpgt(self.w),
        ];
        outside.iter().any(|corners| corners.bitmask() & lanes == lanes)
    }

    fn corner(&self, lane: usize) -> [f32; 4] {
        [self.x[lane], self.y[lane], self.z[lane], self.w[lane]]
    }
}

/// The place of a corner's moving object in its patch.
fn mover_of(vertex: &Vertex) -> Option<usize> {
    ((vertex.corner_normal_mover >> 16) as usize).checked_sub(1)
}

/// Of a quad's four corners, those of its two triangles: see [`PatchMesh::indices`] where the first vertex is the provoking one.
const TRIANGLES: [[usize; 3]; 2] = [[0, 1, 2], [0, 3, 1]];

/// What one thread drew.
struct Image<'a> {
    screen: &'a Screen,
    seen: Vec<Seen>,
}

impl Image<'_> {
    fn draw(&mut self, drawn: &Drawn<'_>, patch: u32, quads: Range<usize>) {
        let indices = &drawn.mesh.indices[quads.start * QUAD_INDICES..quads.end * QUAD_INDICES];
        for (quad, indices) in quads.zip(indices.chunks_exact(QUAD_INDICES)) {
            if indices[0] == indices[1] {
                continue; // Deleted.
            }
            let corners = [0, 1, 2, 4].map(|corner| &drawn.mesh.vertices[indices[corner] as usize]);
            let clip = self.screen.clip(corners, drawn).set_back(drawn.setback);
            if clip.is_outside(0b1111) {
                continue;
            }
            let of =
                |triangle: usize| Seen { depth: 0.0, patch, first_index: (quad * QUAD_INDICES + 3 * triangle) as u32 };
            if clip.is_inside() {
                let (at, depths) = (self.screen.snapped(&clip), clip.z / clip.w);
                let pixels = self.screen.pixels_in(&at);
                if self.is_hidden(&pixels, depths.max_element()) {
                    continue;
                }
                for (triangle, corners) in TRIANGLES.iter().enumerate() {
                    let (at, depths) = (corners.map(|corner| at[corner]), corners.map(|corner| depths[corner]));
                    self.triangle(at, depths, &pixels, drawn.is_one_sided, of(triangle));
                }
            } else {
                for (triangle, corners) in TRIANGLES.iter().enumerate() {
                    if !clip.is_outside(corners.iter().map(|corner| 1 << corner).sum()) {
                        self.cut(corners.map(|corner| clip.corner(corner)), drawn.is_one_sided, of(triangle));
                    }
                }
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
        let on_plane = |[x, y, z, w]: [f32; 4]| {
            let w = w.max(z);
            [x.clamp(-GUARD * w, GUARD * w), y.clamp(-GUARD * w, GUARD * w), z, w]
        };
        let corners: Vec<[f32; 4]> = polygon.into_iter().map(on_plane).collect();
        for index in 2..corners.len() {
            let fan = Clip::new([corners[0], corners[index - 1], corners[index], corners[index]]);
            if fan.is_inside() {
                let ([a, b, c, _], [depth_a, depth_b, depth_c, _]) =
                    (self.screen.snapped(&fan), (fan.z / fan.w).to_array());
                let pixels = self.screen.pixels_in(&[a, b, c]);
                self.triangle([a, b, c], [depth_a, depth_b, depth_c], &pixels, is_one_sided, of);
            }
        }
    }

    /// Whether all of some pixels show what is nearer than a quad's nearest corner: then nothing of it is seen.
    fn is_hidden(&self, (columns, rows): &Pixels, nearest: f32) -> bool {
        let nearest = nearest * ROUNDED_UP;
        let row = |y: usize| &self.seen[y * self.screen.camera.width_px as usize..][columns.clone()];
        columns.is_empty() || rows.clone().all(|y| row(y).iter().all(|seen| seen.depth > nearest))
    }

    /// Draws what of a triangle lies on some pixels, which hold all of its own.
    fn triangle(
        &mut self,
        [a, mut b, mut c]: [[i32; 2]; 3],
        [depth_a, mut depth_b, mut depth_c]: [f32; 3],
        (columns, rows): &Pixels,
        is_one_sided: bool,
        of: Seen,
    ) {
        let area = edge(a, b, c);
        // As y points down, the area is negative where the corners run counter-clockwise: seen from the front.
        if area == 0 || (is_one_sided && area > 0) {
            return;
        }
        if area < 0 {
            std::mem::swap(&mut b, &mut c);
            std::mem::swap(&mut depth_b, &mut depth_c);
        }
        let area = area.abs();
        let bias = [(b, c), (c, a), (a, b)].map(|(from, to)| if owns_its_line(from, to) { 0 } else { -1 });
        let width = self.screen.camera.width_px as usize;
        for y in rows.clone() {
            for x in columns.clone() {
                let centre = [x, y].map(|at| ((at as i32) << 8) + 128);
                let (of_a, of_b) = (edge(b, c, centre), edge(c, a, centre));
                let of_c = area - of_a - of_b;
                if of_a + bias[0] >= 0 && of_b + bias[1] >= 0 && of_c + bias[2] >= 0 {
                    let share = |of_corner: i64, depth: f32| of_corner as f32 * (depth / area as f32);
                    let depth = share(of_a, depth_a) + share(of_b, depth_b) + share(of_c, depth_c);
                    let seen = &mut self.seen[y * width + x];
                    *seen = seen.or(Seen { depth, ..of });
                }
            }
        }
    }
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

    /// What a triangle shows at a pixel's centre.
    fn texel(&self, first_index: usize, pixel: DVec2, screen: &Screen) -> AddressTexel {
        let vertices = self.triangle(first_index).map(|index| &self.mesh.vertices[index]);
        let [a, b, c] = vertices;
        let clip = screen.clip([a, b, c, c], self);
        let shares = perspective_shares([0, 1, 2].map(|lane| clip.corner(lane)), screen.ndc(pixel));
        let mean = |of: fn(&Vertex) -> f32| (0..3).map(|i| shares.of_corners[i] * of(vertices[i])).sum::<f32>();
        let quad = &self.mesh.vertices[self.mesh.indices[first_index - first_index % QUAD_INDICES] as usize];
        let (x, y) = (quad.pixel & 0xffff, quad.pixel >> 16);
        // 1 at the centre of the quad, 0 on its border.
        let tent = |at: f32, first: u32| (1.0 - (2.0 * (at - first as f32) - 1.0).abs()).clamp(0.0, 1.0);
        let tent = tent(mean(|vertex| vertex.u_px), x) * tent(mean(|vertex| vertex.v_px), y);
        let of_corners: Vec3 =
            (0..3).map(|i| shares.of_corners[i] * self.normal_now(vertices[i], corner_normal(vertices[i]))).sum();
        let normal = of_corners.lerp(self.normal_now(quad, quad_normal(quad)), tent);
        let code = u32::from(u16::from_le_bytes(octahedral_code(normal)));
        AddressTexel {
            patch: self.id.0,
            pixel: quad.pixel,
            normal_object: code | (quad.normal_object & 0xffff_0000),
            w_bits: ((shares.depth / f64::from(screen.near_m)) as f32).to_bits(),
        }
    }

    /// A normal, turned with the moving object of its corner.
    fn normal_now(&self, vertex: &Vertex, normal: Vec3) -> Vec3 {
        let mover = mover_of(vertex).and_then(|index| self.placement.movers.get(index));
        mover.map_or(normal, |mover| Vec3::from_array(mover.turn.map(|row| Vec3::from_slice(&row[..3]).dot(normal))))
    }
}

fn quad_normal(vertex: &Vertex) -> Vec3 {
    octahedral_normal_with_rest((vertex.normal_object as u16).to_le_bytes(), vertex.normal_rests_level_end as u8)
}

fn corner_normal(vertex: &Vertex) -> Vec3 {
    octahedral_normal_with_rest(
        (vertex.corner_normal_mover as u16).to_le_bytes(),
        (vertex.normal_rests_level_end >> 8) as u8,
    )
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
