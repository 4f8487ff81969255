//! The topic `novel-views` from end to end, as small as it goes: a real server, real sockets, three pictures, no ffmpeg.

use clap::Command;
use vantage_bench::report::Report;
use vantage_bench::topic::{Run, Topic, run_topic};
use vantage_bench::topics::novel_views::NovelViews;

fn report_of(line: &[&str], out: &std::path::Path) -> Report {
    let matches =
        NovelViews.arguments(Command::new("novel-views")).get_matches_from(["novel-views"].iter().chain(line));
    let mut run = Run::new(vec!["teapots".to_owned()], out.to_owned()).with_matches(matches);
    (run.size_px, run.quick) = (Some((64, 36)), true);
    run_topic(&NovelViews, &run).expect("the topic runs")
}

#[test]
fn three_pictures_are_replayed_and_every_byte_counts() {
    let out = std::env::temp_dir().join(format!("vantage-novel-views-{}", std::process::id()));
    let line = ["--frames", "3", "--image-size", "64", "--images", "2", "--no-sweeps", "--ffmpeg", "/nowhere/ffmpeg"];
    let report = report_of(&line, &out);
    assert!(!report.has_failures(), "{:?}", report.rows);

    let [ours, video] = report.rows.as_slice() else { panic!("a row of ours and one of video: {:?}", report.rows) };
    let figure = |path: &str| ours.figure(path).unwrap_or_else(|| panic!("no {path}"));
    assert_eq!(figure("counts.frames"), 2.0, "two of three are drawn");
    let flip = figure("error.flip.worst");
    assert!(flip > 0.0 && flip < 0.2, "FLIP {flip}");
    assert!(figure("error.holes_share.mean") < 0.02);
    assert!(figure("time_ms.server_update.median") > 0.0 && figure("time_ms.frame.median") > 0.0);
    // Half a round trip of 100 ms with its jitter, and the frame's own grid.
    let first_picture_ms = figure("counts.first_picture_ms");
    assert!((40.0..=80.0).contains(&first_picture_ms), "{first_picture_ms} ms");

    let kinds: f64 = ours.bytes.0.iter().map(|(_, bytes_per_s)| bytes_per_s).sum();
    assert!((kinds * 8.0 / 1e6 - figure("counts.mbit_s")).abs() < 1e-9, "the kinds of bytes add up to all of them");
    for kind in ["up_hello_per_s", "up_pose_per_s", "up_ack_per_s", "down_welcome_per_s", "down_update_per_s"] {
        assert!(figure(&format!("bytes.{kind}")) > 0.0, "{kind}");
    }
    let framing = figure("bytes.framing_per_s") * 3.0 / 60.0;
    assert!((200.0..4000.0).contains(&framing), "{framing} bytes of HTTP and websocket frames");
    let state = video.parameters.get("state").and_then(|state| state.as_str());
    assert_eq!(state, Some("not measured: ffmpeg is not installed"));

    for file in ["novel-views.json", "novel-views.csv", "index.html", "bytes-teapots.svg", "frames-teapots.svg"] {
        assert!(out.join(file).is_file(), "{file}");
    }
    assert!(report.figures.iter().any(|figure| figure.file.ends_with(".png") && out.join(&figure.file).is_file()));
    std::fs::remove_dir_all(out).expect("was written");
}

#[test]
fn a_motion_is_a_row_a_part_with_sheets_and_a_line_each() {
    let out = std::env::temp_dir().join(format!("vantage-motions-{}", std::process::id()));
    let line = ["--motion", "rest", "--image-size", "64", "--images", "1", "--no-video"];
    let report = report_of(&line, &out);
    assert!(!report.has_failures(), "{:?}", report.rows);
    let motion =
        |row: &vantage_bench::report::Row| row.parameters.get("motion").and_then(|m| m.as_str()).map(str::to_owned);
    let parts: Vec<_> = report.rows.iter().filter_map(motion).collect();
    assert_eq!(parts, ["rest, moving", "rest, after 0.5 s", "rest, after 1 s", "rest, at the end"]);
    for row in &report.rows {
        for measure in ["flip", "flip_covered", "flip_band", "flip_16x", "flip_16x_covered", "flip_16x_band"] {
            let figure = row.figure(&format!("error.{measure}.mean"));
            assert!(figure.is_some_and(|flip| flip > 0.0 && flip < 0.5), "{measure}: {figure:?}");
        }
    }
    let [moving, at_rest] = [0, 2].map(|part: usize| &report.rows[part]);
    let off_deg = |row: &vantage_bench::report::Row| row.figure("error.predicted_off_deg.worst");
    assert!(off_deg(moving).is_some_and(|deg| deg > 0.5), "a start and a stop are not foreseen: {:?}", off_deg(moving));
    let errors = |row: &vantage_bench::report::Row| {
        ["error.flip_band.mean", "error.flip_covered.mean"].map(|path| row.figure(path).expect(path))
    };
    let ([moving_band, moving_covered], [band, covered]) = (errors(moving), errors(at_rest));
    assert!(moving_band > moving_covered, "in motion outlines are worst: {moving_band}, {moving_covered}");
    assert!(band < moving_band / 2.0 && band < 1.5 * covered, "at rest they are as all else: {band}, {covered}");
    assert!(at_rest.figure("counts.bytes_after_1_s_of_rest").is_some());
    let csv = std::fs::read_to_string(out.join("motions.csv")).expect("a line each");
    assert_eq!(csv.lines().count(), 5, "{csv}");
    let sheets = report.figures.iter().filter(|figure| figure.file.ends_with(".png"));
    assert!(sheets.clone().count() >= 4 && sheets.clone().all(|figure| out.join(&figure.file).is_file()));
    std::fs::remove_dir_all(out).expect("was written");
}
