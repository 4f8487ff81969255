//! A headset in place of the page: `headset.js` hands in each of its frames, has each eye drawn onto the page's canvas, and copies that to where the headset shows it.

use camera::Rigid;
use client::receive::viewer::Viewer;
use client::show::controls::Controls;
use client::show::headset::{Frustum, Headset, view_of};
use glam::{DQuat, DVec3};
use protocol::message::ViewSize;

use crate::screen::Screen;

/// Numbers of a pose: a position in metres and a quaternion, x y z w, as WebXR has them.
const POSE: usize = 7;
/// Of an eye: its pose and its projection.
const EYE: usize = POSE + 16;

/// See the module.
#[derive(Default)]
pub struct Worn {
    /// `None` until the first frame says where it is.
    headset: Option<Headset>,
    poses: Option<Poses>,
    /// What the server was asked for.
    view: Option<ViewSize>,
}

/// Of a frame, in the headset's own space.
pub struct Poses {
    head: Rigid,
    eyes: Vec<(Rigid, Frustum)>,
    rows_px: u32,
}

impl Poses {
    /// `head`: a pose. `eyes`: for each a pose and the 16 numbers of its projection. `None` where they are none.
    pub fn read(head: &[f64], eyes: &[f64], rows_px: u32) -> Option<Poses> {
        let eye = |numbers: &[f64]| {
            let (pose, projection) = numbers.split_at(POSE);
            Some((rigid(pose)?, Frustum::of_projection(projection.try_into().ok()?)?))
        };
        let (all, rest) = eyes.as_chunks::<EYE>();
        let eyes = all.iter().map(|numbers| eye(numbers)).collect::<Option<Vec<_>>>()?;
        (rest.is_empty() && !eyes.is_empty()).then_some(Poses { head: rigid(head)?, eyes, rows_px })
    }
}

fn rigid(numbers: &[f64]) -> Option<Rigid> {
    let &[x, y, z, i, j, k, w] = numbers else { return None };
    let pose = Rigid::from_gl(DVec3::new(x, y, z), DQuat::from_xyzw(i, j, k, w));
    pose.is_valid().then_some(pose)
}

impl Worn {
    /// Lets `dt_s` seconds pass, at whose end head and eyes are there, and tells the server. `sticks`: right, up and forward, and a turn to the right. Where the head is in the world.
    pub fn advance(
        &mut self,
        poses: Poses,
        sticks: &[f64],
        (controls, viewer): (&mut Controls, &mut Viewer),
        (dt_s, now_s): (f64, f64),
    ) -> Rigid {
        let headset = self.headset.get_or_insert_with(|| Headset::put_on(controls, poses.head));
        let &[right, up, forward, turn] = sticks else { return headset.world_from_head() };
        headset.advance(controls, poses.head, (DVec3::new(right, up, forward), turn), dt_s);
        let head = headset.world_from_head();
        viewer.set_pose(head, now_s);
        let frusta: Vec<Frustum> = poses.eyes.iter().map(|&(_, frustum)| frustum).collect();
        if let Some(view) = view_of(&frusta, poses.rows_px).filter(|&view| self.view != Some(view)) {
            self.view = Some(view);
            viewer.set_view(view, now_s);
        }
        self.poses = Some(poses);
        head
    }

    /// The next frame begins where the controls are then.
    pub fn begin_anew(&mut self) {
        self.headset = None;
    }

    /// Draws what an eye sees; `false` where there is none, or the canvas takes nothing now.
    pub fn show_eye(&self, index: usize, screen: &mut Screen, viewer: &Viewer, near_m: f64) -> Result<bool, String> {
        let (Some(headset), Some(poses)) = (&self.headset, &self.poses) else { return Ok(false) };
        let Some(&(room_from_eye, frustum)) = poses.eyes.get(index) else { return Ok(false) };
        let camera = frustum.camera(headset.world_from_eye(room_from_eye), poses.rows_px, near_m);
        screen.show_camera(viewer.held(), &camera)
    }

    /// It is taken off: the eye stays where it is.
    pub fn take_off(self, controls: &mut Controls) {
        self.headset.into_iter().for_each(|headset| headset.take_off(controls));
    }
}
