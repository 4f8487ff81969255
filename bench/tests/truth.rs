//! The truth as the command draws it, on the software adapter where there is no other. A missing adapter fails.

use std::path::Path;

use camera::{Pinhole, Rigid};
use glam::DVec3;
use gpu::Gpu;
use protocol::Look;
use vantage_bench::compare::folder::compare_folders;
use vantage_bench::options;
use vantage_bench::render::{RenderArgs, render};
use vantage_bench::stage::{Stage, load_scene};

#[test]
fn the_truth_of_a_trace_is_drawn_and_scores_perfectly_against_itself() {
    let folder = std::env::temp_dir().join(format!("vantage-truth-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("the temporary folder is writable");
    let trace = folder.join("trace.txt");
    std::fs::write(&trace, "-3.2 1.67 6.6 -1.7 -8 0 0\n-3.2 1.67 6.5 -1.7 -8 0 17\n").expect("writable");
    let out = folder.join("truth");
    let args = |trace: Option<String>, poses| RenderArgs {
        scene: "pillars".to_owned(),
        trace,
        poses,
        size: options::size("64x36").expect("a size"),
        out: out.clone(),
        look: Look::Flat,
        scale: 1.0,
        fov_y_deg: 60.0,
        supersample: 16,
    };
    render(&args(Some(trace.display().to_string()), None)).expect("the truth is drawn");
    let first = std::fs::read(out.join("frame_00001.png")).expect("two frames");
    assert!(out.join("smooth_00001.png").exists());

    render(&args(None, Some(out.join("truth.json")))).expect("its own rows are poses");
    assert_eq!(
        std::fs::read(out.join("frame_00001.png")).expect("drawn again"),
        first,
        "the same poses, the same truth"
    );

    let comparison = compare_folders(&out, &out).expect("scored");
    assert_eq!((comparison.summary["flip"].worst, comparison.summary["ssim"].worst), (0.0, 1.0));
    let antialiasing = comparison.summary["flip_16x"].mean;
    assert!(
        antialiasing > 0.0 && antialiasing < 0.3,
        "one sample a pixel differs a little from sixteen: {antialiasing}"
    );
    let covered = comparison.rows[0].scores.covered_share;
    assert!(covered > 0.9, "a closed room covers the view: {covered}");
    std::fs::remove_dir_all(folder).expect("was written");
}

/// Light that a code stands for, by the definition of sRGB (IEC 61966-2-1).
fn linear(code: u8) -> f64 {
    let c = f64::from(code) / 255.0;
    if c <= 0.04045 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }
}

/// A wall that ends in the middle of a column of pixels.
#[test]
fn a_half_covered_pixel_is_half_of_the_light_on_either_side() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("half-covered");
    std::fs::create_dir_all(&folder).expect("a folder");
    let path = folder.join("wall.obj");
    std::fs::write(&path, "v -9 -9 -3\nv 0 -9 -3\nv 0 9 -3\nv -9 9 -3\nf 1 2 3 4\n").expect("written");
    let scene = load_scene(&path.to_string_lossy(), 1.0).expect("a scene");
    let gpu = pollster::block_on(Gpu::new_headless()).expect("a GPU adapter, software or not");
    let stage = Stage::new(&gpu, scene, Look::Flat).expect("on the GPU");
    let eye = Rigid::look_along(DVec3::ZERO, DVec3::NEG_Z);
    // Of nine columns the fifth is half covered.
    let camera = Pinhole::symmetric(eye, (9, 8), 60_f64.to_radians(), 0.05);
    let (plain, smooth) = (stage.truth(&camera).expect("drawn"), stage.smooth_truth(&camera).expect("drawn"));
    for row in 0..8 {
        let at = |truth: &server::truth::Truth, column: usize| truth.colour[row * 9 + column];
        let (wall, nothing) = (at(&plain, 1), at(&plain, 7));
        assert!((wall[3], nothing[3]) == (255, 0) && wall[0].abs_diff(nothing[0]) > 40, "{wall:?} {nothing:?}");
        assert_eq!((&at(&smooth, 1)[..3], &at(&smooth, 7)[..3]), (&wall[..3], &nothing[..3]));
        for channel in 0..3 {
            let half = (linear(wall[channel]) + linear(nothing[channel])) / 2.0;
            let found = at(&smooth, 4)[channel];
            // The nearest code to that light.
            let off = |code: u8| (linear(code) - half).abs();
            let best = (0..=255).min_by(|&a, &b| off(a).total_cmp(&off(b))).expect("codes");
            assert!(found.abs_diff(best) <= 1, "row {row}: {found}, not {best}");
        }
    }
    std::fs::remove_dir_all(folder).expect("was written");
}
