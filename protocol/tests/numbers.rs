//! What numbers lose on their way: depths, normals, colours, the bones of a body; and where samples lie in a mask.

#![allow(clippy::unwrap_used, reason = "a test that unwraps fails, as it should")]

use camera::{ImagePoint, Pinhole, Rigid};
use glam::{DVec2, DVec3, Vec3};
use proptest::prelude::*;
use vantage_protocol::body::{Clip, Skin, Wrap, bent};
use vantage_protocol::codec::ColourSteps;
use vantage_protocol::image::{
    Ranks, colour_quarters, colour_with_rest, octahedral_code, octahedral_normal, octahedral_normal_with_rest,
    octahedral_rest,
};
use vantage_protocol::{Body, DepthScale, Mask};

/// What a depth's step may show as, of an output.
const EPSILON_PX: f64 = 0.1;

fn unit() -> impl Strategy<Value = Vec3> {
    let corners = vec![Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z, Vec3::new(1e-30, 1.0, -1e-30)];
    let any = (-1.0..1.0_f32, 0.0..std::f32::consts::TAU).prop_map(|(z, angle)| {
        let across = (1.0 - z * z).sqrt();
        Vec3::new(across * angle.cos(), across * angle.sin(), z)
    });
    prop_oneof![1 => prop::sample::select(corners), 8 => any]
}

/// A clip of up to three bones and six moments.
fn clip() -> impl Strategy<Value = Clip> {
    let period_s = prop_oneof![1e-6..1e-3_f64, 0.1..10.0_f64, 1e3..1e9_f64];
    let code = prop_oneof![Just(i32::MIN), Just(i32::MAX), -1000..1000_i32];
    (1_u16..4, 1_usize..7, period_s).prop_flat_map(move |(bones, moments, period_s)| {
        let codes = prop::collection::vec(code.clone(), moments * usize::from(bones) * Clip::NUMBERS);
        codes.prop_map(move |codes| Clip { period_s, bones, linear_step: 1e-4, offset_step: 1e-3, codes })
    })
}

/// A number of a clip's map at a moment.
fn number(clip: &Clip, moment: usize, bone: usize, at: usize) -> f32 {
    let step = if at % 4 == 3 { clip.offset_step } else { clip.linear_step };
    clip.codes[(moment * usize::from(clip.bones) + bone) * Clip::NUMBERS + at] as f32 * step
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 1024, failure_persistence: None, ..ProptestConfig::default() })]

    /// An eye anywhere in the region beside the image's sees no sample shift by more than half of a tenth of a pixel, unless 16 bits are too few.
    #[test]
    fn no_eye_of_the_region_sees_a_depth_shift_by_a_tenth_of_a_pixel(
        fov in 0.02..2.8_f64,
        height in 64_u32..4096,
        region_decade in -4.0..2.0_f64,
        near_decade in -2.0..2.0_f64,
        farther in 1.0..1e4_f64,
        at in (0.0..1.0_f64, 0.0..1.0_f64),
        depth in 0.0..1.0_f64,
        way in 0.0..std::f64::consts::TAU,
    ) {
        let view = Pinhole::symmetric(Rigid::IDENTITY, (height, height), fov, 1e-3);
        let (region_m, nearest_m) = (10_f64.powf(region_decade), 10_f64.powf(near_decade));
        let (w_max, w_min) = ((1.0 / nearest_m) as f32, (1.0 / (nearest_m * farther)) as f32);
        let scale = DepthScale::for_view(EPSILON_PX, view.focal_px, region_m, w_min, w_max);
        let w = (f64::from(w_min) + depth * f64::from(w_max - w_min)) as f32;
        let decoded = scale.w(scale.code(w));
        prop_assert!(decoded >= w_min && decoded.is_finite());
        // As another view of the region sees both.
        let eye = DVec3::new(way.cos(), way.sin(), 0.0) * region_m;
        let seen = |w: f32| {
            let point = ImagePoint { u: at.0 * f64::from(height), v: at.1 * f64::from(height), w: f64::from(w) };
            let shifted = view.eye_from_image(point) - eye;
            DVec2::new(shifted.x, shifted.y) / shifted.z * view.focal_px
        };
        let shift_px = seen(w).distance(seen(decoded));
        let finest_px = view.focal_px * region_m * f64::from(w_max - w_min) / 65535.0;
        // Depths are f32: a few roundings of the largest.
        let rounding_px = view.focal_px * region_m * f64::from(w_max) * 4.0 * f64::from(f32::EPSILON);
        prop_assert!(shift_px <= EPSILON_PX.max(finest_px) / 2.0 * 1.001 + rounding_px + 1e-6, "{shift_px} px, {scale:?}");
    }

    #[test]
    fn depths_at_the_ends_have_codes_at_the_ends(
        w_min in 0.0..1.0_f32,
        range in 1e-3..1e3_f32,
        odd in prop::num::f32::ANY,
    ) {
        let scale = DepthScale::for_view(EPSILON_PX, 500.0, 1e9, w_min, w_min + range);
        prop_assert_eq!((scale.code(w_min), scale.code(w_min + range)), (0, u16::MAX));
        // Whatever a depth is, its code is one.
        let decoded = scale.w(scale.code(odd));
        prop_assert!((w_min..=(w_min + range) * 1.001).contains(&decoded), "{odd} as {decoded}");
    }

    #[test]
    fn normals_keep_their_direction(normal in unit()) {
        let (code, rest) = (octahedral_code(normal), octahedral_rest(normal));
        let (coarse, fine) = (octahedral_normal(code), octahedral_normal_with_rest(code, rest));
        prop_assert!((coarse.length() - 1.0).abs() < 1e-5 && (fine.length() - 1.0).abs() < 1e-5);
        // In radians, nearly: the greatest that tests over the whole sphere find.
        prop_assert!(coarse.distance(normal) < 0.0165, "{normal} as {coarse}");
        prop_assert!(fine.distance(normal) < 0.0165 / 8.0, "{normal} as {fine}");
    }

    #[test]
    fn any_vector_has_a_code_and_any_code_a_unit_vector(
        numbers in any::<[f32; 3]>(),
        code in any::<[u8; 2]>(),
        rest in any::<u8>(),
    ) {
        let again = octahedral_normal(octahedral_code(Vec3::from(numbers)));
        prop_assert!((again.length() - 1.0).abs() < 1e-5);
        let normal = octahedral_normal_with_rest(code, rest);
        prop_assert!((normal.length() - 1.0).abs() < 1e-5, "{code:?} {rest}: {normal}");
    }

    #[test]
    fn colours_are_off_by_an_eighth_of_a_step_with_their_rests(colour in any::<[u16; 3]>()) {
        let srgb = colour.map(|channel| f32::from(channel) / 65535.0);
        let (code, rest) = colour_with_rest(srgb);
        let found = colour_quarters(code, rest).map(|quarters| f32::from(quarters) / 1020.0);
        let off = found.iter().zip(srgb).map(|(found, wanted)| (found - wanted).abs()).fold(0.0, f32::max);
        prop_assert!(off <= 0.5 / 1020.0 + 1e-6, "{srgb:?} as {found:?}");
    }

    #[test]
    fn settled_colours_stay_and_are_near(colour in any::<[u8; 3]>()) {
        for (steps, most) in ColourSteps::ALL.into_iter().zip([0, 5, 11]) {
            let settled = steps.settle(colour);
            prop_assert_eq!(steps.settle(settled), settled);
            let off = settled.iter().zip(colour).map(|(a, b)| a.abs_diff(b)).max().unwrap();
            prop_assert!(off <= most, "{steps:?}: {colour:?} as {settled:?}");
        }
    }

    #[test]
    fn a_clip_repeats_and_stays_between_its_moments(clip in clip(), share in 0.0..1.0_f64, rounds in -3..4_i32) {
        let rows = clip.at((share + f64::from(rounds)) * clip.period_s);
        let once = clip.at(share * clip.period_s);
        for (bone, (rows, once)) in rows.iter().zip(&once).enumerate() {
            for at in 0..Clip::NUMBERS {
                let found = rows[at / 4][at % 4];
                let values = (0..clip.moments()).map(|moment| number(&clip, moment, bone, at));
                let ends = |(least, most): (f32, f32), value: f32| (least.min(value), most.max(value));
                let (least, most) = values.fold((f32::INFINITY, f32::NEG_INFINITY), ends);
                let slack = 4.0 * f32::EPSILON * least.abs().max(most.abs());
                prop_assert!(found >= least - slack && found <= most + slack, "{found} of {least} to {most}");
                // A hair beside a moment it may be of the next one: at most a hair of the whole way.
                prop_assert!((found - once[at / 4][at % 4]).abs() <= 1e-5 * (most - least) + slack, "{found} a period later");
            }
        }
    }

    #[test]
    fn a_clip_passes_through_its_moments(clip in clip(), moment in any::<prop::sample::Index>()) {
        let last = clip.moments() - 1;
        // The last moment is the first of the next round.
        let moment = moment.index(clip.moments()).min(last.saturating_sub(1));
        let rows = clip.at(moment as f64 / last.max(1) as f64 * clip.period_s);
        for (bone, rows) in rows.iter().enumerate() {
            for at in 0..Clip::NUMBERS {
                let (found, wanted) = (rows[at / 4][at % 4], number(&clip, moment, bone, at));
                // Times round, so it may be a hair before or after; and a number beside a much larger one, of 24 bits.
                let beside = [moment.saturating_sub(1), (moment + 1).min(last)];
                let beside = beside.map(|moment| number(&clip, moment, bone, at).abs());
                let slack = 1e-6 * (beside[0] + wanted.abs() + beside[1]);
                prop_assert!((found - wanted).abs() <= slack, "{found} instead of {wanted}");
            }
        }
    }

    #[test]
    fn a_clip_is_finite_at_any_time(clip in clip(), odd in any::<f64>()) {
        let ages = [1e9, -1e9, 1e300, -1e300, 0.0, -0.0, f64::MIN_POSITIVE, -f64::MIN_POSITIVE];
        for time_s in ages.into_iter().chain([odd, f64::INFINITY, f64::NEG_INFINITY, f64::NAN]) {
            let maps = clip.at(time_s);
            prop_assert_eq!(maps.len(), usize::from(clip.bones));
            prop_assert!(maps.iter().flatten().flatten().all(|number| number.is_finite()), "at {time_s}");
        }
    }

    #[test]
    fn what_bones_that_do_nothing_bend_stays(
        codes in prop::collection::vec(any::<[u16; 3]>(), 1..20),
        shares in any::<[u16; 3]>(),
    ) {
        // Four shares that are all of it.
        let mut cuts = shares;
        cuts.sort_unstable();
        let shares = [cuts[0], cuts[1] - cuts[0], cuts[2] - cuts[1], u16::MAX - cuts[2]];
        let identity = (0..Clip::NUMBERS as i32).map(|at| if at % 5 == 0 { 1024 } else { 0 });
        let clip = Clip { period_s: 1.0, bones: 1, linear_step: 1.0 / 1024.0, offset_step: 1e-3, codes: identity.collect() };
        let body = Body {
            least: [-3.0, 0.0, 1e3],
            step: [1e-4, 2e-4, 0.0],
            normals: Vec::new(),
            uvs: Vec::new(),
            least_uv: [0.0; 2],
            step_uv: [0.0; 2],
            colours: Vec::new(),
            indices: Vec::new(),
            double_sided: false,
            cut_out: false,
            wrap: [Wrap::Repeat; 2],
            nearest: false,
            bounds: [[-3.0, 0.0, 1e3], [10.0, 20.0, 1e3]],
            skin: Some(Skin { bones: vec![[0; 4]; codes.len()], shares: vec![shares; codes.len()], clip: clip.clone() }),
            positions: codes,
        };
        prop_assert!(body.is_whole());
        let bones = clip.at(0.4);
        for vertex in 0..body.positions.len() {
            let (moved, rest) = (bent(&body, &bones, vertex), body.position(vertex));
            prop_assert!(moved.distance(rest) <= 8.0 * f32::EPSILON * rest.length(), "{moved} instead of {rest}");
            prop_assert!(rest.cmpge(Vec3::from(body.bounds[0])).all() && rest.cmple(Vec3::from(body.bounds[1])).all());
        }
    }

    #[test]
    fn a_mask_counts_and_ranks_its_pixels(
        width in 1_u32..150,
        height in 1_u32..12,
        seeds in prop::collection::vec(any::<u64>(), 30),
        from in 0_u32..150,
        length in 0_u32..64,
    ) {
        let is_set = |x: u32, y: u32| seeds[(y * width + x) as usize / 64 % seeds.len()] >> ((y * width + x) % 64) & 1 == 1;
        let mut mask = Mask::empty(width, height);
        let pixels: Vec<(u32, u32)> = (0..height).flat_map(|y| (0..width).map(move |x| (x, y))).collect();
        pixels.iter().for_each(|&(x, y)| mask.set(x, y, is_set(x, y)));
        let naive: Vec<(u32, u32)> = pixels.iter().copied().filter(|&(x, y)| is_set(x, y)).collect();
        prop_assert_eq!(mask.occupied().collect::<Vec<_>>(), naive.clone());
        prop_assert_eq!(mask.count(), naive.len());
        let ranks = Ranks::new(&mask);
        for &(x, y) in &pixels {
            prop_assert_eq!(ranks.of(&mask, x as u16, y as u16), naive.iter().position(|&place| place == (x, y)));
        }
        prop_assert_eq!(ranks.of(&mask, width as u16, 0), None);
        let columns = from.min(width)..(from + length).min(width);
        let counted = naive.iter().filter(|(x, y)| *y == height - 1 && columns.contains(x)).count();
        prop_assert_eq!(mask.count_in(height - 1, columns) as usize, counted);
        prop_assert_eq!(Mask::from_words(width, height, mask.words().to_vec()), Some(mask));
    }
}

/// Every code of two bytes, and what is made of it.
#[test]
fn a_coded_normal_stays_as_it_is() {
    for code in (0..=u16::MAX).map(u16::to_le_bytes) {
        let normal = octahedral_normal(code);
        assert!(octahedral_normal(octahedral_code(normal)).distance(normal) < 1e-5 || code.contains(&255), "{code:?}");
    }
}
