//! Open files: every connection is one, and systems allow a process only so many.

/// What a process has open beside sockets: a scene, a GPU's device, a log, the files of pages. A part of what is allowed, where that is little.
#[cfg(unix)]
const OTHERS: u64 = 256;

/// Raises the soft limit as far as the hard one goes; how many connections there may be, or `None` where nothing limits them.
#[cfg(unix)]
pub(crate) fn for_sockets() -> Option<usize> {
    use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};
    let limit = getrlimit(Resource::Nofile);
    let raised = Rlimit { current: limit.maximum, maximum: limit.maximum };
    let allowed = if limit.current == limit.maximum || setrlimit(Resource::Nofile, raised).is_ok() {
        limit.maximum
    } else {
        limit.current
    };
    allowed.map(|allowed| usize::try_from(for_sockets_of(allowed)).unwrap_or(usize::MAX))
}

/// Elsewhere sockets are not counted among files.
#[cfg(not(unix))]
pub(crate) fn for_sockets() -> Option<usize> {
    None
}

#[cfg(unix)]
fn for_sockets_of(allowed: u64) -> u64 {
    allowed - OTHERS.min(allowed / 2)
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    #[test]
    fn room_is_left_for_other_files() {
        assert_eq!([64, 1024, 1 << 20].map(for_sockets_of), [32, 768, (1 << 20) - OTHERS]);
        assert!(for_sockets().is_none_or(|allowed| allowed > 0));
    }
}
