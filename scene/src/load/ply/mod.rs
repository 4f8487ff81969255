//! PLY, ASCII and binary of either byte order: `vertex` elements with x y z, normals, colours and texture coordinates,
//! `face` elements with polygons, which are cut into fans, and `tristrips` elements. The rest is read over. A file without
//! triangles is a cloud: its points become small solids.
//!
//! The reader is our own: the header claims counts, and each is compared with the bytes that are left before anything is
//! allocated for it. PLY does not say whether a surface has two sides: it is drawn from both unless it closes a solid.

mod header;
mod values;

use glam::DVec3;

use super::closed::is_closed;
use super::geometry::{BuildOptions, Geometry, MissingNormals};
use super::motion::{Part, still_scene};
use super::solids::Solids;
use super::source::shorten;
use super::{LoadError, Request, Stage, Warnings};
use crate::{Material, Scene};

use header::{Element, Encoding, Header, Property};
use values::Values;

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
    let found = triangles.len();
    request.report(Stage::Read, 1, 1);
    let mut geometry = geometry.ok_or_else(|| LoadError::malformed("PLY", "no vertex element"))?;
    let vertices = geometry.positions.len();
    geometry.triangles = triangles;
    geometry.triangles.retain(|triangle| triangle.iter().all(|&index| (index as usize) < vertices));
    let lost = found - geometry.triangles.len();
    warnings.tally("PLY", lost, "triangles with indices past the vertices are dropped");
    let double_sided = if found == 0 {
        geometry = cloud(&geometry, request, &mut warnings);
        false
    } else {
        !is_closed(&geometry.positions, &geometry.triangles)
    };
    let options = BuildOptions { missing_normals: MissingNormals::Smooth, keep_flat_triangles: false };
    let built = geometry.build("PLY", options, &mut warnings);
    request.report(Stage::Meshes, 1, 1);
    let parts = built.into_iter().map(|built| Part { name: request.name.clone(), built }).collect();
    still_scene(parts, vec![Material { double_sided, ..Material::default() }], Vec::new(), request, warnings)
}

/// Solids for the points of a file without triangles.
fn cloud(geometry: &Geometry, request: &Request<'_>, warnings: &mut Warnings) -> Geometry {
    let count = geometry.positions.len();
    let step = (count as u64).div_ceil(request.limits.points.max(1)).max(1) as usize;
    let thinned = if step > 1 { format!(", one of every {step}") } else { String::new() };
    warnings.add(format!("PLY: {count} points without faces are drawn as small octahedra{thinned}"));
    let points: Vec<u32> = (0..count as u32).step_by(step).collect();
    Solids::of_points(geometry, &points).geometry
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
            "face" => self.polygons(element, values, fan),
            "tristrips" => self.polygons(element, values, strips),
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
        self.geometry =
            Some(Geometry { positions, normals, uvs, second_uvs: None, colours, triangles: Vec::new(), material: 0 });
        Ok(())
    }

    /// Lists of corners, cut into triangles by `cut`.
    fn polygons(
        &mut self,
        element: &Element,
        values: &mut Values<'_>,
        cut: fn(&[u32], &mut Vec<[u32; 3]>),
    ) -> Result<(), LoadError> {
        let mut corners: Vec<u32> = Vec::new();
        for index in 0..element.count {
            let fault = |fault: &str| LoadError::malformed(format!("PLY {} {index}", element.name), fault);
            for property in &element.properties {
                match (property.length, property.name.as_str()) {
                    (Some(length), "vertex_indices" | "vertex_index") => {
                        corners.clear();
                        for _ in 0..values.length(length).map_err(fault)? {
                            let corner = values.next(property.kind).map_err(fault)?;
                            let whole = corner >= 0.0 && corner.fract() == 0.0;
                            corners.push(if whole { corner as u32 } else { NO_VERTEX });
                        }
                        cut(&corners, &mut self.triangles);
                    }
                    _ => skip(property, values).map_err(fault)?,
                }
            }
            LoadError::check_limit("triangles", self.triangles.len() as u64, self.request.limits.triangles)?;
        }
        Ok(())
    }
}

/// Stands for negative and fractional indices: out of range everywhere.
const NO_VERTEX: u32 = u32::MAX;

fn fan(corners: &[u32], triangles: &mut Vec<[u32; 3]>) {
    let Some((&hub, rim)) = corners.split_first() else { return };
    triangles.extend(rim.windows(2).map(|pair| [hub, pair[0], pair[1]]));
}

/// A negative index ends one strip and begins another; every second triangle of a strip is turned round.
fn strips(corners: &[u32], triangles: &mut Vec<[u32; 3]>) {
    for strip in corners.split(|&corner| corner == NO_VERTEX) {
        let ordered = |(i, w): (usize, &[u32])| [w[0], w[1 + i % 2], w[2 - i % 2]];
        triangles.extend(strip.windows(3).enumerate().map(ordered));
    }
}

fn skip(property: &Property, values: &mut Values<'_>) -> Result<(), &'static str> {
    let count = property.length.map_or(Ok(1), |length| values.length(length))?;
    for _ in 0..count {
        values.next(property.kind)?;
    }
    Ok(())
}
