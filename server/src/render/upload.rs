//! From a [`Scene`] to buffers, textures and batches.

use std::collections::{BTreeMap, BTreeSet, HashMap};

use bytemuck::Zeroable;
use gpu::Gpu;
use protocol::staging::Excerpt;
use rayon::prelude::*;
use scene::model::{Texture, Wrap};
use scene::{Bounds, Mesh, Scene, Vertex};
use wgpu::util::DeviceExt;

use super::layers::Layers;
use super::materials::{SurfaceMaterial, Tables};
use super::palette::CodeMap;
use super::pipelines::scene_group;
use super::texture::{CodeLevel, Content};

use super::{
    Batch, Blended, Detail, InstanceRecord, Layouts, LeftOut, RenderError, SceneRenderer, Slot, cull, materials, rgba,
    texture,
};

/// Where a mesh, or the copy of a deforming instance, begins in the buffers.
#[derive(Debug, Clone, Copy)]
struct Placed {
    first_vertex: u32,
    vertex_count: u32,
    first_index: u32,
    index_count: u32,
}

/// Vertices and indices of all meshes, one after the other; deforming instances have vertices of their own.
struct Geometry {
    vertices: Vec<Vertex>,
    /// As many, where any mesh has some; else none.
    second_uvs: Vec<[f32; 2]>,
    indices: Vec<u32>,
    meshes: Vec<Placed>,
    deforming: HashMap<u32, Placed>,
}

impl Geometry {
    fn new(scene: &Scene) -> Geometry {
        let mut geometry = Geometry {
            vertices: Vec::new(),
            second_uvs: Vec::new(),
            indices: Vec::new(),
            meshes: Vec::new(),
            deforming: HashMap::new(),
        };
        for mesh in &scene.meshes {
            let first_vertex = geometry.append(mesh);
            let placed = Placed {
                first_vertex,
                vertex_count: mesh.vertices.len() as u32,
                first_index: geometry.indices.len() as u32,
                index_count: mesh.indices.len() as u32,
            };
            geometry.indices.extend_from_slice(&mesh.indices);
            geometry.meshes.push(placed);
        }
        for (object, instance) in scene.instances.iter().enumerate().filter(|(_, instance)| instance.deforms) {
            let first_vertex = geometry.append(&scene.meshes[instance.mesh as usize]);
            let placed = Placed { first_vertex, ..geometry.meshes[instance.mesh as usize] };
            geometry.deforming.insert(object as u32, placed);
        }
        geometry
    }

    fn append(&mut self, mesh: &Mesh) -> u32 {
        let first = self.vertices.len();
        self.vertices.extend_from_slice(&mesh.vertices);
        if !mesh.second_uvs.is_empty() {
            self.second_uvs.resize(first, [0.0; 2]);
            self.second_uvs.extend_from_slice(&mesh.second_uvs);
        }
        first as u32
    }
}

/// Whether some of its fragments may be dropped: by their alpha, or of a pane as they are of another layer.
fn is_cut_out(material: &scene::Material) -> bool {
    material.alpha_cutoff.is_some() || material.is_pane()
}

/// Instances in the order in which they are drawn: those of one batch together.
fn batches(
    scene: &Scene,
    geometry: &Geometry,
    distinct: &[Textures],
    surfaces: &[SurfaceMaterial],
) -> (Vec<Batch>, Vec<Slot>, Vec<InstanceRecord>) {
    let triangle_bases = triangle_bases(scene);
    let mut order: Vec<u32> = (0..scene.instances.len() as u32).collect();
    let material_of = |object: u32| scene.meshes[scene.instances[object as usize].mesh as usize].material;
    order.sort_by_key(|&object| {
        let instance = &scene.instances[object as usize];
        let material = &scene.materials[material_of(object) as usize];
        // Opaque first; then as few changes of state as can be.
        let textures = textures_of(scene, material_of(object));
        let state = (is_cut_out(material), material.double_sided, textures);
        (state, instance.mesh, instance.deforms, object)
    });
    let (mut batches, mut slots, mut records) = (Vec::<Batch>::new(), Vec::new(), Vec::new());
    let mut last: Option<(u32, bool)> = None;
    for object in order {
        let instance = &scene.instances[object as usize];
        let mesh = &scene.meshes[instance.mesh as usize];
        let material = &scene.materials[mesh.material as usize];
        let placed = geometry.deforming.get(&object).unwrap_or(&geometry.meshes[instance.mesh as usize]);
        if instance.deforms || last != Some((instance.mesh, false)) {
            batches.push(Batch {
                first_index: placed.first_index,
                index_count: placed.index_count,
                first_vertex: placed.first_vertex,
                vertex_count: placed.vertex_count,
                slots: slots.len() as u32..slots.len() as u32,
                texture: distinct.binary_search(&textures_of(scene, mesh.material)).expect("all that differ are there"),
                cut_out: is_cut_out(material),
                detailed: surfaces[mesh.material as usize].is_detailed(),
                double_sided: material.double_sided,
            });
            last = Some((instance.mesh, instance.deforms));
        }
        let bounds_mesh = cull::mesh_bounds(&mesh.vertices);
        slots.push(Slot { object, batch: batches.len() - 1, bounds_mesh, bounds_world: Bounds::EMPTY });
        records.push(InstanceRecord {
            triangle_base: triangle_bases[object as usize],
            object,
            material: mesh.material,
            first_vertex: placed.first_vertex,
            first_index: placed.first_index,
            tint: rgba(instance.tint),
            ..InstanceRecord::zeroed()
        });
        if let Some(batch) = batches.last_mut() {
            batch.slots.end = slots.len() as u32;
        }
    }
    (batches, slots, records)
}

/// The id of each instance's first triangle.
pub(crate) fn triangle_bases(scene: &Scene) -> Vec<u32> {
    let triangles =
        scene.instances.iter().map(|instance| scene.meshes[instance.mesh as usize].indices.len() as u32 / 3);
    let base = |next: &mut u32, count: u32| {
        let base = *next;
        *next += count;
        Some(base)
    };
    triangles.scan(1, base).collect()
}

fn check(gpu: &Gpu, scene: &Scene, geometry: &Geometry) -> Result<(), RenderError> {
    if scene.instances.len() > usize::from(u16::MAX) {
        return Err(RenderError::TooManyInstances(scene.instances.len()));
    }
    if scene.triangle_count() >= u64::from(u32::MAX) {
        return Err(RenderError::TooManyTriangles(scene.triangle_count()));
    }
    let limit = gpu.device.limits().max_buffer_size;
    let sizes = [
        ("vertices", size_of_val(geometry.vertices.as_slice()) as u64),
        ("indices", size_of_val(geometry.indices.as_slice()) as u64),
    ];
    let too_large = sizes.into_iter().find(|(_, bytes)| *bytes > limit);
    too_large.map_or(Ok(()), |(what, bytes)| Err(RenderError::TooLarge { what, bytes, limit }))
}

impl SceneRenderer {
    pub(super) fn upload(
        gpu: &Gpu,
        scene: &Scene,
        (native, varied): (bool, bool),
    ) -> Result<SceneRenderer, RenderError> {
        let geometry = Geometry::new(scene);
        check(gpu, scene, &geometry)?;
        let layouts = Layouts::new(gpu, native);
        let distinct = distinct_textures(scene);
        let Tables { surfaces: surface_materials, table: material_table, code_maps, kinds } =
            materials::tables(scene, varied);
        let (batches, slots, records) = batches(scene, &geometry, &distinct, &surface_materials);
        let buffer = |label, contents: &[u8], usage| {
            // An empty scene still needs buffers to bind.
            let contents = if contents.is_empty() { &[0; size_of::<InstanceRecord>()] } else { contents };
            let usage = usage | wgpu::BufferUsages::STORAGE;
            gpu.device.create_buffer_init(&wgpu::util::BufferInitDescriptor { label: Some(label), contents, usage })
        };
        let copied = wgpu::BufferUsages::COPY_DST;
        let vertices =
            buffer("vertices", bytemuck::cast_slice(&geometry.vertices), wgpu::BufferUsages::VERTEX | copied);
        let indices = buffer("indices", bytemuck::cast_slice(&geometry.indices), wgpu::BufferUsages::INDEX);
        let instances = buffer("instances", bytemuck::cast_slice(&records), copied);
        let surfaces =
            buffer("surface materials", bytemuck::cast_slice::<SurfaceMaterial, u8>(&surface_materials), copied);
        let second_uvs = buffer(
            "second texture coordinates",
            bytemuck::cast_slice(&geometry.second_uvs),
            wgpu::BufferUsages::empty(),
        );
        let section = section_buffer(gpu);
        let bound = [&instances, &surfaces, &second_uvs, &section, &vertices, &indices];
        let scene_group = scene_group(gpu, &layouts.scene, &bound[..if native { 4 } else { 6 }]);
        let batch_of_deforming = slots
            .iter()
            .filter(|slot| geometry.deforming.contains_key(&slot.object))
            .map(|slot| (slot.object, slot.batch))
            .collect();
        let mut renderer = SceneRenderer {
            texture_groups: texture_groups(gpu, scene, &layouts, (&distinct, &code_maps)),
            gpu: gpu.clone(),
            layouts,
            native,
            vertices,
            second_uvs,
            indices,
            instances,
            surfaces,
            section,
            surface_materials,
            blended: Layers::of(scene),
            detail: Detail::Motion,
            shown: Blended::default(),
            is_smooth: false,
            scene_group,
            batches,
            slots,
            records,
            batch_of_deforming,
            material_table,
            kinds,
            anchor_world: glam::DVec3::ZERO,
            rays: None,
            left_out: LeftOut::default(),
            excerpt: Excerpt::default(),
        };
        renderer.update(&scene.at(0.0), scene.bounds.centre())?;
        Ok(renderer)
    }

    /// Another one of the same scene, which shares with this one what never changes, so that each may draw it at a time and in a way of its own. `None`
    /// where vertices deform, or rays are followed.
    pub fn twin(&self) -> Option<SceneRenderer> {
        if !self.batch_of_deforming.is_empty() || self.rays.is_some() {
            return None;
        }
        let own = |of: &wgpu::Buffer, label| {
            let usage = of.usage();
            let own = wgpu::BufferDescriptor { label: Some(label), size: of.size(), usage, mapped_at_creation: false };
            self.gpu.device.create_buffer(&own)
        };
        let (instances, surfaces) = (own(&self.instances, "instances"), own(&self.surfaces, "surface materials"));
        self.gpu.queue.write_buffer(&instances, 0, bytemuck::cast_slice(&self.records));
        self.gpu.queue.write_buffer(&surfaces, 0, bytemuck::cast_slice(&self.surface_materials));
        let section = section_buffer(&self.gpu);
        let bound = [&instances, &surfaces, &self.second_uvs, &section, &self.vertices, &self.indices];
        let scene_group = scene_group(&self.gpu, &self.layouts.scene, &bound[..if self.native { 4 } else { 6 }]);
        Some(SceneRenderer {
            gpu: self.gpu.clone(),
            layouts: self.layouts.clone(),
            native: self.native,
            vertices: self.vertices.clone(),
            second_uvs: self.second_uvs.clone(),
            indices: self.indices.clone(),
            instances,
            surfaces,
            section,
            surface_materials: self.surface_materials.clone(),
            blended: self.blended.clone(),
            detail: Detail::Motion,
            shown: self.shown,
            is_smooth: false,
            scene_group,
            texture_groups: self.texture_groups.clone(),
            batches: self.batches.clone(),
            slots: self.slots.clone(),
            records: self.records.clone(),
            batch_of_deforming: self.batch_of_deforming.clone(),
            material_table: self.material_table.clone(),
            kinds: self.kinds.clone(),
            anchor_world: self.anchor_world,
            rays: None,
            left_out: LeftOut::default(),
            excerpt: Excerpt::default(),
        })
    }
}

/// Of a plane that cuts the scene open: none yet, see [`SceneRenderer::show`].
fn section_buffer(gpu: &Gpu) -> wgpu::Buffer {
    gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("section"),
        size: size_of::<[f32; 4]>() as u64,
        usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    })
}

/// What a material is drawn with: the textures of base colours and of normals, and the material whose codes lie as its own, itself.
type Textures = [Option<u32>; 3];

fn textures_of(scene: &Scene, material: u32) -> Textures {
    let own = &scene.materials[material as usize];
    [own.texture, own.bumps.map(|bumps| bumps.texture), (!own.maps.is_empty()).then_some(material)]
}

/// Those that differ, in the order in which they are drawn.
fn distinct_textures(scene: &Scene) -> Vec<Textures> {
    let distinct: BTreeSet<Textures> =
        (0..scene.materials.len() as u32).map(|material| textures_of(scene, material)).collect();
    distinct.into_iter().collect()
}

/// One bind group for each that differ; white and level where a material has none.
fn texture_groups(
    gpu: &Gpu,
    scene: &Scene,
    layouts: &Layouts,
    (distinct, code_maps): (&[Textures], &[Option<CodeMap>]),
) -> Vec<wgpu::BindGroup> {
    let plain = |texel: [u8; 4], content| {
        let rgba = texel.to_vec();
        let texture = Texture { width_px: 1, height_px: 1, rgba, wrap: [Wrap::Repeat; 2], nearest: false };
        texture::upload(gpu, &texture, content, &texture::levels(&texture, content))
    };
    let [white, level] = [plain([255; 4], Content::Colours(None)), plain([128, 128, 255, 255], Content::Numbers)];
    let no_codes = texture::upload_codes(gpu, &[CodeLevel { width_px: 1, height_px: 1, codes: vec![0] }]);
    let uses = uses(scene);
    let levels: Vec<_> = uses
        .par_iter()
        .map(|(&(texture, _), &content)| texture::levels(&scene.textures[texture as usize], content))
        .collect();
    let uploaded: BTreeMap<(u32, bool), _> = uses
        .iter()
        .zip(&levels)
        .map(|((&key, &content), levels)| (key, texture::upload(gpu, &scene.textures[key.0 as usize], content, levels)))
        .collect();
    let of = |texture: Option<u32>, is_normal: bool| texture.and_then(|texture| uploaded.get(&(texture, is_normal)));
    let group = |&[base, normals, codes]: &Textures| {
        let (base, normals) = (of(base, false).unwrap_or(&white), of(normals, true).unwrap_or(&level));
        let codes = codes.and_then(|material| code_maps[material as usize].as_ref());
        let codes = [0, 1].map(|set| Some(texture::upload_codes(gpu, &codes?.sets[set].as_ref()?.levels)));
        let resources = [base, normals].into_iter().flat_map(|(view, sampler)| {
            [wgpu::BindingResource::TextureView(view), wgpu::BindingResource::Sampler(sampler)]
        });
        let codes =
            codes.each_ref().map(|codes| wgpu::BindingResource::TextureView(codes.as_ref().unwrap_or(&no_codes)));
        let entries: Vec<_> = resources
            .chain(codes)
            .zip(0..)
            .map(|(resource, binding)| wgpu::BindGroupEntry { binding, resource })
            .collect();
        gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("textures"),
            layout: &layouts.texture,
            entries: &entries,
        })
    };
    distinct.iter().map(group).collect()
}

/// What textures hold, by their index and whether that is normals; one may serve as both.
fn uses(scene: &Scene) -> BTreeMap<(u32, bool), Content> {
    let mut uses = BTreeMap::new();
    for material in &scene.materials {
        if let Some(texture) = material.texture {
            // The alpha of what is blended is a share, and stays one.
            let own = material.alpha_cutoff.filter(|_| !material.see_through);
            let cutoff = match uses.get(&(texture, false)) {
                Some(Content::Colours(Some(known))) => Some(own.map_or(*known, |cutoff| cutoff.min(*known))),
                _ => own,
            };
            uses.insert((texture, false), Content::Colours(cutoff));
        }
        if let Some(bumps) = material.bumps {
            uses.insert((bumps.texture, true), Content::Numbers);
        }
    }
    uses
}
