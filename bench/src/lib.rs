//! Evidence: how good, how fast and how small Vantage is, on the built-in scenes and on any scene of your own.
//!
//! - [`command`]: what people type; [`all`]: every run of the papers, piece by piece.
//! - [`beside`]: models beside another renderer.
//! - [`compare`]: scores of a picture against the truth (FLIP, SSIM, PSNR, flicker, holes), for one frame or a folder.
//! - [`load`]: many clients of one server.
//! - [`poses`]: the eye, frame by frame; [`motion`]: ways to move that need no file.
//! - [`prediction`]: how far off a viewer is expected to be, by how it moves.
//! - [`raytrace`]: the truth of reflections, refractions and ambient occlusion.
//! - [`report`]: the frame of every report: rows of figures with their bars, written as JSON, CSV, SVG plots and one page.
//! - [`topic`]: what a topic is; [`topics`] holds them, one file each.
//! - [`render`]: the command that draws the truth; [`stage`]: a scene on the GPU with its truth.
//! - [`spread`]: mean, median, bad tail and worst of a measure. No mean is shown without the others.
//!
//! The truth is never made by the code under test: it is the full scene drawn by `server::truth`, which shares nothing with
//! the reconstruction of the client.

pub mod all;
pub mod beside;
pub mod client_view;
pub mod command;
pub mod compare;
pub mod load;
pub mod motion;
pub mod options;
pub mod poses;
pub mod prediction;
mod programs;
pub mod raytrace;
pub mod render;
pub mod report;
pub mod rng;
pub mod sets;
mod spent;
pub mod spread;
pub mod stage;
pub mod topic;
pub mod topics;
