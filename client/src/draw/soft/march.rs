//! Rays from what is seen to a lamp's points, marched through the images of the lamp's corners: no map of any point is drawn, and fragment
//! shaders are enough.
//!
//! Each corner's image shows what was captured from there, so four images of a set without redundancy are layers of one another. All of them
//! and all points lie in one plane, parallel to the images: in each a ray is a straight line along which `w` grows evenly. A texel is the plane of
//! the surface that is drawn there, drawn back where it ends; least and greatest `w` of 4² and 16² texels (a pyramid as in Tevs, Ihrke, Seidel 2008) let a ray leap over
//! what it passes above or below. Images and pyramids stay while neither the lamp nor what it sees changes, wherever the eye goes. They are textures of their own rather than levels of one: a software adapter takes one level for four pixels. What lies on the receiver's own plane, by the rule of [`super`], hides nothing.
//!
//! **Deviation**: between texels whose planes are apart nothing is, so steep sides that no corner sees let rays through.

use bytemuck::{Pod, Zeroable};
use camera::Pinhole;
use gpu::Gpu;
use protocol::Lighting;
use surface::{CastPass, GBuffer, HeldSurfaces, SurfaceError};
use wgpu::{BindingResource, TextureFormat, TextureView};

use super::batch::{POINTS, PointsUniform, Ready, batches, shifts};
use super::bias::Bias;
use super::count::Count;
use super::receivers::Receivers;
use crate::draw::fullscreen::{Binding, FullscreenPass, Onto, Target, uniform};

/// Images of a lamp: the twin of the constant in `client/soft_march.wgsl`.
const CORNERS: usize = 4;
/// Least and greatest `w` of more texels.
const SPANS: TextureFormat = TextureFormat::Rg32Float;
/// A texel of a level is as many of the level before a side; the twin of the constant in `client/soft_spans.wgsl`.
const COARSER: u32 = 4;
/// Planes, and spans of 4² and 16² of them.
const FORMATS: [TextureFormat; 3] = [CastPass::PLANES, SPANS, SPANS];
const LEVELS: usize = FORMATS.len();
/// A patch is of the corner that it was captured from, up to this part of the corners' distance; one of none of them is in the images of all. The nearest other place
/// of a square lamp is a quarter of that distance away (`server/src/lights/places.rs`), and f64 rounds places by 1e-16 of their size: this is far from both.
const AT_CORNER: f64 = 1e-3;

/// `Corners` of `client/soft_march.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
struct CornersUniform {
    places: [[f32; 4]; CORNERS],
    size_px: [u32; 2],
    padding: [u32; 2],
}

/// See the module.
#[derive(Debug)]
pub(super) struct PointMarch {
    gpu: Gpu,
    bias: Bias,
    casting: CastPass,
    /// Spans of planes, and of spans.
    widen: [FullscreenPass; 2],
    march: FullscreenPass,
    /// Of the lamp that counts in each channel, as they were drawn last.
    images: [Option<Images>; Lighting::MAX_CASTING],
}

/// The corners' images, and their spans.
#[derive(Debug)]
struct Images {
    depth: Target,
    levels: [wgpu::Texture; LEVELS],
    /// What they show.
    shows: Option<Shows>,
}

/// What stays the same while the eye moves and further points are drawn.
#[derive(Debug, PartialEq)]
struct Shows {
    corners: Vec<Pinhole>,
    /// [`HeldSurfaces::revision`].
    casters: u64,
}

impl Images {
    fn new(gpu: &Gpu, size_px: (u32, u32)) -> Images {
        let level = |level: usize| {
            let [width, height] = [size_px.0, size_px.1].map(|side| side.div_ceil(COARSER.pow(level as u32)));
            gpu.device.create_texture(&wgpu::TextureDescriptor {
                label: Some("corners"),
                size: wgpu::Extent3d { width, height, depth_or_array_layers: CORNERS as u32 },
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format: FORMATS[level],
                usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::TEXTURE_BINDING,
                view_formats: &[],
            })
        };
        let depth = Target::new(gpu, "corner depth", size_px, GBuffer::DEPTH);
        Images { depth, levels: std::array::from_fn(level), shows: None }
    }

    fn size_px(&self) -> (u32, u32) {
        (self.depth.texture.width(), self.depth.texture.height())
    }

    /// One level of one corner's, to be drawn to.
    fn level(&self, layer: usize, level: usize) -> TextureView {
        self.levels[level].create_view(&wgpu::TextureViewDescriptor {
            dimension: Some(wgpu::TextureViewDimension::D2),
            base_array_layer: layer as u32,
            array_layer_count: Some(1),
            ..Default::default()
        })
    }

    /// All corners' of each level.
    fn levels(&self) -> [TextureView; LEVELS] {
        let dimension = Some(wgpu::TextureViewDimension::D2Array);
        self.levels
            .each_ref()
            .map(|level| level.create_view(&wgpu::TextureViewDescriptor { dimension, ..Default::default() }))
    }
}

impl PointMarch {
    pub(super) fn new(gpu: &Gpu, bias: Bias) -> Result<PointMarch, SurfaceError> {
        use Binding::{FloatTextures, Uniform};
        let widen = |entry_point| {
            FullscreenPass::new(gpu, "client/soft_spans.wgsl", entry_point, &[FloatTextures, Uniform], &[SPANS])
        };
        let bindings = [&Ready::BINDINGS[..], &[Uniform], &[FloatTextures; LEVELS]].concat();
        let shader = ("client/soft_march.wgsl", "hidden_by_march");
        Ok(PointMarch {
            gpu: gpu.clone(),
            bias,
            casting: CastPass::of_planes(gpu)?,
            widen: [widen("widen_planes")?, widen("widen_spans")?],
            march: FullscreenPass::onto(Onto::Sum, gpu, shader, &bindings, &[Count::FORMAT])?,
            images: Default::default(),
        })
    }

    /// Counts some of the points that `points` are the views of, by the images of `corners`: four views that differ from each other, and whose eyes from the points, by
    /// shifts alone. The images are drawn where they do not yet show that.
    pub(super) fn encode(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        (corners, points, casters): (&[Pinhole], &[Pinhole], &HeldSurfaces),
        receivers: Receivers<'_>,
        (count, numbers): (Count<'_>, &[usize]),
    ) {
        let frame = &corners[0];
        let mut images = match self.images[count.channel()].take() {
            Some(images) if images.size_px() == (frame.width_px, frame.height_px) => images,
            _ => Images::new(&self.gpu, (frame.width_px, frame.height_px)),
        };
        let shows = Some(Shows { corners: corners.to_vec(), casters: casters.revision() });
        if images.shows != shows {
            self.draw(encoder, (corners, casters), &images);
            images.shows = shows;
        }
        let ready = Ready::new(&self.gpu, (frame, self.bias), receivers);
        let places = uniform(&self.gpu, "corners", bytemuck::bytes_of(&CornersUniform::new(corners)));
        let spans = images.levels();
        for numbers in batches(numbers, POINTS, count) {
            let (hidden, _) = count.of(numbers[0], points.len());
            let some = ready.points(&PointsUniform::new(frame, (points, numbers), 0, count));
            let spans = spans.iter().map(BindingResource::TextureView);
            let inputs: Vec<_> =
                ready.inputs(&some).into_iter().chain([places.as_entire_binding()]).chain(spans).collect();
            self.march.encode(encoder, &inputs, &[hidden]);
        }
        self.images[count.channel()] = Some(images);
    }

    /// Draws the corners' images, and their spans.
    fn draw(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        (corners, casters): (&[Pinhole], &HeldSurfaces),
        images: &Images,
    ) {
        let all = images.levels();
        for (layer, corner) in corners.iter().enumerate() {
            let is_of_it = |camera: &Pinhole| corner_of(camera, corners).is_none_or(|own| own == layer);
            self.casting.encode_some(encoder, casters, corner, (&images.level(layer, 0), &images.depth.view), is_of_it);
            let number = uniform(&self.gpu, "layer", bytemuck::bytes_of(&[layer as u32, 0, 0, 0]));
            for (widen, level) in self.widen.iter().zip(1..) {
                let inputs = [BindingResource::TextureView(&all[level - 1]), number.as_entire_binding()];
                widen.encode(encoder, &inputs, &[&images.level(layer, level)]);
            }
        }
    }
}

/// The corner that a camera stands at.
fn corner_of(camera: &Pinhole, corners: &[Pinhole]) -> Option<usize> {
    let place = |view: &Pinhole| view.world_from_eye.translation;
    let apart_m = corners.iter().map(|corner| place(corner).distance(place(&corners[0]))).fold(0.0, f64::max);
    corners.iter().position(|corner| place(corner).distance(place(camera)) <= AT_CORNER * apart_m)
}

impl CornersUniform {
    fn new(corners: &[Pinhole]) -> CornersUniform {
        let frame = &corners[0];
        let mut uniform: CornersUniform = Zeroable::zeroed();
        for ((place, corner), shift) in uniform.places.iter_mut().zip(corners).zip(shifts(frame, corners)) {
            *place = [shift.x, shift.y, corner.centre_px.x, corner.centre_px.y].map(|value| value as f32);
        }
        uniform.size_px = [frame.width_px, frame.height_px];
        uniform
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use camera::Rigid;
    use glam::DVec3;

    #[test]
    fn uniforms_are_laid_out_as_in_wgsl() {
        shaders::assert_layout!(CornersUniform, "client/soft_march.wgsl", "Corners", places, size_px);
    }

    #[test]
    fn a_patch_is_of_the_corner_that_it_was_seen_from() {
        let at = |x: f64, z: f64| {
            Pinhole::symmetric(Rigid::look_along(DVec3::new(x, 5.0, z), DVec3::NEG_Y), (8, 8), 1.0, 0.1)
        };
        let corners = [at(-1.0, -1.0), at(1.0, -1.0), at(-1.0, 1.0), at(1.0, 1.0)];
        assert_eq!(corner_of(&at(1.0, -1.0), &corners), Some(1));
        assert_eq!(corner_of(&at(-1.0, 1.0 + 1e-4), &corners), Some(2));
        assert_eq!(corner_of(&at(0.0, 0.0), &corners), None);
    }
}
