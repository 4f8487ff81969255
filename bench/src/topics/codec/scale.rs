//! What the codec's speed is compared with: a general compressor and a copy of the raw planes, and RVL on their depths.

use std::time::Instant;

use anyhow::Context;
use protocol::DepthImage;

use crate::report::Row;
use crate::sets;
use crate::spread::{Better, Spread};

/// The raw planes by zstd.
pub(super) fn zstd_raw(images: &[DepthImage], level: i32, repeats: usize, row: &mut Row) -> anyhow::Result<()> {
    let planes: Vec<Vec<u8>> = images.iter().map(sets::raw_planes).collect();
    let encode = |plane: &Vec<u8>| Ok(zstd::bulk::compress(plane, level)?);
    let decode = |coded: &Vec<u8>, raw: &Vec<u8>| Ok(zstd::bulk::decompress(coded, raw.len())?);
    timed(&planes, repeats, row, encode, decode)
}

/// The raw planes, copied.
pub(super) fn copied_raw(images: &[DepthImage], repeats: usize, row: &mut Row) -> anyhow::Result<()> {
    let planes: Vec<Vec<u8>> = images.iter().map(sets::raw_planes).collect();
    let copy = |from: &Vec<u8>| {
        // Onto pages that are there already, as a coder's buffers are after its first image.
        let mut to = vec![1; from.len()];
        to.copy_from_slice(from);
        Ok(std::hint::black_box(to))
    };
    timed(&planes, repeats, row, copy, |coded, _| copy(coded))
}

/// Their depths by RVL (Wilson, Fast Lossless Depth Image Compression, 2017, listing 1), a hole as zero.
pub(super) fn rvl_depths(images: &[DepthImage], repeats: usize, row: &mut Row) -> anyhow::Result<()> {
    let depths: Vec<Vec<u16>> = images.iter().map(dense_depths).collect();
    timed(&depths, repeats, row, |depths| Ok(rvl_encoded(depths)), |coded, raw| rvl_decoded(coded, raw.len()))
}

/// Encodes and decodes, and says how fast in raw bytes.
fn timed<T: PartialEq, C>(
    raw: &[Vec<T>],
    repeats: usize,
    row: &mut Row,
    encode: impl Fn(&Vec<T>) -> anyhow::Result<Vec<C>>,
    decode: impl Fn(&Vec<C>, &Vec<T>) -> anyhow::Result<Vec<T>>,
) -> anyhow::Result<()> {
    let (mut encode_ms, mut decode_ms, mut bytes) = (Vec::new(), Vec::new(), 0);
    for _ in 0..=repeats {
        let started = Instant::now();
        let coded = raw.iter().map(&encode).collect::<anyhow::Result<Vec<_>>>()?;
        encode_ms.push(started.elapsed().as_secs_f64() * 1000.0);
        let started = Instant::now();
        let decoded =
            coded.iter().zip(raw).map(|(coded, raw)| decode(coded, raw)).collect::<anyhow::Result<Vec<_>>>()?;
        decode_ms.push(started.elapsed().as_secs_f64() * 1000.0);
        anyhow::ensure!(decoded == raw, "planes do not come back");
        bytes = coded.iter().map(|coded| size_of_val(&**coded)).sum();
    }
    let raw_bytes = raw.iter().map(|raw| size_of_val(&**raw)).sum::<usize>() as f64;
    row.bytes.set("raw", raw_bytes);
    row.bytes.set("coded", bytes as f64);
    for (name, ms) in [("encode", encode_ms), ("decode", decode_ms)] {
        // The first run warms up.
        let spread = Spread::of(&ms[1..], Better::Lower).context("at least one run")?;
        row.counts.set(format!("{name}_mb_s"), raw_bytes / spread.median / 1000.0);
        row.time_ms.set(name, spread);
    }
    Ok(())
}

/// Depth codes of all pixels, one more than each, so that zero is a hole.
fn dense_depths(image: &DepthImage) -> Vec<u16> {
    let (width_px, height_px) = image.mask.size_px();
    let mut depths = vec![0; width_px as usize * height_px as usize];
    for ((x, y), &depth) in image.mask.occupied().zip(&image.depth) {
        depths[y as usize * width_px as usize + x as usize] = depth.saturating_add(1);
    }
    depths
}

/// Numbers of any length in nibbles of three bits and one that says that more follow.
#[derive(Default)]
struct Nibbles {
    words: Vec<u32>,
    word: u32,
    count: u32,
}

impl Nibbles {
    fn push(&mut self, mut value: u32) {
        loop {
            let more = value > 7;
            self.word = self.word << 4 | value & 7 | u32::from(more) << 3;
            self.count += 1;
            if self.count == 8 {
                self.words.push(self.word);
                (self.word, self.count) = (0, 0);
            }
            value >>= 3;
            if !more {
                return;
            }
        }
    }

    fn finish(mut self) -> Vec<u32> {
        if self.count > 0 {
            self.words.push(self.word << (4 * (8 - self.count)));
        }
        self.words
    }
}

fn rvl_encoded(depths: &[u16]) -> Vec<u32> {
    let mut nibbles = Nibbles::default();
    let (mut rest, mut last) = (depths, 0_i32);
    while !rest.is_empty() {
        let zeros = rest.iter().take_while(|&&depth| depth == 0).count();
        let (run, after) = rest[zeros..].split_at(rest[zeros..].iter().take_while(|&&depth| depth != 0).count());
        nibbles.push(zeros as u32);
        nibbles.push(run.len() as u32);
        for &depth in run {
            let difference = i32::from(depth) - last;
            nibbles.push((difference << 1 ^ difference >> 31) as u32);
            last = depth.into();
        }
        rest = after;
    }
    nibbles.finish()
}

fn rvl_decoded(words: &[u32], count: usize) -> anyhow::Result<Vec<u16>> {
    let (mut words, mut word, mut left) = (words.iter(), 0_u32, 0);
    let mut pull = || {
        let (mut value, mut shift) = (0, 0);
        loop {
            if left == 0 {
                word = *words.next().context("RVL ends early")?;
                left = 8;
            }
            let nibble = word >> 28;
            word <<= 4;
            left -= 1;
            value |= (nibble & 7) << shift;
            shift += 3;
            if nibble & 8 == 0 {
                return anyhow::Ok(value);
            }
        }
    };
    let mut depths = Vec::with_capacity(count);
    let mut last = 0_i32;
    while depths.len() < count {
        depths.resize(depths.len() + pull()? as usize, 0);
        for _ in 0..pull()? {
            let code = pull()?;
            last += (code >> 1) as i32 ^ -((code & 1) as i32);
            depths.push(last as u16);
        }
    }
    Ok(depths)
}
