//! A connection is cut off, and another one goes on.

use vantage_protocol::Held;
use vantage_protocol::message::Resume;
use vantage_protocol::session::{ClientConfig, ClientSession, ServerConfig, ServerSession};

use super::{ClientEvent, Clock, Pair, ServerEvent, VIEW, add, welcome};

/// A session with some updates, the last of which are on their way when the connection is cut; and how many those are.
fn cut_off() -> (Pair, u64) {
    let mut pair = Pair::new("rtt=200,mbit=20");
    pair.run(2.0, |pair| {
        if ((pair.now_s * 1000.0).round() as u64).is_multiple_of(50) && pair.server.can_send_update() {
            let edits = add(pair);
            pair.send(edits);
        }
    });
    let lost = pair.server_held.number - pair.client_held.number;
    assert!(pair.client_held.number > 5 && lost > 0, "{lost} of {}", pair.server_held.number);
    (pair, lost)
}

fn holds(held: &Held) -> Resume {
    Resume { secret: 1, number: held.number, digest: held.digest() }
}

/// Both ends of another connection, whose server knows what is left of the first one. Returns whether it goes on.
fn come_back(pair: &mut Pair, resume: Resume) -> bool {
    let trail = pair.server.take_trail();
    let config = ClientConfig { resume: Some(resume), ..ClientConfig::new(Clock::Wall, VIEW) };
    let mut after = Pair::new("rtt=200,mbit=20");
    after.client = ClientSession::new(config, 0.0);
    after.server = ServerSession::new(ServerConfig::new(Clock::Wall, welcome()), 0.0);
    after.client_held = std::mem::take(&mut pair.client_held);
    after.server_held = std::mem::take(&mut pair.server_held);
    let hello = after.client.poll_transmit().unwrap();
    after.server.handle(&hello, 0.1).unwrap();
    assert_eq!(after.server.poll_event(), Some(ServerEvent::Resume(resume)));
    assert!(!after.server.can_send_update(), "before it is known what the client holds");
    let goes_on = after.server.resume(1, Some(trail), 0.1);
    let said = after.server.poll_transmit(0.1).unwrap();
    after.client.handle(&said, 0.2).unwrap();
    let Some(ClientEvent::Welcome(welcome)) = after.client.poll_event() else { panic!("a welcome") };
    assert_eq!(welcome.resumed, goes_on);
    *pair = after;
    goes_on
}

#[test]
fn what_was_on_its_way_is_sent_again_and_both_copies_are_one() {
    let (mut pair, lost) = cut_off();
    let resume = holds(&pair.client_held);
    assert!(come_back(&mut pair, resume));
    pair.run(1.0, |_| {});
    assert_eq!(pair.applied as u64, lost);
    assert_eq!(pair.client_held.digest(), pair.server_held.digest());
    assert_eq!(pair.server.in_flight_and_window_bytes().0, 0);
    let edits = add(&pair);
    pair.send(edits);
    pair.run(1.0, |_| {});
    assert_eq!(pair.client_held.digest(), pair.server_held.digest());
    assert_eq!(pair.restarts, 0);
}

#[test]
fn it_may_be_cut_off_again_before_anything_came() {
    let (mut pair, lost) = cut_off();
    let resume = holds(&pair.client_held);
    assert!(come_back(&mut pair, resume));
    assert!(come_back(&mut pair, resume));
    pair.run(1.0, |_| {});
    assert_eq!(pair.applied as u64, lost);
    assert_eq!(pair.client_held.digest(), pair.server_held.digest());
}

#[test]
fn another_copy_begins_anew() {
    for spoil in [
        |resume: Resume| Resume { digest: resume.digest ^ 1, ..resume },
        |resume: Resume| Resume { number: resume.number + 1000, ..resume },
        |resume: Resume| Resume { number: 1, ..resume },
    ] {
        let (mut pair, _) = cut_off();
        let resume = spoil(holds(&pair.client_held));
        assert!(!come_back(&mut pair, resume));
        assert!(pair.server.can_send_update());
    }
}
