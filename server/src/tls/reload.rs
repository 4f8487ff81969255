//! Files that change while a server serves: a certificate is replaced every few weeks.

use std::sync::Arc;
use std::time::Duration;

use rustls::ServerConfig;
use tokio::sync::watch;

use super::certificate::{Files, TlsError};

/// How often the files are looked at.
const LOOK_EVERY: Duration = Duration::from_secs(2);

/// Gives what the files hold to new connections whenever they change, as long as somebody listens. What cannot be used is a
/// warning, and the last that could goes on.
pub(super) async fn keep(mut files: Files, newest: watch::Sender<Arc<ServerConfig>>) {
    loop {
        tokio::select! {
            () = newest.closed() => return,
            () = tokio::time::sleep(LOOK_EVERY) => {}
        }
        // A folder on another machine may be slow to answer.
        let looked = tokio::task::spawn_blocking(move || {
            let found = look(&mut files);
            (files, found)
        });
        let Ok((same_files, found)) = looked.await else { return };
        files = same_files;
        match found {
            None => {}
            Some(Ok(config)) => {
                newest.send_replace(config);
                tracing::info!("new connections get the new certificate");
            }
            Some(Err(error)) => tracing::warn!("the certificate stays as it was: {error}"),
        }
    }
}

/// What the files hold, where they have changed.
fn look(files: &mut Files) -> Option<Result<Arc<ServerConfig>, TlsError>> {
    files.changed().then(|| files.read()?.server_config())
}
