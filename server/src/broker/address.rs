//! Where a broker is, as people write it.

use std::fmt;
use std::str::FromStr;

use async_nats::{ConnectOptions, ServerAddr};
use percent_encoding::percent_decode_str;
use thiserror::Error;

/// Of a broker that names none.
const PORT: u16 = 4222;

/// `nats://[USER:PASSWORD@|TOKEN@]HOST[:PORT]`; `tls://` for one over TLS. Shown without user, password and token.
#[derive(Clone)]
pub struct BrokerAddress {
    server: ServerAddr,
    login: Login,
}

#[derive(Clone)]
enum Login {
    None,
    Token(String),
    User(String, String),
}

/// What is no such address.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error(
    "an address is needed as nats://HOST, nats://HOST:PORT, nats://USER:PASSWORD@HOST or nats://TOKEN@HOST (tls:// over TLS)"
)]
pub struct AddressError;

impl FromStr for BrokerAddress {
    type Err = AddressError;

    fn from_str(text: &str) -> Result<BrokerAddress, AddressError> {
        let given: ServerAddr = text.parse().map_err(|_| AddressError)?;
        if !text.contains("://") || !matches!(given.scheme(), "nats" | "tls") || given.host().is_empty() {
            return Err(AddressError);
        }
        let decoded = |text: &str| percent_decode_str(text).decode_utf8().map(String::from).map_err(|_| AddressError);
        let login = match (given.username(), given.password()) {
            (None, _) => Login::None,
            (Some(token), None) => Login::Token(decoded(token)?),
            (Some(user), Some(password)) => Login::User(decoded(user)?, decoded(password)?),
        };
        let host = if given.host().contains(':') { format!("[{}]", given.host()) } else { given.host().to_owned() };
        let port = given.clone().into_inner().port().unwrap_or(PORT);
        let server = format!("{}://{host}:{port}", given.scheme()).parse().map_err(|_| AddressError)?;
        Ok(BrokerAddress { server, login })
    }
}

impl BrokerAddress {
    pub(super) fn server(&self) -> &ServerAddr {
        &self.server
    }

    pub(super) fn log_in(&self, options: ConnectOptions) -> ConnectOptions {
        match &self.login {
            Login::None => options,
            Login::Token(token) => options.token(token.clone()),
            Login::User(user, password) => options.user_and_password(user.clone(), password.clone()),
        }
    }
}

impl fmt::Display for BrokerAddress {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.write_str(self.server.as_url_str())
    }
}

impl fmt::Debug for BrokerAddress {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, out)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn addresses_are_shown_without_secrets() {
        for (text, shown) in [
            ("nats://host", "nats://host:4222"),
            ("nats://Ada:se%40cret@host:4333", "nats://host:4333"),
            ("tls://secret@[::1]", "tls://[::1]:4222"),
        ] {
            let address: BrokerAddress = text.parse().expect(text);
            assert_eq!((address.to_string(), format!("{address:?}")), (shown.to_owned(), shown.to_owned()));
        }
        let address: BrokerAddress = "nats://Ada:se%40cret@host".parse().expect("an address");
        assert!(matches!(address.login, Login::User(user, password) if user == "Ada" && password == "se@cret"));
        for wrong in ["host", "http://host", "nats://", "ws://host", "nats://host:99999"] {
            assert_eq!(wrong.parse::<BrokerAddress>().map(|address| address.to_string()), Err(AddressError), "{wrong}");
        }
    }
}
