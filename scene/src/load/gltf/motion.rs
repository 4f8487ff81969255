//! A glTF scene over time.

use glam::{DAffine3, DMat3, DVec3};

use super::clip::{Clips, Pose};
use super::deform::Deform;
use super::hierarchy::Hierarchy;
use super::light::NodeLight;
use crate::model::{Animation, Deformed};
use crate::{Rig, Scene, SceneLight, Snapshot, Vertex};

/// Joints of a skin, with the maps from the mesh to each.
#[derive(Debug)]
pub(super) struct Skin {
    pub joints: Vec<usize>,
    /// `joint_from_bind`, by joint: the inverse bind matrices.
    pub joint_from_bind: Vec<DAffine3>,
}

impl Skin {
    /// `world_from_bind` of each joint.
    fn world_from_bind(&self, worlds: &[DAffine3]) -> Vec<DAffine3> {
        self.joints.iter().zip(&self.joint_from_bind).map(|(&joint, bind)| worlds[joint] * *bind).collect()
    }
}

/// How an instance gets its place and its vertices.
#[derive(Debug)]
pub(super) struct Source {
    pub node: usize,
    /// From the mesh's centre and a place in the node: `node_from_mesh`.
    pub node_from_mesh: DAffine3,
    /// Whether its place changes.
    pub moves: bool,
}

/// A deforming instance.
#[derive(Debug)]
pub(super) struct DeformSource {
    pub instance: u32,
    pub deform: Deform,
    /// Index into the skins, where it is skinned.
    pub skin: Option<usize>,
    /// Where its node and its mesh give none, all zero.
    pub rest_weights: Vec<f32>,
    /// A skinned instance is placed at its first joint, as it stood to the mesh's middle at rest.
    pub anchor_from_joint: DVec3,
}

impl DeformSource {
    /// Where mesh space lies for a skinned instance: it follows its first joint without turning.
    fn anchor(&self, skin: &Skin, worlds: &[DAffine3]) -> DVec3 {
        skin.joints.first().map_or(DVec3::ZERO, |&joint| worlds[joint].translation) + self.anchor_from_joint
    }

    /// Vertices and, for a skinned instance, its place.
    pub fn evaluate(
        &self,
        node: usize,
        pose: &Pose,
        worlds: &[DAffine3],
        skins: &[Skin],
    ) -> (Vec<Vertex>, Option<DAffine3>) {
        let weights = pose.weights[node].as_deref().unwrap_or(&self.rest_weights);
        let mut vertices = self.deform.morphed(weights);
        let place = self.skin.map(|index| {
            let skin = &skins[index];
            let anchor_world = self.anchor(skin, worlds);
            self.deform.skin(&mut vertices, &skin.world_from_bind(worlds), anchor_world);
            DAffine3::from_translation(anchor_world)
        });
        (vertices, place)
    }
}

/// The animation of a glTF scene.
#[derive(Debug)]
pub(super) struct Motion {
    pub hierarchy: Hierarchy,
    pub clips: Clips,
    pub skins: Vec<Skin>,
    pub sources: Vec<Source>,
    pub deforms: Vec<DeformSource>,
    pub lights: Vec<NodeLight>,
    /// Of each instance at rest: what holds for those that do not move.
    pub rest: Vec<DAffine3>,
}

impl Motion {
    /// All transforms and weights at a time.
    pub fn pose(&self, time_s: f64) -> (Pose, Vec<DAffine3>) {
        let mut pose = Pose { locals: self.hierarchy.locals.clone(), weights: vec![None; self.hierarchy.locals.len()] };
        self.clips.apply(time_s, &mut pose);
        let worlds = self.hierarchy.worlds(&pose.locals);
        (pose, worlds)
    }

    /// The scene at a time.
    pub fn snapshot(&self, time_s: f64) -> Snapshot {
        let (pose, worlds) = self.pose(time_s);
        let mut world_from_mesh = self.placed(&worlds);
        let deformed = self
            .deforms
            .iter()
            .map(|deform| {
                let instance = deform.instance as usize;
                let (vertices, place) = deform.evaluate(self.sources[instance].node, &pose, &worlds, &self.skins);
                if let Some(place) = place {
                    world_from_mesh[instance] = invertible(place, world_from_mesh[instance]);
                }
                Deformed { instance: deform.instance, vertices }
            })
            .collect();
        Snapshot { time_s, world_from_mesh, deformed, lights: self.lights(&worlds) }
    }

    /// All instances at their nodes.
    fn placed(&self, worlds: &[DAffine3]) -> Vec<DAffine3> {
        let mut world_from_mesh = self.rest.clone();
        for (place, source) in world_from_mesh.iter_mut().zip(&self.sources).filter(|(_, source)| source.moves) {
            *place = invertible(worlds[source.node] * source.node_from_mesh, *place);
        }
        world_from_mesh
    }

    /// The lights, each in its place.
    pub fn lights(&self, worlds: &[DAffine3]) -> Vec<SceneLight> {
        self.lights.iter().map(|light| light.placed(worlds)).collect()
    }
}

impl Animation for Motion {
    fn at(&self, _scene: &Scene, time_s: f64) -> Snapshot {
        self.snapshot(time_s)
    }

    fn period_s(&self) -> Option<f64> {
        self.clips.period_s().filter(|period_s| *period_s > 0.0)
    }

    fn places(&self, _scene: &Scene, time_s: f64) -> Vec<DAffine3> {
        self.placed(&self.pose(time_s).1)
    }

    fn rigs(&self) -> Vec<Rig> {
        let Some(period_s) = self.clips.period_s() else { return Vec::new() };
        let rig = |source: &DeformSource| {
            let bones = self.skins[source.skin?].joints.len();
            let (influences, unbent, is_flat) =
                (source.deform.influences()?, source.deform.unbent(), source.deform.is_flat());
            Some(Rig { instance: source.instance, bones, unbent, is_flat, influences, period_s })
        };
        let rigid = |(instance, _): (usize, &Source)| Rig {
            instance: instance as u32,
            bones: 1,
            unbent: Vec::new(),
            is_flat: false,
            influences: Vec::new(),
            period_s,
        };
        let deforms = |instance: usize| self.deforms.iter().any(|deform| deform.instance as usize == instance);
        let moving = self.sources.iter().enumerate().filter(|(instance, source)| source.moves && !deforms(*instance));
        self.deforms.iter().filter_map(rig).chain(moving.map(rigid)).collect()
    }

    fn bones(&self, rig: &Rig, time_s: f64) -> Vec<DAffine3> {
        let (_, worlds) = self.pose(time_s);
        let of_rig = |source: &&DeformSource| source.instance == rig.instance;
        let Some(source) = self.deforms.iter().find(of_rig) else {
            return self.placed(&worlds).get(rig.instance as usize).copied().into_iter().collect();
        };
        let Some(skin) = source.skin else { return Vec::new() };
        let from_mesh = source.deform.file_from_mesh();
        self.skins[skin]
            .world_from_bind(&worlds)
            .into_iter()
            .map(|world_from_bind| world_from_bind * from_mesh)
            .collect()
    }
}

/// A map that can be inverted, so that nobody after the loader has to ask: where an animated scale vanishes, the object
/// is a point's size at its place; where a transform is not finite, it stays at rest.
pub(super) fn invertible(map: DAffine3, otherwise: DAffine3) -> DAffine3 {
    /// Metres a metre: nothing of the object can be seen.
    const POINT_SCALE: f64 = 1e-6;
    if !map.is_finite() {
        return otherwise;
    }
    let size = map.matrix3.x_axis.length() * map.matrix3.y_axis.length() * map.matrix3.z_axis.length();
    /// Of the volume that the axes' lengths would span: flatter than this cannot be told from flat in f32.
    const FLAT_SHARE: f64 = 1e-12;
    if size > 0.0 && map.matrix3.determinant().abs() > FLAT_SHARE * size {
        return map;
    }
    DAffine3 { matrix3: DMat3::from_diagonal(DVec3::splat(POINT_SCALE)), translation: map.translation }
}
