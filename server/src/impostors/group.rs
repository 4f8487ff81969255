//! Which reflectors share the images of what is around them.
//!
//! Rays leave a reflector from all of its surface, so an image from its middle is off by the parallax of up to its radius `r`, which is `r / d` at
//! a distance `d`. A mirror whose middle lies within the ball around a larger one has rays that start no further from that one's
//! middle than its own rays do, so the same images are as right for it. So a car of many chrome parts gets one set. Glass
//! has its own: its rays go on from its far side. So have rough mirrors: what lies on them is what is told in them, and may be another one.

use camera::Bounds;
use glam::DVec3;

/// How a reflector shows others.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Shows {
    /// [`protocol::Effect::Mirror`].
    Mirror,
    /// As a blur: [`protocol::Material::is_rough_mirror`].
    RoughMirror,
    /// [`protocol::Effect::Glass`].
    Glass,
}

/// A ball around a box.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ball {
    pub centre: DVec3,
    pub radius_m: f64,
}

impl Ball {
    pub fn around(bounds: &Bounds) -> Ball {
        Ball { centre: bounds.middle(), radius_m: (bounds.max - bounds.min).length() / 2.0 }
    }
}

/// Reflectors with one set of images.
#[derive(Debug, Clone)]
pub(super) struct Group {
    /// The largest, from whose middle images are taken.
    pub lead: u16,
    pub shows: Shows,
    pub ball: Ball,
    /// All of them, the lead included; ids ascend.
    pub members: Vec<u16>,
}

/// Each reflector in one group, the largest groups first.
pub(super) fn groups(mut reflectors: Vec<(u16, Shows, Ball)>) -> Vec<Group> {
    reflectors.sort_by(|(_, _, a), (_, _, b)| b.radius_m.total_cmp(&a.radius_m));
    let mut groups: Vec<Group> = Vec::new();
    for (id, shows, ball) in reflectors {
        let is_within = |group: &&mut Group| {
            shows == Shows::Mirror
                && group.shows == Shows::Mirror
                && group.ball.centre.distance(ball.centre) <= group.ball.radius_m
        };
        match groups.iter_mut().find(is_within) {
            Some(group) => group.members.push(id),
            None => groups.push(Group { lead: id, shows, ball, members: vec![id] }),
        }
    }
    groups.iter_mut().for_each(|group| group.members.sort_unstable());
    groups
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ball(x: f64, radius_m: f64) -> Ball {
        Ball { centre: DVec3::X * x, radius_m }
    }

    #[test]
    fn mirrors_within_a_larger_one_share_its_images_and_glass_and_rough_ones_do_not() {
        let (mirror, glass, rough) = (Shows::Mirror, Shows::Glass, Shows::RoughMirror);
        let all = vec![
            (7, mirror, ball(1.9, 0.2)),
            (3, mirror, ball(0.0, 2.0)),
            (4, mirror, ball(2.1, 0.2)),
            (1, glass, ball(1.0, 0.5)),
            (2, mirror, ball(-1.0, 0.1)),
            (5, rough, ball(0.1, 0.05)),
        ];
        let found: Vec<_> = groups(all).into_iter().map(|group| (group.lead, group.members)).collect();
        assert_eq!(found, [(3, vec![2, 3, 7]), (1, vec![1]), (4, vec![4]), (5, vec![5])]);
    }
}
