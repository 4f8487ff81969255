use glam::{DAffine3, DMat3, DQuat, DVec3};
use serde::{Deserialize, Serialize};

/// A rotation followed by a translation, in f64: `b_from_a` maps points of space `a` to space `b`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Rigid {
    /// Unit quaternion.
    pub rotation: DQuat,
    /// Metres, in space `b`.
    pub translation: DVec3,
}

impl Rigid {
    /// The identity.
    pub const IDENTITY: Rigid = Rigid { rotation: DQuat::IDENTITY, translation: DVec3::ZERO };

    /// `world_from_eye` of an eye at `eye_world` that looks at `target_world` with the world's y as up. Looking straight up or
    /// down, where that is undefined, the world's -z is up instead.
    pub fn look_at(eye_world: DVec3, target_world: DVec3) -> Rigid {
        Rigid::look_along(eye_world, target_world - eye_world)
    }

    /// `world_from_eye` of an eye at `eye_world` that looks along `forward_world` (any length but zero; zero looks along -z).
    pub fn look_along(eye_world: DVec3, forward_world: DVec3) -> Rigid {
        let forward = forward_world.try_normalize().unwrap_or(DVec3::NEG_Z);
        let right = forward.cross(DVec3::Y).try_normalize().unwrap_or_else(|| forward.cross(DVec3::NEG_Z).normalize());
        let down = forward.cross(right);
        let rotation = DQuat::from_mat3(&DMat3::from_cols(right, down, forward)).normalize();
        Rigid { rotation, translation: eye_world }
    }

    /// `world_from_eye` from a pose in the convention of glTF and OpenGL, whose camera looks along -z with y up.
    pub fn from_gl(position_world: DVec3, world_from_gl: DQuat) -> Rigid {
        let gl_from_eye = DQuat::from_rotation_x(std::f64::consts::PI);
        Rigid { rotation: (world_from_gl * gl_from_eye).normalize(), translation: position_world }
    }

    /// The rotation of this `world_from_eye` in the convention of glTF and OpenGL.
    pub fn gl_rotation(&self) -> DQuat {
        self.rotation * DQuat::from_rotation_x(-std::f64::consts::PI)
    }

    /// Maps a point of `a` to `b`.
    pub fn transform_point(&self, p_a: DVec3) -> DVec3 {
        self.rotation * p_a + self.translation
    }

    /// Maps a direction of `a` to `b`.
    pub fn transform_vector(&self, v_a: DVec3) -> DVec3 {
        self.rotation * v_a
    }

    /// `a_from_b`.
    pub fn inverse(&self) -> Rigid {
        let rotation = self.rotation.conjugate();
        Rigid { rotation, translation: -(rotation * self.translation) }
    }

    /// The same map as an affine matrix.
    pub fn to_affine(&self) -> DAffine3 {
        DAffine3::from_rotation_translation(self.rotation, self.translation)
    }

    /// Whether every component is finite and the rotation has unit length within 1e-6 (the error of an f32 quaternion).
    pub fn is_valid(&self) -> bool {
        self.translation.is_finite() && self.rotation.is_finite() && (self.rotation.length() - 1.0).abs() < 1e-6
    }
}

impl std::ops::Mul for Rigid {
    type Output = Rigid;
    /// `c_from_b * b_from_a = c_from_a`.
    fn mul(self, b_from_a: Rigid) -> Rigid {
        Rigid {
            rotation: (self.rotation * b_from_a.rotation).normalize(),
            translation: self.transform_point(b_from_a.translation),
        }
    }
}

/// The shortest turn from one orientation to another: axis times angle, in world space.
pub fn turn_between(world_from_a: DQuat, world_from_b: DQuat) -> DVec3 {
    let turn = (world_from_b * world_from_a.conjugate()).normalize();
    let turn = if turn.w < 0.0 { -turn } else { turn };
    turn.to_scaled_axis()
}

/// An axis of a turned map differs from a unit vector, and two of them from a right angle, by less than this: some units of the f32 that a
/// scene's file has.
const TURN_SLACK: f64 = 1e-6;

/// The shortest turn from one map's axes to another's, as [`turn_between`]; `None` where they were stretched or mirrored, too.
pub fn turn_of(before: &DMat3, after: &DMat3) -> Option<DVec3> {
    let turned = *after * before.inverse();
    let off = turned.transpose() * turned - DMat3::IDENTITY;
    let is_turn = off.to_cols_array().iter().all(|number| number.abs() < TURN_SLACK) && turned.determinant() > 0.0;
    is_turn.then(|| turn_between(DQuat::IDENTITY, DQuat::from_mat3(&turned)))
}
