//! [`Staging`]: how a client has a scene put before it, which others need not share: how its time goes, which of its objects are there, and where it is
//! cut open.

use glam::DVec3;
use serde::{Deserialize, Serialize};

/// See the module.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Staging {
    /// How its time goes.
    pub playback: Playback,
    /// What of it is there.
    pub excerpt: Excerpt,
}

/// Scene time by the server's clock: both ends reckon the same from it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Playback {
    /// By the server's clock, in seconds, it was ...
    pub from_s: f64,
    /// ... so late in the scene, in seconds, and goes on from there ...
    pub scene_time_s: f64,
    /// ... so many times as fast as the clock: 0 where it stands, else from [`Playback::SLOWEST`] to [`Playback::FASTEST`].
    pub rate: f64,
}

impl Default for Playback {
    /// Scene time is the server's clock.
    fn default() -> Playback {
        Playback { from_s: 0.0, scene_time_s: 0.0, rate: 1.0 }
    }
}

impl Playback {
    /// What is shown faster is missed.
    pub const FASTEST: f64 = 16.0;
    /// What goes more slowly stands: where it is next could not be told in f32.
    pub const SLOWEST: f64 = 1e-3;
    /// No time is put later or earlier, in seconds: f64 tells a microsecond there, and a scene would have played for thirty years.
    const FARTHEST_S: f64 = 1e9;

    /// Scene time at a time of the server's clock.
    pub fn scene_time_s(&self, server_time_s: f64) -> f64 {
        self.scene_time_s + self.rate * (server_time_s - self.from_s)
    }

    /// Whether the scene stands still.
    pub fn is_paused(&self) -> bool {
        self.rate == 0.0
    }

    /// From now on at another rate.
    pub fn at_rate(&self, rate: f64, server_time_s: f64) -> Playback {
        Playback { from_s: server_time_s, scene_time_s: self.scene_time_s(server_time_s), rate }
    }

    /// From now on from another time of the scene.
    pub fn from(&self, scene_time_s: f64, server_time_s: f64) -> Playback {
        Playback { from_s: server_time_s, scene_time_s, rate: self.rate }
    }

    /// Whether its values are what they are said to be.
    pub fn is_valid(&self) -> bool {
        let times = [self.from_s, self.scene_time_s];
        let rates = Playback::SLOWEST..=Playback::FASTEST;
        times.iter().all(|time_s| time_s.abs() <= Playback::FARTHEST_S)
            && (self.is_paused() || rates.contains(&self.rate))
    }
}

/// What of a scene is there.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Excerpt {
    /// Which of its objects.
    pub parts: Parts,
    /// What of them is cut off; nothing where there is none.
    pub section: Option<Section>,
}

impl Excerpt {
    /// Whether all of the scene is there.
    pub fn is_all(&self) -> bool {
        *self == Excerpt::default()
    }

    /// Whether its values are what they are said to be.
    pub fn is_valid(&self) -> bool {
        self.parts.is_valid() && self.section.is_none_or(|section| section.is_valid())
    }
}

/// Which objects of a scene are there. Ids ascend; at most [`Parts::MOST`] are named.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Parts {
    /// All.
    #[default]
    All,
    /// All but these.
    But(Vec<u16>),
    /// These alone.
    Only(Vec<u16>),
}

impl Parts {
    /// Objects that are named at most: a message stays within a packet.
    pub const MOST: usize = 256;

    /// Whether an object is there.
    pub fn shows(&self, object: u16) -> bool {
        match self {
            Parts::All => true,
            Parts::But(hidden) => hidden.binary_search(&object).is_err(),
            Parts::Only(shown) => shown.binary_search(&object).is_ok(),
        }
    }

    /// The same without an object; as it is where no more can be named.
    pub fn without(&self, object: u16) -> Parts {
        match self {
            Parts::All => Parts::But(vec![object]),
            Parts::But(hidden) => Parts::But(with(hidden, object)),
            Parts::Only(shown) => Parts::Only(shown.iter().copied().filter(|other| *other != object).collect()),
        }
    }

    fn is_valid(&self) -> bool {
        match self {
            Parts::All => true,
            Parts::But(named) | Parts::Only(named) => named.len() <= Parts::MOST && named.is_sorted_by(|a, b| a < b),
        }
    }
}

fn with(named: &[u16], object: u16) -> Vec<u16> {
    let mut named = named.to_vec();
    if let Err(place) = named.binary_search(&object)
        && named.len() < Parts::MOST
    {
        named.insert(place, object);
    }
    named
}

/// A plane that cuts a scene open: what lies beyond it, where `normal · point > offset`, is not there.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Section {
    /// Unit length, in world space.
    pub normal_world: DVec3,
    /// How far the plane lies from the origin along it, in metres.
    pub offset_m: f64,
}

impl Section {
    /// Whether a point is there.
    pub fn shows(&self, point_world: DVec3) -> bool {
        self.normal_world.dot(point_world) <= self.offset_m
    }

    fn is_valid(&self) -> bool {
        self.normal_world.is_normalized() && self.offset_m.is_finite()
    }
}

/// How a scene moves by itself.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub enum SceneMotion {
    /// Not at all.
    #[default]
    Still,
    /// It goes on for ever, or nobody knows for how long.
    Endless,
    /// It begins again.
    Loop {
        /// After so many seconds.
        period_s: f64,
    },
}

impl SceneMotion {
    /// Whether its value is what it is said to be.
    pub fn is_valid(&self) -> bool {
        match self {
            SceneMotion::Still | SceneMotion::Endless => true,
            SceneMotion::Loop { period_s } => period_s.is_finite() && *period_s > 0.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn time_goes_on_from_where_it_is_at_every_change() {
        let plays = Playback::default();
        assert_eq!(plays.scene_time_s(0.1 + 0.2), 0.1 + 0.2, "to the last bit");
        let paused = plays.at_rate(0.0, 12.0);
        assert_eq!((paused.scene_time_s(99.0), paused.is_paused()), (12.0, true));
        let twice = paused.at_rate(2.0, 20.0);
        assert_eq!(twice.scene_time_s(21.5), 15.0);
        let elsewhere = twice.from(3.0, 30.0);
        assert_eq!(elsewhere.scene_time_s(31.0), 5.0);
        let wrong = [f64::NAN, -0.5, 1e-44, 17.0].map(|rate| Playback { rate, ..plays });
        assert!(wrong.iter().chain(&[Playback { from_s: 2e9, ..plays }]).all(|wrong| !wrong.is_valid()));
        assert!(elsewhere.is_valid());
    }

    #[test]
    fn parts_are_hidden_one_after_the_other_up_to_a_cap() {
        let hidden = Parts::All.without(7).without(3).without(7);
        assert_eq!(hidden, Parts::But(vec![3, 7]));
        assert!(!hidden.shows(3) && hidden.shows(4));
        let only = Parts::Only(vec![1, 2]).without(2);
        assert!(only.shows(1) && !only.shows(2) && !only.shows(0));
        let full = (0..400).fold(Parts::All, |parts, object| parts.without(object));
        assert!(full.is_valid() && !full.shows(255) && full.shows(256));
        assert!(!Parts::Only(vec![2, 1]).is_valid() && !Parts::But(vec![1, 1]).is_valid());
        assert!(!Parts::But((0..257).collect()).is_valid());
    }

    #[test]
    fn a_section_has_a_side_that_is_there() {
        let section = Section { normal_world: DVec3::Y, offset_m: 2.0 };
        assert!(section.shows(DVec3::Y) && !section.shows(DVec3::Y * 3.0));
        let excerpt = |section| Excerpt { section: Some(section), ..Excerpt::default() };
        assert!(excerpt(section).is_valid() && !excerpt(section).is_all());
        assert!(!excerpt(Section { normal_world: DVec3::ONE, ..section }).is_valid());
        assert!(!excerpt(Section { offset_m: f64::INFINITY, ..section }).is_valid());
    }
}
