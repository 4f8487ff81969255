//! Which method finds a lamp's points: one that was asked for, or whichever frames come in less time with, which is found out by trying.

use std::str::FromStr;

use web_time::Duration;

use super::method::Method;

/// By which method points are found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Choice {
    /// By this one, where it can be.
    Always(Method),
    /// By whichever shows as many points in less time: [`Method::Warp`] ([`Method::Maps`] without compute shaders) or [`Method::March`].
    Measured,
}

impl Default for Choice {
    fn default() -> Choice {
        Choice::Always(Method::default())
    }
}

impl Choice {
    /// What it begins with.
    pub(super) fn first(self, has_compute: bool) -> Method {
        match self {
            Choice::Always(method) => method,
            Choice::Measured if has_compute => Method::Warp,
            Choice::Measured => Method::Maps,
        }
    }
}

impl FromStr for Choice {
    type Err = String;

    fn from_str(text: &str) -> Result<Choice, String> {
        match text {
            "measured" => Ok(Choice::Measured),
            "warp" => Ok(Choice::Always(Method::Warp)),
            "maps" => Ok(Choice::Always(Method::Maps)),
            "march" => Ok(Choice::Always(Method::March)),
            _ => Err(format!("{text} is no method of soft shadows: use measured, warp, maps or march")),
        }
    }
}

/// So many frames of one method are timed, and the least time counts: what else a machine does comes on top.
const FRAMES: u32 = 3;

/// Tries the other method where not all points come in time, and keeps the faster one.
///
/// [`Method::Maps`] is not tried beside [`Method::Warp`], which draws the same maps: a frame of it could hold a viewer up for a second.
#[derive(Debug)]
pub(super) struct Chooser {
    pub(super) method: Method,
    /// `None` where there is nothing to choose.
    other: Option<Method>,
    state: State,
}

#[derive(Debug)]
enum State {
    /// Since when frames have had as many points as now.
    Watching {
        points: u32,
        frames: u32,
        least: Duration,
    },
    /// Whether frames take less than this; the first, which makes pipelines while a GPU still draws what came before, is not timed.
    Trying {
        to_beat: Duration,
        frames: u32,
        least: Duration,
    },
    Settled,
}

impl State {
    const BEGIN: State = State::Watching { points: 0, frames: 0, least: Duration::MAX };
}

impl Chooser {
    pub(super) fn new(choice: Choice, has_compute: bool) -> Chooser {
        let other = (choice == Choice::Measured).then_some(Method::March);
        Chooser { method: choice.first(has_compute), other, state: State::BEGIN }
    }

    /// What is drawn changed so much that the other one may be the faster by now.
    pub(super) fn begin_again(&mut self) {
        self.state = State::BEGIN;
    }

    /// Whether the number of points is to stay as it is.
    pub(super) fn is_trying(&self) -> bool {
        matches!(self.state, State::Trying { .. })
    }

    /// A frame took so long by the method, with so many of `all` points.
    pub(super) fn drew(&mut self, took: Duration, points: u32, all: u32) {
        let Some(other) = &mut self.other else { return };
        match &mut self.state {
            State::Watching { points: same, frames, least } if *same == points && points < all => {
                (*frames, *least) = (*frames + 1, took.min(*least));
                if *frames == FRAMES {
                    let to_beat = *least;
                    std::mem::swap(&mut self.method, other);
                    self.state = State::Trying { to_beat, frames: 0, least: Duration::MAX };
                }
            }
            State::Watching { .. } => self.state = State::Watching { points, frames: 1, least: took },
            State::Trying { to_beat, frames, least } => {
                *frames += 1;
                if *frames > 1 {
                    *least = took.min(*least);
                }
                if *frames > FRAMES {
                    if least >= to_beat {
                        std::mem::swap(&mut self.method, other);
                    }
                    self.state = State::Settled;
                }
            }
            State::Settled => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn after(chooser: &mut Chooser, ms: &[u64], points: u32) -> Method {
        ms.iter().for_each(|ms| chooser.drew(Duration::from_millis(*ms), points, 64));
        chooser.method
    }

    #[test]
    fn methods_have_names() {
        for method in [Method::Maps, Method::Warp, Method::March] {
            assert_eq!(method.to_string().parse(), Ok(Choice::Always(method)));
        }
        assert_eq!("measured".parse(), Ok(Choice::Measured));
        assert!("wrap".parse::<Choice>().is_err_and(|why| why.contains("wrap") && why.contains("march")));
    }

    #[test]
    fn the_faster_one_stays() {
        for (ms, stays) in [(29, Method::March), (30, Method::Warp), (31, Method::Warp)] {
            let mut chooser = Chooser::new(Choice::Measured, true);
            assert_eq!(after(&mut chooser, &[50, 30], 8), Method::Warp);
            assert_eq!(after(&mut chooser, &[31], 8), Method::March);
            assert!(chooser.is_trying());
            // The first frame's time may be that of what was drawn before.
            assert_eq!(after(&mut chooser, &[1, ms + 20, ms, ms + 1], 8), stays);
            assert_eq!((after(&mut chooser, &[500; 20], 8), chooser.is_trying()), (stays, false));
            chooser.begin_again();
            assert_ne!(after(&mut chooser, &[500; 3], 8), stays, "tried again");
        }
    }

    #[test]
    fn nothing_is_tried_without_need() {
        let mut chooser = Chooser::new(Choice::Measured, true);
        assert_eq!(after(&mut chooser, &[30; 20], 64), Method::Warp, "all points come in time");
        for points in [1, 2, 4, 8, 4, 8, 16] {
            assert_eq!(after(&mut chooser, &[30; 2], points), Method::Warp, "their number changes still");
        }
        let mut chooser = Chooser::new(Choice::Always(Method::Maps), true);
        assert_eq!(after(&mut chooser, &[500; 20], 1), Method::Maps, "nothing else is wanted");
    }

    #[test]
    fn without_compute_shaders_the_papers_method_is_the_first() {
        assert_eq!(Chooser::new(Choice::Measured, false).method, Method::Maps);
        assert_eq!(Chooser::new(Choice::Measured, true).method, Method::Warp);
    }
}
