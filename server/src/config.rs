//! What a server is told: options as plain values, with their limits.

use std::net::{IpAddr, Ipv4Addr};
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use protocol::message::Clock;
use protocol::{Look, Tone};
use scene::environment::Environment;

use crate::access::Access;
use crate::broker::Broker;
use crate::coding::CodingRule;
use crate::discretize::placement::Placement;
use crate::discretize::{Discretization, MAX_IMAGES};
use crate::tls::Tls;

/// Where views of the scene and of copies are laid beside each other.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, clap::ValueEnum)]
pub enum ComparesOn {
    /// On a GPU, unless it is only software.
    #[default]
    Faster,
    /// On the GPU, whatever it is, where it has compute shaders.
    Gpu,
    /// On the processor.
    Processor,
}

/// Everything about a server but its scene.
#[derive(Debug, Clone)]
pub struct Config {
    /// Address to listen on.
    pub bind: IpAddr,
    /// Port to listen on; 0 picks a free one.
    pub port: u16,
    /// How the images of a set are made.
    pub discretization: Discretization,
    /// Where a set's images are taken from.
    pub placement: Placement,
    /// Whether objects that many share the shape of are shown by one image for all, see [`crate::impostors::relief`].
    pub relief: bool,
    /// Whether what is less as its triangles than as samples is sent so, see [`crate::bodies`].
    pub bodies: bool,
    /// Whether a viewer who stands still in a still scene is sent his own view, see [`crate::rest`].
    pub rest: bool,
    /// Whether what a viewer will need next is sent while nobody needs anything, see [`crate::anticipate`].
    pub anticipation: bool,
    /// Images a set, 1 to [`Config::MAX_IMAGES`].
    pub images: usize,
    /// An image has as many pixels as a square of this side, in the shape of the view; within [`Config::IMAGE_SIZES_PX`].
    pub image_size_px: u32,
    /// Where what clients lack is found out, see [`crate::beside`].
    pub compares_on: ComparesOn,
    /// How samples are coded.
    pub coding: CodingRule,
    /// How colour is shown.
    pub look: Look,
    /// The light from all around of [`Look::Full`]; `None` for a neutral studio.
    pub environment: Option<Arc<Environment>>,
    /// From light to the picture, of [`Look::Full`].
    pub tone: Tone,
    /// What all light is multiplied by, of [`Look::Full`].
    pub exposure: f32,
    /// The clock that sessions run on.
    pub clock: Clock,
    /// Ticks a second of a session.
    pub update_hz: f64,
    /// Folder of the built web client; `None` for the one that is built in.
    pub web: Option<PathBuf>,
    /// Who may connect.
    pub access: Access,
    /// What https and wss are served by; `None` for http and ws.
    pub tls: Option<Tls>,
    /// Where what is presented is published for relays; `None` for nowhere.
    pub publish: Option<Broker>,
    /// Caps and patience.
    pub limits: ServerLimits,
}

impl Config {
    /// Images of a set at most.
    pub const MAX_IMAGES: usize = MAX_IMAGES;
    /// Sizes of an image.
    pub const IMAGE_SIZES_PX: std::ops::RangeInclusive<u32> = 16..=4096;
}

impl Default for Config {
    fn default() -> Self {
        Config {
            bind: IpAddr::V4(Ipv4Addr::LOCALHOST),
            port: 8080,
            discretization: Discretization::default(),
            placement: Placement::default(),
            relief: true,
            bodies: true,
            rest: true,
            anticipation: true,
            images: 4,
            image_size_px: 512,
            compares_on: ComparesOn::default(),
            coding: CodingRule::default(),
            look: Look::default(),
            environment: None,
            tone: Tone::Neutral,
            exposure: 1.0,
            clock: Clock::default(),
            update_hz: 10.0,
            web: None,
            access: Access::default(),
            tls: None,
            publish: None,
            limits: ServerLimits::default(),
        }
    }
}

/// What one server puts up with.
#[derive(Debug, Clone, Copy)]
pub struct ServerLimits {
    /// Sessions at one time; more are told to come again.
    pub clients: usize,
    /// What a session's copy may be large for at most, in bytes at the client, whatever the client names: the server keeps
    /// and draws one as large.
    pub budget_bytes: u64,
    /// A connected client must say hello within this time.
    pub hello: Duration,
    /// A message must leave for the client, and what was sent must be acknowledged, within this time.
    pub stall: Duration,
    /// A client must be heard within this time; it sends a ping every few seconds.
    pub silence: Duration,
    /// What is kept of sessions that were cut off, for clients that come back.
    pub resume: ResumeLimits,
    /// Connections at one time at most that have not said who they are, or are told why they may not stay.
    pub doorsteps: usize,
    /// What all peers of one address may take together.
    pub peers: PeerLimits,
}

/// What all peers of one address may take together; of IPv6, those of one network of 64 bits.
#[derive(Debug, Clone, Copy)]
pub struct PeerLimits {
    /// Connections at one time; 0 for as many as come, and no other limit of an address.
    pub connections: usize,
    /// Of these, those that have not said who they are.
    pub doorsteps: usize,
    /// Handshakes a second, on average: of TLS, and of websockets.
    pub handshakes_per_s: f64,
    /// Handshakes at once.
    pub handshake_burst: f64,
    /// Whether programs of this machine are counted too.
    pub loopback: bool,
}

/// What a server keeps of sessions that were cut off.
#[derive(Debug, Clone, Copy)]
pub struct ResumeLimits {
    /// Each for so long.
    pub time: Duration,
    /// All together at most, as what their copies are for the server.
    pub bytes: u64,
}

impl Default for ServerLimits {
    fn default() -> Self {
        ServerLimits {
            clients: 256,
            budget_bytes: protocol::session::DEFAULT_BUDGET_BYTES,
            hello: Duration::from_secs(10),
            stall: Duration::from_secs(30),
            silence: Duration::from_secs(60),
            resume: ResumeLimits { time: Duration::from_secs(120), bytes: 1 << 30 },
            doorsteps: 1024,
            peers: PeerLimits::default(),
        }
    }
}

impl Default for PeerLimits {
    fn default() -> Self {
        // A floor of people behind one address, each with a page that is loaded over a few connections and one session.
        PeerLimits { connections: 64, doorsteps: 32, handshakes_per_s: 16.0, handshake_burst: 128.0, loopback: false }
    }
}
