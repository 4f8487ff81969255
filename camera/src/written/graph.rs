use glam::DVec3;
use serde::Deserialize;

use super::error::{WrittenError, check_size};
use super::plane::{Axis, WrittenPlane};
use crate::convex::{TOLERANCE, area_m2, clip, without_short_edges};
use crate::{
    Bounds, FaceDescription, Frustum, FrustumDescription, GraphCamera, GraphDescription, HalfSpace, Pinhole, Rigid,
    RootDescription,
};

/// What the root is called.
const ROOT: &str = "root";

/// A graph camera as people write it: a pinhole, whose frustum is called `root`, and what is done to it.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WrittenGraph {
    /// Where the eye is.
    #[serde(default)]
    pub eye: DVec3,
    /// A point that it looks at.
    #[serde(default)]
    pub look_at: Option<DVec3>,
    /// Or the way that it looks, of any length; without both, along -z.
    #[serde(default)]
    pub forward: Option<DVec3>,
    /// Vertical field of view in degrees.
    pub fov_y_deg: f64,
    /// Width and height of the image in pixels.
    pub size_px: (u32, u32),
    /// What is nearer than this is not seen, in metres.
    #[serde(default = "near_m")]
    pub near_m: f64,
    /// How far it sees where nothing ends its frustum before, in metres.
    pub depth_m: f64,
    /// What else ends its frustum; normals point out.
    #[serde(default)]
    pub limits: Vec<WrittenPlane>,
    /// One after the other.
    #[serde(default)]
    pub operations: Vec<Operation>,
}

/// A wall that the nose touches.
fn near_m() -> f64 {
    0.05
}

/// How frusta go on. Each frustum is operated on once at most.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "snake_case")]
pub enum Operation {
    /// One frustum goes on in another direction.
    Bend {
        /// Which.
        of: String,
        /// Where.
        at: WrittenPlane,
        /// How.
        into: Part,
    },
    /// One frustum goes on in several directions: each part begins at its own plane, or two share one.
    Split {
        /// Which.
        of: String,
        /// The plane that two parts share.
        #[serde(default)]
        at: Option<WrittenPlane>,
        /// What is between these two: they share a line with it. Its normal points to the second one.
        #[serde(default)]
        between: Option<WrittenPlane>,
        /// How.
        into: Vec<Part>,
    },
    /// Several frusta go on as one.
    Merge {
        /// Which.
        of: Vec<String>,
        /// Where: one plane for all, or one for each.
        at: At,
        /// How.
        into: Part,
    },
}

/// Where frusta merge.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(untagged)]
pub enum At {
    /// All at one plane, or each as far along its own axis.
    One(WrittenPlane),
    /// Each at its own, in their order.
    Each(Vec<WrittenPlane>),
}

/// A frustum that an operation makes.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Part {
    /// What later operations and errors call it.
    pub name: String,
    /// Where it begins, of a split whose parts have planes of their own.
    #[serde(default)]
    pub at: Option<WrittenPlane>,
    /// The way of its middle ray, of any length: its centre is as far before the face as that of the frustum before.
    #[serde(default)]
    pub direction: Option<DVec3>,
    /// Or its centre of projection.
    #[serde(default)]
    pub centre: Option<DVec3>,
    /// How far it goes on where nothing ends it before, in metres along its middle ray.
    pub depth_m: f64,
    /// What else ends it; normals point out.
    #[serde(default)]
    pub limits: Vec<WrittenPlane>,
}

impl WrittenGraph {
    /// The most operations of a camera: more of them are a maze, of which a [`crate::CorridorMap`] makes cameras.
    pub const MAX_OPERATIONS: usize = 64;

    /// The most frusta of a camera, each one that merges counted once for each that it begins at: as many as clients draw with.
    pub const MAX_FRUSTA: usize = 256;

    pub(super) fn compile(&self, world_from_written: &Rigid) -> Result<GraphCamera, WrittenError> {
        let mut making = Making::new(self, *world_from_written)?;
        for (index, operation) in self.operations.iter().enumerate() {
            if index >= WrittenGraph::MAX_OPERATIONS {
                let name = operation.first_name().to_owned();
                return Err(WrittenError::TooMany { name, most: WrittenGraph::MAX_OPERATIONS, what: "operations" });
            }
            making.operate(operation)?;
        }
        Ok(making.camera)
    }

    fn root(&self, place: &Rigid) -> Result<Pinhole, WrittenError> {
        let number = |what, needed| Err(WrittenError::Number { name: ROOT.to_owned(), what, needed });
        check_size(self.size_px)?;
        if !(self.fov_y_deg > 0.0 && self.fov_y_deg < 180.0) {
            return number("fov_y_deg", "more than 0 and less than 180");
        }
        if !(self.near_m > 0.0 && self.near_m < self.depth_m && self.depth_m.is_finite()) {
            return number("near_m", "more than 0 and less than depth_m");
        }
        let forward = match (self.look_at, self.forward) {
            (Some(_), Some(_)) => {
                return Err(WrittenError::OneOf { name: ROOT.to_owned(), one: "look_at", other: "forward" });
            }
            (Some(look_at), None) => look_at - self.eye,
            (None, Some(forward)) => forward,
            (None, None) => DVec3::NEG_Z,
        };
        if !self.eye.is_finite() || forward.try_normalize().is_none() {
            return number("eye and what it looks at", "finite, and not the same");
        }
        let world_from_eye = *place * Rigid::look_along(self.eye, forward);
        Ok(Pinhole::symmetric(world_from_eye, self.size_px, self.fov_y_deg.to_radians(), self.near_m))
    }
}

impl Operation {
    fn first_name(&self) -> &str {
        match self {
            Operation::Bend { into, .. } | Operation::Merge { into, .. } => &into.name,
            Operation::Split { into, of, .. } => into.first().map_or(of, |part| &part.name),
        }
    }
}

/// The camera as far as it is made.
struct Making {
    place: Rigid,
    camera: GraphCamera,
    /// By the frusta's names, as made.
    axes: Vec<(String, Axis)>,
    ended: Vec<String>,
}

/// A frustum that begins at parts of planes across others.
struct Beginning<'a> {
    part: &'a Part,
    /// The frusta that it begins at, and the polygons there.
    faces: Vec<FaceDescription>,
}

impl Making {
    fn new(written: &WrittenGraph, place: Rigid) -> Result<Making, WrittenError> {
        let pinhole = written.root(&place)?;
        let along = pinhole.world_from_eye.transform_vector(DVec3::Z);
        let axis = Axis { from: pinhole.world_from_eye.translation, along };
        let limits = limits(ROOT, written.depth_m, &written.limits, &axis, &place)?;
        let root = RootDescription { name: ROOT.to_owned(), pinhole, limits };
        let description = GraphDescription { root, frusta: Vec::new(), min_face_px: 0.0 };
        let camera = GraphCamera::from_description(&description)?;
        Ok(Making { place, camera, axes: vec![(ROOT.to_owned(), axis)], ended: Vec::new() })
    }

    fn operate(&mut self, operation: &Operation) -> Result<(), WrittenError> {
        match operation {
            Operation::Bend { of, at, into } => self.merge(&[of], &[at], into),
            Operation::Merge { of, at, into } => {
                let planes: Vec<&WrittenPlane> = match at {
                    At::One(plane) => vec![plane; of.len()],
                    At::Each(planes) => planes.iter().collect(),
                };
                if of.len() < 2 || planes.len() != of.len() {
                    let needed = "a merge is of two frusta or more, at one plane or as many";
                    return Err(WrittenError::Planes { name: into.name.clone(), needed });
                }
                self.merge(&of.iter().collect::<Vec<_>>(), &planes, into)
            }
            Operation::Split { of, at, between, into } => self.split(of, (at.as_ref(), between.as_ref()), into),
        }
    }

    /// Frusta end at planes, and one goes on: a bend where it is one of one.
    fn merge(&mut self, of: &[&String], at: &[&WrittenPlane], part: &Part) -> Result<(), WrittenError> {
        let mut description = self.camera.description().clone();
        let mut beginning = Beginning { part, faces: Vec::new() };
        for (parent, plane) in of.iter().zip(at) {
            let plane = self.plane_across(&part.name, parent, plane)?;
            limits_of(&mut description, parent).push(plane);
            beginning.faces.extend(self.faces(&part.name, parent, &plane, &[])?);
        }
        self.add(description, vec![beginning])
    }

    /// A frustum ends at planes, and at each another one goes on.
    fn split(
        &mut self,
        of: &String,
        (at, between): (Option<&WrittenPlane>, Option<&WrittenPlane>),
        parts: &[Part],
    ) -> Result<(), WrittenError> {
        let name = parts.first().map_or(of, |part| &part.name);
        let wrong = |needed| WrittenError::Planes { name: name.clone(), needed };
        let mut planes = Vec::new();
        let mut sides = Vec::new();
        match (at, between) {
            (Some(at), Some(between)) => {
                if parts.len() != 2 || parts.iter().any(|part| part.at.is_some()) {
                    return Err(wrong("a split at one plane is into two parts without planes of their own"));
                }
                planes.push(self.plane_across(name, of, at)?);
                let between = between.half_space(name, &self.axis(name, of)?, &self.place)?;
                sides.extend([between, between.opposite()]);
            }
            (None, None) if parts.len() >= 2 => {
                for part in parts {
                    let at = part.at.as_ref().ok_or_else(|| wrong("each part of the split needs a plane, at"))?;
                    planes.push(self.plane_across(&part.name, of, at)?);
                }
            }
            _ => return Err(wrong("a split needs at and between, or an at in each of two parts or more")),
        }
        let mut description = self.camera.description().clone();
        limits_of(&mut description, of).extend(&planes);
        let mut beginnings = Vec::new();
        for (index, part) in parts.iter().enumerate() {
            let plane = planes.get(index).unwrap_or(&planes[0]);
            let others = planes.iter().filter(|other| *other != plane);
            let within: Vec<HalfSpace> = sides.get(index).into_iter().chain(others).copied().collect();
            beginnings.push(Beginning { part, faces: self.faces(&part.name, of, plane, &within)? });
        }
        self.add(description, beginnings)
    }

    fn axis(&self, name: &str, of: &str) -> Result<Axis, WrittenError> {
        let found = self.axes.iter().find(|(known, _)| known == of).map(|(_, axis)| *axis);
        found.ok_or_else(|| WrittenError::Unknown { name: name.to_owned(), of: of.to_owned() })
    }

    /// A plane that ends a frustum: it holds where the frustum's axis begins.
    fn plane_across(&self, name: &str, of: &str, plane: &WrittenPlane) -> Result<HalfSpace, WrittenError> {
        let axis = self.axis(name, of)?;
        if self.ended.iter().any(|ended| ended == of) {
            return Err(WrittenError::EndsTwice { name: name.to_owned(), of: of.to_owned() });
        }
        plane.holding(axis.from, name, &axis, &self.place)
    }

    /// Where a plane cuts a frustum, as far as it lies in other half-spaces: a face for each of the frustum's own.
    fn faces(
        &self,
        name: &str,
        of: &str,
        plane: &HalfSpace,
        within: &[HalfSpace],
    ) -> Result<Vec<FaceDescription>, WrittenError> {
        let cut = |frustum: &Frustum| {
            let corners = cross_section(frustum, plane, within);
            (!corners.is_empty()).then(|| FaceDescription { parent: of.to_owned(), corners })
        };
        let frusta = self.camera.frusta().iter().filter(|frustum| frustum.name() == of);
        let faces: Vec<FaceDescription> = frusta.filter_map(cut).collect();
        let no_face = || WrittenError::NoFace { name: name.to_owned(), of: of.to_owned() };
        if faces.is_empty() { Err(no_face()) } else { Ok(faces) }
    }

    /// Adds what begins, once all planes that end its parents are there.
    fn add(&mut self, mut description: GraphDescription, beginnings: Vec<Beginning<'_>>) -> Result<(), WrittenError> {
        let frusta: usize = beginnings.iter().map(|beginning| beginning.faces.len()).sum();
        if self.camera.frusta().len() + frusta > WrittenGraph::MAX_FRUSTA {
            let name = beginnings.first().map_or_else(String::new, |beginning| beginning.part.name.clone());
            return Err(WrittenError::TooMany { name, most: WrittenGraph::MAX_FRUSTA, what: "frusta" });
        }
        let mut ended = Vec::new();
        for Beginning { part, faces } in beginnings {
            ended.extend(faces.iter().map(|face| face.parent.clone()));
            let middle = middle(&faces);
            let centre = self.centre(part, middle, &faces)?;
            let along = (middle - centre).try_normalize().ok_or_else(|| no_way(&part.name))?;
            let axis = Axis { from: middle, along };
            let limits = limits(&part.name, part.depth_m, &part.limits, &axis, &self.place)?;
            description.frusta.push(FrustumDescription { name: part.name.clone(), centre, faces, limits });
            self.axes.push((part.name.clone(), axis));
        }
        self.ended.extend(ended);
        self.camera = GraphCamera::from_description(&description)?;
        Ok(())
    }

    fn centre(&self, part: &Part, middle: DVec3, faces: &[FaceDescription]) -> Result<DVec3, WrittenError> {
        match (part.centre, part.direction) {
            (Some(centre), None) => Ok(self.place.transform_point(centre)),
            (None, Some(direction)) => {
                let along = self.place.transform_vector(direction).try_normalize().ok_or_else(|| no_way(&part.name))?;
                let is_before = |frustum: &&Frustum| faces.iter().any(|face| face.parent == frustum.name());
                let before = self.camera.frusta().iter().filter(is_before);
                let distances: Vec<f64> = before.map(|frustum| frustum.centre_world().distance(middle)).collect();
                Ok(middle - along * (distances.iter().sum::<f64>() / distances.len() as f64))
            }
            _ => Err(WrittenError::OneOf { name: part.name.clone(), one: "direction", other: "centre" }),
        }
    }
}

fn no_way(name: &str) -> WrittenError {
    let (what, needed) = ("direction and centre", "finite, and lead away from before its plane");
    WrittenError::Number { name: name.to_owned(), what, needed }
}

fn limits(
    name: &str,
    depth_m: f64,
    written: &[WrittenPlane],
    axis: &Axis,
    place: &Rigid,
) -> Result<Vec<HalfSpace>, WrittenError> {
    if !(depth_m > 0.0 && depth_m.is_finite()) {
        return Err(WrittenError::Number { name: name.to_owned(), what: "depth_m", needed: "more than 0" });
    }
    let end = HalfSpace { point: axis.from + axis.along * depth_m, outward: axis.along };
    let others = written.iter().map(|plane| plane.half_space(name, axis, place));
    std::iter::once(Ok(end)).chain(others).collect()
}

fn limits_of<'a>(description: &'a mut GraphDescription, name: &str) -> &'a mut Vec<HalfSpace> {
    match description.frusta.iter_mut().find(|frustum| frustum.name == name) {
        Some(frustum) => &mut frustum.limits,
        None => &mut description.root.limits,
    }
}

/// The mean of the faces' corners.
fn middle(faces: &[FaceDescription]) -> DVec3 {
    let corners: Vec<DVec3> = faces.iter().flat_map(|face| face.corners.iter().copied()).collect();
    corners.iter().sum::<DVec3>() / corners.len() as f64
}

/// The polygon in which a plane cuts a frustum, as far as it lies in other half-spaces; empty where there is none.
fn cross_section(frustum: &Frustum, plane: &HalfSpace, within: &[HalfSpace]) -> Vec<DVec3> {
    let bounds = frustum.bounds_world();
    // Around the whole frustum from wherever on the plane is nearest to its middle.
    let (middle, reach_m) = (bounds.middle(), (bounds.max - bounds.min).length());
    let on_plane = middle + plane.outward * plane.depth_m(middle);
    let (right, up) = plane.outward.any_orthonormal_pair();
    let square = [right + up, up - right, -right - up, right - up].map(|corner| on_plane + corner * reach_m);
    // A limit on the very plane ends the frustum there too, and by rounding might leave nothing.
    let is_across =
        |side: &&HalfSpace| square.iter().any(|&corner| side.depth_m(corner).abs() > TOLERANCE * bounds.extent_m());
    let sides = frustum.half_spaces_world().iter().chain(within).filter(is_across);
    let polygon = sides.fold(square.to_vec(), |polygon, side| clip(&polygon, side));
    let Some(extent_m) = Bounds::around(polygon.iter().copied()).map(|bounds| bounds.extent_m()) else {
        return Vec::new();
    };
    let polygon = without_short_edges(&polygon, TOLERANCE * extent_m);
    if area_m2(&polygon).length() > TOLERANCE * extent_m.powi(2) { polygon } else { Vec::new() }
}
