//! What holds for graph cameras beyond the laws of every model: frusta that join, rays that bend, descriptions that are refused.

mod support;

use glam::{DVec2, DVec3};
use proptest::prelude::*;
use support::{Model, at, graph, graph_rounding_m, pillar};
use vantage_camera::{
    Bounds, FaceDescription, Frustum, FrustumDescription, FrustumId, GraphCamera, GraphDescription, GraphError,
    HalfSpace, ImagePoint, Rigid,
};

fn px(point: ImagePoint) -> DVec2 {
    DVec2::new(point.u, point.v)
}

fn id(place: usize) -> FrustumId {
    FrustumId::new(place).expect("few")
}

fn frustum(camera: &GraphCamera, id: FrustumId) -> &Frustum {
    camera.frustum(id).expect("its own")
}

/// A point inside of a frustum or on its faces: its corners, mixed.
fn mixed(corners: &[DVec3], random: &[f64]) -> DVec3 {
    let weights: Vec<f64> = corners.iter().zip(random.iter().cycle()).map(|(_, share)| share.powi(4)).collect();
    let sum: f64 = weights.iter().sum::<f64>().max(f64::MIN_POSITIVE);
    let first = corners[0];
    first + corners.iter().zip(&weights).map(|(corner, weight)| (*corner - first) * (weight / sum)).sum::<DVec3>()
}

fn shares() -> impl Strategy<Value = Vec<f64>> {
    prop::collection::vec(0.0..1.0_f64, 13)
}

/// One of a camera's frusta.
fn pick(camera: &GraphCamera, share: f64) -> FrustumId {
    id((share * camera.frusta().len() as f64) as usize)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(512))]

    #[test]
    fn every_point_of_a_frustum_has_an_image_that_leads_back(camera in graph(), share in 0.0..1.0_f64, shares in shares()) {
        let world = mixed(frustum(&camera, pick(&camera, share)).corners_world(), &shares);
        let found = camera.image_from_world(world);
        prop_assert!(found.is_some(), "{world} has no image");
        let (point, found) = found.expect("checked");
        let slack_m = graph_rounding_m(&camera, found, world);
        let again = camera.world_from_image(point, found).expect("it has an image");
        prop_assert!(again.distance(world) <= slack_m, "{world} came back as {again}, {slack_m:e} m");
        // Without the id too: an image point and a depth belong to one world point. Rays that run along a seam may be taken
        // to the frustum beside, or to the end of one that stops there, so the point is looked for off the seams.
        let inside_m = frustum(&camera, found).half_spaces_world().iter().map(|plane| plane.depth_m(world)).fold(f64::INFINITY, f64::min);
        if inside_m > 4.0 * slack_m {
            prop_assert_eq!(camera.frustum_at(point), Some(found), "{}", world);
        }
    }

    #[test]
    fn image_and_depth_are_continuous_across_faces(camera in graph(), share in 0.0..1.0_f64, shares in shares()) {
        let child_id = pick(&camera, share);
        let child = frustum(&camera, child_id);
        let Some(parent_id) = child.parent() else { return Ok(()) };
        let parent = frustum(&camera, parent_id);
        let world = mixed(child.face_world(), &shares);
        prop_assert!(camera.image_from_world(world).is_some(), "a face is inside");
        let (here, there) = (child.image_from_world(world), parent.image_from_world(world));
        prop_assert!(here.is_some() && there.is_some());
        let (here, there) = (here.expect("checked"), there.expect("checked"));
        prop_assert_eq!(child.image_from_world(child.centre_world() * 2.0 - world), None, "behind the centre");
        // Compared in the world, where roundings are known: each frustum takes the other's image back to the same place. The
        // distances from the centres to the face are rounded with the coordinates of the world, and bend by what they err.
        let face = &child.half_spaces_world()[0];
        let size_m = child.centre_world().abs().max_element() + face.point.abs().max_element();
        let distance_m = face.depth_m(child.centre_world()).abs().min(face.depth_m(parent.centre_world()).abs());
        let bent_m = 16.0 * f64::EPSILON * size_m / distance_m * child.centre_world().distance(parent.centre_world());
        let slack_m = graph_rounding_m(&camera, child_id, world) + graph_rounding_m(&camera, parent_id, world) + bent_m;
        prop_assert!(child.world_from_image(there).distance(world) <= slack_m, "{here:?} is not {there:?}, {slack_m:e} m");
        prop_assert!(parent.world_from_image(here).distance(world) <= slack_m, "{here:?} is not {there:?}, {slack_m:e} m");
    }

    #[test]
    fn a_ray_is_one_path_whose_depth_never_swaps(camera in graph(), at in at(), share in 0.0..1.0_f64) {
        let point = camera.point(at, 0.5);
        let pieces = camera.ray(point.u, point.v);
        prop_assert!(!pieces.is_empty());
        prop_assert_eq!(pieces[0].frustum, FrustumId::ROOT);
        for piece in &pieces {
            prop_assert!(piece.w_from > piece.w_to && piece.w_to > 0.0);
            let z = 1.0 / piece.w_from + (1.0 / piece.w_to - 1.0 / piece.w_from) * share;
            let expected = ImagePoint { w: 1.0 / z, ..point };
            let world = piece.from_world.lerp(piece.to_world, share);
            let slack_m = graph_rounding_m(&camera, piece.frustum, world);
            let unprojected = camera.world_from_image(expected, piece.frustum).expect("on the ray");
            prop_assert!(unprojected.distance(world) <= slack_m, "{unprojected} is not {world}");
        }
        for pair in pieces.windows(2) {
            prop_assert_eq!(pair[0].w_to, pair[1].w_from);
            prop_assert_eq!(frustum(&camera, pair[1].frustum).parent(), Some(pair[0].frustum));
            let slack_m = graph_rounding_m(&camera, pair[1].frustum, pair[0].to_world);
            let extent_m = camera.bounds_world().extent_m();
            prop_assert!(slack_m < 1e-3 * extent_m, "a bound that says nothing: {slack_m}");
            let face = &frustum(&camera, pair[1].frustum).half_spaces_world()[0];
            let size_m = pair[0].to_world.abs().max_element();
            let far_out = 1.0 + size_m / face.depth_m(frustum(&camera, pair[1].frustum).centre_world()).abs();
            prop_assert!(pair[0].to_world.distance(pair[1].from_world) <= slack_m * far_out, "broken at {:?}", pair[1].frustum);
        }
    }

    #[test]
    fn a_segments_pieces_are_its_points_in_frusta(
        camera in graph(), ends in (0.0..1.0_f64, 0.0..1.0_f64), a in shares(), b in shares(), t in 0.0..1.0_f64,
    ) {
        let a = mixed(frustum(&camera, pick(&camera, ends.0)).corners_world(), &a);
        let b = mixed(frustum(&camera, pick(&camera, ends.1)).corners_world(), &b);
        let pieces = camera.segment_pieces(a, b);
        for pair in pieces.windows(2) {
            let size_m = 64.0 * f64::EPSILON * (a.abs().max_element() + b.abs().max_element());
            let overlap_m = (pair[0].t_to - pair[1].t_from) * a.distance(b);
            prop_assert!(overlap_m <= 1e3 * size_m, "two frusta at once, {overlap_m} m");
        }
        let p = a.lerp(b, t);
        let holding = pieces.iter().filter(|piece| piece.t_from < t && t < piece.t_to);
        for piece in holding {
            let frustum = frustum(&camera, piece.frustum);
            prop_assert!(frustum.half_spaces_world().iter().all(|plane| plane.depth_m(p) >= -1e-12 * (p.abs().max_element() + 1.0)));
            // A straight line of the image, with `w` linear along it: where `1/w`, which is linear in the world, says.
            let along = (t - piece.t_from) / (piece.t_to - piece.t_from);
            let z = 1.0 / piece.from.w + along * (1.0 / piece.to.w - 1.0 / piece.from.w);
            let share = along / piece.to.w / z;
            let uv = px(piece.from).lerp(px(piece.to), share);
            let on_line = ImagePoint { u: uv.x, v: uv.y, w: piece.from.w + share * (piece.to.w - piece.from.w) };
            let places = [p, a.lerp(b, piece.t_from), a.lerp(b, piece.t_to)];
            let slack_m: f64 = places.map(|place| graph_rounding_m(&camera, piece.frustum, place)).iter().sum();
            let world = frustum.world_from_image(on_line);
            prop_assert!(world.distance(p) <= 4.0 * slack_m, "{world} is not {p}, {slack_m:e} m");
        }
        if let Some(found) = camera.frustum_of(p) {
            let inside_m = frustum(&camera, found).half_spaces_world().iter().map(|plane| plane.depth_m(p)).fold(f64::INFINITY, f64::min);
            if inside_m > 1e-9 * (p.abs().max_element() + 1.0) {
                prop_assert!(pieces.iter().any(|piece| piece.frustum == found && piece.t_from <= t && t <= piece.t_to));
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(1024))]

    /// Bytes from outside may hold anything. What makes a camera nevertheless gives numbers.
    #[test]
    fn no_description_makes_it_panic(changes in prop::collection::vec((0.0..1.0_f64, wild()), 1..4), at in at()) {
        let mut json = serde_json::to_value(pillar(Rigid::IDENTITY)).expect("all numbers are finite");
        for (share, number) in changes {
            let mut numbers = numbers(&mut json);
            let place = (share * numbers.len() as f64) as usize;
            *numbers[place] = number.into();
        }
        let Ok(description) = serde_json::from_value::<GraphDescription>(json) else { return Ok(()) };
        let Ok(camera) = GraphCamera::from_description(&description) else { return Ok(()) };
        for piece in camera.ray(at.x * 640.0, at.y * 480.0) {
            let world = piece.from_world.lerp(piece.to_world, 0.5);
            prop_assert!(world.is_finite() && piece.w_from > piece.w_to && piece.w_to >= 0.0, "{piece:?}");
            let image = camera.image_from_world(world);
            prop_assert!(image.is_none_or(|(point, _)| px(point).is_finite() && point.w > 0.0 && point.w.is_finite()));
            let _may_be_any = camera.segment_pieces(world, DVec3::Z * 5.0);
        }
    }
}

/// Numbers of every size, and those that people write.
fn wild() -> impl Strategy<Value = f64> {
    prop_oneof![-10.0..10.0_f64, prop::num::f64::NORMAL, prop::num::f64::SUBNORMAL, Just(0.0), Just(1e308)]
}

fn numbers(json: &mut serde_json::Value) -> Vec<&mut serde_json::Value> {
    match json {
        serde_json::Value::Array(values) => values.iter_mut().flat_map(numbers).collect(),
        serde_json::Value::Object(fields) => fields.values_mut().flat_map(numbers).collect(),
        serde_json::Value::Number(_) => vec![json],
        _ => Vec::new(),
    }
}

/// Chains of one setback stay exact to 64 frusta; what ends them is the image, as the papers say (section 7.1).
#[test]
fn a_chain_of_64_bends_ends_by_resolution_not_by_rounding() {
    let mut description = pillar(Rigid::IDENTITY);
    description.frusta.clear();
    description.root.pinhole.near_m = 1.0;
    let end = |z: f64| HalfSpace { point: DVec3::Z * z, outward: DVec3::Z };
    description.root.limits = vec![end(2.0)];
    for place in 1..64 {
        let z = 1.0 + f64::from(place);
        let side = if place % 2 == 0 { 0.5 } else { -0.5 };
        let corners = [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)].map(|(x, y)| DVec3::new(x, y, z)).to_vec();
        let parent = if place == 1 { "front".to_owned() } else { (place - 1).to_string() };
        description.frusta.push(FrustumDescription {
            name: place.to_string(),
            centre: DVec3::new(side, 0.0, z - 4.0),
            faces: vec![FaceDescription { parent, corners }],
            limits: vec![end(z + 1.0)],
        });
    }
    let camera = GraphCamera::from_description(&description).expect("a chain");
    assert_eq!(camera.frusta().len(), 64);
    let last = frustum(&camera, id(63));
    let world = DVec3::new(0.1, 0.2, 64.5);
    let (point, found) = camera.image_from_world(world).expect("in the last");
    assert_eq!(found, id(63));
    let spans_px = (last.image_bounds().max_px - last.image_bounds().min_px).max_element();
    let slack_m = graph_rounding_m(&camera, found, world);
    let again = camera.world_from_image(point, found).expect("in the last");
    assert!(again.distance(world) <= slack_m && slack_m < 1e-5, "{} of {slack_m:e} m", again.distance(world));
    assert!(spans_px < 0.01, "its image spans {spans_px} px");
    description.min_face_px = 1.0;
    let cut = GraphCamera::from_description(&description).expect("a chain");
    assert!(cut.frusta().len() < 40, "{} frusta of a pixel", cut.frusta().len());
}

/// In f32, from a centre 10,000 km from the origin, a point lands where the camera says, within eight roundings.
#[test]
fn the_gpus_matrix_projects_as_the_camera() {
    let pose = Rigid { translation: DVec3::new(1e7, -2e6, 3e6), ..Rigid::IDENTITY };
    let camera = GraphCamera::from_description(&pillar(pose)).expect("a camera");
    for frustum in camera.frusta() {
        for &corner in frustum.corners_world() {
            let clip = frustum.clip_from_offset();
            let length: f32 = clip.matrix.to_cols_array().iter().map(|element| element.powi(2)).sum();
            assert!((length - 1.0).abs() <= 16.0 * f32::EPSILON, "unit length");
            let image = clip.matrix * (corner - frustum.centre_world()).as_vec3();
            let point = frustum.image_from_world(corner).expect("its own");
            let slack_px = 8.0 * f64::from(f32::EPSILON) * 640.0 * 4.0;
            let there = DVec2::new(f64::from(image.x / image.z), f64::from(image.y / image.z));
            assert!(px(point).distance(there) <= slack_px, "{point:?} is not {there}");
            let w = clip.w_scale / f64::from(image.z);
            assert!((w / point.w - 1.0).abs() <= 16.0 * f64::from(f32::EPSILON), "{point:?} is not {w}");
        }
    }
}

/// Both ways round the pillar lead behind it, and nobody sees the pillar's inside.
#[test]
fn a_merge_has_an_image_on_either_side_of_its_seam() {
    let camera = GraphCamera::from_description(&pillar(Rigid::IDENTITY)).expect("a camera");
    let named = |name: &str| camera.frusta().iter().filter(|frustum| frustum.name() == name).count();
    assert_eq!((camera.frusta().len(), named("back"), named("behind")), (7, 2, 2), "one for each side of the seam");
    let image = |x: f64, z: f64| camera.image_from_world(DVec3::new(x, 0.0, z));
    assert_eq!(image(0.0, 5.0), None, "in the pillar");
    for z in [7.0, 9.5] {
        let (left, right) = (image(-1e-3, z).expect("behind"), image(1e-3, z).expect("behind"));
        assert!(left.0.u < 250.0 && right.0.u > 390.0, "{left:?} and {right:?} come round their sides");
        let parent = |id: FrustumId| frustum(&camera, id).parent().expect("not the root");
        assert_ne!(parent(left.1), parent(right.1));
    }
}

#[test]
fn image_bounds_hold_what_a_box_shows() {
    let camera = GraphCamera::from_description(&pillar(Rigid::IDENTITY)).expect("a camera");
    let bounds = Bounds { min: DVec3::new(-0.4, -0.3, 3.0), max: DVec3::new(1.2, 0.7, 9.5) };
    let image = camera.image_bounds(&bounds).expect("it is seen");
    let mut seen = 0;
    for step in 0..8000_u32 {
        let share = DVec3::new(f64::from(step % 20), f64::from(step / 20 % 20), f64::from(step / 400)) / 19.0;
        let Some((point, _)) = camera.image_from_world(bounds.min + (bounds.max - bounds.min) * share) else {
            continue;
        };
        seen += 1;
        // A few roundings of pixels.
        let slack_px = 64.0 * f64::EPSILON * 640.0;
        let inside = px(point).cmpge(image.min_px - slack_px) & px(point).cmple(image.max_px + slack_px);
        assert!(
            inside.all() && point.w >= image.w_min * (1.0 - 1e-14) && point.w <= image.w_max * (1.0 + 1e-14),
            "{point:?}"
        );
    }
    assert!(seen > 1000, "{seen}");
    let elsewhere = Bounds { min: DVec3::splat(20.0), max: DVec3::splat(21.0) };
    assert_eq!(camera.image_bounds(&elsewhere), None);
}

fn refused(change: impl FnOnce(&mut GraphDescription)) -> GraphError {
    let mut description = pillar(Rigid::IDENTITY);
    change(&mut description);
    GraphCamera::from_description(&description).expect_err("it should be refused")
}

/// Places of the pillar's frusta in its description.
const BEHIND: usize = 0;
const BACK: usize = 1;
const LEFT: usize = 2;

#[test]
fn a_description_is_refused_with_the_name_of_the_frustum() {
    let name = |name: &str| name.to_owned();
    let at = |frustum: &str, parent: &str| (name(frustum), name(parent));

    let (left, front) = at("left", "front");
    assert_eq!(refused(|d| d.frusta[LEFT].name = name("back")), GraphError::SameName { name: name("back") });
    assert_eq!(refused(|d| d.frusta[LEFT].name = name("front")), GraphError::SameName { name: name("front") });
    assert_eq!(refused(|d| d.frusta[LEFT].faces.clear()), GraphError::NoFace { name: name("left") });
    assert_eq!(
        refused(|d| d.frusta[LEFT].faces[0].parent = name("nobody")),
        GraphError::UnknownParent { name: name("left"), parent: name("nobody") }
    );

    let cycle = refused(|d| d.frusta[LEFT].faces[0].parent = name("back"));
    assert!(
        cycle == GraphError::Cycle { name: name("left") } || cycle == GraphError::Cycle { name: name("back") },
        "{cycle}"
    );
    assert_eq!(
        refused(|d| d.frusta[LEFT].faces[0].parent = name("left")),
        GraphError::Cycle { name: name("left") },
        "not what waits for it"
    );

    let gap = || GraphError::Gap { name: left.clone(), parent: front.clone() };
    let moved = |d: &mut GraphDescription, by: DVec3| {
        d.frusta[LEFT].faces[0].corners.iter_mut().for_each(|corner| *corner += by);
    };
    assert_eq!(refused(|d| moved(d, DVec3::Z * 0.01)), gap(), "off the parent's end");
    assert_eq!(refused(|d| moved(d, DVec3::X * -2.0)), gap(), "beside the parent");
    assert_eq!(refused(|d| d.root.limits[0].point.z = 3.0), gap(), "before the face");
    assert_eq!(
        refused(|d| d.frusta[BEHIND].faces[0].corners[0].x = -40.0),
        GraphError::Gap { name: name("behind"), parent: name("back") },
        "over the end of a merge"
    );

    let no_face = || GraphError::Face { name: left.clone(), parent: front.clone() };
    assert_eq!(refused(|d| d.frusta[LEFT].faces[0].corners.swap(0, 1)), no_face(), "a bow");
    assert_eq!(refused(|d| d.frusta[LEFT].faces[0].corners.truncate(2)), no_face(), "a line");
    assert_eq!(refused(|d| d.frusta[LEFT].faces[0].corners[0] = DVec3::new(-1.4, 0.8, 4.0)), no_face(), "a dart");

    assert_eq!(
        refused(|d| d.frusta[LEFT].centre.z = 4.5),
        GraphError::WrongSide { name: left.clone(), parent: front.clone() }
    );
    let end = |point: DVec3, outward: DVec3| HalfSpace { point, outward };
    for nothing in [end(DVec3::Z * 3.0, DVec3::Z), end(DVec3::Z * 4.0, DVec3::Z), end(DVec3::X * -9.0, DVec3::X)] {
        assert_eq!(refused(|d| d.frusta[LEFT].limits.push(nothing)), GraphError::NoVolume { name: left.clone() });
    }
    assert_eq!(refused(|d| d.frusta[BEHIND].limits.clear()), GraphError::Unbounded { name: name("behind") });
    let along =
        [end(DVec3::X, DVec3::X), end(-DVec3::X, -DVec3::X), end(DVec3::Y, DVec3::Y), end(-DVec3::Y, -DVec3::Y)];
    assert_eq!(
        refused(|d| d.frusta[BEHIND].limits = along.to_vec()),
        GraphError::Unbounded { name: name("behind") },
        "along a tube"
    );
    let overlap = refused(|d| d.frusta[LEFT].limits.truncate(1));
    assert_eq!(overlap, GraphError::Overlap { name: name("right"), other: name("left") });
    assert_eq!(overlap.to_string(), r#"frustum "right": it overlaps "left""#);
}

#[test]
fn numbers_and_counts_out_of_range_are_refused() {
    let number = |name: &str| GraphError::Number { name: name.to_owned() };
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        assert_eq!(refused(|d| d.root.pinhole.near_m = bad), number("front"));
        assert_eq!(refused(|d| d.root.limits[0].point.x = bad), number("front"));
        assert_eq!(refused(|d| d.frusta[BACK].centre.y = bad), number("back"));
        assert_eq!(refused(|d| d.frusta[BACK].faces[1].corners[2].y = bad), number("back"));
        assert_eq!(refused(|d| d.frusta[BACK].limits[0].outward.x = bad), number("back"));
    }
    assert_eq!(refused(|d| d.min_face_px = f64::NAN), number("front"));
    assert_eq!(refused(|d| d.frusta[BACK].limits[0].outward = DVec3::ZERO), number("back"));
    let too_many = |name: &str| GraphError::TooMany { name: name.to_owned() };
    let limit = HalfSpace { point: DVec3::Z * 100.0, outward: DVec3::Z };
    assert_eq!(refused(|d| d.frusta[BACK].limits = vec![limit; GraphCamera::MAX_PLANES + 1]), too_many("back"));
    let many = refused(|d| {
        let one = d.frusta[LEFT].clone();
        d.frusta = (0..GraphCamera::MAX_FRUSTA)
            .map(|place| FrustumDescription { name: place.to_string(), ..one.clone() })
            .collect();
    });
    assert_eq!(many, too_many("4095"));
}

#[test]
fn a_description_can_be_written_by_hand() {
    let text = r#"{
        "root": {
            "name": "hall",
            "pinhole": {
                "world_from_eye": { "rotation": [1, 0, 0, 0], "translation": [0, 1.6, 0] },
                "width_px": 800, "height_px": 600, "focal_px": 500, "centre_px": [400, 300], "near_m": 0.5
            },
            "limits": [{ "point": [0, 0, -4], "outward": [0, 0, -1] }]
        },
        "frusta": [{
            "name": "niche",
            "centre": [1, 1.6, -1],
            "faces": [{ "parent": "hall", "corners": [[-1, 1, -4], [1, 1, -4], [1, 2, -4], [-1, 2, -4]] }],
            "limits": [{ "point": [0, 0, -6], "outward": [0, 0, -2] }]
        }]
    }"#;
    let description: GraphDescription = serde_json::from_str(text).expect("it is well written");
    let camera = GraphCamera::from_description(&description).expect("a camera");
    let (point, found) = camera.image_from_world(DVec3::new(-1.0, 1.6, -5.0)).expect("in the niche");
    // From the niche's centre it is seen through (-0.5, 1.6, -4), which the hall sees an eighth of the focal length left.
    assert_eq!(frustum(&camera, found).name(), "niche");
    assert!(px(point).distance(DVec2::new(400.0 - 500.0 / 8.0, 300.0)) < 1e-9, "{point:?}");
    let text = serde_json::to_string(&description).expect("all numbers are finite");
    let again: GraphDescription = serde_json::from_str(&text).expect("it is its own");
    assert_eq!(GraphCamera::from_description(&again), Ok(camera));
    assert!(serde_json::from_str::<GraphDescription>(&text.replace("limits", "limit")).is_err(), "a misspelled name");
}
