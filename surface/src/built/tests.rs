//! Surfaces that were built beside the drawing, against those that are built in place.

use camera::{Camera, Rigid};
use proptest::prelude::*;
use protocol::held::HeldPatch;
use protocol::{DepthImage, DepthScale, Held, Mask, ObjectPose};

use super::source::Content;
use super::*;
use crate::held::HeldSurfaces;

const SIDE_PX: u32 = 40;
const BUILD: Build = Build { corners: Corners::Averaged, provoking: ProvokingVertex::First };
/// What no mesh of so few samples has: it tells who built a surface.
const MARK: u32 = 1_000_000;

/// Two objects, one of which moves or not, before each other, with holes.
fn patch(bits: &[u64], purpose: Purpose, moves: bool) -> Patch {
    let camera = Pinhole::symmetric(Rigid::IDENTITY, (SIDE_PX, SIDE_PX), 1.0, 0.1);
    let mut mask = Mask::empty(SIDE_PX, SIDE_PX);
    let pixels = (0..SIDE_PX * SIDE_PX).map(|at| (at % SIDE_PX, at / SIDE_PX));
    // Most pixels are occupied, so that there are levels.
    pixels.filter(|(x, y)| bits[*y as usize] >> x & 1 == 0 || x % 16 < 8).for_each(|(x, y)| mask.set(x, y, true));
    let of_samples = |value: fn(u32, u32) -> u32| mask.occupied().map(|(x, y)| value(x, y)).collect::<Vec<u32>>();
    let objects = of_samples(|x, y| 1 + u32::from(x + y > 50));
    let image = DepthImage {
        camera: Camera::Pinhole(camera),
        depth_scale: DepthScale { w_min: 0.1, w_step: 0.001 },
        depth: objects.iter().map(|object| (object * 100) as u16).collect(),
        normal: vec![[128, 128]; objects.len()],
        normal_rest: Vec::new(),
        ends: Vec::new(),
        colour: of_samples(|x, y| x * 6 + y).into_iter().map(|shade| [shade as u8, 7, 9]).collect(),
        colour_rest: Vec::new(),
        object: objects.iter().map(|&object| object as u16).collect(),
        material: of_samples(|_, y| y / 3 * 20).into_iter().map(|code| code as u8).collect(),
        share: Vec::new(),
        mask,
    };
    let pose = ObjectPose { object: 2, world_from_object: glam::DAffine3::IDENTITY };
    Patch { id: PatchId(1), purpose, capture_time_s: 0.0, objects: if moves { vec![pose] } else { Vec::new() }, image }
}

fn any_patch() -> impl Strategy<Value = Patch> {
    let purposes = [Purpose::Eye, Purpose::Light(1), Purpose::Occluders, Purpose::Layer(2)];
    let bits = proptest::collection::vec(any::<u64>(), SIDE_PX as usize);
    (bits, 0..purposes.len(), any::<bool>()).prop_map(move |(bits, at, moves)| patch(&bits, purposes[at], moves))
}

fn simple() -> Patch {
    patch(&[0; SIDE_PX as usize], Purpose::Eye, false)
}

fn held(patch: &Patch) -> HeldPatch {
    HeldPatch { patch: patch.clone(), trims: Vec::new() }
}

fn gpu() -> Gpu {
    Gpu::block_on(Gpu::new_headless()).expect("an adapter")
}

/// What a store that draws a purpose builds in place.
fn in_place(surfaces: &HeldSurfaces, patch: &Patch) -> Built {
    Built::of(patch, surfaces.mesh(&held(patch)), surfaces.build(), patch.purpose == Purpose::Eye)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, ..ProptestConfig::default() })]

    #[test]
    fn what_is_built_beside_is_what_is_built_in_place(patch in any_patch()) {
        let gpu = gpu();
        let surfaces = match patch.purpose {
            Purpose::Eye => HeldSurfaces::new(&gpu),
            purpose => HeldSurfaces::new(&gpu).of(purpose),
        };
        let beside = surfaces.build().surface(&patch);
        prop_assert!(beside.is_of(&patch, surfaces.build()) && !beside.is_empty());
        prop_assert_eq!(beside.to_bytes(), in_place(&surfaces, &patch).to_bytes());
    }

    #[test]
    fn bytes_give_the_surface_again_or_an_error(patch in any_patch(), cut in 0.0..1.0) {
        let built = BUILD.surface(&patch);
        let bytes = built.to_bytes();
        let again = Built::from_bytes(Box::new(bytes.clone())).expect("whole");
        prop_assert_eq!((again.build, again.head), (built.build, built.head));
        prop_assert_eq!(again.parts.tables(), built.parts.tables());
        prop_assert_eq!(again.to_bytes(), bytes.clone());
        let cut = (bytes.len() as f64 * cut) as usize;
        prop_assert!(Built::from_bytes(Box::new(bytes[..cut].to_vec())).is_err());
        prop_assert!(Built::from_bytes(Box::new([bytes, vec![0; 4]].concat())).is_err());
    }
}

#[test]
fn every_pixel_finds_its_own_quad() {
    let patch = patch(&[0x5a5a_a5a5_0ff0_9669; SIDE_PX as usize], Purpose::Eye, false);
    let (mask, mut built) = (&patch.image.mask, BUILD.surface(&patch));
    let Source::Mesh(mesh) = &built.source else { panic!("built here") };
    for (x, y) in mask.occupied() {
        let places = built.parts.delete(mask, &[(x as u16, y as u16)]);
        let quad = &mesh.indices[places[0] as usize * QUAD_INDICES..][..QUAD_INDICES];
        let first = BUILD.provoking.corners(quad)[0];
        assert_eq!((places.len(), mesh.vertices[first as usize].pixel), (1, x | y << 16));
    }
    let (x, y) = (0..SIDE_PX).find_map(|x| (!mask.get(x, 0)).then_some((x, 0))).expect("a hole");
    assert!(built.parts.delete(mask, &[(x as u16, y as u16)]).is_empty());
}

#[test]
fn bytes_that_lie_never_panic() {
    let bytes = BUILD.surface(&simple()).to_bytes();
    let head = size_of::<Head>() + 6 * size_of::<u32>();
    for at in 0..head + 400 {
        for value in [0, 1, 0xff] {
            let mut damaged = bytes.clone();
            damaged[at] = value;
            // A float may be any; counts and ranges must fit.
            let _ = Built::from_bytes(Box::new(damaged));
        }
    }
    let mut huge = bytes;
    huge[size_of::<Head>() + 4..head].fill(0xff);
    assert_eq!(Built::from_bytes(Box::new(huge)).err(), Some(DamagedSurface));
    assert_eq!(Built::from_bytes(Box::new(Vec::new())).err(), Some(DamagedSurface));
}

#[test]
fn codes_of_builds_are_their_own() {
    let builds: Vec<Build> = (0..=u8::MAX).filter_map(Build::from_code).collect();
    assert_eq!(builds.len(), 6);
    assert!(builds.iter().all(|build| Build::from_code(build.code()) == Some(*build) && build.code() != 0));
}

/// Whether a store takes a marked surface that was built by `build` of the patch that these edits add.
fn takes(mut surfaces: HeldSurfaces, build: Build, edits: Vec<Edit>) -> bool {
    let mut held = Held::default();
    let update = held.commit(edits, 0.0, 0).expect("sound edits");
    let marked = build.surfaces(&update).map(|mut built| {
        built.head.guarded = MARK;
        built
    });
    surfaces.apply_built(&held, &update, &mut marked.collect());
    assert!(surfaces.stats().samples > 0);
    surfaces.stats().guarded == MARK as usize
}

#[test]
fn what_does_not_match_is_built_in_place() {
    let gpu = gpu();
    let surfaces = || HeldSurfaces::new(&gpu);
    let (build, add) = (surfaces().build(), || Edit::Add(Box::new(simple())));
    assert!(takes(surfaces(), build, vec![add()]));
    let provoking = ProvokingVertex::Last;
    assert!(!takes(surfaces(), Build { provoking, ..build }, vec![add()]), "flat values come from another vertex");
    assert!(!takes(surfaces(), Build { corners: Corners::OwnPlane, ..build }, vec![add()]));
    let all: Vec<_> = simple().image.mask.occupied().map(|(x, y)| (x as u16, y as u16, 1)).collect();
    assert!(takes(surfaces(), build, vec![add(), Edit::Trim(PatchId(1), all[..9].to_vec())]));
    assert!(!takes(surfaces(), build, vec![add(), Edit::Trim(PatchId(1), all)]), "nothing is left as it was");
    assert!(!takes(surfaces().at_finest_level(), build, vec![add()]), "it has coarser levels");
    let rules = CornerRules { normal_cos: 0.9, ..CornerRules::default() };
    assert!(!takes(HeldSurfaces::with_corners(&gpu, build.corners, rules), build, vec![add()]));
    assert!(!takes(HeldSurfaces::on_host(), build, vec![add()]));
}

#[test]
fn pieces_are_uploaded_until_all_are_there_and_anew_where_the_device_was_lost() {
    let mut built = BUILD.surface(&simple());
    let bytes = [Content::Vertices, Content::Indices].map(|content| built.source.size(content));
    let mut most_bytes = bytes[0] + 4;
    let lost = gpu();
    assert!(!built.upload(&lost, &mut most_bytes) && most_bytes == 0);
    let mut all: BuiltSurfaces = [built].into_iter().collect();
    all.forget_uploads();
    let gpu = gpu();
    assert!(all.upload(&gpu) && all.upload(&gpu));
    let (_, buffers) = all.take(PatchId(1)).expect("built").into_buffers(&gpu);
    assert_eq!(buffers.map(|buffer| buffer.size()), bytes.map(|bytes| bytes as u64));
}
