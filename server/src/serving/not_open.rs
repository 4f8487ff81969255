//! What is said of a scene that is not open.

/// Why a scene is not open.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct NotOpen {
    /// For who asks.
    pub why: String,
    /// Whether it may be otherwise soon.
    pub again: bool,
}

impl NotOpen {
    /// Who comes again may find it open.
    pub fn for_now(why: String) -> NotOpen {
        NotOpen { why, again: true }
    }

    /// Who comes again finds the same.
    pub fn for_ever(why: String) -> NotOpen {
        NotOpen { why, again: false }
    }
}

/// What is said while a scene is loaded, and how far that is.
pub(super) fn loading(said: &str) -> String {
    let and = if said.is_empty() { "" } else { ": " };
    format!("the scene is being loaded{and}{said}")
}
