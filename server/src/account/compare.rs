//! A view of the scene beside the same view of what the client holds: what is lacking, and what covers falsely.
//!
//! Both are planes of one camera, so everything happens in the image. A surface is `w` at a pixel's centre with a normal; on
//! its plane `w` at another pixel is `w (n.r') / (n.r)` (Xie, Wang, Popescu 2016, §4), with the rays `r` and `r'`.
//!
//! - A hit is **held** where the copy shows the same object there, its plane within the tolerance of [`AccountRules`], and its
//!   normal or triangle the same. While the viewer moves, and where the scene itself is discontinuous, a held surface of one
//!   of the eight pixels around may stand for it: outlines are rounded to pixels in both, and each view rounds its own way.
//! - A hit is held **too coarsely** where the scene is now sampled `density_factor` times more densely: the held sample is
//!   replaced, wherever this view shows it. While the viewer moves, only views on its way ask for that.
//! - A hit that is held with another normal is sent in its place. Neither is done on outlines and edges while the viewer moves:
//!   of a twig thinner than a pixel each view hits another side, and views would take turns.
//! - A held sample **covers falsely** where it lies in front of the hit, or where there is none, and no hit around is on it.
//!
//! What covers falsely is never sent behind: the next look, after it was trimmed, tells whether anything lacks there.
//!
//! What the client is shown as it is only hides ([`LeftOut::hiding`](crate::render::LeftOut::hiding)): it is no hit, so nothing of it is ever lacking, but what lies
//! behind it covers nothing.

use std::collections::BTreeSet;

use camera::Pinhole;
use glam::{DVec3, Vec3};
use protocol::image::octahedral_normal;
use protocol::{Mask, PatchId, Purpose};
use rayon::prelude::*;
use surface::{AddressTexel, AddressView};

use super::findings::{Lacking, ascending, is_among};
use super::rules::AccountRules;
use super::samples::{Address, Captured, Samples, density};
use crate::discretize::Capture;

/// A point of a surface as one pixel shows it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Point {
    pub w: f32,
    pub normal: Vec3,
    pub object: u16,
    pub triangle: u32,
    /// Step of its coding.
    pub w_step: f32,
    /// How densely the held sample was captured; 0 for a hit of the scene.
    pub density: f32,
}

/// Two views of one camera.
pub struct Comparison<'a, S> {
    rules: AccountRules,
    samples: &'a S,
    copy: &'a AddressView,
    camera: Pinhole,
    width: i32,
    height: i32,
    focal_px: f32,
    /// `ray_world = right * x' + down * y' + forward`: the first part by column, the second by row, and the last.
    across: Vec<Vec3>,
    down: Vec<Vec3>,
    forward: Vec3,
    /// What stands there; of what only hides, without a triangle.
    truth: Vec<Option<Point>>,
    capture: &'a Capture,
    held: Vec<Option<Point>>,
    /// See [`Samples::sent_by`].
    sent: Vec<u32>,
    /// Patches that views of this plan captured at earlier looks: they are not replaced.
    peers: &'a BTreeSet<PatchId>,
}

/// Why a hit is to be sent, or is not.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Verdict {
    /// Nothing is there, it is held, or it cannot be seen behind what covers it.
    Leave,
    /// Not held.
    Missing,
    /// Held by the sample that is seen there, too coarsely.
    Coarse,
    /// The same object is held at this very place with another normal.
    Turned,
}

impl<'a, S: Samples> Comparison<'a, S> {
    /// `truth` and `copy` are of one camera and size, the copy as far as it is for `purpose`; `peers` are the patches that views of the same plan captured, beside those of
    /// the first set, each of which may be replaced once.
    pub fn new(
        truth: &'a Capture,
        (purpose, copy): (Purpose, &'a AddressView),
        samples: &'a S,
        peers: &'a BTreeSet<PatchId>,
        rules: AccountRules,
    ) -> Comparison<'a, S> {
        let camera = truth.camera;
        let axis = |axis: DVec3| (camera.world_from_eye.rotation * axis).as_vec3();
        // Of the centres of the pixels beside the image too, whose rays are asked for.
        let tangents = |length: u32, centre_px: f64| {
            let tangent = move |at: u32| (at as f32 - 0.5 - centre_px as f32) / camera.focal_px as f32;
            (0..length + 2).map(tangent)
        };
        let hit = |index: usize| {
            (truth.ids[index][0] != 0 || truth.depth[index] > 0.0).then(|| Point {
                w: truth.w(index),
                normal: octahedral_normal(truth.normal_code(index)),
                object: truth.object(index),
                triangle: truth.ids[index][0],
                w_step: 0.0,
                density: 0.0,
            })
        };
        let held = |texel: &AddressTexel| {
            let Captured { triangle, w_step, density } = samples.captured(texel.address()?);
            let normal = octahedral_normal(texel.normal_code());
            Some(Point { w: texel.w(), normal, object: texel.object(), triangle, w_step, density })
        };
        Comparison {
            rules,
            samples,
            copy,
            camera,
            width: camera.width_px as i32,
            height: camera.height_px as i32,
            focal_px: camera.focal_px as f32,
            across: tangents(camera.width_px, camera.centre_px.x).map(|tangent| axis(DVec3::X) * tangent).collect(),
            down: tangents(camera.height_px, camera.centre_px.y).map(|tangent| axis(DVec3::Y) * tangent).collect(),
            forward: axis(DVec3::Z),
            truth: (0..truth.ids.len()).into_par_iter().with_min_len(4096).map(hit).collect(),
            held: copy.texels.par_iter().with_min_len(4096).map(held).collect(),
            capture: truth,
            sent: samples.sent_by(&camera, purpose),
            peers,
        }
    }

    /// The held samples that cover falsely; they ascend.
    pub fn false_cover(&self) -> Vec<Address> {
        let rows = (0..self.height).into_par_iter().flat_map_iter(|y| {
            (0..self.width).filter_map(move |x| {
                let (held, address) = (self.held_at(x, y)?, self.copy.texels[self.at(x, y)].address()?);
                self.covers_falsely(x, y, &held).then_some(address)
            })
        });
        let mut addresses = rows.collect();
        ascending(&mut addresses);
        addresses
    }

    /// What is to be sent.
    pub fn lacking(&self) -> Lacking {
        let verdict = |index: usize| self.verdict(index as i32 % self.width, index as i32 / self.width);
        let pixels = (0..self.truth.len()).into_par_iter().with_min_len(4096);
        let mut verdicts: Vec<Verdict> = pixels.map(verdict).collect();
        let replaced = self.replaced(&mut verdicts);
        let missing = verdicts.iter().filter(|&&verdict| verdict != Verdict::Leave).count();
        let send = self.with_border(&verdicts);
        Lacking { send, missing, replaced }
    }

    fn verdict(&self, x: i32, y: i32) -> Verdict {
        let Some(hit) = self.truth_at(x, y).filter(|_| self.capture.is_own(self.at(x, y))) else {
            return Verdict::Leave;
        };
        let Some(held) = self.held_at(x, y) else {
            let stands_in = self.rules.outlines_stand_in && self.ends_in_nothing(x, y) && self.is_held_around(x, y);
            return if stands_in || self.was_sent(x, y, &hit) { Verdict::Leave } else { Verdict::Missing };
        };
        if self.is_in_place(&hit, &held, 0, 0, x, y) {
            if self.is_same_way(&hit, &held) {
                return if self.is_coarse(x, y, &hit, &held) { Verdict::Coarse } else { Verdict::Leave };
            }
            let on_edge = self.rules.outlines_stand_in && self.is_outline(x, y, &hit);
            let shows_peer = self.seen_at(self.at(x, y)).is_some_and(|(patch, ..)| self.peers.contains(&patch));
            let leave = on_edge || self.is_held_around(x, y) || shows_peer && self.was_sent(x, y, &hit);
            return if leave { Verdict::Leave } else { Verdict::Turned };
        }
        let stands_in = || self.rules.outlines_stand_in && self.is_outline(x, y, &hit) && self.is_held_around(x, y);
        if held.w > hit.w || self.was_sent(x, y, &hit) || stands_in() {
            return Verdict::Leave;
        }
        Verdict::Missing
    }

    /// Whether the hit is held already, from this very camera: what then shows in its place lies nearer than coding and drawing
    /// can tell apart, as where two objects touch, and sending it again would not change that.
    fn was_sent(&self, x: i32, y: i32, hit: &Point) -> bool {
        self.sent[self.at(x, y)] == hit.triangle
    }

    /// Settles what happens to the held samples in the place of what is sent. One that is too coarse goes where this view sees
    /// its centre, and all of its pixels are sent; else it stays and they are not: another view of the same plan may need it,
    /// and would send it again for ever. One that is turned must moreover have all of its pixels sent anyway. Views of one
    /// plan are about equally fine, and see both sides of an edge each: they do not replace what another of them sent.
    fn replaced(&self, verdicts: &mut [Verdict]) -> Vec<Address> {
        let mut coarse = self.seen_with_centre(verdicts, Verdict::Coarse);
        for (index, verdict) in verdicts.iter_mut().enumerate() {
            if !matches!(verdict, Verdict::Coarse | Verdict::Leave) {
                continue;
            }
            let goes = !coarse.is_empty() && self.seen_at(index).is_some_and(|address| is_among(&coarse, address));
            match verdict {
                Verdict::Coarse if !goes => *verdict = Verdict::Leave,
                Verdict::Leave if goes && self.is_own(index) => *verdict = Verdict::Coarse,
                _ => {}
            }
        }
        let mut turned = self.seen_with_centre(verdicts, Verdict::Turned);
        if !turned.is_empty() {
            let left = indices_of(verdicts, Verdict::Leave).filter_map(|index| self.seen_at(index));
            let mut kept: Vec<Address> = left.filter(|address| is_among(&turned, *address)).collect();
            ascending(&mut kept);
            turned.retain(|address| !is_among(&kept, *address) && !self.peers.contains(&address.0));
        }
        for (index, verdict) in verdicts.iter_mut().enumerate() {
            let stays = |address: &Address| !is_among(&turned, *address) && !self.peers.contains(&address.0);
            if *verdict == Verdict::Turned && self.seen_at(index).is_some_and(|address| stays(&address)) {
                *verdict = Verdict::Leave;
            }
        }
        coarse.extend(turned);
        ascending(&mut coarse);
        coarse
    }

    fn seen_at(&self, index: usize) -> Option<Address> {
        self.copy.texels[index].address()
    }

    /// The held samples that pixels of a verdict show, if the truth of this view shows their centres too.
    fn seen_with_centre(&self, verdicts: &[Verdict], wanted: Verdict) -> Vec<Address> {
        let mut seen: Vec<(Address, usize)> = indices_of(verdicts, wanted)
            .filter_map(|index| self.seen_at(index).map(|address| (address, index)))
            .collect();
        seen.sort_unstable_by_key(|&((patch, x, y), _)| (patch, y, x));
        seen.dedup_by_key(|(address, _)| *address);
        seen.retain(|&(address, index)| self.held[index].is_some_and(|held| self.shows_centre(address, &held)));
        seen.into_iter().map(|(address, _)| address).collect()
    }

    /// Whether the hit of the pixel that a held sample's centre falls on lies on the sample.
    fn shows_centre(&self, address: Address, held: &Point) -> bool {
        let centre =
            self.samples.centre_world(address, held.object).and_then(|world| self.camera.image_from_world(world));
        centre.is_some_and(|centre| {
            let (x, y) = (centre.u.floor() as i32, centre.v.floor() as i32);
            let held = Point { w: centre.w as f32, ..*held };
            self.truth_at(x, y).is_some_and(|hit| self.is_in_place(&hit, &held, 0, 0, x, y))
        })
    }

    fn is_own(&self, index: usize) -> bool {
        let (x, y) = (index as i32 % self.width, index as i32 / self.width);
        self.is_held_at(x, y, x, y)
    }

    fn with_border(&self, verdicts: &[Verdict]) -> Mask {
        let mut send = Mask::empty(self.width as u32, self.height as u32);
        let radius = self.rules.border_px as i32;
        for y in 0..self.height {
            for x in 0..self.width {
                let verdict = verdicts[self.at(x, y)];
                let Some(hit) = self.truth_at(x, y).filter(|_| verdict != Verdict::Leave) else { continue };
                for (dx, dy) in square(radius) {
                    if self
                        .truth_at(x + dx, y + dy)
                        .is_some_and(|other| self.is_one_surface(&hit, &other, x, y, dx, dy))
                    {
                        send.set((x + dx) as u32, (y + dy) as u32, true);
                    }
                }
            }
        }
        send
    }

    /// By pixel: how densely the hit there is sampled by what shows it once `send` is sent, see [`density`]; 0 where nothing does.
    pub(super) fn shown_densities(&self, send: &Mask) -> Vec<f32> {
        let shown = |index: usize| {
            let (x, y) = (index as i32 % self.width, index as i32 / self.width);
            if send.get(x as u32, y as u32) {
                return self.view_density(x, y);
            }
            self.held[index].filter(|_| self.is_held_at(x, y, x, y)).map_or(0.0, |held| held.density)
        };
        (0..self.truth.len()).into_par_iter().with_min_len(4096).map(shown).collect()
    }

    /// How densely the view itself samples the hit of a pixel; 0 where there is none.
    pub(super) fn view_density(&self, x: i32, y: i32) -> f32 {
        self.truth_at(x, y).map_or(0.0, |hit| density(self.focal_px, hit.w, hit.normal.dot(self.ray(x, y))))
    }

    pub(super) fn camera(&self) -> &Pinhole {
        &self.camera
    }

    pub(super) fn at_if_inside(&self, (x, y): (i32, i32)) -> Option<usize> {
        self.is_inside(x, y).then(|| self.at(x, y))
    }

    fn at(&self, x: i32, y: i32) -> usize {
        (y * self.width + x) as usize
    }

    fn is_inside(&self, x: i32, y: i32) -> bool {
        x >= 0 && y >= 0 && x < self.width && y < self.height
    }

    pub(super) fn truth_at(&self, x: i32, y: i32) -> Option<Point> {
        self.stands_at(x, y).filter(|point| point.triangle != 0)
    }

    /// The same with what only hides.
    fn stands_at(&self, x: i32, y: i32) -> Option<Point> {
        self.is_inside(x, y).then(|| self.truth[self.at(x, y)]).flatten()
    }

    fn held_at(&self, x: i32, y: i32) -> Option<Point> {
        self.is_inside(x, y).then(|| self.held[self.at(x, y)]).flatten()
    }

    /// The ray of a pixel's centre in the axes of the world, of the image or next to it.
    pub(super) fn ray(&self, x: i32, y: i32) -> Vec3 {
        self.across[(x + 1) as usize] + self.down[(y + 1) as usize] + self.forward
    }

    /// `w` of a point's plane `(dx, dy)` pixels from its own pixel `(x, y)`; its own `w` where the plane is seen edge-on.
    fn w_on_plane(&self, point: &Point, x: i32, y: i32, dx: i32, dy: i32) -> f32 {
        if (dx, dy) == (0, 0) {
            return point.w;
        }
        let (here, there) = (point.normal.dot(self.ray(x, y)), point.normal.dot(self.ray(x + dx, y + dy)));
        let w = point.w * there / here;
        if w > 0.0 && w.is_finite() { w } else { point.w }
    }

    /// How far apart in `w` two points of one surface may be at a pixel.
    pub(super) fn tolerance(&self, a: &Point, b: &Point, x: i32, y: i32) -> f32 {
        let ray = self.ray(x, y);
        let facing = a.normal.dot(ray).abs().max(b.normal.dot(ray).abs());
        let footprint = a.w / self.focal_px;
        let off_plane = self.rules.off_plane_footprints / facing;
        footprint * off_plane.min(self.rules.along_ray_footprints) + a.w_step.max(b.w_step)
    }

    /// Whether the hit of pixel `(x, y)` lies on the held surface seen `(dx, dy)` pixels from it.
    fn is_in_place(&self, hit: &Point, held: &Point, dx: i32, dy: i32, x: i32, y: i32) -> bool {
        hit.object == held.object && {
            let w = self.w_on_plane(held, x + dx, y + dy, -dx, -dy);
            (hit.w - w).abs() <= self.tolerance(hit, held, x, y)
        }
    }

    pub(super) fn is_same_way(&self, hit: &Point, held: &Point) -> bool {
        hit.triangle == held.triangle || hit.normal.dot(held.normal) >= self.rules.normal_cos
    }

    fn is_held_at(&self, x: i32, y: i32, held_x: i32, held_y: i32) -> bool {
        let (Some(hit), Some(held)) = (self.truth_at(x, y), self.held_at(held_x, held_y)) else { return false };
        self.is_in_place(&hit, &held, held_x - x, held_y - y, x, y) && self.is_same_way(&hit, &held)
    }

    /// Whether one of the nine pixels around shows a held surface that the hit of this one lies on.
    fn is_held_around(&self, x: i32, y: i32) -> bool {
        square(1).any(|(dx, dy)| self.is_held_at(x, y, x + dx, y + dy))
    }

    fn is_one_surface(&self, a: &Point, b: &Point, x: i32, y: i32, dx: i32, dy: i32) -> bool {
        a.object == b.object && {
            let w = self.w_on_plane(a, x, y, dx, dy);
            (b.w - w).abs() <= self.tolerance(a, b, x, y).max(2.0 * a.w / self.focal_px)
        }
    }

    /// Whether the scene is discontinuous at a pixel: a hit around is of another surface, or turned, or there is none.
    fn is_outline(&self, x: i32, y: i32, hit: &Point) -> bool {
        square(1).filter(|&(dx, dy)| self.is_inside(x + dx, y + dy)).any(|(dx, dy)| {
            match self.truth_at(x + dx, y + dy) {
                None => true,
                Some(other) => {
                    !self.is_one_surface(hit, &other, x, y, dx, dy)
                        || hit.normal.dot(other.normal) < self.rules.normal_cos
                }
            }
        })
    }

    fn ends_in_nothing(&self, x: i32, y: i32) -> bool {
        square(1).any(|(dx, dy)| self.is_inside(x + dx, y + dy) && self.truth_at(x + dx, y + dy).is_none())
    }

    fn is_coarse(&self, x: i32, y: i32, hit: &Point, held: &Point) -> bool {
        let Some(address) = self.seen_at(self.at(x, y)) else { return false };
        if !self.rules.refines || self.peers.contains(&address.0) {
            return false;
        }
        self.view_density(x, y) > self.rules.density_factor * held.density
            && !(self.rules.outlines_stand_in && self.is_outline(x, y, hit))
    }

    fn covers_falsely(&self, x: i32, y: i32, held: &Point) -> bool {
        let in_front = self.stands_at(x, y).is_none_or(|hit| held.w > hit.w + self.tolerance(&hit, held, x, y));
        in_front
            && !square(1).any(|(dx, dy)| {
                self.truth_at(x + dx, y + dy).is_some_and(|hit| self.is_in_place(&hit, held, -dx, -dy, x + dx, y + dy))
            })
    }
}

fn square(radius: i32) -> impl Iterator<Item = (i32, i32)> {
    (-radius..=radius).flat_map(move |dy| (-radius..=radius).map(move |dx| (dx, dy)))
}

fn indices_of(verdicts: &[Verdict], wanted: Verdict) -> impl Iterator<Item = usize> {
    verdicts.iter().enumerate().filter(move |&(_, &verdict)| verdict == wanted).map(|(index, _)| index)
}
