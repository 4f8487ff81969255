//! How the scene is put before a viewer: its time, its parts, where it is cut open. See [`Staging`].

use std::collections::BTreeMap;

use protocol::staging::{Playback, Staging};

/// Names that are kept at most: a scene has no more objects.
const MOST_NAMES: usize = 1 << 16;

/// What a viewer knows of it.
#[derive(Debug, Default)]
pub(super) struct Staged {
    /// As it was asked for.
    pub staging: Staging,
    /// The presenter's time, of a follower.
    pub presented: Option<Playback>,
    /// What objects are called, as far as that was asked; `None` while there is no answer.
    names: BTreeMap<u16, Option<String>>,
}

impl Staged {
    /// The server says what an object is called.
    pub fn called(&mut self, object: u16, name: String) {
        if let Some(known) = self.names.get_mut(&object) {
            *known = Some(name);
        }
    }

    /// What an object is called, once that is known; where it was not asked, `ask` does that.
    pub fn name_of(&mut self, object: u16, ask: impl FnOnce()) -> Option<String> {
        if let Some(known) = self.names.get(&object) {
            return known.clone();
        }
        if self.names.len() < MOST_NAMES {
            ask();
            self.names.insert(object, None);
        }
        None
    }

    /// The scene may be another one.
    pub fn forget_names(&mut self) {
        self.names.clear();
    }
}
