//! Textures: colours decoded to linear light first, then read between four texels, without mip-maps.

use glam::{DVec2, DVec4};
use scene::Texture;
use scene::model::Wrap;

use super::srgb::linear_from_srgb;

/// A texture: colours in linear light, or numbers.
pub(super) struct LinearTexture {
    size_px: [i64; 2],
    wrap: [Wrap; 2],
    nearest: bool,
    texels: Vec<DVec4>,
}

impl LinearTexture {
    pub fn new(texture: &Texture, is_colour: bool) -> LinearTexture {
        let decode = |number: f64| if is_colour { linear_from_srgb(number) } else { number };
        let linear: [f64; 256] = std::array::from_fn(|code| decode(code as f64 / 255.0));
        let texel = |rgba: &[u8]| {
            let [r, g, b] = [0, 1, 2].map(|channel| linear[usize::from(rgba[channel])]);
            DVec4::new(r, g, b, f64::from(rgba[3]) / 255.0)
        };
        LinearTexture {
            size_px: [texture.width_px.into(), texture.height_px.into()],
            wrap: texture.wrap,
            nearest: texture.nearest,
            texels: texture.rgba.chunks_exact(4).map(texel).collect(),
        }
    }

    /// Its four channels at texture coordinates, from the top left.
    pub fn at(&self, uv: DVec2) -> DVec4 {
        let size_px = DVec2::new(self.size_px[0] as f64, self.size_px[1] as f64);
        let place_px = uv * size_px;
        if self.nearest {
            return self.texel(place_px.floor());
        }
        // Texels lie at +0.5.
        let first = (place_px - 0.5).floor();
        let share = place_px - 0.5 - first;
        let row = |y: f64| {
            let [left, right] = [0.0, 1.0].map(|x| self.texel(first + DVec2::new(x, y)));
            left.lerp(right, share.x)
        };
        row(0.0).lerp(row(1.0), share.y)
    }

    fn texel(&self, place_px: DVec2) -> DVec4 {
        let [x, y] = [0, 1].map(|axis| wrapped(place_px[axis] as i64, self.size_px[axis], self.wrap[axis]));
        self.texels[(y * self.size_px[0] + x) as usize]
    }
}

fn wrapped(place: i64, size: i64, wrap: Wrap) -> i64 {
    match wrap {
        Wrap::Repeat => place.rem_euclid(size),
        Wrap::Clamp => place.clamp(0, size - 1),
        Wrap::Mirror => {
            let twice = place.rem_euclid(2 * size);
            twice.min(2 * size - 1 - twice)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn coordinates_past_the_edge_are_read_as_the_wrap_says() {
        let read = |wrap| (-3..6).map(|place| wrapped(place, 3, wrap)).collect::<Vec<_>>();
        assert_eq!(read(Wrap::Repeat), [0, 1, 2, 0, 1, 2, 0, 1, 2]);
        assert_eq!(read(Wrap::Mirror), [2, 1, 0, 0, 1, 2, 2, 1, 0]);
        assert_eq!(read(Wrap::Clamp), [0, 0, 0, 0, 1, 2, 2, 2, 2]);
    }

    #[test]
    fn black_and_white_mix_in_linear_light() {
        let rgba = vec![0, 0, 0, 255, 255, 255, 255, 255];
        let pair = Texture { width_px: 2, height_px: 1, rgba, wrap: [Wrap::Clamp; 2], nearest: false };
        let texture = LinearTexture::new(&pair, true);
        assert_eq!(texture.at(DVec2::new(0.25, 0.5)), DVec4::new(0.0, 0.0, 0.0, 1.0));
        assert!((texture.at(DVec2::new(0.5, 0.5)).x - 0.5).abs() < 1e-12);
        assert!(
            (LinearTexture::new(&Texture { nearest: true, ..pair }, true).at(DVec2::new(0.51, 0.5)).x - 1.0).abs()
                < 1e-12
        );
    }
}
