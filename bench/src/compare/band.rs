//! The outline band: the pixels where one surface ends before another, in the truth. Averages over all pixels hide what goes wrong there.
//!
//! Two pixels beside each other are *apart* where
//!
//! - one shows a surface and the other none, or they show different objects; or
//! - their depths differ by more than their planes explain. Inverse depth is linear over the image of a plane, so each pixel and its
//!   neighbour on the far side from the other give a line, and a line is how the surface would go on. Where the two lines cross between the
//!   pixels, one surface bends there. Otherwise the smaller of the gaps between them, at either pixel, counts, and they are apart
//!   where it is larger than the less steep line rises over a pixel and than a pixel's own footprint on the nearer surface, which is
//!   `w / focal_px` in inverse depth: less is no step that an eye would see as an outline.
//!
//! The band are the pixels within [`BAND_PX`] of the line between two that are apart, diagonally too: two on either side of an outline,
//! those of the background among them.

/// How far the band reaches to either side.
pub const BAND_PX: usize = 2;

/// What the truth shows at each pixel, row-major.
#[derive(Debug, Clone, Copy)]
pub struct Shape<'a> {
    /// Inverse depths in 1/m, 0 where there is no surface.
    pub w: &'a [f32],
    /// Objects; those of pixels without a surface do not count.
    pub object: &'a [u16],
    /// Pixels of a row.
    pub width_px: usize,
    /// Of the camera, in pixels.
    pub focal_px: f64,
}

impl Shape<'_> {
    /// For each pixel whether it lies in the band.
    pub fn outline_band(&self) -> Vec<bool> {
        let height_px = self.w.len() / self.width_px.max(1);
        let mut beside = vec![false; self.w.len()];
        for y in 0..height_px {
            for x in 0..self.width_px {
                let here = y * self.width_px + x;
                for (step, place, side) in [(1, x, self.width_px), (self.width_px, y, height_px)] {
                    if place + 1 < side && self.are_apart(here, step, place, side) {
                        (beside[here], beside[here + step]) = (true, true);
                    }
                }
            }
        }
        widened(&beside, self.width_px, BAND_PX - 1)
    }

    /// Whether a pixel and the next one are apart. `place` is the pixel's along the direction of `step`, of `side`.
    fn are_apart(&self, here: usize, step: usize, place: usize, side: usize) -> bool {
        let next = here + step;
        let w = |pixel: usize| f64::from(self.w[pixel]);
        match (w(here) > 0.0, w(next) > 0.0) {
            (false, false) => return false,
            (true, true) if self.object[here] == self.object[next] => {}
            _ => return true,
        }
        let same = |a: usize, b: usize| w(b) > 0.0 && self.object[a] == self.object[b];
        let before = (place > 0 && same(here, here - step)).then(|| w(here) - w(here - step));
        let after = (place + 2 < side && same(next, next + step)).then(|| w(next + step) - w(next));
        // A surface of one pixel is taken to go on as the one beside it, and where nothing is known, to face the eye.
        let (rise_here, rise_next) = (before.or(after).unwrap_or(0.0), after.or(before).unwrap_or(0.0));
        let gap_here = w(next) - rise_next - w(here);
        let gap_next = w(next) - w(here) - rise_here;
        let bends = gap_here * gap_next <= 0.0;
        let explained = rise_here.abs().min(rise_next.abs()).max(w(here).max(w(next)) / self.focal_px);
        !bends && gap_here.abs().min(gap_next.abs()) > explained
    }
}

/// The mask with everything within `by_px` of it, diagonally too.
fn widened(mask: &[bool], width_px: usize, by_px: usize) -> Vec<bool> {
    let height_px = mask.len() / width_px.max(1);
    let near = |place: usize, side: usize| place.saturating_sub(by_px)..(place + by_px + 1).min(side);
    let is_near = |index: usize| {
        let (x, y) = (index % width_px, index / width_px);
        near(y, height_px).any(|y| near(x, width_px).any(|x| mask[y * width_px + x]))
    };
    (0..mask.len()).map(is_near).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const WIDTH_PX: usize = 24;
    const FOCAL_PX: f64 = 100.0;

    /// The columns that lie in the band, of an image whose rows are alike.
    fn columns(w: impl Fn(usize) -> f64, object: impl Fn(usize) -> u16) -> Vec<usize> {
        let row_w: Vec<f32> = (0..WIDTH_PX).map(|x| w(x) as f32).collect();
        let row_object: Vec<u16> = (0..WIDTH_PX).map(object).collect();
        let (w, object) = (row_w.repeat(9), row_object.repeat(9));
        let band = Shape { w: &w, object: &object, width_px: WIDTH_PX, focal_px: FOCAL_PX }.outline_band();
        assert!(band.chunks(WIDTH_PX).all(|row| row == &band[..WIDTH_PX]), "rows are alike");
        (0..WIDTH_PX).filter(|&x| band[x]).collect()
    }

    #[test]
    fn two_pixels_on_either_side_of_an_object_and_of_nothing() {
        assert_eq!(columns(|_| 0.5, |x| u16::from(x >= 10)), [8, 9, 10, 11]);
        assert_eq!(columns(|x| if x < 5 { 0.5 } else { 0.0 }, |_| 3), [3, 4, 5, 6]);
        assert_eq!(columns(|x| if x < 1 { 0.5 } else { 0.0 }, |_| 3), [0, 1, 2]);
    }

    #[test]
    fn a_step_in_depth_is_an_outline_and_planes_and_creases_are_none() {
        let steep = |x: usize| 0.1 + 0.03 * x as f64;
        assert_eq!(columns(steep, |_| 0), [] as [usize; 0], "a plane at any angle");
        let crease = |x: usize| 1.0 - 0.04 * (x as f64 - 11.3).abs();
        assert_eq!(columns(crease, |_| 0), [] as [usize; 0], "two planes that meet");
        let foot = |x: usize| 0.5 + 0.1 * (x as f64 - 11.3).max(0.0);
        assert_eq!(columns(foot, |_| 0), [] as [usize; 0], "a wall that begins in a floor");
        let ball = |x: usize| 1.0 + 0.1 * (1.0 - ((x as f64 - 11.5) / 12.0).powi(2)).max(0.0).sqrt();
        assert_eq!(columns(ball, |_| 0), [] as [usize; 0], "a surface that bends");
        let step = |x: usize| if x < 10 { 0.5 } else { 0.7 };
        assert_eq!(columns(step, |_| 0), [8, 9, 10, 11]);
        let steep_step = |x: usize| steep(x) + if x < 10 { 0.0 } else { 0.2 };
        assert_eq!(columns(steep_step, |_| 0), [8, 9, 10, 11], "between two steep planes");
        let twig = |x: usize| if x == 10 { 0.9 } else { 0.5 };
        assert_eq!(columns(twig, |_| 0), [8, 9, 10, 11, 12], "of one pixel");
    }

    #[test]
    fn a_step_of_less_than_a_footprint_is_none() {
        let step = |by: f64| columns(move |x| 0.5 + if x < 10 { 0.0 } else { by }, |_| 0).len();
        assert_eq!((step(0.9 * 0.5 / FOCAL_PX), step(1.1 * 0.5 / FOCAL_PX)), (0, 4));
    }
}
