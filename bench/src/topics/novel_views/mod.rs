//! Topic `novel-views`: a camera trace replayed against the real server, over real sockets and an emulated network.
//!
//! Server and headless viewer run in this process and talk over loopback; on the virtual clock the link's delays are stamps, on
//! the wall clock a proxy's. Every picture is scored against the full scene at its pose (`truths`); every byte that crosses
//! the socket counts (`live`). Beside it stand video at several bit rates, the same bytes among them (`video`), and, under
//! `--protocol quasar-2025`, the figures of other systems on the same scenes and traces ([`peers`], [`setup`]).

mod curves;
mod ffmpeg;
mod live;
mod output;
pub mod peers;
pub mod setup;
mod truths;
mod video;

use std::path::PathBuf;

use anyhow::ensure;
use clap::Args;
use gpu::Gpu;
use network::Link;
use protocol::message::Clock;

use crate::report::progress::Progress;
use crate::report::{Report, Row};
use crate::topic::{Run, Topic, scene_label};
use live::Operation;
use output::{Outcome, What};
use setup::{CLIENT_HZ, Network, Replay, SERVER_HZ};
use truths::Truths;
use video::MARGIN_RAD;

/// See the module.
pub struct NovelViews;

/// Sides of the images that trade bytes for error.
const IMAGE_SIZES_PX: &[u32] = &[256, 384, 512, 724];
const QUICK_IMAGE_SIZES_PX: &[u32] = &[256, 512];
/// Round trips of the network, in milliseconds; each with a fifth of jitter.
const ROUND_TRIPS_MS: &[f64] = &[20.0, 100.0, 200.0];
/// Bit rates of the video, in Mbit/s, beside the one that spends what we spend.
const VIDEO_MBIT: &[f64] = &[1.0, 2.0, 4.0, 8.0, 16.0];
const QUICK_VIDEO_MBIT: &[f64] = &[2.0, 8.0];

/// What the topic takes beside what every topic takes.
#[derive(Args, Debug)]
struct Arguments {
    /// Replay the scenes and traces of other systems' published figures, as they did, and show those figures beside ours.
    #[arg(long, value_enum)]
    protocol: Option<Protocol>,
    /// The emulated network, e.g. rtt=100,jitter=20,mbit=20 (milliseconds, Mbit/s each way). Default: rtt=100,jitter=20, or the
    /// protocol's.
    #[arg(long, value_name = "LINK")]
    network: Option<Link>,
    /// Time advances with the viewer's stamps, the same on every machine; or real time.
    #[arg(long, value_enum, default_value_t)]
    clock: ClockName,
    /// Images a set.
    #[arg(long, default_value_t = 4, value_parser = clap::value_parser!(u64).range(1..=server::Config::MAX_IMAGES as u64))]
    images: u64,
    /// An image has as many pixels as a square of this side, in the shape of the view.
    #[arg(long, value_name = "PX", default_value_t = 512, value_parser = clap::value_parser!(u32).range(
        i64::from(*server::Config::IMAGE_SIZES_PX.start())..=i64::from(*server::Config::IMAGE_SIZES_PX.end())))]
    image_size: u32,
    /// Stop after so many pictures.
    #[arg(long, value_name = "N")]
    frames: Option<usize>,
    /// Only the run at these settings: no other image sizes and round trips.
    #[arg(long)]
    no_sweeps: bool,
    /// The ffmpeg to code video with.
    #[arg(long, value_name = "PATH", default_value = "ffmpeg")]
    ffmpeg: PathBuf,
}

/// `--protocol`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum Protocol {
    /// Three scenes that QUASAR (SIGGRAPH 2025) and its baselines were run on; files in VANTAGE_ASSETS.
    #[value(name = "quasar-2025")]
    Quasar2025,
}

/// `--clock`.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, clap::ValueEnum)]
enum ClockName {
    /// Time advances with the viewer's stamps.
    #[default]
    Virtual,
    /// Real time.
    Wall,
}

impl Topic for NovelViews {
    fn name(&self) -> &'static str {
        "novel-views"
    }

    fn about(&self) -> &'static str {
        "A camera trace replayed against the real server through an emulated network: error of every picture against the full \
         scene, bytes of every kind, beside video of the same bytes and, under a protocol, other systems' published figures."
    }

    fn default_scenes(&self, quick: bool) -> Vec<String> {
        let scenes: &[&str] = if quick { &["pillars"] } else { &["pillars", "urban", "urban-moving"] };
        scenes.iter().map(|&name| name.to_owned()).collect()
    }

    fn arguments(&self, command: clap::Command) -> clap::Command {
        Arguments::augment_args(command)
    }

    fn run(&self, run: &Run, report: &mut Report) -> anyhow::Result<()> {
        let arguments: Arguments = run.arguments()?;
        ensure!(
            arguments.protocol.is_none() || (run.trace.is_none() && run.size_px.is_none()),
            "a protocol has traces and a size of its own: leave out --trace and --size"
        );
        let gpu = run.gpu(report)?.clone();
        let scenes = match arguments.protocol {
            Some(Protocol::Quasar2025) if !run.names_scenes() => setup::QUASAR_2025.map(str::to_owned).to_vec(),
            _ => run.scenes.clone(),
        };
        report.scene = scenes.iter().map(|scene| scene_label(scene)).collect();
        let bench = Bench::new(&gpu, run, &arguments, scenes.len());
        describe(report, &bench);
        for scene in &scenes {
            let measured = bench.replay(scene).and_then(|replay| bench.measure(&replay, report));
            if let Err(error) = measured {
                report.rows.push(Row::failed(&scene_label(scene), "replay", &error));
            }
        }
        Ok(())
    }
}

/// What all scenes share.
struct Bench<'a> {
    gpu: &'a Gpu,
    run: &'a Run,
    arguments: &'a Arguments,
    has_ffmpeg: bool,
    progress: Progress,
}

impl<'a> Bench<'a> {
    fn new(gpu: &'a Gpu, run: &'a Run, arguments: &'a Arguments, scenes: usize) -> Bench<'a> {
        let progress = Progress::new("novel-views", scenes as u64);
        Bench { gpu, run, arguments, has_ffmpeg: ffmpeg::is_installed(&arguments.ffmpeg), progress }
    }

    fn replay(&self, scene: &str) -> anyhow::Result<Replay> {
        let (arguments, run) = (self.arguments, self.run);
        let mut replay = match arguments.protocol {
            Some(Protocol::Quasar2025) => setup::quasar_2025(scene, &setup::assets()?, arguments.frames)?,
            None => setup::own(scene, run.trace.as_deref(), run.size_px, arguments.frames)?,
        };
        if let Some(link) = arguments.network {
            replay.networks = vec![Network::of_link(link)];
        }
        Ok(replay)
    }

    /// Everything about one scene.
    fn measure(&self, replay: &Replay, report: &mut Report) -> anyhow::Result<()> {
        ensure!(!replay.networks.is_empty(), "a replay has a network");
        let mut truths = Truths::new(self.gpu, replay)?;
        let mut outcomes = Vec::new();
        let all: Drawn = if self.run.quick { two_of_ten } else { |_| true };
        for network in &replay.networks {
            let ours = self.ours(replay, &mut truths, network, (self.arguments.image_size, all), What::Main)?;
            let bit_rates = if self.run.quick { QUICK_VIDEO_MBIT } else { VIDEO_MBIT };
            let mut bit_rates: Vec<_> = bit_rates.iter().map(|&mbit| (mbit, two_of_ten as Drawn, What::Size)).collect();
            bit_rates.push((ours.mbit_s(), all, What::Main));
            let videos = self.videos(replay, &mut truths, network, &ours, &bit_rates)?;
            output::pictures(self.run, report, replay, network, &ours, videos.last())?;
            outcomes.push(ours);
            outcomes.extend(videos);
        }
        if !self.arguments.no_sweeps {
            outcomes.extend(self.sizes(replay, &mut truths)?);
            outcomes.extend(self.round_trips(replay, &mut truths)?);
        }
        if self.arguments.protocol.is_some() {
            outcomes.extend(output::peers_of(replay)?);
        }
        self.progress.step();
        output::show(self.run, report, replay, outcomes)
    }

    /// Error against bytes, over the main network.
    fn sizes(&self, replay: &Replay, truths: &mut Truths) -> anyhow::Result<Vec<Outcome>> {
        let sizes = if self.run.quick { QUICK_IMAGE_SIZES_PX } else { IMAGE_SIZES_PX };
        let others = sizes.iter().filter(|&&size_px| size_px != self.arguments.image_size);
        others.map(|&px| self.ours(replay, truths, &replay.networks[0], (px, two_of_ten), What::Size)).collect()
    }

    /// Error against the network's round trip, ours and that of video of the same bytes.
    fn round_trips(&self, replay: &Replay, truths: &mut Truths) -> anyhow::Result<Vec<Outcome>> {
        let mut outcomes = Vec::new();
        for &rtt_ms in ROUND_TRIPS_MS {
            let link: Link = Link { rtt_s: rtt_ms / 1e3, jitter_s: rtt_ms / 5e3, ..replay.networks[0].link };
            let network = Network::of_link(link);
            let ours = self.ours(replay, truths, &network, (self.arguments.image_size, two_of_ten), What::RoundTrip)?;
            let same = [(ours.mbit_s(), two_of_ten as Drawn, What::RoundTrip)];
            let videos = self.videos(replay, truths, &network, &ours, &same)?;
            outcomes.push(ours);
            outcomes.extend(videos);
        }
        Ok(outcomes)
    }

    fn ours(
        &self,
        replay: &Replay,
        truths: &mut Truths,
        network: &Network,
        (image_px, drawn): (u32, Drawn),
        what: What,
    ) -> anyhow::Result<Outcome> {
        let images = self.arguments.images as usize;
        self.progress.say(format!("{}: {images} images of {image_px}, {}", replay.label, network.name));
        let clock = match self.arguments.clock {
            ClockName::Virtual => Clock::Virtual,
            ClockName::Wall => Clock::Wall,
        };
        let operation = Operation { images, image_px, link: network.link, clock, drawn };
        let lived = live::run(self.gpu, replay, &operation)?;
        output::ours(replay, network, &operation, lived, truths, what)
    }

    /// Video at bit rates over a network; without ffmpeg one row that says so.
    fn videos(
        &self,
        replay: &Replay,
        truths: &mut Truths,
        network: &Network,
        ours: &Outcome,
        bit_rates: &[(f64, Drawn, What)],
    ) -> anyhow::Result<Vec<Outcome>> {
        if !self.has_ffmpeg {
            return Ok(vec![output::without_ffmpeg(replay, network)]);
        }
        self.progress.say(format!("{}: video, {}", replay.label, network.name));
        let film = video::film(truths, replay, network.link)?;
        let one = |&(mbit, drawn, what): &(f64, Drawn, What)| {
            let watched = video::watch(truths, replay, network.link, &film, mbit, (&self.arguments.ffmpeg, drawn))?;
            output::video(replay, network, ours, watched, what)
        };
        bit_rates.iter().map(one).collect()
    }
}

/// Settings and notes.
fn describe(report: &mut Report, bench: &Bench<'_>) {
    let arguments = bench.arguments;
    report.settings.set("build", if cfg!(debug_assertions) { "development" } else { "release" });
    report.settings.set("clock", format!("{:?}", arguments.clock).to_lowercase());
    report.settings.set("client_hz", CLIENT_HZ);
    report.settings.set("server_hz", SERVER_HZ);
    report.settings.set("images", format!("{} of {1}x{1} pixels", arguments.images, arguments.image_size));
    if arguments.protocol == Some(Protocol::Quasar2025) {
        report.settings.set("protocol", "quasar-2025");
    }
    if let Some(link) = arguments.network {
        report.settings.set("network", link.to_string());
    }
    report.settings.set("video_margin_deg", MARGIN_RAD.to_degrees().round());
    report.notes = output::NOTES.iter().map(|&note| note.to_owned()).collect();
    if arguments.protocol.is_some() {
        report.notes.extend(output::PROTOCOL_NOTES.iter().map(|&note| note.to_owned()));
    }
}

/// Which pictures are drawn and scored.
type Drawn = fn(usize) -> bool;

/// Two neighbours of every ten pictures: few enough to be quick, and flicker is still known.
fn two_of_ten(frame: usize) -> bool {
    frame % 10 < 2
}
