//! The address of a server, as people type it.

use thiserror::Error;

/// Why an address cannot be used.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum AddressError {
    /// Another scheme.
    #[error("{0}: use ws://HOST:PORT or wss://HOST:PORT")]
    Scheme(String),
    /// No host in it.
    #[error("{0:?} names no host")]
    Host(String),
}

/// The websocket's address of what a person typed: `HOST:PORT`, `http://HOST:PORT` and `ws://HOST:PORT` mean
/// `ws://HOST:PORT/ws`, `https://HOST:PORT` and `wss://HOST:PORT` mean `wss://HOST:PORT/ws`; a path and a query of one's own
/// (`?token=…`) are kept. Without a port, that of http or https is meant.
pub fn websocket_url(typed: &str) -> Result<String, AddressError> {
    let typed = typed.trim();
    let (scheme, rest) = match typed.split_once("://") {
        None => ("ws", typed),
        Some(("ws" | "http", rest)) => ("ws", rest),
        Some(("wss" | "https", rest)) => ("wss", rest),
        Some(_) => return Err(AddressError::Scheme(shown(typed).to_owned())),
    };
    let (before_query, query) = rest.split_once('?').map_or((rest, None), |(before, query)| (before, Some(query)));
    let (authority, path) = before_query.split_once('/').unwrap_or((before_query, ""));
    if authority.is_empty() || authority.starts_with(':') {
        return Err(AddressError::Host(shown(typed).to_owned()));
    }
    let path = if path.is_empty() { "ws" } else { path };
    let query = query.map_or_else(String::new, |query| format!("?{query}"));
    Ok(format!("{scheme}://{authority}/{path}{query}"))
}

/// An address as a person typed it, for people: nobody looks over a shoulder at a token.
pub fn shown(typed: &str) -> &str {
    typed.split_once('?').map_or(typed, |(before, _)| before)
}

/// An address as a person typed it, with a token in its query.
pub fn with_token(typed: &str, token: &str) -> String {
    with_value(typed, "token", token)
}

/// What an address asks for of a server's scenes: one of them, a scene within its file, and a variant of that file's materials.
pub const SCENE_KEYS: [&str; 3] = ["scene", "file-scene", "variant"];

/// An address that asks for one of the server's scenes.
pub fn with_scene(address: &str, name: &str) -> String {
    with_value(address, "scene", name)
}

/// An address with one more part of its query.
pub fn with_value(address: &str, key: &str, value: &str) -> String {
    let coded = |byte: u8| match byte {
        b'A'..=b'Z' | b'a'..=b'z' | b'0'..=b'9' | b'-' | b'_' | b'.' | b'~' => char::from(byte).to_string(),
        _ => format!("%{byte:02X}"),
    };
    let mark = if address.contains('?') { '&' } else { '?' };
    format!("{address}{mark}{key}={}", value.bytes().map(coded).collect::<String>())
}

/// An address that [`websocket_url`] made without the token of its query, and that token.
pub fn without_token(url: &str) -> (String, Option<String>) {
    let Some((before, query)) = url.split_once('?') else { return (url.to_owned(), None) };
    let (tokens, others): (Vec<_>, Vec<_>) = query.split('&').partition(|part| part.starts_with("token="));
    let token = tokens.first().map(|token| decoded(&token["token=".len()..]));
    let others = others.join("&");
    (if others.is_empty() { before.to_owned() } else { format!("{before}?{others}") }, token)
}

/// A value of a query.
fn decoded(value: &str) -> String {
    let (mut bytes, mut rest) = (Vec::new(), value.as_bytes());
    while let Some((&byte, after)) = rest.split_first() {
        let hex = after.get(..2).and_then(|digits| std::str::from_utf8(digits).ok());
        let coded = hex.filter(|_| byte == b'%').and_then(|digits| u8::from_str_radix(digits, 16).ok());
        bytes.push(coded.unwrap_or(if byte == b'+' { b' ' } else { byte }));
        rest = if coded.is_some() { &after[2..] } else { after };
    }
    String::from_utf8_lossy(&bytes).into_owned()
}

/// Whether the server of an address that [`websocket_url`] made is spoken to over TLS.
pub fn is_over_tls(url: &str) -> bool {
    url.starts_with("wss://")
}

/// `HOST:PORT` of an address that [`websocket_url`] made.
pub fn authority(url: &str) -> &str {
    let rest = url.split_once("://").map_or(url, |(_, rest)| rest);
    rest.split(['/', '?']).next().unwrap_or(rest)
}

/// Resolves the server of an address that [`websocket_url`] made, without TLS.
#[cfg(not(target_arch = "wasm32"))]
pub fn socket_addr(url: &str) -> std::io::Result<std::net::SocketAddr> {
    use std::net::ToSocketAddrs;
    let authority = authority(url);
    // `[::1]` and `host` have no port; `[::1]:80` and `host:80` do.
    let after_host = authority.rsplit(']').next().unwrap_or(authority);
    let with_port = if after_host.contains(':') { authority.to_owned() } else { format!("{authority}:80") };
    with_port.to_socket_addrs()?.next().ok_or_else(|| std::io::Error::other(format!("{authority} has no address")))
}

/// The same address at another `HOST:PORT`.
pub fn with_authority(url: &str, new_authority: &str) -> String {
    url.replacen(authority(url), new_authority, 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_people_type_is_understood() {
        for (typed, url) in [
            ("127.0.0.1:8080", "ws://127.0.0.1:8080/ws"),
            ("ws://host:1/", "ws://host:1/ws"),
            (" http://host:1 ", "ws://host:1/ws"),
            ("ws://[::1]:8080/ws", "ws://[::1]:8080/ws"),
            ("ws://host:1/other?token=a/b", "ws://host:1/other?token=a/b"),
            ("host:1?token=x", "ws://host:1/ws?token=x"),
            ("https://host", "wss://host/ws"),
            ("wss://host:1/?token=x", "wss://host:1/ws?token=x"),
            ("wss://[::1]:8443/other", "wss://[::1]:8443/other"),
        ] {
            assert_eq!(websocket_url(typed).as_deref(), Ok(url));
        }
        assert!(is_over_tls("wss://host/ws") && !is_over_tls("ws://wss/ws"));
        assert!(matches!(websocket_url("ftp://host"), Err(AddressError::Scheme(_))));
        for nothing in ["", "ws://", "ws:///ws", ":80", "https://", "wss://:443"] {
            assert!(matches!(websocket_url(nothing), Err(AddressError::Host(_))), "{nothing}");
        }
    }

    #[test]
    fn a_token_is_taken_out_of_an_address() {
        for token in ["secret", "open/Sesame+ü &x=%41", ""] {
            let url = websocket_url(&with_token("wss://host:1/other?a=1", token)).expect("an address");
            assert_eq!(without_token(&url), ("wss://host:1/other?a=1".to_owned(), Some(token.to_owned())));
        }
        assert_eq!(without_token("ws://host/ws?token=a+b%2"), ("ws://host/ws".to_owned(), Some("a b%2".to_owned())));
        assert_eq!(without_token("ws://host/ws"), ("ws://host/ws".to_owned(), None));
        assert_eq!(shown("ws://host?token=x"), "ws://host");
        assert_eq!(with_scene("ws://host/ws", "a room/1 & 2"), "ws://host/ws?scene=a%20room%2F1%20%26%202");
    }

    #[test]
    fn the_host_can_be_exchanged() {
        let url = "ws://[::1]:8080/ws?token=x";
        assert_eq!(authority(url), "[::1]:8080");
        assert_eq!(with_authority(url, "127.0.0.1:9"), "ws://127.0.0.1:9/ws?token=x");
    }
}
