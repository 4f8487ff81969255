//! A certificate that nobody vouches for.

use std::net::IpAddr;

use rcgen::{CertificateParams, DnType, ExtendedKeyUsagePurpose, KeyPair};

use super::certificate::{Identity, TlsError};

/// What a browser names the certificate.
const NAME: &str = "Vantage, self-signed";

/// See [`super::Tls::self_signed`].
pub(super) fn make(bind: IpAddr) -> Result<Identity, TlsError> {
    let mut params = CertificateParams::new(names(bind))?;
    params.distinguished_name.push(DnType::CommonName, NAME);
    params.extended_key_usages = vec![ExtendedKeyUsagePurpose::ServerAuth];
    let key = KeyPair::generate()?;
    let certificate = params.self_signed(&key)?;
    let named = format!("the certificate \"{NAME}\"").into();
    Ok(Identity { chain: vec![certificate.into()], key: key.into(), files: (named, "its key".into()) })
}

/// What this machine is called by itself and on its network, and the address that it listens on where that is one.
fn names(bind: IpAddr) -> Vec<String> {
    let mut names = ["localhost", "127.0.0.1", "::1"].map(str::to_owned).to_vec();
    // Certificates have names in ASCII only.
    names.extend(gethostname::gethostname().into_string().ok().filter(|name| !name.is_empty() && name.is_ascii()));
    if !bind.is_unspecified() {
        names.push(bind.to_string());
    }
    names.sort();
    names.dedup();
    names
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_certificate_names_the_address_that_is_listened_on_where_it_is_one() {
        let of = |bind: &str| names(bind.parse().expect("an address"));
        assert!(of("192.168.1.7").contains(&"192.168.1.7".to_owned()));
        for bind in ["0.0.0.0", "::", "127.0.0.1", "::1"] {
            let names = of(bind);
            assert!(["localhost", "127.0.0.1", "::1"].iter().all(|name| names.contains(&(*name).to_owned())));
            assert!(!names.iter().any(|name| name == "0.0.0.0" || name == "::"), "{names:?}");
        }
    }
}
