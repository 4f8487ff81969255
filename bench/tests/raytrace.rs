//! The traced truth beside the one drawn on a GPU, where nothing reflects, and the built-in scenes that reflect.

use camera::{Pinhole, Rigid};
use gpu::Gpu;
use protocol::Look;
use scene::environment::Environment;
use scene::model::{Bumps, SAME_UV, Texture, UvSet, Wrap};
use vantage_bench::raytrace::{Effects, RayTruth, reflectors};
use vantage_bench::stage::{Stage, load_scene};

/// Where a scene wants to be seen from.
fn start(scene: &scene::Scene, size_px: (u32, u32)) -> Pinhole {
    let start = scene.start.expect("built-in scenes say where to begin");
    Pinhole::symmetric(Rigid::look_along(start.eye_world, start.forward_world), size_px, start.fov_y_rad, 0.05)
}

#[test]
fn without_reflections_it_is_the_truth_of_the_gpu() {
    let gpu = pollster::block_on(Gpu::new_headless()).expect("a GPU adapter, software or not");
    // Textures near by, the lights of the flat look, cut-out leaves, figures and walls. With 16 samples a pixel, as
    // traced textures have no mip-maps.
    for (name, look) in
        [("teapots", Look::Plain), ("teapots", Look::FlatLit), ("grass", Look::Plain), ("mirror-maze", Look::Plain)]
    {
        let scene = load_scene(name, 1.0).expect("built in");
        let camera = start(&scene, (64, 64));
        let stage = Stage::new(&gpu, scene, look).expect("on the GPU");
        let drawn = stage.smooth_truth(&camera).expect("drawn");
        let rays = RayTruth::new(&stage.scene, stage.snapshot(), &stage.lighting);
        let traced = rays.picture(&camera, &Effects::PLAIN, 4);
        let pixels = drawn.colour.len() as f64;
        let same_object = (0..drawn.colour.len()).filter(|&pixel| {
            let object = traced.first_object[pixel];
            object.is_some() == (drawn.w[pixel] > 0.0) && object.unwrap_or(0) == drawn.object[pixel]
        });
        let objects = same_object.count() as f64 / pixels;
        let apart = |(a, b): (&[u8; 4], &[u8; 3])| (0..3).map(|k| u32::from(a[k].abs_diff(b[k]))).sum::<u32>();
        let codes = f64::from(drawn.colour.iter().zip(&traced.rgb).map(apart).sum::<u32>()) / (3.0 * pixels);
        println!("{name} {look:?}: {codes:.3} codes apart on average, {objects:.4} of the pixels show the same object");
        assert!(objects > 0.99, "{name}: {objects}");
        assert!(codes < 2.0, "{name}: {codes}");
    }
}

#[test]
fn materials_under_a_sky_are_what_rays_sum_up() {
    let gpu = pollster::block_on(Gpu::new_headless()).expect("a GPU adapter, software or not");
    let mut scene = load_scene("teapots", 1.0).expect("built in");
    // 0.2 along u, 0.25 against v, 0.95 along the normal.
    let rgba = vec![153, 159, 248, 255];
    let tilted = Texture { width_px: 1, height_px: 1, rgba, wrap: [Wrap::Repeat; 2], nearest: false };
    let texture = scene.textures.len() as u32;
    scene.textures.push(tilted);
    let bumps = Bumps { texture, uv_set: UvSet::First, from_uv: SAME_UV, scale: 1.0 };
    for (index, material) in scene.materials.iter_mut().enumerate() {
        material.bumps = (index % 2 == 0).then_some(bumps);
        material.metallic = [0.0, 1.0, 0.5][index % 3];
        material.roughness = 0.25 + 0.15 * (index % 5) as f32;
        material.clearcoat = [0.0, 0.0, 0.8, 0.0][index % 4];
        material.specular_colour = [[1.0; 3], [2.0, 1.0, 0.5]][index % 2];
    }
    let camera = start(&scene, (64, 64));
    let stage = Stage::new(&gpu, scene, Look::Full).expect("on the GPU");
    let drawn = stage.smooth_truth(&camera).expect("drawn");
    let rays = RayTruth::under(&stage.scene, stage.snapshot(), &stage.lighting, &Environment::studio());
    let traced = rays.picture(&camera, &Effects::PLAIN, 4);
    let apart = |(a, b): (&[u8; 4], &[u8; 3])| (0..3).map(|k| u32::from(a[k].abs_diff(b[k]))).sum::<u32>();
    let codes = f64::from(drawn.colour.iter().zip(&traced.rgb).map(apart).sum::<u32>()) / (3.0 * 64.0 * 64.0);
    println!("{codes:.3} codes apart on average");
    // What light is filtered beforehand loses: a highlight that is as wide from the side as from above, a sky of few texels.
    assert!(codes < 4.0, "{codes}");
}

#[test]
fn reflectors_of_built_in_scenes_are_named_and_seen_from_their_paths() {
    for name in scene::builtin::reflecting() {
        let scene = load_scene(name, 1.0).expect("built in");
        let found = reflectors(&scene);
        let named = |object: &u16| {
            ["mirror", "glass"].iter().any(|word| scene.instances[usize::from(*object)].name.contains(word))
        };
        let (count, least_share) = match name.strip_suffix("-moving").unwrap_or(name) {
            "mirror-pair" => (2, 0.15),
            "chrome-car" => (9, 0.15),
            "lake" => (1, 0.15),
            // A fiftieth of a square in the middle of the picture.
            _ => (1, 0.02 * 9.0 / 16.0),
        };
        assert!(found.len() == count && found.iter().all(named), "{name}: {found:?}");
        let path = scene::builtin::reflection_path(name).expect("has a path");
        assert_eq!(path.poses.len(), 60);
        let mut seen_objects = std::collections::HashSet::new();
        for pose in path.poses.iter().step_by(15) {
            let snapshot = scene.at(pose.t_s);
            let lighting = server::look::SceneLook::new(&scene, Look::Plain).lighting(&snapshot);
            let size_px = (96, 54);
            let camera = Pinhole::symmetric(pose.world_from_eye, size_px, 60_f64.to_radians(), 0.05);
            let picture = RayTruth::new(&scene, &snapshot, &lighting).picture(&camera, &Effects::ONE_BOUNCE, 1);
            let shown = picture.mask(&found).iter().filter(|shown| **shown).count();
            let share = shown as f64 / f64::from(size_px.0 * size_px.1);
            println!("{name} at {} s: {share:.3} of the picture reflect", pose.t_s);
            assert!(share >= least_share, "{name} at {} s: reflectors fill {share}", pose.t_s);
            seen_objects.extend(picture.reflected_object.into_iter().flatten());
        }
        println!("{name}: {} objects in reflections", seen_objects.len());
        assert!(seen_objects.len() >= 3, "{name}: {seen_objects:?}");
    }
}
