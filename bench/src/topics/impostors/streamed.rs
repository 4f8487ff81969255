//! What a session spends on impostors.

use std::collections::BTreeSet;
use std::sync::Arc;

use gpu::Gpu;
use protocol::codec::{Coding, encode_patch};
use protocol::{PatchId, Purpose};
use scene::Scene;
use server::impostors::Needs;

use super::reflect::Path;
use super::settings::Settings;
use crate::report::{Report, Row};
use crate::topics::sent_once::walk::{Setup, UPDATE_HZ, Walker};

/// Side of a server's images.
const IMAGE_PX: u32 = 256;

/// One client along the path, as fast as it was recorded; and the same with a scene whose reflectors are plain.
pub(super) fn measure(
    gpu: &Gpu,
    scene: &Scene,
    path: &Path,
    settings: &Settings,
    report: &mut Report,
) -> anyhow::Result<()> {
    for (name, scene) in [("session", scene.clone()), ("session, nothing reflects", plain(scene))] {
        let (mut all, mut impostors, mut images) = (0, 0, 0);
        let mut seen: BTreeSet<PatchId> = BTreeSet::new();
        let mut walker = Walker::new(gpu, Arc::new(scene.clone()), &Setup::usual(IMAGE_PX))?;
        let mut seconds = 0.0;
        for (index, (_, view)) in path.views(&scene, settings.size_px).enumerate() {
            seconds = index as f64 / UPDATE_HZ;
            all += walker.tick(view.world_from_eye, seconds)?.bytes;
            let new = walker.set.held.patches.iter().filter(|(id, _)| !seen.contains(id));
            for held in new.map(|(_, held)| held).filter(|held| held.patch.purpose != Purpose::Eye) {
                impostors += encode_patch(&held.patch, Coding::default()).len();
                images += 1;
            }
            seen.extend(walker.set.held.patches.keys());
        }
        let mut row = Row::new(&scene.name, name);
        row.bytes.set("session", all as f64);
        row.bytes.set("impostors", f64::from(u32::try_from(impostors)?));
        row.counts.set("images", f64::from(images));
        row.counts.set("seconds", seconds);
        report.rows.push(row);
    }
    Ok(())
}

/// The scene without reflections.
fn plain(scene: &Scene) -> Scene {
    let mut plain = scene.clone();
    for material in &mut plain.materials {
        (material.metallic, material.transmission) = (0.0, 0.0);
    }
    debug_assert!(Needs::new(&plain).is_nothing());
    plain
}
