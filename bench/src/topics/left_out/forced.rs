//! What may be forced in.

use network::Link;
use protocol::message::{Clock, Draws, Shadows};

use crate::topics::novel_views::live::{Operation, two_of_ten};

/// Something that a server leaves out where it is not needed.
pub struct Thing {
    /// For people, as forced in.
    pub name: &'static str,
    /// What is forced.
    pub what: &'static str,
    force: fn(&mut Forced),
}

/// Each, in the order of the report.
pub const THINGS: &[Thing] = &[
    Thing { name: "samples of all", what: "nothing goes as its triangles", force: |forced| forced.bodies = false },
    Thing {
        name: "no reliefs",
        what: "nor by an image that many objects share",
        force: |forced| (forced.bodies, forced.relief) = (false, false),
    },
    Thing {
        name: "light sets",
        what: "what lights see is sent, though no shadow is drawn",
        force: |forced| forced.told.shadows = Shadows::Soft,
    },
    Thing {
        name: "occluders",
        what: "what hides ambient light is sent, though none is drawn",
        force: |forced| forced.told.occlusion_reach_m = REACH_M,
    },
];

/// How far occluders reach that are asked for.
const REACH_M: f64 = 0.5;

/// What is forced in of all.
#[derive(Debug, Clone, Copy)]
pub struct Forced {
    bodies: bool,
    relief: bool,
    told: Draws,
}

impl Default for Forced {
    /// Nothing: as a server decides.
    fn default() -> Forced {
        Forced { bodies: true, relief: true, told: Draws::default() }
    }
}

impl Forced {
    /// One thing.
    pub fn only(thing: &Thing) -> Forced {
        let mut forced = Forced::default();
        (thing.force)(&mut forced);
        forced
    }

    /// All of them.
    pub fn everything() -> Forced {
        let mut forced = Forced::default();
        THINGS.iter().for_each(|thing| (thing.force)(&mut forced));
        forced
    }

    /// A server that makes it so, behind a link.
    pub fn operation(&self, link: Link) -> Operation {
        Operation {
            images: 4,
            image_px: 512,
            link,
            clock: Clock::Virtual,
            drawn: two_of_ten,
            scored: two_of_ten,
            anticipates: true,
            bodies: self.bodies,
            relief: self.relief,
            told: Some(self.told),
            antialias: false,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_thing_changes_what_a_server_makes_and_everything_all_of_it() {
        let differs = |forced: &Forced| {
            let decided = Forced::default();
            [forced.bodies != decided.bodies, forced.relief != decided.relief, forced.told != decided.told]
        };
        assert!(THINGS.iter().all(|thing| differs(&Forced::only(thing)).contains(&true)));
        assert_eq!(differs(&Forced::everything()), [true; 3]);
        let told = Forced::everything().told;
        assert!(told.shadows == Shadows::Soft && told.occlusion_reach_m > 0.0);
    }
}
