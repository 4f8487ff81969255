//! The mask: which pixels hold a sample, by decisions whose context is the ten pixels nearest in this row and the two above (the
//! template of JBIG, ITU-T T.82, §6.7.1). Stretches of 64 or of 8 pixels that go on as the row above take one decision. Only
//! the rectangle around the samples is coded.

use super::CodecError;
use super::bits::{Bits, Probability};
use crate::image::Mask;

/// Pixels of a short stretch.
const SHORT: u32 = 8;

/// What both ends learn while they go through the pixels.
struct Model {
    /// By context: five pixels of the row above, three of the one above that, two of this row.
    pixels: [Probability; 1024],
    /// Whether a stretch goes on, by its length and by what it would hold.
    stretches: [[Probability; 2]; 2],
}

/// Three rows of bits; bit `x` of a row is pixel `x` of the rectangle. A word of holes stands at both ends.
struct Rows {
    above2: Vec<u64>,
    above: Vec<u64>,
    here: Vec<u64>,
}

/// The rectangle that holds all samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Frame {
    x: u32,
    y: u32,
    width_px: u32,
    height_px: u32,
}

impl Frame {
    fn of(mask: &Mask) -> Frame {
        let (_, height_px) = mask.size_px();
        let (mut x, mut x_end, mut y, mut y_end) = (u32::MAX, 0, 0, 0);
        for row in 0..height_px {
            let mut first = true;
            mask.runs(row, |columns| {
                if x_end == 0 && first {
                    y = row;
                }
                first = false;
                (x, x_end, y_end) = (x.min(columns.start), x_end.max(columns.end), row + 1);
            });
        }
        if x_end == 0 {
            Frame { x: 0, y: 0, width_px: 0, height_px: 0 }
        } else {
            Frame { x, y, width_px: x_end - x, height_px: y_end - y }
        }
    }

    /// Codes the rectangle; one that does not fit the image is damaged.
    fn code(self, bits: &mut impl Bits, (width_px, height_px): (u32, u32)) -> Result<Frame, CodecError> {
        const DAMAGED: CodecError = CodecError::Damaged("frame of the samples");
        let whole = self == Frame { x: 0, y: 0, width_px, height_px };
        if bits.bit(&mut Probability::EVEN.clone(), whole) {
            return Ok(Frame { x: 0, y: 0, width_px, height_px });
        }
        let place = |most: u32| u32::BITS - most.leading_zeros();
        let mut number = |value: u32, most: u32| {
            let value = bits.raw(value, place(most));
            if value <= most { Ok(value) } else { Err(DAMAGED) }
        };
        let (x, y) = (number(self.x, width_px)?, number(self.y, height_px)?);
        let (width_px, height_px) = (number(self.width_px, width_px - x)?, number(self.height_px, height_px - y)?);
        Ok(Frame { x, y, width_px, height_px })
    }
}

/// Codes a mask; a reader fills an empty one.
pub(super) fn code<B: Bits>(bits: &mut B, mask: &mut Mask) -> Result<(), CodecError> {
    let known = if B::WRITES { Frame::of(mask) } else { Frame { x: 0, y: 0, width_px: 0, height_px: 0 } };
    let frame = known.code(bits, mask.size_px())?;
    if frame.width_px == 0 || frame.height_px == 0 {
        return Ok(());
    }
    let even = [Probability::EVEN; 2];
    let mut model = Model { pixels: [Probability::EVEN; 1024], stretches: [even, even] };
    let words = frame.width_px.div_ceil(64) as usize;
    let row = || vec![0_u64; words + 2];
    let mut rows = Rows { above2: row(), above: row(), here: row() };
    for y in frame.y..frame.y + frame.height_px {
        std::mem::swap(&mut rows.above2, &mut rows.above);
        std::mem::swap(&mut rows.above, &mut rows.here);
        rows.here.fill(0);
        for word in 0..words {
            let x = frame.x + 64 * word as u32;
            let length = 64.min(frame.x + frame.width_px - x);
            let truth = if B::WRITES { mask.bits(x, y, length) } else { 0 };
            let read = model.word(bits, &mut rows, word + 1, length, truth);
            if !B::WRITES {
                mask.set_bits(x, y, read);
            }
        }
        extend(&mut rows.here, frame.width_px);
    }
    Ok(())
}

/// Repeats the first and the last pixel of a row outwards, so that a row that is full from edge to edge looks alike everywhere.
fn extend(row: &mut [u64], width_px: u32) {
    let last = row.len() - 2;
    let length = (width_px - 1) % 64 + 1;
    row[0] = (row[1] & 1).wrapping_neg();
    row[last + 1] = (row[last] >> (length - 1) & 1).wrapping_neg();
    row[last] |= row[last + 1] & !low_bits(length);
}

fn low_bits(count: u32) -> u64 {
    if count == 64 { u64::MAX } else { (1 << count) - 1 }
}

impl Model {
    fn word(&mut self, bits: &mut impl Bits, rows: &mut Rows, at: usize, length: u32, truth: u64) -> u64 {
        // Pixels `x - 2..=x + 2` of the row above from bit `x` on, and `x - 1..=x + 1` of the one above that.
        let wide = |row: &[u64], left: u32| {
            let (before, after) = (u128::from(row[at - 1] >> (64 - left)), u128::from(row[at + 1]));
            before | u128::from(row[at]) << left | after << (64 + left)
        };
        let (above2, above) = (wide(&rows.above2, 1), wide(&rows.above, 2));
        // The two pixels before, the nearest lowest; at the left edge they are taken to be as those above.
        let last = if at == 1 { rows.above[0] } else { rows.here[at - 1] };
        let mut before = (last >> 63 | last >> 61 & 2) as u32;
        let read = if let Some(goes_on) = self.stretch(bits, length, before & 1 == 1, above >> 1, truth) {
            goes_on
        } else {
            let mut read = 0;
            for start in (0..length).step_by(SHORT as usize) {
                let count = SHORT.min(length - start);
                let rest = (above >> (start + 1), truth >> start);
                if let Some(goes_on) = self.stretch(bits, count, before & 1 == 1, rest.0, rest.1) {
                    read |= goes_on << start;
                    before = if before & 1 == 1 { 3 } else { 0 };
                    continue;
                }
                let (mut above, mut above2) = ((above >> start) as u32, (above2 >> start) as u32);
                for x in start..start + count {
                    let context = (above & 0b1_1111) << 5 | (above2 & 0b111) << 2 | before & 3;
                    let pixel = bits.bit(&mut self.pixels[context as usize], truth >> x & 1 == 1);
                    before = before << 1 | u32::from(pixel);
                    read |= u64::from(pixel) << x;
                    (above, above2) = (above >> 1, above2 >> 1);
                }
            }
            read
        };
        rows.here[at] = read;
        read
    }

    /// `count` pixels, shifted down to the lowest bit, if the one before them and all above them are `value`, and they
    /// go on so. Of the row above, the pixel above to the left is the lowest bit.
    fn stretch(&mut self, bits: &mut impl Bits, count: u32, value: bool, above: u128, truth: u64) -> Option<u64> {
        let all_above = (1 << (count + 2)) - 1;
        if above & all_above != if value { all_above } else { 0 } {
            return None;
        }
        let held = if value { low_bits(count) } else { 0 };
        let goes_on = &mut self.stretches[usize::from(count > SHORT)][usize::from(value)];
        bits.bit(goes_on, truth & low_bits(count) == held).then_some(held)
    }
}
