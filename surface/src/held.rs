use std::collections::{BTreeMap, BTreeSet};
use std::sync::atomic::{AtomicU64, Ordering};

use camera::{Bounds as WorldBounds, Pinhole};
use glam::DAffine3;
use gpu::Gpu;
use protocol::held::HeldPatch;
use protocol::{Edit, Held, Material, Patch, PatchId, Purpose, Update};

use crate::built::{self, Build, Built, BuiltSurfaces};
use crate::corners::{CornerRules, Corners};
use crate::mesh::{self, MeshOptions, PatchMesh, ProvokingVertex, QUAD_INDICES};
use crate::patch::{PatchSurface, QuadBuffers, SurfaceStats};
use crate::redraw;
use crate::tint::Tint;

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
    /// What is shown of them, and at which scene time, in seconds.
    tint: (Tint, f64),
    /// Of the last change that may show in a picture.
    revision: u64,
}

/// A number that no store has had.
fn next_revision() -> u64 {
    static LAST: AtomicU64 = AtomicU64::new(0);
    LAST.fetch_add(1, Ordering::Relaxed) + 1
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
            tint: (Tint::Own, 0.0),
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

    /// Shows what samples are from now on, in place of what they saw; at this scene time, in seconds. Drawn by [`SurfacePass::tinted`](crate::SurfacePass::tinted).
    pub fn set_tint(&mut self, tint: Tint, now_s: f64) {
        self.tint = (tint, now_s);
    }

    /// What is shown of them.
    pub fn tint(&self) -> Tint {
        self.tint.0
    }

    /// Of a patch's samples; see [`Tint::code`].
    pub(crate) fn tint_code(&self, patch: &PatchSurface) -> u32 {
        let (tint, now_s) = self.tint;
        tint.code(now_s - patch.capture_time_s)
    }

    /// Follows an update that `held` has just applied.
    pub fn apply(&mut self, held: &Held, update: &Update) {
        self.apply_built(held, update, &mut BuiltSurfaces::default());
    }

    /// The same, with surfaces that may have been built of the patches that the update adds. What it trims or deletes of these is then drawn as if a later one did.
    pub fn apply_built(&mut self, held: &Held, update: &Update, built: &mut BuiltSurfaces) {
        let mut changed = BTreeSet::new();
        let mut trimmed: BTreeMap<PatchId, Vec<(u16, u16)>> = BTreeMap::new();
        for edit in &update.edits {
            match edit {
                Edit::Add(patch) => match self.take_built(patch, built) {
                    Some(built) => self.place_built(patch, built),
                    None => {
                        changed.insert(patch.id);
                    }
                },
                Edit::Remove(id) => {
                    changed.insert(*id);
                }
                Edit::Trim(id, trims) => {
                    trimmed.entry(*id).or_default().extend(trims.iter().map(|&(x, y, _)| (x, y)));
                }
                Edit::Delete(id, pixels) => self.delete(*id, pixels),
                Edit::Clear => self.clear(),
                // Instances are drawn by rays or as bodies.
                Edit::Move(_)
                | Edit::Shift(_)
                | Edit::Body(..)
                | Edit::Place(..)
                | Edit::Withdraw(_)
                | Edit::Materials(_)
                | Edit::Light(_)
                | Edit::Sky(_)
                | Edit::Join(_) => {}
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

    /// The surface that was built of a patch, if that is what would be built here.
    fn take_built(&self, patch: &Patch, built: &mut BuiltSurfaces) -> Option<Built> {
        let is_usual = self.rules == CornerRules::of(self.purpose) && self.coarsens == built::coarsens(self.purpose);
        if patch.purpose != self.purpose || !is_usual || self.gpu.is_none() {
            return None;
        }
        built.take(patch.id).filter(|built| built.is_of(patch, self.build()))
    }

    /// How surfaces are built beside the drawing, for [`HeldSurfaces::apply_built`].
    pub fn build(&self) -> Build {
        Build { corners: self.corners, provoking: self.provoking_vertex() }
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
        if self.gpu.is_some() {
            return self.place_built(&held.patch, Built::of(&held.patch, mesh, self.build(), self.coarsens));
        }
        let is_empty = mesh.indices.is_empty();
        self.replace(held.patch.id, (!is_empty).then(|| PatchSurface::on_host(&held.patch, mesh)));
    }

    fn place_built(&mut self, patch: &Patch, built: Built) {
        let gpu = self.gpu.as_ref().filter(|_| !built.is_empty());
        self.replace(patch.id, gpu.map(|gpu| PatchSurface::on_gpu(gpu, patch, built)));
    }

    fn replace(&mut self, id: PatchId, surface: Option<PatchSurface>) {
        match surface {
            Some(surface) => {
                self.revision = next_revision();
                self.patches.insert(id, surface);
            }
            None => self.remove(id),
        }
    }

    /// Draws samples of a patch as they are trimmed now.
    pub fn trim(&mut self, held: &HeldPatch, pixels: &[(u16, u16)]) {
        let options = self.mesh_options();
        let Some(patch) = self.patches.get_mut(&held.patch.id) else { return };
        let redrawn = redraw::around(held, pixels, &options);
        if patch.may_redraw(&redrawn) {
            self.revision = next_revision();
            patch.redraw(self.gpu.as_ref(), &redrawn, options.provoking);
        } else {
            self.insert(held);
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
        self.purpose.is_for_eyes()
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

    /// Moves the moving objects there.
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

    /// Whether a patch shows nothing from behind: all of its surfaces have one side, and none may have been mirrored since. What is blended has
    /// a layer for its other side.
    pub(crate) fn is_one_sided(&self, patch: &PatchSurface) -> bool {
        if matches!(self.purpose, Purpose::Layer(_)) {
            return true;
        }
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

    /// Where the moving objects are.
    pub fn poses_now(&self) -> &BTreeMap<u16, DAffine3> {
        &self.poses_now
    }

    fn provoking_vertex(&self) -> ProvokingVertex {
        let backend = self.gpu.as_ref().map(|gpu| gpu.adapter.get_info().backend);
        if backend == Some(wgpu::Backend::Gl) { ProvokingVertex::Last } else { ProvokingVertex::First }
    }
}
