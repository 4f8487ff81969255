//! What the builders of graph cameras promise.

mod support;

use glam::{DVec2, DVec3};
use proptest::prelude::*;
use support::{at, corridors, pinhole, rotation};
use vantage_camera::{
    CorridorMap, CorridorMapError, FrustumId, GraphCamera, GraphDescription, GraphError, Heading, ImagePoint, Pinhole,
    Rigid, split_behind,
};

/// A map of 1 m cells, 1 m high, from the origin: rows of text, `#` for a wall.
fn drawn(rows: &[&str]) -> CorridorMap {
    CorridorMap {
        columns: rows[0].len(),
        free: rows.iter().flat_map(|row| row.chars()).map(|cell| cell != '#').collect(),
        origin_world: DVec3::ZERO,
        cell_m: 1.0,
        height_m: 1.0,
    }
}

/// Which cells a walk from the first one comes to, when it does not leave through the entrance (which is at the map's edge).
fn reached(map: &CorridorMap) -> Vec<bool> {
    let mut reached = vec![false; map.free.len()];
    let mut waiting = vec![(0_isize, 0_isize)];
    let columns = map.columns as isize;
    let rows = map.free.len() as isize / columns;
    while let Some((column, row)) = waiting.pop() {
        let is_on_map = (0..columns).contains(&column) && (0..rows).contains(&row);
        let cell = row * columns + column;
        if is_on_map && map.free[cell as usize] && !std::mem::replace(&mut reached[cell as usize], true) {
            waiting.extend([(column + 1, row), (column - 1, row), (column, row + 1), (column, row - 1)]);
        }
    }
    reached
}

proptest! {
    /// What is too small in the image is left out of the description too, and the rest makes the same camera.
    #[test]
    fn a_description_less_what_is_cut_makes_the_same_camera((_, description) in corridors(), min_face_px in 0.0..40.0_f64) {
        let whole = GraphDescription { min_face_px, ..description };
        let camera = GraphCamera::from_description(&whole).expect("a camera");
        let kept = camera.description();
        let names: Vec<&str> = camera.frusta().iter().map(|frustum| frustum.name()).collect();
        prop_assert!(kept.frusta.iter().all(|frustum| names.contains(&frustum.name.as_str())));
        prop_assert!(GraphCamera::from_description(kept).expect("a camera") == camera);
    }

    /// Every point of a free cell that can be reached has an image, and no point of any other cell has one.
    #[test]
    fn corridors_are_seen_whole((map, description) in corridors(), inside in prop::array::uniform3(0.001..0.999_f64)) {
        let all = GraphDescription { min_face_px: 0.0, ..description };
        let camera = GraphCamera::from_description(&all).expect("a camera");
        for (cell, is_reached) in reached(&map).into_iter().enumerate() {
            let (column, row) = ((cell % map.columns) as f64, (cell / map.columns) as f64);
            let p = map.origin_world
                + DVec3::new(column + inside[0], inside[1] * map.height_m / map.cell_m, row + inside[2]) * map.cell_m;
            prop_assert_eq!(camera.image_from_world(p).is_some(), is_reached, "cell {} {}", column, row);
        }
    }

    /// Before the split plane it is the view itself; behind it, both halves reach the plane between them.
    #[test]
    fn a_split_view_begins_as_the_view(view in pinhole(), split in (0.2..0.8_f64, 1.5..100.0_f64), shift in 0.0..0.5_f64, at in at(), depth in 0.0..1.0_f64) {
        // Up to 100,000 times as far out as its near plane is wide: further out it is lost in the rounding of its place.
        let size_px = DVec2::new(view.width_px.into(), view.height_px.into());
        let nearer = 1e5 / 1e7 * size_px.min_element() / view.focal_px * view.near_m;
        let place = view.world_from_eye.translation * nearer;
        let view = Pinhole { world_from_eye: Rigid { translation: place, ..view.world_from_eye }, ..view };
        let z_m = view.near_m * split.1;
        let split_world = view.world_from_image(ImagePoint { u: split.0 * size_px.x, v: 0.5 * size_px.y, w: 1.0 / z_m });
        let description = split_behind(&view, split_world, shift * z_m, 2.0 * z_m);
        let camera = GraphCamera::from_description(&description).expect("a camera");
        let uv = size_px * (0.5 + (at - 0.5) * 0.99);
        let z = view.near_m * 1.001 + (0.999 * z_m - view.near_m * 1.001) * depth;
        let p = view.world_from_image(ImagePoint { u: uv.x, v: uv.y, w: 1.0 / z });
        let (here, there) = (camera.image_from_world(p), view.image_from_world(p));
        prop_assert!(here.is_some() && there.is_some(), "{here:?} {there:?}");
        let ((here, found), there) = (here.expect("checked"), there.expect("checked"));
        prop_assert_eq!(found, FrustumId::ROOT);
        let rounding_m = 32.0 * f64::EPSILON * (p.abs().max_element() + view.world_from_eye.translation.abs().max_element());
        let slack_px = rounding_m * there.w * (view.focal_px + uv.distance(view.centre_px)) + 64.0 * f64::EPSILON * (uv.length() + view.centre_px.length());
        prop_assert!(DVec2::new(here.u, here.v).distance(DVec2::new(there.u, there.v)) <= slack_px, "{here:?} {there:?} {slack_px:e}");
    }

    /// With no shift the three frusta are the view, cut into parts.
    #[test]
    fn a_split_without_a_shift_changes_nothing(rotation in rotation(), at in at(), depth in 0.0..1.0_f64) {
        let view = Pinhole::symmetric(Rigid { rotation, translation: DVec3::ONE }, (640, 480), 1.0, 0.5);
        let split_world = view.world_from_eye.transform_point(DVec3::new(0.2, -0.3, 2.0));
        let camera = GraphCamera::from_description(&split_behind(&view, split_world, 0.0, 8.0)).expect("a camera");
        let uv = DVec2::new(640.0, 480.0) * (0.5 + (at - 0.5) * 0.99);
        let p = view.world_from_image(ImagePoint { u: uv.x, v: uv.y, w: 1.0 / (0.51 + 7.48 * depth) });
        let (point, _) = camera.image_from_world(p).expect("in the view");
        // A few roundings of pixels, through three matrices.
        prop_assert!(uv.distance(DVec2::new(point.u, point.v)) <= 256.0 * f64::EPSILON * 800.0, "{uv} {point:?}");
        prop_assert!((point.w * (0.51 + 7.48 * depth) - 1.0).abs() <= 256.0 * f64::EPSILON);
    }
}

/// The purpose (Rosen and others, section 6.3): both sides of what stands in the middle are seen.
#[test]
fn a_split_view_sees_round_both_sides() {
    let view = Pinhole::symmetric(Rigid::look_at(DVec3::Z * 4.0, DVec3::ZERO), (640, 480), 1.0, 0.5);
    let camera = GraphCamera::from_description(&split_behind(&view, DVec3::ZERO, 1.5, 8.0)).expect("a camera");
    let ball_m = 0.8;
    let hits_ball = |x: f64| {
        let p = DVec3::new(x, 0.0, -1.5);
        let (point, _) = camera.image_from_world(p).expect("behind the split");
        let pieces = camera.ray(point.u, point.v);
        pieces.iter().any(|piece| {
            (0..=1000)
                .map(|step| piece.from_world.lerp(piece.to_world, f64::from(step) / 1000.0))
                .take_while(|on_ray| on_ray.z > p.z)
                .any(|on_ray| on_ray.length() < ball_m)
        })
    };
    // From the eye, the ball covers 1.12 m to either side there.
    let hides = ball_m / (16.0 - ball_m * ball_m).sqrt() * 5.5;
    assert!(hides > 1.1);
    for x in [0.8, 0.9, 1.0] {
        assert!(!hits_ball(x) && !hits_ball(-x), "{x} m beside the middle is seen");
    }
    assert!(hits_ball(0.1), "right behind it is not");
    // Beyond the outermost rays, which turn inwards, nothing is.
    let outermost = view.ray_eye_from_image(0.0, 240.0) * 5.4;
    assert_eq!(camera.image_from_world(view.world_from_eye.transform_point(outermost)), None);
}

#[test]
fn a_split_point_out_of_view_is_refused() {
    let view = Pinhole::symmetric(Rigid::IDENTITY, (640, 480), 1.0, 0.5);
    for (split_world, far_m) in
        [(DVec3::Z * -1.0, 8.0), (DVec3::Z * 0.4, 8.0), (DVec3::new(9.0, 0.0, 2.0), 8.0), (DVec3::Z * 2.0, 1.0)]
    {
        assert!(
            GraphCamera::from_description(&split_behind(&view, split_world, 0.3, far_m)).is_err(),
            "{split_world} {far_m}"
        );
    }
    let behind = GraphCamera::from_description(&split_behind(&view, DVec3::Z * 2.0, 0.3, 1.0));
    assert_eq!(behind, Err(GraphError::NoVolume { name: "left".to_owned() }));
}

#[test]
fn a_maze_is_walked_breadth_first_in_straight_runs() {
    let map = drawn(&[
        ".####", //
        "....#", ".##.#", "....#", "##.##",
    ]);
    let description = map.describe((0, 0), Heading::PlusZ, 1.0, (800, 800), 0.0).expect("a map");
    let runs: Vec<&str> = description.frusta.iter().map(|frustum| frustum.name.as_str()).collect();
    assert_eq!(description.root.name, "(0, 0) to (0, 3)");
    // Both ways round reach the cell left of the middle's; the one walked first has it.
    assert_eq!(runs, ["(1, 1) to (3, 1)", "(1, 3) to (3, 3)", "(3, 2) to (3, 2)", "(2, 4) to (2, 4)"]);
    // Seen from 1 m before its face of 800 px, the first run's end, 5 m away, spans 160.
    let camera = GraphCamera::from_description(&description).expect("a camera");
    let end = camera.frusta()[0].image_from_world(DVec3::new(1.0, 0.0, 4.0)).expect("in the root");
    assert!((end.u - 400.0).abs() - 80.0 < 1e-9 && (end.w - 0.2).abs() < 1e-15, "{end:?}");
    let cut = map.describe((0, 0), Heading::PlusZ, 1.0, (800, 800), 20.0).expect("a map");
    let cut = GraphCamera::from_description(&cut).expect("a camera");
    assert!(cut.frusta().len() < camera.frusta().len(), "narrow faces are left out");
}

/// Seen from a cell's length before a cell of 800 px, the outer corner at its end is half as far from the axis as the inner one.
#[test]
fn turns_at_an_end_share_the_image() {
    let spans_px = |rows: &[&str], entrance| {
        let description = drawn(rows).describe(entrance, Heading::PlusZ, 1.0, (800, 800), 0.0).expect("a map");
        let camera = GraphCamera::from_description(&description).expect("a camera");
        let spans = camera.frusta()[1..].iter().map(|frustum| frustum.image_bounds());
        spans.map(|image| (image.max_px - image.min_px).x.round()).collect::<Vec<_>>()
    };
    assert_eq!(spans_px(&[".."], (0, 0)), [600.0], "one turn has all of the image but what the outer wall takes");
    assert_eq!(spans_px(&["..."], (1, 0)), [400.0, 400.0], "two share it");
}

/// The papers' picture (*Non-pinhole approximations*, figure 6): a whole maze in 1,920 by 1,175 pixels.
#[test]
fn a_maze_is_held_whole_from_far_enough_back() {
    let map = drawn(&[
        "#.#########", //
        "#.....#...#",
        "#####.#.#.#",
        "#...#.#.#.#",
        "#.#.#...#.#",
        "#.#.#####.#",
        "#.#.......#",
        "#.#######.#",
        "#.....#...#",
        "#####...#.#",
        "###########",
    ]);
    let seen = |setback_m: f64| {
        let description = map.describe((1, 0), Heading::PlusZ, setback_m, (1920, 1175), 1.0).expect("a map");
        let camera = GraphCamera::from_description(&description).expect("a camera");
        let middle = |cell: usize| DVec3::new((cell % 11) as f64 + 0.5, 0.5, (cell / 11) as f64 + 0.5);
        let free = (0..map.free.len()).filter(|&cell| map.free[cell]);
        free.map(middle).filter(|&p| camera.image_from_world(p).is_some()).count()
    };
    assert_eq!(seen(8.0), map.free.iter().filter(|free| **free).count(), "eight cells");
    assert!(seen(1.0) < seen(8.0) / 2, "from near, turns on the way take it all: {}", seen(1.0));
}

#[test]
fn rays_do_not_go_back_through_the_entrance() {
    let map = drawn(&["..", ".."]);
    let description = map.describe((0, 1), Heading::PlusZ, 1.0, (100, 100), 0.0).expect("a map");
    let camera = GraphCamera::from_description(&description).expect("a camera");
    let is_seen = |x: f64, z: f64| camera.image_from_world(DVec3::new(x, 0.5, z)).is_some();
    assert!(
        is_seen(0.5, 1.5) && is_seen(1.5, 1.5) && is_seen(1.5, 0.5) && is_seen(0.5, 0.5),
        "the one before by a detour"
    );
}

#[test]
fn a_map_without_cells_or_sizes_is_refused() {
    let map = drawn(&["..#", "..."]);
    let refused =
        |map: &CorridorMap, entrance| map.describe(entrance, Heading::PlusX, 1.0, (64, 64), 0.0).expect_err("refused");
    for entrance in [(2, 0), (3, 0), (0, 2), (usize::MAX, 0), (0, usize::MAX)] {
        assert_eq!(refused(&map, entrance), CorridorMapError::Entrance);
    }
    for bad in [
        CorridorMap { columns: 0, ..map.clone() },
        CorridorMap { columns: 4, ..map.clone() },
        CorridorMap { cell_m: 0.0, ..map.clone() },
        CorridorMap { height_m: f64::NAN, ..map.clone() },
        CorridorMap { origin_world: DVec3::INFINITY, ..map.clone() },
    ] {
        assert_eq!(refused(&bad, (0, 0)), CorridorMapError::Size);
    }
    let description = map.describe((0, 0), Heading::PlusX, 0.0, (64, 64), 0.0).expect("it is checked later");
    assert_eq!(
        GraphCamera::from_description(&description),
        Err(GraphError::Number { name: description.root.name.clone() })
    );
}

/// What a view from the middle of a cell sees, 90 degrees wide.
fn view_along(map: &CorridorMap, cell: (usize, usize), heading: Heading) -> Pinhole {
    let (x, z) = (cell.0 as f64 + 0.5, cell.1 as f64 + 0.5);
    let eye_world = map.origin_world + DVec3::new(x * map.cell_m, map.height_m / 2.0, z * map.cell_m);
    let world_from_eye = Rigid::look_along(eye_world, heading.forward_world());
    Pinhole::symmetric(world_from_eye, (256, 256), std::f64::consts::FRAC_PI_2, 0.01)
}

/// Whether a level line between two points stays in free cells.
fn is_in_sight(map: &CorridorMap, from_world: DVec3, to_world: DVec3) -> bool {
    (0..=400).all(|k| map.cell_of(from_world.lerp(to_world, f64::from(k) / 400.0)).is_some())
}

/// From all of a grid of points: what the eye sees in the view is in the image, at the very place if no mouth is between; and what any point of
/// the body sees through a mouth that the view shows whole is in the image too.
#[test]
fn views_round_corners_hold_what_the_eye_sees_and_what_the_body_sees_beside() {
    let map = drawn(&[
        "#.#####", //
        "#.....#", "#.###.#", "#.#...#", "#.###.#", "#.....#",
    ]);
    let (view, radius_m) = (view_along(&map, (1, 0), Heading::PlusZ), 0.3);
    let eye_world = view.world_from_eye.translation;
    let description = map.describe_around(&view, Heading::PlusZ, radius_m).expect("a map").expect("it bends");
    let camera = GraphCamera::from_description(&description).expect("a camera");
    let (mut straight, mut beside) = (0, 0);
    for k in 0..70 * 60 {
        let p = DVec3::new(f64::from(k % 70) / 10.0 + 0.03, eye_world.y, f64::from(k / 70) / 10.0 + 0.04);
        if map.cell_of(p).is_none() {
            continue;
        }
        let of_view = view.image_from_world(p).filter(|image| (1.0..255.0).contains(&image.u));
        let of_graph = camera.image_from_world(p);
        if let Some(of_view) = of_view.filter(|_| is_in_sight(&map, eye_world, p)) {
            let of_graph = of_graph.expect("the eye sees it");
            // In the run straight ahead nothing is bent, but past its end cut.
            let is_ahead = p.x > 1.0 && p.x < 2.0 && p.z < 5.0;
            assert!(!is_ahead || (of_view.u - of_graph.0.u).abs() < 1e-9, "{p}: {of_view:?}, {of_graph:?}");
            straight += 1;
        } else if p.z > 1.0
            && (0..64).any(|k| {
                let angle = f64::from(k) / 64.0 * std::f64::consts::TAU;
                is_in_sight(&map, eye_world + DVec3::new(angle.cos(), 0.0, angle.sin()) * radius_m, p)
            })
            && p.z > 4.5
        {
            // Behind the mouth at the end, which is whole in the view.
            assert!(of_graph.is_some(), "{p} is seen from the body");
            beside += 1;
        }
    }
    assert!(straight > 300 && beside > 0, "{straight}, {beside}");
}

#[test]
fn views_stay_straight_where_nothing_hides() {
    let along = |rows: &[&str], cell, radius_m| {
        let map = drawn(rows);
        map.describe_around(&view_along(&map, cell, Heading::PlusZ), Heading::PlusZ, radius_m).expect("a map")
    };
    let corner = ["#.##", "#.##", "#...", "####"];
    assert!(along(&corner, (1, 0), 0.3).is_some());
    assert_eq!(
        along(&corner, (1, 0), 0.0).map(|description| description.frusta[0].centre.x),
        None,
        "a point sees as its eye does"
    );
    assert_eq!(along(&["#.#", "#.#", "#.#"], (1, 0), 0.3), None, "a dead end");
    assert_eq!(along(&["...", "...", "..."], (1, 0), 0.3), None, "a room");
    let map = drawn(&corner);
    let outside = view_along(&map, (0, 0), Heading::PlusZ);
    assert_eq!(map.describe_around(&outside, Heading::PlusZ, 0.3), Err(CorridorMapError::Entrance));
}

/// A corridor is so high that the view shows a mouth in its side in part: what is above and below, other views show, straight.
#[test]
fn a_mouth_that_is_seen_in_part_leaves_no_gap() {
    let map = CorridorMap { height_m: 6.0, ..drawn(&["#.###", "#.###", "#....", "#.###", "#...."]) };
    let view = view_along(&map, (1, 0), Heading::PlusZ);
    let (eye_world, mut seen) = (view.world_from_eye.translation, 0);
    let camera = map.describe_around(&view, Heading::PlusZ, 0.45).expect("a map");
    let camera = camera.map(|description| GraphCamera::from_description(&description).expect("a camera"));
    for k in 0..100 * 100 * 60 {
        let (x, z, y) = (k % 100, k / 100 % 100, k / 10_000);
        let p = DVec3::new(f64::from(x) / 20.0 + 0.03, f64::from(y) / 10.0 + 0.05, f64::from(z) / 20.0 + 0.04);
        let in_image = |image: &ImagePoint| [image.u, image.v].iter().all(|at| (1.0..255.0).contains(at));
        let is_behind_a_mouth = p.x > 2.0;
        if is_behind_a_mouth
            && view.image_from_world(p).as_ref().is_some_and(in_image)
            && is_in_sight(&map, eye_world, p)
        {
            assert!(camera.as_ref().is_none_or(|camera| camera.image_from_world(p).is_some()), "{p}");
            seen += 1;
        }
    }
    assert!(seen > 100, "{seen}");
}
