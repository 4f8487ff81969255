//! Bytes of patches.

mod addresses;
mod bits;
mod colour;
mod dense;
mod fast;
mod header;
mod labels;
mod lanes;
mod mix;
mod outline;
mod pack;
mod rans;
mod residual;
mod rest;
mod samples;
mod segments;

pub(crate) use addresses::{read_addresses, write_addresses};
pub use colour::ColourSteps;
pub(crate) use header::{Header, read as read_header, read_ids, read_instances, read_objects};
pub(crate) use header::{write as write_header, write_ids, write_instances, write_objects};
pub(crate) use pack::{Packer, Unpacker};

use thiserror::Error;

use crate::bytes::{EndsEarly, Reader, Writer};
use crate::held::Patch;
use crate::limits::Limits;

/// What the coder optimizes for. Both are exact on the planes as they are given, and both ends know which it was from the bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Profile {
    /// Speed: residuals of a 2-D prediction, coded by how often each came in a few contexts.
    Fast,
    /// Size: residuals coded by an adaptive arithmetic coder with contexts.
    #[default]
    Dense,
}

/// How patches are coded; the sender chooses.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Coding {
    /// Speed or size.
    pub profile: Profile,
    /// How exactly colours are kept.
    pub colour: ColourSteps,
}

impl Coding {
    fn to_byte(self) -> u8 {
        let colour = ColourSteps::ALL.iter().position(|&steps| steps == self.colour).expect("all are listed");
        u8::from(self.profile == Profile::Dense) | (colour as u8) << 1
    }

    fn from_byte(byte: u8) -> Result<Coding, CodecError> {
        let colour = ColourSteps::ALL.get(usize::from(byte >> 1)).ok_or(CodecError::Damaged("coding"))?;
        Ok(Coding { profile: if byte & 1 == 1 { Profile::Dense } else { Profile::Fast }, colour: *colour })
    }
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
