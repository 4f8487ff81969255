use glam::{DVec2, DVec3};

use super::CorridorMap;
use crate::convex::clip;
use crate::{Bounds, HalfSpace};

/// Cells a side.
const SIDE: usize = 512;
/// Parts of triangles in cells that are looked at, after which a floor counts as crowded: a few seconds of work.
const MOST_PARTS: u32 = 1 << 22;
/// A corridor has to be this many cells wide, to be told from what stands in it.
const LEAST_WIDTH_CELLS: f64 = 8.0;
/// Two widths of corridors are the same within this share: after half of [`SIDE`] / [`LEAST_WIDTH_CELLS`] squares, walls are
/// half a square beside.
const WIDTH_SHARE: f64 = 1.0 / 64.0;
/// Of the floor that can be reached, the share that may lie in squares that count as walls, and of unreachable floor in free ones.
const MISFIT_SHARE: f64 = 1.0 / 16.0;
/// Sides of a free square, on average, that are walls: a corridor has 2, a hall two squares wide 1, a room inside 0.
const LEAST_WALLS: f64 = 1.5;

/// Heights in metres of world space that a floor plan is made from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Storey {
    /// Where the floor lies.
    pub floor_m: f64,
    /// What reaches into the band between this height
    pub low_m: f64,
    /// and this one stands in the way.
    pub high_m: f64,
    /// Where the ceiling hangs; `None` under the sky.
    pub ceiling_m: Option<f64>,
}

/// The floor around a place, seen from above: 512 x 512 square cells, along the world's x and z, and what triangles take up of each
/// of them. It is made into a [`CorridorMap`] where its free space consists of corridors.
///
/// The papers (*Non-pinhole impostors*, section 5) walk a map of a maze that its maker gives. Here the squares of that map are
/// found: as wide as corridors are, which is the median of the free widths at all places that can be reached, and with their walls
/// on the squares' sides. Memory and time are bounded whatever is inserted.
#[derive(Debug, Clone)]
pub struct FloorGrid {
    storey: Storey,
    /// The corner with the least x and z.
    origin: DVec2,
    cell_m: f64,
    /// Row by row along z.
    cells: Vec<Filled>,
    parts: u32,
}

/// What stands in a cell.
#[derive(Debug, Clone, Copy)]
struct Filled {
    /// The least x and z of what reaches into the band; infinite where nothing does.
    min: DVec2,
    /// The greatest.
    max: DVec2,
    /// The greatest height of all that is above the band's lower end.
    top_m: f64,
}

impl Filled {
    const NOTHING: Filled = Filled { min: DVec2::INFINITY, max: DVec2::NEG_INFINITY, top_m: f64::NEG_INFINITY };

    fn is_free(&self) -> bool {
        self.min.x > self.max.x
    }
}

/// Free floor between two walls, along one axis.
#[derive(Debug, Clone, Copy)]
struct Gap {
    start_m: f64,
    /// Infinite where a wall is missing, or where the cell itself is filled.
    width_m: f64,
}

/// An axis of the floor: along x or along z.
#[derive(Clone, Copy)]
struct Axis(usize);

impl Axis {
    /// The cell with number `along` on a line of cells.
    fn cell(self, line: usize, along: usize) -> usize {
        if self.0 == 0 { line * SIDE + along } else { along * SIDE + line }
    }

    fn world(self) -> DVec3 {
        [DVec3::X, DVec3::Z][self.0]
    }
}

impl FloorGrid {
    /// An empty floor whose middle is below `p_world`; `None` where cells are no larger than what tells places there apart.
    pub fn new(p_world: DVec3, storey: Storey, cell_m: f64) -> Option<FloorGrid> {
        // A window of 2^9 cells, each told into 2^20 parts.
        let is_fine =
            p_world.is_finite() && cell_m.is_finite() && cell_m > p_world.abs().max_element() * 2f64.powi(-32);
        let is_storey = storey.floor_m <= storey.low_m && storey.low_m < storey.high_m;
        let origin = DVec2::new(p_world.x, p_world.z) - cell_m * (SIDE / 2) as f64;
        let cells = || vec![Filled::NOTHING; SIDE * SIDE];
        (is_fine && is_storey).then(|| FloorGrid { storey, origin, cell_m, cells: cells(), parts: 0 })
    }

    /// What triangles may lie in to count: the cells, from the band's lower end up to the ceiling.
    pub fn bounds(&self) -> Bounds {
        let side_m = self.cell_m * SIDE as f64;
        let min = DVec3::new(self.origin.x, self.storey.low_m, self.origin.y);
        let top_m = self.storey.ceiling_m.unwrap_or(f64::INFINITY);
        Bounds { min, max: DVec3::new(self.origin.x + side_m, top_m, self.origin.y + side_m) }
    }

    /// Notes a triangle, in world space, in every cell that it reaches into. Its part in a cell is found by clipping, so it is in
    /// no cell that only its bounds meet.
    pub fn insert(&mut self, triangle: [DVec3; 3]) {
        let is_finite = triangle.iter().all(|corner| corner.is_finite());
        if !is_finite || !Bounds::around(triangle).is_some_and(|bounds| bounds.meets(&self.bounds(), 0.0)) {
            return;
        }
        let storey = self.storey;
        let standing = clip(&triangle, &beyond(DVec3::Y, storey.low_m));
        let standing = clip(&standing, &before(DVec3::Y, storey.ceiling_m.unwrap_or(f64::MAX)));
        for row in self.reach(Axis(1), &standing) {
            self.parts += 1;
            let strip = self.part(Axis(1), row, &standing);
            for column in self.reach(Axis(0), &strip) {
                if self.is_crowded() {
                    return;
                }
                self.parts += 1;
                let part = self.part(Axis(0), column, &strip);
                let in_band = clip(&part, &before(DVec3::Y, storey.high_m));
                let filled = &mut self.cells[row * SIDE + column];
                for p in in_band {
                    let at = DVec2::new(p.x, p.z);
                    (filled.min, filled.max) = (filled.min.min(at), filled.max.max(at));
                }
                filled.top_m = part.iter().map(|p| p.y).fold(filled.top_m, f64::max);
            }
        }
    }

    /// The corridors around the middle; `None` where the floor is open or crowded, where walls do not lie on squares, or where there
    /// is no turn.
    pub fn corridors(&self) -> Option<CorridorMap> {
        let reached = self.reached();
        if self.is_crowded() || !reached.contains(&true) {
            return None;
        }
        let gaps = [self.gaps(Axis(0)), self.gaps(Axis(1))];
        let reached_cells = || (0..SIDE * SIDE).filter(|&cell| reached[cell]);
        let narrower_m = |cell: usize| gaps[0][cell].width_m.min(gaps[1][cell].width_m);
        let width_m = median(reached_cells().map(narrower_m).collect())?;
        if !width_m.is_finite() || width_m < LEAST_WIDTH_CELLS * self.cell_m {
            return None;
        }
        let wall_m = |axis: usize| {
            let is_corridor = |cell: &usize| (gaps[axis][*cell].width_m / width_m - 1.0).abs() <= WIDTH_SHARE;
            let nearest = reached_cells().filter(is_corridor).min_by_key(|&cell| from_middle(cell))?;
            Some(gaps[axis][nearest].start_m)
        };
        let map = self.map(DVec2::new(wall_m(0)?, wall_m(1)?), width_m, &reached)?;
        let middle = self.origin + self.cell_m * (SIDE / 2) as f64;
        let entrance = map.cell_of(DVec3::new(middle.x, self.storey.floor_m, middle.y))?;
        is_corridors(&map, entrance).then_some(map)
    }

    fn is_crowded(&self) -> bool {
        self.parts >= MOST_PARTS
    }

    /// The lines of cells that a polygon lies in, by number along an axis.
    fn reach(&self, axis: Axis, polygon: &[DVec3]) -> std::ops::Range<usize> {
        let Some(bounds) = Bounds::around(polygon.iter().copied()) else { return 0..0 };
        let number = |p: DVec3| (p.dot(axis.world()) - self.origin[axis.0]) / self.cell_m;
        let (first, last) = (number(bounds.min).floor().max(0.0), number(bounds.max).floor() + 1.0);
        // What is below zero becomes zero.
        first as usize..(last as usize).min(SIDE)
    }

    /// What of a polygon lies in a line of cells.
    fn part(&self, axis: Axis, line: usize, polygon: &[DVec3]) -> Vec<DVec3> {
        let at_m = |line: usize| self.origin[axis.0] + line as f64 * self.cell_m;
        let part = clip(polygon, &beyond(axis.world(), at_m(line)));
        clip(&part, &before(axis.world(), at_m(line + 1)))
    }

    /// Which cells can be walked to from those near the middle: the largest of such floors, as the middle itself may lie in
    /// something hollow.
    fn reached(&self) -> Vec<bool> {
        let near = SIDE / 2 - LEAST_WIDTH_CELLS as usize..SIDE / 2 + LEAST_WIDTH_CELLS as usize;
        let mut best = (0, vec![false; SIDE * SIDE]);
        let mut seen = best.1.clone();
        for start in near.clone().flat_map(|row| near.clone().map(move |column| row * SIDE + column)) {
            let mut waiting = vec![start];
            let mut floor = Vec::new();
            while let Some(cell) = waiting.pop() {
                if self.cells[cell].is_free() && !std::mem::replace(&mut seen[cell], true) {
                    floor.push(cell);
                    waiting.extend(beside(cell));
                }
            }
            if floor.len() > best.0 {
                best = (floor.len(), vec![false; SIDE * SIDE]);
                floor.into_iter().for_each(|cell| best.1[cell] = true);
            }
        }
        best.1
    }

    /// For each cell the free floor that it lies in along an axis.
    fn gaps(&self, axis: Axis) -> Vec<Gap> {
        let mut gaps = vec![Gap { start_m: f64::NAN, width_m: f64::INFINITY }; SIDE * SIDE];
        for line in 0..SIDE {
            let mut wall: Option<(usize, f64)> = None;
            for along in 0..SIDE {
                let filled = &self.cells[axis.cell(line, along)];
                if filled.is_free() {
                    continue;
                }
                if let Some((behind, start_m)) = wall {
                    let gap = Gap { start_m, width_m: filled.min[axis.0] - start_m };
                    (behind + 1..along).for_each(|free| gaps[axis.cell(line, free)] = gap);
                }
                wall = Some((along, filled.max[axis.0]));
            }
        }
        gaps
    }

    /// Squares of `width_m` with their sides through `corner`: free where most of their cells are reached.
    fn map(&self, corner: DVec2, width_m: f64, reached: &[bool]) -> Option<CorridorMap> {
        let origin = corner - ((corner - self.origin) / width_m).floor() * width_m;
        let side_m = self.cell_m * SIDE as f64;
        let [columns, rows] = ((self.origin + side_m - origin) / width_m).to_array().map(|count| count as usize);
        #[derive(Clone, Copy, Default)]
        struct Square {
            cells: u32,
            reached: u32,
            /// Free cells that are not.
            out: u32,
        }
        let mut squares = vec![Square::default(); columns * rows];
        for (cell, (filled, &is_reached)) in self.cells.iter().zip(reached).enumerate() {
            let middle = DVec2::new((cell % SIDE) as f64 + 0.5, (cell / SIDE) as f64 + 0.5);
            let place = ((self.origin + middle * self.cell_m - origin) / width_m).floor();
            let is_on_map = place.cmpge(DVec2::ZERO).all() && place.x < columns as f64 && place.y < rows as f64;
            if is_on_map {
                let square = &mut squares[place.y as usize * columns + place.x as usize];
                square.cells += 1;
                square.reached += u32::from(is_reached);
                square.out += u32::from(filled.is_free() && !is_reached);
            }
        }
        let is_free = |square: &Square| 2 * square.reached > square.cells;
        let wrong: u32 = squares.iter().map(|square| if is_free(square) { square.out } else { square.reached }).sum();
        let right: u32 = squares.iter().filter(|square| is_free(square)).map(|square| square.reached).sum();
        if f64::from(wrong) > MISFIT_SHARE * f64::from(right) {
            return None;
        }
        let top_m = self.storey.ceiling_m.or_else(|| self.walls_top_m(reached))?;
        let height_m = top_m - self.storey.floor_m;
        (height_m > 0.0 && height_m.is_finite()).then(|| CorridorMap {
            columns,
            free: squares.iter().map(is_free).collect(),
            origin_world: DVec3::new(origin.x, self.storey.floor_m, origin.y),
            cell_m: width_m,
            height_m,
        })
    }

    /// How high walls beside the reached floor are: most of them, as a house may stand among them, or a bench.
    fn walls_top_m(&self, reached: &[bool]) -> Option<f64> {
        let walls = (0..SIDE * SIDE).filter(|&cell| !self.cells[cell].is_free());
        let walls = walls.filter(|&cell| beside(cell).any(|next| reached[next]));
        median(walls.map(|cell| self.cells[cell].top_m).collect())
    }
}

/// Whether most sides of the free squares that can be walked to are walls, and there is a corner to be looked round.
fn is_corridors(map: &CorridorMap, entrance: (usize, usize)) -> bool {
    let mut seen = vec![false; map.free.len()];
    let mut waiting = vec![entrance];
    let (mut squares, mut walls, mut turns) = (0.0, 0.0, false);
    while let Some((column, row)) = waiting.pop() {
        if std::mem::replace(&mut seen[row * map.columns + column], true) {
            continue;
        }
        squares += 1.0;
        turns |= column != entrance.0 && row != entrance.1;
        for next in map.beside((column, row)) {
            let is_free = map.free[next.1 * map.columns + next.0];
            if is_free {
                waiting.push(next);
            } else {
                walls += 1.0;
            }
        }
    }
    turns && walls >= LEAST_WALLS * squares
}

/// The points with greater coordinates along an axis.
fn beyond(axis: DVec3, at_m: f64) -> HalfSpace {
    HalfSpace { point: axis * at_m, outward: -axis }
}

/// The points with lesser ones.
fn before(axis: DVec3, at_m: f64) -> HalfSpace {
    HalfSpace { point: axis * at_m, outward: axis }
}

/// The up to four cells next to one.
fn beside(cell: usize) -> impl Iterator<Item = usize> {
    let (column, row) = (cell % SIDE, cell / SIDE);
    let steps = [(-1, 0), (1, 0), (0, -1), (0, 1)];
    let next = move |(right, down)| {
        let (column, row) = (column.checked_add_signed(right)?, row.checked_add_signed(down)?);
        (column < SIDE && row < SIDE).then_some(row * SIDE + column)
    };
    steps.into_iter().filter_map(next)
}

/// Squared, in half cells.
fn from_middle(cell: usize) -> usize {
    let [column, row] = [cell % SIDE, cell / SIDE].map(|at| (2 * at + 1).abs_diff(SIDE));
    column * column + row * row
}

fn median(mut values: Vec<f64>) -> Option<f64> {
    let middle = values.len() / 2;
    (!values.is_empty()).then(|| *values.select_nth_unstable_by(middle, f64::total_cmp).1)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grid() -> FloorGrid {
        let storey = Storey { floor_m: 0.0, low_m: 1.0, high_m: 2.0, ceiling_m: None };
        FloorGrid::new(DVec3::ZERO, storey, 0.1).expect("a grid")
    }

    /// The parts by points spread over the triangle.
    #[test]
    fn a_triangle_fills_the_cells_that_it_reaches_into_and_no_others() {
        let mut grid = grid();
        let triangle = [DVec3::new(-3.03, 0.5, -2.01), DVec3::new(4.04, 2.6, 1.07), DVec3::new(2.55, 1.2, 3.33)];
        grid.insert(triangle);
        const STEPS: u32 = 2000;
        let mut hit = vec![false; SIDE * SIDE];
        for (i, j) in (0..=STEPS).flat_map(|i| (0..=STEPS - i).map(move |j| (i, j))) {
            let (b, c) = (f64::from(i) / f64::from(STEPS), f64::from(j) / f64::from(STEPS));
            let p = triangle[0] * (1.0 - b - c) + triangle[1] * b + triangle[2] * c;
            let cell = ((DVec2::new(p.x, p.z) - grid.origin) / grid.cell_m).floor().as_u64vec2();
            let cell = cell.y as usize * SIDE + cell.x as usize;
            if (1.0..=2.0).contains(&p.y) {
                hit[cell] = true;
                let filled = &grid.cells[cell];
                let slack_m = 1e-12;
                assert!(filled.min.x <= p.x + slack_m && p.z - slack_m <= filled.max.y, "{p} is in {filled:?}");
            }
        }
        let filled = grid.cells.iter().filter(|filled| !filled.is_free()).count();
        let found = hit.iter().filter(|hit| **hit).count();
        // Points are 4 mm apart, so corners of parts up to that size may have none.
        assert!(hit.iter().zip(&grid.cells).all(|(hit, filled)| !*hit || !filled.is_free()));
        assert!(filled >= found && filled <= found + found / 50, "{filled} filled, {found} found");
        assert!(found > 300, "{found}");
    }

    #[test]
    fn a_crowded_floor_has_no_corridors_and_takes_no_more() {
        let mut grid = grid();
        grid.parts = MOST_PARTS - 1;
        let wall = [DVec3::new(0.05, 1.0, -9.0), DVec3::new(0.05, 3.0, 0.0), DVec3::new(0.05, 1.0, 9.0)];
        grid.insert(wall);
        assert!(grid.parts <= MOST_PARTS + 1 && grid.corridors().is_none());
    }
}
