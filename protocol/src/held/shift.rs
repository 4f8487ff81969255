//! How far rigid objects went since they were last told of, in whole steps. A server that keeps poses on a lattice says most of what moves in a third of the bytes of
//! whole poses, and exactly: both ends add the same numbers.

use glam::{DAffine3, DMat3, DVec3};

/// An object's way from its last pose.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ObjectShift {
    /// The object. Its pose must be known.
    pub object: u16,
    /// Of its axes, column by column.
    pub matrix: Steps<9>,
    /// Of its origin, in metres in world space.
    pub translation: Steps<3>,
}

/// Changes of some numbers, in steps of a power of two.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Steps<const N: usize> {
    /// Of the step, -1000 to 900. 0 where nothing changes.
    pub exponent: i16,
    /// Steps of each number.
    pub counts: [i32; N],
}

/// Of steps that are ordinary numbers, as are all counts of them.
pub const EXPONENTS: std::ops::RangeInclusive<i16> = -1000..=900;

impl ObjectShift {
    /// The way from one pose to another; `None` where no steps lead there exactly.
    pub fn between(object: u16, from: &DAffine3, to: &DAffine3) -> Option<ObjectShift> {
        let matrix = Steps::between(&from.matrix3.to_cols_array(), &to.matrix3.to_cols_array())?;
        let translation = Steps::between(&from.translation.to_array(), &to.translation.to_array())?;
        Some(ObjectShift { object, matrix, translation })
    }

    /// Where the way leads from a pose.
    pub fn from(&self, from: &DAffine3) -> DAffine3 {
        let matrix3 = DMat3::from_cols_array(&self.matrix.from(from.matrix3.to_cols_array()));
        let translation = DVec3::from_array(self.translation.from(from.translation.to_array()));
        DAffine3 { matrix3, translation }
    }
}

impl<const N: usize> Steps<N> {
    /// The largest steps that lead from some numbers to others exactly; `None` where none do.
    fn between(from: &[f64; N], to: &[f64; N]) -> Option<Steps<N>> {
        let changes: [f64; N] = std::array::from_fn(|at| to[at] - from[at]);
        let exponents = changes.iter().filter(|change| **change != 0.0).map(|change| lowest_bit(*change));
        let exponent = exponents.reduce(|a, b| Some(a?.min(b?))).unwrap_or(Some(0))?;
        let step = power_of_two(exponent);
        let mut counts = [0; N];
        for (count, change) in counts.iter_mut().zip(changes) {
            let steps = change / step;
            // Far beyond that a pose takes no more bytes.
            if steps.abs() > f64::from(i32::MAX) {
                return None;
            }
            *count = steps as i32;
        }
        let steps = Steps { exponent, counts };
        (steps.from(*from) == *to).then_some(steps)
    }

    fn from(&self, mut numbers: [f64; N]) -> [f64; N] {
        let step = power_of_two(self.exponent);
        for (number, count) in numbers.iter_mut().zip(self.counts) {
            *number += f64::from(count) * step;
        }
        numbers
    }
}

/// The exponent of the lowest bit of a number that is not zero; `None` where it is not within [`EXPONENTS`].
pub(crate) fn lowest_bit(number: f64) -> Option<i16> {
    let bits = number.to_bits();
    let biased = (bits >> 52 & 0x7ff) as i16;
    // Of numbers from 2^-1022 on, a bit that is not written down leads the others.
    let mantissa = bits & ((1 << 52) - 1) | 1 << 52;
    let exponent = biased - 1075 + mantissa.trailing_zeros() as i16;
    (biased > 0 && EXPONENTS.contains(&exponent)).then_some(exponent)
}

/// Exactly; the exponent must be within [`EXPONENTS`].
pub(crate) fn power_of_two(exponent: i16) -> f64 {
    f64::from_bits(((i64::from(exponent) + 1023) as u64) << 52)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pose(angle_rad: f64, translation: DVec3) -> DAffine3 {
        let on = |number: f64| (number * 16_777_216.0).round() / 16_777_216.0;
        let turned = DMat3::from_rotation_y(angle_rad).to_cols_array().map(on);
        DAffine3 { matrix3: DMat3::from_cols_array(&turned), translation: translation.map(on) }
    }

    #[test]
    fn a_way_on_the_lattice_leads_there_exactly_and_back() {
        let poses = [pose(0.0, DVec3::ZERO), pose(0.3, DVec3::new(40.0, -2.7, 1e-5)), pose(3.0, DVec3::splat(70.0))];
        for from in &poses {
            for to in &poses {
                let shift = ObjectShift::between(3, from, to).expect("a way");
                assert_eq!(shift.from(from), *to);
                assert!(EXPONENTS.contains(&shift.matrix.exponent) && shift.translation.exponent >= -24);
            }
        }
        let still = ObjectShift::between(3, &poses[1], &poses[1]).expect("a way");
        assert_eq!(still.translation, Steps { exponent: 0, counts: [0; 3] });
    }

    #[test]
    fn what_no_steps_lead_to_has_no_way() {
        let at = |x: f64| DAffine3::from_translation(DVec3::new(x, 0.0, 0.0));
        for (from, to) in [
            (0.1, 0.3),
            (0.0, 1.0 + f64::EPSILON),
            (1e300, -1e300),
            (0.0, f64::MIN_POSITIVE / 2.0),
            (0.0, f64::NAN),
            (f64::INFINITY, 0.0),
            (1e16, 1.0),
        ] {
            assert_eq!(ObjectShift::between(0, &at(from), &at(to)), None, "{from} to {to}");
        }
    }

    #[test]
    fn lowest_bits_are_found() {
        for (number, exponent) in [(1.0, 0), (-6.0, 1), (0.375, -3), (1.0 + f64::EPSILON, -52), (1e300, 944)] {
            let found = lowest_bit(number);
            assert_eq!(found, Some(exponent).filter(|exponent| EXPONENTS.contains(exponent)), "{number}");
        }
        assert_eq!([0, -3, 10].map(power_of_two), [1.0, 0.125, 1024.0]);
    }
}
