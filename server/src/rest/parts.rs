//! What a pixel shows in parts: up to [`LAYERS`] samples, each with the share of the pixel that it covers.
//!
//! A picture with one sample a pixel has stairs at every outline. Sixteen samples a pixel, lit one by one and averaged, have none, but are
//! sixteen pictures. Most of the sixteen are alike: what is of one object and material and faces the same way is lit alike, so it goes
//! as one sample with its mean colour, and how many of the sixteen it stands for. (Carpenter, The A-buffer, an antialiased hidden surface
//! method, 1984, keeps fragments with masks; shares are enough where nothing is drawn over them any more.) The first image of a view holds
//! what covers the most of each pixel, the others what is beside it; most pixels are whole.

use camera::{Camera, Pinhole};
use glam::Vec3;
use protocol::image::{
    colour_quarters, colour_with_rest, octahedral_code, octahedral_normal_with_rest, octahedral_rest,
};
use protocol::{DepthImage, Mask};
use rayon::prelude::*;

use crate::discretize::{Capture, DepthPrecision, Planes};
use crate::render::Kinds;

/// Images of a view at most. What a pixel shows beyond is added to what is most like it.
pub const LAYERS: usize = 4;
/// Samples of a pixel along each side.
const SIDE: u32 = 4;
/// Samples of a pixel.
pub(super) const SAMPLES: u32 = SIDE * SIDE;
/// What each of them is of the pixel.
const SHARE_OF_SAMPLE: u8 = DepthImage::WHOLE / SAMPLES as u8;
/// Least cosine between normals that are lit as one: 18 degrees apart, a light from the side is a twentieth off their mean at most.
const NORMAL_COS: f32 = 0.95;

/// The camera that takes all samples of a view's pixels.
pub fn fine(view: &Pinhole) -> Pinhole {
    Pinhole {
        width_px: SIDE * view.width_px,
        height_px: SIDE * view.height_px,
        focal_px: f64::from(SIDE) * view.focal_px,
        centre_px: f64::from(SIDE) * view.centre_px,
        ..*view
    }
}

/// The images of a view, of a capture by its [`fine`] camera; those without a sample are left out, but the first.
pub fn layers(view: &Pinhole, fine: &Capture, kinds: &Kinds, precision: DepthPrecision) -> Vec<DepthImage> {
    let width = view.width_px as usize;
    let linear: Vec<f32> = (0..1024).map(|quarters| linear_from_srgb(quarters as f32 / 1020.0)).collect();
    let pixels: Vec<Pixel> = (0..width * view.height_px as usize)
        .into_par_iter()
        .with_min_len(1024)
        .map(|index| Pixel::of(fine, kinds, &linear, (index % width, index / width)))
        .collect();
    let layers = (0..LAYERS).map_while(|layer| {
        let is_needed = layer == 0 || pixels.iter().any(|pixel| pixel.count > layer);
        is_needed.then(|| image(view, &pixels, layer, precision))
    });
    layers.collect()
}

/// One image of a view.
fn image(view: &Pinhole, pixels: &[Pixel], layer: usize, precision: DepthPrecision) -> DepthImage {
    let parts: Vec<Option<&Part>> = pixels.iter().map(|pixel| pixel.parts[..pixel.count].get(layer)).collect();
    let shown: Vec<Shown> = parts.iter().map(|part| part.map(Part::shown).unwrap_or_default()).collect();
    let mut mask = Mask::empty(view.width_px, view.height_px);
    let width = view.width_px as usize;
    parts.iter().enumerate().filter(|(_, part)| part.is_some()).for_each(|(index, _)| {
        mask.set((index % width) as u32, (index / width) as u32, true);
    });
    let planes = Planes {
        ids: &shown.iter().map(|shown| shown.ids).collect::<Vec<_>>(),
        colour: &shown.iter().map(|shown| shown.colour).collect::<Vec<_>>(),
        rests: &shown.iter().map(|shown| shown.rests).collect::<Vec<_>>(),
        w: &|index| shown[index].w,
    };
    let mut image = planes.depth_image(Camera::Pinhole(*view), mask, precision);
    let share: Vec<u8> = parts.iter().flatten().map(|part| part.samples * SHARE_OF_SAMPLE).collect();
    if share.iter().any(|&share| share < DepthImage::WHOLE) {
        image.share = share;
    }
    image
}

/// The parts of a pixel, the largest first.
#[derive(Debug, Clone, Copy, Default)]
struct Pixel {
    parts: [Part; LAYERS],
    count: usize,
}

/// Samples that are lit as one. Sums over them.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
struct Part {
    samples: u8,
    object: u16,
    material: u8,
    /// The material of each sample.
    codes: [u8; (SIDE * SIDE) as usize],
    reflects: bool,
    normal: Vec3,
    linear: Vec3,
    w: f32,
}

/// A part as planes hold it.
#[derive(Debug, Clone, Copy, Default)]
struct Shown {
    ids: [u32; 2],
    colour: [u8; 4],
    rests: [u8; 2],
    w: f32,
}

impl Pixel {
    fn of(fine: &Capture, kinds: &Kinds, linear: &[f32], (x, y): (usize, usize)) -> Pixel {
        let (side, width) = (SIDE as usize, fine.camera.width_px as usize);
        let rows = (side * y..side * (y + 1)).flat_map(|row| (0..side).map(move |column| row * width + column));
        let samples = rows.map(|first| first + side * x).filter(|&index| fine.ids[index][0] != 0);
        // As many as there may be before any are merged.
        let mut parts = [Part::default(); (SIDE * SIDE) as usize];
        let mut count = 0;
        for sample in samples.map(|index| Part::sample(fine, linear, index)) {
            match parts[..count].iter_mut().find(|part| part.is_lit_as(&sample, kinds)) {
                Some(part) => part.add(&sample),
                None => {
                    parts[count] = sample;
                    count += 1;
                }
            }
        }
        let parts = &mut parts[..count];
        parts.iter_mut().for_each(|part| part.material = kinds.mean(&part.codes[..usize::from(part.samples)]));
        parts.sort_by_key(|part| std::cmp::Reverse(part.samples));
        let mut pixel = Pixel { count: count.min(LAYERS), ..Pixel::default() };
        pixel.parts[..pixel.count].copy_from_slice(&parts[..pixel.count]);
        parts[pixel.count..].iter().for_each(|part| pixel.absorb(part));
        pixel
    }

    /// Adds a part that has no place of its own to the one whose colour is nearest, of its object if there is one.
    fn absorb(&mut self, part: &Part) {
        let unlike = |other: &Part| (other.object != part.object, other.colour().distance_squared(part.colour()));
        let others = self.parts[..self.count].iter_mut();
        if let Some(nearest) = others.min_by(|a, b| {
            let (a, b) = (unlike(a), unlike(b));
            a.0.cmp(&b.0).then(a.1.total_cmp(&b.1))
        }) {
            nearest.samples += part.samples;
            nearest.linear += part.linear;
            nearest.w += nearest.w / f32::from(nearest.samples - part.samples) * f32::from(part.samples);
        }
    }
}

impl Part {
    fn sample(fine: &Capture, linear: &[f32], index: usize) -> Part {
        let ([r, g, b, material], [normal_rest, colour_rest]) = (fine.colour[index], fine.rests[index]);
        Part {
            samples: 1,
            object: fine.object(index),
            material,
            codes: [material; (SIDE * SIDE) as usize],
            reflects: normal_rest != 0,
            normal: octahedral_normal_with_rest(fine.normal_code(index), normal_rest),
            linear: Vec3::from(colour_quarters([r, g, b], colour_rest).map(|quarters| linear[usize::from(quarters)])),
            w: fine.w(index),
        }
    }

    fn is_lit_as(&self, other: &Part, kinds: &Kinds) -> bool {
        self.object == other.object
            && kinds.are_one(self.material, other.material)
            && self.normal.dot(other.normal) >= NORMAL_COS * self.normal.length()
    }

    /// Adds a sample.
    fn add(&mut self, other: &Part) {
        self.codes[usize::from(self.samples)] = other.material;
        self.samples += other.samples;
        self.reflects |= other.reflects;
        self.normal += other.normal;
        self.linear += other.linear;
        self.w += other.w;
    }

    /// Mean, in linear light.
    fn colour(&self) -> Vec3 {
        self.linear / f32::from(self.samples)
    }

    fn shown(&self) -> Shown {
        let [x, y] = octahedral_code(self.normal);
        let ([r, g, b], colour_rest) = colour_with_rest(self.colour().to_array().map(srgb_from_linear));
        Shown {
            ids: [1, u32::from(self.object) | u32::from(u16::from_le_bytes([x, y])) << 16],
            colour: [r, g, b, self.material],
            rests: [if self.reflects { octahedral_rest(self.normal) } else { 0 }, colour_rest],
            w: self.w / f32::from(self.samples),
        }
    }
}

fn linear_from_srgb(c: f32) -> f32 {
    if c <= 0.04045 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }
}

fn srgb_from_linear(c: f32) -> f32 {
    if c <= 0.003_130_8 { 12.92 * c } else { 1.055 * c.powf(1.0 / 2.4) - 0.055 }
}

#[cfg(test)]
mod tests {
    use camera::Rigid;

    use super::*;

    const WHITE: [u8; 4] = [255, 255, 255, 0];
    const GREY: [u8; 4] = [128, 128, 128, 0];
    const UP: u32 = 0x7f_fe_00_00;

    /// Of a view of two pixels: by column and row of the samples an object, its colour, and depth; none for object 0.
    fn capture(view: &Pinhole, sample: impl Fn(u32, u32) -> (u16, [u8; 4])) -> Capture {
        let camera = fine(view);
        let places = (0..camera.height_px).flat_map(|y| (0..camera.width_px).map(move |x| (x, y)));
        let samples: Vec<_> = places.map(|(x, y)| sample(x, y)).collect();
        Capture {
            camera,
            ids: samples.iter().map(|&(object, _)| [u32::from(object), u32::from(object) | UP]).collect(),
            colour: samples.iter().map(|&(_, colour)| colour).collect(),
            rests: vec![[0; 2]; samples.len()],
            hides: Vec::new(),
            depth: vec![0.5; samples.len()],
            ends: Vec::new(),
            gpu_s: None,
        }
    }

    fn view() -> Pinhole {
        Pinhole::symmetric(Rigid::IDENTITY, (2, 1), 1.0, 0.1)
    }

    #[test]
    fn an_outline_is_two_parts_and_the_larger_comes_first() {
        let view = view();
        // The left pixel is whole; of the right one 3 of 4 columns are of object 2, the last of object 1.
        let of = |x| if (4..7).contains(&x) { (2, GREY) } else { (1, WHITE) };
        let layers = layers(&view, &capture(&view, |x, _| of(x)), &Kinds::default(), DepthPrecision::Finest);
        let planes: Vec<_> =
            layers.iter().map(|image| (image.object.clone(), image.share.clone(), image.colour.clone())).collect();
        let first = (vec![1, 2], vec![64, 48], vec![[255; 3], [128; 3]]);
        assert_eq!(planes, [first, (vec![1], vec![16], vec![[255; 3]])]);
        assert!(layers[1].mask.get(1, 0) && !layers[1].mask.get(0, 0));
    }

    #[test]
    fn what_covers_all_has_no_shares_and_what_ends_in_nothing_has() {
        let view = view();
        let whole = layers(&view, &capture(&view, |_, _| (1, WHITE)), &Kinds::default(), DepthPrecision::Finest);
        assert!(whole.len() == 1 && whole[0].share.is_empty());
        let ends =
            layers(&view, &capture(&view, |x, _| (u16::from(x < 6), WHITE)), &Kinds::default(), DepthPrecision::Finest);
        assert_eq!((ends.len(), &ends[0].share[..]), (1, &[64, 32][..]));
        let nothing = layers(&view, &capture(&view, |_, _| (0, WHITE)), &Kinds::default(), DepthPrecision::Finest);
        assert_eq!((nothing.len(), nothing[0].sample_count()), (1, 0), "it says that nothing is seen");
    }

    #[test]
    fn a_texture_goes_by_its_mean_in_linear_light() {
        let view = view();
        let striped = capture(&view, |x, _| (1, if x % 2 == 0 { WHITE } else { [0, 0, 0, 0] }));
        let layers = layers(&view, &striped, &Kinds::default(), DepthPrecision::Finest);
        let quarters = colour_quarters(layers[0].colour[0], layers[0].colour_rest[0]);
        assert_eq!((layers.len(), quarters), (1, [750; 3]), "half of white is 187.5, not 128");
    }

    #[test]
    fn shares_add_up_however_many_objects_a_pixel_shows() {
        let view = view();
        let many = capture(&view, |x, y| ((1 + x / 4 + x % 4 + 4 * (y % 4)) as u16, [(16 * x) as u8, 9, 9, 0]));
        let layers = layers(&view, &many, &Kinds::default(), DepthPrecision::Finest);
        assert_eq!(layers.len(), LAYERS);
        for pixel in 0..2 {
            let shares = layers.iter().map(|image| u32::from(image.share[pixel])).sum::<u32>();
            assert_eq!(shares, u32::from(DepthImage::WHOLE));
        }
    }
}
