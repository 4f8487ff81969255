//! A patch's quads in square parts, each as finely as a view can tell: parts that a view does not see are passed over, and where
//! quads come smaller than its pixels one stands for 2 x 2, 4 x 4 or 8 x 8 of them. So drawing costs by pixels, not by what is held.
//!
//! Quads become one where they share all corners between them and lie in a plane as far as a pixel can tell; its colour and normal
//! are their means, as in a texture's mip levels. What does not (outlines, twigs) is drawn as finely as it is held at every level.

mod part;

use std::array;
use std::ops::Range;

use camera::Pinhole;
use glam::Vec3;
use protocol::{Mask, image};

use crate::mesh::{END, PatchMesh, ProvokingVertex, QUAD_INDICES, Vertex};
use crate::tiles::{Bounds, Pyramid};

pub use part::Part;
use part::{Coarseness, LEVELS, Level, Seen};

/// Pixels of a part's side, a multiple of its coarsest quad's: so small that a part at the rim of a view is mostly seen and has one distance, and that its quads outweigh a draw call.
const SIDE_PX: u32 = 16;
/// The corners that vanish between four quads lie off the middle of those that stay by no more than this share of the new quad's side in the image ...
const MOST_BEND_ACROSS: f32 = 0.125;
/// ... and along the ray by no more than this share: what is coded in steps is rough.
const MOST_BEND_ALONG: f32 = 0.25;
/// A level is kept where it has no more than this share of the quads of the one before.
const WORTHWHILE: f64 = 0.75;
/// Of a square without a sample.
const NO_PART: u32 = u32::MAX;
/// A part of fewer samples has but its finest level.
const FEWEST: usize = 64;

/// The parts of a patch.
#[derive(Debug, Clone, Default)]
pub struct Parts {
    parts: Vec<Part>,
    /// By square of the image, row by row: its part, or none. Empty of a mesh that is not of samples.
    numbers: Vec<u32>,
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
        let (sorted, numbers) = by_part(mask);
        let mut parts = Parts { parts: Vec::with_capacity(sorted.len()), numbers };
        // Further levels have at most a third as many quads and vertices of their own, where they are worth it.
        let further = if coarsens { quads.len() / 3 } else { 0 };
        mesh.indices = Vec::with_capacity((quads.len() + further) * QUAD_INDICES);
        mesh.vertices.reserve(further);
        for samples in &sorted {
            let first = mesh.indices.len() as u32;
            for &(sample, _) in samples {
                mesh.indices.extend(provoking.indices(quads[sample as usize]));
            }
            let quads = samples.iter().map(|&(sample, _)| quads[sample as usize]);
            let finest = Level { first, end: mesh.indices.len() as u32, most: Coarseness::default() };
            parts.parts.push(part_of(mesh, camera, quads, finest));
        }
        if coarsens {
            parts.coarsen(mesh, &sorted, &quads, (camera, provoking));
        }
        parts
    }

    /// One part for all of a mesh that is not of quads of samples: every view draws it whole, and no sample of it can be deleted.
    fn whole(mesh: &PatchMesh) -> Parts {
        let finest = Level { first: 0, end: mesh.indices.len() as u32, most: Coarseness::default() };
        let mut all = Part::new(finest);
        all.moves = 1;
        Parts { parts: vec![all], numbers: Vec::new() }
    }

    /// The parts, and by square of the image the number of its part.
    pub fn tables(&self) -> (&[Part], &[u32]) {
        (&self.parts, &self.numbers)
    }

    /// Of such tables again, over so many indices; `None` where they do not fit.
    pub fn of_tables(parts: Vec<Part>, numbers: Vec<u32>, indices: u32) -> Option<Parts> {
        let fits = |level: &Level| level.first <= level.end && level.end <= indices;
        let is_sound = |part: &Part| part.has_levels() && part.levels().iter().all(fits);
        parts.iter().all(is_sound).then_some(Parts { parts, numbers })
    }

    /// Levels lie behind each other, so that neighbours at one level are drawn at once.
    fn coarsen(
        &mut self,
        mesh: &mut PatchMesh,
        sorted: &[Samples],
        quads: &[[u32; 4]],
        (camera, provoking): (&Pinhole, ProvokingVertex),
    ) {
        let still =
            self.parts.iter_mut().zip(sorted).filter(|(part, samples)| part.moves == 0 && samples.len() >= FEWEST);
        let mut stacks: Vec<(&mut Part, Stack)> =
            still.map(|(part, samples)| (part, Stack::of(mesh, samples, quads, camera))).collect();
        for level in 1..LEVELS {
            for (part, stack) in &mut stacks {
                stack.write(level, mesh, provoking, part);
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
            if part.moves == 0 && (is_turned_away || !pyramid.may_see(&part.bounds)) {
                continue;
            }
            let coarser = if coarsens { &part.levels()[1..] } else { &[] };
            let seen = Seen::new(part, (&pyramid, eye), (view, camera));
            let level = coarser.iter().rev().find(|level| level.most.is_unseen(&seen)).unwrap_or(&part.levels()[0]);
            match ranges.last_mut() {
                Some(last) if last.end == level.first => last.end = level.end,
                _ => ranges.push(level.first..level.end),
            }
        }
        ranges
    }

    /// The place among the quads of a pixel's sample, whose quad has other corners from now on; `None` where `built`, the mask that the quads were made of, has none. Its
    /// part is drawn as finely as it is held from now on; `camera` is the patch's.
    pub fn redraw(&mut self, built: &Mask, pixel: (u16, u16), corners: [Vec3; 4], camera: &Pinhole) -> Option<u32> {
        let (part, place) = self.place(built, pixel)?;
        part.refine();
        part.bounds = part.bounds.and(Bounds::around(corners));
        part.planes = part.planes.with(corners, camera);
        Some(place)
    }

    /// The places among the quads of some pixels' samples, ascending. Their parts are drawn as finely as they are held from now on: quads of other levels show these samples too.
    pub fn delete(&mut self, built: &Mask, pixels: &[(u16, u16)]) -> Vec<u32> {
        let place = |&pixel: &(u16, u16)| {
            let (part, place) = self.place(built, pixel)?;
            part.refine();
            Some(place)
        };
        let mut places: Vec<u32> = pixels.iter().filter_map(place).collect();
        places.sort_unstable();
        places
    }

    /// The part that a pixel's sample lies in, and the place of its quad among the quads: those of a part lie row by row.
    fn place(&mut self, built: &Mask, (x, y): (u16, u16)) -> Option<(&mut Part, u32)> {
        let (x, y, width_px) = (u32::from(x), u32::from(y), built.size_px().0);
        if !built.get(x, y) {
            return None;
        }
        let number = self.numbers.get((y / SIDE_PX * width_px.div_ceil(SIDE_PX) + x / SIDE_PX) as usize)?;
        let part = self.parts.get_mut(*number as usize)?;
        let (left, top) = (x - x % SIDE_PX, y - y % SIDE_PX);
        let rows_above: u32 = (top..y).map(|row| built.count_in(row, left..(left + SIDE_PX).min(width_px))).sum();
        let first = part.levels()[0].first / QUAD_INDICES as u32;
        Some((part, first + rows_above + built.count_in(y, left..x)))
    }
}

/// Samples of a part, each with its pixel within the part.
type Samples = Vec<(u32, [u32; 2])>;

/// Samples by their parts, row by row. Then, by square of the image, the number of its part.
fn by_part(mask: &Mask) -> (Vec<Samples>, Vec<u32>) {
    let (width_px, height_px) = mask.size_px();
    let columns = width_px.div_ceil(SIDE_PX);
    let mut parts = vec![Vec::new(); (columns * height_px.div_ceil(SIDE_PX)) as usize];
    for ((x, y), sample) in mask.occupied().zip(0..) {
        parts[(y / SIDE_PX * columns + x / SIDE_PX) as usize].push((sample, [x % SIDE_PX, y % SIDE_PX]));
    }
    let mut numbers = 0..;
    let number = |part: &Samples| if part.is_empty() { NO_PART } else { numbers.next().unwrap_or(NO_PART) };
    let numbers = parts.iter().map(number).collect();
    parts.retain(|part| !part.is_empty());
    (parts, numbers)
}

fn part_of(mesh: &PatchMesh, camera: &Pinhole, quads: impl Iterator<Item = [u32; 4]>, finest: Level) -> Part {
    let mut part = Part::new(finest);
    for quad in quads {
        let vertices = quad.map(|corner| &mesh.vertices[corner as usize]);
        let corners = vertices.map(Vertex::image);
        part.bounds = part.bounds.and(Bounds::around(corners));
        part.planes = part.planes.with(corners, camera);
        part.moves |= u32::from(vertices.iter().any(|vertex| vertex.corner_normal_mover >> 16 != 0));
    }
    part
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

    /// Writes a level of its part behind all indices, if it is worth it.
    fn write(&self, level: usize, mesh: &mut PatchMesh, provoking: ProvokingVertex, part: &mut Part) {
        let first = mesh.indices.len();
        for cell in 0..side(level) * side(level) {
            self.write_cell(level, cell, &mut |quad| {
                let [_, right, below, across] = quad.corners;
                mesh.indices.extend(provoking.indices([quad.first, right, below, across]));
            });
        }
        let before = part.levels().last().map_or(0, |level| level.end - level.first);
        let written = mesh.indices.len() - first;
        if written as f64 > WORTHWHILE * f64::from(before) {
            mesh.indices.truncate(first);
        } else {
            part.add_level(Level { first: first as u32, end: mesh.indices.len() as u32, most: self.most[level] });
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
