//! A measuring tape: the distance between two points that a person picked, and how far it may be off.

use camera::{Camera, Pinhole};
use glam::{DVec2, DVec3};
use protocol::{Held, Purpose};

/// A sample is of the picked surface where their inverse depths differ by no more than this share. Chosen: what a footprint spans of a surface at a grazing angle; a tenth of it
/// misses those, with ten times it what lies well behind counts.
const SAME_SURFACE: f64 = 0.02;

/// The cosine of the angle at which a surface counts as seen from the side at most: its samples then lie twenty times as far apart as those of one that faces the eye.
const LEAST_FACING: f64 = 0.05;

/// An end of the tape.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mark {
    /// Where.
    pub at_world: DVec3,
    /// How far apart samples of that surface are there, in metres; `None` where the surface is of none, as that of a body.
    pub footprint_m: Option<f64>,
}

impl Mark {
    /// A picked point, by the finest of what is held of it.
    pub fn of(held: &Held, at_world: DVec3) -> Mark {
        let spacings = held.patches.values().filter(|held| matches!(held.patch.purpose, Purpose::Eye | Purpose::Rest));
        let spacings = spacings.filter_map(|held| {
            let image = &held.patch.image;
            let Camera::Pinhole(camera) = &image.camera else { return None };
            let point = camera.image_from_world(at_world)?;
            if !camera.contains(point) {
                return None;
            }
            let (x, y) = (point.u as u32, point.v as u32);
            let index = image.mask.get(x, y).then(|| image.mask.occupied().position(|at| at == (x, y)))??;
            let w = f64::from(image.depth_scale.w(*image.depth.get(index)?));
            let towards = (at_world - camera.world_from_eye.translation).normalize_or_zero();
            // Samples of a surface that is seen from the side lie farther apart on it.
            let facing = image.normal_at(index).as_dvec3().dot(towards).abs().max(LEAST_FACING);
            ((w - point.w).abs() <= SAME_SURFACE * point.w).then(|| 1.0 / (point.w * camera.focal_px * facing))
        });
        Mark { at_world, footprint_m: spacings.reduce(f64::min) }
    }
}

/// At most two marks: a third one begins anew.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Tape {
    marks: Vec<Mark>,
}

impl Tape {
    /// Puts an end somewhere.
    pub fn mark(&mut self, mark: Mark) {
        if self.marks.len() == 2 {
            self.marks.clear();
        }
        self.marks.push(mark);
    }

    /// Its ends.
    pub fn marks(&self) -> &[Mark] {
        &self.marks
    }

    /// Metres, and by how many they may be off: each end lies within half a footprint of what was sampled.
    pub fn length_m(&self) -> Option<(f64, Option<f64>)> {
        let [a, b] = self.marks.as_slice() else { return None };
        let off_m = a.footprint_m.zip(b.footprint_m).map(|(a_m, b_m)| (a_m + b_m) / 2.0);
        Some((a.at_world.distance(b.at_world), off_m))
    }

    /// For a person.
    pub fn in_words(&self) -> String {
        match (self.length_m(), self.marks.len()) {
            (Some((length_m, off_m)), _) => {
                let off = off_m.map_or_else(String::new, |off_m| format!(" ± {}", metres(off_m, 1)));
                format!("{}{off}", metres(length_m, 4))
            }
            (None, 0) => "Click on one end".to_owned(),
            (None, _) => "Click on the other end".to_owned(),
        }
    }

    /// Where its ends are in a picture, in pixels, as far as they are before the eye: what lies behind it is cut off.
    pub fn in_picture(&self, camera: &Pinhole) -> Vec<DVec2> {
        let eye_from_world = camera.world_from_eye.inverse();
        let in_eye: Vec<DVec3> = self.marks.iter().map(|mark| eye_from_world.transform_point(mark.at_world)).collect();
        let before = |a: DVec3, other: Option<DVec3>| {
            if a.z >= camera.near_m {
                return Some(a);
            }
            let b = other.filter(|b| b.z > camera.near_m)?;
            Some(a.lerp(b, (camera.near_m - a.z) / (b.z - a.z)))
        };
        let other = |index: usize| in_eye.get(1 - index).copied();
        let ends = in_eye.iter().enumerate().filter_map(|(index, &end)| before(end, other(index)));
        ends.map(|end| camera.centre_px + DVec2::new(end.x, end.y) * (camera.focal_px / end.z)).collect()
    }
}

/// A length with so many digits, in the unit that suits it.
fn metres(length_m: f64, digits: i32) -> String {
    let (factor, unit) = match length_m {
        m if m < 0.01 => (1e3, "mm"),
        m if m < 1.0 => (1e2, "cm"),
        m if m < 1000.0 => (1.0, "m"),
        _ => (1e-3, "km"),
    };
    let value = length_m * factor;
    let whole_digits = value.max(1e-9).log10().floor() as i32 + 1;
    let decimals = (digits - whole_digits).clamp(0, 4) as usize;
    format!("{value:.decimals$} {unit}")
}

#[cfg(test)]
mod tests {
    use camera::Rigid;

    use super::*;

    fn mark(x_m: f64, footprint_m: Option<f64>) -> Mark {
        Mark { at_world: DVec3::new(x_m, 0.0, -2.0), footprint_m }
    }

    #[test]
    fn a_tape_has_two_ends_and_says_how_far_it_may_be_off() {
        let mut tape = Tape::default();
        assert_eq!(tape.in_words(), "Click on one end");
        tape.mark(mark(0.0, Some(0.004)));
        assert_eq!((tape.in_words(), tape.length_m()), ("Click on the other end".to_owned(), None));
        tape.mark(mark(1.25, Some(0.002)));
        assert_eq!(tape.in_words(), "1.250 m ± 3 mm");
        tape.mark(mark(7.0, None));
        assert_eq!(tape.marks(), [mark(7.0, None)], "the third begins anew");
        tape.mark(mark(7.5, Some(0.1)));
        assert_eq!(tape.in_words(), "50.00 cm", "of a body nothing says how far it is off");
    }

    #[test]
    fn lengths_have_units_that_suit_them() {
        let words = [0.00123, 0.0456, 12.3456, 12_345.0].map(|length_m| metres(length_m, 4));
        assert_eq!(words, ["1.230 mm", "4.560 cm", "12.35 m", "12.35 km"]);
    }

    #[test]
    fn what_lies_behind_the_eye_is_cut_off() {
        let camera = Pinhole::symmetric(Rigid::look_along(DVec3::ZERO, DVec3::NEG_Z), (100, 100), 1.0, 0.1);
        let mut tape = Tape::default();
        tape.mark(mark(0.0, None));
        assert_eq!(tape.in_picture(&camera), [DVec2::splat(50.0)]);
        tape.mark(Mark { at_world: DVec3::new(1.0, 0.0, 2.0), footprint_m: None });
        let ends = tape.in_picture(&camera);
        assert!(ends.len() == 2 && ends[1].x > 50.0 && ends[1].is_finite(), "{ends:?}");
        let away =
            Pinhole::symmetric(Rigid::look_along(DVec3::new(0.0, 0.0, -9.0), DVec3::NEG_Z), (100, 100), 1.0, 0.1);
        assert!(tape.in_picture(&away).is_empty());
    }
}
