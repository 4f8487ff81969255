//! What time it is in the scene, as a client reckons it.

/// Two clocks part by this share of the time at most: ten times what a quartz does.
const DRIFT: f64 = 1e-4;

/// Scene time by a client's clock. The server's stamps tell it (as NTP does, RFC 5905): what was answered between a question and its answer was
/// stamped between them, so that the middle is off by half their distance at most. The answer with the least bound counts, until clocks
/// may have parted further; one that came late, as a page starts or a link is full, tells nothing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SceneClock {
    scene_from_server_s: f64,
    scene_from_client_s: f64,
    /// By how much that was off at most when it was told.
    off_s: f64,
    told_at_s: f64,
}

impl SceneClock {
    /// Where both ends have one clock, which the scene time leads by some seconds.
    pub(super) fn shared(scene_from_clock_s: f64) -> SceneClock {
        SceneClock {
            scene_from_server_s: scene_from_clock_s,
            scene_from_client_s: scene_from_clock_s,
            off_s: 0.0,
            // Nothing tells it better.
            told_at_s: f64::INFINITY,
        }
    }

    /// From a scene time that the server stamped when it said so; how long that was on its way is not known.
    pub(super) fn said(scene_time_s: f64, stamped_at_s: f64, heard_at_s: f64) -> SceneClock {
        SceneClock {
            scene_from_server_s: scene_time_s - stamped_at_s,
            scene_from_client_s: scene_time_s - heard_at_s,
            off_s: f64::INFINITY,
            told_at_s: heard_at_s,
        }
    }

    /// The server stamped an answer to what was asked.
    pub(super) fn answered(&mut self, asked_at_s: f64, stamped_at_s: f64, heard_at_s: f64) {
        let off_s = (heard_at_s - asked_at_s) / 2.0;
        if off_s <= self.off_s + DRIFT * (heard_at_s - self.told_at_s) {
            self.scene_from_client_s = self.scene_from_server_s + stamped_at_s - (asked_at_s + heard_at_s) / 2.0;
            self.off_s = off_s;
            self.told_at_s = heard_at_s;
        }
    }

    /// How long what the server stamped was on its way, as far as the time is known.
    pub(super) fn on_its_way_s(&self, stamped_at_s: f64, heard_at_s: f64) -> f64 {
        heard_at_s + self.scene_from_client_s - self.scene_from_server_s - stamped_at_s
    }

    /// Scene time at a time of the client's clock.
    pub fn scene_time_s(&self, now_s: f64) -> f64 {
        now_s + self.scene_from_client_s
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The client's clock is 40 s behind the server's, and it is 7 s in the scene when the server's says 100 s.
    fn clock() -> SceneClock {
        SceneClock::said(7.0, 100.0, 60.25)
    }

    #[test]
    fn the_answer_with_the_least_bound_counts() {
        let mut clock = clock();
        assert_eq!(clock.scene_time_s(60.25), 7.0, "a quarter of a second late: its way");
        // A page that starts hears late: at 63 s what was stamped at 60.2.
        clock.answered(60.3, 100.2 + 0.2, 63.3);
        assert!((clock.scene_time_s(61.8) - 7.4).abs() < 1e-9);
        clock.answered(64.0, 104.05, 64.1);
        assert!((clock.scene_time_s(64.05) - 11.05).abs() < 1e-9);
        let told = clock;
        clock.answered(66.0, 106.9, 67.0);
        assert_eq!(clock, told, "that one waited");
        // After ten minutes and more the clocks may have parted by 60 ms.
        clock.answered(700.0, 740.07, 700.2);
        assert!((clock.scene_time_s(700.1) - 647.07).abs() < 1e-9);
    }

    #[test]
    fn who_shares_a_clock_learns_nothing_from_answers() {
        let mut clock = SceneClock::shared(-3.0);
        clock.answered(1e6, 9.0, 1e6);
        assert_eq!(clock.scene_time_s(5.0), 2.0);
    }
}
