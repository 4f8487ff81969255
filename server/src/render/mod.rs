//! The scene on the GPU, and drawing it with a pass's own fragment stage.
//!
//! [`SceneRenderer`] holds meshes, materials and textures, and where every instance is at a time. A pass
//! ([`crate::discretize::Discretizer`], [`crate::truth::TruthRenderer`]) brings a [`Pipelines`] and calls
//! `SceneRenderer::draw` in its own render pass.
//!
//! Positions are f32 relative to an anchor near the viewer that the caller chooses at each [`SceneRenderer::update`];
//! matrices are composed in f64 first, so that a scene far from the world's origin looks the same.
//!
//! Ids: the object id of a sample is the instance's index; the triangle id is 1 + the triangles of all instances before it +
//! the triangle within its mesh, stable over the life of the scene; 0 is nothing.

mod cull;
mod error;
mod layers;
mod materials;
mod palette;
mod pipelines;
mod rays;
mod texture;
mod upload;

pub(crate) use cull::{Frustum, world_bounds};
pub use error::RenderError;
use layers::Layers;
pub use layers::{Blended, Layer};
pub use palette::Kinds;
pub(crate) use palette::on_the_whole;
use pipelines::Variant;
pub(crate) use pipelines::{DEPTH_FORMAT, buffer_entry, texture_entry};
pub use pipelines::{Faces, Layouts, Pass, Pipelines, SceneKind};
pub(crate) use rays::RayBuffers;
pub use rays::{FirstHit, RayScene};
pub(crate) use upload::triangle_bases;

use std::collections::BTreeSet;

use bytemuck::{Pod, Zeroable};
use camera::Pinhole;
use glam::{DAffine3, DVec3, Vec3};
use gpu::uniforms::normal_matrix;
use gpu::{Gpu, PinholeUniform};
use protocol::Look;
use protocol::staging::{Excerpt, Section};
use scene::{Bounds, Scene, Snapshot, Vertex};
use wgpu::util::DeviceExt;

/// `Instance` of `server/scene.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub(crate) struct InstanceRecord {
    pub anchor_from_mesh_x: [f32; 4],
    pub anchor_from_mesh_y: [f32; 4],
    pub anchor_from_mesh_z: [f32; 4],
    pub world_normal_from_mesh_x: [f32; 4],
    pub world_normal_from_mesh_y: [f32; 4],
    pub world_normal_from_mesh_z: [f32; 4],
    pub triangle_base: u32,
    pub object: u32,
    pub material: u32,
    /// See [`InstanceRecord::MIRRORED`] and [`InstanceRecord::HIDES`].
    pub flags: u32,
    pub first_vertex: u32,
    pub first_index: u32,
    pub tint: [u8; 4],
    /// Which of its faces are in the layer that is drawn, see [`Layers::faces_in`].
    pub faces: u32,
}

impl InstanceRecord {
    /// Its map turns left to right.
    const MIRRORED: u32 = 1;
    /// See [`LeftOut::hiding`].
    const HIDES: u32 = 2;
}

fn rgba([red, green, blue]: [u8; 3]) -> [u8; 4] {
    [red, green, blue, 255]
}

/// Instances that share buffers, texture and pipeline, and follow each other in the instance buffer.
#[derive(Debug, Clone)]
pub(crate) struct Batch {
    pub first_index: u32,
    pub index_count: u32,
    pub first_vertex: u32,
    pub vertex_count: u32,
    /// Range of instance records.
    pub slots: std::ops::Range<u32>,
    pub texture: usize,
    pub cut_out: bool,
    /// Whether its material has a normal map or varies from place to place.
    pub detailed: bool,
    pub double_sided: bool,
}

/// What is known of an instance beside its record.
#[derive(Debug, Clone)]
pub(crate) struct Slot {
    pub object: u32,
    pub batch: usize,
    /// In mesh space, at rest or as last deformed.
    pub bounds_mesh: [Vec3; 2],
    pub bounds_world: Bounds,
}

/// Instances that are drawn by one call.
pub(crate) struct Run {
    batch: usize,
    pub slots: std::ops::Range<u32>,
    mirrored: bool,
    /// From the eye to the nearest of their boxes.
    distance_m: f64,
}

/// Objects that views of the scene make no samples of, as a client is shown them otherwise.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct LeftOut {
    /// What is not drawn at all: what lies behind is sampled.
    pub absent: BTreeSet<u16>,
    /// What hides what lies behind it: pixels of it have depth, an object and a normal, but no triangle.
    pub hiding: BTreeSet<u16>,
}

/// What is kept of surfaces.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Detail {
    /// Normals finely of what reflects; surfaces are there or not.
    Motion,
    /// Normals and colours finely.
    Fine,
    /// The same, for images whose samples make up pixels, 4 x 4 each.
    Parts,
}

/// A scene on the GPU.
pub struct SceneRenderer {
    gpu: Gpu,
    layouts: Layouts,
    /// Whether triangles are told by the fragment stage; else corners are pulled (see [`SceneRenderer::with_pulling`]).
    native: bool,
    vertices: wgpu::Buffer,
    second_uvs: wgpu::Buffer,
    indices: wgpu::Buffer,
    instances: wgpu::Buffer,
    surfaces: wgpu::Buffer,
    section: wgpu::Buffer,
    /// What is in it.
    surface_materials: Vec<materials::SurfaceMaterial>,
    /// What is blended.
    blended: Layers,
    /// What is kept of all, how it is drawn, and whether without normal maps.
    detail: Detail,
    shown: Blended,
    is_smooth: bool,
    scene_group: wgpu::BindGroup,
    texture_groups: Vec<wgpu::BindGroup>,
    batches: Vec<Batch>,
    /// In the order of the instance buffer.
    slots: Vec<Slot>,
    records: Vec<InstanceRecord>,
    /// The batch of each deforming object.
    batch_of_deforming: std::collections::HashMap<u32, usize>,
    material_table: Vec<protocol::Material>,
    kinds: Kinds,
    anchor_world: DVec3,
    rays: Option<RayScene>,
    /// What [`SceneRenderer::draw`] makes no samples of.
    left_out: LeftOut,
    /// What of the scene is drawn at all.
    excerpt: Excerpt,
}

impl SceneRenderer {
    /// Uploads a scene, at its place at time 0. What is dropped (materials past 256) is logged. Materials are everywhere what they are on the
    /// whole, but for their colours and normals.
    pub fn new(gpu: &Gpu, scene: &Scene) -> Result<SceneRenderer, RenderError> {
        SceneRenderer::upload(gpu, scene, (gpu.caps.primitive_index, false))
    }

    /// The same for a look: materials vary as their textures say where it shows.
    pub fn for_look(gpu: &Gpu, scene: &Scene, look: Look) -> Result<SceneRenderer, RenderError> {
        SceneRenderer::upload(gpu, scene, (gpu.caps.primitive_index, look == Look::Full))
    }

    /// The same without `primitive_index`, as a device that lacks it does it: equal ids, slower.
    pub fn with_pulling(gpu: &Gpu, scene: &Scene) -> Result<SceneRenderer, RenderError> {
        SceneRenderer::upload(gpu, scene, (false, false))
    }

    /// The same, at its place at time 0, ready for methods that follow rays ([`crate::discretize::Discretization::needs_rays`]).
    pub fn with_rays(self, scene: &Scene) -> SceneRenderer {
        let rays = Some(RayScene::new(scene, self.anchor_world));
        SceneRenderer { rays, ..self }
    }

    /// Moves everything to where it is in `snapshot`, relative to `anchor_world`, which should be within some hundred metres of
    /// the eyes that draw next. Draws submitted before are not affected.
    pub fn update(&mut self, snapshot: &Snapshot, anchor_world: DVec3) -> Result<(), RenderError> {
        if snapshot.world_from_mesh.len() != self.slots.len() {
            let (found, expected) = (snapshot.world_from_mesh.len(), self.slots.len());
            return Err(RenderError::OtherScene { found, expected });
        }
        for deformed in &snapshot.deformed {
            self.upload_deformed(deformed.instance, &deformed.vertices);
        }
        for (slot, record) in self.slots.iter_mut().zip(&mut self.records) {
            let world_from_mesh = &snapshot.world_from_mesh[slot.object as usize];
            place(record, world_from_mesh, anchor_world);
            slot.bounds_world = world_bounds(world_from_mesh, slot.bounds_mesh);
        }
        self.gpu.queue.write_buffer(&self.instances, 0, bytemuck::cast_slice(&self.records));
        self.anchor_world = anchor_world;
        self.write_section();
        if let Some(rays) = &mut self.rays {
            rays.update(snapshot, anchor_world);
        }
        Ok(())
    }

    /// The layers that what is blended is drawn in; none where nothing is.
    pub fn layers(&self) -> &[Layer] {
        &self.blended.layers
    }

    /// The objects that light passes straight on: no impostor shows them.
    pub(crate) fn panes(&self) -> &BTreeSet<u16> {
        &self.blended.panes
    }

    /// A box around the objects of a layer, where they are now; `None` where nothing is in it.
    pub(crate) fn layer_bounds(&self, layer: Layer) -> Option<camera::Bounds> {
        let of_layer = self.slots.iter().filter(|slot| self.blended.faces_in(slot.object as u16, layer) != 0);
        let bounds = of_layer.map(|slot| slot.bounds_world).filter(|bounds| !bounds.is_empty());
        bounds.map(|Bounds { min, max }| camera::Bounds { min, max }).reduce(camera::Bounds::union)
    }

    /// Draws what is blended so from now on.
    pub fn blend(&mut self, blended: Blended) {
        if std::mem::replace(&mut self.shown, blended) == blended || self.blended.layers.is_empty() {
            return;
        }
        for (slot, record) in self.slots.iter().zip(&mut self.records) {
            record.faces = match blended {
                Blended::Layer(layer) => self.blended.faces_in(slot.object as u16, layer),
                Blended::CutOut | Blended::LeftOut => 0,
            };
        }
        self.gpu.queue.write_buffer(&self.instances, 0, bytemuck::cast_slice(&self.records));
    }

    /// Whether captures tell how much samples of a layer hide.
    pub(crate) fn shows_layer(&self) -> bool {
        matches!(self.shown, Blended::Layer(_))
    }

    /// Makes no samples of some objects from now on, where views of the scene are drawn; those of which it made none until now. Rays still meet them.
    pub fn leave_out(&mut self, left_out: LeftOut) -> LeftOut {
        let before = std::mem::replace(&mut self.left_out, left_out);
        if before.hiding != self.left_out.hiding {
            for (slot, record) in self.slots.iter().zip(&mut self.records) {
                let hides = self.left_out.hiding.contains(&(slot.object as u16));
                record.flags = record.flags & !InstanceRecord::HIDES | if hides { InstanceRecord::HIDES } else { 0 };
            }
            self.gpu.queue.write_buffer(&self.instances, 0, bytemuck::cast_slice(&self.records));
        }
        before
    }

    /// Draws this part of the scene alone from now on. Rays still meet all of it.
    pub fn show(&mut self, excerpt: &Excerpt) {
        let before = self.excerpt.section;
        self.excerpt.clone_from(excerpt);
        if before != excerpt.section {
            self.write_section();
        }
    }

    /// Writes where the scene is cut open, relative to the anchor.
    fn write_section(&self) {
        let plane = self.excerpt.section.map_or([0.0; 4], |Section { normal_world, offset_m }| {
            let offset_m = offset_m - normal_world.dot(self.anchor_world);
            normal_world.as_vec3().extend(offset_m as f32).to_array()
        });
        self.gpu.queue.write_buffer(&self.section, 0, bytemuck::bytes_of(&plane));
    }

    /// Keeps as much of surfaces as is wanted from now on.
    pub(crate) fn keep(&mut self, detail: Detail) {
        if std::mem::replace(&mut self.detail, detail) != detail {
            self.write_materials();
        }
    }

    /// Leaves normal maps out from now on, and how materials vary, or no longer: surfaces that are not looked at but cast are as smooth as their
    /// meshes.
    pub(crate) fn smooth(&mut self, is_smooth: bool) {
        let was_smooth = std::mem::replace(&mut self.is_smooth, is_smooth);
        if was_smooth != is_smooth && self.surface_materials.iter().any(materials::SurfaceMaterial::is_detailed) {
            self.write_materials();
        }
    }

    /// Writes materials as they are drawn now.
    fn write_materials(&self) {
        let finely = self.detail != Detail::Motion;
        let drawn = |surface: &materials::SurfaceMaterial| {
            let surface = if self.is_smooth { surface.without_detail() } else { *surface };
            let fine = if finely { materials::FINE_NORMAL | materials::FINE_COLOUR } else { surface.fine };
            materials::SurfaceMaterial { fine, ..surface }
        };
        let drawn: Vec<_> = self.surface_materials.iter().map(drawn).collect();
        self.gpu.queue.write_buffer(&self.surfaces, 0, bytemuck::cast_slice(&drawn));
    }

    /// Shows an object's base colours multiplied by `tint` from now on, see [`scene::Instance::tint`]; the tint until now.
    pub(crate) fn set_tint(&mut self, object: u16, tint: [u8; 3]) -> [u8; 3] {
        let Some(slot) = self.slots.iter().position(|slot| slot.object == u32::from(object)) else { return tint };
        let [red, green, blue, _] = std::mem::replace(&mut self.records[slot].tint, rgba(tint));
        let offset = (slot * size_of::<InstanceRecord>()) as u64;
        self.gpu.queue.write_buffer(&self.instances, offset, bytemuck::bytes_of(&self.records[slot]));
        [red, green, blue]
    }

    /// The scene for rays, where it was asked for.
    pub fn rays(&self) -> Option<&RayScene> {
        self.rays.as_ref()
    }

    /// The hierarchy of [`SceneRenderer::rays`] on the GPU.
    pub(crate) fn ray_buffers(&self) -> Result<&RayBuffers, RenderError> {
        self.rays.as_ref().ok_or(RenderError::NoRays)?.buffers(&self.gpu)
    }

    /// The materials that samples refer to by code.
    pub fn materials(&self) -> &[protocol::Material] {
        &self.material_table
    }

    /// By material of the scene, its index into the table; `None` where it, or its normal, is told place by place.
    pub(crate) fn material_codes(&self) -> Vec<Option<u8>> {
        let code = |material: &materials::SurfaceMaterial| (!material.is_detailed()).then_some(material.code as u8);
        self.surface_materials.iter().map(code).collect()
    }

    /// Which codes of the samples' materials belong together.
    pub(crate) fn kinds(&self) -> &Kinds {
        &self.kinds
    }

    /// What positions on the GPU are relative to.
    pub fn anchor_world(&self) -> DVec3 {
        self.anchor_world
    }

    /// The device that holds it.
    pub fn gpu(&self) -> &Gpu {
        &self.gpu
    }

    /// Which kind of pipelines draws it.
    pub fn kind(&self) -> SceneKind {
        let detailed = self.batches.iter().any(|batch| batch.detailed);
        SceneKind { native: self.native, detailed }
    }

    /// The bind group of a camera, for [`SceneRenderer::draw`].
    pub(crate) fn view_group(&self, camera: &Pinhole) -> wgpu::BindGroup {
        let uniform = PinholeUniform::new(camera, self.anchor_world);
        let buffer = self.gpu.device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
            label: Some("camera"),
            contents: bytemuck::bytes_of(&uniform),
            usage: wgpu::BufferUsages::UNIFORM,
        });
        self.gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("camera"),
            layout: &self.layouts.view,
            entries: &[wgpu::BindGroupEntry { binding: 0, resource: buffer.as_entire_binding() }],
        })
    }

    /// Sets what all runs of [`SceneRenderer::draw_run`] share.
    pub(crate) fn begin(&self, pass: &mut wgpu::RenderPass<'_>, size_px: (u32, u32), view: &wgpu::BindGroup) {
        pass.set_viewport(0.0, 0.0, size_px.0 as f32, size_px.1 as f32, 0.0, 1.0);
        pass.set_bind_group(0, view, &[]);
        pass.set_bind_group(1, &self.scene_group, &[]);
        if self.native {
            pass.set_vertex_buffer(0, self.vertices.slice(..));
            pass.set_index_buffer(self.indices.slice(..), wgpu::IndexFormat::Uint32);
        }
    }

    /// Draws what `camera` may see with the pass's pipelines; group 3 is the pass's own and already set.
    pub(crate) fn draw(
        &self,
        pass: &mut wgpu::RenderPass<'_>,
        pipelines: &Pipelines,
        camera: &Pinhole,
        view: &wgpu::BindGroup,
    ) {
        self.begin(pass, (camera.width_px, camera.height_px), view);
        let is_drawn = |object| !self.left_out.absent.contains(&object) && self.blended.is_drawn(object, self.shown);
        for run in self.visible_runs(camera, &is_drawn) {
            self.set_run(pass, pipelines, &run);
            self.draw_run(pass, &run);
        }
    }

    /// The pipeline and the texture of a run.
    pub(crate) fn set_run(&self, pass: &mut wgpu::RenderPass<'_>, pipelines: &Pipelines, run: &Run) {
        let batch = &self.batches[run.batch];
        let is_open = self.excerpt.section.is_some();
        let &Batch { double_sided, cut_out, detailed, .. } = batch;
        let (double_sided, cut_out) = (double_sided || is_open && pipelines.opens(), cut_out || is_open);
        pass.set_pipeline(pipelines.of(Variant { double_sided, mirrored: run.mirrored, cut_out, detailed }));
        pass.set_bind_group(2, &self.texture_groups[batch.texture], &[]);
    }

    /// Where the triangles of a run's instances begin in the index buffer, and how many each of them has.
    pub(crate) fn triangles_of(&self, run: &Run) -> (u32, u32) {
        let batch = &self.batches[run.batch];
        (batch.first_index, batch.index_count / 3)
    }

    /// What `camera` may see of the objects that are drawn.
    pub(crate) fn visible_runs(&self, camera: &Pinhole, is_drawn: &dyn Fn(u16) -> bool) -> Vec<Run> {
        let frustum = Frustum::new(camera);
        self.runs(camera.world_from_eye.translation, is_drawn, |bounds| frustum.may_see(bounds))
    }

    /// The objects that are drawn and whose bounds `may_see` lets through, opaque first and near first, so that what is hidden
    /// fails the depth test before it is shaded.
    pub(crate) fn runs(
        &self,
        eye_world: DVec3,
        is_drawn: &dyn Fn(u16) -> bool,
        may_see: impl Fn(&Bounds) -> bool,
    ) -> Vec<Run> {
        let mut runs: Vec<Run> = Vec::new();
        for (batch_index, batch) in self.batches.iter().enumerate() {
            for slot in batch.slots.clone() {
                let Slot { object, bounds_world: bounds, .. } = &self.slots[slot as usize];
                let is_there = self.excerpt.parts.shows(*object as u16);
                if !is_there || !is_drawn(*object as u16) || !may_see(bounds) {
                    continue;
                }
                let mirrored = self.records[slot as usize].flags & InstanceRecord::MIRRORED != 0;
                let distance_m = eye_world.distance(eye_world.clamp(bounds.min, bounds.max));
                match runs.last_mut() {
                    Some(run) if run.batch == batch_index && run.slots.end == slot && run.mirrored == mirrored => {
                        run.slots.end += 1;
                        run.distance_m = run.distance_m.min(distance_m);
                    }
                    _ => runs.push(Run { batch: batch_index, slots: slot..slot + 1, mirrored, distance_m }),
                }
            }
        }
        let cut_out = |run: &Run| self.batches[run.batch].cut_out;
        runs.sort_by(|a, b| cut_out(a).cmp(&cut_out(b)).then(a.distance_m.total_cmp(&b.distance_m)));
        runs
    }

    /// Draws a run as the renderer tells triangles: with the groups and buffers of [`SceneRenderer::draw`].
    pub(crate) fn draw_run(&self, pass: &mut wgpu::RenderPass<'_>, run: &Run) {
        let batch = &self.batches[run.batch];
        if self.native {
            let indices = batch.first_index..batch.first_index + batch.index_count;
            pass.draw_indexed(indices, batch.first_vertex as i32, run.slots.clone());
        } else {
            self.draw_pulled(pass, run);
        }
    }

    /// Draws a run by a vertex stage that pulls its corners.
    pub(crate) fn draw_pulled(&self, pass: &mut wgpu::RenderPass<'_>, run: &Run) {
        let batch = &self.batches[run.batch];
        pass.draw(batch.first_index..batch.first_index + batch.index_count, run.slots.clone());
    }

    /// Group 1 for vertex stages that pull corners, whether or not this renderer's own do.
    ///
    /// # Errors
    /// [`RenderError::TooLarge`] where vertices or indices are too large to be pulled on this GPU.
    pub(crate) fn pulled_group(&self) -> Result<wgpu::BindGroup, RenderError> {
        let limit = self.gpu.device.limits().max_storage_buffer_binding_size;
        for (what, buffer) in [("vertices", &self.vertices), ("indices", &self.indices)] {
            if buffer.size() > limit {
                return Err(RenderError::TooLarge { what, bytes: buffer.size(), limit });
            }
        }
        let layout = Layouts::new(&self.gpu, false).scene;
        let bound = [&self.instances, &self.surfaces, &self.second_uvs, &self.section, &self.vertices, &self.indices];
        Ok(pipelines::scene_group(&self.gpu, &layout, &bound))
    }

    fn upload_deformed(&mut self, object: u32, vertices: &[Vertex]) {
        let Some(&batch) = self.batch_of_deforming.get(&object) else { return };
        let batch = &self.batches[batch];
        if vertices.len() != batch.vertex_count as usize {
            tracing::warn!("object {object} deformed to {} vertices instead of {}", vertices.len(), batch.vertex_count);
            return;
        }
        let offset = u64::from(batch.first_vertex) * size_of::<Vertex>() as u64;
        self.gpu.queue.write_buffer(&self.vertices, offset, bytemuck::cast_slice(vertices));
        self.slots[batch.slots.start as usize].bounds_mesh = cull::mesh_bounds(vertices);
    }
}

/// Refuses a camera that would not be valid on this GPU.
pub(crate) fn check_camera(gpu: &Gpu, camera: &Pinhole) -> Result<(), RenderError> {
    let limit_px = gpu.device.limits().max_texture_dimension_2d;
    let (width_px, height_px) = (camera.width_px, camera.height_px);
    let fits = camera.is_valid() && width_px <= limit_px && height_px <= limit_px;
    if fits { Ok(()) } else { Err(RenderError::Camera { width_px, height_px }) }
}

/// Writes where an instance is.
fn place(record: &mut InstanceRecord, world_from_mesh: &DAffine3, anchor_world: DVec3) {
    let linear = world_from_mesh.matrix3;
    let offset = world_from_mesh.translation - anchor_world;
    let rows = linear.transpose();
    let row = |row: DVec3, offset: f64| row.as_vec3().extend(offset as f32).to_array();
    record.anchor_from_mesh_x = row(rows.x_axis, offset.x);
    record.anchor_from_mesh_y = row(rows.y_axis, offset.y);
    record.anchor_from_mesh_z = row(rows.z_axis, offset.z);
    let normal_rows = normal_matrix(linear).transpose();
    record.world_normal_from_mesh_x = row(normal_rows.x_axis, 0.0);
    record.world_normal_from_mesh_y = row(normal_rows.y_axis, 0.0);
    record.world_normal_from_mesh_z = row(normal_rows.z_axis, 0.0);
    let mirrored = if linear.determinant() < 0.0 { InstanceRecord::MIRRORED } else { 0 };
    record.flags = record.flags & !InstanceRecord::MIRRORED | mirrored;
}

#[cfg(test)]
mod tests {
    use super::*;
    use shaders::assert_layout;

    #[test]
    fn records_are_laid_out_as_in_wgsl() {
        assert_layout!(
            InstanceRecord,
            "server/scene.wgsl",
            "Instance",
            anchor_from_mesh_x,
            anchor_from_mesh_y,
            anchor_from_mesh_z,
            world_normal_from_mesh_x,
            world_normal_from_mesh_y,
            world_normal_from_mesh_z,
            triangle_base,
            object,
            material,
            flags,
            first_vertex,
            first_index,
            tint,
            faces
        );
    }
}
