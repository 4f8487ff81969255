//! Which impostors a scene needs, by scenes whose needs are known; and that a client is sent them.

mod common;

use camera::Camera;
use common::session::Session;
use common::{coloured, scene, sphere, square};
use glam::{DAffine3, DVec3};
use protocol::Purpose;
use scene::{Material, Scene};
use vantage_server::impostors::{Choices, Decision, Drawn, Faces, Kept, Needs, Rule, Wanted};

const EYE: DVec3 = DVec3::new(0.0, 0.0, 3.0);

fn mirror() -> Material {
    Material { metallic: 1.0, roughness: 0.0, ..coloured([0.9, 0.9, 0.9, 1.0]) }
}

fn glass() -> Material {
    Material { transmission: 1.0, ior: 1.3, ..coloured([1.0; 4]) }
}

/// A ball of `material` at the origin, 0.5 m in radius; a plain one beside it; a picture behind; a far wall.
fn room(material: Material, at: impl Fn(DVec3) -> DVec3) -> Scene {
    let place = |x: f64, z: f64, size: f64| {
        DAffine3::from_translation(at(DVec3::new(x, 0.0, z))) * DAffine3::from_scale(DVec3::splat(size))
    };
    let meshes = vec![sphere(8, 0), sphere(8, 1), square(2, 1)];
    let placed =
        [(0, place(0.0, 0.0, 0.5)), (1, place(1.5, 0.0, 0.4)), (2, place(0.0, -2.0, 0.5)), (2, place(0.0, -90.0, 4.0))];
    scene(meshes, vec![material, coloured([0.6, 0.2, 0.1, 1.0])], &placed)
}

fn decide(scene: &Scene) -> Decision {
    Needs::new(scene).decide(scene, &scene.at(0.0), EYE, &Choices::default())
}

#[test]
fn a_scene_without_reflectors_needs_none() {
    let decision = decide(&room(coloured([0.5; 4]), |p| p));
    assert!(decision.wanted.is_empty());
    assert_eq!(decision.reasons, ["no mirror and no glass: no impostors"]);
}

#[test]
fn a_rough_metal_is_no_mirror_and_a_far_one_needs_none() {
    let rough = Material { roughness: 0.4, ..mirror() };
    assert!(decide(&room(rough, |p| p)).wanted.is_empty());
    let far = decide(&room(mirror(), |p| p + 100.0 * DVec3::NEG_Z));
    assert!(far.wanted.is_empty());
    assert_eq!(far.reasons, ["no mirror or glass in reach: no impostors"]);
}

#[test]
fn under_a_sky_a_rough_metal_shows_what_is_near_by_small_plain_images() {
    let of = |roughness: f32| {
        let scene = room(Material { roughness, ..mirror() }, |p| p);
        Needs::under_sky(&scene).decide(&scene, &scene.at(0.0), EYE, &Choices::default())
    };
    assert!(of(0.6).wanted.is_empty(), "nothing is told in a lobe as wide as that");
    let [rough, smooth] = [of(0.4), of(0.0)];
    let is_plain = |wanted: &&Wanted| matches!(wanted.camera, Camera::Pinhole(_));
    assert_eq!((rough.wanted.len(), rough.wanted.iter().filter(is_plain).count()), (8, 8));
    let pixels = |decision: &Decision| {
        let of = |wanted: &Wanted| u64::from(wanted.camera.size_px().0) * u64::from(wanted.camera.size_px().1);
        decision.wanted.iter().map(of).sum::<u64>()
    };
    assert_eq!(4 * pixels(&rough), pixels(&smooth));
    assert!(rough.reasons[0].contains("is a rough mirror"), "{:?}", rough.reasons);
}

/// A plate of metal, a ball right before it, and one behind it.
fn plate(roughness: f32) -> Scene {
    let at = |z: f64, size: f64| DAffine3::from_translation(z * DVec3::Z) * DAffine3::from_scale(DVec3::splat(size));
    let meshes = vec![square(2, 0), sphere(8, 1)];
    let materials = vec![Material { roughness, ..mirror() }, coloured([0.6, 0.2, 0.1, 1.0])];
    scene(meshes, materials, &[(0, at(0.0, 1.0)), (1, at(0.3, 0.4)), (1, at(-0.6, 0.3))])
}

#[test]
fn what_lies_before_a_flat_rough_mirror_is_seen_from_the_eyes_mirror_image() {
    let scene = plate(0.3);
    let decision = Needs::under_sky(&scene).decide(&scene, &scene.at(0.0), EYE, &Choices::default());
    let own: Vec<_> = decision.wanted.iter().filter_map(|wanted| Some((wanted.key.shown?, &wanted.camera))).collect();
    let [(1, Camera::Pinhole(camera))] = own[..] else { panic!("{own:?}") };
    let eye_world = camera.world_from_eye.translation;
    assert!(eye_world.distance(EYE * DVec3::new(1.0, 1.0, -1.0)) < 1e-9, "{eye_world}");
}

/// Images of the middle of a group would show none of its members to another.
#[test]
fn rough_mirrors_show_each_other() {
    let mut scene = plate(0.3);
    scene.materials[1] = Material { roughness: 0.3, ..mirror() };
    let decision = Needs::under_sky(&scene).decide(&scene, &scene.at(0.0), EYE, &Choices::default());
    let shown = |reflector: u16| {
        let of = |wanted: &&Wanted| wanted.key.reflector == reflector;
        let images = decision.wanted.iter().filter(of).map(|wanted| wanted.drawn.clone()).collect::<Vec<_>>();
        move |object: u16| images.iter().any(|drawn| drawn.contains(object))
    };
    assert!(shown(0)(1) && shown(1)(0));
}

#[test]
fn a_mirror_needs_what_is_near_it_by_its_shape_and_the_rest_by_a_cube() {
    let decision = decide(&room(mirror(), |p| p));
    let of = |object: u16| decision.wanted.iter().find(|wanted| wanted.key.shown == Some(object));
    let [ball, picture] = [1, 2].map(|object| of(object).expect("it is near"));
    assert!(matches!(ball.camera, Camera::Spoc(_)) && ball.purpose == Purpose::Impostor(1));
    assert!(matches!(picture.camera, Camera::Pinhole(_)), "a billboard");
    assert_eq!(ball.drawn, Drawn::Only(1));
    assert!(of(3).is_none(), "too small from there");
    let around: Vec<_> = decision.wanted.iter().filter(|wanted| wanted.purpose == Purpose::Environment).collect();
    assert_eq!(around.len(), 6);
    assert_eq!(around[0].drawn, Drawn::AllBut(vec![0, 1, 2]), "the mirror itself is in no image of its own");
    assert_eq!(decision.wanted.len(), 8);
    assert!(decision.reasons[0].contains("is a mirror"), "{:?}", decision.reasons);
}

#[test]
fn every_corner_of_what_is_near_lies_in_its_image() {
    let scene = room(mirror(), |p| p);
    for wanted in decide(&scene).wanted.iter().filter(|wanted| wanted.key.shown.is_some()) {
        let object = usize::from(wanted.key.shown.expect("an object"));
        let world_from_mesh = scene.at(0.0).world_from_mesh[object];
        for vertex in &scene.meshes[scene.instances[object].mesh as usize].vertices {
            let p_world = world_from_mesh.transform_point3(glam::Vec3::from(vertex.position).as_dvec3());
            let image = wanted.camera.image_from_world(p_world).expect("before the camera");
            let (width, height) = wanted.camera.size_px();
            assert!(image.u > 0.0 && image.u < width.into() && image.v > 0.0 && image.v < height.into(), "{image:?}");
        }
    }
}

/// The maze's plan is the same map from the corner that it is drawn from: see `scene`'s tests.
#[test]
fn corridors_are_those_of_the_floor_where_the_scene_tells_of_none() {
    let told = scene::builtin::load("mirror-maze").expect("it is built in");
    let untold = Scene { corridors: None, ..told.clone() };
    let eye_world = scene::builtin::reflection_path("mirror-maze").expect("a path").poses[0].world_from_eye.translation;
    let none = Choices::default();
    let of = |scene: &Scene, needs: &Needs| needs.decide(scene, &scene.at(0.0), eye_world, &none);
    let bent = |decision: &Decision| {
        let graphs = decision.wanted.iter().filter_map(|wanted| match &wanted.camera {
            Camera::Graph(graph) => Some(graph.frusta().len()),
            _ => None,
        });
        graphs.collect::<Vec<_>>()
    };
    let [by_map, by_plan] = [&told, &untold].map(|scene| bent(&of(scene, &Needs::new(scene))));
    assert!(!by_map.is_empty() && by_map == by_plan, "{by_map:?}, {by_plan:?}");
    // Another storey has another plan, and the first one keeps its own.
    let needs = Needs::new(&untold);
    of(&untold, &needs);
    let mut above = untold.at(0.0);
    above.world_from_mesh.iter_mut().for_each(|place| place.translation.y += 10.0);
    let above = needs.decide(&untold, &above, eye_world + 10.0 * DVec3::Y, &none);
    assert_eq!(bent(&above), by_plan);
    assert_eq!(bent(&of(&untold, &needs)), by_plan);
    let straight = of(&told, &Needs::new(&told).with_rule(Rule::Plain));
    assert!(bent(&straight).is_empty(), "{:?}", straight.reasons);
}

#[test]
fn glass_needs_its_inside_too() {
    let decision = decide(&room(glass(), |p| p));
    let inside: Vec<_> = decision.wanted.iter().filter(|wanted| wanted.purpose == Purpose::Inside(0)).collect();
    assert_eq!((inside.len(), inside[0].faces), (1, Faces::Back));
    assert_eq!(inside[0].drawn, Drawn::Only(0));
}

#[test]
fn what_is_held_is_made_anew_only_where_it_shows_something_else() {
    let held = protocol::Held::default();
    let scene = room(mirror(), |p| p);
    let decision = decide(&scene);
    let mut kept = Kept::default();
    assert_eq!(kept.lacking(&decision, &held).len(), 8, "nothing is held");
    assert!(kept.news(&decision).is_some() && kept.news(&decision).is_none(), "said once");
    let mut account = protocol::Held::default();
    for (wanted, id) in decision.wanted.iter().zip(1..) {
        kept.replace(wanted, protocol::PatchId(id));
        add(&mut account, id);
    }
    assert!(kept.lacking(&decision, &account).is_empty());
    assert_eq!(kept.lacking(&decision, &held).len(), 8, "the client lost its copy");
    // Everything together: no object shows another side, but the surroundings are elsewhere.
    let all = decide(&room(mirror(), |p| p + DVec3::X));
    assert!(kept.lacking(&all, &account).iter().all(|wanted| wanted.key.shown.is_none()));
    assert_eq!(kept.lacking(&all, &account).len(), 6);
    let nearer = decide(&room(mirror(), |p| if p.x > 1.0 { p - 0.4 * DVec3::X } else { p }));
    let lacking = kept.lacking(&nearer, &account);
    assert_eq!(lacking.iter().map(|wanted| wanted.key.shown).collect::<Vec<_>>(), [Some(1)]);
    // Another choice: the surroundings hold what had images of its own.
    let around = Needs::new(&scene).with_rule(Rule::Around);
    let around = around.decide(&scene, &scene.at(0.0), EYE, &Choices::default());
    assert_eq!(kept.lacking(&around, &account).len(), 6);
    let none = decide(&room(coloured([0.5; 4]), |p| p));
    assert_eq!(kept.drop_unwanted(&none).len(), 8);
}

/// How many images of an object, and of surroundings, a client lacks that was sent all of `room` at time 0, when `change` has been at the
/// scene.
fn lacking(moves: bool, time_s: f64, change: impl Fn(&mut [DAffine3])) -> [usize; 2] {
    let mut scene = room(mirror(), |p| p);
    scene.instances[3].moves = moves;
    let (needs, mut kept, mut account) = (Needs::new(&scene), Kept::default(), protocol::Held::default());
    for (wanted, id) in needs.decide(&scene, &scene.at(0.0), EYE, &Choices::default()).wanted.iter().zip(1..) {
        kept.replace(wanted, protocol::PatchId(id));
        add(&mut account, id);
    }
    let mut now = scene.at(time_s);
    change(&mut now.world_from_mesh);
    let decision = needs.decide(&scene, &now, EYE, &Choices::default());
    let lacking = kept.lacking(&decision, &account);
    let is_object = |wanted: &&&Wanted| wanted.key.shown.is_some();
    let objects = lacking.iter().filter(is_object).count();
    [objects, lacking.len() - objects]
}

#[test]
fn what_turned_or_came_nearer_or_moved_away_is_seen_anew() {
    let turned = |by_rad: f64| lacking(false, 0.0, |places| places[1] *= DAffine3::from_rotation_y(by_rad));
    assert_eq!([turned(0.09), turned(-0.09), turned(0.11), turned(-0.11)], [[0, 0], [0, 0], [1, 0], [1, 0]]);
    // It stands 1.5 m away; a fifth of a natural logarithm is a share of 0.22, or of 0.18 nearer.
    let away = |times: f64| lacking(false, 0.0, |places| places[1].translation.x *= times);
    assert_eq!([away(1.21), away(0.83), away(1.23), away(0.81)], [[0, 0], [0, 0], [1, 0], [1, 0]]);
    // The half diagonal of the mirror's box is 0.87 m.
    let all = |by_m: f64| lacking(false, 0.0, |places| places.iter_mut().for_each(|place| place.translation.z += by_m));
    assert_eq!([all(0.43), all(-0.43), all(0.44), all(-0.44)], [[0, 0], [0, 0], [0, 6], [0, 6]]);
}

#[test]
fn what_moves_around_is_followed_twice_a_second() {
    let after = |moves: bool, time_s: f64| lacking(moves, time_s, |_| {});
    assert_eq!([after(true, 0.49), after(true, 0.5), after(true, -0.5)], [[0, 0], [0, 6], [0, 6]]);
    assert_eq!(after(false, 1e6), [0, 0], "nothing moves");
}

#[test]
fn a_client_is_sent_them_and_a_still_one_only_once() {
    let mut session = Session::new(room(mirror(), |p| p + DVec3::NEG_Z * 2.0));
    let first = session.tick().expect("a first update");
    assert!(first.counts.impostor > 10_000, "{:?}", first.counts);
    let purposes = |session: &Session| {
        let count = |purpose| session.held.patches.values().filter(|held| held.patch.purpose == purpose).count();
        [Purpose::Impostor(1), Purpose::Impostor(2), Purpose::Environment].map(count)
    };
    // The flat one behind is as well served by the surroundings.
    assert_eq!(purposes(&session), [1, 0, 6]);
    assert!(session.settle().iter().all(|counts| counts.impostor == 0));
    assert_eq!(purposes(&session), [1, 0, 6]);
}

#[test]
fn a_scene_without_reflectors_is_sent_none() {
    let mut session = Session::new(room(coloured([0.5; 4]), |p| p + DVec3::NEG_Z * 2.0));
    assert_eq!(session.tick().expect("a first update").counts.impostor, 0);
    assert!(session.held.patches.values().all(|held| held.patch.purpose == Purpose::Eye));
}

/// Holds a patch of that number.
fn add(held: &mut protocol::Held, id: u32) {
    let image = protocol::DepthImage::without_samples();
    let patch = protocol::Patch {
        id: protocol::PatchId(id),
        purpose: Purpose::Environment,
        capture_time_s: 0.0,
        objects: Vec::new(),
        image,
    };
    held.commit(vec![protocol::Edit::Add(Box::new(patch))], 0.0, 0).expect("it fits");
}

/// What a built-in scene needs where its path begins.
fn at_the_start_of(name: &str) -> (Scene, Decision) {
    let scene = scene::builtin::load(name).expect("it is built in");
    let eye_world = scene::builtin::reflection_path(name).expect("a path").poses[0].world_from_eye.translation;
    let decision = Needs::new(&scene).decide(&scene, &scene.at(0.0), eye_world, &Choices::default());
    (scene, decision)
}

#[test]
fn the_chrome_parts_of_a_car_share_one_set_of_images() {
    let (scene, decision) = at_the_start_of("chrome-car");
    let body = scene.instances.iter().position(|instance| instance.name == "chrome body mirror").expect("it has one");
    assert_eq!(decision.reasons.len(), 1, "{:?}", decision.reasons);
    assert!(decision.reasons[0].contains("with 8 near it"), "{:?}", decision.reasons);
    assert!(
        decision.wanted.len() <= 10 && decision.wanted.iter().all(|wanted| usize::from(wanted.key.reflector) == body)
    );
    let around = decision.wanted.iter().find(|wanted| wanted.purpose == Purpose::Environment).expect("six");
    let mirrors = scene.instances.iter().zip(0_u16..).filter(|(instance, _)| instance.name.contains("mirror"));
    assert!(mirrors.map(|(_, id)| id).all(|id| !around.drawn.contains(id)), "none stands in the way");
}

#[test]
fn a_lake_is_seen_from_the_mirror_image_of_the_eye() {
    let (_, decision) = at_the_start_of("lake");
    assert_eq!(decision.wanted.len(), 5, "{:?}", decision.reasons);
    for wanted in &decision.wanted {
        let eye_world = wanted.camera.eye_world();
        assert!(eye_world.distance(DVec3::new(-5.0, -2.2, 18.0)) < 1e-6, "{eye_world}");
    }
}
