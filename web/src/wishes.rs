//! What the page's address asks for.

use client::draw::antialiasing::Antialias;
use client::draw::effects::InTime;
use client::draw::frame;
use client::draw::occlusion::{self, Occlusion};
use client::draw::picture::PictureOptions;
use client::draw::shadow::{self, Shadows};
use client::draw::soft::{self, Choice, Pace};
use client::draw::steady::FrameRate;
use client::show::begin::{self, Start};
use client::show::controls::Mode;
use client::show::staging;
use protocol::Staging;
use protocol::message::Role;
use wasm_bindgen::prelude::*;

use crate::screen::Renderer;
use crate::server::{self, Address};

/// Vertical field of view where the address asks for none.
pub const FOV_Y_RAD: f64 = std::f64::consts::FRAC_PI_3;

/// What the address asks for.
pub struct Wishes {
    pub server: Address,
    pub renderer: Option<Renderer>,
    pub picture: PictureOptions,
    pub role: Role,
    /// Where to begin instead of where the server says.
    pub start: Option<Start>,
    /// How to move instead of as the scene suggests.
    pub mode: Option<Mode>,
    pub fov_y_rad: f64,
    /// How the scene is put before the viewer.
    pub staging: Staging,
}

/// Of the page; fails with words for a person.
pub fn wishes() -> Result<Wishes, String> {
    let location = web_sys::window().ok_or("the viewer runs in a page")?.location();
    let part = |part: Result<String, JsValue>| part.map_err(|_| "the page has no address".to_owned());
    let query = web_sys::UrlSearchParams::new_with_str(&part(location.search())?)
        .map_err(|_| "the page's address cannot be read".to_owned())?;
    let renderer = match query.get("renderer").as_deref() {
        None => None,
        Some("webgpu") => Some(Renderer::WebGpu),
        Some("webgl2") => Some(Renderer::WebGl2),
        Some(other) => return Err(format!("?renderer={other}: use webgpu or webgl2")),
    };
    let antialias = match query.get("antialias").as_deref() {
        None => Antialias::Measured,
        Some("on") => Antialias::On,
        Some("off") => Antialias::Off,
        Some(other) => return Err(format!("?antialias={other}: use on or off")),
    };
    let frame_rate = match query.get("frame-rate").as_deref() {
        None | Some("held") => FrameRate::Held,
        Some("free") => FrameRate::Free,
        Some(other) => return Err(format!("?frame-rate={other}: use held or free")),
    };
    let (occlusion, occlusion_in_time) = match query.get("occlusion").as_deref() {
        None => (Occlusion::Graph, true),
        Some("none") => (Occlusion::None, false),
        Some("plain") => (Occlusion::Plain, false),
        Some("graph") => (Occlusion::Graph, false),
        Some(other) => return Err(format!("?occlusion={other}: use none, plain or graph")),
    };
    let mut occlusion = occlusion::Settings { occlusion, ..occlusion::Settings::default() };
    if occlusion_in_time {
        occlusion.taps = occlusion::Settings::IN_TIME_TAPS;
    }
    let (shadows, shadows_in_time) = match query.get("shadows").as_deref() {
        None => (Shadows::Soft, true),
        Some("none") => (Shadows::None, false),
        Some("maps") => (Shadows::Maps, false),
        Some("soft") => (Shadows::Soft, false),
        Some(other) => return Err(format!("?shadows={other}: use none, maps or soft")),
    };
    let in_time = InTime { shadows: shadows_in_time, occlusion: occlusion_in_time };
    let mut shadow = shadow::Settings { shadows, ..shadow::Settings::default() };
    shadow.soft.pace = query.get("soft-pace").map_or(Ok(Pace::Measured), |pace| pace.parse())?;
    shadow.soft.choice = query.get("soft-method").map_or(Ok(Choice::Measured), |choice| choice.parse())?;
    if let Some(points) = query.get("soft-points") {
        let number = points.parse().ok().filter(|number| (1..=soft::Settings::MAX_POINTS).contains(number));
        let most = soft::Settings::MAX_POINTS;
        shadow.soft.points = number.ok_or_else(|| format!("?soft-points={points}: use 1 to {most}"))?;
    }
    let server = server::address(&location, &query)?;
    let stops = query.get("exposure").map_or(Ok(0.0), |stops| begin::stops(&stops));
    let exposure = stops.map_err(|why| format!("?exposure={why}"))?.exp2();
    let frame = frame::Options { antialias, exposure, ..frame::Options::default() };
    let picture = PictureOptions { frame, occlusion, shadow, in_time, frame_rate, ..PictureOptions::default() };
    let start = begin::start(query.get("eye").as_deref(), query.get("target").as_deref())?;
    let mode = query.get("mode").map(|mode| begin::mode(&mode)).transpose()?;
    let fov_y_rad = query.get("fov").map_or(Ok(FOV_Y_RAD), |degrees| begin::fov_y_rad(&degrees))?;
    let role = begin::role(query.get("camera"), query.get("present"), query.get("follow"))?;
    let staging = staging::staging(|name| query.get(name))?;
    Ok(Wishes { server, renderer, picture, role, start, mode, fov_y_rad, staging })
}
