//! A gamepad's sticks and triggers, as the W3C's standard mapping names them: the left stick goes, the right one looks, triggers go down and up.

use glam::{DVec2, DVec3};
use js_sys::Array;
use wasm_bindgen::JsCast;
use web_sys::{Gamepad, GamepadButton, GamepadMappingType};

/// Sticks at rest are off their middle by as much.
const AT_REST: f64 = 0.12;
/// Of the standard mapping.
const LEFT_TRIGGER: u32 = 6;
const RIGHT_TRIGGER: u32 = 7;

/// What the first gamepad says: right, up and forward; right and down. `None` where there is none.
pub fn sticks() -> Option<(DVec3, DVec2)> {
    // Pages by plain http from another machine have none.
    let pads: Array = web_sys::window()?.navigator().get_gamepads().ok()?;
    let mut pads = pads.iter().filter_map(|pad| pad.dyn_into::<Gamepad>().ok());
    let pad = pads.find(|pad| pad.connected() && pad.mapping() == GamepadMappingType::Standard)?;
    let (axes, buttons) = (pad.axes(), pad.buttons());
    let axis = |index: u32| beyond_rest(axes.get(index).as_f64().unwrap_or(0.0));
    let trigger = |index: u32| buttons.get(index).dyn_into::<GamepadButton>().map_or(0.0, |button| button.value());
    let up = beyond_rest(trigger(RIGHT_TRIGGER) - trigger(LEFT_TRIGGER));
    Some((DVec3::new(axis(0), up, -axis(1)), DVec2::new(axis(2), axis(3))))
}

/// From the edge of what counts as rest, where it is 0, to 1.
fn beyond_rest(value: f64) -> f64 {
    let beyond = ((value.abs() - AT_REST) / (1.0 - AT_REST)).clamp(0.0, 1.0);
    beyond.copysign(value)
}
