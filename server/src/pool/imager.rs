//! Stands before an imager, and has it draw only what is not kept.

use std::sync::Arc;

use camera::{Bounds, Camera, Pinhole};
use glam::DVec3;
use protocol::staging::Excerpt;
use protocol::{DepthImage, Lighting, Mask, Material, Purpose, Sky};
use scene::Snapshot;
use surface::{AddressView, HeldSurfaces};

use super::request::{Answer, Request, Settings, Subject};
use super::store::Pool;
use crate::account::Account;
use crate::discretize::{Capture, DepthPrecision, Discretization};
use crate::imager::{Comparer, Imager, ImagerError, Occasion};
use crate::impostors::Shot;
use crate::render::{Blended, Detail, Kinds, Layer, LeftOut};

/// An imager of a scene that never changes, which shares what it draws with all others of the same [`Pool`]. They must be of the same scene, under the same
/// look.
pub struct SharingImager {
    inner: Box<dyn Imager>,
    pool: Arc<Pool>,
    settings: Settings,
    occasion: Occasion,
    /// What the last captures are of.
    set: Option<(Vec<Pinhole>, Discretization)>,
    /// The scene as it always is.
    still: Arc<Snapshot>,
}

impl SharingImager {
    /// Before an imager; `still` is the only snapshot that it will be asked for.
    pub fn new(inner: Box<dyn Imager>, pool: Arc<Pool>, still: Arc<Snapshot>) -> SharingImager {
        let (settings, occasion) = (Settings::default(), Occasion::Passing);
        SharingImager { inner, pool, settings, occasion, set: None, still }
    }

    /// What is kept of a subject as it would be drawn now, or else what the imager draws.
    fn answer(
        &mut self,
        subject: Subject,
        draw: impl FnOnce(&mut dyn Imager) -> Result<Answer, ImagerError>,
    ) -> Result<Answer, ImagerError> {
        let request = Request { settings: self.settings.clone(), subject };
        let answer = self.pool.answer(request, self.occasion, || draw(&mut *self.inner))?;
        Ok(Arc::unwrap_or_clone(answer))
    }

    fn depth_images(
        &mut self,
        subject: Subject,
        draw: impl FnOnce(&mut dyn Imager) -> Result<Vec<DepthImage>, ImagerError>,
    ) -> Result<Vec<DepthImage>, ImagerError> {
        match self.answer(subject, |inner| draw(inner).map(Answer::Depth))? {
            Answer::Depth(images) => Ok(images),
            _ => unreachable!("equal requests have answers of one kind"),
        }
    }

    /// The set that a capture is of, where it is clear which of its captures that is.
    fn set_of(&self, capture: &Capture) -> Option<(Vec<Pinhole>, Discretization)> {
        let is_one = |views: &[Pinhole]| views.iter().filter(|view| **view == capture.camera).count() == 1;
        self.set.clone().filter(|(views, _)| is_one(views))
    }
}

impl Imager for SharingImager {
    fn twin(&self) -> Option<Box<dyn Imager>> {
        Some(Box::new(SharingImager::new(self.inner.twin()?, self.pool.clone(), self.still.clone())))
    }

    fn anew(&self) -> Result<Option<Box<dyn Imager>>, ImagerError> {
        let sharing =
            |inner| Box::new(SharingImager::new(inner, self.pool.clone(), self.still.clone())) as Box<dyn Imager>;
        Ok(self.inner.anew()?.map(sharing))
    }

    fn is_lost(&self) -> bool {
        self.inner.is_lost()
    }

    fn device(&self) -> u32 {
        self.inner.device()
    }

    fn comparer(&mut self) -> Option<&mut dyn Comparer> {
        // What it draws never leaves the GPU, so nothing of it is kept.
        self.inner.comparer()
    }

    fn adapter(&self) -> String {
        self.inner.adapter()
    }

    fn materials(&self) -> Vec<Material> {
        self.inner.materials()
    }

    fn kinds(&self) -> Kinds {
        self.inner.kinds()
    }

    fn lighting(&self, snapshot: &Snapshot) -> Lighting {
        self.inner.lighting(snapshot)
    }

    fn sky(&self) -> Option<Arc<Sky>> {
        self.inner.sky()
    }

    fn draw_for(&mut self, occasion: Occasion) {
        self.occasion = occasion;
    }

    fn captures(
        &mut self,
        snapshot: &Snapshot,
        views: &[Pinhole],
        method: Discretization,
    ) -> Result<Vec<Capture>, ImagerError> {
        self.set = Some((views.to_vec(), method));
        let subject = Subject::Set(views.to_vec(), method);
        match self.answer(subject, |inner| inner.captures(snapshot, views, method).map(Answer::Captures))? {
            Answer::Captures(captures) => Ok(captures),
            _ => unreachable!("equal requests have answers of one kind"),
        }
    }

    fn own_view(&mut self, snapshot: &Snapshot, view: &Pinhole, detail: Detail) -> Result<Vec<Capture>, ImagerError> {
        // As drawing it does. It is too large to keep: what is made of it is kept.
        self.leave_out(LeftOut::default());
        self.blend(Blended::LeftOut);
        self.inner.own_view(snapshot, view, detail)
    }

    fn view_at_rest(
        &mut self,
        snapshot: &Snapshot,
        view: &Pinhole,
        in_parts: bool,
        precision: DepthPrecision,
    ) -> Result<Vec<DepthImage>, ImagerError> {
        // As drawing it does.
        self.leave_out(LeftOut::default());
        self.blend(Blended::LeftOut);
        self.depth_images(Subject::AtRest(*view, in_parts, precision), |inner| {
            inner.view_at_rest(snapshot, view, in_parts, precision)
        })
    }

    fn largest_side_px(&self) -> u32 {
        self.inner.largest_side_px()
    }

    fn place(&mut self, snapshot: &Snapshot, eye_world: DVec3) -> Result<(), ImagerError> {
        self.inner.place(snapshot, eye_world)
    }

    fn tell_ends(&mut self, capture: &mut Capture, mask: &Mask) -> Result<(), ImagerError> {
        let Some((views, method)) = self.set_of(capture).filter(|_| mask.count() > 0) else {
            self.inner.place(&self.still, capture.camera.world_from_eye.translation)?;
            return self.inner.tell_ends(capture, mask);
        };
        let still = self.still.clone();
        let subject = Subject::Ends { views, method, camera: capture.camera, mask: mask.clone() };
        let told = self.answer(subject, |inner| {
            inner.place(&still, capture.camera.world_from_eye.translation)?;
            inner.tell_ends(capture, mask)?;
            Ok(Answer::Ends(capture.ends.clone()))
        })?;
        match told {
            Answer::Ends(ends) => capture.ends = ends,
            _ => unreachable!("equal requests have answers of one kind"),
        }
        Ok(())
    }

    fn material_codes(&self) -> Vec<Option<u8>> {
        self.inner.material_codes()
    }

    fn smooth(&mut self, is_smooth: bool) {
        self.settings.is_smooth = is_smooth;
        self.inner.smooth(is_smooth);
    }

    fn leave_out(&mut self, left_out: LeftOut) {
        self.settings.left_out = left_out.clone();
        self.inner.leave_out(left_out);
    }

    fn show(&mut self, excerpt: &Excerpt) {
        self.settings.excerpt.clone_from(excerpt);
        self.inner.show(excerpt);
    }

    fn layers(&self) -> Vec<Layer> {
        self.inner.layers()
    }

    fn layer_bounds(&mut self, snapshot: &Snapshot, layer: Layer) -> Result<Option<Bounds>, ImagerError> {
        self.inner.layer_bounds(snapshot, layer)
    }

    fn blend(&mut self, blended: Blended) {
        self.settings.blended = blended;
        self.inner.blend(blended);
    }

    fn impostor(&mut self, snapshot: &Snapshot, shot: &Shot<'_>) -> Result<Option<DepthImage>, ImagerError> {
        // As drawing it does.
        self.blend(Blended::CutOut);
        let Shot { camera, drawn, faces, is_tinted } = *shot;
        let subject = Subject::Impostor { camera: camera.clone(), drawn: drawn.clone(), faces, is_tinted };
        let images = self.depth_images(subject, |inner| Ok(inner.impostor(snapshot, shot)?.into_iter().collect()))?;
        Ok(images.into_iter().next())
    }

    fn camera_image(&mut self, snapshot: &Snapshot, camera: &Camera) -> Result<Option<DepthImage>, ImagerError> {
        // As drawing it does.
        self.leave_out(LeftOut::default());
        self.blend(Blended::CutOut);
        let subject = Subject::CameraImage(camera.clone());
        let images =
            self.depth_images(subject, |inner| Ok(inner.camera_image(snapshot, camera)?.into_iter().collect()))?;
        Ok(images.into_iter().next())
    }

    fn new_surfaces(&self) -> Option<HeldSurfaces> {
        self.inner.new_surfaces()
    }

    fn copy_view(&mut self, account: &Account, purpose: Purpose, view: &Pinhole) -> Result<AddressView, ImagerError> {
        self.inner.copy_view(account, purpose, view)
    }
}

#[cfg(test)]
mod tests;
