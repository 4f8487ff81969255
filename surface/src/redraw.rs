//! Samples of a patch that are drawn anew where some of them were trimmed, so that a trim costs by itself and not by its patch.
//!
//! A trimmed sample shares its corners with the eight around it: their quads change. A corner depends on the planes of its four samples
//! ([`crate::corners::averaged`]), and each of those on the samples next to it ([`crate::corners::planes`]). So a mesh of everything within three
//! pixels has these quads as the mesh of the whole patch would.

use protocol::held::HeldPatch;
use protocol::image::Ranks;
use protocol::{Mask, Patch};

use crate::mesh::{MeshOptions, QUAD_INDICES, Vertex, build};

/// Of a quad.
pub const CORNERS: usize = 4;
/// Pixels to the samples that a corner is shared with ...
const SHARED_PX: u32 = 1;
/// ... and to all that their quads depend on.
const KNOWN_PX: u32 = 3;

/// The quad of a sample as it is now: its pixel, and its corners as [`crate::ProvokingVertex::corners`] has them, of which the first bears what is flat.
#[derive(Debug, Clone, Copy)]
pub struct Redrawn {
    pub pixel: (u16, u16),
    pub corners: [Vertex; CORNERS],
}

/// The quads that change where samples of a patch are trimmed.
pub fn around(held: &HeldPatch, pixels: &[(u16, u16)], options: &MeshOptions<'_>) -> Vec<Redrawn> {
    let image = held.patch.image.only(&squares(&held.patch.image.mask, pixels, KNOWN_PX));
    let (all, ranks) = (&held.patch.image.mask, Ranks::new(&held.patch.image.mask));
    let pixel = |(x, y): (u32, u32)| (x as u16, y as u16);
    let trim = |(x, y): (u16, u16)| ranks.of(all, x, y).and_then(|rank| held.trims.get(rank)).copied().unwrap_or(0);
    let few = HeldPatch {
        trims: image.mask.occupied().map(pixel).map(trim).collect(),
        patch: Patch {
            id: held.patch.id,
            purpose: held.patch.purpose,
            capture_time_s: held.patch.capture_time_s,
            objects: held.patch.objects.clone(),
            image,
        },
    };
    let mesh = build(&few, options);
    let redrawn = squares(all, pixels, SHARED_PX);
    let quads = few.patch.image.mask.occupied().zip(mesh.indices.chunks_exact(QUAD_INDICES));
    quads
        .filter(|((x, y), _)| redrawn.get(*x, *y))
        .map(|(at, quad)| Redrawn {
            pixel: pixel(at),
            corners: options.provoking.corners(quad).map(|corner| mesh.vertices[corner as usize]),
        })
        .collect()
}

/// What of a mask lies within so many pixels of some.
fn squares(mask: &Mask, pixels: &[(u16, u16)], radius_px: u32) -> Mask {
    let (width_px, height_px) = mask.size_px();
    let mut within = Mask::empty(width_px, height_px);
    let span = |at: u16, length_px: u32| {
        let at = u32::from(at);
        at.saturating_sub(radius_px)..(at + radius_px + 1).min(length_px)
    };
    for &(x, y) in pixels {
        for row in span(y, height_px) {
            span(x, width_px).filter(|&column| mask.get(column, row)).for_each(|column| within.set(column, row, true));
        }
    }
    within
}
