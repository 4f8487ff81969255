//! Layers from several eyes: what Xie, Wang, Popescu 2016, section 7, name as future work.
//!
//! An image leaves out what images before it hold, and shows what is behind. So a second image of the same eye is its second layer, and one
//! test serves both: no layer holds what another does, of whichever eye.

use camera::Pinhole;
use server::discretize::Discretization;

/// Its name among the methods.
pub(super) const NAME: &str = "peeled from three eyes";
/// The paper's test between images.
pub(super) const METHOD: Discretization = Discretization::PIXEL;
/// Layers of each eye.
const LAYERS: usize = 3;

/// The first layers of all eyes, then the second ones, then the third.
pub(super) fn cameras(eyes: &[Pinhole]) -> Vec<Pinhole> {
    eyes.repeat(LAYERS)
}
