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

    pub fn others(&self) -> std::ops::Range<usize> {
        self.other as usize..(self.other + self.count) as usize
    }
}

/// Occupied pixels side by side: columns `start..end`, ranks from `rank` on.
#[derive(Debug, Clone, Copy)]
struct Run {
    start: u32,
    end: u32,
    rank: u32,
}

/// The segments of a mask in order, by the objects of its samples; without objects, as if all were of one.
pub(super) fn segments(mask: &Mask, object: Option<&[u16]>) -> Vec<Segment> {
    let mut builder = Builder { object, segments: Vec::new(), last_of_object: Vec::new() };
    if let Some(object) = object {
        builder.last_of_object = vec![0; object.iter().max().map_or(0, |&most| usize::from(most) + 1)];
    }
    let (mut above, mut here) = (Vec::new(), Vec::new());
    let mut rank = 0;
    for y in 0..mask.size_px().1 {
        std::mem::swap(&mut above, &mut here);
        here.clear();
        mask.runs(y, |columns| {
            here.push(Run { start: columns.start, end: columns.end, rank });
            rank += columns.end - columns.start;
        });
        let mut rest = above.as_slice();
        for &run in &here {
            // Runs above that end left of the pixel above to the left are behind us.
            while rest.first().is_some_and(|above| above.end < run.start) {
                rest = &rest[1..];
            }
            builder.run(run, rest);
        }
    }
    builder.segments
}

struct Builder<'a> {
    object: Option<&'a [u16]>,
    segments: Vec<Segment>,
    /// Rank + 1 of the last sample of each object, 0 before there is any.
    last_of_object: Vec<u32>,
}

impl Builder<'_> {
    fn same(&self, a: u32, b: u32) -> bool {
        self.object.is_none_or(|object| object[a as usize] == object[b as usize])
    }

    fn push(&mut self, around: Around, start: u32, count: u32, other: u32) {
        match self.segments.last_mut() {
            Some(last) if around == Around::Left && last.around == around && last.start + last.count == start => {
                last.count += count;
            }
            _ => self.segments.push(Segment { around, start, count, other }),
        }
        if let Some(object) = self.object {
            self.last_of_object[usize::from(object[start as usize])] = start + count;
        }
    }

    /// Adds the segments of a run of pixels below `above`, the runs from the one that reaches its upper left corner on.
    fn run(&mut self, run: Run, mut above: &[Run]) {
        let mut x = run.start;
        while x < run.end {
            while above.first().is_some_and(|above| above.end < x) {
                above = &above[1..];
            }
            let rank = run.rank + (x - run.start);
            let at = |x: u32| {
                let over = above.iter().take(2).find(|above| above.start <= x && x < above.end);
                over.map(|above| (above.rank + (x - above.start), above.end)).filter(|over| self.same(over.0, rank))
            };
            let left = x > run.start && self.same(rank - 1, rank);
            let up = at(x);
            let corner = if x > 0 { at(x - 1) } else { None };
            let count = match (left, up, corner) {
                (true, Some((up, above_end)), Some(_)) => {
                    let longest = run.end.min(above_end) - x;
                    let count = self.agreeing(rank, up, longest);
                    self.push(Around::All, rank, count, up);
                    count
                }
                (true, Some((up, _)), None) => {
                    self.push(Around::LeftUp, rank, 1, up);
                    1
                }
                (true, None, _) => {
                    self.push(Around::Left, rank, 1, rank - 1);
                    1
                }
                (false, up, corner) => {
                    match up.or(corner).or_else(|| at(x + 1)) {
                        Some((other, _)) => self.push(Around::Up, rank, 1, other),
                        None => self.alone(rank),
                    }
                    1
                }
            };
            x += count;
        }
    }

    /// How many samples from `rank` on are of its object, with as many from `up` on, up to `longest`.
    fn agreeing(&self, rank: u32, up: u32, longest: u32) -> u32 {
        let Some(object) = self.object else { return longest };
        let own = object[rank as usize];
        let leading = |first: u32| leading(&object[first as usize..(first + longest) as usize], own);
        leading(rank).min(leading(up)) as u32
    }

    fn alone(&mut self, rank: u32) {
        let last = match self.object {
            Some(object) => self.last_of_object[usize::from(object[rank as usize])],
            None => rank,
        };
        match (rank, last) {
            (0, _) => self.push(Around::Nothing, 0, 1, 0),
            (_, 0) => self.push(Around::Anchor, rank, 1, rank - 1),
            (_, last) => self.push(Around::Anchor, rank, 1, last - 1),
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
