//! One tick of one session: scene at a time -> plan -> images -> edits. The whole of what a server makes, in order.

use std::sync::Arc;

use protocol::held::{Edit, Held, HeldError, ObjectPose, Patch, PatchId, Purpose};
use protocol::wire::{self, EncodedUpdate};
use protocol::{DepthImage, Lighting, Material};
use scene::{Scene, Snapshot};

use crate::imager::{Imager, ImagerError};
use crate::plan::{Coverage, Plan, Reason, Rules, plan};
use crate::viewer::Viewer;

/// What makes frames: the scene, and what draws it.
pub struct Stage {
    scene: Arc<Scene>,
    rules: Rules,
    imager: Box<dyn Imager>,
    materials: Vec<Material>,
    /// The one snapshot of a scene that never changes.
    still: Option<Arc<Snapshot>>,
}

/// The images of a set, not yet edits: encoding goes on elsewhere while the next session's images are made.
#[derive(Debug, Clone)]
pub struct Frame {
    /// Why it was made.
    pub reason: Reason,
    /// What the client's copy covers once it holds this.
    pub coverage: Coverage,
    /// The newest pose that it was made for.
    pub pose_seq: u64,
    /// One a view.
    pub images: Vec<DepthImage>,
    /// Where the moving rigid objects are.
    pub objects: Vec<ObjectPose>,
    /// The lights at that time.
    pub lighting: Lighting,
    /// What the material codes mean.
    pub materials: Vec<Material>,
}

impl Stage {
    /// A stage for one scene.
    pub fn new(scene: Arc<Scene>, rules: Rules, imager: Box<dyn Imager>) -> Stage {
        let materials = imager.materials();
        let still = (!scene.is_animated()).then(|| Arc::new(scene.at(0.0)));
        Stage { scene, rules, imager, materials, still }
    }

    /// Makes what a viewer lacks at a time, or nothing where the set that it holds still serves.
    pub fn frame(
        &mut self,
        viewer: &Viewer,
        held: Option<&Coverage>,
        now_s: f64,
    ) -> Result<Option<Frame>, ImagerError> {
        let Some(Plan { reason, coverage, views, precision }) = plan(&self.rules, viewer, now_s, held) else {
            return Ok(None);
        };
        let snapshot = self.snapshot(now_s);
        let images = self.imager.images(&snapshot, &views, precision)?;
        let objects = self.moving_objects(&snapshot);
        let lighting = self.imager.lighting(&snapshot);
        let materials = self.materials.clone();
        Ok(Some(Frame { reason, coverage, pose_seq: viewer.pose_seq, images, objects, lighting, materials }))
    }

    fn snapshot(&self, time_s: f64) -> Arc<Snapshot> {
        self.still.clone().unwrap_or_else(|| Arc::new(self.scene.at(time_s)))
    }

    fn moving_objects(&self, snapshot: &Snapshot) -> Vec<ObjectPose> {
        let instances = self.scene.instances.iter().zip(&snapshot.world_from_mesh).zip(0_u16..);
        instances
            .filter(|((instance, _), _)| instance.moves && !instance.deforms)
            .map(|((_, &world_from_object), object)| ObjectPose { object, world_from_object })
            .collect()
    }
}

/// The server's copy of what one client holds, and what that covers.
#[derive(Debug, Default)]
pub struct ClientCopy {
    held: Held,
    coverage: Option<Coverage>,
    last_patch: u32,
    broken: bool,
}

impl ClientCopy {
    /// What the held set covers; `None` where there is none.
    pub fn coverage(&self) -> Option<&Coverage> {
        self.coverage.as_ref()
    }

    /// The client's copy is broken: the next update starts anew. The old picture stays on its screen until then.
    pub fn start_anew(&mut self) {
        self.coverage = None;
        self.broken = true;
    }

    /// Takes in a frame and gives the update that brings the client there.
    pub fn update(&mut self, frame: Frame) -> Result<EncodedUpdate, HeldError> {
        let (scene_time_s, pose_seq, coverage) = (frame.coverage.scene_time_s, frame.pose_seq, frame.coverage);
        let edits = self.edits(frame);
        let update = self.held.commit(edits, scene_time_s, pose_seq)?;
        self.broken = false;
        self.coverage = Some(coverage);
        Ok(wire::encode_update(&update))
    }

    /// The edits that replace the held set by a frame's, in one step: tables and lights where they changed, the old patches
    /// out, the new ones in.
    fn edits(&mut self, frame: Frame) -> Vec<Edit> {
        let mut edits = Vec::new();
        let nothing = Held::default();
        let held = if self.broken { &nothing } else { &self.held };
        if self.broken {
            edits.push(Edit::Clear);
        }
        if held.materials != frame.materials {
            edits.push(Edit::Materials(frame.materials));
        }
        if held.lighting.as_ref() != Some(&frame.lighting) {
            edits.push(Edit::Light(Box::new(frame.lighting)));
        }
        edits.extend(held.patches.keys().copied().map(Edit::Remove));
        let differs = |pose: &ObjectPose| held.poses_now.get(&pose.object) != Some(&pose.world_from_object);
        let moved: Vec<ObjectPose> = frame.objects.iter().copied().filter(differs).collect();
        if !moved.is_empty() {
            edits.push(Edit::Move(moved));
        }
        for image in frame.images.into_iter().filter(|image| image.sample_count() > 0) {
            self.last_patch += 1;
            edits.push(Edit::Add(Box::new(Patch {
                id: PatchId(self.last_patch),
                purpose: Purpose::Eye,
                capture_time_s: frame.coverage.scene_time_s,
                objects: objects_in(&image, &frame.objects),
                image,
            })));
        }
        edits
    }
}

/// The moving objects that have a sample in an image.
fn objects_in(image: &DepthImage, moving: &[ObjectPose]) -> Vec<ObjectPose> {
    if moving.is_empty() {
        return Vec::new();
    }
    let mut seen = vec![false; usize::from(u16::MAX) + 1];
    image.object.iter().for_each(|&object| seen[usize::from(object)] = true);
    moving.iter().copied().filter(|pose| seen[usize::from(pose.object)]).collect()
}
