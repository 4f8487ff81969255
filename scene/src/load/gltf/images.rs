//! The images that materials need: decoded whole for base colours and normals, reduced to their mean where only that is used.

use image::RgbaImage;
use rayon::prelude::*;

use super::buffers::{Buffers, UriReader};
use super::document::{Document, TextureInfo};
use crate::load::{LoadError, Request, Warnings, texture};

/// Mean colour of an image.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Mean {
    /// Of the values as stored, 0 to 1.
    pub raw: [f32; 3],
    /// Of the values after sRGB decoding.
    pub linear: [f32; 3],
}

/// An image that some material needs.
pub(super) struct Decoded {
    /// `None` once it was taken, or where only the mean is needed.
    pub pixels: Option<RgbaImage>,
    /// `None` where it is not needed.
    pub mean: Option<Mean>,
}

/// What an image is needed for.
#[derive(Debug, Clone, Copy, Default)]
struct Need {
    pixels: bool,
    mean: bool,
}

/// The index of the image behind a texture reference; `None` where one of the references leads nowhere.
pub(super) fn image_of(document: &Document, info: Option<&TextureInfo>) -> Option<usize> {
    document.textures.get(info?.index)?.image(document.images.len())
}

/// Decodes, in parallel, what the materials of a document need; by image. What cannot be read is left out with a warning.
pub(super) fn read(
    document: &Document,
    buffers: &Buffers<'_>,
    uris: &mut UriReader<'_>,
    request: &Request<'_>,
    warnings: &mut Warnings,
) -> Vec<Option<Decoded>> {
    let needs = needs(document);
    let mut files: Vec<Option<Vec<u8>>> = vec![None; document.images.len()];
    for (index, image) in document.images.iter().enumerate() {
        if !needs[index].pixels && !needs[index].mean {
            if let Some(Err(error)) = image.uri.as_ref().map(|uri| uris.check(uri)) {
                warnings.add(format!("images[{index}]: {error}"));
            }
            continue;
        }
        let bytes = match (&image.uri, image.buffer_view) {
            (Some(uri), _) => uris.read(uri),
            (None, Some(view)) => buffers.view(view).map(|view| view.bytes.to_vec()),
            (None, None) => Err(LoadError::malformed(format!("images[{index}]"), "neither uri nor bufferView")),
        };
        match bytes {
            Ok(bytes) => files[index] = Some(bytes),
            Err(error) => warnings.add(format!("images[{index}] is left out: {error}")),
        }
    }
    let slices: Vec<Option<&[u8]>> = files.iter().map(Option::as_deref).collect();
    let decoded = texture::decode_all(&slices, request);
    let reduce = |(image, need): (Option<Result<RgbaImage, String>>, &Need)| {
        image.map(|image| {
            image.map(|image| {
                let mean = need.mean.then(|| mean_of(&image));
                Decoded { pixels: need.pixels.then_some(image), mean }
            })
        })
    };
    let reduced: Vec<_> = decoded.into_par_iter().zip(&needs).map(reduce).collect();
    let mut images = Vec::with_capacity(reduced.len());
    for (index, image) in reduced.into_iter().enumerate() {
        images.push(match image {
            Some(Err(fault)) => {
                warnings.add(format!("images[{index}] is left out: {fault}"));
                None
            }
            Some(Ok(decoded)) => Some(decoded),
            None => None,
        });
    }
    images
}

fn needs(document: &Document) -> Vec<Need> {
    let mut needs = vec![Need::default(); document.images.len()];
    for material in &document.materials {
        let pbr = &material.pbr_metallic_roughness;
        for info in [pbr.base_color_texture.as_ref(), material.normal_texture.as_ref()] {
            if let Some(image) = image_of(document, info) {
                needs[image].pixels = true;
            }
        }
        for info in [pbr.metallic_roughness_texture.as_ref(), material.emissive_texture.as_ref()] {
            if let Some(image) = image_of(document, info) {
                needs[image].mean = true;
            }
        }
    }
    needs
}

/// By histogram: exact, and each of the 256 values is decoded once.
fn mean_of(image: &RgbaImage) -> Mean {
    let mut histogram = [[0_u64; 256]; 3];
    for pixel in image.pixels() {
        for (channel, counts) in histogram.iter_mut().enumerate() {
            counts[usize::from(pixel.0[channel])] += 1;
        }
    }
    let pixels = f64::from(image.width()) * f64::from(image.height());
    let mean = |decode: fn(f64) -> f64| {
        histogram.map(|counts| {
            let sum: f64 = counts.iter().enumerate().map(|(value, &n)| decode(value as f64 / 255.0) * n as f64).sum();
            (sum / pixels) as f32
        })
    };
    Mean { raw: mean(|value| value), linear: mean(linear_from_srgb) }
}

/// IEC 61966-2-1.
fn linear_from_srgb(value: f64) -> f64 {
    if value <= 0.04045 { value / 12.92 } else { ((value + 0.055) / 1.055).powf(2.4) }
}
