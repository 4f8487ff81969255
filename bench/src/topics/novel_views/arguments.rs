//! What the topic is asked for.

use std::path::PathBuf;

use clap::Args;
use network::Link;
use server::options::{AnticipationName, BodiesName};

use crate::motion::Motion;
use crate::options;

/// What one `--motion` names.
pub type Motions = &'static [Motion];

/// Reads `--motion`.
pub fn motions(text: &str) -> Result<Motions, String> {
    if text == "all" {
        return Ok(&Motion::ALL);
    }
    let named = Motion::ALL.chunks(1).find(|motion| motion[0].name() == text);
    named.ok_or_else(|| "a motion is orbit, flick, walk, turn, rest or all".to_owned())
}

/// What the topic takes beside what every topic takes.
#[derive(Args, Debug)]
pub(super) struct Arguments {
    /// Replay the scenes and traces of other systems' published figures, as they did, and show those figures beside ours.
    #[arg(long, value_enum)]
    pub(super) protocol: Option<Protocol>,
    /// Instead of along a trace, move as people do: orbit, flick, walk, turn, rest, or all; may be given several times.
    #[arg(long, value_name = "MOTION", value_parser = motions, conflicts_with_all = ["protocol", "frames"])]
    pub(super) motion: Vec<Motions>,
    /// What a round of the motion orbit takes, in seconds.
    #[arg(long, value_name = "SECONDS", default_value_t = crate::motion::ORBIT_S, value_parser = options::seconds)]
    pub(super) orbit_s: f64,
    /// Hold an animated scene as it is at this time, for motions.
    #[arg(long, value_name = "SECONDS", requires = "motion", allow_negative_numbers = true)]
    pub(super) held_at: Option<f64>,
    /// How scenes are shown: plain, full, flat or flat-lit; full is that of materials of glTF.
    #[arg(long, value_name = "LOOK", default_value = "plain", value_parser = options::look, conflicts_with = "protocol")]
    pub(super) look: protocol::Look,
    /// Antialiasing on both sides: video of frames with 16 samples a pixel, judged by a truth with as many.
    #[arg(long)]
    pub(super) antialias: bool,
    /// Whether the server sends what a viewer will need next while nobody needs anything. Under a protocol both are shown unless this is off.
    #[arg(long, value_enum, default_value_t)]
    pub(super) anticipation: AnticipationName,
    /// Whether what is less as its triangles than as samples is sent so, once.
    #[arg(long, value_enum, default_value_t)]
    pub(super) bodies: BodiesName,
    /// Also an animated picture of each motion: what was shown, video of the same bytes, and the truth. Takes ffmpeg.
    #[arg(long, requires = "motion", conflicts_with = "no_video")]
    pub(super) film: bool,
    /// No video beside it.
    #[arg(long)]
    pub(super) no_video: bool,
    /// The emulated network, e.g. rtt=100,jitter=20,mbit=20 (milliseconds, Mbit/s each way); may be given several times. Default:
    /// rtt=100,jitter=20, or the protocol's.
    #[arg(long, value_name = "LINK")]
    pub(super) network: Vec<Link>,
    /// Time advances with the viewer's stamps, the same on every machine; or real time.
    #[arg(long, value_enum, default_value_t)]
    pub(super) clock: ClockName,
    /// Images a set.
    #[arg(long, default_value_t = 4, value_parser = clap::value_parser!(u64).range(1..=server::Config::MAX_IMAGES as u64))]
    pub(super) images: u64,
    /// An image has as many pixels as a square of this side, in the shape of the view.
    #[arg(long, value_name = "PX", default_value_t = 512, value_parser = clap::value_parser!(u32).range(
        i64::from(*server::Config::IMAGE_SIZES_PX.start())..=i64::from(*server::Config::IMAGE_SIZES_PX.end())))]
    pub(super) image_size: u32,
    /// Stop after so many pictures.
    #[arg(long, value_name = "N")]
    pub(super) frames: Option<usize>,
    /// Only the run at these settings: no other image sizes and round trips.
    #[arg(long)]
    pub(super) no_sweeps: bool,
    /// The ffmpeg to code video with.
    #[arg(long, value_name = "PATH", default_value = "ffmpeg")]
    pub(super) ffmpeg: PathBuf,
}

/// `--protocol`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub(super) enum Protocol {
    /// Three scenes that QUASAR (SIGGRAPH 2025) and its baselines were run on; files in VANTAGE_ASSETS.
    #[value(name = "quasar-2025")]
    Quasar2025,
}

/// `--clock`.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, clap::ValueEnum)]
pub(super) enum ClockName {
    /// Time advances with the viewer's stamps.
    #[default]
    Virtual,
    /// Real time.
    Wall,
}
