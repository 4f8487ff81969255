//! Frames that come in time, whatever drawing what is held takes.
//!
//! Where a device is too slow to draw each frame as a whole (`governor.rs`), a *key picture* is drawn in slices over several frames: of a wider view, from where
//! the eye will be in the middle of the time for which it is shown, and coarser. Until the next one is there, each frame shows it as it looks from where the eye is by
//! then (`reproject.rs`), which takes a small part of a whole frame. (The idea of asynchronous reprojection in headsets; Mark, McMillan, Bishop, *Post-rendering 3D
//! warping*, 1997, have it for networks.) A turn of the head is exact; what moves behind edges waits for the next key picture. At rest the picture is drawn as a whole.

mod governor;
mod reproject;

use std::fmt;
use std::time::Duration;

use camera::{Motion, Pinhole, Rigid};
use glam::DVec2;
use gpu::Gpu;
use surface::Slices;
use web_time::Instant;
use wgpu::{BindingResource, TextureFormat, TextureView};

use crate::draw::antialiasing::Antialias;
use crate::draw::device_times::DeviceTimes;
use crate::draw::frame::{FrameRenderer, Options};
use crate::draw::fullscreen::{Binding, EMBEDDED, FullscreenPass, Target};
use crate::draw::shown::Shown;
use crate::receive::viewer::MotionEstimator;
use governor::{Governor, Work};
use reproject::{ReprojectPass, Seen};

/// Whether frames are to come in time.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum FrameRate {
    /// Each frame is drawn as a whole, however long it takes.
    #[default]
    Free,
    /// Where that takes too long, frames show key pictures.
    Held,
}

/// How frames are drawn now, for people to read.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Resolution {
    /// Each as a whole.
    Whole,
    /// From key pictures, which have so many pixels for one of the output along each side.
    Keys(f64),
}

impl fmt::Display for Resolution {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Resolution::Whole => f.write_str("full"),
            Resolution::Keys(share) => write!(f, "{:.0} % in motion", share * 100.0),
        }
    }
}

/// An eye that stood for so long is at rest.
const REST: Duration = Duration::from_millis(250);
/// A key picture's view is larger than the output by this share of it at each border: an eighth of 90 degrees is turned in a fifth of a second by who looks around.
const MARGIN: f64 = 0.125;
/// No prediction reaches further, in seconds: hands change their minds.
const LONGEST_AHEAD_S: f64 = 0.5;
/// A page that shows no frames for so long draws none.
const ABSENT: Duration = Duration::from_millis(500);

/// See the module.
#[derive(Debug)]
pub(crate) struct Steady {
    gpu: Gpu,
    format: TextureFormat,
    governor: Governor,
    times: DeviceTimes<Work>,
    passes: Option<Passes>,
    shown: Option<KeyPicture>,
    begun: Option<Begun>,
    /// From the first slice of the last key picture to its light.
    key_took: Duration,
    eye: Eye,
}

#[derive(Debug)]
struct Passes {
    reproject: ReprojectPass,
    copy: FullscreenPass,
}

/// What frames show.
#[derive(Debug)]
struct KeyPicture {
    camera: Pinhole,
    colour: Target,
    w: TextureView,
    /// Whether nothing is seen in it.
    is_empty: bool,
}

/// A key picture that is being drawn.
#[derive(Debug)]
struct Begun {
    camera: Pinhole,
    slices: Slices,
    /// Of the picture, and of a slice at most.
    quads: usize,
    most_quads: usize,
    since: Instant,
}

/// Where the eye was.
#[derive(Debug, Default)]
struct Eye {
    motions: MotionEstimator,
    last: Option<(Pinhole, Instant)>,
    begin: Option<Instant>,
    /// When the last frame was drawn.
    drawn: Option<Instant>,
}

/// What a frame is drawn of.
pub(crate) struct Frame<'a> {
    pub shown: Shown<'a>,
    pub camera: &'a Pinhole,
    pub options: Options,
    /// Whether effects are drawn that would not be, were frames too slow with them.
    pub has_effects: bool,
    /// When what is shown last moved by itself.
    pub moved: Option<Instant>,
}

impl Steady {
    /// For targets of `format`. What frames of key pictures need is made when the first one is drawn.
    pub(crate) fn new(gpu: &Gpu, format: TextureFormat) -> Steady {
        Steady {
            gpu: gpu.clone(),
            format,
            // A device without a GPU is known to be slow.
            governor: Governor::new(gpu.caps.software),
            times: DeviceTimes::default(),
            passes: None,
            shown: None,
            begun: None,
            key_took: Duration::ZERO,
            eye: Eye::default(),
        }
    }

    /// How frames are drawn now.
    pub(crate) fn resolution(&self) -> Resolution {
        if self.governor.is_by_keys() { Resolution::Keys(self.governor.share()) } else { Resolution::Whole }
    }

    /// Whether a key picture is being drawn: what it shows must not change meanwhile.
    pub(crate) fn is_drawing(&self, now: Instant) -> bool {
        self.begun.is_some() && self.eye.drawn.is_some_and(|drawn| now.duration_since(drawn) < ABSENT)
    }

    /// Whether the next frame shows more, though nothing moves: a key picture is drawn, or what is seen at rest.
    pub(crate) fn goes_on(&self) -> bool {
        let Some(shown) = self.shown.as_ref().filter(|_| self.governor.is_by_keys()) else { return false };
        self.begun.is_some() || self.eye.last.as_ref().is_some_and(|(camera, _)| shown.camera != *camera)
    }

    /// Draws a frame and submits it.
    pub(crate) fn draw(&mut self, renderer: &mut FrameRenderer, frame: &Frame<'_>, output: &TextureView) {
        let now = Instant::now();
        let is_moving = self.eye.last.as_ref().is_some_and(|(last, _)| last != frame.camera);
        for (work, time) in self.times.take() {
            // Between frames that do not follow each other nobody asks whether the device is done.
            if is_moving {
                self.governor.took(work, time);
            }
        }
        let motion = self.eye.see(frame.camera, now);
        let is_at_rest = self.eye.rests(now) && frame.moved.is_none_or(|moved| now.duration_since(moved) >= REST);
        let mut encoder = self.gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let work = if !self.governor.is_by_keys() {
            (self.shown, self.begun) = (None, None);
            renderer.draw(&mut encoder, frame.shown, frame.camera, output, frame.options);
            let is_least = !frame.has_effects && renderer.samples() == 1;
            (!is_at_rest).then_some(Work::Whole { is_least })
        } else if is_at_rest {
            self.draw_at_rest(renderer, &mut encoder, frame, output);
            None
        } else {
            Some(self.draw_by_keys(renderer, &mut encoder, frame, (motion, now), output))
        };
        self.gpu.queue.submit([encoder.finish()]);
        renderer.submitted(matches!(work, Some(Work::Whole { .. })));
        if let Some(work) = work {
            self.times.submitted(&self.gpu, work);
        }
    }

    /// All that there is of the very view, to be a key picture when the eye moves on.
    fn draw_at_rest(
        &mut self,
        renderer: &mut FrameRenderer,
        encoder: &mut wgpu::CommandEncoder,
        frame: &Frame<'_>,
        output: &TextureView,
    ) {
        self.begun = None;
        let target = self.target((frame.camera.width_px, frame.camera.height_px));
        renderer.draw(encoder, frame.shown, frame.camera, &target.view, frame.options);
        let passes = self.passes.get_or_insert_with(|| Passes::new(&self.gpu, self.format));
        passes.copy.encode(encoder, &[BindingResource::TextureView(&target.view)], &[output]);
        let is_empty = frame.shown.surfaces.quads_drawn(frame.camera) == 0;
        self.show(renderer, target, *frame.camera, is_empty);
    }

    /// A slice of the next key picture, or its light, and the frame by what is there then.
    fn draw_by_keys(
        &mut self,
        renderer: &mut FrameRenderer,
        encoder: &mut wgpu::CommandEncoder,
        frame: &Frame<'_>,
        (motion, now): (Motion, Instant),
        output: &TextureView,
    ) -> Work {
        let options = Options { antialias: Antialias::Off, ..frame.options };
        // What comes into an empty picture is shown at once.
        let is_first = self.shown.as_ref().is_none_or(|shown| shown.is_empty);
        let mut begun = self.begun.take().unwrap_or_else(|| {
            let ahead_s = (1.5 * self.key_took.as_secs_f64()).min(LONGEST_AHEAD_S);
            let world_from_eye = motion.pose_after(&frame.camera.world_from_eye, ahead_s);
            let camera = key_camera(frame.camera, world_from_eye, self.governor.share());
            let slices = if is_first { 1 } else { self.governor.slices() };
            let quads = frame.shown.surfaces.quads_drawn(&camera);
            let most_quads = quads.div_ceil(slices).max(1);
            Begun { camera, slices: Slices::default(), quads, most_quads, since: now }
        });
        let mut work = Work::Light;
        if !begun.slices.are_all() {
            let slices = (&mut begun.slices, begun.most_quads);
            renderer.draw_slice(encoder, frame.shown, &begun.camera, options, slices);
            work = Work::Slice;
        }
        if work == Work::Light || is_first {
            let size_px = (begun.camera.width_px, begun.camera.height_px);
            let target = self.target(size_px);
            renderer.draw_light(encoder, frame.shown, &begun.camera, &target.view, options);
            self.show(renderer, target, begun.camera, begun.quads == 0);
            self.key_took = now.duration_since(begun.since);
        } else {
            self.begun = Some(begun);
        }
        let passes = self.passes.get_or_insert_with(|| Passes::new(&self.gpu, self.format));
        if let Some(KeyPicture { camera, colour, w, .. }) = &self.shown {
            let seen = Seen { camera, colour: &colour.view, w };
            passes.reproject.encode(encoder, seen, frame.camera, output);
        }
        work
    }

    fn show(&mut self, renderer: &FrameRenderer, colour: Target, camera: Pinhole, is_empty: bool) {
        let w = renderer.lit_w().expect("it drew the picture").clone();
        self.shown = Some(KeyPicture { camera, colour, w, is_empty });
    }

    /// The one of the last key picture, where it is of this size: nothing of that is shown any more.
    fn target(&mut self, size_px: (u32, u32)) -> Target {
        let last = self.shown.take().map(|shown| shown.colour);
        let last = last.filter(|last| (last.texture.width(), last.texture.height()) == size_px);
        last.unwrap_or_else(|| Target::new(&self.gpu, "key picture", size_px, self.format))
    }
}

impl Passes {
    fn new(gpu: &Gpu, format: TextureFormat) -> Passes {
        let copy = FullscreenPass::new(gpu, "client/copy.wgsl", "copy", &[Binding::FloatTexture], &[format]);
        Passes { reproject: ReprojectPass::new(gpu, format).expect(EMBEDDED), copy: copy.expect(EMBEDDED) }
    }
}

impl Eye {
    /// Takes in a frame's camera; how it moves.
    fn see(&mut self, camera: &Pinhole, now: Instant) -> Motion {
        let begin = *self.begin.get_or_insert(now);
        self.drawn = Some(now);
        if self.last.as_ref().is_none_or(|(last, _)| last != camera) {
            self.last = Some((*camera, now));
        }
        self.motions.see(camera.world_from_eye, now.duration_since(begin).as_secs_f64())
    }

    fn rests(&self, now: Instant) -> bool {
        self.last.as_ref().is_some_and(|(_, since)| now.duration_since(*since) >= REST)
    }
}

/// A wider and coarser view than that of `output`, of as large pixels everywhere.
fn key_camera(output: &Pinhole, world_from_eye: Rigid, share: f64) -> Pinhole {
    let size_px = DVec2::new(output.width_px.into(), output.height_px.into());
    let margin_px = (MARGIN * share * size_px).ceil();
    let key_px = (share * size_px + 2.0 * margin_px).ceil();
    Pinhole {
        world_from_eye,
        width_px: key_px.x as u32,
        height_px: key_px.y as u32,
        focal_px: share * output.focal_px,
        centre_px: share * output.centre_px + margin_px,
        ..*output
    }
}
