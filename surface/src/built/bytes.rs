//! A surface as plain bytes, for where bytes can be handed over and values cannot: from a web worker to its page.
//!
//! Both ends are one program on one machine, so all of it is the values' own bytes: a head with counts, the parts, and then vertices and indices as the GPU takes them,
//! which are never read here. What has other lengths than it says is refused.

use bytemuck::{AnyBitPattern, NoUninit, Pod, Zeroable};

use super::source::{Content, FarBytes, FarMesh, Source};
use super::{Build, Built, Head};
use crate::levels::{Part, Parts};
use crate::mesh::{QUAD_INDICES, Vertex};

/// The bytes are not those of a surface.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("the bytes of a surface are damaged")]
pub struct DamagedSurface;

#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
struct Counts {
    /// See [`Build::code`].
    build: u32,
    parts: u32,
    /// Of the image, each with the number of its part.
    cells: u32,
    vertices: u32,
    indices: u32,
}

impl Built {
    /// See the module.
    pub fn to_bytes(&self) -> Vec<u8> {
        let (parts, numbers) = self.parts.tables();
        let [vertices, indices] = [Content::Vertices, Content::Indices].map(|content| self.source.size(content));
        let counts = Counts {
            build: self.build.code().into(),
            parts: parts.len() as u32,
            cells: numbers.len() as u32,
            vertices: (vertices / size_of::<Vertex>()) as u32,
            indices: (indices / size_of::<u32>()) as u32,
        };
        let tables = size_of::<Head>() + size_of::<Counts>() + size_of_val(parts) + size_of_val(numbers);
        let mut bytes = Vec::with_capacity(tables + vertices + indices);
        bytes.extend_from_slice(bytemuck::bytes_of(&self.head));
        bytes.extend_from_slice(bytemuck::bytes_of(&counts));
        bytes.extend_from_slice(bytemuck::cast_slice(parts));
        bytes.extend_from_slice(bytemuck::cast_slice(numbers));
        bytes.extend_from_slice(&self.source.piece(Content::Vertices, 0..vertices));
        bytes.extend_from_slice(&self.source.piece(Content::Indices, 0..indices));
        bytes
    }

    /// The surface of [`Built::to_bytes`]'s bytes. Its quads stay where they are until they are uploaded.
    pub fn from_bytes(bytes: Box<dyn FarBytes>) -> Result<Built, DamagedSurface> {
        let mut at = 0;
        let head: Head = values(&*bytes, &mut at, 1)?[0];
        let counts: Counts = values(&*bytes, &mut at, 1)?[0];
        let build = u8::try_from(counts.build).ok().and_then(Build::from_code).ok_or(DamagedSurface)?;
        let parts: Vec<Part> = values(&*bytes, &mut at, counts.parts)?;
        let numbers: Vec<u32> = values(&*bytes, &mut at, counts.cells)?;
        let parts = Parts::of_tables(parts, numbers, counts.indices).ok_or(DamagedSurface)?;
        let sizes = [(counts.vertices, size_of::<Vertex>()), (counts.indices, size_of::<u32>())];
        let size: u64 = sizes.iter().map(|&(count, each)| u64::from(count) * each as u64).sum();
        if at as u64 + size != bytes.count() as u64 || head.quads > counts.indices / QUAD_INDICES as u32 {
            return Err(DamagedSurface);
        }
        let (vertices, indices) = (counts.vertices as usize, counts.indices as usize);
        let source = Source::Far(FarMesh { bytes, at, vertices, indices });
        Ok(Built { build, head, parts, source, upload: None })
    }
}

/// So many values from a place on, which is moved behind them.
fn values<T: NoUninit + AnyBitPattern>(
    bytes: &dyn FarBytes,
    at: &mut usize,
    count: u32,
) -> Result<Vec<T>, DamagedSurface> {
    let size = (count as usize).checked_mul(size_of::<T>()).ok_or(DamagedSurface)?;
    if size > bytes.count() - *at {
        return Err(DamagedSurface);
    }
    let mut values = vec![T::zeroed(); count as usize];
    bytes.read(*at, bytemuck::cast_slice_mut(&mut values));
    *at += size;
    Ok(values)
}
