//! What the page's scripts, and tests, call: each on the one viewer of the page.

use std::cell::RefCell;
use std::rc::Rc;

use camera::Trace;
use client::receive::viewer::Viewer;
use client::show::begin;
use client::show::controls::{Controls, Mode};
use client::show::quality::Quality;
use client::show::staging;
use client::show::tape::Tape;
use glam::DVec3;
use protocol::message::Role;
use protocol::staging::{Parts, Playback, SceneMotion};
use protocol::{Held, Purpose};

use super::worn::{Poses, Worn};
use super::{APP, App, near_m};
use crate::moments::now_s;
use crate::photo::{self, Photo};
use crate::record::{Recording, Replay};
use crate::screen::{Renderer, Screen};
use crate::share;

/// What is said before anything is shown.
const EARLY: &str = "there is no picture yet";

fn app() -> Option<Rc<RefCell<App>>> {
    APP.with_borrow(Clone::clone)
}

/// See `main.js`.
pub fn snapshot() -> String {
    let Some(app) = app() else { return "{}".to_owned() };
    let mut app = app.borrow_mut();
    let now_s = now_s();
    let stats = app.viewer.stats(now_s);
    let pose = app.drawn.pose.map(
        |pose| serde_json::json!({ "position": pose.translation.to_array(), "quaternion": pose.rotation.to_array() }),
    );
    let soft = app.screen.as_ref().and_then(|screen| screen.picture.soft_progress());
    let snapshot = serde_json::json!({
        "frames": stats.frames,
        "samples": stats.samples,
        "updates": stats.updates,
        "impostors": app.screen.as_ref().map(|screen| screen.picture.impostors()),
        "resolution": app.screen.as_ref().map(|screen| screen.picture.resolution().to_string()),
        "soft_points": soft.map(|soft| [soft.points, soft.of]),
        "effects": app.screen.as_ref().map(|screen| screen.picture.effects().map(|drawn| drawn.to_string())),
        "soft_method": soft.and_then(|soft| soft.method).map(|method| method.to_string()),
        "light_images": light_images(app.viewer.held()),
        "uncovered": app.drawn.uncovered,
        "age_ms": stats.age_ms,
        "status": app.status(now_s),
        "connected": app.viewer.is_open(),
        "picture": app.drawn.picture,
        "renderer": app.screen.as_ref().map(|screen| screen.renderer.name()),
        "adapter": app.screen.as_ref().map(|screen| screen.gpu.caps.name.clone()),
        "at_rest": app.drawn.pose.zip(app.screen.as_ref())
            .is_some_and(|(pose, screen)| screen.is_at_rest(pose, app.fov_y_rad, near_m(&app.viewer))),
        "background": app.viewer.held().lighting.as_ref().map(|lighting| lighting.background),
        "size_px": app.screen.as_ref().map(Screen::size_px),
        "mode": app.controls.as_ref().map(|controls| if controls.mode() == Mode::Walk { "walk" } else { "turn" }),
        "pose": pose,
        "measures": app.places.tape().map(Tape::in_words),
        "fov_deg": app.fov_y_rad.to_degrees(),
        "replays": app.replay.is_some(),
        "walls": app.controls.as_ref().map(Controls::has_walls),
        "headset": app.worn.is_some(),
        "led": app.controls.as_ref().is_some_and(Controls::is_led),
        "decoder": if app.viewer.decodes_beside() { "worker" } else { "page" },
        "stats": stats,
        "device_losses": app.devices.losses,
    });
    snapshot.to_string()
}

/// See [`crate::link`].
pub fn link() -> Option<String> {
    let app = app()?;
    let app = app.borrow();
    share::address(app.controls.as_ref()?, &app.viewer, app.fov_y_rad, now_s())
}

/// See [`crate::token`].
pub fn token() -> Option<String> {
    let app = app()?;
    let app = app.borrow();
    app.server.token().map(str::to_owned)
}

/// See [`crate::record`].
pub fn record(is_on: bool) -> Option<String> {
    let app = app()?;
    let mut app = app.borrow_mut();
    let mut begun = is_on.then(|| Recording::begin(now_s()));
    if let (Some(recording), Some(controls)) = (&mut begun, &app.controls) {
        recording.see(controls.pose(), now_s());
    }
    let before = std::mem::replace(&mut app.recording, begun)?;
    before.end().map(|trace| trace.to_text())
}

/// See [`crate::replay`].
pub fn replay(text: &str) -> Result<f64, String> {
    let trace = Trace::parse(text).map_err(|error| error.to_string())?;
    let app = app().ok_or(EARLY)?;
    let duration_s = trace.duration_s();
    app.borrow_mut().replay = Some(Replay::begin(trace, now_s()));
    Ok(duration_s)
}

/// See [`crate::go`].
pub fn go(eye: &[f64], target: &[f64], fov_deg: Option<f64>) -> Result<(), String> {
    let point = |name: &str, at: &[f64]| {
        let at = <[f64; 3]>::try_from(at).map_err(|_| format!("{name}: three numbers are a point, in metres"))?;
        Ok::<_, String>(DVec3::from_array(at))
    };
    let start = begin::view(point("eye", eye)?, point("target", target)?)?;
    let app = app().ok_or(EARLY)?;
    let mut app = app.borrow_mut();
    app.controls.as_mut().ok_or(EARLY)?.go_to_view(start.world_from_eye, start.distance_m);
    app.replay = None;
    if let Some(degrees) = fov_deg.filter(|degrees| degrees.is_finite()) {
        app.set_fov(degrees);
    }
    Ok(())
}

/// See [`crate::set_quality`].
pub fn set_quality(name: &str) -> Result<(), String> {
    let quality: Quality = name.parse()?;
    let app = app().ok_or(EARLY)?;
    let mut this = app.borrow_mut();
    // Where none is there, one is being made: it is asked for again then.
    if this.screen.take().is_none() {
        return Err(EARLY.to_owned());
    }
    this.quality = quality;
    drop(this);
    wasm_bindgen_futures::spawn_local(App::recover(app));
    Ok(())
}

/// See [`crate::mark_holes`].
pub fn mark_holes(are_marked: bool) {
    if let Some(app) = app() {
        let mut app = app.borrow_mut();
        app.picture.frame.mark_uncovered = are_marked;
        app.screen.iter_mut().for_each(|screen| screen.picture.options_mut().mark_uncovered = are_marked);
        app.drawn.stale = true;
    }
}

/// See [`crate::set_tint`].
pub fn set_tint(name: &str) -> Result<(), String> {
    let tint = name.parse()?;
    let app = app().ok_or(EARLY)?;
    let mut app = app.borrow_mut();
    app.picture.frame.tint = tint;
    app.screen.iter_mut().for_each(|screen| screen.picture.options_mut().tint = tint);
    app.drawn.stale = true;
    Ok(())
}

/// See [`crate::staged`].
pub fn staged() -> String {
    let Some(app) = app() else { return "{}".to_owned() };
    let mut app = app.borrow_mut();
    let now_s = now_s();
    let (parts, objects) = match app.viewer.staging().excerpt.parts.clone() {
        Parts::All => ("all", Vec::new()),
        Parts::But(hidden) => ("but", hidden),
        Parts::Only(shown) => ("only", shown),
    };
    let (motion, period_s) = match app.viewer.scene_motion() {
        SceneMotion::Still => ("still", None),
        SceneMotion::Endless => ("endless", None),
        SceneMotion::Loop { period_s } => ("loop", Some(period_s)),
    };
    let named = |object: u16, viewer: &mut Viewer| serde_json::json!({ "object": object, "name": viewer.name_of(object, now_s) });
    let chosen = app.places.chosen();
    let section = app.viewer.staging().excerpt.section;
    let staged = serde_json::json!({
        "motion": motion,
        "period_s": period_s,
        "time_s": app.viewer.scene_time_now_s(now_s),
        "rate": app.viewer.playback().rate,
        "follows": matches!(app.viewer.role(), Role::Follower(_)),
        "parts": parts,
        "objects": objects.into_iter().map(|object| named(object, &mut app.viewer)).collect::<Vec<_>>(),
        "chooses": chosen.is_some(),
        "chosen": chosen.flatten().map(|object| named(object, &mut app.viewer)),
        "section": section.map(|section| (section.normal_world.to_array(), section.offset_m)),
        "bounds": app.viewer.welcome().map(|welcome| [welcome.bounds_min_world, welcome.bounds_max_world]),
    });
    staged.to_string()
}

/// See [`crate::play`].
pub fn play(rate: f64) -> Result<(), String> {
    let (least, most) = (Playback::SLOWEST, Playback::FASTEST);
    if rate != 0.0 && !(least..=most).contains(&rate) {
        return Err(format!("{rate} times as fast: use 0, or {least} to {most}"));
    }
    with_viewer(|viewer| viewer.play(rate, now_s()));
    Ok(())
}

/// See [`crate::seek`].
pub fn seek(time_s: f64) -> Result<(), String> {
    if !(Playback { scene_time_s: time_s, ..Playback::default() }).is_valid() {
        return Err(format!("{time_s} s is no time of a scene"));
    }
    with_viewer(|viewer| viewer.seek(time_s, now_s()));
    Ok(())
}

/// See [`crate::show_parts`].
pub fn show_parts(which: &str, mut objects: Vec<u16>) -> Result<(), String> {
    objects.sort_unstable();
    objects.dedup();
    let parts = match which {
        _ if objects.len() > Parts::MOST => return Err(format!("{} parts at most", Parts::MOST)),
        "all" => Parts::All,
        "but" => Parts::But(objects),
        "only" => Parts::Only(objects),
        other => return Err(format!("{other}: use all, but or only")),
    };
    with_viewer(|viewer| viewer.show_parts(parts, now_s()));
    Ok(())
}

/// See [`crate::cut`].
pub fn cut(normal: &[f64], offset_m: f64) -> Result<(), String> {
    let section = match *normal {
        [] => None,
        [x, y, z] => Some(staging::plane(DVec3::new(x, y, z), offset_m)?),
        _ => return Err("three numbers are a normal".to_owned()),
    };
    with_viewer(|viewer| viewer.cut(section, now_s()));
    Ok(())
}

fn with_viewer(act: impl FnOnce(&mut Viewer)) {
    if let Some(app) = app() {
        act(&mut app.borrow_mut().viewer);
    }
}

/// See [`crate::put_on`].
pub fn put_on() -> Result<(), String> {
    let app = app().ok_or(EARLY)?;
    let mut this = app.borrow_mut();
    if this.controls.is_none() {
        return Err(EARLY.to_owned());
    }
    this.wear(&app, Some(Worn::default()));
    Ok(())
}

/// See [`crate::look`].
pub fn look(head: &[f64], eyes: &[f64], sticks: &[f64], rows_px: u32) -> bool {
    let (Some(app), Some(poses)) = (app(), Poses::read(head, eyes, rows_px)) else { return false };
    let mut this = app.borrow_mut();
    this.look(&app, poses, sticks);
    this.screen.is_some()
}

/// See [`crate::show_eye`].
pub fn show_eye(index: usize) -> bool {
    let Some(app) = app() else { return false };
    let mut this = app.borrow_mut();
    this.show_eye(index).unwrap_or_else(|why| {
        this.lose(&app, &why);
        false
    })
}

/// See [`crate::take_off`].
pub fn take_off() {
    if let Some(app) = app().filter(|app| app.borrow().worn.is_some()) {
        app.borrow_mut().wear(&app, None);
    }
}

/// See [`crate::photo`].
pub async fn photo(size_px: (u32, u32)) -> Result<Photo, String> {
    let app = app().ok_or(EARLY)?;
    let (view, held) = {
        let this = app.borrow();
        let (Some(screen), Some(pose)) = (&this.screen, this.drawn.pose.filter(|_| this.drawn.picture)) else {
            return Err(EARLY.to_owned());
        };
        let view = photo::View {
            gpu: screen.gpu.clone(),
            options: this.picture(),
            draws: screen.picture.draws(),
            moment: this.viewer.moment_at(now_s()),
            world_from_eye: pose,
            fov_y_rad: this.fov_y_rad,
            near_m: near_m(&this.viewer),
            begins_far: screen.renderer == Renderer::WebGl2,
        };
        (view, this.viewer.held().clone())
    };
    photo::take(view, held, size_px).await
}

/// What is held of what lights see.
fn light_images(held: &Held) -> serde_json::Value {
    let of_lights = || held.patches.iter().filter(|(_, held)| matches!(held.patch.purpose, Purpose::Light(_)));
    serde_json::json!({
        "patches": of_lights().count(),
        "samples": of_lights().map(|(_, held)| held.patch.image.sample_count()).sum::<usize>(),
        "newest": of_lights().map(|(id, _)| id.0).max(),
    })
}

/// See [`crate::lose_device`].
pub fn lose_device() {
    if let Some(app) = app() {
        app.borrow_mut().loss_asked = true;
    }
}
