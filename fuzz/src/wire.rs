//! Messages of both directions, and updates.

use protocol::codec::Coding;
use protocol::plain::read_update;
use protocol::wire::{
    Assembler, Envelope, ServerPacket, client_message_kind, decode_client, decode_server, decode_update, encode_client,
    encode_server, server_message_kind,
};
use protocol::{Limits, Update};

use crate::caps;
use crate::make::Source;
use crate::updates::{coding, crossed, plain, settle};

/// The first byte says what the rest is, and how updates are coded again. What decodes is encoded and decoded again to the same.
pub fn wire(bytes: &[u8]) -> bool {
    let Some((&kind, bytes)) = bytes.split_first() else { return false };
    match kind % 5 {
        0 => client(bytes),
        1 => server(bytes),
        2 => fragments(bytes, coding(kind >> 4)),
        3 => update(bytes, coding(kind >> 4)),
        _ => plain_bytes(bytes),
    }
}

fn client(bytes: &[u8]) -> bool {
    let Ok(envelope) = decode_client(bytes, &Limits::default()) else { return false };
    assert!(client_message_kind(bytes).is_some());
    // Every message has one form, so numbers that are none are compared, too.
    assert_eq!(encode_client(&envelope), bytes, "{envelope:?}");
    true
}

fn server(bytes: &[u8]) -> bool {
    let Ok(Envelope { at_s, message }) = decode_server(bytes, &Limits::default()) else { return false };
    assert!(server_message_kind(bytes).is_some());
    if let ServerPacket::Control(message) = message {
        assert_eq!(encode_server(&Envelope { at_s, message }), [bytes]);
    }
    true
}

/// Messages of a length before each, to one assembler; whether they make an update.
fn fragments(bytes: &[u8], coding: Coding) -> bool {
    let mut source = Source::new(bytes);
    let (mut assembler, mut received, mut is_whole) = (Assembler::default(), 0, false);
    while !source.is_empty() {
        let bytes = source.bytes(u8::MAX);
        let Ok(Envelope { message: ServerPacket::Fragment(fragment), .. }) = decode_server(&bytes, &caps::protocol())
        else {
            continue;
        };
        received += fragment.bytes.len();
        match assembler.push(fragment, &caps::protocol()) {
            Ok(Some(bytes)) => is_whole |= update(&bytes, coding),
            Ok(None) => assert!(assembler.progress_bytes().0 <= received),
            Err(_) => break,
        }
    }
    is_whole
}

fn update(bytes: &[u8], coding: Coding) -> bool {
    decode_update(bytes, &caps::protocol()).map(|update| again(update, coding)).is_ok()
}

fn plain_bytes(bytes: &[u8]) -> bool {
    let Ok(update) = read_update(bytes) else { return false };
    let written = plain(&update);
    let Ok(again) = read_update(&written) else { panic!("what was read is refused") };
    assert!(plain(&again) == written, "another update comes back");
    true
}

fn again(mut update: Update, coding: Coding) {
    settle(&mut update.edits, coding);
    crossed(&update, coding);
}
