//! Bytes of a sky: nine harmonics, the number of its first level, and each level as two sections, the low and the high bytes of what its
//! texels differ from what the three before them let expect. Half floats of positive numbers ascend with them, so differences are as of logarithms.

use super::{CodecError, Packer, Unpacker};
use crate::bytes::{Reader, Writer};
use crate::sky::{Sky, SkyLevel};

/// Twelve bits of half floats are coded.
const CODES: u16 = 1 << (16 - Sky::CUT_BITS);

/// Appends a sky.
pub(crate) fn write_sky(sky: &Sky, packer: &mut Packer, out: &mut Writer) {
    sky.diffuse.iter().flatten().for_each(|&number| out.f32(number));
    out.u8(sky.first_level);
    for (level, number) in sky.levels.iter().zip(usize::from(sky.first_level)..) {
        let side_px = Sky::side_px(number);
        let mut planes = [Vec::new(), Vec::new()];
        for channel in 0..3 {
            let codes: Vec<u16> = level.texels.iter().map(|texel| texel[channel] >> Sky::CUT_BITS).collect();
            for (index, code) in codes.iter().enumerate() {
                let [low, high] = residual(code.wrapping_sub(expected(&codes, index, side_px))).to_le_bytes();
                planes[0].push(low);
                planes[1].push(high);
            }
        }
        planes.iter().for_each(|plane| packer.pack(plane, out));
    }
}

/// Reads what [`write_sky`] wrote.
pub(crate) fn read_sky(bytes: &mut Reader, unpacker: &mut Unpacker) -> Result<Sky, CodecError> {
    let mut diffuse = [[0.0; 3]; Sky::HARMONICS];
    for number in diffuse.iter_mut().flatten() {
        *number = bytes.f32()?;
    }
    let first_level = bytes.u8()?;
    if usize::from(first_level) >= Sky::LEVELS {
        return Err(CodecError::Damaged("first level of a sky"));
    }
    let levels = (usize::from(first_level)..Sky::LEVELS).map(|number| {
        let side_px = Sky::side_px(number);
        let count = side_px * side_px;
        let low = unpacker.unpack(bytes, 3 * count)?;
        let high = unpacker.unpack(bytes, 3 * count)?;
        let channel = |first: usize| {
            let mut codes = vec![0; count];
            for index in 0..count {
                let at = first + index;
                let difference = difference(u16::from_le_bytes([low[at], high[at]]));
                codes[index] = expected(&codes, index, side_px).wrapping_add(difference) % CODES;
            }
            codes
        };
        let [red, green, blue] = [0, count, 2 * count].map(channel);
        let texels = (0..count).map(|index| [red[index], green[index], blue[index]].map(|code| code << Sky::CUT_BITS));
        let texels = texels.collect();
        Ok(SkyLevel { texels })
    });
    let levels = levels.collect::<Result<_, CodecError>>()?;
    Ok(Sky { diffuse, first_level, levels })
}

/// What a plane through the three texels before one gives it; along the first row and column, the one before.
fn expected(codes: &[u16], index: usize, side_px: usize) -> u16 {
    let (x, y) = (index % side_px, index / side_px);
    match (x, y) {
        (0, 0) => 0,
        (_, 0) => codes[index - 1],
        (0, _) => codes[index - side_px],
        _ => {
            let plane = codes[index - 1].wrapping_add(codes[index - side_px]);
            plane.wrapping_sub(codes[index - side_px - 1]) % CODES
        }
    }
}

/// Differences near zero, of either sign, as small numbers.
fn residual(difference: u16) -> u16 {
    let signed = difference as i16;
    ((signed << 1) ^ (signed >> 15)) as u16
}

fn difference(residual: u16) -> u16 {
    (residual >> 1) ^ 0u16.wrapping_sub(residual & 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sky(first_level: u8) -> Sky {
        let texel =
            |index: usize| std::array::from_fn(|channel| ((index * (7 + channel)) as u16 % 0x7c0) << Sky::CUT_BITS);
        let level = |number: usize| SkyLevel { texels: (0..Sky::side_px(number).pow(2)).map(texel).collect() };
        let diffuse = std::array::from_fn(|index| [index as f32, -0.5, 0.25]);
        Sky { diffuse, first_level, levels: (usize::from(first_level)..Sky::LEVELS).map(level).collect() }
    }

    fn written(sky: &Sky) -> Vec<u8> {
        let mut out = Writer::default();
        write_sky(sky, &mut Packer::new(), &mut out);
        out.bytes
    }

    fn read(bytes: &[u8]) -> Result<Sky, CodecError> {
        read_sky(&mut Reader::new(bytes), &mut Unpacker::new())
    }

    #[test]
    fn a_sky_comes_back_as_it_is() {
        for first_level in 0..Sky::LEVELS as u8 {
            let sky = sky(first_level);
            assert!(sky.is_whole());
            assert_eq!(read(&written(&sky)), Ok(sky));
        }
    }

    #[test]
    fn damaged_bytes_are_refused_or_make_another_sky() {
        let bytes = written(&sky(3));
        for cut in 0..bytes.len() {
            assert!(read(&bytes[..cut]).is_err(), "cut to {cut} bytes");
        }
        for index in 0..bytes.len() {
            let mut damaged = bytes.clone();
            damaged[index] ^= 1 << (index % 8);
            // No panic; what is infinite or no number is refused where it would be held.
            let _ = read(&damaged);
        }
    }
}
