//! Open files: every connection is one, and systems allow a process only so many.

use thiserror::Error;

/// Beside connections: what the process has open anyway, and a little room.
const BESIDE: u64 = 64;

/// There are too few for all clients.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error(
    "{clients} clients need {needed} open files and the system allows {allowed}: raise its hard limit (ulimit -Hn)"
)]
pub struct TooFewFiles {
    clients: u64,
    needed: u64,
    allowed: u64,
}

/// Makes room for so many connections: the soft limit is raised as far as the hard one goes.
#[cfg(unix)]
pub fn allow(clients: usize) -> anyhow::Result<()> {
    use anyhow::Context;
    use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};
    let Rlimit { current, maximum } = getrlimit(Resource::Nofile);
    if is_to_be_raised((current, maximum), clients as u64)? {
        setrlimit(Resource::Nofile, Rlimit { current: maximum, maximum })
            .context("cannot raise the open-file limit")?;
    }
    Ok(())
}

/// Elsewhere sockets are not counted among files.
#[cfg(not(unix))]
pub fn allow(_: usize) -> anyhow::Result<()> {
    Ok(())
}

/// Whether the soft limit of (soft, hard) is too low, where `None` is no limit.
#[cfg_attr(not(unix), allow(dead_code, reason = "there is no limit to raise"))]
fn is_to_be_raised((soft, hard): (Option<u64>, Option<u64>), clients: u64) -> Result<bool, TooFewFiles> {
    let needed = clients + BESIDE;
    match hard {
        Some(allowed) if allowed < needed => Err(TooFewFiles { clients, needed, allowed }),
        _ => Ok(soft.is_some_and(|soft| soft < needed)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_soft_limit_is_raised_where_it_is_too_low() {
        assert_eq!(is_to_be_raised((Some(1024), Some(4096)), 900), Ok(false));
        assert_eq!(is_to_be_raised((Some(1024), Some(4096)), 1000), Ok(true));
        assert_eq!(is_to_be_raised((Some(1024), None), 100_000), Ok(true));
        assert_eq!(is_to_be_raised((None, None), 100_000), Ok(false));
        let error = is_to_be_raised((Some(1024), Some(2048)), 2000).expect_err("too few");
        assert!(
            error.to_string().starts_with("2000 clients need 2064 open files and the system allows 2048"),
            "{error}"
        );
    }
}
