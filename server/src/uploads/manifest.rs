//! What one brings, told before its bytes: a line of JSON that lists paths and sizes, `[{"path": "car/car.gltf", "bytes": 5120}, ...]`. Then the bytes of all
//! files follow, one after the other, with nothing between them.

use std::path::{Component, Path, PathBuf};

use serde::Deserialize;

use super::not_taken::NotTaken;

/// Of the line. Four thousand files with paths of 200 characters fit.
pub(super) const MOST_BYTES: usize = 1 << 20;
/// Of a path: what common file systems take of a name, several times over.
const MOST_PATH_BYTES: usize = 1024;
const MOST_NAME_BYTES: usize = 255;
const MOST_DEPTH: usize = 8;

/// A file.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct File {
    /// Within the upload.
    pub path: PathBuf,
    pub bytes: u64,
}

#[derive(Deserialize)]
struct Listed {
    path: String,
    bytes: u64,
}

/// Reads the line, without its end.
pub(super) fn read(line: &[u8], most_files: usize) -> Result<Vec<File>, NotTaken> {
    let listed: Vec<Listed> = serde_json::from_slice(line).map_err(|error| NotTaken::Manifest(error.to_string()))?;
    if listed.is_empty() {
        return Err(NotTaken::Manifest("it lists none".to_owned()));
    }
    if listed.len() > most_files {
        return Err(NotTaken::Many { files: listed.len(), most: most_files });
    }
    listed.into_iter().map(|Listed { path, bytes }| Ok(File { path: within(&path)?, bytes })).collect()
}

/// A path that stays within the folder that it is joined to.
pub(super) fn within(path: &str) -> Result<PathBuf, NotTaken> {
    let not_a_path = || NotTaken::Path(path.chars().take(80).collect());
    let plain = path.replace('\\', "/");
    let is_long = plain.len() > MOST_PATH_BYTES || plain.split('/').any(|name| name.len() > MOST_NAME_BYTES);
    // A colon leads to other streams and drives on Windows.
    if is_long || plain.chars().any(|char| char.is_control() || char == ':') {
        return Err(not_a_path());
    }
    let mut names = PathBuf::new();
    for component in Path::new(&plain).components() {
        match component {
            Component::Normal(name) => names.push(name),
            Component::CurDir => {}
            _ => return Err(not_a_path()),
        }
    }
    if names.as_os_str().is_empty() || names.components().count() > MOST_DEPTH { Err(not_a_path()) } else { Ok(names) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_stay_within() {
        for (path, found) in [("a.glb", "a.glb"), ("car\\a b.gltf", "car/a b.gltf"), ("./x/ü.bin", "x/ü.bin")] {
            assert_eq!(within(path).expect(path), Path::new(found));
        }
        let long = "a".repeat(256);
        let deep = "a/".repeat(9) + "a";
        for path in ["", ".", "/etc/passwd", "../a", "a/../../b", "c:\\a", "a:b", "a\nb", "a\0b", &long, &deep] {
            assert!(matches!(within(path), Err(NotTaken::Path(_))), "{path:?}");
        }
    }

    #[test]
    fn a_line_lists_files() {
        let files = read(br#"[{"path": "a.glb", "bytes": 5}]"#, 2).expect("a line");
        assert_eq!(files, [File { path: "a.glb".into(), bytes: 5 }]);
        let three = br#"[{"path":"a","bytes":1},{"path":"b","bytes":1},{"path":"c","bytes":1}]"#;
        assert!(matches!(read(three, 2), Err(NotTaken::Many { files: 3, most: 2 })));
        for wrong in ["[]", "", "{}", r#"[{"path": "a"}]"#, r#"[{"path": "a", "bytes": -1}]"#] {
            assert!(matches!(read(wrong.as_bytes(), 2), Err(NotTaken::Manifest(_))), "{wrong}");
        }
    }
}
