//! What a viewer who stands still is sent: his own view, at the pixels of his output, so that what he sees is the scene itself.
//!
//! Surfaces that are rebuilt from samples of other views are off by a fraction of a pixel at every outline. Who moves does not mind; who
//! stands still looks closely. So once a viewer stands still, rows of his very view follow ([`Purpose::Rest`](protocol::Purpose::Rest)), as
//! many at a time as the path carries in an update interval, and the client shows them pixel by pixel as long as its camera is that of the
//! rows. They are dropped when the viewer moves on. A client that draws antialiased pictures gets each pixel in [`parts`].

pub mod parts;

mod kept;

use camera::Pinhole;
use glam::DVec2;
use protocol::held::PatchId;

use crate::client::Client;
use crate::plan::Rules;
use crate::viewer::Viewer;
pub use kept::{Kept, Strip};

/// Who stood still for so long means to: longer than between two events of a mouse that is dragged slowly.
const REST_AFTER_S: f64 = 0.15;
/// Rows of so many samples at a time at most: what the rest of the session waits for at the server.
const MAX_STRIP_SAMPLES: f64 = (1 << 22) as f64;
/// What a pixel of the first rows is expected to cost, in bytes: between 0.5 (houses) and 2 (leaves) were seen.
const BYTES_PER_PX: f64 = 1.5;
/// Bytes at a time that any path is expected to carry. Who moves slowly is sent little, and then the path looks as slow: this much finds out more.
const LEAST_BYTES: f64 = 16.0 * 1024.0;
/// Rows may be of much more than those above them: at most so many times as many follow at once.
const GROWTH: f64 = 8.0;
/// What a pixel costs a client: ten bytes as it is held, sixteen in textures.
const HELD_BYTES_PER_PX: u64 = 26;
/// Part of a client's budget that such a view may take.
const BUDGET_SHARE: u64 = 2;

/// The rows that a client lacks of its view at rest; `None` of one that moves, has no picture yet, or has them all.
pub fn lacking(rules: &Rules, client: &Client, viewer: &Viewer, now_s: f64) -> Option<Strip> {
    let view = wanted(rules, client, viewer, now_s)?;
    let kept = Some(&client.rest).filter(|kept| kept.camera == Some(view));
    let first = kept.map_or(0, |kept| kept.rows);
    let left = view.height_px.checked_sub(first).filter(|&left| left > 0)?;
    let carried_bytes =
        viewer.bytes_per_s.map_or(f64::INFINITY, |path| (path * rules.update_interval_s).max(LEAST_BYTES));
    let carried_px = carried_bytes / kept.and_then(Kept::bytes_per_px).unwrap_or(BYTES_PER_PX);
    let most_px = MAX_STRIP_SAMPLES / if client.draws.antialiased { f64::from(parts::SAMPLES) } else { 1.0 };
    let most_rows = if first == 0 { f64::INFINITY } else { GROWTH * f64::from(first) };
    let rows = (carried_px.min(most_px) / f64::from(view.width_px)).min(most_rows);
    let height_px = (rows as u32).clamp(1, left);
    let centre_px = view.centre_px - DVec2::new(0.0, f64::from(first));
    Some(Strip { view, camera: Pinhole { height_px, centre_px, ..view } })
}

/// The view that a client should have at rest; `None` while there is none.
fn wanted(rules: &Rules, client: &Client, viewer: &Viewer, now_s: f64) -> Option<Pinhole> {
    let (width_px, height_px) = (viewer.view.width_px, viewer.view.height_px);
    let fits = u64::from(width_px) * u64::from(height_px) * HELD_BYTES_PER_PX <= client.budget_bytes / BUDGET_SHARE
        && width_px.max(height_px) <= protocol::Limits::default().image_side_px;
    // Whether he stays where his first picture found him is heard a round trip after it was sent.
    let saw_s = client.picture_sent_at_s.map_or(0.0, |sent_at_s| now_s - sent_at_s - viewer.round_trip_s);
    let rests = viewer.rested_s(now_s).min(saw_s) >= REST_AFTER_S;
    (rules.rests && fits && rests && client.focus.is_some())
        .then(|| Pinhole::symmetric(viewer.world_from_eye, (width_px, height_px), viewer.view.fov_y_rad, rules.near_m))
}

/// The patches that a client has no use for any more, as its viewer moved on.
pub fn outdated(rules: &Rules, client: &mut Client, viewer: &Viewer, now_s: f64) -> Vec<PatchId> {
    let view = wanted(rules, client, viewer, now_s);
    client.rest.drop_others(view.as_ref())
}

#[cfg(test)]
mod tests {
    use camera::{Motion, Rigid};
    use glam::DVec3;
    use protocol::message::ViewSize;

    use super::*;
    use crate::plan::{Coverage, Focus};

    const VIEW: ViewSize = ViewSize { width_px: 400, height_px: 320, fov_y_rad: 1.0 };
    const RULES: Rules = Rules {
        images: 4,
        image_size_px: 512,
        update_interval_s: 0.1,
        near_m: 0.05,
        margin_m: 0.25,
        animated: false,
        rests: true,
        anticipates: false,
        parallax_error_px: 0.1,
    };

    fn viewer() -> Viewer {
        let mut viewer = Viewer::at_start(VIEW, Rigid::IDENTITY, 0.0);
        viewer.hear(1, 1.0, Rigid::look_along(DVec3::X, DVec3::NEG_Z), Motion::STILL, 1.0);
        viewer
    }

    fn client(viewer: &Viewer) -> Client {
        let coverage = Coverage {
            world_from_eye: viewer.world_from_eye,
            radius_m: 1.0,
            half_field: DVec2::ONE,
            image_size_px: (64, 64),
            view: VIEW,
            scene_time_s: 0.0,
            way: None,
        };
        Client {
            focus: Some(Focus { coverage, settled: false, passing: false, looks: 1 }),
            picture_sent_at_s: Some(0.0),
            ..Client::default()
        }
    }

    /// The first row and the number of rows of every strip, of which each cost so many bytes a pixel.
    fn strips(client: &mut Client, viewer: &Viewer, bytes_per_px: &[f64]) -> Vec<(f64, u32)> {
        let mut strips = Vec::new();
        while let Some(strip) = lacking(&RULES, client, viewer, 2.0) {
            let pixels = f64::from(VIEW.width_px * strip.camera.height_px);
            client.rest.sent(&strip, &[PatchId(strips.len() as u32 + 1)]);
            client.rest.coded((bytes_per_px[strips.len()] * pixels) as usize);
            strips.push((strip.view.centre_px.y - strip.camera.centre_px.y, strip.camera.height_px));
        }
        strips
    }

    #[test]
    fn rows_are_as_many_as_the_path_carries_by_what_those_before_cost() {
        let mut viewer = viewer();
        viewer.bytes_per_s = Some(100.0 * 400.0 * BYTES_PER_PX / RULES.update_interval_s);
        let dear = strips(&mut client(&viewer), &viewer, &[2.0 * BYTES_PER_PX; 6]);
        assert_eq!(dear, [(0.0, 100), (100.0, 50), (150.0, 50), (200.0, 50), (250.0, 50), (300.0, 20)]);
        viewer.bytes_per_s = Some(1.0);
        let cheap = strips(&mut client(&viewer), &viewer, &[0.01; 3]);
        assert_eq!(cheap, [(0.0, 27), (27.0, 216), (243.0, 77)], "a path of which little was asked, and rows of sky");
    }

    #[test]
    fn a_view_comes_once_and_goes_when_the_viewer_moves_on() {
        let mut viewer = viewer();
        viewer.bytes_per_s = Some(150.0 * 400.0 * BYTES_PER_PX / RULES.update_interval_s);
        let mut client = client(&viewer);
        assert_eq!(strips(&mut client, &viewer, &[BYTES_PER_PX; 3]), [(0.0, 150), (150.0, 150), (300.0, 20)]);
        assert_eq!(outdated(&RULES, &mut client, &viewer, 2.0), [], "they are of use");
        viewer.hear(2, 2.0, Rigid::IDENTITY, Motion::along(DVec3::X), 2.0);
        assert_eq!(outdated(&RULES, &mut client, &viewer, 2.0), [PatchId(1), PatchId(2), PatchId(3)]);
        assert_eq!(outdated(&RULES, &mut client, &viewer, 2.0), []);
    }

    #[test]
    fn who_moves_or_just_stopped_or_has_no_picture_gets_nothing() {
        let viewer = viewer();
        let client = client(&viewer);
        assert!(lacking(&RULES, &client, &viewer, 1.0 + REST_AFTER_S / 2.0).is_none(), "just stopped");
        assert!(lacking(&RULES, &client, &viewer, 2.0).is_some());
        assert!(lacking(&RULES, &Client::default(), &viewer, 2.0).is_none(), "no picture");
        let mut far = viewer;
        far.round_trip_s = 0.5;
        let fresh = Client { picture_sent_at_s: Some(1.5), ..self::client(&viewer) };
        assert!(lacking(&RULES, &fresh, &far, 2.0).is_none(), "may have left again");
        assert!(lacking(&RULES, &fresh, &far, 2.2).is_some());
        assert!(lacking(&Rules { rests: false, ..RULES }, &client, &viewer, 2.0).is_none());
        let poor = Client { budget_bytes: BUDGET_SHARE * HELD_BYTES_PER_PX * 400 * 320 - BUDGET_SHARE, ..client };
        assert!(lacking(&RULES, &poor, &viewer, 2.0).is_none(), "no room");
        let mut walker = viewer;
        walker.hear(2, 1.1, Rigid::IDENTITY, Motion::along(DVec3::X), 1.1);
        assert!(lacking(&RULES, &self::client(&walker), &walker, 1.3).is_none(), "moves");
        assert!(lacking(&RULES, &self::client(&walker), &walker, 2.0).is_some(), "silence means standing still");
    }
}
