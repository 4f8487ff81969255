//! Peers that attack: each is cut off, with words where there is somebody to hear them, and the server is as it was.
//!
//! Cases of websockets follow the categories of the Autobahn test suite (framing, pings, reserved bits, opcodes, fragmentation, UTF-8, closing, limits).

mod net;
mod raw;

use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use net::{Client, VIEW, config, request, room, start};
use protocol::message::{ClientMessage, Clock, Draws, Hello, Resume, Role, VERSION};
use protocol::wire::{Envelope, encode_client};
use raw::{
    BINARY, CLOSE, CONTINUATION, Frame, PING, PONG, SOUND, TEXT, answer, connect_from, frames, goodbye, open, read_all,
};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;
use vantage_server::tls::Tls;
use vantage_server::{Config, Running};

/// A stream of numbers that its seed decides (Steele, Lea, Flood 2014, SplitMix64).
struct Rng(u64);

impl Rng {
    fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mixed = (self.0 ^ self.0 >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let mixed = (mixed ^ mixed >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        mixed ^ mixed >> 31
    }

    fn below(&mut self, count: usize) -> usize {
        (self.bits() % count.max(1) as u64) as usize
    }
}

fn hello(resume: Option<Resume>) -> ClientMessage {
    let draws = Draws::default();
    let (budget_bytes, world_from_eye, role, staging) = (1 << 30, None, Role::Viewer, None);
    ClientMessage::Hello(Box::new(Hello {
        version: VERSION,
        clock: Clock::Wall,
        view: VIEW,
        budget_bytes,
        draws,
        role,
        world_from_eye,
        resume,
        staging,
    }))
}

fn said(message: ClientMessage) -> Vec<u8> {
    SOUND.bytes(BINARY, &encode_client(&Envelope { at_s: 0.0, message }))
}

/// Files that this process has open. Every test of this file is a process's part, so a difference is only asked for at most.
fn descriptors() -> usize {
    std::fs::read_dir("/proc/self/fd").map_or(0, Iterator::count)
}

/// Nobody is there any more, the server is well, and serves.
async fn is_as_it_was(running: &Running) {
    let begun = Instant::now();
    while running.stats.clients.load(Ordering::Relaxed) > 0 {
        assert!(begun.elapsed() < raw::SOON, "sessions stay");
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
    assert!(request(running, "/healthz", "").await.contains("\"ok\":true"));
    assert_eq!(running.stats.faults.load(Ordering::Relaxed), 0);
    let mut client = Client::connect(running, Clock::Wall).await;
    client.run(20.0, |client| !client.updates.is_empty()).await.expect("a session");
    assert!(!client.updates.is_empty());
}

#[tokio::test(flavor = "multi_thread")]
async fn frames_that_break_the_rules_end_a_session_with_words() {
    let running = start(config(), room(false), Duration::ZERO).await;
    let part = Frame { is_last: false, ..SOUND };
    let reserved = |reserved| Frame { reserved, ..SOUND };
    let claims = |claims| Frame { claims: Some(claims), ..SOUND };
    let cases: Vec<(&str, Vec<Vec<u8>>)> = vec![
        ("not masked", vec![Frame { is_masked: false, ..SOUND }.bytes(BINARY, b"bare")]),
        ("the first reserved bit", vec![reserved(4).bytes(BINARY, b"x")]),
        ("the second reserved bit", vec![reserved(2).bytes(BINARY, b"x")]),
        ("the third reserved bit, of a ping", vec![reserved(1).bytes(PING, b"x")]),
        ("a reserved opcode", vec![SOUND.bytes(3, b"x")]),
        ("a reserved opcode of control", vec![SOUND.bytes(11, b"x")]),
        ("a ping in parts", vec![part.bytes(PING, b"x")]),
        ("a close in parts", vec![part.bytes(CLOSE, &1000_u16.to_be_bytes())]),
        ("a ping that is too long", vec![SOUND.bytes(PING, &[0; 126])]),
        ("a continuation of nothing", vec![SOUND.bytes(CONTINUATION, b"x")]),
        ("another message among parts", vec![part.bytes(BINARY, b"x"), SOUND.bytes(BINARY, b"y")]),
        (
            "parts that are too much together",
            vec![part.bytes(BINARY, &[0; 4000]), SOUND.bytes(CONTINUATION, &[0; 4000])],
        ),
        ("too long", vec![SOUND.bytes(BINARY, &[0; 5000])]),
        ("says that it is huge", vec![claims(1 << 40).bytes(BINARY, b"x")]),
        ("says that it is as long as can be", vec![claims(u64::MAX).bytes(BINARY, b"x")]),
        ("text", vec![SOUND.bytes(TEXT, b"hello")]),
        ("text that is no UTF-8", vec![SOUND.bytes(TEXT, &[0xc0, 0xaf])]),
        ("nothing at all in a message", vec![SOUND.bytes(BINARY, b"")]),
        ("not a frame", vec![b"GET / HTTP/1.1\r\n\r\n".to_vec()]),
    ];
    for (index, (name, sent)) in cases.iter().enumerate() {
        let mut stream = open(running.addr).await;
        for bytes in sent {
            drop(stream.write_all(bytes).await);
        }
        let heard = read_all(&mut stream).await;
        assert!(goodbye(&heard).is_some(), "{name}: no words in {:?}", frames(&heard));
        let begun = Instant::now();
        while running.stats.cut_off.load(Ordering::Relaxed) < index as u64 + 1 {
            assert!(begun.elapsed() < raw::SOON, "{name}: not cut off");
            tokio::time::sleep(Duration::from_millis(10)).await;
        }
    }
    is_as_it_was(&running).await;
    running.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn frames_that_keep_the_rules_are_taken() {
    let running = start(config(), room(false), Duration::ZERO).await;
    let mut stream = open(running.addr).await;
    let message = encode_client(&Envelope { at_s: 0.0, message: hello(None) });
    let (first, second) = message.split_at(message.len() / 2);
    // A hello in three parts, one of them empty, with a ping and a pong that nobody asked for between them.
    let part = Frame { is_last: false, ..SOUND };
    for bytes in [
        part.bytes(BINARY, first),
        SOUND.bytes(PING, b"between"),
        part.bytes(CONTINUATION, b""),
        SOUND.bytes(PONG, b"unasked"),
        SOUND.bytes(CONTINUATION, second),
    ] {
        stream.write_all(&bytes).await.expect("taken");
    }
    // Only then: who is told goodbye may leave a ping unanswered (RFC 6455, 5.5.3).
    let mut bytes = Vec::new();
    while !frames(&bytes).contains(&(PONG, b"between".to_vec())) {
        let read = tokio::time::timeout(Duration::from_secs(20), stream.read_buf(&mut bytes)).await;
        assert!(read.expect("in time").expect("read") > 0, "{:?}", frames(&bytes));
    }
    stream.write_all(&SOUND.bytes(CLOSE, &1000_u16.to_be_bytes())).await.expect("taken");
    bytes.extend(read_all(&mut stream).await);
    let heard = frames(&bytes);
    assert!(heard.iter().any(|(opcode, _)| *opcode == CLOSE), "{heard:?}");
    is_as_it_was(&running).await;
    assert_eq!(running.stats.cut_off.load(Ordering::Relaxed), 0);
    running.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn closes_of_all_kinds_end_a_session() {
    let running = start(config(), room(false), Duration::ZERO).await;
    let code = |code: u16, reason: &[u8]| [&code.to_be_bytes()[..], reason].concat();
    for payload in [
        vec![],
        vec![3],
        code(1000, b"done"),
        code(999, b""),
        code(1004, b""),
        code(1005, b""),
        code(1006, b""),
        code(1015, b""),
        code(2999, b""),
        code(65535, b""),
        code(1000, &[0xff, 0xfe]),
        code(3000, &[b'x'; 123]),
    ] {
        let mut stream = open(running.addr).await;
        stream.write_all(&SOUND.bytes(CLOSE, &payload)).await.expect("write");
        read_all(&mut stream).await;
    }
    is_as_it_was(&running).await;
    running.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn handshakes_that_break_the_rules_open_nothing() {
    let running = start(config(), room(false), Duration::ZERO).await;
    let sound = raw::upgrade(running.addr, "");
    assert!(sound.contains("Sec-WebSocket-Version: 13") && sound.contains(raw::KEY));
    let floods = "X-Flood: 0123456789\r\n".repeat(200);
    let long = format!("X-Long: {}\r\n", "a".repeat(64 << 10));
    let cases: [(&str, Vec<u8>, &[&str]); 14] = [
        ("no key", sound.replace(raw::KEY, "").into(), &["400"]),
        ("another version", sound.replace("Version: 13", "Version: 12").into(), &["400", "426"]),
        ("no version", sound.replace("Sec-WebSocket-Version: 13\r\n", "").into(), &["400", "426"]),
        ("no upgrade", sound.replace("Upgrade: websocket\r\n", "").into(), &["400", "426"]),
        ("another upgrade", sound.replace("Upgrade: websocket", "Upgrade: h2c").into(), &["400", "426"]),
        ("of HTTP/1.0", sound.replace("HTTP/1.1", "HTTP/1.0").into(), &["400", "426", "505", ""]),
        ("a method that none is", sound.replace("GET", "POST").into(), &["405"]),
        ("a flood of headers", raw::upgrade(running.addr, &floods).into(), &["431"]),
        ("a header that is too long", raw::upgrade(running.addr, &long).into(), &["431"]),
        ("an address that is too long", format!("GET /{} HTTP/1.1\r\n\r\n", "a".repeat(80 << 10)).into(), &["414", "431"]),
        ("no HTTP", b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03".to_vec(), &["400", ""]),
        ("a header with a zero", sound.replace("Host: ", "Host: \0").into(), &["400"]),
        ("two lengths", "POST /ws HTTP/1.1\r\nHost: a\r\nContent-Length: 5\r\nContent-Length: 6\r\n\r\nhello".into(), &["400", "405"]),
        (
            "a body in parts that says its length as well",
            "POST / HTTP/1.1\r\nHost: a\r\nTransfer-Encoding: chunked\r\nContent-Length: 4\r\nConnection: close\r\n\r\n0\r\n\r\n".into(),
            &["400", "404", "405"],
        ),
    ];
    for (name, request, statuses) in cases {
        let mut stream = TcpStream::connect(running.addr).await.expect("connect");
        drop(stream.write_all(&request).await);
        let mut start = [0; 12];
        let reading = tokio::time::timeout(raw::SOON, stream.read_exact(&mut start));
        let heard = match reading.await.expect("an answer, or the end") {
            Ok(_) => String::from_utf8_lossy(&start).into_owned(),
            Err(_) => String::new(),
        };
        let status = heard
            .strip_prefix("HTTP/1.1 ")
            .or(heard.strip_prefix("HTTP/1.0 "))
            .and_then(|rest| rest.get(..3))
            .unwrap_or("");
        assert!(statuses.contains(&status), "{name}: {status:?} of {heard:?}");
    }
    assert_eq!(running.stats.connected.load(Ordering::Relaxed), 0);
    is_as_it_was(&running).await;
    running.stop().await;
}

/// Messages that real clients send.
fn real() -> Vec<Vec<u8>> {
    let eye = camera::Rigid::IDENTITY;
    let motion = camera::Motion::along(glam::DVec3::X);
    let messages = [
        hello(None),
        hello(Some(Resume { secret: 7, number: 3, digest: 9 })),
        ClientMessage::View(VIEW),
        ClientMessage::Pose { seq: 1, sampled_at_s: 0.1, world_from_eye: eye, motion },
        ClientMessage::Ack { number: 1, digest: 5, bytes_received: 1000 },
        ClientMessage::Restart,
        ClientMessage::Draws(Draws::default()),
        ClientMessage::Ping(4),
        ClientMessage::Inventory,
    ];
    messages.into_iter().map(|message| encode_client(&Envelope { at_s: 0.2, message })).collect()
}

/// A message that was damaged in one of the usual ways.
fn damaged(rng: &mut Rng, real: &[Vec<u8>]) -> Vec<u8> {
    let mut bytes = real[rng.below(real.len())].clone();
    for _ in 0..=rng.below(3) {
        let place = rng.below(bytes.len());
        match rng.below(5) {
            0 => bytes.truncate(place),
            1 => bytes.extend((0..rng.below(40)).map(|_| rng.bits() as u8).collect::<Vec<_>>()),
            2 => {
                let other = &real[rng.below(real.len())];
                bytes.truncate(place);
                bytes.extend(&other[rng.below(other.len())..]);
            }
            3 if !bytes.is_empty() => bytes[place] = [0, 0xff, 0x7f, 0x80][rng.below(4)],
            _ if !bytes.is_empty() => bytes[place] ^= 1 << rng.below(8),
            _ => {}
        }
    }
    bytes
}

#[tokio::test(flavor = "multi_thread")]
async fn damaged_messages_disturb_nobody() {
    let running = start(config(), room(false), Duration::ZERO).await;
    let mut other = Client::connect(&running, Clock::Wall).await;
    other.run(20.0, |other| !other.updates.is_empty()).await.expect("a session");
    let (real, mut rng) = (real(), Rng(1));
    for round in 0..150 {
        let mut stream = open(running.addr).await;
        let greets = round % 3 > 0;
        if greets {
            drop(stream.write_all(&SOUND.bytes(BINARY, &real[0])).await);
        }
        for _ in 0..rng.below(12) {
            if stream.write_all(&SOUND.bytes(BINARY, &damaged(&mut rng, &real))).await.is_err() {
                break;
            }
        }
        if round % 2 == 0 {
            drop(stream.write_all(&SOUND.bytes(CLOSE, b"")).await);
            read_all(&mut stream).await;
        }
    }
    other.run(0.5, |_| false).await.expect("a session that goes on");
    drop(other);
    is_as_it_was(&running).await;
    running.stop().await;
}

/// Says some things after a sound hello; gives the words that the server ends it with.
async fn ended_for(running: &Running, messages: Vec<ClientMessage>) -> String {
    let mut stream = open(running.addr).await;
    for message in std::iter::once(hello(None)).chain(messages) {
        if stream.write_all(&said(message)).await.is_err() {
            break;
        }
    }
    goodbye(&read_all(&mut stream).await).expect("words")
}

#[tokio::test(flavor = "multi_thread")]
async fn lies_are_found_out() {
    let running = start(config(), room(false), Duration::ZERO).await;
    let ack = |number, digest| ClientMessage::Ack { number, digest, bytes_received: 0 };
    assert!(ended_for(&running, vec![ack(1 << 40, 1)]).await.contains("never sent"));
    assert!(ended_for(&running, vec![ack(u64::MAX, 0)]).await.contains("never sent"));
    let restarts = (0..200).map(|_| ClientMessage::Restart).collect();
    assert!(ended_for(&running, restarts).await.contains("too many fresh starts"));
    let eye = camera::Rigid::IDENTITY;
    let pose = |seq, x: f64, at_s| {
        let world_from_eye = camera::Rigid { translation: glam::DVec3::splat(x), ..eye };
        ClientMessage::Pose { seq, sampled_at_s: at_s, world_from_eye, motion: camera::Motion::along(glam::DVec3::X) }
    };
    assert!(ended_for(&running, vec![pose(1, f64::NAN, 0.0)]).await.contains("a value of a pose"));
    assert!(ended_for(&running, vec![pose(1, 0.0, f64::INFINITY)]).await.contains("a value of a pose"));
    assert!(ended_for(&running, vec![pose(2, 0.0, 0.0), pose(1, 0.0, 0.0)]).await.contains("the number of a pose"));
    let flood = (1..5000).map(|seq| pose(seq, seq as f64, 0.0)).collect();
    assert!(ended_for(&running, flood).await.contains("too many messages"));
    is_as_it_was(&running).await;
    running.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn poses_at_the_ends_of_numbers_are_survived() {
    let running = start(config(), room(true), Duration::ZERO).await;
    let ends = [f64::MAX, -f64::MAX, 1e300, 1e38, 1e-310, -0.0, 5e-324, 1e16];
    for (index, &end) in ends.iter().enumerate() {
        let mut client = Client::connect(&running, Clock::Wall).await;
        client.run(20.0, |client| !client.updates.is_empty()).await.expect("a session");
        let mut eye = client.start_eye();
        eye.translation[index % 3] = end;
        let motion = camera::Motion::along(glam::DVec3::new(end, -end, 1.0));
        client.session.set_pose(eye, motion, client.now_s());
        // Whether it is served or refused is the server's affair.
        drop(client.run(1.0, |_| false).await);
    }
    is_as_it_was(&running).await;
    running.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn guessed_secrets_open_no_session() {
    let running = start(config(), room(false), Duration::ZERO).await;
    let mut real = Client::connect(&running, Clock::Wall).await;
    real.run(20.0, |real| !real.updates.is_empty()).await.expect("a session");
    let mut rng = Rng(2);
    for _ in 0..100 {
        let secret = u128::from(rng.bits()) << 64 | u128::from(rng.bits());
        let mut stream = open(running.addr).await;
        drop(stream.write_all(&said(hello(Some(Resume { secret, number: 1, digest: rng.bits() })))).await);
        drop(stream.write_all(&SOUND.bytes(CLOSE, &1000_u16.to_be_bytes())).await);
        read_all(&mut stream).await;
    }
    assert_eq!(running.stats.resumed.load(Ordering::Relaxed), 0);
    real.run(0.5, |_| false).await.expect("a session that goes on");
    drop(real);
    is_as_it_was(&running).await;
    running.stop().await;
}

/// Sends bytes one by one until the server has had enough, or forever.
async fn drips(mut stream: TcpStream, bytes: Vec<u8>, every: Duration) -> Vec<u8> {
    let (mut reading, mut writing) = stream.split();
    let mut heard = Vec::new();
    let dripping = async {
        for byte in bytes.iter().chain(std::iter::repeat(&b'a')) {
            if writing.write_all(&[*byte]).await.is_err() {
                break;
            }
            tokio::time::sleep(every).await;
        }
    };
    let listening = async {
        let mut bytes = [0; 1024];
        while let Ok(count @ 1..) = reading.read(&mut bytes).await {
            heard.extend(&bytes[..count]);
        }
    };
    tokio::time::timeout(2 * raw::SOON, async {
        tokio::select! { () = dripping => {}, () = listening => {} }
    })
    .await
    .expect("the server ends the connection");
    heard
}

#[tokio::test(flavor = "multi_thread")]
async fn who_sends_slowly_is_hung_up_on() {
    let mut limits = config().limits;
    (limits.hello, limits.silence) = (Duration::from_secs(1), Duration::from_secs(2));
    let running = start(Config { limits, ..config() }, room(false), Duration::ZERO).await;
    let tls = Tls::self_signed(std::net::Ipv4Addr::LOCALHOST.into()).expect("a certificate");
    let over_tls = start(Config { tls: Some(tls), ..config() }, room(false), Duration::ZERO).await;
    let every = Duration::from_millis(200);
    let plain = async || TcpStream::connect(running.addr).await.expect("connect");
    let head = raw::upgrade(running.addr, "").replace("\r\n\r\n", "\r\nX-Slow: ");
    let greeted = {
        let mut stream = open(running.addr).await;
        stream.write_all(&said(hello(None))).await.expect("write");
        stream
    };
    let first_bytes_of_tls = [0x16, 0x03, 0x01, 0x40, 0x00, 0x01, 0x00, 0x3f, 0xfc, 0x03, 0x03].to_vec();
    let half_a_frame = Frame { claims: Some(4000), ..SOUND }.bytes(BINARY, b"");
    let idle = plain().await;
    let (in_head, in_hello, in_frame, in_tls, silent) = tokio::join!(
        drips(plain().await, head.into(), every),
        drips(open(running.addr).await, half_a_frame.clone(), every),
        drips(greeted, half_a_frame, every),
        drips(TcpStream::connect(over_tls.addr).await.expect("connect"), first_bytes_of_tls, every),
        async {
            let mut idle = idle;
            read_all(&mut idle).await
        },
    );
    assert!(!in_head.starts_with(b"HTTP/1.1 101"), "{in_head:?}");
    assert!(goodbye(&in_hello).is_some_and(|why| why.contains("no greeting")), "{in_hello:?}");
    assert!(goodbye(&in_frame).is_some_and(|why| why.contains("nothing heard")), "{:?}", frames(&in_frame));
    assert!(in_tls.is_empty() && silent.is_empty(), "{in_tls:?} {silent:?}");
    is_as_it_was(&running).await;
    running.stop().await;
    over_tls.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn who_reads_slowly_is_hung_up_on() {
    let mut config = Config { image_size_px: 256, ..config() };
    config.limits.stall = Duration::from_secs(1);
    let running = start(config, room(true), Duration::ZERO).await;
    let mut stream = open(running.addr).await;
    stream.write_all(&said(hello(None))).await.expect("write");
    let begun = Instant::now();
    // Some bytes now and then, and never an acknowledgement.
    let mut bytes = [0; 64];
    while let Ok(count @ 1..) = stream.read(&mut bytes).await {
        assert!(count > 0 && begun.elapsed() < 2 * raw::SOON, "it is still served");
        if running.stats.cut_off.load(Ordering::Relaxed) > 0 {
            break;
        }
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
    drop(stream);
    is_as_it_was(&running).await;
    running.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn one_address_takes_no_more_than_its_share() {
    let mut config = config();
    config.limits.peers.loopback = true;
    (config.limits.peers.connections, config.limits.peers.doorsteps) = (12, 4);
    let running = start(config, room(false), Duration::ZERO).await;
    let before = descriptors();
    let mut attackers = Vec::new();
    for _ in 0..300 {
        attackers.push(connect_from([127, 0, 0, 9], running.addr).await.expect("connect"));
    }
    // Twelve are let in and answered; all others are told that they are too many.
    let asks = format!("GET /healthz HTTP/1.1\r\nHost: {}\r\n\r\n", running.addr);
    let (mut served, mut told) = (0, 0);
    for stream in &mut attackers {
        drop(stream.write_all(asks.as_bytes()).await);
        let mut start = [0; 12];
        let answered = tokio::time::timeout(raw::SOON, stream.read_exact(&mut start)).await.expect("in time");
        served += usize::from(answered.is_ok() && start.ends_with(b"200"));
        told += usize::from(answered.is_ok() && start.ends_with(b"429"));
    }
    assert_eq!(served, 12);
    assert!(told >= 50, "{told} were told");
    // Another address is served meanwhile.
    let other =
        raw::open_over(connect_from([127, 0, 0, 10], running.addr).await.expect("connect"), running.addr, "").await;
    drop(other);
    drop(attackers);
    let begun = Instant::now();
    while descriptors() > before + 8 {
        assert!(begun.elapsed() < raw::SOON, "{} descriptors, {before} before", descriptors());
        tokio::time::sleep(Duration::from_millis(50)).await;
    }
    let again = answer_from([127, 0, 0, 9], &running, &asks.replace("\r\n\r\n", "\r\nConnection: close\r\n\r\n")).await;
    assert!(again.starts_with("HTTP/1.1 200"), "{again}");
    running.stop().await;
}

async fn answer_from(from: [u8; 4], running: &Running, request: &str) -> String {
    let mut stream = connect_from(from, running.addr).await.expect("connect");
    stream.write_all(request.as_bytes()).await.expect("write");
    String::from_utf8_lossy(&read_all(&mut stream).await).into_owned()
}

#[tokio::test(flavor = "multi_thread")]
async fn doorsteps_and_handshakes_of_one_address_are_bounded_and_it_is_told() {
    let mut config = config();
    config.limits.hello = Duration::from_secs(60);
    config.access.proxies = vec![[127, 0, 0, 1].into()];
    let peers = &mut config.limits.peers;
    (peers.doorsteps, peers.handshakes_per_s, peers.handshake_burst) = (6, 0.0, 4.0);
    let running = start(config, room(false), Duration::ZERO).await;
    let of = async |forwarded: &str| {
        let stream = TcpStream::connect(running.addr).await.expect("connect");
        raw::open_over(stream, running.addr, &format!("X-Forwarded-For: 6.6.6.6, {forwarded}\r\n")).await
    };
    // Four shake hands and say nothing; the fifth is told that it is too fast.
    let _silent = [of("192.0.2.1").await, of("192.0.2.1").await, of("192.0.2.1").await, of("192.0.2.1").await];
    let mut fifth = of("192.0.2.1").await;
    let why = goodbye(&read_all(&mut fifth).await).expect("words");
    assert!(why.contains("come too fast"), "{why}");
    // Another one behind the same proxy is not, until it has as many doorsteps as it may.
    let mut others = vec![of("192.0.2.2").await, of("192.0.2.2").await];
    others.push(of("2001:db8::1").await);
    let full = raw::upgrade(running.addr, "X-Forwarded-For: 192.0.2.1\r\n");
    let metrics = request(&running, "/metrics", "").await;
    assert!(metrics.contains("vantage_refused_total{what=\"handshakes\"} 1"), "{metrics}");
    assert!(answer(running.addr, full.as_bytes()).await.starts_with(b"HTTP/1.1 "), "answered in any case");
    running.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn what_a_peer_that_is_no_proxy_says_of_others_is_ignored() {
    let mut config = config();
    config.limits.peers.loopback = true;
    (config.limits.peers.handshakes_per_s, config.limits.peers.handshake_burst) = (0.0, 2.0);
    let running = start(config, room(false), Duration::ZERO).await;
    let mut refused = 0;
    for index in 0..5 {
        let stream = TcpStream::connect(running.addr).await.expect("connect");
        let mut stream = raw::open_over(stream, running.addr, &format!("X-Forwarded-For: 192.0.2.{index}\r\n")).await;
        drop(stream.write_all(&SOUND.bytes(CLOSE, &1000_u16.to_be_bytes())).await);
        refused += usize::from(goodbye(&read_all(&mut stream).await).is_some());
    }
    assert_eq!(refused, 3);
    running.stop().await;
}
