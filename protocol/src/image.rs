//! [`DepthImage`]: what one camera captured, as plain values with no GPU handle.

use std::ops::Range;

use camera::{Camera, Pinhole, Rigid};
use serde::{Deserialize, Serialize};

/// Which pixels of an image hold a sample. Row-major bits, least significant first.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Mask {
    width_px: u32,
    height_px: u32,
    words: Vec<u64>,
}

impl Mask {
    /// A mask without any sample.
    pub fn empty(width_px: u32, height_px: u32) -> Mask {
        let bits = width_px as usize * height_px as usize;
        Mask { width_px, height_px, words: vec![0; bits.div_ceil(64)] }
    }

    /// The mask of [`Mask::words`]; `None` where their number does not fit the size or a bit past the last pixel is set.
    pub fn from_words(width_px: u32, height_px: u32, words: Vec<u64>) -> Option<Mask> {
        let bits = width_px as usize * height_px as usize;
        let past = words.last().filter(|_| !bits.is_multiple_of(64)).map_or(0, |last| last >> (bits % 64));
        (words.len() == bits.div_ceil(64) && past == 0).then_some(Mask { width_px, height_px, words })
    }

    /// Width and height in pixels.
    pub fn size_px(&self) -> (u32, u32) {
        (self.width_px, self.height_px)
    }

    /// Whether pixel `(x, y)` holds a sample; false outside of the image.
    pub fn get(&self, x: u32, y: u32) -> bool {
        x < self.width_px && y < self.height_px && {
            let bit = self.bit(x, y);
            self.words[bit / 64] >> (bit % 64) & 1 == 1
        }
    }

    /// Marks pixel `(x, y)`, which must lie inside of the image.
    pub fn set(&mut self, x: u32, y: u32, occupied: bool) {
        assert!(x < self.width_px && y < self.height_px, "pixel outside of the mask");
        let bit = self.bit(x, y);
        let word = &mut self.words[bit / 64];
        *word = *word & !(1 << (bit % 64)) | u64::from(occupied) << (bit % 64);
    }

    /// How many samples there are.
    pub fn count(&self) -> usize {
        self.words.iter().map(|word| word.count_ones() as usize).sum()
    }

    /// The occupied pixels `(x, y)` in row-major order: the order of every plane of a [`DepthImage`].
    pub fn occupied(&self) -> impl Iterator<Item = (u32, u32)> + '_ {
        self.words.iter().enumerate().flat_map(move |(index, &word)| {
            std::iter::successors((word != 0).then_some(word), |&rest| {
                let rest = rest & (rest - 1);
                (rest != 0).then_some(rest)
            })
            .map(move |rest| {
                let bit = index * 64 + rest.trailing_zeros() as usize;
                ((bit % self.width_px as usize) as u32, (bit / self.width_px as usize) as u32)
            })
        })
    }

    /// The pixels from `(x, y)` on to the right, up to 64, lowest bit first.
    pub(crate) fn bits(&self, x: u32, y: u32, count: u32) -> u64 {
        let bit = self.bit(x, y);
        let low = self.words[bit / 64] >> (bit % 64);
        let high = self.words.get(bit / 64 + 1).map_or(0, |next| (next << 1) << (63 - bit % 64));
        (low | high) & (u64::MAX >> (64 - count))
    }

    /// How many of up to 64 pixels of a row are occupied.
    pub fn count_in(&self, y: u32, columns: Range<u32>) -> u32 {
        if columns.is_empty() { 0 } else { self.bits(columns.start, y, columns.len() as u32).count_ones() }
    }

    /// Marks the pixels of [`Mask::bits`] that are set.
    pub(crate) fn set_bits(&mut self, x: u32, y: u32, bits: u64) {
        let bit = self.bit(x, y);
        self.words[bit / 64] |= bits << (bit % 64);
        let high = bits >> 1 >> (63 - bit % 64);
        if high != 0 {
            self.words[bit / 64 + 1] |= high;
        }
    }

    /// Hands the runs of occupied pixels in a row to `take`, as ranges of columns.
    pub(crate) fn runs(&self, y: u32, mut take: impl FnMut(Range<u32>)) {
        let row = self.bit(0, y);
        let end = row + self.width_px as usize;
        let mut start = self.next_bit(row, end, 0);
        while start < end {
            let stop = self.next_bit(start, end, u64::MAX);
            take((start - row) as u32..(stop - row) as u32);
            start = self.next_bit(stop, end, 0);
        }
    }

    /// The first bit in `from..end` that is set, or with all bits `flipped`, that is not; `end` where there is none.
    fn next_bit(&self, from: usize, end: usize, flipped: u64) -> usize {
        let mut from = from;
        while from < end {
            let rest = (self.words[from / 64] ^ flipped) >> (from % 64);
            if rest != 0 {
                return (from + rest.trailing_zeros() as usize).min(end);
            }
            from = (from / 64 + 1) * 64;
        }
        end
    }

    /// The bits as words; bits past the last pixel are zero.
    pub fn words(&self) -> &[u64] {
        &self.words
    }

    fn bit(&self, x: u32, y: u32) -> usize {
        y as usize * self.width_px as usize + x as usize
    }
}

/// How many samples lie before each word of a mask, so that an address finds its place in the planes at once.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Ranks(Vec<u32>);

impl Ranks {
    /// Of a mask; stale once the mask changes.
    pub fn new(mask: &Mask) -> Ranks {
        let ranks = mask.words().iter().scan(0, |before, word| {
            let rank = *before;
            *before += word.count_ones();
            Some(rank)
        });
        Ranks(ranks.collect())
    }

    /// The place of a pixel's sample in the planes, `None` where the pixel holds none.
    pub fn of(&self, mask: &Mask, x: u16, y: u16) -> Option<usize> {
        mask.get(u32::from(x), u32::from(y)).then(|| {
            let bit = mask.bit(u32::from(x), u32::from(y));
            let below = mask.words[bit / 64] & ((1 << (bit % 64)) - 1);
            self.0[bit / 64] as usize + below.count_ones() as usize
        })
    }
}

/// The uniform quantization of inverse depth: `w = w_min + code * w_step`.
///
/// Uniform in `w`, because the parallax error in pixels of an eye offset `r` parallel to the image is `f * r * dw` at every
/// depth.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct DepthScale {
    /// Inverse depth of code 0, in 1/m.
    pub w_min: f32,
    /// One step, in 1/m; zero where all samples have one depth.
    pub w_step: f32,
}

impl DepthScale {
    /// The scale of samples with inverse depths in `[w_min, w_max]`, for a viewer within `region_m` of the image's eye whose
    /// output has the focal length `focal_px`.
    ///
    /// An eye that moves `r` parallel to the image sees a sample shift by `f r w` pixels, so an error of `dw` shows as
    /// `f r dw`, the same at every depth. A step of `epsilon_px / (f r)` keeps it within half of `epsilon_px`, for rounding
    /// errs by half a step. Never finer than 16 bits allow; no step at all where all depths are one.
    pub fn for_view(epsilon_px: f64, focal_px: f64, region_m: f64, w_min: f32, w_max: f32) -> DepthScale {
        let finest = (w_max - w_min) / f32::from(u16::MAX);
        let wanted = (epsilon_px / (focal_px * region_m)) as f32;
        let w_step = if wanted.is_finite() { wanted.max(finest) } else { finest };
        DepthScale { w_min, w_step: if w_max > w_min { w_step } else { 0.0 } }
    }

    /// The inverse depth of a code, in 1/m.
    pub fn w(&self, code: u16) -> f32 {
        self.w_min + f32::from(code) * self.w_step
    }

    /// The nearest code of an inverse depth.
    pub fn code(&self, w: f32) -> u16 {
        if self.w_step > 0.0 { ((w - self.w_min) / self.w_step).round().clamp(0.0, 65535.0) as u16 } else { 0 }
    }
}

/// A base colour in quarters of a step, 0 to 1023: two bits of `rest` a channel above its code, red in the lowest. The light of a bright lamp
/// shows a step of a dark colour as several.
pub fn colour_quarters(code: [u8; 3], rest: u8) -> [u16; 3] {
    std::array::from_fn(|channel| 4 * u16::from(code[channel]) + u16::from(rest >> (2 * channel) & 3))
}

/// The code of an sRGB-encoded base colour, 0 to 1 a channel, and what it leaves off; white leaves off nothing.
pub fn colour_with_rest(srgb: [f32; 3]) -> ([u8; 3], u8) {
    let quarters = srgb.map(|value| (1020.0 * value.clamp(0.0, 1.0)).round() as u16);
    let rest = |channel: usize| (quarters[channel] as u8 & 3) << (2 * channel);
    (quarters.map(|quarters| (quarters >> 2) as u8), rest(0) | rest(1) | rest(2))
}

/// How a sample's surface ends at its sides: a nibble for each, see [`crate::ends`].
pub type Ends = u16;

/// What one camera captured. Every plane holds one value a sample, in the order of [`Mask::occupied`].
#[derive(Debug, Clone, PartialEq)]
pub struct DepthImage {
    /// The camera, with the size of the image.
    pub camera: Camera,
    /// How `depth` codes inverse depth.
    pub depth_scale: DepthScale,
    /// Which pixels hold a sample.
    pub mask: Mask,
    /// Inverse depth codes, see [`DepthScale`]. At most 65535.
    pub depth: Vec<u16>,
    /// Shading normals in **world space at capture**, octahedral, see [`octahedral_code`].
    pub normal: Vec<[u8; 2]>,
    /// What rounding left off of the normals of reflectors, which show half a degree as a facet: [`octahedral_rest`], and 0 for
    /// samples of other materials. Empty where none of the image has any.
    pub normal_rest: Vec<u8>,
    /// Where surfaces end beside their samples, see [`crate::ends`]. Empty where none does.
    pub ends: Vec<Ends>,
    /// Base colour, sRGB-encoded.
    pub colour: Vec<[u8; 3]>,
    /// What rounding left off of base colours in views at rest: [`colour_quarters`]. Empty where none of the image has any.
    pub colour_rest: Vec<u8>,
    /// Object ids: stable over the life of a scene.
    pub object: Vec<u16>,
    /// Indices into the material table.
    pub material: Vec<u8>,
    /// How much of its pixel each sample covers, 1 to [`DepthImage::WHOLE`]; empty where each covers all of its own. Images of views
    /// at rest have some ([`crate::Purpose::Rest`]): what else a pixel shows is in other images of the same camera. In those of
    /// layers it is how much a sample hides of what lies behind it ([`crate::Purpose::Layer`]).
    pub share: Vec<u8>,
}

impl DepthImage {
    /// The share of a sample that covers all of its pixel, or hides all: finer steps of a gradient are not told from each other.
    pub const WHOLE: u8 = 64;

    /// An image of one pixel that shows nothing, where a patch is to say just that.
    pub fn without_samples() -> DepthImage {
        DepthImage {
            camera: Camera::Pinhole(Pinhole::symmetric(Rigid::IDENTITY, (1, 1), 1.0, 1.0)),
            depth_scale: DepthScale { w_min: 0.0, w_step: 0.0 },
            mask: Mask::empty(1, 1),
            depth: Vec::new(),
            normal: Vec::new(),
            normal_rest: Vec::new(),
            colour_rest: Vec::new(),
            share: Vec::new(),
            ends: Vec::new(),
            colour: Vec::new(),
            object: Vec::new(),
            material: Vec::new(),
        }
    }

    /// How many samples the image holds.
    pub fn sample_count(&self) -> usize {
        self.depth.len()
    }

    /// The normal of a sample, as finely as it is known.
    pub fn normal_at(&self, index: usize) -> glam::Vec3 {
        octahedral_normal_with_rest(self.normal[index], self.normal_rest.get(index).copied().unwrap_or(0))
    }

    /// Forgets the samples whose flag is false; one flag a sample, in the order of the planes.
    pub fn retain(&mut self, keep: &[bool]) {
        let occupied: Vec<(u32, u32)> = self.mask.occupied().collect();
        for ((x, y), _) in occupied.into_iter().zip(keep).filter(|(_, keep)| !**keep) {
            self.mask.set(x, y, false);
        }
        retain(&mut self.depth, keep);
        retain(&mut self.normal, keep);
        if !self.normal_rest.is_empty() {
            retain(&mut self.normal_rest, keep);
        }
        if !self.ends.is_empty() {
            retain(&mut self.ends, keep);
        }
        retain(&mut self.colour, keep);
        if !self.colour_rest.is_empty() {
            retain(&mut self.colour_rest, keep);
        }
        retain(&mut self.object, keep);
        retain(&mut self.material, keep);
        if !self.share.is_empty() {
            retain(&mut self.share, keep);
        }
    }

    /// The samples of a mask of this image's size alone.
    pub fn only(&self, mask: &Mask) -> DepthImage {
        let ranks = Ranks::new(&self.mask);
        let (mut only, mut kept) = (Mask::empty(self.mask.width_px, self.mask.height_px), Vec::new());
        for (x, y) in mask.occupied() {
            if let Some(rank) = ranks.of(&self.mask, x as u16, y as u16) {
                only.set(x, y, true);
                kept.push(rank);
            }
        }
        // Planes that say nothing are empty.
        fn of<T: Copy>(plane: &[T], kept: &[usize]) -> Vec<T> {
            if plane.is_empty() { Vec::new() } else { kept.iter().map(|&rank| plane[rank]).collect() }
        }
        DepthImage {
            camera: self.camera.clone(),
            depth_scale: self.depth_scale,
            depth: of(&self.depth, &kept),
            normal: of(&self.normal, &kept),
            normal_rest: of(&self.normal_rest, &kept),
            ends: of(&self.ends, &kept),
            colour: of(&self.colour, &kept),
            colour_rest: of(&self.colour_rest, &kept),
            object: of(&self.object, &kept),
            material: of(&self.material, &kept),
            share: of(&self.share, &kept),
            mask: only,
        }
    }

    /// Raw bytes at wire width: depth 2, normal 2 and 1 for what is left off, ends 2, colour 3 and 1 for what is left off, object 2, material 1,
    /// share 1 a sample; planes of one value are left out, as the codec leaves them out.
    pub fn raw_bytes(&self) -> usize {
        fn plane<T: PartialEq>(values: &[T]) -> usize {
            let constant = values.iter().all(|value| *value == values[0]);
            if constant { 0 } else { size_of_val(values) }
        }
        let normals = plane(&self.normal) + plane(&self.normal_rest);
        let rests = plane(&self.colour_rest);
        let ids = plane(&self.object) + plane(&self.material);
        plane(&self.depth) + normals + plane(&self.ends) + plane(&self.colour) + rests + ids + plane(&self.share)
    }
}

/// Keeps the values whose flag is true; one flag a value.
pub(crate) fn retain<T>(values: &mut Vec<T>, keep: &[bool]) {
    let mut keep = keep.iter();
    values.retain(|_| *keep.next().expect("one flag a value"));
}

/// The octahedral code of a unit vector, 8 + 8 bits (mean error 0.34 degrees; [`octahedral_rest`] is for more): the sphere is projected
/// on the octahedron `|x| + |y| + |z| = 1`, whose lower half is folded outwards over the upper one, and each of the two coordinates is
/// quantized to 255 steps over [-1, 1] (Cigolle et al., A Survey of Efficient Representations for Independent Unit Vectors, 2014).
pub fn octahedral_code(normal: glam::Vec3) -> [u8; 2] {
    let p = octahedral(normal);
    [quantize(p.x), quantize(p.y)]
}

/// What [`octahedral_code`] rounds off, in sixteenths of its steps: two numbers of four bits from -8 to 7, the first in the low half.
/// With it a vector has 12 + 12 bits (mean error 0.02 degrees).
pub fn octahedral_rest(normal: glam::Vec3) -> u8 {
    let p = octahedral(normal);
    let rest = |value: f32| {
        let steps = ((value + 1.0) * 2032.0).round() - 16.0 * f32::from(quantize(value));
        steps.clamp(-8.0, 7.0) as i8 as u8 & 15
    };
    rest(p.x) | rest(p.y) << 4
}

/// The two numbers of [`octahedral_rest`].
pub fn rest_steps(rest: u8) -> [i8; 2] {
    [(rest << 4) as i8 >> 4, rest as i8 >> 4]
}

/// The octahedral coordinates of a vector, -1 to 1, see [`octahedral_code`]; 0 of one without direction.
pub fn octahedral(normal: glam::Vec3) -> glam::Vec2 {
    let sum = normal.x.abs() + normal.y.abs() + normal.z.abs();
    // Not for NaN either.
    let has_direction = sum > 0.0;
    if !has_direction {
        return glam::Vec2::ZERO;
    }
    let p = glam::Vec2::new(normal.x, normal.y) / sum;
    if normal.z < 0.0 { fold(p) } else { p }
}

/// The unit vector of an octahedral code.
pub fn octahedral_normal(code: [u8; 2]) -> glam::Vec3 {
    octahedral_normal_with_rest(code, 0)
}

/// The unit vector of an octahedral code and what rounding left off ([`octahedral_rest`]).
pub fn octahedral_normal_with_rest(code: [u8; 2], rest: u8) -> glam::Vec3 {
    let [x, y] = rest_steps(rest).map(|steps| f32::from(steps) / 16.0);
    let p = glam::Vec2::new(f32::from(code[0]) + x, f32::from(code[1]) + y) / 127.0 - 1.0;
    let z = 1.0 - p.x.abs() - p.y.abs();
    let p = if z < 0.0 { fold(p) } else { p };
    glam::Vec3::new(p.x, p.y, z).normalize_or(glam::Vec3::Z)
}

/// -1..1 to 0..254, so that 0, and with it every axis, is exact.
fn quantize(value: f32) -> u8 {
    ((value + 1.0) * 127.0).round().clamp(0.0, 254.0) as u8
}

fn fold(p: glam::Vec2) -> glam::Vec2 {
    let sign = glam::Vec2::new(1.0_f32.copysign(p.x), 1.0_f32.copysign(p.y));
    (glam::Vec2::ONE - glam::Vec2::new(p.y.abs(), p.x.abs())) * sign
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn with_what_is_left_off_normals_are_a_sixteenth_as_far_off() {
        let (mut coarse, mut fine, mut sums) = (0.0_f32, 0.0_f32, [0.0_f32; 2]);
        // Evenly over the sphere.
        for index in 0..20_000 {
            let z = 1.0 - 2.0 * (index as f32 + 0.5) / 20_000.0;
            let (sin, cos) = (index as f32 * 2.399_963).sin_cos();
            let normal = glam::Vec2::new(cos, sin).extend(0.0) * (1.0 - z * z).sqrt() + glam::Vec3::Z * z;
            let (code, rest) = (octahedral_code(normal), octahedral_rest(normal));
            let off = [octahedral_normal(code), octahedral_normal_with_rest(code, rest)].map(|n| n.distance(normal));
            (coarse, fine) = (coarse.max(off[0]), fine.max(off[1]));
            sums = [sums[0] + off[0], sums[1] + off[1]];
            assert_eq!(octahedral_normal_with_rest(code, 0), octahedral_normal(code));
        }
        assert!(sums[1] < sums[0] / 14.5, "{sums:?}");
        // Half a step upwards is the one that has no nibble: seven sixteenths stand for it.
        assert!(coarse < 0.0165 && fine < 0.0165 / 8.0, "{coarse} and {fine}");
        assert_eq!(rest_steps(0x8f), [-1, -8]);
        assert_eq!(octahedral_rest(glam::Vec3::NEG_Y), 0, "axes are exact");
    }

    #[test]
    fn the_depth_step_bounds_the_shift() {
        let scale = DepthScale::for_view(0.1, 443.0, 1.0, 0.01, 1.0);
        for w in [0.01_f32, 0.2, 0.77777, 1.0] {
            let shift_px = 443.0 * (scale.w(scale.code(w)) - w).abs();
            assert!(shift_px <= 0.0501, "{shift_px} at {w}");
        }
        assert_eq!(DepthScale::for_view(0.1, 443.0, 1.0, 0.5, 0.5).w_step, 0.0);
        assert_eq!(DepthScale::for_view(0.1, 443.0, 1e9, 0.0, 1.0).code(1.0), u16::MAX);
    }
}
