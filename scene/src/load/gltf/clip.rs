//! Keyframes: animation samplers and what they target (glTF 2.0, 3.11 and appendix C).
//!
//! Which clips play: all of them together where no two target the same node (a file that animates many objects, each
//! by a clip of its own), otherwise the first (a figure with walks and runs to choose from). Each repeats by itself, from
//! time 0 to its last keyframe.

use glam::{DQuat, DVec3};

use super::accessor::{Accessors, Count};
use super::document::{self, Document};
use super::hierarchy::Local;
use crate::load::source::shorten;
use crate::load::{LoadError, LoadLimits, Warnings};

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Interpolation {
    Step,
    Linear,
    CubicSpline,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Property {
    Translation,
    Rotation,
    Scale,
    Weights,
}

/// One animated property of one node.
#[derive(Debug)]
struct Track {
    node: usize,
    property: Property,
    interpolation: Interpolation,
    /// Seconds, growing.
    times_s: Vec<f32>,
    /// Numbers a keyframe value has.
    width: usize,
    /// Of each keyframe a value, or in-tangent, value and out-tangent for cubic splines.
    values: Vec<f32>,
}

/// Tracks that repeat together.
#[derive(Debug)]
struct Clip {
    duration_s: f64,
    tracks: Vec<Track>,
}

/// All clips that play.
#[derive(Debug, Default)]
pub(super) struct Clips {
    clips: Vec<Clip>,
}

/// What an animation changes, of every node.
#[derive(Debug, Clone)]
pub(super) struct Pose {
    pub locals: Vec<Local>,
    /// Morph weights; `None` where the rest weights hold.
    pub weights: Vec<Option<Vec<f32>>>,
}

impl Clips {
    /// Reads the clips that play.
    pub fn read(
        document: &Document,
        accessors: Accessors<'_>,
        limits: &LoadLimits,
        warnings: &mut Warnings,
    ) -> Result<Clips, LoadError> {
        let chosen = choose(document, warnings);
        let mut values_left = limits.keyframe_values;
        let mut clips = Vec::new();
        for &index in &chosen {
            let animation = &document.animations[index];
            let mut tracks: Vec<Track> = Vec::new();
            for (channel_index, channel) in animation.channels.iter().enumerate() {
                let at = format!("animations[{index}].channels[{channel_index}]");
                let reader = TrackReader { document, accessors, at: &at };
                match reader.read(animation, channel, &mut values_left, warnings) {
                    Ok(Some(track)) => tracks.push(track),
                    Ok(None) => {}
                    // A limit is a limit; a fault costs the scene one channel.
                    Err(error @ LoadError::TooLarge { .. }) => return Err(error),
                    Err(error) => warnings.add(format!("{at} is left out: {error}")),
                }
            }
            let duration_s = tracks.iter().filter_map(|track| track.times_s.last()).copied().fold(0.0, f32::max);
            if !tracks.is_empty() {
                clips.push(Clip { duration_s: f64::from(duration_s), tracks });
            }
        }
        Ok(Clips { clips })
    }

    /// Whether nothing is animated.
    pub fn is_empty(&self) -> bool {
        self.clips.is_empty()
    }

    /// After how long all of them begin again together; 0 where nothing plays, `None` where they never do.
    pub fn period_s(&self) -> Option<f64> {
        let mut periods = self.clips.iter().map(|clip| clip.duration_s).filter(|duration_s| *duration_s > 0.0);
        let first = periods.next().unwrap_or(0.0);
        periods.all(|period_s| period_s == first).then_some(first)
    }

    /// Which nodes' transforms change.
    pub fn moves(&self, nodes: usize) -> Vec<bool> {
        self.mark(nodes, |property| property != Property::Weights)
    }

    /// Which nodes' morph weights change.
    pub fn morphs(&self, nodes: usize) -> Vec<bool> {
        self.mark(nodes, |property| property == Property::Weights)
    }

    fn mark(&self, nodes: usize, wanted: impl Fn(Property) -> bool) -> Vec<bool> {
        let mut marked = vec![false; nodes];
        for track in self.clips.iter().flat_map(|clip| &clip.tracks).filter(|track| wanted(track.property)) {
            marked[track.node] = true;
        }
        marked
    }

    /// Changes a rest pose to that at `time_s`.
    pub fn apply(&self, time_s: f64, pose: &mut Pose) {
        let time_s = if time_s.is_finite() { time_s } else { 0.0 };
        for clip in &self.clips {
            let clip_time_s = if clip.duration_s > 0.0 { time_s.rem_euclid(clip.duration_s) } else { 0.0 };
            for track in &clip.tracks {
                track.apply(clip_time_s, pose);
            }
        }
    }
}

/// Indices of the clips that play.
fn choose(document: &Document, warnings: &mut Warnings) -> Vec<usize> {
    let count = document.animations.len();
    let mut animated_by = vec![None; document.nodes.len()];
    for (index, animation) in document.animations.iter().enumerate() {
        for node in animation.channels.iter().filter_map(|channel| channel.target.node) {
            match animated_by.get_mut(node) {
                Some(Some(other)) if *other != index => {
                    let name = document.animations[0].name.as_deref().unwrap_or("unnamed");
                    warnings.add(format!("of {count} animations only the first ({:?}) plays", shorten(name)));
                    return vec![0];
                }
                Some(slot) => *slot = Some(index),
                None => {}
            }
        }
    }
    (0..count).collect()
}

struct TrackReader<'a> {
    document: &'a Document,
    accessors: Accessors<'a>,
    at: &'a str,
}

impl TrackReader<'_> {
    fn read(
        &self,
        animation: &document::Animation,
        channel: &document::Channel,
        values_left: &mut u64,
        warnings: &mut Warnings,
    ) -> Result<Option<Track>, LoadError> {
        let fault = |fault: String| LoadError::malformed(self.at, fault);
        let property = match channel.target.path.as_str() {
            "translation" => Property::Translation,
            "rotation" => Property::Rotation,
            "scale" => Property::Scale,
            "weights" => Property::Weights,
            path => return Err(fault(format!("target path {:?} is not supported", shorten(path)))),
        };
        let Some(node) = channel.target.node else {
            return Err(fault("it targets no node".into()));
        };
        let Some(target) = self.document.nodes.get(node) else {
            return Err(fault(format!("node {node} does not exist, there are {}", self.document.nodes.len())));
        };
        if target.matrix.is_some() && property != Property::Weights {
            warnings.add(format!("{}: nodes[{node}] has a matrix, which the animation replaces", self.at));
        }
        let sampler = animation.samplers.get(channel.sampler).ok_or_else(|| {
            fault(format!("sampler {} does not exist, there are {}", channel.sampler, animation.samplers.len()))
        })?;
        let interpolation = match sampler.interpolation.as_deref() {
            None | Some("LINEAR") => Interpolation::Linear,
            Some("STEP") => Interpolation::Step,
            Some("CUBICSPLINE") => Interpolation::CubicSpline,
            Some(other) => return Err(fault(format!("unknown interpolation {:?}", shorten(other)))),
        };
        let times = self.accessors.floats::<1>(sampler.input, self.at, Count::AtMost(*values_left))?.into_flattened();
        *values_left -= times.len() as u64;
        let growing = times.windows(2).all(|pair| pair[0] < pair[1]);
        if times.is_empty() || times[0] < 0.0 || !growing || !times.iter().all(|t| t.is_finite()) {
            return Err(fault("keyframe times are not finite, growing and at least 0".into()));
        }
        let values_per_key = if interpolation == Interpolation::CubicSpline { 3 } else { 1 };
        let elements = Count::Exactly(times.len() * values_per_key);
        let (width, values) = match property {
            Property::Translation | Property::Scale => {
                (3, self.accessors.floats::<3>(sampler.output, self.at, elements)?.into_flattened())
            }
            Property::Rotation => (4, self.accessors.floats::<4>(sampler.output, self.at, elements)?.into_flattened()),
            Property::Weights => self.weights(sampler.output, times.len() * values_per_key, *values_left)?,
        };
        LoadError::check_limit("keyframe values", values.len() as u64, *values_left)?;
        *values_left -= values.len() as u64;
        if !values.iter().all(|value| value.is_finite()) {
            return Err(fault("a keyframe value is not finite".into()));
        }
        Ok(Some(Track { node, property, interpolation, times_s: times, width, values }))
    }

    /// Weights of all targets follow one another in one scalar accessor.
    fn weights(&self, accessor: usize, keys: usize, limit: u64) -> Result<(usize, Vec<f32>), LoadError> {
        let values = self.accessors.floats::<1>(accessor, self.at, Count::AtMost(limit))?.into_flattened();
        if values.is_empty() || values.len() % keys != 0 {
            let fault = format!("{} weights do not divide into {keys} keyframe values", values.len());
            return Err(LoadError::malformed(self.at, fault));
        }
        Ok((values.len() / keys, values))
    }
}

impl Track {
    fn apply(&self, time_s: f64, pose: &mut Pose) {
        let value = self.at(time_s);
        if self.property == Property::Weights {
            pose.weights[self.node] = Some(value);
            return;
        }
        let local = &mut pose.locals[self.node];
        if matches!(local, Local::Matrix(_)) {
            *local = Local::IDENTITY;
        }
        let Local::Parts { translation, rotation, scale } = local else { return };
        let number = |index: usize| f64::from(value[index]);
        let vector = || DVec3::new(number(0), number(1), number(2));
        match self.property {
            Property::Translation => *translation = vector(),
            Property::Scale => *scale = vector(),
            Property::Rotation => *rotation = normalized(DQuat::from_xyzw(number(0), number(1), number(2), number(3))),
            Property::Weights => {}
        }
    }

    /// The value at a time within the clip; before the first keyframe and after the last it stays.
    fn at(&self, time_s: f64) -> Vec<f32> {
        let next = self.times_s.partition_point(|&t| f64::from(t) <= time_s);
        if next == 0 || next == self.times_s.len() {
            return self.key(next.saturating_sub(1)).to_vec();
        }
        let previous = next - 1;
        let (from_s, to_s) = (f64::from(self.times_s[previous]), f64::from(self.times_s[next]));
        let step_s = to_s - from_s;
        let u = ((time_s - from_s) / step_s) as f32;
        let (a, b) = (self.key(previous), self.key(next));
        match self.interpolation {
            Interpolation::Step => a.to_vec(),
            Interpolation::Linear if self.property == Property::Rotation => slerp(a, b, u),
            Interpolation::Linear => a.iter().zip(b).map(|(a, b)| a + (b - a) * u).collect(),
            Interpolation::CubicSpline => {
                let (out_tangent, in_tangent) = (self.tangent(previous, 2), self.tangent(next, 0));
                (0..self.width)
                    .map(|i| hermite(a[i], out_tangent[i] * step_s as f32, b[i], in_tangent[i] * step_s as f32, u))
                    .collect()
            }
        }
    }

    fn key(&self, index: usize) -> &[f32] {
        match self.interpolation {
            Interpolation::CubicSpline => self.tangent(index, 1),
            _ => &self.values[index * self.width..(index + 1) * self.width],
        }
    }

    /// Of a cubic keyframe: 0 is the in-tangent, 1 the value, 2 the out-tangent.
    fn tangent(&self, index: usize, part: usize) -> &[f32] {
        let start = (index * 3 + part) * self.width;
        &self.values[start..start + self.width]
    }
}

/// Cubic Hermite spline (glTF 2.0, appendix C.5), tangents already scaled by the step.
fn hermite(a: f32, tangent_a: f32, b: f32, tangent_b: f32, u: f32) -> f32 {
    let (u2, u3) = (u * u, u * u * u);
    (2.0 * u3 - 3.0 * u2 + 1.0) * a
        + (u3 - 2.0 * u2 + u) * tangent_a
        + (3.0 * u2 - 2.0 * u3) * b
        + (u3 - u2) * tangent_b
}

/// Along the shorter arc (glTF 2.0, appendix C.4).
fn slerp(a: &[f32], b: &[f32], u: f32) -> Vec<f32> {
    let quaternion = |q: &[f32]| normalized(DQuat::from_xyzw(q[0].into(), q[1].into(), q[2].into(), q[3].into()));
    let value = quaternion(a).slerp(quaternion(b), u.into());
    value.to_array().map(|x| x as f32).to_vec()
}

fn normalized(q: DQuat) -> DQuat {
    let length = q.length();
    if length > 0.0 && length.is_finite() { q / length } else { DQuat::IDENTITY }
}
