//! Bodies: what is sent of a figure is the figure, at any time.

mod common;

use std::sync::Arc;

use common::session::Session;
use glam::{DAffine3, DQuat, DVec3, Vec3};
use protocol::Purpose;
use protocol::body::bent;
use scene::model::Animation;
use scene::{Bounds, Deformed, Instance, Material, Mesh, Rig, Scene, Snapshot, Vertex};
use vantage_server::bodies::{Unfit, build};

const RINGS: u32 = 24;
const PERIOD_S: f64 = 1.25;
const FAR: DVec3 = DVec3::new(1e6, 2.0, -3e5);

/// A tube along z that lies in a file with z up; two bones stand it up, and bend it in its middle by a turn that goes to and fro.
struct Tube {
    mesh: Mesh,
    place: DVec3,
}

impl Tube {
    fn shares(vertex: &Vertex) -> [f32; 2] {
        let along = (vertex.position[2] / 2.0 + 0.5).clamp(0.0, 1.0);
        [1.0 - along, along]
    }
}

impl Animation for Tube {
    fn at(&self, _: &Scene, time_s: f64) -> Snapshot {
        let rig = &self.rigs()[0];
        let bones = self.bones(rig, time_s);
        let anchor_world = self.place + DVec3::X * time_s.rem_euclid(PERIOD_S);
        let moved = |vertex: &Vertex| {
            let shares = Tube::shares(vertex);
            let p = Vec3::from(vertex.position).as_dvec3();
            // Far from the origin shares would have to sum to 1 more exactly than f32 can.
            let sum = bones
                .iter()
                .zip(shares)
                .map(|(bone, share)| (bone.transform_point3(p) - anchor_world) * f64::from(share));
            Vertex { position: sum.sum::<DVec3>().as_vec3().to_array(), ..*vertex }
        };
        let vertices = self.mesh.vertices.iter().map(moved).collect();
        let deformed = vec![Deformed { instance: 0, vertices }];
        Snapshot {
            time_s,
            world_from_mesh: vec![DAffine3::from_translation(anchor_world)],
            deformed,
            lights: Vec::new(),
        }
    }

    fn rigs(&self) -> Vec<Rig> {
        let influences = self.mesh.vertices.iter().map(|vertex| {
            let [root, tip] = Tube::shares(vertex);
            [(0, root), (1, tip), (0, 0.0), (0, 0.0)]
        });
        let unbent = self.mesh.vertices.iter().map(|vertex| [vertex.position, vertex.normal]).collect();
        vec![Rig {
            instance: 0,
            bones: 2,
            unbent,
            is_flat: false,
            influences: influences.collect(),
            period_s: PERIOD_S,
        }]
    }

    fn bones(&self, _: &Rig, time_s: f64) -> Vec<DAffine3> {
        let phase = time_s.rem_euclid(PERIOD_S) / PERIOD_S;
        let up = DQuat::from_rotation_x(-std::f64::consts::FRAC_PI_2);
        let turn = DQuat::from_rotation_z(1.2 * (phase * std::f64::consts::TAU).sin());
        let stretch = DVec3::new(1.0, 1.0 + 0.2 * phase, 1.0);
        let world = |rotation: DQuat| {
            DAffine3::from_scale_rotation_translation(stretch, rotation, self.place + DVec3::X * phase)
        };
        vec![world(up), world(turn * up)]
    }
}

fn tube(place: DVec3) -> Scene {
    let corner = |index: u32| {
        let turn = (index % 8) as f32 / 8.0 * std::f32::consts::TAU;
        let normal = Vec3::new(turn.cos(), turn.sin(), 0.0);
        let z = 2.0 * (index / 8) as f32 / RINGS as f32 - 1.0;
        let position = (0.2 * normal + z * Vec3::Z).to_array();
        Vertex { position, normal: normal.to_array(), uv: [0.0; 2], colour: [255, 128, 0, 255] }
    };
    let cell = |index: u32| {
        let [a, b] = [index, index / 8 * 8 + (index + 1) % 8];
        [a, b, b + 8, a, b + 8, a + 8]
    };
    let vertices: Vec<Vertex> = (0..8 * (RINGS + 1)).map(corner).collect();
    let bounds = [[-0.2, -0.2, -1.0], [0.2, 0.2, 1.0]];
    let mesh = Mesh { vertices, indices: (0..8 * RINGS).rev().flat_map(cell).collect(), bounds, ..Mesh::default() };
    let instance = Instance { mesh: 0, name: "tube".into(), moves: true, deforms: true, tint: [255; 3] };
    Scene {
        name: "tube".into(),
        meshes: vec![mesh.clone()],
        materials: vec![Material::default()],
        textures: Vec::new(),
        instances: vec![instance],
        lights_move: false,
        cameras: Vec::new(),
        bounds: Bounds { min: place - 2.0, max: place + 2.0 },
        walk: false,
        start: None,
        corridors: None,
        named_cameras: Vec::new(),
        offer: scene::load::Offer::default(),
        warnings: Vec::new(),
        animation: Arc::new(Tube { mesh, place }),
    }
}

#[test]
fn a_body_is_bent_as_the_scene_bends_it_at_any_time() {
    let scene = tube(FAR);
    let made = build(&scene, 0, &[Some(7)]).expect("it fits");
    assert_eq!(made.atlas.material, [7], "of one material, so of one texel");
    let body = &made.body;
    let clip = &body.skin.as_ref().expect("bones bend it").clip;
    // A tenth of a pixel of a figure a thousand pixels high, and half as much for what its numbers are rounded by.
    let radius_m = 1.02;
    let most_m = 2e-4 * radius_m * 1.5;

    // In which order vertices are is the body's own: they are found by where they are.
    let mut used = 0.0_f64;
    for time_s in [-3.0, 0.0, 0.1, 0.333, 0.9, 1.2499, 1.25, 1e6 + 0.7] {
        let snapshot = scene.at(time_s);
        let bones = clip.at(time_s);
        let there: Vec<DVec3> = snapshot.deformed[0]
            .vertices
            .iter()
            .map(|vertex| snapshot.world_from_mesh[0].transform_point3(Vec3::from(vertex.position).as_dvec3()))
            .collect();
        for vertex in 0..body.positions.len() {
            let at_rest = body.position(vertex);
            let rest = |vertex: &Vertex| Vec3::from(vertex.position).distance(at_rest);
            let vertices = scene.meshes[0].vertices.iter();
            let (index, _) = vertices.enumerate().min_by(|a, b| rest(a.1).total_cmp(&rest(b.1))).expect("some");
            let here = made.origin_world.expect("bones move it") + bent(body, &bones, vertex).as_dvec3();
            used = used.max(here.distance(there[index]));
        }
    }
    assert!(used < most_m && used > 0.0, "{used} m of {most_m}");
}

#[test]
fn what_textures_tell_place_by_place_is_sampled() {
    assert_eq!(build(&tube(FAR), 0, &[None]).err(), Some(Unfit::Varies));
}

/// What is held of the tube after some ticks: bodies, samples for the eye, and bytes of the later half of the ticks.
fn served(session: Session) -> (usize, usize, usize) {
    const TICKS: usize = 12;
    let mut session = session;
    session.ticks(TICKS / 2);
    let before = session.sent_bytes;
    session.ticks(TICKS / 2);
    let eye = session.held.patches.values().filter(|held| held.patch.purpose == Purpose::Eye);
    let samples = eye.map(|held| held.patch.image.sample_count()).sum();
    (session.held.bodies.len(), samples, session.sent_bytes - before)
}

#[test]
fn a_figure_that_is_near_is_sent_once_and_nothing_after_it() {
    let near = || Session::small(tube(DVec3::new(-0.5, 0.0, -3.0)), 2);
    assert_eq!(served(near().with_bodies()), (1, 0, 0));
    let (bodies, samples, bytes) = served(near());
    assert!(bodies == 0 && samples > 100 && bytes > 1000, "{samples} samples, {bytes} bytes");
}

#[test]
fn a_figure_that_is_far_is_sampled() {
    let (bodies, samples, _) = served(Session::small(tube(DVec3::NEG_Z * 30.0), 2).with_bodies());
    assert!(bodies == 0 && samples > 0, "{bodies} bodies, {samples} samples");
}
