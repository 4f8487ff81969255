//! Ambient occlusion of small held copies, pixel by pixel.

mod common;

use camera::Pinhole;
use common::{Block, FLOOR, SIDE, Stage, World, view};
use glam::DVec3;
use protocol::{Held, Lighting, PatchId, Purpose};
use vantage_client::draw::occlusion::{Occlusion, Settings};

/// Boxes as seen from around and above, relative to `origin`.
fn held(blocks: &[Block], origin: DVec3) -> Held {
    let lighting =
        Lighting { ambient: [1.0; 3], lights: Vec::new(), background: [0; 3], burley: false, ..Lighting::default() };
    World { origin, scale: 1.0, side_px: SIDE }.held(blocks, lighting)
}

struct Frame {
    picture: Vec<[u8; 4]>,
    /// Empty where none was measured.
    shares: Vec<f32>,
    camera: Pinhole,
}

impl Frame {
    /// The share at the pixel that shows a point.
    fn share(&self, p_world: DVec3) -> f32 {
        let image = self.camera.image_from_world(p_world).expect("before the eye");
        self.shares[(image.v as u32 * SIDE + image.u as u32) as usize]
    }
}

/// Draws with each of some settings in turn, by one renderer; the last frame is given.
fn draw(held: &Held, camera: &Pinhole, settings: &[Settings]) -> Frame {
    let mut stage = Stage::new(held);
    let mut picture = Vec::new();
    if settings.is_empty() {
        picture = stage.shoot(held, camera);
    }
    for settings in settings {
        stage.frames.set_occlusion(*settings);
        picture = stage.shoot(held, camera);
    }
    let shares = stage.frames.ambient_shares().map_or_else(Vec::new, |shares| stage.read(shares));
    Frame { picture, shares, camera: *camera }
}

fn by(occlusion: Occlusion) -> Settings {
    Settings { occlusion, reach_m: 1.0, taps: 128 }
}

#[test]
fn an_open_floor_is_light_and_the_foot_of_a_wall_darkens() {
    let wall = (DVec3::new(-3.0, 0.0, -2.0), DVec3::new(3.0, 2.0, -1.5));
    let held = held(&[FLOOR, wall], DVec3::ZERO);
    let camera = view(DVec3::new(0.0, 3.0, 5.0), DVec3::new(0.0, 0.0, -0.5));
    for occlusion in [Occlusion::Plain, Occlusion::Graph] {
        let settings = Settings { reach_m: 2.0, ..by(occlusion) };
        let frame = draw(&held, &camera, &[settings]);
        let open = frame.share(DVec3::new(0.0, 0.0, 2.5));
        let at = |step: u32| frame.share(DVec3::new(0.0, 0.0, -1.4 + 0.1 * f64::from(step)));
        let shares: Vec<f32> = (0..6).map(at).collect();
        let foot = shares.iter().copied().fold(1.0, f32::min);
        assert!(open > 0.97, "{occlusion:?}: open {open}");
        // Slices towards the wall hide up to (1 - d/r)^2 = 0.9 of their half of the sky, 0.1 m from it; contacts come out lighter.
        assert!((0.5..0.8).contains(&foot), "{occlusion:?}: from the foot on {shares:?}");
    }
}

#[test]
fn what_occlusion_would_not_change_it_is_not_drawn_for() {
    let wall = (DVec3::new(-3.0, 0.0, -2.0), DVec3::new(3.0, 2.0, -1.5));
    let camera = view(DVec3::new(0.0, 3.0, 5.0), DVec3::new(0.0, 0.0, -0.5));
    let lit = held(&[FLOOR, wall], DVec3::ZERO);
    assert!(!draw(&lit, &camera, &[by(Occlusion::Plain)]).shares.is_empty());
    let mut unlit = lit.clone();
    unlit.materials.iter_mut().for_each(|material| material.unlit = true);
    let mut dark = lit.clone();
    dark.lighting.iter_mut().for_each(|lighting| lighting.ambient = [0.0; 3]);
    for held in [unlit, dark] {
        let frame = draw(&held, &camera, &[by(Occlusion::Plain)]);
        assert!(frame.shares.is_empty() && frame.picture == draw(&held, &camera, &[]).picture);
    }
}

#[test]
fn only_graph_cameras_see_what_a_post_hides() {
    // The eye, the post and the block stand in line; beside the post it sees the floor to the sides of the block.
    let post = (DVec3::new(-0.6, 0.0, 1.8), DVec3::new(0.6, 2.6, 2.0));
    let block = (DVec3::new(-0.88, 0.0, -0.6), DVec3::new(-0.2, 0.8, 0.2));
    let camera = view(DVec3::new(0.0, 1.4, 5.0), DVec3::new(0.0, 0.4, 0.0));
    let beside = DVec3::new(-1.15, 0.0, -0.2);
    let share = |blocks: &[Block], occlusion| draw(&held(blocks, DVec3::ZERO), &camera, &[by(occlusion)]).share(beside);
    let hidden_from_plain = share(&[FLOOR, post, block], Occlusion::Plain);
    let seen_by_graph = share(&[FLOOR, post, block], Occlusion::Graph);
    let without = share(&[FLOOR, post], Occlusion::Graph);
    assert!(hidden_from_plain > 0.97, "the view does not see the block: {hidden_from_plain}");
    assert!(without > 0.97, "nothing else is near: {without}");
    assert!(seen_by_graph < hidden_from_plain - 0.03, "{seen_by_graph} and {hidden_from_plain}");
}

/// A post as the eye sees it, and what stands behind it as a server sends it.
fn behind_a_post(block: Option<Block>) -> (Held, Pinhole) {
    let post = (DVec3::new(-0.6, 0.0, 1.8), DVec3::new(0.6, 2.6, 2.0));
    let camera = view(DVec3::new(0.0, 1.4, 5.0), DVec3::new(0.0, 0.4, 0.0));
    let world = World { origin: DVec3::ZERO, scale: 1.0, side_px: SIDE };
    let lighting =
        Lighting { ambient: [1.0; 3], lights: Vec::new(), background: [0; 3], burley: false, ..Lighting::default() };
    let eye = [camera.world_from_eye.translation];
    let mut held = world.held_from(&eye, &[FLOOR, post], lighting.clone());
    let from_behind = [DVec3::new(-2.0, 3.0, -4.0), DVec3::new(-4.0, 3.0, 2.0)];
    let sent = block.map(|block| world.held_from(&from_behind, &[block], lighting));
    for (id, mut patch) in sent.into_iter().flat_map(|sent| sent.patches) {
        patch.patch.id = PatchId(100 + id.0);
        patch.patch.purpose = Purpose::Occluders;
        held.patches.insert(patch.patch.id, patch);
    }
    (held, camera)
}

#[test]
fn what_the_eye_never_saw_darkens_and_is_never_shown() {
    let block = (DVec3::new(-0.88, 0.0, -0.6), DVec3::new(-0.2, 0.8, 0.2));
    let beside = DVec3::new(-1.15, 0.0, -0.2);
    let (alone, camera) = behind_a_post(None);
    let (with_occluders, _) = behind_a_post(Some(block));
    let share = |held: &Held, occlusion| draw(held, &camera, &[by(occlusion)]).share(beside);
    assert!(share(&alone, Occlusion::Graph) > 0.97, "{}", share(&alone, Occlusion::Graph));
    assert!(share(&with_occluders, Occlusion::Plain) > 0.97, "the view's own z-buffer has none of it");
    let darkened = share(&with_occluders, Occlusion::Graph);
    assert!(darkened < 0.93, "{darkened}");
    // Neither from the front nor from where it was captured is it seen.
    for eye in [camera, view(DVec3::new(-4.0, 3.0, 2.0), DVec3::ZERO)] {
        assert_eq!(draw(&alone, &eye, &[]).picture, draw(&with_occluders, &eye, &[]).picture);
    }
}

#[test]
fn off_changes_no_bit_and_leaves_nothing() {
    let block = (DVec3::new(-0.5, 0.0, -0.5), DVec3::new(0.5, 1.0, 0.5));
    let held = held(&[FLOOR, block], DVec3::ZERO);
    let camera = view(DVec3::new(2.0, 3.0, 5.0), DVec3::ZERO);
    let never = draw(&held, &camera, &[]);
    let on = draw(&held, &camera, &[by(Occlusion::Graph)]);
    let off_again = draw(&held, &camera, &[by(Occlusion::Graph), by(Occlusion::None)]);
    assert!(never.shares.is_empty() && off_again.shares.is_empty());
    assert_eq!(never.picture, off_again.picture);
    assert_ne!(never.picture, on.picture);
}

#[test]
fn far_from_the_origin_it_is_the_same() {
    let wall = (DVec3::new(-3.0, 0.0, -2.0), DVec3::new(3.0, 2.0, -1.5));
    for occlusion in [Occlusion::Plain, Occlusion::Graph] {
        let shares = [DVec3::ZERO, DVec3::new(1e7, 0.0, -1e7)].map(|origin| {
            let camera = view(origin + DVec3::new(0.0, 3.0, 5.0), origin);
            draw(&held(&[FLOOR, wall], origin), &camera, &[by(occlusion)]).shares
        });
        let differences = shares[0].iter().zip(&shares[1]).map(|(near, far)| f64::from((near - far).abs()));
        let mean = differences.sum::<f64>() / f64::from(SIDE * SIDE);
        // Samples at outlines fall into other pixels by rounding; the rest is equal.
        assert!(mean < 1e-3, "{occlusion:?}: {mean}");
    }
}

#[test]
fn inside_of_what_is_held_graph_cameras_stand_around_the_eye() {
    let walls = [
        FLOOR,
        (DVec3::new(-4.0, 0.0, -4.0), DVec3::new(4.0, 2.0, -3.5)),
        (DVec3::new(-0.3, 0.0, -2.0), DVec3::new(0.3, 1.0, -1.6)),
    ];
    let held = held(&walls, DVec3::ZERO);
    let camera = view(DVec3::new(0.0, 1.2, 2.0), DVec3::new(0.0, 0.6, -2.0));
    let [plain, graph] = [Occlusion::Plain, Occlusion::Graph].map(|by_what| draw(&held, &camera, &[by(by_what)]));
    let open = DVec3::new(1.0, 0.0, 0.0);
    assert!(graph.share(open) > 0.97, "{}", graph.share(open));
    assert_ne!(plain.shares, graph.shares);
}
