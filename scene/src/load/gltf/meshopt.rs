//! Decompression of `EXT_meshopt_compression` views (vendor extension specification, section 'Specifying compressed
//! views'). Every condition that the C decoder asserts is checked here first; within them it is safe on any bytes.

use super::document::Meshopt;

/// Decompresses a view to `count * byteStride` bytes.
pub(super) fn decompress(compressed: &Meshopt, bytes: &[u8]) -> Result<Vec<u8>, String> {
    let (count, stride) = (compressed.count as usize, compressed.byte_stride as usize);
    let mut data = match compressed.mode.as_str() {
        "ATTRIBUTES" => {
            if stride == 0 || stride > 256 || stride % 4 != 0 {
                return Err(format!("byteStride {stride} is not a multiple of 4 up to 256"));
            }
            decode_vertices(bytes, count, stride)
        }
        "TRIANGLES" if count % 3 != 0 => return Err(format!("count {count} is not a multiple of 3")),
        mode @ ("TRIANGLES" | "INDICES") => match stride {
            2 => decode_indices::<u16>(mode, bytes, count),
            4 => decode_indices::<u32>(mode, bytes, count),
            _ => return Err(format!("byteStride {stride} is not 2 or 4")),
        },
        mode => return Err(format!("unknown mode {mode:?}")),
    }?;
    match compressed.filter.as_deref() {
        None | Some("NONE") => {}
        Some(filter) => apply_filter(filter, stride, &mut data)?,
    }
    Ok(data)
}

fn decode_indices<T: meshopt::IndexType + bytemuck::Pod>(
    mode: &str,
    bytes: &[u8],
    count: usize,
) -> Result<Vec<u8>, String> {
    let indices = match mode {
        "TRIANGLES" => meshopt::decode_index_buffer::<T>(bytes, count),
        _ => meshopt::decode_index_sequence::<T>(bytes, count),
    };
    let indices = indices.map_err(|error| format!("the compressed data is damaged ({error})"))?;
    Ok(bytemuck::cast_slice(&indices).to_vec())
}

/// A vertex of any size: the decoder takes the stride from the type.
#[derive(Clone, Copy)]
struct Record<const N: usize>([u8; N]);

impl<const N: usize> Default for Record<N> {
    fn default() -> Self {
        Record([0; N])
    }
}

fn decode_records<const N: usize>(bytes: &[u8], count: usize) -> Result<Vec<u8>, String> {
    let records = meshopt::decode_vertex_buffer::<Record<N>>(bytes, count);
    let records = records.map_err(|error| format!("the compressed data is damaged ({error})"))?;
    Ok(records.iter().flat_map(|record| record.0).collect())
}

/// Strides that a glTF vertex can have, as types.
fn decode_vertices(bytes: &[u8], count: usize, stride: usize) -> Result<Vec<u8>, String> {
    macro_rules! by_stride {
        ($($n:literal)*) => {
            match stride {
                $($n => decode_records::<$n>(bytes, count),)*
                _ => Err(format!("byteStride {stride} is not a multiple of 4 up to 256")),
            }
        };
    }
    by_stride!(4 8 12 16 20 24 28 32 36 40 44 48 52 56 60 64 68 72 76 80 84 88 92 96 100 104 108 112 116 120 124 128
        132 136 140 144 148 152 156 160 164 168 172 176 180 184 188 192 196 200 204 208 212 216 220 224 228 232 236
        240 244 248 252 256)
}

/// The extension's section 'Filters'.
fn apply_filter(filter: &str, stride: usize, data: &mut [u8]) -> Result<(), String> {
    // Copied into a typed, aligned vector and back: bytes have no alignment to rely on.
    fn typed<T: bytemuck::Pod>(data: &mut [u8], run: impl FnOnce(&mut [T])) {
        let mut values: Vec<T> = bytemuck::pod_collect_to_vec(data);
        run(&mut values);
        data.copy_from_slice(bytemuck::cast_slice(&values));
    }
    match (filter, stride) {
        ("OCTAHEDRAL", 4) => typed::<[i8; 4]>(data, meshopt::decode_filter_oct),
        ("OCTAHEDRAL", 8) => typed::<[i16; 4]>(data, meshopt::decode_filter_oct),
        ("QUATERNION", 8) => typed::<[i16; 4]>(data, meshopt::decode_filter_quat),
        ("EXPONENTIAL", stride) if stride % 4 == 0 => typed::<[u32; 1]>(data, meshopt::decode_filter_exp),
        ("OCTAHEDRAL" | "QUATERNION" | "EXPONENTIAL", _) => {
            return Err(format!("filter {filter} does not go with byteStride {stride}"));
        }
        _ => return Err(format!("unknown filter {filter:?}")),
    }
    Ok(())
}
