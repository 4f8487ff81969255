//! Where surfaces end within a pixel ([`protocol::ends`]), from a finer image of the same view.
//!
//! A sample says that its surface is at its pixel's centre. Where the next pixel's centre shows something farther or nothing, the surface
//! ends between the two. A finer image, three times as fine, tells how far it reaches: the strip between the centres, a pixel wide, has six of
//! its pixels, and as many as show the surface are covered. Three is odd, so each ninth pixel is the very ray of a pixel of the view.
//!
//! The finer image is a conventional one: of samples that lie behind something, as non-redundant images peel the scene, nothing is said, and
//! a surface goes on where an earlier image holds it. Only around outlines of samples that are to be sent is anything drawn, objects and depths alone.

use camera::Pinhole;
use glam::DVec2;
use gpu::{Gpu, Readback};
use protocol::Mask;
use protocol::ends::{self, Ends, SIDES};
use rayon::prelude::*;
use wgpu::util::{DeviceExt, TextureDataOrder};

use super::Capture;
use crate::render::{DEPTH_FORMAT, Faces, Pass, Pipelines, RenderError, SceneRenderer, check_camera};

/// Pixels of the finer image that one pixel is wide: the twin of `SUBPIXELS` in `server/finer.wgsl`.
const SUBPIXELS: u32 = 3;
/// Pixels around a part, whose surfaces are asked for: those beside its samples.
const MARGIN_PX: u32 = 1;
/// Parts are at most so wide and high, so that finer images stay small.
const MOST_PX: u32 = 1022;
/// A surface goes on in the next pixel where it falls back by no more than this many footprints ...
const GAP_FOOTPRINTS: f32 = 1.5;
/// ... and by so many times what it fell back by to the pixel before: on a plane `w` is linear in the image, and towards an outline a round
/// one falls ever more.
const BENDS: f32 = 2.5;

/// So many footprints nearer than the samples around a pixel is still drawn: a surface that is seen at a grazing angle comes nearer within a pixel.
const NEARER_FOOTPRINTS: f32 = 4.0;

/// See `server/finer.wgsl`.
const NEAREST_BINDING: u32 = 5;
/// Objects one higher than their ids; 0 where there is none.
const OBJECT_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::R32Uint;

/// A part of a view, finer: [`SUBPIXELS`] squared values a pixel, row-major.
#[derive(Debug, Clone)]
struct Finer {
    /// The first pixel of the view that it shows; it may lie outside by one.
    first_px: (i32, i32),
    /// Values a row.
    width: usize,
    /// One higher than the object's id; 0 where there is none.
    object: Vec<u32>,
    /// Inverse depths in any unit, the same as the view's: those of captures are `near * w`.
    depth: Vec<f32>,
}

/// A part of a view: its first pixel and its size.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Part {
    pub first_px: (u32, u32),
    pub size_px: (u32, u32),
}

impl Part {
    /// The parts of a whole view, row by row.
    pub(crate) fn all((width_px, height_px): (u32, u32)) -> impl Iterator<Item = Part> {
        let starts = |length: u32| (0..length).step_by(MOST_PX as usize);
        let part = move |x: u32, y: u32| Part {
            first_px: (x, y),
            size_px: ((width_px - x).min(MOST_PX), (height_px - y).min(MOST_PX)),
        };
        starts(height_px).flat_map(move |y| starts(width_px).map(move |x| part(x, y)))
    }

    /// Its first pixel, with the margin; it may lie outside.
    pub(crate) fn first_with_margin(self) -> (i32, i32) {
        let first = |first: u32| first as i32 - MARGIN_PX as i32;
        (first(self.first_px.0), first(self.first_px.1))
    }

    /// Its size with the margin.
    pub(crate) fn size_with_margin(self) -> (u32, u32) {
        (self.size_px.0 + 2 * MARGIN_PX, self.size_px.1 + 2 * MARGIN_PX)
    }

    /// The size of its finer image.
    fn finer_px(self) -> (u32, u32) {
        let (width_px, height_px) = self.size_with_margin();
        (width_px * SUBPIXELS, height_px * SUBPIXELS)
    }
}

/// Draws finer images.
pub struct EndsPass {
    gpu: Gpu,
    layout: wgpu::BindGroupLayout,
    pipelines: Pipelines,
    /// Kept for the next part; objects and depths.
    targets: Option<[wgpu::Texture; 2]>,
}

impl EndsPass {
    /// For scenes of `scene`'s kind.
    pub fn new(scene: &SceneRenderer) -> Result<EndsPass, RenderError> {
        let gpu = scene.gpu().clone();
        let layout = gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some("finer"),
            entries: &[wgpu::BindGroupLayoutEntry {
                binding: NEAREST_BINDING,
                visibility: wgpu::ShaderStages::FRAGMENT,
                ty: wgpu::BindingType::Texture {
                    sample_type: wgpu::TextureSampleType::Float { filterable: false },
                    view_dimension: wgpu::TextureViewDimension::D2,
                    multisampled: false,
                },
                count: None,
            }],
        });
        let (formats, own_layout) = (&[OBJECT_FORMAT], Some(&layout));
        let pass = Pass { fragment: "object", formats, own_layout, constants: &[], faces: Faces::Front };
        let pipelines = Pipelines::new(&gpu, scene.kind(), &pass)?;
        Ok(EndsPass { gpu, layout, pipelines, targets: None })
    }

    /// Another one that shares its pipelines.
    pub fn twin(&self) -> EndsPass {
        let (gpu, layout, pipelines) = (self.gpu.clone(), self.layout.clone(), self.pipelines.clone());
        EndsPass { gpu, layout, pipelines, targets: None }
    }

    /// Tells of the samples of a mask of a capture's where their surfaces end; `scene` is as it was when they were captured. All other samples
    /// are said to go on.
    pub fn tell(&mut self, scene: &SceneRenderer, capture: &mut Capture, mask: &Mask) -> Result<(), RenderError> {
        let mut ends = vec![0; capture.ids.len()];
        let outlines = outlines(capture, mask);
        let width = capture.camera.width_px as usize;
        for part in parts(&outlines) {
            let finer = self.draw(scene, capture, &outlines, part)?;
            let rows = part.first_px.1 as usize..(part.first_px.1 + part.size_px.1) as usize;
            ends[rows.start * width..rows.end * width].par_chunks_mut(width).zip(rows).for_each(|(row, y)| {
                for x in part.first_px.0..part.first_px.0 + part.size_px.0 {
                    if outlines.get(x, y as u32) {
                        row[x as usize] = ends_of(capture, &finer, (x, y as u32));
                    }
                }
            });
        }
        capture.ends = ends;
        Ok(())
    }

    fn draw(
        &mut self,
        scene: &SceneRenderer,
        capture: &Capture,
        outlines: &Mask,
        part: Part,
    ) -> Result<Finer, RenderError> {
        let mut encoder = self.gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let nearest = self.nearest(part, &nearest_drawn(capture, outlines, part));
        let targets = self.encode(&mut encoder, scene, &capture.camera, (part, &nearest))?;
        let (width_px, height_px) = part.finer_px();
        let mut readback = Readback::default();
        let object = readback.texture(&targets[0], 0, (width_px, height_px));
        // Depth can only be copied whole.
        let depth = readback.texture(&targets[1], 0, (targets[1].width(), targets[1].height()));
        let encoded = readback.encode(&self.gpu, &mut encoder);
        self.gpu.queue.submit([encoder.finish()]);
        let mapped = encoded.map().wait(&self.gpu)?;
        let mut depths = Vec::with_capacity(width_px as usize * height_px as usize);
        for row in mapped.rows(depth).take(height_px as usize) {
            gpu::readback::extend_from_bytes(&mut depths, &row[..width_px as usize * 4]);
        }
        Ok(Finer {
            first_px: part.first_with_margin(),
            width: width_px as usize,
            object: mapped.values(object),
            depth: depths,
        })
    }

    /// Draws a part of a camera's view, where nothing is nearer than its pixels say, and leaves objects and depths on the GPU until the next part.
    pub(crate) fn encode(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        scene: &SceneRenderer,
        camera: &Pinhole,
        (part, nearest): (Part, &wgpu::TextureView),
    ) -> Result<[wgpu::Texture; 2], RenderError> {
        let (width_px, height_px) = part.finer_px();
        let (x, y) = part.first_with_margin();
        let finer = f64::from(SUBPIXELS);
        let centre_px = (camera.centre_px - DVec2::new(x.into(), y.into())) * finer;
        let camera = Pinhole { width_px, height_px, focal_px: camera.focal_px * finer, centre_px, ..*camera };
        check_camera(&self.gpu, &camera)?;
        let targets = self.take_targets((width_px, height_px));
        let group = self.gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("nearest drawn"),
            layout: &self.layout,
            entries: &[wgpu::BindGroupEntry {
                binding: NEAREST_BINDING,
                resource: wgpu::BindingResource::TextureView(nearest),
            }],
        });
        let view = scene.view_group(&camera);
        let mut pass = begin(encoder, &targets);
        pass.set_bind_group(3, &group, &[]);
        scene.draw(&mut pass, &self.pipelines, &camera, &view);
        drop(pass);
        self.targets = Some(targets.clone());
        Ok(targets)
    }

    fn nearest(&self, part: Part, depths: &[f32]) -> wgpu::TextureView {
        let size = wgpu::Extent3d {
            width: part.size_px.0 + 2 * MARGIN_PX,
            height: part.size_px.1 + 2 * MARGIN_PX,
            depth_or_array_layers: 1,
        };
        let description = wgpu::TextureDescriptor {
            label: Some("nearest drawn"),
            size,
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: wgpu::TextureFormat::R32Float,
            usage: wgpu::TextureUsages::TEXTURE_BINDING,
            view_formats: &[],
        };
        let bytes = bytemuck::cast_slice(depths);
        let texture = self.gpu.device.create_texture_with_data(
            &self.gpu.queue,
            &description,
            TextureDataOrder::LayerMajor,
            bytes,
        );
        texture.create_view(&wgpu::TextureViewDescriptor::default())
    }

    fn take_targets(&mut self, (width, height): (u32, u32)) -> [wgpu::Texture; 2] {
        let fits = |kept: &[wgpu::Texture; 2]| (kept[0].width(), kept[0].height()) == (width, height);
        self.targets.take().filter(fits).unwrap_or_else(|| {
            [OBJECT_FORMAT, DEPTH_FORMAT].map(|format| {
                self.gpu.device.create_texture(&wgpu::TextureDescriptor {
                    label: Some("finer"),
                    size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
                    mip_level_count: 1,
                    sample_count: 1,
                    dimension: wgpu::TextureDimension::D2,
                    format,
                    usage: wgpu::TextureUsages::RENDER_ATTACHMENT
                        | wgpu::TextureUsages::COPY_SRC
                        | wgpu::TextureUsages::TEXTURE_BINDING,
                    view_formats: &[],
                })
            })
        })
    }
}

fn begin<'a>(encoder: &'a mut wgpu::CommandEncoder, targets: &[wgpu::Texture; 2]) -> wgpu::RenderPass<'a> {
    let [object, depth] = targets.each_ref().map(|target| target.create_view(&wgpu::TextureViewDescriptor::default()));
    let ops = wgpu::Operations { load: wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT), store: wgpu::StoreOp::Store };
    encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        label: Some("finer"),
        color_attachments: &[Some(wgpu::RenderPassColorAttachment {
            view: &object,
            depth_slice: None,
            resolve_target: None,
            ops,
        })],
        depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
            view: &depth,
            depth_ops: Some(wgpu::Operations { load: wgpu::LoadOp::Clear(0.0), store: wgpu::StoreOp::Store }),
            stencil_ops: None,
        }),
        ..Default::default()
    })
}

/// The samples of a mask beside which the capture shows something farther, or nothing: no others end.
fn outlines(capture: &Capture, mask: &Mask) -> Mask {
    let (width, height) = (capture.camera.width_px, capture.camera.height_px);
    let depth = |x: u32, y: u32| capture.depth[(y * width + x) as usize];
    let mut outlines = Mask::empty(width, height);
    for (x, y) in mask.occupied() {
        let own = depth(x, y);
        let falls = |[right, down]: &[i32; 2]| {
            let beside = x.checked_add_signed(*right).zip(y.checked_add_signed(*down));
            beside.is_some_and(|(x, y)| x < width && y < height && depth(x, y) < own)
        };
        if SIDES.iter().any(falls) {
            outlines.set(x, y, true);
        }
    }
    outlines
}

/// By pixel of a part with its margin: the depth of the nearest sample of the nine pixels around, and some footprints more; 0, where nothing is
/// drawn, but beside outlines.
fn nearest_drawn(capture: &Capture, outlines: &Mask, part: Part) -> Vec<f32> {
    let (width, height) = (capture.camera.width_px as i32, capture.camera.height_px as i32);
    let nearer = 1.0 + NEARER_FOOTPRINTS / capture.camera.focal_px as f32;
    let first = [part.first_px.0, part.first_px.1].map(|first| first as i32 - MARGIN_PX as i32);
    let columns = first[0]..first[0] + (part.size_px.0 + 2 * MARGIN_PX) as i32;
    let rows = first[1]..first[1] + (part.size_px.1 + 2 * MARGIN_PX) as i32;
    let around = |at: i32, length: i32| (at - 1).clamp(0, length)..(at + 2).clamp(0, length);
    // Of three pixels above each other the nearest depth, and whether one of them is an outline's.
    let of_column = |x: i32, y: i32| {
        let both = |(nearest, is_outline): (f32, bool), y: i32| {
            let depth = capture.depth[(y * width + x) as usize];
            (nearest.max(depth), is_outline || outlines.get(x as u32, y as u32))
        };
        around(y, height).fold((0.0, false), both)
    };
    let row = |y: i32| {
        let of_columns: Vec<(f32, bool)> = (0..width).map(|x| of_column(x, y)).collect();
        let nearest = |x: i32| {
            let columns = &of_columns[around(x, width).start as usize..around(x, width).end as usize];
            let is_drawn = columns.iter().any(|column| column.1);
            if is_drawn { columns.iter().fold(0.0, |nearest: f32, column| nearest.max(column.0)) * nearer } else { 0.0 }
        };
        columns.clone().map(nearest).collect::<Vec<f32>>()
    };
    rows.into_par_iter().flat_map_iter(row).collect()
}

/// The parts of a mask that hold samples.
fn parts(mask: &Mask) -> Vec<Part> {
    let (width_px, height_px) = mask.size_px();
    let columns = width_px.div_ceil(MOST_PX);
    let mut bounds = vec![None; (columns * height_px.div_ceil(MOST_PX)) as usize];
    for (x, y) in mask.occupied() {
        let part = &mut bounds[(y / MOST_PX * columns + x / MOST_PX) as usize];
        let (low, high) = part.unwrap_or(([x, y], [x, y]));
        *part = Some(([low[0].min(x), low[1].min(y)], [high[0].max(x), high[1].max(y)]));
    }
    let part = |(low, high): ([u32; 2], [u32; 2])| Part {
        first_px: (low[0], low[1]),
        size_px: (high[0] - low[0] + 1, high[1] - low[1] + 1),
    };
    bounds.into_iter().flatten().map(part).collect()
}

/// Where the surface of the sample at a pixel of a capture ends, as a finer image around it shows.
fn ends_of(capture: &Capture, finer: &Finer, pixel: (u32, u32)) -> Ends {
    let index = pixel.1 as usize * capture.camera.width_px as usize + pixel.0 as usize;
    let own = (u32::from(capture.object(index)) + 1, capture.depth[index]);
    let side = SUBPIXELS as usize;
    let place = |at: u32, first: i32| (at as i32 - first) as usize * side + side / 2;
    let centre = place(pixel.1, finer.first_px.1) * finer.width + place(pixel.0, finer.first_px.0);
    let around = Around { finer, centre, own, footprint: own.1 / capture.camera.focal_px as f32 };
    // A sample that lies behind something is not seen here.
    if finer.object[centre] != own.0 || (finer.depth[centre] - own.1).abs() > around.footprint {
        return 0;
    }
    (0..SIDES.len()).fold(0, |all, side| ends::with_level(all, side, around.level(SIDES[side])))
}

/// What a finer image shows around a sample.
struct Around<'a> {
    finer: &'a Finer,
    /// Place of the sample's own ray.
    centre: usize,
    /// Its object, and its inverse depth.
    own: (u32, f32),
    footprint: f32,
}

impl Around<'_> {
    /// What is seen some finer pixels to the right and down.
    fn at(&self, right: i32, down: i32) -> (u32, f32) {
        let place = (self.centre as isize + right as isize + down as isize * self.finer.width as isize) as usize;
        (self.finer.object[place], self.finer.depth[place])
    }

    /// The level at a side.
    fn level(&self, [right, down]: [i32; 2]) -> u16 {
        let (object, w) = self.own;
        let step = SUBPIXELS as i32;
        let next = self.at(step * right, step * down);
        if next.1 >= w || (next.0 == object && self.goes_on_to(next.1, [right, down])) {
            return 0;
        }
        // Nearer to the sample than to what is behind, of the same object; of nearer ones what is behind them is not known.
        let middle = w + (next.1 - w) * 0.5;
        let is_own =
            |(seen, seen_w): (u32, f32)| seen_w >= w || (seen == object && (next.0 != object || seen_w > middle));
        let half = step / 2;
        let strip = (1..step).flat_map(|along| (-half..=half).map(move |aside| (along, aside)));
        let covered =
            strip.filter(|&(along, aside)| is_own(self.at(along * right + aside * down, along * down + aside * right)));
        let of = (step - 1) * step;
        1 + ((covered.count() as i32 * 6 + of / 2) / of) as u16
    }

    /// Whether the sample's object is one surface as far as the next pixel, which shows it at `w`.
    fn goes_on_to(&self, w: f32, [right, down]: [i32; 2]) -> bool {
        let step = SUBPIXELS as i32;
        let before = self.at(-step * right, -step * down);
        let fell = if before.0 == self.own.0 { (before.1 - self.own.1).max(0.0) } else { 0.0 };
        self.own.1 - w <= GAP_FOOTPRINTS * self.footprint + BENDS * fell
    }
}
