//! The list of pairs that `tests/browser/beside/main.mjs` writes.

use std::path::Path;

use anyhow::Context;
use serde::Deserialize;

/// All pairs of a folder, and how they were made.
#[derive(Debug, Deserialize)]
pub(super) struct Pairs {
    /// The version of three.js.
    pub three: String,
    /// The environment's file name.
    pub environment: String,
    /// Of the pictures.
    pub side_px: u32,
    pub pairs: Vec<Pair>,
}

/// A model; its pictures lie in the folder of its name.
#[derive(Debug, Clone, Deserialize)]
pub(super) struct Pair {
    pub name: String,
    /// What both pictures show where there is nothing: sRGB bytes. A pair that failed has none.
    pub background: Option<[u8; 3]>,
    /// Why there are no pictures.
    pub failed: Option<String>,
}

impl Pairs {
    /// Reads `pairs.json` of a folder.
    pub fn read(folder: &Path) -> anyhow::Result<Pairs> {
        let path = folder.join("pairs.json");
        let text = std::fs::read_to_string(&path)
            .with_context(|| format!("{}: `cargo xtask beside` writes it", path.display()))?;
        serde_json::from_str(&text).with_context(|| path.display().to_string())
    }
}
