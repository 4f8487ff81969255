//! How long a pose takes to come back as a picture.

use std::collections::VecDeque;

/// Poses in flight at most; at 60 a second, 17 s of silence. Older ones can no longer be told.
const MAX_POSES: usize = 1024;

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

    /// An update was applied whose newest pose is this. What an earlier session was sent counts its own poses.
    pub fn answered(&mut self, seq: u64) {
        if seq > self.newest_answered && seq <= self.newest_sent {
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
}
