//! The plane of octahedral normals.

use super::channel::{ChannelReader, ChannelWriter};
use super::neighbours::{Around, Neighbours, median_edge};
use super::streams::{StreamIter, StreamWriter};
use super::{CodecError, copy, tried};

/// Normals repeat: flat surfaces.
const COPY: u8 = 1;
/// Normals change smoothly: each coordinate predicted by [`median_edge`].
const SMOOTH: u8 = 2;

pub(super) fn write(normal: &[[u8; 2]], neighbours: &Neighbours, streams: &mut StreamWriter) -> u8 {
    let keys: Vec<u32> = normal.iter().map(|&code| u32::from(u16::from_le_bytes(code))).collect();
    let copied = copy::encode(&keys, 2, neighbours);
    let tried = tried(normal.len());
    let share = normal.len() as f64 / tried.len() as f64;
    let smooth_bits = share * channels(normal, neighbours, tried).iter().map(ChannelWriter::cost_bits).sum::<f64>();
    if copied.cost_bits() <= smooth_bits {
        copied.write(streams);
        return COPY;
    }
    channels(normal, neighbours, 0..normal.len()).iter().for_each(|channel| channel.write(streams));
    SMOOTH
}

fn channels(normal: &[[u8; 2]], neighbours: &Neighbours, ranks: std::ops::Range<usize>) -> [ChannelWriter; 2] {
    let mut channels = [0; 2].map(|_| ChannelWriter::starting_at(ranks.start, normal.len(), 8));
    for rank in ranks {
        let around = neighbours.around(rank);
        let predicted = predict(normal, rank, around);
        let mut extra = 0;
        for (axis, channel) in channels.iter_mut().enumerate() {
            extra = u32::from(channel.push(around, extra, predicted[axis], normal[rank][axis].into()));
        }
    }
    channels
}

pub(super) fn read(
    method: u8,
    count: usize,
    neighbours: &Neighbours,
    streams: &mut StreamIter,
) -> Result<Vec<[u8; 2]>, CodecError> {
    match method {
        COPY => {
            let keys = copy::decode(count, 2, neighbours, streams)?;
            Ok(keys.into_iter().map(|key| (key as u16).to_le_bytes()).collect())
        }
        SMOOTH => {
            let mut channels = [ChannelReader::read(streams, count, 8)?, ChannelReader::read(streams, count, 8)?];
            let mut normal = Vec::with_capacity(count);
            for rank in 0..count {
                let around = neighbours.around(rank);
                let predicted = predict(&normal, rank, around);
                let (mut code, mut extra) = ([0; 2], 0);
                for ((value, channel), predicted) in code.iter_mut().zip(&mut channels).zip(predicted) {
                    let (seen, found) = channel.next(around, extra, predicted)?;
                    *value = found as u8;
                    extra = u32::from(seen);
                }
                normal.push(code);
            }
            channels.into_iter().try_for_each(ChannelReader::finish)?;
            Ok(normal)
        }
        _ => Err(CodecError::Damaged("normal predictor")),
    }
}

/// Looks only at normals before `rank`.
fn predict(normal: &[[u8; 2]], rank: usize, around: Around) -> [i32; 2] {
    let at = |rank: usize, axis: usize| i32::from(normal[rank][axis]);
    [0, 1].map(|axis| match around {
        Around::Nothing => 127,
        Around::Anchor(anchor) => at(anchor, axis),
        Around::Left => at(rank - 1, axis),
        Around::Up(up) => at(up, axis),
        Around::LeftUp(up) => (at(rank - 1, axis) + at(up, axis)) / 2,
        Around::All(up) => {
            let (left, above, corner) = (at(rank - 1, axis), at(up, axis), at(up - 1, axis));
            median_edge(left, above, corner)
        }
    })
}
