//! Cases whose answer is known in closed form.

use std::f64::consts::PI;
use std::sync::Arc;

use camera::{Pinhole, Rigid};
use glam::{DAffine3, DVec2, DVec3, Vec3, dvec3};
use protocol::{Light, Lighting};
use scene::model::{Animation, Material, Mesh, Vertex};
use scene::{Bounds, Instance, Scene, Snapshot};

use super::*;

/// Where its instances are.
struct Placed(Vec<DAffine3>);

impl Animation for Placed {
    fn at(&self, _: &Scene, time_s: f64) -> Snapshot {
        Snapshot { time_s, world_from_mesh: self.0.clone(), deformed: Vec::new(), lights: Vec::new() }
    }
}

/// A scene of meshes, each with a material and a place of its own.
pub(super) fn scene(parts: Vec<(Mesh, Material, DVec3)>) -> Scene {
    let places = parts.iter().map(|(_, _, at)| DAffine3::from_translation(*at)).collect();
    let (meshes, materials): (Vec<Mesh>, Vec<Material>) = parts
        .into_iter()
        .enumerate()
        .map(|(k, (mesh, material, _))| (Mesh { material: k as u32, ..mesh }, material))
        .unzip();
    let instance = |mesh| Instance { mesh, name: String::new(), moves: false, deforms: false, tint: [255; 3] };
    Scene {
        name: "test".into(),
        instances: (0..meshes.len() as u32).map(instance).collect(),
        meshes,
        materials,
        textures: Vec::new(),
        cameras: Vec::new(),
        bounds: Bounds { min: DVec3::splat(-1.0), max: DVec3::ONE },
        walk: false,
        start: None,
        corridors: None,
        named_cameras: Vec::new(),
        offer: scene::load::Offer::default(),
        lights_move: false,
        warnings: Vec::new(),
        animation: Arc::new(Placed(places)),
    }
}

fn vertex(position: Vec3, normal: Vec3) -> Vertex {
    Vertex { position: position.into(), normal: normal.into(), uv: [0.0; 2], colour: [255; 4] }
}

/// A parallelogram that faces `u x v`.
pub(super) fn quad(corner: [f32; 3], u: [f32; 3], v: [f32; 3]) -> Mesh {
    let [corner, u, v] = [corner, u, v].map(Vec3::from);
    let normal = u.cross(v).normalize();
    let vertices = [corner, corner + u, corner + u + v, corner + v].map(|p| vertex(p, normal)).to_vec();
    Mesh { vertices, indices: vec![0, 1, 2, 0, 2, 3], ..Mesh::default() }
}

fn joined(meshes: impl IntoIterator<Item = Mesh>) -> Mesh {
    let mut all = Mesh::default();
    for mesh in meshes {
        let first = all.vertices.len() as u32;
        all.vertices.extend(mesh.vertices);
        all.indices.extend(mesh.indices.iter().map(|index| first + index));
    }
    all
}

/// A closed box around the origin, seen from outside.
pub(super) fn cuboid(half: [f32; 3]) -> Mesh {
    let [x, y, z] = half;
    joined([
        quad([-x, -y, z], [2.0 * x, 0.0, 0.0], [0.0, 2.0 * y, 0.0]),
        quad([x, -y, -z], [-2.0 * x, 0.0, 0.0], [0.0, 2.0 * y, 0.0]),
        quad([x, -y, z], [0.0, 0.0, -2.0 * z], [0.0, 2.0 * y, 0.0]),
        quad([-x, -y, -z], [0.0, 0.0, 2.0 * z], [0.0, 2.0 * y, 0.0]),
        quad([-x, y, z], [2.0 * x, 0.0, 0.0], [0.0, 0.0, -2.0 * z]),
        quad([-x, -y, -z], [2.0 * x, 0.0, 0.0], [0.0, 0.0, 2.0 * z]),
    ])
}

/// A ball around the origin with smooth normals.
fn ball(radius: f32) -> Mesh {
    const SIDES: u32 = 48;
    let at = |i: u32, j: u32| {
        let (around, up) = (2.0 * PI * f64::from(i % SIDES) / f64::from(SIDES), PI * f64::from(j) / f64::from(SIDES));
        let out = if j == 0 || j == SIDES { 0.0 } else { up.sin() };
        let normal = dvec3(out * around.cos(), -up.cos(), -out * around.sin()).as_vec3();
        vertex(normal * radius, normal)
    };
    let row = SIDES + 1;
    let vertices = (0..=SIDES).flat_map(|j| (0..=SIDES).map(move |i| at(i, j))).collect();
    let cell = |(i, j): (u32, u32)| {
        let a = j * row + i;
        [a, a + 1, a + row + 1, a, a + row + 1, a + row]
    };
    let indices = (0..SIDES).flat_map(|j| (0..SIDES).map(move |i| (i, j))).flat_map(cell).collect();
    Mesh { vertices, indices, ..Mesh::default() }
}

pub(super) fn plain(base: f32) -> Material {
    Material { base_colour: [base, base, base, 1.0], ..Material::default() }
}

fn mirror(base: f32) -> Material {
    Material { metallic: 1.0, roughness: 0.0, ..plain(base) }
}

pub(super) fn glass(ior: f32) -> Material {
    Material { transmission: 1.0, roughness: 0.0, ior, ..plain(1.0) }
}

fn ambient(level: f32) -> Lighting {
    Lighting { ambient: [level; 3], lights: Vec::new(), background: [28, 32, 40], burley: false, ..Lighting::default() }
}

fn truth(scene: &Scene) -> RayTruth {
    RayTruth::new(scene, &scene.at(0.0), &ambient(1.0))
}

/// From an eye along -z.
fn camera(eye: DVec3, size_px: u32) -> Pinhole {
    Pinhole::symmetric(Rigid::look_along(eye, DVec3::NEG_Z), (size_px, size_px), 60_f64.to_radians(), 0.01)
}

fn code(c: f64) -> u8 {
    code_from_linear(Lights::new(&ambient(1.0), None).shown(DVec3::splat(c)))[0]
}

#[test]
fn a_plane_mirror_shows_a_ball_at_the_place_of_its_image() {
    let wall = quad([-20.0, -20.0, -5.0], [40.0, 0.0, 0.0], [0.0, 40.0, 0.0]);
    // Behind the eye.
    let at = dvec3(1.0, 0.5, 1.0);
    let scene = scene(vec![(wall, mirror(0.5), DVec3::ZERO), (ball(0.4), plain(0.8), at)]);
    let camera = camera(DVec3::ZERO, 128);
    let picture = truth(&scene).picture(&camera, &Effects::ONE_BOUNCE, 1);
    let shown: Vec<usize> =
        (0..picture.rgb.len()).filter(|&pixel| picture.reflected_object[pixel] == Some(1)).collect();
    let sum: DVec2 = shown.iter().map(|&pixel| DVec2::new((pixel % 128) as f64, (pixel / 128) as f64) + 0.5).sum();
    let middle = sum / shown.len() as f64;
    // The image lies as far behind the mirror.
    let image = camera.image_from_world(at.with_z(-11.0)).expect("in front");
    assert!(middle.distance(DVec2::new(image.u, image.v)) < 0.1, "{middle} for {image:?}");
    // A ball of radius 0.4 m at 11 m.
    let area_px = PI * (0.4 * camera.focal_px / 11.0).powi(2);
    assert!((shown.len() as f64 / area_px - 1.0).abs() < 0.1, "{} for {area_px}", shown.len());
    assert_eq!(picture.rgb[shown[shown.len() / 2]], [code(0.5 * 0.8); 3], "the ball's light times the mirror's colour");
    assert!(shown.iter().all(|&pixel| picture.first_object[pixel] == Some(0) && picture.bounces[pixel] == 1));
    // Past the ball the mirror shows the background, dimmed.
    let lights = Lights::new(&ambient(1.0), None);
    assert_eq!(picture.rgb[0], code_from_linear(lights.shown(lights.background * 0.5)));
    assert_eq!((picture.reflected_object[0], picture.bounces[0]), (None, 1));
}

#[test]
fn a_ball_of_air_is_invisible_and_one_of_glass_turns_the_picture_around() {
    // Dark on the left, bright on the right, beyond the place 2.2 m behind the ball where the eye's rays meet again.
    let left = quad([-9.0, -9.0, -7.0], [9.0, 0.0, 0.0], [0.0, 18.0, 0.0]);
    let right = quad([0.0, -9.0, -7.0], [9.0, 0.0, 0.0], [0.0, 18.0, 0.0]);
    let walls = || vec![(left.clone(), plain(0.2), DVec3::ZERO), (right.clone(), plain(0.9), DVec3::ZERO)];
    let with = |ior| {
        let mut parts = walls();
        parts.push((ball(0.7), glass(ior), dvec3(0.0, 0.0, -2.0)));
        truth(&scene(parts)).picture(&camera(DVec3::ZERO, 64), &Effects::ONE_BOUNCE, 1)
    };
    let without = truth(&scene(walls())).picture(&camera(DVec3::ZERO, 64), &Effects::ONE_BOUNCE, 1);
    let air = with(1.0);
    assert_eq!(air.rgb, without.rgb);
    assert!(air.mask(&[2]).iter().filter(|shown| **shown).count() > 300, "the ball is there");
    let glass = with(1.5);
    let row = 32 * 64;
    assert_eq!((without.reflected_object[row + 26], without.first_object[row + 26]), (None, Some(0)));
    assert_eq!((glass.reflected_object[row + 26], glass.reflected_object[row + 37]), (Some(1), Some(0)));
}

/// A flat mirror whose corners have normals that lean to one side.
#[test]
fn rays_are_mirrored_about_the_normals_of_corners_not_of_triangles() {
    let lean_rad = 0.1_f64;
    let leaning = dvec3(lean_rad.sin(), 0.0, lean_rad.cos());
    let mut wall = quad([-20.0, -20.0, -5.0], [40.0, 0.0, 0.0], [0.0, 40.0, 0.0]);
    wall.vertices.iter_mut().for_each(|vertex| vertex.normal = leaning.as_vec3().into());
    // The ray along -z turns by twice as much, 5 m away; the ball lies 8 m further on.
    let out = dvec3((2.0 * lean_rad).sin(), 0.0, (2.0 * lean_rad).cos());
    let shown = |at: DVec3| {
        let scene = scene(vec![(wall.clone(), mirror(0.5), DVec3::ZERO), (ball(0.2), plain(0.8), at)]);
        truth(&scene).picture(&camera(DVec3::ZERO, 9), &Effects::ONE_BOUNCE, 1).reflected_object[40]
    };
    let ball_world = dvec3(0.0, 0.0, -5.0) + 8.0 * out;
    assert_eq!((shown(ball_world), shown(ball_world.with_x(0.0))), (Some(1), None));
}

#[test]
fn after_the_last_bounce_a_mirror_shows_its_colour() {
    let front = quad([-50.0, -50.0, -1.0], [100.0, 0.0, 0.0], [0.0, 100.0, 0.0]);
    let back = quad([-50.0, -50.0, 1.0], [0.0, 100.0, 0.0], [100.0, 0.0, 0.0]);
    let scene = scene(vec![(front, mirror(0.8), DVec3::ZERO), (back, mirror(0.5), DVec3::ZERO)]);
    let truth = truth(&scene);
    let centre = 16 * 33;
    let of = |max_bounces| {
        let effects = Effects { max_bounces, ..Effects::ONE_BOUNCE };
        let picture = truth.picture(&camera(DVec3::ZERO, 33), &effects, 1);
        (picture.rgb[centre + 16][0], picture.bounces[centre + 16], picture.reflected_object[centre + 16])
    };
    assert_eq!(of(0), (code(0.8), 0, None));
    assert_eq!(of(1), (code(0.8 * 0.5), 1, Some(1)));
    assert_eq!(of(2), (code(0.8 * 0.5 * 0.8), 2, Some(0)));
    assert_eq!(of(3), (code(0.8 * 0.5 * 0.8 * 0.5), 3, Some(1)));
}

#[test]
fn a_mirror_sees_itself_only_where_asked() {
    // A corner of two mirrors that are one object, looked into along its bisector.
    let corner = joined([
        quad([-8.0, -8.0, -8.0], [0.0, 0.0, -8.0], [0.0, 16.0, 0.0]),
        quad([-8.0, -8.0, -16.0], [8.0, 0.0, 0.0], [0.0, 16.0, 0.0]),
    ]);
    let corner = joined([corner, quad([-8.0, -8.0, -8.0], [0.0, 16.0, 0.0], [0.0, 0.0, -8.0])]);
    let scene = scene(vec![(corner, mirror(0.5), DVec3::ZERO)]);
    let bounces = |self_reflection| {
        let effects = Effects { max_bounces: 9, self_reflection, ..Effects::ONE_BOUNCE };
        let picture = truth(&scene).picture(&camera(dvec3(-4.0, 0.0, -8.0), 33), &effects, 1);
        picture.bounces[16 * 33 + 4]
    };
    assert_eq!((bounces(false), bounces(true)), (1, 2));
}

#[test]
fn mirrors_pass_through_the_backs_of_single_sided_surfaces() {
    let wall = quad([-20.0, -20.0, -5.0], [40.0, 0.0, 0.0], [0.0, 40.0, 0.0]);
    let screen = |double_sided| {
        // Behind the eye, facing away from the mirror.
        let screen = quad([-9.0, -9.0, 2.0], [18.0, 0.0, 0.0], [0.0, 18.0, 0.0]);
        let scene = scene(vec![
            (wall.clone(), mirror(1.0), DVec3::ZERO),
            (screen, Material { double_sided, ..plain(0.3) }, DVec3::ZERO),
        ]);
        truth(&scene).picture(&camera(DVec3::ZERO, 9), &Effects::ONE_BOUNCE, 1).reflected_object[40]
    };
    assert_eq!((screen(false), screen(true)), (None, Some(1)));
}

#[test]
fn a_scene_far_from_the_origin_looks_the_same() {
    let wall = quad([-20.0, -20.0, -5.0], [40.0, 0.0, 0.0], [0.0, 40.0, 0.0]);
    let at = |origin: DVec3| {
        let parts = vec![
            (wall.clone(), mirror(0.9), origin),
            (ball(0.4), plain(0.8), origin + dvec3(1.0, 0.5, 1.0)),
            (ball(0.5), glass(1.3), origin + dvec3(-0.5, 0.0, -3.0)),
        ];
        truth(&scene(parts)).picture(&camera(origin, 48), &Effects::ONE_BOUNCE, 1)
    };
    let (near, far) = (at(DVec3::ZERO), at(DVec3::splat(1e7)));
    assert_eq!(near.bounces, far.bounces);
    assert_eq!(near.rgb, far.rgb);
}

#[test]
fn a_plate_shades_the_floor_beneath_from_either_side() {
    // Half of the view is below a plate that stands between it and a light straight above.
    let floor = || (quad([-9.0, -1.0, 0.0], [18.0, 0.0, 0.0], [0.0, 0.0, -18.0]), plain(0.5), DVec3::ZERO);
    let up = quad([0.0, 3.0, 0.0], [9.0, 0.0, 0.0], [0.0, 0.0, -18.0]);
    let down = quad([0.0, 3.0, -18.0], [9.0, 0.0, 0.0], [0.0, 0.0, 18.0]);
    let sun = Light::Directional { direction_world: [0.0, -1.0, 0.0], irradiance: [2.0; 3] };
    let lamp = |height: f64| Light::Point {
        position_world: [0.0, height, -4.0],
        intensity: [90.0; 3],
        direction_world: [0.0, -1.0, 0.0],
        spot_cos: [-1.0, -2.0],
        range_m: f32::INFINITY,
        area: None,
    };
    let floor_pixels = 20 * 33;
    for plate in [up, down] {
        let scene = scene(vec![floor(), (plate, plain(0.5), DVec3::ZERO)]);
        let shown = |light: Light, shadows: bool| {
            let lighting = Lighting { lights: vec![light], ..ambient(0.1) };
            let truth = RayTruth::new(&scene, &scene.at(0.0), &lighting);
            let picture = truth.picture(&camera(DVec3::ZERO, 33), &Effects { shadows, ..Effects::PLAIN }, 1);
            [8, 24].map(|x| picture.rgb[floor_pixels + x])
        };
        let [open, under] = shown(sun, true);
        assert_eq!(shown(sun, false), [open, open]);
        assert_eq!(
            shown(Light::Directional { direction_world: [0.0, -1.0, 0.0], irradiance: [0.0; 3] }, true),
            [under; 2]
        );
        assert_ne!(open, under);
        // A lamp above the plate is hidden, one below is not.
        assert_eq!(shown(lamp(5.0), true)[1], under);
        assert_ne!(shown(lamp(2.0), true)[1], under);
        assert_eq!(shown(lamp(2.0), true), shown(lamp(2.0), false));
    }
}

#[test]
fn occlusion_in_closed_form() {
    let floor = || (quad([-50.0, 0.0, 50.0], [100.0, 0.0, 0.0], [0.0, 0.0, -100.0]), plain(1.0), DVec3::ZERO);
    let wall = (quad([0.0, 0.0, 50.0], [0.0, 0.0, -100.0], [0.0, 50.0, 0.0]), plain(1.0), DVec3::ZERO);
    let free = |parts, p: DVec3, reach_m: f64| truth(&scene(parts)).occlusion(p, DVec3::Y, reach_m, 1024);
    assert_eq!(free(vec![floor()], DVec3::ZERO, 20.0), 1.0);
    // In the edge of floor and wall: half of the sky. The rays begin 1 mm above the floor.
    let at_edge = free(vec![floor(), wall.clone()], dvec3(-1e-4, 0.0, 0.0), 1.0);
    assert!((at_edge - 0.5).abs() < 1e-3, "{at_edge}");
    assert_eq!(free(vec![floor(), wall], dvec3(-2.0, 0.0, 0.0), 1.0), 1.0, "out of reach");
    // A disc of radius r at height h hides r^2 / (r^2 + h^2), seen from either side.
    let disc = |r: f64, h: f64| {
        let rim = |k: u32| (f64::from(k) / 128.0 * 2.0 * PI).sin_cos();
        let point = |k: u32| vertex(dvec3(r * rim(k).1, h, r * rim(k).0).as_vec3(), Vec3::Y);
        let vertices = (0..128).map(point).chain([vertex(dvec3(0.0, h, 0.0).as_vec3(), Vec3::Y)]).collect();
        let indices = (0..128).flat_map(|k| [k, (k + 1) % 128, 128]).collect();
        (Mesh { vertices, indices, ..Mesh::default() }, plain(1.0), DVec3::ZERO)
    };
    for (r, h) in [(1.0, 1.0), (0.5, 1.0), (2.0, 1.0)] {
        let found = free(vec![floor(), disc(r, h)], DVec3::ZERO, 3.0);
        let wanted = 1.0 - r * r / (r * r + h * h);
        assert!((found - wanted).abs() < 4e-3, "{found} for {wanted}");
    }
}

#[test]
fn reflectors_are_told_by_their_materials() {
    let cube = || cuboid([1.0; 3]);
    let rough = Material { roughness: 0.2, ..mirror(1.0) };
    let parts = [plain(1.0), mirror(1.0), rough, glass(1.3)].map(|material| (cube(), material, DVec3::ZERO));
    assert_eq!(reflectors(&scene(parts.into())), [1, 3]);
}

/// Sheets that hide three fifths each, red before blue before white; where both triangles of a sheet meet, too.
#[test]
fn what_is_blended_is_seen_through_in_order() {
    let sheet = || quad([-2.0, -2.0, 0.0], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0]);
    let of = |colour: [f32; 3], hides: f32| {
        let [red, green, blue] = colour;
        let base_colour = [red, green, blue, hides];
        let blended = hides < 1.0;
        Material {
            base_colour,
            unlit: true,
            see_through: blended,
            alpha_cutoff: blended.then_some(0.5),
            ..Material::default()
        }
    };
    let parts = vec![
        (sheet(), of([0.9, 0.9, 0.9], 1.0), dvec3(0.0, 0.0, -4.0)),
        (sheet(), of([0.0, 0.0, 0.8], 0.6), dvec3(0.0, 0.0, -3.0)),
        (sheet(), of([0.8, 0.0, 0.0], 0.6), dvec3(0.0, 0.0, -2.0)),
    ];
    let scene = scene(parts);
    let truth = RayTruth::new(&scene, &scene.at(0.0), &Lighting::default());
    let view = Pinhole::symmetric(Rigid::look_at(DVec3::ZERO, dvec3(0.0, 0.0, -1.0)), (15, 15), 0.6, 0.1);
    let traced = truth.picture(&view, &Effects::BLENDED, 1);
    let wanted = code_from_linear(dvec3(0.6 * 0.8 + 0.16 * 0.9, 0.16 * 0.9, 0.4 * 0.6 * 0.8 + 0.16 * 0.9));
    assert!(traced.rgb.iter().all(|rgb| *rgb == wanted), "{:?}, not {wanted:?}", traced.rgb[0]);
    assert!(traced.seen_through.iter().all(|&count| count == 2));
    let cut = truth.picture(&view, &Effects::PLAIN, 1);
    assert!(cut.rgb.iter().all(|rgb| *rgb == code_from_linear(dvec3(0.8, 0.0, 0.0))), "three fifths are not cut out");
}
