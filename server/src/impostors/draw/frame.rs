//! What of the scene an image shows, and the image on its way to the GPU.

use crate::render::{Faces, Pipelines, SceneRenderer};
use crate::targets::Attachments;
use crate::timer::Timer;

/// What of the scene an image shows.
#[derive(Clone, Copy)]
pub struct Subject<'a> {
    /// Which objects, by their ids.
    pub objects: &'a dyn Fn(u16) -> bool,
    /// Which sides of their triangles.
    pub faces: Faces,
}

impl Subject<'_> {
    /// Everything, as a camera sees it.
    pub const ALL: Subject<'static> = Subject { objects: &|_| true, faces: Faces::Front };
}

/// An image on its way to the GPU.
pub(super) struct Frame<'a> {
    pub encoder: wgpu::CommandEncoder,
    pub timer: Option<Timer>,
    pub attachments: Attachments,
    pub scene: &'a SceneRenderer,
    pub pipelines: &'a Pipelines,
    pub subject: Subject<'a>,
}

impl Frame<'_> {
    pub fn draw_pinhole(&mut self, camera: &camera::Pinhole) {
        let view = self.scene.view_group(camera);
        let writes = self.timer.as_ref().map(|timer| timer.writes(0));
        let mut pass = self.attachments.begin(&mut self.encoder, 0, [0.0; 3], writes);
        self.scene.begin(&mut pass, (camera.width_px, camera.height_px), &view);
        for run in self.scene.visible_runs(camera, self.subject.objects) {
            self.scene.set_run(&mut pass, self.pipelines, &run);
            self.scene.draw_run(&mut pass, &run);
        }
    }
}
