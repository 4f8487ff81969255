//! Where rigid objects are, how far they went, and where they go next.
//!
//! A server keeps poses on a lattice (`server/src/lattice.rs`), so their numbers end in zeros, which are left out here; and a way from a pose on it to another one is whole
//! steps. Any other pose comes back as it is, too, in more bytes.

use std::array;

use glam::{DAffine3, DMat3, DVec3, Vec3};

use super::CodecError;
use crate::bytes::{EndsEarly, Reader, Writer};
use crate::held::shift::{EXPONENTS, lowest_bit, power_of_two};
use crate::held::{NextSteps, ObjectPose, ObjectShift, ObjectSteps, Step, Steps};

/// Numbers of a pose.
const NUMBERS: usize = 12;
/// Bytes of one object's pose at least: id, and half a byte a number that tells how many bytes it has.
const LEAST_POSE_BYTES: usize = 2 + NUMBERS / 2;
/// Bytes of an object's way at least: id, and which numbers change.
const LEAST_SHIFT_BYTES: usize = 3;
/// Which numbers of a way change takes so many bits; the next ones say that a step is another one than the object's before.
const NEW_STEPS: [u16; 2] = [1 << NUMBERS, 1 << (NUMBERS + 1)];
/// Numbers of three steps, of ways or of turns.
const OF_STEPS: usize = 9;
/// Bytes of an object's steps at least: id, and a head for ways and turns.
const LEAST_STEPS_BYTES: usize = 2;
/// Objects that go on at most: as many as there are ids.
pub(crate) const MOST: usize = 1 << 16;
/// Bytes of an object at most, of ways and of what it does next, and of their count.
const MOST_OBJECT_BYTES: usize = 80;
const COUNT_BYTES: usize = 8;

/// Bytes of so many ways, or of what so many objects do next, at most.
pub(crate) fn most_bytes(objects: usize) -> usize {
    objects.saturating_mul(MOST_OBJECT_BYTES) + COUNT_BYTES
}
/// Heads of three ways or turns: none goes anywhere; in steps of the object's before; in others; as they are.
const NOWHERE: u8 = 0;
const SAME_STEP: u8 = 1;
const NEW_STEP: u8 = 2;
const AS_THEY_ARE: u8 = 3;

/// Appends a count and the poses.
pub(crate) fn write_objects(objects: &[ObjectPose], out: &mut Writer) {
    out.u32(u32::try_from(objects.len()).expect("at most one pose an object id"));
    for ObjectPose { object, world_from_object } in objects {
        out.u16(*object);
        let numbers = world_from_object.to_cols_array().map(f64::to_be_bytes);
        let lengths = numbers.map(|bytes| bytes.iter().rposition(|&byte| byte != 0).map_or(0, |last| last + 1));
        let (pairs, _) = lengths.as_chunks::<2>();
        pairs.iter().for_each(|[low, high]| out.u8((low | high << 4) as u8));
        numbers.iter().zip(lengths).for_each(|(bytes, length)| out.bytes.extend_from_slice(&bytes[..length]));
    }
}

/// Reads what [`write_objects`] wrote.
pub(crate) fn read_objects(bytes: &mut Reader) -> Result<Vec<ObjectPose>, CodecError> {
    let count = bytes.u32()? as usize;
    if count > bytes.remaining() / LEAST_POSE_BYTES {
        return Err(EndsEarly.into());
    }
    (0..count).map(|_| read_object(bytes)).collect()
}

fn read_object(bytes: &mut Reader) -> Result<ObjectPose, CodecError> {
    let object = bytes.u16()?;
    let pairs = bytes.take(NUMBERS / 2)?;
    let mut numbers = [0.0; NUMBERS];
    let lengths = pairs.iter().flat_map(|pair| [pair & 15, pair >> 4]);
    for (number, length) in numbers.iter_mut().zip(lengths) {
        let mut whole = [0; 8];
        let known = whole.get_mut(..length.into()).ok_or(CodecError::Damaged("length of a number"))?;
        known.copy_from_slice(bytes.take(known.len())?);
        *number = f64::from_be_bytes(whole);
    }
    let [matrix @ .., x, y, z] = numbers;
    let world_from_object = DAffine3 { matrix3: DMat3::from_cols_array(&matrix), translation: DVec3::new(x, y, z) };
    Ok(ObjectPose { object, world_from_object })
}

/// The bytes of ways, for a section. Ids that ascend take the fewest.
pub(crate) fn shift_bytes(shifts: &[ObjectShift]) -> Vec<u8> {
    let mut out = Writer::default();
    out.varint(u32::try_from(shifts.len()).expect("at most one way an object id"));
    let (mut last, mut exponents) = (0_u16, [0; 2]);
    for ObjectShift { object, matrix, translation } in shifts {
        out.varint(object.wrapping_sub(std::mem::replace(&mut last, *object)).into());
        let counts = || matrix.counts.iter().chain(&translation.counts);
        let changed = counts().enumerate().map(|(at, count)| u16::from(*count != 0) << at).sum::<u16>();
        let own = [matrix.exponent, translation.exponent];
        let is_new: [bool; 2] = array::from_fn(|of| own[of] != exponents[of]);
        let new = NEW_STEPS.iter().zip(is_new).map(|(bit, is_new)| if is_new { *bit } else { 0 }).sum::<u16>();
        out.u16(changed | new);
        own.iter().zip(is_new).filter(|(_, is_new)| *is_new).for_each(|(exponent, _)| out.u16(*exponent as u16));
        exponents = own;
        counts().filter(|count| **count != 0).for_each(|count| out.varint(zigzag(*count)));
    }
    out.bytes
}

/// The ways of [`shift_bytes`], so many at most.
pub(crate) fn shifts(bytes: &[u8], most: usize) -> Result<Vec<ObjectShift>, CodecError> {
    let mut bytes = Reader::new(bytes);
    let count = bytes.varint()? as usize;
    if count > most || count > bytes.remaining() / LEAST_SHIFT_BYTES {
        return Err(CodecError::TooMuch("ways of objects"));
    }
    let (mut last, mut exponents) = (0_u16, [0; 2]);
    let mut shift = || {
        last = last.wrapping_add(bytes.varint()? as u16);
        let head = bytes.u16()?;
        for (exponent, bit) in exponents.iter_mut().zip(NEW_STEPS) {
            if head & bit != 0 {
                *exponent = read_exponent(&mut bytes)?;
            }
        }
        let mut counts = [0; NUMBERS];
        for (_, count) in counts.iter_mut().enumerate().filter(|(at, _)| head >> at & 1 == 1) {
            *count = unzigzag(bytes.varint()?);
        }
        let [matrix @ .., x, y, z] = counts;
        let [of_matrix, of_translation] = exponents;
        Ok(ObjectShift {
            object: last,
            matrix: Steps { exponent: of_matrix, counts: matrix },
            translation: Steps { exponent: of_translation, counts: [x, y, z] },
        })
    };
    let shifts = (0..count).map(|_| shift()).collect::<Result<_, CodecError>>()?;
    if bytes.remaining() == 0 { Ok(shifts) } else { Err(CodecError::Damaged("bytes after the last way")) }
}

/// The bytes of what objects do next, for a section; none where there is nothing.
pub(crate) fn next_bytes(next: &NextSteps) -> Vec<u8> {
    let mut out = Writer::default();
    if next.objects.is_empty() {
        return out.bytes;
    }
    out.f32(next.step_s);
    out.varint(u32::try_from(next.objects.len()).expect("at most one entry an object id"));
    let (mut last, mut exponents) = (0_u16, [0; 2]);
    for ObjectSteps { object, steps } in &next.objects {
        out.varint(object.wrapping_sub(std::mem::replace(&mut last, *object)).into());
        let [ways, turns] = [steps.map(|step| step.way_world), steps.map(|step| step.turn_world)].map(Three::of);
        out.u8(ways.head(exponents[0]) | turns.head(exponents[1]) << 2);
        for (three, exponent) in [ways, turns].iter().zip(&mut exponents) {
            three.write(exponent, &mut out);
        }
    }
    out.bytes
}

/// What objects do next, of [`next_bytes`].
pub(crate) fn next_steps(bytes: &[u8]) -> Result<NextSteps, CodecError> {
    let mut bytes = Reader::new(bytes);
    if bytes.remaining() == 0 {
        return Ok(NextSteps::default());
    }
    let (step_s, count) = (bytes.f32()?, bytes.varint()? as usize);
    if count > MOST || count > bytes.remaining() / LEAST_STEPS_BYTES {
        return Err(CodecError::TooMuch("steps of objects"));
    }
    let (mut last, mut exponents) = (0_u16, [0; 2]);
    let mut object = || {
        last = last.wrapping_add(bytes.varint()? as u16);
        let head = bytes.u8()?;
        let ways = read_three(head & 3, &mut exponents[0], &mut bytes)?;
        let turns = read_three(head >> 2, &mut exponents[1], &mut bytes)?;
        let steps = array::from_fn(|at| Step { way_world: ways[at], turn_world: turns[at] });
        Ok(ObjectSteps { object: last, steps })
    };
    let objects = (0..count).map(|_| object()).collect::<Result<_, CodecError>>()?;
    if bytes.remaining() == 0 {
        Ok(NextSteps { step_s, objects })
    } else {
        Err(CodecError::Damaged("bytes after the last step"))
    }
}

/// Three ways or turns, one after the other.
enum Three {
    Nowhere,
    /// In whole steps of a power of two.
    Counted(i16, [i32; OF_STEPS]),
    AsTheyAre([f32; OF_STEPS]),
}

impl Three {
    fn of(vectors: [Vec3; 3]) -> Three {
        let mut numbers = [0.0; OF_STEPS];
        numbers.iter_mut().zip(vectors.iter().flat_map(|vector| vector.to_array())).for_each(|(to, from)| *to = from);
        if numbers.iter().all(|number| *number == 0.0) {
            return Three::Nowhere;
        }
        counted(&numbers).map_or(Three::AsTheyAre(numbers), |(exponent, counts)| Three::Counted(exponent, counts))
    }

    fn head(&self, last_exponent: i16) -> u8 {
        match self {
            Three::Nowhere => NOWHERE,
            Three::Counted(exponent, _) if *exponent == last_exponent => SAME_STEP,
            Three::Counted(..) => NEW_STEP,
            Three::AsTheyAre(_) => AS_THEY_ARE,
        }
    }

    /// The first of three, and how each differs from the one before.
    fn write(&self, last_exponent: &mut i16, out: &mut Writer) {
        match self {
            Three::Nowhere => {}
            Three::Counted(exponent, counts) => {
                if std::mem::replace(last_exponent, *exponent) != *exponent {
                    out.u16(*exponent as u16);
                }
                for at in 0..OF_STEPS {
                    let before = if at < 3 { 0 } else { counts[at - 3] };
                    out.varint(zigzag(counts[at] - before));
                }
            }
            Three::AsTheyAre(numbers) => numbers.iter().for_each(|number| out.f32(*number)),
        }
    }
}

/// Numbers in the largest steps that all are whole in; `None` where there are too many steps for an f32.
fn counted(numbers: &[f32; OF_STEPS]) -> Option<(i16, [i32; OF_STEPS])> {
    let exponents = numbers.iter().filter(|number| **number != 0.0).map(|number| lowest_bit(f64::from(*number)));
    let exponent = exponents.reduce(|a, b| Some(a?.min(b?))).unwrap_or(Some(0))?;
    let steps = numbers.map(|number| f64::from(number) / power_of_two(exponent));
    let fits = steps.iter().all(|steps| steps.abs() <= f64::from(1 << f32::MANTISSA_DIGITS));
    fits.then(|| (exponent, steps.map(|steps| steps as i32)))
}

fn read_three(head: u8, exponent: &mut i16, bytes: &mut Reader) -> Result<[Vec3; 3], CodecError> {
    let mut numbers = [0.0; OF_STEPS];
    match head {
        NOWHERE => {}
        SAME_STEP | NEW_STEP => {
            if head == NEW_STEP {
                *exponent = read_exponent(bytes)?;
            }
            let mut counts = [0_i32; OF_STEPS];
            for at in 0..OF_STEPS {
                let before = if at < 3 { 0 } else { counts[at - 3] };
                counts[at] = unzigzag(bytes.varint()?).wrapping_add(before);
                numbers[at] = (f64::from(counts[at]) * power_of_two(*exponent)) as f32;
            }
        }
        AS_THEY_ARE => {
            for number in &mut numbers {
                *number = bytes.f32()?;
            }
        }
        _ => return Err(CodecError::Damaged("head of steps")),
    }
    let (vectors, _) = numbers.as_chunks::<3>();
    Ok(array::from_fn(|at| Vec3::from_array(vectors[at])))
}

fn read_exponent(bytes: &mut Reader) -> Result<i16, CodecError> {
    let exponent = bytes.u16()? as i16;
    if EXPONENTS.contains(&exponent) { Ok(exponent) } else { Err(CodecError::Damaged("size of a step")) }
}

/// Small numbers of either sign as small numbers.
fn zigzag(number: i32) -> u32 {
    (number << 1 ^ number >> 31) as u32
}

fn unzigzag(number: u32) -> i32 {
    (number >> 1) as i32 ^ -((number & 1) as i32)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shift(object: u16, turns: i32, goes: i32) -> ObjectShift {
        let matrix = Steps { exponent: -24, counts: [turns, 0, -turns, 0, 0, 0, turns, 0, turns] };
        ObjectShift { object, matrix, translation: Steps { exponent: -21, counts: [goes, 0, -1] } }
    }

    #[test]
    fn ways_come_back_and_take_few_bytes() {
        let many: Vec<_> = (0..60).map(|object| shift(3 * object, 1 << 19, 200_000)).collect();
        let bytes = shift_bytes(&many);
        assert_eq!(shifts(&bytes, MOST), Ok(many));
        assert!(bytes.len() < 60 * 21, "{}", bytes.len());
        assert_eq!(shifts(&bytes, 59), Err(CodecError::TooMuch("ways of objects")));
        let strange = [
            shift(9, -i32::MAX, i32::MAX),
            shift(2, 0, 0),
            ObjectShift { translation: Steps { exponent: 900, counts: [1; 3] }, ..shift(65535, 1, 1) },
        ];
        assert_eq!(shifts(&shift_bytes(&strange), MOST), Ok(strange.to_vec()));
        assert_eq!(shifts(&shift_bytes(&[]), 0), Ok(Vec::new()));
        for cut in 0..bytes.len() {
            assert!(shifts(&bytes[..cut], MOST).is_err(), "{cut}");
        }
    }

    #[test]
    fn poses_come_back_and_zeros_are_left_out() {
        let away = DVec3::new(12.0 + 2.0_f64.powi(-21), -0.5, 0.0);
        let turned = DMat3::from_rotation_y(0.3).to_cols_array().map(|x| (x * 16_777_216.0).round() / 16_777_216.0);
        let of = |matrix3, translation| ObjectPose { object: 7, world_from_object: DAffine3 { matrix3, translation } };
        let poses = [
            of(DMat3::from_cols_array(&turned), away),
            of(DMat3::from_rotation_x(1.0), DVec3::splat(f64::MAX)),
            of(DMat3::IDENTITY, DVec3::new(-0.0, f64::MIN_POSITIVE, 1e300)),
        ];
        for (pose, most) in poses.iter().zip([50, 104, 104]) {
            let mut out = Writer::default();
            write_objects(&[*pose], &mut out);
            assert!(out.bytes.len() <= 4 + most, "{}", out.bytes.len());
            assert_eq!(read_objects(&mut Reader::new(&out.bytes)), Ok(vec![*pose]));
        }
        let mut damaged = Writer::default();
        damaged.u32(1);
        damaged.bytes.extend([7, 0, 0xf9, 0, 0, 0, 0, 0]);
        damaged.bytes.extend([0; 32]);
        assert_eq!(read_objects(&mut Reader::new(&damaged.bytes)), Err(CodecError::Damaged("length of a number")));
    }

    #[test]
    fn steps_come_back_whatever_they_are() {
        let on = |x: f32| (x * 262_144.0).round() / 262_144.0;
        let even = |object| {
            let step = |at: f32| Step {
                way_world: Vec3::new(on(0.05 + at / 1e3), 0.0, on(-0.01)),
                turn_world: Vec3::Y * on(0.04),
            };
            ObjectSteps { object, steps: [step(0.0), step(1.0), step(2.0)] }
        };
        let many = NextSteps { step_s: 0.05, objects: (0..60).map(|object| even(2 * object)).collect() };
        let bytes = next_bytes(&many);
        assert_eq!(next_steps(&bytes), Ok(many));
        assert!(bytes.len() < 60 * 28, "{}", bytes.len());
        let odd =
            Step { way_world: Vec3::new(f32::MAX, 1e-30, -0.1), turn_world: Vec3::new(f32::MIN_POSITIVE, 3.0, 0.0) };
        let tiny = Step { way_world: Vec3::X * f32::from_bits(1), turn_world: Vec3::ZERO };
        let large = Step { way_world: Vec3::X * f32::MAX, turn_world: Vec3::NEG_ONE };
        let strange = [[odd, Step::default(), odd], [tiny, tiny, Step::default()], [large, large, Step::default()]];
        let objects = strange.iter().map(|&steps| ObjectSteps { object: 65535, steps }).collect();
        let strange = NextSteps { step_s: -1.0, objects };
        assert_eq!(next_steps(&next_bytes(&strange)), Ok(strange));
        assert_eq!(next_steps(&next_bytes(&NextSteps::default())), Ok(NextSteps::default()));
        for cut in 1..bytes.len() {
            assert!(next_steps(&bytes[..cut]).is_err(), "{cut}");
        }
    }
}
