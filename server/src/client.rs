//! One client, as the stage serves it.

use std::sync::Arc;

use protocol::Inventory;
use protocol::message::Draws;
use protocol::session::DEFAULT_BUDGET_BYTES;
use protocol::staging::{Excerpt, Playback, Staging};

use crate::account::{Account, Known};
use crate::asked::Asked;
use crate::bodies::KeptBodies;
use crate::impostors::relief::KeptReliefs;
use crate::impostors::{Choices, Kept};
use crate::pace::Pace;
use crate::plan::{Focus, Rules};
use crate::portions::Portions;
use crate::{anticipate, lights, occluders, rest};

/// See the module.
#[derive(Debug)]
pub struct Client {
    /// What it holds.
    pub account: Account,
    /// The last look at it; `None` before any, and where it begins anew.
    pub focus: Option<Focus>,
    /// What moving costs it.
    pub pace: Pace,
    /// Server time when it was sent its first picture, coarse as it may be; `None` before.
    pub picture_sent_at_s: Option<f64>,
    /// Server time of the last look at what it lacks; 0 before any.
    pub looked_at_s: f64,
    /// Server time when an update was made for it last; 0 before any.
    pub made_at_s: f64,
    /// Which impostors serve the reflectors that it sees.
    pub choices: Choices,
    /// The impostors it was sent.
    pub impostors: Kept,
    /// The reliefs it was sent.
    pub reliefs: KeptReliefs,
    /// The bodies it was sent.
    pub bodies: KeptBodies,
    /// What it was sent of lights.
    pub lights: lights::Kept,
    /// What it was sent of what only occludes.
    pub occluders: occluders::Kept,
    /// What it was sent of its own view at rest.
    pub rest: rest::Kept,
    /// What it was looked ahead for.
    pub ahead: anticipate::Kept,
    /// How far a look has come that is taken in portions.
    pub portions: Portions,
    /// Where in its own view the last look ended that was taken band by band, as a share of its height.
    pub passing_begin: f64,
    /// Whether its next look is at one coarse image.
    pub begins_coarsely: bool,
    /// What its last look made for it, and what it left out.
    pub inventory: Arc<Inventory>,
    /// The camera that it asked for, in place of views of its own.
    pub asked: Option<Asked>,
    /// What it draws, and so has a use for.
    pub draws: Draws,
    /// What of the scene it is shown.
    pub excerpt: Excerpt,
    /// How its scene time goes.
    pub playback: Playback,
    /// Whether it was put to another time, which no look has been for yet.
    pub is_elsewhen: bool,
    /// What its copy may cost it, in bytes; see [`crate::account::BYTES_PER_SAMPLE`].
    pub budget_bytes: u64,
    /// Where its copy is drawn; see [`crate::imager::Imager::device`].
    pub device: u32,
}

/// What is known of a client beside what it holds, as far as that follows from looks for it.
#[derive(Debug, Clone)]
pub struct Served {
    /// By its account.
    pub known: Known,
    focus: Option<Focus>,
    choices: Choices,
    impostors: Kept,
    reliefs: KeptReliefs,
    bodies: KeptBodies,
    lights: lights::Kept,
    occluders: occluders::Kept,
    ahead: anticipate::Kept,
    portions: Portions,
    inventory: Arc<Inventory>,
}

impl Default for Client {
    fn default() -> Client {
        Client {
            account: Account::default(),
            focus: None,
            pace: Pace::default(),
            picture_sent_at_s: None,
            looked_at_s: 0.0,
            made_at_s: 0.0,
            choices: Choices::default(),
            impostors: Kept::default(),
            reliefs: KeptReliefs::default(),
            bodies: KeptBodies::default(),
            lights: lights::Kept::default(),
            occluders: occluders::Kept::default(),
            rest: rest::Kept::default(),
            ahead: anticipate::Kept::default(),
            portions: Portions::default(),
            passing_begin: 0.0,
            begins_coarsely: false,
            inventory: Arc::default(),
            asked: None,
            draws: Draws::default(),
            excerpt: Excerpt::default(),
            playback: Playback::default(),
            is_elsewhen: false,
            budget_bytes: DEFAULT_BUDGET_BYTES,
            device: 0,
        }
    }
}

impl Client {
    /// What is known of it now.
    pub fn served(&self) -> Served {
        Served {
            known: self.account.known().clone(),
            focus: self.focus,
            choices: self.choices.clone(),
            impostors: self.impostors.clone(),
            reliefs: self.reliefs.clone(),
            bodies: self.bodies.clone(),
            lights: self.lights.clone(),
            occluders: self.occluders.clone(),
            ahead: self.ahead.clone(),
            portions: self.portions.clone(),
            inventory: self.inventory.clone(),
        }
    }

    /// The same is known of it as of another client, whose account its own has followed.
    pub fn serve_as(&mut self, served: &Served) {
        self.focus = served.focus;
        self.choices = served.choices.clone();
        self.impostors = served.impostors.clone();
        self.reliefs = served.reliefs.clone();
        self.bodies = served.bodies.clone();
        self.lights = served.lights.clone();
        self.occluders = served.occluders.clone();
        self.ahead = served.ahead.clone();
        self.portions = served.portions.clone();
        self.inventory = served.inventory.clone();
    }

    /// What it draws from now on. Where that is something else, the server looks again at what it lacks for it.
    pub fn set_draws(&mut self, draws: Draws) {
        if std::mem::replace(&mut self.draws, draws) != draws {
            self.focus.iter_mut().for_each(|focus| focus.settled = false);
        }
    }

    /// How it has the scene put before it from now on; whether that is otherwise than before. What another excerpt shows is looked for anew, as lights and mirrors have other things before them.
    pub fn stage(&mut self, staging: &Staging) -> bool {
        let mut is_other = self.playback != staging.playback;
        if is_other {
            self.playback = staging.playback;
            self.is_elsewhen = true;
        }
        if self.excerpt != staging.excerpt {
            self.excerpt = staging.excerpt.clone();
            self.choices = Choices::default();
            self.start_anew();
            is_other = true;
        }
        is_other
    }

    /// The rules as they hold for it: what stands still for it is no scene that changes with time.
    pub fn rules(&self, of_scene: &Rules) -> Rules {
        let animated = of_scene.animated && (self.is_elsewhen || !self.playback.is_paused());
        Rules { animated, rests: of_scene.rests && !animated, ..*of_scene }
    }

    /// The client's copy is broken: the next update starts anew.
    pub fn start_anew(&mut self) {
        self.account.start_anew();
        self.lights = lights::Kept::default();
        self.occluders = occluders::Kept::default();
        self.rest = rest::Kept::default();
        self.ahead = anticipate::Kept::default();
        self.portions = Portions::default();
        self.asked.iter_mut().for_each(Asked::start_anew);
        self.focus = None;
        self.picture_sent_at_s = None;
    }
}
