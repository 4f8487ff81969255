//! The messages of both directions.
//!
//! Every message travels in an envelope with `at_s`, its time on the sender's clock: under the wall clock information only;
//! under the virtual clock the time at which it counts as sent (server) or delivered (client, whose link model adds the way
//! up), so that nothing depends on how fast the machine is.

use camera::{Motion, Rigid};
use serde::{Deserialize, Serialize};

use crate::held::Update;
use crate::inventory::Inventory;
use crate::look::Look;
use crate::staging::{Playback, SceneMotion, Staging};

/// The version of the protocol; both ends must agree.
pub const VERSION: u16 = 27;

/// The websocket protocol that is spoken. A page that gives a token offers it beside [`TOKEN_SUBPROTOCOL`], as it can set no header.
pub const SUBPROTOCOL: &str = "vantage";
/// The beginning of a websocket protocol that is a token: its bytes follow in hexadecimal.
pub const TOKEN_SUBPROTOCOL: &str = "vantage.token.";

/// Which clock a session runs on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum Clock {
    /// Real time.
    #[default]
    Wall,
    /// Time advances only with [`ClientMessage::Advance`].
    Virtual,
}

/// What a client tells the server about its view.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ViewSize {
    /// Output width.
    pub width_px: u32,
    /// Output height.
    pub height_px: u32,
    /// Vertical field of view of the output.
    pub fov_y_rad: f64,
}

/// Which shadows a client draws.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Shadows {
    /// None.
    #[default]
    None,
    /// Every light casts as from its middle.
    Hard,
    /// Lights with an area cast soft shadows, others hard ones.
    Soft,
}

/// What a client draws that not every client does, and so has a use for.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Draws {
    /// Shadows, by what lights see ([`crate::Purpose::Light`]).
    pub shadows: Shadows,
    /// Antialiased pictures, at rest by what each pixel shows in parts ([`crate::DepthImage::share`]).
    pub antialiased: bool,
    /// Ambient occlusion by all that is within so many metres, also what the eye never saw ([`crate::Purpose::Occluders`]); 0: none.
    pub occlusion_reach_m: f64,
}

/// What a client is there for.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Role {
    /// Its viewer looks around.
    #[default]
    Viewer,
    /// It shows the image of the camera of this name, in place of a view of its own.
    Camera(String),
    /// Its viewer looks around, and others may follow him by this name.
    Presenter(String),
    /// It is sent what the presenter of this name is sent, as soon as there is one, and its viewer looks around in that. Poses of its own change
    /// nothing.
    Follower(String),
}

impl Role {
    /// The longest name of a presenter, in bytes.
    pub const MAX_NAME_BYTES: usize = 64;

    /// Whether it is sent what its own poses ask for.
    pub fn is_asking(&self) -> bool {
        matches!(self, Role::Viewer | Role::Presenter(_))
    }
}

/// What a client says first.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Hello {
    /// [`VERSION`].
    pub version: u16,
    /// The clock that the client asks for; the server refuses one that it does not run.
    pub clock: Clock,
    /// The output.
    pub view: ViewSize,
    /// What the held copy may take of the client's memory, in bytes; the server evicts what was least recently visible.
    pub budget_bytes: u64,
    /// What it draws.
    pub draws: Draws,
    /// What it is there for.
    pub role: Role,
    /// The eye, where that is known before the server says where to begin: the first picture is of what it sees.
    pub world_from_eye: Option<Rigid>,
    /// What it still holds, where a session was cut off.
    pub resume: Option<Resume>,
    /// How it has the scene put before it, where that is not as it is.
    pub staging: Option<Box<Staging>>,
}

/// What a client holds of a session that was cut off.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Resume {
    /// That session's [`Welcome::secret`].
    pub secret: u128,
    /// The last update that is held; all before it are.
    pub number: u64,
    /// Digest of the held copy.
    pub digest: u64,
}

/// From the client.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum ClientMessage {
    /// The first message.
    Hello(Box<Hello>),
    /// The output changed.
    View(ViewSize),
    /// Where the eye is. Sent only when it moved.
    Pose {
        /// Counts from 1.
        seq: u64,
        /// Client clock when the pose was sampled.
        sampled_at_s: f64,
        /// The eye.
        world_from_eye: Rigid,
        /// How it moves on, for prediction.
        motion: Motion,
    },
    /// An update was decoded and is held.
    Ack {
        /// Its number.
        number: u64,
        /// Digest of the held copy, checked by the server.
        digest: u64,
        /// Bytes of bulk received so far: the credit.
        bytes_received: u64,
    },
    /// The client's copy is broken: start anew.
    Restart,
    /// Answered by a pong with the same number.
    Ping(u32),
    /// Virtual clock only: run everything up to this time, then answer [`ServerMessage::Advanced`].
    Advance {
        /// Seconds.
        to_s: f64,
    },
    /// From now on it draws this.
    Draws(Draws),
    /// Answered by a [`ServerMessage::Inventory`].
    Inventory,
    /// From now on it has the scene put before it so.
    Stages(Box<Staging>),
    /// Answered by a [`ServerMessage::Name`].
    AskName {
        /// By its id.
        object: u16,
    },
}

/// From the server. `Update` is bulk: it is coded by the codec and travels in fragments.
#[derive(Debug, Clone, PartialEq)]
pub enum ServerMessage {
    /// The first message.
    Welcome(Welcome),
    /// Edits to what the client holds.
    Update(Box<Update>),
    /// The answer to a ping.
    Pong(u32),
    /// Virtual clock only: everything up to this time has been sent.
    Advanced {
        /// Seconds.
        to_s: f64,
    },
    /// To a follower: where the presenter's eye is, and how the time goes of what he is shown.
    Presenter {
        /// The eye.
        world_from_eye: Rigid,
        /// The time.
        playback: Playback,
    },
    /// What is made for the client, and what is left out.
    Inventory(Inventory),
    /// What an object is called.
    Name {
        /// By its id.
        object: u16,
        /// For a person; empty where there is no such object.
        name: String,
    },
    /// Why the server hangs up.
    Goodbye {
        /// For a person.
        reason: String,
        /// Whether it may be otherwise for who comes again just as it did now.
        again: bool,
    },
}

/// What a client learns at first.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Welcome {
    /// [`VERSION`].
    pub version: u16,
    /// For a person.
    pub scene_name: String,
    /// Smallest corner of the scene's bounds.
    pub bounds_min_world: [f64; 3],
    /// Largest corner of the scene's bounds.
    pub bounds_max_world: [f64; 3],
    /// Where to begin.
    pub start_world_from_eye: Rigid,
    /// Whether one walks in it (a room, a city) or turns it (an object).
    pub walk: bool,
    /// Nearest distance that may be drawn, in metres.
    pub near_m: f64,
    /// How colour is shown.
    pub look: Look,
    /// Seconds between two server ticks of this session.
    pub update_interval_s: f64,
    /// Scene time at the start of the session.
    pub scene_time_s: f64,
    /// How the scene moves by itself.
    pub motion: SceneMotion,
    /// Names this session to the server when it was cut off, see [`Resume`]; nobody else may know it.
    pub secret: u128,
    /// Whether what the client holds of the session that it named is what updates build on from here. If not, the first one clears it.
    pub resumed: bool,
}

impl Welcome {
    /// Whether its values are what they are said to be.
    pub fn is_sound(&self) -> bool {
        let bounds = self.bounds_min_world.iter().chain(&self.bounds_max_world);
        let finite = bounds.chain([&self.scene_time_s]).all(|value| value.is_finite());
        let positive = [self.near_m, self.update_interval_s].iter().all(|value| value.is_finite() && *value > 0.0);
        finite && positive && self.motion.is_valid() && self.start_world_from_eye.is_valid()
    }
}
