//! A neutral studio: a grey room with soft boxes, for objects whose file brings no light.
//!
//! The room is a box with the viewed object in its middle. Its walls are lit from above, so they grow darker downwards; the floor
//! is darkest. Four soft boxes hang on them: a large one overhead, a key at the left of who looks along -z, a weaker fill at his
//! right, and a strip behind the object that draws its outline. Their tints are slight, so that colours stay true.
//!
//! All values are relative; in the end the picture is scaled to a directional mean of 1.

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::{Environment, direction_from_uv};

const WIDTH_PX: u32 = 512;
const HEIGHT_PX: u32 = 256;
/// Directions a pixel along each axis: edges of soft boxes are smooth.
const SAMPLES: u32 = 4;
/// Half of the room along x, y and z, in metres. The light comes from infinitely far away, so only proportions count.
const ROOM_HALF_M: DVec3 = DVec3::new(4.0, 3.0, 5.0);
/// How far the light of a soft box fades at its border, as a share of its half sizes.
const FADE_SHARE: f64 = 0.12;
/// Radiance of the walls' upper and lower edges, of the ceiling and of the floor.
const WALL: [f64; 2] = [0.85, 0.35];
const CEILING: f64 = 0.9;
const FLOOR: f64 = 0.22;

/// A rectangle of light on a side of the room.
struct SoftBox {
    /// The side: its axis (0 x, 1 y, 2 z) and whether it lies towards the positive end.
    side: (usize, bool),
    /// Its middle along the other two axes in their order, in metres.
    middle_m: DVec2,
    half_m: DVec2,
    radiance: DVec3,
}

const SOFT_BOXES: [SoftBox; 4] = [
    SoftBox {
        side: (1, true),
        middle_m: DVec2::new(0.0, 0.5),
        half_m: DVec2::new(1.8, 2.2),
        radiance: DVec3::new(7.0, 7.0, 7.0),
    },
    SoftBox {
        side: (0, false),
        middle_m: DVec2::new(0.9, 1.6),
        half_m: DVec2::new(1.1, 1.6),
        radiance: DVec3::new(9.2, 9.0, 8.7),
    },
    SoftBox {
        side: (0, true),
        middle_m: DVec2::new(0.6, 0.8),
        half_m: DVec2::new(1.4, 1.1),
        radiance: DVec3::new(3.4, 3.5, 3.65),
    },
    SoftBox {
        side: (2, false),
        middle_m: DVec2::new(1.4, 1.3),
        half_m: DVec2::new(1.6, 0.35),
        radiance: DVec3::new(5.0, 5.0, 5.1),
    },
];

impl Environment {
    /// A neutral studio of 512 x 256 pixels, the same at every call: brighter above than below, with a directional mean of 1.
    pub fn studio() -> Environment {
        let rows = (0..HEIGHT_PX).into_par_iter();
        let pixels: Vec<DVec3> = rows.flat_map_iter(|y| (0..WIDTH_PX).map(move |x| pixel(x, y))).collect();
        let as_environment = |scale: f64| Environment {
            width_px: WIDTH_PX,
            height_px: HEIGHT_PX,
            radiance: pixels.iter().map(|&pixel| (pixel * scale).as_vec3().to_array()).collect(),
        };
        let mean = as_environment(1.0).mean_radiance();
        as_environment(3.0 / f64::from(mean.element_sum()))
    }
}

/// The mean over a pixel.
fn pixel(x: u32, y: u32) -> DVec3 {
    let count = f64::from(SAMPLES);
    let samples = (0..SAMPLES).flat_map(|row| (0..SAMPLES).map(move |column| (column, row)));
    let sum: DVec3 = samples
        .map(|(column, row)| {
            let place = DVec2::new(f64::from(column), f64::from(row)) + 0.5;
            let at = (DVec2::new(f64::from(x), f64::from(y)) + place / count)
                / DVec2::new(f64::from(WIDTH_PX), f64::from(HEIGHT_PX));
            radiance(direction_from_uv(DVec2::new(at.x, 1.0 - at.y)))
        })
        .sum();
    sum / (count * count)
}

/// What a ray from the middle of the room meets.
fn radiance(direction: DVec3) -> DVec3 {
    // Never divides by 0. The longest axis of a unit vector is 0.58 and more, so that no other is met as near: any number does that is far smaller.
    let reach = ROOM_HALF_M / direction.abs().max(DVec3::splat(1e-12));
    let axis = [0, 1, 2].into_iter().min_by(|&a, &b| reach[a].total_cmp(&reach[b])).expect("there are three axes");
    let hit_m = direction * reach[axis];
    let side = (axis, direction[axis] > 0.0);
    let on_side = match axis {
        0 => DVec2::new(hit_m.y, hit_m.z),
        1 => DVec2::new(hit_m.x, hit_m.z),
        _ => DVec2::new(hit_m.x, hit_m.y),
    };
    SOFT_BOXES.iter().filter(|lamp| lamp.side == side).fold(DVec3::splat(room(side, hit_m)), |wall, lamp| {
        let beyond = (on_side - lamp.middle_m).abs() / lamp.half_m;
        wall.lerp(lamp.radiance, within(beyond.x) * within(beyond.y))
    })
}

/// The room's own grey.
fn room((axis, positive): (usize, bool), hit_m: DVec3) -> f64 {
    match (axis, positive) {
        (1, true) => CEILING,
        (1, false) => FLOOR,
        _ => {
            let height_share = 0.5 + 0.5 * hit_m.y / ROOM_HALF_M.y;
            WALL[1] + (WALL[0] - WALL[1]) * height_share
        }
    }
}

/// 1 inside of a soft box, 0 outside, smooth between; `share` of its half size from its middle.
fn within(share: f64) -> f64 {
    let t = ((1.0 - share) / FADE_SHARE).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}
