//! Scene files: glTF 2.0 (`.gltf`, `.glb`), Wavefront OBJ with MTL, PLY and STL.
//!
//! [`load`] takes a path and gives a [`Scene`]: meshes re-centred about their f64 bounds, materials, base colour images,
//! instances with their places over time. What is dropped or mended on the way is in [`Scene::warnings`], each entry
//! naming the thing; what cannot be shown is a [`LoadError`] that names it.
//!
//! Animations: see `gltf::clip` for which clips of a file play. Start: the file's first perspective camera where it has
//! one, else the bounds decide. Whether a scene is walked in is judged by its shape, see `summary::is_walked`.
//!
//! Bytes of a file are never trusted: [`LoadLimits`] caps every size that a file can claim, before anything is
//! allocated for it; references are checked before they are followed; hierarchies are walked without recursion. Files
//! that a scene refers to must lie in the scene's own folder.

mod choice;
mod closed;
mod error;
mod geometry;
mod gltf;
mod guard;
mod ktx2;
mod limits;
mod motion;
mod mtl;
mod numbers;
mod obj;
mod ply;
mod request;
mod solids;
mod source;
mod spacing;
mod stl;
mod summary;
#[cfg(test)]
mod tests;
mod texture;
mod warnings;

use std::path::Path;

use crate::Scene;

pub use choice::{Choice, Offer, Up};
pub use error::LoadError;
pub use limits::{LoadLimits, Progress, Stage};

use request::Request;
use source::Folder;
use warnings::Warnings;

/// Formats told apart by [`format_of`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Format {
    Gltf,
    Obj,
    Ply,
    Stl,
}

/// Loads a scene file. `progress` is called from any thread, with shares that grow within a stage.
pub fn load(path: &Path, limits: &LoadLimits, progress: &(dyn Fn(Progress) + Sync)) -> Result<Scene, LoadError> {
    load_chosen(path, &Choice::default(), limits, progress)
}

/// The same of a file that holds several things.
pub fn load_chosen(
    path: &Path,
    choice: &Choice,
    limits: &LoadLimits,
    progress: &(dyn Fn(Progress) + Sync),
) -> Result<Scene, LoadError> {
    let folder = Folder::of(path)?;
    progress(Progress { stage: Stage::Read, share: 0.0 });
    let bytes = source::read_capped(path, limits.file_bytes)?;
    let name = path.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
    let request = Request { name, folder, choice, limits, progress };
    let format = format_of(path, &bytes);
    if format != Some(Format::Gltf) {
        choice.must_be_of_nothing()?;
    }
    match format {
        Some(Format::Gltf) => gltf::load(bytes, &request),
        Some(Format::Obj) => obj::load(&bytes, &request),
        Some(Format::Ply) => ply::load(&bytes, &request),
        Some(Format::Stl) => stl::load(&bytes, &request),
        None => Err(LoadError::UnknownFormat { path: path.to_owned() }),
    }
}

/// Whether a file is called as scene files are.
pub fn is_scene_file(path: &Path) -> bool {
    format_of(path, &[]).is_some()
}

/// The content decides where it has a signature (GLB, PLY); the extension elsewhere.
fn format_of(path: &Path, bytes: &[u8]) -> Option<Format> {
    if bytes.starts_with(gltf::GLB_MAGIC) {
        return Some(Format::Gltf);
    }
    if bytes.starts_with(b"ply\n") || bytes.starts_with(b"ply\r") {
        return Some(Format::Ply);
    }
    match path.extension()?.to_str()?.to_ascii_lowercase().as_str() {
        "gltf" | "glb" => Some(Format::Gltf),
        "obj" => Some(Format::Obj),
        "ply" => Some(Format::Ply),
        "stl" => Some(Format::Stl),
        _ => None,
    }
}
