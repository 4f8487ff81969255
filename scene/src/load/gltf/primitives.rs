//! The primitives of the meshes that are shown, built in parallel.

use std::collections::HashMap;
use std::sync::atomic::{AtomicUsize, Ordering};

use rayon::prelude::*;

use super::attributes::Place;
use super::document::Document;
use super::motion::Skin;
use super::primitive::Primitive;
use crate::load::{LoadError, LoadLimits, Request, Stage, Warnings};

/// Mesh and primitive.
pub(super) type PrimitiveId = (usize, usize);

/// Builds the primitives that the given nodes need. One that is faulty is left out, with a warning; one past a limit is an error.
pub(super) fn read(
    place: Place<'_>,
    visible: &[usize],
    skins: &[Skin],
    request: &Request<'_>,
    warnings: &mut Warnings,
) -> Result<HashMap<PrimitiveId, Primitive>, LoadError> {
    let document = place.document;
    // By mesh: whether it is shown, and the fewest joints of a skin that it is shown with.
    let mut shown: Vec<Option<Option<usize>>> = (0..document.meshes.len()).map(|_| None).collect();
    for &node in visible {
        let source = &document.nodes[node];
        let Some(mesh) = source.mesh else { continue };
        let slot = &mut shown[mesh];
        let joints = source.skin.map(|skin| skins[skin].joints.len());
        *slot = Some(match (slot.take().flatten(), joints) {
            (Some(a), Some(b)) => Some(a.min(b)),
            (a, b) => a.or(b),
        });
    }
    let jobs = jobs(document, &shown);
    let place = Place { solid_step: check_counts(document, &jobs, place.limits)?, ..place };
    let done = AtomicUsize::new(0);
    let built: Vec<_> = jobs
        .par_iter()
        .map(|&((mesh, index), joints)| {
            let mut warnings = Warnings::default();
            let at = format!("meshes[{mesh}].primitives[{index}]");
            let primitive =
                Primitive::read(&document.meshes[mesh].primitives[index], &at, place, joints, &mut warnings);
            request.report(Stage::Meshes, done.fetch_add(1, Ordering::Relaxed) + 1, jobs.len());
            (primitive, warnings)
        })
        .collect();
    let mut primitives = HashMap::new();
    for (((mesh, index), _), (primitive, new_warnings)) in jobs.into_iter().zip(built) {
        warnings.extend(new_warnings);
        let primitive = warnings.leave_out(&format!("meshes[{mesh}].primitives[{index}]"), primitive)?;
        primitives.extend(primitive.flatten().map(|primitive| ((mesh, index), primitive)));
    }
    Ok(primitives)
}

/// A primitive to build, and the fewest joints of its skins.
type Job = (PrimitiveId, Option<usize>);

fn jobs(document: &Document, shown: &[Option<Option<usize>>]) -> Vec<Job> {
    let meshes = shown.iter().enumerate().filter_map(|(mesh, shown)| Some((mesh, (*shown)?)));
    let of_mesh = |(mesh, joints): (usize, Option<usize>)| {
        (0..document.meshes[mesh].primitives.len()).map(move |index| ((mesh, index), joints))
    };
    meshes.flat_map(of_mesh).collect()
}

/// Compares what accessors declare with the limits, before any is read. The result is the step in which points and lines
/// are taken, so that no more of them are drawn than the limit allows.
fn check_counts(document: &Document, jobs: &[Job], limits: &LoadLimits) -> Result<usize, LoadError> {
    const FIRST_MODE_OF_TRIANGLES: u32 = 4;
    let (mut vertices, mut indices, mut points) = (0_u64, 0_u64, 0_u64);
    for &((mesh, index), _) in jobs {
        let primitive = &document.meshes[mesh].primitives[index];
        let count = |accessor: Option<&usize>| accessor.and_then(|&a| document.accessors.get(a)).map_or(0, |a| a.count);
        let own = count(primitive.attributes.get("POSITION"));
        let corners = primitive.indices.map_or(own, |accessor| count(Some(&accessor)));
        vertices = vertices.saturating_add(own.saturating_mul(1 + primitive.targets.len() as u64));
        indices = indices.saturating_add(corners);
        if primitive.mode.is_some_and(|mode| mode < FIRST_MODE_OF_TRIANGLES) {
            points = points.saturating_add(corners);
        }
    }
    LoadError::check_limit("vertices", vertices, limits.vertices)?;
    LoadError::check_limit("indices", indices, limits.triangles.saturating_mul(3))?;
    Ok(points.div_ceil(limits.points.max(1)).max(1) as usize)
}
