use glam::DVec2;

/// The inverse depths between two.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Range {
    pub min: f64,
    pub max: f64,
}

impl Range {
    /// What holds nothing.
    pub const EMPTY: Range = Range { min: f64::INFINITY, max: f64::NEG_INFINITY };

    pub fn union(self, other: Range) -> Range {
        Range { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    /// Whether two have a value in common; an empty one has none with any.
    pub fn meets(&self, other: Range) -> bool {
        self.min <= other.max && self.max >= other.min
    }
}

/// For every pixel, and for every block of 2x2, 4x4, 8x8 pixels and so on, the range of inverse depths of the surface in it;
/// [`Range::EMPTY`] where none of its pixels holds a sample.
#[derive(Debug, Clone)]
pub(crate) struct Pyramid {
    levels: Vec<Level>,
}

#[derive(Debug, Clone)]
struct Level {
    width: usize,
    height: usize,
    ranges: Vec<Range>,
}

impl Level {
    fn at(&self, x: usize, y: usize) -> Range {
        if x < self.width && y < self.height { self.ranges[y * self.width + x] } else { Range::EMPTY }
    }

    fn above(&self) -> Level {
        let (width, height) = (self.width.div_ceil(2), self.height.div_ceil(2));
        let block = |place: usize| {
            let (x, y) = (2 * (place % width), 2 * (place / width));
            let top = self.at(x, y).union(self.at(x + 1, y));
            top.union(self.at(x, y + 1)).union(self.at(x + 1, y + 1))
        };
        Level { width, height, ranges: (0..width * height).map(block).collect() }
    }
}

impl Pyramid {
    /// Of the ranges of all pixels, row by row.
    pub fn new(width: usize, height: usize, ranges: Vec<Range>) -> Pyramid {
        let mut levels = vec![Level { width, height, ranges }];
        while let Some(below) = levels.last().filter(|level| level.width > 1 || level.height > 1) {
            levels.push(below.above());
        }
        Pyramid { levels }
    }

    /// How many levels there are; the last one is a single block.
    pub fn levels(&self) -> usize {
        self.levels.len()
    }

    /// The range of a block on a level; empty outside.
    pub fn block(&self, level: usize, x: usize, y: usize) -> Range {
        self.levels[level].at(x, y)
    }

    /// Of the whole image.
    pub fn whole(&self) -> Range {
        self.levels.last().map_or(Range::EMPTY, |top| top.at(0, 0))
    }

    /// The range over at least the pixels that a box in the image touches, from at most four blocks: those of the level on
    /// which a block is as wide and high as the box. What lies outside of the image is empty.
    pub fn over(&self, min_px: DVec2, max_px: DVec2) -> Range {
        let extent_px = (max_px - min_px).max_element().max(1.0);
        let top = self.levels.len() - 1;
        // From the top on one block is all.
        let level = (extent_px.log2().ceil() as usize).min(top);
        let block_px = (1_u64 << level) as f64;
        let (low, high) = ((min_px / block_px).floor(), (max_px / block_px).floor());
        if high.min_element() < 0.0 {
            return Range::EMPTY;
        }
        let level = &self.levels[level];
        let last = |high: f64, count: usize| (high as usize).min(count - 1);
        let (low_x, low_y) = (low.x.max(0.0) as usize, low.y.max(0.0) as usize);
        let mut range = Range::EMPTY;
        for y in low_y..=last(high.y, level.height) {
            for x in low_x..=last(high.x, level.width) {
                range = range.union(level.at(x, y));
            }
        }
        range
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_box_holds_the_ranges_of_its_pixels_in_four_blocks() {
        let (width, height) = (13, 7);
        let value = |x: usize, y: usize| ((x * 31 + y * 17) % 23) as f64;
        let is_empty = |x: usize, y: usize| (x * y) % 3 == 1;
        let range = |x, y| {
            if is_empty(x, y) { Range::EMPTY } else { Range { min: value(x, y), max: value(x, y) + 0.5 } }
        };
        let ranges = (0..width * height).map(|place| range(place % width, place / width)).collect();
        let pyramid = Pyramid::new(width, height, ranges);
        for (x0, y0, x1, y1) in (0..width).flat_map(|x0| {
            (0..height).flat_map(move |y0| (x0..width).flat_map(move |x1| (y0..height).map(move |y1| (x0, y0, x1, y1))))
        }) {
            let min_px = DVec2::new(x0 as f64 + 0.25, y0 as f64 + 0.75);
            let max_px = DVec2::new(x1 as f64 + 0.5, y1 as f64 + 0.75);
            let over = pyramid.over(min_px, max_px);
            for (x, y) in (x0..=x1).flat_map(|x| (y0..=y1).map(move |y| (x, y))) {
                let inside = range(x, y);
                assert_eq!(over.union(inside), over, "{x} {y} in {min_px} {max_px}");
            }
        }
        assert_eq!(pyramid.over(DVec2::splat(-9.0), DVec2::splat(-0.5)), Range::EMPTY);
        assert_eq!(pyramid.over(DVec2::splat(20.0), DVec2::splat(21.0)), Range::EMPTY);
        assert_eq!(pyramid.over(DVec2::splat(-9.0), DVec2::splat(100.0)), pyramid.whole());
    }
}
