//! Many objects of one shape are shown by one image: which, to whom, and what a client is sent of them.

mod common;

use std::collections::BTreeSet;

use common::session::Session;
use common::{animated, coloured, mesh, scene, sphere, square, swing};
use glam::{DAffine3, DVec3, Quat, Vec3};
use protocol::{PatchId, Purpose};
use scene::{Mesh, Scene};
use vantage_server::impostors::relief::Judged;

const BALLS: usize = 10;
const RADIUS_M: f64 = 0.3;

/// A wall 8 m away, object 0, and before it `count` things in two rows, each tinted otherwise. The viewer stands at the origin, above them.
fn rows(thing: Mesh, count: usize) -> Scene {
    let wall = DAffine3::from_translation(DVec3::Z * -8.0) * DAffine3::from_scale(DVec3::splat(16.0));
    let place = |k: usize| {
        let at = DVec3::new((k % 5) as f64 - 2.0, (k / 5) as f64 - 1.5, -4.0 - (k % 3) as f64 * 0.2);
        DAffine3::from_translation(at)
            * DAffine3::from_rotation_y(k as f64)
            * DAffine3::from_scale(DVec3::splat(RADIUS_M))
    };
    let placed: Vec<_> = std::iter::once((0, wall)).chain((0..count).map(|k| (1, place(k)))).collect();
    let mut scene = scene(vec![square(4, 0), thing], vec![coloured([0.6, 0.5, 0.4, 1.0])], &placed);
    for (instance, k) in scene.instances.iter_mut().skip(1).zip(0_u8..) {
        instance.tint = [255 - 20 * k, 100, 20 * k];
    }
    scene
}

/// Plates behind each other, both sides of each: no one image holds what is between them.
fn comb() -> Mesh {
    let plate = square(1, 0);
    let (mut vertices, mut indices) = (Vec::new(), Vec::new());
    for (k, side) in (0..7).flat_map(|k| [(k, 1.0), (k, -1.0)]) {
        let first = vertices.len() as u32;
        vertices.extend(plate.vertices.iter().map(|vertex| {
            let (p, n) = (Vec3::from(vertex.position), Vec3::from(vertex.normal));
            let position = Vec3::new(p.x * side, p.y, k as f32 / 3.0 - 1.0).to_array();
            scene::Vertex { position, normal: (n * side).to_array(), ..*vertex }
        }));
        indices.extend(plate.indices.iter().map(|index| first + index));
    }
    mesh(vertices, indices, 0)
}

/// On a square 2 m wide, as high: from above all of its sides are seen.
fn pyramid() -> Mesh {
    let corners = [[-1.0, -1.0, 1.0], [1.0, -1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, -1.0, -1.0]].map(Vec3::from);
    let sides = (0..4).map(|k| [corners[k], corners[(k + 1) % 4], Vec3::Y]);
    let base = [[0, 3, 2], [0, 2, 1]].map(|triangle| triangle.map(|k: usize| corners[k]));
    let triangles = sides.chain(base).flat_map(|[a, b, c]| {
        let normal = (b - a).cross(c - a).normalize().to_array();
        [a, b, c].map(|p| scene::Vertex { position: p.to_array(), normal, ..square(1, 0).vertices[0] })
    });
    let vertices: Vec<_> = triangles.collect();
    let indices = (0..vertices.len() as u32).collect();
    mesh(vertices, indices, 0)
}

/// A box whose sides are 2 m wide.
fn box_() -> Mesh {
    let side = square(2, 0);
    let (mut vertices, mut indices) = (Vec::new(), Vec::new());
    let quarter = std::f32::consts::FRAC_PI_2;
    let around = (0..4).map(|turn| Quat::from_rotation_y(quarter * turn as f32));
    for rotation in around.chain([Quat::from_rotation_x(quarter), Quat::from_rotation_x(-quarter)]) {
        let first = vertices.len() as u32;
        vertices.extend(side.vertices.iter().map(|vertex| scene::Vertex {
            position: (rotation * (Vec3::from(vertex.position) + Vec3::Z)).to_array(),
            normal: (rotation * Vec3::Z).to_array(),
            ..*vertex
        }));
        indices.extend(side.indices.iter().map(|index| first + index));
    }
    mesh(vertices, indices, 0)
}

/// A street lamp: a thin post, and its head above it.
fn lamp(post_x: f32) -> Mesh {
    let (mut vertices, mut indices) = (Vec::new(), Vec::new());
    for (centre, half) in [([post_x, 0.0, 0.0], [0.02, 1.0, 0.02]), ([0.0, 1.0, 0.0], [0.7, 0.04, 0.15])] {
        let (part, first) = (box_(), vertices.len() as u32);
        vertices.extend(part.vertices.iter().map(|vertex| {
            let position = Vec3::from(centre) + Vec3::from(half) * Vec3::from(vertex.position);
            scene::Vertex { position: position.to_array(), ..*vertex }
        }));
        indices.extend(part.indices.iter().map(|index| first + index));
    }
    mesh(vertices, indices, 0)
}

/// Objects that reliefs show.
fn shown(session: &Session) -> BTreeSet<u16> {
    session.held.instances.keys().map(|(object, _)| *object).collect()
}

fn session(scene: Scene) -> Session {
    Session::new(scene).with_reliefs()
}

fn reliefs(session: &Session) -> Vec<PatchId> {
    let is_relief = |purpose: Purpose| matches!(purpose, Purpose::Relief(_));
    let patches = session.held.patches.iter().filter(|(_, held)| is_relief(held.patch.purpose));
    patches.map(|(id, _)| *id).collect()
}

/// Samples of an object among those of surfaces.
fn eye_samples(session: &Session, object: u16) -> usize {
    let surfaces = session.held.patches.values().filter(|held| held.patch.purpose == Purpose::Eye);
    surfaces.map(|held| held.patch.image.object.iter().filter(|of| **of == object).count()).sum()
}

fn objects() -> impl Iterator<Item = u16> {
    1..=BALLS as u16
}

#[test]
fn one_image_serves_all_and_no_sample_of_them_is_sent() {
    let mut session = session(rows(pyramid(), BALLS));
    session.settle();
    assert_eq!(reliefs(&session).len(), 1);
    assert!(shown(&session).into_iter().eq(objects()));
    for ((object, _), instance) in &session.held.instances {
        assert_eq!(instance.tint, session.scene.instances[usize::from(*object)].tint);
        assert_eq!(eye_samples(&session, *object), 0);
    }
    let mut without = Session::new(rows(pyramid(), BALLS));
    without.settle();
    assert!(objects().all(|object| eye_samples(&without, object) > 0) && reliefs(&without).is_empty());
    let image = &session.held.patches[&reliefs(&session)[0]].patch.image;
    let greys = image.colour.iter().filter(|[red, _, blue]| red > blue).count();
    assert!(greys == image.colour.len(), "the image itself has no tint");
}

#[test]
fn nobody_waits_for_a_verdict_where_shapes_are_judged_aside() {
    let mut session = Session::new(rows(pyramid(), BALLS)).with_reliefs_judged(Judged::Aside);
    assert!(!session.pause(), "nobody asked for anything");
    session.tick().expect("a first set");
    assert!(shown(&session).is_empty() && objects().all(|object| eye_samples(&session, object) > 0));
    // The views, and one of its axes: they are all alike.
    assert_eq!((0..10).take_while(|_| session.pause()).count(), 2);
    session.settle();
    assert!(shown(&session).into_iter().eq(objects()));
    assert!(objects().all(|object| eye_samples(&session, object) == 0), "what was sent of them is given up");
}

#[test]
fn who_comes_near_gets_samples_of_the_object_and_none_again_from_afar() {
    let mut session = session(rows(pyramid(), BALLS));
    session.settle();
    // Object 3 stands at (0, -1.5, -4.4).
    session.stand_at(DVec3::new(0.0, -1.5, -4.4 + 1.5 * RADIUS_M));
    session.settle();
    assert!(!shown(&session).contains(&3) && eye_samples(&session, 3) > 0);
    assert!(shown(&session).contains(&6), "others are far enough");
    session.stand_at(DVec3::ZERO);
    session.settle();
    assert!(shown(&session).contains(&3));
    assert_eq!(eye_samples(&session, 3), 0, "what was sent of it is given up");
}

#[test]
fn few_objects_and_shapes_that_hide_themselves_are_sampled() {
    let mut few = session(rows(pyramid(), 7));
    few.settle();
    assert!(few.held.instances.is_empty());
    let mut combs = session(rows(comb(), BALLS));
    combs.settle();
    assert!(combs.held.instances.is_empty() && reliefs(&combs).is_empty());
    assert!(objects().all(|object| eye_samples(&combs, object) > 0));
}

/// Pixels of views that are judged are wider than the post: its images may not lose it, where it stands in the middle either.
#[test]
fn a_post_that_its_images_do_not_hold_is_sampled() {
    for post_x in [-0.7, 0.0] {
        let mut lamps = session(rows(lamp(post_x), BALLS));
        lamps.settle();
        assert!(lamps.held.instances.is_empty() && reliefs(&lamps).is_empty(), "{post_x}");
        assert!(objects().all(|object| eye_samples(&lamps, object) > 0));
    }
}

#[test]
fn what_is_less_as_its_triangles_is_no_relief() {
    // Of thirty thousand triangles, which are less than an image and more than the samples that are seen; and of sixty thousand.
    for (steps, images) in [(88, 0), (128, 2)] {
        let mut balls = session(rows(sphere(steps, 0), BALLS)).with_bodies();
        balls.settle();
        assert_eq!(reliefs(&balls).len(), images, "{steps}");
        assert!(objects().all(|object| (eye_samples(&balls, object) > 0) == (images == 0)), "{steps}");
    }
}

/// Of a box, the image from above misses the foot of each side's middle.
#[test]
fn a_ball_and_a_box_need_images_from_both_ends() {
    for thing in [sphere(24, 0), box_()] {
        let mut session = session(rows(thing, BALLS));
        session.settle();
        assert_eq!((reliefs(&session).len(), session.held.instances.len()), (2, 2 * BALLS));
        assert!(objects().all(|object| eye_samples(&session, object) == 0));
    }
}

#[test]
fn objects_that_move_are_carried_by_the_one_image() {
    let still = rows(pyramid(), BALLS);
    let mut scene = animated(still, |snapshot| {
        let at_rest = snapshot.world_from_mesh[4];
        snapshot.world_from_mesh[4] = swing(snapshot.time_s, 2.0) * at_rest;
    });
    scene.instances[4].moves = true;
    let mut session = session(scene);
    session.ticks(3);
    let (before, was) = (reliefs(&session), session.held.poses_now[&4]);
    session.ticks(2);
    assert_eq!(reliefs(&session), before);
    assert!(before.len() == 1 && session.held.instances.len() == BALLS);
    assert!(session.held.poses_now[&4].translation.distance(was.translation) > 0.1);
    assert_eq!(eye_samples(&session, 4), 0);
}

#[test]
fn a_client_that_lost_its_copy_gets_it_again() {
    let mut session = session(rows(pyramid(), BALLS));
    session.settle();
    session.start_anew();
    session.settle();
    assert!(session.held.instances.len() == BALLS && reliefs(&session).len() == 1);
    session.reconnect();
    session.settle();
    assert!(session.held.instances.len() == BALLS && reliefs(&session).len() == 1);
}
