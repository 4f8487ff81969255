//! A view drawn in slices of so many quads, over several frames: where drawing it at once would keep everybody waiting.

use std::ops::Range;

use protocol::PatchId;

use crate::mesh::QUAD_INDICES;

/// How far a view is drawn.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Slices {
    /// The patch whose turn it is, and how many of its quads are drawn.
    next: Option<(PatchId, u32)>,
    is_begun: bool,
}

impl Slices {
    /// Whether nothing is drawn yet.
    pub fn is_first(&self) -> bool {
        !self.is_begun
    }

    /// Whether everything is drawn.
    pub fn are_all(&self) -> bool {
        self.is_begun && self.next.is_none()
    }

    /// Begins the next slice; until it turns out to be full it is the last one.
    pub(crate) fn next(&mut self, most_quads: usize) -> Slice<'_> {
        let from = self.next.take();
        self.is_begun = true;
        Slice { slices: self, from, left: most_quads }
    }
}

/// What one slice may still draw.
#[derive(Debug)]
pub(crate) struct Slice<'a> {
    slices: &'a mut Slices,
    from: Option<(PatchId, u32)>,
    left: usize,
}

impl Slice<'_> {
    /// Whether it is full, and more is to come.
    pub(crate) fn is_over(&self) -> bool {
        self.slices.next.is_some()
    }

    /// Whether a slice before drew all of a patch.
    pub(crate) fn is_drawn(&self, id: PatchId) -> bool {
        self.from.is_some_and(|(first, _)| id < first)
    }

    /// What it draws of the indices that a view sees of a patch. Patches come in the order of their ids.
    pub(crate) fn cut(&mut self, id: PatchId, seen: Vec<Range<u32>>) -> Vec<Range<u32>> {
        let before = self.from.filter(|(first, _)| *first == id).map_or(0, |(_, quads)| quads);
        let mut skipped = before;
        let mut drawn = 0;
        let mut cut = Vec::with_capacity(seen.len());
        for range in seen {
            let quads = range.len() as u32 / QUAD_INDICES as u32;
            let skip = skipped.min(quads);
            skipped -= skip;
            let take = ((quads - skip) as usize).min(self.left - drawn) as u32;
            let start = range.start + skip * QUAD_INDICES as u32;
            if take > 0 {
                cut.push(start..start + take * QUAD_INDICES as u32);
                drawn += take as usize;
            }
            if skip + take < quads {
                self.slices.next = Some((id, before + drawn as u32));
                break;
            }
        }
        self.left -= drawn;
        cut
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIDE: u32 = QUAD_INDICES as u32;

    /// Two patches of three ranges, of 10 and 7 quads.
    fn patches() -> [(PatchId, Vec<Range<u32>>); 2] {
        let ranges = |quads: [Range<u32>; 3]| quads.map(|range| range.start * SIDE..range.end * SIDE).to_vec();
        [(PatchId(3), ranges([0..4, 10..11, 20..25])), (PatchId(8), ranges([5..6, 6..9, 11..14]))]
    }

    #[test]
    fn slices_together_are_everything_once() {
        let whole: Vec<u32> = patches().into_iter().flat_map(|(_, seen)| seen.into_iter().flatten()).collect();
        for most_quads in 1..20 {
            let mut slices = Slices::default();
            let (mut drawn, mut count) = (Vec::new(), 0);
            while !slices.are_all() {
                assert_eq!(slices.is_first(), count == 0);
                let mut slice = slices.next(most_quads);
                let before = drawn.len();
                for (id, seen) in patches() {
                    if !slice.is_over() && !slice.is_drawn(id) {
                        drawn.extend(slice.cut(id, seen).into_iter().flatten());
                    }
                }
                assert!(drawn.len() - before <= most_quads * QUAD_INDICES);
                count += 1;
                assert!(count <= 17, "{most_quads} quads a slice");
            }
            assert_eq!(drawn, whole, "{most_quads} quads a slice");
            assert_eq!(count, 17_usize.div_ceil(most_quads), "{most_quads} quads a slice");
        }
    }

    #[test]
    fn what_is_gone_between_two_slices_is_passed_over() {
        let mut slices = Slices::default();
        let [(first, seen), (last, others)] = patches();
        assert_eq!(slices.next(3).cut(first, seen).into_iter().flatten().count(), 3 * QUAD_INDICES);
        let mut slice = slices.next(100);
        assert!(!slice.is_drawn(last));
        assert_eq!(slice.cut(last, others).into_iter().flatten().count(), 7 * QUAD_INDICES);
        assert!(slices.are_all());
    }
}
