//! All that an image of a still scene depends on, and what came of it: plain values.

use camera::{Camera, Pinhole};
use protocol::image::Ends;
use protocol::message::{Draws, ViewSize};
use protocol::staging::Excerpt;
use protocol::{DepthImage, Edit, Mask};

use crate::account::Past;
use crate::client::Served;
use crate::discretize::{Capture, DepthPrecision, Discretization};
use crate::impostors::Drawn;
use crate::made::Made;
use crate::plan::Plan;
use crate::portions::Portions;
use crate::render::{Blended, Faces, LeftOut};

/// What an imager was told of how to draw, until it is told otherwise.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Settings {
    /// See [`Imager::smooth`](crate::imager::Imager::smooth).
    pub is_smooth: bool,
    /// See [`Imager::leave_out`](crate::imager::Imager::leave_out).
    pub left_out: LeftOut,
    /// See [`Imager::blend`](crate::imager::Imager::blend).
    pub blended: Blended,
    /// See [`Imager::show`](crate::imager::Imager::show).
    pub excerpt: Excerpt,
}

/// What is to be drawn.
#[derive(Debug, Clone, PartialEq)]
pub enum Subject {
    /// The captures of a set.
    Set(Vec<Pinhole>, Discretization),
    /// Where the surfaces of a mask of one of a set's captures end.
    Ends {
        /// The set's.
        views: Vec<Pinhole>,
        /// The set's.
        method: Discretization,
        /// Which of the captures.
        camera: Pinhole,
        /// Of its samples.
        mask: Mask,
    },
    /// Rows of a view at rest, in parts or not.
    AtRest(Pinhole, bool, DepthPrecision),
    /// A picture for rays.
    Impostor {
        /// Takes it.
        camera: Camera,
        /// What it shows.
        drawn: Drawn,
        /// Of these, which sides.
        faces: Faces,
        /// Whether a single object has its tint.
        is_tinted: bool,
    },
    /// All that a camera sees.
    CameraImage(Camera),
    /// A whole look for a client.
    Look(Box<LookRequest>),
}

/// All that a look for a client depends on whose viewer stands still.
#[derive(Debug, Clone, PartialEq)]
pub struct LookRequest {
    /// What was done for the client before.
    pub past: Past,
    /// Where to look.
    pub plan: Plan,
    /// Its viewer's output.
    pub view: ViewSize,
    /// What it draws.
    pub draws: Draws,
    /// What its copy may cost it.
    pub budget_bytes: u64,
    /// How far a look has come that is taken in portions.
    pub portions: Portions,
    /// Whether it gets a coarse image first.
    pub begins_coarsely: bool,
    /// Shapes that were judged, see [`crate::impostors::relief`].
    pub judged_shapes: usize,
}

/// What an imager is asked for. Equal requests of a still scene have equal answers. Numbers are compared as they are: there are few requests, and
/// most differ in the first number.
#[derive(Debug, Clone, PartialEq)]
pub struct Request {
    /// How it was told to draw.
    pub settings: Settings,
    /// What.
    pub subject: Subject,
}

/// What came of a request.
#[derive(Debug, Clone)]
pub enum Answer {
    /// Of a set.
    Captures(Vec<Capture>),
    /// Of a capture's samples.
    Ends(Vec<Ends>),
    /// All others; none where the imager draws none.
    Depth(Vec<DepthImage>),
    /// Of a look, what it did.
    Look(Box<Looked>),
}

/// What a look did, for clients with the same past.
#[derive(Debug, Clone)]
pub struct Looked {
    /// The past of clients for which it was done.
    pub past: Past,
    /// What is known of them then.
    pub served: Served,
    /// What it did; its times are of the first of them. `None` where nothing was lacking.
    pub made: Option<Made>,
}

impl Request {
    /// Memory that it takes, without what is small.
    pub fn bytes(&self) -> usize {
        match &self.subject {
            Subject::Ends { mask, .. } => mask_bytes(mask),
            _ => 0,
        }
    }
}

impl Answer {
    /// How many.
    pub fn count(&self) -> usize {
        match self {
            Answer::Captures(captures) => captures.len(),
            Answer::Ends(_) => 1,
            Answer::Depth(images) => images.len(),
            Answer::Look(_) => 0,
        }
    }

    /// Memory that they take.
    pub fn bytes(&self) -> usize {
        match self {
            Answer::Captures(captures) => captures.iter().map(capture_bytes).sum(),
            Answer::Ends(ends) => size_of_val(&ends[..]),
            Answer::Depth(images) => images.iter().map(image_bytes).sum(),
            Answer::Look(looked) => looked.bytes(),
        }
    }
}

impl Looked {
    fn bytes(&self) -> usize {
        let image_bytes_of = |edit: &Edit| if let Edit::Add(patch) = edit { image_bytes(&patch.image) } else { 0 };
        let edits = self.made.iter().flat_map(|made| &made.update.edits);
        // As they are, and coded once they were sent.
        self.served.known.bytes() + 2 * edits.map(image_bytes_of).sum::<usize>()
    }
}

fn mask_bytes(mask: &Mask) -> usize {
    let (width_px, height_px) = mask.size_px();
    width_px as usize * height_px as usize / 8
}

fn capture_bytes(capture: &Capture) -> usize {
    let Capture { camera: _, ids, colour, rests, hides, depth, ends, gpu_s: _ } = capture;
    size_of_val(&ids[..])
        + size_of_val(&colour[..])
        + size_of_val(&rests[..])
        + size_of_val(&hides[..])
        + size_of_val(&depth[..])
        + size_of_val(&ends[..])
}

fn image_bytes(image: &DepthImage) -> usize {
    let DepthImage {
        camera: _,
        depth_scale: _,
        mask,
        depth,
        normal,
        normal_rest,
        ends,
        colour,
        colour_rest,
        object,
        material,
        share,
    } = image;
    mask_bytes(mask)
        + size_of_val(&depth[..])
        + size_of_val(&normal[..])
        + normal_rest.len()
        + size_of_val(&ends[..])
        + size_of_val(&colour[..])
        + colour_rest.len()
        + size_of_val(&object[..])
        + material.len()
        + share.len()
}
