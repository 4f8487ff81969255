use client::draw::soft::{Choice, Method};
use server::discretize::Discretization;

use super::cell::FULL_GEOMETRY;
use super::sets::{Images, SETS};
use super::settings::{LAMPS, USUAL_LAMP};
use super::*;
use crate::report::kept::Taken;
use crate::report::scratch_folder;

/// Small enough for a test.
fn bench<'a>(run: &'a Run, arguments: &Arguments) -> Bench<'a> {
    let mut report = Report::new("shadows", "");
    let settings = Settings::of(run, arguments).expect("valid");
    let settings = Settings { size_px: (64, 64), runs: 1, ..settings };
    let gpu = run.gpu(&mut report).expect("a GPU adapter, software or not").clone();
    let kept = Kept::open(&run.out, "shadows", Taken::SameBuild).expect("readable");
    Bench { gpu, settings, run, kept, machine: json!("this one") }
}

fn arguments() -> Arguments {
    Arguments { image_size: vec![128], points: Some(2), ..Arguments::default() }
}

#[test]
fn sets_of_the_corners_cast_nearly_the_true_shadows() {
    let out = scratch_folder("shadows");
    let run = Run::new(vec!["birdnest".to_owned()], out.clone());
    let mut report = Report::new("shadows", "");
    scene(&mut bench(&run, &arguments()), "birdnest", &mut report).expect("measured");
    assert!(!report.has_failures(), "{:?}", report.rows);
    for row in report.rows.iter().filter(|row| SETS.contains(&row.method.as_str())) {
        let figure = |path: &str| row.figure(path).expect(path);
        assert!(figure("error.intensity.mean") <= figure("error.visibility.mean"));
        assert!(figure("error.visibility.mean") < 40.0, "{}: {}", row.method, figure("error.visibility.mean"));
        assert!(figure("error.visibility_rays.mean") < 40.0);
    }
    std::fs::remove_dir_all(out).expect("was written");
}

#[test]
fn a_row_that_is_kept_is_not_measured_again_and_one_of_another_setting_is() {
    let out = scratch_folder("shadows-resumed");
    let run = Run::new(vec!["birdnest".to_owned()], out.clone());
    let resumed = |arguments: &Arguments| {
        let mut report = Report::new("shadows", "");
        scene(&mut bench(&run, arguments), "birdnest", &mut report).expect("measured");
        assert!(!report.has_failures(), "{:?}", report.rows);
        let resumed: Vec<bool> =
            report.rows.iter().map(|row| row.parameters.get("resumed") == Some(&json!(true))).collect();
        (report, resumed)
    };
    let one = Arguments { set: vec!["conventional".to_owned()], method: vec!["warp".to_owned()], ..arguments() };
    let (first, was) = resumed(&one);
    assert!(!was.is_empty() && !was.contains(&true));
    let (second, was) = resumed(&one);
    assert!(!was.contains(&false));
    // Times too: nothing was measured. Six digits come back from text.
    let figures = |report: &Report| {
        let of_row = |row: &Row| {
            let figure = |path: &str| format!("{:.6}", row.figure(path).expect(path));
            ["error.visibility_rays.mean", "time_ms.images.median", "time_ms.shadows.median"].map(figure)
        };
        report.rows.iter().map(of_row).collect::<Vec<_>>()
    };
    assert_eq!(figures(&first), figures(&second));
    assert_eq!(first.figures.len(), second.figures.len(), "pictures are shown again");
    let all = Arguments { method: Vec::new(), ..one };
    let (report, was) = resumed(&all);
    let kept: Vec<&Row> = report.rows.iter().zip(&was).filter(|(_, was)| **was).map(|(row, _)| row).collect();
    assert!(was.len() > 1 && kept.len() == 1 && kept[0].method.ends_with(", warp"), "the other ways are new");
    let (_, was) = resumed(&Arguments { points: Some(3), ..all });
    assert!(!was.contains(&true));
    std::fs::remove_dir_all(out).expect("was written");
}

#[test]
fn maps_of_the_full_geometry_are_nearly_the_truth() {
    let out = scratch_folder("shadows-full");
    let run = Run::new(vec!["birdnest".to_owned()], out.clone());
    let bench = bench(&run, &Arguments { image_size: vec![256], ..arguments() });
    let mut subject = bench.subject("birdnest").expect("built in");
    let full = Cell::new("birdnest", (FULL_GEOMETRY, Images::By(Discretization::Conventional)), (USUAL_LAMP, 256));
    assert_eq!((full.way.settings)(2, 256).choice, Choice::Always(Method::Maps));
    let errors = subject.full_geometry_errors(&full).expect("drawn").expect("some pixel shows a surface");
    let conventional = Cell { set: "conventional".to_owned(), ..full.clone() };
    let (row, _) = subject.judged(&conventional).expect("measured");
    let rebuilt = row.figure("error.visibility.mean").expect("judged");
    assert!(errors.visibility < 0.6 * rebuilt, "{} of the full geometry, {rebuilt} of four images", errors.visibility);
    let row = subject.full_geometry(&full).expect("drawn");
    assert_eq!(row.figure("counts.triangles"), Some(subject.triangle_count() as f64));
    std::fs::remove_dir_all(out).expect("was written");
}

#[test]
fn maps_of_a_truth_have_the_texels_of_those_that_a_client_draws() {
    let out = scratch_folder("shadows-texels");
    let run = Run::new(vec!["birdnest".to_owned()], out.clone());
    let bench = bench(&run, &arguments());
    let mut subject = bench.subject("birdnest").expect("built in");
    let set = ("conventional", Images::By(Discretization::Conventional));
    let [of_truth, drawn] = subject.point_views(&Cell::new("birdnest", set, (USUAL_LAMP, 128))).expect("one face");
    assert_eq!(of_truth.len(), 4);
    assert_eq!(of_truth, drawn);
    std::fs::remove_dir_all(out).expect("was written");
}

#[test]
fn every_lamp_of_the_tables_sees_every_scene_by_one_face() {
    let run = Run::new(Vec::new(), std::path::PathBuf::new());
    for name in Shadows.default_scenes(false) {
        let scene = run.load(&name).expect("built in");
        for size in LAMPS {
            let views = lamp::corner_views(&lamp::over(&scene, size), &scene, 64);
            assert_eq!(views.map(|views| views.len()).ok(), Some(4), "{name}, {size}");
        }
    }
}
