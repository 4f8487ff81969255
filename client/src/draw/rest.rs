//! What a viewer who stands still sees, pixel by pixel: rows of his own view, which a server sends as patches of [`Purpose::Rest`].
//!
//! As long as a frame's camera is the very one that the rows were captured by, they take the place of whatever surfaces are rebuilt from
//! other samples, before light; once all rows are there, no surface is drawn at all. So what is seen at rest is the scene, to the rounding of
//! its planes, and a frame costs light alone.

use camera::Pinhole;
use glam::Vec3;
use gpu::Gpu;
use protocol::image::octahedral;
use protocol::{DepthImage, Held, Patch, PatchId, Purpose, Update};
use surface::GBuffer;
use wgpu::{Extent3d, TextureFormat, TextureUsages};

use crate::draw::fullscreen;
use crate::receive::follow::Follow;

/// Focal lengths and principal points that differ by less than this are the same, in pixels: f64 keeps them to 1e-12, and what
/// 1e-6 shifts nobody sees.
const SAME_PX: f64 = 1e-6;

/// See the module.
#[derive(Debug)]
pub struct RestView {
    gpu: Gpu,
    rows: Vec<Rows>,
    revision: u64,
}

/// Rows of a view, on the GPU.
#[derive(Debug)]
struct Rows {
    id: PatchId,
    camera: Pinhole,
    /// Of the formats of [`GBuffer::colour`], whose alpha is the share of the pixel that is covered, [`GBuffer::normal_ids`] and
    /// [`GBuffer::w`].
    planes: [wgpu::Texture; 3],
    /// Whether some samples cover a part of their pixels.
    has_shares: bool,
}

/// The rows that a camera sees.
#[derive(Debug, Default)]
pub(crate) struct RowsOf<'a> {
    rows: Vec<Placed<'a>>,
    height_px: u32,
}

/// Rows in a camera's image.
#[derive(Debug)]
struct Placed<'a> {
    rows: &'a Rows,
    first_row: u32,
    /// How many others of the same rows came before: what covers the most of each pixel comes first.
    layer: usize,
}

impl RestView {
    /// Holds nothing yet.
    pub fn new(gpu: &Gpu) -> RestView {
        RestView { gpu: gpu.clone(), rows: Vec::new(), revision: 0 }
    }

    /// A number that grows with every change.
    pub fn revision(&self) -> u64 {
        self.revision
    }

    /// Takes in everything held, on a device that has none of it yet.
    pub fn rebuild(&mut self, held: &Held) {
        self.rows.clear();
        self.take_in(held);
    }

    /// Whether all that a camera sees is here.
    pub fn shows_all_of(&self, camera: &Pinhole) -> bool {
        self.rows_of(camera).are_all()
    }

    pub(crate) fn rows_of(&self, camera: &Pinhole) -> RowsOf<'_> {
        let mut placed: Vec<Placed<'_>> = Vec::new();
        for rows in &self.rows {
            if let Some(first_row) = rows.first_row_in(camera) {
                let layer = placed.iter().filter(|before| before.first_row == first_row).count();
                placed.push(Placed { rows, first_row, layer });
            }
        }
        RowsOf { rows: placed, height_px: camera.height_px }
    }

    fn take_in(&mut self, held: &Held) {
        let known = self.rows.len();
        self.rows.retain(|rows| held.patches.contains_key(&rows.id));
        let mut changed = self.rows.len() != known;
        let newest = self.rows.last().map(|rows| rows.id);
        // Ids ascend.
        for held in held.patches.values().filter(|held| held.patch.purpose == Purpose::Rest) {
            if newest.is_none_or(|newest| held.patch.id > newest) {
                self.rows.extend(Rows::new(&self.gpu, &held.patch));
                changed = true;
            }
        }
        self.revision += u64::from(changed);
    }
}

impl Follow for RestView {
    fn follow(&mut self, held: &Held, _: &Update, anew: bool) {
        if anew { self.rebuild(held) } else { self.take_in(held) }
    }
}

impl Rows {
    /// `None` of what no pinhole captured, or is larger than the GPU takes.
    fn new(gpu: &Gpu, patch: &Patch) -> Option<Rows> {
        let image = &patch.image;
        let camera = *image.camera.pinhole()?;
        let limit_px = gpu.device.limits().max_texture_dimension_2d;
        if camera.width_px.max(camera.height_px) > limit_px {
            return None;
        }
        let size = Extent3d { width: camera.width_px, height: camera.height_px, depth_or_array_layers: 1 };
        let Texels { colour, normal_ids, w } = Texels::of(image);
        let planes: [(TextureFormat, &[u8]); 3] = [
            (GBuffer::COLOUR, bytemuck::cast_slice(&colour)),
            (GBuffer::NORMAL_IDS, bytemuck::cast_slice(&normal_ids)),
            (GBuffer::W, bytemuck::cast_slice(&w)),
        ];
        let planes = planes.map(|(format, texels)| texture(gpu, size, format, texels));
        Some(Rows { id: patch.id, camera, planes, has_shares: !image.share.is_empty() })
    }

    /// Where these rows begin in a camera's image; `None` where they are of another view.
    fn first_row_in(&self, camera: &Pinhole) -> Option<u32> {
        let Pinhole { world_from_eye, width_px, height_px, focal_px, centre_px, near_m: _ } = self.camera;
        let same = |a: f64, b: f64| (a - b).abs() < SAME_PX;
        let row = camera.centre_px.y - centre_px.y;
        let is_same = world_from_eye == camera.world_from_eye
            && width_px == camera.width_px
            && same(focal_px, camera.focal_px)
            && same(centre_px.x, camera.centre_px.x)
            && same(row, row.round());
        let inside = row.round() >= 0.0 && row.round() + f64::from(height_px) <= f64::from(camera.height_px);
        (is_same && inside).then_some(row.round() as u32)
    }
}

impl RowsOf<'_> {
    /// Whether no row of the camera's is missing.
    pub(crate) fn are_all(&self) -> bool {
        let mut rows: Vec<(u32, u32)> = self
            .rows
            .iter()
            .map(|placed| (placed.first_row, placed.first_row + placed.rows.camera.height_px))
            .collect();
        rows.sort_unstable();
        let seamless = rows.iter().fold(0, |end, &(first, last)| if first <= end { end.max(last) } else { end });
        !rows.is_empty() && seamless >= self.height_px
    }

    /// How many images show pixels in parts; 0 where every pixel is whole, or rows are missing.
    pub(crate) fn parts(&self) -> usize {
        let in_parts = self.are_all() && self.rows.iter().any(|placed| placed.rows.has_shares);
        let layers = self.rows.iter().map(|placed| placed.layer + 1).max().unwrap_or(0);
        if in_parts { layers } else { 0 }
    }

    /// Copies a layer of them over what was drawn, but for its depth test. Layers but the first are not everywhere: nothing is beside them.
    pub(crate) fn encode(&self, encoder: &mut wgpu::CommandEncoder, target: &GBuffer, layer: usize) {
        if layer > 0 {
            drop(fullscreen::begin(encoder, "no parts", true, &[&target.views.colour], None));
        }
        for placed in self.rows.iter().filter(|placed| placed.layer == layer) {
            let targets = [&target.colour, &target.normal_ids, &target.w];
            for (plane, target) in placed.rows.planes.iter().zip(targets) {
                let origin = wgpu::Origin3d { x: 0, y: placed.first_row, z: 0 };
                let to = wgpu::TexelCopyTextureInfo { origin, ..target.as_image_copy() };
                encoder.copy_texture_to_texture(plane.as_image_copy(), to, plane.size());
            }
        }
    }
}

/// The texels of a [`GBuffer`], row by row; zero where there is no sample.
struct Texels {
    colour: Vec<[u8; 4]>,
    normal_ids: Vec<[u32; 2]>,
    w: Vec<f32>,
}

impl Texels {
    fn of(image: &DepthImage) -> Texels {
        let (width, height) = image.mask.size_px();
        let pixels = width as usize * height as usize;
        let mut texels =
            Texels { colour: vec![[0; 4]; pixels], normal_ids: vec![[0; 2]; pixels], w: vec![0.0; pixels] };
        for (index, (x, y)) in image.mask.occupied().enumerate() {
            let at = y as usize * width as usize + x as usize;
            let [red, green, blue] = image.colour[index];
            let share = image.share.get(index).map_or(u8::MAX, |&share| of_255(share));
            texels.colour[at] = [red, green, blue, share];
            let rest = image.colour_rest.get(index).copied().unwrap_or(0);
            let ids = u32::from(image.object[index]) | u32::from(image.material[index]) << 16 | u32::from(rest) << 24;
            texels.normal_ids[at] = [pack_normal(image.normal_at(index)), ids];
            texels.w[at] = image.depth_scale.w(image.depth[index]);
        }
        texels
    }
}

/// A share in 255ths.
fn of_255(share: u8) -> u8 {
    let whole = u16::from(DepthImage::WHOLE);
    ((u16::from(share) * u16::from(u8::MAX) + whole / 2) / whole).min(u16::from(u8::MAX)) as u8
}

/// The twin of `octahedral_code_fine` in `common/octahedral.wgsl`: two signed numbers of 16 bits.
fn pack_normal(normal: Vec3) -> u32 {
    let snorm = |value: f32| (value.clamp(-1.0, 1.0) * 32767.0).round() as i16 as u16;
    let p = octahedral(normal);
    u32::from(snorm(p.x)) | u32::from(snorm(p.y)) << 16
}

fn texture(gpu: &Gpu, size: Extent3d, format: TextureFormat, texels: &[u8]) -> wgpu::Texture {
    let texture = gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: Some("rows of a view at rest"),
        size,
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: TextureUsages::COPY_SRC | TextureUsages::COPY_DST,
        view_formats: &[],
    });
    let bytes_per_row = texels.len() as u32 / size.height;
    let layout = wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(bytes_per_row), rows_per_image: None };
    gpu.queue.write_texture(texture.as_image_copy(), texels, layout, size);
    texture
}
