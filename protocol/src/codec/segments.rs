//! Which samples a sample may be predicted from, as runs that are predicted alike.
//!
//! Neighbours are the samples of the same object at the pixels to the left, above, and above to the left. A hole, or another
//! object, is no neighbour: no prediction reaches across a silhouette. A sample without neighbours starts from the one above to
//! the right, or from an *anchor*, the last sample of its object that came before it in row-major order, which repeats its
//! colour and its normal more often than the sample before it does.
//!
//! Samples are named by their ranks in row-major order. Along a run the ranks of the neighbours go up one by one, so
//! that coders work on slices and ask for neighbours once a run.

use crate::image::Mask;

/// What the samples of a [`Segment`] have to their left and above.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Around {
    /// Nothing: the very first sample. One sample.
    Nothing,
    /// No neighbour: the anchor at [`Segment::other`]. One sample.
    Anchor,
    /// Only one above, to the left or to the right, at [`Segment::other`]. One sample.
    Up,
    /// Only the sample before it.
    Left,
    /// The sample before it and the one above, at [`Segment::other`], but not above to the left. One sample.
    LeftUp,
    /// All three; those above begin at [`Segment::other`], and as many again lie above to the left, one before.
    All,
}

/// Samples of consecutive ranks with the same kind of neighbours.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Segment {
    pub around: Around,
    /// The first rank.
    pub start: u32,
    /// How many samples.
    pub count: u32,
    /// See [`Around`]. Above it, as many ranks as there are samples come before `start`.
    pub other: u32,
}

impl Segment {
    pub fn ranks(&self) -> std::ops::Range<usize> {
        self.start as usize..(self.start + self.count) as usize
    }

    /// The ranks around the sample at a column, of neighbours that are there, and of others in their place: to the left, above, above to
    /// the left and above to the right. The sample itself where there is nothing.
    #[inline(always)]
    pub fn near(&self, column: usize) -> [usize; 4] {
        let (rank, other) = (self.start as usize + column, self.other as usize + column);
        match self.around {
            Around::All => [rank - 1, other, other - 1, other + 1],
            Around::LeftUp => [rank - 1, other, rank - 1, other],
            Around::Left => [rank - 1; 4],
            Around::Nothing | Around::Anchor | Around::Up => [other; 4],
        }
    }

    pub fn others(&self) -> std::ops::Range<usize> {
        self.other as usize..(self.other + self.count) as usize
    }
}

/// Occupied pixels side by side of one object: columns `start..end`, ranks from `rank` on.
#[derive(Debug, Clone, Copy)]
struct Run {
    start: u32,
    end: u32,
    rank: u32,
    object: u16,
}

impl Run {
    /// The rank of the sample at column `x`, if it lies in this run.
    fn at(&self, x: u32) -> Option<u32> {
        (self.start <= x && x < self.end).then(|| self.rank + (x - self.start))
    }
}

/// The segments of a mask in order, by the objects of its samples; without objects, as if all were of one.
pub(super) fn segments(mask: &Mask, object: Option<&[u16]>) -> Vec<Segment> {
    let objects = object.and_then(|object| object.iter().max()).map_or(0, |&most| usize::from(most)) + 1;
    let mut builder = Builder { segments: Vec::new(), last_of_object: vec![0; objects] };
    let (mut above, mut here) = (Vec::new(), Vec::new());
    let mut rank = 0;
    for y in 0..mask.size_px().1 {
        std::mem::swap(&mut above, &mut here);
        here.clear();
        mask.runs(y, |columns| rank = push_runs(columns, rank, object, &mut here));
        let mut rest = above.as_slice();
        for run in &here {
            // Runs above that end left of the pixel above to the left are behind us.
            while rest.first().is_some_and(|above| above.end < run.start) {
                rest = &rest[1..];
            }
            builder.run(run, rest);
        }
    }
    builder.segments
}

/// Splits occupied pixels where the object changes; gives the rank of the next sample.
fn push_runs(columns: std::ops::Range<u32>, mut rank: u32, object: Option<&[u16]>, runs: &mut Vec<Run>) -> u32 {
    let mut start = columns.start;
    while start < columns.end {
        let left = columns.end - start;
        let (own, count) = match object {
            None => (0, left),
            Some(object) => {
                let rest = &object[rank as usize..(rank + left) as usize];
                (rest[0], leading(rest, rest[0]) as u32)
            }
        };
        runs.push(Run { start, end: start + count, rank, object: own });
        (start, rank) = (start + count, rank + count);
    }
    rank
}

struct Builder {
    segments: Vec<Segment>,
    /// Rank + 1 of the last sample of each object, 0 before there is any.
    last_of_object: Vec<u32>,
}

impl Builder {
    fn push(&mut self, around: Around, start: u32, count: u32, other: u32) {
        self.segments.push(Segment { around, start, count, other });
    }

    /// Adds the segments of a run below `above`, the runs from the one that reaches its upper left corner on.
    fn run(&mut self, run: &Run, above: &[Run]) {
        self.first(run, above);
        let rank = |x: u32| run.rank + (x - run.start);
        let mut x = run.start + 1;
        for over in above.iter().take_while(|over| over.start < run.end).filter(|over| over.object == run.object) {
            let (from, to) = (over.start.max(x), over.end.min(run.end));
            if from >= to {
                continue;
            }
            if from > x {
                self.push(Around::Left, rank(x), from - x, rank(x) - 1);
            }
            x = from;
            if over.start == x {
                self.push(Around::LeftUp, rank(x), 1, over.rank);
                x += 1;
            }
            if x < to {
                self.push(Around::All, rank(x), to - x, over.rank + (x - over.start));
            }
            x = to;
        }
        if x < run.end {
            self.push(Around::Left, rank(x), run.end - x, rank(x) - 1);
        }
        self.last_of_object[usize::from(run.object)] = rank(run.end);
    }

    /// Adds the segment of the first sample of a run: nothing to its left is of its object.
    fn first(&mut self, run: &Run, above: &[Run]) {
        // One may hold the pixel above to the left, the next one that above, and one more that to the right.
        let over = |x: u32| above.iter().take(3).filter(|over| over.object == run.object).find_map(|over| over.at(x));
        let x = run.start;
        let up = over(x).or_else(|| over(x.wrapping_sub(1))).or_else(|| over(x + 1));
        match (up, run.rank, self.last_of_object[usize::from(run.object)]) {
            (Some(other), ..) => self.push(Around::Up, run.rank, 1, other),
            (None, 0, _) => self.push(Around::Nothing, 0, 1, 0),
            (None, rank, 0) => self.push(Around::Anchor, rank, 1, rank - 1),
            (None, rank, last) => self.push(Around::Anchor, rank, 1, last - 1),
        }
    }
}

/// How many values at the front are `value`.
pub(super) fn leading<T: PartialEq + Copy>(values: &[T], value: T) -> usize {
    const STEP: usize = 16;
    // Steps without a way out in the middle are vectorized.
    let steps = values.chunks_exact(STEP).take_while(|step| step.iter().fold(true, |all, &v| all & (v == value)));
    let whole = steps.count() * STEP;
    whole + values[whole..].iter().take_while(|&&v| v == value).count()
}
