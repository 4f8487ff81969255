//! Mirrors and glass at the ends of what they do, objects by one image, and ambient light.
//!
//! Of mirrors and glass compared are the pixels around which rays meet one object: images that rays are followed through are coarser than the picture, and outlines of what is
//! seen in a mirror lie as far off as their samples are wide.

use client::draw::occlusion::{Occlusion, Settings};
use glam::{DQuat, DVec3};
use scene::{Material, Scene};

use super::stiff::Stiff;
use crate::client_view::ClientView;
use crate::raytrace::{Effects, reflectors};
use crate::topics::sent_once::walk::Setup;
use crate::topics::stability::build::{Placed, at, ball, cuboid, floor, scene, square};
use crate::topics::stability::case::{Case, PICTURE_PX};
use crate::topics::stability::check::Check;
use crate::topics::stability::judge::Errors;
use crate::topics::stability::lab::Lab;
use crate::topics::stability::served::Served;

use crate::topics::stability::way::Shown;

pub(super) const CASES: &[Stiff] = &[
    Stiff { name: "a flat mirror", judge: |lab| reflecting(lab, flat_mirror(DVec3::new(0.0, 0.0, 2.4))) },
    Stiff { name: "a mirror at 80 degrees", judge: |lab| reflecting(lab, flat_mirror(DVec3::new(-2.4, 0.0, -0.58))) },
    Stiff { name: "a ball as a mirror", judge: |lab| reflecting(lab, body(ball(96), MIRROR)) },
    Stiff { name: "glass at index 1", judge: |lab| reflecting(lab, body(ball(96), glass(1.0))) },
    Stiff { name: "glass at index 1.5", judge: |lab| reflecting(lab, body(ball(96), glass(1.5))) },
    Stiff {
        name: "a cube of index 2.4, which reflects all within",
        judge: |lab| reflecting(lab, body(cuboid(), glass(2.4))),
    },
    Stiff { name: "nine balls by one image", judge: by_one_image },
    Stiff { name: "ambient light on a floor alone, reach of 1e-6 m", judge: |lab| ambient(lab, open(), 1e-6) },
    Stiff { name: "ambient light on a floor alone, reach of 1e6 m", judge: |lab| ambient(lab, open(), 1e6) },
    Stiff { name: "ambient light around a ball that touches a floor", judge: |lab| ambient(lab, touching(), 0.5) },
];

/// Of the pixels that are compared.
const WRONG_SHARE: f64 = 0.01;
/// Of 255. A reflection is of images whose colours are between four samples, lit by normals of 8 + 8 bits on both surfaces.
const WRONG: u8 = 16;
/// An image of what is around a mirror has a sample of up to four pixels of the picture.
const MARGIN_PX: usize = 4;

const MIRROR: fn(&mut Material) = |material| (material.metallic, material.roughness) = (1.0, 0.0);

fn glass(ior: f32) -> impl Fn(&mut Material) {
    move |material: &mut Material| {
        (material.transmission, material.ior, material.roughness) = (1.0, ior, 0.0);
        material.double_sided = false;
        material.base_colour = [1.0; 4];
    }
}

fn part(mesh: scene::Mesh, place: DVec3, size: f64, colour: [f32; 3]) -> Placed {
    Placed { mesh, world_from_mesh: at(place, size), colour }
}

/// A room of four metres with two balls in it; the last part reflects.
fn room(reflector: Placed, material: impl Fn(&mut Material)) -> Scene {
    let mut parts = vec![
        part(cuboid(), DVec3::ZERO, 3.0, [0.5, 0.5, 0.45]),
        part(ball(48), DVec3::new(0.7, 0.1, 0.9), 0.35, [0.7, 0.2, 0.1]),
        part(ball(48), DVec3::new(-0.8, -0.2, 1.0), 0.3, [0.1, 0.4, 0.7]),
        part(square(), DVec3::new(0.0, 0.0, -2.0), 0.8, [0.3, 0.6, 0.2]),
    ];
    parts.push(reflector);
    let mut scene = scene("room", parts);
    scene.materials.last_mut().into_iter().for_each(&material);
    scene
}

/// A mirror in the plane z = -1, seen from a place.
fn flat_mirror(eye: DVec3) -> Case {
    let mirror = part(square(), DVec3::NEG_Z, 0.8, [0.9; 3]);
    Case::look(room(mirror, MIRROR), eye, DVec3::NEG_Z, 0.01)
}

/// A body in the middle of the room.
fn body(mesh: scene::Mesh, material: impl Fn(&mut Material)) -> Case {
    let mut body = part(mesh, DVec3::new(0.0, 0.0, -0.6), 0.45, [0.9; 3]);
    body.world_from_mesh.matrix3 *= glam::DMat3::from_quat(DQuat::from_rotation_y(0.4));
    Case::look(room(body, material), DVec3::new(0.1, 0.3, 2.4), DVec3::new(0.0, 0.0, -0.6), 0.01)
}

fn reflecting(lab: &mut Lab, case: Case) -> anyhow::Result<Vec<Check>> {
    let reflecting = reflectors(&case.scene);
    let mut served = Served::new(lab, case, &Served::usual())?;
    served.tick(0.0)?;
    let shown = served.shown(&lab.gpu, &mut lab.view, &Effects::ONE_BOUNCE)?;
    let on_reflector = shown.truth.mask(&reflecting);
    let compared: Vec<usize> = settled(&shown, &on_reflector).collect();
    let is_wrong = |pixel: &&usize| {
        let drawn = &shown.drawn.picture.rgb[3 * **pixel..][..3];
        drawn.iter().zip(shown.truth.rgb[**pixel]).any(|(a, b)| a.abs_diff(b) > WRONG)
    };
    let share = compared.iter().filter(is_wrong).count() as f64 / compared.len() as f64;
    let from = "chosen: away from outlines by what a sample of the images around a mirror is wide, a hundredth is left to what these do not see";
    Ok(vec![
        Check::unfit(Some(shown.unfit.values as f64)),
        Check::new(
            "reflections that are another colour",
            (WRONG_SHARE, (!compared.is_empty()).then_some(share)),
            "share",
            from,
        ),
    ])
}

/// The pixels of a reflector around which all rays meet the same object at last.
fn settled(shown: &Shown, on_reflector: &[bool]) -> impl Iterator<Item = usize> {
    let side = PICTURE_PX as usize;
    let is_settled = |pixel: usize| {
        let (x, y) = (pixel % side, pixel / side);
        let inner = MARGIN_PX..side - MARGIN_PX;
        let mut around = (0..=2 * MARGIN_PX).flat_map(|dy| (0..=2 * MARGIN_PX).map(move |dx| (dx, dy)));
        inner.contains(&x)
            && inner.contains(&y)
            && around.all(|(dx, dy)| {
                let beside = (y + dy - MARGIN_PX) * side + x + dx - MARGIN_PX;
                on_reflector[beside] && shown.truth.reflected_object[beside] == shown.truth.reflected_object[pixel]
            })
    };
    (0..side * side).filter(|&pixel| is_settled(pixel)).collect::<Vec<_>>().into_iter()
}

fn open() -> Case {
    Case::look(scene("open", vec![floor(DVec3::ZERO, 2.0)]), DVec3::new(0.0, 1.5, 2.0), DVec3::ZERO, 0.01)
}

fn touching() -> Case {
    let parts = vec![floor(DVec3::ZERO, 2.0), part(ball(48), DVec3::new(0.0, 0.4, 0.0), 0.4, [0.7, 0.3, 0.2])];
    Case::look(scene("touching", parts), DVec3::new(0.3, 1.5, 2.2), DVec3::ZERO, 0.01)
}

/// Over a floor alone all ambient light arrives. Beside a ball, where looks into z-buffers are few, it is only judged to be a share, and to hide something.
fn ambient(lab: &Lab, case: Case, reach_m: f64) -> anyhow::Result<Vec<Check>> {
    let is_open = case.scene.instances.len() == 1;
    let mut served = Served::new(lab, case, &Setup { occlusion_reach_m: reach_m, ..Served::usual() })?;
    served.tick(0.0)?;
    let mut view = ClientView::new(&lab.gpu, (PICTURE_PX, PICTURE_PX))?;
    view.set_occlusion(Settings { occlusion: Occlusion::Graph, reach_m, ..Settings::default() });
    let shown = served.shown(&lab.gpu, &mut view, &Effects::PLAIN)?;
    let shares = view.ambient_shares(&shown.camera)?;
    let outside = shares.iter().filter(|share| !(0.0..=1.0).contains(*share)).count();
    let from = "a share lies between 0 and 1";
    let mut checks = vec![
        Check::unfit(Some(shown.unfit.values as f64)),
        Check::new("shares of ambient light that are none", (0.0, Some(outside as f64)), "", from),
    ];
    if is_open {
        let hidden = shares.iter().map(|share| f64::from(1.0 - share)).fold(0.0, f64::max);
        let from = "over a plane nothing hides ambient light; half a step of depth lifts a sample by what shows as no step of 255";
        checks.push(Check::new("ambient light that a plane hides of itself", (1.0 / 255.0, Some(hidden)), "", from));
    }
    Ok(checks)
}

/// Balls of one mesh, which a client draws by rays against one image of it.
fn by_one_image(lab: &mut Lab) -> anyhow::Result<Vec<Check>> {
    let place = |index: i32| DVec3::new(f64::from(index % 3 - 1), f64::from(index / 3 - 1), 0.0) * 0.6;
    let balls = (0..9).map(|index| part(ball(96), place(index), 0.2, [0.7, 0.3, 0.2]));
    let mut scene = scene("balls", balls.collect());
    scene.instances.iter_mut().for_each(|instance| instance.mesh = 0);
    let case = Case::look(scene, DVec3::new(0.2, 0.3, 2.6), DVec3::ZERO, 0.01);
    let mut served = Served::new(lab, case, &Setup { relief: true, ..Served::usual() })?;
    served.tick(0.0)?;
    anyhow::ensure!(served.by_images() > 0, "no ball is drawn by an image");
    let shown = served.shown(&lab.gpu, &mut lab.view, &Effects::PLAIN)?;
    Ok(Check::of_all(&Errors::of(&[shown])))
}
