//! A patch's surface as plain values, before a GPU has it. To build one takes a microsecond a sample, so it is done beside drawing where there is a thread or a worker
//! for it, and what comes out is the same there: [`Built`] is uploaded piece by piece ([`BuiltSurfaces::upload`]) and taken in as it is, or not at all.

mod bytes;
mod source;
#[cfg(test)]
mod tests;
mod upload;

use std::collections::BTreeMap;

use bytemuck::{Pod, Zeroable};
use camera::{Bounds, Pinhole};
use glam::DVec3;
use gpu::Gpu;
use protocol::{Edit, Patch, PatchId, Purpose, Update};

use crate::corners::{CornerRules, Corners};
use crate::levels::Parts;
use crate::mesh::{self, MeshOptions, PatchMesh, ProvokingVertex, QUAD_INDICES, Vertex};

pub use bytes::DamagedSurface;
pub use source::FarBytes;
use source::Source;
use upload::Upload;
pub(crate) use upload::with_room;

/// Bytes that are uploaded at a time: a millisecond's work, about.
const PIECE_BYTES: usize = 1 << 20;

/// How surfaces are built that a GPU will draw: all else follows from what their patches are for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Build {
    /// Where corners come from; no offset image is at hand.
    pub corners: Corners,
    /// From which vertex the GPU takes flat values.
    pub provoking: ProvokingVertex,
}

impl Build {
    const CORNERS: [Corners; 3] = [Corners::Averaged, Corners::OffsetImage, Corners::OwnPlane];

    /// As a byte, which is never 0.
    pub fn code(self) -> u8 {
        let corners = Build::CORNERS.iter().position(|&corners| corners == self.corners).unwrap_or_default();
        1 + 2 * corners as u8 + u8::from(self.provoking == ProvokingVertex::Last)
    }

    /// The one of a code.
    pub fn from_code(code: u8) -> Option<Build> {
        let code = code.checked_sub(1)?;
        let corners = *Build::CORNERS.get(usize::from(code / 2))?;
        let provoking = if code % 2 == 0 { ProvokingVertex::First } else { ProvokingVertex::Last };
        Some(Build { corners, provoking })
    }

    /// The surfaces of the patches that an update adds, one by one.
    pub fn surfaces(self, update: &Update) -> impl Iterator<Item = Built> {
        let added = update.edits.iter().filter_map(|edit| if let Edit::Add(patch) = edit { Some(patch) } else { None });
        added.filter(|patch| patch.purpose.is_surface()).map(move |patch| self.surface(patch))
    }

    fn surface(self, patch: &Patch) -> Built {
        let Build { corners, provoking } = self;
        let rules = CornerRules::of(patch.purpose);
        let options = MeshOptions { corners, rules, provoking, exact_w: None, offset_image: None };
        Built::of(patch, mesh::build_trimmed(patch, &[], &options), self, coarsens(patch.purpose))
    }
}

/// Whether surfaces for a purpose have quads of several samples, unless who draws them asks for single ones.
pub(crate) fn coarsens(purpose: Purpose) -> bool {
    purpose == Purpose::Eye
}

/// What is known of a surface without its quads.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub(crate) struct Head {
    /// A ball around all corners, in the patch's eye space at capture: its centre, and its radius in metres.
    pub ball_centre_eye: DVec3,
    pub ball_radius_m: f64,
    /// Around all corners at capture.
    low_world: DVec3,
    high_world: DVec3,
    /// A bit a code of a material that it has.
    materials: [u64; 4],
    /// See [`PatchId`].
    patch: u32,
    /// Of samples.
    pub quads: u32,
    /// Their corners.
    pub corners: u32,
    /// See [`PatchMesh::guarded`].
    pub guarded: u32,
}

impl Head {
    /// Of a mesh that has no quads of several samples yet.
    pub fn of(patch: &Patch, mesh: &PatchMesh) -> Head {
        // Without a mesh, images of other cameras have no surface.
        let camera = patch.image.camera.root();
        let (low, high) = box_around(mesh.vertices.iter().map(|vertex| corner_eye(camera, vertex)));
        let Bounds { min, max } = bounds_world(camera, &mesh.vertices);
        let mut materials = [0; 4];
        patch.image.material.iter().for_each(|&code| materials[usize::from(code / 64)] |= 1 << (code % 64));
        Head {
            ball_centre_eye: (low + high) / 2.0,
            ball_radius_m: high.distance(low) / 2.0,
            low_world: min,
            high_world: max,
            materials,
            patch: patch.id.0,
            quads: (mesh.indices.len() / QUAD_INDICES) as u32,
            corners: mesh.vertices.len() as u32,
            guarded: mesh.guarded as u32,
        }
    }

    pub fn bounds_world(&self) -> Bounds {
        Bounds { min: self.low_world, max: self.high_world }
    }

    /// The codes of its materials, ascending.
    pub fn materials(&self) -> Vec<u8> {
        let is_there = |code: &u8| self.materials[usize::from(code / 64)] >> (code % 64) & 1 == 1;
        (0..=u8::MAX).filter(is_there).collect()
    }
}

pub(crate) fn bounds_world(camera: &Pinhole, vertices: &[Vertex]) -> Bounds {
    let world_from_eye = camera.world_from_eye.to_affine();
    let corners = vertices.iter().map(|vertex| world_from_eye.transform_point3(corner_eye(camera, vertex)));
    let (min, max) = box_around(corners);
    Bounds { min, max }
}

pub(crate) fn corner_eye(camera: &Pinhole, vertex: &Vertex) -> DVec3 {
    camera.ray_eye_from_image(vertex.u_px.into(), vertex.v_px.into()) / f64::from(vertex.w)
}

fn box_around(points: impl Iterator<Item = DVec3>) -> (DVec3, DVec3) {
    points.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), p| (low.min(p), high.max(p)))
}

/// A patch's surface: see the module.
#[derive(Debug)]
pub struct Built {
    build: Build,
    pub(crate) head: Head,
    parts: Parts,
    source: Source,
    upload: Option<Upload>,
}

impl Built {
    /// Of a patch's mesh.
    pub(crate) fn of(patch: &Patch, mut mesh: PatchMesh, build: Build, coarsens: bool) -> Built {
        let head = Head::of(patch, &mesh);
        let camera = patch.image.camera.root();
        let parts = Parts::of(&mut mesh, &patch.image.mask, (camera, build.provoking, coarsens));
        Built { build, head, parts, source: Source::Mesh(mesh), upload: None }
    }

    /// Whether it was built of all of a patch, and so.
    pub(crate) fn is_of(&self, patch: &Patch, build: Build) -> bool {
        self.build == build && self.head.quads as usize == patch.image.sample_count()
    }

    /// Whether there is nothing to draw.
    pub(crate) fn is_empty(&self) -> bool {
        self.head.quads == 0
    }

    /// Uploads so many bytes more at most; whether all are there.
    fn upload(&mut self, gpu: &Gpu, most_bytes: &mut usize) -> bool {
        if self.is_empty() {
            return true;
        }
        let upload = self.upload.get_or_insert_with(|| Upload::new(gpu, &self.source));
        upload.write(gpu, &self.source, most_bytes)
    }

    /// Its parts, and the buffers of its vertices and indices.
    pub(crate) fn into_buffers(self, gpu: &Gpu) -> (Parts, [wgpu::Buffer; 2]) {
        let mut upload = self.upload.unwrap_or_else(|| Upload::new(gpu, &self.source));
        let mut most_bytes = usize::MAX;
        upload.write(gpu, &self.source, &mut most_bytes);
        (self.parts, upload.into_buffers())
    }
}

/// The surfaces of patches that one update adds.
#[derive(Debug, Default)]
pub struct BuiltSurfaces(BTreeMap<PatchId, Built>);

impl FromIterator<Built> for BuiltSurfaces {
    fn from_iter<I: IntoIterator<Item = Built>>(built: I) -> BuiltSurfaces {
        BuiltSurfaces(built.into_iter().map(|built| (PatchId(built.head.patch), built)).collect())
    }
}

impl BuiltSurfaces {
    /// How many there are.
    pub fn len(&self) -> usize {
        self.0.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Uploads a piece more; whether all pieces of all of them are there.
    pub fn upload(&mut self, gpu: &Gpu) -> bool {
        let mut most_bytes = PIECE_BYTES;
        self.0.values_mut().all(|built| built.upload(gpu, &mut most_bytes))
    }

    /// Begins anew, as the GPU was lost.
    pub fn forget_uploads(&mut self) {
        self.0.values_mut().for_each(|built| built.upload = None);
    }

    /// The surface of a patch.
    pub(crate) fn take(&mut self, patch: PatchId) -> Option<Built> {
        self.0.remove(&patch)
    }
}
