//! When the page acts: with each picture that the browser shows, or every so often.

use std::cell::{Cell, RefCell};
use std::rc::Rc;

use wasm_bindgen::JsCast;
use wasm_bindgen::prelude::*;

type Callback = Closure<dyn FnMut()>;

/// Seconds since the page first asked.
pub fn now_s() -> f64 {
    thread_local!(static BEGIN: Cell<Option<web_time::Instant>> = const { Cell::new(None) });
    let now = web_time::Instant::now();
    let begin = BEGIN.get().unwrap_or(now);
    BEGIN.set(Some(begin));
    (now - begin).as_secs_f64()
}

/// Acts with every picture that the browser shows, which is none while the page is hidden.
pub fn each_frame(mut act: impl FnMut() + 'static) -> Result<(), String> {
    let next: Rc<RefCell<Option<Callback>>> = Rc::default();
    let again = Rc::clone(&next);
    *next.borrow_mut() = Some(Closure::new(move || {
        act();
        // The window outlives its callbacks.
        let _ = request_frame(again.borrow().as_ref());
    }));
    let first = next.borrow();
    request_frame(first.as_ref())
}

fn request_frame(callback: Option<&Callback>) -> Result<(), String> {
    let (Some(window), Some(callback)) = (web_sys::window(), callback) else { return Ok(()) };
    let requested = window.request_animation_frame(callback.as_ref().unchecked_ref());
    requested.map(|_| ()).map_err(|_| "the browser shows no frames".to_owned())
}

/// Acts every so many milliseconds, while the page is hidden too.
pub fn each_interval(interval_ms: i32, act: impl FnMut() + 'static) -> Result<(), String> {
    let act = Closure::<dyn FnMut()>::new(act);
    let window = web_sys::window().ok_or("the viewer runs in a page")?;
    window
        .set_interval_with_callback_and_timeout_and_arguments_0(act.as_ref().unchecked_ref(), interval_ms)
        .map_err(|_| "the browser has no timer".to_owned())?;
    act.forget();
    Ok(())
}
