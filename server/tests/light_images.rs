//! What lights with an area see, sent to clients that draw soft shadows.

mod common;

use camera::Rigid;
use common::session::Session;
use glam::DVec3;
use protocol::{Light, Purpose};

/// The bytes for lights of some ticks.
fn light_bytes(session: &mut Session, ticks: usize) -> usize {
    let before = session.light_bytes;
    session.ticks(ticks);
    session.light_bytes - before
}

/// A viewer of a built-in scene who draws soft shadows.
fn soft(name: &str) -> Session {
    let mut session = Session::built_in(name);
    session.client.soft_shadows = true;
    session
}

/// Samples that are held of a light; `None` where not even a patch is.
fn samples(session: &Session, light: u16) -> Option<usize> {
    let patches = session.held.patches.values().filter(|held| held.patch.purpose == Purpose::Light(light));
    patches.map(|held| held.patch.image.sample_count()).reduce(|a, b| a + b)
}

#[test]
fn measure() {
    for name in ["lamp-teapots", "lamp-teapots-moving"] {
        let mut session = soft(name);
        for tick in 0..20 {
            let (sent, of_lights) = (session.sent_bytes, session.light_bytes);
            let made = session.tick();
            let (counts, took) = made.map(|made| (made.counts, made.lights.took)).unwrap_or_default();
            println!(
                "{name} {tick}: {} bytes, lights {} bytes {took:?} {:?} samples {:?} {:?}",
                session.sent_bytes - sent, session.light_bytes - of_lights, counts.lights, samples(&session, 0), samples(&session, 1)
            );
        }
    }
}
