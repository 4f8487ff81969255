//! What people bring to be shown: files that they drop on the page. Each lies in a folder of its own that nobody else's scene can refer to, under a name that
//! nobody guesses, and is removed when nobody has looked at it for a while, and when the server ends.
//!
//! - `manifest`: which files one brings, told before their bytes; `receive`: a request's body; `archive`: what was packed; `not_taken`: why something is refused; [`options`]: the command line.

mod archive;
mod manifest;
mod not_taken;
pub mod options;
mod receive;
#[cfg(test)]
mod tests;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use tokio::sync::{OwnedSemaphorePermit, Semaphore};

use crate::limits::UploadLimits;
use crate::serving::{Folder, FolderError};
pub use not_taken::NotTaken;
pub(crate) use receive::receive;

/// What the names of all that was brought begin with.
const PREFIX: &str = "brought/";

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
