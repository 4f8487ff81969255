//! Triangles of all shapes and sizes.

use glam::{DVec3, Vec3};
use scene::sanitize::sanitize;
use scene::{Bounds, Mesh};

use super::stiff::{Stiff, flat};
use crate::topics::stability::build::{Placed, at, mesh, scene, square};
use crate::topics::stability::case::Case;

pub(super) const CASES: &[Stiff] = &[
    Stiff { name: "needles of 1e-7 m between strips", judge: |lab| flat(lab, &board(needles(NEEDLE_M))) },
    Stiff {
        name: "triangles without area in a board, as readers leave it",
        judge: |lab| flat(lab, &board(with_nothing())),
    },
    Stiff { name: "a sliver of 1e-7 m along a diagonal", judge: |lab| flat(lab, &board(with_a_sliver())) },
    Stiff { name: "triangles of 1e-6 to 1e4 m side by side", judge: |lab| flat(lab, &board(frames())) },
    Stiff { name: "one triangle over all beside many below a pixel", judge: |lab| flat(lab, &dust()) },
];

/// Below a millionth of what a pixel shows.
const NEEDLE_M: f32 = 1e-7;

/// A mesh in the plane z = 0, seen from two metres away.
fn board(mesh: Mesh) -> Case {
    seen(vec![Placed { mesh, world_from_mesh: at(DVec3::ZERO, 1.0), colour: [0.5, 0.4, 0.3] }])
}

/// The region is that around a board of two metres, however large a triangle is.
fn seen(parts: Vec<Placed>) -> Case {
    let mut scene = scene("board", parts);
    scene.bounds = Bounds { min: DVec3::splat(-1.0), max: DVec3::splat(1.0) };
    Case::look(scene, DVec3::new(0.2, 0.3, 2.0), DVec3::ZERO, 0.01)
}

/// A rectangle's corners in the plane z = 0, and its two triangles where they begin at `first`.
fn cell([left, bottom, right, top]: [f32; 4], first: u32) -> ([(Vec3, Vec3); 4], [u32; 6]) {
    let corners = [[left, bottom], [right, bottom], [right, top], [left, top]];
    (corners.map(|[x, y]| (Vec3::new(x, y, 0.0), Vec3::Z)), [0, 1, 2, 0, 2, 3].map(|index| first + index))
}

/// Rectangles that share no corner.
fn cells(rectangles: impl IntoIterator<Item = [f32; 4]>) -> Mesh {
    let cells = rectangles.into_iter().zip(0..).map(|(rectangle, place)| cell(rectangle, 4 * place));
    let (corners, indices): (Vec<_>, Vec<_>) = cells.unzip();
    mesh(corners.concat(), indices.concat())
}

/// Sixteen strips with a needle as high as the board between each two.
fn needles(width: f32) -> Mesh {
    const STRIPS: u32 = 16;
    let edge = |strip: u32| 2.0 * strip as f32 / STRIPS as f32 - 1.0;
    let strip = |strip: u32| [edge(strip) + if strip > 0 { width } else { 0.0 }, -1.0, edge(strip + 1), 1.0];
    let needle = |strip: u32| [edge(strip), -1.0, edge(strip) + width, 1.0];
    cells((0..STRIPS).map(strip).chain((1..STRIPS).map(needle)))
}

/// A board with triangles of one corner, of two, and of three in a line.
fn with_nothing() -> Mesh {
    let mut board = square();
    let middle = board.vertices.len() as u32;
    board.vertices.push(scene::Vertex { position: [0.0; 3], ..board.vertices[0] });
    board.indices.splice(0..0, [0, 0, 0, 1, 1, 2, 0, middle, 2]);
    sanitize(&mut board);
    board
}

/// A board with a triangle from corner to corner in its plane, next to nothing wide.
fn with_a_sliver() -> Mesh {
    let mut board = square();
    let middle = board.vertices.len() as u32;
    board.vertices.push(scene::Vertex { position: [NEEDLE_M, 0.0, 0.0], ..board.vertices[0] });
    board.indices.splice(0..0, [0, middle, 2]);
    board
}

/// A square of 1e-6 m in frames, each ten times as wide as the one inside of it, out to 1e4 m.
fn frames() -> Mesh {
    let half = |decade: i32| 10_f32.powi(decade);
    let frame = |decade: i32| {
        let (inner, outer) = (half(decade - 1), half(decade));
        [
            [-outer, -outer, -inner, outer],
            [inner, -outer, outer, outer],
            [-inner, -outer, inner, -inner],
            [-inner, inner, inner, outer],
        ]
    };
    let middle = [-half(-6), -half(-6), half(-6), half(-6)];
    cells([middle].into_iter().chain((-5..=4).flat_map(frame)))
}

/// Cells of a tenth of a pixel, before one triangle whose sides reach 1e4 m.
fn dust() -> Case {
    const CELLS: u32 = 160;
    const CELL_M: f32 = 1.5e-3;
    let step = |index: u32| CELL_M * (index as f32 - CELLS as f32 / 2.0);
    let fine = (0..CELLS * CELLS).map(|index| {
        let (x, y) = (index % CELLS, index / CELLS);
        [step(x), step(y), step(x + 1), step(y + 1)]
    });
    let far = [[-1e4, -1e4], [1e4, -1e4], [0.0, 1e4]].map(|[x, y]: [f32; 2]| (Vec3::new(x, y, 0.0), Vec3::Z));
    seen(vec![
        Placed { mesh: mesh(far, vec![0, 1, 2]), world_from_mesh: at(DVec3::NEG_Z, 1.0), colour: [0.3, 0.4, 0.6] },
        Placed { mesh: cells(fine), world_from_mesh: at(DVec3::ZERO, 1.0), colour: [0.7, 0.5, 0.2] },
    ])
}
