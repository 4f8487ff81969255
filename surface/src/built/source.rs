//! Where the quads of a surface lie until a GPU has them.

use std::borrow::Cow;
use std::fmt::Debug;
use std::ops::Range;

use wgpu::WasmNotSend;

use crate::mesh::{PatchMesh, Vertex};

/// Bytes outside of this program's memory, such as a page's, which are to be copied as few times as can be.
pub trait FarBytes: Debug + WasmNotSend {
    /// How many there are.
    fn count(&self) -> usize;
    /// Copies those from `at` on, of which there are enough.
    fn read(&self, at: usize, to: &mut [u8]);
}

/// Not far at all.
impl FarBytes for Vec<u8> {
    fn count(&self) -> usize {
        self.len()
    }

    fn read(&self, at: usize, to: &mut [u8]) {
        to.copy_from_slice(&self[at..][..to.len()]);
    }
}

/// What of a mesh becomes a buffer.
#[derive(Debug, Clone, Copy)]
pub(super) enum Content {
    Vertices,
    Indices,
}

#[derive(Debug)]
pub(super) enum Source {
    Mesh(PatchMesh),
    Far(FarMesh),
}

/// Vertices, and indices behind them.
#[derive(Debug)]
pub(super) struct FarMesh {
    pub bytes: Box<dyn FarBytes>,
    /// Where the vertices begin.
    pub at: usize,
    pub vertices: usize,
    pub indices: usize,
}

impl Source {
    /// How many bytes there are of it.
    pub fn size(&self, content: Content) -> usize {
        let (vertices, indices) = match self {
            Source::Mesh(mesh) => (mesh.vertices.len(), mesh.indices.len()),
            Source::Far(mesh) => (mesh.vertices, mesh.indices),
        };
        match content {
            Content::Vertices => vertices * size_of::<Vertex>(),
            Content::Indices => indices * size_of::<u32>(),
        }
    }

    /// Some of its bytes.
    pub fn piece(&self, content: Content, range: Range<usize>) -> Cow<'_, [u8]> {
        match (self, content) {
            (Source::Mesh(mesh), Content::Vertices) => Cow::from(&bytemuck::cast_slice(&mesh.vertices)[range]),
            (Source::Mesh(mesh), Content::Indices) => Cow::from(&bytemuck::cast_slice(&mesh.indices)[range]),
            (Source::Far(mesh), _) => {
                let before = if let Content::Indices = content { self.size(Content::Vertices) } else { 0 };
                let mut piece = vec![0; range.len()];
                mesh.bytes.read(mesh.at + before + range.start, &mut piece);
                Cow::from(piece)
            }
        }
    }
}
