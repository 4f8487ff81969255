//! Base colours as luma and chroma, exactly or in steps.
//!
//! Luma, orange and green differences are those of YCoCg-R (Malvar, Sullivan, YCoCg-R: A Color Space with RGB Reversibility and Low
//! Dynamic Range, 2003), which gives every colour back. In steps, each is a multiple of its step, so a colour is moved by
//! half a step at most *before* it is coded; what is coded then is exact again. So errors never add up, whatever is predicted
//! from what, colours that were the same stay the same, and the sender holds what the receiver will.

/// How often a colour is cut off at the faces of the cube before it stays; tested on every colour.
const MOST_CUTS: usize = 2;

/// Of a byte's values: negative ones come below.
const MIDDLE: u8 = 0x80;

/// How exactly colours are kept.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum ColourSteps {
    /// As they are.
    #[default]
    Lossless,
    /// Luma in steps of 2, chroma in steps of 4.
    Fine,
    /// Luma in steps of 4, chroma in steps of 8.
    Coarse,
}

impl ColourSteps {
    /// Every choice, the finest first.
    pub const ALL: [ColourSteps; 3] = [ColourSteps::Lossless, ColourSteps::Fine, ColourSteps::Coarse];

    /// [`ColourSteps::codes`] of a plane.
    pub(super) fn codes_of_all(self, colours: &[[u8; 3]]) -> Vec<[i16; 3]> {
        // One loop for each, or the shifts are looked up at every sample.
        match self {
            ColourSteps::Lossless => colours.iter().map(|&colour| ColourSteps::Lossless.codes(colour)).collect(),
            ColourSteps::Fine => colours.iter().map(|&colour| ColourSteps::Fine.codes(colour)).collect(),
            ColourSteps::Coarse => colours.iter().map(|&colour| ColourSteps::Coarse.codes(colour)).collect(),
        }
    }

    /// [`ColourSteps::rgb`] of a plane.
    pub(super) fn rgb_of_all(self, codes: &[[i16; 3]]) -> Vec<[u8; 3]> {
        match self {
            ColourSteps::Lossless => codes.iter().map(|&codes| ColourSteps::Lossless.rgb(codes)).collect(),
            ColourSteps::Fine => codes.iter().map(|&codes| ColourSteps::Fine.rgb(codes)).collect(),
            ColourSteps::Coarse => codes.iter().map(|&codes| ColourSteps::Coarse.rgb(codes)).collect(),
        }
    }

    /// Binary logarithms of the steps of luma and of both chromas.
    #[inline(always)]
    fn shifts(self) -> [u32; 3] {
        match self {
            ColourSteps::Lossless => [0, 0, 0],
            ColourSteps::Fine => [1, 2, 2],
            ColourSteps::Coarse => [2, 3, 3],
        }
    }

    /// The colour that a receiver gets for a colour. A colour that a receiver got is kept as it is.
    pub fn settle(self, colour: [u8; 3]) -> [u8; 3] {
        if self == ColourSteps::Lossless {
            return colour;
        }
        let mut settled = self.rgb(self.codes(colour));
        // At the faces of the cube a colour may be cut off, and then lie nearer to other steps.
        for _ in 0..MOST_CUTS {
            settled = self.rgb(self.codes(settled));
        }
        settled
    }

    /// [`ColourSteps::settle`] for a plane. Neighbours of one colour are looked up once.
    pub fn settle_all(self, colours: &mut [[u8; 3]]) {
        if self == ColourSteps::Lossless {
            return;
        }
        for colour in colours {
            *colour = self.settle(*colour);
        }
    }

    /// A colour in steps: luma, orange, green.
    #[inline(always)]
    pub(super) fn codes(self, [r, g, b]: [u8; 3]) -> [i16; 3] {
        let [r, g, b] = [i16::from(r), i16::from(g), i16::from(b)];
        let [luma, orange, green] = self.shifts();
        if self == ColourSteps::Lossless {
            // By lifting: the floors are undone by the same floors.
            let orange = r - b;
            let middle = b + (orange >> 1);
            let green = g - middle;
            return [middle + (green >> 1), orange, green];
        }
        // From the unrounded values: a floor before the rounding would darken every colour.
        [round(r + 2 * g + b, luma + 2), round(r - b, orange), round(2 * g - r - b, green + 1)]
    }

    /// A colour as three bytes, for coders that predict: in steps luma and the chromas around the middle; exactly, the green,
    /// and what red and blue are above it, which wrap around the middle.
    #[inline(always)]
    pub(super) fn bytes(self, colour: [u8; 3]) -> [u8; 3] {
        let [r, g, b] = colour;
        if self == ColourSteps::Lossless {
            return [g, r.wrapping_sub(g) ^ MIDDLE, b.wrapping_sub(g) ^ MIDDLE];
        }
        let [luma, orange, green] = self.codes(colour).map(|code| code as u8);
        [luma, orange ^ MIDDLE, green ^ MIDDLE]
    }

    /// The colour of [`ColourSteps::bytes`].
    #[inline(always)]
    pub(super) fn rgb_of_bytes(self, [first, second, third]: [u8; 3]) -> [u8; 3] {
        let (second, third) = (second ^ MIDDLE, third ^ MIDDLE);
        if self == ColourSteps::Lossless {
            return [second.wrapping_add(first), first, third.wrapping_add(first)];
        }
        self.rgb([first.into(), (second as i8).into(), (third as i8).into()])
    }

    /// Appends colours by [`ColourSteps::rgb_of_bytes`].
    pub(super) fn extend_by_bytes(self, colours: &mut Vec<[u8; 3]>, bytes: impl Iterator<Item = [u8; 3]>) {
        // One loop for each, or the shifts are looked up at every sample.
        match self {
            ColourSteps::Lossless => colours.extend(bytes.map(|bytes| ColourSteps::Lossless.rgb_of_bytes(bytes))),
            ColourSteps::Fine => colours.extend(bytes.map(|bytes| ColourSteps::Fine.rgb_of_bytes(bytes))),
            ColourSteps::Coarse => colours.extend(bytes.map(|bytes| ColourSteps::Coarse.rgb_of_bytes(bytes))),
        }
    }

    /// The colour of some codes; where they leave the cube, the nearest channel values inside.
    #[inline(always)]
    pub(super) fn rgb(self, codes: [i16; 3]) -> [u8; 3] {
        let shifts = self.shifts();
        let [luma, orange, green]: [i16; 3] = std::array::from_fn(|c| codes[c] << shifts[c]);
        let middle = luma.wrapping_sub(green >> 1);
        let b = middle.wrapping_sub(orange >> 1);
        let rgb = [b.wrapping_add(orange), green.wrapping_add(middle), b];
        rgb.map(|value| value.clamp(0, 255) as u8)
    }
}

/// A value in steps of `2^shift`, halves to the even step, so that the mean is kept.
#[inline(always)]
fn round(value: i16, shift: u32) -> i16 {
    (value + (1 << (shift - 1)) - 1 + (value >> shift & 1)) >> shift
}

#[cfg(test)]
mod tests {
    use super::*;

    fn every_colour() -> impl Iterator<Item = [u8; 3]> {
        (0..1_u32 << 24).map(|code| [code as u8, (code >> 8) as u8, (code >> 16) as u8])
    }

    #[test]
    fn lossless_gives_every_colour_back() {
        let steps = ColourSteps::Lossless;
        assert!(every_colour().all(|colour| steps.rgb(steps.codes(colour)) == colour));
    }

    #[test]
    fn what_a_receiver_got_is_kept() {
        for steps in ColourSteps::ALL {
            let changed = every_colour().map(|colour| steps.settle(colour)).find(|&c| steps.rgb(steps.codes(c)) != c);
            assert_eq!(changed, None, "{steps:?}");
            let changed = every_colour().map(|c| steps.settle(c)).find(|&c| steps.rgb_of_bytes(steps.bytes(c)) != c);
            assert_eq!(changed, None, "{steps:?} as bytes");
        }
    }

    #[test]
    fn colours_move_by_little_and_not_on_average() {
        for (steps, most, mean_bound) in [(ColourSteps::Fine, 5, 0.1), (ColourSteps::Coarse, 10, 0.2)] {
            let (mut furthest, mut sum, mut count, mut square) = (0, [0.0; 3], 0.0, 0.0);
            for colour in every_colour().step_by(7) {
                let settled = steps.settle(colour);
                count += 1.0;
                for channel in 0..3 {
                    let moved = i32::from(settled[channel]) - i32::from(colour[channel]);
                    furthest = furthest.max(moved.abs());
                    sum[channel] += f64::from(moved);
                    square += f64::from(moved * moved);
                }
            }
            let psnr = 10.0 * (255.0 * 255.0 * 3.0 * count / square).log10();
            eprintln!("{steps:?}: {furthest} {:?} {psnr}", sum.map(|s| s / count));
            assert!(furthest <= most, "{steps:?} moves a channel by {furthest}");
            assert!(sum.iter().all(|sum| (sum / count).abs() < mean_bound), "{steps:?} shifts the mean");
        }
    }
}
