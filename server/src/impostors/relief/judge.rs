//! Whether images of a shape hold what viewers see of it: views from all around are laid beside rays against the images, as a
//! client will follow them.

use camera::{Camera, Pinhole, Rigid};
use glam::DVec3;
use impostor::{Impostor, Method, Ray, Side, Steps};
use rayon::prelude::*;
use scene::{Scene, Snapshot};

use super::key::End;
use super::picture::{DISTANCE_RADII, SIDE_PX, camera, impostor, picture, relief, turned_back};
use crate::imager::{Imager, ImagerError};

/// A viewer may be so far in the other half of space before an object is shown by the other image: the sine of ten degrees.
const PAST_HALF: f64 = 0.17;
/// Images serve a shape where at most this share of the pixels that show it are wrong, over all views: 3.1 % of a barrel by both images, 3.9 % of a box by one, 13 % and more of posts.
const MOST_WRONG: f64 = 0.035;
/// And in no view more than this: 7.1 % of a barrel, which has a crack of a few pixels there; 7.6 % of a box by one image, which has a hole in the foot of each side; 30 % and more of posts.
const MOST_WRONG_IN_A_VIEW: f64 = 0.075;
/// The side of the images that are judged, in pixels: the finest. Coarser ones are looked at from further away.
const IMAGE_PX: u32 = SIDE_PX[1];
/// The side of the views, in pixels: odd, so that what is thin and in the middle is seen.
const VIEW_PX: u32 = 33;
/// How far a ray may end from what the view shows around its pixel, in pixels of the view: half for where in its pixel each lies, one for
/// the image's own, and as much again for surfaces seen aslant.
const OFF_PX: f64 = 3.0;

/// What was found about a shape.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Verdict {
    /// In mesh space, unit length.
    pub axis: DVec3,
    /// By the image from either end, in views of its half of space.
    pub wrong: [Wrong; 2],
    /// By both, in all views.
    pub wrong_by_both: Wrong,
}

/// Of the pixels that show a shape, what images of it get wrong.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Wrong {
    /// The share over all views.
    share: f64,
    /// The greatest share of a view.
    worst: f64,
}

impl Wrong {
    const ALL: Wrong = Wrong { share: 1.0, worst: 1.0 };

    fn serves(self) -> bool {
        self.share <= MOST_WRONG && self.worst <= MOST_WRONG_IN_A_VIEW
    }
}

impl std::fmt::Display for Wrong {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{:.1} % ({:.1} % in the worst view)", 100.0 * self.share, 100.0 * self.worst)
    }
}

impl Verdict {
    pub const NONE: Verdict = Verdict { axis: DVec3::Y, wrong: [Wrong::ALL; 2], wrong_by_both: Wrong::ALL };

    /// The ends whose images show it to a viewer in a direction (in mesh space, unit length), who is shown those from `now`.
    pub fn ends_for(&self, to_eye: DVec3, now: &[End]) -> Vec<End> {
        let height = to_eye.dot(self.axis);
        let stays = |end: &End| height * end.sign() > -PAST_HALF;
        let nearer = if height < 0.0 { End::Lower } else { End::Upper };
        let alone = match now {
            [end] if stays(end) => *end,
            _ => nearer,
        };
        if self.wrong[alone as usize].serves() {
            vec![alone]
        } else if self.wrong_by_both.serves() {
            End::BOTH.to_vec()
        } else {
            Vec::new()
        }
    }
}

/// A view of the object, and its rays.
#[derive(Debug)]
struct View {
    /// From the object to the eye, in mesh space.
    towards: DVec3,
    camera: Pinhole,
    /// By pixel; `None` where it shows nothing.
    points_world: Vec<Option<DVec3>>,
}

/// A verdict in the making. It takes a software renderer a second, so it is made in steps: the views first, then one axis after the other.
#[derive(Debug)]
pub(super) struct Judging {
    object: u16,
    views: Vec<View>,
    /// Still to be tried; the next one is the last.
    axes: Vec<DVec3>,
    best: Verdict,
}

/// All steps at once.
pub(super) fn judge(
    scene: &Scene,
    snapshot: &Snapshot,
    object: u16,
    imager: &mut dyn Imager,
) -> Result<Verdict, ImagerError> {
    let mut judging = Judging::begin(scene, snapshot, object, imager)?;
    loop {
        if let Some(verdict) = judging.step(scene, snapshot, imager)? {
            return Ok(verdict);
        }
    }
}

impl Judging {
    /// Looks at an object from all around.
    pub fn begin(
        scene: &Scene,
        snapshot: &Snapshot,
        object: u16,
        imager: &mut dyn Imager,
    ) -> Result<Judging, ImagerError> {
        let views = views(scene, snapshot, object, imager)?;
        let up = turned_back(&snapshot.world_from_mesh[usize::from(object)], DVec3::Y);
        let mut axes = [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| axis * up.dot(axis).signum()).to_vec();
        axes.sort_by(|a, b| up.dot(*a).total_cmp(&up.dot(*b)));
        Ok(Judging { object, views, axes, best: Verdict::NONE })
    }

    /// Tries one of the mesh's axes, the one that points upwards most first, until both images together serve; the best of them otherwise.
    pub fn step(
        &mut self,
        scene: &Scene,
        snapshot: &Snapshot,
        imager: &mut dyn Imager,
    ) -> Result<Option<Verdict>, ImagerError> {
        if let Some(axis) = self.axes.pop() {
            let verdict = self.try_axis(axis, (scene, snapshot), imager)?;
            // One that serves is the last.
            let is_better = |Verdict { wrong_by_both: both, .. }: &Verdict| {
                both.serves() || both.share < self.best.wrong_by_both.share
            };
            self.best = verdict.filter(is_better).unwrap_or(self.best);
        }
        let serves = self.best.wrong_by_both.serves();
        if !serves && !self.axes.is_empty() {
            return Ok(None);
        }
        let Verdict { wrong: [upper, lower], wrong_by_both: both, .. } = self.best;
        tracing::info!(
            "{:?} is {}: images from one end of it, the other and both get wrong {upper}, {lower} and {both} of its pixels",
            scene.instances[usize::from(self.object)].name,
            if serves { "a relief" } else { "no relief" }
        );
        Ok(Some(self.best))
    }

    fn try_axis(
        &self,
        axis: DVec3,
        (scene, snapshot): (&Scene, &Snapshot),
        imager: &mut dyn Imager,
    ) -> Result<Option<Verdict>, ImagerError> {
        let mut images = Vec::new();
        for end in End::BOTH {
            let Some(camera) = camera(scene, snapshot, self.object, axis * end.sign(), IMAGE_PX) else { continue };
            let Some(image) = relief(imager, snapshot, self.object, &camera)? else { continue };
            images.extend(impostor(&image));
        }
        let [upper, lower] = images.as_slice() else { return Ok(None) };
        let wrong = [wrong_by(&[upper], Some(axis), &self.views), wrong_by(&[lower], Some(-axis), &self.views)];
        Ok(Some(Verdict { axis, wrong, wrong_by_both: wrong_by(&[upper, lower], None, &self.views) }))
    }
}

/// From the 26 directions of a cube's faces, edges and corners.
fn views(scene: &Scene, snapshot: &Snapshot, object: u16, imager: &mut dyn Imager) -> Result<Vec<View>, ImagerError> {
    let Some(bounds) = scene.bounds_of(snapshot, object) else { return Ok(Vec::new()) };
    let world_from_object = &snapshot.world_from_mesh[usize::from(object)];
    let radius_m = bounds.min.distance(bounds.max) / 2.0;
    let fov_rad = 2.0 * (1.0 / DISTANCE_RADII).asin();
    let mut views = Vec::new();
    for index in (0..27).filter(|&index| index != 13) {
        let direction = DVec3::new(f64::from(index % 3), f64::from(index / 3 % 3), f64::from(index / 9)) - 1.0;
        let towards_world = (world_from_object.matrix3 * direction).normalize_or_zero();
        let eye_world = bounds.middle() + towards_world * DISTANCE_RADII * radius_m;
        let world_from_eye = Rigid::look_at(eye_world, bounds.middle());
        let camera = Pinhole::symmetric(world_from_eye, (VIEW_PX, VIEW_PX), fov_rad, radius_m);
        let Some(image) = picture(imager, snapshot, object, &Camera::Pinhole(camera))? else { continue };
        let mut points_world = vec![None; (VIEW_PX * VIEW_PX) as usize];
        for (index, (x, y)) in image.mask.occupied().enumerate() {
            let w = image.depth_scale.w(image.depth[index]).into();
            let point = camera::ImagePoint { u: f64::from(x) + 0.5, v: f64::from(y) + 0.5, w };
            points_world[(y * VIEW_PX + x) as usize] = Some(camera.world_from_image(point));
        }
        views.push(View { towards: direction.normalize(), camera, points_world });
    }
    Ok(views)
}

/// What rays against images get wrong in views of half of space around `axis`, or in all.
fn wrong_by(images: &[&Impostor], axis: Option<DVec3>, views: &[View]) -> Wrong {
    let seen = views.par_iter().filter(|view| axis.is_none_or(|axis| view.towards.dot(axis) > -PAST_HALF));
    let counts: Vec<[u32; 2]> = seen.map(|view| view.wrong_and_shown(images)).collect();
    // A view that shows next to nothing, as of a plate from its edge, says little of it.
    let share = |[wrong, shown]: [u32; 2], least: u32| f64::from(wrong) / f64::from(shown.max(least));
    let all = counts.iter().fold([0; 2], |sum, view| [sum[0] + view[0], sum[1] + view[1]]);
    let worst = counts.iter().map(|&view| share(view, 2 * VIEW_PX)).fold(0.0, f64::max);
    Wrong { share: share(all, 1), worst }
}

impl View {
    /// Pixels that rays get wrong, and pixels that show the object.
    fn wrong_and_shown(&self, images: &[&Impostor]) -> [u32; 2] {
        let side = VIEW_PX as i32;
        let of = |points: &[Option<DVec3>], x: i32, y: i32| {
            let inside = (0..side).contains(&x) && (0..side).contains(&y);
            if inside { points[(y * side + x) as usize] } else { None }
        };
        let point = |x: i32, y: i32| of(&self.points_world, x, y);
        let met: Vec<Option<DVec3>> =
            (0..side).flat_map(|y| (0..side).map(move |x| (x, y))).map(|pixel| self.met(images, pixel)).collect();
        let met = |x: i32, y: i32| of(&met, x, y);
        let (mut wrong, mut shown) = (0, 0);
        for (x, y) in (0..side).flat_map(|y| (0..side).map(move |x| (x, y))) {
            let around = || (-1..=1).flat_map(|dy| (-1..=1).map(move |dx| (x + dx, y + dy)));
            let is_shown = point(x, y).is_some();
            let is_wrong = match met(x, y) {
                // Within an outline nothing may be missing; and what is thinner than that, as a post, may not be missing altogether.
                None => {
                    around().all(|(x, y)| point(x, y).is_some())
                        || is_shown && around().all(|(x, y)| met(x, y).is_none())
                }
                Some(met) => {
                    let off_m = OFF_PX * met.distance(self.camera.world_from_eye.translation) / self.camera.focal_px;
                    !around().filter_map(|(x, y)| point(x, y)).any(|point| point.distance(met) <= off_m)
                }
            };
            wrong += u32::from(is_wrong);
            shown += u32::from(is_shown);
        }
        [wrong, shown]
    }

    /// What a pixel's ray meets of images, in world space.
    fn met(&self, images: &[&Impostor], (x, y): (i32, i32)) -> Option<DVec3> {
        let Rigid { translation: eye_world, .. } = self.camera.world_from_eye;
        let direction_eye = self.camera.ray_eye_from_image(f64::from(x) + 0.5, f64::from(y) + 0.5);
        let ray = Ray::endless(eye_world, self.camera.world_from_eye.transform_vector(direction_eye));
        let steps = Steps { method: Method::Hierarchy, fine_px: 1.0 };
        let hits = images.iter().filter_map(|image| image.hit(&ray, steps).hit);
        let hit = hits.filter(|hit| hit.side == Side::Front).min_by(|a, b| a.t.total_cmp(&b.t))?;
        Some(ray.at(hit.t))
    }
}
