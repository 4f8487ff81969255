//! Symbols by what was counted of them beforehand: an asymmetric numeral system (Duda, Asymmetric numeral systems, 2013; in the
//! form of Giesen, Interleaved entropy coders, 2014, with 16 bits moved at a time).
//!
//! A sample's symbols go to a few states, one or two to each, so that the states do not wait for each other and a word is looked for once for
//! two symbols. All share one stream of words. A writer goes backwards, from the last symbol to the first; a reader goes
//! forwards.

use super::CodecError;
use super::bits::{Bits, Number, Probability};

/// Contexts of all symbols together.
pub(super) const CONTEXTS: usize = 64;
/// Frequencies sum up to `1 << PRECISION`. With 10, non-redundant images took 0.8 % (birdnest) to 3 % (urban) more bytes than with 11; more
/// makes a reader's tables leave the nearest cache.
const PRECISION: u32 = 11;
const TOTAL: u32 = 1 << PRECISION;
/// States of a sample: at most one word each is looked for a sample.
pub(super) const STATES: usize = 4;
/// States lie from here up to 2^32 times it; a reader below takes a word. Two symbols take 22 bits at most.
const LEAST_STATE: u64 = 1 << 31;

/// How often each symbol of a context came.
pub(super) type Counts = [u32; 256];

/// How often each symbol comes in [`TOTAL`]; none at all in a context that never came.
type Frequencies = [u16; 256];

/// Counts as frequencies: what came at all keeps one, and the rounding is made up for where it costs least.
fn frequencies(counts: &Counts) -> Frequencies {
    let sum: u64 = counts.iter().map(|&count| u64::from(count)).sum();
    let mut frequencies = [0; 256];
    if sum == 0 {
        return frequencies;
    }
    let mut rest = TOTAL as i32;
    for (frequency, &count) in frequencies.iter_mut().zip(counts).filter(|(_, count)| **count > 0) {
        *frequency = ((u64::from(count) * u64::from(TOTAL) + sum / 2) / sum).max(1) as u16;
        rest -= i32::from(*frequency);
    }
    while rest != 0 {
        let most = frequencies.iter_mut().max().expect("there are 256");
        // At most half of it at once, so that others become the most frequent in turn.
        let step = rest.max(-i32::from(*most / 2));
        *most = (i32::from(*most) + step) as u16;
        rest -= step;
    }
    frequencies
}

/// About what counted symbols cost, with their frequencies.
fn cost_bits(counts: &Counts) -> f64 {
    /// A frequency takes about this much: an estimate, which only decides what is shared.
    const FREQUENCY_BITS: f64 = 6.0;
    let sum = f64::from(counts.iter().sum::<u32>());
    let bits = |&count: &u32| f64::from(count) * (sum / f64::from(count)).log2() + FREQUENCY_BITS;
    counts.iter().filter(|count| **count > 0).map(bits).sum()
}

/// Counts of contexts in order, of which those that cost less together share theirs with the one before.
fn shared(counts: &[Counts; CONTEXTS]) -> Vec<(Counts, bool)> {
    let mut first = 0;
    let mut shared: Vec<(Counts, bool)> = vec![(counts[0], false)];
    for (context, counts) in counts.iter().enumerate().skip(1) {
        let both = std::array::from_fn(|symbol| shared[first].0[symbol] + counts[symbol]);
        let share = cost_bits(&both) <= cost_bits(&shared[first].0) + cost_bits(counts);
        if share {
            shared[first].0 = both;
        } else {
            first = context;
        }
        shared.push((*counts, share));
    }
    shared
}

/// Codes the frequencies of contexts, each by how large the one before it was; a reader gives those that were written.
struct FrequencyCoder {
    shared: Probability,
    used: Number,
    by_last: Vec<Number>,
}

impl FrequencyCoder {
    fn new() -> FrequencyCoder {
        let by_last = vec![Number::NEW; PRECISION as usize + 2];
        FrequencyCoder { shared: Probability::EVEN, used: Number::NEW, by_last }
    }

    /// The frequencies of a context; `None` where they are those of the context before.
    fn code(&mut self, bits: &mut impl Bits, known: Option<&Frequencies>) -> Result<Option<Frequencies>, CodecError> {
        const DAMAGED: CodecError = CodecError::Damaged("frequencies");
        if bits.bit(&mut self.shared, known.is_none()) {
            return Ok(None);
        }
        let known = known.unwrap_or(&[0; 256]);
        let used = known.iter().rposition(|&frequency| frequency > 0).map_or(0, |last| last + 1);
        let used = self.used.code(bits, used as u32) as usize;
        let mut read = [0; 256];
        let (mut last, mut sum) = (0, 0);
        for (read, &known) in read.get_mut(..used).ok_or(DAMAGED)?.iter_mut().zip(known) {
            let frequency = self.by_last[(last + 1_u32).ilog2() as usize].code(bits, u32::from(known));
            sum += u64::from(frequency);
            last = frequency.min(TOTAL);
            *read = last as u16;
        }
        if sum == u64::from(TOTAL) || used == 0 { Ok(Some(read)) } else { Err(DAMAGED) }
    }
}

/// How a writer moves a state by a symbol, without a division (Giesen, rans64.h, 2014).
#[derive(Debug, Clone, Copy, Default)]
struct Step {
    reciprocal: u64,
    bias: u16,
    /// [`TOTAL`] less the frequency.
    others: u16,
    shift: u8,
}

impl Step {
    fn new(start: u32, frequency: u32) -> Step {
        let others = (TOTAL - frequency) as u16;
        if frequency == 1 {
            return Step { reciprocal: u64::MAX, shift: 0, bias: (start + TOTAL - 1) as u16, others };
        }
        let shift = u32::BITS - (frequency - 1).leading_zeros();
        let reciprocal = (1_u128 << (shift + 63)).div_ceil(frequency.into()) as u64;
        Step { reciprocal, shift: shift as u8 - 1, bias: start as u16, others }
    }

    fn frequency(self) -> u64 {
        u64::from(TOTAL) - u64::from(self.others)
    }

    #[inline(always)]
    fn moved(self, state: u64) -> u64 {
        let quotient = ((u128::from(state) * u128::from(self.reciprocal)) >> 64) as u64 >> (self.shift & 63);
        state.wrapping_add(self.bias.into()).wrapping_add(quotient.wrapping_mul(self.others.into()))
    }
}

fn step_each(frequencies: &Frequencies) -> [Step; 256] {
    let mut start = 0;
    frequencies.map(|frequency| {
        let first = start;
        start += u32::from(frequency);
        if frequency > 0 { Step::new(first, frequency.into()) } else { Step::default() }
    })
}

/// Moves by all symbols of all contexts.
pub(super) struct Steps(Vec<[Step; 256]>);

impl Steps {
    /// Writes the frequencies of counted symbols, and takes them.
    pub fn write(counts: &[Counts; CONTEXTS], bits: &mut impl Bits) -> Steps {
        let mut coder = FrequencyCoder::new();
        let mut steps = Vec::with_capacity(CONTEXTS);
        let mut last = [Step::default(); 256];
        for (counts, share) in shared(counts) {
            let frequencies = (!share).then(|| frequencies(&counts));
            coder.code(bits, frequencies.as_ref()).expect("frequencies in memory are sound");
            if let Some(frequencies) = frequencies {
                last = step_each(&frequencies);
            }
            steps.push(last);
        }
        Steps(steps)
    }
}

/// A symbol in its context.
pub(super) type InContext = (u8, u8);

/// Writes the samples of a patch, the last one first.
pub(super) struct Encoder {
    steps: Box<[[Step; 256]; CONTEXTS]>,
    states: [u64; STATES],
    words: Vec<u32>,
}

impl Encoder {
    pub fn new(Steps(steps): Steps) -> Encoder {
        let steps = steps.into_boxed_slice().try_into().expect("one of each context");
        Encoder { steps, states: [LEAST_STATE; STATES], words: Vec::new() }
    }

    /// Writes what a reader takes from a state by one [`Decoder::symbol`].
    #[inline(always)]
    pub fn one(&mut self, state: usize, symbol: InContext) {
        let step = self.step(symbol);
        self.states[state] = step.moved(self.filled(state, step.frequency() << PRECISION));
    }

    /// Writes what a reader takes from a state by two.
    #[inline(always)]
    pub fn two(&mut self, state: usize, [first, second]: [InContext; 2]) {
        let (first, second) = (self.step(first), self.step(second));
        self.states[state] = first.moved(second.moved(self.filled(state, first.frequency() * second.frequency())));
    }

    #[inline(always)]
    fn step(&self, (symbol, context): InContext) -> Step {
        self.steps[usize::from(context) % CONTEXTS][usize::from(symbol)]
    }

    /// A state that has room for symbols that come so often in the square of [`TOTAL`].
    #[inline(always)]
    fn filled(&mut self, state: usize, frequency: u64) -> u64 {
        let from = self.states[state];
        if from < frequency << (63 - 2 * PRECISION) {
            return from;
        }
        self.words.push(from as u32);
        from >> 32
    }

    /// The words in the order of the reader: the states, then those taken on the way.
    pub fn finish(self) -> Vec<u8> {
        let states = self.states.iter().flat_map(|state| state.to_le_bytes());
        states.chain(self.words.iter().rev().flat_map(|word| word.to_le_bytes())).collect()
    }
}

/// What a reader knows of all contexts: the symbol at each place, and the frequency and first place of each symbol, in the upper and the
/// lower half. Two small tables, of which the parts in use stay in the nearest cache, are faster than one of everything.
struct Places {
    symbols: Box<[u8; CONTEXTS << PRECISION]>,
    ranges: Box<[u32; CONTEXTS << 8]>,
}

impl Places {
    /// Reads the frequencies of all contexts that [`Steps::write`] wrote.
    fn read(bits: &mut impl Bits) -> Result<Places, CodecError> {
        let mut coder = FrequencyCoder::new();
        let (mut symbols, mut ranges) = (vec![0; CONTEXTS << PRECISION], vec![0; CONTEXTS << 8]);
        let each = symbols.chunks_exact_mut(TOTAL as usize).zip(ranges.chunks_exact_mut(256));
        let mut last = [0; 256];
        for (symbols, ranges) in each {
            last = coder.code(bits, None)?.unwrap_or(last);
            let mut start = 0;
            for (symbol, &frequency) in (0..=255).zip(&last).filter(|(_, frequency)| **frequency > 0) {
                symbols[start..start + usize::from(frequency)].fill(symbol);
                ranges[usize::from(symbol)] = u32::from(frequency) << 16 | start as u32;
                start += usize::from(frequency);
            }
        }
        let sized = "as many were made";
        Ok(Places {
            symbols: symbols.into_boxed_slice().try_into().expect(sized),
            ranges: ranges.into_boxed_slice().try_into().expect(sized),
        })
    }
}

/// Reads the samples of a patch.
pub(super) struct Decoder {
    places: Places,
    states: [u64; STATES],
    words: Vec<u32>,
    at: usize,
}

impl Decoder {
    const DAMAGED: CodecError = CodecError::Damaged("words of the samples");

    /// Of the frequencies in `bits` and the words in `bytes`.
    pub fn new(bits: &mut impl Bits, bytes: &[u8]) -> Result<Decoder, CodecError> {
        let (states, words) = bytes.split_at_checked(STATES * size_of::<u64>()).ok_or(Decoder::DAMAGED)?;
        let mut states = states.as_chunks().0.iter().map(|&state| u64::from_le_bytes(state));
        let states = std::array::from_fn(|_| states.next().expect("as many were split off"));
        let (words, rest) = words.as_chunks();
        if !rest.is_empty() {
            return Err(Decoder::DAMAGED);
        }
        let words = words.iter().map(|&word| u32::from_le_bytes(word));
        // A sample looks at the next words at once.
        let words = words.chain([0; STATES]).collect();
        Ok(Decoder { places: Places::read(bits)?, states, words, at: 0 })
    }

    /// Takes a symbol from a state. After two at most all must be filled.
    #[inline(always)]
    pub fn symbol(&mut self, state: usize, context: u8) -> u8 {
        let from = self.states[state];
        let context = usize::from(context) % CONTEXTS;
        let place = from as u32 % TOTAL;
        let symbol = self.places.symbols[context << PRECISION | place as usize];
        let range = self.places.ranges[context << 8 | usize::from(symbol)];
        // Below, if the bytes are damaged, only where no sample is.
        self.states[state] =
            u64::from(range >> 16) * (from >> PRECISION) + u64::from(place.wrapping_sub(range & 0xffff));
        symbol
    }

    /// Fills all states.
    #[inline(always)]
    pub fn fill(&mut self) -> Result<(), CodecError> {
        let words: &[u32; STATES] = self.words[self.at..].first_chunk().ok_or(Decoder::DAMAGED)?;
        let mut count = 0;
        for state in &mut self.states {
            let low = *state < LEAST_STATE;
            let filled = *state << 32 | u64::from(words[count % STATES]);
            *state = if low { filled } else { *state };
            count += usize::from(low);
        }
        self.at += count;
        Ok(())
    }

    /// Whether all words were read, and led back to where the writer began.
    pub fn finish(self) -> Result<(), CodecError> {
        let whole = self.at + STATES == self.words.len() && self.states == [LEAST_STATE; STATES];
        if whole { Ok(()) } else { Err(Decoder::DAMAGED) }
    }
}

#[cfg(test)]
mod tests {
    use super::super::bits::{BitReader, BitWriter};
    use super::*;

    const SYMBOLS: usize = 7;

    /// Seven symbols, each in a context of its own: from one that is always the same to noise.
    fn samples() -> Vec<[InContext; SYMBOLS]> {
        let noise = |seed: u64| (seed + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        let symbol = |seed: u64, bits: usize| (noise(noise(seed) ^ bits as u64) >> 32 & ((1 << bits) - 1)) as u8;
        (0..20_000).map(|seed| std::array::from_fn(|bits| (symbol(seed, bits), 9 * bits as u8))).collect()
    }

    #[test]
    fn symbols_come_back_and_what_is_damaged_is_seen() {
        let samples = samples();
        let mut counts = [[0; 256]; CONTEXTS];
        for (symbol, context) in samples.as_flattened() {
            counts[usize::from(*context)][usize::from(*symbol)] += 1;
        }
        let mut bits = BitWriter::new();
        let mut encoder = Encoder::new(Steps::write(&counts, &mut bits));
        for &[a, b, c, d, e, f, g] in samples.iter().rev() {
            encoder.two(3, [f, g]);
            encoder.two(2, [d, e]);
            encoder.two(1, [b, c]);
            encoder.one(0, a);
        }
        let (bits, bytes) = (bits.finish(), encoder.finish());
        let read = |bytes: &[u8]| {
            let mut decoder = Decoder::new(&mut BitReader::new(&bits), bytes)?;
            let mut sample = || {
                let sample = [0, 1, 1, 2, 2, 3, 3].into_iter().zip((0..).step_by(9));
                let sample =
                    sample.map(|(state, context)| (decoder.symbol(state, context), context)).collect::<Vec<_>>();
                decoder.fill().map(|()| sample)
            };
            let read = samples.iter().map(|_| sample()).collect::<Result<Vec<_>, _>>()?;
            decoder.finish().map(|()| read.concat())
        };
        assert!(read(&bytes).expect("sound") == samples.as_flattened());
        let least = samples.len() * (1 + 2 + 3 + 4 + 5 + 6) / 8;
        assert!(bytes.len() < least + least / 100, "{} bytes for {least} of noise", bytes.len());
        assert!(read(&bytes[..bytes.len() - 4]).is_err() && read(&[&bytes[..], &[0; 4]].concat()).is_err());
    }
}
