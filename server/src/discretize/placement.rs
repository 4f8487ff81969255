//! Where the images of a set are taken from, and how many there are (ours; Xie, Wang, Popescu 2016, §7, leave both to trial and error).
//!
//! *Probes* are small conventional images from every place that comes into question. What a probe sees and no image of the set
//! would hold is missing; what one view would add is asked of its own probe. Views are taken one by one, always the one that adds the
//! most to all probes together (greedy covering, which finds at least 1 - 1/e of what the best choice of as many would:
//! Nemhauser, Wolsey, Fisher 1978), until little enough is missing or the budget is spent. So a scene that one image covers gets one.
//!
//! Probes are compared by [`RedundancyTest::Nearby`]: at their size, most triangles are smaller than a pixel, and outlines, which each
//! rounds to its own pixels, are much of a picture. They do not know of what images hold behind what they drop, so what is missing
//! is rather over-estimated.

use camera::Pinhole;
use glam::DVec2;
use rayon::prelude::*;

use super::redundancy::redundant_samples;
use super::{Capture, Redundancy, RedundancyTest};

/// Which views a set by itself is made of.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, clap::ValueEnum)]
pub enum Placement {
    /// The middle of the view region and evenly around its rim.
    #[default]
    Fixed,
    /// As many as are of use, and where they are: by probes.
    Probes,
}

/// The longer side of a probe that views are chosen by.
pub const PROBE_PX: u32 = 96;

/// When no more images are added.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Budget {
    /// Images at most.
    pub images: usize,
    /// Share of the probes' samples that may be missing.
    pub missing: f64,
}

impl Budget {
    /// As many images as `images`, and none for less than 0.05 % of what is seen: probes do not find what is narrower than one of their
    /// pixels, so little that is found stands for more.
    pub fn of(images: usize) -> Budget {
        Budget { images, missing: 0.0005 }
    }
}

/// The views of a set.
#[derive(Debug, Clone, PartialEq)]
pub struct Chosen {
    /// Indices of the probes, in the order of the images.
    pub views: Vec<usize>,
    /// Share of the probes' samples that is missing with the first view, with the first two, and so on.
    pub missing: Vec<f64>,
}

/// A probe of a view: the same field, its longer side of so many pixels.
pub fn probe(view: &Pinhole, longer_px: u32) -> Pinhole {
    let share = f64::from(longer_px) / f64::from(view.width_px.max(view.height_px));
    let side = |side_px: u32| ((f64::from(side_px) * share).round() as u32).max(1);
    Pinhole {
        width_px: side(view.width_px),
        height_px: side(view.height_px),
        focal_px: view.focal_px * share,
        centre_px: view.centre_px * share,
        ..*view
    }
}

/// Chooses views among those of `probes`; the first one is taken first. What counts as missing lies within `half_field`, the
/// tangents of what a viewer sees to each side: images are wider, so that they hold what other eyes see beside it.
pub fn place(probes: &[Capture], half_field: DVec2, budget: Budget) -> Chosen {
    let mut chosen = Chosen { views: Vec::new(), missing: Vec::new() };
    if probes.is_empty() || budget.images == 0 {
        return chosen;
    }
    // What is missing of each probe, sample by sample.
    let mut missing: Vec<Vec<bool>> = probes.iter().map(|probe| shown(probe, half_field)).collect();
    let total = missing.iter().flatten().filter(|shown| **shown).count().max(1);
    // The other views are only looked at where the first one is not enough.
    let mut held_by = vec![held_by_view(probes, 0)];
    let mut next = 0;
    loop {
        chosen.views.push(next);
        for (missing, held) in missing.iter_mut().zip(&held_by[next]) {
            missing.iter_mut().zip(held).for_each(|(missing, held)| *missing &= !held);
        }
        let left = missing.iter().flatten().filter(|missing| **missing).count();
        chosen.missing.push(left as f64 / total as f64);
        if left as f64 <= budget.missing * total as f64 || chosen.views.len() >= budget.images {
            return chosen;
        }
        held_by.extend((held_by.len()..probes.len()).map(|view| held_by_view(probes, view)));
        let gain = |view: usize| -> usize {
            let of_probe = |(missing, held): (&Vec<bool>, &Vec<bool>)| {
                missing.iter().zip(held).filter(|(missing, held)| **missing && **held).count()
            };
            missing.iter().zip(&held_by[view]).map(of_probe).sum()
        };
        // The first of equals, so that the choice is the same everywhere.
        let best = (0..probes.len()).map(|view| (gain(view), std::cmp::Reverse(view))).max();
        match best {
            Some((added, std::cmp::Reverse(view))) if added > 0 => next = view,
            _ => return chosen,
        }
    }
}

/// Which samples of a probe a viewer there would see.
fn shown(probe: &Capture, half_field: DVec2) -> Vec<bool> {
    let camera = &probe.camera;
    let is_shown = |index: usize| {
        let (x, y) = (index as u32 % camera.width_px, index as u32 / camera.width_px);
        let place = DVec2::new(x.into(), y.into()) + 0.5;
        ((place - camera.centre_px) / camera.focal_px).abs().cmple(half_field).all()
    };
    (0..probe.ids.len()).filter(|&index| probe.ids[index][0] != 0).map(is_shown).collect()
}

/// Which samples of each probe the own probe of a view holds.
fn held_by_view(probes: &[Capture], view: usize) -> Vec<Vec<bool>> {
    // Nearness in space does not depend on where coordinates begin as long as no ray is followed.
    let anchor_world = probes[0].camera.world_from_eye.translation;
    let held = |probe: usize| {
        let samples = &probes[probe];
        if probe == view {
            return vec![true; samples.ids.iter().filter(|ids| ids[0] != 0).count()];
        }
        let by = Redundancy::by(RedundancyTest::Nearby);
        redundant_samples(samples, std::slice::from_ref(&probes[view]), by, anchor_world, None)
    };
    (0..probes.len()).into_par_iter().map(held).collect()
}

#[cfg(test)]
mod tests {
    use camera::Rigid;
    use glam::DVec3;

    use super::*;

    /// A wall 2 m away, as an eye at `x` sees it with a narrow field: columns that other eyes may not see.
    fn probe(x: f64) -> Capture {
        let size_px = 8;
        let eye = Rigid::look_along(DVec3::new(x, 0.0, 0.0), DVec3::NEG_Z);
        let camera = Pinhole::symmetric(eye, (size_px, size_px), 1.0, 0.1);
        let pixels = (size_px * size_px) as usize;
        // Octahedral code of +z, towards the eye.
        let normal = protocol::image::octahedral_code(glam::Vec3::Z);
        let ids = [1, 1 | u32::from(normal[0]) << 16 | u32::from(normal[1]) << 24];
        let (ids, colour, depth) = (vec![ids; pixels], vec![[0; 4]; pixels], vec![0.05; pixels]);
        Capture {
            camera,
            ids,
            colour,
            rests: vec![[0; 2]; pixels],
            hides: Vec::new(),
            depth,
            ends: Vec::new(),
            gpu_s: None,
        }
    }

    #[test]
    fn one_image_is_enough_where_all_see_the_same() {
        let probes = vec![probe(0.0); 4];
        let placement = place(&probes, DVec2::INFINITY, Budget::of(4));
        assert_eq!(placement, Chosen { views: vec![0], missing: vec![0.0] });
    }

    #[test]
    fn the_view_that_adds_the_most_comes_next() {
        // Distinct triangles, so that only what lies in the field of view is shared.
        let probes: Vec<Capture> = [0.0, 0.1, 50.0, 50.1, 50.2].map(probe).to_vec();
        let placement = place(&probes, DVec2::INFINITY, Budget { images: 5, missing: 0.2 });
        assert_eq!(placement.views, [0, 3], "the middle of the three that the first does not see");
        assert!(placement.missing[0] > 0.55 && placement.missing[1] < 0.2, "{:?}", placement.missing);
        assert_eq!(place(&probes, DVec2::INFINITY, Budget { images: 1, missing: 0.0 }).views, [0], "the budget");
        assert!(place(&[], DVec2::INFINITY, Budget::of(4)).views.is_empty());
    }
}
