//! The tick of a client that asked for a camera by its name.

use std::collections::BTreeSet;
use std::sync::Arc;

use protocol::Purpose;
use protocol::codec::ColourSteps;

use super::{LightWork, Made, Put, Stage};
use crate::account::Surroundings;
use crate::client::Client;
use crate::imager::Occasion;
use crate::plan::Reason;
use crate::stage_error::StageError;
use crate::viewer::Viewer;

impl Stage {
    /// Makes the image of the camera that a client asked for, as the scene is then; nothing where it is the one that the client
    /// holds.
    pub(super) fn camera_image(
        &mut self,
        viewer: &Viewer,
        client: &mut Client,
        now_s: f64,
    ) -> Result<Option<Made>, StageError> {
        let time_s = self.scene_time_s(viewer, client, now_s);
        let put = Put { by_clip: BTreeSet::new(), ..Put::before(client) };
        self.with_surroundings(time_s, put, |stage, snapshot, now| {
            // Nothing in the image is taken along as objects move: it is drawn anew.
            let now = &Surroundings { moving: &[], ..*now };
            let Some(asked) = &mut client.asked else { return Ok(None) };
            client.account.begin(now)?;
            // It is the same for all who ask for it.
            stage.imager.draw_for(Occasion::Standing);
            let Some(mut image) = stage.imager.camera_image(snapshot, &asked.camera)? else { return Ok(None) };
            now.colour.settle_all(&mut image.colour);
            if now.colour != ColourSteps::Lossless {
                // Nothing is left off of colours that move.
                image.colour_rest.clear();
            }
            let held = asked.sent.and_then(|id| client.account.held().patches.get(&id));
            if held.is_none_or(|held| held.patch.image != image) {
                let sent = client.account.add_impostor(image, Purpose::Camera, now)?;
                if let Some(old) = asked.sent.replace(sent) {
                    client.account.remove_whole(old)?;
                }
            }
            let (width_px, height_px) = asked.camera.size_px();
            let counts = client.account.counts();
            let update = client.account.seal(now.time_s, viewer.pose_seq, false)?;
            let coding = stage.coding.coding(viewer.bytes_per_s);
            let pixels = u64::from(width_px) * u64::from(height_px);
            let lights = LightWork::default();
            Ok(update.map(|update| Made {
                reason: Reason::Camera,
                update,
                coding,
                counts,
                pixels,
                lights,
                coded: Arc::default(),
            }))
        })
    }
}
