//! Which images serve a reflector, as probes say.

mod common;

use camera::Camera;
use common::{coloured, scene, square};
use glam::{DAffine3, DVec3};
use gpu::Gpu;
use scene::{Material, Scene, Snapshot};
use vantage_server::config::Config;
use vantage_server::imager::{GpuImager, Imager, ImagerError};
use vantage_server::impostors::{Choices, Decision, Needs, Shot};

/// Chooses by what an imager draws, counts the pictures, and decides.
fn chosen(
    needs: &Needs,
    (scene, snapshot): (&Scene, &Snapshot),
    eye_world: DVec3,
    choices: &mut Choices,
    imager: &mut GpuImager,
) -> (Decision, usize) {
    let mut pictures = 0;
    let mut draw = |shot: &Shot<'_>| {
        pictures += 1;
        imager.impostor(snapshot, shot)
    };
    needs.choose((scene, snapshot), eye_world, choices, &mut draw).expect("it draws");
    (needs.decide(scene, snapshot, eye_world, choices), pictures)
}

fn imager(scene: &Scene) -> GpuImager {
    let gpu = Gpu::block_on(Gpu::new_headless()).expect("a GPU");
    GpuImager::new(&gpu, scene, &Config::default()).expect("it fits")
}

/// In the maze a pot stands on a stand, which hides most of the floor below from the pot's middle, but not from its spout.
#[test]
fn what_hides_much_from_a_mirror_gets_an_image_of_its_own_and_walls_get_none() {
    let scene = scene::builtin::load("mirror-maze").expect("it is built in");
    let eye_world = scene::builtin::reflection_path("mirror-maze").expect("a path").poses[0].world_from_eye.translation;
    let (needs, mut choices, mut imager) = (Needs::new(&scene), Choices::default(), imager(&scene));
    let now = scene.at(0.0);
    let by_rule = needs.decide(&scene, &now, eye_world, &choices);
    let (decision, pictures) = chosen(&needs, (&scene, &now), eye_world, &mut choices, &mut imager);
    let shown = |decision: &Decision| {
        let shown = decision.wanted.iter().filter_map(|wanted| wanted.key.shown);
        shown.map(|object| scene.instances[usize::from(object)].name.clone()).collect::<Vec<_>>()
    };
    assert_eq!(shown(&decision), ["stand"], "{:?}", decision.reasons);
    assert!(shown(&by_rule).len() > 1, "the rule has walls too: {:?}", by_rule.reasons);
    assert!(pictures > 0 && decision.reasons[0].contains("rays against them err by"), "{:?}", decision.reasons);
    // Nothing has changed: nothing is tried again.
    let (same, pictures) = chosen(&needs, (&scene, &now), eye_world, &mut choices, &mut imager);
    assert_eq!((same, pictures), (decision, 0));
}

/// A mirror ball, 0.2 m in radius, and a flat picture 3 m behind it.
#[test]
fn a_choice_is_made_anew_where_the_viewer_has_gone_round_or_the_mirror_has_gone_away() {
    let mirror = Material { metallic: 1.0, roughness: 0.0, ..coloured([0.9; 4]) };
    let place = |x: f64, z: f64, size: f64| {
        DAffine3::from_translation(DVec3::new(x, 0.0, z)) * DAffine3::from_scale(DVec3::splat(size))
    };
    let meshes = vec![common::sphere(8, 0), square(2, 1)];
    let placed = [(0, place(0.0, 0.0, 0.2)), (1, place(0.0, -3.0, 1.0))];
    let scene = scene(meshes, vec![mirror, coloured([0.6, 0.2, 0.1, 1.0])], &placed);
    let needs = Needs::new(&scene);
    let eye = |angle_rad: f64| DVec3::new(angle_rad.sin(), 0.0, angle_rad.cos()) * 2.0;
    let pictures_at = |angle_rad: f64, moved_m: f64| {
        let (mut choices, mut imager) = (Choices::default(), imager(&scene));
        chosen(&needs, (&scene, &scene.at(0.0)), eye(0.0), &mut choices, &mut imager);
        let mut then = scene.at(0.0);
        then.world_from_mesh[0].translation.z += moved_m;
        let eye_world = eye(angle_rad) + DVec3::Z * moved_m;
        chosen(&needs, (&scene, &then), eye_world, &mut choices, &mut imager).1
    };
    // Half a radian; four radii of the ball around its box, 0.35 m.
    assert_eq!([pictures_at(0.49, 0.0), pictures_at(0.0, 1.35)], [0, 0]);
    assert!(pictures_at(0.51, 0.0) > 0 && pictures_at(0.0, 1.42) > 0);
}

#[test]
fn where_nothing_can_be_drawn_the_rule_holds() {
    let scene = scene::builtin::load("mirror-teapots").expect("it is built in");
    let (needs, mut choices) = (Needs::new(&scene), Choices::default());
    let (now, eye_world) = (scene.at(0.0), DVec3::new(0.05, 0.36, 0.66));
    let mut asked = 0;
    let mut draw = |_: &Shot<'_>| {
        asked += 1;
        Ok::<_, ImagerError>(None)
    };
    needs.choose((&scene, &now), eye_world, &mut choices, &mut draw).expect("nothing fails");
    needs.choose((&scene, &now), eye_world, &mut choices, &mut draw).expect("nothing fails");
    assert_eq!(asked, 1, "it is not tried again where nothing has changed");
    let decision = needs.decide(&scene, &now, eye_world, &choices);
    assert_eq!(decision, needs.decide(&scene, &now, eye_world, &Choices::default()));
    assert!(decision.wanted.iter().any(|wanted| matches!(wanted.camera, Camera::Spoc(_))));
}
