use camera::Motion;
use glam::DQuat;

use super::*;
use crate::viewer::PredictionError;

const VIEW: ViewSize = ViewSize { width_px: 640, height_px: 360, fov_y_rad: 1.047 };
const RULES: Rules = Rules {
    images: 4,
    image_size_px: 512,
    update_interval_s: 0.1,
    near_m: 0.05,
    margin_m: 0.25,
    animated: false,
    rests: false,
    anticipates: false,
    parallax_error_px: PARALLAX_ERROR_PX,
};

fn viewer() -> Viewer {
    Viewer::at_start(VIEW, Rigid::look_along(DVec3::new(0.0, 1.7, 0.0), DVec3::NEG_Z), 0.0)
}

fn first(viewer: &Viewer, now_s: f64) -> Coverage {
    plan(&RULES, viewer, now_s, None).expect("a first look").coverage
}

fn settled(coverage: &Coverage) -> Focus {
    Focus { coverage: *coverage, settled: true, passing: false, looks: 1 }
}

#[test]
fn a_still_viewer_is_looked_for_until_nothing_lacks_and_then_no_more() {
    let viewer = viewer();
    let last = settled(&first(&viewer, 0.0));
    let lacking = Focus { settled: false, ..last };
    for tick in 1..100 {
        let now_s = f64::from(tick) * 0.1;
        assert_eq!(plan(&RULES, &viewer, now_s, Some(&last)), None);
        let again = plan(&RULES, &viewer, now_s, Some(&lacking)).expect("a look");
        assert_eq!((again.reason, again.views.len()), (Reason::Settling, 4));
        let passing = Focus { passing: true, ..last };
        let again = plan(&RULES, &viewer, now_s, Some(&passing)).map(|plan| plan.reason);
        assert_eq!(again, Some(Reason::Settling), "in passing not all is looked for");
    }
}

#[test]
fn who_moved_is_looked_ahead_for() {
    let mut viewer = viewer();
    let last = settled(&first(&viewer, 0.0));
    let start = viewer.world_from_eye;
    let mut pose = start;
    pose.translation.x += 0.1;
    viewer.hear(1, 1.0, pose, Motion::along(DVec3::X), 1.0);
    let moved = plan(&RULES, &viewer, 1.0, Some(&last)).expect("a look");
    assert_eq!((moved.reason, moved.views.len()), (Reason::Moved, 3));
    let step_m = |view: usize| moved.views[view].world_from_eye.translation.x - pose.translation.x;
    assert!((step_m(0) - 0.05).abs() < 1e-9 && (step_m(1) - 0.15).abs() < 1e-9, "half an interval, and one more");
    let turned = Rigid { rotation: DQuat::from_rotation_y(0.05) * start.rotation, ..start };
    viewer.hear(2, 9.0, turned, Motion::STILL, 9.0);
    assert_eq!(plan(&RULES, &viewer, 9.0, Some(&last)).map(|plan| plan.reason), Some(Reason::Turned));
}

#[test]
fn who_goes_on_as_expected_is_looked_for_in_every_third_tick() {
    let rules = Rules { update_interval_s: 1.0 / 30.0, ..RULES };
    let pivot = DVec3::new(0.0, 1.0, -5.0);
    // What the plans of seven ticks are of somebody who turns by 2.4 degrees from one to the next, and does something else from a tick on.
    let looks = |rules: &Rules, changes_at: u32, change: &dyn Fn(&mut Rigid, &mut Motion)| -> Vec<bool> {
        let mut viewer = viewer();
        let mut last = settled(&first(&viewer, 0.0));
        let begin = viewer.world_from_eye;
        let tick = |tick: u32| {
            let now_s = 1.0 + f64::from(tick) * rules.update_interval_s;
            let mut motion = Motion::about(pivot, begin.translation, DVec3::Y * f64::to_radians(72.0));
            let mut eye = motion.pose_after(&begin, f64::from(tick) * rules.update_interval_s);
            motion = Motion::about(pivot, eye.translation, DVec3::Y * f64::to_radians(72.0));
            if tick >= changes_at {
                change(&mut eye, &mut motion);
            }
            viewer.hear(viewer.pose_seq + 1, now_s, eye, motion, now_s);
            let plan = plan(rules, &viewer, now_s, Some(&last));
            last = plan.as_ref().map_or(last, |plan| settled(&plan.coverage));
            plan.is_some()
        };
        (0..7).map(tick).collect()
    };
    let nothing: &dyn Fn(&mut Rigid, &mut Motion) = &|_, _| ();
    assert_eq!(looks(&rules, 9, nothing), [true, false, false, true, false, false, true]);
    assert_eq!(looks(&rules, 2, &|eye, _| eye.translation.y += 0.2)[..3], [true, false, true], "aside");
    let turned = |eye: &mut Rigid, _: &mut Motion| eye.rotation = DQuat::from_rotation_x(0.06) * eye.rotation;
    assert_eq!(looks(&rules, 2, &turned)[..3], [true, false, true], "looks elsewhere");
    assert_eq!(looks(&rules, 2, &|_, motion| *motion = Motion::STILL)[..3], [true, false, true], "stops");
    assert_eq!(looks(&rules, 1, &|eye, _| eye.translation.y -= 0.02)[..3], [true, false, false], "trembles");
    assert_eq!(looks(&Rules { animated: true, ..rules }, 9, nothing), [true; 7]);
}

#[test]
fn who_turns_fast_is_looked_for_all_along_the_arc() {
    let (pivot, mut viewer) = (DVec3::ZERO, viewer());
    let last = settled(&first(&viewer, 0.0));
    let eye = Rigid::look_at(DVec3::new(0.0, 1.0, 5.0), pivot);
    for (deg_per_s, views) in [(60.0, 3), (144.0, 3), (180.0, 4), (360.0, 4)] {
        let motion = Motion::about(pivot, eye.translation, DVec3::Y * f64::to_radians(deg_per_s));
        viewer.hear(viewer.pose_seq + 1, f64::from(viewer.pose_seq as u32), eye, motion, 1.0);
        let plan = plan(&RULES, &viewer, 1.0, Some(&last)).expect("a look");
        assert_eq!(plan.views.len(), views, "{deg_per_s}");
        for view in &plan.views[..plan.refining] {
            let distance_m = view.world_from_eye.translation.distance(pivot);
            assert!((distance_m - eye.translation.length()).abs() < 1e-5, "on the circle");
        }
        let (a, b) = (&plan.views[0].world_from_eye, &plan.views[plan.refining - 1].world_from_eye);
        let turned_deg = a.rotation.angle_between(b.rotation).to_degrees();
        assert!((turned_deg - deg_per_s * RULES.update_interval_s).abs() < 1e-3, "{turned_deg}");
    }
}

#[test]
fn what_may_be_is_covered_from_the_rim_and_what_is_expected_more_finely() {
    let half_rad = |view: &Pinhole| (view.centre_px.x / view.focal_px).atan();
    let judged = PredictionError { distance_m: 0.0, turn_rad: 0.4 };
    // Where none was judged, and a key says the speed before it led anywhere, nothing bounds what a start may gain but the caps.
    for error in [Some(judged), None] {
        let mut viewer = viewer();
        let last = settled(&first(&viewer, 0.0));
        viewer.error = error;
        let motion = Motion::about(DVec3::new(0.0, 1.7, -3.0), viewer.world_from_eye.translation, DVec3::Y);
        viewer.hear(1, 1.0, viewer.world_from_eye, motion, 1.0);
        let plan = plan(&RULES, &viewer, 1.0, Some(&last)).expect("a look");
        let (way, rim) = plan.views.split_at(plan.refining);
        let rest_rad = last.coverage.half_field.x.atan();
        assert!(way.iter().all(|view| (half_rad(view) - rest_rad).abs() < 1e-9), "along an arc, no wider than at rest");
        assert!(rim.iter().all(|view| half_rad(view) > rest_rad + 0.3), "{error:?}");
        assert!(rim.iter().all(|view| view.world_from_eye.translation.is_finite()), "{error:?}");
        assert!(plan.coverage.radius_m <= RULES.max_radius_m(), "{error:?}");
    }
}

#[test]
fn views_from_the_rim_take_turns() {
    let rules = Rules { animated: true, ..RULES };
    let viewer = viewer();
    let coverage = first(&viewer, 0.0);
    let eyes: Vec<DVec3> = (0..RIM_VIEWS)
        .map(|looks| {
            let last = Focus { coverage, settled: true, passing: false, looks };
            let plan = plan(&rules, &viewer, 0.1, Some(&last)).expect("the scene moved on");
            assert_eq!((plan.reason, plan.views.len()), (Reason::Animated, 2));
            plan.views[1].world_from_eye.translation
        })
        .collect();
    assert!((0..RIM_VIEWS).all(|a| (0..a).all(|b| eyes[a].distance(eyes[b]) > 0.1)), "{eyes:?}");
    assert_eq!(plan(&rules, &viewer, 0.0, Some(&settled(&coverage))), None, "its time stands still");
    let back = plan(&rules, &viewer, -1.0, Some(&settled(&coverage))).expect("its time jumped back");
    assert_eq!(back.reason, Reason::Animated);
}

#[test]
fn the_own_view_of_a_still_viewer_is_as_dense_as_the_output_at_most() {
    let own_focal_px = |view: ViewSize| {
        let mut viewer = viewer();
        viewer.view = view;
        plan(&RULES, &viewer, 0.0, None).expect("a first look").views[0].focal_px
    };
    let of_height = |height_px: u32| ViewSize { width_px: height_px * 16 / 9, height_px, ..VIEW };
    let wide_px = region_views(&first(&viewer(), 0.0), &RULES)[0].focal_px;
    assert!((own_focal_px(of_height(180)) / wide_px - 1.0).abs() < 0.01, "small outputs gain nothing");
    let between = of_height(340);
    assert_eq!(own_focal_px(between), output_focal_px(between));
    let most_px = own_focal_px(of_height(1800));
    assert!(most_px > 1.1 * wide_px && most_px < output_focal_px(of_height(1800)), "its pixels end");
}

#[test]
fn images_cover_the_view_from_the_middle_and_the_rim_of_the_region() {
    let coverage = first(&viewer(), 0.0);
    let views = region_views(&coverage, &RULES);
    assert_eq!(views.len(), 4);
    let half = half_view(VIEW);
    for view in &views {
        assert!(view.is_valid());
        let half_field = view.centre_px / view.focal_px;
        assert!(half_field.cmpgt(half).all() && half_field.cmplt(half * 1.5).all(), "{half_field} for {half}");
        let pixels = f64::from(view.width_px * view.height_px);
        assert!((pixels / (512.0 * 512.0) - 1.0).abs() < 0.02, "{pixels} pixels");
    }
    for rim in &views[1..] {
        let offset = rim.world_from_eye.translation - views[0].world_from_eye.translation;
        assert!((offset.length() - coverage.radius_m).abs() < 1e-9);
        assert!(offset.dot(DVec3::NEG_Z).abs() < 1e-9, "the ring lies across the view");
    }
}
