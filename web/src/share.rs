//! The address of the view as it is now, for who is to see the same.

use client::show::begin;
use client::show::controls::{Controls, Mode};
use web_sys::UrlSearchParams;

use crate::wishes::FOV_Y_RAD;

/// Parts of an address that say where it begins, and who leads whom: who follows a link is to see this view, and does not present in its sender's place.
const OWN: [&str; 6] = ["eye", "target", "mode", "present", "follow", "fov"];

/// The page's own address, with its scene and its options, but for where it begins. `walks`: how eyes move in the scene where nothing else is asked for. A token is not in it: it was taken
/// out of the address when the page was opened.
pub fn address(controls: &Controls, walks: bool, fov_y_rad: f64) -> Option<String> {
    let location = web_sys::window()?.location();
    let query = UrlSearchParams::new_with_str(&location.search().ok()?).ok()?;
    OWN.iter().for_each(|name| query.delete(name));
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
    Some(format!("{}{}?{}", location.origin().ok()?, location.pathname().ok()?, parts.join("&")))
}
