//! Figures of impostors' images: how much of an object they hold, and how long they take.
//!
//! `cargo run --release -p vantage-server --example impostor_images`

use std::time::Instant;

use camera::{Bounds, CorridorMap, GraphCamera, Heading, Pinhole, Spoc};
use glam::{DVec2, DVec3};
use gpu::Gpu;
use impostor::ImpostorCamera;
use scene::Scene;
use vantage_server::impostors::Faces;
use vantage_server::impostors::draw::coverage::{covered_share, surface_points};
use vantage_server::impostors::draw::{ImpostorDrawer, Subject};
use vantage_server::render::SceneRenderer;

/// Images that a time is the median of.
const REPEATS: usize = 9;

fn main() {
    let gpu = Gpu::block_on(Gpu::new_headless()).expect("a GPU adapter, software or not");
    println!("{}", gpu.caps.name);
    teapot(&gpu);
    maze(&gpu);
}

fn renderer(gpu: &Gpu, scene: &Scene, eye_world: DVec3) -> SceneRenderer {
    let mut renderer = SceneRenderer::new(gpu, scene).expect("the scene uploads");
    renderer.update(&scene.at(0.0), eye_world).expect("same scene");
    renderer
}

/// Median wall time and GPU time in milliseconds, after one image that builds what is needed.
fn times_ms(
    drawer: &mut ImpostorDrawer,
    scene: &SceneRenderer,
    camera: &ImpostorCamera,
    subject: Subject<'_>,
) -> String {
    drawer.draw(scene, camera, subject).expect("drawn");
    let mut times: Vec<(f64, f64)> = (0..REPEATS)
        .map(|_| {
            let started = Instant::now();
            let capture = drawer.draw(scene, camera, subject).expect("drawn");
            (started.elapsed().as_secs_f64() * 1e3, capture.gpu_s.unwrap_or(f64::NAN) * 1e3)
        })
        .collect();
    times.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (wall_ms, gpu_ms) = times[REPEATS / 2];
    format!("{wall_ms:.1} ms, of which the GPU {gpu_ms:.1} ms")
}

fn teapot(gpu: &Gpu) {
    let scene = scene::builtin::load("teapots").expect("built in");
    let named = |name: &str| scene.instances.iter().position(|instance| instance.name == name);
    let object = named("turning teapot").expect("it is there") as u16;
    let points = surface_points(&scene, &scene.at(0.0), object, 100_000);
    let bounds = Bounds::around(points.iter().map(|point| point.position_world)).expect("a surface");
    let radius_m = (bounds.max - bounds.min).length() / 2.0;
    let eye_world = DVec3::new(0.08, 0.36, 0.62);
    let renderer = renderer(gpu, &scene, eye_world);
    let mut drawer = ImpostorDrawer::new(&renderer).expect("a GPU");
    let subject = Subject { objects: &|id| id == object, faces: Faces::Front };
    println!("the teapot of {radius_m:.3} m from {:.2} m", bounds.middle().distance(eye_world));
    for size_px in [256, 512] {
        for ring in [0.5, 1.0, 1.5, 2.0, 3.0] {
            let spoc = Spoc::around(&bounds, eye_world, (size_px, size_px), ring * radius_m).expect("an eye outside");
            let mut share = |camera| covered_share(&points, &drawer.draw(&renderer, &camera, subject).expect("drawn"));
            let pinhole = share(ImpostorCamera::Pinhole(spoc.pinhole));
            let pushed = share(ImpostorCamera::Spoc(spoc));
            let gain = pushed / pinhole;
            println!("{size_px} px, ring {ring} radii: pinhole {pinhole:.4}, single pole {pushed:.4}, {gain:.3} times");
        }
        let spoc = Spoc::around(&bounds, eye_world, (size_px, size_px), radius_m).expect("an eye outside");
        for (what, subject) in [("the teapot", subject), ("all", Subject::ALL)] {
            let pinhole = times_ms(&mut drawer, &renderer, &ImpostorCamera::Pinhole(spoc.pinhole), subject);
            let pushed = times_ms(&mut drawer, &renderer, &ImpostorCamera::Spoc(spoc), subject);
            println!("{size_px} px, {what}: pinhole {pinhole}; single pole {pushed}");
        }
    }
}

/// The built-in maze by a map of its free floor: cells of 2.6 m, between walls 0.24 m thick.
fn maze(gpu: &Gpu) {
    let scene = scene::builtin::load("maze").expect("built in");
    let start = scene.start.as_ref().map(|start| start.eye_world).unwrap_or_default();
    let renderer = renderer(gpu, &scene, start);
    let mut drawer = ImpostorDrawer::new(&renderer).expect("a GPU");
    // A row of cells along x and one along z from its end, as wide as a cell: rays pass through walls of the maze.
    let columns = 12;
    let free: Vec<bool> = (0..columns * columns).map(|cell| (cell / columns) % 4 == 0 || cell % columns == 5).collect();
    let origin_world = DVec3::new(-15.6, 0.0, -15.6);
    let map = CorridorMap { columns, free, origin_world, cell_m: 2.6, height_m: 2.5 };
    for size_px in [256, 512] {
        let description = map.describe((5, 0), Heading::PlusZ, 20.0, (size_px, size_px), 2.0).expect("free");
        let graph = GraphCamera::from_description(&description).expect("a camera");
        let frusta = graph.frusta().len();
        let pinhole = Pinhole { centre_px: DVec2::splat(f64::from(size_px) / 2.0), ..*graph.root() };
        let straight = times_ms(&mut drawer, &renderer, &ImpostorCamera::Pinhole(pinhole), Subject::ALL);
        let graph = times_ms(&mut drawer, &renderer, &ImpostorCamera::Graph(graph), Subject::ALL);
        println!("{size_px} px, maze: pinhole {straight}; graph of {frusta} frusta {graph}");
    }
}
