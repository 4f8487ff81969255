//! Where scene files are: in a folder, and where people may bring some, among those.

use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};

use super::folder::Folder;
use super::within::{SceneFile, Within};
use crate::uploads::{self, Uploads};

/// Names that a refusal lists.
const LISTED: usize = 20;

/// See the module.
#[derive(Clone, Default)]
pub struct Stock {
    folder: Option<Folder>,
    uploads: Option<Arc<Uploads>>,
    /// What the first scene is called, and its file, where something may be chosen within that.
    first: Option<(String, SceneFile)>,
}

impl From<Folder> for Stock {
    fn from(folder: Folder) -> Stock {
        Stock { folder: Some(folder), ..Stock::default() }
    }
}

impl Stock {
    /// Of either, of both, or of none.
    pub fn new(folder: Option<Folder>, uploads: Option<Arc<Uploads>>) -> Stock {
        Stock { folder, uploads, first: None }
    }

    /// And the first scene's file, for what may be chosen within it.
    pub fn with_first(self, name: String, file: SceneFile) -> Stock {
        Stock { first: Some((name, file)), ..self }
    }

    /// What is chosen of the first scene's file where nobody chooses.
    pub fn first_within(&self) -> Within {
        self.first.as_ref().map(|(_, file)| file.within.clone()).unwrap_or_default()
    }

    /// Whether there may be scenes of other files.
    pub fn has_others(&self) -> bool {
        self.folder.is_some() || self.uploads.is_some()
    }

    /// Whether there can be no scenes.
    pub fn is_none(&self) -> bool {
        self.folder.is_none() && self.uploads.is_none() && self.first.is_none()
    }

    /// Where people bring files; `None` where they may not.
    pub fn uploads(&self) -> Option<&Arc<Uploads>> {
        self.uploads.as_ref()
    }

    /// A scene's file by the scene's name, or what to tell who asks. Reads the folder.
    pub fn file(&self, name: &str) -> Result<PathBuf, String> {
        if let Some(uploads) = self.uploads.as_ref().filter(|_| uploads::is_brought(name)) {
            let gone = || "what was brought is here no more: it is removed when nobody has looked at it for a while";
            return uploads.file(name).ok_or_else(|| gone().to_owned());
        }
        if let Some((_, file)) = self.first.as_ref().filter(|(first, _)| first == name) {
            return Ok(file.path.clone());
        }
        let Some(folder) = &self.folder else { return Err(format!("there is no scene {name:?} here")) };
        let mut files = folder.files();
        files.remove(name).ok_or_else(|| unknown(name, files.keys()))
    }

    /// Names of scenes that all may know of. Reads the folder.
    pub fn names(&self) -> Vec<String> {
        self.folder.iter().flat_map(|folder| folder.files().into_keys()).collect()
    }

    /// A message that may name files, without the places of folders.
    pub fn without_paths(&self, message: &str) -> String {
        let of_folder = self.folder.as_ref().map(|folder| folder.without_its_path(message));
        let message = of_folder.unwrap_or_else(|| message.to_owned());
        self.uploads.as_ref().map_or_else(|| message.clone(), |uploads| uploads.without_its_path(&message))
    }

    /// Removes what people brought and nobody has looked at for `idle`; `is_open`: whether a scene is open whose name begins so.
    pub fn tidy(&self, now: Instant, idle: Duration, is_open: impl Fn(&str) -> bool) {
        self.uploads.iter().for_each(|uploads| uploads.tidy(now, idle, &is_open));
    }

    /// Takes nothing more, and keeps nothing of what was brought.
    pub fn close(&self) {
        self.uploads.iter().for_each(|uploads| uploads.close());
    }
}

fn unknown<'a>(name: &str, names: impl ExactSizeIterator<Item = &'a String>) -> String {
    let more = names.len().saturating_sub(LISTED);
    let listed: Vec<_> = names.take(LISTED).map(String::as_str).collect();
    let and = if more == 0 { String::new() } else { format!(", and {more} more") };
    format!("there is no scene {name:?} here; there are: {}{and}", listed.join(", "))
}
