//! The codec gives back what went in, is small, and takes any bytes without a panic.

#![allow(clippy::unwrap_used, reason = "a test that unwraps fails, as it should")]

mod common;

use std::sync::Arc;

use camera::{Camera, GraphCamera, Pinhole, Rigid, Spoc, split_behind};
use common::{MIRROR, cast, cast_with_mirror, fragments, patch, with_ends};
use glam::{DAffine3, DVec2, DVec3};
use proptest::prelude::*;
use vantage_protocol::codec::{CodecError, Coding, ColourSteps, Profile, decode_patch, encode_patch};
use vantage_protocol::ends::{self, Beside, Besides, SIDES, with_level};
use vantage_protocol::plain::{read_update, write_update};
use vantage_protocol::{
    DepthImage, DepthScale, Edit, Limits, Mask, NextSteps, ObjectPose, Patch, PatchId, Purpose, Update,
};

/// The bytes of the fast profile; both profiles and all steps of colour are tried.
fn round_trip(patch: &Patch) -> Vec<u8> {
    for profile in [Profile::Fast, Profile::Dense] {
        for colour in ColourSteps::ALL {
            let mut patch = patch.clone();
            colour.settle_all(&mut patch.image.colour);
            let bytes = encode_patch(&patch, Coding { profile, colour });
            assert!(decode_patch(&bytes, &Limits::default()).unwrap() == patch, "{profile:?} {colour:?}");
        }
    }
    encode_patch(patch, Coding::default())
}

#[test]
fn conventional_and_fragmented_images_come_back() {
    let whole = patch(3, cast((320, 200), |_, _| true));
    let bytes = round_trip(&whole);
    let raw_bytes = whole.image.raw_bytes();
    assert!(bytes.len() * 8 < raw_bytes, "{} bytes of {raw_bytes} raw", bytes.len());
    let part = patch(4, cast((320, 200), fragments));
    let bytes = round_trip(&part);
    let raw_bytes = part.image.raw_bytes();
    assert!(bytes.len() * 2 < raw_bytes, "{} bytes of {raw_bytes} raw", bytes.len());
}

#[test]
fn what_normals_of_mirrors_leave_off_comes_back_for_less_than_a_byte() {
    for keep in [|_, _| true, fragments] {
        let mirror = cast_with_mirror((640, 400), keep);
        let samples = mirror.object.iter().filter(|&&object| object == MIRROR).count();
        let none = DepthImage { normal_rest: Vec::new(), ..mirror.clone() };
        let bytes = round_trip(&patch(1, mirror)).len() - round_trip(&patch(1, none)).len();
        eprintln!("{bytes} bytes for {samples} samples");
        assert!(samples > 1500 && bytes * 20 < samples * 17, "{bytes} bytes for {samples} samples");
    }
}

#[test]
fn where_surfaces_end_comes_back_for_a_few_bits_at_a_side() {
    for (keep, most_bits) in [((|_, _| true) as fn(u32, u32) -> bool, 2.0), (fragments, 5.0)] {
        let image = with_ends(cast_with_mirror((640, 400), keep));
        let sides = image.ends.iter().flat_map(|&ends| (0..4).map(move |side| ends::level(ends, side)));
        let ending = sides.filter(|&level| level > 0).count();
        let none = DepthImage { ends: Vec::new(), ..image.clone() };
        let bytes = round_trip(&patch(1, image)).len() - round_trip(&patch(1, none)).len();
        let bits = 8.0 * bytes as f64 / ending as f64;
        eprintln!("{bytes} bytes for {ending} sides: {bits:.2} bits");
        assert!(ending > 500 && bits < most_bits, "{bytes} bytes for {ending} sides");
    }
}

#[test]
fn what_colours_leave_off_comes_back_and_costs_nothing_where_they_are_plain() {
    let mut plain = cast((640, 400), |_, _| true);
    plain.colour = plain.object.iter().map(|&object| [object as u8, 40, 90]).collect();
    // By the colour, as rounding leaves it off; and as noise.
    let of_colour = |[r, g, b]: [u8; 3]| (r ^ g ^ b) & 63;
    let rounded: Vec<u8> = plain.colour.iter().map(|&colour| of_colour(colour)).collect();
    let noise: Vec<u8> = (0..plain.sample_count())
        .map(|index| ((index as u64 + 1).pow(2).wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 58) as u8)
        .collect();
    for (rest, is_noise) in [(rounded, false), (noise, true)] {
        let image = DepthImage { colour_rest: rest, ..plain.clone() };
        let bytes = round_trip(&patch(1, image)).len() - round_trip(&patch(1, plain.clone())).len();
        let bits = 8.0 * bytes as f64 / plain.sample_count() as f64;
        eprintln!("{bits:.3} bits a sample");
        assert!(if is_noise { (5.9..6.2).contains(&bits) } else { bits < 0.1 }, "{bits}");
    }
}

#[test]
fn an_image_none_of_whose_surfaces_ends_pays_nothing_for_it() {
    let whole = cast((640, 400), |_, y| y > 300);
    let mut settled = whole.clone();
    settled.settle_ends(vec![0; whole.sample_count()]);
    assert_eq!(settled, whole);
}

#[test]
fn ends_that_the_image_itself_contradicts_are_dropped_and_come_back_where_they_are_kept() {
    let mut image = cast((640, 400), |_, _| true);
    let claims = vec![0x1234; image.sample_count()];
    let claiming = DepthImage { ends: claims.clone(), ..image.clone() };
    round_trip(&patch(1, claiming));
    image.settle_ends(claims);
    let besides = Besides::of(&image);
    let (mut ending, mut going_on) = (0, 0);
    for rank in 0..image.sample_count() {
        for side in 0..SIDES.len() {
            let goes_on = besides.at(rank, side) == Beside::GoesOn;
            assert_eq!(ends::level(image.ends[rank], side), if goes_on { 0 } else { 4 - side as u16 });
            *if goes_on { &mut going_on } else { &mut ending } += 1;
        }
    }
    // Of the floor each sample beyond the height of the eye lies a footprint before the one above it.
    assert!(ending > 100 && going_on > 2 * ending, "{ending} {going_on}");
    round_trip(&patch(1, image));
}

#[test]
fn odd_sizes_empty_images_and_single_samples_come_back() {
    for size in [(1, 1), (1, 300), (300, 1), (63, 5), (64, 5), (65, 5), (129, 3)] {
        round_trip(&patch(1, cast(size, |_, _| true)));
        round_trip(&patch(1, cast(size, |_, _| false)));
        round_trip(&patch(1, cast(size, |x, y| x == size.0 - 1 && y == size.1 - 1)));
    }
}

#[test]
fn materials_that_vary_within_objects_come_back_for_what_they_vary_by() {
    for keep in [|_, _| true, fragments] {
        let plain = cast((640, 400), keep);
        let mut varied = plain.clone();
        let places: Vec<(u32, u32)> = plain.mask.occupied().collect();
        for (material, (x, y)) in varied.material.iter_mut().zip(places) {
            // Two bits of noise on a slope.
            *material = (40 + x / 8 + (x.wrapping_mul(2_654_435_761) ^ y.wrapping_mul(2_246_822_519)) / 7 % 4) as u8;
        }
        for profile in [Profile::Fast, Profile::Dense] {
            let bytes = |image: &DepthImage| {
                encode_patch(&patch(1, image.clone()), Coding { profile, colour: ColourSteps::Lossless }).len()
            };
            let bits = 8.0 * (bytes(&varied) - bytes(&plain)) as f64 / varied.sample_count() as f64;
            eprintln!("{profile:?}: {bits} bits a sample");
            assert!(bits > 2.0 && bits < 3.5, "{profile:?}: {bits} bits a sample");
        }
        round_trip(&patch(1, varied));
    }
}

#[test]
fn constant_planes_are_not_sent() {
    let mut image = cast((128, 128), |_, _| true);
    let textured = encode_patch(&patch(1, image.clone()), Coding::default()).len();
    image.colour.fill([9, 8, 7]);
    image.object.fill(300);
    image.material.fill(2);
    let plain = round_trip(&patch(1, image.clone())).len();
    image.normal.fill([1, 2]);
    image.depth.fill(77);
    let flat = round_trip(&patch(1, image)).len();
    assert!(plain * 2 < textured, "{plain} of {textured}");
    assert!(flat < 600, "only the mask is left: {flat} bytes");
}

#[test]
fn purposes_and_object_poses_come_back() {
    let poses = [3, 900].map(|object| ObjectPose {
        object,
        world_from_object: DAffine3::from_translation(DVec3::new(1e7, -0.5, f64::from(object))),
    });
    let purposes = [
        Purpose::Eye,
        Purpose::Light(3),
        Purpose::Impostor(500),
        Purpose::Environment,
        Purpose::Relief(9),
        Purpose::Inside(7),
        Purpose::Rest,
        Purpose::Camera,
        Purpose::Occluders,
    ];
    for purpose in purposes {
        let image = cast((16, 16), |_, _| true);
        round_trip(&Patch { purpose, objects: poses.to_vec(), ..patch(u32::MAX, image) });
    }
}

/// A pole camera, and a graph camera of three frusta, with images of 16 x 12 pixels.
fn impostor_cameras() -> [Camera; 2] {
    let pinhole = Pinhole::symmetric(Rigid::IDENTITY, (16, 12), 1.0, 0.1);
    let spoc = Spoc {
        pinhole,
        pole_px: DVec2::new(7.5, 6.25),
        push_from_m: 1.0,
        push_to_m: 3.0,
        push_max_px: 2.5,
        ramp_px: 1.5,
    };
    let graph = split_behind(&pinhole, pinhole.world_from_eye.transform_point(2.0 * DVec3::Z), 0.5, 8.0);
    [Camera::Spoc(spoc), Camera::Graph(Arc::new(GraphCamera::from_description(&graph).unwrap()))]
}

#[test]
fn cameras_of_impostors_come_back() {
    for camera in impostor_cameras() {
        let image = DepthImage { camera, ..with_ends(cast_with_mirror((16, 12), |_, _| true)) };
        let patch = Patch { purpose: Purpose::Environment, ..patch(4, image) };
        round_trip(&patch);
        let mut plain = Vec::new();
        let edits = vec![Edit::Add(Box::new(patch.clone()))];
        let update = Update { number: 1, scene_time_s: 0.0, pose_seq: 0, edits, next: NextSteps::default(), digest: 0 };
        write_update(&update, &mut plain);
        assert_eq!(read_update(&plain).unwrap(), update);
        let bytes = encode_patch(&patch, Coding::default());
        for place in 0..bytes.len() {
            let mut damaged = bytes.clone();
            damaged[place] ^= 0x41;
            let _ = decode_patch(&damaged, &Limits::default());
            assert!(decode_patch(&bytes[..place], &Limits::default()).is_err(), "{place} of {}", bytes.len());
        }
    }
}

#[test]
fn limits_hold_before_anything_is_allocated() {
    let bytes = encode_patch(&patch(1, cast((64, 64), |_, _| true)), Coding::default());
    let few = |limits: Limits| decode_patch(&bytes, &limits).unwrap_err();
    assert!(matches!(few(Limits { update_samples: 100, ..Limits::default() }), CodecError::TooMuch("samples")));
    assert!(matches!(few(Limits { update_pixels: 100, ..Limits::default() }), CodecError::TooMuch("pixels")));
    assert!(matches!(few(Limits { image_side_px: 63, ..Limits::default() }), CodecError::TooMuch(_)));
}

#[test]
fn every_truncation_is_refused() {
    let bytes = encode_patch(&patch(1, cast((40, 30), fragments)), Coding::default());
    for length in 0..bytes.len() {
        assert!(decode_patch(&bytes[..length], &Limits::default()).is_err(), "{length} of {}", bytes.len());
    }
}

#[test]
fn damaged_bytes_of_the_fast_profile_never_panic() {
    let coding = Coding { profile: Profile::Fast, ..Coding::default() };
    let bytes = encode_patch(&patch(1, with_ends(cast_with_mirror((200, 120), |_, _| true))), coding);
    // All of the front, where the frequencies are, then here and there.
    for place in (0..1500).chain((1500..bytes.len()).step_by(37)) {
        let mut damaged = bytes.clone();
        damaged[place] ^= 1 << (place % 8);
        let _ = decode_patch(&damaged, &Limits::default());
        assert!(decode_patch(&bytes[..place], &Limits::default()).is_err(), "{place} of {}", bytes.len());
    }
}

prop_compose! {
    fn any_image()(width in 1_u32..70, height in 1_u32..40)(
        width in Just(width),
        height in Just(height),
        occupied in prop::collection::vec(any::<bool>(), (width * height) as usize),
        noise in prop::collection::vec(any::<[u8; 10]>(), (width * height) as usize),
        // How many bits of the noise count: from smooth to none at all.
        bits in 0_u32..9,
    ) -> DepthImage {
        let mut mask = Mask::empty(width, height);
        occupied.iter().enumerate().filter(|(_, is)| **is)
            .for_each(|(i, _)| mask.set(i as u32 % width, i as u32 / width, true));
        let kept: Vec<[u8; 10]> = noise.into_iter().take(mask.count())
            .map(|noise| noise.map(|byte| byte & ((1_u32 << bits) - 1) as u8)).collect();
        DepthImage {
            camera: Camera::Pinhole(Pinhole::symmetric(Rigid::IDENTITY, (width, height), 1.0, 0.1)),
            depth_scale: DepthScale { w_min: 0.0, w_step: 0.001 },
            depth: kept.iter().map(|k| u16::from_le_bytes([k[0], k[1]])).collect(),
            normal: kept.iter().map(|k| [k[2], k[3]]).collect(),
            ends: if bits < 2 { Vec::new() } else { kept.iter().map(|k| k.iter().take(4).enumerate().fold(0, |all, (side, byte)| with_level(all, side, u16::from(byte & 7)))).collect() },
            // Of a quarter of the materials, and of none where nothing counts.
            normal_rest: if bits == 0 { Vec::new() } else { kept.iter().map(|k| if k[9] & 3 == 1 { k[8] } else { 0 }).collect() },
            colour_rest: if bits < 4 { Vec::new() } else { kept.iter().map(|k| k[7] & 63).collect() },
            colour: kept.iter().map(|k| [k[4], k[5], k[6]]).collect(),
            object: kept.iter().map(|k| u16::from_le_bytes([k[7], k[8]])).collect(),
            material: kept.iter().map(|k| k[9]).collect(),
            share: Vec::new(),
            mask,
        }
    }
}

prop_compose! {
    /// Planes of the ends of their ranges, in images of one pixel, one row or column, and beside the width of a word.
    fn extreme_image()(
        size_px in prop::sample::select(vec![(1, 1), (1, 64), (64, 1), (63, 2), (65, 3), (32, 32), (512, 1), (1, 512)]),
        seeds in prop::collection::vec(any::<u64>(), 64),
        far in prop::sample::select(vec![0.0, 1e300, -1e300, f64::MIN_POSITIVE]),
        near_m in prop::sample::select(vec![f64::MIN_POSITIVE, 1e-3, 1e300]),
        depth_scale in prop::sample::select(vec![(0.0, 0.0), (f32::MIN_POSITIVE, f32::MAX), (f32::MAX, f32::MIN_POSITIVE)]),
        planes in any::<u8>(),
    ) -> DepthImage {
        const BYTES: [u8; 8] = [0, 1, 63, 64, 127, 128, 254, 255];
        const SHORTS: [u16; 8] = [0, 1, 255, 256, 32_767, 32_768, 65_534, 65_535];
        let pick = |at: usize, plane: u32| (seeds[at % 64].rotate_left(at as u32 / 64) >> (3 * plane)) as usize & 7;
        let mut mask = Mask::empty(size_px.0, size_px.1);
        let all = (0..size_px.1).flat_map(|y| (0..size_px.0).map(move |x| (x, y)));
        all.enumerate().for_each(|(at, (x, y))| mask.set(x, y, planes & 1 == 0 || pick(at, 20) > 3));
        let count = mask.count();
        let bytes = |plane: u32| (0..count).map(move |at| BYTES[pick(at, plane)]);
        let shorts = |plane: u32| (0..count).map(move |at| SHORTS[pick(at, plane)]);
        let some = |bit: u8, plane: Vec<u8>| if planes >> bit & 1 == 1 { plane } else { Vec::new() };
        let material: Vec<u8> = bytes(0).collect();
        // Of reflectors alone.
        let rests = bytes(1).zip(&material).map(|(rest, material)| if material & 1 == 1 { rest } else { 0 });
        let level = |at: usize, side: usize| if pick(at, 2) >> (side % 3) & 1 == 1 { ends::MOST } else { 0 };
        let ends = (0..count).map(|at| (0..4).fold(0, |all, side| with_level(all, side, level(at, side))));
        let pose = Rigid { translation: DVec3::splat(far), ..Rigid::IDENTITY };
        let camera = Pinhole { near_m, ..Pinhole::symmetric(pose, size_px, 1.0, 0.1) };
        DepthImage {
            camera: Camera::Pinhole(camera),
            depth_scale: DepthScale { w_min: depth_scale.0, w_step: depth_scale.1 },
            depth: shorts(3).collect(),
            normal: bytes(4).zip(bytes(5)).map(|(x, y)| [x, y]).collect(),
            normal_rest: some(1, rests.collect()),
            ends: if planes >> 2 & 1 == 1 { ends.collect() } else { Vec::new() },
            colour: bytes(6).zip(bytes(7)).zip(bytes(8)).map(|((r, g), b)| [r, g, b]).collect(),
            colour_rest: some(3, bytes(9).map(|rest| rest & 63).collect()),
            object: shorts(10).collect(),
            share: some(4, bytes(11).map(|share| share.clamp(1, DepthImage::WHOLE)).collect()),
            material,
            mask,
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn images_of_the_ends_of_all_ranges_come_back(
        image in extreme_image(),
        time_s in any::<f64>(),
        object in any::<u16>(),
    ) {
        let pose = ObjectPose { object, world_from_object: DAffine3::from_scale(DVec3::new(1e300, -1e-300, 0.0)) };
        let time_s = if time_s.is_nan() { f64::INFINITY } else { time_s };
        round_trip(&Patch { capture_time_s: time_s, objects: vec![pose], ..patch(u32::MAX, image) });
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn any_image_comes_back(image in any_image()) {
        round_trip(&patch(PatchId(9).0, image));
    }

    #[test]
    fn damaged_bytes_never_panic(
        image in any_image(),
        damage in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..8),
    ) {
        let mut bytes = encode_patch(&patch(1, image), Coding::default());
        for (place, byte) in damage {
            let place = place.index(bytes.len());
            bytes[place] = byte;
        }
        let limits = Limits { update_samples: 1 << 16, update_pixels: 1 << 18, ..Limits::default() };
        let _ = decode_patch(&bytes, &limits);
    }

    #[test]
    fn random_bytes_never_panic(bytes in prop::collection::vec(any::<u8>(), 0..600)) {
        let _ = decode_patch(&bytes, &Limits::default());
    }
}

#[test]
fn bytes_stay_few() {
    let whole = patch(1, cast((320, 200), |_, _| true));
    let part = patch(1, cast((320, 200), fragments));
    let bytes = |patch: &Patch, profile, colour: ColourSteps| {
        let mut patch = patch.clone();
        colour.settle_all(&mut patch.image.colour);
        encode_patch(&patch, Coding { profile, colour }).len() as f64
    };
    // What was found, and a tenth more.
    for (patch, fast_most, fine_most, dense_most) in [(&whole, 0.48, 0.41, 0.90), (&part, 0.53, 0.48, 1.05)] {
        let fast = bytes(patch, Profile::Fast, ColourSteps::Lossless);
        let zstd = zstd::bulk::compress(&raw_planes(&patch.image), 1).unwrap().len() as f64;
        let dense = bytes(patch, Profile::Dense, ColourSteps::Lossless);
        let fine = bytes(patch, Profile::Fast, ColourSteps::Fine);
        eprintln!("of zstd: fast {:.3}, fine {:.3}; dense of fast {:.3}", fast / zstd, fine / zstd, dense / fast);
        assert!(fast < fast_most * zstd, "fast: {:.3} of zstd at level 1", fast / zstd);
        assert!(fine < fine_most * zstd, "fine: {:.3} of zstd at level 1", fine / zstd);
        assert!(dense < dense_most * fast, "dense: {:.3} of fast", dense / fast);
    }
}

#[test]
fn flat_surfaces_cost_next_to_nothing() {
    // A floor, and two walls that meet in the corner of a room, each as its own steep plane of depth.
    let size_px = (320, 200);
    let planes = [[20_000.0, 31.37, 41.73], [9_000.0, -11.19, 7.003], [31_000.0, 90.071, -60.83]];
    let mut image = cast(size_px, |x, y| fragments(x, y) || y < 120);
    for (rank, (x, y)) in image.mask.clone().occupied().enumerate() {
        let place = if y > 150 - x / 8 { 0 } else { 1 + usize::from(x > 140) };
        let [at, along_x, along_y] = planes[place];
        image.depth[rank] = (at + along_x * f64::from(x) + along_y * f64::from(y)).round() as u16;
        (image.object[rank], image.material[rank]) = (place as u16, 0);
        (image.normal[rank], image.colour[rank]) = ([place as u8; 2], [40 * place as u8; 3]);
    }
    let one_depth = DepthImage { depth: vec![7; image.depth.len()], ..image.clone() };
    for (profile, most_bytes) in [(Profile::Fast, 450), (Profile::Dense, 400)] {
        let coding = Coding { profile, ..Coding::default() };
        let [bytes, of_one_depth] = [&image, &one_depth].map(|image| {
            let patch = patch(1, image.clone());
            round_trip(&patch);
            encode_patch(&patch, coding).len()
        });
        eprintln!("{profile:?}: {bytes} bytes, {of_one_depth} with one depth");
        assert!(bytes < of_one_depth + most_bytes, "{profile:?}: {bytes} bytes, {of_one_depth} with one depth");
    }
}

/// All planes at wire width; none of the test images is constant anywhere.
fn raw_planes(image: &DepthImage) -> Vec<u8> {
    let shorts = |plane: &[u16]| plane.iter().flat_map(|value| value.to_le_bytes()).collect::<Vec<u8>>();
    let (depth, object) = (shorts(&image.depth), shorts(&image.object));
    [&depth, image.normal.as_flattened(), image.colour.as_flattened(), &object, &image.material].concat()
}

#[test]
fn a_small_patch_costs_little_beside_its_header() {
    // A header of 127 bytes; a hundred samples in a corner of a large image.
    let few = patch(1, cast((640, 400), |x, y| (300..310).contains(&x) && (300..310).contains(&y)));
    let bytes = round_trip(&few).len() - HEADER_BYTES;
    assert!(bytes < 3 * 100, "{bytes} bytes for 100 samples of ten bytes each");
    let one = patch(1, cast((640, 400), |x, y| (x, y) == (300, 300)));
    let bytes = round_trip(&one).len() - HEADER_BYTES;
    assert!(bytes < 30, "{bytes} bytes for a sample");
}

/// Id, purpose, time, camera, depth scale and the number of objects.
const HEADER_BYTES: usize = 4 + 3 + 8 + (1 + 7 * 8 + 2 * 4 + 4 * 8) + 8 + 4;

#[test]
fn shares_of_pixels_come_back_and_whole_pixels_cost_next_to_nothing() {
    for size in [(24, 24), (128, 128)] {
        let whole = cast(size, |_, _| true);
        let of = |share: fn(usize) -> u8| DepthImage {
            share: (0..whole.sample_count()).map(share).collect(),
            ..whole.clone()
        };
        round_trip(&patch(1, of(|index| 1 + (index % 64) as u8)));
        let none = round_trip(&patch(1, whole.clone())).len();
        let all = round_trip(&patch(1, of(|_| DepthImage::WHOLE))).len();
        assert!(all <= none + 24, "{all} bytes, {none} without");
        let more = encode_patch(&patch(1, of(|_| DepthImage::WHOLE + 1)), Coding::default());
        assert_eq!(decode_patch(&more, &Limits::default()), Err(CodecError::Damaged("share")));
    }
}

#[test]
fn layers_come_back_and_there_are_few() {
    let of = |layer| Patch { purpose: Purpose::Layer(layer), ..patch(1, cast((24, 24), |_, _| true)) };
    for layer in 0..Purpose::LAYERS {
        round_trip(&of(layer));
    }
    let bytes = encode_patch(&of(Purpose::LAYERS), Coding::default());
    assert_eq!(decode_patch(&bytes, &Limits::default()), Err(CodecError::Damaged("purpose")));
}
