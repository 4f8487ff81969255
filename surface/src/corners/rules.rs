//! By what rules corners are made.

use protocol::Purpose;

/// Where corners come from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Corners {
    /// The mean of what the samples of one surface around the corner predict.
    #[default]
    Averaged,
    /// The offset image of the paper where it agrees, else the sample's own plane.
    OffsetImage,
    /// The sample's own plane.
    OwnPlane,
}

/// What counts as one surface around a corner.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CornerRules {
    /// Predictions further apart than this many pixel footprints (`w/f` in w) belong to two surfaces.
    pub gap_footprints: f32,
    /// Error of a coded normal in radians: a grazing surface's predictions err by `0.7 w/f sec^2(theta)` times it, half a
    /// pixel's diagonal from the sample.
    pub normal_error_rad: f32,
    /// Depth steps that two predictions may be apart by coding alone.
    pub depth_steps: f32,
    /// Least cosine between the normals of two samples of one surface.
    pub normal_cos: f32,
    /// A corner's `w` stays within this factor of its sample's, both ways: the plane of a sample seen edge-on has any slope.
    pub max_ratio: f32,
    /// A slope of more than this many footprints a pixel is believed only where a neighbour of the same object shows it. At a
    /// silhouette a shading normal is as good as edge-on, and its plane would stick out of the surface as a spike.
    pub free_slope_footprints: f32,
    /// Where a surface ends and does not say where: before a farther one, or where the image has no sample.
    pub rim: Rim,
    /// Where a surface ends, its corners rise towards the eye by no more than this many footprints over its samples. A surface seen edge-on that
    /// ends within a pixel would otherwise stand out of itself by all that its plane rises on the rest of it.
    pub end_rise_footprints: f32,
}

/// How far a surface's corners draw back where it ends and does not say where, in pixels along both axes, by how many of the four samples around the
/// corner are of it. Pixels are squares and outlines are not: drawing corners in at one and out at three cuts the steps of a
/// slanted outline, as the contour through the middles between samples does (marching squares). And where several images show an outline, the farthest one out is what is seen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rim {
    /// One sample: the surface's own corner juts out.
    pub convex_px: f32,
    /// Two: its side.
    pub straight_px: f32,
    /// Three: a notch; below zero it is filled.
    pub concave_px: f32,
}

impl Rim {
    /// Of what is looked at: what does not say that it ends goes on.
    pub(super) const NONE: Rim = Rim { convex_px: 0.0, straight_px: 0.0, concave_px: 0.0 };

    /// Of what casts: where several images show an outline, the union of their pixels does, and a hole in a shadow is as wrong as a shadow beside it.
    /// So corners draw back until about as much is covered as in truth: see [`CornerRules::of`].
    pub(super) const CASTING: Rim = Rim { convex_px: 0.26, straight_px: 0.16, concave_px: -0.1 };
}

impl Default for CornerRules {
    fn default() -> CornerRules {
        CornerRules {
            gap_footprints: 1.5,
            // The largest error of 8 + 8 bits; the mean is 0.34 degrees.
            normal_error_rad: 0.0145,
            depth_steps: 1.5,
            normal_cos: 0.5,
            // A floor doubles its w within a pixel only at the very horizon.
            max_ratio: 2.0,
            free_slope_footprints: 2.0,
            rim: Rim::NONE,
            end_rise_footprints: f32::INFINITY,
        }
    }
}

impl CornerRules {
    /// What surfaces for a purpose are rebuilt by. Those of a light's images cover no more than there is: their rims draw back further, none
    /// ends above itself by more than a footprint, and what is one surface is decided more strictly, as the light's images show every outline, each with its own
    /// pixels. Errors of soft shadows of `grass` (0 to 255; 2016 paper, section 6.2; four images of 1024², 16 x 16 points): intensity 3.17
    /// and visibility 9.7; by rims of 0.28 and 0.18 intensity is 3.30, of 0.3 and 0.2 3.61; with gaps, normals and slopes as of what is looked at visibility is 10.0 by the latter, not 9.5.
    pub fn of(purpose: Purpose) -> CornerRules {
        let Purpose::Light(_) = purpose else { return CornerRules::default() };
        CornerRules {
            gap_footprints: 1.0,
            normal_cos: 0.8,
            free_slope_footprints: 0.75,
            rim: Rim::CASTING,
            end_rise_footprints: 1.0,
            ..CornerRules::default()
        }
    }
}
