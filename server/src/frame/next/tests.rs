use super::*;

fn told(place: impl Fn(f64) -> DAffine3) -> Option<[Step; 3]> {
    steps(&[-1.0, 0.0, 1.0, 2.0, 3.0, 4.0].map(place))
}

fn way_m(place: impl Fn(f64) -> f64) -> Option<[f32; 3]> {
    told(|t| DAffine3::from_translation(DVec3::X * place(t))).map(|steps| steps.map(|step| step.way_world.x))
}

#[test]
fn steps_are_told_of_what_moves_starts_or_stops_but_not_of_jumps() {
    let round = |t: f64| DAffine3::from_rotation_y(t) * DAffine3::from_translation(DVec3::X * 2.0);
    for (at, step) in told(round).expect("no stretch").into_iter().enumerate() {
        let way = round(at as f64 + 1.0).translation - round(at as f64).translation;
        assert!((step.way_world.as_dvec3() - way).length() < 1e-6);
        assert!((step.turn_world.as_dvec3() - DVec3::Y).length() < 1e-6);
    }
    assert_eq!(way_m(|t| t.min(0.25)), Some([0.25, 0.0, 0.0]), "it stops");
    assert_eq!(way_m(|t| (t - 1.5).max(0.0)), Some([0.0, 0.5, 1.0]), "it starts");
    assert_eq!(way_m(|_| 7.0), Some([0.0; 3]), "it stands");
    // A clip that begins again in one of the steps, the others of which go on.
    assert_eq!(way_m(|t| if t < 0.5 { 20.0 + t } else { t }), Some([0.0, 1.0, 1.0]));
    assert_eq!(way_m(|t| if t < 1.5 { 20.0 + t } else { t }), Some([1.0, 0.0, 1.0]));
    let turns = |t: f64| DAffine3::from_rotation_z(if t < 0.5 { 2.0 + 0.1 * t } else { 0.1 * t });
    let [first, second, _] = told(turns).expect("no stretch");
    assert_eq!(first, Step::default());
    assert!((second.turn_world.z - 0.1).abs() < 1e-6);

    // Rounding is neither a step nor a jump, and a way beyond f32 none that can be told.
    let tilted =
        DAffine3::from_rotation_x(0.7) * DAffine3::from_rotation_y(0.3) * DAffine3::from_scale(DVec3::splat(0.37));
    assert_eq!(told(|_| tilted), Some([Step::default(); 3]));
    let trembling = |t: f64| {
        let rounding = if t >= 1.0 { 1e-10 } else { 0.0 };
        DAffine3::from_translation(DVec3::X * rounding) * DAffine3::from_rotation_z(0.1 * t)
    };
    let turns = told(trembling).expect("no stretch").map(|step| step.turn_world.z);
    assert!(turns.iter().all(|turn| (turn - 0.1).abs() < 1e-6), "{turns:?}");
    assert_eq!(way_m(|t| t * 1e39), Some([0.0; 3]));

    assert_eq!(told(|t| DAffine3::from_scale(DVec3::new(9.0 + t, 1.0, 1.0))), None);
}
