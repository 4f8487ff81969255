//! Coded samples of many patches.

use super::coding::Coding;
use super::{header, samples};
use crate::bytes::Writer;
use crate::held::{Edit, Patch};

/// The coded samples of an update's added patches, in order. They are nearly all of the work, and the same in an update that adds the same under other
/// names, at another time.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CodedSamples {
    /// How they are coded.
    pub coding: Coding,
    of_patches: Vec<Vec<u8>>,
}

impl CodedSamples {
    /// Of some edits, coded side by side where there are threads.
    pub fn of(edits: &[Edit], coding: Coding) -> CodedSamples {
        let coded = |edit: &Edit| match edit {
            Edit::Add(patch) => {
                let mut out = Writer::default();
                samples::write(&patch.image, coding, &mut out);
                Some(out.bytes)
            }
            _ => None,
        };
        #[cfg(not(target_arch = "wasm32"))]
        use rayon::prelude::*;
        #[cfg(not(target_arch = "wasm32"))]
        let edits = edits.par_iter();
        #[cfg(target_arch = "wasm32")]
        let edits = edits.iter();
        CodedSamples { coding, of_patches: edits.filter_map(coded).collect() }
    }

    /// The bytes of all patches, in order.
    pub(crate) fn patches(&self) -> impl Iterator<Item = &[u8]> {
        self.of_patches.iter().map(Vec::as_slice)
    }
}

/// The bytes of a patch, of whose samples these are coded.
pub(crate) fn patch_bytes(patch: &Patch, coded: &[u8]) -> Vec<u8> {
    let mut out = Writer::default();
    header::write(patch, &mut out);
    out.bytes.extend_from_slice(coded);
    out.bytes
}
