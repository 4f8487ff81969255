//! The redundancy tests' twin on the CPU against projections in f64, on a scene of two plates whose every hit is known: what is called redundant
//! is held by an earlier image where it says, and what is held there is called redundant.

use camera::{ImagePoint, Pinhole, Rigid};
use glam::{DQuat, DVec3};
use proptest::prelude::*;
use protocol::image::octahedral_code;
use vantage_server::discretize::redundancy::redundant_samples;
use vantage_server::discretize::{Capture, Redundancy, RedundancyTest};

/// Half of the sides, and where along z: a small plate before a wall. Its place is its object.
const PLATES: [([f64; 2], f64); 2] = [([0.8, 0.6], -3.0), ([9.0, 9.0], -6.0)];
/// Triangles' legs.
const CELL_M: f64 = 0.4;
const SIDE_PX: u32 = 24;
const NEAR_M: f64 = 0.05;
/// Nearer to a border between pixels than this, f32 may decide otherwise.
const UNSURE_PX: f64 = 1e-3;

/// Of a pixel's ray: where it meets the nearest plate, which, and which of its triangles.
fn hit(camera: &Pinhole, u: f64, v: f64) -> Option<(DVec3, u16, u32)> {
    let pose = &camera.world_from_eye;
    let (eye, ray) = (pose.translation, pose.transform_vector(camera.ray_eye_from_image(u, v)));
    (0..2).find_map(|object| {
        let ([half_x, half_y], z) = PLATES[usize::from(object)];
        let t = (z - eye.z) / ray.z;
        let p = eye + ray * t;
        let is_hit = t > NEAR_M && p.x.abs() < half_x && p.y.abs() < half_y;
        let (x, y) = ((p.x + half_x) / CELL_M, (p.y + half_y) / CELL_M);
        let half = u32::from(x.fract() + y.fract() > 1.0);
        is_hit.then_some((p, object, 1 + (u32::from(object) << 16) + ((x as u32) << 8 | (y as u32) << 1 | half)))
    })
}

fn capture(camera: Pinhole) -> Capture {
    let pixels = (0..SIDE_PX).flat_map(|y| (0..SIDE_PX).map(move |x| (f64::from(x) + 0.5, f64::from(y) + 0.5)));
    let hits: Vec<_> = pixels.map(|(u, v)| hit(&camera, u, v)).collect();
    let [x, y] = octahedral_code(glam::Vec3::Z);
    let ids = |object: u16| u32::from(object) | u32::from(x) << 16 | u32::from(y) << 24;
    let w = |p: DVec3| camera.image_from_world(p).map_or(0.0, |point| point.w);
    Capture {
        camera,
        ids: hits.iter().map(|hit| hit.map_or([0; 2], |(_, object, triangle)| [triangle, ids(object)])).collect(),
        colour: vec![[9; 4]; hits.len()],
        rests: vec![[0; 2]; hits.len()],
        hides: Vec::new(),
        depth: hits.iter().map(|hit| hit.map_or(0.0, |(p, ..)| (NEAR_M * w(p)) as f32)).collect(),
        ends: Vec::new(),
        gpu_s: None,
    }
}

/// Whether an image holds a point at the pixels that a test asks; `None` where rounding may decide.
fn holds(image: &Capture, test: RedundancyTest, (p, object, triangle): (DVec3, u16, u32)) -> Option<bool> {
    let Some(ImagePoint { u, v, .. }) = image.camera.image_from_world(p) else { return Some(false) };
    let is_unsure = |number: f64| (number - number.round()).abs() < UNSURE_PX;
    let four = matches!(test, RedundancyTest::Covered | RedundancyTest::CoveredTriangle);
    let [from_u, from_v] = [u, v].map(|number| if four { number - 0.5 } else { number });
    let side = f64::from(SIDE_PX);
    // In the image or not is decided where the pixel is.
    if [u, v].into_iter().any(|number| is_unsure(number) && (number < 1.0 || number > side - 1.0))
        || is_unsure(from_u)
        || is_unsure(from_v)
    {
        return None;
    }
    if u < 0.0 || v < 0.0 || u >= side || v >= side {
        return Some(false);
    }
    let by_surface = matches!(test, RedundancyTest::Surface | RedundancyTest::Nearby | RedundancyTest::Covered);
    let has = |x: i64, y: i64| {
        let index = (y * i64::from(SIDE_PX) + x) as usize;
        let there = image.ids[index][0];
        // Plates are planes: whose object is the same lies on the same plane.
        there == triangle || by_surface && there != 0 && image.object(index) == object
    };
    let last = i64::from(SIDE_PX) - 1;
    let (x, y) = (from_u.floor() as i64, from_v.floor() as i64);
    Some(match test {
        RedundancyTest::Neighbourhood | RedundancyTest::Nearby => {
            let inside = |place: i64| (0..=last).contains(&place);
            (-1..=1).any(|down| (-1..=1).any(|right| inside(x + right) && inside(y + down) && has(x + right, y + down)))
        }
        _ if four => (0..2).all(|down| (0..2).all(|right| has((x + right).clamp(0, last), (y + down).clamp(0, last)))),
        _ => has(x, y),
    })
}

fn view() -> impl Strategy<Value = Pinhole> {
    let side = || -1.5..1.5_f64;
    (side(), side(), -1.0..1.0_f64, -0.4..0.4_f64, 0.5..1.4_f64).prop_map(|(x, y, z, turn, fov)| {
        let pose = Rigid::look_along(DVec3::new(x, y, z), DQuat::from_rotation_y(turn) * DVec3::NEG_Z);
        Pinhole::symmetric(pose, (SIDE_PX, SIDE_PX), fov, NEAR_M)
    })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 128, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn what_is_redundant_is_held_and_what_is_held_is_redundant(
        this in view(),
        earlier in prop::collection::vec(view(), 1..4),
    ) {
        let (this, earlier) = (capture(this), earlier.into_iter().map(capture).collect::<Vec<_>>());
        for test in RedundancyTest::ALL.into_iter().filter(|test| !test.needs_rays()) {
            let said = redundant_samples(&this, &earlier, Redundancy::by(test), DVec3::ZERO, None);
            let pixels = (0..this.ids.len()).filter(|&index| this.ids[index][0] != 0);
            prop_assert_eq!(pixels.clone().count(), said.len());
            for (index, said) in pixels.zip(said) {
                let (x, y) = (index as u32 % SIDE_PX, index as u32 / SIDE_PX);
                let sample = hit(&this.camera, f64::from(x) + 0.5, f64::from(y) + 0.5);
                let held: Vec<_> = earlier.iter().map(|image| holds(image, test, sample.expect("it has an id"))).collect();
                if held.contains(&None) {
                    continue;
                }
                prop_assert_eq!(said, held.contains(&Some(true)), "{:?} at {}, {}", test, x, y);
            }
        }
    }
}
