//! One patch as it is drawn: its quads, where they are drawn from, and what is around them.

use camera::{Bounds as WorldBounds, HalfSpace, Pinhole};
use glam::DVec3;
use gpu::Gpu;
use protocol::image::Ranks;
use protocol::{Mask, ObjectPose, Patch};

use crate::built::{self, Built, Head, bounds_world, corner_eye};
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

#[derive(Debug)]
pub(crate) struct PatchSurface {
    pub(crate) camera: Pinhole,
    /// Scene time of the capture, in seconds.
    pub(crate) capture_time_s: f64,
    /// The moving objects at capture.
    pub(crate) objects: Vec<ObjectPose>,
    pub(crate) quads: QuadBuffers,
    /// The codes of its materials, ascending.
    pub(crate) materials: Vec<u8>,
    /// Which samples were built.
    built: Mask,
    /// A ball around all corners, in the patch's eye space at capture: its centre, and its radius in metres.
    ball_eye: (DVec3, f64),
    /// Around all corners at capture.
    pub(crate) bounds_world: WorldBounds,
    pub(crate) stats: SurfaceStats,
    /// Vertices of all levels as they were built, and those that were added behind them.
    built_vertices: usize,
    added_vertices: usize,
}

/// Room is made for further vertices by this part of those that were built at least.
const ROOM_SHARE: usize = 8;

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
        /// Of the samples that were built: their places in `mesh`.
        ranks: Ranks,
    },
}

impl QuadBuffers {
    /// Vertices of all levels.
    fn vertices(&self) -> usize {
        match self {
            QuadBuffers::Gpu { vertices, .. } => vertices.size() as usize / size_of::<Vertex>(),
            QuadBuffers::Host { mesh, .. } => mesh.vertices.len(),
        }
    }

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

impl PatchSurface {
    /// On a GPU.
    pub(crate) fn on_gpu(gpu: &Gpu, patch: &Patch, built: Built) -> PatchSurface {
        let (head, index_count) = (built.head, built.head.quads * QUAD_INDICES as u32);
        let (parts, [vertices, indices]) = built.into_buffers(gpu);
        PatchSurface::new(patch, &head, QuadBuffers::Gpu { vertices, indices, index_count, parts })
    }

    /// In the host's memory.
    pub(crate) fn on_host(patch: &Patch, mesh: PatchMesh) -> PatchSurface {
        let (head, mask) = (Head::of(patch, &mesh), &patch.image.mask);
        let tiles = Tiles::new(mask, |sample| bounds(&mesh, sample));
        PatchSurface::new(patch, &head, QuadBuffers::Host { mesh, tiles, ranks: Ranks::new(mask) })
    }

    fn new(patch: &Patch, head: &Head, quads: QuadBuffers) -> PatchSurface {
        PatchSurface {
            camera: *patch.image.camera.root(),
            capture_time_s: patch.capture_time_s,
            objects: patch.objects.clone(),
            built: patch.image.mask.clone(),
            ball_eye: (head.ball_centre_eye, head.ball_radius_m),
            bounds_world: head.bounds_world(),
            materials: head.materials(),
            stats: SurfaceStats {
                samples: head.quads as usize,
                vertices: head.corners as usize,
                guarded: head.guarded as usize,
                bytes: quads.bytes(),
            },
            built_vertices: quads.vertices(),
            added_vertices: 0,
            quads,
        }
    }

    /// Whether samples may be given other quads; where it has become too many, the patch is better built anew.
    pub(crate) fn may_redraw(&self, redrawn: &[Redrawn]) -> bool {
        self.added_vertices + redrawn.len() * CORNERS <= self.built_vertices
    }

    /// Gives samples other quads, each with corners of its own.
    pub(crate) fn redraw(&mut self, gpu: Option<&Gpu>, redrawn: &[Redrawn], provoking: ProvokingVertex) {
        let corners: Vec<Vertex> = redrawn.iter().flat_map(|redrawn| redrawn.corners).collect();
        let first = self.built_vertices + self.added_vertices;
        self.added_vertices += corners.len();
        let quads = redrawn.iter().zip((first as u32..).step_by(CORNERS)).map(|(redrawn, first)| {
            let quad = provoking.indices([first, first + 1, first + 2, first + 3]);
            (redrawn.pixel, redrawn.corners.map(|corner| corner.image()), quad)
        });
        match (&mut self.quads, gpu) {
            (QuadBuffers::Gpu { vertices, indices, parts, .. }, Some(gpu)) => {
                let placed =
                    |(pixel, corners, quad)| Some((parts.redraw(&self.built, pixel, corners, &self.camera)?, quad));
                let mut quads: Vec<(u32, [u32; QUAD_INDICES])> = quads.filter_map(placed).collect();
                quads.sort_unstable_by_key(|(place, _)| *place);
                for run in quads.chunk_by(|a, b| a.0 + 1 == b.0) {
                    let at = (run[0].0 as usize * size_of::<[u32; QUAD_INDICES]>()) as u64;
                    let run: Vec<u32> = run.iter().flat_map(|(_, quad)| *quad).collect();
                    gpu.queue.write_buffer(indices, at, bytemuck::cast_slice(&run));
                }
                if self.built_vertices + self.added_vertices > vertices.size() as usize / size_of::<Vertex>() {
                    let room = corners.len().max(self.built_vertices / ROOM_SHARE);
                    *vertices = built::with_room(gpu, vertices, first + room);
                }
                gpu.queue.write_buffer(vertices, (first * size_of::<Vertex>()) as u64, bytemuck::cast_slice(&corners));
            }
            (QuadBuffers::Host { mesh, ranks, .. }, _) => {
                for ((x, y), _, quad) in quads {
                    if let Some(sample) = ranks.of(&self.built, x, y) {
                        mesh.indices[sample * QUAD_INDICES..][..QUAD_INDICES].copy_from_slice(&quad);
                    }
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
        match (&mut self.quads, gpu) {
            (QuadBuffers::Gpu { indices, parts, .. }, Some(gpu)) => {
                for run in parts.delete(&self.built, pixels).chunk_by(|a, b| a + 1 == *b) {
                    let nothing = vec![0_u32; run.len() * QUAD_INDICES];
                    let at = (run[0] as usize * QUAD_INDICES * size_of::<u32>()) as u64;
                    gpu.queue.write_buffer(indices, at, bytemuck::cast_slice(&nothing));
                }
            }
            (QuadBuffers::Host { mesh, ranks, .. }, _) => {
                let ranks = pixels.iter().filter_map(|&(x, y)| ranks.of(&self.built, x, y));
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
