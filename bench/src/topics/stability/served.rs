//! The way with a server's own stage: looks at times of the scene's, updates, their bytes, the copy that follows them, a frame with its effects.

use std::collections::BTreeMap;
use std::sync::Arc;

use client::draw::frame::Options;
use client::draw::shown::Shown as Held;
use glam::DAffine3;
use gpu::Gpu;
use protocol::Look;
use server::look::SceneLook;

use super::buffers::Unfit;
use super::case::{Case, PICTURE_PX};
use super::lab::{Break, Lab};
use super::way::Shown;
use crate::client_view::ClientView;
use crate::raytrace::{Effects, RayTruth};
use crate::sets;
use crate::topics::sent_once::walk::{Setup, Walker};

/// Side of the server's views, which see 90 degrees: a sample is 1.4 pixels of the picture wide in the middle of one.
const IMAGE_PX: u32 = 192;
pub const MARGIN_PX: usize = 2;

/// A server and a viewer who stands in the middle of a case.
pub struct Served {
    walker: Walker,
    case: Case,
    look: SceneLook,
    broken: Option<Break>,
    /// Where objects were first.
    first_poses: Option<BTreeMap<u16, DAffine3>>,
}

impl Served {
    /// As servers do by themselves.
    pub fn usual() -> Setup {
        Setup { output_px: PICTURE_PX, ..Setup::usual(IMAGE_PX) }
    }

    pub fn new(lab: &Lab, case: Case, setup: &Setup) -> anyhow::Result<Served> {
        lab.looks_at(&case);
        let walker = Walker::new(&lab.gpu, Arc::new(case.scene.clone()), setup)?;
        let look = SceneLook::new(&case.scene, Look::Plain);
        Ok(Served { walker, case, look, broken: lab.broken, first_poses: None })
    }

    /// The server looks at `now_s`, and the client follows.
    pub fn tick(&mut self, now_s: f64) -> anyhow::Result<()> {
        self.walker.tick(self.case.middle, now_s)?;
        if self.broken == Some(Break::Poses) {
            let first = self.first_poses.get_or_insert_with(|| self.walker.set.held.poses_now.clone());
            self.walker.set.surfaces.set_poses(first);
        }
        Ok(())
    }

    /// What the client holds, as a frame shows it.
    fn held(&self) -> Held<'_> {
        let held = self.walker.shown();
        match self.broken {
            Some(Break::Shadows) => Held { lights: None, ..held },
            Some(Break::Impostors) => Held { impostors: None, ..held },
            _ => held,
        }
    }

    /// What a client shows from the middle, beside rays through the scene at the time that it shows.
    pub fn shown(&self, gpu: &Gpu, view: &mut ClientView, effects: &Effects) -> anyhow::Result<Shown> {
        let camera = self.case.camera(self.case.middle.translation);
        // A hole is to be seen, not what it is filled with.
        let options = Options { fill: false, ..Options::default() };
        let drawn = view.frame_shown(self.held(), &camera, options)?;
        let unfit = Unfit::of(gpu, view)?;
        let truth = self.truth().picture(&camera, effects, 1);
        Ok(Shown {
            camera,
            drawn,
            truth,
            region_m: sets::region_radius_m(&self.case.scene),
            unfit,
            margin_px: MARGIN_PX,
        })
    }

    /// How many objects are drawn by rays against images of their shapes.
    pub fn by_images(&self) -> usize {
        self.walker.set.held.instances.len()
    }

    /// The scene at the time that the client shows.
    pub fn truth(&self) -> RayTruth {
        let snapshot = self.case.scene.at(self.walker.set.held.scene_time_s);
        RayTruth::new(&self.case.scene, &snapshot, &self.look.lighting(&snapshot))
    }
}
