//! From a view to the eye space of a map that a light sees, and what that rounds.

use camera::Pinhole;
use glam::DVec3;

/// By how much the inverse depths of a caster and of a receiver may differ by rounding alone, as a share of them: the vertex stage's map into
/// the light's eye space, interpolation and the perspective division round about 8 times by 2^-24 together.
pub(crate) const ROUNDING: f64 = 8.0 / (1u64 << 24) as f64;

/// Columns of the map from points relative to an output eye, with the world's axes, to a map's eye space; the difference of the eyes
/// is taken in f64.
pub(crate) fn from_view(map: &Pinhole, eye_world: DVec3) -> [[f32; 4]; 4] {
    let map_from_world = map.world_from_eye.inverse();
    let turn = glam::DMat3::from_quat(map_from_world.rotation);
    let eye_map = map_from_world.transform_point(eye_world);
    [turn.x_axis, turn.y_axis, turn.z_axis, eye_map].map(|axis| axis.extend(0.0).as_vec4().to_array())
}
