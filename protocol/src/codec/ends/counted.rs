//! The sides of many surfaces' ends by what was counted of them, which takes half of the time of decisions that learn.

use super::{BEFORE, Begun, End, Side, begin, by_learning, walk};
use crate::codec::CodecError;
use crate::codec::bits::{BitReader, BitWriter};
use crate::codec::rans::{CONTEXTS, Counts, Decoder, Encoder, InContext, STATES, Steps};
use crate::ends::{Beside, Ends};
use crate::image::DepthImage;

/// Chosen: of fewer sides the frequencies weigh, and learning takes a fraction of a millisecond.
const MANY: usize = 16 * 1024;

/// Sides that a reader takes before it fills its states: two of each.
const TURN: usize = 2 * STATES;

/// By what is beside, how the surface ended before, and whether it ends across. Surfaces are settled, so that a side is coded only where one may end.
fn context(Side { beside, before, slope: _, across }: Side) -> u8 {
    let beside = match beside {
        Beside::GoesOn | Beside::Nothing => 0,
        Beside::Other => 1,
        Beside::Farther => 2,
    };
    ((beside * BEFORE + before) * 2 + usize::from(across)) as u8
}

/// Counts levels, which are written once all are counted.
struct Counting {
    counts: Box<[Counts; CONTEXTS]>,
    coded: Vec<InContext>,
}

impl End for Counting {
    #[inline(always)]
    fn level(&mut self, side: Side, level: u16) -> u16 {
        let (symbol, context) = (level as u8, context(side));
        self.counts[usize::from(context) % CONTEXTS][usize::from(symbol)] += 1;
        self.coded.push((symbol, context));
        level
    }
}

struct Reading {
    decoder: Decoder,
    taken: usize,
    damaged: Option<CodecError>,
}

impl End for Reading {
    #[inline(always)]
    fn level(&mut self, side: Side, _: u16) -> u16 {
        let level = self.decoder.symbol(self.taken % TURN / 2, context(side));
        self.taken += 1;
        if self.taken.is_multiple_of(TURN)
            && let Err(error) = self.decoder.fill()
        {
            self.damaged = Some(error);
        }
        level.into()
    }
}

/// Writes the ends of an image whose other planes are known; gives the words beside the decisions.
pub fn write(image: &DepthImage, bits: &mut BitWriter) -> Vec<u8> {
    let Some(begun) = begin(bits, image, &image.ends) else { return Vec::new() };
    if !is_counted(&begun) {
        by_learning(bits, image, image.ends.clone(), &begun);
        return Vec::new();
    }
    let counts = vec![[0; 256]; CONTEXTS].into_boxed_slice().try_into().expect("one of each context");
    let mut counting = Counting { counts, coded: Vec::new() };
    walk(image, image.ends.clone(), &begun, &mut counting);
    let mut encoder = Encoder::new(Steps::write(&counting.counts, bits));
    for turn in counting.coded.chunks(TURN).rev() {
        for (state, sides) in turn.chunks(2).enumerate().rev() {
            match *sides {
                [first, second] => encoder.two(state, [first, second]),
                [one] => encoder.one(state, one),
                _ => {}
            }
        }
    }
    encoder.finish()
}

/// Reads what [`write`] wrote.
pub fn read(image: &DepthImage, bits: &mut BitReader, words: &[u8]) -> Result<Vec<Ends>, CodecError> {
    let begun = begin(bits, image, &[]);
    let Some(begun) = begun.as_ref().filter(|begun| is_counted(begun)) else {
        let ends = begun.map_or_else(Vec::new, |begun| by_learning(bits, image, Vec::new(), &begun));
        return if words.is_empty() { Ok(ends) } else { Err(CodecError::Damaged("words of no ends")) };
    };
    let mut reading = Reading { decoder: Decoder::new(bits, words)?, taken: 0, damaged: None };
    let ends = walk(image, Vec::new(), begun, &mut reading);
    if let Some(damaged) = reading.damaged {
        return Err(damaged);
    }
    if !reading.taken.is_multiple_of(TURN) {
        reading.decoder.fill()?;
    }
    reading.decoder.finish().map(|()| ends)
}

fn is_counted(begun: &Begun) -> bool {
    begun.is_settled && begun.besides.side_count() >= MANY
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ends::tests::tatters;

    /// An image so large, whose surfaces end where they may, at levels that go up and down along outlines.
    fn ending(size_px: (u32, u32)) -> DepthImage {
        let mut image = tatters(size_px);
        let level = |rank: usize| 1 + (rank / 7 % 7) as Ends;
        image.settle_ends((0..image.sample_count()).map(|rank| level(rank) * 0x1111).collect());
        image
    }

    fn written(image: &DepthImage) -> (Vec<u8>, Vec<u8>) {
        let mut bits = BitWriter::new();
        let words = write(image, &mut bits);
        (bits.finish(), words)
    }

    #[test]
    fn many_sides_are_counted_few_are_learned_and_both_come_back() {
        for (size_px, is_counted) in [((200, 200), true), ((40, 40), false)] {
            let image = ending(size_px);
            let (bits, words) = written(&image);
            assert_eq!(!words.is_empty(), is_counted);
            let known = DepthImage { ends: Vec::new(), ..image.clone() };
            assert_eq!(read(&known, &mut BitReader::new(&bits), &words), Ok(image.ends));
        }
    }

    #[test]
    fn damaged_words_are_refused() {
        let image = ending((200, 200));
        let (bits, words) = written(&image);
        let known = DepthImage { ends: Vec::new(), ..image };
        let refused = |words: &[u8]| read(&known, &mut BitReader::new(&bits), words).is_err();
        assert!(refused(&[]) && refused(&words[..words.len() - 4]) && refused(&[&words[..], &[0; 4]].concat()));
        let mut flipped = words.clone();
        flipped[words.len() / 2] ^= 1;
        assert!(refused(&flipped));
        for image in [ending((40, 40)), tatters((40, 40))] {
            let (bits, words) = written(&image);
            assert!(words.is_empty(), "few sides, or none");
            let known = DepthImage { ends: Vec::new(), ..image };
            assert!(read(&known, &mut BitReader::new(&bits), &[0; 4]).is_err(), "words that nobody wrote");
        }
    }
}
