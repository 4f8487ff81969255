//! What is blended, over small held copies, pixel by pixel.

mod common;

use camera::{Camera, Pinhole, Rigid};
use common::{SIDE, Stage};
use glam::DVec3;
use protocol::held::HeldPatch;
use protocol::image::octahedral_code;
use protocol::{DepthImage, DepthScale, Held, Lighting, Mask, Material, Patch, PatchId, Purpose};
use vantage_client::draw::antialiasing::Antialias;
use vantage_client::draw::frame::Options;
use vantage_client::draw::rest::RestView;

const WHITE: [u8; 3] = [255, 255, 255];
const RED: [u8; 3] = [255, 0, 0];
const BLUE: [u8; 3] = [0, 0, 255];
const BACKGROUND: [u8; 3] = [0, 128, 0];

/// At the origin, which looks along -z.
fn camera() -> Pinhole {
    Pinhole::symmetric(Rigid::look_at(DVec3::ZERO, DVec3::NEG_Z), (SIDE, SIDE), 1.0, 0.05)
}

/// A sheet so far away that faces the eye, over the columns from `first_column` on; it hides so much of [`DepthImage::WHOLE`].
struct Sheet {
    purpose: Purpose,
    z_m: f32,
    colour: [u8; 3],
    hides: u8,
    first_column: u32,
    material: u8,
}

impl Sheet {
    fn held(&self, id: u32) -> HeldPatch {
        let mut mask = Mask::empty(SIDE, SIDE);
        (0..SIDE).flat_map(|y| (self.first_column..SIDE).map(move |x| (x, y))).for_each(|(x, y)| mask.set(x, y, true));
        let count = mask.count();
        let image = DepthImage {
            camera: Camera::Pinhole(camera()),
            depth_scale: DepthScale { w_min: 1.0 / self.z_m, w_step: 0.0 },
            mask,
            depth: vec![0; count],
            normal: vec![octahedral_code(glam::Vec3::Z); count],
            normal_rest: Vec::new(),
            colour_rest: Vec::new(),
            share: if self.purpose == Purpose::Eye { Vec::new() } else { vec![self.hides; count] },
            ends: Vec::new(),
            colour: vec![self.colour; count],
            object: vec![id as u16; count],
            material: vec![self.material; count],
        };
        let patch = Patch { id: PatchId(id), purpose: self.purpose, capture_time_s: 0.0, objects: Vec::new(), image };
        HeldPatch { patch, trims: Vec::new() }
    }
}

fn sheet(purpose: Purpose, z_m: f32, colour: [u8; 3]) -> Sheet {
    Sheet { purpose, z_m, colour, hides: DepthImage::WHOLE / 2, first_column: 0, material: 0 }
}

/// Everything is shown as its own colour.
fn held(sheets: &[Sheet]) -> Held {
    let mut held = Held::default();
    for (sheet, id) in sheets.iter().zip(1..) {
        held.patches.insert(PatchId(id), sheet.held(id));
    }
    let plain = Material { unlit: true, double_sided: true, ..Material::default() };
    held.materials = vec![plain, Material { unlit: false, thin: true, transmission: 0.75, ..plain }];
    held.lighting = Some(Lighting { background: BACKGROUND, ..Lighting::default() });
    held
}

/// The colour in the middle.
fn shown(sheets: &[Sheet]) -> [u8; 3] {
    let held = held(sheets);
    let pixels = Stage::new(&held).shoot(&held, &camera());
    let [red, green, blue, _] = pixels[(SIDE / 2 * SIDE + SIDE / 2) as usize];
    [red, green, blue]
}

/// sRGB of linear light.
fn encoded(linear: [f64; 3]) -> [u8; 3] {
    linear.map(|value| {
        let srgb = if value <= 0.003_130_8 { 12.92 * value } else { 1.055 * value.powf(1.0 / 2.4) - 0.055 };
        (255.0 * srgb).round() as u8
    })
}

fn assert_near(found: [u8; 3], wanted: [u8; 3], why: &str) {
    assert!(found.iter().zip(wanted).all(|(a, b)| a.abs_diff(b) <= 2), "{why}: {found:?}, not {wanted:?}");
}

#[test]
fn what_is_nearer_lies_over_what_is_farther_whatever_the_layer() {
    let red_first = encoded([0.75, 0.25, 0.5]);
    let wall = || sheet(Purpose::Eye, 4.0, WHITE);
    let [a, b] = [Purpose::Layer(0), Purpose::Layer(3)];
    assert_near(shown(&[wall(), sheet(a, 2.0, RED), sheet(b, 3.0, BLUE)]), red_first, "red before blue");
    assert_near(shown(&[wall(), sheet(b, 2.0, RED), sheet(a, 3.0, BLUE)]), red_first, "the same in other layers");
    let blue_first = encoded([0.5, 0.25, 0.75]);
    assert_near(shown(&[wall(), sheet(a, 3.0, RED), sheet(b, 2.0, BLUE)]), blue_first, "blue before red");
}

#[test]
fn walls_hide_layers_behind_them_and_the_background_shines_through() {
    let layer = |z_m| sheet(Purpose::Layer(1), z_m, RED);
    assert_near(shown(&[sheet(Purpose::Eye, 2.0, WHITE), layer(3.0)]), WHITE, "behind a wall");
    // Half of a pixel behind, it lies on it: at 2 m a pixel of this view is 23 mm wide.
    assert_near(shown(&[sheet(Purpose::Eye, 2.0, WHITE), layer(2.01)]), encoded([1.0, 0.5, 0.5]), "on a wall");
    let green = (f64::from(BACKGROUND[1]) / 255.0 + 0.055) / 1.055;
    assert_near(shown(&[layer(3.0)]), encoded([0.5, 0.5 * green.powf(2.4), 0.0]), "before nothing");
    let whole = Sheet { hides: DepthImage::WHOLE, ..layer(3.0) };
    assert_near(shown(&[sheet(Purpose::Eye, 4.0, WHITE), whole]), RED, "hides all");
}

#[test]
fn layers_show_nothing_from_behind_and_edges_are_smooth() {
    let held = held(&[
        sheet(Purpose::Eye, 4.0, WHITE),
        Sheet { first_column: SIDE / 2, ..sheet(Purpose::Layer(0), 2.0, RED) },
    ]);
    let mut stage = Stage::new(&held);
    // From the other side of the sheet, turned by a fraction of a pixel.
    let from = Rigid::look_at(DVec3::new(0.2, 0.0, -3.0), DVec3::new(0.2, 0.0, -1.0));
    let behind = stage.shoot(&held, &Pinhole { world_from_eye: from, ..camera() });
    assert!(behind.iter().all(|pixel| pixel[..3] == BACKGROUND), "nothing of the sheet");
    let aside = Pinhole { centre_px: camera().centre_px + 0.5, ..camera() };
    let smooth = stage.shoot_with(&held, &aside, Options { antialias: Antialias::On, ..Options::default() });
    let row = &smooth[(SIDE * SIDE / 2) as usize..][..SIDE as usize];
    let (none, half) = (WHITE, encoded([1.0, 0.5, 0.5]));
    let edge = row.iter().find(|pixel| pixel[..3] != none).expect("the sheet's edge");
    assert_near([edge[0], edge[1], edge[2]], encoded([1.0, 0.75, 0.75]), "half of the edge's pixel");
    assert_near([row[80][0], row[80][1], row[80][2]], half, "inside");
}

#[test]
fn a_pane_tints_what_lies_behind_it() {
    // By no light it has none of its own.
    let pane = Sheet { hides: DepthImage::WHOLE, material: 1, ..sheet(Purpose::Layer(0), 2.0, [255, 188, 0]) };
    let wanted = encoded([0.75, 0.75 * 0.5029, 0.0]);
    assert_near(shown(&[sheet(Purpose::Eye, 4.0, WHITE), pane]), wanted, "three quarters of white");
}

#[test]
fn a_view_at_rest_is_seen_through_layers_part_by_part() {
    // Of each pixel three quarters are a wall behind the sheet; the last one is open.
    let at_rest = Sheet { hides: 48, ..sheet(Purpose::Rest, 4.0, WHITE) };
    let held = held(&[at_rest, sheet(Purpose::Layer(0), 2.0, RED)]);
    let mut stage = Stage::new(&held);
    let mut rest = RestView::new(stage.gpu());
    rest.rebuild(&held);
    let pixels = stage.shoot_at_rest(&held, &camera(), &rest);
    let green = ((f64::from(BACKGROUND[1]) / 255.0 + 0.055) / 1.055).powf(2.4);
    let wanted = encoded([0.5 + 0.5 * 0.75, 0.5 * (0.75 + 0.25 * green), 0.5 * 0.75]);
    let [red, green, blue, _] = pixels[(SIDE / 2 * SIDE + SIDE / 2) as usize];
    assert_near([red, green, blue], wanted, "half of red over all of it");
    // A part before the sheet is not seen through it.
    let before = Sheet { hides: 48, ..sheet(Purpose::Rest, 1.0, WHITE) };
    let held = self::held(&[before, sheet(Purpose::Layer(0), 2.0, RED)]);
    rest.rebuild(&held);
    let [red, _, blue, _] = stage.shoot_at_rest(&held, &camera(), &rest)[(SIDE / 2 * SIDE + SIDE / 2) as usize];
    let wanted = encoded([0.75 + 0.25 * 0.5, 0.0, 0.75]);
    assert_near([red, 0, blue], [wanted[0], 0, wanted[2]], "white, and red before the background");
}

#[test]
fn where_nothing_is_blended_nothing_is_made_for_it() {
    let held = held(&[sheet(Purpose::Eye, 4.0, WHITE)]);
    let mut stage = Stage::new(&held);
    stage.shoot(&held, &camera());
    assert!(!stage.frames.sees_through());
}
