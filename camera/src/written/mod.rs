//! Cameras as people write them: a few lengths, angles and planes, from which the cameras of this crate are made.
//!
//! Method: the construction of graph cameras in Rosen, Popescu, Hayward, Wyman, *Non-pinhole approximations for interactive
//! rendering*, section 5: a pinhole's frustum is bent, split and merged, one operation after the other ([`WrittenGraph`]). A
//! single-pole camera is written as an eye, what it looks at, and how far around that it sees ([`WrittenSinglePole`]).
//!
//! | papers | written |
//! |---|---|
//! | bend | [`Operation::Bend`]: a plane ends a frustum, and another one begins there with a centre of its own |
//! | split | [`Operation::Split`]: several begin at one |
//! | merge | [`Operation::Merge`]: one begins at several |
//!
//! Lengths are in metres and angles in degrees, in the space that the camera is written in: y up, looking along -z as a camera of glTF.

mod error;
mod graph;
mod plane;
mod single_pole;

pub use error::WrittenError;
pub use graph::{At, Operation, Part, WrittenGraph};
pub use plane::WrittenPlane;
pub use single_pole::{Target, WrittenSinglePole};

use std::sync::Arc;

use serde::Deserialize;

use crate::{Bounds, Camera, GraphCamera, GraphDescription, Rigid};
use error::check_size;

/// A camera with the name that viewers ask for it by.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NamedWritten {
    /// The name.
    pub name: String,
    #[serde(default)]
    graph_camera: Option<WrittenGraph>,
    #[serde(default)]
    single_pole: Option<WrittenSinglePole>,
    #[serde(default)]
    graph_description: Option<GraphDescription>,
}

/// A camera that viewers ask for by its name.
#[derive(Debug, Clone, PartialEq)]
pub struct NamedCamera {
    /// The name.
    pub name: String,
    /// The camera.
    pub camera: Camera,
}

/// A camera as it is written.
#[derive(Debug, Clone, PartialEq)]
pub enum WrittenCamera {
    /// By operations.
    Graph(WrittenGraph),
    /// By what it looks at.
    SinglePole(WrittenSinglePole),
    /// By all of its faces and limits, in world space.
    Described(GraphDescription),
}

impl NamedWritten {
    /// What is written.
    ///
    /// # Errors
    /// [`WrittenError::Kind`] where it is no camera or several.
    pub fn camera(self) -> Result<WrittenCamera, WrittenError> {
        match (self.graph_camera, self.single_pole, self.graph_description) {
            (Some(graph), None, None) => Ok(WrittenCamera::Graph(graph)),
            (None, Some(single_pole), None) => Ok(WrittenCamera::SinglePole(single_pole)),
            (None, None, Some(description)) => Ok(WrittenCamera::Described(description)),
            _ => Err(WrittenError::Kind),
        }
    }
}

impl WrittenCamera {
    /// The most cameras of a scene.
    pub const MAX_CAMERAS: usize = 256;

    /// The longest name, in bytes: a client says it in its greeting.
    pub const MAX_NAME_BYTES: usize = 64;

    /// Makes the camera: `world_from_written` is where it is written, `bounds_of` tells the bounds of an object by its name.
    ///
    /// # Errors
    /// [`WrittenError`] says which frustum is wrong and how.
    pub fn compile(
        &self,
        world_from_written: &Rigid,
        bounds_of: &dyn Fn(&str) -> Option<Bounds>,
    ) -> Result<Camera, WrittenError> {
        let camera = match self {
            WrittenCamera::Graph(graph) => Camera::Graph(Arc::new(graph.compile(world_from_written)?)),
            WrittenCamera::SinglePole(camera) => Camera::Spoc(camera.compile(world_from_written, bounds_of)?),
            WrittenCamera::Described(description) => {
                Camera::Graph(Arc::new(GraphCamera::from_description(description)?))
            }
        };
        check_size(camera.size_px())?;
        Ok(camera)
    }
}
