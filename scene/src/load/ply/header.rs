//! The header of a PLY file: which elements follow, and the types of what they have.

use crate::load::LoadError;
use crate::load::source::shorten;

/// Longer headers are not of this format.
const MAX_HEADER_BYTES: usize = 1 << 16;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Encoding {
    Ascii,
    LittleEndian,
    BigEndian,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Type {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Type {
    pub fn of(name: &str) -> Option<Type> {
        Some(match name {
            "char" | "int8" => Type::I8,
            "uchar" | "uint8" => Type::U8,
            "short" | "int16" => Type::I16,
            "ushort" | "uint16" => Type::U16,
            "int" | "int32" => Type::I32,
            "uint" | "uint32" => Type::U32,
            "float" | "float32" => Type::F32,
            "double" | "float64" => Type::F64,
            _ => return None,
        })
    }

    pub fn bytes(self) -> usize {
        match self {
            Type::I8 | Type::U8 => 1,
            Type::I16 | Type::U16 => 2,
            Type::I32 | Type::U32 | Type::F32 => 4,
            Type::F64 => 8,
        }
    }

    /// What stands for full colour.
    pub fn white(self) -> f64 {
        match self {
            Type::I8 | Type::U8 => 255.0,
            Type::I16 | Type::U16 => 65_535.0,
            Type::I32 | Type::U32 => 4_294_967_295.0,
            Type::F32 | Type::F64 => 1.0,
        }
    }
}

#[derive(Debug, Clone, PartialEq)]
pub(super) struct Property {
    pub name: String,
    pub kind: Type,
    /// The type of its length, where it is a list.
    pub length: Option<Type>,
}

#[derive(Debug, Clone, PartialEq)]
pub(super) struct Element {
    pub name: String,
    pub count: u64,
    pub properties: Vec<Property>,
}

#[derive(Debug, PartialEq)]
pub(super) struct Header {
    pub encoding: Encoding,
    pub elements: Vec<Element>,
    /// Where the values begin.
    pub bytes: usize,
}

impl Header {
    pub fn parse(bytes: &[u8]) -> Result<Header, LoadError> {
        let (mut encoding, mut elements) = (None, Vec::<Element>::new());
        let mut rest = &bytes[..bytes.len().min(MAX_HEADER_BYTES)];
        let mut used = 0;
        for number in 1.. {
            let fault = |fault: String| LoadError::malformed(format!("PLY header line {number}"), fault);
            let Some(end) = rest.iter().position(|byte| *byte == b'\n') else {
                return Err(fault("the header has no end".into()));
            };
            let line = String::from_utf8_lossy(&rest[..end]).into_owned();
            (rest, used) = (&rest[end + 1..], used + end + 1);
            let words: Vec<&str> = line.split_ascii_whitespace().collect();
            match words.as_slice() {
                ["end_header"] => break,
                [] | ["ply"] | ["comment" | "obj_info", ..] => {}
                ["format", "ascii", "1.0"] => encoding = Some(Encoding::Ascii),
                ["format", "binary_little_endian", "1.0"] => encoding = Some(Encoding::LittleEndian),
                ["format", "binary_big_endian", "1.0"] => encoding = Some(Encoding::BigEndian),
                ["element", name, count] => {
                    let count = count.parse().map_err(|_| fault(format!("count {:?} is no number", shorten(count))))?;
                    elements.push(Element { name: (*name).to_owned(), count, properties: Vec::new() });
                }
                ["property", kind @ .., name] if !kind.is_empty() => {
                    let element = elements.last_mut().ok_or_else(|| fault("a property before any element".into()))?;
                    let property = property(kind, name);
                    element.properties.push(property.ok_or_else(|| fault(format!("{:?}", shorten(&line))))?);
                }
                _ => return Err(fault(format!("{:?} is not understood", shorten(&line)))),
            }
        }
        let encoding = encoding.ok_or_else(|| LoadError::malformed("PLY header", "no format 1.0 is named"))?;
        Ok(Header { encoding, elements, bytes: used })
    }
}

fn property(kind: &[&str], name: &str) -> Option<Property> {
    let (kind, length) = match kind {
        ["list", length, kind] => (Type::of(kind)?, Some(Type::of(length)?)),
        [kind] => (Type::of(kind)?, None),
        _ => return None,
    };
    Some(Property { name: name.to_owned(), kind, length })
}
