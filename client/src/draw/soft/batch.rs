//! What passes share that ask many of a lamp's points at once: the pixels, as the points' frame sees them, and the points.
//!
//! The bindings of `client/soft_receiver.wgsl`, which come before those of each pass.

use bytemuck::{Pod, Zeroable};
use camera::Pinhole;
use glam::DVec2;
use gpu::{Gpu, MaterialUniform, PinholeUniform};
use surface::INVOCATIONS_A_ROW;
use wgpu::{BindingResource, Buffer};

use super::bias::Bias;
use super::count::Count;
use super::receivers::Receivers;
use crate::draw::fullscreen::{Binding, uniform};
use crate::draw::map_space::from_view;

/// Points that are asked together at most; the twin of the constant in `client/compute/warp_points.wgsl`.
pub(super) const POINTS: usize = 32;
/// `WarpPoints` of `client/compute/warp_points.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub(super) struct PointsUniform {
    size_px: [u32; 2],
    pitch: u32,
    row: u32,
    point_count: u32,
    padding: [u32; 3],
    places: [[f32; 4]; POINTS],
    weights: [[f32; 4]; POINTS],
}

/// `Frame` of `client/compute/warp_frame.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub(super) struct FrameUniform {
    frame_from_view: [[f32; 4]; 4],
    focal_px: f32,
    near_m: f32,
    rounding: f32,
    rise_texels: f32,
}

/// Pixels made ready to be asked about.
pub(super) struct Ready<'a> {
    gpu: &'a Gpu,
    pub(super) receivers: Receivers<'a>,
    pub(super) camera: Buffer,
    materials: Buffer,
    /// From there to the frame.
    pub(super) in_frame: Buffer,
}

impl<'a> Ready<'a> {
    /// Of [`Ready::inputs`].
    pub(super) const BINDINGS: [Binding; 6] = [
        Binding::Uniform,
        Binding::Uniform,
        Binding::Uniform,
        Binding::Uniform,
        Binding::FloatTexture,
        Binding::UintTexture,
    ];

    pub(super) fn new(gpu: &'a Gpu, (frame, bias): (&Pinhole, Bias), receivers: Receivers<'a>) -> Ready<'a> {
        let camera = PinholeUniform::new(receivers.view, receivers.view.world_from_eye.translation);
        let materials = MaterialUniform::table(&receivers.held.materials);
        Ready {
            gpu,
            receivers,
            camera: uniform(gpu, "camera", bytemuck::bytes_of(&camera)),
            materials: uniform(gpu, "materials", bytemuck::cast_slice(&materials)),
            in_frame: uniform(gpu, "frame", bytemuck::bytes_of(&FrameUniform::new(frame, receivers.view, bias))),
        }
    }

    /// Some points for the passes.
    pub(super) fn points(&self, points: &PointsUniform) -> Buffer {
        uniform(self.gpu, "points", bytemuck::bytes_of(points))
    }

    /// What passes begin with.
    pub(super) fn inputs<'b>(&'b self, points: &'b Buffer) -> [BindingResource<'b>; 6] {
        let views = &self.receivers.gbuffer.views;
        [
            self.camera.as_entire_binding(),
            self.materials.as_entire_binding(),
            self.in_frame.as_entire_binding(),
            points.as_entire_binding(),
            BindingResource::TextureView(&views.w),
            BindingResource::TextureView(&views.normal_ids),
        ]
    }
}

/// Points in parts of at most `most`, each of which counts in one target.
pub(super) fn batches<'a>(numbers: &'a [usize], most: usize, count: Count<'a>) -> impl Iterator<Item = &'a [usize]> {
    let by_target = numbers.chunk_by(move |a, b| count.target_of(*a) == count.target_of(*b));
    by_target.flat_map(move |numbers| numbers.chunks(most))
}

/// What each of some points shifts by at `w = 1`, in pixels of the frame's image.
pub(super) fn shifts(frame: &Pinhole, points: &[Pinhole]) -> impl Iterator<Item = DVec2> {
    let frame_from_world = frame.world_from_eye.inverse();
    let place = move |point: &Pinhole| frame_from_world.transform_point(point.world_from_eye.translation);
    points.iter().map(move |point| place(point).truncate() * frame.focal_px)
}

impl PointsUniform {
    /// Of the points of a face with these numbers, for maps with rows of `pitch` texels.
    pub(super) fn new(
        frame: &Pinhole,
        (face, numbers): (&[Pinhole], &[usize]),
        pitch: u32,
        count: Count<'_>,
    ) -> PointsUniform {
        let mut uniform: PointsUniform = Zeroable::zeroed();
        uniform.size_px = [frame.width_px, frame.height_px];
        (uniform.pitch, uniform.row) = (pitch, INVOCATIONS_A_ROW);
        uniform.point_count = numbers.len() as u32;
        let points: Vec<Pinhole> = numbers.iter().map(|number| face[*number]).collect();
        for (index, (point, shift)) in points.iter().zip(shifts(frame, &points)).enumerate() {
            uniform.places[index] = [shift.x, shift.y, point.centre_px.x, point.centre_px.y].map(|value| value as f32);
            (_, uniform.weights[index]) = count.of(numbers[index], face.len());
        }
        uniform
    }
}

impl FrameUniform {
    fn new(frame: &Pinhole, view: &Pinhole, bias: Bias) -> FrameUniform {
        FrameUniform {
            frame_from_view: from_view(frame, view.world_from_eye.translation),
            focal_px: frame.focal_px as f32,
            near_m: frame.near_m as f32,
            rounding: bias.rounding(),
            rise_texels: bias.rise_texels(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn uniforms_are_laid_out_as_in_wgsl() {
        let path = "client/soft_receiver.wgsl";
        shaders::assert_layout!(PointsUniform, path, "WarpPoints", size_px, pitch, row, point_count, places, weights);
        shaders::assert_layout!(FrameUniform, path, "Frame", frame_from_view, focal_px, near_m, rounding, rise_texels);
    }
}
