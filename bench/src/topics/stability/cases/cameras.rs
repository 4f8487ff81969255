//! Cameras that are no pinholes, at their ends: images that a server draws for rays, and rays through them.
//!
//! All that they look at lies in planes, so that where a sample must be needs no rays: on one of them.

use std::f64::consts::FRAC_PI_4;

use anyhow::Context;
use camera::{Camera, CorridorMap, GraphCamera, Heading, ImagePoint, Pinhole, Rigid, Spoc};
use glam::{DMat3, DVec2, DVec3};
use impostor::{Impostor, Method, Ray, Steps};
use protocol::Look;
use scene::Scene;
use server::impostors::Faces;
use server::impostors::draw::{ImpostorCapture, ImpostorDrawer, Subject};

use super::effects::Effect;
use super::stiff::Stiff;
use crate::stage::Stage;
use crate::topics::stability::build::{Placed, at, floor, scene, square};
use crate::topics::stability::check::Check;
use crate::topics::stability::lab::Lab;

pub(super) const CASES: &[Stiff] = &[
    Stiff { name: "a single pole without distortion", judge: |lab| pushed(lab, 0.0) },
    Stiff { name: "a single pole that pushes by a tenth of the image", judge: |lab| pushed(lab, 0.1) },
    Stiff { name: "a single pole that pushes by ten images", judge: |lab| pushed(lab, 10.0) },
];

pub(super) const EFFECTS: &[Effect] = &[
    Effect {
        name: "graph",
        parameter: "frusta in a chain",
        values: &[1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0],
        judge: chain,
    },
    Effect {
        name: "impostor depth jump",
        parameter: "far over near",
        values: &[1e1, 1e2, 1e3, 1e4, 1e5, 1e6],
        judge: jump,
    },
];

const SIDE_PX: u32 = 160;

/// A plane that samples may lie on.
struct Plane {
    point: DVec3,
    normal: DVec3,
}

impl Plane {
    fn off_m(&self, p: DVec3) -> f64 {
        (p - self.point).dot(self.normal).abs()
    }
}

/// The image of a scene by a camera.
fn drawn(lab: &Lab, scene: Scene, camera: &Camera) -> anyhow::Result<ImpostorCapture> {
    let mut stage = Stage::new(&lab.gpu, scene, Look::Plain)?;
    stage.show(0.0, camera.eye_world())?;
    let subject = Subject { objects: &|_| true, faces: Faces::Front };
    Ok(ImpostorDrawer::new(&stage.renderer)?.draw(&stage.renderer, camera, subject)?)
}

/// A place in the image at a sample, some pixels beside its middle.
fn place(capture: &ImpostorCapture, pixel: usize, beside_px: DVec2) -> ImagePoint {
    let width = capture.camera.size_px().0 as usize;
    let (x, y) = ((pixel % width) as f64, (pixel / width) as f64);
    ImagePoint { u: x + 0.5 + beside_px.x, v: y + 0.5 + beside_px.y, w: capture.w[pixel].into() }
}

/// The world point of a sample and what a pixel is wide there.
fn sample(capture: &ImpostorCapture, pixel: usize) -> Option<(DVec3, f64)> {
    let point = place(capture, pixel, DVec2::ZERO);
    let along = |beside_px: DVec2| match &capture.camera {
        Camera::Graph(graph) => graph.world_from_image(place(capture, pixel, beside_px), graph.frustum_at(point)?),
        camera => Some(camera.world_from_image(place(capture, pixel, beside_px))),
    };
    let p = along(DVec2::ZERO)?;
    Some((p, along(DVec2::X)?.distance(p).max(along(DVec2::Y)?.distance(p))))
}

/// How far samples lie off all planes, worst, in what a pixel is wide there.
fn off_px(capture: &ImpostorCapture, planes: &[Plane]) -> Option<f64> {
    let samples = (0..capture.ids.len()).filter(|&pixel| capture.is_occupied(pixel));
    let off = |pixel: usize| {
        let Some((p, pixel_m)) = sample(capture, pixel) else { return f64::NAN };
        planes.iter().map(|plane| plane.off_m(p)).fold(f64::INFINITY, f64::min) / pixel_m
    };
    samples.map(off).reduce(|worst, off| if off > worst || off.is_nan() { off } else { worst })
}

fn numbers(capture: &ImpostorCapture) -> Check {
    Check::unfit(Some(capture.w.iter().filter(|w| !(w.is_finite() && **w >= 0.0)).count() as f64))
}

/// Through a corridor that turns left and right in turn, from its beginning; only floor and ceiling are there.
fn chain(lab: &mut Lab, frusta: f64) -> anyhow::Result<Vec<Check>> {
    const HEIGHT_M: f64 = 1.0;
    // A run of two cells for each frustum, the last of which the next one begins in.
    let (legs, side) = (frusta as usize, frusta as usize / 2 + 2);
    let mut free = vec![false; side * side];
    let (mut column, mut row) = (0, 0);
    free[0] = true;
    for leg in 0..legs {
        if leg % 2 == 0 {
            column += 1;
        } else {
            row += 1;
        }
        free[row * side + column] = true;
    }
    let map = CorridorMap { columns: side, free, origin_world: DVec3::ZERO, cell_m: 1.0, height_m: HEIGHT_M };
    let description = map.describe((0, 0), Heading::PlusX, 4.0, (SIDE_PX, SIDE_PX), 0.0)?;
    let graph = GraphCamera::from_description(&description)?;
    anyhow::ensure!(graph.frusta().len() == legs, "{} frusta instead of {legs}", graph.frusta().len());
    let half_m = side as f64;
    let mut ceiling = floor(DVec3::new(half_m / 2.0, HEIGHT_M, half_m / 2.0), half_m);
    ceiling.world_from_mesh.matrix3 *= DMat3::from_rotation_x(std::f64::consts::PI);
    let ground = floor(DVec3::new(half_m / 2.0, 0.0, half_m / 2.0), half_m);
    let planes = [0.0, HEIGHT_M].map(|y| Plane { point: DVec3::Y * y, normal: DVec3::Y });
    let capture = drawn(lab, scene("corridor", vec![ground, ceiling]), &Camera::Graph(graph.into()))?;
    let from = "as far as half a step of depth shifts a sample: a camera is to be no coarser than what its image is coded with";
    Ok(vec![
        numbers(&capture),
        Check::new("samples off floor and ceiling", (0.05, off_px(&capture, &planes)), "px", from),
    ])
}

/// Two metres before the origin.
fn pinhole() -> Pinhole {
    Pinhole::symmetric(Rigid::look_at(DVec3::Z * 2.0, DVec3::ZERO), (SIDE_PX, SIDE_PX), 1.0, 0.1)
}

/// A board that leans back, by a camera that pushes it by so many images over its depth.
fn pushed(lab: &Lab, by_images: f64) -> anyhow::Result<Vec<Check>> {
    let lean = DMat3::from_rotation_x(-FRAC_PI_4);
    let mut board = Placed { mesh: square(), world_from_mesh: at(DVec3::ZERO, 0.8), colour: [0.5, 0.4, 0.3] };
    board.world_from_mesh.matrix3 *= lean;
    let capture = drawn(lab, scene("board", vec![board]), &Camera::Spoc(spoc(by_images, [1.2, 2.8])))?;
    let planes = [Plane { point: DVec3::ZERO, normal: lean * DVec3::Z }];
    let from = "triangles are cut until none bows by more than a quarter of a pixel in the image";
    Ok(vec![numbers(&capture), Check::new("samples off a board", (0.25, off_px(&capture, &planes)), "px", from)])
}

fn spoc(by_images: f64, [push_from_m, push_to_m]: [f64; 2]) -> Spoc {
    let pinhole = pinhole();
    let (pole_px, push_max_px) = (pinhole.centre_px, by_images * f64::from(SIDE_PX));
    Spoc { pinhole, pole_px, push_from_m, push_to_m, push_max_px, ramp_px: f64::from(SIDE_PX) / 8.0 }
}

/// A board before one that is so many times as far away, both before a single pole that pushes between; rays from beside it find what the image holds.
fn jump(lab: &mut Lab, ratio: f64) -> anyhow::Result<Vec<Check>> {
    const NEAR_M: f64 = 1.0;
    let eye_z = pinhole().world_from_eye.translation.z;
    let boards = [(NEAR_M, 0.3), (NEAR_M * ratio, 2.0 * ratio)];
    let placed = |(depth_m, half_m): (f64, f64)| Placed {
        mesh: square(),
        world_from_mesh: at(DVec3::Z * (eye_z - depth_m), half_m),
        colour: [0.5, 0.4, 0.3],
    };
    let planes = boards.map(|(depth_m, _)| Plane { point: DVec3::Z * (eye_z - depth_m), normal: DVec3::Z });
    let camera = Camera::Spoc(spoc(0.1, [NEAR_M * 0.9, NEAR_M * 1.5]));
    let capture = drawn(lab, scene("boards", boards.map(placed).into()), &camera)?;
    let from = "triangles are cut until none bows by more than a quarter of a pixel in the image";
    let samples = Check::new("samples off two boards", (0.25, off_px(&capture, &planes)), "px", from);
    let from = "chosen: where the pixels around hold the board that a ray meets it is found within a step of a pixel, but for a hundredth of the rays, which pass an edge before";
    let wrong = wrong_share(&capture, boards, eye_z).context("no ray meets what is held")?;
    Ok(vec![
        numbers(&capture),
        samples,
        Check::new("rays that find something else", (0.01, Some(wrong)), "share", from),
    ])
}

/// Of the rays from a twentieth of a metre beside the eye, to boards of a depth and half a side.
fn wrong_share(capture: &ImpostorCapture, boards: [(f64, f64); 2], eye_z: f64) -> Option<f64> {
    let impostor = Impostor::new(capture.camera.clone(), &capture.samples()).ok()?;
    let beside = Pinhole {
        world_from_eye: Rigid { translation: DVec3::new(0.05, 0.05, eye_z), ..pinhole().world_from_eye },
        ..pinhole()
    };
    let (mut held, mut wrong) = (0, 0);
    for pixel in 0..SIDE_PX * SIDE_PX {
        let (x, y) = (f64::from(pixel % SIDE_PX) + 0.5, f64::from(pixel / SIDE_PX) + 0.5);
        let origin = beside.world_from_eye.translation;
        let way = beside.world_from_eye.transform_vector(beside.ray_eye_from_image(x, y));
        // Along the ray depth grows by 1.
        let met = boards.into_iter().map(|(depth_m, half_m)| (origin + way * depth_m, depth_m, half_m));
        let Some((p, depth_m, _)) = met.into_iter().find(|(p, _, half_m)| p.x.abs().max(p.y.abs()) < *half_m) else {
            continue;
        };
        let Some(pixel_m) = width_where_held(capture, p, depth_m) else { continue };
        held += 1;
        let hit = impostor.hit(&Ray::endless(origin, way), Steps { method: Method::Hierarchy, fine_px: 1.0 }).hit;
        wrong += usize::from(!hit.is_some_and(|hit| hit.p_world.distance(p) <= pixel_m));
    }
    (held > 0).then(|| f64::from(wrong as u32) / f64::from(held))
}

/// What a pixel is wide at a point, along the depth too, where it and those around hold samples of that depth.
fn width_where_held(capture: &ImpostorCapture, p: DVec3, depth_m: f64) -> Option<f64> {
    let image = capture.camera.image_from_world(p)?;
    let inside = 1.0..f64::from(SIDE_PX) - 1.0;
    if !(inside.contains(&image.u) && inside.contains(&image.v)) {
        return None;
    }
    let middle = image.v as usize * SIDE_PX as usize + image.u as usize;
    let reach = [middle - SIDE_PX as usize, middle, middle + SIDE_PX as usize];
    // Of one depth: within a hundredth.
    let is_held = |pixel: usize| (f64::from(capture.w[pixel]) * depth_m - 1.0).abs() < 0.01;
    reach.into_iter().flat_map(|row| row - 1..=row + 1).all(is_held).then(|| depth_m / pinhole().focal_px)
}
