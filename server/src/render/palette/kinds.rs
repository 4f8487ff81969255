//! Which entries of the table are of one material.

use std::ops::Range;

use protocol::Material;

use super::place::{Place, distance_squared, place};

/// Which codes belong together: those of one material that varies.
#[derive(Debug, Clone, Default)]
pub struct Kinds {
    /// Of each material that varies, ascending.
    ranges: Vec<Range<usize>>,
    /// By code, of all before the end of the last range.
    places: Vec<Place>,
    /// By code, the same.
    range_of: Vec<Option<u8>>,
}

impl Kinds {
    pub(super) fn new(ranges: Vec<Range<usize>>, first: usize, entries: &[Material]) -> Kinds {
        let nowhere = [0.0; size_of::<Place>() / 4];
        let places = std::iter::repeat_n(nowhere, first).chain(entries.iter().map(place)).collect();
        let mut range_of = vec![None; first + entries.len()];
        for (number, range) in ranges.iter().enumerate() {
            range_of[range.clone()].fill(Some(number as u8));
        }
        Kinds { ranges, places, range_of }
    }

    fn range(&self, code: u8) -> Option<u8> {
        self.range_of.get(usize::from(code)).copied().flatten()
    }

    /// Whether two codes are of one material, at two places of it or at one.
    pub(crate) fn are_one(&self, a: u8, b: u8) -> bool {
        a == b || self.range(a).is_some_and(|range| self.range(b) == Some(range))
    }

    /// The code that is nearest to the mean of some, all of one material.
    pub(crate) fn mean(&self, codes: &[u8]) -> u8 {
        let Some(&first) = codes.first() else { return 0 };
        let Some(range) = self.range(first).filter(|_| codes.iter().any(|code| *code != first)) else { return first };
        let mut mean = [0.0; size_of::<Place>() / 4];
        for place in codes.iter().map(|&code| &self.places[usize::from(code)]) {
            mean.iter_mut().zip(place).for_each(|(sum, number)| *sum += number / codes.len() as f32);
        }
        let distance = |code: &usize| distance_squared(&self.places[*code], &mean);
        let range = self.ranges[usize::from(range)].clone();
        range.min_by(|a, b| distance(a).total_cmp(&distance(b))).map_or(first, |code| code as u8)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn means_are_of_the_same_material() {
        let with = |metallic: f32, occlusion: f32| Material { metallic, occlusion, ..Material::default() };
        let entries = [with(0.0, 0.1), with(0.0, 0.9), with(1.0, 0.1), with(1.0, 0.5), with(1.0, 0.9)];
        let kinds = Kinds::new(vec![3..5, 5..8], 3, &entries);
        assert!(kinds.are_one(3, 4) && kinds.are_one(5, 7) && kinds.are_one(2, 2));
        assert!(!kinds.are_one(4, 5) && !kinds.are_one(1, 2) && !kinds.are_one(2, 3));
        assert_eq!(kinds.mean(&[5, 7]), 6);
        assert_eq!(kinds.mean(&[5, 5, 5, 5, 7]), 5, "0.26 of 0.1, 0.5 and 0.9");
        assert_eq!(kinds.mean(&[3, 4, 4, 4]), 4);
        assert_eq!(kinds.mean(&[2, 2]), 2);
    }
}
