//! Values that no buffer of a frame may hold.
//!
//! Every texture that a client draws into is read back. Floats must be numbers, and no inverse depth or depth may lie below 0, no depth, share or count of
//! the sum of rays be infinite. Bytes and packed normals are numbers whatever they hold: what they say is judged by colours. Where there is a surface,
//! though, it must be marked in the bytes of its colour too.

use gpu::{Gpu, Readback, ReadbackError};
use wgpu::TextureFormat;

use crate::client_view::ClientView;

/// How many values of the last frame's buffers are not fit, and how many buffers there were.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Unfit {
    pub values: usize,
    pub buffers: usize,
}

impl Unfit {
    pub fn of(gpu: &Gpu, view: &ClientView) -> Result<Unfit, ReadbackError> {
        let buffers = view.buffers();
        let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let mut readback = Readback::default();
        let slot = |&(name, texture): &(&'static str, &wgpu::Texture)| {
            (name, texture.format(), readback.texture(texture, 0, (texture.width(), texture.height())))
        };
        let slots: Vec<_> = buffers.iter().map(slot).collect();
        let encoded = readback.encode(gpu, &mut encoder);
        gpu.queue.submit([encoder.finish()]);
        let mapped = encoded.map().wait(gpu)?;
        let mut unfit = Unfit { values: 0, buffers: slots.len() };
        let (mut w, mut colour) = (Vec::new(), Vec::new());
        for (name, format, slot) in slots {
            match (name, format) {
                ("surface w", _) => w = mapped.values::<f32>(slot),
                ("surface colour", _) => colour = mapped.values::<[u8; 4]>(slot),
                _ => {}
            }
            unfit.values += match format {
                TextureFormat::R32Float | TextureFormat::Depth32Float => {
                    let values: Vec<f32> = mapped.values(slot);
                    values.iter().filter(|value| !(value.is_finite() && **value >= 0.0)).count()
                }
                TextureFormat::Rg32Float | TextureFormat::Rgba32Float => {
                    let values: Vec<f32> = mapped.values(slot);
                    values.iter().filter(|value| !value.is_finite()).count()
                }
                TextureFormat::Rgba16Float => {
                    let values: Vec<u16> = mapped.values(slot);
                    values.iter().filter(|value| !is_finite_half(**value)).count()
                }
                _ => 0,
            };
        }
        unfit.values += w.iter().zip(&colour).filter(|(w, colour)| **w > 0.0 && colour[3] == 0).count();
        Ok(unfit)
    }

    pub fn add(&mut self, other: Unfit) {
        self.values += other.values;
        self.buffers = self.buffers.max(other.buffers);
    }
}

/// Whether a float of 16 bits is a number: all bits of its exponent set say otherwise (IEEE 754).
fn is_finite_half(bits: u16) -> bool {
    const EXPONENT: u16 = 0x7c00;
    bits & EXPONENT != EXPONENT
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn halves_that_are_no_numbers_are_told() {
        // 1, -2, the greatest, zero; infinity, its negative, no number.
        assert!([0x3c00, 0xc000, 0x7bff, 0].into_iter().all(is_finite_half));
        assert!(![0x7c00, 0xfc00, 0x7e00].into_iter().any(is_finite_half));
    }
}
