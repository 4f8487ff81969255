//! The bodies of a scene.

use std::collections::BTreeMap;
use std::sync::OnceLock;

use scene::Scene;

use super::build::build;
use super::made::{Made, Unfit};

/// What of a scene may be sent as bodies, for all stages of a server.
#[derive(Debug, Default)]
pub struct Bodies {
    /// By object.
    pub(super) candidates: BTreeMap<u16, OnceLock<Result<Made, Unfit>>>,
}

impl Bodies {
    /// Of a scene.
    pub fn new(scene: &Scene) -> Bodies {
        let objects = scene.animation.rigs().into_iter().filter_map(|rig| u16::try_from(rig.instance).ok());
        Bodies { candidates: objects.map(|object| (object, OnceLock::new())).collect() }
    }

    /// Whether there is nothing to decide.
    pub fn is_nothing(&self) -> bool {
        self.candidates.is_empty()
    }

    /// An object's, made when it is first asked for; `codes` are those of the scene's materials, see [`crate::imager::Imager::material_codes`].
    pub(super) fn made(&self, object: u16, scene: &Scene, codes: &[Option<u8>]) -> Option<&Made> {
        let candidate = self.candidates.get(&object)?;
        let made = candidate.get_or_init(|| {
            let made = build(scene, object, codes);
            let name = &scene.instances[usize::from(object)].name;
            match &made {
                Ok(made) => tracing::info!(
                    "{name:?} is sent as it is: {} triangles, {} bytes",
                    made.body.indices.len() / 3,
                    made.bytes
                ),
                Err(unfit) => tracing::info!("{name:?} is sampled anew with each update: {unfit}"),
            }
            made
        });
        made.as_ref().ok()
    }
}
