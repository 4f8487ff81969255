//! What an update may take of the path to a client.
//!
//! An update counts as a whole: nothing of it is seen, and nothing newer comes, before all of it is there. On a path that carries 0.2 Mbit/s a first set of half a megabyte
//! takes twenty seconds. So where a path carries little, an update brings what it carries in half a second, and the next one brings more.

use crate::viewer::Viewer;

/// An update of a viewer who stands takes so long at most: about as long as people wait before they take a picture for one that stands still.
const LONGEST_S: f64 = 0.5;
/// Who was sent little was delivered little. Where the last update waited for less than this share of it, the path may carry twice as much.
const SHORT_WAIT_SHARE: f64 = 0.2;
/// Bytes before anything is known of a path: with a first picture they are what is sent before it has answered (64 KiB, see [`protocol::session`]).
const UNKNOWN_BYTES: f64 = 48.0 * 1024.0;
/// Powers of two, of bytes: less is mostly frames of messages, and more is no matter for any path that is so fast.
const STEPS: std::ops::RangeInclusive<u32> = 12..=20;

/// Bytes that an update may bring: a power of two, so that clients on like paths are served alike.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Allowance(Option<u32>);

impl Allowance {
    /// As many as there are.
    pub const ALL: Allowance = Allowance(None);

    /// What a viewer's path carries in half a second, as far as that is known.
    pub fn of(viewer: &Viewer) -> Allowance {
        let grows = if viewer.queue_s < SHORT_WAIT_SHARE * LONGEST_S { 2.0 } else { 1.0 };
        let bytes = viewer.bytes_per_s.map_or(UNKNOWN_BYTES, |bytes_per_s| bytes_per_s * LONGEST_S * grows);
        let step = bytes.max(1.0).log2() as u32;
        Allowance((step <= *STEPS.end()).then_some(step.max(*STEPS.start())))
    }

    /// Whether an update may bring as much as there is.
    pub fn is_all(self) -> bool {
        self.0.is_none()
    }

    /// Infinite where an update may bring as much as there is.
    pub fn bytes(self) -> f64 {
        self.0.map_or(f64::INFINITY, |step| f64::from(1_u32 << step))
    }
}

#[cfg(test)]
mod tests {
    use camera::Rigid;
    use protocol::message::ViewSize;

    use super::*;

    #[test]
    fn an_update_brings_what_the_path_carries_in_half_a_second() {
        let view = ViewSize { width_px: 640, height_px: 360, fov_y_rad: 1.0 };
        let bytes = |bytes_per_s, queue_s| {
            let mut viewer = Viewer::at_start(view, Rigid::IDENTITY, 0.0);
            (viewer.bytes_per_s, viewer.queue_s) = (bytes_per_s, queue_s);
            Allowance::of(&viewer).bytes()
        };
        assert_eq!(bytes(None, 0.0), 32.0 * 1024.0, "nothing is known");
        assert_eq!(bytes(Some(26e3), 0.3), 8192.0, "0.2 Mbit/s");
        assert_eq!(bytes(Some(26e3), 0.0), 16384.0, "which nothing waits for may carry more");
        assert_eq!(bytes(Some(0.0), 1.0), 4096.0);
        assert_eq!(bytes(Some(1e9), 1.0), f64::INFINITY);
        assert!(Allowance::ALL.is_all() && Allowance::ALL.bytes().is_infinite());
    }
}
