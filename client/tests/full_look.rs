//! The full look: materials under light from all around, where the answer is known.

mod common;

use std::sync::Arc;

use camera::{Camera, Pinhole, Rigid};
use common::{SIDE, Stage};
use glam::{DVec3, Vec2, Vec3};
use protocol::held::HeldPatch;
use protocol::image::octahedral_code;
use protocol::sky::{SkyLevel, direction_at};
use protocol::{DepthImage, DepthScale, Held, Light, Lighting, Mask, Material, Patch, PatchId, Purpose, Sky, Tone};

/// Half floats of 0 and 1.
const DARK: u16 = 0;
const BRIGHT: u16 = 0x3c00;

fn camera() -> Pinhole {
    Pinhole::symmetric(Rigid::look_at(DVec3::ZERO, DVec3::NEG_Z), (SIDE, SIDE), 1.0, 0.05)
}

/// A wall two metres before the eye that faces it, over all of the view.
fn wall(base: u8) -> HeldPatch {
    let mut mask = Mask::empty(SIDE, SIDE);
    (0..SIDE).flat_map(|y| (0..SIDE).map(move |x| (x, y))).for_each(|(x, y)| mask.set(x, y, true));
    let count = mask.count();
    let image = DepthImage {
        camera: Camera::Pinhole(camera()),
        depth_scale: DepthScale { w_min: 0.5, w_step: 0.0 },
        mask,
        depth: vec![0; count],
        normal: vec![octahedral_code(Vec3::Z); count],
        normal_rest: Vec::new(),
        colour_rest: Vec::new(),
        share: Vec::new(),
        ends: Vec::new(),
        colour: vec![[base; 3]; count],
        object: vec![1; count],
        material: vec![0; count],
    };
    let patch = Patch { id: PatchId(1), purpose: Purpose::Eye, capture_time_s: 0.0, objects: Vec::new(), image };
    HeldPatch { patch, trims: Vec::new() }
}

/// A sky that is bright in some directions, at every roughness; matte surfaces see `even` of it from everywhere.
fn sky(even: f32, is_bright: impl Fn(Vec3) -> bool) -> Arc<Sky> {
    let level = |number: usize| {
        let side_px = Sky::side_px(number);
        let texel = |index: usize| {
            let place = Vec2::new((index % side_px) as f32, (index / side_px) as f32) + 0.5;
            [if is_bright(direction_at(place / side_px as f32 * 2.0 - 1.0)) { BRIGHT } else { DARK }; 3]
        };
        SkyLevel { texels: (0..side_px * side_px).map(texel).collect() }
    };
    let mut diffuse = [[0.0; 3]; Sky::HARMONICS];
    diffuse[0] = [even / 0.282_095; 3];
    Arc::new(Sky { diffuse, first_level: 0, levels: (0..Sky::LEVELS).map(level).collect() })
}

/// Linear colours, a value a pixel: the scenes are grey.
fn shown(base: u8, material: Material, sky: Arc<Sky>, lighting: Lighting) -> Vec<f32> {
    let mut held = Held::default();
    held.patches.insert(PatchId(1), wall(base));
    held.materials = vec![material];
    held.lighting = Some(lighting);
    held.sky = Some(sky);
    let pixels = Stage::new(&held).shoot(&held, &camera());
    pixels.into_iter().map(|[red, ..]| linear(red)).collect()
}

fn linear(code: u8) -> f32 {
    let c = f32::from(code) / 255.0;
    if c <= 0.04045 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }
}

fn under(sky: f32, tone: Tone) -> Lighting {
    Lighting { sky, tone, ..Lighting::default() }
}

const MIDDLE: usize = (SIDE / 2 * SIDE + SIDE / 2) as usize;

#[test]
fn white_surfaces_leave_nothing_out_of_even_light() {
    for (metallic, roughness) in [(0.0, 0.0), (0.0, 0.5), (0.0, 1.0), (1.0, 0.0), (1.0, 0.5), (1.0, 1.0)] {
        let material = Material { metallic, roughness, ..Material::default() };
        let light = shown(255, material, sky(1.0, |_| true), under(0.5, Tone::Cut));
        let furthest = light.iter().map(|light| (light - 0.5).abs()).fold(0.0, f32::max);
        assert!(furthest < 0.015, "{furthest} of 0.5 is lost or won at metallic {metallic}, roughness {roughness}");
    }
}

#[test]
fn coats_and_fibres_leave_nothing_out_of_even_light() {
    let coated =
        |clearcoat_roughness| Material { clearcoat: 1.0, clearcoat_roughness, roughness: 0.6, ..Material::default() };
    let fibrous = |sheen_roughness| Material { sheen: [1.0; 3], sheen_roughness, ..Material::default() };
    for material in [coated(0.0), coated(0.5), fibrous(0.3), fibrous(1.0)] {
        let light = shown(255, material, sky(1.0, |_| true), under(0.5, Tone::Cut));
        let furthest = light.iter().map(|light| (light - 0.5).abs()).fold(0.0, f32::max);
        assert!(furthest < 0.015, "{furthest} of 0.5 is lost or won by {material:?}");
    }
}

#[test]
fn a_metal_in_part_is_a_mix_of_both() {
    let light = |metallic| {
        let material = Material { metallic, roughness: 0.4, ..Material::default() };
        shown(188, material, sky(1.0, |_| true), under(1.0, Tone::Cut))[MIDDLE]
    };
    let mixed = (light(0.0) + light(1.0)) / 2.0;
    assert!((light(0.5) - mixed).abs() < 0.01, "{} instead of {mixed}", light(0.5));
}

#[test]
fn light_from_around_arrives_as_far_as_the_form_lets_it() {
    let light = |occlusion| {
        shown(255, Material { occlusion, ..Material::default() }, sky(1.0, |_| true), under(0.8, Tone::Cut))[MIDDLE]
    };
    assert!((light(0.5) - 0.4).abs() < 0.02, "{}", light(0.5));
    assert!(light(0.0) < 0.01, "{}", light(0.0));
    // A smooth mirror mirrors what lies before it even in a hollow.
    let mirror = Material { metallic: 1.0, roughness: 0.101, occlusion: 0.7, ..Material::default() };
    let mirrored = shown(255, mirror, sky(1.0, |_| true), under(0.8, Tone::Cut))[MIDDLE];
    assert!(mirrored > 0.6 && mirrored < 0.8, "{mirrored}");
}

#[test]
fn smooth_metal_mirrors_what_lies_there() {
    let mirror = Material { metallic: 1.0, roughness: 0.0, ..Material::default() };
    // Of the wall's upper half, rays go on upwards, and all of them back towards +z.
    let above = shown(255, mirror, sky(0.0, |direction| direction.y > 0.0), under(0.5, Tone::Cut));
    let column = |y: u32| above[(y * SIDE + SIDE / 2) as usize];
    assert!(column(SIDE / 8) > 0.49 && column(SIDE / 2 - 8) > 0.49, "{} {}", column(SIDE / 8), column(SIDE / 2 - 8));
    assert!(column(SIDE / 2 + 8) < 0.01 && column(SIDE - 8) < 0.01, "{} {}", column(SIDE / 2 + 8), column(SIDE - 8));
    let behind = shown(255, mirror, sky(0.0, |direction| direction.z < 0.0), under(0.5, Tone::Cut));
    assert!(behind.iter().all(|light| *light < 0.01));
}

#[test]
fn rough_dielectrics_show_their_colour() {
    let light = shown(188, Material::default(), sky(1.0, |_| true), under(1.0, Tone::Neutral))[MIDDLE];
    // Half of the light is scattered. The tone takes away the 4 % that a smooth dielectric mirrors; so rough a one mirrors 3 %.
    assert!((light - 0.475).abs() < 0.01, "{light}");
}

#[test]
fn lamps_are_mirrored_in_highlights() {
    let lamp = Light::Directional { direction_world: [0.0, 0.0, -1.0], irradiance: [0.1; 3] };
    let black = |roughness| {
        let lighting = Lighting { lights: vec![lamp], ..under(1e-6, Tone::Cut) };
        shown(0, Material { roughness, ..Material::default() }, sky(0.0, |_| false), lighting)
    };
    let rough = black(0.5);
    // Straight on, GGX spreads to 1 / (pi alpha^2), a facing dielectric mirrors 4 % of it, and the masking is a quarter.
    let expected = 0.1 * 0.04 / (std::f32::consts::PI * 0.25 * 0.25) / 4.0;
    assert!((rough[MIDDLE] - expected).abs() < 0.1 * expected, "{} for {expected}", rough[MIDDLE]);
    let smooth = black(0.3);
    assert!(smooth[MIDDLE] > 2.0 * rough[MIDDLE], "narrower ones are brighter");
    assert!(smooth[5] < rough[5], "and darker beside");
}

#[test]
fn without_a_sky_the_look_is_plain() {
    let metal = Material { metallic: 1.0, roughness: 0.3, ..Material::default() };
    let lighting = Lighting { ambient: [0.7; 3], ..Lighting::default() };
    let light = shown(255, metal, sky(1.0, |_| true), lighting)[MIDDLE];
    assert!((light - (1.0 - (-0.7_f32).exp())).abs() < 0.005, "{light}");
}
