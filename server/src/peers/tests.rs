//! What addresses may take.

use super::table::REMEMBERED;
use super::*;

fn limits(connections: usize) -> ServerLimits {
    let peers =
        PeerLimits { connections, doorsteps: 2, handshakes_per_s: 1.0, handshake_burst: 3.0, ..PeerLimits::default() };
    ServerLimits { peers, ..ServerLimits::default() }
}

fn peer(text: &str) -> SocketAddr {
    SocketAddr::new(text.parse().expect("an address"), 9)
}

fn peers(connections: usize) -> Arc<Peers> {
    Arc::new(Peers::new(&limits(connections), &[peer("10.0.0.1").ip()]))
}

#[test]
fn an_address_has_so_many_places_and_others_have_theirs() {
    let peers = peers(3);
    let one = peer("192.0.2.1");
    let mut taken: Vec<Place> = (0..3).map(|_| peers.takes_place(one).expect("free")).collect();
    assert_eq!(peers.takes_place(one).err(), Some(Crowded::Connections(3)));
    assert!(peers.takes_place(peer("192.0.2.2")).is_ok());
    assert!(peers.takes_place(peer("::ffff:192.0.2.1")).is_err(), "the same one");
    taken.pop();
    assert!(peers.takes_place(one).is_ok(), "a place that is given back");
    assert_eq!(peers.refused()[1].1, 2);
}

#[test]
fn a_few_more_are_let_in_to_be_told() {
    let peers = peers(3);
    let one = peer("192.0.2.1");
    let connects = || peers.connects(one);
    let taken: Vec<_> = (0..3 + TOLD).map(|_| connects().expect("let in")).collect();
    assert!(taken.iter().take(3).all(|(_, crowded)| crowded.is_none()), "as many as may be");
    assert!(taken.iter().skip(3).all(|(_, crowded)| *crowded == Some(Crowded::Connections(3))), "to be told");
    assert!(connects().is_err());
    drop(taken);
    assert!(connects().expect("let in").1.is_none());
}

#[test]
fn doorsteps_and_handshakes_are_counted_by_themselves() {
    let peers = peers(100);
    let one = peer("192.0.2.1");
    let _steps = [peers.doorstep(one).expect("free"), peers.doorstep(one).expect("free")];
    assert_eq!(peers.doorstep(one).err(), Some(Crowded::Doorsteps));
    assert!(peers.doorstep(peer("192.0.2.2")).is_ok());
    assert_eq!((0..10).filter(|_| peers.may_shake_hands(one).is_ok()).count(), 3, "as many as at once");
    assert!(peers.may_shake_hands(peer("192.0.2.2")).is_ok());
}

#[test]
fn this_machine_and_proxies_are_not_counted() {
    let peers = peers(1);
    for free in ["127.0.0.1", "::1", "::ffff:127.0.0.1", "10.0.0.1"] {
        let _taken: Vec<_> = (0..50).map(|_| peers.connects(peer(free)).expect(free)).collect();
        assert!((0..50).all(|_| peers.may_shake_hands(peer(free)).is_ok()), "{free}");
    }
    assert_eq!(peers.known(), 0);
}

#[test]
fn what_is_remembered_is_bounded_and_who_is_there_is_not_forgotten() {
    let peers = peers(1);
    let here = peer("192.0.2.1");
    let _place = peers.takes_place(here).expect("free");
    for network in 0..3 * REMEMBERED as u128 {
        let spoofed = std::net::Ipv6Addr::from_bits((0x2001_0db8 << 96) | (network << 64) | 1);
        drop(peers.takes_place(SocketAddr::new(spoofed.into(), 1)).expect("free"));
    }
    assert!(peers.known() <= REMEMBERED, "{}", peers.known());
    assert!(peers.takes_place(here).is_err(), "still counted");
}

#[test]
fn all_together_are_bounded() {
    let limits = ServerLimits { clients: 1, doorsteps: 2, ..limits(usize::MAX - TOLD) };
    let peers = Arc::new(Peers::new(&limits, &[]));
    let mut taken = Vec::new();
    let crowded = loop {
        match peers.connects(peer("192.0.2.1")) {
            Ok(place) => taken.push(place),
            Err(crowded) => break crowded,
        }
    };
    assert_eq!(crowded, Crowded::Server);
    assert!(taken.len() <= 3 + PAGES, "{}", taken.len());
}
