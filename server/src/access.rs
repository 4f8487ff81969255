//! Who may connect: origins, tokens, and the headers that keep a page to itself.

use axum::http::{HeaderMap, HeaderName, HeaderValue, header};

/// Headers of every answer: the page is isolated, is not framed by others, and a rebuilt client is seen at once.
pub const SECURITY_HEADERS: [(HeaderName, HeaderValue); 7] = [
    (HeaderName::from_static("cross-origin-opener-policy"), HeaderValue::from_static("same-origin")),
    (HeaderName::from_static("cross-origin-embedder-policy"), HeaderValue::from_static("require-corp")),
    (HeaderName::from_static("cross-origin-resource-policy"), HeaderValue::from_static("same-origin")),
    (header::X_CONTENT_TYPE_OPTIONS, HeaderValue::from_static("nosniff")),
    (header::REFERRER_POLICY, HeaderValue::from_static("no-referrer")),
    (header::CONTENT_SECURITY_POLICY, HeaderValue::from_static("frame-ancestors 'none'")),
    (header::CACHE_CONTROL, HeaderValue::from_static("no-cache")),
];

/// Why a websocket was refused.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum Refused {
    /// A page of another site asked.
    #[error("the page's origin is neither this server nor loopback")]
    Origin,
    /// The token is missing or wrong.
    #[error("a token is needed: add ?token=... to the address")]
    Token,
}

/// Whether a websocket request may go on. Browsers always name the page's origin; programs need not. Without a token only
/// pages from loopback are let in: comparing the origin with the Host header alone would let in any site whose name an
/// attacker points at this machine.
pub fn check(headers: &HeaderMap, given_token: Option<&str>, token: Option<&str>) -> Result<(), Refused> {
    if let Some(token) = token
        && !given_token.is_some_and(|given| same_bytes(given.as_bytes(), token.as_bytes()))
    {
        return Err(Refused::Token);
    }
    let Some(origin) = headers.get(header::ORIGIN) else { return Ok(()) };
    let host = headers.get(header::HOST).and_then(|host| host.to_str().ok());
    let authority = origin.to_str().ok().and_then(|origin| origin.split_once("://")).map(|(_, authority)| authority);
    match authority {
        Some(authority) if is_loopback(authority) => Ok(()),
        Some(authority) if token.is_some() && Some(authority) == host => Ok(()),
        _ => Err(Refused::Origin),
    }
}

/// Whether `host[:port]` names this machine from within.
fn is_loopback(authority: &str) -> bool {
    let host = match authority.strip_prefix('[') {
        Some(rest) => rest.split(']').next().unwrap_or(rest),
        None => authority.split(':').next().unwrap_or(authority),
    };
    host.eq_ignore_ascii_case("localhost")
        || host.parse::<std::net::IpAddr>().is_ok_and(|address| address.is_loopback())
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

    #[test]
    fn programs_and_loopback_pages_may_connect() {
        for origin in [None, Some("http://localhost:8080"), Some("http://127.0.0.1:9"), Some("http://[::1]:8080")] {
            assert_eq!(check(&headers(origin, "127.0.0.1:8080"), None, None), Ok(()), "{origin:?}");
        }
    }

    #[test]
    fn pages_of_other_sites_may_not() {
        for origin in
            ["http://evil.example", "null", "http://127.0.0.1.evil.example:8080", "http://localhost.evil.example"]
        {
            assert_eq!(check(&headers(Some(origin), "127.0.0.1:8080"), None, None), Err(Refused::Origin), "{origin}");
        }
        let rebound = headers(Some("http://evil.example:8080"), "evil.example:8080");
        assert_eq!(check(&rebound, None, None), Err(Refused::Origin), "a name that points here is not us");
    }

    #[test]
    fn a_token_opens_the_servers_own_page_and_is_required() {
        let own = headers(Some("https://host.example"), "host.example");
        assert_eq!(check(&own, Some("secret"), Some("secret")), Ok(()));
        assert_eq!(check(&own, Some("secreT"), Some("secret")), Err(Refused::Token));
        assert_eq!(check(&headers(None, "host.example"), None, Some("secret")), Err(Refused::Token));
        let other = headers(Some("https://evil.example"), "host.example");
        assert_eq!(check(&other, Some("secret"), Some("secret")), Err(Refused::Origin));
    }
}
