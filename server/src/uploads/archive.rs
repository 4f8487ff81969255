//! What was packed: where one ZIP file alone was brought, what is in it takes its place.

use std::fs::File;
use std::io::{Read, Write};
use std::path::{Path, PathBuf};

use zip::ZipArchive;
use zip::result::ZipError;

use super::manifest::within;
use super::not_taken::NotTaken;

/// Bytes that are unpacked at one time.
const PIECE_BYTES: usize = 64 * 1024;

/// Unpacks the one ZIP file of a folder into it; does nothing where there is none, or something else beside it. `takes`: room for so many bytes more is needed,
/// asked for before they are written: what an archive says of itself is not believed.
pub(super) fn unpack_in(
    folder: &Path,
    most_files: usize,
    mut takes: impl FnMut(u64) -> Result<(), NotTaken>,
) -> Result<(), NotTaken> {
    let Some(path) = lone_archive(folder)? else { return Ok(()) };
    let mut archive = ZipArchive::new(File::open(&path)?).map_err(not_unpacked)?;
    if archive.len() > most_files {
        return Err(NotTaken::Many { files: archive.len(), most: most_files });
    }
    let mut piece = vec![0; PIECE_BYTES];
    for index in 0..archive.len() {
        let mut entry = archive.by_index(index).map_err(not_unpacked)?;
        // Links and the like are no files of a scene.
        if !entry.is_file() || entry.is_symlink() {
            continue;
        }
        let name = entry.name().map_err(not_unpacked)?.into_owned();
        let to = folder.join(within(&name)?);
        if to == path {
            return Err(NotTaken::Archive("it holds a file of its own name".to_owned()));
        }
        to.parent().map_or(Ok(()), std::fs::create_dir_all)?;
        let mut file = File::create(&to)?;
        loop {
            let read = entry.read(&mut piece).map_err(|error| NotTaken::Archive(error.to_string()))?;
            if read == 0 {
                break;
            }
            takes(read as u64)?;
            file.write_all(&piece[..read])?;
        }
    }
    Ok(std::fs::remove_file(path)?)
}

fn lone_archive(folder: &Path) -> std::io::Result<Option<PathBuf>> {
    let mut entries = std::fs::read_dir(folder)?;
    let (Some(one), None) = (entries.next().transpose()?, entries.next()) else { return Ok(None) };
    let path = one.path();
    let is_zip = path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("zip"));
    Ok((is_zip && path.is_file()).then_some(path))
}

fn not_unpacked(error: ZipError) -> NotTaken {
    match error {
        ZipError::Io(error) => error.into(),
        other => NotTaken::Archive(other.to_string()),
    }
}
