//! The browser client: page, websocket, input and panel around the client library.
//!
//! `web/static` holds the page; its `main.js` loads the WebAssembly and calls `start`. A frame runs in an animation-frame
//! callback; a slower timer keeps the session alive while the page is hidden. Updates are decoded, and their surfaces built, by a web
//! worker, an instance of the same WebAssembly that calls `decode` alone.

#![cfg(target_arch = "wasm32")]

mod app;
mod gamepad;
mod input;
mod moments;
mod page;
mod photo;
mod record;
mod screen;
mod server;
mod share;
mod socket;
mod wishes;
mod worker;

use app::exports;
use js_sys::{Array, Uint8Array};
use wasm_bindgen::Clamped;
use wasm_bindgen::prelude::*;

/// Starts the viewer on the page's elements. Fails with words for a person.
#[wasm_bindgen]
pub async fn start() -> Result<(), JsValue> {
    page::report_panics();
    app::start().await.map_err(|error| js_sys::Error::new(&error.to_string()).into())
}

/// In the worker: the parts of the answer to the bytes of an update, each an `ArrayBuffer`.
#[wasm_bindgen]
pub fn decode(bytes: &[u8], build: u8) -> Array {
    console_error_panic_hook::set_once();
    let parts = Array::new();
    client::receive::viewer::answer_in_parts(bytes, build, &protocol::Limits::default(), |part| {
        parts.push(&Uint8Array::from(&*part).buffer());
    });
    parts
}

/// What the viewer is doing, as JSON; see `main.js` for the fields.
#[wasm_bindgen]
pub fn snapshot() -> String {
    exports::snapshot()
}

/// The address of the view as it is now; `None` before there is one.
#[wasm_bindgen]
pub fn link() -> Option<String> {
    exports::link()
}

/// The token that the page was opened with, for requests beside the websocket.
#[wasm_bindgen]
pub fn token() -> Option<String> {
    exports::token()
}

/// Writes the eye's path down from now on, or ends that: gives what was written so far, as lines `px py pz rx ry rz t_ms` (metres, degrees, milliseconds).
#[wasm_bindgen]
pub fn record(is_on: bool) -> Option<String> {
    exports::record(is_on)
}

/// Goes a path that was written so, until the person moves; its length in seconds. Fails with words for a person.
#[wasm_bindgen]
pub fn replay(text: &str) -> Result<f64, JsValue> {
    exports::replay(text).map_err(|error| js_sys::Error::new(&error).into())
}

/// Goes to where a point is seen from another, each of three numbers, in metres; with another vertical field of view in degrees, where one is given. Fails with words for a person.
#[wasm_bindgen]
pub fn go(eye: &[f64], target: &[f64], fov_deg: Option<f64>) -> Result<(), JsValue> {
    exports::go(eye, target, fov_deg).map_err(|error| js_sys::Error::new(&error).into())
}

/// Draws as finely as is asked for from now on: `auto`, `fast` or `fine`. Fails with words for a person.
#[wasm_bindgen]
pub fn set_quality(name: &str) -> Result<(), JsValue> {
    exports::set_quality(name).map_err(|error| js_sys::Error::new(&error).into())
}

/// Shows where nothing is held, in magenta, from now on, or no longer.
#[wasm_bindgen]
pub fn mark_holes(are_marked: bool) {
    exports::mark_holes(are_marked);
}

/// Shows `picture`, what samples saw, from now on, or by false colours what they are: their `age` or `density`. Fails with words for a person.
#[wasm_bindgen]
pub fn set_tint(name: &str) -> Result<(), JsValue> {
    exports::set_tint(name).map_err(|error| js_sys::Error::new(&error).into())
}

/// How the scene is put before the viewer, as JSON: see `staging.js` for the fields.
#[wasm_bindgen]
pub fn staged() -> String {
    exports::staged()
}

/// Scene time goes on so many times as fast from now on; 0 stops it. Fails with words for a person.
#[wasm_bindgen]
pub fn play(rate: f64) -> Result<(), JsValue> {
    exports::play(rate).map_err(|error| js_sys::Error::new(&error).into())
}

/// Scene time is this one now, in seconds. Fails with words for a person.
#[wasm_bindgen]
pub fn seek(time_s: f64) -> Result<(), JsValue> {
    exports::seek(time_s).map_err(|error| js_sys::Error::new(&error).into())
}

/// Shows `all` of the scene's objects from now on, all `but` some, or `only` those, by their numbers. Fails with words for a person.
#[wasm_bindgen]
pub fn show_parts(which: &str, objects: Vec<u16>) -> Result<(), JsValue> {
    exports::show_parts(which, objects).map_err(|error| js_sys::Error::new(&error).into())
}

/// Cuts the scene open by a plane: what lies farther along its normal than so many metres from the origin is not shown. No longer, where the normal is empty. Fails with words for a
/// person.
#[wasm_bindgen]
pub fn cut(normal: &[f64], offset_m: f64) -> Result<(), JsValue> {
    exports::cut(normal, offset_m).map_err(|error| js_sys::Error::new(&error).into())
}

/// From now on a headset is worn: it says when frames are drawn, and from where. Fails with words for a person.
#[wasm_bindgen]
pub fn put_on() -> Result<(), JsValue> {
    exports::put_on().map_err(|error| js_sys::Error::new(&error).into())
}

/// The next frame of a headset: where the head and its eyes are, and what its sticks say; see `headset.js`. How many rows an eye's picture has. Whether there is anything to
/// draw.
#[wasm_bindgen]
pub fn look(head: &[f64], eyes: &[f64], sticks: &[f64], rows_px: u32) -> bool {
    exports::look(head, eyes, sticks, rows_px)
}

/// Draws what an eye of it sees, as the whole of the canvas `view`; whether it is there.
#[wasm_bindgen]
pub fn show_eye(index: usize) -> bool {
    exports::show_eye(index)
}

/// It is taken off: the page is looked at again.
#[wasm_bindgen]
pub fn take_off() {
    exports::take_off();
}

/// A picture of the view as it is now, of any size up to 8K. Fails with words for a person.
#[wasm_bindgen]
pub async fn photo(width_px: u32, height_px: u32) -> Result<web_sys::ImageData, JsValue> {
    let words = |error: String| JsValue::from(js_sys::Error::new(&error));
    let photo = exports::photo((width_px, height_px)).await.map_err(words)?;
    let (width_px, height_px) = photo.size_px;
    web_sys::ImageData::new_with_u8_clamped_array_and_sh(Clamped(&photo.rgba), width_px, height_px)
}

/// Loses the graphics device on purpose, as a driver's reset would: for tests.
#[wasm_bindgen]
pub fn lose_device() {
    exports::lose_device();
}
