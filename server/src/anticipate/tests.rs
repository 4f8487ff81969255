use protocol::message::ViewSize;

use super::*;

const VIEW: ViewSize = ViewSize { width_px: 640, height_px: 360, fov_y_rad: 1.047 };

#[test]
fn a_ring_goes_round_at_the_same_distance_nearest_first_and_then_higher_and_lower() {
    let (pivot, eye) = (DVec3::new(1.0, 0.5, 2.0), DVec3::new(1.0, 1.5, 6.0));
    let looks = rings(&Rigid::look_at(eye, pivot), pivot, DVec3::Y);
    assert_eq!(looks.poses.len(), 5 * 18);
    let angle = |pose: &Rigid| {
        let out = pose.translation - pivot;
        out.x.atan2(out.z)
    };
    let first: Vec<f64> = looks.poses[..4].iter().map(|pose| (angle(pose) / RING_STEP_RAD).round()).collect();
    assert_eq!(first, [0.0, 1.0, -1.0, 2.0]);
    for pose in &looks.poses {
        let distance_m = pose.translation.distance(pivot);
        assert!((distance_m - eye.distance(pivot)).abs() < 1e-9);
        assert!(pose.transform_point(DVec3::Z * distance_m).distance(pivot) < 1e-9, "it looks at the pivot");
    }
    assert!(looks.poses[18].translation.y > eye.y && looks.poses[36].translation.y < eye.y);
    let count = looks.poses.len();
    let distinct = (0..count).all(|a| !looks.is_done(&looks.poses[..a], &looks.poses[a]));
    assert!(distinct, "no view stands for another of the same rings");
}

#[test]
fn who_turned_on_needs_no_other_ring() {
    let pivot = DVec3::new(0.0, 1.0, 0.0);
    let here = Rigid::look_at(DVec3::new(0.0, 2.0, 5.0), pivot);
    let done = rings(&here, pivot, DVec3::Y).poses;
    for angle in [0.1, 1.0, 3.0] {
        let looks = rings(&turned(&here, pivot, DQuat::from_rotation_y(angle)), pivot, DVec3::Y);
        assert!(looks.poses.iter().all(|pose| looks.is_done(&done, pose)), "{angle}");
    }
    let nearer = Rigid { translation: here.translation * 0.6, ..here };
    let looks = rings(&nearer, pivot, DVec3::Y);
    assert!(!looks.is_done(&done, &looks.poses[0]), "from nearer everything is seen more finely");
}

#[test]
fn who_walks_looks_round_and_then_as_far_as_the_way_is_free() {
    let viewer = Viewer::at_start(VIEW, Rigid::look_along(DVec3::Y, DVec3::NEG_Z), 0.0);
    let places_of = |free_m| {
        let looks = places(&viewer, free_m, 0.25);
        let mut along: Vec<f64> = looks.poses.iter().map(|pose| -pose.translation.z).collect();
        along.dedup();
        along
    };
    assert_eq!(places_of([0.5, 0.5]), [0.0]);
    assert_eq!(places_of([2.8, 1.4]), [0.0, 0.7, 1.4, -0.7, 2.1]);
    assert_eq!(places_of([f64::INFINITY; 2]).len(), 7);
}
