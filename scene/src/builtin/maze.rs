//! A maze of corridors with people in it, as in the graph camera's scenes.

use std::f64::consts::FRAC_PI_2;
use std::sync::Arc;

use glam::{DAffine3, DVec2, dvec2, dvec3, vec2, vec3};

use super::figure::{Figure, STRIDE_M, WARDROBE};
use super::kit::{EYE_HEIGHT_M, Kit, camera};
use super::mesher::Mesher;
use super::rng::Rng;
use super::texture;
use super::track::Track;
use crate::model::SceneCamera;

/// Cells a side.
pub(super) const CELLS: usize = 12;
const CELL_M: f64 = 2.6;
const WALL_HALF_M: f32 = 0.12;
const HEIGHT_M: f32 = 2.5;
const PEOPLE: usize = 19;
/// Cells that someone walks before turning back.
const ROUTE_CELLS: usize = 9;
/// People keep this far to the right of their corridor's middle.
const LANE_M: f64 = 0.36;
pub(super) const PERIOD_S: f64 = 90.0;

/// Which neighbours of a cell can be walked to: +x and +z of each cell.
pub(super) struct Plan {
    /// From the middle of a cell to the next one's.
    cell_m: f64,
    open_x: [[bool; CELLS]; CELLS],
    open_z: [[bool; CELLS]; CELLS],
}

impl Plan {
    /// The maze, its cells `cell_m` apart.
    pub fn of(cell_m: f64) -> Self {
        Plan::carve(&mut Rng::new(66), cell_m)
    }

    /// Depth-first carving, then a few walls more taken out so that there are ways around.
    fn carve(rng: &mut Rng, cell_m: f64) -> Self {
        let mut plan = Plan { cell_m, open_x: [[false; CELLS]; CELLS], open_z: [[false; CELLS]; CELLS] };
        let mut seen = [[false; CELLS]; CELLS];
        let mut trail = vec![(0usize, 0usize)];
        seen[0][0] = true;
        while let Some(&(i, j)) = trail.last() {
            let next: Vec<_> = around(i, j).filter(|&(a, b)| !seen[a][b]).collect();
            if next.is_empty() {
                trail.pop();
                continue;
            }
            let (a, b) = next[rng.index(next.len())];
            plan.open((i, j), (a, b));
            seen[a][b] = true;
            trail.push((a, b));
        }
        for _ in 0..16 {
            let (i, j) = (1 + rng.index(CELLS - 2), 1 + rng.index(CELLS - 2));
            plan.open((i, j), if rng.unit() < 0.5 { (i + 1, j) } else { (i, j + 1) });
        }
        plan
    }

    fn open(&mut self, (i, j): (usize, usize), (a, b): (usize, usize)) {
        if i == a {
            self.open_z[i][j.min(b)] = true;
        } else {
            self.open_x[i.min(a)][j] = true;
        }
    }

    pub fn is_open(&self, (i, j): (usize, usize), (a, b): (usize, usize)) -> bool {
        if i == a { self.open_z[i][j.min(b)] } else { self.open_x[i.min(a)][j] }
    }

    fn ways(&self, (i, j): (usize, usize)) -> Vec<(usize, usize)> {
        around(i, j).filter(|&to| self.is_open((i, j), to)).collect()
    }

    /// The middle of a cell.
    fn middle(&self, (i, j): (usize, usize)) -> DVec2 {
        (dvec2(i as f64, j as f64) - (CELLS as f64 - 1.0) / 2.0) * self.cell_m
    }
}

fn around(i: usize, j: usize) -> impl Iterator<Item = (usize, usize)> {
    [(i.wrapping_sub(1), j), (i + 1, j), (i, j.wrapping_sub(1)), (i, j + 1)]
        .into_iter()
        .filter(|&(a, b)| a < CELLS && b < CELLS)
}

fn plan() -> Plan {
    Plan::of(CELL_M)
}

pub(super) fn build() -> Kit {
    let mut kit = Kit::new(PERIOD_S);
    kit.walk = true;
    kit.daylight();
    let plan = plan();
    walls(&mut kit, &plan);
    let figures = figures(&mut kit);
    for (k, route) in routes(&plan).into_iter().enumerate() {
        figures[k % figures.len()].walk(&mut kit, &(Arc::new(move |share| route.walk(share)) as _));
    }
    kit.start = start(&plan);
    kit
}

/// Who walks in a maze.
pub(super) fn figures(kit: &mut Kit) -> [Figure; WARDROBE.len()] {
    let cloth = kit.painted("cloth");
    WARDROBE.map(|clothes| Figure::new(kit, cloth, clothes, [8, 2]))
}

/// Somebody's way through the maze, walked at about 1.25 m/s a whole number of times a period.
#[derive(Clone)]
pub(super) struct Route {
    track: Track,
    /// The share of the way where it starts.
    start: f64,
}

impl Route {
    /// The same way from another share of it on.
    pub fn starting_at(self, start: f64) -> Route {
        Route { start, ..self }
    }

    fn laps(&self) -> f64 {
        (1.25 * PERIOD_S / self.track.length_m()).round().max(1.0)
    }

    /// Standing on the way after a share of the period, `ahead_m` further on; +z is forward.
    pub fn pose(&self, share: f64, ahead_m: f64) -> DAffine3 {
        let gone_m = (self.start + self.laps() * share) * self.track.length_m() + ahead_m;
        self.track.pose(gone_m, 0.0, 0.2)
    }

    /// The place of a walker, and how far through a step cycle they are.
    pub fn walk(&self, share: f64) -> (DAffine3, f64) {
        let strides = (self.laps() * self.track.length_m() / STRIDE_M).round();
        (self.pose(share, 0.0), strides * share + self.start * 5.0)
    }
}

fn walls(kit: &mut Kit, plan: &Plan) {
    let floor = kit.textured("floor", texture::tiles([0xb8a98e, 0xa08f76], 0x756a5a, 4));
    let stone = kit.textured("stone", texture::brick(0xffffff, 0xbdb5a6, [4, 8], 0.06));
    let post = kit.textured("post", texture::marble(0xd8cfbd, 0x8f8371));
    let half = (CELLS as f64 / 2.0 * CELL_M) as f32 + 0.3;
    let mut mesher = Mesher::new();
    mesher.uv_per_m(0.4).cuboid_cells(vec3(-half, -0.2, -half), vec3(half, 0.0, half), [24, 1, 24]);
    let mesh = kit.mesh(mesher, floor);
    kit.place("floor", mesh, DAffine3::IDENTITY);

    let tones = [0xb9805f, 0x9fa889, 0xc4b07c, 0x8f9bab, 0xb59a9a];
    let panels = tones.map(|tone| {
        let mut mesher = Mesher::new();
        let length = CELL_M as f32 / 2.0;
        mesher.paint(tone).uv_per_m(0.6);
        mesher.cuboid_cells(vec3(-length, 0.0, -WALL_HALF_M), vec3(length, HEIGHT_M, WALL_HALF_M), [6, 6, 1]);
        kit.mesh(mesher, stone)
    });
    let (m, w) = (0.2, 0.26);
    let profile =
        [(0.0, 0.0), (w, 0.0), (w, 0.2), (m, 0.3), (m, HEIGHT_M), (w, HEIGHT_M + 0.08), (0.0, HEIGHT_M + 0.22)];
    let mut mesher = Mesher::new();
    mesher.uv_per_m(0.5).lathe(&profile.map(|(r, y)| vec2(r, y)), 8, 1.0);
    let post = kit.mesh(mesher, post);

    let corner = -(CELLS as f64) / 2.0 * CELL_M;
    for (i, j) in (0..=CELLS).flat_map(|i| (0..=CELLS).map(move |j| (i, j))) {
        let at = dvec3(corner + i as f64 * CELL_M, 0.0, corner + j as f64 * CELL_M);
        kit.place("post", post, DAffine3::from_translation(at));
        // Neighbouring quarters of the maze differ in colour, so that one finds one's way.
        let panel = panels[(i / 4 + 3 * (j / 4)) % panels.len()];
        let along_x = i < CELLS && (j == 0 || j == CELLS || !plan.open_z[i][j - 1]);
        if along_x {
            kit.place("wall", panel, DAffine3::from_translation(at + dvec3(CELL_M / 2.0, 0.0, 0.0)));
        }
        let along_z = j < CELLS && (i == 0 || i == CELLS || !plan.open_x[i - 1][j]);
        if along_z {
            let place = DAffine3::from_translation(at + dvec3(0.0, 0.0, CELL_M / 2.0));
            kit.place("wall", panel, place * DAffine3::from_rotation_y(FRAC_PI_2));
        }
    }
}

/// Each walks along corridors and back on the other side.
pub(super) fn routes(plan: &Plan) -> Vec<Route> {
    let mut rng = Rng::new(19);
    (0..PEOPLE)
        .map(|k| {
            let mut cells = vec![((k * 5) % CELLS, (k * 7 + k / 4) % CELLS)];
            while cells.len() < ROUTE_CELLS {
                let here = cells[cells.len() - 1];
                let next: Vec<_> = plan.ways(here).into_iter().filter(|to| !cells.contains(to)).collect();
                if next.is_empty() {
                    break;
                }
                cells.push(next[rng.index(next.len())]);
            }
            if cells.len() < 2 {
                cells.extend(plan.ways(cells[0]).first());
            }
            Route { track: there_and_back(plan, &cells), start: f64::from(rng.unit()) }
        })
        .collect()
}

/// On the right of the corridor's middle, both ways.
fn there_and_back(plan: &Plan, cells: &[(usize, usize)]) -> Track {
    let points: Vec<DVec2> = cells.iter().map(|&cell| plan.middle(cell)).collect();
    let right = |k: usize| {
        let step = |a: usize, b: usize| (points[b] - points[a]).normalize_or_zero().perp();
        let last = points.len() - 1;
        match k {
            0 => step(0, 1),
            _ if k == last => step(last - 1, last),
            _ if step(k - 1, k) == step(k, k + 1) => step(k, k + 1),
            _ => step(k - 1, k) + step(k, k + 1),
        }
    };
    let there = (0..points.len()).map(|k| points[k] + right(k) * LANE_M);
    let back = (0..points.len()).rev().map(|k| points[k] - right(k) * LANE_M);
    let corners: Vec<DVec2> = there.chain(back).collect();
    Track::around(&corners, 0.35)
}

/// Cells in a straight line that can be walked from `cell` through its neighbour `to`.
fn run(plan: &Plan, cell: (usize, usize), to: (usize, usize)) -> usize {
    let (mut here, mut next, mut cells) = (cell, to, 0);
    while plan.ways(here).contains(&next) {
        cells += 1;
        // Past the rim this wraps to a cell that is no neighbour.
        let beyond = |a: usize, b: usize| (2 * b).wrapping_sub(a);
        (here, next) = (next, (beyond(here.0, next.0), beyond(here.1, next.1)));
    }
    cells
}

/// Looking along the longest corridor that leaves a cell.
fn eye(plan: &Plan, cell: (usize, usize)) -> (usize, SceneCamera) {
    let longest = plan.ways(cell).into_iter().max_by_key(|&to| run(plan, cell, to));
    let to = longest.expect("every cell of the maze is reached");
    let (eye, way) = (plan.middle(cell), (plan.middle(to) - plan.middle(cell)).normalize());
    // A little aside, so that ways that turn off show.
    let way = way + way.perp() * 0.12;
    (run(plan, cell, to), camera(dvec3(eye.x, EYE_HEIGHT_M, eye.y), dvec3(way.x, -0.05, way.y)))
}

/// The longest view.
pub(super) fn start(plan: &Plan) -> Option<SceneCamera> {
    free_cells(plan).map(|cell| eye(plan, cell)).max_by_key(|(run, _)| *run).map(|(_, eye)| eye)
}

/// Middles of cells where nobody stands at the start, looking into a corridor.
pub(super) fn eyes() -> Vec<SceneCamera> {
    eyes_in(&plan())
}

/// The same in a maze of another size.
pub(super) fn eyes_in(plan: &Plan) -> Vec<SceneCamera> {
    free_cells(plan).step_by(5).map(|cell| eye(plan, cell).1).collect()
}

fn free_cells(plan: &Plan) -> impl Iterator<Item = (usize, usize)> + '_ {
    let people: Vec<DVec2> =
        routes(plan).iter().map(|route| route.pose(0.0, 0.0).translation).map(|at| dvec2(at.x, at.z)).collect();
    let cells = (0..CELLS * CELLS).map(|k| (k % CELLS, k / CELLS));
    cells.filter(move |&cell| people.iter().all(|person| person.distance(plan.middle(cell)) > 1.2))
}
