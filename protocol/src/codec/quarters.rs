//! What rounding left off of base colours in views at rest ([`DepthImage::colour_rest`]), for both profiles.
//!
//! Two bits a channel. Where a neighbour of the same object has the same colour it most likely left off the same: a plain surface costs next to
//! nothing. Elsewhere they are noise, and cost what they are. Images without any say so in a decision that next to always comes, at no bytes.

use super::bits::{Bits, Probability};
use super::segments::segments;
use crate::image::DepthImage;

/// That an image has none, in 1/32768.
const NONE: u32 = 32_767;
/// By what a neighbour of the same colour left off, and a last one where there is none.
const CONTEXTS: usize = 5;

/// Codes the plane of an image whose other planes are known; a writer hands in `rest`, a reader nothing.
pub(super) fn code(bits: &mut impl Bits, image: &DepthImage, mut rest: Vec<u8>) -> Vec<u8> {
    if !bits.decide(NONE, !rest.is_empty()) {
        return Vec::new();
    }
    rest.resize(image.sample_count(), 0);
    let mut trees = [[[Probability::EVEN; 4]; CONTEXTS]; 3];
    for segment in segments(&image.mask, Some(&image.object)) {
        for (column, rank) in segment.ranks().enumerate() {
            let [left, up, ..] = segment.near(column);
            let like = |channel: usize| {
                let is_like =
                    |&other: &usize| other < rank && image.colour[other][channel] == image.colour[rank][channel];
                [left, up].into_iter().find(is_like)
            };
            let coded = std::array::from_fn(|channel| {
                let context = like(channel).map_or(CONTEXTS - 1, |other| usize::from(two_bits(rest[other], channel)));
                bits.tree(&mut trees[channel][context], 2, two_bits(rest[rank], channel).into()) as u8
            });
            let [red, green, blue]: [u8; 3] = coded;
            rest[rank] = red | green << 2 | blue << 4;
        }
    }
    rest
}

fn two_bits(rest: u8, channel: usize) -> u8 {
    rest >> (2 * channel) & 3
}
