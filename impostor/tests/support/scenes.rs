//! The scenes, and cameras of every model for them.

use std::sync::LazyLock;

use camera::{Bounds, Camera, CorridorMap, GraphCamera, Heading, Pinhole, Rigid, Spoc};
use glam::DVec3;

use super::{Image, Scene, Solid};

fn ball(x: f64, y: f64, z: f64, radius: f64) -> Solid {
    Solid::Ball { centre: DVec3::new(x, y, z), radius }
}

fn block(min: (f64, f64, f64), max: (f64, f64, f64)) -> Solid {
    Solid::Block { min: min.into(), max: max.into() }
}

/// A pot with a lid, a spout and a handle of balls and blocks, two metres wide.
pub fn pot() -> Scene {
    Scene(vec![
        ball(0.0, 0.0, 0.0, 0.7),
        ball(0.0, 0.75, 0.0, 0.15),
        ball(0.75, 0.1, 0.0, 0.15),
        ball(0.9, 0.25, 0.0, 0.1),
        block((-1.0, -0.3, -0.05), (-0.6, 0.3, 0.05)),
        block((-0.5, -0.75, -0.5), (0.5, -0.6, 0.5)),
    ])
}

pub const POT_EYE: DVec3 = DVec3::new(0.0, 0.9, 3.5);

pub const POT_BOUNDS: Bounds = Bounds { min: DVec3::new(-1.0, -0.75, -0.7), max: DVec3::new(1.0, 0.9, 0.7) };

pub fn pot_by_pinhole(size: u32) -> Image {
    let pose = Rigid::look_at(POT_EYE, POT_BOUNDS.middle());
    Image::take(Camera::Pinhole(Pinhole::symmetric(pose, (size, size), 0.7, 0.5)), pot())
}

pub fn pot_by_spoc(size: u32) -> Image {
    let camera = Spoc::around(&POT_BOUNDS, POT_EYE, (size, size), 1.0).expect("outside of the pot");
    Image::take(Camera::Spoc(camera), pot())
}

/// A plate two metres before a wall, and an eye four metres before it.
pub fn plate_by_pinhole(size: u32) -> Image {
    let scene = Scene(vec![block((-1.0, -1.0, -0.1), (1.0, 1.0, 0.0)), block((-4.0, -4.0, -2.2), (4.0, 4.0, -2.0))]);
    let pose = Rigid::look_along(DVec3::Z * 4.0, DVec3::NEG_Z);
    Image::take(Camera::Pinhole(Pinhole::symmetric(pose, (size, size), 1.0, 0.5)), scene)
}

/// A maze of 4 m cells with two balls in it.
pub fn maze_map() -> CorridorMap {
    let rows =
        ["#####.#####", "#.........#", "#.###.###.#", "#.#.....#.#", "#.#.###.#.#", "#...#.....#", "###########"];
    let free = rows.iter().flat_map(|row| row.chars().map(|cell| cell == '.')).collect();
    CorridorMap { columns: 11, free, origin_world: DVec3::new(-22.0, 0.0, 0.0), cell_m: 4.0, height_m: 3.0 }
}

pub fn maze() -> Scene {
    let map = maze_map();
    let rows = map.free.len() / map.columns;
    let corner = |column: usize, row: usize| {
        map.origin_world + DVec3::new(column as f64 * map.cell_m, 0.0, row as f64 * map.cell_m)
    };
    let (low, high) = (corner(0, 0), corner(map.columns, rows));
    let mut solids = vec![
        Solid::Block { min: low - DVec3::Y, max: high },
        Solid::Block { min: low + DVec3::Y * map.height_m, max: high + DVec3::Y * (map.height_m + 1.0) },
        ball(-18.0, 1.0, 10.0, 0.8),
        ball(8.0, 1.2, 6.5, 0.6),
    ];
    for (cell, _) in map.free.iter().enumerate().filter(|(_, free)| !**free) {
        let (column, row) = (cell % map.columns, cell / map.columns);
        let max = corner(column + 1, row + 1) + DVec3::Y * map.height_m;
        solids.push(Solid::Block { min: corner(column, row), max });
    }
    Scene(solids)
}

pub fn maze_by_graph(size: (u32, u32)) -> Image {
    let description = maze_map().describe((5, 0), Heading::PlusZ, 32.0, size, 2.0).expect("the entrance is free");
    let camera = GraphCamera::from_description(&description).unwrap_or_else(|error| panic!("{error}"));
    Image::take(Camera::Graph(std::sync::Arc::new(camera)), maze())
}

/// From within the maze, so that rays come from behind the camera and go there.
pub fn maze_by_pinhole(size: u32) -> Image {
    let pose = Rigid::look_along(DVec3::new(0.0, 1.5, 6.5), DVec3::new(1.0, -0.1, -0.1));
    Image::take(Camera::Pinhole(Pinhole::symmetric(pose, (size, size), 1.4, 0.1)), maze())
}

/// Two of the pot and two of the maze, made once for all tests.
pub static IMAGES: LazyLock<[Image; 4]> =
    LazyLock::new(|| [pot_by_pinhole(256), pot_by_spoc(256), maze_by_graph((960, 720)), maze_by_pinhole(256)]);
