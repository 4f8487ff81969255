use std::sync::Arc;

use camera::{ImagePoint, Pinhole};
use protocol::image::Ranks;
use protocol::{DepthImage, Edit, Mask};

use super::deforming::{Deforming, SurfacePoint};
use super::samples::{Captured, density};

/// What the server knows of a patch's samples beside what the client holds: by the places that they had when the patch was
/// added, so that deletes change nothing here.
#[derive(Debug, Clone)]
pub(super) struct Record {
    /// The look that captured it.
    pub added: u32,
    /// Step of the coded inverse depths, 1/m.
    w_step: f32,
    captured: Arc<CapturedSamples>,
    uses: Vec<Use>,
}

/// What never changes: shared by all accounts that came to the same patch.
#[derive(Debug)]
struct CapturedSamples {
    mask: Mask,
    ranks: Ranks,
    samples: Vec<Sample>,
    /// By place, row by row, of deforming objects only.
    points: Vec<((u16, u16), SurfacePoint)>,
}

#[derive(Debug, Clone, Copy)]
pub(super) struct Sample {
    /// Samples an area, see [`density`].
    pub density: f32,
    /// Inverse depth, 1/m.
    pub w: f32,
    pub triangle: u32,
}

/// What became of a sample.
#[derive(Debug, Clone, Copy)]
struct Use {
    /// The last look that showed it.
    seen: u32,
    /// The look that last trimmed it; 0 never.
    trimmed: u32,
    extent: u8,
}

impl Record {
    /// Of an image's samples, captured and seen by look number `look`.
    pub fn new(
        image: &DepthImage,
        camera: &Pinhole,
        triangles: Vec<u32>,
        look: u32,
        deforming: &Deforming<'_>,
    ) -> Record {
        let points = points_of(image, camera, &triangles, deforming);
        let samples = image.mask.occupied().enumerate().zip(triangles).map(|((index, (x, y)), triangle)| {
            let ray_eye = camera.ray_eye_from_image(f64::from(x) + 0.5, f64::from(y) + 0.5);
            let ray_world = camera.world_from_eye.transform_vector(ray_eye).as_vec3();
            let facing = image.normal_at(index).dot(ray_world);
            let w = image.depth_scale.w(image.depth[index]);
            let density = density(camera.focal_px as f32, w, facing);
            Sample { density, w, triangle }
        });
        let (mask, samples, ranks) = (image.mask.clone(), samples.collect::<Vec<_>>(), Ranks::new(&image.mask));
        let uses = vec![Use { seen: look, trimmed: 0, extent: 0 }; samples.len()];
        let captured = Arc::new(CapturedSamples { mask, ranks, samples, points });
        Record { added: look, w_step: image.depth_scale.w_step, captured, uses }
    }

    /// Memory that a copy of it takes.
    pub fn copied_bytes(&self) -> usize {
        size_of_val(&self.uses[..])
    }

    /// Memory that all copies of it share, nearly.
    pub fn shared_bytes(&self) -> usize {
        let CapturedSamples { mask: _, ranks: _, samples, points } = &*self.captured;
        size_of_val(&samples[..]) + size_of_val(&points[..])
    }

    /// The places whose points of deforming objects are no longer where they were captured, row by row; deleted samples among them.
    pub fn moved(&self, deforming: &Deforming<'_>) -> impl Iterator<Item = (u16, u16)> {
        self.captured.points.iter().filter(|(_, point)| point.has_moved(deforming)).map(|(at, _)| *at)
    }

    fn rank(&self, x: u16, y: u16) -> Option<usize> {
        self.captured.ranks.of(&self.captured.mask, x, y)
    }

    pub fn sample(&self, x: u16, y: u16) -> Option<&Sample> {
        self.rank(x, y).map(|rank| &self.captured.samples[rank])
    }

    /// Which pixels were captured; in the order of [`Record::samples`].
    pub fn mask(&self) -> &Mask {
        &self.captured.mask
    }

    /// Every sample that was captured, row by row.
    pub fn samples(&self) -> &[Sample] {
        &self.captured.samples
    }

    /// The last look that showed each of them.
    pub fn last_looks(&self) -> impl Iterator<Item = u32> {
        self.uses.iter().map(|sample| sample.seen)
    }

    /// Looks that showed the samples too, by the order of [`Record::samples`].
    pub fn seen_too(&mut self, looks: &[u32]) {
        self.uses.iter_mut().zip(looks).for_each(|(sample, &look)| sample.seen = sample.seen.max(look));
    }

    fn use_mut(&mut self, x: u16, y: u16) -> Option<&mut Use> {
        self.rank(x, y).map(|rank| &mut self.uses[rank])
    }

    pub fn captured(&self, x: u16, y: u16) -> Option<Captured> {
        let captured =
            |sample: &Sample| Captured { triangle: sample.triangle, w_step: self.w_step, density: sample.density };
        self.sample(x, y).map(captured)
    }

    pub fn w(&self, x: u16, y: u16) -> Option<f32> {
        self.sample(x, y).map(|sample| sample.w)
    }

    pub fn triangle(&self, x: u16, y: u16) -> Option<u32> {
        self.sample(x, y).map(|sample| sample.triangle)
    }

    pub fn seen(&self, x: u16, y: u16) -> Option<u32> {
        self.rank(x, y).map(|rank| self.uses[rank].seen)
    }

    pub fn see(&mut self, x: u16, y: u16, look: u32) {
        if let Some(of_sample) = self.use_mut(x, y) {
            of_sample.seen = look;
        }
    }

    /// No sample was ever shown.
    pub fn forget_seen(&mut self) {
        self.uses.iter_mut().for_each(|of_sample| of_sample.seen = 0);
    }

    /// Halves an extent, once a look; the new extent's code, or `None` where it stays as it is.
    pub fn trim(&mut self, x: u16, y: u16, look: u32) -> Option<u8> {
        let of_sample = self.use_mut(x, y)?;
        if of_sample.extent == Edit::MAX_TRIM || of_sample.trimmed == look {
            return None;
        }
        of_sample.extent += 1;
        of_sample.trimmed = look;
        Some(of_sample.extent)
    }
}

fn points_of(
    image: &DepthImage,
    camera: &Pinhole,
    triangles: &[u32],
    deforming: &Deforming<'_>,
) -> Vec<((u16, u16), SurfacePoint)> {
    if deforming.is_empty() {
        return Vec::new();
    }
    let samples = image.mask.occupied().enumerate().zip(triangles);
    let point = |((index, (x, y)), &triangle): ((usize, (u32, u32)), &u32)| {
        let w = f64::from(image.depth_scale.w(image.depth[index]));
        let place = ImagePoint { u: f64::from(x) + 0.5, v: f64::from(y) + 0.5, w };
        let footprint_m = 1.0 / (w * camera.focal_px);
        let of = (image.object[index], triangle);
        let point = SurfacePoint::nearest(deforming, of, camera.world_from_image(place), footprint_m)?;
        Some(((x as u16, y as u16), point))
    };
    samples.filter_map(point).collect()
}
