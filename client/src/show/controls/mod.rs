//! Where the eye goes: orbiting and walking by mouse, keyboard and touch.
//!
//! Windows and pages translate their own events to [`Input`]; [`Controls`] turns them into `world_from_eye`. Drags move by what
//! the pointer moved, keys by time, and both give the same path at every frame rate: the velocity that keys ask for is
//! approached exponentially, and that motion is integrated in closed form.
//!
//! | | orbit (an object) | walk (a room, a city) |
//! |---|---|---|
//! | drag, one finger | turn the object | look around |
//! | right or middle drag, two fingers | move the pivot | move sideways and forward |
//! | three fingers | move the pivot | move sideways and up |
//! | left stick | turn the object, nearer and farther | move |
//! | right stick | turn the object | look around |
//! | wheel, pinch | nearer and farther | forward and back |
//! | W S / up, down | nearer and farther | forward and back |
//! | A D / left, right | turn the object | sideways |
//! | Q E | down and up around the object | down and up |
//! | shift | four times as fast | four times as fast |
//!
//! It also goes by itself: where somebody leads it, or to a view that was asked for (`flight`).

mod flight;
mod glide;
mod going;
mod touch;
mod walls;

use camera::{Motion, Rigid};
use glam::{DVec2, DVec3};

use flight::Flight;
pub use flight::Side;
use glide::Glide;
pub use touch::Drag;
use touch::Pointers;
use walls::{Walls, body_m};

use crate::draw::feel::Wall;

/// Time constant with which the velocity of keys is approached, in seconds: short enough to feel direct, long enough not to jerk.
const SMOOTHING_S: f64 = 0.08;
/// The longest step that one frame makes, in seconds: after a stall the eye does not leap.
const LONGEST_STEP_S: f64 = 0.25;
/// The same of an eye that is led: its leader's poses come ten times a second.
const LED_SMOOTHING_S: f64 = 0.15;
/// So near to where it is led, in radians and as a share of the distance to what it looks at, an eye is there: a pixel is a thousand times as much.
const THERE: f64 = 1e-6;
/// Looking straight up or down stays this far off the vertical, where the direction of "right" is lost.
const LARGEST_PITCH_RAD: f64 = 1.55;
/// A brisk walk, in m/s.
const WALKING_SPEED_M_S: f64 = 1.6;
/// What shift multiplies every speed by.
const FAST: f64 = 4.0;
/// What a press of a key makes of the speed: three double it.
pub const FASTER: f64 = 1.259_921;
/// Shares of the speed that fits a scene that a person may set.
const SPEED_SHARES: [f64; 2] = [1.0 / 64.0, 64.0];
/// Turning by keys, in rad/s: once around in six seconds.
const TURNING_SPEED_RAD_S: f64 = std::f64::consts::TAU / 6.0;
/// What one notch of a wheel multiplies the distance from the pivot by.
const ZOOM_PER_NOTCH: f64 = 0.9;
/// Seconds of walking that one notch of a wheel is worth.
const WALK_PER_NOTCH_S: f64 = 0.35;
/// Zooming by keys, as the change of the logarithm of the distance a second.
const ZOOM_SPEED_PER_S: f64 = 1.0;

/// How the eye moves.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mode {
    /// Around a pivot.
    Orbit,
    /// On one's own feet.
    Walk,
}

/// A key that moves the eye. The physical key, whatever the layout prints on it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Key {
    /// W, arrow up.
    Forward,
    /// S, arrow down.
    Back,
    /// A, arrow left.
    Left,
    /// D, arrow right.
    Right,
    /// E, page up.
    Up,
    /// Q, page down.
    Down,
    /// Either shift.
    Fast,
}

impl Key {
    /// The key of a W3C `KeyboardEvent.code`, as browsers name it and as the native window can.
    pub fn from_code(code: &str) -> Option<Key> {
        Some(match code {
            "KeyW" | "ArrowUp" => Key::Forward,
            "KeyS" | "ArrowDown" => Key::Back,
            "KeyA" | "ArrowLeft" => Key::Left,
            "KeyD" | "ArrowRight" => Key::Right,
            "KeyE" | "PageUp" => Key::Up,
            "KeyQ" | "PageDown" => Key::Down,
            "ShiftLeft" | "ShiftRight" => Key::Fast,
            _ => return None,
        })
    }
}

/// An event, the same from a window and from a page. Pixels are of the picture's own size on screen, y down.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Input {
    /// A button or a finger goes down.
    PointerDown {
        /// Tells fingers apart; any constant for a mouse.
        id: u64,
        /// What it does.
        drag: Drag,
        /// Where.
        at_px: DVec2,
    },
    /// It moves; ignored where it is not down.
    PointerMove {
        /// As in `PointerDown`.
        id: u64,
        /// Where to.
        at_px: DVec2,
    },
    /// It goes up, or is cancelled.
    PointerUp {
        /// As in `PointerDown`.
        id: u64,
    },
    /// The wheel turns; a notch away from the hand is 1.
    Wheel {
        /// Notches, and fractions of them.
        notches: f64,
    },
    /// A key goes down or up.
    Key {
        /// Which.
        key: Key,
        /// Down or up.
        down: bool,
    },
    /// What the sticks and triggers of a gamepad say from now on, each from -1 to 1; 0 at rest.
    Sticks {
        /// Right, up and forward.
        go: DVec3,
        /// Right and down.
        look: DVec2,
    },
    /// The window lost the keyboard: nothing is held any more.
    FocusLost,
}

/// The state behind the eye's pose.
#[derive(Debug, Clone)]
pub struct Controls {
    mode: Mode,
    /// Of the eye when walking, of the pivot when orbiting.
    anchor_world: DVec3,
    /// From the pivot; kept while walking so that one can switch.
    distance_m: f64,
    yaw_rad: f64,
    pitch_rad: f64,
    speed_m_s: f64,
    /// What the person makes of it.
    speed_share: f64,
    nearest_m: f64,
    farthest_m: f64,
    keys: [bool; 7],
    /// Of keys: right, up, forward in speeds' units.
    velocity: DVec3,
    pointers: Pointers,
    /// As [`Input::Sticks`] has it.
    sticks: (DVec3, DVec2),
    glide: Glide,
    /// Whether what is dragged glides on.
    glides: bool,
    led: Led,
    flight: Option<Flight>,
    walls: Walls,
    /// Corners of the scene's bounds.
    bounds_world: [DVec3; 2],
    size_px: DVec2,
    fov_y_rad: f64,
}

/// Whether somebody else moves the eye.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Led {
    /// Nobody does.
    No,
    /// Somebody is to, and was not heard of yet.
    Waits,
    /// To this pose.
    To(Rigid),
    /// It is at this pose.
    At(Rigid),
}

impl Controls {
    /// Begins at `start`, turning or walking, in a scene with the given corners of its bounds.
    pub fn new(start_world_from_eye: Rigid, walk: bool, bounds_min: DVec3, bounds_max: DVec3) -> Controls {
        let diagonal_m = (bounds_max - bounds_min).length();
        let diagonal_m = if diagonal_m.is_finite() && diagonal_m > 0.0 { diagonal_m } else { 10.0 };
        let eye = start_world_from_eye.translation;
        let forward = start_world_from_eye.transform_vector(DVec3::Z);
        let ahead_m = ((bounds_min + bounds_max) / 2.0 - eye).dot(forward);
        // Chosen: who looks past the middle, or has it nearer before him than a twentieth, turns around what lies half a diagonal ahead.
        let distance_m = if ahead_m > diagonal_m * 0.05 { ahead_m } else { diagonal_m * 0.5 };
        Controls {
            mode: if walk { Mode::Walk } else { Mode::Orbit },
            anchor_world: if walk { eye } else { eye + forward * distance_m },
            distance_m,
            yaw_rad: (-forward.x).atan2(-forward.z),
            pitch_rad: forward.y.clamp(-1.0, 1.0).asin().clamp(-LARGEST_PITCH_RAD, LARGEST_PITCH_RAD),
            speed_m_s: WALKING_SPEED_M_S.clamp(diagonal_m / 60.0, diagonal_m / 4.0),
            speed_share: 1.0,
            // Nothing is cut there: what is drawn begins at half of that at most (`near_m` of `server/src/start.rs`).
            nearest_m: diagonal_m * 1e-3,
            farthest_m: diagonal_m * 20.0,
            keys: [false; 7],
            velocity: DVec3::ZERO,
            pointers: Pointers::default(),
            sticks: (DVec3::ZERO, DVec2::ZERO),
            glide: Glide::default(),
            glides: true,
            led: Led::No,
            flight: None,
            walls: Walls::default(),
            bounds_world: [bounds_min, bounds_max],
            size_px: DVec2::new(1280.0, 720.0),
            fov_y_rad: 60_f64.to_radians(),
        }
    }

    /// The picture's size on screen, in the pixels that [`Input`] uses, and its vertical field of view.
    pub fn set_view(&mut self, size_px: DVec2, fov_y_rad: f64) {
        self.size_px = size_px.max(DVec2::ONE);
        self.fov_y_rad = fov_y_rad;
    }

    /// Whether what is dragged glides on when it is let go; who wants less motion wants none of that.
    pub fn set_glides(&mut self, glides: bool) {
        self.glides = glides;
    }

    /// Whether walls stop who walks, by keys or sticks.
    pub fn set_walls(&mut self, are_on: bool) {
        self.walls = Walls { are_on, wall: None };
    }

    /// Whether they do.
    pub fn has_walls(&self) -> bool {
        self.walls.are_on
    }

    /// Where a wall may be: from the eye along a unit vector, for a body of a radius in metres; `None` where none would stop anybody.
    pub fn feels(&self) -> Option<((DVec3, DVec3), f64)> {
        let is_walking = self.mode == Mode::Walk && self.walls.are_on;
        let asked = self.asked_velocity();
        let velocity = if asked == DVec3::ZERO { self.velocity } else { asked };
        let way = self.walking_way(velocity).with_y(0.0).try_normalize().filter(|_| is_walking)?;
        Some(((self.anchor_world, way), body_m(self.speed_m_s)))
    }

    /// What was met there, or nothing.
    pub fn meet(&mut self, wall: Option<Wall>) {
        self.walls.wall = wall;
    }

    /// How the eye moves now.
    pub fn mode(&self) -> Mode {
        self.mode
    }

    /// Switches between turning and walking; the eye stays where it is.
    pub fn set_mode(&mut self, mode: Mode) {
        if mode == self.mode {
            return;
        }
        let eye = self.pose().translation;
        self.anchor_world = if mode == Mode::Walk { eye } else { eye + self.forward() * self.distance_m };
        self.mode = mode;
        self.velocity = DVec3::ZERO;
    }

    /// How far before the eye that is which it turns about.
    pub fn distance_m(&self) -> f64 {
        self.distance_m
    }

    /// Turns about what is so far before the eye, which stays where it is.
    pub fn turn_about(&mut self, distance_m: f64) {
        let eye = self.pose().translation;
        self.distance_m = distance_m.clamp(self.nearest_m, self.farthest_m);
        if self.mode == Mode::Orbit {
            self.anchor_world = eye + self.forward() * self.distance_m;
        }
    }

    /// The eye now.
    pub fn pose(&self) -> Rigid {
        let forward = self.forward();
        let eye = match self.mode {
            Mode::Walk => self.anchor_world,
            Mode::Orbit => self.anchor_world - forward * self.distance_m,
        };
        Rigid::look_along(eye, forward)
    }

    /// Walks and flies so many times as fast from now on as before.
    pub fn change_speed(&mut self, factor: f64) {
        self.speed_share = (self.speed_share * factor).clamp(SPEED_SHARES[0], SPEED_SHARES[1]);
    }

    /// The eye is here now, wherever it was going.
    pub fn put(&mut self, world_from_eye: Rigid) {
        self.let_go();
        self.velocity = DVec3::ZERO;
        self.approach(world_from_eye, 1.0);
    }

    /// The eye is carried there, as by a head: keys, sticks and whoever leads it go on from there.
    pub fn carry_to(&mut self, world_from_eye: Rigid) {
        self.approach(world_from_eye, 1.0);
    }

    /// Nobody but the person moves the eye any more.
    fn let_go(&mut self) {
        self.glide.stop();
        self.led = Led::No;
        self.flight = None;
    }

    /// Lets the eye be led from now on, until the person moves it.
    pub fn be_led(&mut self) {
        self.led = Led::Waits;
    }

    /// Whether the eye goes where it is led.
    pub fn is_led(&self) -> bool {
        self.led != Led::No
    }

    /// Where the leader's eye is now; the first time the eye leaps there, and from then on it goes.
    pub fn lead_to(&mut self, world_from_eye: Rigid) {
        if self.led == Led::Waits {
            self.approach(world_from_eye, 1.0);
        }
        if self.is_led() && self.led != Led::At(world_from_eye) {
            self.led = Led::To(world_from_eye);
        }
    }

    /// Goes a share of the way to another pose. Roll is left out.
    fn approach(&mut self, world_from_eye: Rigid, share: f64) {
        let there = Controls::new(world_from_eye, true, DVec3::ZERO, DVec3::ZERO);
        let eye = self.pose().translation.lerp(there.anchor_world, share);
        let half_turn = std::f64::consts::PI;
        let yaw_rad = (there.yaw_rad - self.yaw_rad + half_turn).rem_euclid(2.0 * half_turn) - half_turn;
        self.turn(yaw_rad * share, (there.pitch_rad - self.pitch_rad) * share);
        self.anchor_world = if self.mode == Mode::Walk { eye } else { eye + self.forward() * self.distance_m };
    }

    fn is_near(&self, world_from_eye: Rigid) -> bool {
        let (here, to) = (self.pose(), world_from_eye);
        let turned = self.forward().distance(to.transform_vector(DVec3::Z));
        turned < THERE && here.translation.distance(to.translation) < THERE * self.distance_m
    }

    /// Takes an event.
    pub fn handle(&mut self, input: Input) {
        let steers = match input {
            Input::PointerDown { .. } | Input::Wheel { .. } | Input::Key { down: true, .. } => true,
            Input::Sticks { go, look } => go != DVec3::ZERO || look != DVec2::ZERO,
            _ => false,
        };
        if steers {
            self.let_go();
        }
        match input {
            Input::PointerDown { id, drag, at_px } => self.pointers.down(id, drag, at_px),
            Input::PointerMove { id, at_px } => {
                let gesture = self.pointers.moved(id, at_px);
                if gesture.look_px != DVec2::ZERO {
                    self.look(gesture.look_px);
                    self.glide.drag(gesture.look_px);
                }
                self.pan(gesture.pan_px);
                self.lift(gesture.lift_px);
                self.pinch(gesture.pinch);
            }
            Input::PointerUp { id } => {
                self.pointers.up(id);
                if !self.pointers.is_any_down() {
                    self.glide.let_go();
                }
            }
            Input::Wheel { notches } if notches.is_finite() => match self.mode {
                Mode::Orbit => self.zoom(ZOOM_PER_NOTCH.powf(notches)),
                Mode::Walk => self.anchor_world += self.forward() * (self.speed_m_s * WALK_PER_NOTCH_S * notches),
            },
            Input::Wheel { .. } => {}
            Input::Key { key, down } => self.keys[key as usize] = down,
            Input::Sticks { go, look } if go.is_finite() && look.is_finite() => self.sticks = (go, look),
            Input::Sticks { .. } => {}
            Input::FocusLost => {
                self.keys = [false; 7];
                self.sticks = (DVec3::ZERO, DVec2::ZERO);
                self.glide.stop();
                self.pointers = Pointers::default();
            }
        }
    }

    /// Lets `dt_s` seconds of keys pass. Returns whether the eye still moves by itself.
    pub fn advance(&mut self, dt_s: f64) -> bool {
        let dt_s = if dt_s.is_finite() { dt_s.clamp(0.0, LONGEST_STEP_S) } else { 0.0 };
        let asked = self.asked_velocity();
        // v(t) = asked + (v0 - asked) e^(-t/T), integrated over the step.
        let decay = (-dt_s / SMOOTHING_S).exp();
        let travel = asked * dt_s + (self.velocity - asked) * (SMOOTHING_S * (1.0 - decay));
        self.velocity = asked + (self.velocity - asked) * decay;
        // Of full speed. What is left of the way is `SMOOTHING_S` times that: 0.13 mm of a walk, or 0.005 degrees of a turn, where a pixel of 720 rows spans 0.08.
        if asked == DVec3::ZERO && self.velocity.length() < 1e-3 * self.speed_share {
            self.velocity = DVec3::ZERO;
        }
        self.travel(travel);
        self.look_by_stick(dt_s);
        let glide_px = self.glide.advance(dt_s);
        if self.glides {
            self.look(glide_px);
        } else if self.glide.goes_on() {
            self.glide.stop();
        }
        if let Led::To(there) = self.led {
            let share = 1.0 - (-dt_s / LED_SMOOTHING_S).exp();
            if self.is_near(there) {
                self.approach(there, 1.0);
                self.led = Led::At(there);
            } else {
                self.approach(there, share);
            }
        }
        let flies = self.advance_flight(dt_s);
        let moves = self.velocity != DVec3::ZERO || asked != DVec3::ZERO || self.sticks.1 != DVec2::ZERO;
        moves || flies || self.glide.goes_on()
    }

    /// How the eye moves on, where keys alone say so; what a pointer does next nobody knows.
    pub fn motion(&self) -> Option<Motion> {
        let asked = self.asked_velocity();
        let rate = if asked == DVec3::ZERO { self.velocity } else { asked };
        if rate == DVec3::ZERO || self.pointers.is_any_down() || self.flight.is_some() {
            return None;
        }
        let motion = match self.mode {
            Mode::Walk => {
                // In so short a time as nobody walks past a wall's end.
                let way_m = self.walking_way(rate) * (self.speed_m_s * SMOOTHING_S);
                let stopped_m = self.walls.stop(self.anchor_world, way_m, body_m(self.speed_m_s));
                Motion::along(stopped_m / SMOOTHING_S)
            }
            Mode::Orbit => {
                let turn = (DVec3::Y * rate.x - self.right() * rate.y) * TURNING_SPEED_RAD_S;
                let round = Motion::about(self.anchor_world, self.pose().translation, turn);
                let nearer = self.forward() * (rate.z * ZOOM_SPEED_PER_S * self.distance_m);
                Motion { velocity_world: round.velocity_world + nearer.as_vec3(), ..round }
            }
        };
        // Keys that are held are approached by the same law as speeds fade once they are let go.
        Some(Motion { fades_in_s: (asked == DVec3::ZERO).then_some(SMOOTHING_S as f32), ..motion })
    }

    /// Right, up and forward that the held keys ask for, 1 at full speed.
    fn asked_velocity(&self) -> DVec3 {
        let held = |key: Key| f64::from(u8::from(self.keys[key as usize]));
        let axes = DVec3::new(
            held(Key::Right) - held(Key::Left),
            held(Key::Up) - held(Key::Down),
            held(Key::Forward) - held(Key::Back),
        );
        let fast = if self.keys[Key::Fast as usize] { FAST } else { 1.0 };
        (axes + self.sticks.0).clamp_length_max(1.0) * fast * self.speed_share
    }

    fn travel(&mut self, travel: DVec3) {
        match self.mode {
            Mode::Walk => self.walk(self.walking_way(travel) * self.speed_m_s),
            Mode::Orbit => {
                self.turn(travel.x * TURNING_SPEED_RAD_S, -travel.y * TURNING_SPEED_RAD_S);
                self.zoom((-travel.z * ZOOM_SPEED_PER_S).exp());
            }
        }
    }

    /// Right, up and forward along the ground, in world space.
    fn walking_way(&self, travel: DVec3) -> DVec3 {
        let (right, ahead) = self.ground_axes();
        right * travel.x + DVec3::Y * travel.y + ahead * travel.z
    }

    /// Goes a way, as far as walls let it.
    fn walk(&mut self, way_m: DVec3) {
        self.anchor_world += self.walls.stop(self.anchor_world, way_m, body_m(self.speed_m_s));
    }

    /// A drag turns what is grabbed with the pointer: walking, a point of the picture stays under it.
    fn look(&mut self, moved_px: DVec2) {
        match self.mode {
            Mode::Walk => {
                let rad_per_px = self.fov_y_rad / self.size_px.y;
                self.turn(moved_px.x * rad_per_px, moved_px.y * rad_per_px);
            }
            Mode::Orbit => {
                let rad_per_px = std::f64::consts::PI / self.size_px.y;
                self.turn(-moved_px.x * rad_per_px, -moved_px.y * rad_per_px);
            }
        }
    }

    /// A stick that is held turns as the keys do, whichever way the eye moves.
    fn look_by_stick(&mut self, dt_s: f64) {
        let turn = self.sticks.1 * (TURNING_SPEED_RAD_S * dt_s);
        match self.mode {
            Mode::Walk => self.turn(-turn.x, -turn.y),
            Mode::Orbit => self.turn(turn.x, -turn.y),
        }
    }

    /// Three fingers: sideways and up, in the plane of the picture.
    fn lift(&mut self, moved_px: DVec2) {
        if self.mode == Mode::Orbit {
            return self.pan(moved_px);
        }
        let m_per_px = 2.0 * self.speed_m_s / self.pixels_per_rad();
        self.anchor_world += (DVec3::Y * moved_px.y - self.right() * moved_px.x) * m_per_px;
    }

    fn pixels_per_rad(&self) -> f64 {
        self.size_px.y / 2.0 / (self.fov_y_rad / 2.0).tan()
    }

    fn pan(&mut self, moved_px: DVec2) {
        let pixels_per_rad = self.pixels_per_rad();
        match self.mode {
            Mode::Orbit => {
                let m_per_px = self.distance_m / pixels_per_rad;
                let (right, up) = (self.right(), self.right().cross(self.forward()));
                self.anchor_world += (up * moved_px.y - right * moved_px.x) * m_per_px;
            }
            Mode::Walk => {
                // As if the ground two seconds' walk ahead were grabbed.
                let m_per_px = 2.0 * self.speed_m_s / pixels_per_rad;
                let (right, ahead) = self.ground_axes();
                self.anchor_world += (ahead * moved_px.y - right * moved_px.x) * m_per_px;
            }
        }
    }

    fn pinch(&mut self, spread: f64) {
        match self.mode {
            Mode::Orbit => self.zoom(1.0 / spread),
            Mode::Walk => self.anchor_world += self.forward() * (2.0 * self.speed_m_s * spread.ln()),
        }
    }

    fn turn(&mut self, yaw_rad: f64, pitch_rad: f64) {
        self.yaw_rad = (self.yaw_rad + yaw_rad).rem_euclid(std::f64::consts::TAU);
        self.pitch_rad = (self.pitch_rad + pitch_rad).clamp(-LARGEST_PITCH_RAD, LARGEST_PITCH_RAD);
    }

    fn zoom(&mut self, factor: f64) {
        self.distance_m = (self.distance_m * factor).clamp(self.nearest_m, self.farthest_m);
    }

    fn forward(&self) -> DVec3 {
        let (sin_yaw, cos_yaw) = self.yaw_rad.sin_cos();
        let (sin_pitch, cos_pitch) = self.pitch_rad.sin_cos();
        DVec3::new(-sin_yaw * cos_pitch, sin_pitch, -cos_yaw * cos_pitch)
    }

    fn right(&self) -> DVec3 {
        let (sin_yaw, cos_yaw) = self.yaw_rad.sin_cos();
        DVec3::new(cos_yaw, 0.0, -sin_yaw)
    }

    /// Right and ahead along the ground.
    fn ground_axes(&self) -> (DVec3, DVec3) {
        let right = self.right();
        (right, DVec3::Y.cross(right))
    }
}

#[cfg(test)]
mod tests;
