//! Who may connect: origins, tokens, and the headers that keep a page to itself.

use std::net::IpAddr;

use axum::http::{HeaderMap, HeaderName, HeaderValue, header};
use protocol::message::TOKEN_SUBPROTOCOL;

/// Headers of every answer beside [`Access::content_security_policy`]: the page is isolated, uses none of a machine's devices, and a rebuilt client is seen at once.
pub const SECURITY_HEADERS: [(HeaderName, HeaderValue); 7] = [
    (HeaderName::from_static("cross-origin-opener-policy"), HeaderValue::from_static("same-origin")),
    (HeaderName::from_static("cross-origin-embedder-policy"), HeaderValue::from_static("require-corp")),
    (HeaderName::from_static("cross-origin-resource-policy"), HeaderValue::from_static("same-origin")),
    (header::X_CONTENT_TYPE_OPTIONS, HeaderValue::from_static("nosniff")),
    (header::REFERRER_POLICY, HeaderValue::from_static("no-referrer")),
    (HeaderName::from_static("permissions-policy"), HeaderValue::from_static(PERMISSIONS_POLICY)),
    (header::CACHE_CONTROL, HeaderValue::from_static("no-cache")),
];

/// Of every answer over TLS by a certificate of files: for a year this host is asked over TLS only. Not where a certificate is made at start, as on a machine where something
/// is tried: what else is there under the same name would be out of reach.
pub const TLS_ONLY: (HeaderName, HeaderValue) =
    (header::STRICT_TRANSPORT_SECURITY, HeaderValue::from_static("max-age=31536000"));

/// Content Security Policy, level 3. Scripts and styles are files of this server, of which WebAssembly is compiled; the icon is in the page,
/// and small pictures of scenes are blobs that the page asked for. Websockets lead to any server, as
/// `?server=` may name another one: what is said there is data, and that server lets in whom it will. Who may frame the page follows.
const CONTENT_SECURITY_POLICY: &str = "default-src 'none'; script-src 'self' 'wasm-unsafe-eval'; style-src 'self'; img-src 'self' data: blob:; \
    worker-src 'self'; connect-src 'self' ws: wss:; base-uri 'none'; form-action 'none'; frame-ancestors 'self' \
    http://localhost:* https://localhost:* http://127.0.0.1:* https://127.0.0.1:*";

/// Headers of the one file that pages of every origin may run: an element that frames the page (`web/static/vantage-view.js`).
pub const FOR_EVERY_PAGE: [(HeaderName, HeaderValue); 2] = [
    (header::ACCESS_CONTROL_ALLOW_ORIGIN, HeaderValue::from_static("*")),
    (HeaderName::from_static("cross-origin-resource-policy"), HeaderValue::from_static("cross-origin")),
];

/// Nothing of this is used, so nothing that gets into the page can ask for it.
const PERMISSIONS_POLICY: &str = "accelerometer=(), camera=(), display-capture=(), geolocation=(), gyroscope=(), \
    hid=(), microphone=(), midi=(), payment=(), serial=(), usb=()";

/// How pages give a token beside their websocket: in hexadecimal, as headers hold no letters of most languages.
const HEX_SCHEME: &str = "Vantage-Hex ";

/// Who may connect.
#[derive(Debug, Clone, Default)]
pub struct Access {
    /// What a client must know.
    pub token: Option<String>,
    /// Origins of pages that may connect beside the server's own, as `https://host` or `https://host:port`.
    pub origins: Vec<String>,
    /// Proxies that are believed to say whom they ask for.
    pub proxies: Vec<IpAddr>,
}

impl Access {
    /// The policy of the page, which pages may frame that may connect: of this machine, by its names that a policy can hold, and of origins that were named.
    pub fn content_security_policy(&self) -> HeaderValue {
        let also = self.origins.iter().map(|origin| origin.trim_end_matches('/'));
        // An origin with a space or a semicolon would say something else.
        let also = also.filter(|origin| origin.chars().all(|c| c.is_ascii_graphic() && !matches!(c, ';' | ',')));
        let policy = also.fold(CONTENT_SECURITY_POLICY.to_owned(), |policy, origin| policy + " " + origin);
        HeaderValue::from_str(&policy).unwrap_or(HeaderValue::from_static(CONTENT_SECURITY_POLICY))
    }
}

/// Why a websocket was refused.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum Refused {
    /// A page of another site asked.
    #[error("the page's origin is neither this server, nor loopback, nor one that --allow-origin names")]
    Origin,
    /// There is no token.
    #[error("a token is needed: add #token=... to the page's address, or give it to the viewer by --token")]
    NoToken,
    /// The token is another.
    #[error("the token is wrong")]
    WrongToken,
}

/// Whether a websocket request may go on. Browsers always name the page's origin; programs need not. Without a token only
/// pages from loopback are let in: comparing the origin with the Host header alone would let in any site whose name an
/// attacker points at this machine. `in_address`: the token of the address, for clients that can give it nowhere else.
pub fn check(headers: &HeaderMap, in_address: Option<&str>, access: &Access) -> Result<(), Refused> {
    if let Some(token) = &access.token {
        let given = token_of(headers).or_else(|| in_address.map(str::to_owned)).ok_or(Refused::NoToken)?;
        if !same_bytes(given.as_bytes(), token.as_bytes()) {
            return Err(Refused::WrongToken);
        }
    }
    let Some(origin) = headers.get(header::ORIGIN) else { return Ok(()) };
    let host = headers.get(header::HOST).and_then(|host| host.to_str().ok());
    let origin = origin.to_str().map_err(|_| Refused::Origin)?;
    let authority = origin.split_once("://").map(|(_, authority)| authority).ok_or(Refused::Origin)?;
    let is_own = access.token.is_some() && Some(authority) == host;
    let is_allowed = access.origins.iter().any(|allowed| allowed.trim_end_matches('/').eq_ignore_ascii_case(origin));
    if is_loopback(authority) || is_own || is_allowed { Ok(()) } else { Err(Refused::Origin) }
}

/// The same for who reads what is told of a server. A page of the same origin names none when it reads, so without a token the host must be this machine by a
/// name that nobody else can point here.
pub fn check_reader(headers: &HeaderMap, in_address: Option<&str>, access: &Access) -> Result<(), Refused> {
    check(headers, in_address, access)?;
    let host = headers.get(header::HOST).and_then(|host| host.to_str().ok());
    let is_here = access.token.is_some() || host.is_none_or(is_loopback);
    if is_here { Ok(()) } else { Err(Refused::Origin) }
}

/// The token of a request's headers: that of a bearer, of a page, or one of the offered protocols.
fn token_of(headers: &HeaderMap) -> Option<String> {
    let value = |name| headers.get(name).and_then(|value: &HeaderValue| value.to_str().ok());
    if let Some(bearer) = value(header::AUTHORIZATION).and_then(|value| value.strip_prefix("Bearer ")) {
        return Some(bearer.trim().to_owned());
    }
    let by_page = value(header::AUTHORIZATION).and_then(|value| value.strip_prefix(HEX_SCHEME));
    let offered = || {
        let mut offered = value(header::SEC_WEBSOCKET_PROTOCOL)?.split(',').map(str::trim);
        offered.find_map(|protocol| protocol.strip_prefix(TOKEN_SUBPROTOCOL))
    };
    let hex = by_page.or_else(offered)?;
    let byte = |index: usize| hex.get(index..index + 2).and_then(|digits| u8::from_str_radix(digits, 16).ok());
    String::from_utf8((0..hex.len()).step_by(2).map(byte).collect::<Option<_>>()?).ok()
}

/// Whether `host[:port]` names this machine from within.
fn is_loopback(authority: &str) -> bool {
    let host = match authority.strip_prefix('[') {
        Some(rest) => rest.split(']').next().unwrap_or(rest),
        None => authority.split(':').next().unwrap_or(authority),
    };
    host.eq_ignore_ascii_case("localhost") || host.parse::<IpAddr>().is_ok_and(|address| address.is_loopback())
}

/// Compares in a time that depends on the lengths only.
fn same_bytes(a: &[u8], b: &[u8]) -> bool {
    a.len() == b.len() && a.iter().zip(b).fold(0, |difference, (a, b)| difference | (a ^ b)) == 0
}

#[cfg(test)]
mod tests {
    use super::*;

    fn headers(origin: Option<&'static str>, host: &'static str) -> HeaderMap {
        let mut headers = HeaderMap::new();
        headers.insert(header::HOST, HeaderValue::from_static(host));
        if let Some(origin) = origin {
            headers.insert(header::ORIGIN, HeaderValue::from_static(origin));
        }
        headers
    }

    fn with_token(origins: &[&str]) -> Access {
        let origins = origins.iter().map(|&origin| origin.to_owned()).collect();
        Access { token: Some("secret".to_owned()), origins, ..Access::default() }
    }

    #[test]
    fn who_may_connect_may_frame_the_page() {
        let framers = |origins: &[&str]| {
            let policy = with_token(origins).content_security_policy();
            let policy = policy.to_str().expect("ASCII").to_owned();
            policy.split("frame-ancestors ").nth(1).expect("said last").to_owned()
        };
        assert!(framers(&[]).starts_with("'self' http://localhost:*"));
        assert!(
            framers(&["https://notes.example/", "http://here:9"]).ends_with(" https://notes.example http://here:9")
        );
        assert_eq!(framers(&["https://a; script-src *", "https://ü"]), framers(&[]), "says nothing else");
    }

    #[test]
    fn programs_and_loopback_pages_may_connect() {
        for origin in [None, Some("http://localhost:8080"), Some("http://127.0.0.1:9"), Some("http://[::1]:8080")] {
            let open = Access::default();
            assert_eq!(check(&headers(origin, "127.0.0.1:8080"), None, &open), Ok(()), "{origin:?}");
        }
    }

    #[test]
    fn pages_of_other_sites_may_not() {
        let open = Access::default();
        for origin in
            ["http://evil.example", "null", "http://127.0.0.1.evil.example:8080", "http://localhost.evil.example"]
        {
            assert_eq!(check(&headers(Some(origin), "127.0.0.1:8080"), None, &open), Err(Refused::Origin), "{origin}");
        }
        assert_eq!(check_reader(&headers(None, "evil.example:8080"), None, &open), Err(Refused::Origin));
        assert_eq!(check_reader(&headers(None, "127.0.0.1:8080"), None, &open), Ok(()));
        let rebound = headers(Some("http://evil.example:8080"), "evil.example:8080");
        assert_eq!(check(&rebound, None, &open), Err(Refused::Origin), "a name that points here is not us");
    }

    #[test]
    fn a_token_opens_the_servers_own_page_and_is_required() {
        let access = with_token(&[]);
        let own = headers(Some("https://host.example"), "host.example");
        assert_eq!(check(&own, Some("secret"), &access), Ok(()));
        assert_eq!(check(&own, Some("secreT"), &access), Err(Refused::WrongToken));
        assert_eq!(check(&headers(None, "host.example"), None, &access), Err(Refused::NoToken));
        let other = headers(Some("https://evil.example"), "host.example");
        assert_eq!(check(&other, Some("secret"), &access), Err(Refused::Origin));
    }

    #[test]
    fn a_token_may_come_by_headers() {
        for (name, value, expected) in [
            (header::AUTHORIZATION, "Bearer secret", Ok(())),
            (header::AUTHORIZATION, "Bearer other", Err(Refused::WrongToken)),
            (header::AUTHORIZATION, "Basic secret", Err(Refused::NoToken)),
            (header::SEC_WEBSOCKET_PROTOCOL, "vantage, vantage.token.736563726574", Ok(())),
            (header::SEC_WEBSOCKET_PROTOCOL, "vantage.token.7365637265", Err(Refused::WrongToken)),
            (header::SEC_WEBSOCKET_PROTOCOL, "vantage.token.73x", Err(Refused::NoToken)),
            (header::SEC_WEBSOCKET_PROTOCOL, "vantage", Err(Refused::NoToken)),
        ] {
            let mut headers = headers(None, "host.example");
            headers.insert(name, HeaderValue::from_static(value));
            assert_eq!(check(&headers, None, &with_token(&[])), expected, "{value}");
        }
    }

    #[test]
    fn allowed_origins_are_whole_ones() {
        let access = with_token(&["https://viewer.example/", "http://lab.example:81"]);
        for (origin, is_in) in [
            ("https://viewer.example", true),
            ("http://viewer.example", false),
            ("https://viewer.example.evil", false),
            ("http://lab.example:81", true),
            ("http://lab.example", false),
        ] {
            let checked = check(&headers(Some(origin), "host.example"), Some("secret"), &access);
            assert_eq!(checked.is_ok(), is_in, "{origin}");
        }
    }
}
