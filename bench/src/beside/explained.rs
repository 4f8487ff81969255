//! Models that look unlike three.js for a reason that we know.

/// The reason, where one is known.
pub(super) fn why(name: &str) -> Option<&'static str> {
    EXPLAINED.iter().find(|(model, _)| *model == name).map(|(_, why)| *why)
}

/// By the names of pairs. A reason is of the model, not of a time: what is to be mended does not belong here.
const EXPLAINED: &[(&str, &str)] = &[];
