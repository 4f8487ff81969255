//! What is seen through: a window before moving things, and a row of boards, one for each way in which alpha may count.

use std::f64::consts::TAU;

use glam::{DAffine3, Vec3, dvec3, vec3};

use super::kit::Kit;
use super::mesher::Mesher;
use super::texture;
use crate::model::{Material, Texture, Wrap};

const PERIOD_S: f64 = 12.0;

/// A shop window of tinted glass in a frame, with a smoky stripe, before things that pass behind it; a green bottle, of which both walls are
/// seen, stands before it, and a stained pane hangs there.
pub(super) fn build() -> Kit {
    let mut kit = Kit::new(PERIOD_S);
    kit.daylight();
    kit.look(dvec3(0.8, 1.6, 2.9), dvec3(0.0, 1.1, -0.6));
    room(&mut kit);
    frame(&mut kit);
    let pane = glass(&mut kit, "tinted pane", [0.55, 0.75, 0.85, 0.4]);
    let mut sheet = Mesher::new();
    sheet.panel(vec3(-1.5, 0.5, 0.0), Vec3::X * 3.0, Vec3::Y * 1.5, [6, 3]);
    let sheet = kit.mesh(sheet, pane);
    kit.place("pane", sheet, DAffine3::IDENTITY);
    let smoke = kit.textured("smoky stripe", fading(0x2e3238));
    kit.alter(smoke, blended);
    let mut stripe = Mesher::new();
    stripe.uv_per_m(1.0 / 3.0).panel(vec3(-1.5, 0.9, 0.12), Vec3::X * 3.0, Vec3::Y * 0.6, [6, 2]);
    let stripe = kit.mesh(stripe, smoke);
    kit.place("stripe", stripe, DAffine3::IDENTITY);
    let green = glass(&mut kit, "bottle glass", [0.2, 0.6, 0.3, 0.35]);
    let mut bottle = Mesher::new();
    bottle.capsule([vec3(0.0, 0.2, 0.0), vec3(0.0, 0.75, 0.0)], [0.2, 0.12], [48, 12]);
    let bottle = kit.mesh(bottle, green);
    kit.place("bottle", bottle, DAffine3::from_translation(dvec3(-0.7, 0.0, 1.1)));
    let stained = Material {
        transmission: 0.9,
        thin: true,
        double_sided: true,
        base_colour: [0.95, 0.35, 0.2, 1.0],
        ..Material::default()
    };
    let stained = kit.material(Material { name: "stained glass".into(), ..stained });
    let mut disc = Mesher::new();
    disc.panel(vec3(0.35, 1.1, 0.35), Vec3::X * 0.7, Vec3::Y * 0.7, [2, 2]);
    let disc = kit.mesh(disc, stained);
    kit.place("stained pane", disc, DAffine3::IDENTITY);
    passers(&mut kit);
    kit
}

/// Boards before a wall of marble: opaque, blended by a gradient, blended all over, and cut out at a quarter, a half and three quarters of the same gradient.
pub(super) fn boards() -> Kit {
    let mut kit = Kit::new(PERIOD_S);
    kit.daylight();
    kit.look(dvec3(0.0, 1.2, 3.6), dvec3(0.0, 1.0, 0.0));
    let marble = kit.textured("marble", texture::marble(0xd8d2c4, 0x5b5248));
    let mut wall = Mesher::new();
    wall.uv_per_m(0.3).cuboid(vec3(-4.0, -0.5, -1.2), vec3(4.0, 3.0, -1.0));
    wall.uv_per_m(0.3).cuboid(vec3(-4.0, -0.6, -1.0), vec3(4.0, -0.5, 2.0));
    let wall = kit.mesh(wall, marble);
    kit.drive("wall", wall, |share| DAffine3::from_translation(dvec3(0.3 * (TAU * share).sin(), 0.0, 0.0)));
    let opaque = kit.textured("opaque", fading(0x3565a8));
    let gradient = kit.textured("blended by a gradient", fading(0x3565a8));
    kit.alter(gradient, blended);
    let even = glass(&mut kit, "blended", [0.05, 0.13, 0.39, 0.5]);
    let cut = [0.25, 0.5, 0.75].map(|cutoff| {
        let material = kit.textured("cut out", fading(0x3565a8));
        kit.alter(material, |material| (material.alpha_cutoff, material.double_sided) = (Some(cutoff), true));
        material
    });
    for (index, material) in [opaque, gradient, even, cut[0], cut[1], cut[2]].into_iter().enumerate() {
        let mut board = Mesher::new();
        board.uv_per_m(1.0 / 0.9).panel(vec3(-0.5, 0.0, 0.0), Vec3::X * 0.9, Vec3::Y * 1.8, [2, 4]);
        let board = kit.mesh(board, material);
        let x = 1.05 * (index as f64 - 2.5);
        kit.place("board", board, DAffine3::from_translation(dvec3(x, 0.1, 0.0)));
    }
    kit
}

fn room(kit: &mut Kit) {
    let floor = kit.textured("floor", texture::marble(0xb9a68a, 0x8a7458));
    let mut ground = Mesher::new();
    ground.uv_per_m(0.3).cuboid_cells(vec3(-5.0, -0.2, -4.0), vec3(5.0, 0.0, 4.0), [10, 1, 8]);
    ground.uv_per_m(0.3).cuboid_cells(vec3(-5.0, 0.0, -4.2), vec3(5.0, 3.0, -4.0), [10, 3, 1]);
    let ground = kit.mesh(ground, floor);
    kit.place("floor and wall", ground, DAffine3::IDENTITY);
}

fn frame(kit: &mut Kit) {
    let wood = kit.painted("wood");
    let mut frame = Mesher::new();
    frame.paint(0x6d4a2f);
    for [low, high] in [
        [vec3(-1.6, 0.0, -0.06), vec3(1.6, 0.5, 0.06)],
        [vec3(-1.6, 2.0, -0.06), vec3(1.6, 2.1, 0.06)],
        [vec3(-1.6, 0.5, -0.06), vec3(-1.5, 2.0, 0.06)],
        [vec3(1.5, 0.5, -0.06), vec3(1.6, 2.0, 0.06)],
        [vec3(-0.03, 0.5, -0.04), vec3(0.03, 2.0, 0.04)],
    ] {
        frame.cuboid(low, high);
    }
    let frame = kit.mesh(frame, wood);
    kit.place("frame", frame, DAffine3::IDENTITY);
}

/// Balls that roll by behind the pane, and a post that turns.
fn passers(kit: &mut Kit) {
    let paint = kit.painted("paint");
    for (index, colour) in [0xc9302c, 0xe0a030, 0x4a8a3c].into_iter().enumerate() {
        let mut ball = Mesher::new();
        ball.paint(colour).ellipsoid(Vec3::splat(0.35), [48, 24]);
        let ball = kit.mesh(ball, paint);
        let lane = -0.9 - 0.8 * index as f64;
        kit.drive("ball", ball, move |share| {
            let x = 1.4 * (TAU * (share + index as f64 / 3.0)).sin();
            DAffine3::from_translation(dvec3(x, 0.35 + 0.45 * index as f64, lane))
                * DAffine3::from_rotation_z(-x / 0.35)
        });
    }
    let mut post = Mesher::new();
    post.paint(0xe8e8e8).cuboid(vec3(-0.4, 0.0, -0.05), vec3(0.4, 1.9, 0.05));
    let post = kit.mesh(post, paint);
    kit.drive("post", post, |share| {
        DAffine3::from_translation(dvec3(0.9, 0.0, -1.6)) * DAffine3::from_rotation_y(TAU * share)
    });
}

/// Thin, seen from both sides; linear RGB and how much it hides.
fn glass(kit: &mut Kit, name: &str, base_colour: [f32; 4]) -> u32 {
    let material = kit.material(Material { name: name.into(), base_colour, ..Material::default() });
    kit.alter(material, blended);
    material
}

fn blended(material: &mut Material) {
    (material.see_through, material.alpha_cutoff, material.double_sided) = (true, Some(0.5), true);
}

/// One colour that hides ever more from the left to the right.
fn fading(srgb: u32) -> Texture {
    const SIDE: u32 = 128;
    let [_, red, green, blue] = srgb.to_be_bytes();
    let texel = |index: u32| [red, green, blue, (255 * (index % SIDE) / (SIDE - 1)) as u8];
    let rgba = (0..SIDE * SIDE).flat_map(texel).collect();
    Texture { width_px: SIDE, height_px: SIDE, rgba, wrap: [Wrap::Clamp; 2], nearest: false }
}
