//! What counts as one address, and whom a proxy asks for.

use std::net::{IpAddr, Ipv6Addr, SocketAddr};

use axum::http::HeaderMap;

/// Where a proxy says whom it asks for; each one that a request comes by adds the address that it got it from at the end.
const FORWARDED: &str = "x-forwarded-for";
/// Of IPv6, what one customer is given at least: whoever has one address has all of that network (RFC 6177).
const NETWORK: u128 = !0 << 64;

/// One address of IPv4, or one network of 64 bits of IPv6.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Address(u128);

impl Address {
    /// Of a peer.
    pub fn of(peer: IpAddr) -> Address {
        match peer.to_canonical() {
            IpAddr::V4(v4) => Address(v4.to_ipv6_mapped().to_bits()),
            IpAddr::V6(v6) => Address(Ipv6Addr::to_bits(v6) & NETWORK),
        }
    }
}

/// See [`super::Peers::who_asks`]. Of what is no address nothing further is believed: then it is the last proxy that asks.
pub(super) fn who_asks(peer: SocketAddr, headers: &HeaderMap, proxies: &[IpAddr]) -> SocketAddr {
    let is_trusted = |ip: IpAddr| proxies.contains(&ip.to_canonical());
    if !is_trusted(peer.ip()) {
        return peer;
    }
    let mut asks = peer;
    let lines: Vec<&str> = headers.get_all(FORWARDED).iter().filter_map(|line| line.to_str().ok()).collect();
    for hop in lines.iter().rev().flat_map(|line| line.rsplit(',')) {
        let Some(hop) = parsed(hop.trim()) else { break };
        asks = hop;
        if !is_trusted(hop.ip()) {
            break;
        }
    }
    asks
}

/// An address, with or without a port; of IPv6 with brackets or, without a port, without.
fn parsed(hop: &str) -> Option<SocketAddr> {
    let bare = || hop.trim_start_matches('[').trim_end_matches(']').parse::<IpAddr>().ok();
    hop.parse().ok().or_else(|| bare().map(|ip| SocketAddr::new(ip, 0)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn address(text: &str) -> Address {
        Address::of(text.parse().expect("an address"))
    }

    #[test]
    fn a_network_of_ipv6_is_one_address_and_mapped_ones_are_of_ipv4() {
        assert_eq!(address("2001:db8:1:2::1"), address("2001:db8:1:2:ffff::9"));
        assert_ne!(address("2001:db8:1:2::1"), address("2001:db8:1:3::1"));
        assert_eq!(address("192.0.2.1"), address("::ffff:192.0.2.1"));
        assert_ne!(address("192.0.2.1"), address("192.0.2.2"));
    }

    #[test]
    fn who_asks_is_the_last_that_no_trusted_proxy_is() {
        let proxies = ["10.0.0.1", "10.0.0.2"].map(|ip| ip.parse().expect("an address"));
        let asks = |peer: &str, lines: &[&'static str]| {
            let mut headers = HeaderMap::new();
            for line in lines {
                headers.append(FORWARDED, line.parse().expect("a value"));
            }
            who_asks(SocketAddr::new(peer.parse().expect("an address"), 7), &headers, &proxies).ip().to_string()
        };
        assert_eq!(asks("192.0.2.9", &["198.51.100.1"]), "192.0.2.9", "who is not trusted may say what it likes");
        assert_eq!(asks("10.0.0.1", &[]), "10.0.0.1");
        assert_eq!(asks("10.0.0.1", &["198.51.100.1"]), "198.51.100.1");
        assert_eq!(
            asks("10.0.0.1", &["6.6.6.6, 198.51.100.1"]),
            "198.51.100.1",
            "the first ones are what the peer said"
        );
        assert_eq!(asks("10.0.0.1", &["6.6.6.6", "198.51.100.1, 10.0.0.2"]), "198.51.100.1");
        assert_eq!(asks("10.0.0.1", &["198.51.100.1:4711"]), "198.51.100.1");
        assert_eq!(asks("10.0.0.1", &["[2001:db8::1]:4711"]), "2001:db8::1");
        assert_eq!(asks("10.0.0.1", &["2001:db8::1"]), "2001:db8::1");
        assert_eq!(asks("10.0.0.1", &["198.51.100.1, nonsense"]), "10.0.0.1");
        assert_eq!(asks("::ffff:10.0.0.1", &["198.51.100.1"]), "198.51.100.1");
    }
}
