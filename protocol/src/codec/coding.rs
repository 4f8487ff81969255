//! How patches are coded.

use super::colour::ColourSteps;
use super::error::CodecError;

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
    pub(super) fn to_byte(self) -> u8 {
        let colour = ColourSteps::ALL.iter().position(|&steps| steps == self.colour).expect("all are listed");
        u8::from(self.profile == Profile::Dense) | (colour as u8) << 1
    }

    pub(super) fn from_byte(byte: u8) -> Result<Coding, CodecError> {
        let colour = ColourSteps::ALL.get(usize::from(byte >> 1)).ok_or(CodecError::Damaged("coding"))?;
        Ok(Coding { profile: if byte & 1 == 1 { Profile::Dense } else { Profile::Fast }, colour: *colour })
    }
}
