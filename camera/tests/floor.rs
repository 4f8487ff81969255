//! Corridors are found from what stands on a floor, and only where there are any.

use glam::{DVec2, DVec3};
use vantage_camera::{Bounds, CorridorMap, FloorGrid, Storey};

const MAZE: [&str; 7] = ["#########", "#...#...#", "#.#.#.#.#", "#.#...#.#", "#.#####.#", "#.......#", "#########"];
const HEIGHT_M: f64 = 2.5;

/// Where the map of a plan lies, and how large one of its cells is.
#[derive(Debug, Clone, Copy)]
struct Place {
    origin_world: DVec3,
    scale: f64,
}

const HERE: Place = Place { origin_world: DVec3::ZERO, scale: 1.0 };

impl Place {
    fn world(&self, p: DVec3) -> DVec3 {
        self.origin_world + p * self.scale
    }

    /// A grid around the middle of a cell, with 14 of its cells a cell.
    fn grid(&self, (column, row): (usize, usize)) -> FloorGrid {
        let heights = |y: f64| self.world(DVec3::Y * y).y;
        let storey = Storey { floor_m: heights(0.0), low_m: heights(0.5), high_m: heights(1.5), ceiling_m: None };
        let middle = self.world(DVec3::new(column as f64 + 0.5, 1.0, row as f64 + 0.5));
        FloorGrid::new(middle, storey, self.scale / 14.3).expect("a grid")
    }

    /// A box of 12 triangles.
    fn block(&self, grid: &mut FloorGrid, min: DVec3, max: DVec3) {
        let corners = Bounds { min, max }.corners().map(|p| self.world(p));
        let sides = [[0, 1, 3, 2], [4, 5, 7, 6], [0, 1, 5, 4], [2, 3, 7, 6], [0, 2, 6, 4], [1, 3, 7, 5]];
        for [a, b, c, d] in sides {
            grid.insert([corners[a], corners[b], corners[c]]);
            grid.insert([corners[a], corners[c], corners[d]]);
        }
    }

    /// A floor, and a block for each `#`.
    fn build(&self, rows: &[&str], grid: &mut FloorGrid) {
        self.block(grid, DVec3::new(-50.0, -0.2, -50.0), DVec3::new(50.0, 0.0, 50.0));
        for (row, text) in rows.iter().enumerate() {
            for (column, _) in text.chars().enumerate().filter(|(_, cell)| *cell == '#') {
                let min = DVec3::new(column as f64, 0.0, row as f64);
                self.block(grid, min, min + DVec3::new(1.0, HEIGHT_M, 1.0));
            }
        }
    }

    fn found(&self, rows: &[&str], middle: (usize, usize)) -> Option<CorridorMap> {
        let mut grid = self.grid(middle);
        self.build(rows, &mut grid);
        grid.corridors()
    }
}

/// Whether a map says of every cell of a plan what the plan does.
fn assert_is(rows: &[&str], place: &Place, map: &CorridorMap) {
    for (row, text) in rows.iter().enumerate() {
        for (column, cell) in text.chars().enumerate() {
            let middle = place.world(DVec3::new(column as f64 + 0.5, 0.0, row as f64 + 0.5));
            assert_eq!(map.cell_of(middle).is_some(), cell == '.', "{place:?}: column {column}, row {row}");
        }
    }
    let free = rows.iter().flat_map(|row| row.chars()).filter(|cell| *cell == '.').count();
    assert_eq!(map.free.iter().filter(|free| **free).count(), free, "{place:?}: nothing else is free");
}

#[test]
fn a_maze_of_blocks_is_found_at_any_size_and_place() {
    let far = DVec3::new(1e7, -2e6, 3e7);
    let places = [
        HERE,
        Place { origin_world: DVec3::new(0.3, 7.0, -0.7), scale: 2.2 },
        Place { origin_world: far, scale: 2.2 },
        Place { origin_world: DVec3::ZERO, scale: 1e5 },
        Place { origin_world: DVec3::ZERO, scale: 1e-4 },
    ];
    for place in places {
        let map = place.found(&MAZE, (1, 4)).expect("corridors");
        assert_is(&MAZE, &place, &map);
        // A wall's place is rounded by this much.
        let rounding_m = 1e-15 * place.origin_world.abs().max_element() + 1e-12 * place.scale;
        assert!((map.cell_m - place.scale).abs() <= 16.0 * rounding_m, "{place:?}: {} m", map.cell_m);
        assert!((map.height_m - HEIGHT_M * place.scale).abs() <= 16.0 * rounding_m, "{place:?}: {} m", map.height_m);
        let corner =
            DVec2::new(map.origin_world.x, map.origin_world.z) - DVec2::new(place.origin_world.x, place.origin_world.z);
        let beside = (corner / place.scale).round() * place.scale - corner;
        assert!(beside.abs().max_element() <= 64.0 * rounding_m, "{place:?}: walls are {beside} m beside");
    }
}

#[test]
fn who_stands_in_a_corridor_does_not_close_it() {
    let mut grid = HERE.grid((1, 4));
    HERE.build(&MAZE, &mut grid);
    for (x, z) in [(1.5, 4.5), (1.6, 2.5), (5.4, 5.4)] {
        let somebody = DVec3::new(0.15, 0.0, 0.12);
        let at = DVec3::new(x, 0.0, z);
        HERE.block(&mut grid, at - somebody, at + somebody + DVec3::Y * 1.8);
    }
    assert_is(&MAZE, &HERE, &grid.corridors().expect("corridors"));
}

#[test]
fn below_a_ceiling_corridors_reach_up_to_it() {
    let mut grid = FloorGrid::new(
        DVec3::new(1.5, 1.0, 4.5),
        Storey { floor_m: 0.0, low_m: 0.5, high_m: 1.5, ceiling_m: Some(2.0) },
        0.07,
    )
    .expect("a grid");
    HERE.build(&MAZE, &mut grid);
    assert_eq!(grid.corridors().expect("corridors").height_m, 2.0);
}

#[test]
fn open_places_rooms_and_walls_off_the_squares_have_none() {
    let pillars = [
        "##########",
        "#........#",
        "#.#..#..##",
        "#........#",
        "#........#",
        "#.#..#..##",
        "#........#",
        "##########",
    ];
    let room = ["######", "#....#", "#....#", "#....#", "######"];
    let straight = ["###", "#.#", "#.#", "#.#", "#.#", "#.#", "###"];
    for (rows, middle) in [(&pillars[..], (3, 3)), (&room, (2, 2)), (&straight, (1, 3)), (&[], (0, 0))] {
        assert_eq!(HERE.found(rows, middle), None, "{rows:?}");
    }
    let is_pillar = |k: usize| k.is_multiple_of(2);
    let pillar = |row: usize, column: usize| {
        let is_rim = [row, column].iter().any(|&k| k == 0 || k == 18);
        if is_rim || is_pillar(row) && is_pillar(column) { '#' } else { '.' }
    };
    let dense: Vec<String> = (0..19).map(|row| (0..19).map(|column| pillar(row, column)).collect()).collect();
    let dense: Vec<&str> = dense.iter().map(String::as_str).collect();
    assert_eq!(HERE.found(&dense, (9, 8)), None, "pillars as wide as what is between them");
    // Corridors of one width between walls of another do not lie on squares.
    for wall_m in [0.4, 1.3] {
        let mut grid = HERE.grid((1, 4));
        let at = |k: usize| (k / 2) as f64 * (1.0 + wall_m) + (k % 2) as f64 * wall_m;
        for (row, text) in MAZE.iter().enumerate() {
            for (column, _) in text.chars().enumerate().filter(|(_, cell)| *cell == '#') {
                let (min, max) = (DVec3::new(at(column), 0.0, at(row)), DVec3::new(at(column + 1), 2.0, at(row + 1)));
                HERE.block(&mut grid, min, max);
            }
        }
        assert_eq!(grid.corridors(), None, "walls of {wall_m} m");
    }
}

#[test]
fn from_a_crossing_there_is_no_corner_to_look_round() {
    let cross = ["#######", "###.###", "###.###", "#.....#", "###.###", "###.###", "#######"];
    assert_eq!(HERE.found(&cross, (3, 3)), None);
    assert_is(&cross, &HERE, &HERE.found(&cross, (3, 1)).expect("an arm turns"));
}

#[test]
fn what_is_no_triangle_or_no_place_is_passed_over() {
    let mut grid = HERE.grid((1, 4));
    HERE.build(&MAZE, &mut grid);
    let p = DVec3::new(1.5, 1.0, 4.5);
    for triangle in [[DVec3::NAN; 3], [p, p, DVec3::new(f64::INFINITY, 1.0, 0.0)], [p; 3]] {
        grid.insert(triangle);
    }
    assert_is(&MAZE, &HERE, &grid.corridors().expect("corridors"));
    for far in [DVec3::splat(1e15), DVec3::MAX] {
        grid.insert([far, -far, p]);
        assert_eq!(grid.corridors(), None, "a wall through everything");
    }
    let storey = Storey { floor_m: 0.0, low_m: 0.5, high_m: 1.5, ceiling_m: None };
    for (p_world, cell_m) in [(p, 0.0), (p, f64::NAN), (p, f64::INFINITY), (DVec3::NAN, 1.0), (DVec3::MAX, 1.0)] {
        assert!(FloorGrid::new(p_world, storey, cell_m).is_none(), "{p_world}, {cell_m} m");
    }
    assert!(FloorGrid::new(p, Storey { high_m: 0.5, ..storey }, 1.0).is_none(), "a band without height");
}
