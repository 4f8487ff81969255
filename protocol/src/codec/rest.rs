//! What rounding left off of the normals of reflectors ([`DepthImage::normal_rest`]), for both profiles.
//!
//! With its code a normal is two numbers of 12 bits, which neighbours of the same object predict. The code is known when this is read,
//! so the lowest four bits of the difference are all that is left to say. Images without any say so in a decision that next to always
//! comes, at no bytes.

use super::bits::{Bits, Probability};
use super::residual::{Predictor, mean};
use super::segments::{Around, segments};
use crate::image::{DepthImage, rest_steps};

/// That an image has none, in 1/32768.
const NONE: u32 = 32_767;
/// Sizes of the neighbours' differences told apart, and a last one for samples without all neighbours.
const CONTEXTS: usize = 6;

/// Codes the plane of an image whose other planes are known; a writer hands in `rest`, a reader nothing.
pub(super) fn code(bits: &mut impl Bits, image: &DepthImage, mut rest: Vec<u8>) -> Vec<u8> {
    if !bits.decide(NONE, !rest.is_empty()) {
        return Vec::new();
    }
    rest.resize(image.sample_count(), 0);
    let has_rest = materials(bits, image, &rest);
    // Samples ahead count as their codes alone, which is what a reader knows of them.
    let mut values: Vec<[i16; 2]> = image.normal.iter().map(|&normal| value(normal, 0)).collect();
    let mut sizes = vec![[0_u8; 2]; rest.len()];
    let mut trees = [[[Probability::EVEN; 16]; CONTEXTS]; 2];
    for segment in segments(&image.mask, Some(&image.object)) {
        for (column, rank) in segment.ranks().enumerate() {
            if !has_rest[usize::from(image.material[rank])] {
                continue;
            }
            let near = segment.near(column);
            let steps = rest_steps(rest[rank]);
            let coded: [u8; 2] = std::array::from_fn(|channel| {
                let [left, up, corner, _] = near.map(|rank| values[rank][channel]);
                let predicted = match segment.around {
                    Around::All => Predictor::Gradient.predict(left, up, corner),
                    Around::LeftUp => mean(left, up),
                    _ => left,
                };
                let context = match segment.around {
                    Around::All => usize::from((sizes[near[0]][channel] + sizes[near[1]][channel]).min(8)).div_ceil(2),
                    _ => CONTEXTS - 1,
                };
                let difference = i16::from(steps[channel]).wrapping_sub(predicted) as u8 & 15;
                let difference = bits.tree(&mut trees[channel][context], 4, difference.into()) as u8;
                sizes[rank][channel] = difference.min(16 - difference);
                (i16::from(difference).wrapping_add(predicted)) as u8 & 15
            });
            rest[rank] = coded[0] | coded[1] << 4;
            values[rank] = value(image.normal[rank], rest[rank]);
        }
    }
    rest
}

/// A code and what it left off, as two numbers of 12 bits.
fn value(normal: [u8; 2], rest: u8) -> [i16; 2] {
    let steps = rest_steps(rest);
    std::array::from_fn(|channel| 16 * i16::from(normal[channel]) + i16::from(steps[channel]))
}

/// Which of the materials that an image shows have any.
fn materials(bits: &mut impl Bits, image: &DepthImage, rest: &[u8]) -> [bool; 256] {
    let (mut is_shown, mut has_rest) = ([false; 256], [false; 256]);
    for (&material, &rest) in image.material.iter().zip(rest) {
        is_shown[usize::from(material)] = true;
        has_rest[usize::from(material)] |= rest != 0;
    }
    for (has_rest, _) in has_rest.iter_mut().zip(is_shown).filter(|(_, is_shown)| *is_shown) {
        *has_rest = bits.raw(u32::from(*has_rest), 1) == 1;
    }
    has_rest
}
