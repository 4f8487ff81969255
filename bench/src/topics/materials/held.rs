//! The set that the topic looks at.

use gpu::Gpu;
use server::discretize::{Discretization, Discretizer};

use crate::client_view::HeldSet;
use crate::sets::{self, SetPlan};
use crate::stage::Stage;
use crate::topics::reconstruction::eyes::Eye;

/// As a server makes one at first.
pub(super) const PLAN: SetPlan = SetPlan { discretization: Discretization::COVERED, images: 4, image_px: 512 };

/// What a client holds of the scene who looks at it from an eye, and the set that it was sent.
pub(super) fn held_at(
    gpu: &Gpu,
    stage: &mut Stage,
    discretizer: &mut Discretizer,
    eye: &Eye,
) -> anyhow::Result<(sets::ImageSet, HeldSet)> {
    stage.show(0.0, eye.middle.translation)?;
    let (views, precision) = sets::planned(&stage.scene, eye.middle, &eye.output, &PLAN);
    let set = sets::make(stage, discretizer, &views, PLAN.discretization, precision)?;
    let mut held = HeldSet::new(gpu, &set.images, (stage.renderer.materials(), &stage.lighting))?;
    held.held.sky = stage.sky().cloned();
    Ok((set, held))
}
