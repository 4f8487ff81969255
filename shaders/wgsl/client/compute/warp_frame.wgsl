// The frame that a lamp's points look beside, as seen from a view: the twin of `client::soft::batch::FrameUniform`.
struct Frame {
    // Takes a point to the frame's eye space.
    frame_from_view: mat4x3f,
    focal_px: f32,
    near_m: f32,
    // How far rounding moves an inverse depth, as a share of it.
    rounding: f32,
    // Over how many texels what the plane rises hides nothing.
    rise_texels: f32,
}
