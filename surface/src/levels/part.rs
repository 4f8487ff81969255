//! A part of a patch's quads, and how a view shows it: plain values, whose bytes can be handed over.

use bytemuck::{Pod, Zeroable};
use camera::Pinhole;
use glam::{DVec2, DVec3, Vec3};

use crate::tiles::{Bounds, Pyramid};

/// Quads over 1, 2, 4 and 8 samples along a side; a part's side is a multiple.
pub const LEVELS: usize = 4;
/// A level is drawn where what its quads bend along rays comes to no more pixels than this, so that cracks beside finer quads stay far below one.
const MOST_BEND_PX: f64 = 0.125;
/// A level is drawn where the longest side of its quads comes to no more pixels than this: they are from half of a pixel large to two. Of a machine full of ribs, held
/// with up to two samples a pixel, FLIP is the same with 1, the square root of 2 and 2.
const LONGEST_PX: f64 = std::f64::consts::SQRT_2;

/// One square part of a patch.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub struct Part {
    /// Around the planes of its triangles.
    pub planes: Planes,
    /// Around its corners.
    pub bounds: Bounds,
    /// Not 0 where something in it may have moved since.
    pub moves: u32,
    /// How many levels it has, from the finest on; at least one.
    level_count: u32,
    levels: [Level; LEVELS],
}

impl Part {
    pub fn new(finest: Level) -> Part {
        let levels = [finest, Level::zeroed(), Level::zeroed(), Level::zeroed()];
        Part { planes: Planes::NONE, bounds: Bounds::around([]), moves: 0, level_count: 1, levels }
    }

    /// Whether there are as many levels as can be.
    pub fn has_levels(&self) -> bool {
        (1..=LEVELS as u32).contains(&self.level_count)
    }

    pub fn levels(&self) -> &[Level] {
        &self.levels[..self.level_count as usize]
    }

    pub fn add_level(&mut self, level: Level) {
        self.levels[self.level_count as usize] = level;
        self.level_count += 1;
    }

    /// Draws it as finely as it is held from now on.
    pub fn refine(&mut self) {
        self.level_count = 1;
    }
}

/// How a view shows a part.
#[derive(Debug, Clone, Copy)]
pub struct Seen {
    /// Pixels of the view at most that one of the patch's image comes to.
    px_of_px: f64,
    /// Pixels of the patch's image at most that a length along the ray comes to, which is as long as its depth.
    along_px: f64,
}

impl Seen {
    /// `eye`: the view's, in the patch's eye space. From beside, what lies along a ray is seen under the angle between that ray and the eye's own, whose sine is no
    /// more than the eye's distance from the ray over that from the point.
    pub fn new(part: &Part, (pyramid, eye): (&Pyramid, DVec3), (view, camera): (&Pinhole, &Pinhole)) -> Seen {
        let nearer = pyramid.least_depth_share(&part.bounds).max(0.0);
        let sine = (eye.length() * part.bounds.nearest_w() / nearer).min(1.0);
        let corner_px = DVec2::new(camera.width_px.into(), camera.height_px.into());
        let farthest_px = camera.centre_px.max(corner_px - camera.centre_px).length();
        Seen { px_of_px: view.focal_px / camera.focal_px / nearer, along_px: sine * camera.focal_px.hypot(farthest_px) }
    }
}

/// A box around planes, each as the vector `n` with `n . p = 1` for all of its points `p`, in the eye space of the patch at capture: the patch's
/// own eye has `n . p = 0`, and is before all of them.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub struct Planes {
    low: DVec3,
    high: DVec3,
}

impl Planes {
    pub const NONE: Planes = Planes { low: DVec3::INFINITY, high: DVec3::NEG_INFINITY };

    /// With the planes of a quad's two triangles: its corners are given in the image, as [`ProvokingVertex::corners`] has them.
    pub fn with(self, [a, b, c, d]: [Vec3; 4], camera: &Pinhole) -> Planes {
        [[a, d, b], [a, c, d]].into_iter().fold(self, |around, [a, b, c]| {
            // `w` is linear in the image: `w = n . ray`.
            let (to_b, to_c) = ((b - a).as_dvec3(), (c - a).as_dvec3());
            let area = to_b.x * to_c.y - to_b.y * to_c.x;
            let right = (to_b.z * to_c.y - to_c.z * to_b.y) / area * camera.focal_px;
            let down = (to_c.z * to_b.x - to_b.z * to_c.x) / area * camera.focal_px;
            let ray = camera.ray_eye_from_image(a.x.into(), a.y.into());
            let n = DVec3::new(right, down, f64::from(a.z) - right * ray.x - down * ray.y);
            // A triangle without an area shows nothing.
            if area == 0.0 { around } else { Planes { low: around.low.min(n), high: around.high.max(n) } }
        })
    }

    /// Whether an eye lies behind all of them, or there are none.
    pub fn are_all_before(&self, eye: DVec3) -> bool {
        // Products of nothing and infinity are no numbers; nor is any comparison with them true.
        self.low.x > self.high.x || (self.low * eye).min(self.high * eye).element_sum() >= 1.0
    }
}

/// The quads of a part at a level.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub struct Level {
    /// Their first index ...
    pub first: u32,
    /// ... and what is behind the last one.
    pub end: u32,
    /// Of those that stand for several.
    pub most: Coarseness,
}

/// How coarse quads are at most, seen from where they were captured.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default, PartialEq, Pod, Zeroable)]
pub struct Coarseness {
    /// Their sides across the ray, in pixels of the patch's image.
    across_px: f32,
    /// How much nearer the one end of a side is than the other, as a share of its depth: what an eye beside sees of it.
    along: f32,
    /// How far they bend along the ray, likewise.
    bend: f32,
}

impl Coarseness {
    /// The most of both, with a quad between four corners in the image that bends by so much.
    pub fn with(self, [a, b, c, d]: [Vec3; 4], bend: f32) -> Coarseness {
        let most = Coarseness { bend: self.bend.max(bend), ..self };
        [(a, b), (a, c), (b, d), (c, d)].into_iter().fold(most, |most, (from, to)| {
            let across_px = from.truncate().distance(to.truncate());
            let along = (from.z - to.z).abs() / from.z.min(to.z);
            Coarseness { across_px: most.across_px.max(across_px), along: most.along.max(along), ..most }
        })
    }

    /// Whether a view cannot tell.
    pub fn is_unseen(self, seen: &Seen) -> bool {
        let along_px = |along: f32| f64::from(along) * seen.along_px * seen.px_of_px;
        f64::from(self.across_px) * seen.px_of_px + along_px(self.along) <= LONGEST_PX
            && along_px(self.bend) <= MOST_BEND_PX
    }
}
