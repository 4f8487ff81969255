use camera::Camera;
use glam::DVec3;
use impostor::Sample;
use protocol::image::octahedral_normal_with_rest;
use protocol::{DepthImage, Mask};

use crate::discretize::{DepthPrecision, Planes, normal_code, object};

/// One image of any camera as it comes from the GPU: planes of a value a pixel, row-major.
/// [`crate::discretize::Capture`] is its like for sets of pinholes.
#[derive(Debug, Clone, PartialEq)]
pub struct ImpostorCapture {
    /// What captured it.
    pub camera: Camera,
    /// Triangle id (0 where there is no sample); object id (low 16 bits) and octahedral normal (high 16 bits).
    pub ids: Vec<[u32; 2]>,
    /// sRGB-encoded base colour, and the material code as alpha.
    pub colour: Vec<[u8; 4]>,
    /// What the codes of normals leave off, of samples that reflect, else 0; and of colours, 0.
    pub rests: Vec<[u8; 2]>,
    /// Inverse depth in the camera's own measure, 1/m for a pinhole and a single-pole camera; 0 where there is no
    /// sample.
    pub w: Vec<f32>,
    /// What the GPU took for it, where it can tell.
    pub gpu_s: Option<f64>,
    /// From the call to the planes, waiting for the GPU included.
    pub wall_s: f64,
}

impl ImpostorCapture {
    /// Whether a pixel holds a sample.
    pub fn is_occupied(&self, index: usize) -> bool {
        self.ids[index][0] != 0
    }

    /// Object id at an index.
    pub fn object(&self, index: usize) -> u16 {
        object(self.ids[index])
    }

    /// Unit shading normal at an index, in world space, as exactly as its code holds it.
    pub fn normal_world(&self, index: usize) -> DVec3 {
        let normal = octahedral_normal_with_rest(normal_code(self.ids[index]), self.rests[index][0]);
        normal.as_dvec3()
    }

    /// What [`impostor::Impostor::new`] is made of, beside the camera.
    pub fn samples(&self) -> Vec<Sample> {
        let sample = |index: usize| Sample { w: self.w[index].into(), normal_world: self.normal_world(index) };
        (0..self.ids.len()).map(|index| if self.is_occupied(index) { sample(index) } else { Sample::EMPTY }).collect()
    }

    /// Which pixels hold a sample.
    pub fn mask(&self) -> Mask {
        let (width_px, height_px) = self.camera.size_px();
        let mut mask = Mask::empty(width_px, height_px);
        let pixels = (0..height_px).flat_map(|y| (0..width_px).map(move |x| (x, y)));
        for ((x, y), _) in pixels.zip(&self.ids).filter(|(_, ids)| ids[0] != 0) {
            mask.set(x, y, true);
        }
        mask
    }

    /// All samples, packed.
    pub fn depth_image(&self, precision: DepthPrecision) -> DepthImage {
        let Self { ids, colour, rests, w, .. } = self;
        let planes = Planes { ids, colour, rests, w: &|index| w[index] };
        planes.depth_image(self.camera.clone(), self.mask(), precision)
    }
}
