//! A headset's views: where its space lies in the world, how the person goes through the scene beyond the steps of his own feet, and a camera for each eye.
//!
//! WebXR's spaces have y up and look along -z, as glTF's do; the *room* is the one that the headset measures its poses in.

use camera::{Pinhole, Rigid};
use glam::{DQuat, DVec2, DVec3};
use protocol::message::ViewSize;

use crate::show::controls::{Controls, Input, Mode};

/// A stick that is pushed farther to a side than the first turns the person once, and once more when it was nearer to its middle than the second: turning smoothly
/// while the body stands makes people sick.
const SNAP: [f64; 2] = [0.7, 0.3];
/// By as much.
const SNAP_RAD: f64 = std::f64::consts::PI / 6.0;
/// Pixels of an eye's picture along a side, at most.
const LARGEST_PX: f64 = 4096.0;

/// What of the plane at distance 1 before an eye its picture shows: slopes, of which left and down are negative where the axis lies within.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frustum {
    /// Along x, to the right.
    pub left: f64,
    /// The same.
    pub right: f64,
    /// Along y, up.
    pub down: f64,
    /// The same.
    pub up: f64,
}

impl Frustum {
    /// Of a projection of WebXR: a matrix of OpenGL by columns, whose clip space is -1 to 1. `None` where it is no perspective.
    pub fn of_projection(matrix: &[f64; 16]) -> Option<Frustum> {
        let [x, y, shift_x, shift_y] = [matrix[0], matrix[5], matrix[8], matrix[9]];
        if matrix[11] != -1.0 || matrix[15] != 0.0 {
            return None;
        }
        let frustum = Frustum {
            left: (shift_x - 1.0) / x,
            right: (shift_x + 1.0) / x,
            down: (shift_y - 1.0) / y,
            up: (shift_y + 1.0) / y,
        };
        let all = [frustum.left, frustum.right, frustum.down, frustum.up];
        let is_one =
            all.iter().all(|slope| slope.is_finite()) && frustum.right > frustum.left && frustum.up > frustum.down;
        is_one.then_some(frustum)
    }

    /// A camera of so many rows. Its pixels are square, as a viewport's are not always: its picture is stretched over that. Rounding the width to pixels moves what lies at
    /// a side by half a pixel at most.
    pub fn camera(&self, world_from_eye: Rigid, rows_px: u32, near_m: f64) -> Pinhole {
        let (width, height) = (self.right - self.left, self.up - self.down);
        let focal_px = (f64::from(rows_px.max(1)) / height).min(LARGEST_PX / width.max(height));
        let [width_px, height_px] = [width, height].map(|side| (focal_px * side).round().max(1.0));
        Pinhole {
            world_from_eye,
            width_px: width_px as u32,
            height_px: height_px as u32,
            focal_px,
            centre_px: DVec2::new(-self.left, self.up) * focal_px,
            near_m,
        }
    }
}

/// The view that a server is asked for: straight ahead, and as wide as what the eyes see to either side together. Of eyes that are turned against each other it leaves
/// out what only the turn shows.
pub fn view_of(eyes: &[Frustum], rows_px: u32) -> Option<ViewSize> {
    let first = eyes.first()?;
    let widest = |of: fn(&Frustum) -> f64| eyes.iter().map(of).fold(0.0, f64::max);
    let across = widest(|eye| eye.left.abs().max(eye.right.abs()));
    let along = widest(|eye| eye.down.abs().max(eye.up.abs()));
    let focal_px = (f64::from(rows_px) / (first.up - first.down)).min(LARGEST_PX / (2.0 * across.max(along)));
    let side_px = |slope: f64| (2.0 * focal_px * slope).round().max(1.0) as u32;
    Some(ViewSize { width_px: side_px(across), height_px: side_px(along), fov_y_rad: 2.0 * along.atan() })
}

/// A headset that is worn.
#[derive(Debug)]
pub struct Headset {
    world_from_room: Rigid,
    /// Of the head now.
    world_from_head: Rigid,
    /// Whether the stick that turns was let go since it turned.
    may_snap: bool,
    mode_before: Mode,
}

impl Headset {
    /// Puts it on: who wears it stands where the eye was, and looks along the ground as it did, whichever way he stands in his room.
    pub fn put_on(controls: &mut Controls, room_from_head: Rigid) -> Headset {
        let mode_before = controls.mode();
        controls.set_mode(Mode::Walk);
        let world_from_head = level(controls.pose());
        let world_from_room = world_from_head * level(room_from_head).inverse();
        Headset { world_from_room, world_from_head: world_from_room * room_from_head, may_snap: true, mode_before }
    }

    /// Takes it off; the eye stays where it is.
    pub fn take_off(self, controls: &mut Controls) {
        controls.put(self.world_from_head);
        controls.set_mode(self.mode_before);
    }

    /// Lets `dt_s` seconds pass, at whose end the head is there: sticks `go` right, up and forward of where it looks, and `turn` to the right.
    pub fn advance(&mut self, controls: &mut Controls, room_from_head: Rigid, (go, turn): (DVec3, f64), dt_s: f64) {
        let before = level(self.world_from_room * room_from_head);
        controls.carry_to(before);
        controls.handle(Input::Sticks { go, look: DVec2::ZERO });
        controls.advance(dt_s);
        let moved = level(controls.pose()) * before.inverse();
        self.world_from_room = moved * self.world_from_room;
        self.world_from_room = self.snap(room_from_head, turn) * self.world_from_room;
        self.world_from_head = self.world_from_room * room_from_head;
        controls.carry_to(level(self.world_from_head));
    }

    /// A turn about the head.
    fn snap(&mut self, room_from_head: Rigid, turn: f64) -> Rigid {
        let [begins, ends] = SNAP;
        self.may_snap |= turn.abs() < ends;
        if !self.may_snap || turn.abs() < begins {
            return Rigid::IDENTITY;
        }
        self.may_snap = false;
        let rotation = DQuat::from_rotation_y(-SNAP_RAD.copysign(turn));
        let head = self.world_from_room.transform_point(room_from_head.translation);
        Rigid { rotation, translation: head - rotation * head }
    }

    /// The head now.
    pub fn world_from_head(&self) -> Rigid {
        self.world_from_head
    }

    /// An eye of it.
    pub fn world_from_eye(&self, room_from_eye: Rigid) -> Rigid {
        self.world_from_room * room_from_eye
    }
}

/// The same place, upright, looking along the ground. A head that is not tilted says by what lies to its right where it looks, even where that is straight down.
fn level(world_from_eye: Rigid) -> Rigid {
    let right = world_from_eye.transform_vector(DVec3::X);
    Rigid::look_along(world_from_eye.translation, DVec3::Y.cross(right).with_y(0.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    const ROOM: [DVec3; 2] = [DVec3::splat(-10.0), DVec3::splat(10.0)];

    fn controls() -> Controls {
        let eye = DVec3::new(1.0, 1.6, 2.0);
        let mut controls = Controls::new(Rigid::look_along(eye, DVec3::new(1.0, -0.5, 0.0)), true, ROOM[0], ROOM[1]);
        controls.set_walls(false);
        controls
    }

    /// As WebXR has it: a metre and a half above the floor, turned to the left, looking down a little.
    fn head() -> Rigid {
        let turn = DQuat::from_rotation_y(0.7) * DQuat::from_rotation_x(-0.3);
        Rigid::from_gl(DVec3::new(0.2, 1.5, 0.1), turn)
    }

    fn forward(pose: Rigid) -> DVec3 {
        pose.transform_vector(DVec3::Z)
    }

    #[test]
    fn a_projection_has_the_slopes_that_it_was_made_of() {
        let (left, right, down, up, near) = (-1.376, 0.839, -1.428, 0.966, 0.1);
        let mut matrix = [0.0; 16];
        (matrix[0], matrix[5]) = (2.0 / (right - left), 2.0 / (up - down));
        (matrix[8], matrix[9]) = ((right + left) / (right - left), (up + down) / (up - down));
        (matrix[10], matrix[11], matrix[14]) = (-1.0, -1.0, -2.0 * near);
        let frustum = Frustum::of_projection(&matrix).expect("a perspective");
        for (found, made) in [(frustum.left, left), (frustum.right, right), (frustum.down, down), (frustum.up, up)] {
            assert!((found - made).abs() < 1e-12, "{frustum:?}");
        }
        // Its corners are those of the camera's image.
        let camera = frustum.camera(Rigid::IDENTITY, 1760, near);
        let corner = camera.image_from_eye(DVec3::new(right, -up, 1.0)).expect("in front");
        assert!((corner.u - f64::from(camera.width_px)).abs() <= 0.5 && corner.v.abs() < 1e-9, "{corner:?}");
        let corner = camera.image_from_eye(DVec3::new(left, -down, 1.0)).expect("in front");
        assert!(corner.u.abs() < 1e-9 && (corner.v - 1760.0).abs() < 1e-9, "{corner:?}");
        assert!(camera.is_valid());
        assert_eq!(Frustum::of_projection(&[0.0; 16]), None);
        (matrix[11], matrix[15]) = (0.0, 1.0);
        assert_eq!(Frustum::of_projection(&matrix), None, "parallel rays");
        let large = frustum.camera(Rigid::IDENTITY, 100_000, near);
        assert!(large.width_px.max(large.height_px) <= 4096 && (large.fov_y_rad() - camera.fov_y_rad()).abs() < 1e-3);
        assert_eq!(Frustum::of_projection(&[f64::NAN; 16]), None);
    }

    #[test]
    fn a_server_is_asked_for_what_both_eyes_see() {
        let left = Frustum { left: -1.376, right: 0.839, down: -1.428, up: 0.966 };
        let right = Frustum { left: -0.839, right: 1.376, ..left };
        let view = view_of(&[left, right], 1760).expect("two eyes");
        let camera = Pinhole::symmetric(Rigid::IDENTITY, (view.width_px, view.height_px), view.fov_y_rad, 0.1);
        for (x, y) in [(-1.376, 1.428), (1.376, -0.966)] {
            let at = camera.image_from_eye(DVec3::new(x, y, 1.0)).expect("in front");
            let (width, height) = (f64::from(view.width_px) + 1.0, f64::from(view.height_px) + 1.0);
            assert!((-1.0..=width).contains(&at.u) && (-1.0..=height).contains(&at.v), "{at:?} of {view:?}");
        }
        assert_eq!(view_of(&[], 1760), None);
    }

    #[test]
    fn who_puts_it_on_stands_and_looks_where_the_eye_did() {
        let mut controls = controls();
        let headset = Headset::put_on(&mut controls, head());
        let pose = headset.world_from_head();
        assert!(pose.translation.distance(DVec3::new(1.0, 1.6, 2.0)) < 1e-12, "{pose:?}");
        // Down as he looks, not as the eye did.
        let along = DVec3::new((0.3_f64).cos(), -(0.3_f64).sin(), 0.0);
        assert!(forward(pose).distance(along) < 1e-9, "{:?}", forward(pose));
        // What lies to the right of him lies there.
        let right = pose.transform_vector(DVec3::X);
        assert!(right.distance(DVec3::Z) < 1e-9, "{right:?}");
    }

    #[test]
    fn steps_of_the_feet_are_steps_in_the_scene() {
        let mut controls = controls();
        let mut headset = Headset::put_on(&mut controls, head());
        let before = headset.world_from_head();
        // Half a metre along where he looks: -z of the room, turned.
        let step = DQuat::from_rotation_y(0.7) * DVec3::new(0.0, 0.0, -0.5);
        let there = Rigid { translation: head().translation + step, ..head() };
        headset.advance(&mut controls, there, (DVec3::ZERO, 0.0), 0.1);
        let moved = headset.world_from_head().translation - before.translation;
        assert!(moved.distance(DVec3::new(0.5, 0.0, 0.0)) < 1e-9, "{moved:?}");
        assert!(controls.pose().translation.distance(headset.world_from_head().translation) < 1e-9);
        // An eye 3 cm to the right of the middle is so in the world.
        let right_eye = there * Rigid { translation: DVec3::new(0.03, 0.0, 0.0), ..Rigid::IDENTITY };
        let apart = headset.world_from_eye(right_eye).translation - headset.world_from_head().translation;
        assert!(apart.distance(DVec3::new(0.0, 0.0, 0.03)) < 1e-9, "{apart:?}");
    }

    #[test]
    fn sticks_go_where_the_head_looks_at_the_speed_of_walking_and_turn_by_steps() {
        let mut controls = controls();
        let mut headset = Headset::put_on(&mut controls, head());
        let start = headset.world_from_head();
        for _ in 0..50 {
            headset.advance(&mut controls, head(), (DVec3::Z, 0.0), 0.02);
        }
        let moved = headset.world_from_head().translation - start.translation;
        // Walking speed for a second, less what it begins with; on the level though he looks down.
        assert!((1.4..1.7).contains(&moved.x) && moved.y.abs() < 1e-9 && moved.z.abs() < 1e-9, "{moved:?}");
        for _ in 0..50 {
            headset.advance(&mut controls, head(), (DVec3::ZERO, 0.0), 0.02);
        }
        let rests = headset.world_from_head();
        for turn in [0.5, 0.9, 1.0, 0.5, 1.0] {
            headset.advance(&mut controls, head(), (DVec3::ZERO, turn), 0.02);
        }
        let turned = headset.world_from_head();
        assert!(turned.translation.distance(rests.translation) < 1e-9, "it turns about the head");
        let level = |pose: Rigid| forward(pose).with_y(0.0).normalize();
        assert!((level(turned).dot(level(rests)) - SNAP_RAD.cos()).abs() < 1e-9, "once");
        assert!(level(rests).cross(level(turned)).y < 0.0, "to the right");
        headset.advance(&mut controls, head(), (DVec3::ZERO, 0.0), 0.02);
        headset.advance(&mut controls, head(), (DVec3::ZERO, -1.0), 0.02);
        assert!(level(headset.world_from_head()).distance(level(rests)) < 1e-9, "and back");
    }

    #[test]
    fn taken_off_the_eye_stays_and_moves_as_before() {
        let mut controls = controls();
        controls.set_mode(Mode::Orbit);
        let mut headset = Headset::put_on(&mut controls, head());
        assert_eq!(controls.mode(), Mode::Walk);
        headset.advance(&mut controls, head(), (DVec3::ZERO, 1.0), 0.02);
        let pose = headset.world_from_head();
        headset.take_off(&mut controls);
        assert_eq!(controls.mode(), Mode::Orbit);
        assert!(controls.pose().translation.distance(pose.translation) < 1e-9);
        assert!(forward(controls.pose()).distance(forward(pose)) < 1e-9);
    }

    #[test]
    fn a_head_that_looks_straight_down_stays_upright() {
        let down = Rigid::from_gl(DVec3::new(0.0, 1.5, 0.0), DQuat::from_rotation_x(-std::f64::consts::FRAC_PI_2));
        let mut controls = controls();
        let mut headset = Headset::put_on(&mut controls, down);
        headset.advance(&mut controls, down, (DVec3::Z, 0.0), 0.5);
        let pose = headset.world_from_head();
        assert!(forward(pose).distance(DVec3::NEG_Y) < 1e-9, "{pose:?}");
        let moved = pose.translation - DVec3::new(1.0, 1.6, 2.0);
        assert!(moved.x > 0.1 && moved.z.abs() < 1e-9, "ahead is where the eye looked: {moved:?}");
    }
}
