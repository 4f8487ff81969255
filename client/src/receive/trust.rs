//! Whom a viewer believes that a server is who it says.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use rustls::crypto::ring::default_provider;
use rustls::pki_types::CertificateDer;
use rustls::pki_types::pem::PemObject;
use rustls::{CertificateError, ClientConfig, OtherError, RootCertStore};
use thiserror::Error;

/// Why certificates to trust could not be had.
#[derive(Debug, Error)]
pub enum TrustError {
    /// The file is not there or not ours.
    #[error("cannot read {}: {why}", file.display())]
    Read {
        /// Which.
        file: PathBuf,
        /// The system's reason.
        why: std::io::Error,
    },
    /// The file is not PEM from its beginning to its end.
    #[error("{} is not sound PEM", .0.display())]
    Pem(PathBuf),
    /// The file has none in it.
    #[error("{} holds no certificate in PEM", .0.display())]
    NoCertificate(PathBuf),
    /// What the file holds is broken.
    #[error("{} cannot be used: {why}", file.display())]
    Unusable {
        /// Which.
        file: PathBuf,
        /// The reason.
        why: rustls::Error,
    },
}

/// Trusts the authorities that browsers trust, the system's own, and the certificates in a file: of further authorities, or of
/// servers themselves.
pub fn trust(further: Option<&Path>) -> Result<Arc<ClientConfig>, TrustError> {
    let mut roots = RootCertStore { roots: webpki_roots::TLS_SERVER_ROOTS.to_vec() };
    // A system may have none, or some that are broken.
    roots.add_parsable_certificates(rustls_native_certs::load_native_certs().certs);
    if let Some(file) = further {
        for certificate in read(file)? {
            roots.add(certificate).map_err(|why| TrustError::Unusable { file: file.to_owned(), why })?;
        }
    }
    let config = ClientConfig::builder_with_provider(Arc::new(default_provider()))
        .with_safe_default_protocol_versions()
        .expect("the provider has what the default versions need")
        .with_root_certificates(roots)
        .with_no_client_auth();
    Ok(Arc::new(config))
}

fn read(file: &Path) -> Result<Vec<CertificateDer<'static>>, TrustError> {
    let text = std::fs::read(file).map_err(|why| TrustError::Read { file: file.to_owned(), why })?;
    let certificates: Result<Vec<_>, _> = CertificateDer::pem_slice_iter(&text).collect();
    match certificates {
        Err(_) => Err(TrustError::Pem(file.to_owned())),
        Ok(none) if none.is_empty() => Err(TrustError::NoCertificate(file.to_owned())),
        Ok(certificates) => Ok(certificates),
    }
}

/// What went wrong in a handshake, for a person.
pub fn words(error: &rustls::Error) -> String {
    match error {
        rustls::Error::InvalidCertificate(CertificateError::UnknownIssuer) => {
            "the server's certificate is not trusted: nobody known here vouches for it (--tls-ca FILE trusts those in a file)"
                .to_owned()
        }
        rustls::Error::InvalidCertificate(CertificateError::Other(OtherError(why)))
            if matches!(why.downcast_ref(), Some(webpki::Error::CaUsedAsEndEntity)) =>
        {
            "the server's certificate is not trusted: it is marked as an authority's, and --tls-ca FILE cannot change that \
             (servers need one with basicConstraints CA:FALSE)"
                .to_owned()
        }
        rustls::Error::InvalidCertificate(why) => {
            format!("the server's certificate is not trusted: {why} (--tls-ca FILE trusts others)")
        }
        rustls::Error::InvalidMessage(_) => "the server does not speak TLS there: try ws://".to_owned(),
        other => format!("no TLS: {other}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_cannot_be_trusted_is_named() {
        let folder = std::env::temp_dir().join(format!("vantage-trust-{}", std::process::id()));
        std::fs::create_dir_all(&folder).expect("folder");
        let said = |text: Option<&str>| {
            let file = folder.join("ca.pem");
            let _ = std::fs::remove_file(&file);
            text.iter().for_each(|text| std::fs::write(&file, text).expect("file"));
            let said = trust(Some(&file)).expect_err("nothing to trust").to_string();
            assert!(said.contains("ca.pem"), "{said}");
            said
        };
        assert!(said(None).starts_with("cannot read"));
        assert!(said(Some("hello")).contains("no certificate"));
        assert!(said(Some("-----BEGIN CERTIFICATE-----\n?\n-----END CERTIFICATE-----\n")).contains("not sound PEM"));
        assert!(
            said(Some("-----BEGIN CERTIFICATE-----\nAAAA\n-----END CERTIFICATE-----\n")).contains("cannot be used")
        );
        std::fs::remove_dir_all(folder).expect("remove");
        assert!(trust(None).is_ok());
    }

    #[test]
    fn an_untrusted_server_leads_to_the_option() {
        let said = |why| words(&rustls::Error::InvalidCertificate(why));
        for why in [CertificateError::UnknownIssuer, CertificateError::Expired, CertificateError::NotValidForName] {
            let said = said(why);
            assert!(said.contains("not trusted") && said.contains("--tls-ca"), "{said}");
        }
        let of_an_authority = OtherError(Arc::new(webpki::Error::CaUsedAsEndEntity));
        assert!(said(CertificateError::Other(of_an_authority)).contains("CA:FALSE"));
    }
}
