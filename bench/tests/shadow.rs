//! Shadows at the client beside traced ones, for what a server sends a viewer at the start of a scene.

use camera::{Pinhole, Rigid};
use client::draw::frame::Options;
use client::draw::shadow::{Settings, Shadows};
use gpu::Gpu;
use protocol::Look;
use server::discretize::{Discretization, Discretizer};
use vantage_bench::client_view::{ClientView, HeldSet};
use vantage_bench::compare::Picture;
use vantage_bench::raytrace::{Effects, RayTruth};
use vantage_bench::sets::{self, SetPlan};
use vantage_bench::stage::{Stage, load_scene};

const SIZE_PX: (u32, u32) = (128, 128);

/// Mean absolute difference of sRGB-encoded channels, in codes, over what the truth covers.
fn codes_apart(frame: &Picture, truth: &Picture) -> f64 {
    let covered = truth.covered.as_ref().expect("a mask");
    let pixels = frame.rgb.chunks_exact(3).zip(truth.rgb.chunks_exact(3)).zip(covered).filter(|(_, covered)| **covered);
    let apart = pixels.map(|((a, b), _)| a.iter().zip(b).map(|(a, b)| f64::from(a.abs_diff(*b))).sum::<f64>() / 3.0);
    let (sum, count) = apart.fold((0.0, 0.0), |(sum, count), apart| (sum + apart, count + 1.0));
    sum / count
}

#[test]
fn shadows_of_held_samples_are_near_traced_ones() {
    let gpu = pollster::block_on(Gpu::new_headless()).expect("a GPU adapter, software or not");
    for name in ["barrels", "cars"] {
        let scene = load_scene(name, 1.0).expect("built in");
        let start = scene.start.expect("says where to begin");
        let eye = Rigid::look_along(start.eye_world, start.forward_world);
        let camera = Pinhole::symmetric(eye, SIZE_PX, start.fov_y_rad, server::start::near_m(&scene));
        let stage = Stage::new(&gpu, scene, Look::Plain).expect("on the GPU");
        let plan = SetPlan { discretization: Discretization::default(), images: 6, image_px: 256 };
        let (views, precision) = sets::planned(&stage.scene, eye, &camera, &plan);
        let mut discretizer = Discretizer::new(&stage.renderer).expect("compiles");
        let set = sets::make(&stage, &mut discretizer, &views, plan.discretization, precision).expect("made");
        let look = (stage.renderer.materials(), &stage.lighting);
        let held = HeldSet::new(&gpu, &set.images, look).expect("held");
        let mut client = ClientView::new(&gpu, SIZE_PX).expect("compiles");
        let rays = RayTruth::new(&stage.scene, stage.snapshot(), &stage.lighting);
        let traced = |shadows| rays.picture(&camera, &Effects { shadows, ..Effects::PLAIN }, 3).picture();
        let truth = traced(true);
        let plain = client.frame(&held, &camera, Options::default()).expect("drawn").picture;
        client.set_shadows(Settings { shadows: Shadows::Maps, side_px: 1024, ..Settings::default() });
        let drawn = client.frame(&held, &camera, Options::default()).expect("drawn");
        let again_ms = client.draw(&held, &camera, Options::default()).expect("drawn");
        let (off, on) = (codes_apart(&plain, &truth), codes_apart(&drawn.picture, &truth));
        let without = codes_apart(&plain, &traced(false));
        println!(
            "{name}: {on:.2} codes off traced shadows, {off:.2} without shadows (which are {without:.2} off a truth without); \
             {:.0} ms the first frame, {again_ms:.0} ms the next",
            drawn.frame_ms
        );
        if let Some(folder) = std::env::var_os("VANTAGE_SHADOW_PICTURES") {
            let pictures = Picture::beside(&[&plain, &drawn.picture, &truth], 4);
            pictures.write(&std::path::Path::new(&folder).join(format!("{name}.png"))).expect("writable");
        }
        // What is left is by far the samples' own.
        assert!(on < off && on - without < 0.25 * (off - without), "{name}: {on}, {off} and {without}");
    }
}
