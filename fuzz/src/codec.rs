//! Patches and edits, from any bytes and as a server makes them, applied to the copies of both ends.

use protocol::Edit;
use protocol::codec::{Coding, decode_patch, encode_patch};
use protocol::wire::decode_update;

use crate::caps;
use crate::make::Source;
use crate::updates::{Copies, coding, settle};

/// The first byte says how the rest is taken, and how it is coded.
pub fn codec(bytes: &[u8]) -> bool {
    let Some((&kind, bytes)) = bytes.split_first() else { return false };
    let coding = coding(kind >> 4);
    match kind % 5 {
        0 => patch(bytes, coding),
        1 => update(bytes, coding, kind & 0x80 != 0),
        2 => image(bytes, coding),
        3 => damaged(bytes, coding),
        _ => edits(bytes, coding),
    }
}

fn patch(bytes: &[u8], coding: Coding) -> bool {
    let Ok(patch) = decode_patch(bytes, &caps::protocol()) else { return false };
    hold(vec![Edit::Add(Box::new(patch))], coding);
    true
}

/// The edits of an update, all at once or one after the other.
fn update(bytes: &[u8], coding: Coding, apart: bool) -> bool {
    let Ok(update) = decode_update(bytes, &caps::protocol()) else { return false };
    if !apart {
        hold(update.edits, coding);
        return true;
    }
    let mut copies = Copies::default();
    for edit in update.edits {
        let mut edits = vec![edit];
        settle(&mut edits, coding);
        copies.exchange(edits, coding);
    }
    copies.check();
    true
}

fn image(bytes: &[u8], coding: Coding) -> bool {
    let patch = Source::new(bytes).patch(1);
    let mut settled = patch.clone();
    coding.colour.settle_all(&mut settled.image.colour);
    let bytes = encode_patch(&settled, coding);
    // Cameras that are none are refused; then there is nothing to compare.
    if patch.image.camera.is_valid() {
        let again = decode_patch(&bytes, &caps::protocol()).unwrap_or_else(|error| panic!("{error}"));
        assert!(encode_patch(&again, coding) == bytes, "another patch comes back");
        assert_eq!(again.image.mask, settled.image.mask);
        assert_eq!(again.image.colour, settled.image.colour);
        assert_eq!(again.image.depth, settled.image.depth);
        assert_eq!(again.image.object, settled.image.object);
        assert_eq!(again.image.ends, settled.image.ends);
    }
    hold(vec![Edit::Add(Box::new(patch))], coding);
    true
}

/// What an encoder wrote, with some bytes changed.
fn damaged(bytes: &[u8], coding: Coding) -> bool {
    let mut source = Source::new(bytes);
    let changes: Vec<(u16, u8)> = (0..1 + source.below(6)).map(|_| (source.short(), source.byte())).collect();
    let mut bytes = encode_patch(&source.patch(1), coding);
    for (place, byte) in changes {
        let place = usize::from(place) % bytes.len();
        bytes[place] = byte;
    }
    patch(&bytes, coding);
    true
}

/// Updates of a few edits each.
fn edits(bytes: &[u8], coding: Coding) -> bool {
    /// A copy that is looked at as a whole after each update.
    const MOST_UPDATES: usize = 12;
    let mut source = Source::new(bytes);
    let (mut copies, mut newest) = (Copies::default(), 0);
    for _ in 0..MOST_UPDATES {
        if source.is_empty() {
            break;
        }
        let mut edits: Vec<Edit> = (0..1 + source.below(4)).map(|_| source.edit(&mut newest)).collect();
        settle(&mut edits, coding);
        copies.exchange(edits, coding);
    }
    copies.check();
    true
}

fn hold(mut edits: Vec<Edit>, coding: Coding) {
    settle(&mut edits, coding);
    let mut copies = Copies::default();
    copies.exchange(edits, coding);
    copies.check();
}
