//! From nodes and primitives to the instances of a scene.

use std::collections::HashMap;
use std::sync::Arc;

use glam::{DAffine3, DVec3};

use super::accessor::{Accessors, Count};
use super::attributes::Place;
use super::clip::{Clips, Pose};
use super::deform::Deform;
use super::document::Document;
use super::hierarchy::Hierarchy;
use super::instancing::{self, Offset};
use super::light::{self, NodeLight};
use super::material::Materials;
use super::merge::{Parts, merged};
use super::motion::{DeformSource, Motion, Skin, Source, invertible};
use super::named_camera::named_cameras;
use super::panel::rectangle;
use super::primitive::Primitive;
use super::primitives::{self, PrimitiveId};
use super::{Request, Stage, Warnings};
use crate::load::choice::find;
use crate::load::geometry::bounds_of;
use crate::load::motion::Still;
use crate::load::source::shorten;
use crate::load::{LoadError, summary};
use crate::model::Animation;
use crate::{Instance, Material, Mesh, Scene, Texture};

/// Rectangles of a file that are lights: no more count in a picture ([`NodeLight`]s of other kinds come first).
const PANELS: usize = 16;

/// Builds the scene of a document whose materials are read.
pub(super) fn scene(
    document: &Document,
    accessors: Accessors<'_>,
    materials: Materials,
    request: &Request<'_>,
    mut warnings: Warnings,
) -> Result<Scene, LoadError> {
    let hierarchy = Hierarchy::of(document, request.limits, &mut warnings)?;
    let visible = hierarchy.visible(document, &mut warnings)?;
    let clips = Clips::read(document, accessors, request.limits, &mut warnings)?;
    let skins = skins(document, accessors, &visible, &mut warnings)?;
    let uv_sources = &materials.uv_sources;
    let place = Place { document, accessors, limits: request.limits, uv_sources, solid_step: 1 };
    let primitives = primitives::read(place, &visible, &skins, request, &mut warnings)?;
    let worlds = hierarchy.worlds(&hierarchy.locals);
    let rest_pose = Pose { locals: hierarchy.locals.clone(), weights: vec![None; document.nodes.len()] };
    let mut moving = clips.moves(document.nodes.len());
    hierarchy.spread_down(&mut moving);
    let morphing = clips.morphs(document.nodes.len());
    let mut assembly = Assembly {
        place,
        primitives: &primitives,
        skins: &skins,
        worlds: &worlds,
        rest_pose: &rest_pose,
        moving: &moving,
        morphing: &morphing,
        known: HashMap::new(),
        meshes: Vec::new(),
        instances: Vec::new(),
        sources: Vec::new(),
        deforms: Vec::new(),
        rest: Vec::new(),
        copied: 0,
    };
    for &node in &visible {
        assembly.add_node(node, &mut warnings)?;
    }
    let Assembly { meshes, instances, sources, mut deforms, rest, .. } = assembly;
    if instances.is_empty() {
        return Err(LoadError::NothingToDraw {
            reason: warnings.explain("no node of the scene has a mesh with triangles"),
        });
    }
    let (camera_names, cameras): (Vec<_>, Vec<_>) =
        light::cameras(document, &visible, &worlds, &mut warnings).into_iter().unzip();
    let chosen = request.choice.camera.as_ref();
    let start = chosen.map_or(Ok(0), |chosen| find("camera", chosen, &camera_names))?;
    let mut lights = NodeLight::read(document, &visible, &mut warnings);
    lights.extend(panels(
        (&meshes, &instances, &sources),
        (&materials.materials, &materials.textures),
        &worlds,
        &mut warnings,
    ));
    let lights_move = lights.iter().any(|light| moving[light.node]);
    let found = instances.len();
    let mut parts = Parts { meshes, instances, sources, rest };
    if found as u64 > request.limits.objects {
        let merged = merged(parts, request.limits)?;
        for deform in &mut deforms {
            deform.instance = merged.new_of_old[deform.instance as usize];
        }
        parts = merged.parts;
        let objects = parts.instances.len();
        warnings.add(format!("{found} parts are shown as {objects} objects: neighbours of one material together"));
    }
    let Parts { meshes, instances, sources, rest } = parts;
    let motion = Motion { hierarchy, clips, skins, sources, deforms, lights, rest };
    let snapshot = motion.snapshot(0.0);
    let bounds = summary::bounds(&meshes, &instances, &snapshot);
    let walk = summary::is_walked(&meshes, &instances, &snapshot, &bounds);
    let animation: Arc<dyn Animation> = match motion.clips.is_empty() {
        true => Arc::new(Still { world_from_mesh: motion.rest, lights: snapshot.lights }),
        false => Arc::new(motion),
    };
    request.report(Stage::Finish, 1, 1);
    let mut scene = Scene {
        name: request.name.clone(),
        meshes,
        materials: materials.materials,
        textures: materials.textures,
        instances,
        lights_move,
        start: cameras.get(start).copied(),
        cameras,
        offer: document.offer(&camera_names),
        bounds,
        walk,
        corridors: None,
        named_cameras: Vec::new(),
        warnings: Vec::new(),
        animation,
    };
    scene.named_cameras = named_cameras(document, &visible, &worlds, &scene, &mut warnings);
    scene.warnings = warnings.into_messages();
    Ok(scene)
}

/// The rectangles that emit light, the strongest first; [`PANELS`] at most.
fn panels(
    (meshes, instances, sources): (&[Mesh], &[Instance], &[Source]),
    (materials, textures): (&[Material], &[Texture]),
    worlds: &[DAffine3],
    warnings: &mut Warnings,
) -> Vec<NodeLight> {
    let panel = |(instance, source): (&Instance, &Source)| {
        let mesh = &meshes[instance.mesh as usize];
        let material = &materials[mesh.material as usize];
        let emits = material.emissive.iter().any(|channel| *channel > 0.0) && !material.unlit && !instance.deforms;
        let rectangle = emits.then(|| rectangle(mesh)).flatten()?;
        Some(NodeLight::panel(
            source.node,
            (rectangle, source.node_from_mesh),
            (material.mean_emissive(textures), material.double_sided),
        ))
    };
    let mut panels: Vec<NodeLight> = instances.iter().zip(sources).filter_map(panel).collect();
    panels.sort_by(|a, b| b.strength(worlds).total_cmp(&a.strength(worlds)));
    if panels.len() > PANELS {
        warnings.add(format!("{} rectangles emit light; the {PANELS} strongest are lights", panels.len()));
        panels.truncate(PANELS);
    }
    panels
}

/// All skins of a document; those that no shown node uses stay empty.
fn skins(
    document: &Document,
    accessors: Accessors<'_>,
    visible: &[usize],
    warnings: &mut Warnings,
) -> Result<Vec<Skin>, LoadError> {
    let mut shown = vec![false; document.nodes.len()];
    visible.iter().for_each(|&node| shown[node] = true);
    let mut used = vec![false; document.skins.len()];
    for &node in visible {
        let Some(skin) = document.nodes[node].skin else { continue };
        let count = used.len();
        *used.get_mut(skin).ok_or_else(|| {
            LoadError::malformed(
                format!("nodes[{node}].skin"),
                format!("skin {skin} does not exist, there are {count}"),
            )
        })? = true;
    }
    let read = |(index, skin): (usize, &super::document::Skin)| {
        if !used[index] {
            return Ok(Skin { joints: Vec::new(), joint_from_bind: Vec::new() });
        }
        let at = format!("skins[{index}]");
        if let Some(joint) = skin.joints.iter().find(|joint| **joint >= document.nodes.len()) {
            return Err(LoadError::malformed(at, format!("joint {joint} is no node")));
        }
        if let Some(joint) = skin.joints.iter().find(|joint| !shown[**joint]) {
            warnings.add(format!("{at}: joint {joint} is not in the scene that is shown"));
        }
        let joint_from_bind = match skin.inverse_bind_matrices {
            None => vec![DAffine3::IDENTITY; skin.joints.len()],
            Some(accessor) => {
                let limit = Count::AtMost(document.nodes.len() as u64);
                let matrices = accessors.floats::<16>(accessor, &at, limit)?;
                if matrices.len() < skin.joints.len() {
                    let fault = format!("{} inverse bind matrices for {} joints", matrices.len(), skin.joints.len());
                    return Err(LoadError::malformed(at, fault));
                }
                let affine = |m: &[f32; 16]| DAffine3::from_mat4(glam::DMat4::from_cols_array(&m.map(f64::from)));
                let matrices: Vec<DAffine3> = matrices.iter().map(affine).collect();
                if matrices.iter().any(|matrix| !matrix.is_finite()) {
                    return Err(LoadError::malformed(at, "an inverse bind matrix is not finite"));
                }
                matrices
            }
        };
        Ok(Skin { joints: skin.joints.clone(), joint_from_bind })
    };
    document.skins.iter().enumerate().map(read).collect()
}

struct Assembly<'a> {
    place: Place<'a>,
    primitives: &'a HashMap<PrimitiveId, Primitive>,
    skins: &'a [Skin],
    worlds: &'a [DAffine3],
    rest_pose: &'a Pose,
    moving: &'a [bool],
    morphing: &'a [bool],
    /// Undeformed meshes of the scene, by primitive.
    known: HashMap<PrimitiveId, u32>,
    meshes: Vec<Mesh>,
    instances: Vec<Instance>,
    sources: Vec<Source>,
    deforms: Vec<DeformSource>,
    rest: Vec<DAffine3>,
    /// Vertices, morph deltas and joints of meshes that only one instance has.
    copied: u64,
}

impl Assembly<'_> {
    fn add_node(&mut self, node: usize, warnings: &mut Warnings) -> Result<(), LoadError> {
        let document = self.place.document;
        let source = &document.nodes[node];
        let Some(mesh) = source.mesh else { return Ok(()) };
        let at = format!("nodes[{node}]");
        let name = source.name.as_ref().or(document.meshes[mesh].name.as_ref());
        let name = name.map_or_else(|| at.clone(), |name| shorten(name));
        let offsets = instancing::offsets(source, &at, self.place.accessors, self.place.limits);
        let Some(offsets) = warnings.leave_out(&at, offsets)? else { return Ok(()) };
        for index in 0..document.meshes[mesh].primitives.len() {
            let Some(primitive) = self.primitives.get(&(mesh, index)) else { continue };
            for offset in &offsets {
                let found = self.instances.len() as u64 + 1;
                LoadError::check_limit("instances of the scene", found, self.place.limits.instances)?;
                let placed = self.add_instance(node, (mesh, index), primitive, offset, &name)?;
                if !placed {
                    warnings.add(format!("{at}: an instance whose transform flattens it is left out"));
                }
            }
        }
        Ok(())
    }

    /// Whether it was added: not where its place for all time is flat. Which way its triangles face is decided by its
    /// place at rest: an animation that mirrors it on the way turns it inside out.
    fn add_instance(
        &mut self,
        node: usize,
        id: PrimitiveId,
        primitive: &Primitive,
        offset: &Offset,
        name: &str,
    ) -> Result<bool, LoadError> {
        let source = &self.place.document.nodes[node];
        let skin = source.skin.filter(|_| primitive.influences.is_some());
        let node_from_mesh = offset.node_from_instance * DAffine3::from_translation(primitive.built.centre);
        let place = self.worlds[node] * node_from_mesh;
        let moves = self.moving[node] && skin.is_none();
        if skin.is_none() && !moves && invertible(place, DAffine3::IDENTITY) != place {
            return Ok(false);
        }
        let joints_move = skin.is_some_and(|skin| self.skins[skin].joints.iter().any(|&joint| self.moving[joint]));
        let deforms = joints_move || (self.morphing[node] && !primitive.targets.is_empty());
        let rest_weights = self.rest_weights(node, primitive);
        let shaped = skin.is_some() || rest_weights.iter().any(|weight| *weight != 0.0);
        let (mesh, place) = if deforms || shaped {
            self.charge_copy(primitive, skin)?;
            self.add_deformed(node, primitive, skin, rest_weights, deforms, place)
        } else {
            (self.shared_mesh(id, primitive), place)
        };
        self.instances.push(Instance {
            mesh,
            name: name.to_owned(),
            moves: moves || joints_move,
            deforms,
            tint: offset.tint,
        });
        self.sources.push(Source { node, node_from_mesh, moves });
        self.rest.push(invertible(place, DAffine3::from_translation(self.worlds[node].translation)));
        Ok(true)
    }

    /// Many nodes may show one mesh, each deformed in its own way: what that takes is counted like vertices of the file.
    fn charge_copy(&mut self, primitive: &Primitive, skin: Option<usize>) -> Result<(), LoadError> {
        let vertices = primitive.built.mesh.vertices.len() * (1 + primitive.targets.len());
        let joints = skin.map_or(0, |skin| self.skins[skin].joints.len());
        self.copied += (vertices + joints) as u64;
        LoadError::check_limit("vertices and joints of deforming instances", self.copied, self.place.limits.vertices)
    }

    fn rest_weights(&self, node: usize, primitive: &Primitive) -> Vec<f32> {
        let document = self.place.document;
        let source = &document.nodes[node];
        let mesh_weights = source.mesh.and_then(|mesh| document.meshes[mesh].weights.as_ref());
        let weights = source.weights.as_ref().or(mesh_weights);
        let mut weights = weights.cloned().unwrap_or_default();
        weights.resize(primitive.targets.len(), 0.0);
        weights.iter_mut().filter(|weight| !weight.is_finite()).for_each(|weight| *weight = 0.0);
        weights
    }

    /// A mesh of its own, in rest shape; and its place.
    fn add_deformed(
        &mut self,
        node: usize,
        primitive: &Primitive,
        skin: Option<usize>,
        rest_weights: Vec<f32>,
        deforms: bool,
        place: DAffine3,
    ) -> (u32, DAffine3) {
        let mirrored = match skin {
            Some(skin) => self.is_skin_mirrored(skin),
            None => false,
        };
        let mut source = DeformSource {
            instance: self.instances.len() as u32,
            deform: Deform::of(primitive, mirrored),
            skin,
            rest_weights,
            anchor_from_joint: DVec3::ZERO,
        };
        let (vertices, _) = source.evaluate(node, self.rest_pose, self.worlds, self.skins);
        if skin.is_some() {
            // The first joint may be far from what it moves: the middle of the rest shape is not.
            let [min, max] = bounds_of(&vertices).map(|corner| DVec3::from(corner.map(f64::from)));
            source.anchor_from_joint = (min + max) / 2.0;
        }
        let (vertices, skinned_place) = source.evaluate(node, self.rest_pose, self.worlds, self.skins);
        let bounds = bounds_of(&vertices);
        let mut mesh = Mesh { vertices, bounds, ..primitive.built.mesh.clone() };
        if mirrored {
            flip(&mut mesh);
        }
        self.meshes.push(mesh);
        if deforms {
            self.deforms.push(source);
        }
        (self.meshes.len() as u32 - 1, skinned_place.unwrap_or(place))
    }

    /// Whether most joints of a skin mirror what they move, at rest.
    fn is_skin_mirrored(&self, skin: usize) -> bool {
        let skin = &self.skins[skin];
        let mirrors = |(joint, bind): (&usize, &DAffine3)| (self.worlds[*joint] * *bind).matrix3.determinant() < 0.0;
        skin.joints.iter().zip(&skin.joint_from_bind).filter(|pair| mirrors(*pair)).count() * 2 > skin.joints.len()
    }

    fn shared_mesh(&mut self, id: PrimitiveId, primitive: &Primitive) -> u32 {
        *self.known.entry(id).or_insert_with(|| {
            self.meshes.push(primitive.built.mesh.clone());
            self.meshes.len() as u32 - 1
        })
    }
}

/// Turns the winding round: bones that mirror turn it back (glTF 2.0, 3.7.4).
fn flip(mesh: &mut Mesh) {
    for [_, b, c] in mesh.indices.as_chunks_mut::<3>().0 {
        std::mem::swap(b, c);
    }
}
