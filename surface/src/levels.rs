//! A patch's quads in square parts, each as finely as a view can tell: parts that a view does not see are passed over, and where
//! quads come smaller than its pixels one stands for 2 x 2, 4 x 4 or 8 x 8 of them. So drawing costs by pixels, not by what is held.
//!
//! Quads become one where they share all corners between them and lie in a plane as far as a pixel can tell; its colour and normal
//! are their means, as in a texture's mip levels. What does not (outlines, twigs) is drawn as finely as it is held at every level.

use std::array;
use std::ops::Range;

use camera::Pinhole;
use glam::{DVec2, DVec3, Vec3};
use protocol::{Mask, image};

use crate::mesh::{END, PatchMesh, ProvokingVertex, QUAD_INDICES, Vertex};
use crate::tiles::{Bounds, Pyramid};

/// Pixels of a part's side: so small that a part at the rim of a view is mostly seen and has one distance, and that its quads outweigh a draw call.
const SIDE_PX: u32 = 16;
/// Quads over 1, 2, 4 and 8 samples along a side; [`SIDE_PX`] is a multiple.
const LEVELS: usize = 4;
/// The corners that vanish between four quads lie off the middle of those that stay by no more than this share of the new quad's side in the image ...
const MOST_BEND_ACROSS: f32 = 0.125;
/// ... and along the ray by no more than this share: what is coded in steps is rough.
const MOST_BEND_ALONG: f32 = 0.25;
/// A level is drawn where what its quads bend along rays comes to no more pixels than this, so that cracks beside finer quads stay far below one.
const MOST_BEND_PX: f64 = 0.125;
/// A level is kept where it has no more than this share of the quads of the one before.
const WORTHWHILE: f64 = 0.75;
/// A level is drawn where the longest side of its quads comes to no more pixels than this: they are from half of a pixel large to two. Of a machine full of ribs, held
/// with up to two samples a pixel, FLIP is the same with 1, the square root of 2 and 2.
const LONGEST_PX: f64 = std::f64::consts::SQRT_2;
/// A part of fewer samples has but its finest level.
const FEWEST: usize = 64;

/// One square part of a patch.
#[derive(Debug, Clone)]
struct Part {
    /// Around its corners.
    bounds: Bounds,
    /// Around the planes of its triangles.
    planes: Planes,
    /// Whether something in it may have moved since.
    moves: bool,
    /// From the finest on; never empty.
    levels: Vec<Level>,
}

/// How a view shows a part.
#[derive(Debug, Clone, Copy)]
struct Seen {
    /// Pixels of the view at most that one of the patch's image comes to.
    px_of_px: f64,
    /// Pixels of the patch's image at most that a length along the ray comes to, which is as long as its depth.
    along_px: f64,
}

impl Seen {
    /// `eye`: the view's, in the patch's eye space. From beside, what lies along a ray is seen under the angle between that ray and the eye's own, whose sine is no
    /// more than the eye's distance from the ray over that from the point.
    fn new(part: &Part, (pyramid, eye): (&Pyramid, DVec3), (view, camera): (&Pinhole, &Pinhole)) -> Seen {
        let nearer = pyramid.least_depth_share(&part.bounds).max(0.0);
        let sine = (eye.length() * part.bounds.nearest_w() / nearer).min(1.0);
        let corner_px = DVec2::new(camera.width_px.into(), camera.height_px.into());
        let farthest_px = camera.centre_px.max(corner_px - camera.centre_px).length();
        Seen { px_of_px: view.focal_px / camera.focal_px / nearer, along_px: sine * camera.focal_px.hypot(farthest_px) }
    }
}

/// A box around planes, each as the vector `n` with `n . p = 1` for all of its points `p`, in the eye space of the patch at capture: the patch's
/// own eye has `n . p = 0`, and is before all of them.
#[derive(Debug, Clone, Copy)]
struct Planes {
    low: DVec3,
    high: DVec3,
}

impl Planes {
    const NONE: Planes = Planes { low: DVec3::INFINITY, high: DVec3::NEG_INFINITY };

    /// With the planes of a quad's two triangles: its corners are given in the image, as [`ProvokingVertex::corners`] has them.
    fn with(self, [a, b, c, d]: [Vec3; 4], camera: &Pinhole) -> Planes {
        [[a, d, b], [a, c, d]].into_iter().fold(self, |around, [a, b, c]| {
            // `w` is linear in the image: `w = n . ray`.
            let (to_b, to_c) = ((b - a).as_dvec3(), (c - a).as_dvec3());
            let area = to_b.x * to_c.y - to_b.y * to_c.x;
            let right = (to_b.z * to_c.y - to_c.z * to_b.y) / area * camera.focal_px;
            let down = (to_c.z * to_b.x - to_b.z * to_c.x) / area * camera.focal_px;
            let ray = camera.ray_eye_from_image(a.x.into(), a.y.into());
            let n = DVec3::new(right, down, f64::from(a.z) - right * ray.x - down * ray.y);
            // A triangle without an area shows nothing.
            if area == 0.0 { around } else { Planes { low: around.low.min(n), high: around.high.max(n) } }
        })
    }

    /// Whether an eye lies behind all of them, or there are none.
    fn are_all_before(&self, eye: DVec3) -> bool {
        // Products of nothing and infinity are no numbers; nor is any comparison with them true.
        self.low.x > self.high.x || (self.low * eye).min(self.high * eye).element_sum() >= 1.0
    }
}

/// The quads of a part at a level.
#[derive(Debug, Clone)]
struct Level {
    /// Their indices.
    indices: Range<u32>,
    /// Of those that stand for several.
    most: Coarseness,
}

/// How coarse quads are at most, seen from where they were captured.
#[derive(Debug, Clone, Copy, Default)]
struct Coarseness {
    /// Their sides across the ray, in pixels of the patch's image.
    across_px: f32,
    /// How much nearer the one end of a side is than the other, as a share of its depth: what an eye beside sees of it.
    along: f32,
    /// How far they bend along the ray, likewise.
    bend: f32,
}

impl Coarseness {
    /// The most of both, with a quad between four corners in the image that bends by so much.
    fn with(self, [a, b, c, d]: [Vec3; 4], bend: f32) -> Coarseness {
        let most = Coarseness { bend: self.bend.max(bend), ..self };
        [(a, b), (a, c), (b, d), (c, d)].into_iter().fold(most, |most, (from, to)| {
            let across_px = from.truncate().distance(to.truncate());
            let along = (from.z - to.z).abs() / from.z.min(to.z);
            Coarseness { across_px: most.across_px.max(across_px), along: most.along.max(along), ..most }
        })
    }

    /// Whether a view cannot tell.
    fn is_unseen(self, seen: &Seen) -> bool {
        let along_px = |along: f32| f64::from(along) * seen.along_px * seen.px_of_px;
        f64::from(self.across_px) * seen.px_of_px + along_px(self.along) <= LONGEST_PX
            && along_px(self.bend) <= MOST_BEND_PX
    }
}

/// The parts of a patch.
#[derive(Debug, Clone, Default)]
pub struct Parts {
    parts: Vec<Part>,
    /// By sample: its part, and the place of its quad among the quads.
    places: Vec<[u32; 2]>,
}

impl Parts {
    /// Sorts the quads of a mesh, in the order of its samples so far, by parts; with `coarsens` quads of further levels follow behind all of them, and their
    /// first vertices behind all vertices.
    pub fn of(
        mesh: &mut PatchMesh,
        mask: &Mask,
        (camera, provoking, coarsens): (&Pinhole, ProvokingVertex, bool),
    ) -> Parts {
        if !mesh.is_of_samples {
            return Parts::whole(mesh);
        }
        let quads: Vec<[u32; 4]> =
            mesh.indices.chunks_exact(QUAD_INDICES).map(|quad| provoking.corners(quad)).collect();
        let sorted = by_part(mask);
        let mut parts = Parts { parts: Vec::with_capacity(sorted.len()), places: vec![[0; 2]; quads.len()] };
        // Further levels have at most a third as many quads and vertices of their own, where they are worth it.
        let further = if coarsens { quads.len() / 3 } else { 0 };
        mesh.indices = Vec::with_capacity((quads.len() + further) * QUAD_INDICES);
        mesh.vertices.reserve(further);
        for (samples, number) in sorted.iter().zip(0..) {
            let first = mesh.indices.len() as u32;
            for &(sample, _) in samples {
                parts.places[sample as usize] = [number, (mesh.indices.len() / QUAD_INDICES) as u32];
                mesh.indices.extend(provoking.indices(quads[sample as usize]));
            }
            let quads = samples.iter().map(|&(sample, _)| quads[sample as usize]);
            let finest = Level { indices: first..mesh.indices.len() as u32, most: Coarseness::default() };
            parts.parts.push(part(mesh, camera, quads, finest));
        }
        if coarsens {
            parts.coarsen(mesh, &sorted, &quads, (camera, provoking));
        }
        parts
    }

    /// One part for all of a mesh that is not of quads of samples: every view draws it whole, and no sample of it can be deleted.
    fn whole(mesh: &PatchMesh) -> Parts {
        let finest = Level { indices: 0..mesh.indices.len() as u32, most: Coarseness::default() };
        let all = Part { bounds: Bounds::around([]), planes: Planes::NONE, moves: true, levels: vec![finest] };
        Parts { parts: vec![all], places: Vec::new() }
    }

    /// Levels lie behind each other, so that neighbours at one level are drawn at once.
    fn coarsen(
        &mut self,
        mesh: &mut PatchMesh,
        sorted: &[Vec<(u32, [u32; 2])>],
        quads: &[[u32; 4]],
        (camera, provoking): (&Pinhole, ProvokingVertex),
    ) {
        let still = self.parts.iter_mut().zip(sorted).filter(|(part, samples)| !part.moves && samples.len() >= FEWEST);
        let mut stacks: Vec<(&mut Part, Stack)> =
            still.map(|(part, samples)| (part, Stack::of(mesh, samples, quads, camera))).collect();
        for level in 1..LEVELS {
            for (part, stack) in &mut stacks {
                stack.write(level, mesh, provoking, &mut part.levels);
            }
        }
    }

    /// The indices of what a view sees, in ascending order as long as levels are alike; `camera` is the patch's. With `coarsens` quads are no finer than the view's
    /// pixels ask for; of one side, they show nothing from behind.
    pub fn seen_from(&self, view: &Pinhole, camera: &Pinhole, (coarsens, one_sided): (bool, bool)) -> Vec<Range<u32>> {
        let pyramid = Pyramid::new(camera, view);
        let eye = camera.world_from_eye.inverse().transform_point(view.world_from_eye.translation);
        let mut ranges: Vec<Range<u32>> = Vec::new();
        for part in &self.parts {
            let is_turned_away = one_sided && part.planes.are_all_before(eye);
            if !part.moves && (is_turned_away || !pyramid.may_see(&part.bounds)) {
                continue;
            }
            let coarser = if coarsens { &part.levels[1..] } else { &[] };
            let seen = Seen::new(part, (&pyramid, eye), (view, camera));
            let level = coarser.iter().rev().find(|level| level.most.is_unseen(&seen)).unwrap_or(&part.levels[0]);
            match ranges.last_mut() {
                Some(last) if last.end == level.indices.start => last.end = level.indices.end,
                _ => ranges.push(level.indices.clone()),
            }
        }
        ranges
    }

    /// The place among the quads of a sample, whose quad has other corners from now on; `None` of a mesh that is not of samples. Its part is drawn as finely as it is held
    /// from now on; `camera` is the patch's.
    pub fn redraw(&mut self, sample: usize, corners: [Vec3; 4], camera: &Pinhole) -> Option<u32> {
        let &[part, place] = self.places.get(sample)?;
        let part = &mut self.parts[part as usize];
        part.levels.truncate(1);
        part.bounds = part.bounds.and(Bounds::around(corners));
        part.planes = part.planes.with(corners, camera);
        Some(place)
    }

    /// The places among the quads of some samples, ascending. Their parts are drawn as finely as they are held from now on: quads of other levels show these samples too.
    pub fn delete(&mut self, samples: impl Iterator<Item = usize>) -> Vec<u32> {
        let mut places: Vec<u32> = samples
            .filter_map(|sample| self.places.get(sample))
            .map(|&[part, place]| {
                self.parts[part as usize].levels.truncate(1);
                place
            })
            .collect();
        places.sort_unstable();
        places
    }
}

/// Samples by their parts, each with its pixel within the part; parts row by row.
fn by_part(mask: &Mask) -> Vec<Vec<(u32, [u32; 2])>> {
    let (width_px, height_px) = mask.size_px();
    let columns = width_px.div_ceil(SIDE_PX);
    let mut parts = vec![Vec::new(); (columns * height_px.div_ceil(SIDE_PX)) as usize];
    for ((x, y), sample) in mask.occupied().zip(0..) {
        parts[(y / SIDE_PX * columns + x / SIDE_PX) as usize].push((sample, [x % SIDE_PX, y % SIDE_PX]));
    }
    parts.retain(|part| !part.is_empty());
    parts
}

fn part(mesh: &PatchMesh, camera: &Pinhole, quads: impl Iterator<Item = [u32; 4]>, finest: Level) -> Part {
    let (mut bounds, mut planes, mut moves) = (Bounds::around([]), Planes::NONE, false);
    for quad in quads {
        let vertices = quad.map(|corner| &mesh.vertices[corner as usize]);
        let corners = vertices.map(Vertex::image);
        bounds = bounds.and(Bounds::around(corners));
        planes = planes.with(corners, camera);
        moves |= vertices.iter().any(|vertex| vertex.corner_normal_mover >> 16 != 0);
    }
    Part { bounds, planes, moves, levels: vec![finest] }
}

/// A quad of one level or another.
#[derive(Debug, Clone, Copy)]
struct Quad {
    /// Top left, top right, bottom left, bottom right, among the corners of samples.
    corners: [u32; 4],
    /// What is drawn as its top left vertex, and bears what is flat.
    first: u32,
}

/// The quads of a part at all levels.
struct Stack {
    /// By level and cell, row by row.
    quads: [Vec<Option<Quad>>; LEVELS],
    most: [Coarseness; LEVELS],
}

fn side(level: usize) -> usize {
    SIDE_PX as usize >> level
}

impl Stack {
    /// Of some samples, with the corners of each; vertices that further quads need are added.
    fn of(mesh: &mut PatchMesh, samples: &[(u32, [u32; 2])], corners: &[[u32; 4]], camera: &Pinhole) -> Stack {
        let mut quads: [Vec<Option<Quad>>; LEVELS] = array::from_fn(|level| vec![None; side(level) * side(level)]);
        for &(sample, [x, y]) in samples {
            let corners = corners[sample as usize];
            quads[0][y as usize * side(0) + x as usize] = Some(Quad { corners, first: corners[0] });
        }
        let mut most = [Coarseness::default(); LEVELS];
        for level in 1..LEVELS {
            most[level] = most[level - 1];
            for cell in 0..side(level) * side(level) {
                let [Some(a), Some(b), Some(c), Some(d)] = children(level, cell).map(|child| quads[level - 1][child])
                else {
                    continue;
                };
                if let Some((quad, bend)) = joined(mesh, camera, [a, b, c, d], level) {
                    let corners = quad.corners.map(|corner| mesh.vertices[corner as usize].image());
                    most[level] = most[level].with(corners, bend);
                    quads[level][cell] = Some(quad);
                }
            }
        }
        Stack { quads, most }
    }

    /// Writes a level behind all indices, if it is worth it.
    fn write(&self, level: usize, mesh: &mut PatchMesh, provoking: ProvokingVertex, levels: &mut Vec<Level>) {
        let first = mesh.indices.len();
        for cell in 0..side(level) * side(level) {
            self.write_cell(level, cell, &mut |quad| {
                let [_, right, below, across] = quad.corners;
                mesh.indices.extend(provoking.indices([quad.first, right, below, across]));
            });
        }
        let (written, before) = (mesh.indices.len() - first, levels.last().map_or(0, |level| level.indices.len()));
        if written as f64 > WORTHWHILE * before as f64 {
            mesh.indices.truncate(first);
        } else {
            let indices = first as u32..mesh.indices.len() as u32;
            levels.push(Level { indices, most: self.most[level] });
        }
    }

    /// What a cell shows: its own quad, or what the levels before have there.
    fn write_cell(&self, level: usize, cell: usize, write: &mut impl FnMut(Quad)) {
        match self.quads[level][cell] {
            Some(quad) => write(quad),
            None if level > 0 => {
                children(level, cell).into_iter().for_each(|child| self.write_cell(level - 1, child, write));
            }
            None => {}
        }
    }
}

/// The four cells of the level before that a cell covers.
fn children(level: usize, cell: usize) -> [usize; 4] {
    let (x, y) = (cell % side(level), cell / side(level));
    let first = 2 * y * side(level - 1) + 2 * x;
    [first, first + 1, first + side(level - 1), first + side(level - 1) + 1]
}

/// One quad in place of four, where they are of one flat surface, and how far they bend along the ray, as a share of its depth.
fn joined(mesh: &mut PatchMesh, camera: &Pinhole, four: [Quad; 4], level: usize) -> Option<(Quad, f32)> {
    let [a, b, c, d] = four.map(|quad| quad.corners);
    let is_shared = [a[3], b[2], c[1]] == [d[0]; 3] && (a[1], a[2]) == (b[0], c[0]) && (b[3], c[3]) == (d[1], d[2]);
    let firsts = four.map(|quad| mesh.vertices[quad.first as usize]);
    let material = |vertex: &Vertex| vertex.colour_material >> 24;
    if !is_shared || firsts.iter().any(|first| material(first) != material(&firsts[0])) {
        return None;
    }
    let corners = [a[0], b[1], c[2], d[3]];
    let at = |corner: u32| mesh.vertices[corner as usize].image();
    let [p, q, r, s] = corners.map(at);
    let middles = [(a[1], (p + q) / 2.0), (a[2], (p + r) / 2.0), (d[1], (q + s) / 2.0), (d[2], (r + s) / 2.0)];
    let middles = middles.into_iter().chain([(a[3], (p + q + r + s) / 4.0)]);
    let bend = middles.fold(Vec3::ZERO, |most, (corner, middle)| {
        let off = (at(corner) - middle).abs();
        most.max(Vec3::new(off.x, off.y, off.z / middle.z))
    });
    let side_px = (1 << level) as f32;
    // Not for NaN either.
    let is_flat = bend.x.max(bend.y) <= MOST_BEND_ACROSS * side_px
        && bend.z * camera.focal_px as f32 <= MOST_BEND_ALONG * side_px;
    is_flat.then(|| {
        let first = mesh.vertices.len() as u32;
        mesh.vertices.push(first_vertex(&mesh.vertices[corners[0] as usize], &firsts, level));
        (Quad { corners, first }, bend.z)
    })
}

/// A corner that bears the means of what is flat over four quads.
fn first_vertex(corner: &Vertex, four: &[Vertex; 4], level: usize) -> Vertex {
    let mean = |byte: usize| {
        let sum: u32 = four.iter().map(|quad| u32::from(quad.colour_material.to_le_bytes()[byte])).sum();
        ((sum + 2) / 4) << (8 * byte)
    };
    let normal_of = |quad: &Vertex| {
        image::octahedral_normal_with_rest((quad.normal_object as u16).to_le_bytes(), quad.normal_rests_level_end as u8)
    };
    let code = |quad: &Vertex| (quad.normal_object as u16, quad.normal_rests_level_end as u8);
    let (normal, rest) = if four.iter().all(|quad| code(quad) == code(&four[0])) {
        code(&four[0])
    } else {
        let normal: Vec3 = four.iter().map(normal_of).sum();
        let has_rests = four.iter().any(|quad| code(quad).1 != 0);
        let rest = if has_rests { image::octahedral_rest(normal) } else { 0 };
        (u16::from_le_bytes(image::octahedral_code(normal)), rest)
    };
    Vertex {
        colour_material: mean(0) | mean(1) | mean(2) | four[0].colour_material & 0xff00_0000,
        normal_object: u32::from(normal) | four[0].normal_object & 0xffff_0000,
        pixel: four[0].pixel,
        normal_rests_level_end: corner.normal_rests_level_end & (END | 0xff00) | u32::from(rest) | (level as u32) << 16,
        ..*corner
    }
}
