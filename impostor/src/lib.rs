//! Impostors: depth images that rays are intersected with, in place of the scene that they show. Pure maths in f64; the
//! shaders of `impostor/` are the twins of every [`Method`] but [`Method::Points`] in f32, and [`ImpostorUniform`] and its like are what they read.
//!
//! Method: Rosen, Popescu, Hayward, Wyman, *Non-pinhole approximations for interactive rendering*, sections 3.2, 4, 5.1 and 7.2;
//! Popescu, Hayward, Rosen, Wyman, *Non-pinhole impostors* (2009), sections 3 to 5. A ray projects to a curve in the image; walking
//! along it, one compares the ray's depth with the image's. So a ray costs a walk along one line, not a search through a
//! scene, and any camera that projects quickly will do.
//!
//! | papers | here |
//! |---|---|
//! | depth image, impostor | [`Impostor`] |
//! | clip the segment with the bounding volume | [`Impostor::bounds_world`], then the image and the depths in it |
//! | interpolate in 3-D and project every point; first algorithm for the graph camera | [`Method::Points`] |
//! | walk on the projection; second algorithm for the graph camera | [`Method::Fine`] |
//! | coarse steps, fuzzy intersection, then fine steps | [`Method::Coarse`] |
//! | - (ours) | [`Method::Hierarchy`] |
//! | intersection in `(t, z)` | planes of samples against the ray, in `w`; see [`Impostor`] |
//!
//! **Deviations.** Points of the walk are spaced evenly in the image, not in space: where a ray comes near the camera, even
//! steps in space leap over many pixels. They are the straight projection's, pushed one by one, so a curved projection is followed
//! all the same; steps are as short as a bound of the curve's length says, where the distance between the images of the
//! ends, which the papers count by, is too short. The papers reject a coarse segment whose ends find nothing; that loses what is
//! thinner. Here a coarse segment is rejected only if nothing in the pixels around it meets its depths.
//!
//! **Steps.** Means per ray at fine steps of 1/4, 1/2 and 1 pixel, coarse steps of 6 (`tests/steps.rs`: rays off a mirror ball; an
//! object in 512 x 512 pixels, a maze in 1,920 x 1,440). The papers' scenes are others, and they do not say how the maze was stepped.
//!
//! | | object | papers | maze | papers |
//! |---|---|---|---|---|
//! | [`Method::Points`] | 389, 195, 98 | | 2573, 1287, 645 | 155 |
//! | [`Method::Fine`] | 358, 179, 90 | | 2615, 1308, 654 | |
//! | [`Method::Coarse`] | 46, 31, 23 | 48, 31, 22 | 154, 132, 121 | 27 |
//! | [`Method::Hierarchy`] | 24, 21, 19 | | 42, 36, 32 | |
//!
//! A step is cut at the borders of pixels, so what a walk finds does not hang on the length of its steps; finer ones follow a curved
//! projection more closely.

mod camera;
mod crossing;
mod curve;
mod gpu;
mod image;
mod pyramid;
mod ray;
mod search;
mod walk;

pub use crossing::Side;
pub use gpu::{FRUSTUM_TEXELS, ImpostorUniform, RangeTexels};
pub use image::{Impostor, ImpostorError, Sample, SampleShape};
pub use ray::Ray;
pub use search::{Hit, Search, Steps};
pub use walk::{Method, StepCount};
