//! Symbols by what was counted of them beforehand: an asymmetric numeral system (Duda, Asymmetric numeral systems, 2013; in the
//! form of Giesen, Interleaved entropy coders, 2014, with 16 bits moved at a time).
//!
//! Each symbol of a sample has a state of its own, its *lane*, so that the lanes do not wait for each other. All share one
//! stream of words. A writer goes backwards, from the last symbol to the first; a reader goes forwards.

use super::CodecError;
use super::bits::{Bits, Number, Probability};
use super::lanes::{LANES, get, put};

/// Contexts of all lanes together.
pub(super) const CONTEXTS: usize = 64;
/// Frequencies sum up to `1 << PRECISION`. With 10, non-redundant images took 0.8 % (birdnest) to 3 % (urban) more bytes than with 11; more
/// makes a reader's tables leave the nearest cache.
const PRECISION: u32 = 11;
const TOTAL: u32 = 1 << PRECISION;
/// States lie from here up to 2^16 times it; a reader below takes a word.
const LEAST_STATE: u32 = 1 << 15;
/// Words that a sample takes at most, in a power of two.
const MOST_WORDS: usize = LANES.next_power_of_two();

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

/// How a writer moves a state by a symbol, without a division (Giesen, rans_byte.h, 2014).
#[derive(Debug, Clone, Copy, Default)]
struct Step {
    /// From this state on, a word is written first.
    limit: u32,
    reciprocal: u32,
    shift: u32,
    bias: u32,
}

impl Step {
    fn new(start: u32, frequency: u32) -> Step {
        let limit = frequency << (31 - PRECISION);
        if frequency == 1 {
            return Step { limit, reciprocal: u32::MAX, shift: 0, bias: start + TOTAL - 1 };
        }
        let shift = 32 - (frequency - 1).leading_zeros();
        let reciprocal = (1_u64 << (shift + 31)).div_ceil(u64::from(frequency));
        Step { limit, reciprocal: reciprocal as u32, shift: shift - 1, bias: start }
    }

    /// [`TOTAL`] less the frequency.
    #[inline(always)]
    fn others(self) -> u32 {
        TOTAL - (self.limit >> (31 - PRECISION))
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

/// Writes the samples of a patch, the last one first.
pub(super) struct Encoder {
    steps: Box<[[Step; 256]; CONTEXTS]>,
    states: [u32; LANES],
    words: Vec<u16>,
    count: usize,
}

impl Encoder {
    pub fn new(Steps(steps): Steps) -> Encoder {
        let steps = steps.into_boxed_slice().try_into().expect("one of each context");
        Encoder { steps, states: [LEAST_STATE; LANES], words: vec![0; 1024], count: 0 }
    }

    /// Writes the symbols of some lanes in their contexts.
    #[inline(always)]
    pub fn write<const N: usize>(&mut self, symbols: u64, contexts: u64, lanes: [usize; N]) {
        if self.words.len() < self.count + MOST_WORDS {
            self.words.resize(2 * self.words.len(), 0);
        }
        let words: &mut [u16; MOST_WORDS] =
            self.words[self.count..].first_chunk_mut().expect("there was made room for as many");
        let mut count = 0;
        for lane in lanes.into_iter().rev() {
            let step = self.steps[usize::from(get(contexts, lane)) % CONTEXTS][usize::from(get(symbols, lane))];
            let state = self.states[lane];
            let full = state >= step.limit;
            words[count % MOST_WORDS] = state as u16;
            count += usize::from(full);
            let state = if full { state >> 16 } else { state };
            let quotient = ((u64::from(state) * u64::from(step.reciprocal)) >> 32) as u32 >> step.shift;
            self.states[lane] = state.wrapping_add(step.bias).wrapping_add(quotient.wrapping_mul(step.others()));
        }
        self.count += count;
    }

    /// The words in the order of the reader: the states, then those taken on the way.
    pub fn finish(mut self) -> Vec<u8> {
        self.words.truncate(self.count);
        let states = self.states.iter().flat_map(|state| state.to_le_bytes());
        states.chain(self.words.iter().rev().flat_map(|word| word.to_le_bytes())).collect()
    }
}

/// What a reader knows of a context: the symbol at each place, and the frequency and first place of each symbol, in the upper and the
/// lower half. Two small tables, of which the parts in use stay in the nearest cache, are faster than one of everything.
#[derive(Debug, Clone)]
struct Places {
    symbols: [u8; TOTAL as usize],
    ranges: [u32; 256],
}

impl Places {
    fn new(frequencies: &Frequencies) -> Places {
        let mut places = Places { symbols: [0; TOTAL as usize], ranges: [0; 256] };
        let mut start = 0;
        for (symbol, &frequency) in (0..=255).zip(frequencies).filter(|(_, frequency)| **frequency > 0) {
            places.symbols[start..start + usize::from(frequency)].fill(symbol);
            places.ranges[usize::from(symbol)] = u32::from(frequency) << 16 | start as u32;
            start += usize::from(frequency);
        }
        places
    }

    /// Reads the frequencies of all contexts that [`Steps::write`] wrote.
    fn read(bits: &mut impl Bits) -> Result<Box<[Places; CONTEXTS]>, CodecError> {
        let mut coder = FrequencyCoder::new();
        let mut all = Vec::with_capacity(CONTEXTS);
        let mut last = Places::new(&[0; 256]);
        for _ in 0..CONTEXTS {
            if let Some(frequencies) = coder.code(bits, None)? {
                last = Places::new(&frequencies);
            }
            all.push(last.clone());
        }
        Ok(all.into_boxed_slice().try_into().expect("one of each context"))
    }
}

/// Reads the samples of a patch.
pub(super) struct Decoder {
    places: Box<[Places; CONTEXTS]>,
    states: [u32; LANES],
    words: Vec<u16>,
    at: usize,
}

impl Decoder {
    const DAMAGED: CodecError = CodecError::Damaged("words of the samples");

    /// Of the frequencies in `bits` and the words in `bytes`.
    pub fn new(bits: &mut impl Bits, bytes: &[u8]) -> Result<Decoder, CodecError> {
        let (states, words) = bytes.split_at_checked(4 * LANES).ok_or(Decoder::DAMAGED)?;
        let mut states = states.as_chunks().0.iter().map(|&state| u32::from_le_bytes(state));
        let states = std::array::from_fn(|_| states.next().expect("as many were split off"));
        let (words, rest) = words.as_chunks();
        if !rest.is_empty() {
            return Err(Decoder::DAMAGED);
        }
        let words = words.iter().map(|&word| u16::from_le_bytes(word));
        // A sample looks at the next words at once.
        let words = words.chain([0; MOST_WORDS]).collect();
        Ok(Decoder { places: Places::read(bits)?, states, words, at: 0 })
    }

    /// Reads the symbols of some lanes in their contexts.
    #[inline(always)]
    pub fn read<const N: usize>(&mut self, contexts: u64, lanes: [usize; N]) -> Result<u64, CodecError> {
        let words: &[u16; MOST_WORDS] = self.words[self.at..].first_chunk().ok_or(Decoder::DAMAGED)?;
        let mut count = 0;
        let mut symbols = 0;
        for lane in lanes {
            let state = self.states[lane];
            let places = &self.places[usize::from(get(contexts, lane)) % CONTEXTS];
            let place = state % TOTAL;
            let symbol = places.symbols[place as usize];
            symbols |= put(symbol, lane);
            let range = places.ranges[usize::from(symbol)];
            // Below, if the bytes are damaged, only where no sample is.
            let state = (range >> 16) * (state >> PRECISION) + place.wrapping_sub(range & 0xffff);
            let low = state < LEAST_STATE;
            let filled = state << 16 | u32::from(words[count % MOST_WORDS]);
            self.states[lane] = if low { filled } else { state };
            count += usize::from(low);
        }
        self.at += count;
        Ok(symbols)
    }

    /// Whether all words were read, and led back to where the writer began.
    pub fn finish(self) -> Result<(), CodecError> {
        let whole = self.at + MOST_WORDS == self.words.len() && self.states == [LEAST_STATE; LANES];
        if whole { Ok(()) } else { Err(Decoder::DAMAGED) }
    }
}

#[cfg(test)]
mod tests {
    use super::super::bits::{BitReader, BitWriter};
    use super::*;

    const ORDER: [usize; LANES] = [0, 1, 2, 3, 4, 5, 6];

    /// Symbols of each lane in a context of its own: from one that is always the same to noise.
    fn samples() -> Vec<u64> {
        let noise = |seed: u64| (seed + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        let symbol = |seed: u64, lane: usize| (noise(noise(seed) ^ lane as u64) >> 32 & ((1 << lane) - 1)) as u8;
        (0..20_000).map(|seed| ORDER.iter().map(|&lane| put(symbol(seed, lane), lane)).sum()).collect()
    }

    #[test]
    fn symbols_come_back_and_what_is_damaged_is_seen() {
        let contexts = ORDER.iter().map(|&lane| put(9 * lane as u8, lane)).sum();
        let samples = samples();
        let mut counts = [[0; 256]; CONTEXTS];
        for sample in &samples {
            ORDER.iter().for_each(|&lane| counts[9 * lane][usize::from(get(*sample, lane))] += 1);
        }
        let mut bits = BitWriter::new();
        let mut encoder = Encoder::new(Steps::write(&counts, &mut bits));
        samples.iter().rev().for_each(|&sample| encoder.write(sample, contexts, ORDER));
        let (bits, bytes) = (bits.finish(), encoder.finish());
        let read = |bytes: &[u8]| {
            let mut decoder = Decoder::new(&mut BitReader::new(&bits), bytes)?;
            let read = samples.iter().map(|_| decoder.read(contexts, ORDER)).collect::<Result<Vec<u64>, _>>()?;
            decoder.finish().map(|()| read)
        };
        assert!(read(&bytes).expect("sound") == samples);
        let least = samples.len() * (1 + 2 + 3 + 4 + 5 + 6) / 8;
        assert!(bytes.len() < least + least / 100, "{} bytes for {least} of noise", bytes.len());
        assert!(read(&bytes[..bytes.len() - 2]).is_err() && read(&[&bytes[..], &[0, 0]].concat()).is_err());
    }
}
