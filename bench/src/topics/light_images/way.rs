//! Ways to hold what casts.

use std::sync::Arc;

use client::draw::frame::Options;
use client::draw::shadow;
use gpu::Gpu;
use protocol::Purpose;
use protocol::codec::{Coding, encode_patch};
use protocol::message::Shadows;
use scene::Scene;

use super::settings::Settings;
use super::truth::{Arriving, Seen};
use crate::client_view::{ClientView, Drawn};
use crate::topics::sent_once::walk::{Setup, UPDATE_HZ, Walk, Walker};

/// A way.
pub(super) struct Way {
    pub name: &'static str,
    /// What the client says that it draws, and so is sent.
    shadows: Shadows,
    /// Whether objects of one shape are shown by one image.
    relief: bool,
}

/// What the eye saw alone, as without images of lights; what lights see.
pub(super) const WAYS: [Way; 4] = [
    Way { name: "the eye's samples", shadows: Shadows::None, relief: false },
    Way { name: "lights' images", shadows: Shadows::Hard, relief: false },
    Way { name: "the eye's samples, reliefs", shadows: Shadows::None, relief: true },
    Way { name: "lights' images, reliefs", shadows: Shadows::Hard, relief: true },
];

/// What was found along a walk.
#[derive(Default)]
pub(super) struct Walked {
    /// Of each view that was compared.
    pub views: Vec<Found>,
    pub bytes: usize,
    /// Of these what was sent of lights.
    pub light_bytes: usize,
    pub objects: usize,
}

/// How wrong a view is.
pub(super) struct Found {
    /// Of the strongest light: the sun, where there is one.
    pub strongest: Errors,
    /// Of all that cast.
    pub all: Errors,
    pub frame_ms: f64,
    pub look_ms: f64,
    /// What arrives of the strongest light, and how wrong it is by rays; 255 and 0 where nothing faces it.
    pub arriving: Vec<u8>,
    pub off: Vec<f32>,
}

/// Means over the pixels that face a light, 0 to 255.
#[derive(Clone, Copy, Default)]
pub(super) struct Errors {
    pub by_rays: f64,
    pub by_map: f64,
    pixels: f64,
}

impl Errors {
    fn add(&mut self, by_rays: f64, by_map: f64) {
        self.pixels += 1.0;
        self.by_rays += (by_rays - self.by_rays) / self.pixels;
        self.by_map += (by_map - self.by_map) / self.pixels;
    }
}

impl Way {
    /// Whether a scene has what the way is about: shapes that many objects have.
    pub fn is_of(&self, scene: &Scene) -> bool {
        !self.relief || scene.instances.len() > scene.meshes.len()
    }

    /// Walks, and compares at the views that truths are there of.
    pub fn walk(
        &self,
        gpu: &Gpu,
        scene: &Arc<Scene>,
        (walk, ticks): (&Walk, usize),
        seen: &[(usize, Seen)],
        settings: &Settings,
    ) -> anyhow::Result<Walked> {
        let setup = Setup {
            relief: self.relief,
            shadows: self.shadows,
            output_px: settings.output_px,
            ..Setup::usual(settings.image_px)
        };
        let mut walker = Walker::new(gpu, scene.clone(), &setup)?;
        let mut client = ClientView::new(gpu, (settings.output_px, settings.output_px))?;
        client.set_shadows(shadow::Settings { shadows: shadow::Shadows::Maps, ..shadow::Settings::default() });
        let mut walked = Walked::default();
        let mut known = std::collections::BTreeSet::new();
        for tick in 0..=ticks {
            let at_s = tick as f64 / UPDATE_HZ;
            let done = walker.tick(walk.at(at_s), at_s)?;
            walked.bytes += done.bytes;
            for (id, held) in &walker.set.held.patches {
                if known.insert(*id) && matches!(held.patch.purpose, Purpose::Light(_)) {
                    walked.light_bytes += encode_patch(&held.patch, Coding::default()).len();
                }
            }
            if let Some((_, seen)) = seen.iter().find(|(of, _)| *of == tick) {
                let drawn = client.frame_shown(walker.shown(), &seen.view, Options::default())?;
                let shares = client.light_shares(&seen.view)?;
                walked.views.push(compare(seen, &drawn, shares.as_deref(), done.look_ms));
            }
        }
        walked.objects = walker.set.held.instances.len();
        Ok(walked)
    }
}

/// Over the pixels where a surface faces a light and the client shows one too. A light that the client draws no shadows of arrives.
fn compare(seen: &Seen, drawn: &Drawn, shares: Option<&[[u8; 4]]>, look_ms: f64) -> Found {
    let (w, mut all, mut strongest) = (&drawn.w, Errors::default(), Errors::default());
    let (mut arriving, mut errors) = (vec![255; w.len()], vec![0.0; w.len()]);
    for (channel, Arriving { facing, hidden_by_rays, hidden_by_map }) in seen.lights.iter().enumerate() {
        for pixel in (0..w.len()).filter(|&pixel| facing[pixel] && w[pixel] > 0.0) {
            let arrives = shares.map_or(255, |shares| shares[pixel][channel]);
            let off = |hidden: bool| (f64::from(arrives) - if hidden { 0.0 } else { 255.0 }).abs();
            let (by_rays, by_map) = (off(hidden_by_rays[pixel]), off(hidden_by_map[pixel]));
            all.add(by_rays, by_map);
            if channel == 0 {
                strongest.add(by_rays, by_map);
                (arriving[pixel], errors[pixel]) = (arrives, (by_rays / 255.0) as f32);
            }
        }
    }
    Found { strongest, all, frame_ms: drawn.frame_ms, look_ms, arriving, off: errors }
}
