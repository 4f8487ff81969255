use glam::DVec3;
use gpu::Gpu;

use super::cases::GROUPS;
use super::check::Check;
use super::judge::{Errors, differing_share};
use super::lab::{Break, Lab};
use super::sweeps::BY_CODE;
use super::swept::values;
use super::way::{Shown, shown};

fn lab(broken: Option<Break>) -> Lab {
    let gpu = pollster::block_on(Gpu::new_headless()).expect("a GPU adapter, software or not");
    Lab::new(&gpu, broken).expect("pipelines")
}

#[test]
fn a_still_life_far_away_is_drawn_as_at_the_origin_and_a_wrong_place_is_seen() {
    let mut lab = lab(None);
    let [near, far] = [0, 7].map(|decade| shown(&mut lab, &BY_CODE[0].1(10_f64.powi(decade))).expect("drawn"));
    assert!(!Check::alike(Some(differing_share(&near, &far))).is_missed());
    let missed = |shown: &[Shown]| Check::of_all(&Errors::of(shown)).iter().any(Check::is_missed);
    assert!(Errors::of(&far).inside > 1000 && Errors::of(&far).unfit.buffers > 5 && !missed(&far));
    // Two centimetres off the truth, as f32 would be there.
    let mut off = far;
    off.iter_mut().for_each(|shown| shown.camera.world_from_eye.translation += DVec3::new(0.0, 0.0, 0.02));
    assert!(missed(&off));
}

#[test]
fn every_case_is_made_of_numbers() {
    for (sweep, case) in BY_CODE {
        assert!((sweep.decades[0]..=sweep.decades[1]).contains(&sweep.holds_to));
        for decade in values(sweep.decades, sweep.holds_to, false) {
            let case = case(10_f64.powi(decade));
            let snapshot = case.scene.at(0.0);
            assert!(snapshot.world_from_mesh.iter().all(|pose| pose.is_finite()), "{} {decade}", sweep.name);
            assert!(case.middle.translation.is_finite() && case.near_m > 0.0 && !case.scene.bounds.is_empty());
        }
    }
}

/// A case by its name.
fn judged(lab: &mut Lab, name: &str) -> Vec<Check> {
    let case = GROUPS.iter().flat_map(|group| group.cases).find(|case| case.name == name).expect("a case");
    (case.judge)(lab).expect("judged")
}

#[test]
fn every_way_to_break_it_is_a_miss() {
    let of_cases = [
        (Break::Normals, "triangles of 1e-6 to 1e4 m side by side"),
        (Break::Colours, "triangles of 1e-6 to 1e4 m side by side"),
        (Break::Poses, "a vibration of 1 kHz, seen ten times a second"),
        (Break::Shadows, "a point light inside of a ball"),
        (Break::Impostors, "a flat mirror"),
    ];
    for (broken, name) in of_cases {
        assert!(!judged(&mut lab(None), name).iter().any(Check::is_missed), "{name} holds");
        assert!(judged(&mut lab(Some(broken)), name).iter().any(Check::is_missed), "{name}, broken by {broken:?}");
    }
    let of_sweeps = [
        (Break::Step, "size", 1.0),
        (Break::Code, "size", 1.0),
        (Break::Anchor, "distance from the origin", 1e7),
        (Break::Corners, "grazing", 1.0),
        (Break::Camera, "size", 1.0),
    ];
    for (broken, name, value) in of_sweeps {
        let (_, case) = BY_CODE.iter().find(|(sweep, _)| sweep.name == name).expect("a sweep");
        let missed = |broken| {
            let shown = shown(&mut lab(broken), &case(value)).expect("drawn");
            Check::of_all(&Errors::of(&shown)).iter().any(Check::is_missed)
        };
        assert!(!missed(None), "{name} holds");
        assert!(missed(Some(broken)), "{name}, broken by {broken:?}");
    }
    assert_eq!(of_cases.len() + of_sweeps.len(), Break::ALL.len());
}
