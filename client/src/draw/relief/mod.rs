//! Objects that are drawn by rays against one impostor: many of one shape, wherever they stand or move, in colours of their own.
//!
//! Method: relief texture mapping by non-pinhole images; Rosen, Popescu, Hayward, Wyman, *Non-pinhole approximations for interactive
//! rendering*, section 6.2 and figures 2, 12, 13 and 20. The image of a single-pole occlusion camera holds the top and the sides of an
//! object in one layer. The box around it is drawn where each object stands; every pixel in it sends the eye's ray to the space of
//! capture, and walks there ([`impostor`]). What it meets is written with its true depth, so silhouettes and what lies before what are
//! right among objects and with surfaces, whatever draws them, and all later passes take it for a surface. Any pinhole does for an
//! eye: a view, or what a shadow map is drawn from.
//!
//! | paper | here |
//! |---|---|
//! | a relief tile on a coarse model | [`protocol::Edit::Place`]: the image of an object, and affine poses of all that it shows |
//! | the tile's bounding box is rendered | its back faces, so that the eye may stand in it; mirrored poses turn its triangles over |
//! | world space z is computed at the intersection | as `w`, of the output eye: `1/w` is the ray's parameter |
//! | the colour is changed where it is the car's | it is multiplied by a tint, in linear light |
//! | - (ours) | colours are averages over as many of the image's pixels as an output pixel is wide at that depth |
//!
//! **Deviations.** Rays that come out from behind a surface go on: only what the camera saw from its front is shown, so a hole shows
//! where the image does not hold what the eye sees. The papers' "rubber bands", across steps in depth, are cut as in every walk
//! ([`impostor::Impostor`]). A sample counts or it does not, at grazing angles too: what lies behind is not known before all is
//! drawn, so nothing can fade into it. Surfaces are tested against a depth that is set back by half a footprint, reliefs are not: a relief
//! shows before a surface that it touches.
//!
//! Left out on the CPU is what lies beside the view, and what is smaller than a pixel. Nothing is made before something is placed. An
//! object is 104 bytes a frame.

mod instances;
mod pass;

pub(crate) use instances::may_show;
pub(crate) use pass::{ReliefInputs, ReliefPass, onto};
