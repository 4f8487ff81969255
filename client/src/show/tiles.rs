//! A picture that is larger than what is drawn at once, in parts.

use camera::Pinhole;
use glam::DVec2;

/// Bytes of a pixel: sRGB with alpha.
pub const PIXEL_BYTES: usize = 4;
/// A side of a tile, with what is drawn around it.
const TILE_PX: u32 = 2048;
/// What is drawn around each tile and not taken, so that what depends on surroundings (antialiasing, ambient occlusion, filled holes) is alike on both sides of an
/// edge.
const AROUND_PX: u32 = 128;

/// A part of a picture, and what is drawn for it.
#[derive(Debug, Clone, Copy)]
pub struct Tile {
    /// Of what is drawn, in the picture.
    left_px: u32,
    top_px: u32,
    drawn_px: (u32, u32),
    /// Of what is taken, in what is drawn.
    from_px: (u32, u32),
    taken_px: (u32, u32),
}

/// Where a side is cut: beginning and length of what is drawn; beginning within that, and length, of what is taken.
fn cuts(side_px: u32) -> Vec<(u32, u32, u32, u32)> {
    if side_px <= TILE_PX {
        return vec![(0, side_px, 0, side_px)];
    }
    let step_px = TILE_PX - 2 * AROUND_PX;
    let cut = |index: u32| {
        let (begin, end) = (index * step_px, ((index + 1) * step_px).min(side_px));
        let (first, last) = (begin.saturating_sub(AROUND_PX), (end + AROUND_PX).min(side_px));
        (first, last - first, begin - first, end - begin)
    };
    (0..side_px.div_ceil(step_px)).map(cut).collect()
}

/// The parts of a picture, which cover each of its pixels once.
pub fn tiles((width_px, height_px): (u32, u32)) -> Vec<Tile> {
    let columns = cuts(width_px);
    let row = |(top_px, height, from_top, taken_height)| {
        columns.iter().map(move |&(left_px, width, from_left, taken_width)| Tile {
            left_px,
            top_px,
            drawn_px: (width, height),
            from_px: (from_left, from_top),
            taken_px: (taken_width, taken_height),
        })
    };
    cuts(height_px).into_iter().flat_map(row).collect()
}

impl Tile {
    /// What draws it, of the camera of the whole picture.
    pub fn camera(&self, whole: &Pinhole) -> Pinhole {
        let (width_px, height_px) = self.drawn_px;
        let corner_px = DVec2::new(f64::from(self.left_px), f64::from(self.top_px));
        Pinhole { width_px, height_px, centre_px: whole.centre_px - corner_px, ..*whole }
    }

    /// Puts what was drawn into the whole picture, which is so wide. Both are rows from the top.
    pub fn put(&self, drawn: &[u8], rgba: &mut [u8], width_px: u32) {
        let at = |x: u32, y: u32, width: u32| (y as usize * width as usize + x as usize) * PIXEL_BYTES;
        let bytes = self.taken_px.0 as usize * PIXEL_BYTES;
        for row in 0..self.taken_px.1 {
            let from = at(self.from_px.0, self.from_px.1 + row, self.drawn_px.0);
            let to = at(self.left_px + self.from_px.0, self.top_px + self.from_px.1 + row, width_px);
            rgba[to..to + bytes].copy_from_slice(&drawn[from..from + bytes]);
        }
    }
}

#[cfg(test)]
mod tests {
    use camera::Rigid;

    use super::*;

    #[test]
    fn tiles_make_up_a_picture() {
        for size_px in [(1, 1), (2048, 3), (2049, 1), (1800, 3600)] {
            let whole = Pinhole::symmetric(Rigid::IDENTITY, size_px, 1.0, 0.1);
            let (width_px, height_px) = (size_px.0 as usize, size_px.1 as usize);
            let mut rgba = vec![0; width_px * height_px * PIXEL_BYTES];
            for tile in tiles(size_px) {
                let camera = tile.camera(&whole);
                assert!(camera.width_px <= TILE_PX && camera.height_px <= TILE_PX, "{camera:?}");
                // Each pixel is where it is in the picture, by its ray.
                let pixel = |index: u32| {
                    let at = (index % camera.width_px, index / camera.width_px);
                    let ray = camera.ray_eye_from_image(f64::from(at.0) + 0.5, f64::from(at.1) + 0.5);
                    let place = whole.image_from_eye(ray).expect("in front");
                    let index = place.v.floor() as u32 * size_px.0 + place.u.floor() as u32;
                    (index + 1).to_le_bytes()
                };
                let drawn: Vec<u8> = (0..camera.width_px * camera.height_px).flat_map(pixel).collect();
                tile.put(&drawn, &mut rgba, size_px.0);
            }
            let found = rgba.chunks_exact(PIXEL_BYTES).map(|pixel| u32::from_le_bytes(pixel.try_into().expect("four")));
            assert!(found.eq(1..=size_px.0 * size_px.1), "{size_px:?}");
        }
    }
}
