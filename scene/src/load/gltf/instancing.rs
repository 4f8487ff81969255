//! Many instances of one node's mesh (`EXT_mesh_gpu_instancing`).

use glam::{DAffine3, DQuat, DVec3};

use super::accessor::{Accessors, Count};
use super::document::Node;
use crate::load::{LoadError, LoadLimits};

/// One instance of a node.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Offset {
    pub node_from_instance: DAffine3,
    /// See [`crate::Instance::tint`].
    pub tint: [u8; 3],
}

/// Each instance of a node; a node without the extension is one, where it is.
pub(super) fn offsets(
    node: &Node,
    at: &str,
    accessors: Accessors<'_>,
    limits: &LoadLimits,
) -> Result<Vec<Offset>, LoadError> {
    let Some(instancing) = &node.extensions.instancing else {
        return Ok(vec![Offset { node_from_instance: DAffine3::IDENTITY, tint: [255; 3] }]);
    };
    let attributes = &instancing.attributes;
    let at = format!("{at}.extensions.EXT_mesh_gpu_instancing");
    let given = [attributes.translation, attributes.rotation, attributes.scale];
    let Some(first) = given.into_iter().flatten().next() else {
        return Err(LoadError::malformed(at, "no attribute that places an instance"));
    };
    let count = accessors.get(first, &at)?.count;
    LoadError::check_limit(format!("{at}: instances"), count, limits.instances)?;
    let exactly = Count::Exactly(count as usize);
    let read = |attribute: Option<usize>| attribute.map(|index| accessors.floats::<3>(index, &at, exactly)).transpose();
    let translations = read(attributes.translation)?;
    let scales = read(attributes.scale)?;
    let rotations = attributes.rotation.map(|index| accessors.floats::<4>(index, &at, exactly)).transpose()?;
    let tints = attributes.colour.map(|index| tints(accessors, index, &at, exactly)).transpose()?;
    let vector = |values: &Option<Vec<[f32; 3]>>, index: usize, otherwise: DVec3| {
        values.as_ref().map_or(otherwise, |values| DVec3::from(values[index].map(f64::from)))
    };
    Ok((0..count as usize)
        .map(|index| {
            let rotation = rotations.as_ref().map_or(DQuat::IDENTITY, |r| DQuat::from_array(r[index].map(f64::from)));
            let length = rotation.length();
            let rotation = if length > 0.0 { rotation / length } else { DQuat::IDENTITY };
            let node_from_instance = DAffine3::from_scale_rotation_translation(
                vector(&scales, index, DVec3::ONE),
                rotation,
                vector(&translations, index, DVec3::ZERO),
            );
            Offset { node_from_instance, tint: tints.as_ref().map_or([255; 3], |tints| tints[index]) }
        })
        .collect())
}

/// Linear RGB, or RGBA whose alpha is not shown.
fn tints(accessors: Accessors<'_>, index: usize, at: &str, count: Count) -> Result<Vec<[u8; 3]>, LoadError> {
    let byte = |value: f32| (value.clamp(0.0, 1.0) * 255.0).round() as u8;
    match accessors.floats::<4>(index, at, count) {
        Ok(colours) => Ok(colours.into_iter().map(|[red, green, blue, _]| [red, green, blue].map(byte)).collect()),
        Err(_) => Ok(accessors.floats::<3>(index, at, count)?.into_iter().map(|colour| colour.map(byte)).collect()),
    }
}
