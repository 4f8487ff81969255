//! Messages come back as they went in; malformed and oversized ones are refused by name.

#![allow(clippy::unwrap_used, reason = "a test that unwraps fails, as it should")]

mod common;

use camera::{Motion, Rigid};
use common::{cast, fragments, patch, with_ends};
use glam::{DVec3, Vec3};
use proptest::prelude::*;
use vantage_protocol::codec::Coding;
use vantage_protocol::message::{
    Clock, Draws, Hello, Resume, Role, ServerMessage, Shadows, VERSION, ViewSize, Welcome,
};
use vantage_protocol::plain::{read_update, write_update};
use vantage_protocol::staging::{Excerpt, Parts, Playback, SceneMotion, Section};
use vantage_protocol::wire::{
    Assembler, Envelope, FRAGMENT_BYTES, Fragment, ServerPacket, UpdateHead, WireError, client_message_kind,
    decode_client, decode_server, decode_update, encode_client, encode_server, encode_update, server_message_kind,
};
use vantage_protocol::{
    Area, AreaShape, ClientMessage, Edit, Held, Instance, Light, Lighting, Limits, Look, Material, NextSteps,
    ObjectPose, ObjectShift, ObjectSteps, PatchId, Staging, Step, Steps, Update,
};

const VIEW: ViewSize = ViewSize { width_px: 640, height_px: 360, fov_y_rad: 1.0 };

fn staging(parts: u16) -> Staging {
    let section = Some(Section { normal_world: DVec3::Y, offset_m: 2.5 });
    let excerpt = Excerpt { parts: Parts::But((0..parts).collect()), section };
    Staging { playback: Playback { from_s: 1.0, scene_time_s: 2.0, rate: 0.5 }, excerpt }
}

fn client_messages() -> Vec<ClientMessage> {
    vec![
        ClientMessage::Hello(Box::new(Hello {
            version: VERSION,
            clock: Clock::Virtual,
            view: VIEW,
            budget_bytes: 1 << 30,
            draws: Draws { shadows: Shadows::Soft, antialiased: false, occlusion_reach_m: 0.5 },
            role: Role::Follower("ein Führer".to_owned()),
            world_from_eye: Some(Rigid::IDENTITY),
            resume: Some(Resume { secret: u128::MAX, number: 7, digest: u64::MAX }),
            staging: None,
        })),
        ClientMessage::View(VIEW),
        ClientMessage::Pose {
            seq: 7,
            sampled_at_s: 1.25,
            world_from_eye: Rigid::look_at(DVec3::ONE, DVec3::ZERO),
            motion: Motion { fades_in_s: Some(0.2), ..Motion::about(DVec3::X, DVec3::ONE, DVec3::Y) },
        },
        ClientMessage::Ack { number: u64::MAX, digest: 1, bytes_received: 2 },
        ClientMessage::Restart,
        ClientMessage::Ping(9),
        ClientMessage::Advance { to_s: 3.5 },
        ClientMessage::Stages(Box::new(staging(9))),
        ClientMessage::AskName { object: 65535 },
    ]
}

fn welcome() -> Welcome {
    Welcome {
        version: VERSION,
        scene_name: "städtchen".into(),
        bounds_min_world: [-1e7, 0.0, 0.0],
        bounds_max_world: [1e7, 1.0, 1.0],
        start_world_from_eye: Rigid::IDENTITY,
        walk: true,
        near_m: 0.05,
        look: Look::Flat,
        update_interval_s: 0.1,
        scene_time_s: 0.0,
        motion: SceneMotion::Loop { period_s: 2.5 },
        secret: 0,
        resumed: false,
    }
}

fn update() -> Update {
    update_of((1000, 800))
}

fn update_of(size_px: (u32, u32)) -> Update {
    let light = Light::Point {
        position_world: [1e7, 2.0, 3.0],
        intensity: [1.0; 3],
        direction_world: [0.0, -1.0, 0.0],
        spot_cos: [-1.0, -2.0],
        range_m: f32::INFINITY,
        area: Some(Area { half_world: [[1.0, 0.0, 0.0], [0.0, 0.0, 2.0]], shape: AreaShape::Disc }),
    };
    let lighting = Lighting {
        ambient: [0.1; 3],
        lights: vec![light; 16],
        background: [1, 2, 3],
        burley: true,
        ..Lighting::default()
    };
    let pose = ObjectPose { object: 7, world_from_object: glam::DAffine3::from_translation(DVec3::new(1e7, 0.0, 0.5)) };
    let shift = |object| ObjectShift {
        object,
        matrix: Steps { exponent: -24, counts: [1, 0, -1, 0, i32::MIN, 0, 0, 0, i32::MAX] },
        translation: Steps { exponent: -900, counts: [0, 0, 5] },
    };
    let edits = vec![
        Edit::Clear,
        Edit::Materials(vec![Material::default(); 256]),
        Edit::Light(Box::new(lighting)),
        Edit::Add(Box::new(patch(8, with_ends(cast(size_px, fragments))))),
        Edit::Remove(PatchId(8)),
        Edit::Delete(PatchId(1), vec![(0, 0), (65535, 0), (0, 65535), (3, 65535)]),
        Edit::Trim(PatchId(2), vec![(4, 4, 1), (5, 4, 4)]),
        Edit::Move(vec![]),
        Edit::Shift(vec![shift(65535), shift(7)]),
        Edit::Place(PatchId(9), vec![Instance { pose, tint: [1, 2, 255] }]),
        Edit::Withdraw(vec![7, 65535]),
        Edit::Join(0x0123_4567_89ab_cdef),
    ];
    let first = Step { way_world: Vec3::new(0.0, -2.0, 1e-9), turn_world: Vec3::Y };
    let second = Step { way_world: Vec3::Z, turn_world: Vec3::new(f32::MIN_POSITIVE, 3.0, f32::MAX) };
    let steps = |object| ObjectSteps { object, steps: [first, second, Step::default()] };
    let next = NextSteps { step_s: 0.025, objects: vec![steps(7), steps(65535)] };
    Update { number: 1 << 40, scene_time_s: 0.5, pose_seq: 3, edits, next, digest: 0xfeed }
}

#[test]
fn every_client_message_comes_back_and_is_small() {
    for message in client_messages() {
        let envelope = Envelope { at_s: 0.25, message };
        let bytes = encode_client(&envelope);
        // Who comes back names his session, once.
        let most = if matches!(envelope.message, ClientMessage::Hello(_)) { 192 } else { 128 };
        assert!(bytes.len() <= most, "{} bytes", bytes.len());
        assert_eq!(decode_client(&bytes, &Limits::default()).unwrap(), envelope);
    }
}

#[test]
fn a_greeting_that_names_as_many_parts_as_it_may_is_let_in() {
    let ClientMessage::Hello(mut hello) = client_messages().swap_remove(0) else { panic!("the first is a greeting") };
    hello.staging = Some(Box::new(staging(Parts::MOST as u16)));
    hello.role = Role::Presenter("x".repeat(Role::MAX_NAME_BYTES));
    let envelope = Envelope { at_s: 0.25, message: ClientMessage::Hello(hello) };
    assert_eq!(decode_client(&encode_client(&envelope), &Limits::default()).unwrap(), envelope);
}

#[test]
fn every_server_message_comes_back() {
    let messages = [
        ServerMessage::Welcome(welcome()),
        ServerMessage::Pong(3),
        ServerMessage::Advanced { to_s: 1.0 },
        ServerMessage::Goodbye { reason: "because".into(), again: true },
        ServerMessage::Presenter {
            world_from_eye: Rigid::look_at(DVec3::ONE, DVec3::ZERO),
            playback: Playback::default(),
        },
        ServerMessage::Name { object: 65535, name: "Tür".into() },
    ];
    for message in messages {
        let bytes = encode_server(&Envelope { at_s: -1.0, message: message.clone() });
        let envelope = decode_server(&bytes[0], &Limits::default()).unwrap();
        assert_eq!((envelope.at_s, envelope.message), (-1.0, ServerPacket::Control(message)));
    }
}

#[test]
fn messages_are_told_apart_without_their_sessions() {
    let sent = client_messages().into_iter().map(|message| encode_client(&Envelope { at_s: 0.25, message }));
    let kinds: Vec<_> = sent.filter_map(|bytes| client_message_kind(&bytes)).collect();
    assert_eq!(kinds, ["hello", "view", "pose", "ack", "restart", "ping", "advance", "stages", "ask_name"]);
    let kind = |message| server_message_kind(&encode_server(&Envelope { at_s: 0.0, message })[0]);
    assert_eq!(kind(ServerMessage::Update(Box::new(update_of((8, 8))))), Some("update"));
    assert_eq!(kind(ServerMessage::Pong(3)), Some("pong"));
    assert_eq!((client_message_kind(&[]), server_message_kind(&[0; 9])), (None, None));
}

#[test]
fn an_update_travels_in_small_fragments() {
    let limits = Limits::default();
    let messages = encode_server(&Envelope { at_s: 2.0, message: ServerMessage::Update(Box::new(update())) });
    assert!(messages.len() > 1 && messages.iter().all(|bytes| bytes.len() <= FRAGMENT_BYTES + 32));
    let mut assembler = Assembler::default();
    let mut whole = None;
    for bytes in &messages {
        assert!(whole.is_none());
        match decode_server(bytes, &limits).unwrap().message {
            ServerPacket::Fragment(fragment) => whole = assembler.push(fragment, &limits).unwrap(),
            ServerPacket::Control(message) => panic!("{message:?}"),
        }
    }
    let bytes = whole.unwrap();
    let head = UpdateHead::peek(&bytes).unwrap();
    assert_eq!((head.number, head.pose_seq, head.digest, head.clears), (1 << 40, 3, 0xfeed, true));
    assert!(decode_update(&bytes, &limits).unwrap() == update());
}

#[test]
fn fragments_out_of_sequence_are_refused() {
    let limits = Limits::default();
    let fragment = |update, offset, length| Fragment { update, total_bytes: 100, offset, bytes: vec![0; length] };
    let refused = [
        vec![fragment(1, 10, 10)],
        vec![fragment(1, 0, 10), fragment(1, 0, 10)],
        vec![fragment(1, 0, 10), fragment(1, 20, 10)],
        vec![fragment(1, 0, 10), fragment(2, 10, 10)],
        vec![fragment(1, 0, 10), fragment(1, 10, 91)],
        vec![fragment(1, 0, 0)],
    ];
    for fragments in refused {
        let mut assembler = Assembler::default();
        let result: Result<Vec<_>, _> =
            fragments.into_iter().map(|fragment| assembler.push(fragment, &limits)).collect();
        assert!(matches!(result, Err(WireError::Fragment(_))), "{result:?}");
        let (here, all) = assembler.progress_bytes();
        assert!(here <= all, "{here} of {all} bytes: what is refused is not kept");
    }
    let huge = Fragment { update: 1, total_bytes: u32::MAX, offset: 0, bytes: vec![0] };
    assert!(matches!(Assembler::default().push(huge, &limits), Err(WireError::TooLarge { .. })));
}

#[test]
fn malformed_and_oversized_messages_are_refused_by_name() {
    let limits = Limits::default();
    let ping = encode_client(&Envelope { at_s: 0.0, message: ClientMessage::Ping(1) });
    assert!(matches!(decode_client(&vec![0; 1025], &limits), Err(WireError::TooLarge { bytes: 1025, limit: 1024 })));
    assert!(matches!(decode_server(&vec![0; 1 << 20], &limits), Err(WireError::TooLarge { .. })));
    assert!(matches!(decode_client(&[], &limits), Err(WireError::EndsEarly(_))));
    assert!(matches!(decode_client(&[9; 20], &limits), Err(WireError::Kind(9))));
    assert!(matches!(decode_client(&[&ping[..], &[0]].concat(), &limits), Err(WireError::Control(_))));
    assert!(matches!(decode_client(&ping[..ping.len() - 1], &limits), Err(WireError::Control(_))));
    let mut timeless = ping;
    timeless[1..9].copy_from_slice(&f64::NAN.to_le_bytes());
    assert!(matches!(decode_client(&timeless, &limits), Err(WireError::Time)));
    // A text that claims to be longer than everything.
    let goodbye = Envelope { at_s: 0.0, message: ServerMessage::Goodbye { reason: "x".into(), again: false } };
    let mut bytes = encode_server(&goodbye).remove(0).to_vec();
    bytes[13..21].copy_from_slice(&u64::MAX.to_le_bytes());
    assert!(matches!(decode_server(&bytes, &limits), Err(WireError::Control(_))));
}

#[test]
fn an_update_that_claims_much_is_refused() {
    let mut bytes = encode_update(&update(), Coding::default()).bytes;
    bytes[33..37].copy_from_slice(&u32::MAX.to_le_bytes());
    assert!(decode_update(&bytes, &Limits::default()).is_err());
    let limits = Limits { update_samples: 1000, ..Limits::default() };
    assert!(matches!(
        decode_update(&encode_update(&update(), Coding::default()).bytes, &limits),
        Err(WireError::Codec(_))
    ));
    let limits = Limits { update_bytes: 100, ..Limits::default() };
    assert!(matches!(
        decode_update(&encode_update(&update(), Coding::default()).bytes, &limits),
        Err(WireError::TooLarge { .. })
    ));
    // Ways pack well: what they take once they are read is capped over all edits.
    let shift = |object| {
        let steps = (Steps { exponent: 0, counts: [0; 9] }, Steps { exponent: 0, counts: [1, 0, 0] });
        ObjectShift { object, matrix: steps.0, translation: steps.1 }
    };
    let half = Edit::Shift((0..40_000).map(shift).collect());
    for (edits, is_sound) in [(vec![half.clone()], true), (vec![half; 2], false)] {
        let bytes = encode_update(&Update { edits, ..update() }, Coding::default()).bytes;
        assert_eq!(decode_update(&bytes, &Limits::default()).is_ok(), is_sound);
    }
}

#[test]
fn an_update_comes_back_from_its_plain_bytes() {
    let update = update();
    let mut bytes = b"before".to_vec();
    write_update(&update, &mut bytes);
    let bytes = bytes.strip_prefix(b"before").unwrap();
    assert_eq!(read_update(bytes), Ok(update));
    for length in (0..bytes.len()).step_by(997).chain([bytes.len() - 1]) {
        assert!(read_update(&bytes[..length]).is_err(), "{length} of {} bytes", bytes.len());
    }
    assert!(read_update(&[bytes, &[0]].concat()).is_err(), "a byte too many");
}

/// A small update with an edit of every kind, for damage.
fn small() -> Vec<u8> {
    encode_update(&update_of((24, 16)), Coding::default()).bytes
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn random_messages_never_panic(bytes in prop::collection::vec(any::<u8>(), 0..300), kind in 0_u8..3) {
        let bytes = [&[kind][..], &bytes].concat();
        let limits = Limits::default();
        let _ = decode_client(&bytes, &limits);
        if let Ok(Envelope { message: ServerPacket::Fragment(fragment), .. }) = decode_server(&bytes, &limits) {
            let _ = Assembler::default().push(fragment, &limits);
        }
        let _ = decode_update(&bytes, &limits);
        let _ = read_update(&bytes);
    }

    #[test]
    fn damaged_plain_updates_never_panic(
        damage in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6),
    ) {
        let mut bytes = Vec::new();
        write_update(&update_of((24, 16)), &mut bytes);
        for (place, byte) in damage {
            let place = place.index(bytes.len());
            bytes[place] = byte;
        }
        if let Ok(update) = read_update(&bytes) {
            let _ = Held::default().apply(&update);
        }
    }

    #[test]
    fn damaged_updates_never_panic_and_are_never_half_applied(
        damage in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6),
        cut in any::<prop::sample::Index>(),
        cuts in any::<bool>(),
    ) {
        let mut bytes = small();
        for (place, byte) in damage {
            let place = place.index(bytes.len());
            bytes[place] = byte;
        }
        if cuts {
            bytes.truncate(cut.index(bytes.len()));
        }
        let limits = Limits { update_samples: 1 << 16, update_pixels: 1 << 18, ..Limits::default() };
        if let Ok(update) = decode_update(&bytes, &limits) {
            let mut held = Held::default();
            if held.apply_within(&update, &limits).is_err() {
                prop_assert_eq!((held.number, held.patches.len()), (0, 0));
            }
        }
    }

    #[test]
    fn any_split_of_an_update_is_put_together_again(length in 1_usize..200_000) {
        let mut update = encode_update(&Update { edits: vec![], ..update_of((1, 1)) }, Coding::default());
        update.bytes.resize(length, 7);
        let mut assembler = Assembler::default();
        let mut whole = Vec::new();
        for bytes in update.packed(0.0).fragments.iter() {
            match decode_server(bytes, &Limits::default()).unwrap().message {
                ServerPacket::Fragment(fragment) => whole.extend(assembler.push(fragment, &Limits::default()).unwrap()),
                ServerPacket::Control(_) => unreachable!(),
            }
        }
        prop_assert_eq!(whole, vec![update.bytes]);
    }
}
