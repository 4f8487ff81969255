//! A patch's quads in square parts, each as finely as a view can tell: parts that a view does not see are passed over, and where
//! quads come smaller than its pixels one stands for 2 x 2, 4 x 4 or 8 x 8 of them. So drawing costs by pixels, not by what is held.
//!
//! Quads become one where they share all corners between them and lie in a plane as far as a pixel can tell; its colour and normal
//! are their means, as in a texture's mip levels. What does not (outlines, twigs) is drawn as finely as it is held at every level.

use std::array;
use std::ops::Range;

use camera::Pinhole;
use glam::Vec3;
use protocol::{Mask, image};

use crate::mesh::{PatchMesh, ProvokingVertex, QUAD_INDICES, Vertex};
use crate::tiles::{Bounds, Pyramid};

/// Pixels of a part's side: so small that a part at the rim of a view is mostly seen and has one distance, and that its quads outweigh a draw call.
const SIDE_PX: u32 = 32;
/// Quads over 1, 2, 4 and 8 samples along a side; [`SIDE_PX`] is a multiple.
const LEVELS: usize = 4;
/// The corners that vanish between four quads lie off the middle of those that stay by no more than this share of the new quad's side. It is drawn no
/// wider than a pixel, so cracks beside finer quads stay far below one.
const MOST_BEND: f32 = 0.125;
/// A level is kept where it has no more than this share of the quads of the one before.
const WORTHWHILE: f64 = 0.75;
/// A level is drawn where the longest side of its quads comes to no more pixels than this.
const LONGEST_PX: f64 = 1.0;

/// One square part of a patch.
#[derive(Debug, Clone)]
struct Part {
    /// Around its corners.
    bounds: Bounds,
    /// Whether something in it may have moved since.
    moves: bool,
    /// From the finest on; never empty.
    levels: Vec<Level>,
}

/// The quads of a part at a level.
#[derive(Debug, Clone)]
struct Level {
    /// Their indices.
    indices: Range<u32>,
    /// Of those that stand for several.
    longest: Sides,
}

/// The longest sides of quads, seen from where they were captured and as shares of their depths there.
#[derive(Debug, Clone, Copy, Default)]
struct Sides {
    /// Across the ray.
    across: f64,
    /// Along it: what an eye beside sees of it.
    along: f64,
}

impl Sides {
    /// The longer of both ways, with the sides of a quad between four corners in an image.
    fn with(self, [a, b, c, d]: [Vec3; 4], camera: &Pinhole) -> Sides {
        [(a, b), (a, c), (b, d), (c, d)].into_iter().fold(self, |longest, (from, to)| {
            let across = f64::from(from.truncate().distance(to.truncate())) / camera.focal_px;
            let ray = camera.ray_eye_from_image(from.x.into(), from.y.into()).length();
            let along = f64::from((from.z - to.z).abs() / from.z.min(to.z)) * ray;
            Sides { across: longest.across.max(across), along: longest.along.max(along) }
        })
    }

    /// No more than so many pixels in a view whose pyramid and whose eye's distance from where the quads were captured are given. An eye beside sees
    /// what lies along a ray under the angle between that ray and its own, whose sine is no more than its distance from the ray over that from the point.
    fn px(self, view: &Pinhole, (pyramid, aside_m): (&Pyramid, f64), bounds: &Bounds) -> f64 {
        let nearer = pyramid.least_depth_share(bounds);
        if nearer <= 0.0 {
            return f64::INFINITY;
        }
        let sine = (aside_m * bounds.nearest_w() / nearer).min(1.0);
        (self.across + self.along * sine) * view.focal_px / nearer
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
        let quads: Vec<[u32; 4]> = mesh.indices.chunks_exact(QUAD_INDICES).map(|quad| provoking.corners(quad)).collect();
        let sorted = by_part(mask);
        let mut parts = Parts { parts: Vec::with_capacity(sorted.len()), places: vec![[0; 2]; quads.len()] };
        mesh.indices.clear();
        for (samples, number) in sorted.iter().zip(0..) {
            let first = mesh.indices.len() as u32;
            for &(sample, _) in samples {
                parts.places[sample as usize] = [number, (mesh.indices.len() / QUAD_INDICES) as u32];
                mesh.indices.extend(provoking.indices(quads[sample as usize]));
            }
            let corners = samples.iter().flat_map(|&(sample, _)| quads[sample as usize]);
            let finest = Level { indices: first..mesh.indices.len() as u32, longest: Sides::default() };
            parts.parts.push(part(mesh, corners, finest));
        }
        if coarsens {
            parts.coarsen(mesh, &sorted, &quads, (camera, provoking));
        }
        parts
    }

    /// Levels lie behind each other, so that neighbours at one level are drawn at once.
    fn coarsen(
        &mut self,
        mesh: &mut PatchMesh,
        sorted: &[Vec<(u32, [u32; 2])>],
        quads: &[[u32; 4]],
        (camera, provoking): (&Pinhole, ProvokingVertex),
    ) {
        let still = self.parts.iter_mut().zip(sorted).filter(|(part, _)| !part.moves);
        let mut stacks: Vec<(&mut Part, Stack)> =
            still.map(|(part, samples)| (part, Stack::of(mesh, samples, quads, camera))).collect();
        for level in 1..LEVELS {
            for (part, stack) in &mut stacks {
                stack.write(level, mesh, provoking, &mut part.levels);
            }
        }
    }

    /// The indices of what a view sees, in ascending order as long as levels are alike; `camera` is the patch's. With `coarsens` quads are no finer than the view's pixels ask for.
    pub fn seen_from(&self, view: &Pinhole, camera: &Pinhole, coarsens: bool) -> Vec<Range<u32>> {
        let pyramid = Pyramid::new(camera, view);
        let aside_m = view.world_from_eye.translation.distance(camera.world_from_eye.translation);
        let mut ranges: Vec<Range<u32>> = Vec::new();
        for part in &self.parts {
            if !part.moves && !pyramid.may_see(&part.bounds) {
                continue;
            }
            let is_fine = |level: &&Level| level.longest.px(view, (&pyramid, aside_m), &part.bounds) <= LONGEST_PX;
            let coarser = if coarsens { &part.levels[1..] } else { &[] };
            let level = coarser.iter().rev().find(is_fine).unwrap_or(&part.levels[0]);
            match ranges.last_mut() {
                Some(last) if last.end == level.indices.start => last.end = level.indices.end,
                _ => ranges.push(level.indices.clone()),
            }
        }
        ranges
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

fn part(mesh: &PatchMesh, corners: impl Iterator<Item = u32> + Clone, finest: Level) -> Part {
    let vertices = corners.map(|corner| &mesh.vertices[corner as usize]);
    let moves = vertices.clone().any(|vertex| vertex.corner_normal_mover >> 16 != 0);
    Part { bounds: Bounds::around(vertices.map(Vertex::image)), moves, levels: vec![finest] }
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
    longest: [Sides; LEVELS],
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
        let mut longest = [Sides::default(); LEVELS];
        for level in 1..LEVELS {
            longest[level] = longest[level - 1];
            for cell in 0..side(level) * side(level) {
                let [Some(a), Some(b), Some(c), Some(d)] = children(level, cell).map(|child| quads[level - 1][child])
                else {
                    continue;
                };
                if let Some(quad) = joined(mesh, camera, [a, b, c, d], level) {
                    let corners = quad.corners.map(|corner| mesh.vertices[corner as usize].image());
                    longest[level] = longest[level].with(corners, camera);
                    quads[level][cell] = Some(quad);
                }
            }
        }
        Stack { quads, longest }
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
            levels.push(Level { indices, longest: self.longest[level] });
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

/// One quad in place of four, where they are of one flat surface.
fn joined(mesh: &mut PatchMesh, camera: &Pinhole, four: [Quad; 4], level: usize) -> Option<Quad> {
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
    let bend = |corner: u32, middle: Vec3| {
        let off = (at(corner) - middle).abs();
        off.x.max(off.y).max(off.z / middle.z * camera.focal_px as f32)
    };
    let middles = [(a[1], (p + q) / 2.0), (a[2], (p + r) / 2.0), (d[1], (q + s) / 2.0), (d[2], (r + s) / 2.0)];
    let mut middles = middles.into_iter().chain([(a[3], (p + q + r + s) / 4.0)]);
    let most = MOST_BEND * (1 << level) as f32;
    // Not for NaN either.
    let is_flat = middles.all(|(corner, middle)| bend(corner, middle) <= most);
    is_flat.then(|| {
        let first = mesh.vertices.len() as u32;
        mesh.vertices.push(first_vertex(&mesh.vertices[corners[0] as usize], &firsts, level));
        Quad { corners, first }
    })
}

/// A corner that bears the means of what is flat over four quads.
fn first_vertex(corner: &Vertex, four: &[Vertex; 4], level: usize) -> Vertex {
    let mean = |byte: usize| {
        let sum: u32 = four.iter().map(|quad| u32::from(quad.colour_material.to_le_bytes()[byte])).sum();
        ((sum + 2) / 4) << (8 * byte)
    };
    let normal_of = |quad: &Vertex| {
        image::octahedral_normal_with_rest((quad.normal_object as u16).to_le_bytes(), quad.normal_rests_level as u8)
    };
    let normal: Vec3 = four.iter().map(normal_of).sum();
    let has_rests = four.iter().any(|quad| quad.normal_rests_level as u8 != 0);
    let rest = if has_rests { image::octahedral_rest(normal) } else { 0 };
    Vertex {
        colour_material: mean(0) | mean(1) | mean(2) | four[0].colour_material & 0xff00_0000,
        normal_object: u32::from(u16::from_le_bytes(image::octahedral_code(normal)))
            | four[0].normal_object & 0xffff_0000,
        pixel: four[0].pixel,
        normal_rests_level: corner.normal_rests_level & 0xff00 | u32::from(rest) | (level as u32) << 16,
        ..*corner
    }
}
