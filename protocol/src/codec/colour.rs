//! The plane of base colours.

use super::channel::{ChannelReader, ChannelWriter};
use super::neighbours::{Around, Neighbours, median_edge};
use super::streams::{StreamIter, StreamWriter};
use super::{CodecError, copy, tried};

/// Colours repeat: untextured surfaces.
const COPY: u8 = 1;
/// Textures: YCoCg-R, each channel predicted by [`median_edge`].
const MEDIAN_EDGE: u8 = 2;
/// As above, each channel predicted by a plane that is drawn towards the mean: fine, noisy textures.
const SMOOTHED: u8 = 3;

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
    let copied = copy::encode(&keys, 3, neighbours);
    let planes: Vec<[i16; 3]> = colour.iter().map(|&rgb| luma_chroma(rgb)).collect();
    let estimate = |method| {
        let tried = tried(colour.len());
        let share = colour.len() as f64 / tried.len() as f64;
        share * channels(method, &planes, neighbours, tried).iter().map(ChannelWriter::cost_bits).sum::<f64>()
    };
    let (median_edge_bits, smoothed_bits) = (estimate(MEDIAN_EDGE), estimate(SMOOTHED));
    if copied.cost_bits() <= median_edge_bits.min(smoothed_bits) {
        copied.write(streams);
        return COPY;
    }
    let method = if median_edge_bits <= smoothed_bits { MEDIAN_EDGE } else { SMOOTHED };
    channels(method, &planes, neighbours, 0..colour.len()).iter().for_each(|channel| channel.write(streams));
    method
}

fn channels(
    method: u8,
    planes: &[[i16; 3]],
    neighbours: &Neighbours,
    ranks: std::ops::Range<usize>,
) -> [ChannelWriter; 3] {
    let mut channels = [0; 3].map(|_| ChannelWriter::starting_at(ranks.start, planes.len(), 16));
    for rank in ranks {
        let around = neighbours.around(rank);
        let predicted = predict(method, planes, rank, around);
        let mut extra = 0;
        for (index, channel) in channels.iter_mut().enumerate() {
            let code = channel.push(around, extra, predicted[index], planes[rank][index].into());
            extra = u32::from(code) / 2;
        }
    }
    channels
}

pub(super) fn read(
    method: u8,
    count: usize,
    neighbours: &Neighbours,
    streams: &mut StreamIter,
) -> Result<Vec<[u8; 3]>, CodecError> {
    match method {
        COPY => {
            let keys = copy::decode(count, 3, neighbours, streams)?;
            Ok(keys.into_iter().map(|key| [key as u8, (key >> 8) as u8, (key >> 16) as u8]).collect())
        }
        MEDIAN_EDGE | SMOOTHED => {
            let mut channel = || ChannelReader::read(streams, count, 16);
            let mut channels = [channel()?, channel()?, channel()?];
            let mut planes: Vec<[i16; 3]> = Vec::with_capacity(count);
            for rank in 0..count {
                let around = neighbours.around(rank);
                let predicted = predict(method, &planes, rank, around);
                let (mut sample, mut extra) = ([0; 3], 0);
                for ((value, channel), predicted) in sample.iter_mut().zip(&mut channels).zip(predicted) {
                    let (code, found) = channel.next(around, extra, predicted)?;
                    *value = found as i16;
                    extra = u32::from(code) / 2;
                }
                planes.push(sample);
            }
            channels.into_iter().try_for_each(ChannelReader::finish)?;
            Ok(planes.into_iter().map(rgb).collect())
        }
        _ => Err(CodecError::Damaged("colour predictor")),
    }
}

/// Looks only at samples before `rank`.
#[inline]
fn predict(method: u8, planes: &[[i16; 3]], rank: usize, around: Around) -> [i32; 3] {
    let at = |rank: usize, channel: usize| i32::from(planes[rank][channel]);
    std::array::from_fn(|channel| match around {
        Around::Nothing => 0,
        Around::Anchor(anchor) => at(anchor, channel),
        Around::Left => at(rank - 1, channel),
        Around::Up(up) => at(up, channel),
        Around::LeftUp(up) => (at(rank - 1, channel) + at(up, channel)) / 2,
        Around::All(up) => {
            let (left, above, corner) = (at(rank - 1, channel), at(up, channel), at(up - 1, channel));
            match method {
                SMOOTHED => (3 * (left + above) - 2 * corner + 2) >> 2,
                _ => median_edge(left, above, corner),
            }
        }
    })
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
