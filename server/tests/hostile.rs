//! Clients that misbehave, vanish or do not read: each is cut off, and nobody else notices.

mod net;

use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use axum::http::{HeaderName, header};
use camera::written::NamedCamera;
use camera::{Camera, Pinhole, Rigid};
use futures_util::{SinkExt, StreamExt};
use net::{Client, Socket, VIEW, config, room, secret, socket, start};
use protocol::limits::Limits;
use protocol::message::{ClientMessage, Clock, Draws, Hello, Role, ServerMessage, VERSION};
use protocol::wire::{Envelope, ServerPacket, decode_server, encode_client};
use tokio_tungstenite::tungstenite::Message;
use tokio_tungstenite::tungstenite::client::IntoClientRequest;
use vantage_server::{Config, Running};

fn hello(version: u16, clock: Clock) -> Message {
    hello_for(version, clock, Role::Viewer)
}

fn hello_for(version: u16, clock: Clock, role: Role) -> Message {
    let draws = Draws::default();
    let (budget_bytes, world_from_eye, resume, staging) = (1 << 30, None, None, None);
    say(ClientMessage::Hello(Box::new(Hello {
        version,
        clock,
        view: VIEW,
        budget_bytes,
        draws,
        role,
        world_from_eye,
        resume,
        staging,
    })))
}

fn say(message: ClientMessage) -> Message {
    Message::Binary(encode_client(&Envelope { at_s: 0.0, message }).into())
}

/// Reads until the server says goodbye; gives its words, or none where the connection just ended.
async fn goodbye(socket: &mut Socket) -> Option<String> {
    farewell(socket).await.map(|(reason, _)| reason)
}

/// The same, and whether it may be otherwise for who comes again.
async fn farewell(socket: &mut Socket) -> Option<(String, bool)> {
    let reading = async {
        while let Some(Ok(message)) = socket.next().await {
            let Message::Binary(bytes) = message else { continue };
            let message = decode_server(&bytes, &Limits::default()).expect("a sound message").message;
            if let ServerPacket::Control(ServerMessage::Goodbye { reason, again }) = message {
                return Some((reason, again));
            }
        }
        None
    };
    tokio::time::timeout(Duration::from_secs(10), reading).await.expect("the server ends the session")
}

/// The server still serves others.
async fn still_serves(running: &Running) {
    let mut client = Client::connect(running, Clock::Wall).await;
    client.run(10.0, |client| !client.updates.is_empty()).await.expect("a session");
    assert_eq!(client.updates.len(), 1);
}

async fn eventually(what: &str, condition: impl Fn() -> bool) {
    let begun = Instant::now();
    while !condition() {
        assert!(begun.elapsed() < Duration::from_secs(10), "{what}");
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
}

#[tokio::test]
async fn each_kind_of_nonsense_is_answered_by_its_name() {
    let running = start(config(), room(false), Duration::ZERO).await;
    let cases: [(&str, Vec<Message>, &str); 7] = [
        ("a wrong version", vec![hello(VERSION + 1, Clock::Wall)], "version"),
        ("a wrong clock", vec![hello(VERSION, Clock::Virtual)], "clock"),
        ("no hello", vec![say(ClientMessage::Ping(1))], "before Hello"),
        ("garbage", vec![Message::Binary(vec![0xAB; 100].into())], ""),
        ("text", vec![Message::Text("hello".into())], "text"),
        ("too large", vec![Message::Binary(vec![0; 1 << 20].into())], ""),
        (
            "too many",
            std::iter::once(hello(VERSION, Clock::Wall))
                .chain((0..5000).map(|n| say(ClientMessage::Ping(n))))
                .collect(),
            "too many",
        ),
    ];
    for (index, (name, messages, words)) in cases.into_iter().enumerate() {
        let mut socket = socket(&running).await;
        for message in messages {
            if socket.send(message).await.is_err() {
                break;
            }
        }
        let reason = goodbye(&mut socket).await;
        if !words.is_empty() {
            let reason = reason.unwrap_or_else(|| panic!("{name}: no goodbye"));
            assert!(reason.contains(words), "{name}: {reason}");
        }
        eventually(name, || running.stats.cut_off.load(Ordering::Relaxed) == index as u64 + 1).await;
        still_serves(&running).await;
    }
    running.stop().await;
}

#[tokio::test]
async fn who_asks_for_a_camera_that_is_not_there_is_told_those_that_are_and_others_go_on() {
    let mut scene = room(true);
    for name in ["both-sides", "two-corners"] {
        let camera = Camera::Pinhole(Pinhole::symmetric(Rigid::IDENTITY, (32, 32), 1.0, 0.1));
        scene.named_cameras.push(NamedCamera { name: name.to_owned(), camera });
    }
    let running = start(config(), scene, Duration::ZERO).await;
    let mut other = Client::connect(&running, Clock::Wall).await;
    other.run(10.0, |other| !other.updates.is_empty()).await.expect("a session");
    for (asked, words) in [("nowhere".to_owned(), "\"nowhere\""), (String::new(), "\"\""), ("x".repeat(900), "\"xxx")] {
        let mut socket = socket(&running).await;
        socket.send(hello_for(VERSION, Clock::Wall, Role::Camera(asked))).await.expect("send");
        let reason = goodbye(&mut socket).await.expect("words");
        assert!([words, "both-sides, two-corners"].iter().all(|word| reason.contains(word)), "{reason}");
        let so_far = other.updates.len();
        other.run(10.0, |other| other.updates.len() > so_far).await.expect("a session that goes on");
        assert!(other.updates.len() > so_far);
    }
    running.stop().await;
}

#[tokio::test]
async fn a_client_that_vanishes_is_cleaned_up() {
    let running = start(config(), room(false), Duration::from_millis(50)).await;
    for _ in 0..5 {
        let mut socket = socket(&running).await;
        socket.send(hello(VERSION, Clock::Wall)).await.expect("send");
        drop(socket);
    }
    eventually("sessions end", || running.stats.clients.load(Ordering::Relaxed) == 0).await;
    assert_eq!(running.stats.connected.load(Ordering::Relaxed), 5);
    still_serves(&running).await;
    running.stop().await;
}

#[tokio::test]
async fn a_client_that_never_reads_is_cut_off_and_others_are_served() {
    let mut config = Config { image_size_px: 256, ..config() };
    config.limits.stall = Duration::from_secs(1);
    let running = start(config, room(true), Duration::ZERO).await;
    let mut stuck = socket(&running).await;
    stuck.send(hello(VERSION, Clock::Wall)).await.expect("send");
    let mut client = Client::connect(&running, Clock::Wall).await;
    client.run(20.0, |client| client.updates.len() >= 10).await.expect("a session");
    assert!(client.updates.len() >= 10, "{} updates beside a stuck client", client.updates.len());
    eventually("cut off", || running.stats.cut_off.load(Ordering::Relaxed) == 1).await;
    client.run(0.5, |_| false).await.expect("a session that goes on");
    drop(stuck);
    running.stop().await;
}

#[tokio::test]
async fn a_client_that_says_nothing_is_cut_off() {
    let mut config = config();
    config.limits.hello = Duration::from_millis(300);
    let running = start(config, room(false), Duration::ZERO).await;
    let mut silent = socket(&running).await;
    assert!(goodbye(&mut silent).await.expect("words").contains("no greeting"));
    running.stop().await;
}

#[tokio::test]
async fn a_wrong_digest_begins_anew() {
    let running = start(config(), room(false), Duration::ZERO).await;
    let mut client = Client::connect(&running, Clock::Wall).await;
    client.run(10.0, |client| client.updates.len() == 2).await.expect("a session");
    client.session.broken(client.now_s());
    client.run(10.0, |client| client.updates.len() == 4).await.expect("a session");
    assert!(client.updates[2].clears, "a coarse picture first");
    assert_eq!(client.held.patches.len(), 2, "and then a set");
    running.stop().await;
}

/// What a server says to who asks for `path` with these headers, and whether it may be otherwise later.
async fn refusal(running: &Running, path: &str, headers: &[(HeaderName, &str)]) -> Option<(String, bool)> {
    let mut request = format!("ws://{}{path}", running.addr).into_client_request().expect("a request");
    for (name, value) in headers {
        request.headers_mut().insert(name, value.parse().expect("a value"));
    }
    let (mut socket, _) = tokio_tungstenite::connect_async(request).await.expect("it is opened, to say why");
    farewell(&mut socket).await
}

#[tokio::test]
async fn pages_of_other_sites_and_wrong_tokens_are_told_why_they_are_refused() {
    let running = start(config(), room(false), Duration::ZERO).await;
    let evil = (header::ORIGIN, "http://evil.example");
    let (why, again) = refusal(&running, "/ws", &[evil]).await.expect("words");
    assert!(why.contains("origin") && !again, "{why}");
    running.stop().await;
    let running = start(Config { access: secret(), ..config() }, room(false), Duration::ZERO).await;
    let wrong = (header::AUTHORIZATION, "Bearer wrong");
    for (path, headers, words) in [
        ("/ws", vec![], "a token is needed"),
        ("/ws?token=wrong", vec![], "the token is wrong"),
        ("/ws", vec![wrong], "the token is wrong"),
    ] {
        let (why, again) = refusal(&running, path, &headers).await.expect("words");
        assert!(why.contains(words) && !again, "{why}");
        assert!(!why.contains("secret"), "{why}");
    }
    assert_eq!(running.stats.connected.load(Ordering::Relaxed), 0, "none of them was a session");
    let url = format!("ws://{}/ws?token=secret", running.addr);
    let (mut socket, _) = tokio_tungstenite::connect_async(url).await.expect("the right token opens");
    socket.send(hello(VERSION, Clock::Wall)).await.expect("send");
    eventually("a session", || running.stats.updates.load(Ordering::Relaxed) > 0).await;
    running.stop().await;
}

#[tokio::test]
async fn more_clients_than_places_are_told_to_come_again() {
    let mut config = config();
    config.limits.clients = 2;
    let running = start(config, room(false), Duration::ZERO).await;
    let mut clients = [Client::connect(&running, Clock::Wall).await, Client::connect(&running, Clock::Wall).await];
    for client in &mut clients {
        client.run(10.0, |client| client.welcome.is_some()).await.expect("a session");
    }
    let mut third = socket(&running).await;
    third.send(hello(VERSION, Clock::Wall)).await.expect("send");
    let (why, again) = farewell(&mut third).await.expect("words");
    assert!(why.contains("2 clients are here already") && again, "{why}");
    drop(clients);
    eventually("places are free", || running.stats.clients.load(Ordering::Relaxed) == 0).await;
    still_serves(&running).await;
    running.stop().await;
}

#[tokio::test]
async fn who_never_greets_keeps_no_place_from_others() {
    let mut config = config();
    config.limits.clients = 1;
    config.limits.doorsteps = 3;
    let running = start(config, room(false), Duration::ZERO).await;
    let _silent = [socket(&running).await, socket(&running).await];
    still_serves(&running).await;
    running.stop().await;
}
