//! Both truths of a lamp: shadow maps of the full geometry, and rays.
//!
//! Maps of a truth have the texels of those that clients draw from images of the same size, of the same box: the 2016 paper, section 6.2, takes
//! its methods for approximations of the maps of the lamp's points, and measures how far off these they are. Maps with other
//! texels are off by as much again where things are thinner than a texel: on `grass`, of 1024² each, by a visibility error of 16 without any image
//! between. What texels cost at all is in the errors against rays.

use std::rc::Rc;

use camera::Pinhole;
use client::draw::soft::Lamp;
use server::discretize::{Capture, Discretization, Discretizer};

use super::hidden::{Hidden, MapTruth, receivers};
use super::lamp;
use crate::raytrace::RayTruth;
use crate::stage::Stage;

/// See the module.
#[derive(Clone)]
pub(super) struct Truths {
    pub maps: Rc<Hidden>,
    pub rays: Rc<Hidden>,
}

/// By maps of `map_px²`, of the pixels that `shown` is the image of.
pub(super) fn by_maps(
    stage: &Stage,
    discretizer: &mut Discretizer,
    (lamp, points, map_px): (&Lamp, u32, u32),
    shown: &Capture,
) -> anyhow::Result<Hidden> {
    let double_sided: Vec<bool> = stage.renderer.materials().iter().map(|material| material.double_sided).collect();
    let points = lamp::point_views(lamp, &stage.scene, points, map_px)?;
    let mut maps = MapTruth::new(receivers(shown, &double_sided), points.len());
    for (index, point) in points.iter().enumerate() {
        let seen = discretizer.run(&stage.renderer, &[*point], Discretization::Conventional)?.wait()?;
        maps.add(index, &seen[0]);
    }
    Ok(maps.done())
}

/// By rays, of the pixels of a view.
pub(super) fn by_rays(stage: &Stage, (lamp, points): (&Lamp, u32), view: &Pinhole) -> Hidden {
    let eyes: Vec<_> = lamp.area.points_world(lamp.middle_world, points).collect();
    let pixels = RayTruth::new(&stage.scene, stage.snapshot(), &stage.lighting).hidden_points(view, &eyes);
    Hidden::new(eyes.len(), pixels)
}
