//! One patch as it is drawn: its quads, where they are drawn from, and what is around them.

use bytemuck::Zeroable;
use camera::{Bounds as WorldBounds, HalfSpace, Pinhole};
use glam::DVec3;
use gpu::Gpu;
use protocol::held::HeldPatch;
use protocol::image::Ranks;
use protocol::{DepthImage, Mask, ObjectPose};
use wgpu::util::DeviceExt;

use crate::levels::Parts;
use crate::mesh::{PatchMesh, ProvokingVertex, QUAD_INDICES, Vertex};
use crate::redraw::{CORNERS, Redrawn};
use crate::tiles::{Bounds, Tiles};

/// What is held for drawing.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct SurfaceStats {
    /// Quads of samples.
    pub samples: usize,
    /// Their corners.
    pub vertices: usize,
    /// Samples whose normal gives no usable plane, see [`PatchMesh::guarded`].
    pub guarded: usize,
    /// Memory of the meshes.
    pub bytes: u64,
}

/// How a patch's quads are made.
#[derive(Debug, Clone, Copy)]
pub(crate) struct QuadOptions {
    /// Which vertex bears what is flat.
    pub provoking: ProvokingVertex,
    /// Whether there are quads of several samples.
    pub coarsens: bool,
    /// Corners that can be added.
    pub room: usize,
}

#[derive(Debug)]
pub(crate) struct PatchSurface {
    pub(crate) camera: Pinhole,
    /// The moving objects at capture.
    pub(crate) objects: Vec<ObjectPose>,
    pub(crate) quads: QuadBuffers,
    /// The codes of its materials, ascending.
    pub(crate) materials: Vec<u8>,
    /// Which samples were built, and their places in `indices`.
    built: Mask,
    ranks: Ranks,
    /// A ball around all corners, in the patch's eye space at capture: its centre, and its radius in metres.
    ball_eye: (DVec3, f64),
    /// Around all corners at capture.
    pub(crate) bounds_world: WorldBounds,
    pub(crate) stats: SurfaceStats,
    /// Corners that can be added: on the GPU the last ones of its buffer.
    pub(crate) room: usize,
}

/// The mesh of a patch, where it is drawn from.
#[derive(Debug)]
pub(crate) enum QuadBuffers {
    Gpu {
        vertices: wgpu::Buffer,
        indices: wgpu::Buffer,
        /// Of the quads of samples; those of further levels are behind them.
        index_count: u32,
        parts: Parts,
    },
    Host {
        mesh: PatchMesh,
        #[cfg_attr(target_arch = "wasm32", expect(dead_code, reason = "only servers draw on the host"))]
        tiles: Tiles,
    },
}

impl QuadBuffers {
    fn new(
        gpu: Option<&Gpu>,
        (mask, camera): (&Mask, &Pinhole),
        mut mesh: PatchMesh,
        QuadOptions { provoking, coarsens, room }: QuadOptions,
    ) -> QuadBuffers {
        let Some(gpu) = gpu else {
            let tiles = Tiles::new(mask, |sample| bounds(&mesh, sample));
            return QuadBuffers::Host { mesh, tiles };
        };
        let index_count = mesh.indices.len() as u32;
        let parts = Parts::of(&mut mesh, mask, (camera, provoking, coarsens));
        let buffer = |label, contents, usage| {
            gpu.device.create_buffer_init(&wgpu::util::BufferInitDescriptor { label: Some(label), contents, usage })
        };
        // Compute shaders read them too: see [`crate::FlattenPass`].
        let read = if gpu.caps.compute { wgpu::BufferUsages::STORAGE } else { wgpu::BufferUsages::empty() };
        let changing = wgpu::BufferUsages::INDEX | wgpu::BufferUsages::COPY_DST | read;
        mesh.vertices.resize(mesh.vertices.len() + room, Vertex::zeroed());
        let corners = wgpu::BufferUsages::VERTEX | wgpu::BufferUsages::COPY_DST | read;
        QuadBuffers::Gpu {
            vertices: buffer("corners", bytemuck::cast_slice(&mesh.vertices), corners),
            indices: buffer("quads", bytemuck::cast_slice(&mesh.indices), changing),
            index_count,
            parts,
        }
    }
}

impl QuadBuffers {
    /// Memory of vertices and indices, of all levels.
    fn bytes(&self) -> u64 {
        match self {
            QuadBuffers::Gpu { vertices, indices, .. } => vertices.size() + indices.size(),
            QuadBuffers::Host { mesh, .. } => (size_of_val(&*mesh.vertices) + size_of_val(&*mesh.indices)) as u64,
        }
    }
}

/// Of a sample's quad.
fn bounds(mesh: &PatchMesh, sample: usize) -> Bounds {
    let corners = &mesh.indices[sample * QUAD_INDICES..(sample + 1) * QUAD_INDICES];
    Bounds::around(corners.iter().map(|&index| mesh.vertices[index as usize].image()))
}

/// The codes of an image's materials, ascending.
fn materials_in(image: &DepthImage) -> Vec<u8> {
    let mut seen = [false; 256];
    image.material.iter().for_each(|&code| seen[usize::from(code)] = true);
    (0..=u8::MAX).filter(|&code| seen[usize::from(code)]).collect()
}

/// A ball around corners: around the middle of their box.
fn ball_eye(camera: &Pinhole, vertices: &[Vertex]) -> (DVec3, f64) {
    let (low, high) = box_around(vertices.iter().map(|vertex| corner_eye(camera, vertex)));
    let centre = (low + high) / 2.0;
    (centre, high.distance(low) / 2.0)
}

fn bounds_world(camera: &Pinhole, vertices: &[Vertex]) -> WorldBounds {
    let world_from_eye = camera.world_from_eye.to_affine();
    let corners = vertices.iter().map(|vertex| world_from_eye.transform_point3(corner_eye(camera, vertex)));
    let (min, max) = box_around(corners);
    WorldBounds { min, max }
}

fn corner_eye(camera: &Pinhole, vertex: &Vertex) -> DVec3 {
    camera.ray_eye_from_image(vertex.u_px.into(), vertex.v_px.into()) / f64::from(vertex.w)
}

fn box_around(points: impl Iterator<Item = DVec3>) -> (DVec3, DVec3) {
    points.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), p| (low.min(p), high.max(p)))
}

impl PatchSurface {
    pub(crate) fn new(gpu: Option<&Gpu>, held: &HeldPatch, mesh: PatchMesh, options: QuadOptions) -> PatchSurface {
        // Without a mesh, images of other cameras have no surface.
        let camera = *held.patch.image.camera.root();
        let stats = SurfaceStats {
            samples: mesh.indices.len() / QUAD_INDICES,
            vertices: mesh.vertices.len(),
            guarded: mesh.guarded,
            bytes: 0,
        };
        let bounds = (ball_eye(&camera, &mesh.vertices), bounds_world(&camera, &mesh.vertices));
        let quads = QuadBuffers::new(gpu, (&held.patch.image.mask, &camera), mesh, options);
        PatchSurface {
            camera,
            objects: held.patch.objects.clone(),
            ranks: Ranks::new(&held.patch.image.mask),
            built: held.patch.image.mask.clone(),
            ball_eye: bounds.0,
            bounds_world: bounds.1,
            materials: materials_in(&held.patch.image),
            stats: SurfaceStats { bytes: quads.bytes(), ..stats },
            quads,
            room: options.room,
        }
    }

    /// Gives samples other quads, each with corners of its own, for which there must be room.
    pub(crate) fn redraw(&mut self, gpu: Option<&Gpu>, redrawn: &[Redrawn], provoking: ProvokingVertex) {
        let corners: Vec<Vertex> = redrawn.iter().flat_map(|redrawn| redrawn.corners).collect();
        let first = match &self.quads {
            QuadBuffers::Gpu { vertices, .. } => vertices.size() as usize / size_of::<Vertex>() - self.room,
            QuadBuffers::Host { mesh, .. } => mesh.vertices.len(),
        };
        self.room -= corners.len();
        let quads = redrawn.iter().zip((first as u32..).step_by(CORNERS)).filter_map(|(redrawn, first)| {
            let (x, y) = redrawn.pixel;
            let quad = provoking.indices([first, first + 1, first + 2, first + 3]);
            Some((self.ranks.of(&self.built, x, y)?, redrawn.corners.map(|corner| corner.image()), quad))
        });
        match (&mut self.quads, gpu) {
            (QuadBuffers::Gpu { vertices, indices, parts, .. }, Some(gpu)) => {
                let placed = |(sample, corners, quad)| Some((parts.redraw(sample, corners, &self.camera)?, quad));
                let mut quads: Vec<(u32, [u32; QUAD_INDICES])> = quads.filter_map(placed).collect();
                quads.sort_unstable_by_key(|(place, _)| *place);
                for run in quads.chunk_by(|a, b| a.0 + 1 == b.0) {
                    let at = (run[0].0 as usize * size_of::<[u32; QUAD_INDICES]>()) as u64;
                    let run: Vec<u32> = run.iter().flat_map(|(_, quad)| *quad).collect();
                    gpu.queue.write_buffer(indices, at, bytemuck::cast_slice(&run));
                }
                gpu.queue.write_buffer(vertices, (first * size_of::<Vertex>()) as u64, bytemuck::cast_slice(&corners));
            }
            (QuadBuffers::Host { mesh, .. }, _) => {
                for (sample, _, quad) in quads {
                    mesh.indices[sample * QUAD_INDICES..][..QUAD_INDICES].copy_from_slice(&quad);
                }
                mesh.vertices.extend(&corners);
            }
            (QuadBuffers::Gpu { .. }, None) => {}
        }
        // Trimmed quads shrink, but a corner that a sample shared with one deleted since lies elsewhere.
        let (centre, radius_m) = self.ball_eye;
        let farthest_m = corners.iter().map(|corner| corner_eye(&self.camera, corner).distance(centre));
        self.ball_eye.1 = farthest_m.fold(radius_m, f64::max);
        self.bounds_world = self.bounds_world.union(bounds_world(&self.camera, &corners));
    }

    /// Makes the triangles of samples empty.
    pub(crate) fn delete(&mut self, gpu: Option<&Gpu>, pixels: &[(u16, u16)]) {
        let ranks = pixels.iter().filter_map(|&(x, y)| self.ranks.of(&self.built, x, y));
        match (&mut self.quads, gpu) {
            (QuadBuffers::Gpu { indices, parts, .. }, Some(gpu)) => {
                for run in parts.delete(ranks).chunk_by(|a, b| a + 1 == *b) {
                    let nothing = vec![0_u32; run.len() * QUAD_INDICES];
                    let at = (run[0] as usize * QUAD_INDICES * size_of::<u32>()) as u64;
                    gpu.queue.write_buffer(indices, at, bytemuck::cast_slice(&nothing));
                }
            }
            (QuadBuffers::Host { mesh, .. }, _) => {
                ranks.for_each(|rank| mesh.indices[rank * QUAD_INDICES..][..QUAD_INDICES].fill(0));
            }
            (QuadBuffers::Gpu { .. }, None) => {}
        }
    }

    /// How far aside of where the patch was captured an eye is, as a share of its distance from what the patch shows: the tangent of the angle between
    /// both looks, about.
    pub(crate) fn aside_of(&self, eye_world: DVec3) -> f64 {
        let (centre_eye, radius_m) = self.ball_eye;
        let centre_world = self.camera.world_from_eye.transform_point(centre_eye);
        let distance_m = eye_world.distance(centre_world).max(radius_m);
        eye_world.distance(self.camera.world_from_eye.translation) / distance_m
    }

    /// Whether `view` may see any of it: whether its ball reaches into the view's pyramid. A patch with moving objects always
    /// may.
    pub(crate) fn may_be_seen_from(&self, view: &Pinhole) -> bool {
        let (centre, radius_m) = self.ball_eye;
        if !self.objects.is_empty() || !radius_m.is_finite() {
            return true;
        }
        let eye_from_patch = view.world_from_eye.inverse() * self.camera.world_from_eye;
        view.may_see_ball(eye_from_patch.transform_point(centre), radius_m)
    }

    /// Whether any of it may lie inside of all of some half-spaces. A patch with moving objects always may.
    pub(crate) fn may_reach_into(&self, half_spaces: &[HalfSpace]) -> bool {
        let (centre, radius_m) = self.ball_eye;
        if !self.objects.is_empty() || !radius_m.is_finite() {
            return true;
        }
        let centre_world = self.camera.world_from_eye.transform_point(centre);
        half_spaces.iter().all(|half_space| half_space.depth_m(centre_world) >= -radius_m)
    }
}
