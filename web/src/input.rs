//! The page's events as [`Input`] and [`Action`].

use std::cell::Cell;
use std::rc::Rc;

use client::show::controls::{Drag, FASTER, Input, Key, Side};
use glam::DVec2;
use wasm_bindgen::JsCast;
use wasm_bindgen::prelude::*;
use web_sys::{
    AddEventListenerOptions, Event, EventTarget, HtmlCanvasElement, KeyboardEvent, MouseEvent, PointerEvent, WheelEvent,
};

use crate::page::{self, Dialog};

/// What a wheel's pixels and lines are worth in notches.
const PIXELS_PER_NOTCH: f64 = 100.0;
const LINES_PER_NOTCH: f64 = 3.0;
/// A pointer that went farther from where it went down has dragged, and clicked on nothing. In CSS pixels.
const CLICK_PX: f64 = 4.0;
/// What a press of a key makes of the field of view, in degrees.
const FOV_STEP_DEG: f64 = 5.0;

/// What a person asks for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Action {
    /// The eye moves.
    Move(Input),
    /// Back to the start.
    Restart,
    /// Go with the presenter.
    Follow,
    /// Walk or turn.
    SwitchMode,
    /// To where all is seen.
    GoTo(Side),
    /// To what lies at a place of the page, in CSS pixels.
    Visit(DVec2),
    /// To what lies in the middle of the picture.
    VisitMiddle,
    /// Measures from now on, or no more.
    Measure,
    /// Chooses parts from now on, or no more.
    ChooseParts,
    /// The tool is used at a place of the page, in CSS pixels.
    Use(DVec2),
    /// The same in the middle of the picture.
    UseMiddle,
    /// A pointer that is not down is at a place of the page, in CSS pixels.
    Point(DVec2),
    /// It is over the picture no more.
    Leave,
    /// Walls stop who walks, or no longer.
    SwitchWalls,
    /// So many times as fast as before.
    ChangeSpeed(f64),
    /// So many degrees more of the scene from top to bottom.
    ChangeFov(f64),
    /// The page is shown again.
    Shown,
}

/// Where actions go.
type Sink = Rc<dyn Fn(Action)>;

/// Listens to the page. Once.
pub fn listen_to_page(sink: &Sink) -> Result<(), String> {
    let window = web_sys::window().ok_or("the viewer runs in a page")?;
    for (name, down) in [("keydown", true), ("keyup", false)] {
        let sink = Rc::clone(sink);
        listen(&window, name, move |event: KeyboardEvent| on_key(&event, down, &*sink));
    }
    let blur = Rc::clone(sink);
    listen(&window, "blur", move |_: Event| blur(Action::Move(Input::FocusLost)));
    let shown = Rc::clone(sink);
    listen(&page::document(), "visibilitychange", move |_: Event| shown(Action::Shown));
    let mode = Rc::clone(sink);
    listen(page::element("mode")?.as_ref(), "click", move |_: Event| mode(Action::SwitchMode));
    let follow = Rc::clone(sink);
    listen(page::element("role")?.as_ref(), "click", move |_: Event| follow(Action::Follow));
    for (button, action) in [("tape-toggle", Action::Measure), ("parts-toggle", Action::ChooseParts)] {
        let sink = Rc::clone(sink);
        listen(page::element(button)?.as_ref(), "click", move |_: Event| {
            // Keys use them, too.
            if let Ok(canvas) = page::canvas() {
                let _ = canvas.focus();
            }
            sink(action);
        });
    }
    for (button, dialog) in [("help-open", Dialog::Help), ("inventory-open", Dialog::Inventory)] {
        listen(page::element(button)?.as_ref(), "click", move |_: Event| page::toggle(dialog));
    }
    listen(page::element("panel-toggle")?.as_ref(), "click", |_: Event| page::toggle_figures());
    Ok(())
}

/// Listens to a canvas.
pub fn listen_to_canvas(canvas: &HtmlCanvasElement, sink: &Sink) {
    let down_px = Rc::new(Cell::new(DVec2::ZERO));
    let down = {
        let (sink, canvas, down_px) = (Rc::clone(sink), canvas.clone(), Rc::clone(&down_px));
        move |event: PointerEvent| {
            down_px.set(place(&event));
            // Without capture a drag only ends at the canvas's edge.
            let _ = canvas.set_pointer_capture(event.pointer_id());
            let _ = canvas.focus();
            let drag = if event.button() == 0 { Drag::Look } else { Drag::Pan };
            sink(Action::Move(Input::PointerDown { id: pointer(&event), drag, at_px: place(&event) }));
        }
    };
    listen(canvas, "pointerdown", down);
    let moved = Rc::clone(sink);
    listen(canvas, "pointermove", move |event: PointerEvent| {
        moved(Action::Move(Input::PointerMove { id: pointer(&event), at_px: place(&event) }));
        if event.buttons() == 0 {
            moved(Action::Point(place(&event)));
        }
    });
    for name in ["pointerup", "pointercancel"] {
        let sink = Rc::clone(sink);
        listen(canvas, name, move |event: PointerEvent| {
            sink(Action::Move(Input::PointerUp { id: pointer(&event) }));
        });
    }
    let left = Rc::clone(sink);
    listen(canvas, "pointerleave", move |_: Event| left(Action::Leave));
    let wheel = Rc::clone(sink);
    listen(canvas, "wheel", move |event: WheelEvent| {
        event.prevent_default();
        let per_notch = match event.delta_mode() {
            WheelEvent::DOM_DELTA_PIXEL => PIXELS_PER_NOTCH,
            WheelEvent::DOM_DELTA_LINE => LINES_PER_NOTCH,
            _ => 1.0,
        };
        wheel(Action::Move(Input::Wheel { notches: -event.delta_y() / per_notch }));
    });
    let visit = Rc::clone(sink);
    listen(canvas, "dblclick", move |event: MouseEvent| visit(Action::Visit(place(&event))));
    let mark = Rc::clone(sink);
    listen(canvas, "click", move |event: MouseEvent| {
        if place(&event).distance(down_px.get()) <= CLICK_PX {
            mark(Action::Use(place(&event)));
        }
    });
    listen(canvas, "contextmenu", |event: Event| event.prevent_default());
}

fn on_key(event: &KeyboardEvent, down: bool, sink: &dyn Fn(Action)) {
    // The browser's own shortcuts stay the browser's; a key that goes up is heard in any case.
    if down && (event.ctrl_key() || event.alt_key() || event.meta_key() || page::has_open_dialog()) {
        return;
    }
    let code = event.code();
    if let Some(key) = Key::from_code(&code) {
        if code.starts_with("Arrow") || code.starts_with("Page") {
            event.prevent_default();
        }
        return sink(Action::Move(Input::Key { key, down }));
    }
    if !down || event.repeat() {
        return;
    }
    match code.as_str() {
        "KeyR" => sink(Action::Restart),
        "KeyF" => sink(Action::Follow),
        "KeyM" => sink(Action::SwitchMode),
        "Home" => sink(Action::GoTo(Side::Same)),
        "Digit1" => sink(Action::GoTo(Side::Front)),
        "Digit2" => sink(Action::GoTo(Side::Right)),
        "Digit3" => sink(Action::GoTo(Side::Top)),
        "Enter" if page::looks_at_view() => sink(Action::VisitMiddle),
        "Space" if page::looks_at_view() && page::has_tool() => sink(Action::UseMiddle),
        "Space" if page::looks_at_view() => page::press("play"),
        "KeyT" => page::press("tape-toggle"),
        "KeyX" => page::press("parts-toggle"),
        "KeyK" => page::press("play"),
        "KeyC" => sink(Action::SwitchWalls),
        "Delete" => page::press("part-hide"),
        "BracketLeft" => sink(Action::ChangeFov(-FOV_STEP_DEG)),
        "BracketRight" => sink(Action::ChangeFov(FOV_STEP_DEG)),
        "Equal" | "NumpadAdd" => sink(Action::ChangeSpeed(FASTER)),
        "Minus" | "NumpadSubtract" => sink(Action::ChangeSpeed(1.0 / FASTER)),
        "KeyP" => page::toggle_figures(),
        "KeyH" => page::toggle(Dialog::Help),
        "KeyI" => page::toggle(Dialog::Inventory),
        "KeyO" => page::press("scenes-open"),
        "KeyL" => page::press("share-open"),
        _ => {}
    }
}

fn pointer(event: &PointerEvent) -> u64 {
    // Ids may be negative; only their being different counts.
    i64::from(event.pointer_id()) as u64
}

fn place(event: &MouseEvent) -> DVec2 {
    DVec2::new(f64::from(event.offset_x()), f64::from(event.offset_y()))
}

/// Listens as long as the page lives.
fn listen<E: JsCast + wasm_bindgen::convert::FromWasmAbi + 'static>(
    target: &EventTarget,
    name: &str,
    handler: impl FnMut(E) + 'static,
) {
    let handler = Closure::<dyn FnMut(E)>::new(handler);
    let options = AddEventListenerOptions::new();
    options.set_passive(false);
    // Fails only for handlers that are no functions.
    let _ = target.add_event_listener_with_callback_and_add_event_listener_options(
        name,
        handler.as_ref().unchecked_ref(),
        &options,
    );
    handler.forget();
}
