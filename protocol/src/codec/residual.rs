//! Values as the difference from what their neighbours predict: channels of one plane, sample after sample.
//!
//! All arithmetic wraps, so that every value comes back whatever was predicted.

use super::segments::{Around, Segment};

/// How a value is predicted where it has all neighbours. Others repeat the only one, or take the mean of two.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Predictor {
    /// The one to the left.
    Left,
    /// The median edge detector of LOCO-I (Weinberger, Seroussi, Sapiro 2000, §III.A): at an edge the neighbour on this side
    /// of it, elsewhere the plane through the three.
    MedianEdge,
    /// The plane through the three: inverse depth is linear on a plane.
    Gradient,
    /// Between the plane and the mean: fine, noisy textures.
    Smoothed,
}

impl Predictor {
    pub const ALL: [Predictor; 4] = [Predictor::Left, Predictor::MedianEdge, Predictor::Gradient, Predictor::Smoothed];

    #[inline(always)]
    pub fn predict(self, left: i16, up: i16, corner: i16) -> i16 {
        let plane = left.wrapping_add(up).wrapping_sub(corner);
        match self {
            Predictor::Left => left,
            Predictor::MedianEdge => plane.max(left.min(up)).min(left.max(up)),
            Predictor::Gradient => plane,
            Predictor::Smoothed => plane.wrapping_add(mean(left, up)).wrapping_add(1) >> 1,
        }
    }
}

/// Where values wrap.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Range {
    /// 0 to 255.
    Byte,
    /// 16 bits.
    Short,
}

impl Range {
    /// The residual of least size that stands for a difference.
    #[inline(always)]
    pub fn residual(self, difference: i16) -> i16 {
        if self == Range::Byte { i16::from(difference as i8) } else { difference }
    }

    /// The value in range.
    #[inline(always)]
    pub fn value(self, sum: i16) -> i16 {
        if self == Range::Byte { sum & 0xff } else { sum }
    }
}

#[inline(always)]
pub(super) fn mean(a: i16, b: i16) -> i16 {
    a.wrapping_add(b) >> 1
}

/// The residuals of values that are all known, for the samples of `segments`.
pub(super) fn residuals<const N: usize>(
    values: &[[i16; N]],
    segments: &[Segment],
    predictor: Predictor,
    range: Range,
) -> Vec<[i16; N]> {
    let mut residuals = match predictor {
        Predictor::Left => residuals_of(values, segments, |l, u, c| Predictor::Left.predict(l, u, c)),
        Predictor::MedianEdge => residuals_of(values, segments, |l, u, c| Predictor::MedianEdge.predict(l, u, c)),
        Predictor::Gradient => residuals_of(values, segments, |l, u, c| Predictor::Gradient.predict(l, u, c)),
        Predictor::Smoothed => residuals_of(values, segments, |l, u, c| Predictor::Smoothed.predict(l, u, c)),
    };
    if range == Range::Byte {
        residuals.as_flattened_mut().iter_mut().for_each(|residual| *residual = range.residual(*residual));
    }
    residuals
}

#[inline(always)]
fn residuals_of<const N: usize>(
    values: &[[i16; N]],
    segments: &[Segment],
    predict: impl Fn(i16, i16, i16) -> i16,
) -> Vec<[i16; N]> {
    let count = segments.iter().map(|segment| segment.count as usize).sum();
    let mut residuals = vec![[0; N]; count];
    let mut rest = residuals.as_mut_slice();
    for segment in segments {
        let ranks = segment.ranks();
        let (out, after) = rest.split_at_mut(ranks.len());
        rest = after;
        let here = values[ranks.clone()].as_flattened();
        let out = out.as_flattened_mut();
        let subtract = |out: &mut [i16], predicted: &[i16]| {
            out.iter_mut().zip(here).zip(predicted).for_each(|((out, here), p)| *out = here.wrapping_sub(*p));
        };
        match segment.around {
            Around::Nothing => out.copy_from_slice(here),
            Around::Anchor | Around::Up => subtract(out, &values[segment.other as usize]),
            Around::Left => subtract(out, values[ranks.start - 1..ranks.end - 1].as_flattened()),
            Around::LeftUp => {
                let (left, up) = (values[ranks.start - 1], values[segment.other as usize]);
                subtract(out, &std::array::from_fn::<i16, N, _>(|c| mean(left[c], up[c])));
            }
            Around::All => {
                let left = values[ranks.start - 1..ranks.end - 1].as_flattened();
                let others = segment.others();
                let corner = values[others.start - 1..others.end - 1].as_flattened();
                let up = values[others].as_flattened();
                let known = here.iter().zip(left).zip(up.iter().zip(corner));
                for (out, ((here, left), (up, corner))) in out.iter_mut().zip(known) {
                    *out = here.wrapping_sub(predict(*left, *up, *corner));
                }
            }
        }
    }
    residuals
}

/// 0, -1, 1, -2, ... as 0, 1, 2, 3, ...
#[inline(always)]
pub(super) fn zigzag(value: i16) -> u16 {
    (value << 1 ^ value >> 15) as u16
}

/// Samples to choose a predictor by: blocks of segments from all over the image.
pub(super) fn some_segments(segments: &[Segment]) -> Vec<Segment> {
    /// Enough to tell predictors apart.
    const ENOUGH: u32 = 8 * 1024;
    const BLOCK: usize = 16;
    let samples: u32 = segments.iter().map(|segment| segment.count).sum();
    let step = samples.div_ceil(ENOUGH).max(1) as usize;
    segments.chunks(BLOCK).step_by(step).flatten().copied().collect()
}

/// About how many bits the residuals of some samples cost: the entropy of each channel's symbols.
pub(super) fn cost_bits<const N: usize>(
    values: &[[i16; N]],
    segments: &[Segment],
    predictor: Predictor,
    range: Range,
) -> f64 {
    let residuals = residuals(values, segments, predictor, range);
    let mut counts = [[0_u32; 256]; N];
    for residual in &residuals {
        for (counts, &residual) in counts.iter_mut().zip(residual) {
            counts[usize::from(zigzag(residual).min(255))] += 1;
        }
    }
    let total = residuals.len() as f64;
    let entropy = |counts: &[u32; 256]| {
        let bits = |&count: &u32| if count > 0 { f64::from(count) * (total / f64::from(count)).log2() } else { 0.0 };
        counts.iter().map(bits).sum::<f64>() + f64::from(counts[255]) * 16.0
    };
    counts.iter().map(entropy).sum()
}
