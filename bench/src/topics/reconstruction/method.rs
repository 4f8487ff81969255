//! What is compared: where samples come from, and how surfaces are made of them.

use client::draw::frame::Options;
use server::discretize::Discretization;
use surface::{Corners, Smoothing};

use super::settings::{IMAGES, Settings};
use crate::sets::SetPlan;

/// Settings of a curve beside the product's own are seen from every fourth eye.
const CURVE_STRIDE: usize = 4;

/// Where the samples come from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Source {
    /// A set of images for the region's middle.
    Set,
    /// A set of images for the eye's own place.
    SetFromTheEye,
    /// What a viewer in the region's middle holds when the server finds nothing lacking any more.
    Settled,
}

/// How surfaces are made of samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Rebuilt {
    /// A quad a sample.
    Quads(Corners),
    /// The same of depths that were not quantized.
    ExactQuads(Corners),
    /// The mesh over the grid of samples.
    Mesh,
    /// The mesh, and quads where it ends.
    MeshWithBorders,
    /// A pixel of the output a sample.
    Points,
}

impl Rebuilt {
    /// Every way, the product's first.
    pub const ALL: [Rebuilt; 9] = [
        Rebuilt::Quads(Corners::Averaged),
        Rebuilt::Quads(Corners::OffsetImage),
        Rebuilt::Quads(Corners::OwnPlane),
        Rebuilt::ExactQuads(Corners::Averaged),
        Rebuilt::ExactQuads(Corners::OffsetImage),
        Rebuilt::ExactQuads(Corners::OwnPlane),
        Rebuilt::Mesh,
        Rebuilt::MeshWithBorders,
        Rebuilt::Points,
    ];

    fn name(self) -> String {
        let corners = |corners| match corners {
            Corners::Averaged => "averaged corners",
            Corners::OffsetImage => "offset image",
            Corners::OwnPlane => "own plane",
        };
        match self {
            Rebuilt::Quads(from) => corners(from).to_owned(),
            Rebuilt::ExactQuads(from) => format!("{}, float depth", corners(from)),
            Rebuilt::Mesh => "mesh".to_owned(),
            Rebuilt::MeshWithBorders => "mesh with border quads".to_owned(),
            Rebuilt::Points => "points".to_owned(),
        }
    }

    /// Whether it needs a second image of each view.
    pub fn takes_offset_images(self) -> bool {
        matches!(self, Rebuilt::Quads(Corners::OffsetImage) | Rebuilt::ExactQuads(Corners::OffsetImage))
    }

    /// How its frames are drawn: the vertices of a mesh and of points are samples themselves, and colours are linear between them.
    pub fn options(self) -> Options {
        let smoothing = match self {
            Rebuilt::Quads(_) | Rebuilt::ExactQuads(_) => Smoothing::default(),
            Rebuilt::Mesh | Rebuilt::MeshWithBorders | Rebuilt::Points => Smoothing::Linear,
        };
        Options { smoothing, ..Options::default() }
    }
}

/// A method at a setting.
#[derive(Debug, Clone, Copy)]
pub(super) struct Method {
    pub plan: SetPlan,
    pub rebuilt: Rebuilt,
    pub source: Source,
    /// Every `stride`-th eye.
    pub stride: usize,
}

impl Method {
    pub fn name(&self) -> String {
        match self.source {
            Source::SetFromTheEye => "floor: one conventional image from the eye itself".to_owned(),
            Source::Settled => "settled: the set, completed and trimmed".to_owned(),
            Source::Set => format!("{}, {}", self.plan.discretization, self.rebuilt.name()),
        }
    }

    /// What the server and the client do by themselves: the bars are about it.
    pub fn is_product(&self, settings: &Settings) -> bool {
        self.plan == settings.product() && self.rebuilt == Rebuilt::ALL[0] && self.source == Source::Set
    }
}

/// All methods at the product's setting and the floor, then, where curves are wanted, other sizes and counts of images with
/// averaged corners.
pub(super) fn methods(settings: &Settings) -> Vec<Method> {
    let both = [Discretization::default(), Discretization::Conventional];
    let plan = |discretization, images, image_px| SetPlan { discretization, images, image_px };
    let method = |plan, rebuilt| Method { plan, rebuilt, source: Source::Set, stride: 1 };
    let averaged = |plan| method(plan, Rebuilt::ALL[0]);
    // The paper's own test beside the product's.
    let pixel = averaged(plan(Discretization::PIXEL, IMAGES, settings.image_px));
    if settings.only_bars {
        return both.map(|d| averaged(plan(d, IMAGES, settings.image_px))).into_iter().chain([pixel]).collect();
    }
    let mut methods: Vec<Method> =
        both.iter().flat_map(|&d| Rebuilt::ALL.map(|way| method(plan(d, IMAGES, settings.image_px), way))).collect();
    methods.push(pixel);
    methods.push(Method { source: Source::Settled, ..averaged(settings.product()) });
    let floor = plan(Discretization::Conventional, 1, settings.image_px);
    methods.push(Method { source: Source::SetFromTheEye, ..averaged(floor) });
    if settings.curves {
        let others = [(1, 512), (2, 512), (8, 512), (4, 256), (4, 768)];
        let curve = |d| others.map(|(images, px)| Method { stride: CURVE_STRIDE, ..averaged(plan(d, images, px)) });
        methods.extend(both.into_iter().flat_map(curve));
    }
    methods
}
