use std::collections::{BTreeMap, BTreeSet};
use std::sync::atomic::{AtomicU64, Ordering};

use bytemuck::Zeroable;
use camera::{Bounds as WorldBounds, HalfSpace, Pinhole};
use glam::{DAffine3, DVec3};
use gpu::Gpu;
use protocol::held::HeldPatch;
use protocol::image::Ranks;
use protocol::{DepthImage, Edit, Held, Mask, Material, ObjectPose, PatchId, Purpose, Update};
use wgpu::util::DeviceExt;

use crate::corners::{CornerRules, Corners};
use crate::levels::Parts;
use crate::mesh::{self, MeshOptions, PatchMesh, ProvokingVertex, QUAD_INDICES, Vertex};
use crate::redraw::{self, Redrawn};
use crate::tiles::{Bounds, Tiles};

/// The surfaces of everything held that is for one purpose, the eye if nothing else is said, one mesh a patch: on the GPU, or in the host's memory for what draws there.
///
/// Where samples were trimmed, their quads and those around them are drawn anew (`surface/src/redraw.rs`). Deleted samples are no longer drawn; the corners
/// that they shared stay where they are. A moved object costs nothing here, as its pose is read when it is drawn.
#[derive(Debug)]
pub struct HeldSurfaces {
    /// `None` on the host.
    gpu: Option<Gpu>,
    corners: Corners,
    rules: CornerRules,
    /// Patches of others are left out.
    purpose: Purpose,
    /// Whether quads of several samples are made, for views that tell them from single ones no more.
    coarsens: bool,
    patches: BTreeMap<PatchId, PatchSurface>,
    poses_now: BTreeMap<u16, DAffine3>,
    /// By material code.
    double_sided: Vec<bool>,
    /// Of the last change that may show in a picture.
    revision: u64,
}

/// Of a quad.
const CORNERS: usize = 4;
/// A patch that is trimmed gets room for further corners: this part of those it has. A small one is built anew as quickly.
const ROOM_SHARE: usize = 8;

/// How a patch is drawn: which vertex bears what is flat, whether its quads coarsen, and how many corners can be added.
type Options = (ProvokingVertex, bool, usize);

/// A number that no store has had.
fn next_revision() -> u64 {
    static LAST: AtomicU64 = AtomicU64::new(0);
    LAST.fetch_add(1, Ordering::Relaxed) + 1
}

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
    /// The moving objects at capture.
    pub(crate) objects: Vec<ObjectPose>,
    pub(crate) quads: QuadBuffers,
    /// The codes of its materials, ascending.
    materials: Vec<u8>,
    /// Which samples were built, and their places in `indices`.
    built: Mask,
    ranks: Ranks,
    /// A ball around all corners, in the patch's eye space at capture: its centre, and its radius in metres.
    ball_eye: (DVec3, f64),
    /// Around all corners at capture.
    bounds_world: WorldBounds,
    stats: SurfaceStats,
    /// Corners that can be added.
    room: usize,
}

/// The mesh of a patch, where it is drawn from.
#[derive(Debug)]
pub(crate) enum QuadBuffers {
    Gpu {
        vertices: wgpu::Buffer,
        /// Those in use.
        vertex_count: usize,
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

impl HeldSurfaces {
    /// Holds nothing yet; corners are averaged by the default rules.
    pub fn new(gpu: &Gpu) -> HeldSurfaces {
        HeldSurfaces::with_corners(gpu, Corners::default(), CornerRules::default())
    }

    /// Holds nothing yet.
    pub fn with_corners(gpu: &Gpu, corners: Corners, rules: CornerRules) -> HeldSurfaces {
        HeldSurfaces::empty(Some(gpu.clone()), corners, rules)
    }

    /// Holds nothing yet, and will in the host's memory; corners are averaged by the default rules.
    pub fn on_host() -> HeldSurfaces {
        HeldSurfaces::empty(None, Corners::default(), CornerRules::default())
    }

    fn empty(gpu: Option<Gpu>, corners: Corners, rules: CornerRules) -> HeldSurfaces {
        let (patches, poses_now, double_sided) = (BTreeMap::new(), BTreeMap::new(), Vec::new());
        let gpu_draws = gpu.is_some();
        HeldSurfaces {
            gpu,
            corners,
            rules,
            purpose: Purpose::Eye,
            coarsens: gpu_draws,
            patches,
            poses_now,
            double_sided,
            revision: next_revision(),
        }
    }

    /// The same of what is held for something else, by the rules for it; of a store that holds nothing yet.
    pub fn of(self, purpose: Purpose) -> HeldSurfaces {
        HeldSurfaces { purpose, rules: CornerRules::of(purpose), coarsens: false, ..self }
    }

    /// The same without quads of several samples, for who asks for single ones; of a store that holds nothing yet.
    pub fn at_finest_level(self) -> HeldSurfaces {
        HeldSurfaces { coarsens: false, ..self }
    }

    /// Follows an update that `held` has just applied.
    pub fn apply(&mut self, held: &Held, update: &Update) {
        let mut changed = BTreeSet::new();
        let mut trimmed: BTreeMap<PatchId, Vec<(u16, u16)>> = BTreeMap::new();
        for edit in &update.edits {
            match edit {
                Edit::Add(patch) => {
                    changed.insert(patch.id);
                }
                Edit::Remove(id) => {
                    changed.insert(*id);
                }
                Edit::Trim(id, trims) => {
                    trimmed.entry(*id).or_default().extend(trims.iter().map(|&(x, y, _)| (x, y)));
                }
                Edit::Delete(id, pixels) => self.delete(*id, pixels),
                Edit::Clear => changed.extend(self.patches.keys().copied()),
                // Instances are drawn by rays.
                Edit::Move(_) | Edit::Place(..) | Edit::Withdraw(_) | Edit::Materials(_) | Edit::Light(_) => {}
            }
        }
        self.set_poses(&held.poses_now);
        self.set_materials(&held.materials);
        for (id, pixels) in trimmed.iter().filter(|(id, _)| !changed.contains(id)) {
            if let Some(patch) = held.patches.get(id) {
                self.trim(patch, pixels);
            }
        }
        for id in changed {
            match held.patches.get(&id) {
                Some(patch) => self.insert(patch),
                None => self.remove(id),
            }
        }
    }

    /// Builds everything that `held` holds anew; for a fresh or a restarted session.
    pub fn rebuild(&mut self, held: &Held) {
        self.clear();
        self.set_poses(&held.poses_now);
        self.set_materials(&held.materials);
        held.patches.values().for_each(|patch| self.insert(patch));
    }

    /// Builds a patch's surface, or builds it anew. Patches for other purposes are left out.
    pub fn insert(&mut self, held: &HeldPatch) {
        let mesh = self.mesh(held);
        self.place(held, mesh);
    }

    /// The mesh of a patch, not yet placed: several can be built at once. Empty for patches for other purposes.
    pub fn mesh(&self, held: &HeldPatch) -> PatchMesh {
        if held.patch.purpose != self.purpose {
            return PatchMesh::default();
        }
        mesh::build(held, &self.mesh_options())
    }

    /// How it makes meshes.
    pub fn mesh_options(&self) -> MeshOptions<'static> {
        let (corners, rules, provoking) = (self.corners, self.rules, self.provoking_vertex());
        MeshOptions { corners, rules, provoking, exact_w: None, offset_image: None }
    }

    /// Draws a patch by its mesh from now on.
    pub fn place(&mut self, held: &HeldPatch, mesh: PatchMesh) {
        // Most patches are never trimmed.
        self.place_with_room(held, mesh, 0);
    }

    fn place_with_room(&mut self, held: &HeldPatch, mesh: PatchMesh, room: usize) {
        if mesh.indices.is_empty() {
            self.remove(held.patch.id);
        } else {
            self.revision = next_revision();
            let options = (self.provoking_vertex(), self.coarsens, room);
            self.patches.insert(held.patch.id, PatchSurface::new(self.gpu.as_ref(), held, mesh, options));
        }
    }

    /// Draws samples of a patch as they are trimmed now.
    pub fn trim(&mut self, held: &HeldPatch, pixels: &[(u16, u16)]) {
        let options = self.mesh_options();
        let Some(patch) = self.patches.get_mut(&held.patch.id) else { return };
        let redrawn = redraw::around(held, pixels, &options);
        if patch.room < redrawn.len() * CORNERS {
            // Which was trimmed once will be trimmed again.
            let mesh = self.mesh(held);
            let room = mesh.vertices.len() / ROOM_SHARE;
            self.place_with_room(held, mesh, room);
        } else {
            self.revision = next_revision();
            patch.redraw(self.gpu.as_ref(), &redrawn, options.provoking);
        }
    }

    /// Draws single samples of a patch no more.
    pub fn delete(&mut self, id: PatchId, pixels: &[(u16, u16)]) {
        if let Some(patch) = self.patches.get_mut(&id) {
            self.revision = next_revision();
            patch.delete(self.gpu.as_ref(), pixels);
        }
    }

    /// Whether it is what eyes look at, and not what lights do.
    pub(crate) fn is_for_eyes(&self) -> bool {
        self.purpose == Purpose::Eye
    }

    /// How many quads [`crate::SurfacePass`] draws for a view.
    pub fn quads_drawn(&self, view: &Pinhole) -> usize {
        let of_patch = |patch: &PatchSurface| match &patch.quads {
            QuadBuffers::Gpu { parts, .. } if patch.may_be_seen_from(view) => {
                let seen = parts.seen_from(view, &patch.camera, (true, self.is_one_sided(patch)));
                seen.iter().map(|range| range.len() / QUAD_INDICES).sum()
            }
            QuadBuffers::Gpu { .. } => 0,
            QuadBuffers::Host { mesh, .. } => mesh.indices.len() / QUAD_INDICES,
        };
        self.patches.values().map(of_patch).sum()
    }

    /// Whether a view may show anything of a patch.
    pub fn may_show(&self, id: PatchId, view: &Pinhole) -> bool {
        self.patches.get(&id).is_some_and(|patch| patch.may_be_seen_from(view))
    }

    /// A box around everything held as it was captured; `None` where nothing is. Moving objects may have left it since.
    pub fn bounds_world(&self) -> Option<WorldBounds> {
        self.patches.values().map(|patch| patch.bounds_world).reduce(WorldBounds::union)
    }

    /// A number that grows with every change of what is drawn, and that no other store has.
    pub fn revision(&self) -> u64 {
        self.revision
    }

    /// Forgets a patch.
    pub fn remove(&mut self, id: PatchId) {
        if self.patches.remove(&id).is_some() {
            self.revision = next_revision();
        }
    }

    /// Forgets everything.
    pub fn clear(&mut self) {
        self.revision = next_revision();
        self.patches.clear();
        self.poses_now.clear();
    }

    /// Where the moving objects are now.
    pub fn set_poses(&mut self, poses_now: &BTreeMap<u16, DAffine3>) {
        if self.poses_now != *poses_now {
            self.revision = next_revision();
            self.poses_now.clone_from(poses_now);
        }
    }

    /// What the materials' codes mean: surfaces of one side are not drawn from behind.
    pub fn set_materials(&mut self, materials: &[Material]) {
        let double_sided = materials.iter().map(|material| material.double_sided).collect();
        if self.double_sided != double_sided {
            self.revision = next_revision();
            self.double_sided = double_sided;
        }
    }

    /// Whether a patch shows nothing from behind: all of its surfaces have one side, and none may have been mirrored since.
    pub(crate) fn is_one_sided(&self, patch: &PatchSurface) -> bool {
        let has_one_side = |code: &u8| self.double_sided.get(usize::from(*code)) == Some(&false);
        patch.objects.is_empty() && patch.materials.iter().all(has_one_side)
    }

    /// Summed over the patches.
    pub fn stats(&self) -> SurfaceStats {
        self.patches.values().fold(SurfaceStats::default(), |sum, patch| SurfaceStats {
            samples: sum.samples + patch.stats.samples,
            vertices: sum.vertices + patch.stats.vertices,
            guarded: sum.guarded + patch.stats.guarded,
            bytes: sum.bytes + patch.stats.bytes,
        })
    }

    pub(crate) fn patches(&self) -> impl ExactSizeIterator<Item = (PatchId, &PatchSurface)> {
        self.patches.iter().map(|(id, patch)| (*id, patch))
    }

    pub(crate) fn poses_now(&self) -> &BTreeMap<u16, DAffine3> {
        &self.poses_now
    }

    fn provoking_vertex(&self) -> ProvokingVertex {
        let backend = self.gpu.as_ref().map(|gpu| gpu.adapter.get_info().backend);
        if backend == Some(wgpu::Backend::Gl) { ProvokingVertex::Last } else { ProvokingVertex::First }
    }
}

impl QuadBuffers {
    fn new(
        gpu: Option<&Gpu>,
        (mask, camera): (&Mask, &Pinhole),
        mut mesh: PatchMesh,
        (provoking, coarsens, room): Options,
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
        let vertex_count = mesh.vertices.len();
        mesh.vertices.resize(vertex_count + room, Vertex::zeroed());
        let corners = wgpu::BufferUsages::VERTEX | wgpu::BufferUsages::COPY_DST | read;
        QuadBuffers::Gpu {
            vertices: buffer("corners", bytemuck::cast_slice(&mesh.vertices), corners),
            vertex_count,
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

/// A ball around the corners of a mesh: around the middle of their box.
fn ball_eye(camera: &Pinhole, mesh: &PatchMesh) -> (DVec3, f64) {
    let (low, high) = box_around(mesh.vertices.iter().map(|vertex| corner_eye(camera, vertex)));
    let centre = (low + high) / 2.0;
    (centre, high.distance(low) / 2.0)
}

fn bounds_world(camera: &Pinhole, mesh: &PatchMesh) -> WorldBounds {
    let world_from_eye = camera.world_from_eye.to_affine();
    let corners = mesh.vertices.iter().map(|vertex| world_from_eye.transform_point3(corner_eye(camera, vertex)));
    let (min, max) = box_around(corners);
    WorldBounds { min, max }
}

fn corners_eye(camera: &Pinhole, redrawn: &[Redrawn]) -> impl Iterator<Item = DVec3> {
    redrawn.iter().flat_map(|redrawn| redrawn.corners).map(|corner| corner_eye(camera, &corner))
}

fn corner_eye(camera: &Pinhole, vertex: &Vertex) -> DVec3 {
    camera.ray_eye_from_image(vertex.u_px.into(), vertex.v_px.into()) / f64::from(vertex.w)
}

fn box_around(points: impl Iterator<Item = DVec3>) -> (DVec3, DVec3) {
    points.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), p| (low.min(p), high.max(p)))
}

impl PatchSurface {
    fn new(gpu: Option<&Gpu>, held: &HeldPatch, mesh: PatchMesh, options: Options) -> PatchSurface {
        // Without a mesh, images of other cameras have no surface.
        let camera = *held.patch.image.camera.root();
        let stats = SurfaceStats {
            samples: mesh.indices.len() / 6,
            vertices: mesh.vertices.len(),
            guarded: mesh.guarded,
            bytes: 0,
        };
        let bounds = (ball_eye(&camera, &mesh), bounds_world(&camera, &mesh));
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
            room: options.2,
        }
    }

    /// Gives samples other quads, each with corners of its own, for which there must be room.
    fn redraw(&mut self, gpu: Option<&Gpu>, redrawn: &[Redrawn], provoking: ProvokingVertex) {
        self.room -= redrawn.len() * CORNERS;
        let corners: Vec<Vertex> = redrawn.iter().flat_map(|redrawn| redrawn.corners).collect();
        let samples = redrawn.iter().map(|redrawn| {
            let (x, y) = redrawn.pixel;
            (self.ranks.of(&self.built, x, y), redrawn.corners.map(|corner| corner.image()))
        });
        let quad = |vertex_count: usize, index: usize| {
            let first = (vertex_count + index * CORNERS) as u32;
            provoking.indices([first, first + 1, first + 2, first + 3])
        };
        match (&mut self.quads, gpu) {
            (QuadBuffers::Gpu { vertices, vertex_count, indices, parts, .. }, Some(gpu)) => {
                let mut quads: Vec<(u32, [u32; QUAD_INDICES])> = samples
                    .enumerate()
                    .filter_map(|(index, (sample, corners))| {
                        Some((parts.redraw(sample?, corners, &self.camera)?, quad(*vertex_count, index)))
                    })
                    .collect();
                quads.sort_unstable_by_key(|(place, _)| *place);
                for run in quads.chunk_by(|a, b| a.0 + 1 == b.0) {
                    let at = (run[0].0 as usize * size_of::<[u32; QUAD_INDICES]>()) as u64;
                    let run: Vec<u32> = run.iter().flat_map(|(_, quad)| *quad).collect();
                    gpu.queue.write_buffer(indices, at, bytemuck::cast_slice(&run));
                }
                let at = (*vertex_count * size_of::<Vertex>()) as u64;
                gpu.queue.write_buffer(vertices, at, bytemuck::cast_slice(&corners));
                *vertex_count += corners.len();
            }
            (QuadBuffers::Host { mesh, .. }, _) => {
                for (index, (sample, _)) in samples.enumerate() {
                    if let Some(sample) = sample {
                        let quad = quad(mesh.vertices.len(), index);
                        mesh.indices[sample * QUAD_INDICES..][..QUAD_INDICES].copy_from_slice(&quad);
                    }
                }
                mesh.vertices.extend(corners);
            }
            (QuadBuffers::Gpu { .. }, None) => {}
        }
        let (centre, radius_m) = self.ball_eye;
        let farthest_m = corners_eye(&self.camera, redrawn).map(|corner| corner.distance(centre));
        self.ball_eye.1 = farthest_m.fold(radius_m, f64::max);
    }

    /// Makes the triangles of samples empty.
    fn delete(&mut self, gpu: Option<&Gpu>, pixels: &[(u16, u16)]) {
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
