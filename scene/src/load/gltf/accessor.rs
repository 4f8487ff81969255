//! Accessors to vectors of numbers (glTF 2.0, 3.6.2): interleaved, normalized, sparse; bounds and counts checked
//! before anything is allocated.

use super::buffers::Buffers;
use super::document::{Accessor, Document};
use crate::load::LoadError;

/// `componentType`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Component {
    I8,
    U8,
    I16,
    U16,
    U32,
    F32,
}

impl Component {
    fn of(code: u32) -> Option<Component> {
        Some(match code {
            5120 => Component::I8,
            5121 => Component::U8,
            5122 => Component::I16,
            5123 => Component::U16,
            5125 => Component::U32,
            5126 => Component::F32,
            _ => return None,
        })
    }

    fn bytes(self) -> usize {
        match self {
            Component::I8 | Component::U8 => 1,
            Component::I16 | Component::U16 => 2,
            Component::U32 | Component::F32 => 4,
        }
    }

    /// As a float; where `normalized`, integers span -1 to 1 or 0 to 1 (glTF 2.0, 3.11).
    fn to_f32(self, normalized: bool, b: &[u8]) -> f32 {
        let (value, largest) = match self {
            Component::I8 => (f32::from(b[0] as i8), f32::from(i8::MAX)),
            Component::U8 => (f32::from(b[0]), f32::from(u8::MAX)),
            Component::I16 => (f32::from(i16::from_le_bytes([b[0], b[1]])), f32::from(i16::MAX)),
            Component::U16 => (f32::from(u16::from_le_bytes([b[0], b[1]])), f32::from(u16::MAX)),
            Component::U32 => (u32::from_le_bytes([b[0], b[1], b[2], b[3]]) as f32, u32::MAX as f32),
            Component::F32 => return f32::from_le_bytes([b[0], b[1], b[2], b[3]]),
        };
        if normalized { (value / largest).max(-1.0) } else { value }
    }

    /// As an unsigned integer; `None` for types that are not.
    fn to_u32(self, b: &[u8]) -> Option<u32> {
        Some(match self {
            Component::U8 => u32::from(b[0]),
            Component::U16 => u32::from(u16::from_le_bytes([b[0], b[1]])),
            Component::U32 => u32::from_le_bytes([b[0], b[1], b[2], b[3]]),
            Component::I8 | Component::I16 | Component::F32 => return None,
        })
    }
}

/// Bytes of a component, by its code.
pub(super) fn component_bytes(code: u32) -> Option<u64> {
    Component::of(code).map(|component| component.bytes() as u64)
}

/// Components of an element, by `type`.
pub(super) fn width_of(shape: &str) -> Option<usize> {
    Some(match shape {
        "SCALAR" => 1,
        "VEC2" => 2,
        "VEC3" => 3,
        "VEC4" | "MAT2" => 4,
        "MAT3" => 9,
        "MAT4" => 16,
        _ => return None,
    })
}

/// How many elements an accessor may have.
#[derive(Debug, Clone, Copy)]
pub(super) enum Count {
    /// As many as its companions have.
    Exactly(usize),
    /// A cap.
    AtMost(u64),
}

/// Reads accessors of a document.
#[derive(Clone, Copy)]
pub(super) struct Accessors<'a> {
    document: &'a Document,
    buffers: &'a Buffers<'a>,
}

impl<'a> Accessors<'a> {
    /// Of a document and its buffers.
    pub fn new(document: &'a Document, buffers: &'a Buffers<'a>) -> Accessors<'a> {
        Accessors { document, buffers }
    }

    /// The bytes that accessors are of.
    pub fn buffers(&self) -> &'a Buffers<'a> {
        self.buffers
    }

    /// The accessor itself. `at` is where it is referred to.
    pub fn get(&self, index: usize, at: &str) -> Result<&'a Accessor, LoadError> {
        self.document.accessors.get(index).ok_or_else(|| {
            let count = self.document.accessors.len();
            LoadError::malformed(at, format!("accessor {index} does not exist, there are {count}"))
        })
    }

    /// How many components an element has: 3 for `VEC3`.
    pub fn width(&self, index: usize, at: &str) -> Result<usize, LoadError> {
        let shape = &self.get(index, at)?.shape;
        width_of(shape)
            .ok_or_else(|| LoadError::malformed(format!("accessors[{index}].type"), format!("unknown type {shape:?}")))
    }

    /// Elements of `N` floats, from floats or (normalized or plain) integers.
    pub fn floats<const N: usize>(&self, index: usize, at: &str, count: Count) -> Result<Vec<[f32; N]>, LoadError> {
        let accessor = self.get(index, at)?;
        let component = self.component(accessor, index)?;
        if component == Component::U32 {
            return Err(LoadError::malformed(
                at,
                format!("accessor {index} holds 32 bit integers where floats are due"),
            ));
        }
        let normalized = accessor.normalized;
        self.elements(index, at, count, |bytes| component.to_f32(normalized, bytes))
    }

    /// Elements of `N` unsigned integers.
    pub fn integers<const N: usize>(&self, index: usize, at: &str, count: Count) -> Result<Vec<[u32; N]>, LoadError> {
        let accessor = self.get(index, at)?;
        let component = self.component(accessor, index)?;
        if !matches!(component, Component::U8 | Component::U16 | Component::U32) || accessor.normalized {
            return Err(LoadError::malformed(at, format!("accessor {index} does not hold unsigned integers")));
        }
        self.elements(index, at, count, |bytes| component.to_u32(bytes).unwrap_or_default())
    }

    fn component(&self, accessor: &Accessor, index: usize) -> Result<Component, LoadError> {
        Component::of(accessor.component_type).ok_or_else(|| {
            let fault = format!("unknown component type {}", accessor.component_type);
            LoadError::malformed(format!("accessors[{index}].componentType"), fault)
        })
    }

    fn elements<const N: usize, T: Copy + Default>(
        &self,
        index: usize,
        at: &str,
        count: Count,
        decode: impl Fn(&[u8]) -> T,
    ) -> Result<Vec<[T; N]>, LoadError> {
        let accessor = self.get(index, at)?;
        let width = self.width(index, at)?;
        if width != N {
            let fault = format!("accessor {index} is {}, {N} components are due", accessor.shape);
            return Err(LoadError::malformed(at, fault));
        }
        match count {
            Count::Exactly(expected) if accessor.count != expected as u64 => {
                let fault = format!("accessor {index} has {} elements, {expected} are due", accessor.count);
                return Err(LoadError::malformed(at, fault));
            }
            Count::AtMost(limit) => LoadError::check_limit(format!("{at}: elements"), accessor.count, limit)?,
            Count::Exactly(_) => {}
        }
        let count = accessor.count as usize;
        let component_bytes = self.component(accessor, index)?.bytes();
        let read = |bytes: &[u8]| -> [T; N] {
            std::array::from_fn(|i| decode(&bytes[i * component_bytes..(i + 1) * component_bytes]))
        };
        let element_bytes = component_bytes * N;
        let mut elements: Vec<[T; N]> = match accessor.buffer_view {
            None => vec![[T::default(); N]; count],
            Some(view) => {
                let name = format!("accessors[{index}]");
                let span = self.span(&name, view, accessor.byte_offset, count, element_bytes)?;
                span.map(read).collect()
            }
        };
        if let Some(sparse) = &accessor.sparse {
            let name = format!("accessors[{index}].sparse");
            LoadError::check_limit(format!("{name}.count"), sparse.count, accessor.count)?;
            let places = &sparse.indices;
            let component =
                Component::of(places.component_type).filter(|c| c.to_u32(&[0; 4]).is_some()).ok_or_else(|| {
                    LoadError::malformed(format!("{name}.indices"), "the component type is not an unsigned integer")
                })?;
            let replaced = sparse.count as usize;
            let at_indices = format!("{name}.indices");
            let places = self.span(&at_indices, places.buffer_view, places.byte_offset, replaced, component.bytes())?;
            let values = &sparse.values;
            let values =
                self.span(&format!("{name}.values"), values.buffer_view, values.byte_offset, replaced, element_bytes)?;
            for (place, value) in places.zip(values) {
                let place = component.to_u32(place).unwrap_or_default();
                let element = elements.get_mut(place as usize).ok_or_else(|| {
                    LoadError::malformed(at_indices.as_str(), format!("{place} is past the {count} elements"))
                })?;
                *element = read(value);
            }
        }
        Ok(elements)
    }

    /// The bytes of each of `count` elements, all within the view.
    fn span(
        &self,
        at: &str,
        view: usize,
        offset: u64,
        count: usize,
        element_bytes: usize,
    ) -> Result<impl Iterator<Item = &'a [u8]> + use<'a>, LoadError> {
        let view = self.buffers.view(view)?;
        let stride = view.stride_bytes.unwrap_or(element_bytes);
        let needed = match count {
            0 => Some(0),
            _ => (stride as u64).checked_mul(count as u64 - 1).and_then(|n| n.checked_add(element_bytes as u64)),
        };
        let end = needed.and_then(|needed| needed.checked_add(offset)).filter(|&end| end <= view.bytes.len() as u64);
        if end.is_none() {
            let fault = format!(
                "{count} elements of {element_bytes} bytes at {offset} are past the {} bytes of the view",
                view.bytes.len()
            );
            return Err(LoadError::malformed(at, fault));
        }
        let bytes = &view.bytes[(offset as usize).min(view.bytes.len())..];
        Ok((0..count).map(move |index| &bytes[index * stride..index * stride + element_bytes]))
    }
}
