//! What is swept: one stiff parameter over its decades, all else as usual.

use glam::{DVec3, Vec3};
use scene::{Mesh, Scene};
use server::scale::scaled;
use server::start::{near_m, start_pose};

use super::build::{Placed, at, ball, mesh, scene, square};
use super::case::{Case, FOV_Y_RAD, PICTURE_PX};
use super::moved::moved;

/// A parameter, the decades that it is swept over, and what must hold.
pub struct Sweep {
    pub name: &'static str,
    /// With its unit.
    pub parameter: &'static str,
    /// Powers of ten, first and last.
    pub decades: [i32; 2],
    /// The decade up to which the bounds must hold, counted in the direction of the sweep.
    pub holds_to: i32,
    /// Whether every case must look like the first one.
    pub looks_alike: bool,
    /// Whether depth inside of surfaces has a bound: they are flat, or bend little within a pixel.
    pub bounds_depth: bool,
    /// Why the bounds are what they are.
    pub why: &'static str,
}

const DISTANCE: Sweep = Sweep {
    name: "distance from the origin",
    parameter: "distance in m",
    decades: [0, 9],
    holds_to: 7,
    looks_alike: true,
    bounds_depth: true,
    why: "coordinates on the GPU are relative to an anchor near the eye, composed in f64, whose step is 2e-9 m at 1e7 m and 1e-7 m at 1e9",
};

const SIZE: Sweep = Sweep {
    name: "size",
    parameter: "size in m",
    decades: [-6, 9],
    holds_to: 9,
    looks_alike: true,
    bounds_depth: true,
    why: "all that is compared scales with the scene",
};

/// What is made by code of a value.
type Made = fn(f64) -> Case;
/// What becomes of a scene that somebody has.
type Changed = fn(&Scene, f64) -> Case;

/// Sweeps of what is made.
pub const BY_CODE: &[(Sweep, Made)] = &[
    (DISTANCE, |distance_m| still_life_case(away(distance_m), 1.0)),
    (
        Sweep {
            name: "far over near",
            parameter: "far / near",
            decades: [1, 9],
            holds_to: 7,
            looks_alike: false,
            bounds_depth: true,
            why: "depth is uniform in inverse depth, in steps that move a sample by a tenth of a pixel over the region",
        },
        near_and_far,
    ),
    (SIZE, |size_m| still_life_case(DVec3::ZERO, size_m)),
    (
        Sweep {
            name: "triangle",
            parameter: "side in pixels",
            decades: [-6, 6],
            holds_to: 6,
            looks_alike: false,
            bounds_depth: true,
            why: "samples do not depend on how a surface is cut into triangles",
        },
        triangles,
    ),
    (
        Sweep {
            name: "grazing",
            parameter: "angle in degrees",
            decades: [-8, 1],
            holds_to: 1,
            looks_alike: false,
            bounds_depth: true,
            why: "inverse depth is linear over a plane at any angle; its slope is that of the normal, of 8 + 8 bits",
        },
        grazing,
    ),
];

/// Sweeps of what is changed.
pub const OF_SCENES: &[(Sweep, Changed)] = &[
    (Sweep { bounds_depth: false, ..DISTANCE }, |scene, distance_m| begun(moved(scene, away(distance_m)))),
    (
        Sweep { parameter: "size over its own", decades: [-6, 6], holds_to: 6, bounds_depth: false, ..SIZE },
        // Somebody who walks is as tall as he is: what is to look alike is turned about.
        |scene, scale| begun(Scene { walk: false, ..scaled(scene.clone(), scale) }),
    ),
];

/// So far away, in whole metres: each place is the same to the last bit but for the size of its numbers.
fn away(distance_m: f64) -> DVec3 {
    (DVec3::new(0.8, 0.2, -0.56) * distance_m).round()
}

/// A scene from where viewers begin.
fn begun(scene: Scene) -> Case {
    Case { middle: start_pose(&scene), near_m: near_m(&scene), scene }
}

/// A board with two balls and a wall, two metres across.
pub fn still_life(place: DVec3, scale: f64) -> Vec<Placed> {
    let placed = |mesh: Mesh, offset: DVec3, size: f64, colour| Placed {
        mesh,
        world_from_mesh: at(place + offset * scale, size * scale),
        colour,
    };
    let mut parts = vec![
        placed(square(), DVec3::new(0.0, 0.0, -1.0), 1.0, [0.5, 0.4, 0.3]),
        placed(ball(24), DVec3::new(-0.4, -0.2, 0.0), 0.35, [0.7, 0.2, 0.1]),
        placed(ball(24), DVec3::new(0.45, 0.1, -0.3), 0.3, [0.1, 0.4, 0.7]),
    ];
    let mut board = placed(square(), DVec3::new(0.0, -0.6, 0.0), 1.0, [0.3, 0.5, 0.3]);
    board.world_from_mesh.matrix3 *= glam::DMat3::from_rotation_x(-std::f64::consts::FRAC_PI_2);
    parts.push(board);
    parts
}

fn still_life_case(place: DVec3, scale: f64) -> Case {
    let eye = place + DVec3::new(0.3, 0.5, 2.4) * scale;
    Case::look(
        scene("still life", still_life(place, scale)),
        eye,
        place + DVec3::new(0.0, -0.1, 0.0) * scale,
        0.01 * scale,
    )
}

/// A board that faces the eye at each decade, from the near plane on, in columns side by side. The nearest is a twentieth of a metre away.
fn near_and_far(ratio: f64) -> Case {
    let near_m = 0.05;
    let decades = ratio.log10().round() as i32;
    let columns = f64::from(decades + 1);
    let half_view = (FOV_Y_RAD / 2.0).tan();
    let board = |decade: i32| {
        // A little behind the decade, so that the first one lies behind the near plane.
        let depth_m = 1.5 * near_m * 10_f64.powi(decade);
        let column = (2.0 * f64::from(decade) + 1.0) / columns - 1.0;
        let mut world_from_mesh =
            at(DVec3::new(column * half_view * depth_m, 0.0, -depth_m), half_view * depth_m * 1.2);
        world_from_mesh.matrix3.x_axis /= 1.2 * columns * 1.1;
        Placed {
            mesh: square(),
            world_from_mesh,
            colour: [0.2 + 0.06 * decade as f32, 0.5, 0.6 - 0.05 * decade as f32],
        }
    };
    let mut scene = scene("boards", (0..=decades).map(board).collect());
    // To be walked in: the region is that of a person's head, however far the last board is.
    scene.walk = true;
    Case::look(scene, DVec3::ZERO, DVec3::NEG_Z, near_m)
}

/// A board of triangles so large, before one of one: where they would be more than a few thousand, only the middle of it.
fn triangles(side_px: f64) -> Case {
    const MOST_CELLS: f64 = 48.0;
    let distance_m = 2.0;
    let pixel_m = 2.0 * distance_m * (FOV_Y_RAD / 2.0).tan() / f64::from(PICTURE_PX);
    let side_m = side_px * pixel_m;
    let cells = (2.0 / side_m).clamp(1.0, MOST_CELLS).round() as u32;
    let half = (side_m * f64::from(cells) / 2.0) as f32;
    let at_step = |step: u32| half * (2.0 * step as f32 / cells as f32 - 1.0);
    let corner = |index: u32| (Vec3::new(at_step(index % (cells + 1)), at_step(index / (cells + 1)), 0.0), Vec3::Z);
    let cell = |index: u32| {
        let a = index / cells * (cells + 1) + index % cells;
        let b = a + cells + 1;
        [a, a + 1, b + 1, a, b + 1, b]
    };
    let fine = mesh((0..(cells + 1) * (cells + 1)).map(corner), (0..cells * cells).flat_map(cell).collect());
    let parts = vec![
        Placed { mesh: square(), world_from_mesh: at(DVec3::ZERO, 1.0), colour: [0.3, 0.4, 0.6] },
        Placed { mesh: fine, world_from_mesh: at(DVec3::new(0.0, 0.0, 0.2), 1.0), colour: [0.7, 0.5, 0.2] },
    ];
    let mut scene = scene("triangles", parts);
    // The region is that around the board, however large a triangle is.
    scene.bounds = scene::Bounds { min: DVec3::splat(-1.0), max: DVec3::splat(1.0) };
    Case::look(scene, DVec3::new(0.0, 0.0, 0.2 + distance_m), DVec3::ZERO, 0.01)
}

/// A floor that an eye looks along, at an angle with it.
fn grazing(angle_deg: f64) -> Case {
    let angle = angle_deg.to_radians();
    let mut floor = Placed { mesh: square(), world_from_mesh: at(DVec3::ZERO, 1.0), colour: [0.4, 0.5, 0.3] };
    floor.world_from_mesh.matrix3 *= glam::DMat3::from_rotation_x(-std::f64::consts::FRAC_PI_2);
    let eye = DVec3::new(0.0, 2.0 * angle.sin(), 2.0 * angle.cos());
    Case::look(scene("floor", vec![floor]), eye, DVec3::ZERO, 0.01)
}
