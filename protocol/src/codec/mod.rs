//! Bytes of patches.

mod addresses;
mod bits;
mod body;
mod coded;
mod coding;
mod colour;
mod dense;
mod ends;
mod error;
mod facets;
mod fast;
mod header;
mod labels;
mod lanes;
mod mix;
mod outline;
mod pack;
mod poses;
mod quarters;
mod rans;
mod residual;
mod rest;
mod samples;
mod scatter;
mod segments;
mod sky;

pub(crate) use addresses::{read_addresses, write_addresses};
pub(crate) use body::{read_body, write_body};
pub use coded::CodedSamples;
pub(crate) use coded::patch_bytes;
pub use coding::{Coding, Profile};
pub use colour::ColourSteps;
pub use error::CodecError;
pub(crate) use header::{Header, read as read_header, read_ids, read_instances};
pub(crate) use header::{write as write_header, write_ids, write_instances};
pub(crate) use pack::{Packer, Unpacker};
pub(crate) use poses::{MOST as MOST_OBJECTS, most_bytes, next_bytes, next_steps, shift_bytes, shifts};
pub(crate) use poses::{read_objects, write_objects};
pub(crate) use sky::{read_sky, write_sky};

use crate::bytes::{Reader, Writer};
use crate::held::Patch;
use crate::limits::Limits;

/// The bytes of a patch. It comes back as it is if its colours are settled ([`ColourSteps::settle_all`]); a patch must be
/// settled before it is held, so that both ends hold the same.
pub fn encode_patch(patch: &Patch, coding: Coding) -> Vec<u8> {
    let mut out = Writer::default();
    header::write(patch, &mut out);
    samples::write(&patch.image, coding, &mut out);
    out.bytes
}

/// The patch of [`encode_patch`]'s bytes. Planes fit the mask; whether the patch fits the held copy, [`crate::Held::apply`] says.
pub fn decode_patch(bytes: &[u8], limits: &Limits) -> Result<Patch, CodecError> {
    let mut bytes = Reader::new(bytes);
    let header = header::read(&mut bytes, limits)?;
    let patch = samples::read(header, &mut bytes, limits)?;
    if bytes.remaining() == 0 { Ok(patch) } else { Err(CodecError::Damaged("bytes after the patch")) }
}
