//! The baseline that everybody has: video. The truth, drawn where the server expects the viewer to be, coded as H.264, and
//! turned to where the viewer looks when it is shown (asynchronous time warp: rotation alone, for there is no depth).
//!
//! The server hears the same poses over the same link, and predicts with the same predictor, as the one that sends samples.
//! It draws a field that is wider by [`MARGIN_RAD`] on every side, at the same pixels a radian in its middle, so that turns
//! within a round trip show no rim. What leaves that field is shown as the nearest pixel of the rim, and counts as a hole.

use std::f64::consts::FRAC_PI_2;
use std::path::Path;

use camera::Pinhole;
use glam::{DVec2, DVec3};
use network::{Link, LinkModel};

use super::expected::expected_eyes;
use super::ffmpeg;
use super::setup::{Replay, SERVER_HZ};
use super::truths::{Pair, Truths, shown_at_s};
use crate::compare::Picture;

/// Six degrees: a tenth of a second of the traces' fastest turns, 65 degrees a second. With prediction a view is off by 1 degree
/// in the mean and 3.4 at most there.
pub const MARGIN_RAD: f64 = 6.0 / 180.0 * std::f64::consts::PI;
/// The pictures of a run before they are coded.
pub struct Filmed {
    sent: Vec<Sent>,
    pictures: Vec<Picture>,
}

/// One picture of the server.
struct Sent {
    /// On the trace's clock.
    tick_s: f64,
    camera: Pinhole,
}

/// Draws what a server would send during a replay over a link.
pub fn film(truths: &mut Truths, replay: &Replay, link: Link) -> anyhow::Result<Filmed> {
    let wide = wider(&truths.view());
    let frames = replay.trace.poses.len();
    let mut film = Filmed { sent: Vec::new(), pictures: Vec::new() };
    for (tick_s, world_from_eye) in expected_eyes(replay, link) {
        // The last picture that can arrive before the last frame.
        if tick_s <= shown_at_s(frames - 1) {
            let camera = Pinhole { world_from_eye, ..wide };
            film.pictures.push(truths.from(&camera, tick_s.max(0.0))?);
            film.sent.push(Sent { tick_s, camera });
        }
    }
    Ok(film)
}

/// The headless viewer's own seed, so that video meets the same network.
const DOWN_SEED: u64 = !1;

/// The camera with a field wider by the margin.
fn wider(view: &Pinhole) -> Pinhole {
    let half = |pixels: u32| {
        let half_rad = (f64::from(pixels) / 2.0 / view.focal_px).atan() + MARGIN_RAD;
        // H.264 in 4:2:0 needs even sides.
        let half_px = (half_rad.min(0.95 * FRAC_PI_2).tan() * view.focal_px).ceil() as u32;
        half_px * 2
    };
    let (width_px, height_px) = (half(view.width_px), half(view.height_px));
    Pinhole { width_px, height_px, centre_px: DVec2::new(width_px.into(), height_px.into()) / 2.0, ..*view }
}

/// What a viewer of the video saw.
pub struct Watched {
    /// Its pictures, turned to its poses.
    pub pairs: Vec<Pair>,
    /// Of the H.264 stream, per second of it.
    pub mbit_s: f64,
    /// Real milliseconds a picture.
    pub encode_ms: f64,
}

/// Codes at a bit rate, decodes, and shows the frames that `drawn` picks.
pub fn watch(
    truths: &mut Truths,
    replay: &Replay,
    link: Link,
    film: &Filmed,
    mbit: f64,
    (tool, drawn): (&Path, super::Drawn),
) -> anyhow::Result<Watched> {
    let coded = ffmpeg::encode(tool, &film.pictures, SERVER_HZ, mbit)?;
    let pictures = ffmpeg::decode(tool, &coded.bytes, &film.pictures[0])?;
    anyhow::ensure!(pictures.len() == film.pictures.len(), "{} of {} pictures", pictures.len(), film.pictures.len());
    let mut down = LinkModel::new(link, DOWN_SEED);
    let bytes_each = coded.bytes.len() / pictures.len();
    let arrivals: Vec<f64> = film.sent.iter().map(|sent| down.deliver(sent.tick_s, bytes_each)).collect();
    let mut pairs = Vec::new();
    for frame in (0..replay.trace.poses.len()).filter(|&frame| drawn(frame)) {
        let now_s = shown_at_s(frame);
        let newest = arrivals.iter().rposition(|&arrival_s| arrival_s <= now_s).unwrap_or(0);
        let view = Pinhole { world_from_eye: replay.trace.at(now_s), ..truths.view() };
        let picture = turned(&pictures[newest], &film.sent[newest].camera, &view);
        pairs.push(Pair {
            frame,
            picture,
            truth: truths.of(frame, view.world_from_eye, now_s)?,
            uncovered_share: None,
        });
    }
    let seconds = pictures.len() as f64 / SERVER_HZ;
    Ok(Watched {
        pairs,
        mbit_s: coded.bytes.len() as f64 * 8.0 / 1e6 / seconds,
        encode_ms: coded.ms / pictures.len() as f64,
    })
}

/// A picture of `from` as `view` sees it if everything is infinitely far away, bilinear.
pub fn turned(picture: &Picture, from: &Pinhole, view: &Pinhole) -> Picture {
    let from_view = from.world_from_eye.rotation.conjugate() * view.world_from_eye.rotation;
    let mut shown = Picture::filled(view.width_px, view.height_px, [0; 3]);
    let mut covered = Vec::with_capacity(shown.pixel_count());
    for (index, out) in shown.rgb.chunks_exact_mut(3).enumerate() {
        let (x, y) = (index as u32 % view.width_px, index as u32 / view.width_px);
        let ray: DVec3 = from_view * view.ray_eye_from_image(f64::from(x) + 0.5, f64::from(y) + 0.5);
        let place = DVec2::new(ray.x, ray.y) / ray.z.max(f64::MIN_POSITIVE) * from.focal_px + from.centre_px;
        let size_px = DVec2::new(from.width_px.into(), from.height_px.into());
        covered.push(ray.z > 0.0 && place.cmpge(DVec2::ZERO).all() && place.cmple(size_px).all());
        out.copy_from_slice(&bilinear(picture, place.clamp(DVec2::ZERO, size_px)));
    }
    shown.covered = Some(covered);
    shown
}

/// The colour at a place in pixels, whose centres are at +0.5; held at the rim.
fn bilinear(picture: &Picture, place: DVec2) -> [u8; 3] {
    let last = DVec2::new(f64::from(picture.width_px - 1), f64::from(picture.height_px - 1));
    let place = (place - 0.5).clamp(DVec2::ZERO, last);
    let low = place.floor();
    let (share, high) = (place - low, (low + 1.0).min(last));
    let texel = |x: f64, y: f64, channel: usize| {
        f64::from(picture.rgb[(y as usize * picture.width_px as usize + x as usize) * 3 + channel])
    };
    std::array::from_fn(|channel| {
        let row = |y| texel(low.x, y, channel) * (1.0 - share.x) + texel(high.x, y, channel) * share.x;
        (row(low.y) * (1.0 - share.y) + row(high.y) * share.y).round() as u8
    })
}

#[cfg(test)]
mod tests {
    use camera::Rigid;
    use glam::DQuat;

    use super::*;

    fn view() -> Pinhole {
        Pinhole::symmetric(Rigid::IDENTITY, (64, 36), std::f64::consts::FRAC_PI_3, 0.1)
    }

    /// Every pixel says where it is.
    fn chart(camera: &Pinhole) -> Picture {
        let mut chart = Picture::filled(camera.width_px, camera.height_px, [0; 3]);
        for (index, rgb) in chart.rgb.chunks_exact_mut(3).enumerate() {
            let (x, y) = (index as u32 % camera.width_px, index as u32 / camera.width_px);
            rgb.copy_from_slice(&[x as u8 * 2, y as u8 * 4, 128]);
        }
        chart
    }

    #[test]
    fn a_viewer_who_did_not_turn_sees_the_middle_of_the_wide_picture() {
        let world_from_eye = Rigid::look_along(DVec3::ONE, DVec3::new(-0.3, 0.2, 0.7).normalize());
        let view = Pinhole { world_from_eye, ..view() };
        let wide = wider(&view);
        assert!(wide.width_px > view.width_px && wide.width_px.is_multiple_of(2) && wide.height_px.is_multiple_of(2));
        let film = chart(&wide);
        let shown = turned(&film, &wide, &view);
        let (left, top) = ((wide.width_px - view.width_px) / 2, (wide.height_px - view.height_px) / 2);
        for (index, rgb) in shown.rgb.chunks_exact(3).enumerate() {
            let (x, y) = (index as u32 % view.width_px + left, index as u32 / view.width_px + top);
            assert_eq!(rgb, [x as u8 * 2, y as u8 * 4, 128], "at {index}");
        }
        assert!(shown.covered.is_some_and(|covered| covered.iter().all(|&covered| covered)));
    }

    #[test]
    fn turns_within_the_margin_uncover_nothing_and_larger_ones_do() {
        let holes = |turn_rad: f64| {
            let view = Pinhole {
                world_from_eye: Rigid { rotation: DQuat::from_rotation_y(turn_rad), ..Rigid::IDENTITY },
                ..view()
            };
            let wide = wider(&Pinhole { world_from_eye: Rigid::IDENTITY, ..view });
            let shown = turned(&chart(&wide), &wide, &view);
            shown.covered.map_or(0, |covered| covered.iter().filter(|&&covered| !covered).count())
        };
        assert_eq!((holes(0.9 * MARGIN_RAD), holes(-0.9 * MARGIN_RAD)), (0, 0));
        assert!(holes(2.0 * MARGIN_RAD) > 0);
    }

    #[test]
    fn a_turn_moves_the_picture_the_other_way() {
        let wide = wider(&view());
        let right = DQuat::from_rotation_y(0.05);
        let view = Pinhole { world_from_eye: Rigid { rotation: right, ..Rigid::IDENTITY }, ..view() };
        let looks_right = view.world_from_eye.transform_vector(DVec3::Z).x > 0.0;
        assert!(looks_right, "x is right, z forward");
        let middle = (18 * 64 + 32) * 3;
        let straight = wide.width_px as u8; // The middle's column is half of the width, and its red twice that.
        assert!(turned(&chart(&wide), &wide, &view).rgb[middle] > straight);
    }
}
