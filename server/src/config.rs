//! What a server is told: options as plain values, with their limits.

use std::net::{IpAddr, Ipv4Addr};
use std::path::PathBuf;
use std::sync::Arc;

use protocol::message::Clock;
use protocol::{Look, Tone};
use scene::environment::Environment;

use crate::access::Access;
use crate::broker::Broker;
use crate::coding::CodingRule;
use crate::discretize::placement::Placement;
use crate::discretize::{Discretization, MAX_IMAGES};
use crate::limits::ServerLimits;
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
    /// Whether a viewer who stands still in a scene that stands still, or that he paused, is sent his own view, see [`crate::rest`].
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
    /// Whether small pictures of scenes are made, for who chooses among several.
    pub thumbnails: bool,
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
            thumbnails: false,
            publish: None,
            limits: ServerLimits::default(),
        }
    }
}
