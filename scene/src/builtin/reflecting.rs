//! A teapot on a table in a room, beside a mirror or a body of glass, as in the non-pinhole papers. Walls face inwards:
//! in the room, no reflected ray leaves the scene, and from outside one sees in.

use std::f64::consts::{PI, TAU};

use camera::Trace;
use glam::{DAffine3, DVec3, Vec3, dvec3, vec2, vec3};

use super::kit::{Kit, path as path_of};
use super::mesher::Mesher;
use super::teapots::{glazed, pot, table};
use super::texture;
use crate::model::Material;

const PERIOD_S: f64 = 20.0;

/// The middle of the mirror pot.
pub(super) const MIRROR_WORLD: DVec3 = dvec3(-0.15, 0.09, 0.0);
/// The middle of the body of glass.
pub(super) const GLASS_WORLD: DVec3 = dvec3(-0.05, GLASS_RADII_M.y as f64 + CLOTH_M, 0.08);
/// The middle between the mirror pot and the mirror vase.
const PAIR_WORLD: DVec3 = dvec3(0.0, 0.1, 0.05);
/// The cloth on the table is this thick.
const CLOTH_M: f64 = 0.003;
/// About the pot's body without spout and handle: 0.24 m wide and 0.19 m high.
const GLASS_RADII_M: Vec3 = vec3(0.12, 0.095, 0.12);

/// A teapot as a mirror, and a glazed one near it, which turns and rocks to and fro around it.
pub(super) fn mirror() -> Kit {
    let mut kit = stage();
    let silver = silver(&mut kit);
    let pot = kit.mesh(pot(Vec3::ONE), silver);
    let place = MIRROR_WORLD.with_y(0.0);
    // Spout to the front, handle to the back, where the other pot does not touch them.
    kit.place("mirror teapot", pot, DAffine3::from_translation(place) * DAffine3::from_rotation_y(4.0));
    diffuse_pot(&mut kit, move |share| {
        // Beside the mirror, to its front and its back.
        let around = 0.2 + 0.25 * (TAU * share).sin();
        place + dvec3(around.cos(), 0.0, around.sin()) * 0.36
    });
    kit
}

/// A mirror pot and a mirror vase that see each other, and a small glazed pot behind that both show, also in one another.
pub(super) fn pair() -> Kit {
    let mut kit = stage();
    let silver = silver(&mut kit);
    let pot = kit.mesh(pot(Vec3::ONE), silver);
    let at = PAIR_WORLD.with_y(0.0);
    kit.place("mirror teapot", pot, DAffine3::from_translation(at - DVec3::X * 0.17) * DAffine3::from_rotation_y(4.0));
    let vase = kit.mesh(vase(), silver);
    kit.place("mirror vase", vase, DAffine3::from_translation(at + DVec3::X * 0.14));
    glazed_pot(&mut kit, 0.6, move |share| at + dvec3(0.02 + 0.06 * (TAU * share).sin(), 0.0, -0.3));
    kit
}

/// A pot of brushed metal and a glazed one on a tray of duller metal: what is near shows in both as a blur, the sharper the nearer.
pub(super) fn rough() -> Kit {
    let mut kit = stage();
    let metal = |kit: &mut Kit, name: &str, roughness: f32, colour: [f32; 3]| {
        kit.material(Material { metallic: 1.0, roughness, double_sided: true, ..toned(name, colour) })
    };
    let steel = metal(&mut kit, "brushed steel", 0.2, [0.78, 0.76, 0.72]);
    let brass = metal(&mut kit, "dull brass", 0.35, [0.86, 0.68, 0.4]);
    let tray = (CLOTH_M as f32, CLOTH_M as f32 + 0.006);
    let mut slab = Mesher::new();
    slab.cuboid(vec3(-0.45, tray.0, -0.19), vec3(0.25, tray.1, 0.25));
    let slab = kit.mesh(slab, brass);
    kit.place("rough tray", slab, DAffine3::IDENTITY);
    let on_tray = DVec3::Y * f64::from(tray.1);
    let pot = kit.mesh(pot(Vec3::ONE), steel);
    let place = MIRROR_WORLD.with_y(0.0) + on_tray;
    kit.place("rough teapot", pot, DAffine3::from_translation(place) * DAffine3::from_rotation_y(4.0));
    glazed_pot(&mut kit, 0.7, move |share| on_tray + dvec3(0.12, 0.0, 0.05 + 0.06 * (TAU * share).sin()));
    kit
}

/// 0.26 m high, closed.
fn vase() -> Mesher {
    const RINGS: usize = 40;
    let ring = |k: usize| {
        let up = k as f32 / RINGS as f32;
        vec2(0.075 + 0.035 * (5.0 * up - 0.9).sin(), 0.26 * up + CLOTH_M as f32)
    };
    let ends = [ring(0), ring(RINGS)].map(|rim| rim.with_x(0.0));
    let profile: Vec<_> = std::iter::once(ends[0]).chain((0..=RINGS).map(ring)).chain([ends[1]]).collect();
    let mut vase = Mesher::new();
    vase.lathe(&profile, 96, 1.0);
    vase
}

/// A solid ellipsoid of glass of the size of a teapot's body, and a glazed teapot behind it. The teapot's own mesh is a
/// thin, open sheet, which has no inside to refract in; the ellipsoid is closed, so that every ray goes in once and out
/// once.
pub(super) fn glass() -> Kit {
    let mut kit = stage();
    let glass = Material { transmission: 1.0, ior: 1.3, roughness: 0.0, ..toned("glass", [0.93, 0.97, 0.95]) };
    let glass = kit.material(glass);
    let mut body = Mesher::new();
    body.ellipsoid(GLASS_RADII_M, [96, 48]);
    let body = kit.mesh(body, glass);
    kit.place("glass body", body, DAffine3::from_translation(GLASS_WORLD));
    diffuse_pot(&mut kit, |share| dvec3(0.0 + 0.08 * (TAU * share).sin(), 0.0, -0.24));
    kit
}

/// What shows all that it meets, from both sides.
pub(super) fn silver(kit: &mut Kit) -> u32 {
    kit.material(Material { metallic: 1.0, roughness: 0.0, double_sided: true, ..toned("mirror", [0.95, 0.93, 0.9]) })
}

fn toned(name: &str, [r, g, b]: [f32; 3]) -> Material {
    Material { name: name.into(), base_colour: [r, g, b, 1.0], ..Material::default() }
}

fn stage() -> Kit {
    let mut kit = Kit::new(PERIOD_S);
    kit.daylight();
    kit.look(dvec3(0.05, 0.36, 0.66), dvec3(0.0, 0.06, 0.0));
    table(&mut kit);
    room(&mut kit);
    kit
}

/// Four walls, a floor and a ceiling, seen from inside.
fn room(kit: &mut Kit) {
    let [paper, tiles, plaster] = [
        kit.textured("wallpaper", texture::brick(0xc9b68f, 0xa98f6a, [4, 8], 0.06)),
        kit.textured("floor", texture::tiles([0x8d6f52, 0x5f4a3a], 0x443428, 4)),
        kit.textured("plaster", texture::mottled(0xd6d8da, 8, 0.1)),
    ];
    let (low, high) = (vec3(-1.5, -0.75, -1.5), vec3(1.5, 1.6, 1.5));
    let (x, y, z) = (Vec3::X * 3.0, Vec3::Y * (high.y - low.y), Vec3::Z * 3.0);
    let mut panel = |name: &str, material: u32, corner: Vec3, u: Vec3, v: Vec3| {
        let mut mesher = Mesher::new();
        mesher.uv_per_m(0.8).panel(corner, u, v, [8, 8]);
        let mesh = kit.mesh(mesher, material);
        kit.place(name, mesh, DAffine3::IDENTITY);
    };
    panel("back wall", paper, low, x, y);
    panel("front wall", paper, low + x + z, -x, y);
    panel("left wall", paper, low + z, -z, y);
    panel("right wall", paper, low + x, z, y);
    panel("floor", tiles, low + z, x, -z);
    panel("ceiling", plaster, low + y, x, z);
}

/// A pot that turns once a period while it follows a way on the table.
fn diffuse_pot(kit: &mut Kit, way: impl Fn(f64) -> DVec3 + Send + Sync + 'static) {
    glazed_pot(kit, 1.0, way);
}

fn glazed_pot(kit: &mut Kit, scale: f32, way: impl Fn(f64) -> DVec3 + Send + Sync + 'static) {
    let red = glazed(kit, "red glaze", texture::speckled(0xa8402f, 0x6d2419));
    let pot = kit.mesh(pot(Vec3::splat(scale)), red);
    kit.drive("diffuse teapot", pot, move |share| {
        DAffine3::from_translation(way(share)) * DAffine3::from_rotation_y(0.6 + TAU * share)
    });
}

/// 60 degrees around the pair, nearer.
pub(super) fn pair_path() -> Trace {
    path_from(PAIR_WORLD, 0.42, 0.14)
}

/// 60 degrees around a place on the table, half a metre away and `above_m` higher.
pub(super) fn path(around_world: DVec3, above_m: f64) -> Trace {
    path_from(around_world, 0.5, above_m)
}

fn path_from(around_world: DVec3, away_m: f64, above_m: f64) -> Trace {
    path_of(|share, _| {
        let angle = PI / 3.0 * (share - 0.5);
        (around_world + dvec3(away_m * angle.sin(), above_m, away_m * angle.cos()), around_world)
    })
}
