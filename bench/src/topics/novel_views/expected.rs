//! Where the server expects the viewer during a replay, and how far that is off: the server's own predictor, fed with the poses of the
//! trace over the emulated network.

use camera::Rigid;
use client::receive::viewer::MotionEstimator;
use network::{Link, LinkModel};
use protocol::message::ViewSize;
use server::viewer::Viewer;

use super::setup::{CLIENT_HZ, Replay, SERVER_HZ};
use super::truths::shown_at_s;

/// How long the viewer rests at the first pose before the trace begins, so that its first picture is there.
const REST_S: f64 = 1.0;
/// A pose's message.
const POSE_BYTES: usize = 97;
/// The headless viewer's own seed, so that everybody meets the same network.
const UP_SEED: u64 = 1;

/// Where the server expects the viewer at each of its ticks, from the one that brings the first picture on.
pub fn expected_eyes(replay: &Replay, link: Link) -> Vec<(f64, Rigid)> {
    let view = ViewSize { width_px: replay.size_px.0, height_px: replay.size_px.1, fov_y_rad: replay.fov_y_rad };
    let mut up = LinkModel::new(link, UP_SEED);
    let mut viewer = Viewer::at_start(view, replay.trace.at(0.0), -REST_S);
    (viewer.round_trip_s, viewer.one_way_s) = (link.rtt_s, link.rtt_s / 2.0);
    let first_pose = -(REST_S * CLIENT_HZ) as i64;
    let mut estimator = MotionEstimator::default();
    let poses: Vec<_> = (first_pose..replay.trace.poses.len() as i64)
        .map(|index| {
            let t_s = index as f64 / CLIENT_HZ;
            let world_from_eye = replay.trace.at(t_s);
            (up.deliver(t_s, POSE_BYTES), t_s, world_from_eye, estimator.see(world_from_eye, t_s))
        })
        .collect();
    let mut heard = poses.iter().zip(1_u64..).peekable();
    let ticks = -((REST_S / 2.0 * SERVER_HZ) as i64)..=(replay.trace.duration_s() * SERVER_HZ) as i64;
    let mut eyes = Vec::new();
    for tick_s in ticks.map(|tick| tick as f64 / SERVER_HZ) {
        while let Some((&(at_s, t_s, world_from_eye, motion), seq)) = heard.next_if(|((at_s, ..), _)| *at_s <= tick_s) {
            viewer.hear(seq, t_s, world_from_eye, motion, at_s);
        }
        eyes.push((tick_s, viewer.predict(tick_s, 1.0 / SERVER_HZ, 0.0, f64::INFINITY).world_from_eye));
    }
    // Before the trace begins one picture is enough: the viewer rests.
    let first = eyes.iter().rposition(|(tick_s, _)| *tick_s <= -link.rtt_s - link.jitter_s).unwrap_or(0);
    let begun = eyes.iter().position(|(tick_s, _)| *tick_s >= 0.0).unwrap_or(0);
    let mut kept = vec![eyes[first]];
    kept.extend_from_slice(&eyes[begun.max(first + 1)..]);
    kept
}

/// How far the eye was from where it was expected.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Missed {
    /// On the trace's clock: the middle of the time for which what was made for the expected eye is shown.
    pub shown_s: f64,
    /// Metres.
    pub distance_m: f64,
    /// Degrees between the two orientations.
    pub turn_deg: f64,
}

/// The errors of prediction of a replay, one for each tick of the server whose update can be shown before the end.
pub fn missed(replay: &Replay, link: Link) -> Vec<Missed> {
    let end_s = shown_at_s(replay.trace.poses.len() - 1);
    let of = |(tick_s, expected): (f64, Rigid)| {
        let shown_s = tick_s + link.rtt_s / 2.0 + 0.5 / SERVER_HZ;
        let eye = replay.trace.at(shown_s);
        let turn_deg = expected.rotation.angle_between(eye.rotation).to_degrees();
        Missed { shown_s, distance_m: expected.translation.distance(eye.translation), turn_deg }
    };
    let ticks = expected_eyes(replay, link).into_iter().filter(|(tick_s, _)| *tick_s >= 0.0);
    ticks.map(of).filter(|missed| missed.shown_s <= end_s).collect()
}

#[cfg(test)]
mod tests {
    use camera::{Trace, TracePose};
    use glam::{DQuat, DVec3};
    use protocol::Look;

    use super::super::setup::Network;
    use super::*;

    fn replay_of(eye: impl Fn(f64) -> Rigid, link: Link) -> Replay {
        let poses = (0..120).map(|index| f64::from(index) / CLIENT_HZ);
        Replay {
            label: "teapots".to_owned(),
            scene: scene::builtin::load("teapots").expect("built in"),
            look: Look::Flat,
            trace: Trace { poses: poses.map(|t_s| TracePose { t_s, world_from_eye: eye(t_s) }).collect() },
            size_px: (64, 36),
            fov_y_rad: 1.0,
            networks: vec![Network::of_link(link)],
        }
    }

    /// A steady walker, who is where the server expects him when the picture is shown.
    #[test]
    fn the_server_expects_a_walker_ahead() {
        let eye = |t_s: f64| Rigid { translation: DVec3::X * (1.2 * t_s), ..Rigid::IDENTITY };
        let link: Link = "rtt=100".parse().expect("a link");
        let replay = replay_of(eye, link);
        let eyes = expected_eyes(&replay, link);
        assert!(eyes[0].0 <= -0.1 && eyes[1].0 == 0.0, "one picture rests, the others follow from the beginning on");
        for (tick_s, expected) in eyes.iter().filter(|(tick_s, _)| *tick_s > 1.0) {
            // Sent so that it arrives half a round trip later and is shown for an update interval.
            let shown_s = tick_s + 0.05 + 0.5 / SERVER_HZ;
            let off_m = expected.translation.x - eye(shown_s).translation.x;
            assert!(off_m.abs() < 1.2 / CLIENT_HZ, "{off_m} m off at {tick_s} s");
        }
    }

    /// Who stands still until he turns at once is missed by all that he turned within the delay of what is shown.
    #[test]
    fn a_turn_out_of_rest_is_missed_by_what_it_is_late() {
        let turn_rad_s = 1.0;
        let eye = |t_s: f64| Rigid {
            rotation: DQuat::from_rotation_y(turn_rad_s * (t_s - 1.0).max(0.0)),
            translation: DVec3::ZERO,
        };
        let link: Link = "rtt=100".parse().expect("a link");
        let missed = missed(&replay_of(eye, link), link);
        assert!(missed.iter().all(|missed| missed.distance_m == 0.0));
        let at = |from_s: f64, to_s: f64| {
            let within = missed.iter().filter(|missed| (from_s..to_s).contains(&missed.shown_s));
            within.map(|missed| missed.turn_deg).fold(0.0, f64::max)
        };
        assert!(at(0.0, 1.0) < 1e-9 && at(1.5, 2.0) < 1.0, "{} and {}", at(0.0, 1.0), at(1.5, 2.0));
        // A round trip, and up to an update interval: 6 to 9 degrees.
        assert!((5.0..9.0).contains(&at(1.0, 1.5)), "{}", at(1.0, 1.5));
    }
}
