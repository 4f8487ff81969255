//! Shadows of small held copies, pixel by pixel, against rays through the boxes themselves.

mod common;

use camera::Pinhole;
use common::{Block, FLOOR, OnFloor, Stage, World, camera, entry, lit_by, on_floor, view};
use glam::DVec3;
use protocol::{Held, Light};
use vantage_client::draw::effects::Strengths;
use vantage_client::draw::frame::Options;
use vantage_client::draw::shadow::{Settings, Shadows};
use vantage_client::draw::soft;

/// Of shadow maps.
const MAP_PX: u32 = 256;
/// Of the images that are held.
const HELD_PX: u32 = 256;
const CUBE: Block = (DVec3::new(-0.7, 0.5, -0.6), DVec3::new(0.6, 1.7, 0.7));
const MAPS: Settings = Settings {
    shadows: Shadows::Maps,
    side_px: MAP_PX,
    soft: soft::Settings {
        choice: soft::Choice::Always(soft::Method::Maps),
        points: 16,
        map_px: MAP_PX,
        pace: soft::Pace::All,
        bias: soft::Bias { times: 1 },
    },
};
const HERE: World = World { origin: DVec3::ZERO, scale: 1.0, side_px: HELD_PX };

/// None sees a face of the cube edge-on: such samples reach far beyond it.
const EYES: [DVec3; 5] = [
    DVec3::new(0.0, 5.0, 7.0),
    DVec3::new(7.0, 5.0, 0.0),
    DVec3::new(0.0, 5.0, -7.0),
    DVec3::new(-7.0, 5.0, 0.0),
    DVec3::new(0.0, 9.0, 0.0),
];

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
        area: None,
    }
}

/// A stage with shadows of a held copy.
fn stage(held: &Held) -> Stage {
    let mut stage = Stage::new(held);
    stage.frames.set_shadows(MAPS);
    stage
}

/// The shares of a held copy's lights, in their channels, at every pixel.
fn shares(stage: &mut Stage, held: &Held, camera: &Pinhole) -> Vec<[u8; 4]> {
    stage.shoot(held, camera);
    stage.read(stage.frames.light_shares().expect("a light casts"))
}

/// Compares with the closed form: where rays to the light agree all around a point, within the sum of a texel of the map, a pixel
/// and a held sample's shadow, the share is theirs. A `sample` and a `texel` are as large as their shadows on the floor. Says how many pixels
/// are lit there, how many dark, and how many lie beside the outline.
fn compare(light: Light, to_light: impl Fn(DVec3) -> DVec3, texel: f64, sample: f64) {
    let blocks = [FLOOR, CUBE];
    let camera = camera(&HERE);
    let held = HERE.held_from(&EYES, &blocks, lit_by(vec![light]));
    let mut stage = stage(&held);
    let shares = shares(&mut stage, &held, &camera);
    let is_dark = |p: DVec3| entry(CUBE, p, to_light(p)).is_some();
    let (mut lit, mut dark, mut beside) = (0, 0, 0);
    for OnFloor { pixel, p, footprint } in on_floor(&stage, &HERE, &camera, &blocks) {
        let reach = texel + footprint + sample;
        if p.abs().max_element() > FLOOR.1.x - reach {
            continue;
        }
        let is_dark_at = |turn: u32| {
            let (sin, cos) = (f64::from(turn) / 16.0 * std::f64::consts::TAU).sin_cos();
            is_dark(p + DVec3::new(cos, 0.0, sin) * reach)
        };
        match (0..16).filter(|turn| is_dark_at(*turn)).count() {
            0 => {
                assert_eq!(shares[pixel][0], 255, "lit at {p}");
                lit += 1;
            }
            16 => {
                assert_eq!(shares[pixel][0], 0, "dark at {p}");
                dark += 1;
            }
            _ => beside += 1,
        }
    }
    assert!(lit > 2000 && dark > 100 && beside < 600, "{lit} {dark} {beside}");
}

/// What a held sample spans at a distance of 9, about as far as the farthest of the cube are.
const SAMPLE: f64 = 9.0 * 0.546_302_489_843_790_5 / (HELD_PX as f64 / 2.0);

#[test]
fn the_sun_casts_the_outline_of_a_cube() {
    let direction = DVec3::new(0.5, -1.0, 0.3);
    let lengthens = direction.length();
    // The widest map spans the floor's bounding ball and at most a quarter more.
    let texel = 2.0 * 5.9 * 1.25 / f64::from(MAP_PX);
    compare(sun(direction), |_| -direction, texel * lengthens, SAMPLE * lengthens);
}

const LAMP: DVec3 = DVec3::new(-0.4, 4.0, -0.3);
/// How many times larger the shadow of the cube's top is.
const LAMP_GROWS: f64 = 4.0 / (4.0 - CUBE.1.y);

#[test]
fn a_lamp_casts_the_outline_of_a_cube() {
    // A texel of the face below, on the floor.
    let texel = 2.0 * LAMP.y / f64::from(MAP_PX - 2);
    compare(lamp(&HERE, LAMP), |p| LAMP - p, texel, SAMPLE * LAMP_GROWS);
}

#[test]
fn a_spot_casts_by_one_map() {
    let Light::Point { position_world, intensity, range_m, .. } = lamp(&HERE, LAMP) else { unreachable!() };
    let direction_world = [0.0, -1.0, 0.0];
    let light = Light::Point { position_world, intensity, direction_world, spot_cos: [0.9, 0.6], range_m, area: None };
    let texel = 2.0 * LAMP.y * (1.0 / 0.36 - 1.0_f64).sqrt() / f64::from(MAP_PX - 2);
    compare(light, |p| LAMP - p, texel, SAMPLE * LAMP_GROWS);
}

#[test]
fn a_plane_does_not_shadow_itself() {
    // So wide that nobody sees its sides, whose samples rise above it by a part of one.
    let plane = (DVec3::new(-60.0, -1.0, -60.0), DVec3::new(60.0, 0.0, 60.0));
    let places = [(DVec3::ZERO, 1e-3), (DVec3::ZERO, 1.0), (DVec3::ZERO, 1e4), (DVec3::new(1e6, 0.0, -1e6), 1.0)];
    for (origin, scale) in places {
        let world = World { origin, scale, side_px: 64 };
        let camera = camera(&world);
        let mut held = world.held_from(&EYES, &[plane], lit_by(Vec::new()));
        let mut stage = stage(&held);
        for elevation in [1.0_f64, 10.0, 60.0] {
            let (sin, cos) = elevation.to_radians().sin_cos();
            let grazing = sun(DVec3::new(0.8 * cos, -sin, 0.6 * cos));
            for light in [grazing, lamp(&world, DVec3::new(-6.0 * cos, 6.0 * sin, 0.4))] {
                held.lighting = Some(lit_by(vec![light]));
                let shares = shares(&mut stage, &held, &camera);
                let seen = on_floor(&stage, &world, &camera, &[plane]);
                let dark = seen.iter().filter(|at| shares[at.pixel][0] < 255).count();
                assert!(seen.len() > 6000, "{}", seen.len());
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
    let mut stage = stage(&held);
    let shares = shares(&mut stage, &held, &camera);
    let seen = on_floor(&stage, &HERE, &camera, &blocks);
    assert_eq!(shares[nearest(&seen, DVec3::new(0.0, 0.0, 1.6))][0], 0);
}

/// The pixel that shows a point.
fn nearest(seen: &[OnFloor], p: DVec3) -> usize {
    let nearest = seen.iter().min_by(|a, b| a.p.distance(p).total_cmp(&b.p.distance(p))).expect("the floor is seen");
    assert!(nearest.p.distance(p) < nearest.footprint, "{p} is not seen");
    nearest.pixel
}

#[test]
fn nothing_is_made_where_no_light_casts() {
    let held = HERE.held_from(&EYES, &[FLOOR, CUBE], lit_by(Vec::new()));
    let mut stage = Stage::new(&held);
    stage.frames.set_shadows(MAPS);
    stage.shoot(&held, &camera(&HERE));
    assert!(stage.frames.light_shares().is_none() && !stage.frames.casts());
}

#[test]
fn off_changes_no_bit_and_leaves_nothing() {
    let held = HERE.held_from(&EYES, &[FLOOR, CUBE], lit_by(vec![sun(DVec3::new(0.5, -1.0, 0.3))]));
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
    let directions = [DVec3::new(1.2, -1.0, 0.0), DVec3::new(-1.2, -1.0, 0.6), DVec3::new(0.0, -1.0, 1.2)];
    let lights = directions.map(|direction| match sun(direction) {
        // The last is the strongest.
        Light::Directional { direction_world, .. } => {
            Light::Directional { direction_world, irradiance: [direction.z as f32 + 1.0; 3] }
        }
        light => light,
    });
    let blocks = [FLOOR, CUBE];
    let held = HERE.held_from(&EYES, &blocks, lit_by(lights.to_vec()));
    let camera = camera(&HERE);
    let mut stage = stage(&held);
    let shares = shares(&mut stage, &held, &camera);
    let seen = on_floor(&stage, &HERE, &camera, &blocks);
    for (channel, light) in [2, 1, 0].into_iter().enumerate() {
        let middle = (CUBE.0 + CUBE.1) / 2.0;
        let pixel = nearest(&seen, middle + directions[light] * middle.y);
        let expected: [u8; 3] = std::array::from_fn(|other| if other == channel { 0 } else { 255 });
        assert_eq!(shares[pixel][..3], expected, "light {light}");
        assert_eq!(shares[pixel][3], 0, "no fourth light");
    }
}

#[test]
fn shadows_fade_from_none_to_all_of_them() {
    let blocks = [FLOOR, CUBE];
    let camera = camera(&HERE);
    let held = HERE.held_from(&EYES, &blocks, lit_by(vec![sun(DVec3::new(0.5, -1.0, 0.3))]));
    let without = Stage::new(&held).shoot(&held, &camera);
    let mut stage = stage(&held);
    let mut shot = |shadows: f32| {
        let strengths = Strengths { shadows, ..Strengths::default() };
        stage.shoot_with(&held, &camera, Options { strengths, ..Options::default() })
    };
    let [none, half, all] = [0.0, 0.5, 1.0].map(&mut shot);
    assert!(none == without && all != without);
    assert_eq!(all, stage.shoot(&held, &camera), "as by default");
    let between = |pixel: usize| (0..3).all(|c| (all[pixel][c]..=none[pixel][c]).contains(&half[pixel][c]));
    assert!((0..all.len()).all(between));
    assert!((0..all.len()).filter(|&pixel| half[pixel] != all[pixel] && half[pixel] != none[pixel]).count() > 100);
}
