//! The samples of the fast profile: one walk along the rows, seven symbols a sample, each coded by what was counted in its context
//! ([`super::rans`]).
//!
//! What a sample is predicted from is the last sample seen in its column and in the columns beside it, however far up: in a
//! row without holes these are the neighbours. A sample's *surface* is its object and material; its symbol says which of
//! the samples nearby has the same one. The other symbols are the differences of depth, normal and colour from what the
//! neighbours of the same surface predict (the median edge detector of LOCO-I: Weinberger, Seroussi, Sapiro 2000, §III.A), in
//! contexts of how large the differences nearby were.

use std::ops::Range;

use super::CodecError;
use super::bits::{BitReader, BitWriter};
use super::colour::ColourSteps;
use super::facets::{Facets, TILE_PX, surface_of};
use super::lanes::{self, get, put};
use super::rans::{CONTEXTS, Counts, Decoder, Encoder, InContext, Steps};
use crate::bytes::{Reader, Writer};
use crate::image::{DepthImage, Mask};

/// Symbols of a sample in their lanes: two of the normal, three of the colour, of depth, and of the surface.
type Symbols = u64;
/// The contexts of symbols, in their lanes.
type Contexts = u64;
const DEPTH: usize = 5;
const SURFACE: usize = 6;
/// The first context of each lane. A channel has four by how large the differences nearby were, and one where no neighbour is of
/// the surface; the surface has sixteen, by how those nearby agree.
const FIRST_CONTEXTS: Contexts =
    put(8, 1) + put(16, 2) + put(24, 3) + put(32, 4) + put(8 * DEPTH as u8, DEPTH) + put(8 * SURFACE as u8, SURFACE);
/// The lanes that change where a surface bends.
const SHAPE: Symbols = put(255, 0) + put(255, 1) + put(255, DEPTH);
const NORMAL: [usize; 2] = [0, 1];
const COLOUR: [usize; 3] = [2, 3, 4];
const CHANNELS: [usize; 6] = [0, 1, 2, 3, 4, DEPTH];

/// The states of the entropy coder: of surface and depth, of the normal, of the first byte of the colour, and of the others.
const SHAPE_STATE: usize = 0;
const NORMAL_STATE: usize = 1;
const FIRST_STATE: usize = 2;
const OTHERS_STATE: usize = 3;

/// Where the next level of differences begins, of the sum of two symbols. By entropies over four scenes, these were the best of five choices.
const LEVELS: [u8; 3] = [1, 7, 23];
/// Of all channels, without a neighbour.
const ALONE: Contexts = lanes::all(4) - put(4, SURFACE);

/// The symbol of a depth that does not fit one: it follows among the literals.
const WIDE: u8 = 255;

/// See [`surface_of`].
type Surface = u32;
/// No sample's.
const NO_SURFACE: Surface = u32::MAX;
/// What the surface's symbol says: one of the neighbours' ([`Around::neighbour`]), ...
const LIKELY: u8 = 0;
const LEFT: u8 = 1;
const UP: u8 = 2;
/// ... the likely one, and also that depth and normal are as predicted, so that they have no symbols, ...
const FLAT: u8 = 3;
/// The surface's context where that is worth asking: all nearby are alike, and so far depth and normal were as predicted. Takes the
/// place of one that cannot be.
const FLAT_CONTEXT: u8 = 0b0011;
/// ... one farther away ([`Columns::farther`]), ...
const FIRST_FARTHER: u8 = 4;
const FARTHER: usize = 4;
/// ... one that follows among the literals, or one of those remembered.
const LITERAL: u8 = FIRST_FARTHER + FARTHER as u8;
const FIRST_RECENT: u8 = LITERAL + 1;
/// Of the number of surfaces remembered; by entropies over four scenes, more cost as much in symbols as they save in literals.
const RECENT_BITS: u32 = 6;

fn recent_place(surface: Surface) -> usize {
    // Fibonacci hashing: the upper bits of a product with the golden ratio.
    (surface.wrapping_mul(0x9e37_79b9) >> (u32::BITS - RECENT_BITS)) as usize
}

/// The channels but for depth in their lanes, and depth in the upper two bytes.
type Values = u64;
const DEPTH_SHIFT: u32 = 48;
/// The lanes of the others.
const LOWER: u64 = put(255, 0) | put(255, 1) | put(255, 2) | put(255, 3) | put(255, 4);

/// What three neighbours predict, the last of them the one between the others: at an edge the one on this side of it, else the plane
/// through the three.
#[inline(always)]
fn edge(left: Values, up: Values, corner: Values) -> Values {
    let [l, u, c] = [left, up, corner].map(depth);
    let depth = l.wrapping_add(u).wrapping_sub(c.max(l.min(u)).min(l.max(u)));
    lanes::median_edge(left & LOWER, up & LOWER, corner & LOWER) | u64::from(depth) << DEPTH_SHIFT
}

#[inline(always)]
fn depth(values: Values) -> u16 {
    (values >> DEPTH_SHIFT) as u16
}

/// Columns before the first one and after the last one.
const MARGIN: usize = 2;

/// The last sample seen in a column.
#[derive(Debug, Clone, Copy)]
struct Column {
    values: Values,
    /// How large the differences were, see [`lanes::at_most_31`].
    sizes: u64,
    surface: Surface,
}

impl Column {
    const EMPTY: Column = Column { values: 0, sizes: 0, surface: NO_SURFACE };
}

/// What was seen elsewhere.
struct Seen {
    /// The last sample of each object.
    of_object: Box<[Values; 1 << 16]>,
    recent: [Surface; 1 << RECENT_BITS],
}

/// The surfaces around a sample: to the left, above, and above to both sides.
#[derive(Clone, Copy)]
struct Around {
    left: Surface,
    up: Surface,
    corner: Surface,
    right: Surface,
}

impl Around {
    /// The context of the surface. `flat` where depth and normal were as predicted to the left and above.
    #[inline(always)]
    fn context(self, flat: bool) -> u8 {
        const ALIKE: u8 = 0b1111;
        let Around { left, up, corner, right } = self;
        let bit = |same: bool, place: u32| u8::from(same) << place;
        let context = bit(left == up, 0) | bit(up == corner, 1) | bit(up == right, 2) | bit(left == corner, 3);
        if flat & (context == ALIKE) { FLAT_CONTEXT } else { context }
    }

    /// The surface of the first symbols. Not a choice of branches: which it is, is as good as chance at outlines.
    #[inline(always)]
    fn neighbour(self, symbol: u8) -> Surface {
        [self.likely(), self.left, self.up, self.likely()][usize::from(symbol % 4)]
    }

    /// The most likely surface: below an edge that comes down, the one on this side.
    #[inline(always)]
    fn likely(self) -> Surface {
        if self.left == self.corner { self.up } else { self.left }
    }
}

/// The surfaces farther away from the sample in the middle, with those [`MARGIN`] columns beside it.
fn farther(columns: &[Column], at: usize, around: Around) -> [Surface; FARTHER] {
    [around.right, around.corner, columns[at - 2].surface, columns[at + 2].surface]
}

impl Seen {
    fn new() -> Seen {
        let of_object = vec![0; 1 << 16].into_boxed_slice().try_into().expect("as many were made");
        Seen { of_object, recent: [NO_SURFACE; 1 << RECENT_BITS] }
    }

    /// What a sample without a neighbour of its surface is predicted to be. `corner` is what lay to the left before this row, `right` what
    /// lies above to the right.
    #[cold]
    fn elsewhere(&self, surface: Surface, around: Around, corner: Values, right: Values) -> Values {
        if around.corner == surface {
            corner
        } else if around.right == surface {
            right
        } else {
            self.of_object[usize::from(surface as u16)]
        }
    }
}

/// A surface, and the symbol that says so.
type Named = (Surface, u8);

/// One end of the walk.
trait End {
    /// The surface of the next sample, in a context.
    fn surface(
        &mut self,
        seen: &mut Seen,
        columns: &[Column],
        at: usize,
        around: Around,
        context: u8,
    ) -> Result<Named, CodecError>;

    /// Its values, and the symbols of their channels.
    fn values(&mut self, named: Named, predicted: Values, contexts: Contexts) -> Result<(Values, Symbols), CodecError>;

    /// A run of columns was walked.
    fn end_run(&mut self, _: &[Column]) {}
}

/// Goes through the samples of a mask.
fn walk(mask: &Mask, facets: &Facets, end: &mut impl End) -> Result<(), CodecError> {
    let (width_px, height_px) = mask.size_px();
    let mut columns = vec![Column::EMPTY; width_px as usize + 2 * MARGIN];
    let mut seen = Seen::new();
    let mut runs: Vec<Range<u32>> = Vec::new();
    for y in 0..height_px {
        runs.clear();
        mask.runs(y, |columns| runs.push(columns));
        for run in &runs {
            let columns = &mut columns[run.start as usize..run.end as usize + 2 * MARGIN];
            walk_run(columns, &mut seen, Tiles { facets, x: run.start as usize, y: y as usize }, end)?;
            end.end_run(&columns[MARGIN..columns.len() - MARGIN]);
        }
    }
    Ok(())
}

/// The tiles that a run of columns goes through, from a pixel on.
struct Tiles<'a> {
    facets: &'a Facets,
    x: usize,
    y: usize,
}

/// A run of columns, with [`MARGIN`] more on both sides.
#[inline(always)]
fn walk_run(columns: &mut [Column], seen: &mut Seen, tiles: Tiles, end: &mut impl End) -> Result<(), CodecError> {
    let mut left = columns[MARGIN - 1];
    let mut corner = left;
    let (mut at, count) = (MARGIN, columns.len() - 2 * MARGIN);
    while at < MARGIN + count {
        let x = tiles.x + at - MARGIN;
        let tile_end = (at + TILE_PX - x % TILE_PX).min(MARGIN + count);
        let mut facets = tiles.facets.near(x, tiles.y);
        while at < tile_end {
            let (up, right) = (columns[at], columns[at + 1]);
            let around = Around { left: left.surface, up: up.surface, corner: corner.surface, right: right.surface };
            let context = around.context((left.sizes | up.sizes) & SHAPE == 0);
            let (surface, symbol) = end.surface(seen, columns, at, around, context)?;
            if surface != left.surface {
                seen.of_object[usize::from(left.surface as u16)] = left.values;
            }
            let (predicted, beside, contexts) = if symbol <= FLAT {
                // The one that is missing is as the other one.
                let (is_left, is_up) = (around.left == surface, around.up == surface);
                let (first, second) =
                    (if is_left { left.values } else { up.values }, if is_up { up.values } else { left.values });
                let between = if is_left & is_up & (around.corner == surface) { corner.values } else { second };
                let contexts = FIRST_CONTEXTS + lanes::levels(left.sizes + up.sizes, LEVELS);
                (edge(first, second, between), [first, second], contexts)
            } else {
                let elsewhere = seen.elsewhere(surface, around, corner.values, right.values);
                (elsewhere, [elsewhere; 2], FIRST_CONTEXTS + ALONE)
            };
            let depth = facets.depth(surface, depth(predicted), beside.map(depth));
            let predicted = predicted & LOWER | u64::from(depth) << DEPTH_SHIFT;
            let (values, symbols) = end.values((surface, symbol), predicted, contexts + put(context, SURFACE))?;
            corner = up;
            left = Column { values, sizes: lanes::at_most_31(symbols), surface };
            columns[at] = left;
            facets.step();
            at += 1;
        }
    }
    seen.of_object[usize::from(left.surface as u16)] = left.values;
    Ok(())
}

/// Counts symbols, which are written once all are counted.
struct Counting<'a> {
    image: &'a DepthImage,
    steps: ColourSteps,
    told_apart: bool,
    rank: usize,
    /// Symbols and contexts.
    coded: Vec<(Symbols, Contexts)>,
    counts: Box<[Counts; CONTEXTS]>,
    literals: Writer,
}

impl End for Counting<'_> {
    #[inline(always)]
    fn surface(
        &mut self,
        seen: &mut Seen,
        columns: &[Column],
        at: usize,
        around: Around,
        _: u8,
    ) -> Result<Named, CodecError> {
        let surface = surface_of(self.image, self.told_apart, self.rank);
        let neighbour = [LIKELY, LEFT, UP].into_iter().find(|&symbol| around.neighbour(symbol) == surface);
        if let Some(symbol) = neighbour {
            return Ok((surface, symbol));
        }
        let symbol = match farther(columns, at, around).iter().position(|&farther| farther == surface) {
            Some(place) => FIRST_FARTHER + place as u8,
            None if seen.recent[recent_place(surface)] == surface => FIRST_RECENT + recent_place(surface) as u8,
            None => {
                self.literals.u16(surface as u16);
                self.literals.u8((surface >> 16) as u8);
                LITERAL
            }
        };
        seen.recent[recent_place(surface)] = surface;
        Ok((surface, symbol))
    }

    #[inline(always)]
    fn values(
        &mut self,
        (_, symbol): Named,
        predicted: Values,
        contexts: Contexts,
    ) -> Result<(Values, Symbols), CodecError> {
        let (depth, [x, y]) = (self.image.depth[self.rank], self.image.normal[self.rank]);
        let [a, b, c] = self.steps.bytes(self.image.colour[self.rank]);
        let channels = put(x, 0) | put(y, 1) | put(a, 2) | put(b, 3) | put(c, 4);
        let difference = depth.wrapping_sub(self::depth(predicted)) as i16;
        let code = (difference << 1 ^ difference >> 15) as u16;
        if code >= WIDE.into() {
            self.literals.u16(code);
        }
        let symbols =
            lanes::zigzag(lanes::subtract(channels, predicted & LOWER)) | put(code.min(WIDE.into()) as u8, DEPTH);
        let may_be_flat = get(contexts, SURFACE) == get(FIRST_CONTEXTS, SURFACE) + FLAT_CONTEXT;
        let flat = may_be_flat && symbol == LIKELY && symbols & SHAPE == 0;
        let coded = symbols | put(if flat { FLAT } else { symbol }, SURFACE);
        let mut count = |lane| {
            self.counts[usize::from(get(contexts, lane)) % CONTEXTS][usize::from(get(coded, lane))] += 1;
        };
        count(SURFACE);
        if flat {
            COLOUR.into_iter().for_each(count);
        } else {
            CHANNELS.into_iter().for_each(count);
        }
        self.coded.push((coded, contexts));
        self.rank += 1;
        Ok((channels | u64::from(depth) << DEPTH_SHIFT, symbols))
    }
}

/// Writes frequencies as decisions; gives the symbols, and what does not fit one.
///
/// Materials go along with objects, or where they are `told_apart`, by another coder.
pub(super) fn write(image: &DepthImage, steps: ColourSteps, told_apart: bool, bits: &mut BitWriter) -> [Vec<u8>; 2] {
    let counts = vec![[0; 256]; CONTEXTS].into_boxed_slice().try_into().expect("one of each context");
    let coded = Vec::with_capacity(image.sample_count());
    let mut counting = Counting { image, steps, told_apart, rank: 0, coded, counts, literals: Writer::default() };
    let facets = Facets::find(image, |rank| surface_of(image, told_apart, rank));
    let facets = facets.code(bits, image.mask.size_px()).expect("facets in memory are sound");
    walk(&image.mask, &facets, &mut counting).expect("images in memory are sound");
    let mut encoder = Encoder::new(Steps::write(&counting.counts, bits));
    for &(symbols, contexts) in counting.coded.iter().rev() {
        write_sample(&mut encoder, |lane| (get(symbols, lane), get(contexts, lane)));
    }
    [encoder.finish(), counting.literals.bytes]
}

/// Writes the symbols of a sample in the order that a reader needs, backwards.
#[inline(always)]
fn write_sample(encoder: &mut Encoder, in_context: impl Fn(usize) -> InContext) {
    let surface = in_context(SURFACE);
    encoder.two(OTHERS_STATE, [in_context(COLOUR[1]), in_context(COLOUR[2])]);
    encoder.one(FIRST_STATE, in_context(COLOUR[0]));
    if surface.0 == FLAT {
        encoder.one(SHAPE_STATE, surface);
    } else {
        encoder.two(NORMAL_STATE, NORMAL.map(&in_context));
        encoder.two(SHAPE_STATE, [surface, in_context(DEPTH)]);
    }
}

/// Reads samples into the planes of an image.
struct Reading<'a> {
    planes: Planes,
    decoder: Decoder,
    literals: Reader<'a>,
}

impl End for Reading<'_> {
    #[inline(always)]
    fn surface(
        &mut self,
        seen: &mut Seen,
        columns: &[Column],
        at: usize,
        around: Around,
        context: u8,
    ) -> Result<Named, CodecError> {
        let symbol = self.decoder.symbol(SHAPE_STATE, get(FIRST_CONTEXTS, SURFACE) + context);
        if symbol <= FLAT {
            return Ok((around.neighbour(symbol), symbol));
        }
        let surface = match symbol {
            ..LITERAL => farther(columns, at, around)[usize::from(symbol - FIRST_FARTHER)],
            LITERAL => Surface::from(self.literals.u16()?) | Surface::from(self.literals.u8()?) << 16,
            FIRST_RECENT.. => seen.recent[usize::from(symbol - FIRST_RECENT) % (1 << RECENT_BITS)],
        };
        seen.recent[recent_place(surface)] = surface;
        Ok((surface, symbol))
    }

    #[inline(always)]
    fn values(
        &mut self,
        (_, symbol): Named,
        predicted: Values,
        contexts: Contexts,
    ) -> Result<(Values, Symbols), CodecError> {
        let mut take = |state: usize, lane: usize| put(self.decoder.symbol(state, get(contexts, lane)), lane);
        let [first, second, third] = COLOUR;
        let mut symbols = take(FIRST_STATE, first) | take(OTHERS_STATE, second) | take(OTHERS_STATE, third);
        let mut depth = depth(predicted);
        if symbol != FLAT {
            let [x, y] = NORMAL;
            symbols |= take(NORMAL_STATE, x) | take(NORMAL_STATE, y) | take(SHAPE_STATE, DEPTH);
            let code = get(symbols, DEPTH);
            let code = if code == WIDE { self.literals.u16()? } else { code.into() };
            depth = depth.wrapping_add(code >> 1 ^ (code & 1).wrapping_neg());
        }
        self.decoder.fill()?;
        let channels = lanes::add(predicted & LOWER, lanes::unzigzag(symbols)) & LOWER;
        Ok((channels | u64::from(depth) << DEPTH_SHIFT, symbols))
    }

    fn end_run(&mut self, columns: &[Column]) {
        self.planes.extend(columns);
    }
}

/// The planes of an image, as far as they are read.
struct Planes {
    steps: ColourSteps,
    depth: Vec<u16>,
    normal: Vec<[u8; 2]>,
    colour: Vec<[u8; 3]>,
    object: Vec<u16>,
    material: Vec<u8>,
}

impl Planes {
    fn with_capacity(count: usize, steps: ColourSteps) -> Planes {
        Planes {
            steps,
            depth: Vec::with_capacity(count),
            normal: Vec::with_capacity(count),
            colour: Vec::with_capacity(count),
            object: Vec::with_capacity(count),
            material: Vec::with_capacity(count),
        }
    }

    fn extend(&mut self, columns: &[Column]) {
        self.depth.extend(columns.iter().map(|column| depth(column.values)));
        self.normal.extend(columns.iter().map(|column| NORMAL.map(|lane| get(column.values, lane))));
        let colours = columns.iter().map(|column| COLOUR.map(|lane| get(column.values, lane)));
        self.steps.extend_by_bytes(&mut self.colour, colours);
        self.object.extend(columns.iter().map(|column| column.surface as u16));
        self.material.extend(columns.iter().map(|column| (column.surface >> 16) as u8));
    }
}

/// Reads what [`write`] wrote into an image of a mask.
pub(super) fn read(
    image: &mut DepthImage,
    steps: ColourSteps,
    bits: &mut BitReader,
    symbols: &[u8],
    literals: &[u8],
) -> Result<(), CodecError> {
    let facets = Facets::none(image.mask.size_px()).code(bits, image.mask.size_px())?;
    let mut reading = Reading {
        planes: Planes::with_capacity(image.mask.count(), steps),
        decoder: Decoder::new(bits, symbols)?,
        literals: Reader::new(literals),
    };
    walk(&image.mask, &facets, &mut reading)?;
    reading.decoder.finish()?;
    if reading.literals.remaining() > 0 {
        return Err(CodecError::Damaged("literals"));
    }
    let Planes { depth, normal, colour, object, material, .. } = reading.planes;
    (image.depth, image.normal, image.colour) = (depth, normal, colour);
    (image.object, image.material) = (object, material);
    Ok(())
}
