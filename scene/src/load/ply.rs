//! PLY, ASCII and binary of either byte order: `vertex` elements with x y z, normals, colours and texture coordinates, and
//! `face` elements with polygons, which are cut into fans. The rest is read over.
//!
//! The reader is our own: the header claims counts, and each is compared with the bytes that are left before anything is
//! allocated for it. PLY does not say whether a surface has two sides: it is drawn from both unless it closes a solid.

use std::str::SplitAsciiWhitespace;

use glam::DVec3;

use super::closed::is_closed;
use super::geometry::{BuildOptions, Geometry, MissingNormals};
use super::motion::{Part, still_scene};
use super::source::shorten;
use super::{LoadError, Request, Stage, Warnings};
use crate::{Material, Scene};

/// Longer headers are not of this format.
const MAX_HEADER_BYTES: usize = 1 << 16;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Encoding {
    Ascii,
    LittleEndian,
    BigEndian,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Type {
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
    fn of(name: &str) -> Option<Type> {
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

    fn bytes(self) -> usize {
        match self {
            Type::I8 | Type::U8 => 1,
            Type::I16 | Type::U16 => 2,
            Type::I32 | Type::U32 | Type::F32 => 4,
            Type::F64 => 8,
        }
    }

    /// What stands for full colour.
    fn white(self) -> f64 {
        match self {
            Type::I8 | Type::U8 => 255.0,
            Type::I16 | Type::U16 => 65_535.0,
            Type::I32 | Type::U32 => 4_294_967_295.0,
            Type::F32 | Type::F64 => 1.0,
        }
    }
}

#[derive(Debug, Clone, PartialEq)]
struct Property {
    name: String,
    kind: Type,
    /// The type of its length, where it is a list.
    length: Option<Type>,
}

#[derive(Debug, Clone, PartialEq)]
struct Element {
    name: String,
    count: u64,
    properties: Vec<Property>,
}

#[derive(Debug, PartialEq)]
struct Header {
    encoding: Encoding,
    elements: Vec<Element>,
    /// Where the values begin.
    bytes: usize,
}

impl Header {
    fn parse(bytes: &[u8]) -> Result<Header, LoadError> {
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

/// The values after the header, one after another.
enum Values<'a> {
    Ascii(SplitAsciiWhitespace<'a>),
    Binary { bytes: &'a [u8], big_endian: bool },
}

impl Values<'_> {
    /// The next value; every type fits an f64 exactly.
    fn next(&mut self, kind: Type) -> Result<f64, &'static str> {
        match self {
            Values::Ascii(words) => {
                let word = words.next().ok_or("the file ends too early")?;
                word.parse().map_err(|_| "a value is not a number")
            }
            Values::Binary { bytes, big_endian } => {
                let (value, rest) = bytes.split_at_checked(kind.bytes()).ok_or("the file ends too early")?;
                *bytes = rest;
                let mut b = [0_u8; 8];
                b[..value.len()].copy_from_slice(value);
                if *big_endian {
                    b[..value.len()].reverse();
                }
                let low = u32::from_le_bytes([b[0], b[1], b[2], b[3]]);
                Ok(match kind {
                    Type::I8 => f64::from(b[0] as i8),
                    Type::U8 => f64::from(b[0]),
                    Type::I16 => f64::from(low as i16),
                    Type::U16 => f64::from(low as u16),
                    Type::I32 => f64::from(low as i32),
                    Type::U32 => f64::from(low),
                    Type::F32 => f64::from(f32::from_bits(low)),
                    Type::F64 => f64::from_le_bytes(b),
                })
            }
        }
    }

    /// A list's length: a whole number.
    fn length(&mut self, kind: Type) -> Result<u64, &'static str> {
        let length = self.next(kind)?;
        if length >= 0.0 && length.fract() == 0.0 {
            Ok(length as u64)
        } else {
            Err("a list's length is no whole number")
        }
    }
}

/// Where a vertex property goes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Role {
    Position(usize),
    Normal(usize),
    Uv(usize),
    Colour(usize),
    None,
}

impl Role {
    fn of(name: &str) -> Role {
        match name {
            "x" => Role::Position(0),
            "y" => Role::Position(1),
            "z" => Role::Position(2),
            "nx" => Role::Normal(0),
            "ny" => Role::Normal(1),
            "nz" => Role::Normal(2),
            "s" | "u" | "texture_u" => Role::Uv(0),
            "t" | "v" | "texture_v" => Role::Uv(1),
            "red" | "diffuse_red" | "r" => Role::Colour(0),
            "green" | "diffuse_green" | "g" => Role::Colour(1),
            "blue" | "diffuse_blue" | "b" => Role::Colour(2),
            "alpha" | "diffuse_alpha" | "a" => Role::Colour(3),
            _ => Role::None,
        }
    }
}

/// Loads a PLY file.
pub(super) fn load(bytes: &[u8], request: &Request<'_>) -> Result<Scene, LoadError> {
    let mut warnings = Warnings::default();
    let header = Header::parse(bytes)?;
    let body = &bytes[header.bytes..];
    let text;
    let mut values = match header.encoding {
        Encoding::Ascii => {
            text = String::from_utf8_lossy(body);
            Values::Ascii(text.split_ascii_whitespace())
        }
        encoding => Values::Binary { bytes: body, big_endian: encoding == Encoding::BigEndian },
    };
    let mut reader = Reader { geometry: None, triangles: Vec::new(), request, warnings: &mut warnings };
    for element in &header.elements {
        check_size(element, header.encoding, body.len() as u64)?;
        reader.element(element, &mut values)?;
    }
    let Reader { geometry, triangles, .. } = reader;
    request.report(Stage::Read, 1, 1);
    let mut geometry = geometry.ok_or_else(|| LoadError::malformed("PLY", "no vertex element"))?;
    if triangles.is_empty() {
        let reason = warnings.explain("the file has points but no faces");
        return Err(LoadError::NothingToDraw { reason });
    }
    let vertices = geometry.positions.len();
    if let Some(index) = triangles.iter().flatten().find(|index| **index as usize >= vertices) {
        return Err(LoadError::malformed("PLY face", format!("index {index} is past the {vertices} vertices")));
    }
    geometry.triangles = triangles;
    let double_sided = !is_closed(&geometry.positions, &geometry.triangles);
    let options = BuildOptions { missing_normals: MissingNormals::Smooth, keep_flat_triangles: false };
    let built = geometry.build("PLY", options, &mut warnings);
    request.report(Stage::Meshes, 1, 1);
    let parts = built.into_iter().map(|built| Part { name: request.name.clone(), built }).collect();
    still_scene(parts, vec![Material { double_sided, ..Material::default() }], Vec::new(), request, warnings)
}

/// Compares what an element's count needs at least with the bytes that there are.
fn check_size(element: &Element, encoding: Encoding, bytes: u64) -> Result<(), LoadError> {
    // In text a value takes a digit and a blank (the last of all takes no blank).
    let least = |property: &Property| match encoding {
        Encoding::Ascii => 2,
        _ => property.length.unwrap_or(property.kind).bytes() as u64,
    };
    let needed = element.count.saturating_mul(element.properties.iter().map(least).sum());
    if needed > bytes + 1 {
        let fault = format!("{} elements need {needed} bytes, there are {bytes}", element.count);
        return Err(LoadError::malformed(format!("PLY element {:?}", shorten(&element.name)), fault));
    }
    Ok(())
}

struct Reader<'a> {
    geometry: Option<Geometry>,
    triangles: Vec<[u32; 3]>,
    request: &'a Request<'a>,
    warnings: &'a mut Warnings,
}

impl Reader<'_> {
    fn element(&mut self, element: &Element, values: &mut Values<'_>) -> Result<(), LoadError> {
        // Elements without properties take no bytes: their count means nothing.
        if element.properties.is_empty() {
            return Ok(());
        }
        match element.name.as_str() {
            "vertex" => self.vertices(element, values),
            "face" => self.faces(element, values),
            name => {
                if element.count > 0 {
                    self.warnings.add(format!("PLY elements {:?} are not drawn", shorten(name)));
                }
                (0..element.count).try_for_each(|index| {
                    let fault = |fault: &str| LoadError::malformed(format!("PLY {name} {index}"), fault);
                    element.properties.iter().try_for_each(|property| skip(property, values)).map_err(fault)
                })
            }
        }
    }

    fn vertices(&mut self, element: &Element, values: &mut Values<'_>) -> Result<(), LoadError> {
        LoadError::check_limit("vertices", element.count, self.request.limits.vertices)?;
        let roles: Vec<Role> = element.properties.iter().map(|property| Role::of(&property.name)).collect();
        let has = |wanted: fn(usize) -> Role, count: usize| (0..count).all(|axis| roles.contains(&wanted(axis)));
        if !has(Role::Position, 3) {
            return Err(LoadError::malformed("PLY vertex", "not all of x, y and z are there"));
        }
        let count = element.count as usize;
        let mut positions = Vec::with_capacity(count);
        let mut normals = has(Role::Normal, 3).then(|| Vec::with_capacity(count));
        let mut uvs = has(Role::Uv, 2).then(|| Vec::with_capacity(count));
        let mut colours = has(Role::Colour, 3).then(|| Vec::with_capacity(count));
        for index in 0..count {
            let fault = |fault: &str| LoadError::malformed(format!("PLY vertex {index}"), fault);
            let (mut position, mut normal, mut uv, mut colour) = ([0.0; 3], [0.0; 3], [0.0; 2], [255_u8; 4]);
            for (property, role) in element.properties.iter().zip(&roles) {
                if property.length.is_some() {
                    skip(property, values).map_err(fault)?;
                    continue;
                }
                let value = values.next(property.kind).map_err(fault)?;
                match *role {
                    Role::Position(axis) => position[axis] = value,
                    Role::Normal(axis) => normal[axis] = value as f32,
                    // The first row of an image is its top here, and its bottom in PLY.
                    Role::Uv(axis) => uv[axis] = if axis == 1 { 1.0 - value as f32 } else { value as f32 },
                    Role::Colour(channel) => {
                        colour[channel] = ((value / property.kind.white()).clamp(0.0, 1.0) * 255.0).round() as u8;
                    }
                    Role::None => {}
                }
            }
            positions.push(DVec3::from(position));
            normals.iter_mut().for_each(|normals| normals.push(normal));
            uvs.iter_mut().for_each(|uvs| uvs.push(uv));
            colours.iter_mut().for_each(|colours| colours.push(colour));
        }
        self.geometry = Some(Geometry { positions, normals, uvs, colours, triangles: Vec::new(), material: 0 });
        Ok(())
    }

    fn faces(&mut self, element: &Element, values: &mut Values<'_>) -> Result<(), LoadError> {
        let mut polygon: Vec<u32> = Vec::new();
        for index in 0..element.count {
            let fault = |fault: &str| LoadError::malformed(format!("PLY face {index}"), fault);
            for property in &element.properties {
                match (property.length, property.name.as_str()) {
                    (Some(length), "vertex_indices" | "vertex_index") => {
                        polygon.clear();
                        for _ in 0..values.length(length).map_err(fault)? {
                            let corner = values.next(property.kind).map_err(fault)?;
                            // Negative and fractional ones become an index that is out of range.
                            let whole = corner >= 0.0 && corner.fract() == 0.0;
                            polygon.push(if whole { corner as u32 } else { u32::MAX });
                        }
                        let fan =
                            polygon.get(1..).unwrap_or_default().windows(2).map(|pair| [polygon[0], pair[0], pair[1]]);
                        self.triangles.extend(fan);
                    }
                    _ => skip(property, values).map_err(fault)?,
                }
            }
            LoadError::check_limit("triangles", self.triangles.len() as u64, self.request.limits.triangles)?;
        }
        Ok(())
    }
}

fn skip(property: &Property, values: &mut Values<'_>) -> Result<(), &'static str> {
    let count = property.length.map_or(Ok(1), |length| values.length(length))?;
    for _ in 0..count {
        values.next(property.kind)?;
    }
    Ok(())
}
