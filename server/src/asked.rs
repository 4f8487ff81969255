//! The image of a camera that a client asked for by its name: all that such a client is sent.
//!
//! A still scene's is sent once. One that moves is drawn anew once the client holds the last one, and sent where it differs.

use camera::Camera;
use protocol::PatchId;

/// What a client asked for, and what it was sent of it.
#[derive(Debug, Clone)]
pub struct Asked {
    /// The camera.
    pub camera: Camera,
    /// The image that it holds; `None` before any.
    pub sent: Option<PatchId>,
}

impl Asked {
    /// Nothing was sent yet.
    pub fn of(camera: Camera) -> Asked {
        Asked { camera, sent: None }
    }

    /// Whether to look at it now: before the client has any, and in a scene that moves once it has acknowledged the last one.
    pub fn is_due(&self, animated: bool, in_flight_bytes: u64) -> bool {
        in_flight_bytes == 0 && (animated || self.sent.is_none())
    }

    /// The client holds nothing any more.
    pub fn start_anew(&mut self) {
        self.sent = None;
    }
}
