//! Depth images of cameras that are not pinholes, drawn from the scene, against the same cameras in f64.

mod common;

use camera::{Camera, CorridorMap, GraphCamera, Heading, ImagePoint, Pinhole, Rigid, Spoc};
use common::triangles::{distance_to_triangle, triangles};
use common::*;
use glam::{DAffine3, DQuat, DVec2, DVec3};
use scene::{Material, Scene};
use vantage_server::discretize::Discretization;
use vantage_server::impostors::Faces;
use vantage_server::impostors::draw::coverage::{covered_share, surface_points, world_sample};
use vantage_server::impostors::draw::{ImpostorCapture, ImpostorDrawer, Subject};
use vantage_server::render::SceneRenderer;

fn draw(renderer: &SceneRenderer, camera: &Camera, subject: Subject<'_>) -> ImpostorCapture {
    ImpostorDrawer::new(renderer).expect("a GPU").draw(renderer, camera, subject).expect("drawn")
}

/// How far samples lie from the very triangles that they name, in footprints: all but a thousandth of them, and all.
/// The rest are of slivers, whose depth a rasterizer rounds: its planes are too steep for f32.
fn worst_distances(scene: &Scene, capture: &ImpostorCapture) -> (f64, f64) {
    let triangles = triangles(scene);
    let distance = |index: usize| {
        let sample = world_sample(capture, index)?;
        let triangle = triangles[capture.ids[index][0] as usize - 1];
        Some(distance_to_triangle(sample.position_world, triangle) / sample.footprint_m)
    };
    let mut distances: Vec<f64> = (0..capture.ids.len()).filter_map(distance).collect();
    distances.sort_by(f64::total_cmp);
    (distances[(distances.len() - 1) * 999 / 1000], distances[distances.len() - 1])
}

fn occupied(capture: &ImpostorCapture) -> usize {
    (0..capture.ids.len()).filter(|&index| capture.is_occupied(index)).count()
}

fn object_named(scene: &Scene, name: &str) -> u16 {
    scene.instances.iter().position(|instance| instance.name == name).expect("it is there") as u16
}

/// The teapot that turns, and the camera around it from where the scene is looked at, its ring as wide as `ring` times
/// the sphere around the pot.
fn teapot(size_px: u32, ring: f64) -> (Scene, u16, Spoc) {
    let scene = scene::builtin::load("teapots").expect("built in");
    let object = object_named(&scene, "turning teapot");
    let points = surface_points(&scene, &scene.at(0.0), object, 4000);
    let bounds = camera::Bounds::around(points.iter().map(|point| point.position_world)).expect("a surface");
    let ring_m = ring * (bounds.max - bounds.min).length() / 2.0;
    let eye_world = DVec3::new(0.08, 0.36, 0.62);
    let spoc = Spoc::around(&bounds, eye_world, (size_px, size_px), ring_m).expect("an eye outside");
    (scene, object, spoc)
}

fn ball() -> Scene {
    scene(vec![sphere(32, 0)], vec![Material::default()], &[(0, DAffine3::IDENTITY)])
}

fn ball_spoc(size_px: u32) -> Spoc {
    let bounds = camera::Bounds { min: DVec3::splat(-1.0), max: DVec3::splat(1.0) };
    Spoc::around(&bounds, DVec3::new(0.0, 0.0, 4.0), (size_px, size_px), 2.0).expect("an eye outside")
}

#[test]
fn samples_lie_on_the_triangles_that_they_name() {
    let gpu = gpu();
    let (scene, _, spoc) = teapot(96, 1.0);
    let renderer = renderer(&gpu, &scene, &spoc.pinhole);
    let pinhole = draw(&renderer, &Camera::Pinhole(spoc.pinhole), Subject::ALL);
    let (most, worst) = worst_distances(&scene, &pinhole);
    assert!(occupied(&pinhole) > 3000 && most < 0.01 && worst < 0.5, "pinhole: {most}, {worst} footprints");
    let pushed = draw(&renderer, &Camera::Spoc(spoc), Subject::ALL);
    let (most, worst) = worst_distances(&scene, &pushed);
    // A quarter of a pixel at edges, a third inside.
    assert!(occupied(&pushed) > 3000 && most < 0.3 && worst < 0.5, "single pole: {most}, {worst} footprints");
}

#[test]
fn a_single_pole_image_holds_more_of_a_surface() {
    let gpu = gpu();
    for (ring, least_gain) in [(1.0, 1.18), (2.0, 1.3)] {
        let (scene, object, spoc) = teapot(96, ring);
        let renderer = renderer(&gpu, &scene, &spoc.pinhole);
        let subject = Subject { objects: &|id| id == object, faces: Faces::Front };
        let points = surface_points(&scene, &scene.at(0.0), object, 20_000);
        let share = |camera: Camera| covered_share(&points, &draw(&renderer, &camera, subject));
        let (by_pinhole, by_spoc) = (share(Camera::Pinhole(spoc.pinhole)), share(Camera::Spoc(spoc)));
        assert!(by_pinhole > 0.3 && by_pinhole < 0.4, "{by_pinhole}");
        assert!(by_spoc > least_gain * by_pinhole, "{by_spoc} against {by_pinhole} with a ring of {ring} radii");
    }
}

/// The direction in which a single-pole camera's ray goes on at a sample.
fn ray_world(spoc: &Spoc, capture: &ImpostorCapture, index: usize) -> DVec3 {
    let width = spoc.pinhole.width_px as usize;
    let ray = spoc.ray((index % width) as f64 + 0.5, (index / width) as f64 + 0.5);
    let z_m = 1.0 / f64::from(capture.w[index]);
    (ray.world_at(z_m * 1.0001) - ray.world_at(z_m)).normalize()
}

#[test]
fn sides_are_told_by_the_rays_of_the_camera_itself() {
    let gpu = gpu();
    let (scene, spoc) = (ball(), ball_spoc(96));
    let renderer = renderer(&gpu, &scene, &spoc.pinhole);
    let eye_world = spoc.pinhole.world_from_eye.translation;
    for (faces, sign) in [(Faces::Front, -1.0), (Faces::Back, 1.0)] {
        let subject = Subject { faces, ..Subject::ALL };
        let capture = draw(&renderer, &Camera::Spoc(spoc), subject);
        let mut behind_silhouette = 0;
        for index in (0..capture.ids.len()).filter(|&index| capture.is_occupied(index)) {
            let normal = capture.normal_world(index);
            let facing = sign * normal.dot(ray_world(&spoc, &capture, index));
            // Shading normals differ from a facet's by up to 3 degrees.
            assert!(facing > -0.08, "{faces:?}: {facing}");
            let from_eye = world_sample(&capture, index).expect("occupied").position_world - eye_world;
            behind_silhouette += usize::from(sign * normal.dot(from_eye.normalize()) < -0.05);
        }
        assert!(occupied(&capture) > 2000, "{faces:?}");
        let is_some = behind_silhouette > 100;
        assert_eq!(
            is_some,
            faces == Faces::Front,
            "{faces:?}: {behind_silhouette} that the eye takes for the other side"
        );
    }
}

/// What a camera's ray meets first of some triangles, and how deep inside of it, in barycentric coordinates: by brute
/// force.
fn first_hit(spoc: &Spoc, triangles: &[[DVec3; 3]], u: f64, v: f64, z_m: std::ops::Range<f64>) -> Option<f64> {
    const STEPS: usize = 400;
    let ray = spoc.ray(u, v);
    let at = |step: usize| z_m.start + (z_m.end - z_m.start) * step as f64 / STEPS as f64;
    let points: Vec<DVec3> = (0..=STEPS).map(|step| ray.world_at(at(step))).collect();
    points.windows(2).find_map(|ends| {
        triangles.iter().find_map(|[a, b, c]| {
            let normal = (b - a).cross(c - a);
            let (from, to) = ((ends[0] - a).dot(normal), (ends[1] - a).dot(normal));
            let p = (from < 0.0) != (to < 0.0);
            let p = p.then(|| ends[0] + (ends[1] - ends[0]) * (from / (from - to)))?;
            let share = |a: &DVec3, b: &DVec3| (b - a).cross(p - a).dot(normal) / normal.length_squared();
            let inside = share(a, b).min(share(b, c)).min(share(c, a));
            (inside > 0.0).then_some(inside)
        })
    })
}

/// How far from a sample's pixel the point of its triangle that has its depth lands, the nearest of all of them.
fn shift_px(spoc: &Spoc, triangles: &[[DVec3; 3]], capture: &ImpostorCapture, index: usize) -> Option<f64> {
    let position = world_sample(capture, index)?.position_world;
    let [a, b, c] = triangles[capture.ids[index][0] as usize - 1];
    let (normal, forward) = ((b - a).cross(c - a), spoc.pinhole.world_from_eye.transform_vector(DVec3::Z));
    let across = normal - forward * normal.dot(forward);
    let p = position - across * ((position - a).dot(normal) / across.length_squared());
    let (at, width) = (spoc.image_from_world(p)?, spoc.pinhole.width_px as usize);
    let centre_px = DVec2::new((index % width) as f64 + 0.5, (index / width) as f64 + 0.5);
    Some(DVec2::new(at.u, at.v).distance(centre_px))
}

/// A slanted square of 2 x 2 pairs of triangles across the pole, and one camera with the push at its steepest.
fn slanted() -> (Scene, Spoc) {
    let two_sided = Material { double_sided: true, ..Material::default() };
    let turn = DQuat::from_rotation_y(0.9) * DQuat::from_rotation_x(0.4) * DQuat::from_rotation_z(0.3);
    let place = DAffine3::from_scale_rotation_translation(DVec3::splat(1.4), turn, DVec3::new(0.1, -0.05, 0.0));
    let scene = scene(vec![square(2, 0)], vec![two_sided], &[(0, place)]);
    let pinhole = Pinhole { near_m: 0.5, ..looking_back(DVec3::new(0.0, 0.0, 3.0), 128) };
    let pinhole = Pinhole { focal_px: 75.0, ..pinhole };
    let centre_px = DVec2::splat(64.0);
    let spoc = Spoc { pinhole, pole_px: centre_px, push_from_m: 2.2, push_to_m: 3.7, push_max_px: 22.0, ramp_px: 14.0 };
    assert!(spoc.is_valid());
    (scene, spoc)
}

#[test]
fn large_triangles_across_the_pole_have_no_cracks_and_bow_as_they_should() {
    let gpu = gpu();
    let (scene, spoc) = slanted();
    let renderer = renderer(&gpu, &scene, &spoc.pinhole);
    let capture = draw(&renderer, &Camera::Spoc(spoc), Subject::ALL);
    let (most, worst) = worst_distances(&scene, &capture);
    assert!(most <= worst && worst < 0.3, "{worst} footprints");
    let triangles = triangles(&scene);
    let shift_px = |index: usize| shift_px(&spoc, &triangles, &capture, index);
    let worst_px = (0..capture.ids.len()).filter_map(shift_px).fold(0.0, f64::max);
    assert!(worst_px > 0.02 && worst_px < 0.3, "{worst_px} px from where the push takes the point of that depth");
    let mut held = 0;
    for index in 0..capture.ids.len() {
        let (u, v) = ((index % 128) as f64 + 0.5, (index / 128) as f64 + 0.5);
        let Some(_) = first_hit(&spoc, &triangles, u, v, 1.0..6.0) else { continue };
        // Beside the outline the exact hit may be a fraction of a pixel away from the drawn edge.
        let around = [(0.7, 0.0), (-0.7, 0.0), (0.0, 0.7), (0.0, -0.7)];
        let is_inner = around.iter().all(|(du, dv)| first_hit(&spoc, &triangles, u + du, v + dv, 1.0..6.0).is_some());
        assert!(!is_inner || capture.is_occupied(index), "a hole at {u}, {v}");
        held += usize::from(is_inner);
    }
    assert!(held > 2500, "{held} pixels inside of the outline");
}

#[test]
fn a_floor_from_behind_the_eye_is_clipped_at_the_near_plane() {
    let gpu = gpu();
    let floor = DAffine3::from_scale_rotation_translation(
        DVec3::splat(20.0),
        DQuat::from_rotation_x(-std::f64::consts::FRAC_PI_2),
        DVec3::new(0.0, -1.0, 0.0),
    );
    let scene = scene(vec![square(10, 0)], vec![Material::default()], &[(0, floor)]);
    let (_, spoc) = slanted();
    let renderer = renderer(&gpu, &scene, &spoc.pinhole);
    let capture = draw(&renderer, &Camera::Spoc(spoc), Subject::ALL);
    assert!((0..128).all(|x| capture.is_occupied(127 * 128 + x)), "the lowest row shows the floor");
    assert!(!capture.is_occupied(0), "the highest one does not");
    let (most, worst) = worst_distances(&scene, &capture);
    assert!(
        most < 0.3 && worst < 0.6,
        "{most}, {worst} footprints: the border of the ramp is crossed by edges of more steps than there are"
    );
}

#[test]
fn a_pinhole_draws_what_the_discretizer_does() {
    let gpu = gpu();
    let (scene, _, spoc) = teapot(96, 1.0);
    let renderer = renderer(&gpu, &scene, &spoc.pinhole);
    let ours = draw(&renderer, &Camera::Pinhole(spoc.pinhole), Subject::ALL);
    let theirs = captures(&renderer, &[spoc.pinhole], Discretization::Conventional).remove(0);
    assert_eq!((&ours.ids, &ours.colour), (&theirs.ids, &theirs.colour));
    assert!((0..ours.w.len()).all(|index| ours.w[index] == theirs.w(index)));
    assert_eq!(ours.depth_image(precision()), theirs.depth_image(precision()));
    // A push of nothing is a pinhole too.
    let without = Spoc { push_max_px: 0.0, ..spoc };
    let unpushed = draw(&renderer, &Camera::Spoc(without), Subject::ALL);
    let same = ours.ids.iter().zip(&unpushed.ids).filter(|(a, b)| a == b).count();
    assert!(same * 1000 >= ours.ids.len() * 995, "{same} of {} pixels", ours.ids.len());
}

fn precision() -> vantage_server::discretize::DepthPrecision {
    vantage_server::discretize::DepthPrecision::Finest
}

/// A corridor with two bends and a branch, closed all around but for its entrance: its walls lie exactly on the planes
/// of frusta.
fn corridor() -> (Scene, GraphCamera) {
    let (cell_m, height_m) = (2.6, 2.5);
    let rows = ["#.####", "#.####", "#...##", "###.##", "#....#", "######"];
    let free: Vec<bool> = rows.iter().flat_map(|row| row.chars().map(|cell| cell == '.')).collect();
    let origin_world = DVec3::new(-7.8, 0.1, 3.3);
    let map = CorridorMap { columns: 6, free: free.clone(), origin_world, cell_m, height_m };
    let mut placed = Vec::new();
    for (cell, _) in free.iter().enumerate().filter(|(_, free)| **free) {
        let (column, row) = (cell % 6, cell / 6);
        let middle =
            origin_world + DVec3::new((column as f64 + 0.5) * cell_m, height_m / 2.0, (row as f64 + 0.5) * cell_m);
        let mut wall = |outward: DVec3| {
            let half_m = DVec3::new(cell_m, height_m, cell_m) / 2.0;
            // They reach into each other: walls are meshes of their own, whose edges are rounded each for itself.
            let grown_m = half_m * 1.01;
            let turn = DQuat::from_rotation_arc(DVec3::Z, -outward);
            // The mesh's sides in world space; a cell is as deep as wide.
            let size = if outward.y == 0.0 {
                DVec3::new(grown_m.x, grown_m.y, 1.0)
            } else {
                DVec3::new(grown_m.x, grown_m.z, 1.0)
            };
            placed.push((0, DAffine3::from_scale_rotation_translation(size, turn, middle + outward * half_m)));
        };
        wall(DVec3::Y);
        wall(DVec3::NEG_Y);
        for (outward, next) in [
            (DVec3::X, Some(cell + 1)),
            (DVec3::NEG_X, Some(cell - 1)),
            (DVec3::Z, Some(cell + 6)),
            (DVec3::NEG_Z, cell.checked_sub(6)),
        ] {
            if next.is_some_and(|next| !free[next]) {
                wall(outward);
            }
        }
    }
    let scene = scene(vec![square(2, 0)], vec![Material::default()], &placed);
    let description = map.describe((1, 0), Heading::PlusZ, 10.0, (128, 123), 0.0).expect("the entrance is free");
    (scene, GraphCamera::from_description(&description).expect("a camera"))
}

#[test]
fn a_graph_camera_sees_round_corners_without_holes() {
    let gpu = gpu();
    let (scene, camera) = corridor();
    assert!(camera.frusta().len() >= 5, "{} frusta", camera.frusta().len());
    let renderer = renderer(&gpu, &scene, camera.root());
    let capture = draw(&renderer, &Camera::Graph(std::sync::Arc::new(camera.clone())), Subject::ALL);
    let mut frusta_seen = std::collections::HashSet::new();
    for index in 0..capture.ids.len() {
        let (u, v) = ((index % 128) as f64 + 0.5, (index / 128) as f64 + 0.5);
        let pieces = camera.ray(u, v);
        // The corridor is closed: every ray ends at a wall, where the last frustum on its way does.
        assert_eq!(capture.is_occupied(index), !pieces.is_empty(), "pixel {u}, {v}");
        if let Some(last) = pieces.last() {
            let error = (f64::from(capture.w[index]) / last.w_to - 1.0).abs();
            assert!(error < 1e-4, "w is off by {error} at {u}, {v}");
            let point = ImagePoint { u, v, w: capture.w[index].into() };
            frusta_seen.extend(camera.frustum_at(point));
        }
    }
    assert!(occupied(&capture) > 15_000 && frusta_seen.len() >= 5, "{} frusta seen", frusta_seen.len());
    let (most, worst) = worst_distances(&scene, &capture);
    assert!(most < 0.01 && worst < 0.05, "{most}, {worst} footprints");
}

#[test]
fn both_ways_of_telling_triangles_draw_the_same() {
    let gpu = gpu();
    assert!(gpu.caps.primitive_index, "this test compares with the native path");
    let (pots, _, spoc) = teapot(64, 1.0);
    let (halls, graph) = corridor();
    let cases = [
        (&pots, Camera::Pinhole(spoc.pinhole)),
        (&pots, Camera::Spoc(spoc)),
        (&halls, Camera::Graph(std::sync::Arc::new(graph))),
    ];
    for (scene, camera) in cases {
        let native = SceneRenderer::new(&gpu, scene).expect("the scene uploads");
        let pulled = SceneRenderer::with_pulling(&gpu, scene).expect("the scene uploads");
        let [ours, theirs] = [&native, &pulled].map(|renderer| draw(renderer, &camera, Subject::ALL));
        assert!(occupied(&ours) > 1000);
        assert_eq!((ours.ids, ours.w), (theirs.ids, theirs.w), "{camera:?}");
    }
}

#[test]
fn only_the_objects_asked_for_are_drawn_and_where_they_are_now() {
    let gpu = gpu();
    let scene = moving_ball(|time_s| swing(time_s, 4.0));
    let pinhole = Pinhole::symmetric(Rigid::IDENTITY, (64, 64), 1.0, 0.1);
    let pinhole = Pinhole { world_from_eye: Rigid::look_along(DVec3::ZERO, DVec3::NEG_Z), ..pinhole };
    let mut renderer = renderer(&gpu, &scene, &pinhole);
    let bounds = camera::Bounds { min: DVec3::new(-1.5, -0.5, -3.0), max: DVec3::new(1.5, 0.5, -2.0) };
    let spoc = Spoc::around(&bounds, DVec3::ZERO, (64, 64), 0.4).expect("an eye outside");
    let mut drawer = ImpostorDrawer::new(&renderer).expect("a GPU");
    let subject = Subject { objects: &|id| id == 1, faces: Faces::Front };
    for (time_s, x) in [(0.0, 0.0), (1.0, 1.0), (3.0, -1.0)] {
        renderer.update(&scene.at(time_s), DVec3::ZERO).expect("same scene");
        let capture = drawer.draw(&renderer, &Camera::Spoc(spoc), subject).expect("drawn");
        assert!(occupied(&capture) > 100);
        for index in (0..capture.ids.len()).filter(|&index| capture.is_occupied(index)) {
            let sample = world_sample(&capture, index).expect("occupied");
            let distance_m = sample.position_world.distance(DVec3::new(x, 0.0, -2.5));
            assert!(capture.object(index) == 1 && (distance_m - 0.4).abs() < 0.01, "{distance_m} m at {time_s} s");
        }
        let impostor = impostor::Impostor::new(capture.camera.clone(), &capture.samples()).expect("a sample each");
        assert!(impostor.bounds_world().is_some());
    }
}
