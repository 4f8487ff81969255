//! What a comparison finds to be sent, and addresses in order.

use protocol::Mask;

use super::samples::Address;
use crate::discretize::Capture;

/// What is to be sent.
#[derive(Debug)]
pub struct Lacking {
    /// The pixels to send, border included.
    pub send: Mask,
    /// Pixels whose hit is not held, or too coarsely; without the border.
    pub missing: usize,
    /// Held samples that what is sent replaces; ascending by patch, then row by row.
    pub replaced: Vec<Address>,
}

impl Lacking {
    /// Nothing of a view.
    pub fn nothing(capture: &Capture) -> Lacking {
        Lacking {
            send: Mask::empty(capture.camera.width_px, capture.camera.height_px),
            missing: 0,
            replaced: Vec::new(),
        }
    }

    /// Whether a held sample is replaced.
    pub(super) fn replaces(&self, address: Address) -> bool {
        is_among(&self.replaced, address)
    }

    /// Every hit of a view.
    pub fn all(capture: &Capture) -> Lacking {
        let send = capture.mask();
        Lacking { missing: send.count(), send, replaced: Vec::new() }
    }
}

/// Sorts addresses for [`is_among`].
pub(crate) fn ascending(addresses: &mut Vec<Address>) {
    addresses.sort_unstable_by_key(|&(patch, x, y)| (patch, y, x));
    addresses.dedup();
}

pub(super) fn is_among(ascending: &[Address], (patch, x, y): Address) -> bool {
    ascending.binary_search_by_key(&(patch, y, x), |&(patch, x, y)| (patch, y, x)).is_ok()
}
