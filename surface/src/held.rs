use std::collections::{BTreeMap, BTreeSet};

use camera::Pinhole;
use glam::DAffine3;
use gpu::Gpu;
use protocol::held::HeldPatch;
use protocol::{DepthImage, Edit, Held, ObjectPose, PatchId, Purpose, Update};
use wgpu::util::DeviceExt;

use crate::corners::{CornerRules, Corners};
use crate::mesh::{self, MeshOptions, PatchMesh, ProvokingVertex};

/// The surfaces of everything held that is for the eye, on the GPU: one mesh a patch.
///
/// A patch whose samples were trimmed or deleted is built anew; a moved object costs nothing here, as its pose is read when
/// it is drawn.
#[derive(Debug)]
pub struct HeldSurfaces {
    gpu: Gpu,
    corners: Corners,
    rules: CornerRules,
    patches: BTreeMap<PatchId, PatchSurface>,
    poses_now: BTreeMap<u16, DAffine3>,
}

/// What is held for drawing.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct SurfaceStats {
    /// Quads.
    pub samples: usize,
    /// Corners.
    pub vertices: usize,
    /// Samples whose normal gives no usable plane, see [`PatchMesh::guarded`].
    pub guarded: usize,
    /// GPU memory of the meshes.
    pub bytes: u64,
}

#[derive(Debug)]
pub(crate) struct PatchSurface {
    pub(crate) camera: Pinhole,
    /// The moving objects at capture.
    pub(crate) objects: Vec<ObjectPose>,
    pub(crate) vertices: wgpu::Buffer,
    pub(crate) indices: wgpu::Buffer,
    pub(crate) index_count: u32,
    stats: SurfaceStats,
}

impl HeldSurfaces {
    /// Holds nothing yet; corners are averaged by the default rules.
    pub fn new(gpu: &Gpu) -> HeldSurfaces {
        HeldSurfaces::with_corners(gpu, Corners::default(), CornerRules::default())
    }

    /// Holds nothing yet.
    pub fn with_corners(gpu: &Gpu, corners: Corners, rules: CornerRules) -> HeldSurfaces {
        HeldSurfaces { gpu: gpu.clone(), corners, rules, patches: BTreeMap::new(), poses_now: BTreeMap::new() }
    }

    /// Follows an update that `held` has just applied.
    pub fn apply(&mut self, held: &Held, update: &Update) {
        let mut changed = BTreeSet::new();
        for edit in &update.edits {
            match edit {
                Edit::Add(patch) => {
                    changed.insert(patch.id);
                }
                Edit::Remove(id) | Edit::Delete(id, _) | Edit::Trim(id, _) => {
                    changed.insert(*id);
                }
                Edit::Clear => changed.extend(self.patches.keys().copied()),
                Edit::Move(_) | Edit::Materials(_) | Edit::Light(_) => {}
            }
        }
        self.poses_now.clone_from(&held.poses_now);
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
        self.poses_now.clone_from(&held.poses_now);
        held.patches.values().for_each(|patch| self.insert(patch));
    }

    /// Builds a patch's surface, or builds it anew. Patches that are not for the eye are left out.
    pub fn insert(&mut self, held: &HeldPatch) {
        self.insert_with_offset(held, None);
    }

    /// As [`HeldSurfaces::insert`], with the offset image of the same view for [`Corners::OffsetImage`]: one pixel larger,
    /// pixel centres on the corners of the patch's pixels.
    pub fn insert_with_offset(&mut self, held: &HeldPatch, offset_image: Option<&DepthImage>) {
        if held.patch.purpose != Purpose::Eye {
            return;
        }
        let options =
            MeshOptions { corners: self.corners, rules: self.rules, provoking: self.provoking_vertex(), offset_image };
        let mesh = mesh::build(held, &options);
        if mesh.indices.is_empty() {
            self.remove(held.patch.id);
        } else {
            self.patches.insert(held.patch.id, PatchSurface::new(&self.gpu, held, &mesh));
        }
    }

    /// Forgets a patch.
    pub fn remove(&mut self, id: PatchId) {
        self.patches.remove(&id);
    }

    /// Forgets everything.
    pub fn clear(&mut self) {
        self.patches.clear();
        self.poses_now.clear();
    }

    /// Where the moving objects are now.
    pub fn set_poses(&mut self, poses_now: &BTreeMap<u16, DAffine3>) {
        self.poses_now.clone_from(poses_now);
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

    pub(crate) fn patches(&self) -> impl ExactSizeIterator<Item = &PatchSurface> {
        self.patches.values()
    }

    pub(crate) fn poses_now(&self) -> &BTreeMap<u16, DAffine3> {
        &self.poses_now
    }

    fn provoking_vertex(&self) -> ProvokingVertex {
        match self.gpu.adapter.get_info().backend {
            wgpu::Backend::Gl => ProvokingVertex::Last,
            _ => ProvokingVertex::First,
        }
    }
}

impl PatchSurface {
    fn new(gpu: &Gpu, held: &HeldPatch, mesh: &PatchMesh) -> PatchSurface {
        let camera::Camera::Pinhole(camera) = held.patch.image.camera;
        let buffer = |label, contents, usage| {
            gpu.device.create_buffer_init(&wgpu::util::BufferInitDescriptor { label: Some(label), contents, usage })
        };
        let vertices = buffer("corners", bytemuck::cast_slice(&mesh.vertices), wgpu::BufferUsages::VERTEX);
        let indices = buffer("quads", bytemuck::cast_slice(&mesh.indices), wgpu::BufferUsages::INDEX);
        let stats = SurfaceStats {
            samples: mesh.indices.len() / 6,
            vertices: mesh.vertices.len(),
            guarded: mesh.guarded,
            bytes: vertices.size() + indices.size(),
        };
        PatchSurface {
            camera,
            objects: held.patch.objects.clone(),
            vertices,
            indices,
            index_count: mesh.indices.len() as u32,
            stats,
        }
    }
}
