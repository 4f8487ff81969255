//! What lights see, sent to clients that draw shadows.

mod common;

use camera::{Pinhole, Rigid};
use common::looking_back;
use common::session::{Session, added};
use glam::{DAffine3, DVec3};
use protocol::image::Ranks;
use protocol::message::Shadows;
use protocol::{DepthImage, Lamp, Purpose, Viewpoint, shadow_views};
use scene::{LightArea, Material, Scene, SceneLight};
use surface::AddressPass;
use vantage_server::account::LightCounts;
use vantage_server::discretize::Capture;

/// Depths that differ by more than this share are of two surfaces.
const SAME_DEPTH: f32 = 0.02;

/// A viewer of a scene who draws soft shadows.
fn soft(mut session: Session) -> Session {
    session.client.draws.shadows = Shadows::Soft;
    session
}

/// A viewer of a scene who draws hard shadows alone.
fn hard(mut session: Session) -> Session {
    session.client.draws.shadows = Shadows::Hard;
    session
}

/// What some ticks do for lights, and in how many bytes.
fn ticks(session: &mut Session, count: usize) -> (LightCounts, usize) {
    let (before, mut sum) = (session.light_bytes, LightCounts::default());
    for LightCounts { added, deleted, trimmed, anew, views, sets, unchanged, without } in
        session.ticks(count).iter().map(|counts| counts.lights)
    {
        sum = LightCounts {
            added: sum.added + added,
            deleted: sum.deleted + deleted,
            trimmed: sum.trimmed + trimmed,
            anew: sum.anew + anew,
            views: sum.views + views,
            sets: sum.sets + sets,
            unchanged: sum.unchanged + unchanged,
            without: sum.without + without,
        };
    }
    (sum, session.light_bytes - before)
}

/// Samples that are held of a light; `None` where not even a patch is.
fn samples(session: &Session, light: u16) -> Option<usize> {
    let patches = session.held.patches.values().filter(|held| held.patch.purpose == Purpose::Light(light));
    patches.map(|held| held.patch.image.sample_count()).reduce(|a, b| a + b)
}

/// A scene under a square lamp of a metre that shines along -z, from a place at a time.
fn lit_from(scene: Scene, range_m: f32, place: impl Fn(f64) -> DVec3 + Send + Sync + 'static) -> Scene {
    let lights_move = place(0.0) != place(1.0);
    common::animated(Scene { lights_move, ..scene }, move |snapshot| {
        snapshot.lights = vec![SceneLight::Point {
            position_world: place(snapshot.time_s),
            colour: [100.0; 3],
            direction_world: DVec3::NEG_Z,
            spot_angles_rad: None,
            range_m,
            area: Some(LightArea { half_world: [DVec3::X * 0.5, DVec3::NEG_Y * 0.5], is_disc: false }),
        }];
    })
}

/// The same from a metre behind the origin, where it swings from side to side.
fn lit(scene: Scene) -> Scene {
    lit_from(scene, f32::INFINITY, |time_s| common::swing(time_s, 8.0).transform_point3(DVec3::Z))
}

/// From where the first light is looked from: the corners of a lamp that casts softly, else where its shadow maps are seen from.
fn views(session: &Session) -> Vec<Pinhole> {
    let snapshot = session.scene.at(session.held.scene_time_s);
    let instances = 0..session.scene.instances.len() as u16;
    let bounds = instances.filter_map(|id| session.scene.bounds_of(&snapshot, id)).reduce(camera::Bounds::union);
    let (bounds, light) = (bounds.expect("a scene"), &session.held.lighting.as_ref().expect("lit").lights[0]);
    match Lamp::of(light).filter(|_| session.client.draws.shadows == Shadows::Soft) {
        Some(lamp) => lamp.corner_views(bounds, 128).into_iter().flatten().collect(),
        None => shadow_views(
            light,
            bounds,
            Viewpoint::of(&looking_back(session.viewer.world_from_eye.translation, 128)),
            128,
        ),
    }
}

/// The share of what the first light sees now that the client holds otherwise, or not, for it.
fn wrong_share(session: &Session) -> f64 {
    wrong_share_of(session, &|_| true)
}

/// The same of some objects.
fn wrong_share_of(session: &Session, is_meant: &dyn Fn(u16) -> bool) -> f64 {
    let held = &session.held;
    let views = views(session);
    let (mut witness, mut pass) = (session.witness(), AddressPass::new(&session.gpu).expect("pipelines"));
    let mut surfaces = pass.new_surfaces().of(Purpose::Light(0));
    surfaces.rebuild(held);
    let (mut wrong, mut all) = (0, 0);
    for view in &views {
        let truth = witness.truth(view, held.scene_time_s);
        let copy = pass.view(&surfaces, view).expect("a view");
        for index in (0..truth.ids.len()).filter(|&index| truth.ids[index][0] != 0 && is_meant(truth.object(index))) {
            let (column, row) = (index as i32 % view.width_px as i32, index as i32 / view.width_px as i32);
            let around = (-1..=1).flat_map(|dy| (-1..=1).map(move |dx| (column + dx, row + dy)));
            let inside =
                around.filter(|&(x, y)| x >= 0 && y >= 0 && x < view.width_px as i32 && y < view.height_px as i32);
            let is_held =
                inside.map(|(x, y)| copy.texels[y as usize * view.width_px as usize + x as usize]).any(|texel| {
                    let apart = (texel.w() - truth.w(index)).abs();
                    texel.address().is_some()
                        && texel.object() == truth.object(index)
                        && apart <= SAME_DEPTH * truth.w(index)
                });
            all += 1;
            wrong += usize::from(!is_held);
        }
    }
    assert!(all > 200, "{all} pixels");
    wrong as f64 / all as f64
}

/// The outermost pixels of an object as its camera sees it: how many of them an image holds, and how many of those say that it ends there, as shares.
fn rim(image: &DepthImage, truth: &Capture, object: u16) -> [f64; 2] {
    let (width, height) = (truth.camera.width_px, truth.camera.height_px);
    let is_object = |x: u32, y: u32| truth.object((y * width + x) as usize) == object;
    let pixels = (1..height - 1).flat_map(|y| (1..width - 1).map(move |x| (x, y)));
    let is_inner =
        |x: u32, y: u32| [(x - 1, y), (x + 1, y), (x, y - 1), (x, y + 1)].iter().all(|&(x, y)| is_object(x, y));
    let rim: Vec<_> = pixels.filter(|&(x, y)| is_object(x, y) && !is_inner(x, y)).collect();
    let ranks = Ranks::new(&image.mask);
    // Not what is held of something behind.
    let is_held = |&sample: &usize| image.object[sample] == object;
    let held: Vec<_> =
        rim.iter().filter_map(|&(x, y)| ranks.of(&image.mask, x as u16, y as u16)).filter(is_held).collect();
    let says = held.iter().filter(|&&sample| image.ends.get(sample).is_some_and(|ends| *ends != 0)).count();
    [held.len() as f64 / rim.len() as f64, says as f64 / held.len().max(1) as f64]
}

#[test]
fn a_set_is_sent_once_and_the_eye_goes_where_it_likes() {
    let mut session = soft(Session::built_in("lamp-teapots"));
    let (first, bytes) = ticks(&mut session, 1);
    assert_eq!((first.sets, first.unchanged), (2, 0));
    assert!(samples(&session, 0) > Some(3000) && samples(&session, 1) > Some(1500) && bytes > 4000, "{bytes} bytes");
    assert!(wrong_share(&session) < 0.01, "{}", wrong_share(&session));
    let (still, bytes) = ticks(&mut session, 10);
    assert_eq!((still.added, still.views, bytes), (0, 0, 0), "nothing moves");
    let start = session.viewer.world_from_eye;
    let aside = Rigid { translation: start.transform_point(DVec3::new(0.4, -0.2, 0.1)), ..start };
    let before = session.light_bytes;
    let walked = session.walk_to(aside, 12);
    assert!(added(&walked) > 100, "the eye sees more: {}", added(&walked));
    assert!(walked.iter().all(|counts| counts.lights.views == 0 && counts.lights.unchanged == 2));
    assert_eq!(session.light_bytes, before);
}

#[test]
fn an_outline_is_sent_once_and_says_where_it_is() {
    // All points of the lamp see the same rim of a flat card.
    let card = DAffine3::from_translation(DVec3::NEG_Z * 3.0) * DAffine3::from_rotation_z(0.3);
    let wall = DAffine3::from_translation(DVec3::NEG_Z * 4.0) * DAffine3::from_scale(DVec3::splat(3.0));
    let material = common::coloured([0.6, 0.5, 0.4, 1.0]);
    let before_wall = common::scene(vec![common::square(4, 0)], vec![material], &[(0, wall), (0, card)]);
    let mut session = soft(Session::new(lit(before_wall)));
    session.tick();
    let mut witness = session.witness();
    let of_light = session.held.patches.values().filter(|held| held.patch.purpose == Purpose::Light(0));
    let rims: Vec<[f64; 2]> = of_light
        .map(|held| {
            let view = held.patch.image.camera.pinhole().expect("a camera");
            rim(&held.patch.image, &witness.truth(view, session.held.scene_time_s), 1)
        })
        .collect();
    let [[held, says], others @ ..] = &*rims else { panic!("no images") };
    assert!(*held == 1.0 && *says > 0.95, "{rims:?}");
    assert!(!others.is_empty() && others.iter().all(|[held, _]| *held < 0.2), "{rims:?}");
}

/// From where the images were seen that are held of the first light.
fn places(session: &Session) -> Vec<DVec3> {
    let of_light = session.held.patches.values().filter(|held| held.patch.purpose == Purpose::Light(0));
    of_light.map(|held| held.patch.image.camera.eye_world()).collect()
}

/// A wall at z = -9 m with square tubes on it, 0.2 m wide and 6 m deep, at these places of it.
fn tubes(places: &[(f64, f64)]) -> Scene {
    const HALF_M: f64 = 0.1;
    let wall = DAffine3::from_translation(DVec3::NEG_Z * 9.0) * DAffine3::from_scale(DVec3::splat(0.7));
    // A side, a quarter turn further each time.
    let side = |(x, y): (f64, f64), turn: usize| {
        DAffine3::from_translation(DVec3::new(x, y, -6.0))
            * DAffine3::from_rotation_z(turn as f64 * std::f64::consts::FRAC_PI_2)
            * DAffine3::from_translation(DVec3::X * HALF_M)
            * DAffine3::from_rotation_y(std::f64::consts::FRAC_PI_2)
            * DAffine3::from_scale(DVec3::new(3.0, HALF_M, 1.0))
    };
    let sides = places.iter().flat_map(|&place| (0..4).map(move |turn| (0, side(place, turn))));
    let placed: Vec<_> = std::iter::once((0, wall)).chain(sides).collect();
    let material = Material { double_sided: true, ..common::coloured([0.6, 0.5, 0.4, 1.0]) };
    common::scene(vec![common::square(4, 0)], vec![material], &placed)
}

#[test]
fn a_lamp_is_looked_from_where_it_sees_what_its_other_points_do_not() {
    // The bottom of a tube is seen from the point before it alone: its mouth is 3 m away, so from a point
    // that is d beside, the first (d - 0.1) 6 / 3 m of its 0.2 m are hidden, all where d is a quarter of a metre.
    let from = |tubes_at: &[(f64, f64)]| {
        let mut session = soft(Session::new(lit_from(tubes(tubes_at), f32::INFINITY, |_| DVec3::ZERO)));
        let (first, _) = ticks(&mut session, 1);
        assert_eq!(first.sets, 1);
        places(&session)
    };
    let has =
        |places: &[DVec3], x: f64, y: f64| places.iter().any(|place| place.distance(DVec3::new(x, y, 0.0)) < 1e-9);
    let quarters = from(&[(0.25, 0.25), (-0.25, -0.25)]);
    assert!(has(&quarters, 0.25, 0.25) && has(&quarters, -0.25, -0.25), "{quarters:?}");
    let corner = from(&[(0.5, 0.5)]);
    assert!(has(&corner, 0.5, 0.5) && !has(&corner, -0.25, -0.25), "{corner:?}");
}

#[test]
fn a_lamp_that_sees_all_from_its_middle_is_looked_from_there_alone() {
    // A far smaller one than what it lights.
    let small = common::animated(common::ball_before_wall(), |snapshot| {
        snapshot.lights = vec![SceneLight::Point {
            position_world: DVec3::Z * 2.0,
            colour: [100.0; 3],
            direction_world: DVec3::NEG_Z,
            spot_angles_rad: None,
            range_m: f32::INFINITY,
            area: Some(LightArea { half_world: [DVec3::X * 0.002, DVec3::NEG_Y * 0.002], is_disc: false }),
        }];
    });
    let mut session = soft(Session::new(small));
    let (first, _) = ticks(&mut session, 1);
    assert_eq!(first.sets, 1);
    assert_eq!(places(&session), [DVec3::Z * 2.0]);
    assert!(wrong_share(&session) < 0.01, "{}", wrong_share(&session));
}

#[test]
fn colours_are_not_sent() {
    let mut session = soft(Session::built_in("lamp-teapots"));
    session.tick();
    let of_lights = session.held.patches.values().filter(|held| held.patch.purpose != Purpose::Eye);
    let images: Vec<_> = of_lights.map(|held| &held.patch.image).collect();
    assert!(images.len() >= 8 && images.iter().all(|image| image.colour.iter().all(|colour| *colour == [0; 3])));
}

#[test]
fn where_the_lamp_moves_only_what_comes_into_its_view_is_sent() {
    let mut session = soft(Session::built_in("lamp-teapots-moving"));
    let (_, set_bytes) = ticks(&mut session, 1);
    let mut most = 0;
    for tick in 0..40 {
        let (moved, bytes) = ticks(&mut session, 1);
        assert!(moved.sets == 0 && moved.views > 0, "{moved:?}");
        if tick % 8 == 0 {
            assert!(wrong_share(&session) < 0.05, "{} after {moved:?}", wrong_share(&session));
        }
        most = most.max(bytes);
    }
    let (rest, bytes) = ticks(&mut session, 40);
    assert!(most * 4 < set_bytes && bytes / 40 * 10 < set_bytes, "{most} and {} of {set_bytes}", bytes / 40);
    assert!(rest.added * 20 < rest.anew, "{} of {} samples", rest.added, rest.anew);
}

#[test]
fn what_deforms_is_followed() {
    let mut session = soft(Session::new(lit(common::bending_figure(4.0))));
    for _ in 0..3 {
        session.ticks(4);
        let wrong = wrong_share_of(&session, &|object| object == 2);
        assert!(wrong < 0.06, "{wrong} of the figure at {} s", session.now_s);
    }
}

#[test]
fn a_lamp_that_casts_nothing_gets_no_images_until_it_does() {
    // A ball comes from behind the lamp after two seconds.
    let come = |time_s: f64| DAffine3::from_translation(DVec3::Z * if time_s < 2.0 { 9.0 } else { 0.0 });
    let mut session = soft(Session::new(lit(common::moving_ball(come))));
    let (first, bytes) = ticks(&mut session, 1);
    assert_eq!((first.without, first.added, samples(&session, 0)), (1, 0, Some(0)));
    assert!(bytes < 300, "{bytes} bytes to say so");
    let (nothing, bytes) = ticks(&mut session, 15);
    assert_eq!((nothing.without, nothing.added, bytes), (15, 0, 0));
    let (then, _) = ticks(&mut session, 10);
    assert!(then.sets == 1 && samples(&session, 0) > Some(3000), "{then:?}");
    assert!(wrong_share(&session) < 0.05, "{}", wrong_share(&session));
}

#[test]
fn where_nothing_moves_that_casts_nothing_nobody_looks_again() {
    let behind = |_| DAffine3::from_translation(DVec3::Z * 9.0);
    let mut session = soft(Session::new(lit_from(common::moving_ball(behind), f32::INFINITY, |_| DVec3::Z)));
    let (first, _) = ticks(&mut session, 1);
    assert!(first.without == 1 && first.views > 0, "{first:?}");
    let (then, bytes) = ticks(&mut session, 5);
    assert_eq!((then.without, then.views, bytes), (5, 0, 0));
}

#[test]
fn a_lamp_that_travels_leaves_behind_what_it_sees_no_more() {
    // Along a wall of 24 m with balls before it, of which it reaches 6 m at a time. Nothing but the lamp moves.
    let at = |x: f64, z: f64, scale: f64| {
        DAffine3::from_translation(DVec3::new(x, 0.0, z)) * DAffine3::from_scale(DVec3::splat(scale))
    };
    let balls = (-5..=5).map(|ball| (1, at(2.0 * f64::from(ball), -3.2, 0.3)));
    let placed: Vec<_> = [(0, at(0.0, -4.0, 12.0))].into_iter().chain(balls).collect();
    let material = common::coloured([0.6, 0.5, 0.4, 1.0]);
    let wall = common::scene(vec![common::square(4, 0), common::sphere(24, 0)], vec![material], &placed);
    let there = |time_s: f64| DVec3::new((4.0 * time_s - 9.0).min(9.0), 0.0, -2.0);
    let mut session = soft(Session::new(lit_from(wall, 2.0, there)));
    ticks(&mut session, 1);
    let begun = samples(&session, 0).expect("a set");
    let mut most = 0;
    while session.now_s < 5.0 {
        ticks(&mut session, 1);
        most = most.max(samples(&session, 0).expect("a set"));
    }
    assert!(begun > 3000 && most > begun && most <= 2 * begun, "{most} of {begun} samples");
    assert!(wrong_share(&session) < 0.05, "{}", wrong_share(&session));
}

#[test]
fn who_draws_none_gets_none() {
    let mut session = Session::built_in("lamp-teapots-moving");
    let (counts, bytes) = ticks(&mut session, 5);
    assert_eq!((counts, bytes, samples(&session, 0)), (LightCounts::default(), 0, None));
}

/// A scene under one light.
fn under(scene: Scene, light: SceneLight) -> Scene {
    common::animated(scene, move |snapshot| snapshot.lights = vec![light])
}

fn sun(direction_world: DVec3) -> SceneLight {
    SceneLight::Directional { direction_world: direction_world.normalize(), colour: [3.0; 3] }
}

fn lamp(position_world: DVec3, spot_angles_rad: Option<[f32; 2]>) -> SceneLight {
    let (colour, range_m, area) = ([100.0; 3], f32::INFINITY, None);
    SceneLight::Point { position_world, colour, direction_world: DVec3::NEG_Z, spot_angles_rad, range_m, area }
}

#[test]
fn every_light_without_an_area_gets_what_it_sees() {
    let place = DVec3::new(1.0, 0.5, 1.0);
    let lights = [sun(DVec3::new(0.5, -0.4, -1.0)), lamp(place, None), lamp(place, Some([0.3, 0.7]))];
    for (light, rows) in lights.into_iter().zip([3, 1, 1]) {
        let mut session = hard(Session::new(under(common::ball_before_wall(), light)));
        let (first, _) = ticks(&mut session, 1);
        assert!(first.sets == 1 && samples(&session, 0) > Some(1000), "{light:?}: {first:?}");
        assert!(views(&session).len() >= rows && wrong_share(&session) < 0.02, "{light:?}: {}", wrong_share(&session));
        let (then, bytes) = ticks(&mut session, 5);
        assert_eq!((then.views, bytes), (0, 0), "{light:?}: nothing moves");
    }
}

#[test]
fn a_light_with_an_area_casts_as_from_its_middle_for_who_draws_hard_shadows() {
    let mut session = hard(Session::new(lit_from(common::ball_before_wall(), f32::INFINITY, |_| DVec3::Z)));
    let (hard_set, _) = ticks(&mut session, 1);
    assert!(hard_set.sets == 1 && wrong_share(&session) < 0.02, "{}", wrong_share(&session));
    assert!(places(&session).iter().all(|eye| *eye == DVec3::Z));
    let mut session = soft(Session::new(lit_from(tubes(&[(0.5, 0.5)]), f32::INFINITY, |_| DVec3::ZERO)));
    ticks(&mut session, 1);
    assert!(places(&session).len() > 1);
}

#[test]
fn around_a_viewer_who_walks_the_sun_sees_finely_and_only_what_is_new_is_sent() {
    // A street of balls on a wall of 60 m, of which the finest frame has 4 m.
    let at = |x: f64, z: f64, scale: f64| {
        DAffine3::from_translation(DVec3::new(x, 0.0, z)) * DAffine3::from_scale(DVec3::splat(scale))
    };
    let balls = (-14..=14).map(|ball| (1, at(2.0 * f64::from(ball), -3.2, 0.3)));
    let placed: Vec<_> = [(0, at(0.0, -4.0, 30.0))].into_iter().chain(balls).collect();
    let material = common::coloured([0.6, 0.5, 0.4, 1.0]);
    let street = common::scene(vec![common::square(16, 0), common::sphere(24, 0)], vec![material], &placed);
    let mut session = hard(Session::new(under(street, sun(DVec3::new(0.5, -0.4, -1.0)))));
    let (first, set_bytes) = ticks(&mut session, 1);
    assert!(first.sets == 1, "{first:?}");
    let before = session.light_bytes;
    let start = session.viewer.world_from_eye;
    let mut views = 0;
    for step in 1..=4 {
        let there = Rigid { translation: DVec3::X * f64::from(step), ..start };
        views += session.walk_to(there, 6).iter().map(|counts| counts.lights.views).sum::<usize>();
        session.ticks(3);
        assert!(wrong_share(&session) < 0.03, "{} at {step} m", wrong_share(&session));
    }
    let walked_bytes = session.light_bytes - before;
    assert!(views > 2 && views < 40, "{views} views");
    // What is seen anew is small beside a set; of a flat wall a set's bytes are few by themselves.
    let a_view = walked_bytes / views;
    assert!(4 * a_view < set_bytes, "{a_view} bytes a view, {set_bytes} the set");
}

#[test]
fn what_reliefs_show_casts_among_what_a_light_sees() {
    let mut session = hard(Session::built_in("cars").with_reliefs());
    session.ticks(3);
    assert!(session.held.instances.len() > 3, "{} objects by reliefs", session.held.instances.len());
    let of_light = session.held.patches.values().filter(|held| held.patch.purpose == Purpose::Light(0));
    let seen: std::collections::BTreeSet<u16> = of_light.flat_map(|held| held.patch.image.object.clone()).collect();
    let shown: std::collections::BTreeSet<u16> = session.held.instances.keys().map(|(object, _)| *object).collect();
    assert!(shown.iter().any(|object| seen.contains(object)), "{shown:?} in {seen:?}");
}

#[test]
fn who_begins_anew_gets_a_set_anew() {
    let mut session = soft(Session::built_in("lamp-teapots"));
    session.ticks(3);
    let before = samples(&session, 0);
    session.start_anew();
    let (anew, _) = ticks(&mut session, 2);
    assert_eq!((anew.sets, samples(&session, 0)), (2, before));
}

#[test]
fn a_small_budget_makes_small_sets_that_stay() {
    let mut session = soft(Session::built_in("lamp-teapots-moving"));
    session.client.budget_bytes = 0;
    let (first, _) = ticks(&mut session, 1);
    let held = |session: &Session| samples(session, 0).unwrap_or(0) + samples(session, 1).unwrap_or(0);
    let begun = held(&session);
    assert!(first.sets == 2 && begun > 50, "{first:?}");
    ticks(&mut session, 40);
    let now = held(&session);
    assert!(now >= begun / 2 && now <= 2 * begun, "{now} of {begun}");
}
