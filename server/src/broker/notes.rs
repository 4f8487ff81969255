//! What both ends say in words, as JSON that people can read at the broker.

use protocol::message::{Role, VERSION, Welcome};
use serde::{Deserialize, Serialize};
use thiserror::Error;

/// What is read of a message at most. A thousand names take a part of it.
const MAX_BYTES: usize = 256 << 10;
/// Presenters of one message at most; more are left out.
pub(crate) const MAX_NAMES: usize = 1024;

/// What a relay asks for.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Ask {
    version: u16,
    /// Whom its clients follow.
    pub follows: Vec<Followed>,
}

/// One who is followed at a relay.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Followed {
    pub name: String,
    /// Whether the whole copy of now is needed.
    pub whole: bool,
}

/// What a server says of itself.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Notice {
    version: u16,
    /// Tells one run of a server from all others.
    pub origin: u64,
    /// Its clock, by which all is stamped that it says.
    pub now_s: f64,
    /// What clients are welcomed with, but for times and secrets.
    pub welcome: Welcome,
    pub presenters: Vec<Presenter>,
}

/// One who presents.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Presenter {
    pub name: String,
    /// His newest update.
    pub last: u64,
}

/// Why a note is not read.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub(crate) enum NoteError {
    #[error("{0} bytes are too many")]
    TooLarge(usize),
    #[error("version {theirs} of the protocol, here it is {VERSION}")]
    Version { theirs: u16 },
    #[error("{0}")]
    Malformed(String),
}

impl Ask {
    pub fn new(follows: Vec<Followed>) -> Ask {
        Ask { version: VERSION, follows }
    }

    pub fn read(bytes: &[u8]) -> Result<Ask, NoteError> {
        let mut ask: Ask = read(bytes)?;
        ask.follows.retain(|followed| is_name(&followed.name));
        ask.follows.truncate(MAX_NAMES);
        Ok(ask)
    }

    pub fn bytes(&self) -> Vec<u8> {
        written(self)
    }
}

impl Notice {
    pub fn new((origin, now_s): (u64, f64), welcome: &Welcome, presenters: Vec<(String, u64)>) -> Notice {
        // What a session's secret is, no other end may know.
        let welcome = Welcome { secret: 0, resumed: false, ..welcome.clone() };
        let presenters = presenters.into_iter().take(MAX_NAMES).map(|(name, last)| Presenter { name, last }).collect();
        Notice { version: VERSION, origin, now_s, welcome, presenters }
    }

    pub fn read(bytes: &[u8]) -> Result<Notice, NoteError> {
        let mut notice: Notice = read(bytes)?;
        let welcome = &mut notice.welcome;
        (welcome.secret, welcome.resumed) = (0, false);
        if !welcome.is_sound() || !notice.now_s.is_finite() {
            return Err(NoteError::Malformed("a value out of its range".to_owned()));
        }
        notice.presenters.retain(|presenter| is_name(&presenter.name));
        notice.presenters.truncate(MAX_NAMES);
        Ok(notice)
    }

    pub fn bytes(&self) -> Vec<u8> {
        written(self)
    }
}

fn is_name(name: &str) -> bool {
    (1..=Role::MAX_NAME_BYTES).contains(&name.len())
}

fn written(note: &impl Serialize) -> Vec<u8> {
    serde_json::to_vec(note).expect("names, numbers and tables of them")
}

fn read<T: for<'de> Deserialize<'de>>(bytes: &[u8]) -> Result<T, NoteError> {
    #[derive(Deserialize)]
    struct Versioned {
        version: u16,
    }
    if bytes.len() > MAX_BYTES {
        return Err(NoteError::TooLarge(bytes.len()));
    }
    let malformed = |error: serde_json::Error| NoteError::Malformed(error.to_string());
    // Of another version the rest may be anything.
    let Versioned { version: theirs } = serde_json::from_slice(bytes).map_err(malformed)?;
    if theirs != VERSION {
        return Err(NoteError::Version { theirs });
    }
    serde_json::from_slice(bytes).map_err(malformed)
}

#[cfg(test)]
mod tests {
    use camera::Rigid;
    use protocol::Look;
    use protocol::staging::SceneMotion;

    use super::*;

    fn welcome() -> Welcome {
        Welcome {
            version: VERSION,
            scene_name: "a \"room\"".to_owned(),
            bounds_min_world: [-1e7, 0.1, -3.0],
            bounds_max_world: [1e7, 0.3, 3.0],
            start_world_from_eye: Rigid::IDENTITY,
            walk: true,
            near_m: 0.05,
            look: Look::Plain,
            update_interval_s: 0.1,
            scene_time_s: 0.0,
            motion: SceneMotion::Still,
            secret: u128::MAX,
            resumed: true,
        }
    }

    #[test]
    fn notes_come_through_without_secrets() {
        let notice = Notice::new((u64::MAX, 12.25), &welcome(), vec![("Ada".to_owned(), 7)]);
        let read = Notice::read(&notice.bytes()).expect("a notice");
        assert_eq!(read, notice);
        assert_eq!((read.welcome.secret, read.welcome.resumed), (0, false));
        assert!(!String::from_utf8_lossy(&notice.bytes()).contains(&u128::MAX.to_string()));
        let ask = Ask::new(vec![Followed { name: "Ada".to_owned(), whole: true }]);
        assert_eq!(Ask::read(&ask.bytes()), Ok(ask));
    }

    #[test]
    fn what_is_no_note_is_told() {
        let mut wrong = Notice::new((1, 0.0), &welcome(), Vec::new());
        wrong.version += 1;
        assert_eq!(Notice::read(&wrong.bytes()), Err(NoteError::Version { theirs: VERSION + 1 }));
        let mut wrong = Notice::new((1, 0.0), &welcome(), Vec::new());
        wrong.welcome.near_m = -1.0;
        assert!(matches!(Notice::read(&wrong.bytes()), Err(NoteError::Malformed(_))));
        assert!(matches!(Notice::read(b"\xff{"), Err(NoteError::Malformed(_))));
        assert_eq!(Notice::read(&vec![b' '; MAX_BYTES + 1]), Err(NoteError::TooLarge(MAX_BYTES + 1)));
        let long = Followed { name: "x".repeat(Role::MAX_NAME_BYTES + 1), whole: false };
        let ask = Ask::new(vec![long, Followed { name: String::new(), whole: true }]);
        assert_eq!(Ask::read(&ask.bytes()), Ok(Ask::new(Vec::new())), "nobody has such a name");
    }
}
