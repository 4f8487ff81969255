//! What all scenes of a run share.

use gpu::Gpu;
use protocol::message::Clock;
use server::options::{AnticipationName, BodiesName};

use super::arguments::{Arguments, ClockName, Protocol};
use super::live::{Drawn, Operation};
use super::setup::{Network, Replay};
use super::{ffmpeg, setup};
use crate::report::progress::Progress;
use crate::topic::Run;

/// What all scenes share.
pub(super) struct Bench<'a> {
    pub(super) gpu: &'a Gpu,
    pub(super) run: &'a Run,
    pub(super) arguments: &'a Arguments,
    pub(super) has_ffmpeg: bool,
    pub(super) progress: Progress,
}

impl<'a> Bench<'a> {
    pub(super) fn new(gpu: &'a Gpu, run: &'a Run, arguments: &'a Arguments, scenes: usize) -> Bench<'a> {
        let progress = Progress::new("novel-views", scenes as u64);
        Bench { gpu, run, arguments, has_ffmpeg: ffmpeg::is_installed(&arguments.ffmpeg), progress }
    }

    pub(super) fn replay(&self, scene: &str) -> anyhow::Result<Replay> {
        let (arguments, run) = (self.arguments, self.run);
        let mut replay = match arguments.protocol {
            Some(Protocol::Quasar2025) => setup::quasar_2025(scene, &setup::assets()?, arguments.frames)?,
            None => setup::own(scene, run.trace.as_deref(), run.size_px, arguments.frames)?,
        };
        self.set_asked(&mut replay);
        Ok(replay)
    }

    /// The look and the networks that were asked for.
    pub(super) fn set_asked(&self, replay: &mut Replay) {
        if self.arguments.protocol.is_none() {
            replay.look = self.arguments.look;
        }
        if !self.arguments.network.is_empty() {
            replay.networks = self.arguments.network.iter().copied().map(Network::of_link).collect();
        }
    }

    /// As asked for.
    pub(super) fn operation(&self, network: &Network, drawn: Drawn, scored: Drawn) -> Operation {
        let clock = match self.arguments.clock {
            ClockName::Virtual => Clock::Virtual,
            ClockName::Wall => Clock::Wall,
        };
        Operation {
            images: self.arguments.images as usize,
            image_px: self.arguments.image_size,
            link: network.link,
            clock,
            drawn,
            scored,
            antialias: self.arguments.antialias,
            bodies: self.arguments.bodies == BodiesName::Auto,
            relief: true,
            told: None,
            anticipates: self.arguments.anticipation == AnticipationName::On,
        }
    }
}
