//! Names of frusta.

use serde::{Deserialize, Serialize};

/// The place of a frustum in [`GraphCamera::frusta`](super::GraphCamera::frusta), after its parent's.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct FrustumId(u16);

impl FrustumId {
    /// How many there are.
    pub const COUNT: usize = 4096;

    /// The frustum where rays begin.
    pub const ROOT: FrustumId = FrustumId(0);

    /// The id of a place, or `None` beyond [`FrustumId::COUNT`].
    pub fn new(place: usize) -> Option<FrustumId> {
        u16::try_from(place).ok().filter(|_| place < FrustumId::COUNT).map(FrustumId)
    }

    /// Where it stands in [`GraphCamera::frusta`](super::GraphCamera::frusta).
    pub fn place(self) -> usize {
        self.0.into()
    }

    pub(super) fn all(count: usize) -> impl Iterator<Item = FrustumId> {
        (0..count).filter_map(FrustumId::new)
    }
}
