//! Where patches and their moving objects are, seen from an output's eye.

use glam::{DAffine3, DMat3, Vec3};
use gpu::Gpu;
use gpu::uniforms::{Rows, rows};
use protocol::ObjectPose;
use wgpu::util::DeviceExt;

use crate::held::HeldSurfaces;
use crate::patch::PatchSurface;

/// Texels a moving object takes in the texture of movers: three rows for points, three for normals.
pub(crate) const MOVER_TEXELS: u32 = 6;

/// Moving objects a row of that texture; the twin of the constant in `surface/quads.wgsl`. 2048 rows, which every device has,
/// hold 131,072.
const MOVERS_A_ROW: u32 = 64;

/// The texture of movers: [`MOVER_TEXELS`] a moving object, in whole rows, at least one.
pub(crate) fn movers_texture(gpu: &Gpu, mut texels: Vec<[f32; 4]>) -> wgpu::Texture {
    let row = (MOVER_TEXELS * MOVERS_A_ROW) as usize;
    texels.resize(texels.len().max(1).next_multiple_of(row), [0.0; 4]);
    let size = wgpu::Extent3d { width: row as u32, height: (texels.len() / row) as u32, depth_or_array_layers: 1 };
    gpu.device.create_texture_with_data(
        &gpu.queue,
        &wgpu::TextureDescriptor {
            label: Some("movers"),
            size,
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: wgpu::TextureFormat::Rgba32Float,
            usage: wgpu::TextureUsages::TEXTURE_BINDING,
            view_formats: &[],
        },
        wgpu::util::TextureDataOrder::LayerMajor,
        bytemuck::cast_slice(&texels),
    )
}

/// Where a patch is, seen from an output's eye.
pub(crate) struct Placement {
    pub(crate) eye_from_patch: Rows,
    /// Of its moving objects, in their order.
    pub(crate) movers: Vec<Mover>,
}

/// Where a patch's moving object is.
pub(crate) struct Mover {
    pub(crate) eye_from_patch: Rows,
    /// The world's turn since capture, for normals.
    pub(crate) turn: Rows,
}

impl Placement {
    pub(crate) fn new(surfaces: &HeldSurfaces, patch: &PatchSurface, eye_from_world: &DAffine3) -> Placement {
        let world_from_patch = patch.camera.world_from_eye.to_affine();
        let mover = |pose: &ObjectPose| {
            let now = surfaces.poses_now().get(&pose.object).unwrap_or(&pose.world_from_object);
            let now_from_capture = *now * pose.world_from_object.inverse();
            Mover {
                eye_from_patch: rows(*eye_from_world * now_from_capture * world_from_patch),
                turn: normal_rows(now_from_capture.matrix3),
            }
        };
        Placement {
            eye_from_patch: rows(*eye_from_world * world_from_patch),
            movers: patch.objects.iter().map(mover).collect(),
        }
    }
}

/// Normals go by the inverse transpose, which for a rigid motion is the rotation itself.
fn normal_rows(now_from_capture: DMat3) -> Rows {
    let rows = now_from_capture.inverse();
    [rows.x_axis, rows.y_axis, rows.z_axis].map(|row| {
        let row: Vec3 = row.as_vec3();
        row.extend(0.0).to_array()
    })
}
