//! Bytes of patches.

mod addresses;
mod binary;
mod channel;
mod colour;
mod copy;
mod depth;
mod header;
mod mask;
mod neighbours;
mod normal;
mod pack;
mod planes;
mod rans;
mod streams;

pub(crate) use addresses::{read_addresses, write_addresses};
pub(crate) use header::{read_objects, write_objects};
pub(crate) use pack::{Packer, Unpacker};

use thiserror::Error;

use crate::bytes::{EndsEarly, Reader, Writer};
use crate::held::Patch;
use crate::limits::Limits;

/// What the coder optimizes for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Profile {
    /// Speed: 2-D prediction, byte planes, zstd at level 1. Exactly lossless on the quantized planes.
    #[default]
    Fast,
}

/// Why the bytes of a patch or an update were refused. The sender, or what lies between, is at fault.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum CodecError {
    /// The bytes end before the patch does.
    #[error(transparent)]
    EndsEarly(#[from] EndsEarly),
    /// Past one of the [`Limits`].
    #[error("more {0} than allowed")]
    TooMuch(&'static str),
    /// Bytes that no coder writes.
    #[error("damaged: {0}")]
    Damaged(&'static str),
}

/// The bytes of a patch.
pub fn encode_patch(patch: &Patch, profile: Profile) -> Vec<u8> {
    let Profile::Fast = profile;
    let mut out = Writer::default();
    header::write(patch, &mut out);
    planes::write(&patch.image, &mut Packer::new(), &mut out);
    out.bytes
}

/// The patch of [`encode_patch`]'s bytes. Planes fit the mask; whether the patch fits the held copy, [`crate::Held::apply`] says.
pub fn decode_patch(bytes: &[u8], limits: &Limits) -> Result<Patch, CodecError> {
    let mut bytes = Reader::new(bytes);
    let header = header::read(&mut bytes, limits)?;
    let patch = planes::read(header, &mut Unpacker::new(), &mut bytes, limits)?;
    if bytes.remaining() == 0 { Ok(patch) } else { Err(CodecError::Damaged("bytes after the patch")) }
}

/// The ranks by which a predictor is chosen: all of a small plane, the middle of a large one.
fn tried(count: usize) -> std::ops::Range<usize> {
    let half = count.min(TRIED_SAMPLES) / 2;
    count / 2 - half..(count / 2 + half).max(count.min(1))
}

/// Enough to tell predictors apart; an eighth of a 512x512 image.
const TRIED_SAMPLES: usize = 32 * 1024;
