//! Caps that the targets run under: those of the product, lowered until a run is small.

use protocol::Limits;
use scene::load::LoadLimits;

/// By the formula of [`LoadLimits`], a load takes at most 3 + 4 + 20 + 10 + 13 + 12 MB with these.
pub const LOAD: LoadLimits = LoadLimits {
    file_bytes: 1 << 20,
    json_values: 1 << 16,
    nodes: 1 << 10,
    depth: 1 << 6,
    vertices: 1 << 16,
    triangles: 1 << 16,
    points: 1 << 12,
    texture_pixels: 1 << 20,
    keyframe_values: 1 << 16,
    instances: 1 << 10,
    objects: 1 << 8,
};

/// A copy of at most 8 Ki samples: more take longer, and reach no other code.
pub fn protocol() -> Limits {
    Limits {
        update_bytes: 1 << 20,
        update_edits: 1 << 10,
        image_side_px: 1 << 10,
        update_pixels: 1 << 14,
        update_samples: 1 << 12,
        held_samples: 1 << 13,
        held_pixels: 1 << 16,
        held_patches: 1 << 10,
        body_vertices: 1 << 12,
        body_indices: 1 << 14,
        body_clip_numbers: 1 << 14,
        ..Limits::default()
    }
}
