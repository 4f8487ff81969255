//! The sessions of both ends: against anything, and against each other over a path that damages what it carries.

use std::collections::VecDeque;
use std::sync::Arc;

use protocol::codec::Coding;
use protocol::message::{Clock, ServerMessage, ViewSize};
use protocol::session::{
    ClientConfig, ClientEvent, ClientSession, ReceivedUpdate, ServerConfig, ServerEvent, ServerSession, Trail,
};
use protocol::wire::{
    EncodedUpdate, Envelope, decode_client, decode_server, decode_update, encode_client, encode_server, encode_update,
};
use protocol::{Edit, Held, Limits, Material};

use crate::caps;
use crate::make::Source;

/// Steps of time between two events, in seconds: within a frame, past each deadline, and an age.
const STEPS_S: [f64; 8] = [0.0, 0.004, 0.02, 0.3, 2.5, 11.0, 31.0, 1e9];
const VIEW: ViewSize = ViewSize { width_px: 640, height_px: 360, fov_y_rad: 1.0 };

/// The first byte says which ends there are, and on which clock.
pub fn session(bytes: &[u8]) -> bool {
    let mut source = Source::new(bytes);
    let kind = source.byte();
    let clock = if kind & 0x80 == 0 { Clock::Wall } else { Clock::Virtual };
    match kind % 3 {
        0 => server(&mut source, clock),
        1 => client(&mut source, clock),
        _ => both(&mut source),
    }
    true
}

fn new_server(source: &mut Source<'_>, clock: Clock, message_burst: f64) -> ServerSession {
    let mut welcome = source.welcome();
    // The server's own numbers are sound.
    welcome.scene_time_s = 0.0;
    let mut config = ServerConfig::new(clock, welcome);
    config.cameras = Arc::from(["corner".to_owned()]);
    config.message_burst = message_burst;
    config.limits.update_bytes = caps::protocol().update_bytes;
    ServerSession::new(config, 0.0)
}

fn new_client(clock: Clock) -> ClientSession {
    ClientSession::new(ClientConfig { limits: caps::protocol(), ..ClientConfig::new(clock, VIEW) }, 0.0)
}

/// The next update of a copy. Sessions mind its size, whether it clears, and nothing else: it may take several fragments.
fn next_update(source: &mut Source<'_>, held: &mut Held) -> EncodedUpdate {
    let mut edits = if source.flag() { vec![Edit::Clear] } else { Vec::new() };
    let tables = source.below(8).saturating_sub(4);
    edits.extend((0..tables).map(|_| Edit::Materials(vec![Material::default(); source.byte().into()])));
    edits.push(Edit::Join(source.word()));
    let update = held.commit(edits, 0.0, 0).unwrap_or_else(|error| panic!("none of these is refused: {error}"));
    encode_update(&update, Coding::default())
}

fn server(source: &mut Source<'_>, clock: Clock) {
    let (mut server, mut held, mut now_s) = (new_server(source, clock, 40.0), Held::default(), 0.0);
    let mut closed = false;
    while !source.is_empty() {
        let result = match source.below(12) {
            0..=4 => {
                let at_s = if source.below(4) == 3 { source.number() } else { now_s };
                let message = source.client_message(clock);
                server.handle(&encode_client(&Envelope { at_s, message }), now_s)
            }
            5 => server.handle(&encode_client(&Envelope { at_s: now_s, message: source.hello(clock) }), now_s),
            6 => server.handle(&source.bytes(u8::MAX), now_s),
            7 => server.handle_timeout(now_s),
            8 => {
                let update = next_update(source, &mut held);
                let could = server.can_send_update();
                assert!(server.send_update(&update, now_s).is_err() || could);
                Ok(())
            }
            9 => {
                now_s += STEPS_S[usize::from(source.below(8))];
                Ok(())
            }
            10 => server.run_until(now_s),
            _ => {
                server.advanced();
                Ok(())
            }
        };
        assert!(!closed || !server.is_open(), "a closed session opened");
        closed |= result.is_err();
        assert_eq!(server.next_deadline_s().is_none(), closed);
        check_server(&mut server, now_s, source.flag());
        if closed && server.is_drained() {
            return;
        }
    }
}

/// What it says can be heard, and what it reckons is a number.
fn check_server(server: &mut ServerSession, now_s: f64, takes: bool) {
    while takes && let Some(bytes) = server.poll_transmit(now_s) {
        if let Err(error) = decode_server(&bytes, &Limits::default()) {
            panic!("no client takes what the server says: {error}");
        }
    }
    while let Some(event) = server.poll_event() {
        if matches!(event, ServerEvent::Resume(_)) {
            server.resume(1, takes.then(Trail::default), now_s);
        }
    }
    assert!(server.next_deadline_s().is_none_or(f64::is_finite));
    assert!(server.round_trip_s().is_none_or(|s| s.is_finite() && s >= 0.0));
    assert!(server.throughput_bytes_per_s().is_none_or(|rate| rate.is_finite() && rate >= 0.0));
    assert!(server.queue_s().is_finite());
    assert!(server.pose().is_none_or(|pose| pose.world_from_eye.is_valid() && pose.motion.is_valid()));
    server.in_flight_and_window_bytes();
}

fn client(source: &mut Source<'_>, clock: Clock) {
    let (mut client, mut now_s) = (new_client(clock), 0.0);
    let (mut held, mut copy) = (Held::default(), Held::default());
    let mut waiting: Vec<Vec<u8>> = Vec::new();
    while !source.is_empty() {
        let result = match source.below(12) {
            0..=3 => {
                let at_s = if source.below(4) == 3 { source.number() } else { now_s };
                let message = source.server_message();
                let bytes = encode_server(&Envelope { at_s, message }).remove(0);
                take(&mut client, source, bytes.to_vec(), now_s)
            }
            4 => {
                let welcome = ServerMessage::Welcome(source.welcome());
                client.handle(&encode_server(&Envelope { at_s: now_s, message: welcome })[0], now_s)
            }
            5 => {
                let bytes = source.bytes(u8::MAX);
                take(&mut client, source, bytes, now_s)
            }
            6 => {
                waiting
                    .extend(next_update(source, &mut held).packed(now_s).fragments.iter().map(|bytes| bytes.to_vec()));
                Ok(())
            }
            7 if !waiting.is_empty() => {
                let mut bytes = waiting.remove(0);
                damage(source, &mut bytes);
                take(&mut client, source, bytes, now_s)
            }
            8 => client.handle_timeout(now_s),
            9 => client.run_until(now_s),
            10 => {
                client.set_pose(source.pose(), camera::Motion::STILL, now_s);
                client.set_draws(source.draws(), now_s);
                client.set_staging(&source.staging(), now_s);
                client.ask_name(source.short(), now_s);
                Ok(())
            }
            _ => {
                now_s += STEPS_S[usize::from(source.below(8))];
                Ok(())
            }
        };
        let is_over = result.is_err();
        assert!(!is_over || !client.is_open());
        hear(&mut client, &mut copy, now_s);
        check_client(&mut client);
        if is_over {
            return;
        }
    }
}

/// On either clock's way.
fn take(
    client: &mut ClientSession,
    source: &mut Source<'_>,
    bytes: Vec<u8>,
    now_s: f64,
) -> Result<(), protocol::session::SessionError> {
    if source.flag() { client.receive_virtual(bytes, |at_s, _| at_s + 0.01) } else { client.handle(&bytes, now_s) }
}

fn damage(source: &mut Source<'_>, bytes: &mut [u8]) {
    if source.below(8) == 7 && !bytes.is_empty() {
        let place = usize::from(source.short()) % bytes.len();
        bytes[place] = source.byte();
    }
}

/// Takes over updates as a client does; those that it refuses break its copy, which a fresh start mends.
fn hear(client: &mut ClientSession, copy: &mut Held, now_s: f64) {
    while let Some(event) = client.poll_event() {
        match event {
            ClientEvent::Update(update) => match apply(copy, &update) {
                true => client.applied(copy.number, copy.digest(), now_s),
                false => client.broken(now_s),
            },
            ClientEvent::Welcome(welcome) => assert!(welcome.start_world_from_eye.is_valid()),
            ClientEvent::Presenter(eye, playback) => assert!(eye.is_valid() && playback.is_valid()),
            ClientEvent::Name { .. } => {}
            ClientEvent::Advanced { .. } | ClientEvent::Inventory(_) => {}
        }
    }
}

fn apply(copy: &mut Held, update: &ReceivedUpdate) -> bool {
    let limits = caps::protocol();
    decode_update(&update.bytes, &limits).is_ok_and(|update| copy.apply_within(&update, &limits).is_ok())
}

fn check_client(client: &mut ClientSession) {
    while let Some(bytes) = client.poll_transmit() {
        if let Err(error) = decode_client(&bytes, &Limits::default()) {
            panic!("no server takes what the client says: {error}");
        }
    }
    assert!(client.next_deadline_s().is_none_or(|at_s| !at_s.is_nan()));
    assert!(client.round_trip_s().is_none_or(|s| s.is_finite() && s >= 0.0));
    let (here, all) = client.progress_bytes();
    assert!(here <= all);
}

/// Both ends on the wall clock, with a path that keeps messages waiting and damages some. While it damages none, neither end blames the other.
fn both(source: &mut Source<'_>) {
    let mut welcome_source = Source::new(&[]);
    let mut server = new_server(&mut welcome_source, Clock::Wall, 2000.0);
    let mut client = new_client(Clock::Wall);
    let (mut held, mut copy, mut now_s) = (Held::default(), Held::default(), 0.0);
    let (mut up, mut down) = (VecDeque::new(), VecDeque::new());
    let mut is_sound = true;
    while !source.is_empty() {
        match source.below(10) {
            0..=2 => {
                if let Some(mut bytes) = up.pop_front() {
                    is_sound &= !damaged(source, &mut bytes);
                    let result = server.handle(&bytes, now_s);
                    assert!(!is_sound || result.is_ok(), "the server refuses its client: {result:?}");
                }
            }
            3..=5 => {
                if let Some(mut bytes) = down.pop_front() {
                    is_sound &= !damaged(source, &mut bytes);
                    let result = client.handle(&bytes, now_s);
                    assert!(!is_sound || result.is_ok(), "the client refuses its server: {result:?}");
                    hear(&mut client, &mut copy, now_s);
                    assert!(!is_sound || copy.number == 0 || copy.number <= held.number);
                }
            }
            6 | 7 if server.can_send_update() => {
                let update = next_update(source, &mut held);
                if server.send_update(&update, now_s).is_err() {
                    // It must clear: the server's own copy begins anew, too.
                    is_sound = false;
                }
            }
            8 => {
                let pose = Some(source.pose()).filter(camera::Rigid::is_valid);
                client.set_pose(pose.unwrap_or(camera::Rigid::IDENTITY), camera::Motion::STILL, now_s);
            }
            _ => {
                now_s += STEPS_S[usize::from(source.below(4))];
                let results = [client.handle_timeout(now_s), server.handle_timeout(now_s)];
                is_sound &= results.iter().all(Result::is_ok);
            }
        }
        up.extend(std::iter::from_fn(|| client.poll_transmit()));
        down.extend(std::iter::from_fn(|| server.poll_transmit(now_s)).map(|bytes| bytes.to_vec()));
        let restarts =
            std::iter::from_fn(|| server.poll_event()).filter(|event| *event == ServerEvent::Restart).count();
        assert!(!is_sound || restarts == 0, "a sound copy is called broken");
    }
}

fn damaged(source: &mut Source<'_>, bytes: &mut Vec<u8>) -> bool {
    let before = bytes.clone();
    damage(source, bytes);
    *bytes != before
}
