//! The images that materials need, decoded.

use image::RgbaImage;

use super::buffers::{Buffers, UriReader};
use super::document::{Document, TextureInfo};
use crate::load::{LoadError, Request, Warnings, texture};

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
) -> Vec<Option<RgbaImage>> {
    let needs = needs(document);
    let mut files: Vec<Option<Vec<u8>>> = vec![None; document.images.len()];
    for (index, image) in document.images.iter().enumerate() {
        if !needs[index] {
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
    let mut images = Vec::with_capacity(decoded.len());
    for (index, image) in decoded.into_iter().enumerate() {
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

/// By image, whether some material that is shown needs it.
fn needs(document: &Document) -> Vec<bool> {
    let mut needs = vec![false; document.images.len()];
    let shown = document.shown_materials();
    let materials = shown.iter().filter_map(|&material| document.materials.get(material));
    let used = materials.flat_map(|material| material.textures().map(|(_, info)| info));
    used.filter_map(|info| image_of(document, Some(info))).for_each(|image| needs[image] = true);
    needs
}
