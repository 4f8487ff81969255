//! From a description to a camera: frusta in the order of their parents, each with its matrix, each checked.

use std::collections::{HashMap, HashSet};

use glam::{DMat3, DVec2, DVec3};

use super::frustum::image_from_offset;
use super::{
    FaceDescription, Frustum, FrustumDescription, FrustumId, GraphCamera, GraphDescription, GraphError, Index,
};
use crate::convex::{TOLERANCE, area_m2, clip, corners, edges, has_volume, without_short_edges};
use crate::{Bounds, HalfSpace, ImageBounds, Pinhole};

impl GraphCamera {
    /// Makes the camera of a description.
    ///
    /// Every face is cut along the frusta of its parent that it lies in, and becomes a frustum for each: a merge has one for
    /// each of its faces from the start, split by the plane through its centre and the seam between the faces, and
    /// what comes behind a merge is split where the seam crosses its face. So every frustum has one parent and one matrix,
    /// rays form a tree, and a merge's two halves connect by position, not by depth.
    ///
    /// # Errors
    /// [`GraphError`] says what is wrong, and at which frustum.
    pub fn from_description(description: &GraphDescription) -> Result<GraphCamera, GraphError> {
        check_planes_and_numbers(description)?;
        let order = parents_first(description)?;
        let mut composer = Composer::new(description)?;
        for frustum in order {
            for face in &frustum.faces {
                composer.add_face(frustum, face)?;
            }
        }
        let index = Index::new(&composer.frusta);
        check_disjoint(&composer.frusta, &index)?;
        Ok(GraphCamera::new(without_cut(description, &composer.frusta), composer.frusta, index))
    }
}

/// The description less what is too small in the image: it makes the same camera, and is short to send.
fn without_cut(description: &GraphDescription, made: &[Frustum]) -> GraphDescription {
    let names: HashSet<&str> = made.iter().map(|frustum| frustum.name.as_str()).collect();
    let mut kept = description.clone();
    kept.frusta.retain(|frustum| names.contains(frustum.name.as_str()));
    for frustum in &mut kept.frusta {
        frustum.faces.retain(|face| names.contains(face.parent.as_str()));
    }
    kept
}

impl TryFrom<GraphDescription> for GraphCamera {
    type Error = GraphError;

    fn try_from(description: GraphDescription) -> Result<GraphCamera, GraphError> {
        GraphCamera::from_description(&description)
    }
}

impl From<GraphCamera> for GraphDescription {
    fn from(camera: GraphCamera) -> GraphDescription {
        camera.description
    }
}

fn check_planes_and_numbers(description: &GraphDescription) -> Result<(), GraphError> {
    let root = &description.root;
    let number = |name: &str| GraphError::Number { name: name.to_owned() };
    let too_many = |name: &str| GraphError::TooMany { name: name.to_owned() };
    if !root.pinhole.is_valid() || description.min_face_px.is_nan() {
        return Err(number(&root.name));
    }
    let limits = |name: &str, limits: &[HalfSpace]| match limits {
        limits if limits.len() > GraphCamera::MAX_PLANES => Err(too_many(name)),
        limits if limits.iter().any(|limit| limit.normalized().is_none()) => Err(number(name)),
        _ => Ok(()),
    };
    limits(&root.name, &root.limits)?;
    for frustum in &description.frusta {
        let longest = frustum.faces.iter().map(|face| face.corners.len()).fold(frustum.faces.len(), usize::max);
        if longest > GraphCamera::MAX_PLANES {
            return Err(too_many(&frustum.name));
        }
        let mut points = frustum.faces.iter().flat_map(|face| &face.corners).chain([&frustum.centre]);
        if !points.all(|point| point.is_finite()) {
            return Err(number(&frustum.name));
        }
        limits(&frustum.name, &frustum.limits)?;
    }
    Ok(())
}

/// The frusta behind the root, each one after all of its parents.
fn parents_first(description: &GraphDescription) -> Result<Vec<&FrustumDescription>, GraphError> {
    let mut by_name = HashMap::new();
    for frustum in &description.frusta {
        if frustum.name == description.root.name || by_name.insert(frustum.name.as_str(), frustum).is_some() {
            return Err(GraphError::SameName { name: frustum.name.clone() });
        }
    }
    let mut children: HashMap<&str, Vec<&FrustumDescription>> = HashMap::new();
    let mut missing = HashMap::new();
    for frustum in &description.frusta {
        if frustum.faces.is_empty() {
            return Err(GraphError::NoFace { name: frustum.name.clone() });
        }
        missing.insert(frustum.name.as_str(), frustum.faces.len());
        for FaceDescription { parent, .. } in &frustum.faces {
            if *parent != description.root.name && !by_name.contains_key(parent.as_str()) {
                return Err(GraphError::UnknownParent { name: frustum.name.clone(), parent: parent.clone() });
            }
            children.entry(parent.as_str()).or_default().push(frustum);
        }
    }
    let mut order = Vec::with_capacity(description.frusta.len());
    let mut at = 0;
    let mut parent = description.root.name.as_str();
    loop {
        for child in children.get(parent).into_iter().flatten() {
            let left = missing.entry(child.name.as_str()).or_default();
            *left -= 1;
            if *left == 0 {
                order.push(*child);
            }
        }
        let Some(next) = order.get(at) else { break };
        parent = next.name.as_str();
        at += 1;
    }
    // Who waits for a parent that waits leads, parent by parent, into a cycle.
    let waits = |name: &str| missing.get(name).is_some_and(|left| *left > 0);
    let Some(mut stuck) = description.frusta.iter().find(|frustum| waits(&frustum.name)) else { return Ok(order) };
    let mut seen = HashSet::new();
    while seen.insert(stuck.name.as_str()) {
        let waited_for = stuck.faces.iter().find(|face| waits(&face.parent));
        stuck = waited_for.map(|face| by_name[face.parent.as_str()]).expect("it waits for a parent");
    }
    Err(GraphError::Cycle { name: stuck.name.clone() })
}

/// The frusta made so far, and what the faces to come ask of them.
struct Composer<'a> {
    description: &'a GraphDescription,
    frusta: Vec<Frustum>,
    made_of: HashMap<&'a str, Vec<FrustumId>>,
    /// Frusta of which a part or all was too small in the image.
    cut_short: HashSet<&'a str>,
}

impl<'a> Composer<'a> {
    fn new(description: &'a GraphDescription) -> Result<Composer<'a>, GraphError> {
        let root = &description.root;
        let pinhole = &root.pinhole;
        let forward = pinhole.world_from_eye.transform_vector(DVec3::Z);
        let (width_px, height_px) = (f64::from(pinhole.width_px), f64::from(pinhole.height_px));
        let rectangle = [(0.0, 0.0), (width_px, 0.0), (width_px, height_px), (0.0, height_px)];
        let on_near_plane = |(u, v)| pinhole.ray_eye_from_image(u, v) * pinhole.near_m;
        let near = pinhole.world_from_eye.transform_point(DVec3::new(0.0, 0.0, pinhole.near_m));
        let eye_from_offset = DMat3::from_quat(pinhole.world_from_eye.rotation.conjugate());
        let mut composer =
            Composer { description, frusta: Vec::new(), made_of: HashMap::new(), cut_short: HashSet::new() };
        let shape = Shape {
            name: &root.name,
            centre: pinhole.world_from_eye.translation,
            face: rectangle.map(|corner| pinhole.world_from_eye.transform_point(on_near_plane(corner))).to_vec(),
            plane: HalfSpace { point: near, outward: -forward },
            limits: &root.limits,
        };
        let matrices = Matrices {
            image_from_offset: image_from_eye(pinhole) * eye_from_offset,
            offset_from_image: eye_from_offset.transpose() * eye_from_image(pinhole),
        };
        composer.add(shape, matrices, None)?;
        Ok(composer)
    }

    /// Makes the frusta behind a face: one for each frustum of the parent that it lies on.
    fn add_face(&mut self, frustum: &'a FrustumDescription, face: &'a FaceDescription) -> Result<(), GraphError> {
        let (name, parent) = (frustum.name.as_str(), face.parent.as_str());
        let gap = || GraphError::Gap { name: name.to_owned(), parent: parent.to_owned() };
        let parents = self.made_of.get(parent).cloned().unwrap_or_default();
        if self.cut_short.contains(parent) {
            self.cut_short.insert(name);
        }
        let Some(&first) = parents.first() else { return Ok(()) };
        let extent_m = Bounds::around(face.corners.iter().copied()).ok_or_else(gap)?.extent_m();
        let on_plane =
            |limit: &&HalfSpace| face.corners.iter().all(|&p| limit.depth_m(p).abs() <= TOLERANCE * extent_m);
        let limit = *self.frusta[first.place()].sides_and_limits().1.iter().find(on_plane).ok_or_else(gap)?;
        let corners = convex_polygon(&face.corners, &limit, extent_m)
            .ok_or_else(|| GraphError::Face { name: name.to_owned(), parent: parent.to_owned() })?;
        if limit.depth_m(frustum.centre) <= TOLERANCE * extent_m {
            return Err(GraphError::WrongSide { name: name.to_owned(), parent: parent.to_owned() });
        }
        let mut missing_m2 = area_m2(&corners).length();
        for parent in parents {
            let around = &self.frusta[parent.place()].half_spaces;
            let others = around.iter().filter(|half_space| **half_space != limit);
            let part = others.fold(corners.clone(), |part, half_space| clip(&part, half_space));
            let part = without_short_edges(&part, TOLERANCE * extent_m);
            let part_m2 = area_m2(&part).length();
            missing_m2 -= part_m2;
            if part_m2 <= TOLERANCE * extent_m.powi(2) {
                continue;
            }
            let shape =
                Shape { name, centre: frustum.centre, face: part, plane: limit.opposite(), limits: &frustum.limits };
            let matrices = self.frusta[parent.place()].bent(frustum.centre, &limit);
            self.add(shape, matrices, Some(parent))?;
        }
        // A strip as wide as faces may miss each other by, along four sides.
        let is_covered = missing_m2 <= 4.0 * TOLERANCE * extent_m.powi(2);
        if is_covered || self.cut_short.contains(parent) { Ok(()) } else { Err(gap()) }
    }

    /// Adds one frustum, unless its face is too small in the image.
    fn add(&mut self, shape: Shape<'a>, matrices: Matrices, parent: Option<FrustumId>) -> Result<(), GraphError> {
        let name = shape.name;
        let number = || GraphError::Number { name: name.to_owned() };
        if !(matrices.image_from_offset.is_finite() && matrices.offset_from_image.is_finite()) {
            return Err(number());
        }
        let (face, half_spaces) = shape.enclose()?;
        let corners = corners(&half_spaces);
        let bounds = Bounds::around(corners.iter().copied()).filter(|_| has_volume(&half_spaces, &corners));
        let bounds = bounds.ok_or_else(|| GraphError::NoVolume { name: name.to_owned() })?;
        let in_image = |corner: &DVec3| image_from_offset(&matrices.image_from_offset, *corner - shape.centre);
        let image = ImageBounds::around(corners.iter().filter_map(in_image)).ok_or_else(number)?;
        if parent.is_some() && (image.max_px - image.min_px).min_element() < self.description.min_face_px {
            self.cut_short.insert(name);
            return Ok(());
        }
        let id = FrustumId::new(self.frusta.len()).ok_or_else(|| GraphError::TooMany { name: name.to_owned() })?;
        self.frusta.push(Frustum {
            name: name.to_owned(),
            parent,
            children: Vec::new(),
            centre_world: shape.centre,
            image_from_offset: matrices.image_from_offset,
            offset_from_image: matrices.offset_from_image,
            face,
            half_spaces,
            corners,
            bounds,
            image,
        });
        if let Some(parent) = parent {
            self.frusta[parent.place()].children.push(id);
        }
        self.made_of.entry(name).or_default().push(id);
        Ok(())
    }
}

/// `H` of a frustum, and its inverse; composed apart, as inverting the product of a long chain would lose more.
struct Matrices {
    image_from_offset: DMat3,
    offset_from_image: DMat3,
}

impl Frustum {
    /// The matrices of a child with its centre at `centre` behind a face on `limit`, with the outward normal `n`:
    /// `H_child = H (I + d n^T/delta)` with `d = centre - centre_world`, where `delta` is the child's distance from the face.
    /// On the face both take a point to the same multiple of `(u, v, 1)`.
    fn bent(&self, centre: DVec3, limit: &HalfSpace) -> Matrices {
        let (shift, normal) = (centre - self.centre_world, limit.outward);
        let outer = DMat3::from_cols(shift * normal.x, shift * normal.y, shift * normal.z);
        // Not measured anew: both matrices must be inverse even far from the origin, where distances are rounded.
        let child_m = limit.depth_m(centre);
        let parent_m = child_m + normal.dot(shift);
        Matrices {
            image_from_offset: self.image_from_offset * (DMat3::IDENTITY + outer * child_m.recip()),
            offset_from_image: (DMat3::IDENTITY - outer * parent_m.recip()) * self.offset_from_image,
        }
    }
}

/// Takes `(x, y, z)` of eye space to `(u z, v z, z)`.
fn image_from_eye(pinhole: &Pinhole) -> DMat3 {
    let focal_px = pinhole.focal_px;
    DMat3::from_cols(DVec3::X * focal_px, DVec3::Y * focal_px, pinhole.centre_px.extend(1.0))
}

fn eye_from_image(pinhole: &Pinhole) -> DMat3 {
    let per_px = pinhole.focal_px.recip();
    let centre: DVec2 = -pinhole.centre_px * per_px;
    DMat3::from_cols(DVec3::X * per_px, DVec3::Y * per_px, centre.extend(1.0))
}

/// What a frustum is made from.
struct Shape<'a> {
    name: &'a str,
    centre: DVec3,
    /// Convex, counter-clockwise around the direction away from the centre.
    face: Vec<DVec3>,
    /// The face's plane; the frustum lies inside of it.
    plane: HalfSpace,
    limits: &'a [HalfSpace],
}

impl Shape<'_> {
    /// The face as far as it lies within the limits, and all planes of the frustum.
    fn enclose(&self) -> Result<(Vec<DVec3>, Vec<HalfSpace>), GraphError> {
        let no_volume = || GraphError::NoVolume { name: self.name.to_owned() };
        let limits: Vec<HalfSpace> = self.limits.iter().filter_map(HalfSpace::normalized).collect();
        let extent_m = Bounds::around(self.face.iter().copied()).ok_or_else(no_volume)?.extent_m();
        let face = limits.iter().fold(self.face.clone(), |face, limit| clip(&face, limit));
        let face = without_short_edges(&face, TOLERANCE * extent_m);
        if area_m2(&face).length() <= TOLERANCE * extent_m.powi(2) {
            return Err(no_volume());
        }
        if is_endless(&face, self.centre, &limits) {
            return Err(GraphError::Unbounded { name: self.name.to_owned() });
        }
        let side = |(a, b): (DVec3, DVec3)| {
            let outward = (b - self.centre).cross(a - self.centre).try_normalize()?;
            Some(HalfSpace { point: self.centre, outward })
        };
        let sides: Option<Vec<HalfSpace>> = edges(&face).map(side).collect();
        let half_spaces = [self.plane].into_iter().chain(sides.ok_or_else(no_volume)?).chain(limits).collect();
        Ok((face, half_spaces))
    }
}

/// Whether a ray from the centre through the face meets no limit: what is left of the face's directions inside of all limits
/// moved through the centre, which may be a single one.
fn is_endless(face: &[DVec3], centre: DVec3, limits: &[HalfSpace]) -> bool {
    let directions: Vec<DVec3> = face.iter().map(|corner| corner - centre).collect();
    let slack_m = TOLERANCE * directions.iter().map(|direction| direction.length()).fold(0.0, f64::max);
    let through_centre = |limit: &HalfSpace| HalfSpace { point: limit.outward * slack_m, outward: limit.outward };
    !limits.iter().fold(directions, |left, limit| clip(&left, &through_centre(limit))).is_empty()
}

/// A polygon put onto a plane, counter-clockwise around the plane's normal; `None` where it is not convex.
fn convex_polygon(corners: &[DVec3], plane: &HalfSpace, extent_m: f64) -> Option<Vec<DVec3>> {
    let on_plane = |corner: &DVec3| *corner + plane.outward * plane.depth_m(*corner);
    let mut polygon = without_short_edges(&corners.iter().map(on_plane).collect::<Vec<_>>(), TOLERANCE * extent_m);
    let area = area_m2(&polygon);
    if area.dot(plane.outward) < 0.0 {
        polygon.reverse();
    }
    let has_area = area.length() > TOLERANCE * extent_m.powi(2);
    // Every corner lies on the inner side of every edge; a star would pass by its corners alone.
    let is_inside = |(a, b): (DVec3, DVec3)| {
        let outward = (b - a).cross(plane.outward);
        let slack_m = TOLERANCE * extent_m * outward.length();
        polygon.iter().all(|&corner| HalfSpace { point: a, outward }.depth_m(corner) >= -slack_m)
    };
    (has_area && edges(&polygon).all(is_inside)).then_some(polygon)
}

fn check_disjoint(frusta: &[Frustum], index: &Index) -> Result<(), GraphError> {
    for (id, frustum) in FrustumId::all(frusta.len()).zip(frusta) {
        for other in index.meeting(frustum.bounds, 0.0).filter(|other| other.place() < id.place()) {
            let other = &frusta[other.place()];
            if is_beyond_a_plane(frustum, other) || is_beyond_a_plane(other, frustum) {
                continue;
            }
            let common: Vec<HalfSpace> = frustum.half_spaces.iter().chain(&other.half_spaces).copied().collect();
            if has_volume(&common, &corners(&common)) {
                return Err(GraphError::Overlap { name: frustum.name.clone(), other: other.name.clone() });
            }
        }
    }
    Ok(())
}

/// Whether one frustum lies outside of a plane of another: what all neighbours do that share a face or a side, and quickly
/// told.
fn is_beyond_a_plane(frustum: &Frustum, of: &Frustum) -> bool {
    of.half_spaces.iter().any(|half_space| frustum.corners.iter().all(|&corner| half_space.depth_m(corner) <= 0.0))
}
