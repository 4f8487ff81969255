//! Telling systemd that a service is ready, or stops: a datagram to the socket that `NOTIFY_SOCKET` names (sd_notify(3)). Says nothing where nobody asks.

/// Serves.
pub const READY: &str = "READY=1";
/// Is about to end.
pub const STOPPING: &str = "STOPPING=1";

/// Tells it, as a line of a variable and its value. Nothing depends on it: what goes wrong is a warning.
pub fn notify(state: &str) {
    #[cfg(target_os = "linux")]
    if let Some(name) = std::env::var_os("NOTIFY_SOCKET")
        && let Err(error) = send(&name, state)
    {
        tracing::warn!("systemd was not told {state}: {error}");
    }
    #[cfg(not(target_os = "linux"))]
    let _ = state;
}

#[cfg(target_os = "linux")]
fn send(name: &std::ffi::OsStr, state: &str) -> std::io::Result<()> {
    use std::os::linux::net::SocketAddrExt;
    use std::os::unix::ffi::OsStrExt;
    use std::os::unix::net::{SocketAddr, UnixDatagram};
    let address = match name.as_bytes().strip_prefix(b"@") {
        Some(name) => SocketAddr::from_abstract_name(name)?,
        None => SocketAddr::from_pathname(name)?,
    };
    UnixDatagram::unbound()?.send_to_addr(state.as_bytes(), &address).map(|_| ())
}

#[cfg(all(test, target_os = "linux"))]
mod tests {
    use std::os::unix::net::UnixDatagram;

    use super::*;

    #[test]
    fn says_it_to_the_socket_that_is_named() {
        let path = std::env::temp_dir().join(format!("vantage-notify-{}", std::process::id()));
        let socket = UnixDatagram::bind(&path).expect("a socket");
        send(path.as_os_str(), READY).expect("sent");
        let mut heard = [0; 64];
        let length = socket.recv(&mut heard).expect("heard");
        assert_eq!(&heard[..length], READY.as_bytes());
        std::fs::remove_file(path).expect("removed");
    }
}
