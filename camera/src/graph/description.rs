use glam::DVec3;
use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::{HalfSpace, Pinhole};

/// A graph camera as people and builders write it; [`GraphCamera::from_description`](crate::GraphCamera::from_description)
/// checks it and makes the camera.
///
/// The papers bend, split and merge the frusta of a pinhole. Here all three are faces: a frustum begins at a face on one
/// of its parent's planes. One face is a bend, several frusta with faces on one parent are a split, several faces of one
/// frustum are a merge.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GraphDescription {
    /// Where rays begin.
    pub root: RootDescription,
    /// All other frusta, in any order.
    pub frusta: Vec<FrustumDescription>,
    /// A frustum whose face is narrower or lower than this in the image, in pixels, is left out with all behind it: along a
    /// chain of frusta the image of a face shrinks, and with it what can be told of the scene there. 0 keeps all.
    #[serde(default)]
    pub min_face_px: f64,
}

/// The first frustum: a pinhole's, from its near plane on.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RootDescription {
    /// What faces and errors call it.
    pub name: String,
    /// Its image is the graph camera's.
    pub pinhole: Pinhole,
    /// What it ends at, and what it is cut by, in world space. Together with the pyramid of its rays they must bound it.
    pub limits: Vec<HalfSpace>,
}

/// A frustum behind others.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FrustumDescription {
    /// What faces and errors call it; no two frusta share a name.
    pub name: String,
    /// The centre of projection, in world space. Rays run through the faces as if they came from here.
    pub centre: DVec3,
    /// Where rays come in: one face, or one for each parent that merges into this frustum. The pyramids from the centre
    /// through the faces must not overlap.
    pub faces: Vec<FaceDescription>,
    /// As for the root.
    pub limits: Vec<HalfSpace>,
}

/// Where a frustum's rays go over into a child's.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FaceDescription {
    /// The name of the frustum whose rays arrive here.
    pub parent: String,
    /// A convex polygon on one of the parent's limits and inside of the parent, in world space, going round either way. Both
    /// within a millionth of its extent.
    pub corners: Vec<DVec3>,
}

/// Why a description makes no camera. Every reason names the frustum it is found at.
#[derive(Debug, Error, Clone, PartialEq)]
pub enum GraphError {
    /// More than [`GraphCamera::MAX_FRUSTA`](crate::GraphCamera::MAX_FRUSTA), counted as in the camera; or more than
    /// [`GraphCamera::MAX_PLANES`](crate::GraphCamera::MAX_PLANES) corners of a face, faces or limits of one frustum.
    #[error("frustum {name:?}: too many frusta, faces, corners or limits")]
    TooMany {
        /// Where the count went over.
        name: String,
    },
    /// A number is not finite or out of range, or a plane's normal has no length; or the frustum lies so deep that its
    /// matrix is not finite.
    #[error("frustum {name:?}: a number is not finite or out of range")]
    Number {
        /// Which frustum.
        name: String,
    },
    /// Two frusta have this name.
    #[error("frustum {name:?}: another one has the same name")]
    SameName {
        /// The name.
        name: String,
    },
    /// A frustum behind the root has no face.
    #[error("frustum {name:?}: no face leads into it")]
    NoFace {
        /// Which frustum.
        name: String,
    },
    /// A face names a parent that does not exist.
    #[error("frustum {name:?}: there is no parent {parent:?}")]
    UnknownParent {
        /// Which frustum.
        name: String,
        /// The name without a frustum.
        parent: String,
    },
    /// A frustum is its own ancestor.
    #[error("frustum {name:?}: it is its own ancestor")]
    Cycle {
        /// A frustum of the cycle.
        name: String,
    },
    /// A face is no convex polygon.
    #[error("frustum {name:?}: its face at {parent:?} is not a convex polygon")]
    Face {
        /// Which frustum.
        name: String,
        /// The parent at that face.
        parent: String,
    },
    /// A face does not lie on one of its parent's limits, or reaches over the end of the parent there.
    #[error("frustum {name:?}: a gap between its face and {parent:?}")]
    Gap {
        /// Which frustum.
        name: String,
        /// The parent at that face.
        parent: String,
    },
    /// A centre does not lie before its face, on the parent's side.
    #[error("frustum {name:?}: its centre is on the wrong side of its face at {parent:?}")]
    WrongSide {
        /// Which frustum.
        name: String,
        /// The parent at that face.
        parent: String,
    },
    /// The limits leave nothing, or nothing but a face, of a frustum.
    #[error("frustum {name:?}: it has no volume")]
    NoVolume {
        /// Which frustum.
        name: String,
    },
    /// The limits do not bound the frustum.
    #[error("frustum {name:?}: it has no end")]
    Unbounded {
        /// Which frustum.
        name: String,
    },
    /// Two frusta have points in common, which would have two images.
    #[error("frustum {name:?}: it overlaps {other:?}")]
    Overlap {
        /// Which frustum.
        name: String,
        /// The other one; the same name where two pyramids of a merge overlap.
        other: String,
    },
}
