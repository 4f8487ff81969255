//! Lighting an image of a camera, and showing it whole.

use bytemuck::{Pod, Zeroable};
use glam::Vec4;
use gpu::{Gpu, MaterialUniform, SkyTexture};
use protocol::Held;
use wgpu::{BindingResource, TextureFormat, TextureView};

use super::{CameraImage, Image, MAX_CENTRES};
use crate::draw::coverage::{self, Coverage};
use crate::draw::fullscreen::{Binding, FullscreenPass, Target, uniform};
use crate::draw::light::lighting_of;
use crate::draw::lit::Lit;

/// `Letterbox` of `client/letterbox.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
struct LetterboxUniform {
    background: [f32; 3],
    target_encodes: u32,
    empty: [f32; 3],
    coverage_in_alpha: u32,
    first_px: [f32; 2],
    texels_per_px: f32,
    padding: f32,
}

/// How an image is shown.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Showing {
    /// The output's width and height.
    pub size_px: (u32, u32),
    /// What is shown where the image shows nothing, sRGB-encoded; `None` for the scene's background.
    pub mark: Option<[u8; 3]>,
    /// As [`crate::draw::frame::Options::coverage_in_alpha`].
    pub coverage_in_alpha: bool,
    /// As [`crate::draw::frame::Options::exposure`].
    pub exposure: f32,
}

/// See the module.
#[derive(Debug)]
pub(crate) struct CameraImagePass {
    gpu: Gpu,
    light: FullscreenPass,
    sky: SkyTexture,
    show: FullscreenPass,
    coverage: Coverage,
    targets: Option<(Lit, Target)>,
    output_format: TextureFormat,
}

impl CameraImagePass {
    pub(crate) fn new(gpu: &Gpu, output_format: TextureFormat) -> Result<CameraImagePass, shaders::ShaderError> {
        use Binding::{FloatTexture, UintTexture, Uniform};
        let lit = [Uniform, Uniform, Uniform, FloatTexture, UintTexture, FloatTexture, FloatTexture, FloatTexture];
        let formats = [Lit::COLOUR, Lit::W];
        let shown = [Uniform, FloatTexture];
        Ok(CameraImagePass {
            gpu: gpu.clone(),
            light: FullscreenPass::new(gpu, "client/light_places.wgsl", "light_places", &lit, &formats)?,
            sky: SkyTexture::default(),
            show: FullscreenPass::new(gpu, "client/letterbox.wgsl", "show_letterbox", &shown, &[output_format])?,
            coverage: Coverage::new(gpu)?,
            targets: None,
            output_format,
        })
    }

    /// Draws the image into `output`, as large as it fits; nothing where there is none. Call [`CameraImagePass::submitted`] once the
    /// commands are submitted.
    pub(crate) fn encode(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        (shown, held): (&CameraImage, &Held),
        showing: Showing,
        output: &TextureView,
    ) {
        let Some(image) = &shown.image else { return };
        let size_of = |(lit, _): &(Lit, Target)| (lit.colour.texture.width(), lit.colour.texture.height());
        let targets = self.targets.take().filter(|targets| size_of(targets) == image.size_px);
        let made = || (Lit::new(&self.gpu, image.size_px), coverage::tiles(&self.gpu, image.size_px));
        let (lit, tiles) = targets.unwrap_or_else(made);
        self.light(encoder, image, (held, showing.exposure), &lit);
        let letterbox = letterbox(image.size_px, held, showing, self.output_format.is_srgb());
        let letterbox = uniform(&self.gpu, "letterbox", bytemuck::bytes_of(&letterbox));
        let inputs = [letterbox.as_entire_binding(), BindingResource::TextureView(&lit.colour.view)];
        self.show.encode(encoder, &inputs, &[output]);
        self.coverage.encode(&self.gpu, encoder, &lit, &tiles);
        self.targets = Some((lit, tiles));
    }

    /// Tells that the commands of the last image were submitted.
    pub(crate) fn submitted(&mut self) {
        self.coverage.submitted();
    }

    /// Share of the image's pixels without a surface, of the newest that was counted; `None` before the first.
    pub(crate) fn uncovered_share(&mut self) -> Option<f64> {
        self.coverage.share()
    }

    fn light(&mut self, encoder: &mut wgpu::CommandEncoder, image: &Image, (held, exposure): (&Held, f32), lit: &Lit) {
        let lighting = lighting_of(held, image.anchor_world, exposure);
        let mut centres = [Vec4::ZERO; MAX_CENTRES];
        centres[..image.centres.len()].copy_from_slice(&image.centres);
        let mut materials = MaterialUniform::table(&held.materials);
        // The side that the camera sees was captured; nothing is turned towards it.
        materials.iter_mut().for_each(|material| material.flags &= !MaterialUniform::DOUBLE_SIDED);
        let centres = uniform(&self.gpu, "centres", bytemuck::cast_slice(&centres));
        let lighting = uniform(&self.gpu, "lighting", bytemuck::bytes_of(&lighting));
        let materials = uniform(&self.gpu, "materials", bytemuck::cast_slice(&materials));
        let uniforms = [&centres, &lighting, &materials].map(wgpu::Buffer::as_entire_binding);
        let sky = self.sky.of(&self.gpu, held.sky.as_ref());
        let [colour, normal_ids, w, places] = image.views.each_ref();
        let textures = [colour, normal_ids, w, &sky, places].map(BindingResource::TextureView);
        let inputs: Vec<_> = uniforms.into_iter().chain(textures).collect();
        self.light.encode(encoder, &inputs, &[&lit.colour.view, &lit.w.view]);
    }
}

/// Whole, as large as it fits, in the middle.
fn letterbox(image_px: (u32, u32), held: &Held, showing: Showing, target_encodes: bool) -> LetterboxUniform {
    let unit = |bytes: [u8; 3]| bytes.map(|value| f32::from(value) / 255.0);
    let background = held.lighting.as_ref().map_or([0; 3], |lighting| lighting.background);
    let (width, height) = (image_px.0 as f32, image_px.1 as f32);
    let (output_width, output_height) = (showing.size_px.0 as f32, showing.size_px.1 as f32);
    let texels_per_px = (width / output_width).max(height / output_height);
    let first = |output: f32, image: f32| (output - image / texels_per_px) / 2.0;
    LetterboxUniform {
        background: unit(background),
        target_encodes: u32::from(target_encodes),
        empty: unit(showing.mark.unwrap_or(background)),
        coverage_in_alpha: u32::from(showing.coverage_in_alpha),
        first_px: [first(output_width, width), first(output_height, height)],
        texels_per_px,
        padding: 0.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_uniform_is_laid_out_as_in_wgsl() {
        shaders::assert_layout!(
            LetterboxUniform,
            "client/letterbox.wgsl",
            "Letterbox",
            background,
            target_encodes,
            empty,
            coverage_in_alpha,
            first_px,
            texels_per_px
        );
    }

    #[test]
    fn an_image_fits_whole_in_the_middle() {
        let held = Held::default();
        let shown = |image_px, size_px| {
            let showing = Showing { size_px, mark: None, coverage_in_alpha: false, exposure: 1.0 };
            let uniform = letterbox(image_px, &held, showing, false);
            (uniform.first_px, uniform.texels_per_px)
        };
        assert_eq!(shown((640, 360), (640, 360)), ([0.0, 0.0], 1.0));
        assert_eq!(shown((320, 180), (640, 480)), ([0.0, 60.0], 0.5));
        assert_eq!(shown((100, 400), (300, 200)), ([125.0, 0.0], 2.0));
    }
}
