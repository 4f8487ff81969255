//! What holds for every camera, way of walking and ray: what is hit is there, what is held is hit, and a search ends.

mod support;

use glam::DVec3;
use proptest::prelude::*;
use support::{Image, Point, Shown, scenes};
use vantage_impostor::{Hit, Method, Ray, Steps};

/// All but points spaced evenly in space: those leap over pixels where the projection is fast, as the papers say.
const METHODS: [Method; 3] = [Method::Fine, Method::Coarse { coarse_px: 6.0 }, Method::Hierarchy];

fn steps() -> impl Strategy<Value = Steps> {
    let method = prop::sample::select(METHODS.to_vec());
    (method, prop::sample::select(vec![0.25, 0.5, 1.0])).prop_map(|(method, fine_px)| Steps { method, fine_px })
}

fn unit() -> impl Strategy<Value = DVec3> {
    (-1.0..1.0_f64, 0.0..std::f64::consts::TAU).prop_map(|(height, angle)| {
        let across = (1.0 - height * height).sqrt();
        DVec3::new(across * angle.cos(), height, across * angle.sin())
    })
}

/// An image and a ray of its scene: at the pot from around it, or from anywhere in the maze.
fn image_and_ray() -> impl Strategy<Value = (usize, Ray)> {
    let at_pot = (0_usize..2, unit(), unit(), 0.0..1.2_f64)
        .prop_map(|(image, from, to, size)| (image, Ray::endless(from * 3.0, to * size - from * 3.0)));
    let in_maze = (2_usize..4, 0_usize..1000, (0.0..1.0_f64, 0.05..0.95_f64, 0.0..1.0_f64), unit()).prop_map(
        |(image, cell, at, way)| {
            let map = scenes::maze_map();
            let free: Vec<usize> = (0..map.free.len()).filter(|cell| map.free[*cell]).collect();
            let cell = free[cell % free.len()];
            let (column, row) = ((cell % map.columns) as f64, (cell / map.columns) as f64);
            let at_m = DVec3::new((column + at.0) * map.cell_m, at.1 * map.height_m, (row + at.2) * map.cell_m);
            (image, Ray::endless(map.origin_world + at_m, way * DVec3::new(1.0, 0.2, 1.0)))
        },
    );
    prop_oneof![2 => at_pot, 1 => in_maze]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 4096, failure_persistence: None, ..ProptestConfig::default() })]

    /// So a ray that passes clear of everything by more than that meets nothing.
    #[test]
    fn what_is_hit_is_there((image, ray) in image_and_ray(), steps in steps()) {
        let image = &scenes::IMAGES[image];
        let Some(hit) = image.impostor.hit(&ray, steps).hit else { return Ok(()) };
        let (distance_m, bound_m) = (image.scene.distance(hit.p_world), footprint_on_surface_m(image, &hit));
        prop_assert!(distance_m <= bound_m, "{hit:?} is {distance_m} m off, {bound_m} m");
        prop_assert!(hit.p_world.distance(ray.at(hit.t)) <= 1e-9);
    }

    #[test]
    fn nothing_is_hit_beyond_a_rays_ends((image, ray) in image_and_ray(), steps in steps(), share in 0.0..2.0_f64) {
        let impostor = &scenes::IMAGES[image].impostor;
        let Some(first) = impostor.hit(&ray, steps).hit else { return Ok(()) };
        // Not so near that the steps, which lie elsewhere on a shorter ray, may find it or not.
        let share = if (share - 1.0).abs() < 1e-3 { 0.999 } else { share };
        let short = impostor.hit(&Ray { t_to: first.t * share, ..ray }, steps).hit;
        let late = impostor.hit(&Ray { t_from: first.t * share, ..ray }, steps).hit;
        prop_assert!(short.is_none_or(|hit| hit.t <= first.t * share), "{first:?} {short:?}");
        prop_assert!(late.is_none_or(|hit| hit.t >= first.t * share), "{first:?} {late:?}");
    }

    #[test]
    fn what_is_held_is_hit((image, ray) in image_and_ray(), steps in steps()) {
        let image = &scenes::IMAGES[image];
        let hit = image.impostor.hit(&ray, steps).hit;
        let points = image.scene.points(ray.origin_world, ray.direction_world, 0.0, 1e3);
        let Some((point, slack_m)) = points.iter().find_map(|point| Some((point, held_within_m(image, &ray, point)?))) else {
            return Ok(());
        };
        let late_m = hit.map_or(f64::INFINITY, |hit| (hit.t - point.t) * ray.direction_world.length());
        prop_assert!(late_m <= slack_m, "{point:?}: {late_m} m behind it, {slack_m} m");
    }

    #[test]
    fn halving_finds_what_quarter_steps_find_or_earlier((image, ray) in image_and_ray()) {
        let image = &scenes::IMAGES[image];
        let hit = |method| image.impostor.hit(&ray, Steps { method, fine_px: 0.25 }).hit;
        for slow in [Method::Fine, Method::Coarse { coarse_px: 6.0 }] {
            let Some(slow) = hit(slow) else { continue };
            let t = hit(Method::Hierarchy).map_or(f64::INFINITY, |hit| hit.t);
            let slack_m = footprint_on_surface_m(image, &slow);
            let late_m = (t - slow.t) * ray.direction_world.length();
            prop_assert!(late_m <= slack_m / 8.0, "{late_m} m behind {slow:?}");
        }
    }
}

/// How long a pixel is on the surface: the greatest length around a hit. A hit lies on the plane of its pixel, at most half a
/// diagonal from the sample, which is on the surface; or between the planes of neighbours that count as one surface.
fn footprint_on_surface_m(image: &Image, hit: &Hit) -> f64 {
    let (x, y) = (i64::from(hit.pixel.0), i64::from(hit.pixel.1));
    let around = (0..9).filter_map(|i| image.at(x + i % 3 - 1, y + i / 3 - 1));
    around.map(|shown| shown.footprint_m / shown.cosine).fold(0.0, f64::max)
}

/// Where the image surely holds a point of a surface, how far behind it along the ray a hit may be: the pixel's and its
/// neighbours' samples lie on the same surface, within a footprint of its plane at the point, which the
/// camera sees at no more than 84 degrees and the ray at no more than 78. Then the ray crosses all that may be between in a footprint, taken
/// along the ray.
fn held_within_m(image: &Image, ray: &Ray, point: &Point) -> Option<f64> {
    let at = image.impostor.camera().image_from_world(point.p_world)?;
    let around = image.around(at.u.floor() as i64, at.v.floor() as i64)?;
    let footprint_m = around.iter().map(|shown| shown.footprint_m).fold(0.0, f64::max);
    let is_here = |shown: &Shown| {
        let off_m = (shown.p_world - point.p_world).dot(point.normal).abs();
        off_m < footprint_m && shown.normal.dot(point.normal) > 0.9 && shown.cosine > 0.1
    };
    let across = point.normal.dot(ray.direction_world.normalize()).abs();
    (around.iter().all(is_here) && across > 0.2).then_some(footprint_m / across)
}
