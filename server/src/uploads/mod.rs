//! What people bring to be shown: files that they drop on the page. Each lies in a folder of its own that nobody else's scene can refer to, under a name that
//! nobody guesses, and is removed when nobody has looked at it for a while, and when the server ends.
//!
//! - `manifest`: which files one brings, told before their bytes; `receive`: a request's body; `archive`: what was packed; [`options`]: the command line.

mod archive;
mod manifest;
pub mod options;
mod receive;
#[cfg(test)]
mod tests;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use axum::http::StatusCode;
use thiserror::Error;
use tokio::sync::{OwnedSemaphorePermit, Semaphore};

use crate::limits::UploadLimits;
use crate::serving::{Folder, FolderError};
pub(crate) use receive::receive;

/// What the names of all that was brought begin with.
const PREFIX: &str = "brought/";

/// Why something is not taken.
#[derive(Debug, Error)]
pub enum NotTaken {
    /// The request is no upload.
    #[error("an upload begins with a line of JSON that lists its files: {0}")]
    Manifest(String),
    /// A file's path leads out of the upload, or is none.
    #[error("{0:?} is no path of a file within an upload")]
    Path(String),
    /// It is larger than any may be.
    #[error("it has {} MiB, and one upload may have {}", .bytes.div_ceil(1 << 20), .most >> 20)]
    Large {
        /// Its size.
        bytes: u64,
        /// What one may have.
        most: u64,
    },
    /// There are more files than there may be.
    #[error("it has {files} files, and one upload may have {most}")]
    Many {
        /// How many.
        files: usize,
        /// As many as may be.
        most: usize,
    },
    /// Others have brought too much.
    #[error(
        "there is no room for it now beside what others have brought; what nobody looks at is removed after a while"
    )]
    Full,
    /// Others are bringing something.
    #[error("as many as may be are bringing something now")]
    Crowded,
    /// Nothing came for a while.
    #[error("nothing came for {0} s")]
    Slow(u64),
    /// It ended early, or was more than it said.
    #[error("its bytes are not those that it lists")]
    Length,
    /// The archive cannot be unpacked.
    #[error("the archive cannot be unpacked: {0}")]
    Archive(String),
    /// Nothing of it can be shown.
    #[error("there is no scene file in it (glTF, GLB, OBJ, PLY, STL, or a ZIP of one)")]
    NoScene,
    /// The disk.
    #[error("it cannot be kept: {0}")]
    Disk(#[from] std::io::Error),
}

impl NotTaken {
    /// Of the answer.
    pub(crate) fn status(&self) -> StatusCode {
        match self {
            NotTaken::Manifest(_) | NotTaken::Path(_) | NotTaken::Length => StatusCode::BAD_REQUEST,
            NotTaken::Large { .. } | NotTaken::Many { .. } => StatusCode::PAYLOAD_TOO_LARGE,
            NotTaken::Full | NotTaken::Disk(_) => StatusCode::INSUFFICIENT_STORAGE,
            NotTaken::Crowded => StatusCode::SERVICE_UNAVAILABLE,
            NotTaken::Slow(_) => StatusCode::REQUEST_TIMEOUT,
            NotTaken::Archive(_) | NotTaken::NoScene => StatusCode::UNPROCESSABLE_ENTITY,
        }
    }
}

/// See the module.
pub struct Uploads {
    /// Of this server alone.
    folder: PathBuf,
    limits: UploadLimits,
    /// One permit for each that is being brought.
    places: Arc<Semaphore>,
    /// Of all that is here and all that is being brought.
    bytes: AtomicU64,
    kept: Mutex<BTreeMap<String, Kept>>,
}

/// One that is whole.
struct Kept {
    scenes: BTreeMap<String, PathBuf>,
    bytes: u64,
    /// When somebody last looked at it.
    wanted_at: Instant,
}

/// Whether a scene's name is of something that was brought.
pub(crate) fn is_brought(name: &str) -> bool {
    name.starts_with(PREFIX)
}

impl Uploads {
    /// Makes a folder of its own in a folder, for as long as it lives.
    pub fn open(within: &Path, limits: UploadLimits) -> std::io::Result<Uploads> {
        std::fs::create_dir_all(within)?;
        let folder = within.canonicalize()?.join(format!("vantage-uploads-{}", random_name()?));
        private_folder(&folder)?;
        let places = Arc::new(Semaphore::new(limits.at_once));
        Ok(Uploads { folder, limits, places, bytes: AtomicU64::new(0), kept: Mutex::default() })
    }

    /// Bytes of one upload at most.
    pub fn most_bytes(&self) -> u64 {
        self.limits.bytes
    }

    /// How long one may take.
    pub fn time(&self) -> Duration {
        self.limits.time
    }

    /// The file of a scene that was brought, by the scene's name.
    pub fn file(&self, name: &str) -> Option<PathBuf> {
        let (id, scene) = name.strip_prefix(PREFIX)?.split_once('/')?;
        let mut kept = self.kept();
        let upload = kept.get_mut(id)?;
        upload.wanted_at = Instant::now();
        upload.scenes.get(scene).cloned()
    }

    /// Removes what nobody has looked at for `idle`; `is_open`: whether one of its scenes is open now.
    pub fn tidy(&self, now: Instant, idle: Duration, is_open: impl Fn(&str) -> bool) {
        let prefix = |id: &String| format!("{PREFIX}{id}/");
        self.kept().retain(|id, upload| {
            if is_open(&prefix(id)) {
                upload.wanted_at = now;
            }
            let stays = now.saturating_duration_since(upload.wanted_at) < idle;
            if !stays {
                tracing::info!("what was brought is removed: nobody is there");
                self.remove(id, upload.bytes);
            }
            stays
        });
    }

    /// What was brought, as messages may name its place.
    pub fn without_its_path(&self, message: &str) -> String {
        let folder = self.folder.to_string_lossy();
        let mut shown = String::new();
        let mut rest = message;
        while let Some((before, after)) = rest.split_once(&*folder) {
            shown.push_str(before);
            // Behind it: a separator, the upload's folder, and another one.
            rest = after.splitn(3, std::path::MAIN_SEPARATOR).nth(2).unwrap_or_default();
        }
        shown + rest
    }

    /// Removes all of it, and takes nothing more.
    pub fn close(&self) {
        self.places.close();
        self.kept().clear();
        // Whoever still writes into it fails, which is told to nobody: the server ends.
        drop(std::fs::remove_dir_all(&self.folder));
    }

    /// Begins one of so many bytes.
    fn begin(self: &Arc<Self>, bytes: u64) -> Result<Bringing, NotTaken> {
        let place = self.places.clone().try_acquire_owned().map_err(|_| NotTaken::Crowded)?;
        let id = random_name()?;
        let mut bringing = Bringing { uploads: self.clone(), id, bytes: 0, is_kept: false, _place: place };
        bringing.takes(bytes)?;
        private_folder(&bringing.folder())?;
        Ok(bringing)
    }

    fn remove(&self, id: &str, bytes: u64) {
        self.bytes.fetch_sub(bytes, Ordering::SeqCst);
        if let Err(error) = std::fs::remove_dir_all(self.folder.join(id)) {
            tracing::warn!("what was brought cannot be removed: {error}");
        }
    }

    fn kept(&self) -> MutexGuard<'_, BTreeMap<String, Kept>> {
        self.kept.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Drop for Uploads {
    fn drop(&mut self) {
        self.close();
    }
}

/// One that is on its way. Dropped before it is whole, it is removed.
struct Bringing {
    uploads: Arc<Uploads>,
    id: String,
    /// What it may take of all room.
    bytes: u64,
    is_kept: bool,
    _place: OwnedSemaphorePermit,
}

impl Bringing {
    fn folder(&self) -> PathBuf {
        self.uploads.folder.join(&self.id)
    }

    /// It needs room for so many bytes more.
    fn takes(&mut self, bytes: u64) -> Result<(), NotTaken> {
        let most = self.uploads.limits.bytes;
        if self.bytes.saturating_add(bytes) > most {
            return Err(NotTaken::Large { bytes: self.bytes.saturating_add(bytes), most });
        }
        let room = |taken: u64| taken.checked_add(bytes).filter(|&taken| taken <= self.uploads.limits.all_bytes);
        self.uploads.bytes.fetch_update(Ordering::SeqCst, Ordering::SeqCst, room).map_err(|_| NotTaken::Full)?;
        self.bytes += bytes;
        Ok(())
    }

    /// It is whole: the names of the scenes in it, those first that are not in folders. May take a while.
    fn settle(mut self) -> Result<Vec<String>, NotTaken> {
        archive::unpack_in(&self.folder(), self.uploads.limits.files, |bytes| self.takes(bytes))?;
        let folder = match Folder::open(&self.folder()) {
            Ok(folder) => folder,
            Err(FolderError::Empty(_)) => return Err(NotTaken::NoScene),
            Err(FolderError::Unread { source, .. }) => return Err(source.into()),
        };
        let scenes = folder.files();
        let mut names: Vec<_> = scenes.keys().cloned().collect();
        names.sort_by_key(|name| name.matches('/').count());
        let kept = Kept { scenes, bytes: self.bytes, wanted_at: Instant::now() };
        self.uploads.kept().insert(self.id.clone(), kept);
        self.is_kept = true;
        Ok(names.into_iter().map(|name| format!("{PREFIX}{}/{name}", self.id)).collect())
    }
}

impl Drop for Bringing {
    fn drop(&mut self) {
        if !self.is_kept {
            self.uploads.remove(&self.id, self.bytes);
        }
    }
}

/// 128 bits that nobody guesses: who knows a name has been told it.
fn random_name() -> std::io::Result<String> {
    let mut bytes = [0; 16];
    getrandom::fill(&mut bytes).map_err(|error| std::io::Error::other(error.to_string()))?;
    Ok(bytes.iter().map(|byte| format!("{byte:02x}")).collect())
}

/// For this server's eyes alone, where the system tells users apart.
fn private_folder(path: &Path) -> std::io::Result<()> {
    let mut builder = std::fs::DirBuilder::new();
    #[cfg(unix)]
    std::os::unix::fs::DirBuilderExt::mode(&mut builder, 0o700);
    builder.create(path)
}
