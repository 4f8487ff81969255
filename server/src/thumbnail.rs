//! A small picture of a scene, as who comes first sees it, for who chooses among several.

use camera::Pinhole;
use image::codecs::jpeg::JpegEncoder;
use image::{ExtendedColorType, ImageEncoder};
use scene::Scene;

use crate::imager::Imager;
use crate::start;

/// Twice as many pixels a side as the page's cards have, for finer screens.
const SIZE_PX: (u32, u32) = (352, 220);
const FOV_Y_RAD: f64 = std::f64::consts::FRAC_PI_3;
const QUALITY: u8 = 80;

/// A JPEG of a scene at its start; `None` where its imager draws none. That there is none is no reason not to show the scene.
pub(crate) fn of(scene: &Scene, imager: &mut dyn Imager) -> Option<Vec<u8>> {
    let view = Pinhole::symmetric(start::start_pose(scene), SIZE_PX, FOV_Y_RAD, start::near_m(scene));
    let drawn = imager.picture(&scene.at(0.0), &view);
    let pixels = drawn.inspect_err(|error| tracing::warn!("{} has no thumbnail: {error}", scene.name)).ok()??;
    let rgb: Vec<u8> = pixels.iter().flat_map(|&[red, green, blue, _]| [red, green, blue]).collect();
    let mut bytes = Vec::new();
    let encoder = JpegEncoder::new_with_quality(&mut bytes, QUALITY);
    encoder.write_image(&rgb, SIZE_PX.0, SIZE_PX.1, ExtendedColorType::Rgb8).ok()?;
    Some(bytes)
}
