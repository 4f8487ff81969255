//! Every topic takes a scene file and a trace that nobody has seen before.

use std::path::Path;

use clap::Command;
use vantage_bench::topic::{Run, run_topic};
use vantage_bench::topics;

/// A room of 4 x 3 x 4 m, seen from within, with a box in it.
fn write_room(path: &Path) {
    let mut text = String::new();
    let mut first = 1;
    for (low, high, turn) in [([-2.0, 0.0, -2.0], [2.0, 3.0, 2.0], true), ([-0.4, 0.0, -1.2], [0.4, 0.8, -0.6], false)]
    {
        for corner in 0..8 {
            let at = |axis: usize| if corner >> axis & 1 == 0 { low[axis] } else { high[axis] };
            let (x, y, z): (f64, f64, f64) = (at(0), at(1), at(2));
            text += &format!("v {x} {y} {z}\n");
        }
        for face in [[0, 2, 3, 1], [4, 5, 7, 6], [0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3]] {
            let mut corners = face.map(|corner: i32| (first + corner).to_string());
            if turn {
                corners.reverse();
            }
            text += &format!("f {}\n", corners.join(" "));
        }
        first += 8;
    }
    std::fs::write(path, text).expect("written");
}

/// What makes a topic small.
fn arguments(topic: &str) -> &'static [&'static str] {
    match topic {
        "sampling" => &["--image-size", "64", "--frames", "3", "--no-convergence"],
        "reconstruction" => &["--eyes", "2", "--only-bars"],
        "materials" => &["--eyes", "2"],
        "novel-views" => &["--frames", "3", "--image-size", "64", "--no-sweeps", "--ffmpeg", "/nowhere/ffmpeg"],
        "network" => &["--path", "none"],
        "impostors" => &["--poses", "2", "--only-errors"],
        "shadows" => &["--points", "2", "--method", "maps", "--no-growth"],
        _ => &[],
    }
}

/// Every topic is in one of so many parts, so that as many cores have something to do.
const PARTS: usize = 4;

#[test]
fn every_topic_takes_a_file_and_a_trace() {
    topics_take_a_file_and_a_trace(0);
}

#[test]
fn every_topic_takes_a_file_and_a_trace_second_part() {
    topics_take_a_file_and_a_trace(1);
}

#[test]
fn every_topic_takes_a_file_and_a_trace_third_part() {
    topics_take_a_file_and_a_trace(2);
}

#[test]
fn every_topic_takes_a_file_and_a_trace_fourth_part() {
    topics_take_a_file_and_a_trace(3);
}

fn topics_take_a_file_and_a_trace(part: usize) {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("any-scene-{part}"));
    std::fs::create_dir_all(&folder).expect("a folder");
    let (scene, trace) = (folder.join("room.obj"), folder.join("walk.txt"));
    write_room(&scene);
    // Looks along -z and walks to the right.
    std::fs::write(&trace, "-0.5 1.5 1.5 0 0 0 0\n0.5 1.5 1.5 0 10 0 200\n").expect("written");
    for topic in topics::ALL.iter().skip(part).step_by(PARTS) {
        let name = topic.name();
        let matches = topic.arguments(Command::new(name)).get_matches_from([name].iter().chain(arguments(name)));
        let scenes = vec![scene.to_string_lossy().into_owned()];
        let mut run = Run::new(scenes, folder.join(name)).with_matches(matches);
        (run.size_px, run.quick) = (Some((64, 48)), true);
        run.trace = Some(folder.join("nowhere.txt"));
        let unread = run_topic(*topic, &run).map_or(true, |report| report.has_failures());
        assert!(unread, "{name} does not read its trace");
        run.trace = Some(trace.clone());
        let report = run_topic(*topic, &run).unwrap_or_else(|error| panic!("{name}: {error:#}"));
        assert!(!report.has_failures(), "{name}: {:?}", report.rows);
        // Of topics that draw nothing it is not: they name no scenes. A topic may tell bounds in a table of their own: "room, bounds".
        let draws = !topic.default_scenes(true).is_empty();
        assert!(!draws || report.rows.iter().all(|row| row.scene.starts_with("room")), "{name}");
    }
    std::fs::remove_dir_all(folder).expect("was written");
}
