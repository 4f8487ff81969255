//! Both truths of a lamp: shadow maps of the full geometry, and rays.

use camera::Pinhole;
use client::soft::Lamp;
use server::discretize::{Capture, Discretization, Discretizer};

use super::hidden::{Hidden, MapTruth, receivers};
use super::{Settings, lamp};
use crate::raytrace::RayTruth;
use crate::stage::Stage;

/// See the module.
pub(super) struct Truths {
    pub maps: Hidden,
    pub rays: Hidden,
}

impl Truths {
    /// Of the pixels of a view, which `shown` is the image of.
    pub fn new(
        stage: &Stage,
        discretizer: &mut Discretizer,
        lamp: &Lamp,
        (shown, view): (&Capture, &Pinhole),
        settings: &Settings,
    ) -> anyhow::Result<Truths> {
        let double_sided: Vec<bool> = stage.renderer.materials().iter().map(|material| material.double_sided).collect();
        let points = lamp::point_views(lamp, &stage.scene, settings.points, settings.truth_px)?;
        let mut maps = MapTruth::new(receivers(shown, &double_sided), points.len());
        for (index, point) in points.iter().enumerate() {
            let seen = discretizer.run(&stage.renderer, &[*point], Discretization::Conventional)?.wait()?;
            maps.add(index, &seen[0]);
        }
        let eyes: Vec<_> = points.iter().map(|point| point.world_from_eye.translation).collect();
        let rays = RayTruth::new(&stage.scene, stage.snapshot(), &stage.lighting).hidden_points(view, &eyes);
        Ok(Truths { maps: maps.done(), rays: Hidden { points: points.len(), pixels: rays } })
    }
}
