use ::camera::{Bounds, Camera, ImagePoint};
use glam::{DVec2, DVec3};
use thiserror::Error;

use crate::camera::Around;
use crate::pyramid::{Pyramid, Range};

/// What a pixel's centre shows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample {
    /// Inverse depth in the camera's own measure; 0 where nothing is shown.
    pub w: f64,
    /// The surface's normal in world space, of any length and to either side. Zero where it is not known: then the surface
    /// is taken to lie across, all of the pixel at one `w`.
    pub normal_world: DVec3,
}

impl Sample {
    /// Of a pixel that shows nothing.
    pub const EMPTY: Sample = Sample { w: 0.0, normal_world: DVec3::ZERO };
}

/// Why samples make no impostor.
#[derive(Debug, Error, Clone, Copy, PartialEq, Eq)]
pub enum ImpostorError {
    /// Not one sample for each pixel of the camera's image, or no pixel at all.
    #[error("{samples} samples do not fill an image of {width_px} x {height_px} pixels")]
    Size {
        /// How many there are.
        samples: usize,
        /// The image's width.
        width_px: u32,
        /// The image's height.
        height_px: u32,
    },
}

/// A depth image that rays are intersected with.
///
/// **Planes.** A sample stands for a piece of plane: through its point, across its normal, as wide as its pixel. Within the pixel
/// `w` is linear in the image: exactly so for pinholes and frusta, to first order for the single-pole camera. A plane so
/// steep that its depth would double on the way to a corner is taken less steep: of such a surface the pixel tells no more.
///
/// **Discontinuities.** Two pixels show one surface, and what is between is part of it, if `w` rises from one centre to the other
/// by no less than the one plane and no more than the other one says: a surface that bends one way, or has one crease,
/// has a slope between theirs on the way (by the mean value theorem). Gaps of up to a footprint are closed too: a step in depth
/// smaller than a pixel is wide is not told from a surface by its samples.
#[derive(Debug, Clone)]
pub struct Impostor {
    camera: Camera,
    width: usize,
    height: usize,
    texels: Vec<Texel>,
    pyramid: Pyramid,
    bounds: Option<Bounds>,
}

/// The piece of plane of a pixel; `w` is 0 where there is none.
#[derive(Debug, Clone, Copy)]
struct Texel {
    w: f64,
    /// How `w` changes on the plane per pixel along u and v.
    slope_per_px: DVec2,
    /// A pixel's width in depth, at this depth.
    footprint_w: f64,
    shape: SampleShape,
}

/// How a sample lies before its camera.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct SampleShape {
    /// How wide a pixel is at its depth, metres; 0 where nothing is held.
    pub footprint_m: f64,
    /// The sine of the angle between the camera's ray and the surface: 1 for one that lies across, 0 for one that the ray grazes.
    pub facing: f64,
}

/// The place of a pixel that holds a sample.
pub(crate) type TexelId = usize;

impl Impostor {
    /// An impostor of samples row by row from the top left, one for each pixel. A sample that is not finite, or that the camera
    /// cannot unproject, is empty.
    ///
    /// # Errors
    /// [`ImpostorError::Size`] where there is not one for each pixel.
    pub fn new(camera: Camera, samples: &[Sample]) -> Result<Impostor, ImpostorError> {
        let (width_px, height_px) = camera.size_px();
        let (width, height) = (width_px as usize, height_px as usize);
        if samples.is_empty() || width.checked_mul(height) != Some(samples.len()) {
            return Err(ImpostorError::Size { samples: samples.len(), width_px, height_px });
        }
        let mut bounds: Option<Bounds> = None;
        let texel = |(place, sample): (usize, &Sample)| {
            let Some((texel, its_bounds)) = Texel::new(&camera, centre_px(place, width), sample) else {
                return Texel::EMPTY;
            };
            bounds = Some(bounds.map_or(its_bounds, |bounds| bounds.union(its_bounds)));
            texel
        };
        let texels: Vec<Texel> = samples.iter().enumerate().map(texel).collect();
        let pyramid = Pyramid::new(width, height, texels.iter().map(Texel::range).collect());
        Ok(Impostor { camera, width, height, texels, pyramid, bounds })
    }

    /// The camera that it was taken by.
    pub fn camera(&self) -> &Camera {
        &self.camera
    }

    /// A box around all that its samples stand for, and a footprint more; `None` of an empty impostor.
    pub fn bounds_world(&self) -> Option<Bounds> {
        self.bounds
    }

    /// How the samples lie before their camera, row by row.
    pub fn sample_shapes(&self) -> impl ExactSizeIterator<Item = SampleShape> {
        self.texels.iter().map(|texel| texel.shape)
    }

    pub(crate) fn size_px(&self) -> DVec2 {
        DVec2::new(self.width as f64, self.height as f64)
    }

    pub(crate) fn pyramid(&self) -> &Pyramid {
        &self.pyramid
    }

    /// A pixel's `w`, its slopes per pixel along u and v, and a footprint in `w`; all zero where it holds nothing.
    pub(crate) fn plane(&self, texel: TexelId) -> [f64; 4] {
        let Texel { w, slope_per_px, footprint_w, .. } = self.texels[texel];
        [w, slope_per_px.x, slope_per_px.y, footprint_w]
    }

    /// Column and row of a pixel.
    pub(crate) fn pixel(&self, texel: TexelId) -> (u32, u32) {
        ((texel % self.width) as u32, (texel / self.width) as u32)
    }

    /// The pixel at a place in the image, if it holds a sample.
    pub(crate) fn texel_at(&self, px: DVec2) -> Option<TexelId> {
        let is_inside = px.cmpge(DVec2::ZERO).all() && px.cmplt(self.size_px()).all();
        let place = || px.y as usize * self.width + px.x as usize;
        is_inside.then(place).filter(|&place| self.texels[place].w > 0.0)
    }

    /// By how much the inverse depth of a point is greater than that of a pixel's plane there: positive before the surface.
    pub(crate) fn ahead_w(&self, texel: TexelId, point: ImagePoint) -> f64 {
        let Texel { w, slope_per_px, .. } = self.texels[texel];
        point.w - (w + slope_per_px.dot(DVec2::new(point.u, point.v) - centre_px(texel, self.width)))
    }

    /// What a pixel's plane spans in depth, and a footprint more.
    pub(crate) fn range(&self, texel: TexelId) -> Range {
        self.texels[texel].range()
    }

    /// Whether two pixels show one surface; see the type's words.
    pub(crate) fn is_one_surface(&self, a: TexelId, b: TexelId) -> bool {
        let way_px = centre_px(b, self.width) - centre_px(a, self.width);
        let (a, b) = (&self.texels[a], &self.texels[b]);
        let (by_a, by_b) = (a.slope_per_px.dot(way_px), b.slope_per_px.dot(way_px));
        let gap_w = a.footprint_w.max(b.footprint_w);
        (by_a.min(by_b) - gap_w..=by_a.max(by_b) + gap_w).contains(&(b.w - a.w))
    }
}

fn centre_px(place: usize, width: usize) -> DVec2 {
    DVec2::new((place % width) as f64 + 0.5, (place / width) as f64 + 0.5)
}

impl Texel {
    const EMPTY: Texel = Texel {
        w: 0.0,
        slope_per_px: DVec2::ZERO,
        footprint_w: 0.0,
        shape: SampleShape { footprint_m: 0.0, facing: 0.0 },
    };

    /// A sample's plane, and a box around its part in the pixel.
    fn new(camera: &Camera, centre_px: DVec2, sample: &Sample) -> Option<(Texel, Bounds)> {
        let point = |px: DVec2, w: f64| ImagePoint { u: px.x, v: px.y, w };
        let w = sample.w;
        if !(w > 0.0 && w.is_finite() && sample.normal_world.is_finite()) {
            return None;
        }
        let around = Around::new(camera, point(centre_px, w))?;
        let per_px = |axis: DVec2| {
            let world = |px| around.world_from_image(point(px, w));
            world(centre_px + axis / 2.0) - world(centre_px - axis / 2.0)
        };
        let (per_u, per_v) = (per_px(DVec2::X), per_px(DVec2::Y));
        let footprint_m = per_u.length().max(per_v.length());
        // Of `z = 1/w`, as points of a pinhole's ray are linear in it.
        let z = 1.0 / w;
        let half_z = z.min(footprint_m) / 2.0;
        let at_z = |z: f64| around.world_from_image(point(centre_px, 1.0 / z));
        let per_z = (at_z(z + half_z) - at_z(z - half_z)) / (2.0 * half_z);
        let footprint_w = w - 1.0 / (z + footprint_m / per_z.length());
        let normal = sample.normal_world;
        // On the plane `n.(per_u du + per_z dz) = 0`, and `dw = -w^2 dz`.
        let slope_per_px = DVec2::new(normal.dot(per_u), normal.dot(per_v)) * (w * w / normal.dot(per_z));
        let span_w = slope_per_px.abs().element_sum();
        let slope_per_px = slope_per_px * (w / span_w).min(1.0);
        let slope_per_px = if slope_per_px.is_finite() { slope_per_px } else { DVec2::ZERO };
        // Not known where there is no normal: then it lies across.
        let facing = (normal.dot(per_z) / (normal.length() * per_z.length())).abs();
        let shape = SampleShape { footprint_m, facing: if facing.is_finite() { facing } else { 1.0 } };
        let texel = Texel { w, slope_per_px, footprint_w, shape };
        let bounds = texel.bounds(&around, centre_px, footprint_m)?;
        footprint_w.is_finite().then_some((texel, bounds))
    }

    fn bounds(&self, around: &Around<'_>, centre_px: DVec2, footprint_m: f64) -> Option<Bounds> {
        let corner = |offset_px: DVec2| {
            let px = centre_px + offset_px;
            around.world_from_image(ImagePoint { u: px.x, v: px.y, w: self.w + self.slope_per_px.dot(offset_px) })
        };
        let corners = [(-0.5, -0.5), (0.5, -0.5), (-0.5, 0.5), (0.5, 0.5)].map(|offset_px| corner(offset_px.into()));
        let Bounds { min, max } = Bounds::around(corners)?;
        let bounds = Bounds { min: min - footprint_m, max: max + footprint_m };
        (bounds.min.is_finite() && bounds.max.is_finite()).then_some(bounds)
    }

    fn range(&self) -> Range {
        if self.w <= 0.0 {
            return Range::EMPTY;
        }
        let half_w = self.slope_per_px.abs().element_sum() / 2.0 + self.footprint_w;
        Range { min: self.w - half_w, max: self.w + half_w }
    }
}

#[cfg(test)]
mod tests {
    use ::camera::{Pinhole, Rigid};

    use super::*;

    /// Whether two pixels beside each other, at depths in metres and with normals in eye space, show one surface. A pixel is
    /// 0.01 wide at a depth of 1.
    fn is_one_surface(a: (f64, DVec3), b: (f64, DVec3)) -> bool {
        let camera = Pinhole { focal_px: 100.0, ..Pinhole::symmetric(Rigid::IDENTITY, (2, 1), 1.0, 0.1) };
        let samples = [a, b].map(|(z_m, normal_world)| Sample { w: 1.0 / z_m, normal_world });
        let impostor = Impostor::new(Camera::Pinhole(camera), &samples).expect("two samples");
        assert_eq!(impostor.is_one_surface(0, 1), impostor.is_one_surface(1, 0));
        impostor.is_one_surface(0, 1)
    }

    #[test]
    fn a_step_of_less_than_a_footprint_is_one_surface_and_a_larger_one_is_not() {
        let across = DVec3::NEG_Z;
        assert!(is_one_surface((1.0, across), (1.009, across)));
        assert!(is_one_surface((1.009, across), (1.0, across)));
        assert!(!is_one_surface((1.0, across), (1.011, across)));
        assert!(!is_one_surface((1.011, across), (1.0, across)));
    }

    #[test]
    fn a_steep_plane_and_a_crease_are_one_surface() {
        // The plane falls away by 0.05 from one pixel to the next, to the right.
        let steep = DVec3::new(5.0, 0.0, -1.0);
        assert!(is_one_surface((1.0, steep), (1.0525, steep)));
        assert!(!is_one_surface((1.0, DVec3::NEG_Z), (1.0525, DVec3::NEG_Z)), "flat ones are not");
        assert!(is_one_surface((1.0, steep), (1.03, DVec3::NEG_Z)), "a crease between them");
        assert!(!is_one_surface((1.0, steep), (1.1, DVec3::NEG_Z)), "further than it falls");
        assert!(!is_one_surface((1.0, steep), (0.97, DVec3::NEG_Z)), "the wrong way");
    }

    #[test]
    fn a_plane_seen_edge_on_stays_near_its_sample() {
        let camera = Pinhole { focal_px: 100.0, ..Pinhole::symmetric(Rigid::IDENTITY, (1, 1), 1.0, 0.1) };
        for normal_world in [DVec3::X, DVec3::new(1e9, 1.0, -1.0), DVec3::new(1.0, 1.0, 1e-300)] {
            let sample = Sample { w: 0.5, normal_world };
            let impostor = Impostor::new(Camera::Pinhole(camera), &[sample]).expect("one sample");
            let bounds = impostor.bounds_world().expect("a sample");
            assert!(bounds.min.z > 1.0 && bounds.max.z < 4.1 && bounds.max.x < 0.1, "{bounds:?}");
        }
    }
}
