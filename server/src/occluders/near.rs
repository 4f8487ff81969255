//! Which samples may occlude which, and which are held already: by points in cells of space.

use std::collections::{HashMap, HashSet};

use camera::{Camera, ImagePoint, Pinhole};
use glam::{DVec3, IVec3};
use protocol::image::octahedral_normal;
use protocol::{Ball, Held, Purpose};
use rayon::prelude::*;

use crate::discretize::Capture;

/// A point of a surface.
#[derive(Debug, Clone, Copy)]
pub(super) struct Point {
    pub place: DVec3,
    pub normal: DVec3,
    pub object: u16,
}

/// Sine of the elevation up to which nothing occludes; what clients take it for (`client/occlusion.wgsl`).
const LEAST_SINE: f64 = 0.1;
/// Cells of what is occluded, in reaches.
const CELL_REACHES: f64 = 0.25;
/// A held sample stands for at most so many points along each axis of its pixel: on a floor that is seen at a grazing angle it is long.
const MOST_ALONG: f64 = 8.0;

fn cell_of(place: DVec3, cell_m: f64) -> IVec3 {
    (place / cell_m).floor().as_ivec3()
}

/// A cell's own offset and those of its neighbours.
fn around() -> impl Iterator<Item = IVec3> {
    let along = || -1..=1;
    along().flat_map(move |x| along().flat_map(move |y| along().map(move |z| IVec3::new(x, y, z))))
}

/// One of 26 ways that a normal may face.
fn facing(normal: DVec3) -> IVec3 {
    (1.4 * normal).round().as_ivec3()
}

/// The bit of a way in a set of them.
fn bit(facing: IVec3) -> u32 {
    1 << ((facing.x + 1) * 9 + (facing.y + 1) * 3 + facing.z + 1)
}

/// The ways that are less than a quarter turn from one.
fn alike(facing: IVec3) -> u32 {
    around().filter(|way| way.dot(facing) > 0).map(bit).fold(0, |set, bit| set | bit)
}

/// What something may occlude: of each cell a point for each way that a surface faces there.
#[derive(Debug)]
pub(super) struct Receivers {
    reach_m: f64,
    /// By cells of a reach.
    near: HashMap<IVec3, Vec<Point>>,
    known: HashSet<(IVec3, IVec3)>,
}

impl Receivers {
    pub fn new(reach_m: f64) -> Receivers {
        Receivers { reach_m, near: HashMap::new(), known: HashSet::new() }
    }

    pub fn add(&mut self, point: Point) {
        if self.known.insert((self.cell(point.place), facing(point.normal))) {
            self.near.entry(cell_of(point.place, self.reach_m)).or_default().push(point);
        }
    }

    /// Which of some points may occlude any: they lie within reach of one, and above its tangent plane. Those of a cell are taken for one.
    pub fn occluded_by(&self, points: impl Iterator<Item = Point>) -> HashSet<IVec3> {
        let firsts: HashMap<IVec3, DVec3> = points.map(|point| (self.cell(point.place), point.place)).collect();
        let firsts: Vec<(IVec3, DVec3)> = firsts.into_iter().collect();
        firsts.into_par_iter().filter(|(_, place)| self.is_above_any(*place)).map(|(cell, _)| cell).collect()
    }

    /// The cell of a place, as [`Receivers::occluded_by`] names it.
    pub fn cell(&self, place: DVec3) -> IVec3 {
        cell_of(place, CELL_REACHES * self.reach_m)
    }

    fn is_above_any(&self, place: DVec3) -> bool {
        let cell = cell_of(place, self.reach_m);
        let mut below = around().filter_map(|offset| self.near.get(&(cell + offset))).flatten();
        below.any(|point| {
            let way = place - point.place;
            let distance_m = way.length();
            distance_m < self.reach_m && way.dot(point.normal) > LEAST_SINE * distance_m
        })
    }
}

/// Where samples are held.
#[derive(Debug)]
pub(super) struct Covered {
    cell_m: f64,
    /// Of each cell and object: the ways that its surface faces there, see [`bit`].
    cells: HashMap<(IVec3, u16), u32>,
}

impl Covered {
    /// By what is held for the eye and as occluders within a ball; `spacing_m` apart, samples of one object count as one. What the eye holds
    /// also receives.
    pub fn new(held: &Held, ball: &Ball, spacing_m: f64, receivers: &mut Receivers) -> Covered {
        let mut covered = Covered { cell_m: spacing_m, cells: HashMap::new() };
        for held_patch in held.patches.values() {
            let (patch, is_seen) = (&held_patch.patch, held_patch.patch.purpose == Purpose::Eye);
            let (true, Camera::Pinhole(camera)) = (is_seen || patch.purpose == Purpose::Occluders, &patch.image.camera)
            else {
                continue;
            };
            let image = &patch.image;
            for (sample, (x, y)) in image.mask.occupied().enumerate() {
                let object = image.object[sample];
                let w = f64::from(image.depth_scale.w(image.depth[sample]));
                let captured = patch.objects.iter().find(|pose| pose.object == object);
                let now = captured.map(|pose| {
                    let now = held.poses_now.get(&object).unwrap_or(&pose.world_from_object);
                    *now * pose.world_from_object.inverse()
                });
                let moved = |point: DVec3| now.map_or(point, |now| now.transform_point3(point));
                let normal = octahedral_normal(image.normal[sample]).as_dvec3();
                let place = camera.world_from_image(ImagePoint { u: f64::from(x) + 0.5, v: f64::from(y) + 0.5, w });
                if !ball.has(moved(place)) {
                    continue;
                }
                let normal_now = now.map_or(normal, |now| now.transform_vector3(normal).normalize_or(normal));
                let point = |place: DVec3| Point { place: moved(place), normal: normal_now, object };
                if is_seen {
                    receivers.add(point(place));
                }
                covered.add_pixel(camera, (x, y), (place, normal), point);
            }
        }
        covered
    }

    /// All of a surface that a pixel shows.
    fn add_pixel(
        &mut self,
        camera: &Pinhole,
        (x, y): (u32, u32),
        (place, normal): (DVec3, DVec3),
        point: impl Fn(DVec3) -> Point,
    ) {
        let eye = camera.world_from_eye.translation;
        let height_m = normal.dot(place - eye);
        let on_plane = |u: f64, v: f64| {
            let ray = camera.world_from_eye.transform_vector(camera.ray_eye_from_image(u, v));
            let along = height_m / normal.dot(ray);
            (along.is_finite() && along > 0.0).then(|| eye + ray * along)
        };
        let (u, v) = (f64::from(x), f64::from(y));
        let span_m = |ends: [Option<DVec3>; 2]| match ends {
            [Some(a), Some(b)] => a.distance(b),
            _ => 0.0,
        };
        let count = |span_m: f64| (span_m / self.cell_m).ceil().clamp(1.0, MOST_ALONG) as u32;
        let across = count(span_m([on_plane(u, v + 0.5), on_plane(u + 1.0, v + 0.5)]));
        let down = count(span_m([on_plane(u + 0.5, v), on_plane(u + 0.5, v + 1.0)]));
        for (column, row) in (0..across).flat_map(|column| (0..down).map(move |row| (column, row))) {
            let share = |index: u32, of: u32| (f64::from(index) + 0.5) / f64::from(of);
            let along = on_plane(u + share(column, across), v + share(row, down));
            // Towards a horizon a plane goes on for ever.
            let along = along.filter(|along| along.distance(place) < MOST_ALONG * self.cell_m);
            self.add(point(along.unwrap_or(place)));
        }
    }

    pub fn add(&mut self, point: Point) {
        *self.cells.entry((cell_of(point.place, self.cell_m), point.object)).or_default() |= bit(facing(point.normal));
    }

    /// Whether the surface that has a point is held there.
    pub fn has(&self, point: Point) -> bool {
        let (cell, alike) = (cell_of(point.place, self.cell_m), alike(facing(point.normal)));
        around().any(|offset| self.cells.get(&(cell + offset, point.object)).is_some_and(|ways| ways & alike != 0))
    }
}

/// The samples of a capture that lie in a ball, with their indices.
pub(super) fn points_of(capture: &Capture, ball: &Ball) -> Vec<(usize, Point)> {
    let camera = capture.camera;
    let point = |index: usize| {
        let (x, y) = (index % camera.width_px as usize, index / camera.width_px as usize);
        let at = ImagePoint { u: x as f64 + 0.5, v: y as f64 + 0.5, w: capture.w(index).into() };
        let normal = octahedral_normal(capture.normal_code(index)).as_dvec3();
        (index, Point { place: camera.world_from_image(at), normal, object: capture.object(index) })
    };
    let is_in_ball = |(_, point): &(usize, Point)| ball.has(point.place);
    (0..capture.ids.len()).filter(|&index| capture.ids[index][0] != 0).map(point).filter(is_in_ball).collect()
}
