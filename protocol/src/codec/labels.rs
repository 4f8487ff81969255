//! Planes of few distinct values: objects, materials, normals of flat surfaces, plain colours.
//!
//! Each sample is predicted to repeat one of its neighbours: the one on this side of an edge that comes down from the row
//! above, else the one to the left. What is written are the *exceptions*: how many samples come before the next one, counted
//! for each way in which the neighbours agree (the run mode of LOCO-I, Weinberger, Seroussi, Sapiro 2000, §III.D, for every context),
//! and then which value it is: that of another neighbour, one of those last introduced, or a new one.

use super::CodecError;
use super::bits::{Bits, Number, Probability};
use super::segments::{Around, Segment, leading};

/// Values remembered.
const RECENT: usize = 30;

/// A value of a plane.
pub(super) trait Label: Copy + Eq + Default {
    /// As many bytes as count.
    const BYTES: usize;
    fn to_bytes(self) -> [u8; 4];
    fn from_bytes(bytes: [u8; 4]) -> Self;
}

impl Label for u8 {
    const BYTES: usize = 1;
    fn to_bytes(self) -> [u8; 4] {
        [self, 0, 0, 0]
    }
    fn from_bytes([value, ..]: [u8; 4]) -> u8 {
        value
    }
}

impl Label for u16 {
    const BYTES: usize = 2;
    fn to_bytes(self) -> [u8; 4] {
        u32::from(self).to_le_bytes()
    }
    fn from_bytes([low, high, ..]: [u8; 4]) -> u16 {
        u16::from_le_bytes([low, high])
    }
}

impl Label for [u8; 2] {
    const BYTES: usize = 2;
    fn to_bytes(self) -> [u8; 4] {
        [self[0], self[1], 0, 0]
    }
    fn from_bytes([x, y, ..]: [u8; 4]) -> [u8; 2] {
        [x, y]
    }
}

impl Label for [u8; 3] {
    const BYTES: usize = 3;
    fn to_bytes(self) -> [u8; 4] {
        [self[0], self[1], self[2], 0]
    }
    fn from_bytes([r, g, b, _]: [u8; 4]) -> [u8; 3] {
        [r, g, b]
    }
}

/// How the neighbours of a sample agree.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(usize)]
enum Class {
    /// All three, or the two that there are.
    Flat,
    FlatPair,
    OnlyLeft,
    OnlyUp,
    Anchor,
    PairDiffers,
    /// An edge comes down: the one to the left is as the one beyond it.
    EdgeDown,
    /// An edge lies between this row and the one above, so far.
    EdgeAcross,
    CornerDiffers,
    AllDiffer,
}

const CLASSES: usize = Class::AllDiffer as usize + 1;

/// What a plane's walk asks for on its way.
trait Guide<T> {
    /// How many of the next samples, of one class, repeat `predicted`. `truth` holds them where they are known, and is as
    /// long.
    fn repeats(&mut self, class: Class, predicted: T, truth: &[T]) -> usize;

    /// The value of a sample that does not, but may be `other`.
    fn exception(&mut self, class: Class, predicted: T, other: Option<T>, truth: T) -> Result<T, CodecError>;
}

/// Goes through a plane, and fills it where it is not known.
fn walk<T: Label>(values: &mut [T], segments: &[Segment], guide: &mut impl Guide<T>) -> Result<(), CodecError> {
    for segment in segments {
        let (before, here) = values.split_at_mut(segment.start as usize);
        let here = &mut here[..segment.count as usize];
        let other = segment.other as usize;
        match segment.around {
            Around::Nothing => here[0] = guide.exception(Class::Anchor, T::default(), None, here[0])?,
            Around::Anchor => {
                step(here, Class::Anchor, before[other], None, guide)?;
            }
            Around::Up => {
                step(here, Class::OnlyUp, before[other], None, guide)?;
            }
            Around::LeftUp => {
                let (left, up) = (before[before.len() - 1], before[other]);
                let (class, other) = if left == up { (Class::FlatPair, None) } else { (Class::PairDiffers, Some(up)) };
                step(here, class, left, other, guide)?;
            }
            Around::Left => {
                let (mut at, mut left) = (0, before[before.len() - 1]);
                while at < here.len() {
                    at += step(&mut here[at..], Class::OnlyLeft, left, None, guide)?;
                    left = here[at - 1];
                }
            }
            Around::All => {
                walk_all(before[before.len() - 1], before[other - 1], &before[segment.others()], here, guide)?;
            }
        }
    }
    Ok(())
}

/// A segment with all neighbours: `above` lies above the samples.
fn walk_all<T: Label>(
    mut left: T,
    mut corner: T,
    above: &[T],
    here: &mut [T],
    guide: &mut impl Guide<T>,
) -> Result<(), CodecError> {
    let mut at = 0;
    while at < here.len() {
        let up = above[at];
        let (class, predicted, other) = match (left == up, left == corner, up == corner) {
            (true, true, _) => (Class::Flat, left, None),
            (true, false, _) => (Class::CornerDiffers, left, None),
            (false, true, _) => (Class::EdgeDown, up, Some(left)),
            (false, _, true) => (Class::EdgeAcross, left, Some(up)),
            (false, _, false) => (Class::AllDiffer, left, Some(up)),
        };
        // Below a flat stretch of the row above, everything stays flat as long as it repeats.
        let alike = if class == Class::Flat { leading(&above[at..], left) } else { 1 };
        at += step(&mut here[at..at + alike], class, predicted, other, guide)?;
        (left, corner) = (here[at - 1], above[at - 1]);
    }
    Ok(())
}

/// Settles the samples that repeat the predicted value, and the first that does not; gives how many these are.
#[inline]
fn step<T: Label>(
    here: &mut [T],
    class: Class,
    predicted: T,
    other: Option<T>,
    guide: &mut impl Guide<T>,
) -> Result<usize, CodecError> {
    let repeats = guide.repeats(class, predicted, here);
    here[..repeats].fill(predicted);
    if repeats == here.len() {
        return Ok(repeats);
    }
    here[repeats] = guide.exception(class, predicted, other, here[repeats])?;
    Ok(repeats + 1)
}

/// What a writer has to say, in the order in which a reader asks.
enum Event<T> {
    /// How many samples of a class repeat before its next exception.
    Gap(Class, u32),
    /// An exception: what was predicted, what else it might be, and what it is.
    Exception(Class, T, Option<T>, T),
}

/// Finds the events of a plane that is known.
struct Scout<T> {
    events: Vec<Event<T>>,
    /// The event of the gap that each class is in; `None` where none has begun since the last exception.
    open: [Option<usize>; CLASSES],
}

impl<T: Label> Guide<T> for Scout<T> {
    #[inline]
    fn repeats(&mut self, class: Class, predicted: T, truth: &[T]) -> usize {
        let repeats = leading(truth, predicted);
        let open = &mut self.open[class as usize];
        let event = *open.get_or_insert_with(|| {
            self.events.push(Event::Gap(class, 0));
            self.events.len() - 1
        });
        if let Event::Gap(_, gap) = &mut self.events[event] {
            *gap += repeats as u32;
        }
        if repeats < truth.len() {
            *open = None;
        }
        repeats
    }

    #[inline]
    fn exception(&mut self, class: Class, predicted: T, other: Option<T>, truth: T) -> Result<T, CodecError> {
        self.events.push(Event::Exception(class, predicted, other, truth));
        Ok(truth)
    }
}

/// Codes events, and reads what they were.
struct Coder<'a, T, B> {
    bits: &'a mut B,
    /// For a reader: samples that still repeat; `None` where the next gap is not known yet.
    open: [Option<u32>; CLASSES],
    gap: Vec<Number>,
    is_other: [Probability; CLASSES],
    place: Number,
    difference: [Number; 3],
    recent: [T; RECENT],
    remembered: usize,
}

impl<T: Label, B: Bits> Coder<'_, T, B> {
    fn new(bits: &mut B) -> Coder<'_, T, B> {
        Coder {
            bits,
            open: [None; CLASSES],
            gap: vec![Number::NEW; CLASSES],
            is_other: [Probability::EVEN; CLASSES],
            place: Number::NEW,
            difference: [Number::NEW; 3],
            recent: [T::default(); RECENT],
            remembered: 0,
        }
    }

    /// A new value as the difference of each byte from the predicted one's.
    fn new_value(&mut self, predicted: T, truth: T) -> T {
        let (predicted, truth) = (predicted.to_bytes(), truth.to_bytes());
        let mut value = [0; 4];
        for byte in 0..T::BYTES {
            let difference = truth[byte].wrapping_sub(predicted[byte]) as i8;
            let read =
                self.difference[byte].code(self.bits, u32::from((difference << 1 ^ difference >> 7) as u8)) as u8;
            value[byte] = predicted[byte].wrapping_add(read >> 1 ^ (read & 1).wrapping_neg());
        }
        T::from_bytes(value)
    }
}

impl<T: Label, B: Bits> Guide<T> for Coder<'_, T, B> {
    #[inline]
    fn repeats(&mut self, class: Class, _: T, truth: &[T]) -> usize {
        let class = class as usize;
        let open = match self.open[class] {
            Some(open) => open,
            None => self.gap[class].code(self.bits, 0),
        };
        let repeats = (open as usize).min(truth.len());
        self.open[class] = (repeats == truth.len()).then_some(open - repeats as u32);
        repeats
    }

    fn exception(&mut self, class: Class, predicted: T, other: Option<T>, truth: T) -> Result<T, CodecError> {
        if let Some(other) = other
            && self.bits.bit(&mut self.is_other[class as usize], truth == other)
        {
            return Ok(other);
        }
        // The place in the list, the newest first, from 1; 0 where the value is new.
        let known = &self.recent[..self.remembered];
        let place = known.iter().position(|&recent| recent == truth).map_or(0, |place| place + 1);
        let place = self.place.code(self.bits, place as u32) as usize;
        if place > self.remembered {
            return Err(CodecError::Damaged("place of a value"));
        }
        if place == 0 {
            let value = self.new_value(predicted, truth);
            self.remembered = (self.remembered + 1).min(RECENT);
            self.recent[..self.remembered].rotate_right(1);
            self.recent[0] = value;
        } else {
            self.recent[..place].rotate_right(1);
        }
        Ok(self.recent[0])
    }
}

/// How many of the samples of some segments are exceptions, in a plane that is known.
pub(super) fn exceptions<T: Label>(values: &[T], segments: &[Segment]) -> usize {
    let differs = |left: T, up: T, corner: T, here: T| usize::from(here != if left == corner { up } else { left });
    let segment = |segment: &Segment| {
        let (start, other) = (segment.start as usize, segment.other as usize);
        let here = &values[segment.ranks()];
        match segment.around {
            Around::Nothing => 1,
            Around::Anchor | Around::Up => usize::from(here[0] != values[other]),
            Around::LeftUp => usize::from(here[0] != values[start - 1]),
            Around::Left => here.iter().zip(&values[start - 1..]).map(|(here, left)| usize::from(here != left)).sum(),
            Around::All => {
                let (left, up, corner) = (&values[start - 1..], &values[segment.others()], &values[other - 1..]);
                let known = here.iter().zip(left).zip(up.iter().zip(corner));
                known.map(|((here, left), (up, corner))| differs(*left, *up, *corner, *here)).sum()
            }
        }
    };
    segments.iter().map(segment).sum()
}

/// Codes a plane; a reader gives one sample a rank, whatever they are.
pub(super) fn code<T: Label, B: Bits>(bits: &mut B, values: &mut [T], segments: &[Segment]) -> Result<(), CodecError> {
    if !B::WRITES {
        return walk(values, segments, &mut Coder::new(bits));
    }
    let mut scout = Scout { events: Vec::new(), open: [None; CLASSES] };
    walk(values, segments, &mut scout)?;
    let mut coder = Coder::new(bits);
    for event in scout.events {
        match event {
            Event::Gap(class, gap) => {
                coder.gap[class as usize].code(coder.bits, gap);
            }
            Event::Exception(class, predicted, other, truth) => {
                coder.exception(class, predicted, other, truth)?;
            }
        }
    }
    Ok(())
}
