//! Images of nothing, of one sample, and of one depth.

use anyhow::ensure;
use glam::DVec3;
use protocol::{DepthImage, Mask};

use super::stiff::Stiff;
use crate::topics::stability::build::{Placed, at, scene, square};
use crate::topics::stability::case::Case;
use crate::topics::stability::check::Check;
use crate::topics::stability::judge::Errors;
use crate::topics::stability::lab::Lab;
use crate::topics::stability::way::{Shown, shown_of};

pub(super) const CASES: &[Stiff] = &[
    Stiff { name: "images without a sample", judge: |lab| few(lab, 0) },
    Stiff { name: "one image of one sample", judge: |lab| few(lab, 1) },
    Stiff { name: "a depth range of one value", judge: one_depth },
];

/// A wall that faces the eye, so that all of it lies in one depth.
fn wall() -> Case {
    let wall = Placed { mesh: square(), world_from_mesh: at(DVec3::ZERO, 1.0), colour: [0.5, 0.4, 0.3] };
    Case::look(scene("wall", vec![wall]), DVec3::new(0.0, 0.0, 2.0), DVec3::ZERO, 0.01)
}

fn covered(shown: &[Shown]) -> usize {
    shown.iter().flat_map(|shown| &shown.drawn.w).filter(|w| **w > 0.0).count()
}

/// Only so many samples are sent, of one image; all others are empty.
fn few(lab: &mut Lab, samples: usize) -> anyhow::Result<Vec<Check>> {
    let cut = |images: Vec<DepthImage>| {
        let images = images.into_iter().enumerate();
        images.map(|(place, image)| only(image, if place == 0 { samples } else { 0 })).collect()
    };
    let shown = shown_of(lab, &wall(), cut)?;
    // A sample is a pixel of an image that sees more than the picture does: with its rim it shows in up to four pixels.
    let most = (4 * samples * shown.len()) as f64;
    let from = "a sample is less than a pixel of the picture wide, and a square of that size lies over the middles of four at most";
    let few = Check::new("pixels with a surface in both pictures", (most, Some(covered(&shown) as f64)), "", from);
    Ok(vec![Check::unfit(Some(Errors::of(&shown).unfit.values as f64)), few])
}

/// An image with its samples from the middle on, so many at most.
fn only(image: DepthImage, samples: usize) -> DepthImage {
    let middle = image.sample_count() / 2;
    let kept = middle..(middle + samples).min(image.sample_count());
    let (width_px, height_px) = image.mask.size_px();
    let mut mask = Mask::empty(width_px, height_px);
    image
        .mask
        .occupied()
        .enumerate()
        .filter(|(place, _)| kept.contains(place))
        .for_each(|(_, (x, y))| mask.set(x, y, true));
    fn of<T: Clone>(plane: &[T], kept: &std::ops::Range<usize>) -> Vec<T> {
        plane.get(kept.clone()).map(<[T]>::to_vec).unwrap_or_default()
    }
    DepthImage {
        mask,
        depth: of(&image.depth, &kept),
        normal: of(&image.normal, &kept),
        normal_rest: of(&image.normal_rest, &kept),
        colour_rest: of(&image.colour_rest, &kept),
        share: of(&image.share, &kept),
        ends: of(&image.ends, &kept),
        colour: of(&image.colour, &kept),
        object: of(&image.object, &kept),
        material: of(&image.material, &kept),
        ..image
    }
}

fn one_depth(lab: &mut Lab) -> anyhow::Result<Vec<Check>> {
    let mut steps = Vec::new();
    let shown = shown_of(lab, &wall(), |images| {
        steps.extend(images.iter().filter(|image| image.sample_count() > 0).map(|image| image.depth_scale.w_step));
        images
    })?;
    ensure!(steps.contains(&0.0), "no image of the wall is of one depth: steps of {steps:?}");
    Ok(Check::of_flat(&Errors::of(&shown)))
}
