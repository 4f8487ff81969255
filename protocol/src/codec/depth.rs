//! The plane of inverse depths.

use camera::Camera;
use glam::DVec3;

use super::channel::{ChannelReader, ChannelWriter};
use super::neighbours::{Around, Neighbours, median_edge};
use super::streams::{StreamIter, StreamWriter};
use super::{CodecError, tried};
use crate::image::{DepthScale, Mask, octahedral_normal};

/// How a depth is predicted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub(super) enum Predictor {
    /// Repeats the neighbour.
    Neighbour = 1,
    /// See [`median_edge`]: best where depth is coarse.
    MedianEdge = 2,
    /// The plane through the three neighbours: best where depth is fine, for `w` is linear on a plane.
    Gradient = 3,
    /// The plane through one neighbour with its and this sample's normal: best on foliage and fragments.
    Normals = 4,
}

const PREDICTORS: [Predictor; 4] =
    [Predictor::Neighbour, Predictor::MedianEdge, Predictor::Gradient, Predictor::Normals];

/// What prediction looks at beside the depths.
pub(super) struct Context<'a> {
    pub neighbours: &'a Neighbours,
    pub camera: &'a Camera,
    pub depth_scale: DepthScale,
    pub mask: &'a Mask,
    pub normal: &'a [[u8; 2]],
}

pub(super) fn write(depth: &[u16], context: &Context, streams: &mut StreamWriter) -> u8 {
    let surface = Surface::new(context);
    let estimate = |predictor| channel(predictor, depth, context.neighbours, &surface, tried(depth.len())).cost_bits();
    let costs = PREDICTORS.map(|predictor| (predictor, estimate(predictor)));
    let (predictor, _) = costs.into_iter().min_by(|a, b| a.1.total_cmp(&b.1)).expect("there are predictors");
    channel(predictor, depth, context.neighbours, &surface, 0..depth.len()).write(streams);
    predictor as u8
}

fn channel(
    predictor: Predictor,
    depth: &[u16],
    neighbours: &Neighbours,
    surface: &Surface,
    ranks: std::ops::Range<usize>,
) -> ChannelWriter {
    let mut channel = ChannelWriter::starting_at(ranks.start, depth.len(), 16);
    for rank in ranks {
        let predicted = predict(predictor, depth, rank, neighbours, surface);
        channel.push(neighbours.around(rank), 0, predicted, depth[rank].into());
    }
    channel
}

pub(super) fn read(method: u8, context: &Context, streams: &mut StreamIter) -> Result<Vec<u16>, CodecError> {
    let predictor = PREDICTORS.into_iter().find(|&predictor| predictor as u8 == method);
    let predictor = predictor.ok_or(CodecError::Damaged("depth predictor"))?;
    let count = context.normal.len();
    let mut residuals = ChannelReader::read(streams, count, 16)?;
    let surface = if predictor == Predictor::Normals { Surface::new(context) } else { Surface::empty() };
    let mut depth = Vec::with_capacity(count);
    for rank in 0..count {
        let predicted = predict(predictor, &depth, rank, context.neighbours, &surface);
        let (_, code) = residuals.next(context.neighbours.around(rank), 0, predicted)?;
        depth.push(code as u16);
    }
    residuals.finish()?;
    Ok(depth)
}

/// Looks only at depths before `rank`.
fn predict(predictor: Predictor, depth: &[u16], rank: usize, neighbours: &Neighbours, surface: &Surface) -> i32 {
    let at = |rank: usize| i32::from(depth[rank]);
    let along = |from: usize| match predictor {
        Predictor::Normals => surface.extend(at(from), from, rank),
        _ => at(from),
    };
    match neighbours.around(rank) {
        Around::Nothing => 0,
        Around::Anchor(anchor) => along(anchor),
        Around::Left => along(rank - 1),
        Around::Up(up) => along(up),
        Around::LeftUp(up) => match predictor {
            Predictor::Neighbour => at(rank - 1),
            _ => (along(rank - 1) + along(up)) / 2,
        },
        Around::All(up) => {
            let (left, above, corner) = (at(rank - 1), at(up), at(up - 1));
            match predictor {
                Predictor::Neighbour => left,
                Predictor::MedianEdge => median_edge(left, above, corner),
                Predictor::Gradient => (left + above - corner).clamp(0, i32::from(u16::MAX)),
                Predictor::Normals => (along(rank - 1) + along(up)) / 2,
            }
        }
    }
}

/// Rays and normals of the samples in eye space, for predictions along the surface.
struct Surface {
    rays: Vec<DVec3>,
    normals: Vec<DVec3>,
    /// `w_min` in steps: codes count from there.
    code_of_zero: f64,
}

impl Surface {
    fn empty() -> Surface {
        Surface { rays: Vec::new(), normals: Vec::new(), code_of_zero: 0.0 }
    }

    fn new(context: &Context) -> Surface {
        let Camera::Pinhole(camera) = context.camera;
        let eye_from_world = camera.world_from_eye.rotation.conjugate();
        let mut last = ([0; 2], DVec3::ZERO);
        let normal = |&code: &[u8; 2]| {
            if last.0 != code || last.1 == DVec3::ZERO {
                last = (code, eye_from_world * octahedral_normal(code).as_dvec3());
            }
            last.1
        };
        let scale = context.depth_scale;
        let steps = f64::from(scale.w_min) / f64::from(scale.w_step);
        Surface {
            rays: context
                .mask
                .occupied()
                .map(|(x, y)| camera.ray_eye_from_image(f64::from(x) + 0.5, f64::from(y) + 0.5))
                .collect(),
            normals: context.normal.iter().map(normal).collect(),
            code_of_zero: if steps.is_finite() { steps } else { 0.0 },
        }
    }

    /// The code where the plane through sample `from` (whose code is `code`) meets the ray of sample `to`: on a plane with
    /// normal `n`, `w` is proportional to `n.r`. The normal is the mean of both, which is exact to second order on a sphere.
    fn extend(&self, code: i32, from: usize, to: usize) -> i32 {
        let normal = self.normals[from] + self.normals[to];
        let ratio = normal.dot(self.rays[to]) / normal.dot(self.rays[from]);
        // Past a factor of two from one sample to the next the surface is seen along its edge, or the normal is not its own.
        if !(0.5..=2.0).contains(&ratio) {
            return code;
        }
        let steps = (f64::from(code) + self.code_of_zero) * ratio - self.code_of_zero;
        (steps + 0.5).floor().clamp(0.0, f64::from(u16::MAX)) as i32
    }
}
