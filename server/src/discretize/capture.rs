use camera::{Camera, Pinhole};
use glam::DVec2;
use protocol::ends::Ends;
use protocol::{DepthImage, DepthScale, Mask};

/// One image as it comes from the GPU: planes of a value a pixel, row-major.
#[derive(Debug, Clone, PartialEq)]
pub struct Capture {
    /// What captured it.
    pub camera: Pinhole,
    /// Triangle id (0 where there is no sample); object id (low 16 bits) and octahedral normal (high 16 bits).
    pub ids: Vec<[u32; 2]>,
    /// sRGB-encoded base colour, and the material code as alpha.
    pub colour: Vec<[u8; 4]>,
    /// What the codes of normals leave off, of samples that reflect and in views at rest, and what those of colours do, in views at rest; else 0.
    pub rests: Vec<[u8; 2]>,
    /// Of a layer of what is blended, how much each sample hides ([`DepthImage::WHOLE`]), 0 of what is opaque, which is no sample of the layer. Empty of other captures.
    pub hides: Vec<u8>,
    /// `near * w`; 0 where there is no sample.
    pub depth: Vec<f32>,
    /// Where surfaces end beside their samples, see [`super::EndsPass`]. Empty where nobody asked.
    pub ends: Vec<Ends>,
    /// What the GPU took for it, where it can tell.
    pub gpu_s: Option<f64>,
}

/// How finely inverse depth is stored.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum DepthPrecision {
    /// All 65,535 steps between the least and the greatest.
    Finest,
    /// So that an eye that moves `offset_m` sideways sees samples shift by at most `epsilon_px` at the focal length `focal_px`
    /// of the output: `w_step = epsilon / (f r)`, and never finer than [`DepthPrecision::Finest`].
    Parallax {
        /// Pixels.
        epsilon_px: f64,
        /// Pixels.
        focal_px: f64,
        /// Metres.
        offset_m: f64,
    },
}

impl DepthPrecision {
    /// The scale of samples whose inverse depths lie in `[w_min, w_max]`.
    pub fn scale(self, w_min: f32, w_max: f32) -> DepthScale {
        let finest = (w_max - w_min) / f32::from(u16::MAX);
        let w_step = match self {
            DepthPrecision::Finest => finest,
            DepthPrecision::Parallax { epsilon_px, focal_px, offset_m } => {
                let wanted = (epsilon_px / (focal_px * offset_m)) as f32;
                if wanted.is_finite() { wanted.max(finest) } else { finest }
            }
        };
        DepthScale { w_min, w_step: if w_max > w_min { w_step } else { 0.0 } }
    }
}

impl Capture {
    /// The triangle at a pixel; 0 where there is none, outside of the image too.
    pub fn triangle_at(&self, x: i32, y: i32) -> u32 {
        let inside = x >= 0 && y >= 0 && (x as u32) < self.camera.width_px && (y as u32) < self.camera.height_px;
        if inside { self.ids[y as usize * self.camera.width_px as usize + x as usize][0] } else { 0 }
    }

    /// Inverse depth `1/z` in 1/m at an index; 0 where there is no sample.
    pub fn w(&self, index: usize) -> f32 {
        self.depth[index] / self.camera.near_m as f32
    }

    /// Object id at an index.
    pub fn object(&self, index: usize) -> u16 {
        object(self.ids[index])
    }

    /// Octahedral code of the shading normal in world space at an index.
    pub fn normal_code(&self, index: usize) -> [u8; 2] {
        normal_code(self.ids[index])
    }

    /// Which pixels hold a sample.
    pub fn mask(&self) -> Mask {
        self.mask_where(|_| true)
    }

    /// Whether a hit is a sample of what the capture is of, and not only stands before or behind that.
    pub fn is_own(&self, index: usize) -> bool {
        self.hides.is_empty() || self.hides[index] > 0
    }

    /// Which pixels hold a sample that `keep` (asked with the index) lets through.
    pub fn mask_where(&self, keep: impl Fn(usize) -> bool) -> Mask {
        let (width_px, height_px) = (self.camera.width_px, self.camera.height_px);
        let mut mask = Mask::empty(width_px, height_px);
        for (y, row) in (0..height_px).zip(self.ids.chunks_exact(width_px as usize)) {
            let first = y as usize * width_px as usize;
            for (x, ids) in (0..width_px).zip(row) {
                let index = first + x as usize;
                if ids[0] != 0 && self.is_own(index) && keep(index) {
                    mask.set(x, y, true);
                }
            }
        }
        mask
    }

    /// The part of `size_px` that begins at `origin`, which must lie inside: the same eye, a smaller image.
    pub fn cropped(&self, origin: (u32, u32), size_px: (u32, u32)) -> Capture {
        let camera = Pinhole {
            width_px: size_px.0,
            height_px: size_px.1,
            centre_px: self.camera.centre_px - DVec2::new(origin.0.into(), origin.1.into()),
            ..self.camera
        };
        let width = self.camera.width_px as usize;
        let rows = (origin.1..origin.1 + size_px.1).map(|y| y as usize * width + origin.0 as usize);
        let rows = rows.map(|first| first..first + size_px.0 as usize);
        Capture {
            camera,
            ids: rows.clone().flat_map(|row| &self.ids[row]).copied().collect(),
            colour: rows.clone().flat_map(|row| &self.colour[row]).copied().collect(),
            rests: rows.clone().flat_map(|row| &self.rests[row]).copied().collect(),
            hides: rows.clone().filter(|_| !self.hides.is_empty()).flat_map(|row| &self.hides[row]).copied().collect(),
            depth: rows.clone().flat_map(|row| &self.depth[row]).copied().collect(),
            ends: rows.filter(|_| !self.ends.is_empty()).flat_map(|row| &self.ends[row]).copied().collect(),
            gpu_s: self.gpu_s,
        }
    }

    /// All samples.
    pub fn depth_image(&self, precision: DepthPrecision) -> DepthImage {
        self.depth_image_of(self.mask(), precision)
    }

    /// The samples of a mask of this image's size, all of which must be occupied here.
    pub fn depth_image_of(&self, mask: Mask, precision: DepthPrecision) -> DepthImage {
        let Self { ids, colour, rests, .. } = self;
        let planes = Planes { ids, colour, rests, w: &|index| self.w(index) };
        let mut image = planes.depth_image(Camera::Pinhole(self.camera), mask, precision);
        let index = |(x, y): (u32, u32)| y as usize * self.camera.width_px as usize + x as usize;
        if !self.hides.is_empty() {
            image.share = image.mask.occupied().map(|pixel| self.hides[index(pixel)]).collect();
        }
        if !self.ends.is_empty() {
            let ends = image.mask.occupied().map(|pixel| self.ends[index(pixel)]).collect();
            image.settle_ends(ends);
        }
        image
    }
}

/// What depth images are packed from: values of every pixel of an image, row-major.
pub(crate) struct Planes<'a> {
    pub ids: &'a [[u32; 2]],
    pub colour: &'a [[u8; 4]],
    pub rests: &'a [[u8; 2]],
    /// Inverse depth at an index.
    pub w: &'a dyn Fn(usize) -> f32,
}

impl Planes<'_> {
    /// The samples of a mask of this image's size, all of which must be occupied.
    pub(crate) fn depth_image(&self, camera: Camera, mask: Mask, precision: DepthPrecision) -> DepthImage {
        let width_px = mask.size_px().0 as usize;
        assert_eq!(width_px * mask.size_px().1 as usize, self.ids.len(), "a mask of another image");
        let indices: Vec<usize> = mask.occupied().map(|(x, y)| y as usize * width_px + x as usize).collect();
        let extent = indices.iter().fold((f32::INFINITY, 0.0_f32), |(least, greatest), &index| {
            let w = (self.w)(index);
            (least.min(w), greatest.max(w))
        });
        let (w_min, w_max) = if indices.is_empty() { (0.0, 0.0) } else { extent };
        let depth_scale = precision.scale(w_min, w_max);
        let colour = |index: usize| {
            let [r, g, b, _] = self.colour[index];
            [r, g, b]
        };
        // Of a plane of nothing but zeros nothing is kept.
        let rest = |plane: usize| {
            let rests = indices.iter().map(|&index| self.rests[index][plane]);
            if rests.clone().any(|rest| rest != 0) { rests.collect() } else { Vec::new() }
        };
        DepthImage {
            camera,
            depth_scale,
            depth: indices.iter().map(|&index| depth_scale.code((self.w)(index))).collect(),
            normal: indices.iter().map(|&index| normal_code(self.ids[index])).collect(),
            normal_rest: rest(0),
            ends: Vec::new(),
            colour: indices.iter().map(|&index| colour(index)).collect(),
            colour_rest: rest(1),
            object: indices.iter().map(|&index| object(self.ids[index])).collect(),
            material: indices.iter().map(|&index| self.colour[index][3]).collect(),
            share: Vec::new(),
            mask,
        }
    }
}

/// The object id in a pixel's ids.
pub(crate) fn object(ids: [u32; 2]) -> u16 {
    ids[1] as u16
}

/// The octahedral code of the normal in a pixel's ids.
pub(crate) fn normal_code(ids: [u32; 2]) -> [u8; 2] {
    let [_, _, low, high] = ids[1].to_le_bytes();
    [low, high]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_depth_step_bounds_the_shift_in_pixels() {
        let precision = DepthPrecision::Parallax { epsilon_px: 0.1, focal_px: 443.0, offset_m: 1.0 };
        let scale = precision.scale(0.01, 1.0);
        for w in [0.01_f32, 0.2, 0.77777, 1.0] {
            let shift_px = 443.0 * 1.0 * (scale.w(scale.code(w)) - w).abs();
            assert!(shift_px <= 0.0501, "{shift_px} at {w}");
        }
        assert!(scale.code(1.0) < 1 << 13, "10 to 12 bits are meant: {}", scale.code(1.0));
        // Too fine a wish is capped by the 16 bits.
        let capped = DepthPrecision::Parallax { epsilon_px: 1e-9, focal_px: 443.0, offset_m: 1.0 }.scale(0.0, 1.0);
        assert_eq!(capped.code(1.0), 65535);
        assert_eq!(DepthPrecision::Finest.scale(0.5, 0.5).w_step, 0.0);
    }
}
