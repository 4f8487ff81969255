//! Held samples whose place finer ones have taken.
//!
//! Of overlapping samples of one surface the finer is shown. One that a look shows nowhere, although its view sees where it is,
//! costs memory and time at both ends and adds nothing; and a coarse one of an outline reaches past it, seen from elsewhere. So the
//! viewer's own view gives up samples whose centre it sees, and of whose extent it shows all that it sees, and a margin, by
//! samples [`FINER`] times as dense. No pixel of that view changes by it; what of the extent it does not see is sent when it comes into
//! view.

use camera::Pinhole;
use glam::{DVec2, DVec3, Vec3};
use protocol::held::{HeldPatch, PatchId};
use protocol::{ObjectPose, Purpose};
use rayon::prelude::*;

use super::Account;
use super::compare::{Comparison, Point};
use super::findings::Lacking;
use super::record::{Record, Sample};
use super::samples::Address;

/// Samples an area over those of what they supersede, and the pixels around its extent that they reach over. Walking among pillars (two
/// seconds out and back, set back by a whole footprint, given up by the own view alone), as dense ones without a margin leave cracks between what is left: the way back then costs as much as the way out, as
/// dense ones with one half of it, twice as dense ones with one a quarter, as without superseding. Only four times as dense ones leave coarse
/// outlines: 4.8 % of false cover where it is worst, not 1.2 %.
const FINER: f32 = 2.0;
const MARGIN_PX: i32 = 1;
/// A view that samples a surface more sparsely than this share of a sample's density does not tell what overlaps it.
const LEAST_VIEW_DENSITY: f32 = 0.5;
/// An extent of more pixels a side is looked at no further: one pass over a view's samples must stay in proportion to the view.
const MOST_EXTENT_PX: i32 = 32;
/// Farther than any image is wide, and no sum of two of it leaves 32 bits.
const FAR_OFF_PX: f64 = 1e6;

/// A sample as the view sees it.
struct Flat {
    point: Point,
    /// Its plane: `w = m . r` for a ray `r` in the axes of the world.
    plane: Vec3,
    /// What its pixel spans at its depth, in metres: by so much it may be hidden by others.
    footprint_m: f32,
    /// The pixel of its centre.
    centre_px: (i32, i32),
    /// Pixels of its extent: first and last column, first and last row.
    extent_px: [(i32, i32); 2],
}

impl Account {
    /// What is superseded in a view that is brought up to date by what it lacks, beside what that replaces. Addresses ascend.
    pub fn superseded(&self, view: &Comparison<'_, Account>, lacking: &Lacking) -> Vec<Address> {
        let shown = view.shown_densities(&lacking.send);
        let is_in_view = |id: &PatchId| self.surfaces(Purpose::Eye).is_some_and(|s| s.may_show(*id, view.camera()));
        let patches: Vec<_> = self.held.patches.iter().filter(|(id, _)| is_in_view(id)).collect();
        let of_patch = |(id, held): (&PatchId, &HeldPatch)| {
            let record = self.known.records.get(id);
            record.map(|record| self.superseded_of(*id, held, record, view, &shown)).unwrap_or_default()
        };
        patches.into_par_iter().flat_map_iter(of_patch).filter(|address| !lacking.replaces(*address)).collect()
    }

    fn superseded_of(
        &self,
        id: PatchId,
        held: &HeldPatch,
        record: &Record,
        view: &Comparison<'_, Account>,
        shown: &[f32],
    ) -> Vec<Address> {
        let image = &held.patch.image;
        let carried = |pose: &ObjectPose| self.held.poses_now.get(&pose.object) != Some(&pose.world_from_object);
        let carried: Vec<u16> = held.patch.objects.iter().filter(|pose| carried(pose)).map(|p| p.object).collect();
        let eyes = Eyes::new(image.camera.root(), view.camera());
        let mut superseded = Vec::new();
        for (index, (x, y)) in image.mask.occupied().enumerate() {
            let (object, address) = (image.object[index], (id, x as u16, y as u16));
            let w = image.depth_scale.w(image.depth[index]);
            // Most end here: they are out of sight, or as fine as what shows.
            let Some(centre) = eyes.pixel_inside(f64::from(x) + 0.5, f64::from(y) + 0.5, w) else { continue };
            let Some(sample) = record.sample(address.1, address.2) else { continue };
            if view.at_if_inside(centre).is_none_or(|at| shown[at] < FINER * sample.density)
                || carried.contains(&object)
            {
                continue;
            }
            let (normal, w_step) = (image.normal_at(index), image.depth_scale.w_step);
            let &Sample { triangle, density, .. } = sample;
            let point = Point { w, normal, object, triangle, w_step, density };
            let Some(flat) = eyes.flat((x, y), point, centre) else { continue };
            if view.is_superseded(&flat, shown) {
                superseded.push(address);
            }
        }
        superseded
    }
}

/// From a patch's image to a view's eye: linear in `(u, v, w)` for a point times its `w`.
struct Eyes<'a> {
    from: &'a Pinhole,
    to: &'a Pinhole,
    /// A pixel to the right, and down.
    right: DVec3,
    down: DVec3,
    /// The ray of the image's top left corner.
    corner: DVec3,
    from_eye: DVec3,
}

impl<'a> Eyes<'a> {
    fn new(from: &'a Pinhole, to: &'a Pinhole) -> Eyes<'a> {
        let to_from = (to.world_from_eye.inverse() * from.world_from_eye).to_affine();
        let turned = |ray: DVec3| to_from.transform_vector3(ray);
        let (right, down) = (turned(DVec3::X) / from.focal_px, turned(DVec3::Y) / from.focal_px);
        let corner = turned(from.ray_eye_from_image(0.0, 0.0));
        Eyes { from, to, right, down, corner, from_eye: to_from.translation }
    }

    /// Where a point of the patch's image is in the view's eye space, times `w`.
    fn point_times_w(&self, u: f64, v: f64, w: f64) -> DVec3 {
        self.right * u + self.down * v + self.corner + self.from_eye * w
    }

    /// Where in the view's image a point is, if it lies before its near plane.
    fn image_point(&self, u: f64, v: f64, w: f32) -> Option<DVec2> {
        let eye = self.point_times_w(u, v, w.into());
        let is_before = eye.z > self.to.near_m * f64::from(w);
        is_before.then(|| self.to.centre_px + self.to.focal_px / eye.z * eye.truncate())
    }

    /// The pixel there; what is far off the view is taken to be [`FAR_OFF_PX`] from it.
    fn pixel(&self, u: f64, v: f64, w: f32) -> Option<(i32, i32)> {
        let pixel = |at: f64| at.floor().clamp(-FAR_OFF_PX, FAR_OFF_PX) as i32;
        self.image_point(u, v, w).map(|at| (pixel(at.x), pixel(at.y)))
    }

    /// The same, if the view's image has it: without a call into the maths library.
    fn pixel_inside(&self, u: f64, v: f64, w: f32) -> Option<(i32, i32)> {
        let is_inside = |at: &DVec2| {
            at.x >= 0.0 && at.y >= 0.0 && at.x < self.to.width_px.into() && at.y < self.to.height_px.into()
        };
        self.image_point(u, v, w).filter(is_inside).map(|at| (at.x as i32, at.y as i32))
    }

    /// `point` is of the patch's image, its normal in world space.
    fn flat(&self, (x, y): (u32, u32), point: Point, centre_px: (i32, i32)) -> Option<Flat> {
        let (u, v) = (f64::from(x) + 0.5, f64::from(y) + 0.5);
        let normal = point.normal.as_dvec3();
        let ray = |u: f64, v: f64| self.from.world_from_eye.transform_vector(self.from.ray_eye_from_image(u, v));
        let facing = normal.dot(ray(u, v));
        let mut extent_px = [(i32::MAX, i32::MIN); 2];
        for (du, dv) in [(-0.5, -0.5), (0.5, -0.5), (-0.5, 0.5), (0.5, 0.5)] {
            let tilt = normal.dot(ray(u + du, v + dv)) / facing;
            let (column, row) = self.pixel(u + du, v + dv, point.w * tilt.clamp(0.5, 2.0) as f32)?;
            for (range, at) in extent_px.iter_mut().zip([column, row]) {
                *range = (range.0.min(at), range.1.max(at));
            }
        }
        let centre_world_times_w = self.to.world_from_eye.transform_vector(self.point_times_w(u, v, point.w.into()));
        let plane = (normal * f64::from(point.w) / normal.dot(centre_world_times_w)).as_vec3();
        let footprint_m = (1.0 / (self.from.focal_px * f64::from(point.w))) as f32;
        plane.is_finite().then_some(Flat { point, plane, footprint_m, centre_px, extent_px })
    }
}

impl Comparison<'_, Account> {
    fn is_superseded(&self, sample: &Flat, shown: &[f32]) -> bool {
        let [columns, rows] = sample.extent_px.map(|(first, last)| (first - MARGIN_PX, last + MARGIN_PX));
        let (x, y) = sample.centre_px;
        let tells = self.view_density(x, y) >= LEAST_VIEW_DENSITY * sample.point.density;
        let is_small = columns.1 - columns.0 < MOST_EXTENT_PX && rows.1 - rows.0 < MOST_EXTENT_PX;
        let is_shown_finer = |(x, y)| {
            let at = self.at_if_inside((x, y)).filter(|_| self.lies_on(x, y, sample));
            at.is_none_or(|at| shown[at] >= FINER * sample.point.density)
        };
        tells
            && is_small
            && self.lies_on(x, y, sample)
            && (rows.0..=rows.1).flat_map(|y| (columns.0..=columns.1).map(move |x| (x, y))).all(is_shown_finer)
    }

    /// Whether the hit of a pixel lies on the sample's plane, and faces the same way.
    fn lies_on(&self, x: i32, y: i32, sample: &Flat) -> bool {
        self.truth_at(x, y).is_some_and(|hit| {
            let apart = (hit.w - sample.plane.dot(self.ray(x, y))).abs();
            hit.object == sample.point.object
                && self.is_same_way(&hit, &sample.point)
                && apart <= self.tolerance(&hit, &sample.point, x, y) + hit.w * hit.w * sample.footprint_m
        })
    }
}
