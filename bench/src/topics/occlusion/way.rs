//! Ways to look for occluders, along a walk.

use std::collections::BTreeSet;
use std::sync::Arc;

use camera::Pinhole;
use client::draw::frame::Options;
use client::draw::occlusion::{Occlusion, Settings as Measure};
use gpu::Gpu;
use protocol::Purpose;
use protocol::codec::{Coding, encode_patch};
use scene::Scene;

use super::points::{Point, bilinear, mean, shown_at};
use super::settings::Settings;
use crate::client_view::ClientView;
use crate::topics::sent_once::walk::{Setup, UPDATE_HZ, Walk, Walker};

/// A session: what a server sends.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Session {
    pub name: &'static str,
    /// Whether it sends occluders.
    pub serves: bool,
    /// Whether objects of one shape are shown by one image.
    pub relief: bool,
}

/// Sessions of which the second is what servers do.
pub(super) const SESSIONS: [Session; 3] = [
    Session { name: "seen", serves: false, relief: false },
    Session { name: "served", serves: true, relief: false },
    Session { name: "served, reliefs", serves: true, relief: true },
];

/// A way to measure occlusion in a session.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Way {
    pub session: Session,
    pub occlusion: Occlusion,
    pub taps: u32,
}

impl Way {
    pub fn name(&self) -> String {
        let by = match self.occlusion {
            Occlusion::None => "none",
            Occlusion::Plain => "view",
            Occlusion::Graph => "graph",
        };
        format!("{by}, {}, {} taps", self.session.name, self.taps)
    }
}

impl Session {
    /// Whether a scene has what the session is about: shapes that many objects have.
    pub fn is_of(&self, scene: &Scene) -> bool {
        !self.relief || scene.instances.len() > scene.meshes.len()
    }

    /// What is measured in it: the view's own z-buffer where nothing is served, graph cameras' in all.
    pub fn ways(self, taps: &[u32]) -> Vec<Way> {
        let kinds: &[Occlusion] = if self.serves { &[Occlusion::Graph] } else { &[Occlusion::Plain, Occlusion::Graph] };
        let of = |&taps| kinds.iter().map(move |&occlusion| Way { session: self, occlusion, taps });
        taps.iter().flat_map(of).collect()
    }
}

/// What was measured in sessions, and what was found.
pub(super) type Sessions = [(Vec<Way>, Walked)];

/// What was found in a session.
pub(super) struct Walked {
    /// By way, point and frame: the share of ambient light, where the frame shows the point.
    pub shares: Vec<Vec<Vec<Option<f64>>>>,
    /// By way: of each frame.
    pub frame_ms: Vec<Vec<f64>>,
    pub bytes: usize,
    /// Of these, what only occludes.
    pub occluder_bytes: usize,
    pub occluder_samples: usize,
    pub look_ms: Vec<f64>,
}

/// Walks, and measures at some ticks.
pub(super) fn walk(
    gpu: &Gpu,
    scene: &Arc<Scene>,
    (session, ways): (Session, &[Way]),
    (walk, frames): (&Walk, &[(usize, Pinhole)]),
    (points, reach_m): (&[Point], f64),
    settings: &Settings,
) -> anyhow::Result<Walked> {
    let setup = Setup {
        relief: session.relief,
        occlusion_reach_m: if session.serves { reach_m } else { 0.0 },
        output_px: settings.output_px,
        ..Setup::usual(settings.image_px)
    };
    let mut walker = Walker::new(gpu, scene.clone(), &setup)?;
    let size_px = (settings.output_px, settings.output_px);
    let client = |way: &Way| {
        let mut client = ClientView::new(gpu, size_px)?;
        client.set_occlusion(Measure { occlusion: way.occlusion, reach_m, taps: way.taps });
        Ok(client)
    };
    let mut clients: Vec<ClientView> = ways.iter().map(client).collect::<anyhow::Result<_>>()?;
    let mut walked = Walked {
        shares: vec![vec![Vec::with_capacity(frames.len()); points.len()]; ways.len()],
        frame_ms: vec![Vec::new(); ways.len()],
        bytes: 0,
        occluder_bytes: 0,
        occluder_samples: 0,
        look_ms: Vec::new(),
    };
    let mut known = BTreeSet::new();
    let ticks = frames.last().map_or(0, |(tick, _)| *tick);
    for tick in 0..=ticks {
        let at_s = tick as f64 / UPDATE_HZ;
        let done = walker.tick(walk.at(at_s), at_s)?;
        walked.bytes += done.bytes;
        walked.look_ms.push(done.look_ms);
        for (id, held) in &walker.set.held.patches {
            if known.insert(*id) && held.patch.purpose == Purpose::Occluders {
                walked.occluder_bytes += encode_patch(&held.patch, Coding::default()).len();
                walked.occluder_samples += held.patch.image.sample_count();
            }
        }
        let Some((_, view)) = frames.iter().find(|(of, _)| *of == tick) else { continue };
        for (way, client) in clients.iter_mut().enumerate() {
            let drawn = client.frame_shown(walker.shown(), view, Options::default())?;
            walked.frame_ms[way].push(drawn.frame_ms);
            let shares = client.ambient_shares(view)?;
            for (point, of_point) in points.iter().zip(&mut walked.shares[way]) {
                of_point.push(shown_at(point, view, &drawn.w).map(|image| bilinear(&shares, view, image)));
            }
        }
    }
    Ok(walked)
}

/// How steady a way is, and how near the truth.
pub(super) struct Figures {
    /// Standard deviation of a point's share over the frames that show it: mean over the points.
    pub deviation: f64,
    /// Difference of a point's mean share to the traced one: mean of the absolutes.
    pub error: f64,
    /// The same with its sign; positive: too bright.
    pub bias: f64,
}

/// Over the points that are followed; `of_points` and `traced` by point.
pub(super) fn figures(of_points: &[Vec<Option<f64>>], traced: &[f64], followed: &[usize]) -> Figures {
    let means: Vec<f64> = followed.iter().map(|&point| mean(of_points[point].iter().flatten().copied())).collect();
    let deviation = |(&point, middle): (&usize, &f64)| {
        mean(of_points[point].iter().flatten().map(|value| (value - middle).powi(2))).sqrt()
    };
    let off = || means.iter().zip(followed).map(|(mean, &point)| mean - traced[point]);
    Figures {
        deviation: mean(followed.iter().zip(&means).map(deviation)),
        error: mean(off().map(f64::abs)),
        bias: mean(off()),
    }
}
