//! The methods that turn a scene and cameras into depth images.

use std::fmt;
use std::str::FromStr;

use camera::Pinhole;

/// Which method makes the images of a set.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Discretization {
    /// Every image holds all that its camera sees.
    Conventional,
    /// Every image is of the first camera and holds what lies behind the one before it. Layers are told apart as the paper does it,
    /// by [`RedundancyTest::Pixel`] from one eye, so surfaces that touch or coincide are peeled one by one.
    DepthPeeling,
    /// No image holds what an earlier one does.
    NonRedundant(Redundancy),
}

/// When an image leaves out a sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Redundancy {
    /// Where an earlier image is asked for it.
    pub test: RedundancyTest,
    /// Ours: a sample that is more than this many times as dense as in the earlier image is kept, as that one saw its surface from
    /// afar or at a grazing angle. 0: density does not count, as in the paper. Rays ([`RedundancyTest::Visibility`]) do not ask for it.
    pub density_factor: f32,
}

/// How an earlier image is asked whether it holds a sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum RedundancyTest {
    /// Whether its pixel there holds the same triangle (Alg. 3).
    Pixel,
    /// The same for the 3 x 3 pixels around it (ours): see [`super`].
    Neighbourhood,
    /// Whether its pixel there holds the same triangle, or a sample of the same object that faces the same way, on whose plane the
    /// sample lies within a footprint (ours): triangles smaller than a pixel are told by their surface.
    Surface,
    /// The same for the 3 x 3 pixels around it (ours): two small images of one outline, each rounded to its own pixels, miss nothing
    /// of each other. For probes ([`super::placement`]).
    Nearby,
    /// The same as [`RedundancyTest::Surface`] for all four pixels whose centres are around it (ours): between four samples of one surface a client's quads leave no
    /// gap, beside an outline they may. So outlines are sampled by every image, each with its own pixels.
    Covered,
    /// Whether all four pixels whose centres are around it hold the same triangle (ours): what another eye sees of the triangle between them
    /// has one of them as its nearest, so no image loses by it what it would hold by itself.
    CoveredTriangle,
    /// Whether a ray from its eye reaches the sample through nothing but what images before it hold (Alg. 2, in a recursive form that is
    /// ours: an image holds what it reached behind fragments that it dropped). Cut-outs are taken to be whole, so what
    /// lies behind their holes is kept rather than lost.
    Visibility,
    /// Whether a ray from its eye reaches the sample through nothing (Alg. 2 as it stands): from the third image on, what an
    /// earlier one reached behind its dropped fragments is taken again.
    VisibilityPlain,
}

impl RedundancyTest {
    /// Every test.
    pub const ALL: [RedundancyTest; 8] = [
        RedundancyTest::Pixel,
        RedundancyTest::Neighbourhood,
        RedundancyTest::Surface,
        RedundancyTest::Nearby,
        RedundancyTest::Covered,
        RedundancyTest::CoveredTriangle,
        RedundancyTest::Visibility,
        RedundancyTest::VisibilityPlain,
    ];

    /// Whether it follows rays through the scene ([`crate::render::RayScene`]).
    pub fn needs_rays(self) -> bool {
        matches!(self, RedundancyTest::Visibility | RedundancyTest::VisibilityPlain)
    }

    /// `redundancy_test` of `server/redundancy.wgsl`.
    pub(crate) fn code(self) -> u32 {
        match self {
            RedundancyTest::Pixel | RedundancyTest::Neighbourhood | RedundancyTest::CoveredTriangle => 0,
            RedundancyTest::Surface | RedundancyTest::Nearby | RedundancyTest::Covered => 1,
            RedundancyTest::Visibility => 2,
            RedundancyTest::VisibilityPlain => 3,
        }
    }

    /// Whether it asks where earlier images' samples lie.
    pub(crate) fn needs_depth(self) -> bool {
        self.code() == RedundancyTest::Surface.code()
    }

    /// Which pixels of an earlier image are asked.
    pub(crate) fn asked(self) -> Asked {
        match self {
            RedundancyTest::Neighbourhood | RedundancyTest::Nearby => Asked::AnyOfNine,
            RedundancyTest::Covered | RedundancyTest::CoveredTriangle => Asked::AllOfFour,
            _ => Asked::Own,
        }
    }
}

/// Which pixels of an earlier image are asked for a sample; its codes are those of `asked_pixels` in `server/redundancy.wgsl`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Asked {
    /// The one that the sample lies in.
    Own = 0,
    /// That one and its neighbours: one is enough.
    AnyOfNine = 1,
    /// Those whose centres are around it: every one.
    AllOfFour = 2,
}

impl Redundancy {
    /// By a test, whatever the density.
    pub const fn by(test: RedundancyTest) -> Redundancy {
        Redundancy { test, density_factor: 0.0 }
    }

    /// The `override` constants of `server/redundancy.wgsl`.
    pub(crate) fn constants(&self) -> [(&'static str, f64); 3] {
        [
            ("redundancy_test", self.test.code().into()),
            ("asked_pixels", f64::from(self.test.asked() as u32)),
            ("density_factor", self.density_factor.into()),
        ]
    }
}

impl Default for Discretization {
    fn default() -> Self {
        Discretization::COVERED
    }
}

impl Discretization {
    /// The paper's method on a GPU (Alg. 1 and 3).
    pub const PIXEL: Discretization = Discretization::NonRedundant(Redundancy::by(RedundancyTest::Pixel));
    /// By surface. Beside [`Discretization::PIXEL`] it has no lines of samples along edges between triangles. Four images of
    /// 512 x 512, six eyes in the region: a tenth fewer bytes and less false cover (`birdnest` 1,424 kB and 2.37 % instead of 1,585 and
    /// 2.52, `urban` 325 kB and 0.37 % instead of 359 and 0.43) at the same holes and FLIP.
    pub const SURFACE: Discretization = Discretization::NonRedundant(Redundancy::by(RedundancyTest::Surface));
    /// How much denser a sample must be for [`Discretization::FOOTPRINT`] to keep it: of the held copy, too, what is 2.5 times as dense
    /// is sent again ([`crate::account`]).
    pub const DENSITY_FACTOR: f32 = 2.5;
    /// By surface, and aware of footprints.
    pub const FOOTPRINT: Discretization = Discretization::NonRedundant(Redundancy {
        test: RedundancyTest::Surface,
        density_factor: Discretization::DENSITY_FACTOR,
    });

    /// By surface, where all four pixels around say so. The default, and for lamps: outlines are in every image, each with its own pixels, so no image
    /// loses by another what it would hold by itself. By [`Discretization::SURFACE`], three images of 1024 x 1024 of `urban` miss 1.3 % of what is seen between their
    /// eyes, conventional ones 0.5 %; by this 0.5 %, and less than those on `birdnest`, `grass` and `tree` too, for 3 to 14 % more samples than by surface
    /// and 6 to 33 % fewer than conventional.
    pub const COVERED: Discretization = Discretization::NonRedundant(Redundancy::by(RedundancyTest::Covered));

    /// Every method by its name, as people type it.
    pub const NAMED: [(&str, Discretization); 11] = [
        ("conventional", Discretization::Conventional),
        ("depth-peeling", Discretization::DepthPeeling),
        ("non-redundant", Discretization::PIXEL),
        ("neighbourhood", Discretization::NonRedundant(Redundancy::by(RedundancyTest::Neighbourhood))),
        ("surface", Discretization::SURFACE),
        ("nearby", Discretization::NonRedundant(Redundancy::by(RedundancyTest::Nearby))),
        ("covered", Discretization::COVERED),
        ("covered-triangle", Discretization::NonRedundant(Redundancy::by(RedundancyTest::CoveredTriangle))),
        ("footprint", Discretization::FOOTPRINT),
        ("visibility", Discretization::NonRedundant(Redundancy::by(RedundancyTest::Visibility))),
        ("visibility-plain", Discretization::NonRedundant(Redundancy::by(RedundancyTest::VisibilityPlain))),
    ];

    /// What leaves samples out; `None` where nothing does.
    pub fn redundancy(self) -> Option<Redundancy> {
        match self {
            Discretization::Conventional => None,
            Discretization::DepthPeeling => Some(Redundancy::by(RedundancyTest::Pixel)),
            Discretization::NonRedundant(redundancy) => Some(redundancy),
        }
    }

    /// Whether it follows rays through the scene.
    pub fn needs_rays(self) -> bool {
        self.redundancy().is_some_and(|redundancy| redundancy.test.needs_rays())
    }

    /// The cameras that it uses of those planned.
    pub fn cameras(self, planned: &[Pinhole]) -> Vec<Pinhole> {
        match planned.first() {
            Some(first) if self == Discretization::DepthPeeling => vec![*first; planned.len()],
            _ => planned.to_vec(),
        }
    }
}

impl fmt::Display for Discretization {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match Discretization::NAMED.iter().find(|(_, method)| method == self) {
            Some((name, _)) => out.write_str(name),
            None => write!(out, "{self:?}"),
        }
    }
}

impl FromStr for Discretization {
    type Err = String;

    fn from_str(text: &str) -> Result<Discretization, String> {
        let found = Discretization::NAMED.iter().find(|(name, _)| *name == text).map(|(_, method)| *method);
        let names = || Discretization::NAMED.map(|(name, _)| name).join(", ");
        found.ok_or_else(|| format!("there is no method {text}; there are {}", names()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_come_back() {
        for (name, method) in Discretization::NAMED {
            assert_eq!(name.parse(), Ok(method));
            assert_eq!(method.to_string(), name);
        }
        let error = "voxels".parse::<Discretization>().expect_err("unknown");
        assert!(error.contains("voxels") && error.contains("depth-peeling"), "{error}");
    }

    #[test]
    fn layers_are_peeled_from_the_first_eye() {
        let eye = |x: f64| camera::Rigid::look_along(glam::DVec3::X * x, glam::DVec3::NEG_Z);
        let planned = [0.0, 1.0, 2.0].map(|x| Pinhole::symmetric(eye(x), (8, 8), 1.0, 0.1));
        assert_eq!(Discretization::DepthPeeling.cameras(&planned), vec![planned[0]; 3]);
        assert_eq!(Discretization::PIXEL.cameras(&planned), planned);
    }
}
