//! Every number that decides what is sent, in one place.

/// When a first hit of the scene counts as held, and what of the copy is taken back.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AccountRules {
    /// A hit may lie this many pixel footprints (`1/f` of its distance) off the held surface, measured along its normal: what
    /// averaging corners and coding depths and normals may shift a surface by.
    pub off_plane_footprints: f32,
    /// The same along the ray, where a surface is seen edge-on and the former would allow anything.
    pub along_ray_footprints: f32,
    /// Least cosine between the normals of a hit and of the held surface; not asked where the triangle is the same.
    pub normal_cos: f32,
    /// Whether a held surface one pixel away may stand for a hit on an outline. It may while views change from update to
    /// update, or each would send its own outlines; views that stay want theirs complete.
    pub outlines_stand_in: bool,
    /// A hit is sent again where the scene is now sampled this many times more densely (samples an area) than it is held.
    /// 4 is half the distance. Walking among pillars for 20 s, 2.5 sends three tenths more than 4, and FLIP falls from 0.034 to 0.032, below
    /// that of views sent anew; without it what was first seen from afar stays coarse.
    pub density_factor: f32,
    /// Whether what is held too coarsely is sent again. While the viewer moves only views on its way ask for it: one from the
    /// rim may lie right before a wall that the viewer will never be as near to. In a room of pillars that was a fifth of all
    /// samples sent.
    pub refines: bool,
    /// A view that lacks less than this share of its pixels gets nothing, unless it is the viewer's own. Chosen: of 640 x 360 pixels 0.0005 are 115. A tenth
    /// would be 11, and ten times as much a hole of 34 x 34.
    pub least_missing: f64,
    /// While the viewer or the scene moves, what covers falsely is trimmed, and what finer samples cover given up, at every so manieth look
    /// only: the next views may not show it any more.
    pub trim_every: usize,
    /// Sent samples are surrounded by a border of their own surface this wide, so that patches overlap instead of cracking.
    pub border_px: u32,
}

impl Default for AccountRules {
    fn default() -> AccountRules {
        AccountRules {
            off_plane_footprints: 1.5,
            along_ray_footprints: 10.0,
            normal_cos: 0.7,
            outlines_stand_in: true,
            density_factor: 2.5,
            refines: true,
            least_missing: 0.0005,
            trim_every: 4,
            border_px: 1,
        }
    }
}
