//! Materials that differ from place to place, and what is seen through.

mod common;

use camera::Pinhole;
use common::*;
use glam::{DAffine3, DVec3};
use protocol::Look;
use scene::model::{Map, Quantity, SAME_UV, UvMap, UvSet};
use scene::{Material, Scene};
use vantage_server::config::Config;
use vantage_server::discretize::{Capture, Discretization};
use vantage_server::imager::{GpuImager, Imager};
use vantage_server::render::{Detail, SceneRenderer};

const SIZE_PX: u32 = 64;

/// A square that fills the view, whose texture is rough and no metal to the left, smooth and metal to the right; the share of light that
/// arrives is 1 above and 0.2 below.
fn varied(from_uv: UvMap) -> Scene {
    varied_by([UvSet::First; 2], from_uv)
}

/// The same by these sets of coordinates; along the second, the square lies with both of its coordinates exchanged.
fn varied_by(sets: [UvSet; 2], from_uv: UvMap) -> Scene {
    let map = |quantity, texture: u32| {
        let uv_set = sets[texture as usize];
        Map { quantity, texture, uv_set, from_uv, strength: 1.0 }
    };
    let material = Material {
        metallic: 1.0,
        roughness: 0.5,
        maps: vec![map(Quantity::MetallicRoughness, 0), map(Quantity::Occlusion, 1)],
        ..Material::default()
    };
    let mut square = square(3, 0);
    if material.needs_second_uvs() {
        square.second_uvs = square.vertices.iter().map(|vertex| [vertex.uv[1], vertex.uv[0]]).collect();
    }
    let mut scene = scene(vec![square], vec![material], &[(0, DAffine3::IDENTITY)]);
    let texel = |x: u32| if x == 0 { [0, 255, 0, 255] } else { [0, 51, 255, 255] };
    scene.textures = vec![
        texture(2, 1, true, |x, _| texel(x)),
        texture(4, 4, true, |_, y| [if y < 2 { 255 } else { 51 }, 0, 0, 255]),
    ];
    scene
}

fn capture(scene: &Scene, camera: &Pinhole, look: Look) -> (Capture, Vec<protocol::Material>) {
    let mut renderer = SceneRenderer::for_look(&gpu(), scene, look).expect("the scene uploads");
    renderer.update(&scene.at(0.0), camera.world_from_eye.translation).expect("same scene");
    let capture = captures(&renderer, &[*camera], Discretization::Conventional).remove(0);
    (capture, renderer.materials().to_vec())
}

#[test]
fn samples_name_what_the_textures_say_there() {
    let camera = looking_back(DVec3::new(0.0, 0.0, 0.9), SIZE_PX);
    let half: UvMap = [[2.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    let (first, second) = (UvSet::First, UvSet::Second);
    // As it is; half as fine, so that the right half is beyond the edge; and by the second set.
    let cases = [
        ([first, first], SAME_UV, 0.5),
        ([first, first], half, 0.25),
        ([first, second], SAME_UV, 0.5),
        ([second, first], half, 0.25),
        ([second, second], SAME_UV, 0.5),
    ];
    for (sets, from_uv, metal_from) in cases {
        let (capture, table) = capture(&varied_by(sets, from_uv), &camera, Look::Full);
        for (index, ids) in capture.ids.iter().enumerate() {
            assert!(ids[0] != 0, "the square fills the view");
            let (x, y) = ((index as u32 % SIZE_PX) as f32 + 0.5, (index as u32 / SIZE_PX) as f32 + 0.5);
            let (u, v) = (0.5 + 0.9 * (x / 64.0 - 0.5), 0.5 + 0.9 * (y / 64.0 - 0.5));
            let by = |set| if set == first { (u, v) } else { (v, u) };
            let (across, down) = (by(sets[0]).0, by(sets[1]).1);
            if (across - metal_from).abs() < 0.02 || (down - 0.5).abs() < 0.02 {
                continue;
            }
            let found = table[usize::from(capture.colour[index][3])];
            let (metallic, roughness) = if across < metal_from { (0.0, 0.5) } else { (1.0, 0.101) };
            let occlusion = if down < 0.5 { 1.0 } else { 0.2 };
            let off = [found.metallic - metallic, found.roughness - roughness, found.occlusion - occlusion];
            assert!(off.iter().all(|off| off.abs() < 0.02), "{found:?} at {u}, {v} by {sets:?}");
        }
    }
}

#[test]
fn from_afar_a_texture_is_its_mean() {
    // Sixteen times along each side, so six of them a pixel.
    let often = varied([[16.0, 0.0, 0.0], [0.0, 16.0, 0.0]]);
    let (capture, table) = capture(&often, &looking_back(DVec3::new(0.0, 0.0, 12.0), SIZE_PX), Look::Full);
    let seen = (SIZE_PX / 2 * SIZE_PX + SIZE_PX / 2) as usize;
    let found = table[usize::from(capture.colour[seen][3])];
    assert!((found.metallic - 0.5).abs() < 0.05 && (found.occlusion - 0.6).abs() < 0.05, "{found:?}");
}

#[test]
fn a_look_without_materials_has_one_code() {
    let camera = looking_back(DVec3::new(0.0, 0.0, 0.9), SIZE_PX);
    let (capture, table) = capture(&varied(SAME_UV), &camera, Look::Plain);
    assert!(table.len() == 1 && capture.colour.iter().all(|colour| colour[3] == 0));
    assert!((table[0].roughness - 0.3).abs() < 0.01 && (table[0].occlusion - 0.6).abs() < 0.01, "{:?}", table[0]);
}

#[test]
fn more_materials_than_codes_are_shown_on_the_whole() {
    let one = varied(SAME_UV);
    let mesh = |number: u32| scene::Mesh { material: number, ..one.meshes[0].clone() };
    let material = |number: u32| Material { ior: 1.0 + number as f32 / 100.0, ..one.materials[0].clone() };
    // One behind the other.
    let at = |number: u32| (number, DAffine3::from_translation(DVec3::NEG_Z * f64::from(number)));
    let placed: Vec<_> = (0..300).map(at).collect();
    let mut crowd = scene((0..300).map(mesh).collect(), (0..300).map(material).collect(), &placed);
    crowd.textures = one.textures;
    let (capture, table) = capture(&crowd, &looking_back(DVec3::new(0.0, 0.0, 0.9), SIZE_PX), Look::Full);
    assert_eq!(table.len(), 256);
    assert!(capture.ids.iter().all(|ids| ids[0] != 0));
}

/// Panes of an opacity before a blue wall.
fn panes(count: usize, opacity: f32) -> Scene {
    let pane = Material { alpha_cutoff: Some(0.5), see_through: true, ..coloured([1.0, 0.0, 0.0, opacity]) };
    let wall = DAffine3::from_translation(DVec3::new(0.0, 0.0, -0.5)) * DAffine3::from_scale(DVec3::splat(5.0));
    let at = |number: usize| DAffine3::from_translation(DVec3::new(0.0, 0.0, 0.1 * number as f64));
    let placed: Vec<_> = std::iter::once((1, wall)).chain((0..count).map(|number| (0, at(number)))).collect();
    scene(vec![square(1, 0), square(1, 1)], vec![pane, coloured([0.0, 0.0, 1.0, 1.0])], &placed)
}

#[test]
fn a_view_at_rest_leaves_out_what_is_seen_through() {
    let scene = panes(2, 0.9);
    let view = looking_back(DVec3::new(0.0, 0.0, 0.9), 8);
    let mut imager = GpuImager::new(&gpu(), &scene, &Config::default()).expect("the scene uploads");
    for detail in [Detail::Fine, Detail::Parts] {
        let shown = imager.own_view(&scene.at(0.0), &view, detail).expect("it draws").remove(0);
        assert!(
            (0..shown.ids.len()).all(|index| shown.ids[index][0] != 0 && shown.object(index) == 0),
            "the wall alone"
        );
    }
}
