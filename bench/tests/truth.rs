//! The truth as the command draws it, on the software adapter where there is no other. A missing adapter fails.

use vantage_bench::compare::folder::compare_folders;
use vantage_bench::options;
use vantage_bench::render::{RenderArgs, render};

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
        look: protocol::Look::Flat,
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
