//! What every sample of an image has beside it, row by row, without a branch at a sample.

use crate::image::DepthImage;

/// In place of an object's id: a pixel without a sample, and what is no pixel of the image.
const NOTHING: i32 = -1;
const OUTSIDE: i32 = -2;

/// The pixels of a row, behind one more that is no pixel, and before another.
struct Row {
    objects: Vec<i32>,
    /// Codes of depth. Where no sample is, nearer than all.
    depths: Vec<i32>,
}

impl Row {
    fn outside(width_px: u32) -> Row {
        let columns = width_px as usize + 2;
        Row { objects: vec![OUTSIDE; columns], depths: vec![i32::MAX; columns] }
    }

    fn pixels(&self, columns: std::ops::Range<usize>) -> Pixels<'_> {
        (&self.objects[columns.clone()], &self.depths[columns])
    }

    /// Takes the samples of a row, the first of which is `rank`; gives the rank behind them.
    fn load(&mut self, image: &DepthImage, y: u32, mut rank: usize) -> usize {
        let pixels = 1..self.objects.len() - 1;
        self.objects[pixels.clone()].fill(NOTHING);
        self.depths[pixels].fill(i32::MAX);
        image.mask.runs(y, |run| {
            let (columns, ranks) = (run.start as usize + 1..run.end as usize + 1, rank..rank + run.len());
            let objects = self.objects[columns.clone()].iter_mut().zip(&image.object[ranks.clone()]);
            objects.for_each(|(to, &object)| *to = object.into());
            let depths = self.depths[columns].iter_mut().zip(&image.depth[ranks.clone()]);
            depths.for_each(|(to, &depth)| *to = depth.into());
            rank = ranks.end;
        });
        rank
    }
}

/// A footprint, in depth steps: of a depth's code, it and this, times the next.
struct Footprints {
    steps_before: f64,
    each_step: f64,
}

impl Footprints {
    /// How many steps at most do not pass the footprint of a depth. Where depths have no step, none do.
    #[inline(always)]
    fn most_steps(&self, depth: i32) -> i32 {
        let footprint = (self.steps_before + f64::from(depth)) * self.each_step;
        if footprint.is_nan() { i32::MAX } else { footprint as i32 }
    }
}

/// See [`super::Besides`].
pub(super) fn codes(image: &DepthImage) -> Vec<u8> {
    let (w_min, w_step) = (f64::from(image.depth_scale.w_min), f64::from(image.depth_scale.w_step));
    let footprints = Footprints { steps_before: w_min / w_step, each_step: 1.0 / image.camera.root().focal_px };
    let (width_px, height_px) = image.mask.size_px();
    let [mut above, mut here, mut below] = [(); 3].map(|()| Row::outside(width_px));
    let mut row_codes = RowCodes::new(width_px);
    let mut codes = Vec::with_capacity(image.depth.len());
    let mut loaded = below.load(image, 0, 0);
    for y in 0..height_px {
        std::mem::swap(&mut above, &mut here);
        std::mem::swap(&mut here, &mut below);
        if y + 1 < height_px {
            loaded = below.load(image, y + 1, loaded);
        } else {
            below = Row::outside(width_px);
        }
        row_codes.fill([&above, &here, &below], &footprints);
        image.mask.runs(y, |run| codes.extend_from_slice(&row_codes.codes[run.start as usize..run.end as usize]));
    }
    codes
}

/// The codes of a row's pixels. Those without a sample have some as well.
struct RowCodes {
    most_steps: Vec<i32>,
    codes: Vec<u8>,
}

impl RowCodes {
    fn new(width_px: u32) -> RowCodes {
        RowCodes { most_steps: vec![0; width_px as usize], codes: vec![0; width_px as usize] }
    }

    fn fill(&mut self, [above, here, below]: [&Row; 3], footprints: &Footprints) {
        let pixels = self.codes.len();
        let row = |row, first| Row::pixels(row, first..first + pixels);
        let own = row(here, 1);
        self.most_steps.iter_mut().zip(own.1).for_each(|(most, &depth)| *most = footprints.most_steps(depth));
        self.codes.fill(0);
        // In the order of the sides.
        for (side, other) in [row(here, 2), row(below, 1), row(here, 0), row(above, 1)].into_iter().enumerate() {
            add_side(&mut self.codes, &self.most_steps, own, other, 2 * side);
        }
    }
}

/// Objects and depths of as many pixels.
type Pixels<'a> = (&'a [i32], &'a [i32]);

/// Adds the codes of a side, shifted.
fn add_side(codes: &mut [u8], most_steps: &[i32], own: Pixels<'_>, other: Pixels<'_>, shift: usize) {
    let pixels = own.0.iter().zip(own.1).zip(other.0.iter().zip(other.1)).zip(most_steps);
    for (code, (((&object, &depth), (&other, &other_depth)), &most_steps)) in codes.iter_mut().zip(pixels) {
        let same = other == object;
        let farther = same & (depth.wrapping_sub(other_depth) > most_steps);
        let behind = !same & (other_depth <= depth);
        *code |= (3 * u8::from(farther) + 2 * u8::from(behind) + u8::from(other == NOTHING)) << shift;
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use camera::{Camera, Pinhole, Rigid};

    use super::super::{Beside, Besides, SIDES};
    use crate::image::Ranks;
    use crate::{DepthImage, DepthScale, Mask};

    /// Noise of an index and a kind.
    fn noise(index: u32, kind: u32) -> u32 {
        let mixed = (index ^ kind << 20).wrapping_mul(2_654_435_761);
        (mixed ^ mixed >> 15).wrapping_mul(2_246_822_519) >> 7
    }

    /// Three samples of four, of two objects in tatters, at depths that step now and then by more than a footprint.
    pub(crate) fn tatters((width_px, height_px): (u32, u32)) -> DepthImage {
        let mut mask = Mask::empty(width_px, height_px);
        let pixels = (0..height_px).flat_map(|y| (0..width_px).map(move |x| (x, y)));
        pixels.filter(|&(x, y)| !noise(y * width_px + x, 0).is_multiple_of(4)).for_each(|(x, y)| mask.set(x, y, true));
        let count = mask.count();
        let of = |kind: u32| (0..count as u32).map(move |index| noise(index, kind));
        DepthImage {
            camera: Camera::Pinhole(Pinhole::symmetric(Rigid::IDENTITY, (width_px, height_px), 1.0, 0.1)),
            depth_scale: DepthScale { w_min: 0.01, w_step: 1e-4 },
            depth: of(1).map(|noise| (1000 + 20 * (noise % 13)) as u16).collect(),
            normal: vec![[128, 128]; count],
            normal_rest: Vec::new(),
            ends: Vec::new(),
            colour: vec![[9, 9, 9]; count],
            colour_rest: Vec::new(),
            object: of(2).map(|noise| u16::from(noise.is_multiple_of(5))).collect(),
            material: vec![0; count],
            share: Vec::new(),
            mask,
        }
    }

    /// The same by what is said of one side of one sample.
    fn beside(image: &DepthImage, ranks: &Ranks, (x, y): (u32, u32), [right, down]: [i32; 2]) -> Beside {
        let (width_px, height_px) = image.mask.size_px();
        let (beside_x, beside_y) = (x as i32 + right, y as i32 + down);
        if beside_x < 0 || beside_y < 0 || beside_x >= width_px as i32 || beside_y >= height_px as i32 {
            return Beside::GoesOn;
        }
        let rank = |x: u32, y: u32| ranks.of(&image.mask, x as u16, y as u16);
        let own = rank(x, y).expect("a sample");
        let Some(other) = rank(beside_x as u32, beside_y as u32) else { return Beside::Nothing };
        let (depth, other_depth) = (image.depth[own], image.depth[other]);
        let footprint_w = f64::from(image.depth_scale.w(depth)) / image.camera.root().focal_px;
        let farther_w = (f64::from(depth) - f64::from(other_depth)) * f64::from(image.depth_scale.w_step);
        match image.object[own] == image.object[other] {
            false if other_depth <= depth => Beside::Other,
            true if farther_w > footprint_w => Beside::Farther,
            _ => Beside::GoesOn,
        }
    }

    #[test]
    fn rows_tell_what_single_samples_do() {
        for size in [(1, 1), (1, 40), (40, 1), (67, 23)] {
            let image = tatters(size);
            let (ranks, besides) = (Ranks::new(&image.mask), Besides::of(&image));
            let mut found = [0; 4];
            for (rank, pixel) in image.mask.occupied().enumerate() {
                for (side, step) in SIDES.into_iter().enumerate() {
                    let expected = beside(&image, &ranks, pixel, step);
                    assert_eq!(besides.at(rank, side), expected, "{pixel:?} {step:?} of {size:?}");
                    found[expected as usize] += 1;
                }
            }
            assert!(size != (67, 23) || found.iter().all(|&count| count > 20), "{found:?}");
            assert_eq!(besides.side_count(), found[1..].iter().sum::<usize>());
        }
    }

    #[test]
    fn depths_without_a_step_are_never_farther() {
        let mut image = tatters((40, 40));
        image.depth_scale.w_step = 0.0;
        let besides = Besides::of(&image);
        assert!((0..image.sample_count()).all(|rank| (0..4).all(|side| besides.at(rank, side) != Beside::Farther)));
    }
}
