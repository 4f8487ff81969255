//! How updates travel: cut into messages that many sessions may send, and put together again.

use std::sync::Arc;

use bytes::Bytes;

use super::{ENVELOPE_BYTES, EncodedUpdate, FRAGMENT, WireError, check_size};
use crate::bytes::Writer;
use crate::limits::Limits;

/// Bytes of an update in one message at most.
pub const FRAGMENT_BYTES: usize = 32 * 1024;
/// An update in the messages that carry it, each of at most [`FRAGMENT_BYTES`] and a head. Clones share their bytes: as many sessions as like
/// send the same ones.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PackedUpdate {
    /// [`Update::number`].
    pub number: u64,
    /// [`Update::digest`].
    pub digest: u64,
    /// Whether it begins with [`Edit::Clear`].
    pub clears: bool,
    /// Bytes of the update, without the messages' heads.
    pub bytes: usize,
    /// The messages, in order.
    pub fragments: Arc<[Bytes]>,
}

impl EncodedUpdate {
    /// Its messages, stamped with the sender's time.
    pub fn packed(&self, at_s: f64) -> PackedUpdate {
        PackedUpdate {
            number: self.number,
            digest: self.digest,
            clears: self.clears,
            bytes: self.bytes.len(),
            fragments: fragments(at_s, self).map(Bytes::from).collect(),
        }
    }
}

/// The messages of an update's fragments, in order.
fn fragments(at_s: f64, update: &EncodedUpdate) -> impl Iterator<Item = Vec<u8>> + '_ {
    let total_bytes = u32::try_from(update.bytes.len()).expect("updates stay under 4 GiB");
    update.bytes.chunks(FRAGMENT_BYTES).enumerate().map(move |(index, bytes)| {
        let mut out = Writer { bytes: Vec::with_capacity(ENVELOPE_BYTES + 12 + bytes.len()) };
        out.u8(FRAGMENT);
        out.f64(at_s);
        out.u32(update.number as u32);
        out.u32(total_bytes);
        out.u32((index * FRAGMENT_BYTES) as u32);
        out.bytes.extend_from_slice(bytes);
        out.bytes
    })
}

/// A part of an update.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Fragment {
    /// Low bits of the update's number.
    pub update: u32,
    /// Bytes of the whole update.
    pub total_bytes: u32,
    /// Where `bytes` belong.
    pub offset: u32,
    /// At most [`FRAGMENT_BYTES`].
    pub bytes: Vec<u8>,
}

/// Puts updates together again. Fragments come in order, for the transport keeps it.
#[derive(Debug, Default)]
pub struct Assembler {
    update: u32,
    total_bytes: u32,
    bytes: Vec<u8>,
}

impl Assembler {
    /// Takes the next fragment; gives the bytes of the update with its last one. Memory grows with the bytes that came, not
    /// with what a fragment claims.
    pub fn push(&mut self, fragment: Fragment, limits: &Limits) -> Result<Option<Vec<u8>>, WireError> {
        let Fragment { update, total_bytes, offset, bytes } = fragment;
        check_size(&bytes, FRAGMENT_BYTES)?;
        if total_bytes as usize > limits.update_bytes {
            return Err(WireError::TooLarge { bytes: total_bytes as usize, limit: limits.update_bytes });
        }
        if offset == 0 && self.bytes.is_empty() {
            (self.update, self.total_bytes) = (update, total_bytes);
        }
        if (update, total_bytes) != (self.update, self.total_bytes) {
            return Err(WireError::Fragment("of another update"));
        }
        if offset as usize != self.bytes.len() || bytes.is_empty() {
            return Err(WireError::Fragment("not where the last one ended"));
        }
        self.bytes.extend_from_slice(&bytes);
        match self.bytes.len().cmp(&(total_bytes as usize)) {
            std::cmp::Ordering::Less => Ok(None),
            std::cmp::Ordering::Equal => Ok(Some(std::mem::take(&mut self.bytes))),
            std::cmp::Ordering::Greater => Err(WireError::Fragment("past the update's end")),
        }
    }

    /// Bytes of the update that is still on its way, received and in all.
    pub fn progress_bytes(&self) -> (usize, usize) {
        (self.bytes.len(), if self.bytes.is_empty() { 0 } else { self.total_bytes as usize })
    }
}
