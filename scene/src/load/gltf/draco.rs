//! Compressed primitives (`KHR_draco_mesh_compression`): a stream of the file to triangles and attributes.
//!
//! The decoder is the crate `draco-core`. It is told what the stream may decode to before it starts: no more triangles
//! than the accessor of the indices declares, and no more bytes than its vertices can need. What accessors declare is
//! checked against the limits of the whole load before that.

use draco_core::{DataType, DecodeLimits, DecoderBuffer, Mesh, MeshDecoder, PointAttribute};

use super::buffers::Buffers;
use super::document::{Document, Draco, Primitive};
use crate::load::guard::guarded;

/// Of a vertex with everything that glTF names: place, normal, tangent, two texture coordinates, colour and eight joints
/// with weights come to 136 bytes.
const BYTES_PER_VERTEX: u64 = 136;

/// What a stream decodes to.
#[derive(Debug)]
pub(super) struct Decompressed<'a> {
    mesh: Mesh,
    compressed: &'a Draco,
    /// All below [`Decompressed::vertices`].
    pub triangles: Vec<[u32; 3]>,
}

/// Decodes the stream of a primitive; `None` where it has none.
pub(super) fn decompress<'a>(
    primitive: &'a Primitive,
    document: &Document,
    buffers: &Buffers<'_>,
) -> Option<Result<Decompressed<'a>, String>> {
    let compressed = primitive.extensions.draco.as_ref()?;
    let declared = |index: Option<&usize>| index.and_then(|&index| document.accessors.get(index)).map(|a| a.count);
    let vertices = declared(primitive.attributes.get("POSITION")).unwrap_or(0);
    let indices = declared(primitive.indices.as_ref()).unwrap_or(vertices);
    let limits = DecodeLimits::default()
        .with_max_faces(indices / 3)
        .with_max_decoded_bytes(vertices.saturating_mul(BYTES_PER_VERTEX));
    let view = buffers.view(compressed.buffer_view).map_err(|error| error.to_string());
    Some(view.and_then(|view| {
        guarded(|| {
            let mut mesh = Mesh::new();
            let mut stream = DecoderBuffer::new(view.bytes).with_limits(limits);
            MeshDecoder::new().decode(&mut stream, &mut mesh).map_err(|error| error.message().to_owned())?;
            Decompressed::of(mesh, compressed)
        })
    }))
}

impl<'a> Decompressed<'a> {
    fn of(mesh: Mesh, compressed: &'a Draco) -> Result<Decompressed<'a>, String> {
        let vertices = mesh.num_points();
        let triangles: Vec<[u32; 3]> = mesh.faces().iter().map(|face| face.map(|corner| corner.0)).collect();
        if let Some(index) = triangles.iter().flatten().find(|index| **index as usize >= vertices) {
            return Err(format!("index {index} is past the {vertices} vertices"));
        }
        let lacks = compressed.attributes.iter().find(|(_, id)| mesh.attribute_by_unique_id(**id).is_none());
        match lacks {
            Some((name, id)) => Err(format!("the stream has no attribute {id}, which {name} refers to")),
            None => Ok(Decompressed { mesh, compressed, triangles }),
        }
    }

    /// How many each of its attributes is for.
    pub fn vertices(&self) -> usize {
        self.mesh.num_points()
    }

    fn attribute(&self, name: &str) -> Option<&PointAttribute> {
        self.mesh.attribute_by_unique_id(*self.compressed.attributes.get(name)?)
    }

    /// How many components an attribute has; `None` where it is not in the stream.
    pub fn width(&self, name: &str) -> Option<usize> {
        self.attribute(name).map(|attribute| usize::from(attribute.num_components()))
    }

    /// Elements of `N` floats; where `normalized`, integers span -1 to 1 or 0 to 1 (glTF 2.0, 3.11). `None` where the
    /// stream does not have the attribute.
    pub fn floats<const N: usize>(&self, name: &str, normalized: bool) -> Option<Result<Vec<[f32; N]>, String>> {
        let attribute = self.attribute(name)?;
        let width = usize::from(attribute.num_components());
        if width != N {
            return Some(Err(format!("{width} components in the stream, {N} are due")));
        }
        let mut values = attribute.read_f32s(self.mesh.num_points(), N);
        let largest = match attribute.data_type() {
            DataType::Int8 => f32::from(i8::MAX),
            DataType::Uint8 => f32::from(u8::MAX),
            DataType::Int16 => f32::from(i16::MAX),
            DataType::Uint16 => f32::from(u16::MAX),
            _ => 1.0,
        };
        if normalized || attribute.normalized() {
            values.iter_mut().for_each(|value| *value = (*value / largest).max(-1.0));
        }
        Some(Ok(values.as_chunks::<N>().0.to_vec()))
    }

    /// Elements of `N` whole numbers. Joints, which these are, are small enough for an f32.
    pub fn integers<const N: usize>(&self, name: &str) -> Option<Result<Vec<[u32; N]>, String>> {
        let whole = |elements: Vec<[f32; N]>| {
            let all = elements.iter().flatten().all(|x| *x >= 0.0 && x.fract() == 0.0);
            let numbers = || elements.iter().map(|element| element.map(|x| x as u32)).collect();
            all.then(numbers).ok_or_else(|| "not unsigned integers".to_owned())
        };
        self.floats::<N>(name, false).map(|elements| elements.and_then(whole))
    }
}
