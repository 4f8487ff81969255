//! Where points of deforming objects are, and which held samples are no longer there.
//!
//! A sample is a point of a triangle. Where that point goes tells whether the sample is still true, seen or not. What a view shows does not: a
//! surface that slides along itself looks in place by its depth and normal, but its texture is elsewhere.

use glam::{DAffine3, DVec2, DVec3};
use scene::model::{Deformed, Instance, Mesh};
use scene::{Scene, Snapshot};

/// A sample is still true while its point is within so many pixels of its image from where it was captured: the rounding to pixels shifts what
/// is seen as much.
const STAYS_PX: f64 = 0.5;

/// The triangles of deforming objects at a time. `default()`: nothing deforms.
#[derive(Debug, Clone, Default)]
pub struct Deforming<'a> {
    instances: &'a [Instance],
    meshes: &'a [Mesh],
    world_from_mesh: &'a [DAffine3],
    /// By object: the id of its first triangle.
    first_triangles: &'a [u32],
    /// By object; nothing of those that do not deform. Empty where none does.
    deformed: Vec<Option<&'a Deformed>>,
}

impl<'a> Deforming<'a> {
    /// Those of a scene; `first_triangles` by object.
    pub fn new(scene: &'a Scene, snapshot: &'a Snapshot, first_triangles: &'a [u32]) -> Deforming<'a> {
        if snapshot.deformed.is_empty() {
            return Deforming::default();
        }
        let mut deformed = vec![None; scene.instances.len()];
        for of_instance in &snapshot.deformed {
            deformed[of_instance.instance as usize] = Some(of_instance);
        }
        let (instances, meshes) = (scene.instances.as_slice(), scene.meshes.as_slice());
        Deforming { instances, meshes, world_from_mesh: &snapshot.world_from_mesh, first_triangles, deformed }
    }

    /// Whether nothing does.
    pub fn is_empty(&self) -> bool {
        self.deformed.is_empty()
    }

    /// The corners of a triangle of an object that deforms.
    fn corners_world(&self, object: u16, triangle: u32) -> Option<[DVec3; 3]> {
        let object = usize::from(object);
        let deformed = (*self.deformed.get(object)?)?;
        let within = triangle.checked_sub(*self.first_triangles.get(object)?)? as usize;
        let indices = &self.meshes[self.instances[object].mesh as usize].indices;
        let &[a, b, c] = indices.get(3 * within..3 * within + 3)? else { return None };
        let corner = |index: u32| {
            let vertex = deformed.vertices.get(index as usize)?;
            Some(self.world_from_mesh[object].transform_point3(DVec3::from(vertex.position.map(f64::from))))
        };
        Some([corner(a)?, corner(b)?, corner(c)?])
    }
}

/// A held sample's point of a deforming object.
#[derive(Debug, Clone, Copy)]
pub(super) struct SurfacePoint {
    object: u16,
    triangle: u32,
    /// Of the triangle's second and third corner.
    weights: DVec2,
    /// Where it was when it was captured.
    at_world: DVec3,
    /// A pixel of its image there, in metres.
    footprint_m: f64,
}

impl SurfacePoint {
    /// The point of a triangle nearest to where a sample was captured, in the triangle's plane; `None` of what does not deform.
    pub fn nearest(
        deforming: &Deforming<'_>,
        (object, triangle): (u16, u32),
        sample_world: DVec3,
        footprint_m: f64,
    ) -> Option<SurfacePoint> {
        let [a, b, c] = deforming.corners_world(object, triangle)?;
        let (ab, ac, away) = (b - a, c - a, sample_world - a);
        let (bb, bc, cc) = (ab.dot(ab), ab.dot(ac), ac.dot(ac));
        let area = bb * cc - bc * bc;
        let weights = DVec2::new(cc * ab.dot(away) - bc * ac.dot(away), bb * ac.dot(away) - bc * ab.dot(away)) / area;
        // A triangle without area is its first corner.
        let weights = if weights.is_finite() { weights } else { DVec2::ZERO };
        Some(SurfacePoint { object, triangle, weights, at_world: a + ab * weights.x + ac * weights.y, footprint_m })
    }

    /// Whether it is no longer where it was captured.
    pub fn has_moved(&self, deforming: &Deforming<'_>) -> bool {
        let Some([a, b, c]) = deforming.corners_world(self.object, self.triangle) else { return true };
        let now_world = a + (b - a) * self.weights.x + (c - a) * self.weights.y;
        now_world.distance(self.at_world) > STAYS_PX * self.footprint_m
    }
}
