//! What a viewer who stands still sees, pixel by pixel: rows of his own view, which a server sends as patches of [`Purpose::Rest`].
//!
//! As long as a frame's camera is the very one that the rows were captured by, they take the place of whatever surfaces are rebuilt from
//! other samples, before light; once all rows are there, no surface is drawn at all. So what is seen at rest is the scene, to the rounding of
//! its planes, and a frame costs light alone.

use camera::Pinhole;
use gpu::Gpu;
use protocol::{Held, Patch, PatchId, Purpose, Update};
use surface::{BuiltSurfaces, GBuffer};

use crate::draw::{fullscreen, planes};
use crate::receive::follow::Follow;

/// Focal lengths and principal points that differ by less than this are the same, in pixels: f64 keeps them to 1e-12, and what
/// 1e-6 shifts nobody sees.
const SAME_PX: f64 = 1e-6;

/// See the module.
#[derive(Debug)]
pub struct RestView {
    gpu: Gpu,
    rows: Vec<Rows>,
    /// The time of a scene that changes with it: rows are of that time alone.
    scene_time_s: Option<f64>,
    revision: u64,
}

/// Rows of a view, on the GPU.
#[derive(Debug)]
struct Rows {
    id: PatchId,
    captured_at_s: f64,
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
        RestView { gpu: gpu.clone(), rows: Vec::new(), scene_time_s: None, revision: 0 }
    }

    /// A number that grows with every change.
    pub fn revision(&self) -> u64 {
        self.revision
    }

    /// Shows what was captured at a time of the scene alone from now on, where it changes with time.
    pub fn show_at(&mut self, scene_time_s: Option<f64>) {
        let before = std::mem::replace(&mut self.scene_time_s, scene_time_s);
        self.revision += u64::from(before != scene_time_s && !self.rows.is_empty());
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
        let is_of_now = |rows: &&Rows| self.scene_time_s.is_none_or(|time_s| rows.captured_at_s == time_s);
        for rows in self.rows.iter().filter(is_of_now) {
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
    fn follow(&mut self, held: &Held, _: &Update, anew: bool, _: &mut BuiltSurfaces) {
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
        let planes = planes::of(gpu, image);
        Some(Rows {
            id: patch.id,
            captured_at_s: patch.capture_time_s,
            camera,
            planes,
            has_shares: !image.share.is_empty(),
        })
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

    /// Whether they show what is blended too, as parts of pixels.
    pub(crate) fn are_in_parts(&self) -> bool {
        self.rows.iter().any(|placed| placed.rows.has_shares)
    }

    /// How many images show pixels in parts; 0 where every pixel is whole, or rows are missing.
    pub(crate) fn parts(&self) -> usize {
        let in_parts = self.are_all() && self.are_in_parts();
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
