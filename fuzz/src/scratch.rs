//! A folder for files that a loader reads: by path is the only way in, as a scene's parts lie beside it.

use std::path::PathBuf;

thread_local! {
    static FOLDER: Folder = Folder::new();
}

struct Folder(PathBuf);

impl Folder {
    fn new() -> Folder {
        let thread = std::thread::current().id();
        let path = std::env::temp_dir().join(format!("vantage-fuzz-{}-{thread:?}", std::process::id()));
        std::fs::create_dir_all(&path).expect("the system's temporary folder takes folders");
        Folder(path)
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

/// Writes a file of this thread's folder, over what had its name, and gives its path.
pub fn write(name: &str, bytes: &[u8]) -> PathBuf {
    FOLDER.with(|folder| {
        let path = folder.0.join(name);
        std::fs::write(&path, bytes).expect("the temporary folder takes files");
        path
    })
}
