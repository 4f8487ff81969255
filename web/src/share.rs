//! The address of the view as it is now, for who is to see the same.

use client::receive::viewer::Viewer;
use client::show::begin;
use client::show::controls::{Controls, Mode};
use client::show::staging;
use protocol::Staging;
use web_sys::UrlSearchParams;

use crate::wishes::FOV_Y_RAD;

/// Parts of an address that say where it begins, and who leads whom: who follows a link is to see this view, and does not present in its sender's place.
const OWN: [&str; 6] = ["eye", "target", "mode", "present", "follow", "fov"];

/// The page's own address, with its scene and its options, but for where it begins. A token is not in it: it was taken
/// out of the address when the page was opened.
pub fn address(controls: &Controls, viewer: &Viewer, fov_y_rad: f64, now_s: f64) -> Option<String> {
    let walks = viewer.welcome()?.walk;
    let location = web_sys::window()?.location();
    let query = UrlSearchParams::new_with_str(&location.search().ok()?).ok()?;
    OWN.iter().chain(&staging::NAMES).for_each(|name| query.delete(name));
    let others = String::from(query.to_string());
    let mut parts: Vec<String> = Some(others).filter(|others| !others.is_empty()).into_iter().collect();
    parts.push(begin::parts(controls.pose(), controls.distance_m()));
    let mode = controls.mode();
    if (mode == Mode::Walk) != walks {
        parts.push(format!("mode={}", begin::mode_name(mode)));
    }
    if fov_y_rad != FOV_Y_RAD {
        let degrees = format!("{:.3}", fov_y_rad.to_degrees());
        parts.push(format!("fov={}", degrees.trim_end_matches('0').trim_end_matches('.')));
    }
    let playback = viewer.playback();
    let staged = Staging { playback, ..viewer.staging().clone() };
    parts.extend(staging::parts(&staged, viewer.scene_time_now_s(now_s)));
    Some(format!("{}{}?{}", location.origin().ok()?, location.pathname().ok()?, parts.join("&")))
}
