use std::path::{Path, PathBuf};

use glam::{DVec2, DVec3, Vec3};
use proptest::prelude::*;

use super::*;

/// Four by two pixels, each of another grey.
fn numbered() -> Environment {
    Environment { width_px: 4, height_px: 2, radiance: (0..8).map(|n| [n as f32; 3]).collect() }
}

fn scratch_file(name: &str) -> PathBuf {
    std::env::temp_dir().join(format!("vantage-environment-{}-{name}", std::process::id()))
}

#[test]
fn axes_lie_where_the_module_says() {
    let places = [
        (DVec3::X, DVec2::new(0.5, 0.5)),
        (DVec3::Z, DVec2::new(0.75, 0.5)),
        (DVec3::NEG_Z, DVec2::new(0.25, 0.5)),
        (DVec3::Y, DVec2::new(0.5, 1.0)),
        (DVec3::NEG_Y, DVec2::new(0.5, 0.0)),
    ];
    for (direction, uv) in places {
        assert!(uv_from_direction(direction * 3.0).abs_diff_eq(uv, 1e-12), "{direction}");
    }
    assert_eq!(uv_from_direction(DVec3::new(-1.0, 0.0, 1e-300)).x, 1.0);
    assert_eq!(uv_from_direction(DVec3::new(-1.0, 0.0, -1e-300)).x, 0.0);
}

#[test]
fn lookups_blend_neighbours_go_around_and_end_at_the_poles() {
    let environment = numbered();
    let at = |u: f64, v: f64| environment.radiance(direction_from_uv(DVec2::new(u, v))).x;
    assert!((at(0.375, 0.75) - 1.0).abs() < 1e-6, "a pixel's middle");
    assert!((at(0.5, 0.75) - 1.5).abs() < 1e-6, "between two");
    assert!((at(0.375, 0.5) - 3.0).abs() < 1e-6, "between two rows");
    assert!((at(0.0, 0.75) - 1.5).abs() < 1e-6, "between the last and the first column");
    assert!((at(0.625, 0.99) - 2.0).abs() < 1e-6, "above the first row's middle");
    assert!((at(0.625, 0.01) - 6.0).abs() < 1e-6, "below the last row's middle");
}

#[test]
fn the_mean_weighs_rows_by_their_solid_angles() {
    let mut environment = Environment { width_px: 3, height_px: 3, radiance: vec![[1.0; 3]; 9] };
    assert!(environment.mean_radiance().abs_diff_eq(Vec3::ONE, 1e-6));
    environment.radiance[..3].fill([0.0; 3]);
    // A third of the height from the pole: (1 - sin 30°) / 2 of all directions.
    assert!((environment.mean_radiance().x - 0.75).abs() < 1e-6);
}

#[test]
fn the_studio_is_neutral_and_brighter_above() {
    let studio = Environment::studio();
    assert_eq!((studio.width_px, studio.height_px, studio.radiance.len()), (512, 256, 512 * 256));
    assert!(studio.mean_radiance().abs_diff_eq(Vec3::ONE, 0.03), "{}", studio.mean_radiance());
    let half = |rows: &[[f32; 3]]| rows.iter().map(|pixel| pixel[1]).sum::<f32>() / rows.len() as f32;
    let (above, below) = studio.radiance.split_at(512 * 128);
    assert!(half(above) > 2.0 * half(below), "{} and {}", half(above), half(below));
    assert!(studio.radiance(DVec3::Y).x > 5.0 * studio.radiance(DVec3::NEG_Y).x);
    let [left, right] = [-1.0, 1.0].map(|x| studio.radiance(DVec3::new(x, 0.25, 0.3)).x);
    assert!(left > right && right > 1.0, "{left} and {right}");
    assert_eq!(studio, Environment::studio());
}

#[test]
fn a_written_file_reads_as_it_was() {
    let path = scratch_file("studio.hdr");
    let studio = Environment::studio();
    studio.write_hdr(&path).unwrap();
    let read = Environment::load(&path).unwrap();
    std::fs::remove_file(&path).unwrap();
    assert_eq!((read.width_px, read.height_px), (512, 256));
    for (found, wanted) in read.radiance.iter().zip(&studio.radiance) {
        let largest = Vec3::from(*wanted).max_element();
        assert!(Vec3::from(*found).abs_diff_eq(Vec3::from(*wanted), largest / 128.0), "{found:?} for {wanted:?}");
    }
}

#[test]
fn an_exr_file_is_read_and_its_values_are_made_usable() {
    let path = scratch_file("values.exr");
    let values = vec![0.5, f32::NAN, -1.0, f32::INFINITY, 1e6, 2.0];
    image::Rgb32FImage::from_raw(2, 1, values).unwrap().save(&path).unwrap();
    let read = Environment::load(&path).unwrap();
    std::fs::remove_file(&path).unwrap();
    let most = Environment::MAX_RADIANCE;
    assert_eq!(read.radiance, [[0.5, 0.0, 0.0], [most, most, 2.0]]);
}

#[test]
fn an_exr_file_whose_blocks_claim_more_than_it_can_hold_gets_no_memory() {
    let path = scratch_file("blocks.exr");
    let pixels = exr::prelude::SpecificChannels::rgb(|_: exr::prelude::Vec2<usize>| (0.5_f32, 0.5_f32, 0.5_f32));
    let mut picture = exr::prelude::Image::from_channels((40, 2), pixels);
    picture.layer_data.encoding.blocks = exr::prelude::Blocks::Tiles((64, 64).into());
    exr::prelude::WritableImage::write(&picture).to_file(&path).unwrap();
    let tiled = std::fs::read(&path).unwrap();
    std::fs::remove_file(&path).unwrap();
    assert_eq!(Environment::decode(&tiled, &path).unwrap().radiance, [[0.5; 3]; 80]);
    // Width and height of a tile follow the size of the attribute.
    let name = b"tiledesc\0\x09\0\0\0";
    let at = tiled.windows(name.len()).position(|window| window == name).unwrap() + name.len() + 4;
    for height in [1_i32 << 22, 1 << 28] {
        let mut claims = tiled.clone();
        claims[at..at + 4].copy_from_slice(&height.to_le_bytes());
        let error = Environment::decode(&claims, &path).unwrap_err().to_string();
        assert!(error.contains("bytes is claimed in"), "{error}");
    }
}

#[test]
fn errors_say_what_is_wrong() {
    let missing = Environment::load(Path::new("no/such.hdr")).unwrap_err();
    assert!(missing.to_string().starts_with("cannot use no/such.hdr: "), "{missing}");
    let said = |bytes: &[u8]| Environment::decode(bytes, Path::new("sky.hdr")).unwrap_err().to_string();
    assert_eq!(said(b"\x89PNG"), "sky.hdr: neither a Radiance (.hdr) nor an OpenEXR (.exr) picture");
    assert!(said(b"#?RADIANCE\n\n-Y 65536 +X 65536\n").contains("65536 x 65536 pixels; from 1 to 33554432"));
    assert!(said(b"#?RADIANCE\n\n-Y 0 +X 8\n").contains("8 x 0 pixels"));
    assert!(said(b"#?RADIANCE\n\n-Y 4096 +X 8192\n").contains("8192 x 4096 pixels are claimed in 28 bytes"));
    assert!(said(b"#?RADIANCE\n\n-Y 2 +X 2\n\x01").starts_with("sky.hdr: "));
    assert!(said(b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n").starts_with("sky.hdr: "));
}

proptest! {
    #[test]
    fn directions_and_places_are_inverses(u in 0.001f64..0.999, v in 0.001f64..0.999) {
        let uv = DVec2::new(u, v);
        prop_assert!(uv_from_direction(direction_from_uv(uv)).abs_diff_eq(uv, 1e-9));
        prop_assert!((direction_from_uv(uv).length() - 1.0).abs() < 1e-12);
    }

    #[test]
    fn any_bytes_are_read_or_refused(tail in prop::collection::vec(any::<u8>(), 0..400), exr in any::<bool>()) {
        let head: &[u8] = if exr { &[0x76, 0x2f, 0x31, 0x01, 2, 0, 0, 0] } else { b"#?RADIANCE\n\n-Y 3 +X 9\n" };
        // Either is right; it must end.
        let _ = Environment::decode(&[head, &tail].concat(), Path::new("any"));
    }
}
