//! What people type, parsed.

/// A size such as `640x360`, each side 7 to 16,384 pixels: the window of SSIM, and the largest texture of the adapters we
/// know.
pub fn size(text: &str) -> Result<(u32, u32), String> {
    let sides = text.split_once(['x', 'X']).and_then(|(w, h)| Some((w.parse().ok()?, h.parse().ok()?)));
    match sides {
        Some((width, height)) if (7..=16_384).contains(&width) && (7..=16_384).contains(&height) => Ok((width, height)),
        _ => Err("a size is WIDTHxHEIGHT in pixels, for example 640x360, each from 7 to 16384".to_owned()),
    }
}

/// A vertical field of view in degrees, above 0 and below 180.
pub fn fov_y_deg(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(degrees) if degrees > 0.0 && degrees < 180.0 => Ok(degrees),
        _ => Err("a field of view lies above 0 and below 180 degrees".to_owned()),
    }
}

/// A factor above 0.
pub fn scale(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(scale) if scale > 0.0 && scale.is_finite() => Ok(scale),
        _ => Err("a scale is a number above 0".to_owned()),
    }
}

/// A time of a tenth of a second to ten minutes.
pub fn seconds(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(seconds) if (0.1..=600.0).contains(&seconds) => Ok(seconds),
        _ => Err("a time is 0.1 to 600 seconds".to_owned()),
    }
}

/// `plain`, `full`, `flat` or `flat-lit`.
pub fn look(text: &str) -> Result<protocol::Look, String> {
    match text {
        "plain" => Ok(protocol::Look::Plain),
        "full" => Ok(protocol::Look::Full),
        "flat" => Ok(protocol::Look::Flat),
        "flat-lit" => Ok(protocol::Look::FlatLit),
        _ => Err("the look is plain, full, flat or flat-lit".to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_checked() {
        assert_eq!(size("640x360"), Ok((640, 360)));
        for wrong in ["640", "x360", "0x7", "640x360x2", "99999x9", "-5x9", ""] {
            assert!(size(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn angles_scales_and_times_are_checked() {
        assert_eq!(seconds("18"), Ok(18.0));
        assert!(seconds("0").is_err() && seconds("NaN").is_err() && seconds("1e9").is_err());
        assert_eq!(fov_y_deg("60"), Ok(60.0));
        assert!(fov_y_deg("180").is_err() && fov_y_deg("NaN").is_err() && scale("0").is_err() && scale("inf").is_err());
    }
}
