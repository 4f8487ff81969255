//! What the shaders of `impostor/` read of an impostor: a uniform, and the texels of three textures.

use ::camera::Camera;
use bytemuck::{Pod, Zeroable};
use glam::DVec3;

use crate::image::Impostor;

/// `Impostor` of `impostor/image.wgsl`. The camera's own uniform comes beside it.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub struct ImpostorUniform {
    /// Metres, world axes, relative to the anchor.
    pub bounds_min_anchor: [f32; 3],
    /// The range of inverse depths of the whole image.
    pub w_min: f32,
    /// Metres, world axes, relative to the anchor.
    pub bounds_max_anchor: [f32; 3],
    /// The range of inverse depths of the whole image.
    pub w_max: f32,
    /// Pixels.
    pub size_px: [f32; 2],
    /// An upper bound of a fine step's length in pixels, at most 1.
    pub fine_px: f32,
    /// The coarsest level of the ranges.
    pub top_level: u32,
    /// What points are pushed away from.
    pub pole_px: [f32; 2],
    /// Inverse depth where the push begins.
    pub push_from_w: f32,
    /// Inverse depth where it ends.
    pub push_to_w: f32,
    /// How far the deepest points are pushed; 0 for a camera without a pole.
    pub push_max_px: f32,
    /// How far from the pole the push has its full length.
    pub ramp_px: f32,
    /// Unused.
    pub padding: [f32; 2],
}

/// The texels of a texture of two f32 channels: the least and the greatest inverse depth of every pixel and of every block of 2x2, 4x4
/// and so on; where one holds nothing, the greatest number and the least. The pixels are a square on the left, its side a power of
/// two; the blocks of every further level stand below those of the one before, from the top right on.
#[derive(Debug, Clone, PartialEq)]
pub struct RangeTexels {
    /// Texels in a row: one and a half times the side.
    pub width: u32,
    /// Rows: the side.
    pub height: u32,
    /// Row by row.
    pub ranges: Vec<[f32; 2]>,
}

/// How wide a row of the texture of frusta is.
pub const FRUSTUM_TEXELS: usize = 40;

/// The first texels of a row: three columns of a matrix, and the centre.
const BEFORE_PLANES: usize = 4;

impl Impostor {
    /// The uniform, relative to `anchor_world`; `None` of an empty impostor, which no ray meets.
    pub fn uniform(&self, anchor_world: DVec3, fine_px: f64) -> Option<ImpostorUniform> {
        let bounds = self.bounds_world()?;
        let range = self.pyramid().whole();
        let size_px = self.size_px();
        let without_pole = ImpostorUniform {
            bounds_min_anchor: (bounds.min - anchor_world).to_array().map(below),
            w_min: below(range.min),
            bounds_max_anchor: (bounds.max - anchor_world).to_array().map(above),
            w_max: above(range.max),
            size_px: size_px.as_vec2().to_array(),
            // As `Walk::new` has it.
            fine_px: 1.0_f64.min(fine_px).max(1.0 / 256.0) as f32,
            top_level: self.pyramid().levels() as u32 - 1,
            pole_px: (size_px / 2.0).as_vec2().to_array(),
            push_from_w: 1.0,
            push_to_w: 0.0,
            push_max_px: 0.0,
            ramp_px: 1.0,
            padding: [0.0; 2],
        };
        let Camera::Spoc(camera) = self.camera() else { return Some(without_pole) };
        Some(ImpostorUniform {
            pole_px: camera.pole_px.as_vec2().to_array(),
            push_from_w: camera.push_from_m.recip() as f32,
            push_to_w: camera.push_to_m.recip() as f32,
            push_max_px: camera.push_max_px as f32,
            ramp_px: camera.ramp_px as f32,
            ..without_pole
        })
    }

    /// The texels of a texture of four f32 channels, row by row: `w`, its slopes per pixel along u and v, and a footprint in `w`;
    /// all zero where a pixel holds nothing.
    pub fn plane_texels(&self) -> Vec<[f32; 4]> {
        let (width, height) = self.camera().size_px();
        (0..width as usize * height as usize).map(|texel| self.plane(texel).map(|value| value as f32)).collect()
    }

    /// The ranges of inverse depths, rounded outwards: what meets nothing here meets nothing in f64.
    pub fn range_texels(&self) -> RangeTexels {
        let (width, height) = self.camera().size_px();
        let side = width.max(height).next_power_of_two() as usize;
        let row_texels = side + side.div_ceil(2);
        let mut ranges = vec![[f32::MAX, f32::MIN]; row_texels * side];
        for level in 0..self.pyramid().levels() {
            let (left, top) = if level == 0 { (0, 0) } else { (side, side - (side >> (level - 1))) };
            for (y, x) in (0..side >> level).flat_map(|y| (0..side >> level).map(move |x| (y, x))) {
                let range = self.pyramid().block(level, x, y);
                if range.min <= range.max {
                    ranges[(top + y) * row_texels + left + x] = [below(range.min), above(range.max)];
                }
            }
        }
        RangeTexels { width: row_texels as u32, height: side as u32, ranges }
    }

    /// The texels of a texture of four f32 channels, one row of [`FRUSTUM_TEXELS`] for each frustum of a graph camera, relative to
    /// `anchor_world`; `impostor/graph.wgsl` says what is where. `None` where the camera has no frusta, or one of them has more planes than
    /// a row has room for.
    pub fn frustum_texels(&self, anchor_world: DVec3) -> Option<Vec<[f32; 4]>> {
        let Camera::Graph(camera) = self.camera() else { return None };
        let mut texels = Vec::with_capacity(camera.frusta().len() * FRUSTUM_TEXELS);
        for frustum in camera.frusta() {
            let planes = frustum.half_spaces_world();
            if planes.len() > FRUSTUM_TEXELS - BEFORE_PLANES {
                return None;
            }
            let (projection, centre) = (frustum.clip_from_offset(), frustum.centre_world());
            let columns = [projection.matrix.x_axis, projection.matrix.y_axis, projection.matrix.z_axis];
            texels.extend([
                columns[0].extend(planes.len() as f32).to_array(),
                columns[1].extend(0.0).to_array(),
                columns[2].extend(0.0).to_array(),
                (centre - anchor_world).as_vec3().extend(projection.w_scale as f32).to_array(),
            ]);
            let plane = |plane: &::camera::HalfSpace| plane.outward.extend(plane.depth_m(centre)).as_vec4().to_array();
            texels.extend(planes.iter().map(plane));
            texels.resize(texels.len().next_multiple_of(FRUSTUM_TEXELS), [0.0; 4]);
        }
        Some(texels)
    }
}

/// The greatest f32 that is no greater.
fn below(value: f64) -> f32 {
    let rounded = value as f32;
    if f64::from(rounded) > value { rounded.next_down() } else { rounded }
}

/// The least f32 that is no less.
fn above(value: f64) -> f32 {
    -below(-value)
}

#[cfg(test)]
mod tests {
    use ::camera::{Pinhole, Rigid};

    use super::*;
    use crate::Sample;

    #[test]
    fn the_uniform_is_laid_out_as_in_wgsl() {
        shaders::assert_layout!(
            ImpostorUniform,
            "impostor/image.wgsl",
            "Impostor",
            bounds_min_anchor,
            w_min,
            bounds_max_anchor,
            w_max,
            size_px,
            fine_px,
            top_level,
            pole_px,
            push_from_w,
            push_to_w,
            push_max_px,
            ramp_px
        );
    }

    #[test]
    fn a_row_of_frusta_has_room_for_as_many_planes_as_the_shader_reads() {
        let text = shaders::source("impostor/graph.wgsl").expect("it is there");
        assert!(text.contains(&format!("FRUSTUM_PLANES_AT = {BEFORE_PLANES};")));
        assert!(text.contains(&format!("FRUSTUM_PLANE_CAP = {};", FRUSTUM_TEXELS - BEFORE_PLANES)));
    }

    #[test]
    fn ranges_stand_beside_the_pixels_down_to_one_block_that_holds_the_whole() {
        let camera = Pinhole::symmetric(Rigid::IDENTITY, (5, 3), 1.0, 0.1);
        let sample =
            |place: u32| Sample { w: 0.1 + f64::from(place % 4) / 7.0, normal_world: DVec3::new(0.1, 0.2, -1.0) };
        let samples: Vec<Sample> = (0..15).map(sample).collect();
        let impostor = Impostor::new(Camera::Pinhole(camera), &samples).expect("15 samples");
        let texels = impostor.range_texels();
        let at = |x: usize, y: usize| texels.ranges[y * 12 + x];
        assert_eq!((texels.width, texels.height, texels.ranges.len()), (12, 8, 96));
        let (whole, uniform) = (impostor.pyramid().whole(), impostor.uniform(DVec3::ZERO, 0.5).expect("samples"));
        assert!(f64::from(uniform.w_min) <= whole.min && f64::from(uniform.w_max) >= whole.max);
        assert_eq!((uniform.top_level, uniform.fine_px), (3, 0.5));
        // A row of pixels, blocks of 2x2 from the top right on, of 4x4 below, and the one of all.
        assert_eq!([at(5, 0), at(0, 3), at(11, 0)], [[f32::MAX, f32::MIN]; 3]);
        let union = |blocks: [[f32; 2]; 4]| blocks.into_iter().reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])]);
        assert_eq!(union([at(0, 0), at(1, 0), at(0, 1), at(1, 1)]), Some(at(8, 0)));
        assert_eq!(union([at(8, 0), at(9, 0), at(8, 1), at(9, 1)]), Some(at(8, 4)));
        assert_eq!(
            (union([at(8, 4), at(9, 4), at(8, 5), at(9, 5)]), at(8, 6)),
            (Some(at(8, 6)), [uniform.w_min, uniform.w_max])
        );
        assert_eq!((impostor.plane_texels().len(), impostor.frustum_texels(DVec3::ZERO)), (15, None));
    }
}
