//! Ends that break the rules, flood, fall silent or never read.

use camera::{Motion, Rigid};
use glam::DVec3;
use vantage_protocol::codec::Coding;
use vantage_protocol::message::{Clock, Draws, Hello, Role, ServerMessage, VERSION, ViewSize, Welcome};
use vantage_protocol::session::{ClientConfig, ClientSession, Fault, ServerConfig, ServerSession, SessionError};
use vantage_protocol::staging::Playback;
use vantage_protocol::wire::{Envelope, WireError, encode_server, encode_update};
use vantage_protocol::{ClientMessage, Held, Staging};

use super::{VIEW, message, pose, welcome};

fn greeting() -> Hello {
    let (version, clock, budget_bytes, draws, role) = (VERSION, Clock::Wall, 0, Draws::default(), Role::Viewer);
    let (world_from_eye, resume, staging) = (None, None, None);
    Hello { version, clock, view: VIEW, budget_bytes, draws, role, world_from_eye, resume, staging }
}

/// No time goes so.
fn backwards() -> Staging {
    Staging { playback: Playback { rate: -1.0, ..Playback::default() }, ..Staging::default() }
}

fn said(hello: Hello) -> Vec<u8> {
    message(0.0, ClientMessage::Hello(Box::new(hello)))
}

fn hello() -> Vec<u8> {
    said(greeting())
}

fn server() -> ServerSession {
    ServerSession::new(ServerConfig::new(Clock::Wall, welcome()), 0.0)
}

/// The error of the last of these messages; a Goodbye must be ready that says so.
fn refusal(messages: &[Vec<u8>]) -> SessionError {
    let mut server = server();
    let (last, first) = messages.split_last().unwrap();
    first.iter().for_each(|bytes| server.handle(bytes, 0.1).unwrap());
    let error = server.handle(last, 0.2).unwrap_err();
    let mut client = ClientSession::new(ClientConfig::new(Clock::Wall, VIEW), 0.0);
    let said = std::iter::from_fn(|| server.poll_transmit(0.2)).find_map(|bytes| client.handle(&bytes, 0.3).err());
    assert_eq!(said, Some(SessionError::Goodbye { reason: error.to_string(), again: error.may_come_again() }));
    assert!(server.is_drained());
    assert_eq!(server.handle(last, 0.3), Err(SessionError::Closed));
    error
}

#[test]
fn hostile_clients_are_refused_by_name() {
    let pose =
        |seq, x_m| ClientMessage::Pose { seq, sampled_at_s: 0.0, world_from_eye: pose(x_m), motion: Motion::STILL };
    let other = Hello { version: 99, ..greeting() };
    assert_eq!(refusal(&[said(other)]), SessionError::Version { ours: VERSION, theirs: 99 });
    let other = Hello { clock: Clock::Virtual, ..greeting() };
    assert_eq!(refusal(&[said(other)]).fault(), Fault::Mismatch);
    for other in [
        Hello { view: ViewSize { width_px: 0, ..VIEW }, ..greeting() },
        Hello { world_from_eye: Some(super::pose(f64::NAN)), ..greeting() },
        Hello { staging: Some(Box::new(backwards())), ..greeting() },
    ] {
        assert!(matches!(refusal(&[said(other)]), SessionError::Range(_)));
    }
    assert!(matches!(refusal(&[message(0.0, ClientMessage::Restart)]), SessionError::Unexpected(_)));
    assert!(matches!(refusal(&[hello(), hello()]), SessionError::Unexpected(_)));
    let advance = message(0.0, ClientMessage::Advance { to_s: 1.0 });
    assert!(matches!(refusal(&[hello(), advance]), SessionError::Unexpected(_)));
    assert!(matches!(refusal(&[hello(), message(0.0, pose(1, f64::NAN))]), SessionError::Range(_)));
    assert!(matches!(
        refusal(&[hello(), message(0.0, ClientMessage::Stages(Box::new(backwards())))]),
        SessionError::Range(_)
    ));
    for motion in [Motion::along(DVec3::X * f64::INFINITY), Motion { fades_in_s: Some(0.0), ..Motion::STILL }] {
        let pose = ClientMessage::Pose { seq: 1, sampled_at_s: 0.0, world_from_eye: Rigid::IDENTITY, motion };
        assert!(matches!(refusal(&[hello(), message(0.0, pose)]), SessionError::Range(_)));
    }
    assert!(matches!(
        refusal(&[hello(), message(0.0, pose(1, 0.0)), message(0.0, pose(1, 1.0))]),
        SessionError::Range(_)
    ));
    let ack = ClientMessage::Ack { number: 1, digest: 0, bytes_received: 0 };
    assert!(matches!(refusal(&[hello(), message(0.0, ack)]), SessionError::Range(_)));
    assert!(matches!(refusal(&[hello(), vec![0; 4096]]), SessionError::Wire(WireError::TooLarge { .. })));
    assert!(matches!(refusal(&[hello(), vec![0; 12]]), SessionError::Wire(_)));
    assert_eq!(refusal(&[hello(), vec![0; 12]]).fault(), Fault::Peer);
}

#[test]
fn floods_are_cut_off() {
    let mut server = server();
    server.handle(&hello(), 0.0).unwrap();
    let flood = (0..10_000).find_map(|number| server.handle(&message(0.0, ClientMessage::Ping(number)), 1.0).err());
    assert_eq!(flood, Some(SessionError::TooMany("messages")));
    let mut server = self::server();
    server.handle(&hello(), 0.0).unwrap();
    let flood = (0..100).find_map(|_| server.handle(&message(0.0, ClientMessage::Restart), 1.0).err());
    assert_eq!(flood, Some(SessionError::TooMany("fresh starts")));
}

#[test]
fn silence_ends_either_end() {
    let mut server = server();
    assert_eq!(server.handle_timeout(9.9), Ok(()));
    assert_eq!(server.next_deadline_s(), Some(10.0));
    assert_eq!(server.handle_timeout(10.0), Err(SessionError::NoGreeting { after_s: 10.0 }));
    let mut server = self::server();
    server.handle(&hello(), 1.0).unwrap();
    assert_eq!(server.handle_timeout(21.0), Err(SessionError::Silent { after_s: 20.0 }));
    let mut client = ClientSession::new(ClientConfig::new(Clock::Wall, VIEW), 0.0);
    assert_eq!(client.handle_timeout(20.0), Err(SessionError::Silent { after_s: 20.0 }));
    assert_eq!(client.next_deadline_s(), None);
}

#[test]
fn a_client_that_never_reads_is_cut_off() {
    let mut server = server();
    server.handle(&hello(), 0.0).unwrap();
    let update = Held::default().commit(vec![], 0.0, 0).unwrap();
    server.send_update(&encode_update(&update, Coding::default()), 0.0).unwrap();
    assert!(!server.can_send_update(), "the socket has not taken the last one");
    let stalled = (1..100).find_map(|second| {
        let now_s = f64::from(second);
        server.handle(&message(now_s, ClientMessage::Ping(second)), now_s).unwrap();
        server.handle_timeout(now_s).err().map(|error| (second, error))
    });
    assert_eq!(stalled, Some((30, SessionError::Stalled { after_s: 30.0 })));
}

#[test]
fn hostile_servers_are_refused_by_name() {
    let greeted = || {
        let mut client = ClientSession::new(ClientConfig::new(Clock::Wall, VIEW), 0.0);
        let welcome = encode_server(&Envelope { at_s: 0.0, message: ServerMessage::Welcome(welcome()) });
        client.handle(&welcome[0], 0.0).unwrap();
        client
    };
    let say = |client: &mut ClientSession, message| {
        client.handle(&encode_server(&Envelope { at_s: 0.0, message })[0], 0.1).unwrap_err()
    };
    let mut new = ClientSession::new(ClientConfig::new(Clock::Wall, VIEW), 0.0);
    assert!(matches!(say(&mut new, ServerMessage::Pong(1)), SessionError::Unexpected(_)));
    assert!(matches!(say(&mut greeted(), ServerMessage::Pong(77)), SessionError::Unexpected(_)));
    let bad = Welcome { near_m: 0.0, ..welcome() };
    let mut new = ClientSession::new(ClientConfig::new(Clock::Wall, VIEW), 0.0);
    assert!(matches!(say(&mut new, ServerMessage::Welcome(bad)), SessionError::Range(_)));
    assert!(matches!(say(&mut greeted(), ServerMessage::Welcome(welcome())), SessionError::Unexpected(_)));
    assert!(matches!(greeted().handle(&[1; 60], 0.1), Err(SessionError::Wire(_))));
}
