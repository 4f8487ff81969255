//! The image of a single-pole occlusion camera (`camera::Spoc`): triangles are cut into pieces, whose corners are
//! pushed.
//!
//! **Cutting.** A first pass gives every edge a level, the number of pieces that it is cut into, and every triangle one
//! for its inside, no less than any of its edges'. Pieces are evenly spaced in space and form a lattice; what lies on
//! an edge is moved to the nearest step of the edge's own level. Rows stay in order, so pieces do not overlap, and some
//! are empty. The level of an edge and the points on it are computed from its two ends alone, from the same one first,
//! so that the triangles on both sides have the same points and no gap is between them. Most triangles of real files
//! are smaller than a pixel or two and are one piece; what is not seen is none. A second pass counts pieces, a vertex
//! stage finds its triangle by bisection.
//!
//! **Bound.** Let `x(s)` be a straight line in the pinhole's image, from the pole, by its length; `rho = |x|`, `e =
//! x/rho`, `D` the push, `m = |dD/ds|`, constant while it grows as `w` is linear in the image. The image is `x + D e`
//! outside of the ramp, with a second derivative of `2 D' e' + D e''`, where `|e'| <= 1/rho` and `|e''| <= 2/(sqrt(3)
//! rho^2)`: with `c` the sine between line and `e`, `|e''|^2 = (4 c^2 - 3 c^4)/rho^4`. Inside it is `x (1 + D/rho_0)`,
//! and the second derivative `2 D'/rho_0`. The slope jumps by `m` where the push begins and ends, and by `D
//! |rho'|/rho_0` at the border of the ramp. A chord of length `h` is off by at most `h^2/8` times the second derivative
//! and `h/4` times the jumps on it. For an edge cut into `N`, with `H = N h`, `M = m H`, `rho = max(rho_min, rho_0)`:
//!
//! `error <= A/(4 N^2) + B/(4 N)`, `A = M H/rho + D H^2/(sqrt(3) rho^2)`, `B = kinks M + H D |rho'|/rho_0`,
//!
//! `D` and its term in `A` only where the edge leaves the ramp, in `B` only where it crosses its border. A quarter of a
//! pixel takes `N = (B + sqrt(B^2 + 4 A))/2`. Steps are even in space and not in the image, so `H` and `M` are as if
//! all of the edge went by as fast as at its nearest point: times the ratio of its depths. What lies nearer than where
//! the push begins is exact and left out. Inside of a triangle `A` is a third more: there a point is up to `h/sqrt(3)`,
//! not `h/2`, from the nearest corner. A triangle that reaches before the push is taken to be as fast inside as along
//! its edges.
//!
//! Levels end at [`LEVEL_CAP`], so an edge of more pixels than that across the border of the ramp is off by up to `H
//! D/(4 rho_0 LEVEL_CAP)`.
//!
//! **Depth.** In a piece `w` is linear in the image, and so off by what a quarter of a pixel makes on the triangle's
//! slope: a sample's point lies on its triangle's plane within a quarter of its footprint on it. Normals, texture
//! coordinates and colours are interpolated with perspective within each piece.

use bytemuck::{Pod, Zeroable};
use camera::Spoc;
use gpu::Gpu;
use wgpu::util::DeviceExt;

use super::frame::Frame;
use crate::render::{Layouts, RenderError, Run, SceneRenderer, buffer_entry};

/// The most pieces that an edge is cut into.
pub const LEVEL_CAP: u32 = 128;

/// `Push` of `camera/spoc.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
struct PushUniform {
    pole_px: [f32; 2],
    from_m: f32,
    to_m: f32,
    from_w: f32,
    to_w: f32,
    max_px: f32,
    ramp_px: f32,
}

impl PushUniform {
    fn new(camera: &Spoc) -> PushUniform {
        PushUniform {
            pole_px: camera.pole_px.as_vec2().to_array(),
            from_m: camera.push_from_m as f32,
            to_m: camera.push_to_m as f32,
            from_w: camera.push_from_m.recip() as f32,
            to_w: camera.push_to_m.recip() as f32,
            max_px: camera.push_max_px as f32,
            ramp_px: camera.ramp_px as f32,
        }
    }
}

/// `Split` of `server/split.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
struct SplitUniform {
    push: PushUniform,
    item_count: u32,
    run_count: u32,
    level_cap: u32,
    padding: u32,
}

/// `SplitRun` of `server/split_levels.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
struct SplitRun {
    first_item: u32,
    triangles: u32,
    first_instance: u32,
    first_index: u32,
}

/// Bytes of an `Item` of `server/split.wgsl`.
const ITEM_BYTES: u64 = 12;
/// Bytes of a draw call's arguments.
const CALL_BYTES: u64 = size_of::<wgpu::util::DrawIndirectArgs>() as u64;
/// Items of one group of `cut`.
const GROUP_ITEMS: u32 = 64;
/// What every device takes.
const MOST_GROUPS: u32 = 65_535;

/// Draws images of single-pole cameras.
pub(super) struct SpocPass {
    gpu: Gpu,
    /// Group 3 of the vertex stage, and of the passes before.
    draw_layout: wgpu::BindGroupLayout,
    cut_layout: wgpu::BindGroupLayout,
    cut: wgpu::ComputePipeline,
    count: wgpu::ComputePipeline,
}

/// What one image's passes share.
struct Split {
    runs: Vec<Run>,
    item_count: u32,
    calls: wgpu::Buffer,
    draw_group: wgpu::BindGroup,
    cut_group: wgpu::BindGroup,
}

impl SpocPass {
    pub fn new(gpu: &Gpu) -> Result<SpocPass, RenderError> {
        if !gpu.caps.compute {
            return Err(RenderError::NoCompute);
        }
        let (vertex, compute) = (wgpu::ShaderStages::VERTEX, wgpu::ShaderStages::COMPUTE);
        let storage = |read_only| wgpu::BufferBindingType::Storage { read_only };
        let layout = |label, entries: &[wgpu::BindGroupLayoutEntry]| {
            gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: Some(label), entries })
        };
        let draw_layout = layout(
            "pieces",
            &[
                buffer_entry(0, vertex, wgpu::BufferBindingType::Uniform),
                buffer_entry(1, vertex, storage(true)),
                buffer_entry(2, vertex, storage(true)),
            ],
        );
        let cut_layout = layout(
            "cutting",
            &[
                buffer_entry(0, compute, wgpu::BufferBindingType::Uniform),
                buffer_entry(1, compute, storage(false)),
                buffer_entry(2, compute, storage(false)),
                buffer_entry(3, compute, storage(true)),
                buffer_entry(4, compute, storage(false)),
            ],
        );
        let shared = Layouts::new(gpu, false);
        let module = gpu.shader("server/split_levels.wgsl")?;
        let pipeline_layout = gpu.device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some("cutting"),
            bind_group_layouts: &[Some(&shared.view), Some(&shared.scene), None, Some(&cut_layout)],
            immediate_size: 0,
        });
        let pipeline = |entry| {
            gpu.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
                label: Some(entry),
                layout: Some(&pipeline_layout),
                module: &module,
                entry_point: Some(entry),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                cache: None,
            })
        };
        let (cut, count) = (pipeline("cut"), pipeline("count"));
        Ok(SpocPass { gpu: gpu.clone(), draw_layout, cut_layout, cut, count })
    }

    /// Group 3 of the pass that draws.
    pub fn layout(&self) -> &wgpu::BindGroupLayout {
        &self.draw_layout
    }

    pub fn draw(&self, frame: &mut Frame<'_>, camera: &Spoc) -> Result<(), RenderError> {
        let scene = frame.scene;
        let (view, pulled) = (scene.view_group(&camera.pinhole), scene.pulled_group()?);
        let split = self.split(scene, camera, frame.subject.objects)?;
        {
            let writes = frame.timer.as_ref().map(|timer| timer.writes(0));
            let mut pass = frame.encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
                label: Some("cutting"),
                timestamp_writes: writes.map(|writes| wgpu::ComputePassTimestampWrites {
                    query_set: writes.query_set,
                    beginning_of_pass_write_index: writes.beginning_of_pass_write_index,
                    end_of_pass_write_index: writes.end_of_pass_write_index,
                }),
            });
            if split.item_count > 0 {
                for (group, bound) in [(0, &view), (1, &pulled), (3, &split.cut_group)] {
                    pass.set_bind_group(group, bound, &[]);
                }
                pass.set_pipeline(&self.cut);
                pass.dispatch_workgroups(split.item_count.div_ceil(GROUP_ITEMS).min(MOST_GROUPS), 1, 1);
                pass.set_pipeline(&self.count);
                pass.dispatch_workgroups(1, 1, 1);
            }
        }
        let writes = frame.timer.as_ref().map(|timer| timer.writes(1));
        let mut pass = frame.attachments.begin(&mut frame.encoder, 0, [0.0; 3], writes);
        scene.begin(&mut pass, (camera.pinhole.width_px, camera.pinhole.height_px), &view);
        pass.set_bind_group(1, &pulled, &[]);
        pass.set_bind_group(3, &split.draw_group, &[]);
        for (run, call) in split.runs.iter().zip(0..) {
            scene.set_run(&mut pass, frame.pipelines, run);
            pass.draw_indirect(&split.calls, call * CALL_BYTES);
        }
        Ok(())
    }

    fn split(
        &self,
        scene: &SceneRenderer,
        camera: &Spoc,
        is_drawn: &dyn Fn(u16) -> bool,
    ) -> Result<Split, RenderError> {
        let mut runs =
            scene.runs(camera.pinhole.world_from_eye.translation, is_drawn, |bounds| may_see(camera, bounds));
        runs.retain(|run| scene.triangles_of(run).1 > 0);
        let mut item_count = 0_u64;
        let mut table: Vec<SplitRun> = Vec::with_capacity(runs.len() + 1);
        for run in &runs {
            let (first_index, triangles) = scene.triangles_of(run);
            table.push(SplitRun {
                first_item: item_count as u32,
                triangles,
                first_instance: run.slots.start,
                first_index,
            });
            item_count += run.slots.len() as u64 * u64::from(triangles);
        }
        let limit = self.gpu.device.limits().max_storage_buffer_binding_size;
        let bytes = item_count * ITEM_BYTES;
        if bytes > limit {
            return Err(RenderError::TooLarge { what: "triangles in view", bytes, limit });
        }
        let item_count = item_count as u32;
        table.push(SplitRun { first_item: item_count, ..SplitRun::zeroed() });
        let uniform = SplitUniform {
            push: PushUniform::new(camera),
            item_count,
            run_count: runs.len() as u32,
            level_cap: level_cap(item_count),
            padding: 0,
        };
        let (calls, groups) = self.buffers(&uniform, &table);
        let [draw_group, cut_group] = groups;
        Ok(Split { runs, item_count, calls, draw_group, cut_group })
    }

    /// The calls' arguments, and group 3 of the pass that draws and of those before.
    fn buffers(&self, uniform: &SplitUniform, table: &[SplitRun]) -> (wgpu::Buffer, [wgpu::BindGroup; 2]) {
        let device = &self.gpu.device;
        let filled = |label, contents, usage| {
            device.create_buffer_init(&wgpu::util::BufferInitDescriptor { label: Some(label), contents, usage })
        };
        let empty = |label, size, usage| {
            let usage = wgpu::BufferUsages::STORAGE | usage;
            device.create_buffer(&wgpu::BufferDescriptor { label: Some(label), size, usage, mapped_at_creation: false })
        };
        let none = wgpu::BufferUsages::empty();
        let uniform_buffer = filled("cutting", bytemuck::bytes_of(uniform), wgpu::BufferUsages::UNIFORM);
        let runs = filled("runs", bytemuck::cast_slice(table), wgpu::BufferUsages::STORAGE);
        let items = empty("triangles", u64::from(uniform.item_count.max(1)) * ITEM_BYTES, none);
        let starts = empty("first pieces", (u64::from(uniform.item_count) + 1) * 4, none);
        let calls = empty("calls", table.len() as u64 * CALL_BYTES, wgpu::BufferUsages::INDIRECT);
        let bound = [&uniform_buffer, &items, &starts, &runs, &calls];
        let group = |label, layout, count: usize| {
            let entries: Vec<_> = (0_u32..)
                .zip(&bound[..count])
                .map(|(binding, buffer)| wgpu::BindGroupEntry { binding, resource: buffer.as_entire_binding() })
                .collect();
            device.create_bind_group(&wgpu::BindGroupDescriptor { label: Some(label), layout, entries: &entries })
        };
        let groups = [group("pieces", &self.draw_layout, 3), group("cutting", &self.cut_layout, 5)];
        (calls, groups)
    }
}

/// So many that even if every edge is cut so, 32 bits count the corners of all pieces.
fn level_cap(item_count: u32) -> u32 {
    let pieces = u32::MAX / 3 / item_count.max(1);
    pieces.isqrt().clamp(1, LEVEL_CAP)
}

/// Whether some of a box may be in the image.
fn may_see(camera: &Spoc, bounds: &scene::Bounds) -> bool {
    if bounds.is_empty() {
        return false;
    }
    let image = camera.image_bounds(&camera::Bounds { min: bounds.min, max: bounds.max });
    let (width_px, height_px) = (f64::from(camera.pinhole.width_px), f64::from(camera.pinhole.height_px));
    // Rounding in f32 on the GPU must not find what this dropped: not by a pixel.
    image.is_some_and(|image| {
        image.max_px.x > -1.0
            && image.max_px.y > -1.0
            && image.min_px.x < width_px + 1.0
            && image.min_px.y < height_px + 1.0
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn uniforms_are_laid_out_as_in_wgsl() {
        let path = "server/split_levels.wgsl";
        shaders::assert_layout!(PushUniform, path, "Push", pole_px, from_m, to_m, from_w, to_w, max_px, ramp_px);
        shaders::assert_layout!(SplitUniform, path, "Split", push, item_count, run_count, level_cap);
        shaders::assert_layout!(SplitRun, path, "SplitRun", first_item, triangles, first_instance, first_index);
    }

    #[test]
    fn pieces_are_counted_in_32_bits() {
        assert_eq!(level_cap(0), LEVEL_CAP);
        for items in [1, 87_000, 90_000, 1 << 24, u32::MAX] {
            let cap = u64::from(level_cap(items));
            assert!(cap >= 1 && (cap == 1 || u64::from(items) * 3 * cap * cap <= u64::from(u32::MAX)), "{items}");
        }
    }
}
