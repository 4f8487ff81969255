//! Which held sample each pixel shows.

use protocol::PatchId;

/// A pixel of an [`AddressView`], as the shader writes it; all zero where nothing is held.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, bytemuck::Pod, bytemuck::Zeroable)]
pub struct AddressTexel {
    /// [`PatchId`], from 1.
    pub patch: u32,
    /// The sample's pixel in its patch: x in the low half, y in the high one.
    pub pixel: u32,
    /// Octahedral normal in world space now in the low half (8 + 8 bits), object in the high one.
    pub normal_object: u32,
    /// Bits of the f32 inverse depth `1/z` in 1/m of the surface at the pixel's centre.
    pub w_bits: u32,
}

impl AddressTexel {
    /// The patch and the sample's `(x, y)` in it; `None` where nothing is held.
    pub fn address(&self) -> Option<(PatchId, u16, u16)> {
        (self.patch != 0).then_some((PatchId(self.patch), self.pixel as u16, (self.pixel >> 16) as u16))
    }

    /// The object.
    pub fn object(&self) -> u16 {
        (self.normal_object >> 16) as u16
    }

    /// Octahedral code of the surface's normal, in world space now.
    pub fn normal_code(&self) -> [u8; 2] {
        (self.normal_object as u16).to_le_bytes()
    }

    /// Inverse depth of the surface, 1/m; 0 where nothing is held.
    pub fn w(&self) -> f32 {
        f32::from_bits(self.w_bits)
    }
}

/// What a view shows of what is held, row-major.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct AddressView {
    /// Width and height.
    pub size_px: (u32, u32),
    /// One a pixel.
    pub texels: Vec<AddressTexel>,
}

impl AddressView {
    /// Nothing is held.
    pub fn empty(size_px: (u32, u32)) -> AddressView {
        AddressView { size_px, texels: vec![AddressTexel::default(); size_px.0 as usize * size_px.1 as usize] }
    }
}
