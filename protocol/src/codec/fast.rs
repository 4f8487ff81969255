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
use super::rans::{Counts, Decoder, Encoder, FrequencyCoder, LANES, Places, Steps};
use crate::bytes::{Reader, Writer};
use crate::image::{DepthImage, Mask};

/// Depth, two of normal, three of colour; padded to a vector.
type Values = [i16; 8];
/// The lane of the surface's symbol, and how many lanes of values come after it.
const SURFACE: usize = 0;
const CHANNELS: usize = LANES - 1;
const DEPTH: usize = 0;

/// Contexts of the surface: four comparisons of those nearby.
const SURFACE_CONTEXTS: usize = 16;
/// Contexts of a channel: four levels of the differences nearby, and one for samples without a neighbour; in a power of two.
const CHANNEL_CONTEXTS: usize = 8;
const ALONE: u8 = 4;
/// Where the next level begins, of the sum of two symbols. By entropies over four scenes, these three were best of five choices.
const LEVELS: [u8; 3] = [1, 7, 23];
const CONTEXTS: usize = SURFACE_CONTEXTS + CHANNELS * CHANNEL_CONTEXTS;

/// A depth's difference that does not fit a symbol: it follows among the literals.
const WIDE: u8 = 255;

/// Object in the lower 16 bits, then material.
type Surface = u32;
/// No sample's.
const NO_SURFACE: Surface = u32::MAX;
/// Surfaces nearby that a symbol names; the next symbol is a literal, those above are places of [`Columns::recent`].
const NEARBY: usize = 7;
const LITERAL: u8 = NEARBY as u8;
const FIRST_RECENT: u8 = LITERAL + 1;
/// Surfaces remembered: as many as told apart best by entropies over four scenes.
const RECENT_BITS: u32 = 6;

fn recent_place(surface: Surface) -> usize {
    // Fibonacci hashing: the upper bits of a product with the golden ratio.
    (surface.wrapping_mul(0x9e37_79b9) >> (u32::BITS - RECENT_BITS)) as usize
}

/// Columns before the first one and after the last one.
const MARGIN: usize = 2;

/// The last sample seen in each column, and of each object.
struct Columns {
    values: Vec<Values>,
    /// The symbols of the channels.
    symbols: Vec<[u8; 8]>,
    surfaces: Vec<Surface>,
    of_object: Vec<Values>,
    recent: [Surface; 1 << RECENT_BITS],
}

/// The surfaces around a sample: to the left, above, and above to both sides.
struct Around {
    left: Surface,
    up: Surface,
    corner: Surface,
    right: Surface,
}

impl Around {
    #[inline(always)]
    fn context(&self) -> usize {
        let Around { left, up, corner, right } = *self;
        usize::from(left == up)
            | usize::from(up == corner) << 1
            | usize::from(up == right) << 2
            | usize::from(left == corner) << 3
    }

    /// The most likely surface: below an edge that comes down, the one on this side.
    #[inline(always)]
    fn likely(&self) -> Surface {
        if self.left == self.corner { self.up } else { self.left }
    }
}

impl Columns {
    fn new(width_px: u32) -> Columns {
        let columns = width_px as usize + 2 * MARGIN;
        Columns {
            values: vec![[0; 8]; columns],
            symbols: vec![[0; 8]; columns],
            surfaces: vec![NO_SURFACE; columns],
            of_object: vec![[0; 8]; 1 << 16],
            recent: [NO_SURFACE; 1 << RECENT_BITS],
        }
    }

    /// The surfaces that the first symbols name.
    #[inline(always)]
    fn nearby(&self, at: usize, around: &Around) -> [Surface; NEARBY] {
        let Around { left, up, corner, right } = *around;
        [around.likely(), left, up, right, corner, self.surfaces[at - 2], self.surfaces[at + 2]]
    }

    /// What a sample is predicted to be, and whether no neighbour is of its surface. `corner` is what lay to the left before this
    /// row.
    #[inline(always)]
    fn predict(&self, at: usize, surface: Surface, around: &Around, corner: Values) -> (Values, bool) {
        let (left, up) = (self.values[at - 1], self.values[at]);
        match (around.left == surface, around.up == surface) {
            (true, true) if around.corner == surface => {
                let edge = |c: usize| {
                    let plane = left[c].wrapping_add(up[c]).wrapping_sub(corner[c]);
                    plane.max(left[c].min(up[c])).min(left[c].max(up[c]))
                };
                (std::array::from_fn(edge), false)
            }
            (true, _) => (left, false),
            (false, true) => (up, false),
            (false, false) if around.corner == surface => (corner, true),
            (false, false) if around.right == surface => (self.values[at + 1], true),
            (false, false) => (self.of_object[usize::from(surface as u16)], true),
        }
    }

    /// The contexts of the channels.
    #[inline(always)]
    fn contexts(&self, at: usize, alone: bool) -> [u8; CHANNELS] {
        let (left, up) = (self.symbols[at - 1], self.symbols[at]);
        std::array::from_fn(|channel| {
            let sum = left[channel].saturating_add(up[channel]);
            let level = LEVELS.map(|least| u8::from(sum >= least)).iter().sum();
            if alone { ALONE } else { level }
        })
    }
}

/// One end of the walk.
trait End {
    /// The surface of the next sample.
    fn surface(&mut self, columns: &mut Columns, at: usize, around: &Around) -> Result<Surface, CodecError>;

    /// Its values and their symbols.
    fn values(
        &mut self,
        surface: Surface,
        predicted: Values,
        contexts: [u8; CHANNELS],
    ) -> Result<(Values, [u8; 8]), CodecError>;
}

/// Goes through the samples of a mask.
fn walk(mask: &Mask, end: &mut impl End) -> Result<(), CodecError> {
    let (width_px, height_px) = mask.size_px();
    let mut columns = Columns::new(width_px);
    let mut runs: Vec<Range<u32>> = Vec::new();
    for y in 0..height_px {
        runs.clear();
        mask.runs(y, |columns| runs.push(columns));
        for run in &runs {
            walk_run(&mut columns, run.start as usize + MARGIN..run.end as usize + MARGIN, end)?;
        }
    }
    Ok(())
}

fn walk_run(columns: &mut Columns, run: Range<usize>, end: &mut impl End) -> Result<(), CodecError> {
    let mut corner = (columns.surfaces[run.start - 1], columns.values[run.start - 1]);
    for at in run {
        let surfaces = &columns.surfaces;
        let around = Around { left: surfaces[at - 1], up: surfaces[at], corner: corner.0, right: surfaces[at + 1] };
        let surface = end.surface(columns, at, &around)?;
        let (predicted, alone) = columns.predict(at, surface, &around, corner.1);
        let contexts = columns.contexts(at, alone);
        let (values, symbols) = end.values(surface, predicted, contexts)?;
        corner = (around.up, columns.values[at]);
        columns.surfaces[at] = surface;
        columns.values[at] = values;
        columns.symbols[at] = symbols;
        columns.of_object[usize::from(surface as u16)] = values;
    }
    Ok(())
}

/// A sample in symbols and their contexts.
#[derive(Clone, Copy)]
struct Coded {
    symbols: [u8; LANES],
    contexts: [u8; LANES],
}

/// Counts symbols, which are written once all are counted.
struct Counting<'a> {
    image: &'a DepthImage,
    steps: ColourSteps,
    rank: usize,
    coded: Vec<Coded>,
    counts: Vec<Counts>,
    literals: Writer,
    /// Symbol and context of the surface of this sample.
    surface: (u8, u8),
}

impl End for Counting<'_> {
    #[inline(always)]
    fn surface(&mut self, columns: &mut Columns, at: usize, around: &Around) -> Result<Surface, CodecError> {
        let surface = Surface::from(self.image.object[self.rank]) | Surface::from(self.image.material[self.rank]) << 16;
        let mut symbol = 0;
        if surface != around.likely() {
            let nearby = columns.nearby(at, around);
            let recent = &mut columns.recent[recent_place(surface)];
            symbol = match nearby.iter().position(|&nearby| nearby == surface) {
                Some(place) => place as u8,
                None if *recent == surface => FIRST_RECENT + recent_place(surface) as u8,
                None => {
                    self.literals.u16(self.image.object[self.rank]);
                    self.literals.u8(self.image.material[self.rank]);
                    LITERAL
                }
            };
            *recent = surface;
        }
        self.surface = (symbol, around.context() as u8);
        Ok(surface)
    }

    #[inline(always)]
    fn values(
        &mut self,
        _: Surface,
        predicted: Values,
        contexts: [u8; CHANNELS],
    ) -> Result<(Values, [u8; 8]), CodecError> {
        let image = self.image;
        let [x, y] = image.normal[self.rank].map(|code| i16::from((code ^ 0x80) as i8));
        let [a, b, c] = self.steps.bytes(image.colour[self.rank]).map(i16::from);
        let values = [image.depth[self.rank] as i16, x, y, a, b, c, 0, 0];
        let mut symbols: [u8; 8] = std::array::from_fn(|channel| {
            let difference = values[channel].wrapping_sub(predicted[channel]) as i8;
            (difference << 1 ^ difference >> 7) as u8
        });
        let difference = values[DEPTH].wrapping_sub(predicted[DEPTH]);
        let code = (difference << 1 ^ difference >> 15) as u16;
        symbols[DEPTH] = code.min(WIDE.into()) as u8;
        if symbols[DEPTH] == WIDE {
            self.literals.u16(code);
        }
        let mut coded = Coded { symbols: [self.surface.0; LANES], contexts: [self.surface.1; LANES] };
        coded.symbols[SURFACE + 1..].copy_from_slice(&symbols[..CHANNELS]);
        for channel in 0..CHANNELS {
            coded.contexts[SURFACE + 1 + channel] =
                (SURFACE_CONTEXTS + channel * CHANNEL_CONTEXTS) as u8 + contexts[channel];
        }
        for lane in 0..LANES {
            self.counts[usize::from(coded.contexts[lane])][usize::from(coded.symbols[lane])] += 1;
        }
        self.coded.push(coded);
        self.rank += 1;
        Ok((values, symbols))
    }
}

/// Writes frequencies as decisions; gives the symbols, and what does not fit one.
pub(super) fn write(image: &DepthImage, steps: ColourSteps, bits: &mut BitWriter) -> [Vec<u8>; 2] {
    let mut counting = Counting {
        image,
        steps,
        rank: 0,
        coded: Vec::with_capacity(image.sample_count()),
        counts: vec![[0; 256]; CONTEXTS],
        literals: Writer::default(),
        surface: (0, 0),
    };
    walk(&image.mask, &mut counting).expect("images in memory are sound");
    let mut coder = FrequencyCoder::new();
    let steps: Vec<Steps> = counting.counts.iter().map(|counts| Steps::write(counts, &mut coder, bits)).collect();
    let mut encoder = Encoder::new();
    for coded in counting.coded.iter().rev() {
        encoder.write(coded.symbols, coded.contexts.map(|context| &steps[usize::from(context)]));
    }
    [encoder.finish(), counting.literals.bytes]
}

/// Reads samples into the planes of an image.
struct Reading<'a> {
    image: &'a mut DepthImage,
    steps: ColourSteps,
    rank: usize,
    places: Vec<Places>,
    decoder: Decoder,
    literals: Reader<'a>,
}

impl End for Reading<'_> {
    #[inline(always)]
    fn surface(&mut self, columns: &mut Columns, at: usize, around: &Around) -> Result<Surface, CodecError> {
        let [symbol] = self.decoder.read(SURFACE, [&self.places[around.context()]])?;
        if symbol == 0 {
            return Ok(around.likely());
        }
        let surface = match symbol {
            ..LITERAL => columns.nearby(at, around)[usize::from(symbol)],
            LITERAL => Surface::from(self.literals.u16()?) | Surface::from(self.literals.u8()?) << 16,
            FIRST_RECENT.. => columns.recent[usize::from(symbol - FIRST_RECENT) % (1 << RECENT_BITS)],
        };
        columns.recent[recent_place(surface)] = surface;
        Ok(surface)
    }

    #[inline(always)]
    fn values(
        &mut self,
        surface: Surface,
        predicted: Values,
        contexts: [u8; CHANNELS],
    ) -> Result<(Values, [u8; 8]), CodecError> {
        let places = std::array::from_fn(|channel| {
            &self.places[SURFACE_CONTEXTS + channel * CHANNEL_CONTEXTS + usize::from(contexts[channel])]
        });
        let read: [u8; CHANNELS] = self.decoder.read(SURFACE + 1, places)?;
        let mut symbols = [0; 8];
        symbols[..CHANNELS].copy_from_slice(&read);
        let mut values: Values = std::array::from_fn(|channel| {
            let difference = i16::from((symbols[channel] >> 1) as i8 ^ -((symbols[channel] & 1) as i8));
            i16::from(predicted[channel].wrapping_add(difference) as i8)
        });
        let code = if symbols[DEPTH] == WIDE { self.literals.u16()? } else { symbols[DEPTH].into() };
        values[DEPTH] = predicted[DEPTH].wrapping_add((code >> 1) as i16 ^ -((code & 1) as i16));
        let [depth, x, y, a, b, c, ..] = values;
        let (image, rank) = (&mut *self.image, self.rank);
        image.depth[rank] = depth as u16;
        image.normal[rank] = [x, y].map(|value| value as u8 ^ 0x80);
        image.colour[rank] = self.steps.rgb_of_bytes([a, b, c].map(|value| value as i8));
        image.object[rank] = surface as u16;
        image.material[rank] = (surface >> 16) as u8;
        self.rank += 1;
        Ok((values, symbols))
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
    let mut coder = FrequencyCoder::new();
    let mut places: Vec<Places> = (0..CONTEXTS).map(|_| Places::NONE).collect();
    places.iter_mut().try_for_each(|places| places.read(&mut coder, bits))?;
    let (mask, count) = (image.mask.clone(), image.mask.count());
    (image.depth, image.normal, image.colour) = (vec![0; count], vec![[0; 2]; count], vec![[0; 3]; count]);
    (image.object, image.material) = (vec![0; count], vec![0; count]);
    let mut reading =
        Reading { image, steps, rank: 0, places, decoder: Decoder::new(symbols)?, literals: Reader::new(literals) };
    walk(&mask, &mut reading)?;
    reading.decoder.finish()?;
    if reading.literals.remaining() == 0 { Ok(()) } else { Err(CodecError::Damaged("literals")) }
}
