//! Facets: where tiles of an image show a flat surface, whose depth one plane tells for all of them.
//!
//! Codes of depth are steps of inverse depth, which over a flat surface goes linearly with the pixels of a pinhole camera. Neighbours,
//! each rounded, predict it to a step or two only; a plane through thousands of samples predicts nearly all of them exactly. So the
//! writer fits planes to tiles, grows them over the tiles beside (region growing, Besl, Jain 1988, §IV), and sends those
//! that save more than they cost, and of each tile which one holds in it. What a plane does not tell is coded as a
//! difference like any other, so nothing is lost where it is wrong.

use super::CodecError;
use super::bits::{Bits, Number, Probability};
use super::scatter::{Scatter, Sums};
use crate::image::{DepthImage, Mask};

/// Pixels along a side of a tile.
pub(super) const TILE_PX: usize = 16;
/// Samples in the tiles of a facet worth its bytes: it takes about 100 bits, and saves about one a sample.
const LEAST_SAMPLES: f64 = 128.0;
/// The most that the squares of differences from a plane, in steps of depth, may be in the mean over a tile. Rounding alone makes it 1/12;
/// with half more, one code in six is off by a step. A little less or more changed bytes by less than a hundredth on five scenes.
const MOST_VARIANCE: f64 = 0.125;
/// Fraction bits of a facet's numbers: a slope's rounding adds up to 1/32 step over 4096 pixels.
const FRACTION_BITS: u32 = 16;

/// That an image has none, in 1/32768: a bit either way.
const NONE: u32 = 1 << 14;

/// The surface of a sample: its object in the lower 16 bits, then its material, where materials are not told apart from objects.
#[inline(always)]
pub(super) fn surface_of(image: &DepthImage, told_apart: bool, rank: usize) -> u32 {
    let material = if told_apart { 0 } else { image.material[rank] };
    u32::from(image.object[rank]) | u32::from(material) << 16
}

/// A plane of depth, for the samples of one surface. All numbers wrap, as codes do, so that none from outside is out of range.
#[derive(Debug, Clone, Copy)]
struct Facet {
    /// See [`surface_of`].
    surface: u32,
    /// At pixel (0, 0), and from one to the next along x and y, in steps, with [`FRACTION_BITS`].
    at: u32,
    along: [u32; 2],
}

impl Facet {
    /// No sample's.
    const NONE: Facet = Facet { surface: u32::MAX, at: 0, along: [0; 2] };

    /// Of a plane through the middle of some samples.
    fn new(surface: u32, scatter: &Scatter, slopes: [f64; 2]) -> Option<Facet> {
        let fixed = |steps: f64| (steps * f64::from(1 << FRACTION_BITS)).round() as i64 as u32;
        let [x, y, depth] = scatter.mean;
        // Steeper ones are edges, and what is coded for a slope must fit 32 bits.
        let is_steep = slopes.iter().any(|slope| slope.abs() >= f64::from(1 << 14));
        let along = slopes.map(fixed);
        // The rounded slopes go through the middle as well. Half a step more, as the fraction is cut off.
        let [back_x, back_y] = along.map(|slope| f64::from(slope as i32) / f64::from(1 << FRACTION_BITS));
        (!is_steep).then(|| Facet { surface, at: fixed(depth - back_x * x - back_y * y + 0.5), along })
    }

    /// The plane's depth at a pixel, with [`FRACTION_BITS`].
    #[inline(always)]
    fn depth(self, x: usize, y: usize) -> u32 {
        let [along_x, along_y] = self.along;
        self.at.wrapping_add(along_x.wrapping_mul(x as u32)).wrapping_add(along_y.wrapping_mul(y as u32))
    }

    fn code(self, bits: &mut impl Bits, slopes: &mut [Number; 2]) -> Facet {
        let surface = bits.raw(self.surface, 24);
        let at = bits.raw(self.at, 32);
        let mut along = self.along;
        for (slope, number) in along.iter_mut().zip(slopes) {
            let zigzag = number.code(bits, *slope << 1 ^ ((*slope as i32) >> 31) as u32);
            *slope = zigzag >> 1 ^ (zigzag & 1).wrapping_neg();
        }
        Facet { surface, at, along }
    }
}

/// Facets that a sample may be predicted by: that of its tile, or another one around.
pub(super) const NEAR: usize = 3;

/// The facets near a pixel, the tile's own first, and their depths there; goes along a row.
#[derive(Debug, Clone, Copy)]
pub(super) struct Near {
    facets: [Facet; NEAR],
    depths: [u32; NEAR],
}

impl Near {
    /// The depth of a sample of a surface which is else `predicted`: the tile's own facet tells it, unless the neighbours to the left and
    /// above lie on another facet around, as where two faces of an object meet within a tile.
    #[inline(always)]
    pub fn depth(&self, surface: u32, predicted: u16, [left, up]: [u16; 2]) -> u16 {
        let code = |depth: u32| (depth >> FRACTION_BITS) as u16;
        let is_of = |at: usize| self.facets[at].surface == surface;
        let holds = |at: usize| {
            let (depth, [along_x, along_y]) = (self.depths[at], self.facets[at].along);
            is_of(at) & (code(depth.wrapping_sub(along_x)) == left) & (code(depth.wrapping_sub(along_y)) == up)
        };
        let own = if is_of(0) { self.depths[0] } else { u32::from(predicted) << FRACTION_BITS };
        let other = if holds(1) {
            self.depths[1]
        } else if holds(2) {
            self.depths[2]
        } else {
            own
        };
        code(if holds(0) { own } else { other })
    }

    /// To the next pixel of the tile.
    #[inline(always)]
    pub fn step(&mut self) {
        for (depth, facet) in self.depths.iter_mut().zip(&self.facets) {
            *depth = depth.wrapping_add(facet.along[0]);
        }
    }
}

/// The facets of an image, by its tiles.
#[derive(Debug)]
pub(super) struct Facets {
    /// The first one is none.
    facets: Vec<Facet>,
    /// Indices of the tiles' own, row by row; empty where there are no facets.
    of_tile: Vec<u32>,
    /// Those and others around.
    near: Vec<[u32; NEAR]>,
    tiles_across: usize,
}

impl Facets {
    pub fn none((width_px, _): (u32, u32)) -> Facets {
        let tiles_across = (width_px as usize).div_ceil(TILE_PX);
        Facets { facets: vec![Facet::NONE], of_tile: Vec::new(), near: Vec::new(), tiles_across }
    }

    /// The facets near a pixel.
    #[inline(always)]
    pub fn near(&self, x: usize, y: usize) -> Near {
        let tile = y / TILE_PX * self.tiles_across + x / TILE_PX;
        let facets = self.near.get(tile).map_or([Facet::NONE; NEAR], |near| near.map(|at| self.facets[at as usize]));
        Near { facets, depths: facets.map(|facet| facet.depth(x, y)) }
    }

    /// Betters predictions of depth by the ranks of samples, which it takes in their order; see [`Near::depth`].
    pub fn along(&self, mask: &Mask, surface: impl Fn(usize) -> u32) -> impl FnMut(usize, i16, [i16; 2]) -> i16 {
        let mut pixels = mask.occupied();
        move |rank, predicted, near| match pixels.next() {
            Some((x, y)) => {
                let facets = self.near(x as usize, y as usize);
                facets.depth(surface(rank), predicted as u16, near.map(|code| code as u16)) as i16
            }
            None => predicted,
        }
    }

    /// Finds the facets of an image, whose samples have these surfaces.
    pub fn find(image: &DepthImage, surface: impl Fn(usize) -> u32) -> Facets {
        let mut facets = Facets::none(image.mask.size_px());
        if image.depth.windows(2).all(|pair| pair[0] == pair[1]) {
            return facets;
        }
        let tiles = tiles(image, facets.tiles_across, surface);
        let mut growing = Growing { is_free: vec![true; tiles.len()], tiles, across: facets.tiles_across };
        let mut of_tile = vec![0; growing.tiles.len()];
        for seed in 0..of_tile.len() {
            if let Some((facet, tiles)) = growing.from(seed) {
                tiles.iter().for_each(|&tile| of_tile[tile] = facets.facets.len() as u32);
                facets.facets.push(facet);
            }
        }
        if facets.facets.len() > 1 {
            facets.of_tile = of_tile;
        }
        facets.in_order()
    }

    /// Numbers facets as they come first.
    fn in_order(mut self) -> Facets {
        let mut new = vec![0; self.facets.len()];
        let mut facets = vec![Facet::NONE];
        for facet in self.of_tile.iter_mut().filter(|facet| **facet > 0) {
            let old = *facet as usize;
            if new[old] == 0 {
                new[old] = facets.len() as u32;
                facets.push(self.facets[old]);
            }
            *facet = new[old];
        }
        Facets { facets, ..self }
    }

    /// Codes the facets of an image; a reader hands in none.
    pub fn code<B: Bits>(self, bits: &mut B, size_px: (u32, u32)) -> Result<Facets, CodecError> {
        let mut read = Facets::none(size_px);
        if !bits.decide(NONE, self.facets.len() > 1) {
            return Ok(read);
        }
        let mut model = Model::new();
        let across = read.tiles_across;
        let count = across * (size_px.1 as usize).div_ceil(TILE_PX);
        read.of_tile.reserve_exact(count);
        for tile in 0..count {
            let before = |back: usize, is_in: bool| if is_in { read.of_tile[tile - back] } else { 0 };
            let before = [before(1, tile % across > 0), before(across, tile >= across)];
            let truth = self.of_tile.get(tile).copied().unwrap_or(0);
            let facet = model.tile(bits, before, read.facets.len() as u32, truth);
            if facet as usize == read.facets.len() {
                let known = self.facets.get(truth as usize).copied().unwrap_or(Facet::NONE);
                read.facets.push(known.code(bits, &mut model.slopes));
            } else if facet as usize > read.facets.len() {
                return Err(CodecError::Damaged("facet of a tile"));
            }
            read.of_tile.push(facet);
        }
        read.near = (0..count).map(|tile| read.first_around(tile)).collect();
        Ok(read)
    }

    /// The facet of a tile, and the first others around it.
    fn first_around(&self, tile: usize) -> [u32; NEAR] {
        const AROUND: [(isize, isize); 8] = [(-1, 0), (1, 0), (0, -1), (0, 1), (-1, -1), (1, -1), (-1, 1), (1, 1)];
        let (column, row) = (tile % self.tiles_across, tile / self.tiles_across);
        let (mut near, mut count) = ([0; NEAR], 1);
        near[0] = self.of_tile[tile];
        for (x, y) in AROUND {
            let beside = column.checked_add_signed(x).filter(|&column| column < self.tiles_across);
            let beside = beside.zip(row.checked_add_signed(y)).map(|(column, row)| row * self.tiles_across + column);
            let facet = beside.and_then(|tile| self.of_tile.get(tile)).copied().unwrap_or(0);
            if facet > 0 && count < NEAR && !near[..count].contains(&facet) {
                near[count] = facet;
                count += 1;
            }
        }
        near
    }
}

/// What both ends learn of facets.
struct Model {
    /// That a tile has that of the one beside it, by whether that is one, and whether the one above has it, too.
    is_left: [[Probability; 2]; 2],
    is_up: Probability,
    is_none: Probability,
    is_new: Probability,
    slopes: [Number; 2],
}

impl Model {
    fn new() -> Model {
        let even = Probability::EVEN;
        let slopes = [const { Number::NEW }; 2];
        Model { is_left: [[even; 2]; 2], is_up: even, is_none: even, is_new: even, slopes }
    }

    /// The facet of a tile, of those before `new`, or `new` itself, by those of the tiles to the left and above.
    fn tile(&mut self, bits: &mut impl Bits, [left, up]: [u32; 2], new: u32, truth: u32) -> u32 {
        let is_left = &mut self.is_left[usize::from(left > 0)][usize::from(left == up)];
        if bits.bit(is_left, truth == left) {
            left
        } else if left != up && bits.bit(&mut self.is_up, truth == up) {
            up
        } else if left > 0 && up > 0 && bits.bit(&mut self.is_none, truth == 0) {
            0
        } else if bits.bit(&mut self.is_new, truth == new) {
            new
        } else {
            bits.raw(truth, u32::BITS - new.leading_zeros())
        }
    }
}

/// The surface that shows most in a tile, and its depth.
#[derive(Debug, Clone, Copy)]
struct Tile {
    surface: u32,
    scatter: Scatter,
}

/// The tiles of an image, row by row; those of no sample are `None`.
fn tiles(image: &DepthImage, across: usize, surface: impl Fn(usize) -> u32) -> Vec<Option<Tile>> {
    let height_px = image.mask.size_px().1 as usize;
    let mut tiles = Vec::new();
    let mut shown: Vec<Vec<(u32, Sums)>> = vec![Vec::new(); across];
    let mut rank = 0;
    for y in 0..height_px {
        image.mask.runs(y as u32, |columns| {
            let (mut x, end) = (columns.start as usize, columns.end as usize);
            while x < end {
                let most = end.min((x / TILE_PX + 1) * TILE_PX) - x;
                let here = surface(rank);
                let count = (1..most).find(|&ahead| surface(rank + ahead) != here).unwrap_or(most);
                let shown = &mut shown[x / TILE_PX];
                let place = shown.iter().rposition(|&(surface, _)| surface == here).unwrap_or_else(|| {
                    shown.push((here, Sums::default()));
                    shown.len() - 1
                });
                shown[place].1.add([x % TILE_PX, y % TILE_PX], &image.depth[rank..rank + count]);
                (x, rank) = (x + count, rank + count);
            }
        });
        if (y + 1) % TILE_PX == 0 || y + 1 == height_px {
            for (column, shown) in shown.iter_mut().enumerate() {
                let most = shown.drain(..).max_by_key(|(_, sums)| sums.count());
                let corner = [column, y / TILE_PX].map(|tile| (tile * TILE_PX) as f64);
                tiles.push(most.map(|(surface, sums)| Tile { surface, scatter: sums.scatter(corner) }));
            }
        }
    }
    tiles
}

/// Tiles, of which some are facets' already.
struct Growing {
    tiles: Vec<Option<Tile>>,
    is_free: Vec<bool>,
    across: usize,
}

impl Growing {
    /// The facet that grows from a tile, and its tiles, if it is worth its bytes.
    fn from(&mut self, seed: usize) -> Option<(Facet, Vec<usize>)> {
        let Tile { surface, scatter: mut whole } = self.free(seed)?;
        whole.slopes().filter(|&slopes| whole.fits(&whole, slopes, MOST_VARIANCE))?;
        let mut members = vec![seed];
        self.is_free[seed] = false;
        let mut next = 0;
        while let Some(&tile) = members.get(next) {
            next += 1;
            for beside in self.beside(tile) {
                let Some(found) = self.free(beside).filter(|found| found.surface == surface) else { continue };
                let merged = whole.with(&found.scatter);
                if merged.slopes().is_some_and(|slopes| merged.fits(&found.scatter, slopes, MOST_VARIANCE)) {
                    whole = merged;
                    self.is_free[beside] = false;
                    members.push(beside);
                }
            }
        }
        let slopes = whole.slopes()?;
        // What bends slowly leads away from where it began.
        members.retain(|&tile| self.tiles[tile].is_some_and(|tile| whole.fits(&tile.scatter, slopes, MOST_VARIANCE)));
        let samples: f64 = members.iter().filter_map(|&tile| self.tiles[tile]).map(|tile| tile.scatter.count).sum();
        let facet = Facet::new(surface, &whole, slopes)?;
        (samples >= LEAST_SAMPLES).then_some((facet, members))
    }

    fn free(&self, tile: usize) -> Option<Tile> {
        self.tiles[tile].filter(|_| self.is_free[tile])
    }

    /// The tiles that share an edge with one.
    fn beside(&self, tile: usize) -> impl Iterator<Item = usize> + use<> {
        let (across, count, column) = (self.across, self.tiles.len(), tile % self.across);
        let left = (column > 0).then(|| tile - 1);
        let right = (column + 1 < across).then_some(tile + 1);
        let up = (tile >= across).then(|| tile - across);
        let down = (tile + across < count).then_some(tile + across);
        [left, right, up, down].into_iter().flatten()
    }
}
