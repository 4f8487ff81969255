//! The same port over TLS: https and wss instead of http and ws.
//!
//! - [`Tls`]: the certificate and its key, of files or made at start; [`TlsError`]: what is wrong with them.
//! - [`TlsListener`]: connections whose handshake is done; `reload`: files that change while it serves.

mod certificate;
mod listener;
mod reload;
mod self_signed;

use std::net::IpAddr;
use std::path::PathBuf;
use std::sync::Arc;

use rustls::ServerConfig;
use tokio::sync::watch;

pub use certificate::TlsError;
use certificate::{Files, Identity};
pub use listener::TlsListener;

use crate::peers::Door;

/// A certificate that a server shows, with its key.
#[derive(Debug, Clone)]
pub struct Tls {
    certificate_der: Vec<u8>,
    config: Arc<ServerConfig>,
    /// Where it was read from, and may change; `None` where it was made at start.
    files: Option<Files>,
}

impl Tls {
    /// Reads a certificate, with the chain of those that vouch for it, and its private key, both in PEM.
    pub fn of_files(certificate: impl Into<PathBuf>, key: impl Into<PathBuf>) -> Result<Tls, TlsError> {
        let files = Files::new(certificate.into(), key.into());
        let identity = files.read()?;
        Ok(Tls { files: Some(files), ..Tls::of(identity)? })
    }

    /// Makes a certificate that nobody vouches for: of this machine, by all names that it has for itself, and of the address
    /// that a server listens on. Its key is nowhere but in this process.
    pub fn self_signed(bind: IpAddr) -> Result<Tls, TlsError> {
        Tls::of(self_signed::make(bind)?)
    }

    fn of(identity: Identity) -> Result<Tls, TlsError> {
        let certificate_der = identity.certificate_der().to_vec();
        Ok(Tls { certificate_der, config: identity.server_config()?, files: None })
    }

    /// The server's own certificate, in DER.
    pub fn certificate_der(&self) -> &[u8] {
        &self.certificate_der
    }

    /// Whether somebody gave it, so that it is to stay; one that is made at start is another each time.
    pub fn is_of_files(&self) -> bool {
        self.files.is_some()
    }

    /// SHA-256 of the certificate as browsers show it: pairs of hexadecimal digits between colons.
    pub fn fingerprint(&self) -> String {
        let digest = ring::digest::digest(&ring::digest::SHA256, &self.certificate_der);
        digest.as_ref().iter().map(|byte| format!("{byte:02X}")).collect::<Vec<_>>().join(":")
    }

    /// Shakes hands with who connects, by the certificate that the files hold at that time.
    pub fn listen(self, door: Door) -> TlsListener {
        let (newest, configs) = watch::channel(self.config);
        if let Some(files) = self.files {
            tokio::spawn(reload::keep(files, newest));
        }
        TlsListener::new(door, configs)
    }
}
