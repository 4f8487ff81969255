//! The maze with walls as thick as its corridors are wide, and a mirror that is rolled through it among the people.
//!
//! Thick walls make it a map of square cells ([`CorridorMap`]): cells of the maze lie at even columns and rows, what
//! connects or parts them between.

use std::f64::consts::PI;
use std::sync::Arc;

use camera::{CorridorMap, Trace};
use glam::{DAffine3, DVec3, Vec3, dvec3, vec2, vec3};

use super::kit::{Kit, path as path_of};
use super::maze::{self, CELLS, PERIOD_S, Plan, Route};
use super::mesher::Mesher;
use super::{teapots, texture};
use crate::model::{Material, SceneCamera};

/// Width of corridors and walls.
const BLOCK_M: f64 = 2.2;
const HEIGHT_M: f64 = 2.5;
/// Blocks a side, the outer walls included.
const COLUMNS: usize = 2 * CELLS + 1;
/// The pot of the table, 2.5 times as large, is 1 m from spout to handle and 0.47 m high.
const POT_SCALE: f32 = 2.5;
const STAND_M: f64 = 0.75;
/// The middle of the pot.
const MIRROR_HEIGHT_M: f64 = STAND_M + 0.22;
/// The one of the maze's ways that the mirror takes instead of a walker: with a long corridor, and away from where
/// others turn.
const MIRROR_ROUTE: usize = 12;
/// Where on its way it starts, as a share: 3 m into its longest straight corridor, of 17 m.
const MIRROR_START: f64 = 0.225;
/// Two people walk with it: one in front and one behind whoever follows it.
const COMPANIONS_M: [f64; 2] = [2.2, -3.4];

fn plan() -> Plan {
    Plan::of(2.0 * BLOCK_M)
}

/// The free cells, exactly: walls are blocks of the same size as corridors are wide.
pub(super) fn map() -> CorridorMap {
    let plan = plan();
    let free = |k: usize| {
        let (column, row) = (k % COLUMNS, k / COLUMNS);
        let cell = |column: usize, row: usize| (column / 2, row / 2);
        let is_rim = [column, row].iter().any(|&at| at == 0 || at == COLUMNS - 1);
        match (column % 2, row % 2) {
            (1, 1) => true,
            (0, 0) => false,
            _ if is_rim => false,
            (0, _) => plan.is_open(cell(column - 1, row), cell(column + 1, row)),
            _ => plan.is_open(cell(column, row - 1), cell(column, row + 1)),
        }
    };
    let half_m = COLUMNS as f64 * BLOCK_M / 2.0;
    CorridorMap {
        columns: COLUMNS,
        free: (0..COLUMNS * COLUMNS).map(free).collect(),
        origin_world: dvec3(-half_m, 0.0, -half_m),
        cell_m: BLOCK_M,
        height_m: HEIGHT_M,
    }
}

pub(super) fn build() -> Kit {
    let mut kit = Kit::new(PERIOD_S);
    kit.walk = true;
    kit.corridors = Some(map());
    kit.daylight();
    blocks(&mut kit);
    let plan = plan();
    let mirror = mirror_route(&plan);
    rolling_mirror(&mut kit, &mirror);
    let figures = maze::figures(&mut kit);
    let others = maze::routes(&plan).into_iter().enumerate().filter(|(k, _)| *k != MIRROR_ROUTE);
    for (k, route) in others {
        figures[k % figures.len()].walk(&mut kit, &(Arc::new(move |share| route.walk(share)) as _));
    }
    for (k, ahead_m) in COMPANIONS_M.into_iter().enumerate() {
        let route = mirror.clone();
        let walk = move |share| (route.pose(share, ahead_m), route.walk(share).1 + 0.3 * k as f64);
        figures[k].walk(&mut kit, &(Arc::new(walk) as _));
    }
    kit.start = maze::start(&plan);
    kit
}

fn mirror_route(plan: &Plan) -> Route {
    maze::routes(plan).swap_remove(MIRROR_ROUTE).starting_at(MIRROR_START)
}

fn blocks(kit: &mut Kit) {
    let floor = kit.textured("floor", texture::tiles([0xb8a98e, 0xa08f76], 0x756a5a, 4));
    let stone = kit.textured("stone", texture::brick(0xffffff, 0xbdb5a6, [4, 8], 0.06));
    let map = map();
    let half = (-map.origin_world.x) as f32;
    let mut mesher = Mesher::new();
    mesher.uv_per_m(0.4).cuboid_cells(vec3(-half, -0.2, -half), vec3(half, 0.0, half), [25, 1, 25]);
    let mesh = kit.mesh(mesher, floor);
    kit.place("floor", mesh, DAffine3::IDENTITY);
    let tones = [0xb9805f, 0x9fa889, 0xc4b07c, 0x8f9bab, 0xb59a9a];
    let blocks = tones.map(|tone| {
        let (half, height) = (BLOCK_M as f32 / 2.0, HEIGHT_M as f32);
        let mut mesher = Mesher::new();
        mesher.paint(tone).uv_per_m(0.6);
        mesher.cuboid_cells(vec3(-half, 0.0, -half), vec3(half, height, half), [3, 3, 3]);
        kit.mesh(mesher, stone)
    });
    for k in (0..map.free.len()).filter(|&k| !map.free[k]) {
        let (column, row) = (k % COLUMNS, k / COLUMNS);
        let at = map.origin_world + dvec3(column as f64 + 0.5, 0.0, row as f64 + 0.5) * BLOCK_M;
        // As in the maze, quarters differ in colour.
        let block = blocks[(column / 8 + 3 * (row / 8)) % blocks.len()];
        kit.place("wall", block, DAffine3::from_translation(at));
    }
}

/// A pot on a stand, which goes along a way; it looks forward with its spout.
fn rolling_mirror(kit: &mut Kit, route: &Route) {
    let base_colour = [0.95, 0.93, 0.9, 1.0];
    let silver = Material { metallic: 1.0, roughness: 0.0, double_sided: true, base_colour, ..Material::default() };
    let silver = kit.material(Material { name: "mirror".into(), ..silver });
    let pot = kit.mesh(teapots::pot(Vec3::splat(POT_SCALE)), silver);
    let wood = kit.textured("stand", texture::planks(0xa87a4c, 6));
    let mut stand = Mesher::new();
    let top = STAND_M as f32;
    let profile = [(0.0, 0.0), (0.26, 0.0), (0.26, 0.06), (0.12, 0.12), (0.12, top - 0.06), (0.28, top), (0.0, top)];
    stand.lathe(&profile.map(|(r, y)| vec2(r, y)), 24, 1.0);
    let stand = kit.mesh(stand, wood);
    // The spout points along the pot's +x, the way along +z.
    let turn = DAffine3::from_rotation_y(-PI / 2.0);
    let (mirror_way, stand_way) = (route.clone(), route.clone());
    kit.drive("mirror teapot", pot, move |share| {
        mirror_way.pose(share, 0.0) * DAffine3::from_translation(DVec3::Y * STAND_M) * turn
    });
    kit.drive("stand", stand, move |share| stand_way.pose(share, 0.0));
}

/// Middles of cells where nobody stands at the start; see [`super::walk_eyes`].
pub(super) fn eyes() -> Vec<SceneCamera> {
    maze::eyes_in(&plan())
}

/// From behind the mirror on its way: 1.8 m behind it as it rolls, or, where it stands, from 2.6 m behind it to 1.5 m.
pub(super) fn path(moving: bool) -> Trace {
    let route = mirror_route(&plan());
    path_of(|share, t_s| {
        let (gone, behind_m) = if moving { (t_s / PERIOD_S, 1.8) } else { (0.0, 2.6 - 1.1 * share) };
        let eye = route.pose(gone, -behind_m).translation;
        let target = route.pose(gone, 0.0).translation;
        (eye + DVec3::Y * 1.5, target + DVec3::Y * MIRROR_HEIGHT_M)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The column and row of a place.
    fn cell(map: &CorridorMap, at_world: DVec3) -> [usize; 2] {
        let offset = (at_world - map.origin_world) / map.cell_m;
        [offset.x as usize, offset.z as usize]
    }

    #[test]
    fn the_map_is_free_where_no_wall_stands() {
        let (map, scene) = (map(), build().finish("mirror-maze", false));
        let snapshot = scene.at(0.0);
        let mut free = vec![true; COLUMNS * COLUMNS];
        for (instance, place) in scene.instances.iter().zip(&snapshot.world_from_mesh) {
            let [column, row] = cell(&map, place.translation);
            free[row * COLUMNS + column] &= instance.name != "wall";
        }
        assert_eq!(map.free, free);
        assert!(map.free.iter().filter(|free| **free).count() > CELLS * CELLS);
    }

    #[test]
    fn the_mirror_stays_in_the_corridors_and_meets_nobody() {
        let (map, scene) = (map(), build().finish("mirror-maze-moving", true));
        let mirror = scene.instances.iter().position(|instance| instance.name == "mirror teapot").expect("is there");
        for step in 0..900 {
            let places = scene.at(f64::from(step) / 900.0 * PERIOD_S).world_from_mesh;
            let at = places[mirror].translation;
            // Half of a pot that is turned in any way.
            for (x, z) in [(-0.5, -0.5), (0.5, -0.5), (-0.5, 0.5), (0.5, 0.5)] {
                let [column, row] = cell(&map, at + dvec3(x, 0.0, z));
                assert!(map.free[row * COLUMNS + column], "step {step}: {at}");
            }
            for (instance, place) in scene.instances.iter().zip(&places) {
                // Half the pot's width and half of somebody's.
                let apart_m = (place.translation - at).with_y(0.0).length();
                assert!(instance.name != "torso" || apart_m > 0.3 + 0.25, "step {step}: {apart_m} m");
            }
        }
    }
}
