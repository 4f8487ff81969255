//! The transfer to the screen, and back.

use glam::DVec3;

/// The sRGB transfer function of IEC 61966-2-1, to linear light.
pub(super) fn linear_from_srgb(encoded: f64) -> f64 {
    if encoded <= 0.04045 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) }
}

/// The same transfer function, from linear light; both from 0 to 1.
pub(super) fn srgb_from_linear(linear: f64) -> f64 {
    let linear = linear.clamp(0.0, 1.0);
    if linear <= 0.0031308 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
}

/// The code of a linear colour on the screen.
pub(super) fn code_from_linear(linear: DVec3) -> [u8; 3] {
    linear.to_array().map(|channel| (srgb_from_linear(channel) * 255.0).round() as u8)
}
