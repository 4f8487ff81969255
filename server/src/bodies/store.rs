//! The bodies of a scene.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::OnceLock;

use scene::Scene;

use super::build::{build, fit};
use super::made::{Made, Unfit};

/// About the fewest bytes that a triangle takes, of a body of many.
const LEAST_BYTES_PER_TRIANGLE: f64 = 2.0;
/// No body takes less than about that.
const LEAST_BYTES: f64 = 200.0;

/// What of a scene may be sent as bodies, for all stages of a server.
#[derive(Debug, Default)]
pub struct Bodies {
    pub(super) shapes: Vec<Shape>,
}

/// Objects that one body shows: one that bones bend or move, or all that are rigid and of one mesh.
#[derive(Debug)]
pub(super) struct Shape {
    /// Ids ascend.
    pub objects: Vec<u16>,
    /// Whether bones bend or move it.
    pub is_rigged: bool,
    /// Its body takes more than about that.
    pub least_bytes: f64,
    made: OnceLock<Result<Made, Unfit>>,
}

impl Bodies {
    /// Of a scene; `codes` are those of its materials, see [`crate::imager::Imager::material_codes`].
    pub fn new(scene: &Scene, codes: &[Option<u8>]) -> Bodies {
        let rigged: BTreeSet<u32> = scene.animation.rigs().into_iter().map(|rig| rig.instance).collect();
        let mut shapes: Vec<Shape> = Vec::new();
        let mut of_mesh: BTreeMap<u32, Vec<u16>> = BTreeMap::new();
        for (object, instance) in (0..).zip(&scene.instances) {
            if rigged.contains(&u32::from(object)) {
                shapes.push(Shape::new(scene, vec![object], true));
            } else if !instance.deforms {
                of_mesh.entry(instance.mesh).or_default().push(object);
            }
        }
        let rigid = of_mesh.into_iter().filter(|(mesh, _)| match fit(scene, *mesh, codes) {
            Ok(_) => true,
            Err(unfit) => {
                tracing::debug!("objects of mesh {mesh} are sampled: {unfit}");
                false
            }
        });
        shapes.extend(rigid.map(|(_, objects)| Shape::new(scene, objects, false)));
        Bodies { shapes }
    }

    /// Whether there is nothing to decide.
    pub fn is_nothing(&self) -> bool {
        self.shapes.is_empty()
    }

    /// What the body of a rigid object takes, in bytes; `None` where there is none. Makes it, where that was not done before.
    pub fn rigid_bytes(&self, object: u16, scene: &Scene, codes: &[Option<u8>]) -> Option<f64> {
        let is_of = |shape: &&Shape| !shape.is_rigged && shape.objects.binary_search(&object).is_ok();
        Some(self.shapes.iter().find(is_of)?.made(scene, codes)?.bytes as f64)
    }
}

impl Shape {
    fn new(scene: &Scene, objects: Vec<u16>, is_rigged: bool) -> Shape {
        let triangles = scene.meshes[scene.instances[usize::from(objects[0])].mesh as usize].indices.len() / 3;
        let least_bytes = LEAST_BYTES.max(LEAST_BYTES_PER_TRIANGLE * triangles as f64);
        Shape { objects, is_rigged, least_bytes, made: OnceLock::new() }
    }

    /// Its body, made when it is first asked for.
    pub fn made(&self, scene: &Scene, codes: &[Option<u8>]) -> Option<&Made> {
        let made = self.made.get_or_init(|| {
            let made = build(scene, self.objects[0], codes);
            let name = &scene.instances[usize::from(self.objects[0])].name;
            match &made {
                Ok(made) => tracing::debug!(
                    "{name:?} as it is: {} triangles, {} bytes, {} objects",
                    made.body.indices.len() / 3,
                    made.bytes,
                    self.objects.len()
                ),
                Err(unfit) => tracing::info!("{name:?} is sampled: {unfit}"),
            }
            made
        });
        made.as_ref().ok()
    }

    /// Whether it was found that there is no body of it.
    pub fn is_unfit(&self) -> bool {
        matches!(self.made.get(), Some(Err(_)))
    }
}
