//! The image of a graph camera (`camera::GraphCamera`): the scene drawn once for each frustum, into one image.
//!
//! A frustum's projection takes triangles to triangles, so nothing is cut; `1/w` is the fourth coordinate of the clip
//! position, in one measure for all frusta, so one depth buffer serves them all, and what lies behind a centre or
//! before the root's near plane is clipped as ever. Each frustum draws the objects whose boxes meet it, and keeps the
//! fragments that lie inside.
//!
//! **Walls on planes.** In a maze the walls of corridors *are* the planes of frusta: every fragment of them lies on
//! one, up to rounding, and must be kept. An offset from the centre is a product of three terms and a sum, rounded at
//! each step, then interpolated (three weights, whose sum is 1 up to rounding), then multiplied with the plane: some
//! sixteen roundings of numbers no larger than the point and the centre are from the anchor. So a fragment counts as
//! inside up to 32 times `2^-24` of the sum of both, twice as much: 0.1 mm at 50 m. What is let in too much lies before
//! or behind the same plane by as little, and in the same pixel of the frusta on both sides, as the image is
//! continuous.

use bytemuck::{Pod, Zeroable};
use camera::{Frustum, GraphCamera, Pinhole, Rigid};
use glam::DVec3;
use gpu::Gpu;
use gpu::uniforms::columns;
use wgpu::util::DeviceExt;

use super::frame::Frame;
use crate::render::{RenderError, buffer_entry};

/// The planes that a frustum may have: its face, and as many sides and limits as the camera allows.
const PLANE_CAP: usize = 1 + 2 * GraphCamera::MAX_PLANES;

/// How many roundings a fragment's depth inside of a plane is allowed. See the module's words.
const ROUNDINGS: f64 = 32.0;

/// `GraphFrustum` of `server/raster_graph.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
struct FrustumUniform {
    image_from_offset: [[f32; 4]; 3],
    size_px: [f32; 2],
    depth_q: f32,
    plane_count: u32,
    slack_per_m: f32,
    slack_m: f32,
    padding: [f32; 2],
    planes: [[f32; 4]; PLANE_CAP],
}

impl FrustumUniform {
    fn new(root: &Pinhole, frustum: &Frustum, anchor_world: DVec3) -> FrustumUniform {
        let projection = frustum.clip_from_offset();
        let half_spaces = frustum.half_spaces_world();
        let centre_world = frustum.centre_world();
        let slack_per_m = ROUNDINGS / f64::from(1 << 24);
        let mut planes = [[0.0; 4]; PLANE_CAP];
        for (plane, half_space) in planes.iter_mut().zip(half_spaces) {
            *plane = half_space.outward.extend(half_space.depth_m(centre_world)).as_vec4().to_array();
        }
        FrustumUniform {
            image_from_offset: columns(projection.matrix),
            size_px: [root.width_px as f32, root.height_px as f32],
            depth_q: (root.near_m * projection.w_scale) as f32,
            plane_count: half_spaces.len().min(PLANE_CAP) as u32,
            slack_per_m: slack_per_m as f32,
            slack_m: (slack_per_m * (centre_world - anchor_world).abs().element_sum()) as f32,
            padding: [0.0; 2],
            planes,
        }
    }
}

/// Draws images of graph cameras.
pub(super) struct GraphPass {
    gpu: Gpu,
    layout: wgpu::BindGroupLayout,
}

impl GraphPass {
    pub fn new(gpu: &Gpu) -> GraphPass {
        let entry = buffer_entry(0, wgpu::ShaderStages::VERTEX_FRAGMENT, wgpu::BufferBindingType::Uniform);
        let layout = gpu
            .device
            .create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: Some("frustum"), entries: &[entry] });
        GraphPass { gpu: gpu.clone(), layout }
    }

    /// Group 3 of the pass.
    pub fn layout(&self) -> &wgpu::BindGroupLayout {
        &self.layout
    }

    pub fn draw(&self, frame: &mut Frame<'_>, camera: &GraphCamera) -> Result<(), RenderError> {
        let scene = frame.scene;
        let pulled = scene.pulled_group()?;
        let writes = frame.timer.as_ref().map(|timer| timer.writes(0));
        let mut pass = frame.attachments.begin(&mut frame.encoder, 0, [0.0; 3], writes);
        for frustum in camera.frusta() {
            let centre_world = frustum.centre_world();
            let runs = scene.runs(centre_world, frame.subject.objects, |bounds| meets(frustum, bounds));
            let Some([x, y, width, height]) = scissor(camera, frustum).filter(|_| !runs.is_empty()) else { continue };
            // Positions come relative to the eye of the view: the centre.
            let eye =
                Pinhole { world_from_eye: Rigid { translation: centre_world, ..Rigid::IDENTITY }, ..*camera.root() };
            scene.begin(&mut pass, camera.size_px(), &scene.view_group(&eye));
            pass.set_scissor_rect(x, y, width, height);
            pass.set_bind_group(1, &pulled, &[]);
            pass.set_bind_group(
                3,
                &self.group(&FrustumUniform::new(camera.root(), frustum, scene.anchor_world())),
                &[],
            );
            for run in runs {
                scene.set_run(&mut pass, frame.pipelines, &run);
                scene.draw_pulled(&mut pass, &run);
            }
        }
        Ok(())
    }

    fn group(&self, uniform: &FrustumUniform) -> wgpu::BindGroup {
        let buffer = self.gpu.device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
            label: Some("frustum"),
            contents: bytemuck::bytes_of(uniform),
            usage: wgpu::BufferUsages::UNIFORM,
        });
        self.gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("frustum"),
            layout: &self.layout,
            entries: &[wgpu::BindGroupEntry { binding: 0, resource: buffer.as_entire_binding() }],
        })
    }
}

/// False only where a box lies outside of a frustum's box or of one of its planes.
fn meets(frustum: &Frustum, bounds: &scene::Bounds) -> bool {
    if bounds.is_empty() {
        return false;
    }
    let (low, high) = (bounds.min - frustum.centre_world(), bounds.max - frustum.centre_world());
    // Rounding in f32 on the GPU must not find what this dropped.
    // By the sixteen roundings of the module's words a place as far from the centre as the anchor is may be off by 1e-6 of its distance: this is ten times that.
    let slack_m = 1e-5 * low.abs().max(high.abs()).max_element();
    let innermost = |outward: DVec3| DVec3::select(outward.cmpgt(DVec3::ZERO), bounds.min, bounds.max);
    let bounds_world = camera::Bounds { min: bounds.min, max: bounds.max };
    frustum.bounds_world().meets(&bounds_world, slack_m)
        && frustum.half_spaces_world().iter().all(|side| side.depth_m(innermost(side.outward)) >= -slack_m)
}

/// The pixels that a frustum may show something in, and one around: left, top, width and height; `None` where there are
/// none.
fn scissor(camera: &GraphCamera, frustum: &Frustum) -> Option<[u32; 4]> {
    let size_px = glam::UVec2::from(camera.size_px());
    let image = frustum.image_bounds();
    let low = (image.min_px.floor() - 1.0).max(glam::DVec2::ZERO).as_uvec2().min(size_px);
    let high = (image.max_px.ceil() + 1.0).max(glam::DVec2::ZERO).as_uvec2().min(size_px);
    (low.x < high.x && low.y < high.y).then(|| [low.x, low.y, high.x - low.x, high.y - low.y])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_uniform_is_laid_out_as_in_wgsl() {
        shaders::assert_layout!(
            FrustumUniform,
            "server/raster_graph.wgsl",
            "GraphFrustum",
            image_from_offset,
            size_px,
            depth_q,
            plane_count,
            slack_per_m,
            slack_m,
            planes
        );
    }
}
