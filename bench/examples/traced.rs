//! Traces the built-in scenes that reflect, along their paths: `traced FOLDER [SIDE_PX] [SAMPLES_PER_SIDE]` writes
//! every 20th pose as a PNG, with its ambient occlusion, and prints how long each took.

use std::path::PathBuf;
use std::time::Instant;

use camera::Pinhole;
use protocol::Look;
use server::look::SceneLook;
use vantage_bench::compare::Picture;
use vantage_bench::raytrace::{Effects, RayTruth};

fn main() -> anyhow::Result<()> {
    let mut arguments = std::env::args().skip(1);
    let folder = PathBuf::from(arguments.next().ok_or_else(|| anyhow::anyhow!("usage: traced FOLDER"))?);
    let side_px: u32 = arguments.next().map_or(Ok(256), |word| word.parse())?;
    let samples: u32 = arguments.next().map_or(Ok(2), |word| word.parse())?;
    std::fs::create_dir_all(&folder)?;
    for name in scene::builtin::reflecting() {
        let scene = vantage_bench::stage::load_scene(name, 1.0)?;
        let look = SceneLook::new(&scene, Look::Default);
        let path = scene::builtin::reflection_path(name).into_iter().flat_map(|path| path.poses);
        for (index, pose) in path.enumerate().step_by(20) {
            let snapshot = scene.at(pose.t_s);
            let started = Instant::now();
            let truth = RayTruth::new(&scene, &snapshot, &look.lighting(&snapshot));
            let built_s = started.elapsed().as_secs_f64();
            let camera = Pinhole::symmetric(pose.world_from_eye, (side_px, side_px), 50_f64.to_radians(), 0.02);
            let traced = truth.picture(&camera, &Effects::ONE_BOUNCE, samples);
            let traced_s = started.elapsed().as_secs_f64() - built_s;
            let reach_m = if scene.walk { 0.5 } else { 0.1 };
            let free = truth.occlusions(&traced, reach_m, 64);
            let occluded_s = started.elapsed().as_secs_f64() - built_s - traced_s;
            let grey = free.iter().flat_map(|share| [(share * 255.0).round() as u8; 3]).collect();
            let occlusion = Picture { width_px: side_px, height_px: side_px, rgb: grey, covered: None };
            let sheet = Picture::beside(&[&traced.picture(), &occlusion], 4);
            sheet.write(&folder.join(format!("{name}-{index:02}.png")))?;
            println!("{name} {index}: built {built_s:.2} s, traced {traced_s:.2} s, occlusion {occluded_s:.2} s");
        }
    }
    Ok(())
}
