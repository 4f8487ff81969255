//! Which sample is seen: the pass on the processor against the one on the GPU.

mod common;

use std::collections::BTreeMap;

use camera::Pinhole;
use common::{Shape, ball, capture, view};
use glam::{DAffine3, DVec3};
use gpu::Gpu;
use protocol::held::HeldPatch;
use protocol::image::octahedral_normal;
use protocol::{Material, ObjectPose, PatchId};
use vantage_surface::{AddressPass, AddressTexel, AddressView, HeldSurfaces};

const ROOM: [Shape; 3] = [
    Shape::Plane { point: DVec3::ZERO, normal: DVec3::Y },
    Shape::Plane { point: DVec3::new(0.0, 0.0, -6.0), normal: DVec3::Z },
    Shape::Sphere { centre: DVec3::new(0.3, 1.2, -3.0), radius: 0.8 },
];
const EYE: DVec3 = DVec3::new(0.0, 1.7, 0.0);
const TARGET: DVec3 = DVec3::new(0.2, 0.8, -3.0);

/// Two patches of a room: one whole, whose sphere moves; one with trimmed samples and without every seventh.
fn patches() -> [HeldPatch; 2] {
    let mut first = capture(&ROOM, &view(EYE, TARGET, 96, 70.0));
    first.patch.objects = vec![ObjectPose { object: 3, world_from_object: DAffine3::IDENTITY }];
    let mut second = capture(&ROOM, &view(EYE + DVec3::X, TARGET, 64, 50.0));
    second.patch.id = PatchId(2);
    second.trims = (0..second.patch.image.sample_count()).map(|sample| (sample % 5 / 3) as u8).collect();
    [first, second]
}

fn fill(mut surfaces: HeldSurfaces) -> HeldSurfaces {
    let patches = patches();
    patches.iter().for_each(|patch| surfaces.insert(patch));
    let every_seventh = patches[1].patch.image.mask.occupied().step_by(7).map(|(x, y)| (x as u16, y as u16));
    surfaces.delete(PatchId(2), &every_seventh.collect::<Vec<_>>());
    surfaces
        .set_poses(&BTreeMap::from([(3, DAffine3::from_rotation_y(0.1) * DAffine3::from_translation(DVec3::Y * 0.2))]));
    surfaces
}

fn are_close(a: &AddressTexel, b: &AddressTexel) -> bool {
    (a.w() - b.w()).abs() <= 1e-3 * a.w().max(b.w())
}

/// Pixels of which the two show different samples at different depths, and of which one alone shows any. Where both patches hold
/// one surface, either may be in front.
fn differ(a: &AddressView, b: &AddressView) -> (usize, usize) {
    let pairs = || a.texels.iter().zip(&b.texels);
    let differ = pairs().filter(|(a, b)| a.address() != b.address() && !are_close(a, b)).count();
    (differ, pairs().filter(|(a, b)| a.address().is_some() != b.address().is_some()).count())
}

#[test]
fn the_processor_sees_what_the_gpu_sees() {
    let gpu = Gpu::block_on(Gpu::new_headless()).expect("an adapter");
    let (mut on_gpu, mut on_host) = (AddressPass::on_gpu(&gpu).expect("the shaders compile"), AddressPass::on_host());
    let (gpu_surfaces, host_surfaces) = (fill(on_gpu.new_surfaces()), fill(on_host.new_surfaces()));
    // Beside the captures; right above the floor, where quads cross the near plane; from far away, where they are tiny; backwards.
    let near = Pinhole { near_m: 0.01, ..view(DVec3::new(0.1, 0.03, -2.0), TARGET, 96, 90.0) };
    let beside = ball(6).into_iter().map(|offset| view(EYE + 0.4 * offset, TARGET, 96, 75.0));
    let others = [near, view(EYE * 9.0, TARGET, 64, 40.0), view(TARGET, EYE, 64, 90.0)];
    for camera in beside.chain(others) {
        let a = on_gpu.view(&gpu_surfaces, &camera).expect("a view");
        let b = on_host.view(&host_surfaces, &camera).expect("a view");
        let (differ, uncovered) = differ(&a, &b);
        let pixels = a.texels.len();
        // Where an edge runs through a pixel's centre, rounding decides.
        assert!(differ * 200 <= pixels && uncovered * 500 <= pixels, "{differ} and {uncovered} of {pixels} differ");
        let same = a.texels.iter().zip(&b.texels).filter(|(a, b)| a.address().is_some() && a.address() == b.address());
        for (a, b) in same {
            assert_eq!(a.object(), b.object());
            assert!(are_close(a, b), "{} and {}", a.w(), b.w());
            let normals = [a, b].map(|texel| octahedral_normal(texel.normal_code()));
            assert!(normals[0].dot(normals[1]) > 0.998, "{normals:?}");
        }
    }
}

#[test]
fn tiles_are_passed_over_only_where_nothing_of_them_is_seen() {
    let mut pass = AddressPass::on_host();
    let (mut in_tiles, mut whole) = (pass.new_surfaces(), pass.new_surfaces());
    for mut patch in patches() {
        patch.patch.objects.clear();
        in_tiles.insert(&patch);
        // What holds moving objects is never passed over. This one has no samples.
        patch.patch.objects = vec![ObjectPose { object: 99, world_from_object: DAffine3::IDENTITY }];
        whole.insert(&patch);
    }
    let near = Pinhole { near_m: 0.5, ..view(DVec3::new(0.1, 0.03, -2.0), TARGET, 96, 90.0) };
    let beside = ball(24).into_iter().map(|offset| view(EYE + offset, TARGET + 4.0 * offset, 96, 25.0));
    for camera in beside.chain([near, view(TARGET, EYE, 64, 90.0)]) {
        let seen = [&in_tiles, &whole].map(|surfaces| pass.view(surfaces, &camera).expect("a view"));
        assert_eq!(seen[0], seen[1]);
    }
}

#[test]
fn a_plane_has_no_gaps_on_the_processor_either() {
    let wall = &ROOM[1..2];
    let mut pass = AddressPass::on_host();
    let mut surfaces = pass.new_surfaces();
    surfaces.insert(&capture(wall, &view(EYE, DVec3::new(1.0, 1.0, -3.0), 96, 60.0)));
    for offset in ball(24) {
        let target = DVec3::new(1.0, 1.0, -3.0) + 0.2 * offset;
        for size_px in [16, 64, 256] {
            let seen = pass.view(&surfaces, &view(EYE + 0.2 * offset, target, size_px, 30.0)).expect("a view");
            assert!(seen.texels.iter().all(|texel| texel.address().is_some()), "gaps from {offset} at {size_px} px");
        }
    }
    let empty = pass.view(&pass.new_surfaces(), &view(EYE, TARGET, 16, 60.0)).expect("a view");
    assert_eq!(empty, AddressView::empty((16, 16)));
}

#[test]
fn one_sided_surfaces_are_not_seen_from_behind() {
    let gpu = Gpu::block_on(Gpu::new_headless()).expect("an adapter");
    let patch = capture(&ROOM[1..2], &view(EYE, DVec3::new(0.0, 1.0, -6.0), 64, 60.0));
    let code = usize::from(patch.patch.image.material[0]);
    let in_front = view(EYE, DVec3::new(0.0, 1.0, -6.0), 32, 40.0);
    let behind = view(DVec3::new(0.0, 1.0, -12.0), DVec3::new(0.0, 1.0, -6.0), 32, 40.0);
    // So near that quads reach behind the near plane.
    let right_behind =
        Pinhole { near_m: 0.1, ..view(DVec3::new(0.0, 1.0, -6.05), DVec3::new(1.0, 1.0, -6.0), 32, 90.0) };
    for mut pass in [AddressPass::on_gpu(&gpu).expect("the shaders compile"), AddressPass::on_host()] {
        let mut surfaces = pass.new_surfaces();
        surfaces.insert(&patch);
        for double_sided in [false, true] {
            let material = Material { double_sided, ..Material::default() };
            surfaces.set_materials(&vec![material; code + 1]);
            let mut covered = |camera: &Pinhole| {
                let seen = pass.view(&surfaces, camera).expect("a view");
                seen.texels.iter().filter(|texel| texel.address().is_some()).count()
            };
            assert_eq!(covered(&in_front), 32 * 32);
            assert_eq!(covered(&behind), if double_sided { 32 * 32 } else { 0 });
            assert_eq!(covered(&right_behind) > 0, double_sided);
        }
    }
}

/// By pixel: which of two patches of a floor shows. The first has an eighth of the other's pixels a side and lies nearer.
fn address_of_overlap(pass: &mut AddressPass, coarse_is_nearer_m: f64) -> Vec<u32> {
    let floor = |height_m: f64| Shape::Plane { point: DVec3::Y * height_m, normal: DVec3::Y };
    let (above, target) = (DVec3::new(0.0, 2.0, 0.0), DVec3::new(0.0, 0.0, -0.5));
    let coarse = capture(&[floor(coarse_is_nearer_m)], &view(above, target, 16, 90.0));
    let mut fine = capture(&[floor(0.0)], &view(above, target, 128, 90.0));
    fine.patch.id = PatchId(2);
    let mut surfaces = pass.new_surfaces();
    [coarse, fine].iter().for_each(|patch| surfaces.insert(patch));
    let seen = pass.view(&surfaces, &view(DVec3::new(0.3, 1.5, 0.2), target, 64, 50.0)).expect("a view");
    seen.texels.iter().map(|texel| texel.patch).collect()
}

#[test]
fn of_overlapping_samples_the_finer_shows_unless_it_lies_clearly_behind() {
    let gpu = Gpu::block_on(Gpu::new_headless()).expect("an adapter");
    for mut pass in [AddressPass::on_gpu(&gpu).expect("the shaders compile"), AddressPass::on_host()] {
        // A coarse pixel spans 0.25 m.
        let (near, far) = (address_of_overlap(&mut pass, 0.02), address_of_overlap(&mut pass, 0.3));
        assert!(near.iter().all(|&patch| patch == 2), "the finer is 2 cm behind: {near:?}");
        assert!(far.iter().all(|&patch| patch == 1), "what lies 30 cm behind stays hidden: {far:?}");
    }
}
