//! Shadows by what a light sees, of things that the eye never saw.

mod common;

use std::collections::BTreeMap;

use common::{Block, FLOOR, OnFloor, Stage, World, camera, lit_by, on_floor};
use glam::{DAffine3, DVec3};
use protocol::held::ObjectPose;
use protocol::{Area, AreaShape, Edit, Held, Light, Patch, PatchId, Purpose};
use surface::{BuiltSurfaces, Corners};
use vantage_client::draw::light_images::LightImages;
use vantage_client::draw::shadow::{Settings, Shadows};
use vantage_client::receive::follow::Follow;

const WORLD: World = World { origin: DVec3::ZERO, scale: 1.0, side_px: 128 };
const PLATE: Block = (DVec3::new(-0.8, 1.0, -0.8), DVec3::new(0.8, 1.02, 0.8));
const LAMP: DVec3 = DVec3::new(0.0, 3.0, 0.0);
const HALF: f64 = 0.3;

fn lamp() -> Light {
    Light::Point {
        position_world: LAMP.to_array(),
        intensity: [30.0; 3],
        direction_world: [0.0, -1.0, 0.0],
        spot_cos: [-1.0, -2.0],
        range_m: f32::INFINITY,
        area: Some(Area { half_world: [[HALF, 0.0, 0.0], [0.0, 0.0, HALF]], shape: AreaShape::Rectangle }),
    }
}

/// Patches of boxes for a purpose, as some eyes see them, numbered from `first` on.
fn patches(eyes: &[DVec3], blocks: &[Block], purpose: Purpose, first: u32) -> Vec<Edit> {
    let held = WORLD.held_from(eyes, blocks, lit_by(vec![lamp()]));
    let patches = held.patches.into_values().zip(first..);
    patches.map(|(held, id)| Edit::Add(Box::new(Patch { id: PatchId(id), purpose, ..held.patch }))).collect()
}

/// What the lamp's corners see of boxes.
fn seen_by_lamp(blocks: &[Block], first: u32) -> Vec<Edit> {
    let corner = |(s, t): (f64, f64)| LAMP + DVec3::new(s, 0.0, t) * HALF;
    let corners = [(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)].map(corner);
    patches(&corners, blocks, Purpose::Light(0), first)
}

/// A client whose eye saw the floor, and perhaps the plate.
struct Client {
    held: Held,
    stage: Stage,
}

impl Client {
    fn new(eye_saw: &[Block]) -> Client {
        Client::with(eye_saw, Shadows::Soft)
    }

    fn with(eye_saw: &[Block], shadows: Shadows) -> Client {
        let mut held = WORLD.held_from(&[], &[], lit_by(vec![lamp()]));
        held.commit(patches(&[DVec3::new(1.0, 9.0, 1.0), DVec3::new(1.5, 5.0, 5.5)], eye_saw, Purpose::Eye, 1), 0.0, 0)
            .expect("sound");
        let mut stage = Stage::new(&held);
        stage.frames.set_shadows(Settings { shadows, ..Settings::default() });
        stage.lights = Some(LightImages::new(stage.gpu(), Corners::default()));
        Client { held, stage }
    }

    fn update(&mut self, edits: Vec<Edit>) {
        let update = self.held.commit(edits, 0.0, 0).expect("sound");
        self.stage.lights.as_mut().expect("made").follow(&self.held, &update, false, &mut BuiltSurfaces::default());
    }

    /// Of the lamp's light, the mean share that arrives on the floor under the plate's middle, and well beside it.
    fn shares(&mut self) -> [f64; 2] {
        self.stage.shoot(&self.held, &camera(&WORLD));
        let Some(texture) = self.stage.frames.light_shares() else { return [1.0; 2] };
        let shares: Vec<[u8; 4]> = self.stage.read(texture);
        let floor = on_floor(&self.stage, &WORLD, &camera(&WORLD), &[FLOOR]);
        let mean = |is_meant: &dyn Fn(DVec3) -> bool| {
            let meant: Vec<f64> = floor.iter().filter(|at| is_meant(at.p)).map(|at| share(&shares, at)).collect();
            assert!(meant.len() > 20, "{} pixels", meant.len());
            meant.iter().sum::<f64>() / meant.len() as f64
        };
        let side = |p: DVec3| p.abs().with_y(0.0).max_element();
        // Umbra up to 1.04 m, penumbra up to 1.36 m; the floor ends at 4 m.
        [mean(&|p| side(p) < 0.9), mean(&|p| side(p) > 1.6 && side(p) < 3.7)]
    }
}

fn share(shares: &[[u8; 4]], at: &OnFloor) -> f64 {
    f64::from(shares[at.pixel][0]) / 255.0
}

#[test]
fn what_only_the_light_saw_casts() {
    for shadows in [Shadows::Soft, Shadows::Maps] {
        let mut client = Client::with(&[FLOOR], shadows);
        assert_eq!(client.shares(), [1.0, 1.0], "nothing above the floor is held");
        client.update(seen_by_lamp(&[FLOOR, PLATE], 10));
        let [under, beside] = client.shares();
        assert!(under < 0.01 && beside > 0.99, "{shadows:?}: {under} and {beside}");
        client.update((10..14).map(|id| Edit::Remove(PatchId(id))).collect());
        assert_eq!(client.shares(), [1.0, 1.0], "it was taken back");
        client.update(seen_by_lamp(&[FLOOR], 20));
        assert_eq!(client.shares(), [1.0, 1.0], "the plate is gone");
    }
}

#[test]
fn a_shadow_goes_where_its_object_is_moved_between_updates() {
    const PLATES: u16 = 5;
    let at = |x_m: f64| BTreeMap::from([(PLATES, DAffine3::from_translation(DVec3::X * x_m))]);
    let mut plate = seen_by_lamp(&[PLATE], 10);
    for edit in &mut plate {
        let Edit::Add(patch) = edit else { continue };
        patch.objects = vec![ObjectPose { object: PLATES, world_from_object: DAffine3::IDENTITY }];
        patch.image.object.fill(PLATES);
    }
    let mut client = Client::new(&[FLOOR]);
    let mut hard = Client::with(&[FLOOR], Shadows::Maps);
    hard.update(plate.clone());
    client.update(plate);
    for (x_m, is_there) in [(0.0, true), (20.0, false), (0.0, true)] {
        for client in [&mut client, &mut hard] {
            client.stage.lights.as_mut().expect("made").move_objects(&at(x_m));
            let [under, beside] = client.shares();
            assert!(if is_there { under < 0.01 } else { under == 1.0 } && beside > 0.99, "{x_m}: {under} and {beside}");
        }
    }
}

#[test]
fn everything_held_casts_only_while_nothing_of_the_lamp_is() {
    let mut client = Client::new(&[FLOOR, PLATE]);
    client.stage.lights = None;
    client.stage.shoot(&client.held, &camera(&WORLD));
    let shares: Vec<[u8; 4]> = client.stage.read(client.stage.frames.light_shares().expect("a lamp casts"));
    assert!(shares.iter().filter(|share| share[0] == 0).count() > 20, "by everything held");
    client.stage.lights = Some(LightImages::new(client.stage.gpu(), Corners::default()));
    let mut nothing = seen_by_lamp(&[], 10);
    nothing.truncate(1);
    client.update(nothing);
    client.stage.shoot(&client.held, &camera(&WORLD));
    let shares: Vec<[u8; 4]> = client.stage.read(client.stage.frames.light_shares().expect("a lamp casts"));
    assert!(shares.iter().all(|share| share[0] == 255), "a lamp with a patch without samples casts nothing");
}
