//! Bytes from the disk: capped, and only from the scene's own folder.

use std::fs::File;
use std::io::Read;
use std::path::{Component, Path, PathBuf};

use percent_encoding::percent_decode_str;

use super::LoadError;

/// The folder that a scene file lies in. What the scene refers to must lie in it, or in folders below it.
#[derive(Debug, Clone)]
pub(super) struct Folder {
    /// Without symbolic links.
    canonical: PathBuf,
}

impl Folder {
    /// The folder of the scene file `path`.
    pub fn of(path: &Path) -> Result<Folder, LoadError> {
        let parent = match path.parent() {
            Some(parent) if parent != Path::new("") => parent,
            _ => Path::new("."),
        };
        let canonical = parent.canonicalize().map_err(|source| LoadError::Io { path: parent.to_owned(), source })?;
        Ok(Folder { canonical })
    }

    /// Where the relative URI `uri` of a glTF file points. Percent-encoding is undone; a name that does not exist that
    /// way is tried as it is written.
    pub fn resolve_uri(&self, uri: &str) -> Result<PathBuf, LoadError> {
        let outside = |reason| LoadError::Outside { uri: shorten(uri), reason };
        if has_scheme(uri) {
            return Err(outside("only files beside the scene are read, no URLs"));
        }
        let decoded = percent_decode_str(uri)
            .decode_utf8()
            .map_err(|_| LoadError::malformed(shorten(uri), "percent-encoding is not UTF-8"))?;
        match self.resolve(&decoded) {
            Err(LoadError::Io { .. }) if decoded != uri => self.resolve(uri),
            other => other,
        }
    }

    /// Where the relative path `name` points: inside the folder after symbolic links are followed.
    pub fn resolve(&self, name: &str) -> Result<PathBuf, LoadError> {
        let outside = |reason| LoadError::Outside { uri: shorten(name), reason };
        let relative = PathBuf::from(name.replace('\\', "/"));
        for component in relative.components() {
            match component {
                Component::Normal(_) | Component::CurDir => {}
                Component::ParentDir => return Err(outside("it leaves the scene's folder by \"..\"")),
                Component::RootDir | Component::Prefix(_) => return Err(outside("it is an absolute path")),
            }
        }
        let joined = self.canonical.join(relative);
        let canonical = joined.canonicalize().map_err(|source| LoadError::Io { path: joined.clone(), source })?;
        if !canonical.starts_with(&self.canonical) {
            return Err(outside("a symbolic link leaves the scene's folder"));
        }
        Ok(canonical)
    }
}

/// Whether a URI begins with a scheme, such as `https:`. One letter is a drive, refused as an absolute path is.
fn has_scheme(uri: &str) -> bool {
    let Some((scheme, _)) = uri.split_once(':') else { return uri.starts_with("//") };
    scheme.starts_with(|c: char| c.is_ascii_alphabetic())
        && scheme.chars().all(|c| c.is_ascii_alphanumeric() || matches!(c, '+' | '-' | '.'))
}

/// A name from a file, short enough for a message.
pub(super) fn shorten(name: &str) -> String {
    const SHOWN: usize = 80;
    if name.chars().count() <= SHOWN {
        return name.to_owned();
    }
    let mut short: String = name.chars().take(SHOWN).collect();
    short.push('…');
    short
}

/// Reads a regular file of at most `limit` bytes.
pub(super) fn read_capped(path: &Path, limit: u64) -> Result<Vec<u8>, LoadError> {
    let io = |source| LoadError::Io { path: path.to_owned(), source };
    let metadata = std::fs::metadata(path).map_err(io)?;
    if !metadata.is_file() {
        return Err(io(std::io::Error::other("not a regular file")));
    }
    LoadError::check_limit(format!("bytes of {}", path.display()), metadata.len(), limit)?;
    let mut bytes = Vec::with_capacity(metadata.len() as usize);
    // The file may grow meanwhile: one byte past the limit tells.
    File::open(path).map_err(io)?.take(limit.saturating_add(1)).read_to_end(&mut bytes).map_err(io)?;
    LoadError::check_limit(format!("bytes of {}", path.display()), bytes.len() as u64, limit)?;
    Ok(bytes)
}
