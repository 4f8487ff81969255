//! Scene files in a folder, by names that people write into an address.

use std::collections::BTreeMap;
use std::fs::DirEntry;
use std::path::{Path, PathBuf};

use thiserror::Error;

/// Folders within folders that are looked into: scenes often have one of their own, with the files that they refer to.
const MAX_DEPTH: usize = 3;
/// Files and folders that are looked at.
const MAX_ENTRIES: usize = 10_000;

/// Why there are no scenes.
#[derive(Debug, Error)]
pub enum FolderError {
    /// It cannot be read.
    #[error("cannot read the folder of scenes {}", .path.display())]
    Unread {
        /// Which.
        path: PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },
    /// Nothing in it is a scene.
    #[error("there is no scene file (glTF, GLB, OBJ, PLY, STL) in {}", .0.display())]
    Empty(PathBuf),
}

/// A folder of scenes. What is in it may change at any time.
#[derive(Debug, Clone)]
pub struct Folder {
    path: PathBuf,
}

impl Folder {
    /// It must be there, with a scene in it.
    pub fn open(path: &Path) -> Result<Folder, FolderError> {
        let folder = Folder { path: path.to_owned() };
        std::fs::read_dir(path).map_err(|source| FolderError::Unread { path: path.to_owned(), source })?;
        if folder.files().is_empty() { Err(FolderError::Empty(path.to_owned())) } else { Ok(folder) }
    }

    /// Files of scenes that are there now, by their names: the path in the folder, without the extension where no other has that name. Links to files count,
    /// links to folders do not, as they may lead in a circle; nor does what is hidden.
    pub fn files(&self) -> BTreeMap<String, PathBuf> {
        let mut found = Vec::new();
        let mut left = MAX_ENTRIES;
        let mut folders = vec![(self.path.clone(), 0)];
        while let Some((folder, depth)) = folders.pop() {
            // One that cannot be read has no scenes for us.
            for entry in std::fs::read_dir(&folder).into_iter().flatten().flatten() {
                if left == 0 {
                    tracing::warn!(
                        "{} holds more than {MAX_ENTRIES} files: some scenes are left out",
                        self.path.display()
                    );
                    return named(found);
                }
                left -= 1;
                if is_hidden(&entry) {
                    continue;
                }
                match entry.file_type() {
                    Ok(kind) if kind.is_dir() && depth < MAX_DEPTH => folders.push((entry.path(), depth + 1)),
                    Ok(kind) if !kind.is_dir() => found.extend(self.scene(entry.path())),
                    _ => {}
                }
            }
        }
        named(found)
    }

    /// A message that may name its files, with their paths in the folder.
    pub fn without_its_path(&self, message: &str) -> String {
        message.replace(&format!("{}{}", self.path.display(), std::path::MAIN_SEPARATOR), "")
    }

    /// With its path in the folder; `None` where it is no scene, or its name is no text.
    fn scene(&self, path: PathBuf) -> Option<(String, PathBuf)> {
        if !scene::load::is_scene_file(&path) || !path.is_file() {
            return None;
        }
        let parts = path.strip_prefix(&self.path).ok()?.iter().map(|part| part.to_str()).collect::<Option<Vec<_>>>()?;
        Some((parts.join("/"), path))
    }
}

fn is_hidden(entry: &DirEntry) -> bool {
    entry.file_name().as_encoded_bytes().starts_with(b".")
}

/// Without extensions, where that leaves names apart.
fn named(found: Vec<(String, PathBuf)>) -> BTreeMap<String, PathBuf> {
    let short = |name: &str| name.rsplit_once('.').map_or(name, |(before, _)| before).to_owned();
    let mut times = BTreeMap::<String, usize>::new();
    found.iter().for_each(|(name, _)| *times.entry(short(name)).or_default() += 1);
    found.into_iter().map(|(name, path)| (if times[&short(&name)] == 1 { short(&name) } else { name }, path)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scenes_have_names_that_tell_them_apart() {
        let path = std::env::temp_dir().join(format!("vantage-folder-{}", std::process::id()));
        let _ = std::fs::remove_dir_all(&path);
        assert!(matches!(Folder::open(&path), Err(FolderError::Unread { .. })));
        for folder in ["engine", ".hidden", "a/b/c/d"] {
            std::fs::create_dir_all(path.join(folder)).expect("a folder");
        }
        std::fs::write(path.join("notes.txt"), "").expect("a file");
        assert!(matches!(Folder::open(&path), Err(FolderError::Empty(_))));
        for file in [
            "room.GLB",
            "bunny.ply",
            "bunny.obj",
            "engine/engine.v2.gltf",
            ".hidden/x.obj",
            "a/b/c/deep.stl",
            "a/b/c/d/deeper.stl",
        ] {
            std::fs::write(path.join(file), "").expect("a file");
        }
        let files = Folder::open(&path).expect("scenes").files();
        let names: Vec<_> = files.keys().map(String::as_str).collect();
        assert_eq!(names, ["a/b/c/deep", "bunny.obj", "bunny.ply", "engine/engine.v2", "room"]);
        assert_eq!(files["room"], path.join("room.GLB"));
        let folder = Folder::open(&path).expect("scenes");
        assert_eq!(folder.without_its_path(&format!("{}: bad", files["room"].display())), "room.GLB: bad");
        std::fs::remove_dir_all(path).expect("removed");
    }
}
