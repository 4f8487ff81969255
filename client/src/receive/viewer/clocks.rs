//! What time it is in the scene, and how long a pose takes to come back as a picture.

use std::collections::VecDeque;

/// Poses in flight at most; at 60 a second, 17 s of silence. Older ones can no longer be told.
const MAX_POSES: usize = 1024;

/// Scene time at the server, as the client reckons it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SceneClock {
    /// Scene time minus client time.
    offset_s: f64,
}

impl SceneClock {
    /// From the scene time that Welcome names and the client's time when it was said. On the wall clock that is when it came;
    /// what it took on its way is added by [`SceneClock::now_s`].
    pub fn new(scene_time_s: f64, said_at_s: f64) -> SceneClock {
        SceneClock { offset_s: scene_time_s - said_at_s }
    }

    /// Scene time now, where a message takes `one_way_s` (0 on the virtual clock, whose Welcome takes no time).
    pub fn now_s(&self, now_s: f64, one_way_s: f64) -> f64 {
        now_s + self.offset_s + one_way_s
    }
}

/// Matches poses with the pictures they bring.
#[derive(Debug, Clone, Default)]
pub struct RoundTrips {
    sent: VecDeque<(u64, f64)>,
    newest_sent: u64,
    /// Answered by an update that is held but not yet shown.
    answered: Option<u64>,
    newest_answered: u64,
    last_s: Option<f64>,
}

impl RoundTrips {
    /// The session has sent poses up to this number. Call it whenever it may have.
    pub fn sent(&mut self, seq: u64, now_s: f64) {
        if seq > self.newest_sent {
            self.newest_sent = seq;
            self.sent.push_back((seq, now_s));
            if self.sent.len() > MAX_POSES {
                self.sent.pop_front();
            }
        }
    }

    /// An update was applied whose newest pose is this.
    pub fn answered(&mut self, seq: u64) {
        if seq > self.newest_answered {
            self.newest_answered = seq;
            self.answered = Some(seq);
        }
    }

    /// Whether any update used a pose.
    pub fn is_answered(&self) -> bool {
        self.newest_answered > 0
    }

    /// A picture is shown of what is held now.
    pub fn shown(&mut self, now_s: f64) {
        let Some(seq) = self.answered.take() else { return };
        while let Some((sent, at_s)) = self.sent.pop_front_if(|(sent, _)| *sent <= seq) {
            if sent == seq {
                self.last_s = Some(now_s - at_s);
            }
        }
    }

    /// The last round trip, from a pose's sending to the first picture that used what it brought.
    pub fn last_s(&self) -> Option<f64> {
        self.last_s
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_round_trip_ends_with_the_first_picture() {
        let mut trips = RoundTrips::default();
        trips.sent(1, 0.0);
        trips.sent(1, 0.5);
        trips.sent(2, 1.0);
        trips.shown(1.5);
        assert_eq!(trips.last_s(), None);
        trips.answered(1);
        trips.shown(2.0);
        assert_eq!(trips.last_s(), Some(2.0));
        trips.answered(1);
        trips.shown(9.0);
        assert_eq!(trips.last_s(), Some(2.0), "an answer that brings nothing new says nothing");
        trips.answered(2);
        trips.shown(3.0);
        assert_eq!(trips.last_s(), Some(2.0));
    }

    #[test]
    fn poses_that_are_never_answered_are_forgotten() {
        let mut trips = RoundTrips::default();
        for seq in 1..=10_000 {
            trips.sent(seq, seq as f64);
        }
        assert_eq!(trips.sent.len(), MAX_POSES);
        trips.answered(10_000);
        trips.shown(10_000.5);
        assert_eq!((trips.last_s(), trips.sent.len()), (Some(0.5), 0));
    }

    #[test]
    fn scene_time_runs_with_the_clients_clock() {
        let clock = SceneClock::new(100.0, 3.0);
        assert_eq!(clock.now_s(3.0, 0.0), 100.0);
        assert_eq!(clock.now_s(5.0, 0.25), 102.25);
    }
}
