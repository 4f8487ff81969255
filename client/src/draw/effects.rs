//! Whether shadows and ambient occlusion are drawn: as asked for, or as long as frames come in time with them.
//!
//! What is asked for *in time* begins switched off. Once frames come in time, it is drawn for a few of them without being seen; where these come in
//! time too it fades in, and where later ones do not it fades out again, to be tried anew after a while that doubles each time. So a picture
//! never jumps. One is tried after the other, and the one that came last goes first. A server sends for it only what is drawn.

use std::fmt;
use std::time::Duration;

use gpu::Gpu;
use web_time::Instant;

use crate::draw::device_times::DeviceTimes;

/// How much of what hides light counts, 0 to 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Strengths {
    /// Of what hides ambient light.
    pub occlusion: f32,
    /// Of what hides single lights.
    pub shadows: f32,
}

impl Default for Strengths {
    /// All of it.
    fn default() -> Strengths {
        Strengths { occlusion: 1.0, shadows: 1.0 }
    }
}

/// Which effects are drawn only as long as frames come in time; others always, as their settings say.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct InTime {
    /// Shadows.
    pub shadows: bool,
    /// Ambient occlusion.
    pub occlusion: bool,
}

/// What became of an effect, for people to read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Drawn {
    /// It was not asked for.
    Never,
    /// Whatever frames take.
    Always,
    /// Frames have not shown yet whether they would come in time.
    Undecided,
    /// Frames come in time with it.
    InTime,
    /// Frames do not come in time with it.
    TooSlow,
}

impl fmt::Display for Drawn {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Drawn::Never => "off",
            Drawn::Always | Drawn::InTime => "on",
            Drawn::Undecided => "not yet",
            Drawn::TooSlow => "off: too slow",
        })
    }
}

/// Frames come in time that the device takes no longer for: 30 a second.
const FAST: Duration = Duration::from_millis(33);
/// Frames that take longer are slow. Antialiasing is given up before, which is seen least while things move.
const SLOW: Duration = Duration::from_millis(55);
/// So many frames in time, one after the other, or so many slow ones, are no accident.
const FRAMES: u32 = 6;
/// Where so many frames decide nothing, it stays as it is.
const UNDECIDED_FRAMES: u32 = 60;
/// The first frames of an effect wait for shaders, and for what only they make.
const FIRST_FRAMES: u32 = 3;
/// From what is decided to what is seen: what a server sends for it is there by then.
const ARRIVAL: Duration = Duration::from_secs(1);
/// How long it takes to come and to go.
const FADE: Duration = Duration::from_millis(600);
/// How long it stays off after its first try; each time twice as long.
const REST: Duration = Duration::from_secs(8);

/// The effects that are drawn as long as frames come in time.
#[derive(Debug)]
pub(crate) struct Effects {
    /// In the order in which they are tried.
    shadows: Option<Effect>,
    occlusion: Option<Effect>,
    times: DeviceTimes<()>,
}

impl Effects {
    pub(crate) fn new(in_time: InTime) -> Effects {
        let effect = |in_time: bool| in_time.then(Effect::default);
        Effects {
            shadows: effect(in_time.shadows),
            occlusion: effect(in_time.occlusion),
            times: DeviceTimes::default(),
        }
    }

    /// Decides what the next frame draws.
    pub(crate) fn step(&mut self, now: Instant) {
        let times: Vec<Duration> = self.times.take().into_iter().map(|((), time)| time).collect();
        let first_is_settled = self.shadows.as_ref().is_none_or(Effect::is_settled);
        let last_is_off = self.occlusion.as_ref().is_none_or(|effect| !effect.is_drawn());
        for effect in self.shadows.iter_mut() {
            effect.step(now, if last_is_off { &times } else { &[] });
        }
        for effect in self.occlusion.iter_mut() {
            effect.step(now, if first_is_settled { &times } else { &[] });
        }
    }

    /// A frame was submitted just now.
    pub(crate) fn submitted(&self, gpu: &Gpu) {
        if self.all().next().is_some() {
            self.times.submitted(gpu, ());
        }
    }

    /// Frames do not come in time as a whole, however long the device worked at what was drawn instead: that is decided.
    pub(crate) fn missed(&self) {
        if self.all().next().is_some() {
            (0..FRAMES).for_each(|_| self.times.add((), 2 * SLOW));
        }
    }

    /// Whether shadows and occlusion are drawn.
    pub(crate) fn drawn(&self) -> InTime {
        let is_drawn = |effect: &Option<Effect>| effect.as_ref().is_some_and(Effect::is_drawn);
        InTime { shadows: is_drawn(&self.shadows), occlusion: is_drawn(&self.occlusion) }
    }

    /// Whether they are kept, and so are worth sending something for.
    pub(crate) fn kept(&self) -> InTime {
        let is_kept = |effect: &Option<Effect>| effect.as_ref().is_some_and(Effect::is_kept);
        InTime { shadows: is_kept(&self.shadows), occlusion: is_kept(&self.occlusion) }
    }

    pub(crate) fn strengths(&self) -> Strengths {
        let strength = |effect: &Option<Effect>| effect.as_ref().map_or(1.0, |effect| effect.strength);
        Strengths { occlusion: strength(&self.occlusion), shadows: strength(&self.shadows) }
    }

    /// What became of shadows and of occlusion; `None` of what is not drawn by time.
    pub(crate) fn told(&self) -> [Option<Drawn>; 2] {
        [&self.shadows, &self.occlusion].map(|effect| effect.as_ref().map(Effect::told))
    }

    /// Whether the next frame may differ, or tell something, though nothing moves.
    pub(crate) fn go_on(&self) -> bool {
        self.all().any(Effect::goes_on)
    }

    fn all(&self) -> impl Iterator<Item = &Effect> {
        self.shadows.iter().chain(&self.occlusion)
    }
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Stage {
    /// Until then, and until frames come in time without it.
    Off(Option<Instant>),
    /// Drawn and not seen.
    Tried,
    /// Seen from then on.
    On(Instant),
    Leaving,
}

#[derive(Debug)]
struct Effect {
    stage: Stage,
    strength: f32,
    /// Frames in time, and slow ones, one after the other.
    fast: u32,
    slow: u32,
    /// Frames since it last came or went.
    frames: u32,
    tries: u32,
    stepped: Option<Instant>,
}

impl Default for Effect {
    fn default() -> Effect {
        Effect { stage: Stage::Off(None), strength: 0.0, fast: 0, slow: 0, frames: 0, tries: 0, stepped: None }
    }
}

impl Effect {
    fn step(&mut self, now: Instant, times: &[Duration]) {
        for &time in times {
            self.took(now, time);
        }
        let dt = self.stepped.replace(now).map_or(Duration::ZERO, |stepped| now.duration_since(stepped));
        let change = dt.as_secs_f32() / FADE.as_secs_f32();
        match self.stage {
            Stage::On(from) if now >= from => self.strength = (self.strength + change).min(1.0),
            Stage::Leaving => {
                self.strength = (self.strength - change).max(0.0);
                if self.strength == 0.0 {
                    self.rest(now);
                }
            }
            _ => {}
        }
    }

    /// The device took so long for a frame.
    fn took(&mut self, now: Instant, time: Duration) {
        self.frames = self.frames.saturating_add(1);
        if self.stage == Stage::Tried && self.frames <= FIRST_FRAMES {
            return;
        }
        self.fast = if time <= FAST { self.fast + 1 } else { 0 };
        self.slow = if time > SLOW { self.slow + 1 } else { 0 };
        let (fast, slow, undecided) = (self.fast >= FRAMES, self.slow >= FRAMES, self.frames >= UNDECIDED_FRAMES);
        match self.stage {
            Stage::Off(until) if fast && until.is_none_or(|until| now >= until) => self.enter(Stage::Tried),
            Stage::Off(None) if undecided => self.rest(now),
            Stage::Tried if fast => self.enter(Stage::On(now + ARRIVAL)),
            Stage::Tried if slow || undecided => self.enter(Stage::Leaving),
            Stage::On(_) if slow => self.enter(Stage::Leaving),
            _ => {}
        }
    }

    fn enter(&mut self, stage: Stage) {
        (self.stage, self.fast, self.slow, self.frames) = (stage, 0, 0, 0);
    }

    fn rest(&mut self, now: Instant) {
        self.enter(Stage::Off(Some(now + REST * 2u32.saturating_pow(self.tries))));
        self.tries = (self.tries + 1).min(16);
    }

    fn is_drawn(&self) -> bool {
        !matches!(self.stage, Stage::Off(_))
    }

    fn is_kept(&self) -> bool {
        matches!(self.stage, Stage::On(_))
    }

    /// Whether the next one's turn has come.
    fn is_settled(&self) -> bool {
        match self.stage {
            Stage::Off(_) => self.slow >= FRAMES || self.tries > 0,
            Stage::On(_) => self.strength == 1.0,
            Stage::Tried | Stage::Leaving => false,
        }
    }

    fn goes_on(&self) -> bool {
        match self.stage {
            Stage::Off(_) => self.slow < FRAMES && self.tries == 0,
            Stage::On(_) => self.strength < 1.0,
            Stage::Tried | Stage::Leaving => true,
        }
    }

    fn told(&self) -> Drawn {
        match self.stage {
            Stage::On(_) => Drawn::InTime,
            Stage::Off(_) if self.is_settled() => Drawn::TooSlow,
            _ => Drawn::Undecided,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FRAME: Duration = Duration::from_millis(16);

    /// Frames, which take `time(effects)`; the strengths after each.
    fn frames(
        effects: &mut Effects,
        at: &mut Instant,
        count: u32,
        time: impl Fn(&Effects) -> Duration,
    ) -> Vec<Strengths> {
        let mut frame = || {
            effects.times.add((), time(effects));
            *at += FRAME;
            effects.step(*at);
            effects.strengths()
        };
        (0..count).map(|_| frame()).collect()
    }

    fn both() -> Effects {
        Effects::new(InTime { shadows: true, occlusion: true })
    }

    #[test]
    fn what_comes_in_time_fades_in_one_after_the_other() {
        let (mut effects, mut at) = (both(), Instant::now());
        let seen = frames(&mut effects, &mut at, 400, |_| FRAME / 2);
        assert_eq!(effects.strengths(), Strengths::default());
        assert!(seen.windows(2).all(|pair| {
            let step = (pair[1].shadows - pair[0].shadows).max(pair[1].occlusion - pair[0].occlusion);
            (0.0..0.05).contains(&step)
        }));
        assert!(seen.iter().all(|seen| seen.occlusion == 0.0 || seen.shadows == 1.0));
        assert!(!effects.go_on());
        assert_eq!(effects.told(), [Some(Drawn::InTime); 2]);
    }

    #[test]
    fn what_is_slow_is_never_seen_and_tried_ever_more_rarely() {
        let (mut effects, mut at) = (both(), Instant::now());
        let slow = |effects: &Effects| if effects.drawn().occlusion { 2 * SLOW } else { FRAME / 2 };
        let mut drawn = 0;
        for _ in 0..4000 {
            frames(&mut effects, &mut at, 1, slow);
            drawn += u32::from(effects.drawn().occlusion);
        }
        assert_eq!(effects.strengths(), Strengths { shadows: 1.0, occlusion: 0.0 });
        assert_eq!(effects.told(), [Some(Drawn::InTime), Some(Drawn::TooSlow)]);
        // A minute: tries after 0, 8, 24 and 56 seconds.
        assert!((20..80).contains(&drawn), "{drawn}");
    }

    #[test]
    fn the_last_one_goes_first_when_frames_get_slow_and_nothing_jumps() {
        let (mut effects, mut at) = (both(), Instant::now());
        frames(&mut effects, &mut at, 400, |_| FRAME / 2);
        let seen =
            frames(&mut effects, &mut at, 60, |effects| if effects.drawn().occlusion { 2 * SLOW } else { FRAME });
        assert_eq!(effects.strengths(), Strengths { shadows: 1.0, occlusion: 0.0 });
        assert!(seen.windows(2).all(|pair| pair[0].occlusion - pair[1].occlusion < 0.05));
        assert_eq!(effects.kept(), InTime { shadows: true, occlusion: false });
    }

    #[test]
    fn where_frames_are_not_drawn_as_a_whole_what_was_seen_goes_and_nothing_is_tried() {
        let (mut effects, mut at) = (both(), Instant::now());
        frames(&mut effects, &mut at, 400, |_| FRAME / 2);
        for _ in 0..400 {
            effects.missed();
            at += FRAME;
            effects.step(at);
        }
        assert_eq!(effects.strengths(), Strengths { shadows: 0.0, occlusion: 0.0 });
        assert!(!effects.go_on());
        assert_eq!(effects.told(), [Some(Drawn::TooSlow); 2]);
    }

    #[test]
    fn on_a_device_that_is_slow_anyway_nothing_is_tried() {
        let (mut effects, mut at) = (both(), Instant::now());
        for _ in 0..1000 {
            frames(&mut effects, &mut at, 1, |_| 2 * SLOW);
            assert_eq!(effects.drawn(), InTime::default());
        }
        assert!(!effects.go_on());
        assert_eq!(effects.told(), [Some(Drawn::TooSlow); 2]);
        assert!(!Effects::new(InTime::default()).go_on());
    }
}
