//! The samples of an image by square parts of it, so that whole parts that a view does not see are passed over.
//!
//! Both a part's bounds and a view's pyramid are kept in the image of the patch: there a point `(u, v, w)` is mapped to the view's
//! eye, times `w`, linearly, so a box of the image lies beside the pyramid where all of its eight corners lie beside one side.

use std::ops::Range;

use bytemuck::{Pod, Zeroable};
use camera::Pinhole;
use glam::{DVec3, DVec4, Vec3};
use protocol::Mask;

/// Pixels a side: so small that a part at the rim of a view is mostly seen, and that asking for it costs little beside drawing it.
const SIDE_PX: u32 = 16;

/// A box in an image: pixels from the left and from the top, and inverse depth in 1/m.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub struct Bounds {
    low: Vec3,
    high: Vec3,
}

impl Bounds {
    /// The smallest box around some points `(u, v, w)`.
    pub fn around(points: impl IntoIterator<Item = Vec3>) -> Bounds {
        let nothing = Bounds { low: Vec3::INFINITY, high: Vec3::NEG_INFINITY };
        points.into_iter().fold(nothing, |all, point| all.and(Bounds { low: point, high: point }))
    }

    /// 1/m.
    pub(crate) fn nearest_w(&self) -> f64 {
        self.high.z.into()
    }

    pub(crate) fn and(self, other: Bounds) -> Bounds {
        Bounds { low: self.low.min(other.low), high: self.high.max(other.high) }
    }
}

/// A part of an image.
#[derive(Debug, Clone)]
struct Tile {
    /// Its samples, row by row, by their places in the image's planes.
    rows: Vec<Range<usize>>,
    bounds: Bounds,
}

/// See the module.
#[derive(Debug, Clone, Default)]
pub struct Tiles(Vec<Tile>);

impl Tiles {
    /// Of the samples of a mask, whose bounds are given by their places in the image's planes.
    pub fn new(mask: &Mask, bounds_of: impl Fn(usize) -> Bounds) -> Tiles {
        let columns = mask.size_px().0.div_ceil(SIDE_PX) as usize;
        let mut tiles: Vec<Tile> = Vec::new();
        // By column: the tile of the present rows, and the last of these that it has samples of.
        let mut present: Vec<Option<(usize, u32)>> = vec![None; columns];
        for (sample, (x, y)) in mask.occupied().enumerate() {
            let (column, bounds) = ((x / SIDE_PX) as usize, bounds_of(sample));
            match &mut present[column] {
                Some((tile, last)) if *last / SIDE_PX == y / SIDE_PX => {
                    let tile = &mut tiles[*tile];
                    tile.bounds = tile.bounds.and(bounds);
                    match tile.rows.last_mut().filter(|_| *last == y) {
                        Some(row) => row.end = sample + 1,
                        None => tile.rows.push(sample..sample + 1),
                    }
                    *last = y;
                }
                new => {
                    *new = Some((tiles.len(), y));
                    tiles.push(Tile { rows: std::iter::once(sample..sample + 1).collect(), bounds });
                }
            }
        }
        Tiles(tiles)
    }

    /// The samples of the parts that may be seen: for each part its rows. Of all of them without a pyramid.
    pub fn rows_in(&self, pyramid: Option<Pyramid>) -> impl Iterator<Item = &[Range<usize>]> {
        let is_seen = move |tile: &&Tile| pyramid.as_ref().is_none_or(|pyramid| pyramid.may_see(&tile.bounds));
        self.0.iter().filter(is_seen).map(|tile| tile.rows.as_slice())
    }
}

/// The pyramid that a view sees, in the image of another camera.
#[derive(Debug, Clone, Copy)]
pub struct Pyramid {
    /// Near plane and sides: a point is beside one where its dot product with `(u, v, w, 1)` is positive.
    beside: [DVec4; 5],
    /// The dot product is a point's depth in the view, times `w`.
    depth: DVec4,
}

impl Pyramid {
    /// What `view` sees, in the image of `camera`, where nothing moved since.
    pub fn new(camera: &Pinhole, view: &Pinhole) -> Pyramid {
        let view_from_eye = (view.world_from_eye.inverse() * camera.world_from_eye).to_affine();
        let [right, down, forward] = [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| view_from_eye.matrix3 * axis);
        let (u, v) = (right / camera.focal_px, down / camera.focal_px);
        let corner = forward - u * camera.centre_px.x - v * camera.centre_px.y;
        let row =
            |axis: DVec3| DVec4::new(axis.dot(u), axis.dot(v), axis.dot(view_from_eye.translation), axis.dot(corner));
        let (x, y, z) = (row(DVec3::X), row(DVec3::Y), row(DVec3::Z));
        let size_px = glam::DVec2::new(view.width_px.into(), view.height_px.into());
        let (low, high) = (-view.centre_px / view.focal_px, (size_px - view.centre_px) / view.focal_px);
        let near = DVec4::Z * view.near_m - z;
        Pyramid { beside: [near, low.x * z - x, x - high.x * z, low.y * z - y, y - high.y * z], depth: z }
    }

    pub(crate) fn may_see(&self, bounds: &Bounds) -> bool {
        self.beside.iter().all(|beside| least(*beside, bounds) <= 0.0)
    }

    /// The least depth that any point of a box has in the view, as a share of its depth in the other camera; below zero where it may lie behind the eye.
    pub(crate) fn least_depth_share(&self, bounds: &Bounds) -> f64 {
        least(self.depth, bounds)
    }
}

/// The least dot product of anything in a box, as `(u, v, w, 1)`.
fn least(row: DVec4, bounds: &Bounds) -> f64 {
    let (low, high) = (bounds.low.as_dvec3().extend(1.0), bounds.high.as_dvec3().extend(1.0));
    (row * low).min(row * high).element_sum()
}

#[cfg(test)]
mod tests {
    use camera::Rigid;

    use super::*;

    fn camera(direction: DVec3, fov_y_rad: f64) -> Pinhole {
        Pinhole::symmetric(Rigid::look_along(DVec3::ZERO, direction), (96, 96), fov_y_rad, 0.1)
    }

    #[test]
    fn parts_hold_every_sample_once_and_a_view_sees_its_own() {
        let mut mask = Mask::empty(96, 96);
        (0..96 * 96).filter(|at| at % 5 != 0).for_each(|at| mask.set(at % 96, at / 96, true));
        let pixels: Vec<(u32, u32)> = mask.occupied().collect();
        let centre = |sample: usize| Vec3::new(pixels[sample].0 as f32 + 0.5, pixels[sample].1 as f32 + 0.5, 0.5);
        let tiles = Tiles::new(&mask, |sample| Bounds::around([centre(sample)]));
        let samples = |pyramid: Option<Pyramid>| -> Vec<usize> {
            let mut samples: Vec<usize> = tiles.rows_in(pyramid).flatten().flat_map(Range::clone).collect();
            samples.sort_unstable();
            samples
        };
        assert!(samples(None).into_iter().eq(0..pixels.len()));
        let whole = camera(DVec3::NEG_Z, 1.5);
        let seen = |direction, fov_y_rad| samples(Some(Pyramid::new(&whole, &camera(direction, fov_y_rad))));
        assert_eq!(seen(DVec3::NEG_Z, 1.5).len(), pixels.len());
        assert!(seen(DVec3::Z, 1.5).is_empty());
        let narrow = seen(DVec3::new(0.3, 0.1, -1.0), 0.4);
        let looks_at = |sample: &usize| {
            let view = camera(DVec3::new(0.3, 0.1, -1.0), 0.4);
            let [u, v, w] = centre(*sample).as_dvec3().to_array();
            let world = whole.world_from_image(camera::ImagePoint { u, v, w });
            view.image_from_world(world).is_some_and(|at| view.contains(at))
        };
        let inside: Vec<usize> = (0..pixels.len()).filter(looks_at).collect();
        assert!(inside.len() > 100 && inside.iter().all(|sample| narrow.contains(sample)));
        assert!(narrow.len() < 8 * inside.len(), "{} for {}", narrow.len(), inside.len());
    }
}
