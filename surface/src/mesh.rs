//! The quads of one patch as an indexed mesh.
//!
//! Samples of one surface share their corner vertices, so there is about one vertex a sample. What is constant over a quad
//! (colour, normal, ids) is read from its top left vertex: that vertex is shared with quads above and to the left, but is
//! the top left one of this quad alone. Both triangles therefore start (WebGPU) or end (WebGL2) with it, wherever the API
//! takes flat values from.

use bytemuck::{Pod, Zeroable};
use camera::Pinhole;
use glam::Vec3;
use protocol::held::HeldPatch;
use protocol::{DepthImage, Patch};

use crate::corners::{self, Corner, CornerRules, Corners, Plane};

/// One corner. Layout of the vertex buffer, 36 bytes.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub struct Vertex {
    /// Pixels from the left edge of the patch's image.
    pub u_px: f32,
    /// Pixels from its top edge.
    pub v_px: f32,
    /// Inverse depth in 1/m, above zero.
    pub w: f32,
    /// Of the quad whose top left corner this is: sRGB bytes, and the material in the highest byte.
    pub colour_material: u32,
    /// Of that quad: octahedral normal in the low half, object in the high one.
    pub normal_object: u32,
    /// Mean colour of the samples that share the corner: sRGB bytes. The highest byte is the extent code of the quad.
    pub corner_colour_trim: u32,
    /// Mean normal of the samples that share the corner in the low half; in the high one 0, or `1 + i` where the sample
    /// belongs to the patch's moving object number `i`.
    pub corner_normal_mover: u32,
    /// The pixel of the quad: x in the low half, y in the high one.
    pub pixel: u32,
    /// What the codes of both normals leave off ([`protocol::image::octahedral_rest`]): of the quad's in the lowest byte, of the
    /// corner's in the next one. The third is the quad's level: it covers `2^level` pixels a side, from its pixel on. The highest is
    /// 1 where the corner's surface says that it ends there, and from its second bit on how much the quad hides ([`DepthImage::share`]), 0 for all.
    pub normal_rests_level_end: u32,
}

impl Vertex {
    /// `(u, v, w)` of the patch's image.
    pub(crate) fn image(&self) -> Vec3 {
        Vec3::new(self.u_px, self.v_px, self.w)
    }
}

/// From which vertex of a triangle the API takes flat values.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ProvokingVertex {
    /// WebGPU, Vulkan, Metal, Direct3D.
    First,
    /// OpenGL and WebGL.
    Last,
}

/// Of [`Vertex::normal_rests_level_end`].
pub(crate) const END: u32 = 1 << 24;
/// Where the share that a quad hides begins in it.
const SHARE_BIT: u32 = 25;

/// Indices of a quad: two triangles.
pub(crate) const QUAD_INDICES: usize = 6;

impl ProvokingVertex {
    /// The two triangles of a quad by its corners: top left, top right, bottom left, bottom right. What is constant over it is read from the first of these.
    pub(crate) fn indices(self, [top_left, top_right, bottom_left, bottom_right]: [u32; 4]) -> [u32; QUAD_INDICES] {
        match self {
            ProvokingVertex::First => [top_left, bottom_right, top_right, top_left, bottom_left, bottom_right],
            ProvokingVertex::Last => [bottom_right, top_right, top_left, bottom_left, bottom_right, top_left],
        }
    }

    /// The corners again.
    pub(crate) fn corners(self, indices: &[u32]) -> [u32; 4] {
        match self {
            ProvokingVertex::First => [indices[0], indices[2], indices[4], indices[1]],
            ProvokingVertex::Last => [indices[2], indices[1], indices[3], indices[0]],
        }
    }
}

/// The quads of a patch, ready for upload.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct PatchMesh {
    /// Corners.
    pub vertices: Vec<Vertex>,
    /// Six a sample, in the order of the samples; of any triangles unless it `is_of_samples`.
    pub indices: Vec<u32>,
    /// Whether its quads are the samples'. Other meshes are what ours are compared with: GPUs draw them whole, and hosts not at all.
    pub is_of_samples: bool,
    /// Samples whose normal gives no usable plane: their corners were kept within [`CornerRules::max_ratio`].
    pub guarded: usize,
}

/// How to make a [`PatchMesh`].
#[derive(Debug, Clone, Copy)]
pub struct MeshOptions<'a> {
    /// Where corners come from.
    pub corners: Corners,
    /// What counts as one surface.
    pub rules: CornerRules,
    /// See [`ProvokingVertex`].
    pub provoking: ProvokingVertex,
    /// Inverse depths of the samples before they were quantized, in place of the image's codes: to tell what coding costs.
    pub exact_w: Option<&'a [f32]>,
    /// For [`Corners::OffsetImage`].
    pub offset_image: Option<OffsetImage<'a>>,
}

/// The image of the same view, one pixel larger, whose pixel centres are the corners.
#[derive(Debug, Clone, Copy)]
pub struct OffsetImage<'a> {
    /// Its samples.
    pub image: &'a DepthImage,
    /// See [`MeshOptions::exact_w`].
    pub exact_w: Option<&'a [f32]>,
}

const NONE: u32 = u32::MAX;

/// Builds the quads of a held patch; none of an image that no pinhole took.
pub fn build(held: &HeldPatch, options: &MeshOptions<'_>) -> PatchMesh {
    build_trimmed(&held.patch, &held.trims, options)
}

/// The same of a patch with what its samples are trimmed by, which is nothing before it is held.
pub(crate) fn build_trimmed(patch: &Patch, trims: &[u8], options: &MeshOptions<'_>) -> PatchMesh {
    match patch.image.camera.pinhole() {
        Some(camera) => Builder::new((patch, trims), camera, options).run(),
        None => PatchMesh::default(),
    }
}

struct Builder<'a> {
    patch: &'a Patch,
    trims: &'a [u8],
    options: &'a MeshOptions<'a>,
    planes: Vec<Plane>,
    guarded: usize,
    pixels: Vec<(u32, u32)>,
    /// Sample of each pixel of two rows: the one above the current corners and the one below.
    rows: [Vec<u32>; 2],
    /// Vertices of each sample: top left, top right, bottom left, bottom right.
    quads: Vec<[u32; 4]>,
    vertices: Vec<Vertex>,
    /// Of each vertex; empty where nothing is trimmed.
    extents: Vec<Extents>,
}

impl<'a> Builder<'a> {
    fn new((patch, trims): (&'a Patch, &'a [u8]), camera: &Pinhole, options: &'a MeshOptions<'a>) -> Builder<'a> {
        let image = &patch.image;
        let (planes, guarded) = corners::planes(image, camera, &options.rules, options.exact_w);
        let width = image.mask.size_px().0 as usize;
        Builder {
            patch,
            trims,
            options,
            guarded,
            pixels: image.mask.occupied().collect(),
            rows: [vec![NONE; width + 2], vec![NONE; width + 2]],
            quads: vec![[NONE; 4]; planes.len()],
            vertices: Vec::with_capacity(planes.len() * 5 / 4),
            extents: Vec::new(),
            planes,
        }
    }

    fn run(mut self) -> PatchMesh {
        let height = self.patch.image.mask.size_px().1;
        let offset = self.options.offset_image.map(OffsetPlane::new);
        let mut next = 0;
        for y in 0..=height {
            self.rows.swap(0, 1);
            let below = &mut self.rows[1];
            below.fill(NONE);
            let start = next;
            while next < self.pixels.len() && self.pixels[next].1 == y {
                below[self.pixels[next].0 as usize + 1] = next as u32;
                next += 1;
            }
            let above_is_empty = start == 0 || self.pixels[start - 1].1 + 1 != y;
            if !(start == next && above_is_empty) {
                self.corner_row(y, offset.as_ref());
            }
        }
        self.shrink_trimmed();
        let indices = self.indices();
        PatchMesh { vertices: self.vertices, indices, is_of_samples: true, guarded: self.guarded }
    }

    fn corner_row(&mut self, y: u32, offset: Option<&OffsetPlane<'_>>) {
        for x in 0..self.rows[0].len() - 1 {
            let around = [self.rows[0][x], self.rows[0][x + 1], self.rows[1][x], self.rows[1][x + 1]];
            if around == [NONE; 4] {
                continue;
            }
            let rules = &self.options.rules;
            let planes = around.map(|sample| self.planes.get(sample as usize));
            let corner = match self.options.corners {
                Corners::Averaged => corners::averaged(planes, rules),
                Corners::OwnPlane => corners::own_plane(planes, rules),
                Corners::OffsetImage => {
                    corners::from_offset_image(planes, offset.and_then(|offset| offset.at(x as u32, y)), rules)
                }
            };
            self.add_vertices(x as f32, y as f32, around, &corner);
        }
    }

    fn add_vertices(&mut self, u_px: f32, v_px: f32, around: [u32; 4], corner: &Corner) {
        for (first, group) in corner.group.into_iter().enumerate() {
            let id = self.vertices.len() as u32;
            let mut mean = Mean::default();
            let mut owner = NONE;
            // A group is named by its lowest sample, so each comes up once.
            for (index, sample) in around.into_iter().enumerate().skip(first) {
                if usize::from(group) == first && sample != NONE && corner.group[index] == group {
                    // The corner lies on the other side of the sample: it is the bottom right one of the sample above left.
                    self.quads[sample as usize][3 - index] = id;
                    mean.add(self.patch.image.colour[sample as usize], &self.planes[sample as usize]);
                    owner = sample;
                }
            }
            if owner != NONE {
                // The last sample of the group; where this is its top left corner, that is sample 3, which only comes last.
                let [right, down] = corner.shift_px[first];
                let mut vertex = self.vertex(u_px + right, v_px + down, corner.w[first], owner as usize, &mean);
                vertex.normal_rests_level_end |= if corner.ends[first] { END } else { 0 };
                self.vertices.push(vertex);
                if !self.trims.is_empty() {
                    let members = (0..4).filter(|&index| corner.group[index] == corner.group[first]);
                    let extents = Extents::of(members.map(|index| around[index]), self);
                    self.extents.push(extents);
                }
            }
        }
    }

    fn vertex(&self, u_px: f32, v_px: f32, w: f32, sample: usize, mean: &Mean) -> Vertex {
        let image = &self.patch.image;
        let object = image.object[sample];
        let mover = self.patch.objects.iter().position(|pose| pose.object == object).map_or(0, |index| index + 1);
        let (x, y) = self.pixels[sample];
        let rest = image.normal_rest.get(sample).copied();
        let share = image.share.get(sample).map_or(0, |&share| u32::from(share % DepthImage::WHOLE));
        // A mean of normals without rests is worth none.
        let mean_rest = rest.map_or(0, |_| protocol::image::octahedral_rest(mean.normal));
        Vertex {
            u_px,
            v_px,
            w,
            colour_material: packed(image.colour[sample], image.material[sample]),
            normal_object: u32::from(u16::from_le_bytes(image.normal[sample])) | u32::from(object) << 16,
            corner_colour_trim: packed(mean.colour(), self.trims.get(sample).copied().unwrap_or(0)),
            corner_normal_mover: u32::from(u16::from_le_bytes(mean.normal())) | (mover as u32) << 16,
            pixel: x | y << 16,
            normal_rests_level_end: u32::from(rest.unwrap_or(0)) | u32::from(mean_rest) << 8 | share << SHARE_BIT,
        }
    }

    /// Draws the corners of trimmed samples towards their centres; `w` is linear in the image. A corner that an untrimmed
    /// sample shares stays, so that no crack opens inside of a surface. One that only samples trimmed once share moves with
    /// all of them, so that a rim draws back as a whole; else each sample gets a corner of its own, which also parts samples
    /// of two surfaces that were taken for one.
    fn shrink_trimmed(&mut self) {
        let shared = self.vertices.clone();
        for (vertex, extents) in self.vertices.iter_mut().zip(&self.extents) {
            if extents.least == 1 && extents.most == 1 {
                *vertex = drawn_towards(vertex, extents.centre, 1);
            }
        }
        for sample in 0..self.trims.len() {
            let trim = self.trims[sample];
            if trim == 0 {
                continue;
            }
            let (x, y) = self.pixels[sample];
            let centre = [x as f32 + 0.5, y as f32 + 0.5, self.planes[sample].w];
            let mut mean = Mean::default();
            mean.add(self.patch.image.colour[sample], &self.planes[sample]);
            for corner in 0..4 {
                let vertex = self.quads[sample][corner] as usize;
                let extents = &self.extents[vertex];
                if extents.least == 0 || extents.most == 1 {
                    continue;
                }
                let Vertex { u_px, v_px, w, normal_rests_level_end, .. } = shared[vertex];
                let mut own = drawn_towards(&self.vertex(u_px, v_px, w, sample, &mean), centre, trim);
                own.normal_rests_level_end |= normal_rests_level_end & END;
                self.quads[sample][corner] = self.vertices.len() as u32;
                self.vertices.push(own);
            }
        }
    }

    fn indices(&self) -> Vec<u32> {
        self.quads.iter().flat_map(|&corners| self.options.provoking.indices(corners)).collect()
    }
}

/// A vertex moved to `2^-trim` of its distance from a centre `(u, v, w)`.
fn drawn_towards(vertex: &Vertex, [u_px, v_px, w]: [f32; 3], trim: u8) -> Vertex {
    let scale = 0.5_f32.powi(i32::from(trim));
    let drawn = |from: f32, to: f32| to + scale * (from - to);
    Vertex { u_px: drawn(vertex.u_px, u_px), v_px: drawn(vertex.v_px, v_px), w: drawn(vertex.w, w), ..*vertex }
}

/// How far the samples that share a vertex are trimmed.
#[derive(Debug, Clone, Copy)]
struct Extents {
    least: u8,
    most: u8,
    /// Mean of their centres: u, v, w.
    centre: [f32; 3],
}

impl Extents {
    fn of(members: impl Iterator<Item = u32>, builder: &Builder<'_>) -> Extents {
        let mut extents = Extents { least: u8::MAX, most: 0, centre: [0.0; 3] };
        let mut count = 0.0;
        for sample in members.filter(|&sample| sample != NONE).map(|sample| sample as usize) {
            let trim = builder.trims[sample];
            (extents.least, extents.most) = (extents.least.min(trim), extents.most.max(trim));
            let (x, y) = builder.pixels[sample];
            let centre = [x as f32 + 0.5, y as f32 + 0.5, builder.planes[sample].w];
            extents.centre.iter_mut().zip(centre).for_each(|(sum, value)| *sum += value);
            count += 1.0;
        }
        extents.centre = extents.centre.map(|sum| sum / count);
        extents
    }
}

fn packed([r, g, b]: [u8; 3], high: u8) -> u32 {
    u32::from_le_bytes([r, g, b, high])
}

#[derive(Default)]
struct Mean {
    colour: [u32; 3],
    normal: Vec3,
    count: u32,
}

impl Mean {
    fn add(&mut self, colour: [u8; 3], plane: &Plane) {
        for (sum, value) in self.colour.iter_mut().zip(colour) {
            *sum += u32::from(value);
        }
        self.normal += plane.normal;
        self.count += 1;
    }

    fn colour(&self) -> [u8; 3] {
        self.colour.map(|sum| ((sum + self.count / 2) / self.count) as u8)
    }

    fn normal(&self) -> [u8; 2] {
        protocol::image::octahedral_code(self.normal)
    }
}

/// The offset image by pixel.
struct OffsetPlane<'a> {
    offset: OffsetImage<'a>,
    samples: Vec<u32>,
}

impl OffsetPlane<'_> {
    fn new(offset: OffsetImage<'_>) -> OffsetPlane<'_> {
        let (width, height) = offset.image.mask.size_px();
        let mut samples = vec![NONE; width as usize * height as usize];
        for (index, (x, y)) in offset.image.mask.occupied().enumerate() {
            samples[y as usize * width as usize + x as usize] = index as u32;
        }
        OffsetPlane { offset, samples }
    }

    fn at(&self, x: u32, y: u32) -> Option<(u16, f32)> {
        let OffsetImage { image, exact_w } = self.offset;
        let (width, height) = image.mask.size_px();
        if x >= width || y >= height {
            return None;
        }
        let sample = self.samples[y as usize * width as usize + x as usize] as usize;
        let code = *image.depth.get(sample)?;
        Some((image.object[sample], exact_w.map_or(image.depth_scale.w(code), |exact_w| exact_w[sample])))
    }
}
