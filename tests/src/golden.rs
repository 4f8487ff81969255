//! Golden images: what a picture must look like, kept small in `tests/golden`.
//!
//! One policy for all: a pixel differs when a channel is off by more than [`CHANNEL_TOLERANCE`], and at most
//! [`DIFFERING_SHARE`] of the pixels may differ. Rasterizers may settle edge pixels differently; nothing else may change.
//! A missing reference fails. With `VANTAGE_BLESS=1` the references are written anew instead.

use std::path::{Path, PathBuf};

use anyhow::{Context, bail, ensure};
use image::RgbaImage;

/// Of 255: one step of an 8-bit texture filter on either side, after the sRGB curve's steepest part (slope 12.92).
pub const CHANNEL_TOLERANCE: u8 = 13;
/// Share of pixels: a silhouette's pixels in a picture of 128 pixels are about one in fifty, of which a fifth may flip.
pub const DIFFERING_SHARE: f64 = 0.004;

/// Compares a picture with `tests/golden/NAME.png`.
pub fn check(name: &str, picture: &RgbaImage) -> anyhow::Result<()> {
    let path = path(name);
    if std::env::var_os("VANTAGE_BLESS").is_some() {
        return picture.save(&path).with_context(|| format!("writing {}", path.display()));
    }
    let reference = image::open(&path)
        .with_context(|| {
            format!("no reference {}: look at the picture, then run with VANTAGE_BLESS=1", path.display())
        })?
        .into_rgba8();
    ensure!(
        reference.dimensions() == picture.dimensions(),
        "{name}: {:?} pixels, the reference has {:?}",
        picture.dimensions(),
        reference.dimensions()
    );
    let differing = reference.pixels().zip(picture.pixels()).filter(|(a, b)| differ(a.0, b.0)).count();
    let share = differing as f64 / f64::from(reference.width() * reference.height());
    if share > DIFFERING_SHARE {
        let found = std::env::temp_dir().join(format!("vantage-golden-{name}.png"));
        picture.save(&found)?;
        bail!("{name}: {:.2} % of the pixels differ; see {}", share * 100.0, found.display());
    }
    Ok(())
}

fn differ(a: [u8; 4], b: [u8; 4]) -> bool {
    a.iter().zip(b).any(|(a, b)| a.abs_diff(b) > CHANNEL_TOLERANCE)
}

fn path(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("golden").join(format!("{name}.png"))
}
