//! The way from a scene to a client's picture, and the truth beside it: images as the server makes them, their bytes, the held copy, its surfaces, a frame.

use anyhow::ensure;
use camera::Pinhole;
use client::draw::frame::Options;
use glam::DVec3;
use protocol::codec::{Coding, decode_patch};
use protocol::{DepthImage, Limits, Look};
use server::discretize::{Discretization, Discretizer};

use super::buffers::Unfit;
use super::case::Case;
use super::lab::{Break, Lab};
use crate::client_view::{Drawn, HeldSet};
use crate::raytrace::{Effects, RayTruth, TracedPicture};
use crate::sets::{self, SetPlan};
use crate::stage::Stage;

/// Side of each image of a set.
const IMAGE_PX: u32 = 192;
const IMAGES: usize = 4;
/// What a client draws at an eye, and what is there.
pub struct Shown {
    pub camera: Pinhole,
    pub drawn: Drawn,
    pub truth: TracedPicture,
    /// Radius of the region that the set was made for.
    pub region_m: f64,
    /// Of all that the frame was drawn into.
    pub unfit: Unfit,
    /// How far from outlines it is judged: what an image's sample is wide, in whole pixels of the picture.
    pub margin_px: usize,
}

impl Shown {
    /// By how many pixels an error of inverse depth shifts a sample for an eye at the rim of the region.
    pub fn parallax_px(&self, w_error: f64) -> f64 {
        self.camera.focal_px * self.region_m * w_error.abs()
    }

    /// What a whole step of 16 bits from the near plane on shifts a sample by.
    pub fn finest_px(&self) -> f64 {
        self.parallax_px(1.0 / (self.camera.near_m * f64::from(u16::MAX)))
    }

    /// Inverse depth in the truth, in 1/m; `None` where nothing is.
    pub fn true_w(&self, pixel: usize) -> Option<f64> {
        let eye = self.camera.world_from_eye;
        let forward = eye.rotation * DVec3::Z;
        self.truth.first[pixel].map(|point| 1.0 / forward.dot(point.p_world - eye.translation))
    }
}

/// What clients show of a case: from the region's middle, and from its rim.
pub fn shown(lab: &mut Lab, case: &Case) -> anyhow::Result<Vec<Shown>> {
    shown_of(lab, case, |images| images)
}

/// The same of what `kept` leaves of the images.
pub fn shown_of(
    lab: &mut Lab,
    case: &Case,
    kept: impl FnOnce(Vec<DepthImage>) -> Vec<DepthImage>,
) -> anyhow::Result<Vec<Shown>> {
    lab.looks_at(case);
    let mut stage = Stage::new(&lab.gpu, case.scene.clone(), Look::Plain)?;
    stage.show(0.0, case.middle.translation)?;
    Break::anchored(lab.broken, &mut stage)?;
    let plan = SetPlan { discretization: Discretization::default(), images: IMAGES, image_px: IMAGE_PX };
    let (views, precision) = sets::planned(&stage.scene, case.middle, &case.camera(case.middle.translation), &plan);
    let mut discretizer = Discretizer::new(&stage.renderer)?;
    let precision = Break::packed(lab.broken, precision);
    let set = sets::make(&stage, &mut discretizer, &views, plan.discretization, precision)?;
    let mut images = kept(set.images);
    Break::sent(lab.broken, &mut images);
    let images = through_the_codec(&images)?;
    let surfaces = Break::surfaces(lab.broken, &lab.gpu);
    let look = (stage.renderer.materials(), &stage.lighting);
    let held = HeldSet::with_meshes(&lab.gpu, &images, look, |_, patch, _| surfaces.mesh(patch))?;
    let truth = RayTruth::new(&stage.scene, stage.snapshot(), &stage.lighting);
    let region_m = sets::region_radius_m(&stage.scene);
    let of_eye = |eye: DVec3| {
        let camera = case.camera(eye);
        let drawn = lab.view.frame(&held, &camera, Options::default())?;
        let unfit = Unfit::of(&lab.gpu, &lab.view)?;
        Ok(Shown { camera, drawn, truth: truth.picture(&camera, &Effects::PLAIN, 1), region_m, unfit, margin_px: 1 })
    };
    case.eyes().into_iter().map(of_eye).collect()
}

fn through_the_codec(images: &[DepthImage]) -> anyhow::Result<Vec<DepthImage>> {
    let decoded = sets::encoded(images, Coding::default())
        .iter()
        .map(|bytes| Ok(decode_patch(bytes, &Limits::default())?.image))
        .collect::<anyhow::Result<Vec<_>>>()?;
    ensure!(decoded == images, "images do not come back from their bytes");
    Ok(decoded)
}
