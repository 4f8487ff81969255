//! What holds for the corners of any samples: who shares a corner is one surface and has one place, and a plane comes back as it was.

use camera::{Pinhole, Rigid};
use glam::{DVec3, Vec3};
use proptest::prelude::*;
use protocol::held::HeldPatch;
use protocol::image::{octahedral_code, octahedral_rest};
use protocol::{DepthImage, DepthScale, Mask, Patch, PatchId, Purpose};
use vantage_surface::corners::{Corner, Plane, averaged, own_plane, planes};
use vantage_surface::{CornerRules, Corners, ProvokingVertex, mesh};

/// A sample around a corner, near to the others often enough to be one surface with them.
fn plane() -> impl Strategy<Value = Plane> {
    let w = prop_oneof![Just(1.0_f32), 0.95..1.05_f32, 1e-6..1e3_f32];
    let slope = prop_oneof![Just(0.0_f32), -0.1..0.1_f32, -1e3..1e3_f32];
    let normal = prop_oneof![3 => Just(Vec3::NEG_Z), 1 => Just(Vec3::X), 1 => Just(Vec3::Z)];
    (w, [slope.clone(), slope], normal, 0_u16..2, prop_oneof![2 => Just(0), 1 => any::<u16>()], 0.0..0.5_f32).prop_map(
        |(w, slope, normal, object, ends, tolerance)| Plane {
            w,
            slope,
            end_rise: 0.05 * w,
            tolerance: tolerance * w,
            // A side has three bits of four.
            ends: ends & 0x7777,
            normal,
            object,
        },
    )
}

fn around() -> impl Strategy<Value = [Option<Plane>; 4]> {
    let one = || prop_oneof![1 => Just(None), 4 => plane().prop_map(Some)];
    [one(), one(), one(), one()]
}

fn rules() -> impl Strategy<Value = CornerRules> {
    prop_oneof![Just(CornerRules::of(Purpose::Eye)), Just(CornerRules::of(Purpose::Light(0)))]
}

fn corner_of(around: &[Option<Plane>; 4], rules: &CornerRules) -> Corner {
    averaged([0, 1, 2, 3].map(|index| around[index].as_ref()), rules)
}

/// Mirrored: left and right change places.
fn mirrored(around: &[Option<Plane>; 4]) -> [Option<Plane>; 4] {
    let mirror = |plane: &Plane| Plane { slope: [-plane.slope[0], plane.slope[1]], ..*plane };
    [1, 0, 3, 2].map(|index: usize| around[index].as_ref().map(mirror))
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 4096, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn who_shares_a_corner_is_one_surface_and_has_one_place(around in around(), rules in rules()) {
        let corner = corner_of(&around, &rules);
        let own = own_plane([0, 1, 2, 3].map(|index| around[index].as_ref()), &rules);
        for index in (0..4).filter(|&index| around[index].is_some()) {
            let group = usize::from(corner.group[index]);
            prop_assert!(group <= index && usize::from(corner.group[group]) == group, "{:?}", corner.group);
            prop_assert_eq!(around[group].map(|plane| plane.object), around[index].map(|plane| plane.object));
            let place = |of: usize| (corner.w[of], corner.shift_px[of], corner.ends[of]);
            prop_assert_eq!(place(index), place(group));
            // A quad keeps its pixel's middle: it never turns over.
            prop_assert!(corner.shift_px[index].iter().all(|shift| shift.abs() < 0.5), "{:?}", corner.shift_px);
            prop_assert!(corner.w[index] > 0.0 && corner.w[index].is_finite(), "{:?}", corner.w);
            // Each stays within twice of its own sample, so the mean of some does within those of all.
            let ratio = own.w[index] / around[index].map_or(1.0, |plane| plane.w);
            prop_assert!((0.4999..2.0001).contains(&ratio), "{ratio}");
        }
        for index in (0..4).filter(|&index| around[index].is_none()) {
            prop_assert_eq!(usize::from(corner.group[index]), index);
        }
    }

    /// Where no sample keeps the corner near to itself, and none says where it ends: there the first of a surface decides for all, and of two ways
    /// to go on that are as long the first.
    #[test]
    fn a_mirrored_corner_is_the_mirror_of_the_corner(around in around(), rules in rules()) {
        let tame = |plane: Plane| Plane {
            slope: plane.slope.map(|slope| slope.clamp(-0.2, 0.2) * plane.w),
            tolerance: 0.1,
            end_rise: f32::INFINITY,
            ends: 0,
            ..plane
        };
        let around = around.map(|plane| plane.map(tame));
        let (corner, mirror) = (corner_of(&around, &rules), corner_of(&mirrored(&around), &rules));
        for (index, other) in [(0, 1), (1, 0), (2, 3), (3, 2)] {
            if around[index].is_none() {
                continue;
            }
            let slack = 1e-4 * corner.w[index];
            prop_assert!((corner.w[index] - mirror.w[other]).abs() <= slack, "{:?} and {:?}", corner.w, mirror.w);
            let [shift, mirror_shift] = [corner.shift_px[index], mirror.shift_px[other]];
            let off = [shift[0] + mirror_shift[0], shift[1] - mirror_shift[1]];
            prop_assert!(off.iter().all(|off| off.abs() < 1e-4), "{shift:?} and {mirror_shift:?}");
            prop_assert_eq!(corner.ends[index], mirror.ends[other]);
        }
    }
}

/// A plane in space, as a camera sees it: inverse depth is linear in its image.
fn seen(camera: &Pinhole, normal: DVec3, distance_m: f64, u: f64, v: f64) -> f64 {
    let ray = camera.ray_eye_from_image(u, v);
    normal.dot(ray) / (normal.dot(DVec3::Z) * distance_m)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 256, failure_persistence: None, ..ProptestConfig::default() })]

    /// However it is turned, as long as it is not seen edge-on: corners lie on it, by less than a coded normal is off, and all samples share them.
    #[test]
    fn a_plane_comes_back_as_a_plane(
        lean in (-1.0..1.0_f64, -1.0..1.0_f64),
        distance_m in 0.1..1e4_f64,
        fov in 0.2..1.5_f64,
        exact in any::<bool>(),
    ) {
        let side_px = 8;
        let camera = Pinhole::symmetric(Rigid::IDENTITY, (side_px, side_px), fov, 1e-3);
        let normal = DVec3::new(lean.0, lean.1, -2.5).normalize();
        let mut mask = Mask::empty(side_px, side_px);
        let pixels: Vec<(u32, u32)> = (0..side_px).flat_map(|y| (0..side_px).map(move |x| (x, y))).collect();
        pixels.iter().for_each(|&(x, y)| mask.set(x, y, true));
        let seen_at = |u: f64, v: f64| seen(&camera, normal, distance_m, u, v);
        let w_of = |&(x, y): &(u32, u32)| seen_at(f64::from(x) + 0.5, f64::from(y) + 0.5) as f32;
        let w: Vec<f32> = pixels.iter().map(w_of).collect();
        let (least, most) = w.iter().fold((f32::INFINITY, 0.0_f32), |(least, most), &w| (least.min(w), most.max(w)));
        prop_assume!(least > 0.0);
        let depth_scale = DepthScale { w_min: least, w_step: (most - least) / 65535.0 };
        let image = DepthImage {
            camera: camera::Camera::Pinhole(camera),
            depth_scale,
            depth: w.iter().map(|&w| depth_scale.code(w)).collect(),
            normal: vec![octahedral_code(normal.as_vec3()); w.len()],
            normal_rest: vec![octahedral_rest(normal.as_vec3()); w.len()],
            ends: Vec::new(),
            colour: vec![[9; 3]; w.len()],
            colour_rest: Vec::new(),
            object: vec![4; w.len()],
            material: vec![0; w.len()],
            share: Vec::new(),
            mask,
        };
        let rules = CornerRules::default();
        let (planes, guarded) = planes(&image, &camera, &rules, exact.then_some(&w[..]));
        prop_assert_eq!(guarded, 0);
        for y in 0..=side_px {
            for x in 0..=side_px {
                let at = |right: u32, down: u32| {
                    let (x, y) = (x.checked_sub(right)?, y.checked_sub(down)?);
                    (x < side_px && y < side_px).then(|| &planes[(y * side_px + x) as usize])
                };
                let around = [at(1, 1), at(0, 1), at(1, 0), at(0, 0)];
                let corner = averaged(around, &rules);
                let first = around.iter().position(Option::is_some).unwrap_or_default();
                let is_first = |index: usize| around[index].is_none() || usize::from(corner.group[index]) == first;
                prop_assert!((0..4).all(is_first), "one surface");
                let wanted = seen_at(x.into(), y.into());
                // What neighbours predict from either side of a corner cancels. At a border it is off by what the coded normal is, half a pixel away.
                let off = (f64::from(corner.w[first]) / wanted - 1.0).abs();
                let ray = camera.ray_eye_from_image(x.into(), y.into());
                let cos_squared = (normal.dot(ray) / ray.length()).powi(2);
                let coded = 0.7 * f64::from(rules.normal_error_rad) / 8.0 / cos_squared / camera.focal_px;
                let most = if around.iter().all(Option::is_some) { 1e-4 } else { 2.0 * coded + 1e-4 };
                prop_assert!(off < most, "{off:e} at {x}, {y}");
            }
        }
        let (purpose, objects) = (Purpose::Eye, Vec::new());
        let patch = Patch { id: PatchId(1), purpose, capture_time_s: 0.0, objects, image };
        let options = mesh::MeshOptions {
            corners: Corners::default(),
            rules,
            provoking: ProvokingVertex::First,
            exact_w: None,
            offset_image: None,
        };
        let built = mesh::build(&HeldPatch { patch, trims: Vec::new() }, &options);
        // Watertight: a vertex a corner, six indices a sample.
        prop_assert_eq!((built.vertices.len(), built.indices.len()), (81, 64 * 6));
    }
}
