//! Topic `novel-views`: a camera trace replayed against the real server, over real sockets and an emulated network.
//!
//! Server and headless viewer run in this process and talk over loopback; on the virtual clock the link's delays are stamps, on
//! the wall clock a proxy's. Every picture is scored against the full scene at its pose (`truths`); every byte that crosses
//! the socket counts (`live`). Beside it stand video at several bit rates, the same bytes among them (`video`), and, under
//! `--protocol quasar-2025`, the figures of other systems on the same scenes and traces ([`peers`], [`setup`]).
//!
//! With `--motion` the traces are made by [`crate::motion`], and each part of a motion is a row (`moving`).

mod arguments;
mod bench;
mod curves;
mod expected;
mod ffmpeg;
mod film;
pub(crate) mod live;
mod moving;
mod moving_table;
mod outcome;
mod output;
pub mod peers;
pub mod setup;
mod sheets;
pub(crate) mod truths;
mod video;

use anyhow::ensure;
use clap::Args;
use network::Link;
use server::options::AnticipationName;

use crate::report::{Report, Row};
use crate::topic::{Run, Topic, scene_label};
use arguments::{Arguments, Protocol};
use bench::Bench;
use live::{Drawn, Operation, two_of_ten};
use outcome::{Outcome, What};
use setup::{Network, Replay};
use truths::Truths;

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
        ensure!(
            arguments.motion.is_empty() || run.trace.is_none(),
            "motions are traces of their own: leave out --trace"
        );
        let gpu = run.gpu(report)?.clone();
        let scenes = match arguments.protocol {
            Some(Protocol::Quasar2025) if !run.names_scenes() => setup::QUASAR_2025.map(str::to_owned).to_vec(),
            _ => run.scenes.clone(),
        };
        report.scene = scenes.iter().map(|scene| scene_label(scene)).collect();
        let bench = Bench::new(&gpu, run, &arguments, scenes.len());
        output::describe(report, &bench);
        for scene in &scenes {
            if !arguments.motion.is_empty() {
                moving::measure(&bench, scene, report);
                continue;
            }
            let measured = bench.replay(scene).and_then(|replay| bench.measure(&replay, report));
            if let Err(error) = measured {
                report.rows.push(Row::failed(&scene_label(scene), "replay", &error));
            }
        }
        Ok(())
    }
}

impl Bench<'_> {
    /// Everything about one scene along a trace.
    fn measure(&self, replay: &Replay, report: &mut Report) -> anyhow::Result<()> {
        ensure!(!replay.networks.is_empty(), "a replay has a network");
        let mut truths = Truths::new(self.gpu, replay, self.arguments.antialias)?;
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
            // Other systems send what is in view: beside them stands a run that does no more.
            if self.arguments.protocol.is_some() && self.arguments.anticipation == AnticipationName::On {
                let operation = Operation { anticipates: false, ..self.operation(network, all, all) };
                outcomes.push(self.operated(replay, &mut truths, network, &operation, What::InView)?);
            }
        }
        if !self.arguments.no_sweeps {
            outcomes.extend(self.sizes(replay, &mut truths)?);
            outcomes.extend(self.round_trips(replay, &mut truths)?);
        }
        if self.arguments.protocol.is_some() {
            outcomes.extend(outcome::peers_of(replay)?);
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
        let operation = Operation { image_px, ..self.operation(network, drawn, drawn) };
        self.operated(replay, truths, network, &operation, what)
    }

    fn operated(
        &self,
        replay: &Replay,
        truths: &mut Truths,
        network: &Network,
        operation: &Operation,
        what: What,
    ) -> anyhow::Result<Outcome> {
        let Operation { images, image_px, .. } = operation;
        self.progress.say(format!("{}: {images} images of {image_px}, {}", replay.label, network.name));
        let lived = live::run(self.gpu, replay, operation)?;
        outcome::ours(replay, network, operation, lived, truths, what)
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
        if self.arguments.no_video {
            return Ok(Vec::new());
        }
        if !self.has_ffmpeg {
            return Ok(vec![outcome::without_ffmpeg(replay, network)]);
        }
        self.progress.say(format!("{}: video, {}", replay.label, network.name));
        let film = video::film(truths, replay, network.link)?;
        let one = |&(mbit, drawn, what): &(f64, Drawn, What)| {
            let watched = video::watch(truths, replay, network.link, &film, mbit, (&self.arguments.ffmpeg, drawn))?;
            outcome::video(replay, network, ours, watched, (self.arguments.antialias, what))
        };
        bit_rates.iter().map(one).collect()
    }
}
