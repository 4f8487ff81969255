//! Cameras that people write into a file: `graph_camera` or `single_pole` in the `extras` of a node with a camera, see
//! [`camera::written`]. The node's name is theirs.

use camera::Rigid;
use camera::written::{NamedCamera, WrittenCamera, WrittenError};
use glam::{DAffine3, DMat3, DQuat, DVec3};
use serde::Deserialize;
use serde_json::Value;

use super::document::Document;
use crate::Scene;
use crate::load::Warnings;

/// Those of the given nodes, where these are at time 0, in their order; a bad one is named and left out.
pub(super) fn named_cameras(
    document: &Document,
    visible: &[usize],
    worlds: &[DAffine3],
    scene: &Scene,
    warnings: &mut Warnings,
) -> Vec<NamedCamera> {
    let mut cameras: Vec<NamedCamera> = Vec::new();
    for &node in visible {
        let Some(written) = written(&document.nodes[node].extras) else { continue };
        let name = document.nodes[node].name.clone().unwrap_or_default();
        let compiled = written.and_then(|written| {
            if document.nodes[node].camera.is_none() {
                return Err("the node has no camera".to_owned());
            }
            check_name(&name, &cameras)?;
            let bounds_of = |object: &str| scene.bounds_of_name(object);
            written.compile(&place(&worlds[node]), &bounds_of).map_err(|error: WrittenError| error.to_string())
        });
        match compiled {
            Ok(camera) => cameras.push(NamedCamera { name, camera }),
            Err(why) => warnings.add(format!("nodes[{node}]: camera {name:?} is left out: {why}")),
        }
    }
    cameras
}

/// What a node's `extras` say; `None` where they say nothing of cameras.
fn written(extras: &Value) -> Option<Result<WrittenCamera, String>> {
    fn read<'a, T: Deserialize<'a>>(value: &'a Value) -> Result<T, String> {
        T::deserialize(value).map_err(|error| error.to_string())
    }
    match (extras.get("graph_camera"), extras.get("single_pole")) {
        (None, None) => None,
        (Some(graph), None) => Some(read(graph).map(WrittenCamera::Graph)),
        (None, Some(single_pole)) => Some(read(single_pole).map(WrittenCamera::SinglePole)),
        (Some(_), Some(_)) => Some(Err("it is both graph_camera and single_pole".to_owned())),
    }
}

fn check_name(name: &str, others: &[NamedCamera]) -> Result<(), String> {
    if !(1..=WrittenCamera::MAX_NAME_BYTES).contains(&name.len()) {
        Err(format!("a name of 1 to {} bytes is needed", WrittenCamera::MAX_NAME_BYTES))
    } else if others.iter().any(|other| other.name == name) {
        Err("there is another one of this name".to_owned())
    } else if others.len() >= WrittenCamera::MAX_CAMERAS {
        Err(format!("a file has at most {}", WrittenCamera::MAX_CAMERAS))
    } else {
        Ok(())
    }
}

/// Turned with its node, not scaled: lengths are metres, as distances of lights are.
fn place(world_from_node: &DAffine3) -> Rigid {
    let back = world_from_node.transform_vector3(DVec3::Z).normalize_or(DVec3::Z);
    let up = world_from_node.transform_vector3(DVec3::Y).reject_from_normalized(back);
    let up = up.normalize_or(back.any_orthonormal_vector());
    let rotation = DQuat::from_mat3(&DMat3::from_cols(up.cross(back), up, back)).normalize();
    Rigid { rotation, translation: world_from_node.translation }
}
