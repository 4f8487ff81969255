//! Which points of a lamp each pixel does not see, and how two answers differ.

use camera::Pinhole;
use glam::{DVec2, DVec3};
use server::discretize::Capture;

/// How much of a lamp each pixel does not see.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::topics) struct Hidden {
    pub points: usize,
    /// Which points, 64 a word; `None` where no surface is.
    pub pixels: Vec<Option<Vec<u64>>>,
    /// The share that a picture shows, 0 to 1.
    pub shares: Vec<f32>,
}

/// The 2016 paper's errors, section 6.2, over the pixels that show a surface in both, on its scale: 255 where every point is wrong.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::topics) struct Errors {
    /// Mean of the points that are resolved wrongly.
    pub visibility: f64,
    /// Of it the points that are taken to be hidden and are seen; the others are taken to be seen and are hidden.
    pub too_dark: f64,
    /// Mean of how wrong the share is that is seen: wrong ones of both kinds make good for each other.
    pub intensity: f64,
    /// The greatest error of a pixel's share.
    pub worst_intensity: f64,
    /// Pixels that were compared.
    pub pixels: usize,
}

impl Hidden {
    /// Of so many points, which a picture shows as they are.
    pub fn new(points: usize, pixels: Vec<Option<Vec<u64>>>) -> Hidden {
        let share = |words: &Vec<u64>| ones(words) as f32 / points as f32;
        let shares = pixels.iter().map(|words| words.as_ref().map_or(0.0, share)).collect();
        Hidden { points, pixels, shares }
    }

    /// The share of the lamp that each pixel sees, 0 to 255; 255 without a surface.
    pub fn seen(&self) -> Vec<u8> {
        let seen = |(words, share): (&Option<_>, &f32)| if words.is_some() { 255.0 * (1.0 - share) } else { 255.0 };
        self.pixels.iter().zip(&self.shares).map(|pixel| seen(pixel).round() as u8).collect()
    }

    /// How wrong it is, of as many points.
    pub fn errors(&self, truth: &Hidden) -> Option<Errors> {
        let scale = 255.0 / self.points as f64;
        let mut errors = Errors { visibility: 0.0, too_dark: 0.0, intensity: 0.0, worst_intensity: 0.0, pixels: 0 };
        let off = self.intensity_errors(truth);
        for ((own, of_truth), off) in self.pixels.iter().zip(&truth.pixels).zip(off) {
            let (Some(own), Some(of_truth)) = (own, of_truth) else { continue };
            let wrong: u32 = own.iter().zip(of_truth).map(|(a, b)| (a ^ b).count_ones()).sum();
            let too_dark: u32 = own.iter().zip(of_truth).map(|(a, b)| (a & !b).count_ones()).sum();
            let off = 255.0 * f64::from(off);
            errors.visibility += scale * f64::from(wrong);
            errors.too_dark += scale * f64::from(too_dark);
            errors.intensity += off;
            errors.worst_intensity = errors.worst_intensity.max(off);
            errors.pixels += 1;
        }
        let count = errors.pixels as f64;
        (errors.pixels > 0).then_some(Errors {
            visibility: errors.visibility / count,
            too_dark: errors.too_dark / count,
            intensity: errors.intensity / count,
            ..errors
        })
    }

    /// How wrong the share of each pixel is; 0 where one of both shows no surface.
    pub fn intensity_errors(&self, truth: &Hidden) -> Vec<f32> {
        let both = self.pixels.iter().zip(&truth.pixels).map(|(own, of_truth)| own.is_some() && of_truth.is_some());
        let off = self.shares.iter().zip(&truth.shares).map(|(own, of_truth)| (own - of_truth).abs());
        both.zip(off).map(|(both, off)| if both { off } else { 0.0 }).collect()
    }
}

pub(super) fn ones(words: &[u64]) -> u32 {
    words.iter().map(|word| word.count_ones()).sum()
}

/// What a pixel shows.
#[derive(Debug, Clone, Copy)]
pub(in crate::topics) struct Receiver {
    p_world: DVec3,
    normal_world: DVec3,
    triangle: u32,
}

/// What a view shows, from its full geometry; normals of surfaces with two sides face the view.
pub(in crate::topics) fn receivers(capture: &Capture, double_sided: &[bool]) -> Vec<Option<Receiver>> {
    let width = capture.camera.width_px as usize;
    let receiver = |index: usize| {
        let triangle = capture.ids[index][0];
        let (x, y) = ((index % width) as f64 + 0.5, (index / width) as f64 + 0.5);
        let ray = capture.camera.ray_eye_from_image(x, y);
        let p_world = capture.camera.world_from_eye.transform_point(ray / f64::from(capture.w(index)));
        let normal = protocol::image::octahedral_normal(capture.normal_code(index)).as_dvec3();
        let away = normal.dot(p_world - capture.camera.world_from_eye.translation) > 0.0;
        let turns = double_sided[usize::from(capture.colour[index][3])] && away;
        (triangle != 0).then_some(Receiver { p_world, normal_world: if turns { -normal } else { normal }, triangle })
    };
    (0..capture.ids.len()).map(receiver).collect()
}

/// The paper's truth: shadow maps of the full geometry. `seen` of every point of the lamp is looked up where a pixel's surface lies in it: the
/// point is seen where that texel shows the pixel's own triangle, or nothing nearer than the plane of the pixel's surface in the texel's middle.
pub(in crate::topics) struct MapTruth {
    receivers: Vec<Option<Receiver>>,
    points: usize,
    pixels: Vec<Option<Vec<u64>>>,
}

impl MapTruth {
    pub fn new(receivers: Vec<Option<Receiver>>, points: usize) -> MapTruth {
        let words = |receiver: &Option<Receiver>| receiver.map(|_| vec![0; points.div_ceil(64)]);
        let pixels = receivers.iter().map(words).collect();
        MapTruth { receivers, points, pixels }
    }

    /// Takes in what a point sees.
    pub fn add(&mut self, point: usize, seen: &Capture) {
        let map_from_world = seen.camera.world_from_eye.inverse();
        for (receiver, words) in self.receivers.iter().zip(&mut self.pixels) {
            let (Some(receiver), Some(words)) = (receiver, words) else { continue };
            if is_hidden(receiver, seen, &map_from_world) {
                words[point / 64] |= 1 << (point % 64);
            }
        }
    }

    pub fn done(self) -> Hidden {
        Hidden::new(self.points, self.pixels)
    }
}

fn is_hidden(receiver: &Receiver, seen: &Capture, map_from_world: &camera::Rigid) -> bool {
    let p = map_from_world.transform_point(receiver.p_world);
    let normal = map_from_world.transform_vector(receiver.normal_world);
    let facing = -normal.dot(p);
    if facing <= 0.0 {
        return true;
    }
    let Some(place) = seen.camera.image_from_eye(p).filter(|place| seen.camera.contains(*place)) else { return false };
    let (x, y) = (place.u.floor(), place.v.floor());
    let index = y as usize * seen.camera.width_px as usize + x as usize;
    if seen.ids[index][0] == 0 || seen.ids[index][0] == receiver.triangle {
        return false;
    }
    let slope = -normal.truncate() / (seen.camera.focal_px * facing);
    let plane_w = place.w + slope.dot(DVec2::new(x + 0.5 - place.u, y + 0.5 - place.v));
    // What depths in f32 leave: the way to them is in f32 too.
    let slack = 0.5 * (slope.x.abs() + slope.y.abs()) + place.w * 2f64.powi(-20);
    f64::from(seen.w(index)) > plane_w + slack
}

/// The pixels of a view.
pub(super) fn pixel_count(view: &Pinhole) -> usize {
    view.width_px as usize * view.height_px as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(points: usize, words: u64) -> Hidden {
        Hidden::new(points, vec![None, Some(vec![words])])
    }

    #[test]
    fn wrong_points_of_both_kinds_make_good_for_each_other_in_intensity_alone() {
        let (own, truth) = (of(16, 0b0000_0000_1100_1100), of(16, 0b0000_0000_1111_1000));
        let errors = own.errors(&truth).expect("a pixel shows a surface");
        let scale = 255.0 / 16.0;
        assert_eq!((errors.visibility, errors.too_dark), (3.0 * scale, scale));
        assert_eq!((errors.intensity, errors.pixels), (scale, 1));
        assert_eq!(own.intensity_errors(&truth), [0.0, 1.0 / 16.0]);
    }

    #[test]
    fn what_a_picture_shows_counts_in_intensity_alone() {
        let own = Hidden { shares: vec![0.9, 0.75], ..of(16, 0b1111_0000_0010_0101) };
        let errors = own.errors(&of(16, 0b0000_0000_1111_1111)).expect("a pixel shows a surface");
        assert_eq!((errors.intensity, errors.pixels), (255.0 * 0.25, 1));
        assert_eq!(errors.visibility, 255.0 * 9.0 / 16.0);
        assert_eq!(own.seen(), [255, 64]);
    }
}
