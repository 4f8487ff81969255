//! STL, binary and ASCII: triangles without anything else.
//!
//! Normals of the file are left out, as they are those of the triangles, or nothing. STL does not say which way is up, nor
//! how long a unit is, nor whether a surface has two sides: it is drawn from both unless it closes a solid.

use glam::DVec3;

use super::closed::is_closed;
use super::geometry::{BuildOptions, Geometry, MissingNormals};
use super::motion::{Part, still_scene};
use super::numbers::numbers;
use super::{LoadError, Request, Stage, Warnings};
use crate::{Material, Scene};

const HEADER_BYTES: usize = 80;
const COUNT_BYTES: usize = 4;
/// Normal, three corners and two bytes that are left to applications.
const FACET_BYTES: usize = 50;
const NORMAL_BYTES: usize = 12;

/// Loads an STL file.
pub(super) fn load(bytes: &[u8], request: &Request<'_>) -> Result<Scene, LoadError> {
    let mut warnings = Warnings::default();
    let positions = match facets(bytes) {
        Some(facets) if !is_text(bytes, facets) => binary(bytes, facets, request, &mut warnings)?,
        _ if bytes.trim_ascii_start().starts_with(b"solid") => ascii(bytes, request)?,
        _ => return Err(LoadError::malformed("STL", "neither a binary header nor the word \"solid\"")),
    };
    request.report(Stage::Read, 1, 1);
    let triangles = (0..positions.len() as u32 / 3).map(|facet| [3 * facet, 3 * facet + 1, 3 * facet + 2]).collect();
    let geometry =
        Geometry { positions, normals: None, uvs: None, second_uvs: None, colours: None, triangles, material: 0 };
    let double_sided = !is_closed(&geometry.positions, &geometry.triangles);
    let options = BuildOptions { missing_normals: MissingNormals::Flat, keep_flat_triangles: false };
    let built = geometry.build("STL", options, &mut warnings);
    request.report(Stage::Meshes, 1, 1);
    let parts = built.into_iter().map(|built| Part { name: request.name.clone(), built }).collect();
    still_scene(parts, vec![Material { double_sided, ..Material::default() }], Vec::new(), request, warnings)
}

/// How many facets the header of a binary file claims.
fn facets(bytes: &[u8]) -> Option<u64> {
    let count = bytes.get(HEADER_BYTES..HEADER_BYTES + COUNT_BYTES)?;
    Some(u64::from(u32::from_le_bytes(count.try_into().ok()?)))
}

/// Binary headers may begin with "solid" too: then the count decides, which in text is some letters.
fn is_text(bytes: &[u8], facets: u64) -> bool {
    bytes.starts_with(b"solid") && (bytes.len() - HEADER_BYTES - COUNT_BYTES) as u64 != facets * FACET_BYTES as u64
}

fn binary(bytes: &[u8], facets: u64, request: &Request<'_>, warnings: &mut Warnings) -> Result<Vec<DVec3>, LoadError> {
    let (whole, rest) = bytes[HEADER_BYTES + COUNT_BYTES..].as_chunks::<FACET_BYTES>();
    let there = whole.len() as u64;
    if there < facets {
        return Err(LoadError::malformed("STL header", format!("{facets} facets, but there are bytes for {there}")));
    }
    let unused = (there - facets) * FACET_BYTES as u64 + rest.len() as u64;
    if unused > 0 {
        warnings.add(format!("STL: {unused} bytes past the last facet are ignored"));
    }
    LoadError::check_limit("triangles", facets, request.limits.triangles)?;
    let mut positions = Vec::with_capacity(facets as usize * 3);
    for facet in &whole[..facets as usize] {
        let coordinate = |b: &[u8; 4]| f64::from(f32::from_le_bytes(*b));
        let coordinates = facet[NORMAL_BYTES..].as_chunks::<4>().0;
        positions
            .extend(coordinates.as_chunks::<3>().0.iter().map(|corner| DVec3::from(corner.map(|c| coordinate(&c)))));
    }
    Ok(positions)
}

/// Takes the corners of all facets of all solids, one a line.
fn ascii(bytes: &[u8], request: &Request<'_>) -> Result<Vec<DVec3>, LoadError> {
    let text = String::from_utf8_lossy(bytes);
    let mut positions = Vec::new();
    // Corners of the facet that is being read.
    let mut corners = 0;
    for (index, line) in text.lines().enumerate() {
        let fault = |fault: &str| LoadError::malformed(format!("STL line {}", index + 1), fault);
        let mut words = line.split_ascii_whitespace();
        match words.next() {
            Some("facet") => corners = 0,
            Some("vertex") => {
                let corner = numbers::<3>(&mut words, 3).ok_or_else(|| fault("a vertex needs three numbers"))?;
                positions.push(DVec3::from(corner));
                corners += 1;
            }
            Some("endfacet") if corners != 3 => return Err(fault("a facet does not have three corners")),
            Some("endfacet") => {
                LoadError::check_limit("triangles", positions.len() as u64 / 3, request.limits.triangles)?;
            }
            _ => {}
        }
    }
    match positions.len() % 3 {
        0 => Ok(positions),
        _ => Err(LoadError::malformed("STL", "the file ends inside of a facet")),
    }
}
