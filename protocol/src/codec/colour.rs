//! The plane of base colours.

use super::copy;
use super::neighbours::{Around, Neighbours, median_edge};
use super::residual::{ResidualReader, ResidualWriter, entropy_bits};
use super::streams::{StreamIter, StreamWriter};
use super::{CodecError, sampled};

/// Colours repeat: untextured surfaces.
const COPY: u8 = 1;
/// Textures: YCoCg-R, each channel predicted by [`median_edge`].
const MEDIAN_EDGE: u8 = 2;
/// As above, each channel predicted by the neighbour to the left: noise, and fragments one pixel wide.
const NEIGHBOUR: u8 = 3;

/// Luma, orange, green: lossless (Malvar, Sullivan, YCoCg-R: A Color Space with RGB Reversibility and Low Dynamic Range,
/// 2003).
fn luma_chroma([r, g, b]: [u8; 3]) -> [i16; 3] {
    let [r, g, b] = [i16::from(r), i16::from(g), i16::from(b)];
    let orange = r - b;
    let middle = b + (orange >> 1);
    let green = g - middle;
    [middle + (green >> 1), orange, green]
}

/// The inverse; damaged values wrap.
fn rgb([luma, orange, green]: [i16; 3]) -> [u8; 3] {
    let middle = luma.wrapping_sub(green >> 1);
    let b = middle.wrapping_sub(orange >> 1);
    [b.wrapping_add(orange) as u8, green.wrapping_add(middle) as u8, b as u8]
}

pub(super) fn write(colour: &[[u8; 3]], neighbours: &Neighbours, streams: &mut StreamWriter) -> u8 {
    let keys: Vec<u32> = colour.iter().map(|&[r, g, b]| u32::from_le_bytes([r, g, b, 0])).collect();
    let (symbols, new) = copy::encode(&keys, neighbours);
    let copied_bits = entropy_bits(&symbols) + new.len() as f64 * 24.0;
    let planes: Vec<[i16; 3]> = colour.iter().map(|&rgb| luma_chroma(rgb)).collect();
    let estimate = |method| {
        let residuals = residuals(method, &planes, neighbours, sampled(colour.len()));
        let share = colour.len() as f64 / residuals[0].bytes.len() as f64;
        let bits = |channel: &ResidualWriter| entropy_bits(&channel.bytes) + channel.escaped.len() as f64 * 16.0;
        share * residuals.iter().map(bits).sum::<f64>()
    };
    let (median_edge_bits, neighbour_bits) = (estimate(MEDIAN_EDGE), estimate(NEIGHBOUR));
    if copied_bits <= median_edge_bits.min(neighbour_bits) {
        streams.push(&symbols);
        for channel in 0..3 {
            streams.push(&new.iter().map(|rgb| rgb.to_le_bytes()[channel]).collect::<Vec<u8>>());
        }
        return COPY;
    }
    let method = if median_edge_bits <= neighbour_bits { MEDIAN_EDGE } else { NEIGHBOUR };
    for channel in residuals(method, &planes, neighbours, 0..colour.len()) {
        streams.push(&channel.bytes);
        streams.push_shorts(&channel.escaped);
    }
    method
}

pub(super) fn read(
    method: u8,
    count: usize,
    neighbours: &Neighbours,
    streams: &mut StreamIter,
) -> Result<Vec<[u8; 3]>, CodecError> {
    match method {
        COPY => {
            let symbols = streams.next_of(count)?;
            let reds = streams.next()?;
            let (greens, blues) = (streams.next_of(reds.len())?, streams.next_of(reds.len())?);
            let new = reds.iter().zip(greens).zip(blues).map(|((&r, &g), &b)| u32::from_le_bytes([r, g, b, 0]));
            let keys = copy::decode(symbols, new, neighbours)?;
            Ok(keys.into_iter().map(|key| [key as u8, (key >> 8) as u8, (key >> 16) as u8]).collect())
        }
        MEDIAN_EDGE | NEIGHBOUR => {
            let mut channel =
                || -> Result<_, CodecError> { Ok(ResidualReader::new(streams.next_of(count)?, streams.next()?)) };
            let mut channels = [channel()?, channel()?, channel()?];
            let mut planes: Vec<[i16; 3]> = Vec::with_capacity(count);
            for rank in 0..count {
                let mut sample = predict(method, &planes, rank, neighbours);
                for (value, residuals) in sample.iter_mut().zip(&mut channels) {
                    *value = value.wrapping_add(residuals.next()?);
                }
                planes.push(sample);
            }
            Ok(planes.into_iter().map(rgb).collect())
        }
        _ => Err(CodecError::Damaged("colour predictor")),
    }
}

fn residuals(
    method: u8,
    planes: &[[i16; 3]],
    neighbours: &Neighbours,
    ranks: impl Iterator<Item = usize>,
) -> [ResidualWriter; 3] {
    let mut residuals = [0; 3].map(|_| ResidualWriter::with_capacity(ranks.size_hint().0));
    for rank in ranks {
        let predicted = predict(method, planes, rank, neighbours);
        for (channel, residuals) in residuals.iter_mut().enumerate() {
            residuals.push(planes[rank][channel] - predicted[channel]);
        }
    }
    residuals
}

/// Looks only at samples before `rank`.
fn predict(method: u8, planes: &[[i16; 3]], rank: usize, neighbours: &Neighbours) -> [i16; 3] {
    match neighbours.around(rank) {
        Around::Nothing => [128, 0, 0],
        Around::Anchor(anchor) => planes[anchor],
        Around::Left => planes[rank - 1],
        Around::Up(up) => planes[up],
        Around::LeftUp(_) | Around::All(_) if method == NEIGHBOUR => planes[rank - 1],
        Around::LeftUp(up) => {
            let (left, up) = (planes[rank - 1], planes[up]);
            std::array::from_fn(|channel| ((i32::from(left[channel]) + i32::from(up[channel])) / 2) as i16)
        }
        Around::All(up) => {
            let (left, corner, up) = (planes[rank - 1], planes[up - 1], planes[up]);
            std::array::from_fn(|channel| {
                median_edge(left[channel].into(), up[channel].into(), corner[channel].into()) as i16
            })
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn luma_and_chroma_are_reversible() {
        for colour in (0..1 << 24).step_by(7) {
            let [r, g, b, _] = u32::to_le_bytes(colour);
            assert_eq!(rgb(luma_chroma([r, g, b])), [r, g, b]);
        }
    }
}
