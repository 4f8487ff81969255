//! What a person chooses between when he chooses a quality.

use std::str::FromStr;

use crate::draw::antialiasing::Antialias;
use crate::draw::effects::InTime;
use crate::draw::frame;
use crate::draw::occlusion::{self, Occlusion};
use crate::draw::picture::PictureOptions;
use crate::draw::shadow::{self, Shadows};
use crate::draw::soft::{self, Pace};
use crate::draw::steady::FrameRate;

/// See the module.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Quality {
    /// As was asked for at first: as much as frames have time for, where nothing else was.
    #[default]
    Auto,
    /// No shadows, no occlusion, one sample a pixel.
    Fast,
    /// Everything, however long it takes.
    Fine,
}

impl Quality {
    /// How pictures of it are drawn, where those of [`Quality::Auto`] are drawn so.
    pub fn options(self, auto: PictureOptions) -> PictureOptions {
        let in_time = InTime { shadows: false, occlusion: false };
        let soft = soft::Settings { pace: Pace::All, ..auto.shadow.soft };
        let taps = occlusion::Settings::default().taps;
        let with = |shadows: Shadows, occlusion: Occlusion, antialias: Antialias| PictureOptions {
            frame: frame::Options { antialias, ..auto.frame },
            shadow: shadow::Settings { shadows, soft, ..auto.shadow },
            occlusion: occlusion::Settings { occlusion, taps, ..auto.occlusion },
            in_time,
            ..auto
        };
        match self {
            Quality::Auto => auto,
            Quality::Fast => with(Shadows::None, Occlusion::None, Antialias::Off),
            Quality::Fine => with(Shadows::Soft, Occlusion::Graph, Antialias::On),
        }
    }

    /// The same for both eyes of a headset. Each of their pictures is drawn as a whole, and what goes on from one picture of an eye to its next is left out: the other's is
    /// between them.
    pub fn headset_options(self, auto: PictureOptions) -> PictureOptions {
        let quality = if self == Quality::Auto { Quality::Fast } else { self };
        let options = quality.options(auto);
        let antialias = if self == Quality::Fast { Antialias::Off } else { Antialias::On };
        PictureOptions { frame: frame::Options { antialias, ..options.frame }, frame_rate: FrameRate::Free, ..options }
    }
}

impl FromStr for Quality {
    type Err = String;

    fn from_str(name: &str) -> Result<Quality, String> {
        match name {
            "auto" => Ok(Quality::Auto),
            "fast" => Ok(Quality::Fast),
            "fine" => Ok(Quality::Fine),
            other => Err(format!("{other} is no quality: use auto, fast or fine")),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fine_draws_all_and_fast_draws_nothing_that_is_not_asked_for() {
        let auto = PictureOptions { in_time: InTime { shadows: true, occlusion: true }, ..PictureOptions::default() };
        let of = |name: &str| name.parse::<Quality>().expect("a quality").options(auto);
        assert_eq!(of("fast").draws(), protocol::message::Draws::default());
        let fine = of("fine").draws();
        assert!(fine.antialiased && fine.occlusion_reach_m > 0.0 && fine.shadows == protocol::message::Shadows::Soft);
        assert_eq!(of("auto").draws(), auto.draws());
        let headset = Quality::Auto.headset_options(PictureOptions { frame_rate: FrameRate::Held, ..auto });
        assert_eq!((headset.frame_rate, headset.in_time), (FrameRate::Free, InTime::default()));
        assert!(headset.draws().antialiased, "of what is so near to an eye each pixel is seen");
        assert!("best".parse::<Quality>().unwrap_err().contains("auto, fast or fine"));
    }
}
