use std::collections::VecDeque;

use glam::{DVec2, DVec3};
use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::graph::{FaceDescription, FrustumDescription, GraphDescription, RootDescription};
use crate::{Bounds, HalfSpace, Pinhole, Rigid};

/// A map of free space, seen from above: a maze, or the floor plan of any scene. Cells are squares in the world's x and z; all
/// of them reach from one floor to one ceiling.
///
/// Cells are walked breadth first from an entrance, as in the papers (*Non-pinhole impostors*, section 5). Cells that are
/// walked straight on make one frustum, a *run*, which its rays fill: a run as wide as its face, seen from behind the face, lies
/// within the pyramid of rays. Where a run ends in a turn, its last cell is cut along the diagonal, and nearly all of the image
/// goes on round the corner; where it ends in two, each gets half. A turn before the end is a face in the run's side, which
/// the rays pass at a grazing angle. So every free cell that can be reached is seen once, without gaps. Rooms become runs
/// side by side.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CorridorMap {
    /// Cells along x.
    pub columns: usize,
    /// Row by row along z: whether nothing stands in a cell.
    pub free: Vec<bool>,
    /// The corner of the first cell with the least coordinates, on the floor, in world space.
    pub origin_world: DVec3,
    /// The side of a cell.
    pub cell_m: f64,
    /// From floor to ceiling.
    pub height_m: f64,
}

/// A direction on a [`CorridorMap`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Heading {
    /// Along the world's x, to the next column.
    PlusX,
    /// Against the world's x.
    MinusX,
    /// Along the world's z, to the next row.
    PlusZ,
    /// Against the world's z.
    MinusZ,
}

impl Heading {
    const ALL: [Heading; 4] = [Heading::PlusX, Heading::MinusX, Heading::PlusZ, Heading::MinusZ];

    fn step(self) -> (isize, isize) {
        match self {
            Heading::PlusX => (1, 0),
            Heading::MinusX => (-1, 0),
            Heading::PlusZ => (0, 1),
            Heading::MinusZ => (0, -1),
        }
    }

    /// The direction in world space, of unit length.
    pub fn forward_world(self) -> DVec3 {
        let (x, z) = self.step();
        DVec3::new(x as f64, 0.0, z as f64)
    }
}

/// Why a corridor map makes no camera.
#[derive(Debug, Error, Clone, Copy, PartialEq, Eq)]
pub enum CorridorMapError {
    /// The map has no columns, rows of different lengths, or sizes that are not positive and finite.
    #[error("the map has no cells, no full rows, or no size")]
    Size,
    /// The entrance is outside of the map or not free.
    #[error("nothing is free at the entrance")]
    Entrance,
}

impl CorridorMap {
    /// The camera of all free cells that can be reached from `entrance` (column, row), which is entered in the direction
    /// `heading`. The root's eye stands `setback_m` before that cell's face, and so do the centres of other frusta before theirs:
    /// from further away, what lies far off gets more of the image, and turns on the way get less. From eight cells away, an
    /// image 1,920 pixels wide holds all of a maze of some 50 cells; from one cell away, not half of it. The image shows the
    /// whole face, so its sides are best in proportion to `cell_m` and `height_m`. Frusta whose face spans less than
    /// `min_face_px` are left out.
    ///
    /// # Errors
    /// [`CorridorMapError`]; and the description is refused later where `setback_m` is not positive or the image is empty.
    pub fn describe(
        &self,
        entrance: (usize, usize),
        heading: Heading,
        setback_m: f64,
        size_px: (u32, u32),
        min_face_px: f64,
    ) -> Result<GraphDescription, CorridorMapError> {
        let is_size = |length_m: f64| length_m > 0.0 && length_m.is_finite();
        let is_map = self.columns > 0 && self.free.len().is_multiple_of(self.columns);
        if !(is_map && is_size(self.cell_m) && is_size(self.height_m) && self.origin_world.is_finite()) {
            return Err(CorridorMapError::Size);
        }
        let (column, row) = entrance;
        let first = row.checked_mul(self.columns).and_then(|cells| cells.checked_add(column));
        let first = first.filter(|&cell| column < self.columns && self.is_free(cell));
        let mut runs = self.runs(first.ok_or(CorridorMapError::Entrance)?, heading).into_iter();
        let root = runs.next().ok_or(CorridorMapError::Entrance)?;
        Ok(GraphDescription {
            root: RootDescription {
                name: root.name(self),
                pinhole: self.pinhole(&root, setback_m, size_px),
                limits: self.limits(&root),
            },
            frusta: runs.map(|run| self.frustum(&run, setback_m)).collect(),
            min_face_px,
        })
    }

    /// The column and row of the free cell that a point stands in or above; `None` outside of all.
    pub fn cell_of(&self, p_world: DVec3) -> Option<(usize, usize)> {
        let place = (p_world - self.origin_world) / self.cell_m;
        let (column, row) = (place.x.floor(), place.z.floor());
        if !(column >= 0.0 && row >= 0.0 && column < self.columns as f64 && row < self.free.len() as f64) {
            return None;
        }
        let (column, row) = (column as usize, row as usize);
        self.is_free(row * self.columns + column).then_some((column, row))
    }

    /// Whether the cell next to one is free.
    pub fn is_free_beside(&self, (column, row): (usize, usize), heading: Heading) -> bool {
        self.next(row * self.columns + column, heading).is_some_and(|cell| self.is_free(cell))
    }

    /// The up to four cells next to one, free or not.
    pub(super) fn beside(&self, (column, row): (usize, usize)) -> impl Iterator<Item = (usize, usize)> {
        let next = move |heading| self.next(row * self.columns + column, heading);
        let cells = Heading::ALL.into_iter().filter_map(next).filter(|&cell| cell < self.free.len());
        cells.map(|cell| (cell % self.columns, cell / self.columns))
    }

    fn is_free(&self, cell: usize) -> bool {
        self.free.get(cell).copied().unwrap_or(false)
    }

    /// The cell next to one, if it is on the map.
    fn next(&self, cell: usize, heading: Heading) -> Option<usize> {
        let (x, z) = heading.step();
        let column = (cell % self.columns).checked_add_signed(x).filter(|&column| column < self.columns)?;
        Some((cell / self.columns).checked_add_signed(z)? * self.columns + column)
    }

    /// The runs of a walk, breadth first, the entrance's first.
    pub(super) fn runs(&self, first: usize, heading: Heading) -> Vec<Run> {
        let entered = self.walk(first, heading);
        let mut runs = Vec::new();
        let root =
            Run { first, last: first, heading, parent: None, mouth: self.side(first, heading), cuts: Vec::new() };
        let mut waiting = VecDeque::from([root]);
        while let Some(mut run) = waiting.pop_front() {
            let goes_on = |from: usize, heading: Heading| {
                let next = self.next(from, heading)?;
                (entered.get(next) == Some(&Some((from, heading)))).then_some(next)
            };
            let mut cells = vec![run.first];
            while let Some(next) = goes_on(run.last, run.heading) {
                run.last = next;
                cells.push(next);
            }
            for from in cells {
                let turns = Heading::ALL.into_iter().filter(|&turn| turn != run.heading);
                let turns: Vec<_> = turns.filter_map(|turn| Some((turn, goes_on(from, turn)?))).collect();
                for &(turn, next) in &turns {
                    let mut mouth = self.side(next, turn);
                    if from == run.last {
                        mouth = self.corner(from, run.heading, turn, turns.len() > 1);
                        run.cuts.push(mouth.plane(turn));
                    }
                    let parent = Some(run.name(self));
                    waiting.push_back(Run { first: next, last: next, heading: turn, parent, mouth, cuts: Vec::new() });
                }
            }
            runs.push(run);
        }
        runs
    }

    /// For each cell the one that a walk breadth first comes to it from, and the direction; straight on comes first.
    fn walk(&self, first: usize, entrance: Heading) -> Vec<Option<(usize, Heading)>> {
        let mut entered = vec![None; self.free.len()];
        entered[first] = Some((first, entrance));
        let mut waiting = VecDeque::from([(first, entrance)]);
        while let Some((cell, heading)) = waiting.pop_front() {
            for turn in [heading].into_iter().chain(Heading::ALL) {
                let Some(next) = self.next(cell, turn).filter(|&next| self.is_free(next)) else { continue };
                // Rays come in through the entrance; none go out.
                let is_out = cell == first && turn.step() == (-entrance.step().0, -entrance.step().1);
                if entered[next].is_none() && !is_out {
                    entered[next] = Some((cell, turn));
                    waiting.push_back((next, turn));
                }
            }
        }
        entered
    }

    fn cell_bounds(&self, cell: usize) -> Bounds {
        let corner = |column: usize, row: usize, y_m: f64| {
            self.origin_world + DVec3::new(column as f64 * self.cell_m, y_m, row as f64 * self.cell_m)
        };
        let (column, row) = (cell % self.columns, cell / self.columns);
        Bounds { min: corner(column, row, 0.0), max: corner(column + 1, row + 1, self.height_m) }
    }

    /// All sides of a run but the one that it is entered through, and where it is cut at its end.
    pub(super) fn limits(&self, run: &Run) -> Vec<HalfSpace> {
        let bounds = self.cell_bounds(run.first).union(self.cell_bounds(run.last));
        let is_entry = |side: &HalfSpace| side.outward == -run.heading.forward_world();
        let sides = bounds.half_spaces().into_iter().filter(|side| !is_entry(side));
        sides.chain(run.cuts.iter().copied()).collect()
    }

    /// The side that a cell is entered through.
    fn side(&self, cell: usize, heading: Heading) -> Mouth {
        let Bounds { min, max } = self.cell_bounds(cell);
        let (a, b) = match heading {
            Heading::PlusX => (min, min.with_z(max.z)),
            Heading::MinusX => (max.with_z(min.z), max),
            Heading::PlusZ => (min, min.with_x(max.x)),
            Heading::MinusZ => (max.with_x(min.x), max),
        };
        let (a, b) = (a.with_y(min.y), b.with_y(min.y));
        Mouth { a, b, middle: a.midpoint(b) }
    }

    /// What a run that ends in `cell` goes over into a turn at: from the corner that the turn is made around to the opposite
    /// one, or, where the run turns to both sides, to the middle of the end.
    fn corner(&self, cell: usize, heading: Heading, turn: Heading, is_both: bool) -> Mouth {
        let Bounds { min, max } = self.cell_bounds(cell);
        let middle = min.midpoint(max).with_y(min.y);
        let [ahead, aside] = [heading, turn].map(|heading| heading.forward_world() * self.cell_m / 2.0);
        let far = if is_both { middle + ahead } else { middle + ahead - aside };
        Mouth { a: middle - ahead + aside, b: far, middle }
    }

    /// Where a run is seen from: halfway up, on its axis, before its mouth.
    fn centre(&self, run: &Run, setback_m: f64) -> DVec3 {
        run.mouth.middle + DVec3::Y * (self.height_m / 2.0) - run.heading.forward_world() * setback_m
    }

    fn pinhole(&self, root: &Run, setback_m: f64, (width_px, height_px): (u32, u32)) -> Pinhole {
        let centre_px = DVec2::new(width_px.into(), height_px.into()) / 2.0;
        let half_face_m = DVec2::new(self.cell_m, self.height_m) / 2.0;
        Pinhole {
            world_from_eye: Rigid::look_along(self.centre(root, setback_m), root.heading.forward_world()),
            width_px,
            height_px,
            focal_px: (centre_px / half_face_m).min_element() * setback_m,
            centre_px,
            near_m: setback_m,
        }
    }

    fn frustum(&self, run: &Run, setback_m: f64) -> FrustumDescription {
        let parent = run.parent.clone().unwrap_or_default();
        let (Mouth { a, b, .. }, up) = (run.mouth, DVec3::Y * self.height_m);
        FrustumDescription {
            name: run.name(self),
            centre: self.centre(run, setback_m),
            faces: vec![FaceDescription { parent, corners: vec![a, b, b + up, a + up] }],
            limits: self.limits(run),
        }
    }
}

/// Cells that are walked straight on.
pub(super) struct Run {
    first: usize,
    last: usize,
    pub heading: Heading,
    /// The name of the run that it turns off from; `None` for the entrance's.
    pub parent: Option<String>,
    pub mouth: Mouth,
    /// Where it goes over into turns at its end.
    pub cuts: Vec<HalfSpace>,
}

/// Where a run begins: a wall of rays from floor to ceiling.
#[derive(Clone, Copy)]
pub(super) struct Mouth {
    /// One end, on the floor, in world space.
    pub a: DVec3,
    /// The other end.
    pub b: DVec3,
    /// A point on the run's axis that it is set back from to be seen.
    pub middle: DVec3,
}

impl Mouth {
    /// The run before, as far as this mouth ends it; the one behind goes on along `heading`.
    pub fn plane(&self, heading: Heading) -> HalfSpace {
        let across = (self.b - self.a).cross(DVec3::Y);
        HalfSpace { point: self.a, outward: across * across.dot(heading.forward_world()).signum() }
    }
}

impl Run {
    /// From which cell to which, as (column, row).
    pub fn name(&self, map: &CorridorMap) -> String {
        let at = |cell: usize| (cell % map.columns, cell / map.columns);
        format!("{:?} to {:?}", at(self.first), at(self.last))
    }
}
