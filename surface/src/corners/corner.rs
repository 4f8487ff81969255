//! One corner, as each of the samples around it has it.

use super::planes::Plane;
use super::rules::CornerRules;

/// What the samples around one corner make of it. Index 0 to 3: the pixel above left, above right, below left, below right.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Corner {
    /// `w` for each sample; samples with one `group` have one value.
    pub w: [f32; 4],
    /// The lowest index of the sample's group.
    pub group: [u8; 4],
    /// How far the corner lies beside the pixels' own, in pixels; the same within a group.
    pub shift_px: [[f32; 2]; 4],
    /// Whether the group says that its surface ends here.
    pub ends: [bool; 4],
}

/// Every sample by its own plane; nothing is shared.
pub fn own_plane(around: [Option<&Plane>; 4], rules: &CornerRules) -> Corner {
    Corner { w: predictions(around, rules), group: [0, 1, 2, 3], shift_px: [[0.0; 2]; 4], ends: [false; 4] }
}

/// The offset image's sample at the corner, `(object, w)`, for every sample that no discontinuity separates from it.
pub fn from_offset_image(around: [Option<&Plane>; 4], offset: Option<(u16, f32)>, rules: &CornerRules) -> Corner {
    let mut corner = own_plane(around, rules);
    let Some((object, offset_w)) = offset else { return corner };
    let mut first = None;
    for (index, plane) in around.iter().enumerate() {
        let Some(plane) = plane else { continue };
        if plane.object == object && (corner.w[index] - offset_w).abs() <= plane.tolerance {
            corner.w[index] = offset_w;
            corner.group[index] = *first.get_or_insert(index as u8);
        }
    }
    corner
}

pub(super) fn predictions(around: [Option<&Plane>; 4], rules: &CornerRules) -> [f32; 4] {
    std::array::from_fn(|index| {
        let (sample_is_left, sample_is_above) = (index % 2 == 0, index < 2);
        around[index].map_or(0.0, |plane| plane.at_corner(sample_is_left, sample_is_above, rules))
    })
}
