//! A window's events as [`Input`].

use glam::DVec2;
use protocol::staging::Parts;
use winit::event::{ElementState, MouseButton, MouseScrollDelta, TouchPhase, WindowEvent};
use winit::keyboard::{KeyCode, PhysicalKey};

use super::running::{Running, Sought};
use crate::show::controls::{Drag, FASTER, Input, Key, Mode, Side};

/// The mouse among the pointers; fingers have their own numbers.
const MOUSE: u64 = u64::MAX;
/// Pixels that a touchpad scrolls for one notch of a wheel.
const PIXELS_PER_NOTCH: f64 = 100.0;

/// Takes an event that the panel did not want.
pub(super) fn handle(running: &mut Running<'_>, event: &WindowEvent) {
    if let WindowEvent::CursorMoved { position, .. } = event {
        running.cursor_px = DVec2::new(position.x, position.y);
    }
    if let WindowEvent::KeyboardInput { event, .. } = event
        && event.state == ElementState::Pressed
        && !event.repeat
    {
        press(running, event.physical_key);
    }
    let Some(input) = input(event, running.cursor_px) else { return };
    if let Some(controls) = &mut running.controls {
        controls.handle(input);
        running.screen.window.request_redraw();
    }
}

/// Keys that do something once.
fn press(running: &mut Running<'_>, key: PhysicalKey) {
    match key {
        PhysicalKey::Code(KeyCode::KeyP) => running.overlay.toggle(),
        PhysicalKey::Code(KeyCode::KeyR) => running.begin(),
        PhysicalKey::Code(KeyCode::KeyF) => running.follow(),
        PhysicalKey::Code(KeyCode::KeyK | KeyCode::Space) => running.play_or_pause(),
        PhysicalKey::Code(KeyCode::KeyX) => running.seeks = Some((running.cursor_px, Sought::Hide)),
        PhysicalKey::Code(KeyCode::KeyU) => running.viewer.show_parts(Parts::All, running.pump.now_s()),
        PhysicalKey::Code(KeyCode::Enter) => running.seeks = Some((running.cursor_px, Sought::Visit)),
        PhysicalKey::Code(code) => {
            let Some(controls) = &mut running.controls else { return };
            match code {
                KeyCode::KeyM => {
                    controls.set_mode(if controls.mode() == Mode::Walk { Mode::Orbit } else { Mode::Walk });
                }
                KeyCode::KeyC => controls.set_walls(!controls.has_walls()),
                KeyCode::Home => controls.go_to(Side::Same),
                KeyCode::Digit1 => controls.go_to(Side::Front),
                KeyCode::Digit2 => controls.go_to(Side::Right),
                KeyCode::Digit3 => controls.go_to(Side::Top),
                KeyCode::Equal | KeyCode::NumpadAdd => controls.change_speed(FASTER),
                KeyCode::Minus | KeyCode::NumpadSubtract => controls.change_speed(1.0 / FASTER),
                _ => return,
            }
        }
        PhysicalKey::Unidentified(_) => return,
    }
    running.screen.window.request_redraw();
}

fn input(event: &WindowEvent, cursor_px: DVec2) -> Option<Input> {
    Some(match event {
        WindowEvent::CursorMoved { position, .. } => {
            Input::PointerMove { id: MOUSE, at_px: DVec2::new(position.x, position.y) }
        }
        WindowEvent::MouseInput { state: ElementState::Pressed, button, .. } => {
            let drag = if *button == MouseButton::Left { Drag::Look } else { Drag::Pan };
            Input::PointerDown { id: MOUSE, drag, at_px: cursor_px }
        }
        WindowEvent::MouseInput { state: ElementState::Released, .. } => Input::PointerUp { id: MOUSE },
        WindowEvent::MouseWheel { delta, .. } => Input::Wheel {
            notches: match delta {
                MouseScrollDelta::LineDelta(_, lines) => f64::from(*lines),
                MouseScrollDelta::PixelDelta(pixels) => pixels.y / PIXELS_PER_NOTCH,
            },
        },
        WindowEvent::Touch(touch) => {
            let at_px = DVec2::new(touch.location.x, touch.location.y);
            match touch.phase {
                TouchPhase::Started => Input::PointerDown { id: touch.id, drag: Drag::Look, at_px },
                TouchPhase::Moved => Input::PointerMove { id: touch.id, at_px },
                TouchPhase::Ended | TouchPhase::Cancelled => Input::PointerUp { id: touch.id },
            }
        }
        WindowEvent::KeyboardInput { event, .. } => {
            Input::Key { key: key(event.physical_key)?, down: event.state == ElementState::Pressed }
        }
        WindowEvent::Focused(false) => Input::FocusLost,
        _ => return None,
    })
}

fn key(key: PhysicalKey) -> Option<Key> {
    let PhysicalKey::Code(code) = key else { return None };
    Some(match code {
        KeyCode::KeyW | KeyCode::ArrowUp => Key::Forward,
        KeyCode::KeyS | KeyCode::ArrowDown => Key::Back,
        KeyCode::KeyA | KeyCode::ArrowLeft => Key::Left,
        KeyCode::KeyD | KeyCode::ArrowRight => Key::Right,
        KeyCode::KeyE | KeyCode::PageUp => Key::Up,
        KeyCode::KeyQ | KeyCode::PageDown => Key::Down,
        KeyCode::ShiftLeft | KeyCode::ShiftRight => Key::Fast,
        _ => return None,
    })
}
