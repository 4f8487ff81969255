//! A certificate and its key, as files hold them.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::SystemTime;

use rustls::ServerConfig;
use rustls::crypto::ring::default_provider;
use rustls::pki_types::pem::{self, PemObject};
use rustls::pki_types::{CertificateDer, PrivateKeyDer};
use thiserror::Error;

/// What the server speaks once TLS is up, as it is named in the handshake.
const PROTOCOL: &[u8] = b"http/1.1";

/// Why a certificate or its key cannot be used. Says nothing of what a key's file holds.
#[derive(Debug, Error)]
pub enum TlsError {
    /// A file is not there or not ours.
    #[error("cannot read {}: {why}", file.display())]
    Read {
        /// Which.
        file: PathBuf,
        /// The system's reason.
        why: std::io::Error,
    },
    /// A file is not PEM from its beginning to its end.
    #[error("{} is not sound PEM", .0.display())]
    Pem(PathBuf),
    /// A file without a certificate.
    #[error("{} holds no certificate in PEM", .0.display())]
    NoCertificate(PathBuf),
    /// A file without a key, or with an encrypted one.
    #[error("{} holds no private key in PEM that could be read without a password", .0.display())]
    NoKey(PathBuf),
    /// Each is sound by itself.
    #[error("the key in {} does not belong to the certificate in {}", key.display(), certificate.display())]
    Mismatch {
        /// File of the certificate.
        certificate: PathBuf,
        /// File of the key.
        key: PathBuf,
    },
    /// What a file holds is broken, or of a kind that is not served.
    #[error("{} cannot be used: {why}", file.display())]
    Unusable {
        /// Which.
        file: PathBuf,
        /// The reason.
        why: rustls::Error,
    },
    /// No certificate could be made.
    #[error("cannot make a certificate")]
    Make(#[from] rcgen::Error),
}

/// Where a certificate and its key lie, and how the files were when they were last read.
#[derive(Debug, Clone)]
pub(super) struct Files {
    certificate: PathBuf,
    key: PathBuf,
    read: [Option<Stamp>; 2],
}

/// What tells a written file from what it was before: when it was modified, and its length in bytes.
type Stamp = (SystemTime, u64);

impl Files {
    pub(super) fn new(certificate: PathBuf, key: PathBuf) -> Files {
        let read = [&certificate, &key].map(|file| stamp(file));
        Files { certificate, key, read }
    }

    /// Whether one of them has been written or taken away since it was last asked.
    pub(super) fn changed(&mut self) -> bool {
        let now = [&self.certificate, &self.key].map(|file| stamp(file));
        std::mem::replace(&mut self.read, now) != now
    }

    /// What they hold.
    pub(super) fn read(&self) -> Result<Identity, TlsError> {
        let text = read(&self.certificate)?;
        let chain: Result<Vec<_>, _> = CertificateDer::pem_slice_iter(&text).collect();
        let chain = chain.map_err(|_| TlsError::Pem(self.certificate.clone()))?;
        if chain.is_empty() {
            return Err(TlsError::NoCertificate(self.certificate.clone()));
        }
        let key = PrivateKeyDer::from_pem_slice(&read(&self.key)?).map_err(|error| match error {
            pem::Error::NoItemsFound => TlsError::NoKey(self.key.clone()),
            _ => TlsError::Pem(self.key.clone()),
        })?;
        Ok(Identity { chain, key, files: (self.certificate.clone(), self.key.clone()) })
    }
}

fn read(file: &Path) -> Result<Vec<u8>, TlsError> {
    std::fs::read(file).map_err(|why| TlsError::Read { file: file.to_owned(), why })
}

/// Of the file that a link leads to; `None` where there is none.
fn stamp(file: &Path) -> Option<Stamp> {
    let about = std::fs::metadata(file).ok()?;
    Some((about.modified().ok()?, about.len()))
}

/// A certificate with the chain that vouches for it, and its key.
pub(super) struct Identity {
    /// The server's own is the first.
    pub(super) chain: Vec<CertificateDer<'static>>,
    pub(super) key: PrivateKeyDer<'static>,
    /// What errors name: the certificate's and the key's.
    pub(super) files: (PathBuf, PathBuf),
}

impl Identity {
    pub(super) fn certificate_der(&self) -> &[u8] {
        self.chain.first().map_or(&[], |certificate| certificate)
    }

    /// As connections take it.
    pub(super) fn server_config(self) -> Result<Arc<ServerConfig>, TlsError> {
        let (certificate, key) = self.files;
        let explain = |error| match error {
            rustls::Error::InconsistentKeys(_) => {
                TlsError::Mismatch { certificate: certificate.clone(), key: key.clone() }
            }
            rustls::Error::InvalidCertificate(_) => TlsError::Unusable { file: certificate.clone(), why: error },
            _ => TlsError::Unusable { file: key.clone(), why: error },
        };
        let mut config = ServerConfig::builder_with_provider(Arc::new(default_provider()))
            .with_safe_default_protocol_versions()
            .map_err(explain)?
            .with_no_client_auth()
            .with_single_cert(self.chain, self.key)
            .map_err(explain)?;
        config.alpn_protocols = vec![PROTOCOL.to_vec()];
        Ok(Arc::new(config))
    }
}
