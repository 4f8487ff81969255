//! What of the views of a light is sent.

use protocol::Mask;

use crate::discretize::redundancy::redundant_samples;
use crate::discretize::{Capture, Redundancy, RedundancyTest};

/// When an earlier view holds a sample: where its pixel there shows the same surface, about as finely. Outlines are in one view then, whose
/// samples say where they end; the rims of several, each with its own pixels ([`RedundancyTest::Covered`]), together reach further than the surface.
const HELD: Redundancy = Redundancy { test: RedundancyTest::Surface, density_factor: 2.5 };

/// Of each of some views of one light, which see the same things, the samples that no view before it holds.
///
/// Xie, Wang, Popescu 2016, section 3, let each image show what lies behind what is held (Alg. 1), as nobody knows what eyes between its own
/// will see. Here probes chose views until next to nothing is missing ([`super::places`]), and what lies deeper casts no shadow that is seen.
pub fn unseen(views: &[Capture]) -> Vec<Mask> {
    let of = |(index, capture): (usize, &Capture)| {
        if index == 0 {
            return capture.mask();
        }
        let anchor_world = capture.camera.world_from_eye.translation;
        let held = redundant_samples(capture, &views[..index], HELD, anchor_world, None);
        let mut is_unseen = vec![false; capture.ids.len()];
        let occupied = is_unseen.iter_mut().zip(&capture.ids).filter(|(_, ids)| ids[0] != 0);
        occupied.zip(held).for_each(|((unseen, _), held)| *unseen = !held);
        capture.mask_where(|index| is_unseen[index])
    };
    views.iter().enumerate().map(of).collect()
}
