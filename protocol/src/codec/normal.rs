//! The plane of octahedral normals.

use super::copy;
use super::neighbours::{Around, Neighbours, median_edge};
use super::residual::entropy_bits;
use super::streams::{StreamIter, StreamWriter};
use super::{CodecError, sampled};

/// Normals repeat: flat surfaces.
const COPY: u8 = 1;
/// Normals change smoothly: each coordinate predicted by [`median_edge`].
const SMOOTH: u8 = 2;

pub(super) fn write(normal: &[[u8; 2]], neighbours: &Neighbours, streams: &mut StreamWriter) -> u8 {
    let keys: Vec<u32> = normal.iter().map(|&code| u32::from(u16::from_le_bytes(code))).collect();
    let (symbols, new) = copy::encode(&keys, neighbours);
    let copied_bits = entropy_bits(&symbols) + new.len() as f64 * 16.0;
    let sample: [Vec<u8>; 2] =
        [0, 1].map(|axis| sampled(normal.len()).map(|rank| residual(normal, rank, axis, neighbours)).collect());
    let share = normal.len() as f64 / sample[0].len() as f64;
    let smooth_bits = share * sample.iter().map(|residuals| entropy_bits(residuals)).sum::<f64>();
    if copied_bits <= smooth_bits {
        streams.push(&symbols);
        for axis in 0..2 {
            streams.push(&new.iter().map(|code| code.to_le_bytes()[axis]).collect::<Vec<u8>>());
        }
        return COPY;
    }
    for axis in 0..2 {
        let residuals: Vec<u8> = (0..normal.len()).map(|rank| residual(normal, rank, axis, neighbours)).collect();
        streams.push(&residuals);
    }
    SMOOTH
}

pub(super) fn read(
    method: u8,
    count: usize,
    neighbours: &Neighbours,
    streams: &mut StreamIter,
) -> Result<Vec<[u8; 2]>, CodecError> {
    match method {
        COPY => {
            let symbols = streams.next_of(count)?;
            let first = streams.next()?;
            let second = streams.next_of(first.len())?;
            let new = first.iter().zip(second).map(|(&first, &second)| u32::from(u16::from_le_bytes([first, second])));
            let keys = copy::decode(symbols, new, neighbours)?;
            Ok(keys.into_iter().map(|key| (key as u16).to_le_bytes()).collect())
        }
        SMOOTH => {
            let (first, second) = (streams.next_of(count)?, streams.next_of(count)?);
            let mut normal = Vec::with_capacity(count);
            for (rank, residuals) in first.iter().zip(second).enumerate() {
                let [u, v] = predict(&normal, rank, neighbours);
                let (du, dv) = (unzigzag(*residuals.0), unzigzag(*residuals.1));
                normal.push([u.wrapping_add(du), v.wrapping_add(dv)]);
            }
            Ok(normal)
        }
        _ => Err(CodecError::Damaged("normal predictor")),
    }
}

fn residual(normal: &[[u8; 2]], rank: usize, axis: usize, neighbours: &Neighbours) -> u8 {
    zigzag(normal[rank][axis].wrapping_sub(predict(normal, rank, neighbours)[axis]))
}

/// Looks only at normals before `rank`.
fn predict(normal: &[[u8; 2]], rank: usize, neighbours: &Neighbours) -> [u8; 2] {
    let both = |combine: &dyn Fn(usize) -> i32| [combine(0) as u8, combine(1) as u8];
    let at = |rank: usize, axis: usize| i32::from(normal[rank][axis]);
    match neighbours.around(rank) {
        Around::Nothing => [127, 127],
        Around::Anchor(anchor) => normal[anchor],
        Around::Left => normal[rank - 1],
        Around::Up(up) => normal[up],
        Around::LeftUp(up) => both(&|axis| (at(rank - 1, axis) + at(up, axis)) / 2),
        Around::All(up) => both(&|axis| median_edge(at(rank - 1, axis), at(up, axis), at(up - 1, axis))),
    }
}

/// 0, -1, 1, -2, ... as 0, 1, 2, 3, ...
fn zigzag(value: u8) -> u8 {
    value << 1 ^ ((value as i8) >> 7) as u8
}

fn unzigzag(code: u8) -> u8 {
    code >> 1 ^ (code & 1).wrapping_neg()
}
