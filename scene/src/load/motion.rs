//! Scenes in which nothing moves.

use std::sync::Arc;

use glam::DAffine3;

use super::geometry::Built;
use super::{LoadError, Request, Stage, Warnings, summary};
use crate::model::Animation;
use crate::{Instance, Material, Scene, SceneLight, Snapshot, Texture};

/// The same places at all times.
#[derive(Debug, Clone, Default)]
pub(super) struct Still {
    /// Of each instance.
    pub world_from_mesh: Vec<DAffine3>,
    /// Of the file.
    pub lights: Vec<SceneLight>,
}

impl Still {
    /// The only snapshot there is, at any time.
    fn snapshot(&self, time_s: f64) -> Snapshot {
        Snapshot {
            time_s,
            world_from_mesh: self.world_from_mesh.clone(),
            deformed: Vec::new(),
            lights: self.lights.clone(),
        }
    }
}

impl Animation for Still {
    fn at(&self, _scene: &Scene, time_s: f64) -> Snapshot {
        self.snapshot(time_s)
    }
}

/// A mesh with a name, drawn once where it is.
#[derive(Debug)]
pub(super) struct Part {
    pub name: String,
    pub built: Built,
}

/// A scene of parts, each an object. Fails where there are none, or too many.
pub(super) fn still_scene(
    parts: Vec<Part>,
    materials: Vec<Material>,
    textures: Vec<Texture>,
    request: &Request<'_>,
    warnings: Warnings,
) -> Result<Scene, LoadError> {
    if parts.is_empty() {
        return Err(LoadError::NothingToDraw { reason: warnings.explain("the file has no faces") });
    }
    LoadError::check_limit("objects of the scene", parts.len() as u64, request.limits.objects)?;
    let mut still = Still::default();
    let (mut meshes, mut instances) = (Vec::with_capacity(parts.len()), Vec::with_capacity(parts.len()));
    for (index, part) in parts.into_iter().enumerate() {
        still.world_from_mesh.push(request.choice.up.world_from_file() * DAffine3::from_translation(part.built.centre));
        meshes.push(part.built.mesh);
        instances.push(Instance { mesh: index as u32, name: part.name, moves: false, deforms: false, tint: [255; 3] });
    }
    let snapshot = still.snapshot(0.0);
    let bounds = summary::bounds(&meshes, &instances, &snapshot);
    let walk = summary::is_walked(&meshes, &instances, &snapshot, &bounds);
    request.report(Stage::Finish, 1, 1);
    Ok(Scene {
        name: request.name.clone(),
        meshes,
        materials,
        textures,
        instances,
        lights_move: false,
        cameras: Vec::new(),
        bounds,
        walk,
        start: None,
        corridors: None,
        named_cameras: Vec::new(),
        offer: crate::load::Offer::default(),
        warnings: warnings.into_messages(),
        animation: Arc::new(still),
    })
}
