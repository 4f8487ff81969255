//! The browser client: page, websocket, input and panel around the client library.
//!
//! `web/static` holds the page; its `main.js` loads the WebAssembly and calls `start`. A frame runs in an animation-frame
//! callback; a slower timer keeps the session alive while the page is hidden. Updates are decoded, and their surfaces built, by a web
//! worker, an instance of the same WebAssembly that calls `decode` alone.

#![cfg(target_arch = "wasm32")]

mod app;
mod input;
mod page;
mod screen;
mod server;
mod socket;
mod worker;

use js_sys::{Array, Uint8Array};
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
    app::snapshot()
}

/// Loses the graphics device on purpose, as a driver's reset would: for tests.
#[wasm_bindgen]
pub fn lose_device() {
    app::lose_device();
}
