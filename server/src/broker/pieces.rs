//! What followers are to be sent, as it travels: each message of the protocol behind a number that tells the server's run, and updates put together again.

use bytes::{BufMut, Bytes, BytesMut};
use protocol::limits::Limits;
use protocol::message::ServerMessage;
use protocol::staging::Playback;
use protocol::wire::{self, FRAGMENT_BYTES, Fragment, PackedUpdate, ServerPacket, UpdateHead};
use thiserror::Error;

/// What a broker must let through in one message: a fragment, what leads it, and some room.
pub(crate) const LARGEST_BYTES: usize = FRAGMENT_BYTES + 256;

/// A message as it is published.
pub(crate) fn piece(origin: u64, message: &Bytes) -> Bytes {
    let mut piece = BytesMut::with_capacity(8 + message.len());
    piece.put_u64_le(origin);
    piece.put_slice(message);
    piece.freeze()
}

/// The server's run that a piece is of, and the message; `None` where it is too short for any.
pub(crate) fn opened(mut piece: Bytes) -> Option<(u64, Bytes)> {
    use bytes::Buf;
    let origin = piece.try_get_u64_le().ok()?;
    Some((origin, piece))
}

/// Why a piece is refused.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub(crate) enum PieceError {
    #[error(transparent)]
    Wire(#[from] wire::WireError),
    #[error("{0}")]
    Wrong(&'static str),
}

/// The eye that a message tells, how the time goes of what it sees, and when that was.
pub(crate) fn eye(message: &[u8]) -> Result<(camera::Rigid, Playback, f64), PieceError> {
    let envelope = wire::decode_server(message, &Limits::default())?;
    match envelope.message {
        ServerPacket::Control(ServerMessage::Presenter { world_from_eye, playback })
            if world_from_eye.is_valid() && playback.is_valid() =>
        {
            Ok((world_from_eye, playback, envelope.at_s))
        }
        _ => Err(PieceError::Wrong("no place of an eye")),
    }
}

/// Puts the fragments of updates together. What is lost between two of them takes its update with it, and the next one begins anew.
#[derive(Debug, Default)]
pub(crate) struct Gather {
    head: Option<UpdateHead>,
    total_bytes: usize,
    bytes: usize,
    fragments: Vec<Bytes>,
}

impl Gather {
    /// Takes the next message; gives the update with its last one. The messages stay as they are: they are what followers are sent.
    pub fn push(&mut self, message: Bytes) -> Result<Option<PackedUpdate>, PieceError> {
        let ServerPacket::Fragment(fragment) = wire::decode_server(&message, &Limits::default())?.message else {
            return Err(PieceError::Wrong("no part of an update"));
        };
        self.check(&fragment).inspect_err(|_| self.forget())?;
        self.bytes += fragment.bytes.len();
        self.fragments.push(message);
        if self.bytes < self.total_bytes {
            return Ok(None);
        }
        let Gather { head, bytes, fragments, .. } = std::mem::take(self);
        let update = |UpdateHead { number, digest, clears, .. }: UpdateHead| PackedUpdate {
            number,
            digest,
            clears,
            bytes,
            fragments: fragments.into(),
        };
        Ok(head.map(update))
    }

    /// Whether some of an update is here.
    pub fn is_under_way(&self) -> bool {
        self.bytes > 0
    }

    /// What is missing never comes.
    pub fn forget(&mut self) {
        *self = Gather::default();
    }

    /// Whether a fragment goes on where the last one ended, or begins an update.
    fn check(&mut self, fragment: &Fragment) -> Result<(), PieceError> {
        let (total_bytes, offset, length) =
            (fragment.total_bytes as usize, fragment.offset as usize, fragment.bytes.len());
        if total_bytes > Limits::default().update_bytes {
            return Err(PieceError::Wrong("an update that is too large"));
        }
        if offset == 0 {
            self.forget();
            self.head = Some(UpdateHead::peek(&fragment.bytes)?);
            self.total_bytes = total_bytes;
        }
        let is_of_it = self.head.is_some_and(|head| head.number as u32 == fragment.update);
        // Were they smaller, an update could be as many fragments as it has bytes.
        let is_whole = length == FRAGMENT_BYTES.min(total_bytes.saturating_sub(offset)) && length > 0;
        if !is_of_it || total_bytes != self.total_bytes || offset != self.bytes || !is_whole {
            return Err(PieceError::Wrong("a part of an update that does not go on where the last one ended"));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use camera::Rigid;
    use protocol::codec::Coding;
    use protocol::wire::Envelope;
    use protocol::{Edit, Held, Material};

    use super::*;

    /// An update of several fragments.
    fn packed() -> PackedUpdate {
        let mut update = Held::default().whole();
        (update.number, update.digest) = (7 + (1 << 32), 9);
        update.edits.push(Edit::Materials(vec![Material::default(); 256]));
        let filler = std::iter::repeat_with(|| Edit::Remove(protocol::PatchId(1)));
        update.edits.extend(filler.take(2 * FRAGMENT_BYTES / 5));
        wire::encode_update(&update, Coding::default()).packed(3.5)
    }

    #[test]
    fn an_update_comes_through_as_it_was() {
        let packed = packed();
        assert!(packed.fragments.len() > 2);
        let mut gather = Gather::default();
        let mut came = Vec::new();
        for fragment in packed.fragments.iter() {
            let (origin, message) = opened(piece(5, fragment)).expect("a piece");
            assert_eq!((origin, &message), (5, fragment));
            assert!(piece(5, fragment).len() <= LARGEST_BYTES);
            came.extend(gather.push(message).expect("a fragment"));
        }
        assert_eq!(came, [packed]);
        assert!(!gather.is_under_way());
    }

    #[test]
    fn what_misses_a_part_is_left_and_the_next_one_is_taken() {
        let packed = packed();
        let mut gather = Gather::default();
        gather.push(packed.fragments[0].clone()).expect("its beginning");
        assert!(gather.is_under_way());
        assert!(gather.push(packed.fragments[2].clone()).is_err(), "a part is missing");
        assert!(!gather.is_under_way() && gather.push(packed.fragments[1].clone()).is_err());
        gather.push(packed.fragments[0].clone()).expect("a beginning");
        let came: Vec<_> =
            packed.fragments.iter().filter_map(|part| gather.push(part.clone()).expect("sound")).collect();
        assert_eq!(came, [packed], "who begins twice begins anew");
    }

    #[test]
    fn lies_take_no_memory() {
        let fragment = |update: u32, total_bytes: u32, offset: u32, bytes: &[u8]| {
            let mut message = vec![1];
            message.extend(0.0_f64.to_le_bytes());
            [update, total_bytes, offset].iter().for_each(|number| message.extend(number.to_le_bytes()));
            message.extend(bytes);
            Bytes::from(message)
        };
        let mut gather = Gather::default();
        for (what, message) in [
            ("nothing", Bytes::new()),
            ("too large", fragment(0, u32::MAX, 0, &[0; FRAGMENT_BYTES])),
            ("a tiny part", fragment(0, 1 << 20, 0, &[0; 64])),
            ("no head", fragment(0, 3, 0, &[0; 3])),
            ("another number", fragment(1, 64, 0, &[0; 64])),
            ("past its end", fragment(0, 64, 0, &[0; 65])),
            ("no beginning", fragment(0, 64, 32, &[0; 32])),
        ] {
            assert!(gather.push(message).is_err(), "{what}");
            assert!(!gather.is_under_way(), "{what}");
        }
        assert_eq!(opened(Bytes::from_static(b"short")), None);
    }

    #[test]
    fn an_eye_is_one_only_where_it_is_valid() {
        let told = |world_from_eye| {
            let message = ServerMessage::Presenter { world_from_eye, playback: Playback::default() };
            wire::encode_server(&Envelope { at_s: 2.0, message }).remove(0)
        };
        assert_eq!(eye(&told(Rigid::IDENTITY)), Ok((Rigid::IDENTITY, Playback::default(), 2.0)));
        let mut wrong = Rigid::IDENTITY;
        wrong.translation.x = f64::NAN;
        assert!(eye(&told(wrong)).is_err());
        assert!(eye(&wire::encode_server(&Envelope { at_s: 0.0, message: ServerMessage::Pong(1) })[0]).is_err());
    }
}
