//! Readback returns what was written, with several in flight.

use vantage_gpu::{Gpu, Readback};

fn texture(gpu: &Gpu, format: wgpu::TextureFormat) -> wgpu::Texture {
    gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: None,
        size: wgpu::Extent3d { width: 5, height: 3, depth_or_array_layers: 2 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: wgpu::TextureUsages::COPY_SRC | wgpu::TextureUsages::COPY_DST,
        view_formats: &[],
    })
}

#[test]
fn rows_come_back_without_padding_and_in_order() {
    let gpu = Gpu::block_on(Gpu::new_headless()).expect("an adapter");
    let texture = texture(&gpu, wgpu::TextureFormat::R32Uint);
    let mut pending = Vec::new();
    for round in 0..3_u32 {
        let texels: Vec<u32> = (0..15).map(|index| round * 100 + index).collect();
        let whole = wgpu::Extent3d { width: 5, height: 3, depth_or_array_layers: 1 };
        gpu.queue.write_texture(
            wgpu::TexelCopyTextureInfo {
                texture: &texture,
                mip_level: 0,
                origin: wgpu::Origin3d { x: 0, y: 0, z: 1 },
                aspect: wgpu::TextureAspect::All,
            },
            bytemuck::cast_slice(&texels),
            wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(20), rows_per_image: None },
            whole,
        );
        let mut readback = Readback::default();
        let slot = readback.texture(&texture, 1, (4, 3));
        let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let encoded = readback.encode(&gpu, &mut encoder);
        gpu.queue.submit([encoder.finish()]);
        pending.push((round, slot, encoded.map()));
    }
    for (round, slot, pending) in pending {
        let mapped = pending.wait(&gpu).expect("mapped");
        let expected: Vec<u32> =
            (0..3).flat_map(|row| (0..4).map(move |column| round * 100 + row * 5 + column)).collect();
        assert_eq!(mapped.values::<u32>(slot), expected);
        assert_eq!(mapped.rows(slot).len(), 3);
    }
}
