//! What a viewer will need next, sent while nobody needs anything now.
//!
//! Who stands still and lacks nothing looks for what he will turn or walk to. Who turns an object about a point is sent the other sides: views
//! on the ring on which he stands, nearest first, both ways, then from higher and lower. Who walks is sent what is around him, then
//! what he would see from places along the way, as far as it is free, and back. Each view is looked at once, by the account's ordinary rules, so nothing
//! is sent twice; when all are, or a share of the client's budget is full, there is silence.
//!
//! It waits for everything else: for the viewer's own views, for the view at rest ([`crate::rest`]), for other sessions, and for all that is in flight; and what is
//! sent at a time is so little that a viewer who starts to move then hardly waits for it.

mod kept;

use std::f64::consts::{PI, TAU};

use camera::{Pinhole, Rigid};
use glam::{DQuat, DVec2, DVec3};

use crate::account::BYTES_PER_SAMPLE;
use crate::client::Client;
use crate::discretize::Capture;
use crate::plan::{Rules, half_view};
use crate::viewer::Viewer;
pub use kept::{Kept, Part};

/// Who stood still for so long is looked ahead for: the view at rest begins by then.
const REST_AFTER_S: f64 = 0.15;
/// What a viewer who starts to move may wait for, in seconds of the path: little beside a round trip.
const WAIT_S: f64 = 0.02;
/// What a pixel of a view is expected to cost before any was sent, in bytes: a view of which nothing is held.
const BYTES_PER_PX: f64 = 2.0;
/// The share of a client's budget above which nothing more is anticipated: what is seen later must have room.
const BUDGET_SHARE: f64 = 0.75;
/// From one view of a ring to the next: of what a view of a ball shows, all but the outermost 7 % are seen from so far round.
const RING_STEP_RAD: f64 = TAU / 18.0;
/// Rings above and below, in order.
const RINGS_RAD: [f64; 5] = [0.0, 0.35, -0.35, 0.7, -0.7];
/// No ring is nearer to the axis than this cosine says: 18 degrees.
const STEEPEST_COS: f64 = 0.95;
/// A view that is at most this part of a step away from one that was looked at needs no look.
const NEAR: f64 = 0.6;
/// Places along the way of who walks, every half second of walking near by: ahead, then behind. Negative ones lie behind.
const PLACES_M: [f64; 6] = [0.7, 1.4, -0.7, 2.1, -1.4, 2.8];
/// Width and field of a view of a way: at 3 m a walker is 0.5 m wide.
const WAY_PX: u32 = 16;
const WAY_FIELD_RAD: f64 = 0.17;
/// Nothing is looked at from nearer to what is ahead than this, in metres: an arm's length.
const ARM_M: f64 = 0.6;

/// Whether a client may be looked ahead for: its viewer rests, has a picture and lacks nothing of it, and there is room.
pub fn may(rules: &Rules, client: &Client, viewer: &Viewer, now_s: f64) -> bool {
    let held_bytes = client.account.held().sample_count() as u64 * BYTES_PER_SAMPLE;
    rules.anticipates
        && viewer.rested_s(now_s) >= REST_AFTER_S
        && client.focus.is_some_and(|focus| focus.settled)
        && client.ahead.ended_at != Some(viewer.world_from_eye)
        && (held_bytes as f64) < BUDGET_SHARE * client.budget_bytes as f64
}

/// What is to be looked at next, in the views that `view_from` makes of poses; `None` where nothing is left.
pub fn next(
    rules: &Rules,
    client: &Client,
    viewer: &Viewer,
    around: &Around,
    view_from: impl Fn(Rigid) -> Pinhole,
) -> Option<Part> {
    let kept = &client.ahead;
    let looks = around.poses(viewer, rules);
    let world_from_eye = *looks.poses.iter().find(|pose| !looks.is_done(&kept.done, pose))?;
    let view = view_from(world_from_eye);
    let first_row = kept.begun.filter(|(begun, _)| *begun == world_from_eye).map_or(0, |(_, rows)| rows);
    let carried_px =
        viewer.bytes_per_s.map_or(f64::INFINITY, |path| path * WAIT_S / kept.bytes_per_px.unwrap_or(BYTES_PER_PX));
    let rows = (carried_px / f64::from(view.width_px)) as u32;
    let height_px = rows.clamp(1, view.height_px.saturating_sub(first_row).max(1));
    let centre_px = view.centre_px - DVec2::new(0.0, f64::from(first_row));
    Some(Part { view, camera: Pinhole { height_px, centre_px, ..view }, first_row })
}

/// What a viewer moves about.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Around {
    /// An object.
    Object {
        /// A point of the axis.
        pivot_world: DVec3,
        /// Unit length.
        axis_world: DVec3,
    },
    /// Where it stands.
    Place {
        /// How far the way is free ahead, and behind, in metres.
        free_m: [f64; 2],
    },
}

/// Poses to look from, the most probable first.
struct Looks {
    poses: Vec<Rigid>,
    /// Poses nearer to each other than this show the same.
    near_m: f64,
    near_rad: f64,
}

impl Looks {
    fn is_done(&self, done: &[Rigid], pose: &Rigid) -> bool {
        done.iter().any(|done| {
            done.translation.distance(pose.translation) < self.near_m
                && done.rotation.angle_between(pose.rotation) < self.near_rad
        })
    }
}

impl Around {
    /// What a viewer turns about, or where it stands: the former where it turned before, and before anything but a scene to walk in.
    pub fn object(viewer: &Viewer, middle_world: DVec3, walk: bool) -> Option<Around> {
        if let Some(pivot) = viewer.pivot {
            return Some(Around::Object { pivot_world: pivot.pivot_world, axis_world: pivot.axis_world });
        }
        let forward = viewer.world_from_eye.transform_vector(DVec3::Z);
        let ahead_m = (middle_world - viewer.world_from_eye.translation).dot(forward);
        let pivot_world = viewer.world_from_eye.translation + forward * ahead_m;
        (!walk && ahead_m > 0.0).then_some(Around::Object { pivot_world, axis_world: DVec3::Y })
    }

    fn poses(&self, viewer: &Viewer, rules: &Rules) -> Looks {
        match *self {
            Around::Object { pivot_world, axis_world } => rings(&viewer.world_from_eye, pivot_world, axis_world),
            Around::Place { free_m } => places(viewer, free_m, rules.margin_m),
        }
    }
}

/// The ring of a pose about an axis, and those above and below, at the same distance from what is looked at.
fn rings(world_from_eye: &Rigid, pivot_world: DVec3, axis_world: DVec3) -> Looks {
    let forward = world_from_eye.transform_vector(DVec3::Z);
    let to_axis = (pivot_world - world_from_eye.translation).reject_from_normalized(axis_world);
    let across = forward.reject_from_normalized(axis_world);
    let distance_m = (across.dot(to_axis) / across.length_squared()).max(0.0);
    // Who looks straight along the axis has no point before him that is nearest to it.
    let distance_m = if distance_m.is_finite() { distance_m } else { to_axis.length() };
    let target_world = world_from_eye.translation + forward * distance_m;
    let right_world = world_from_eye.transform_vector(DVec3::X);
    let steps = (TAU / RING_STEP_RAD).round() as i32;
    // 0, 1, -1, 2, -2 and so on: both ways in turn, to the far side.
    let both_ways = (0..steps).map(|index| if index % 2 == 0 { -index / 2 } else { (index + 1) / 2 });
    let mut poses = Vec::new();
    for raised_rad in RINGS_RAD {
        let raised = turned(world_from_eye, target_world, DQuat::from_axis_angle(right_world, -raised_rad));
        if raised.transform_vector(DVec3::Z).dot(axis_world).abs() > STEEPEST_COS {
            continue;
        }
        let round = both_ways.clone().map(|step| {
            turned(&raised, pivot_world, DQuat::from_axis_angle(axis_world, f64::from(step) * RING_STEP_RAD))
        });
        poses.extend(round);
    }
    Looks { poses, near_m: NEAR * RING_STEP_RAD * distance_m, near_rad: NEAR * RING_STEP_RAD }
}

/// Small views of the way ahead of a view, and of that behind: level, and no wider than a walker.
pub fn ways(own: &Pinhole) -> (Pinhole, Pinhole) {
    let here = own.world_from_eye;
    let forward = here.transform_vector(DVec3::Z);
    let level = DVec3::new(forward.x, 0.0, forward.z);
    let probe = |along: DVec3| {
        Pinhole::symmetric(Rigid::look_along(here.translation, along), (WAY_PX, WAY_PX), WAY_FIELD_RAD, own.near_m)
    };
    (probe(level), probe(-level))
}

/// How far the nearest thing in a view of a way is.
pub fn free_m(way: &Capture) -> f64 {
    let nearest_w = (0..way.depth.len()).map(|index| way.w(index)).fold(0.0, f32::max);
    1.0 / f64::from(nearest_w)
}

/// A pose turned about a point.
fn turned(world_from_eye: &Rigid, pivot_world: DVec3, turn: DQuat) -> Rigid {
    Rigid {
        rotation: (turn * world_from_eye.rotation).normalize(),
        translation: pivot_world + turn * (world_from_eye.translation - pivot_world),
    }
}

/// Round on the spot, then the same places ahead and behind as far as the way is free.
fn places(viewer: &Viewer, free_m: [f64; 2], margin_m: f64) -> Looks {
    let here = viewer.world_from_eye;
    let half_rad = half_view(viewer.view).x.atan();
    let around = |place: Rigid| {
        // Views beside each other overlap a little.
        let steps = (PI / half_rad * 1.1).ceil().max(1.0);
        let step_rad = TAU / steps;
        (0..steps as i32).map(move |index| {
            let step = if index % 2 == 0 { -index / 2 } else { (index + 1) / 2 };
            let turn = DQuat::from_rotation_y(f64::from(step) * step_rad);
            Rigid { rotation: (turn * place.rotation).normalize(), ..place }
        })
    };
    let forward = here.transform_vector(DVec3::Z);
    let ahead = DVec3::new(forward.x, 0.0, forward.z).normalize_or_zero();
    let is_free = |way_m: f64| way_m.abs() + ARM_M < free_m[usize::from(way_m < 0.0)];
    let there = PLACES_M.into_iter().filter(|&way_m| ahead != DVec3::ZERO && is_free(way_m));
    let there = there.map(|way_m| Rigid { translation: here.translation + ahead * way_m, ..here });
    let poses = std::iter::once(here).chain(there).flat_map(around).collect();
    Looks { poses, near_m: margin_m.max(PLACES_M[0] / 2.0), near_rad: NEAR * half_rad }
}

#[cfg(test)]
mod tests;
