//! Seven bytes in a word, each with a bit to spare above it, so that small arithmetic on all of them takes a few instructions on every
//! machine.

/// From one byte to the next one.
const STRIDE: usize = 9;

const BYTES: u64 = all(0xff);
/// The bits to spare.
const SPARE: u64 = all(0x100);

/// A byte in every lane.
pub(super) const fn all(byte: u64) -> u64 {
    byte * 0o1_001_001_001_001_001_001
}

/// A byte in its lane.
#[inline(always)]
pub(super) const fn put(byte: u8, lane: usize) -> u64 {
    (byte as u64) << (STRIDE * lane)
}

/// The byte of a lane.
#[inline(always)]
pub(super) fn get(bytes: u64, lane: usize) -> u8 {
    (bytes >> (STRIDE * lane)) as u8
}

/// Wraps in every lane.
#[inline(always)]
pub(super) fn add(a: u64, b: u64) -> u64 {
    (a + b) & BYTES
}

/// Wraps in every lane.
#[inline(always)]
pub(super) fn subtract(a: u64, b: u64) -> u64 {
    ((a | SPARE) - b) & BYTES
}

/// All bits where `a` is not less than `b`.
#[inline(always)]
fn not_less(a: u64, b: u64) -> u64 {
    let not_less = ((a | SPARE) - b) & SPARE;
    not_less - (not_less >> 8)
}

/// The smaller and the larger ones.
#[inline(always)]
fn sorted(a: u64, b: u64) -> (u64, u64) {
    let swapped = (a ^ b) & not_less(a, b);
    (a ^ swapped, b ^ swapped)
}

/// `left + up - corner` where that lies between `left` and `up`, else the one nearer to it.
#[inline(always)]
pub(super) fn median_edge(left: u64, up: u64, corner: u64) -> u64 {
    let (least, most) = sorted(left, up);
    let (_, corner) = sorted(corner, least);
    let (corner, _) = sorted(corner, most);
    left + up - corner
}

/// 0, 1, 2, ... for 0, -1, 1, ...
#[inline(always)]
pub(super) fn zigzag(bytes: u64) -> u64 {
    let negative = bytes >> 7 & all(1);
    (bytes & all(0x7f)) << 1 ^ ((negative << 8) - negative)
}

/// Undoes [`zigzag`].
#[inline(always)]
pub(super) fn unzigzag(codes: u64) -> u64 {
    let negative = codes & all(1);
    codes >> 1 & all(0x7f) ^ ((negative << 8) - negative)
}

/// 31 in place of all that is larger.
#[inline(always)]
pub(super) fn at_most_31(bytes: u64) -> u64 {
    let large = (bytes + all(0xe0)) >> 8 & all(1);
    bytes & all(31) | ((large << 5) - large)
}

/// How many of `bounds` are reached by bytes below 256 less the least of them.
#[inline(always)]
pub(super) fn levels<const N: usize>(bytes: u64, bounds: [u8; N]) -> u64 {
    bounds.iter().map(|&bound| (bytes + all(256 - u64::from(bound))) >> 8 & all(1)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Bytes in a word.
    const LANES: usize = 7;

    /// A word of seven bytes from each of three words of noise.
    fn some() -> impl Iterator<Item = [[u8; LANES]; 3]> {
        let noise = |seed: u64| seed.wrapping_mul(0x9e37_79b9_7f4a_7c15).to_le_bytes()[1..].try_into().expect("seven");
        (0..30_000).map(move |seed| [noise(seed), noise(seed.reverse_bits() | 1), noise(seed * seed + 7)])
    }

    fn word(bytes: [u8; LANES]) -> u64 {
        bytes.iter().enumerate().map(|(lane, &byte)| put(byte, lane)).sum()
    }

    #[test]
    fn bytes_do_not_touch_each_other() {
        for [a, b, c] in some() {
            let each = |of: &dyn Fn(usize) -> u8| word(std::array::from_fn(of));
            assert_eq!(add(word(a), word(b)), each(&|i| a[i].wrapping_add(b[i])));
            assert_eq!(subtract(word(a), word(b)), each(&|i| a[i].wrapping_sub(b[i])));
            assert_eq!(zigzag(word(a)), each(&|i| a[i] << 1 ^ ((a[i] as i8) >> 7) as u8));
            assert_eq!(unzigzag(zigzag(word(a))), word(a));
            assert_eq!(at_most_31(word(a)), each(&|i| a[i].min(31)));
            let small = a.map(|byte| byte & 63);
            let level = |i: usize| [1, 7, 23].iter().filter(|bound| small[i] >= **bound).count() as u8;
            assert_eq!(levels(word(small), [1, 7, 23]), each(&level));
            let plane = |i: usize| i16::from(a[i]) + i16::from(b[i]) - i16::from(c[i]);
            let edge = |i: usize| plane(i).clamp(a[i].min(b[i]).into(), a[i].max(b[i]).into()) as u8;
            assert_eq!(median_edge(word(a), word(b), word(c)), each(&edge));
        }
    }
}
