//! What a comparison is asked, and what it answers.

use std::collections::BTreeSet;

use camera::Pinhole;
use protocol::PatchId;

use crate::account::AccountRules;
use crate::account::findings::Lacking;
use crate::account::samples::Address;
use crate::discretize::Capture;

/// What is asked of a view.
#[derive(Debug, Clone, Copy)]
pub struct Asked<'a> {
    /// What decides.
    pub rules: AccountRules,
    /// Patches that views of the same plan captured: they are not replaced.
    pub peers: &'a BTreeSet<PatchId>,
    /// Whether what covers falsely is looked for.
    pub trims: bool,
    /// Whether what finer samples have taken the place of is.
    pub supersedes: bool,
    /// Whether the viewer sees the view: what it shows counts as seen.
    pub is_seen: bool,
    /// A view that lacks no more pixels than this is sent nothing.
    pub least_px: f64,
}

/// What came of it.
#[derive(Debug)]
pub struct Found {
    /// The part of the view that has all that is to be sent, with its ends, and nothing else.
    pub capture: Capture,
    /// Of that part.
    pub lacking: Lacking,
    /// Held samples that cover falsely; ascending.
    pub false_cover: Vec<Address>,
    /// Held samples whose place finer ones have taken; ascending.
    pub superseded: Vec<Address>,
    /// Pixels of the whole view that show anything.
    pub hits: usize,
}

/// A view of the scene on the GPU: ids, colour, rests and depth.
#[derive(Debug)]
pub struct KeptView {
    /// What captured it.
    pub camera: Pinhole,
    pub(crate) planes: [wgpu::TextureView; 4],
}
