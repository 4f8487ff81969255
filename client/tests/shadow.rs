//! Shadows of small held copies, pixel by pixel, against rays through the boxes themselves.

mod common;

use camera::Pinhole;
use common::{Block, FLOOR, SIDE, Stage, World, entry, view};
use glam::DVec3;
use protocol::{Held, Light, Lighting};
use vantage_client::shadow::{Settings, Shadows};

/// Of shadow maps.
const MAP_PX: u32 = 256;
/// Of the images that are held.
const HELD_PX: u32 = 192;
const CUBE: Block = (DVec3::new(-0.7, 0.5, -0.6), DVec3::new(0.6, 1.7, 0.7));
const MAPS: Settings = Settings { shadows: Shadows::Maps, side_px: MAP_PX };
const HERE: World = World { origin: DVec3::ZERO, scale: 1.0, side_px: HELD_PX };

fn lit_by(lights: Vec<Light>) -> Lighting {
    Lighting { ambient: [0.1; 3], lights, background: [0; 3], burley: false }
}

fn sun(direction: DVec3) -> Light {
    Light::Directional { direction_world: direction.normalize().as_vec3().to_array(), irradiance: [3.0; 3] }
}

fn lamp(world: &World, place: DVec3) -> Light {
    Light::Point {
        position_world: world.point(place).to_array(),
        intensity: [30.0; 3],
        direction_world: [0.0, -1.0, 0.0],
        spot_cos: [-1.0, -2.0],
        range_m: f32::INFINITY,
    }
}

fn camera(world: &World) -> Pinhole {
    let mut camera = view(world.point(DVec3::new(1.5, 5.0, 5.5)), world.origin);
    camera.near_m *= world.scale;
    camera
}

/// The share of a held copy's first light at every pixel.
fn shares(held: &Held, camera: &Pinhole) -> Vec<f64> {
    let mut stage = Stage::new(held);
    stage.frames.set_shadows(MAPS);
    stage.shoot(held, camera);
    let shares: Vec<[u8; 4]> = stage.read(stage.frames.light_shares().expect("a light casts"));
    shares.iter().map(|share| f64::from(share[0]) / 255.0).collect()
}

/// For the middle of every pixel that shows the floor's top: the pixel, the point in the boxes' units, and its depth in them.
fn on_floor<'a>(
    world: &'a World,
    camera: &'a Pinhole,
    blocks: &'a [Block],
) -> impl Iterator<Item = (usize, DVec3, f64)> + 'a {
    (0..SIDE * SIDE).filter_map(move |pixel| {
        let ray = camera.ray_eye_from_image(f64::from(pixel % SIDE) + 0.5, f64::from(pixel / SIDE) + 0.5);
        let along = camera.world_from_eye.transform_vector(ray);
        let from = (camera.world_from_eye.translation - world.origin) / world.scale;
        let hit = |block: &Block| entry(*block, from, along).map(|hit| (hit, *block == FLOOR));
        let ((t, normal), is_floor) = blocks.iter().filter_map(hit).min_by(|a, b| a.0.0.total_cmp(&b.0.0))?;
        (is_floor && normal == DVec3::Y).then_some((pixel as usize, from + t * along, t))
    })
}

/// Compares with the closed form: where rays to the light agree all around a point, within the sum of a texel of the map, a pixel
/// and half a held sample, the share is theirs. Gives how many pixels are lit and dark there, and how many are neither.
fn compare(light: Light, to_light: impl Fn(DVec3) -> DVec3, texel: f64) -> [usize; 3] {
    let blocks = [FLOOR, CUBE];
    let camera = camera(&HERE);
    let held = HERE.held(&blocks, lit_by(vec![light]));
    let shares = shares(&held, &camera);
    let is_dark = |p: DVec3| entry(CUBE, p, to_light(p)).is_some();
    let sample = 10.0 / (f64::from(HELD_PX) / 2.0 / 0.5_f64.tan());
    let mut counts = [0; 3];
    for (pixel, p, depth) in on_floor(&HERE, &camera, &blocks) {
        let towards = to_light(p).normalize();
        // A texel's shadow on the floor, a pixel's, and half of a sample's.
        let reach = texel / towards.y
            + depth / camera.focal_px / (camera.world_from_eye.translation - p).normalize().y
            + sample / 2.0;
        let around = (0..16).map(|k| {
            let (sin, cos) = (f64::from(k) / 16.0 * std::f64::consts::TAU).sin_cos();
            is_dark(p + DVec3::new(cos, 0.0, sin) * reach)
        });
        let dark = around.filter(|dark| *dark).count();
        match dark {
            0 => {
                assert_eq!(shares[pixel], 1.0, "lit {p}");
                counts[0] += 1;
            }
            16 => {
                assert_eq!(shares[pixel], 0.0, "in shadow {p}");
                counts[1] += 1;
            }
            _ => counts[2] += 1,
        }
    }
    counts
}

#[test]
fn the_sun_casts_the_outline_of_a_cube() {
    let direction = DVec3::new(0.5, -1.0, 0.3);
    // The widest map spans the floor's bounding ball and at most a quarter more.
    let texel = 2.0 * 5.9 * 1.25 / f64::from(MAP_PX);
    let [lit, dark, between] = compare(sun(direction), |_| -direction, texel);
    assert!(lit > 1500 && dark > 60 && between < 900, "{lit} {dark} {between}");
}

#[test]
fn a_lamp_casts_the_outline_of_a_cube() {
    let place = DVec3::new(-0.4, 4.0, -0.3);
    // A texel of the face below, on the floor.
    let texel = 2.0 * 4.0 / f64::from(MAP_PX - 2);
    let [lit, dark, between] = compare(lamp(&HERE, place), |p| place - p, texel);
    assert!(lit > 1500 && dark > 60 && between < 900, "{lit} {dark} {between}");
}

#[test]
fn a_spot_casts_by_one_map() {
    let place = DVec3::new(-0.4, 4.0, -0.3);
    let Light::Point { position_world, intensity, range_m, .. } = lamp(&HERE, place) else { unreachable!() };
    let direction_world = [0.0, -1.0, 0.0];
    let light = Light::Point { position_world, intensity, direction_world, spot_cos: [0.9, 0.6], range_m };
    let texel = 2.0 * 4.0 * (1.0 / 0.36 - 1.0_f64).sqrt() / f64::from(MAP_PX - 2);
    let [lit, dark, between] = compare(light, |p| place - p, texel);
    assert!(lit > 1500 && dark > 60 && between < 900, "{lit} {dark} {between}");
}

#[test]
fn a_plane_does_not_shadow_itself() {
    let places = [(DVec3::ZERO, 1e-3), (DVec3::ZERO, 1.0), (DVec3::ZERO, 1e4), (DVec3::new(1e6, 0.0, -1e6), 1.0)];
    for (origin, scale) in places {
        let world = World { origin, scale, side_px: HELD_PX };
        let camera = camera(&world);
        for elevation in [1.0_f64, 3.0, 10.0, 60.0] {
            let (sin, cos) = elevation.to_radians().sin_cos();
            let grazing = sun(DVec3::new(0.8 * cos, -sin, 0.6 * cos));
            let near = lamp(&world, DVec3::new(-6.0 * cos, 6.0 * sin, 0.4));
            for light in [grazing, near] {
                let held = world.held(&[FLOOR], lit_by(vec![light]));
                let shares = shares(&held, &camera);
                let dark = on_floor(&world, &camera, &[FLOOR]).filter(|(pixel, ..)| shares[*pixel] < 1.0).count();
                assert_eq!(dark, 0, "scale {scale}, {elevation} degrees, {light:?}");
            }
        }
    }
}

#[test]
fn what_was_seen_from_behind_casts_too() {
    // The cube's lit side was seen by nobody.
    let blocks = [FLOOR, CUBE];
    let direction = DVec3::new(0.0, -1.0, 1.2);
    let eyes = [DVec3::new(0.0, 5.0, 7.0), DVec3::new(1.0, 4.0, 7.0)];
    let held = HERE.held_from(&eyes, &[FLOOR, (CUBE.0, DVec3::new(0.6, 40.0, 0.7))], lit_by(vec![sun(direction)]));
    let camera = view(DVec3::new(0.0, 5.0, 7.0), DVec3::ZERO);
    let shares = shares(&held, &camera);
    let before = DVec3::new(0.0, 0.0, 1.6);
    let (pixel, ..) = on_floor(&HERE, &camera, &blocks)
        .min_by(|a, b| a.1.distance(before).total_cmp(&b.1.distance(before)))
        .expect("the floor is seen");
    assert_eq!(shares[pixel], 0.0);
}

#[test]
fn nothing_is_made_where_no_light_casts() {
    let held = HERE.held(&[FLOOR, CUBE], lit_by(Vec::new()));
    let mut stage = Stage::new(&held);
    stage.frames.set_shadows(MAPS);
    stage.shoot(&held, &camera(&HERE));
    assert!(stage.frames.light_shares().is_none() && !stage.frames.casts());
}

#[test]
fn off_changes_no_bit_and_leaves_nothing() {
    let held = HERE.held(&[FLOOR, CUBE], lit_by(vec![sun(DVec3::new(0.5, -1.0, 0.3))]));
    let camera = camera(&HERE);
    let mut stage = Stage::new(&held);
    let never = stage.shoot(&held, &camera);
    stage.frames.set_shadows(MAPS);
    let on = stage.shoot(&held, &camera);
    assert!(stage.frames.casts());
    stage.frames.set_shadows(Settings::default());
    let off_again = stage.shoot(&held, &camera);
    assert!(stage.frames.light_shares().is_none());
    assert_eq!(never, off_again);
    assert_ne!(never, on);
}

#[test]
fn each_of_several_lights_casts_its_own_shadow() {
    let directions = [DVec3::new(0.9, -1.0, 0.0), DVec3::new(-0.9, -1.0, 0.0), DVec3::new(0.0, -1.0, 0.9)];
    let lights = directions.map(|direction| match sun(direction) {
        // The last is the strongest.
        Light::Directional { direction_world, .. } => {
            Light::Directional { direction_world, irradiance: [direction.z as f32 + 1.0; 3] }
        }
        light => light,
    });
    let blocks = [FLOOR, CUBE];
    let held = HERE.held(&blocks, lit_by(lights.to_vec()));
    let camera = camera(&HERE);
    let mut stage = Stage::new(&held);
    stage.frames.set_shadows(MAPS);
    stage.shoot(&held, &camera);
    let shares: Vec<[u8; 4]> = stage.read(stage.frames.light_shares().expect("lights cast"));
    for (channel, light) in [2, 0, 1].into_iter().enumerate() {
        let middle = (CUBE.0 + CUBE.1) / 2.0;
        let shadow = middle + directions[light] * middle.y;
        let (pixel, p, _) = on_floor(&HERE, &camera, &blocks)
            .min_by(|a, b| a.1.distance(shadow).total_cmp(&b.1.distance(shadow)))
            .expect("the floor is seen");
        let expected: [u8; 3] = std::array::from_fn(|other| if other == channel { 0 } else { 255 });
        assert_eq!(shares[pixel][..3], expected, "light {light} at {p}");
        assert_eq!(shares[pixel][3], 0, "no fourth light");
    }
}
