//! GLB: a JSON text and a buffer in one file (glTF 2.0, section 4).

use serde_json::Value;

use crate::load::{LoadError, Warnings};

/// First bytes of a GLB file.
pub(in crate::load) const GLB_MAGIC: &[u8] = b"glTF";
const HEADER_BYTES: usize = 12;
const CHUNK_HEADER_BYTES: usize = 8;
const GLB_VERSION: u32 = 2;

/// A file taken apart.
#[derive(Debug, PartialEq)]
pub(super) struct Container<'a> {
    /// The JSON text.
    pub json: &'a [u8],
    /// The first `BIN` chunk.
    pub bin: Option<&'a [u8]>,
}

impl<'a> Container<'a> {
    /// Takes a `.glb` apart; a `.gltf` is all JSON.
    pub fn of(bytes: &'a [u8], warnings: &mut Warnings) -> Result<Container<'a>, LoadError> {
        if !bytes.starts_with(GLB_MAGIC) {
            return Ok(Container { json: bytes, bin: None });
        }
        let header = |fault: String| LoadError::malformed("GLB header", fault);
        let version = word(bytes, 4).ok_or_else(|| header("the file ends inside of it".into()))?;
        if version != GLB_VERSION {
            return Err(header(format!("version {version} is not {GLB_VERSION}")));
        }
        let length = word(bytes, 8).ok_or_else(|| header("the file ends inside of it".into()))? as usize;
        if length < HEADER_BYTES || length > bytes.len() {
            return Err(header(format!("length {length} in a file of {} bytes", bytes.len())));
        }
        if length < bytes.len() {
            warnings.add(format!("GLB header: {} bytes after the end are ignored", bytes.len() - length));
        }
        Container::of_chunks(&bytes[..length], warnings)
    }

    fn of_chunks(bytes: &'a [u8], warnings: &mut Warnings) -> Result<Container<'a>, LoadError> {
        let (mut json, mut bin) = (None, None);
        let mut rest = &bytes[HEADER_BYTES..];
        for index in 0.. {
            if rest.is_empty() {
                break;
            }
            let at = || format!("GLB chunk {index}");
            let (Some(length), Some(kind)) = (word(rest, 0), rest.get(4..CHUNK_HEADER_BYTES)) else {
                return Err(LoadError::malformed(at(), "the file ends inside of its header"));
            };
            let body = &rest[CHUNK_HEADER_BYTES..];
            if length as usize > body.len() {
                return Err(LoadError::malformed(at(), format!("length {length}, but {} bytes are left", body.len())));
            }
            let (chunk, after) = body.split_at(length as usize);
            match (index, kind) {
                (0, b"JSON") => json = Some(chunk),
                (0, _) => return Err(LoadError::malformed(at(), "the first chunk is not JSON")),
                (1, b"BIN\0") => bin = Some(chunk),
                (_, b"JSON" | b"BIN\0") => warnings.add(format!("{}: out of place and ignored", at())),
                _ => warnings.add(format!("{}: of unknown type and ignored", at())),
            }
            rest = after;
        }
        let json = json.ok_or_else(|| LoadError::malformed("GLB", "no JSON chunk"))?;
        Ok(Container { json, bin })
    }
}

fn word(bytes: &[u8], at: usize) -> Option<u32> {
    let bytes = bytes.get(at..at + 4)?;
    Some(u32::from_le_bytes(bytes.try_into().expect("four bytes")))
}

/// Parses the JSON text. Its values are counted first: each takes up to 64 bytes of memory, from two bytes of text.
pub(super) fn parse_json(text: &[u8], limit: u64) -> Result<Value, LoadError> {
    // Every value but the first follows one of these; those inside of strings only make the count larger.
    let values = 1 + text.iter().filter(|byte| matches!(byte, b',' | b'[' | b'{' | b':')).count() as u64;
    LoadError::check_limit("JSON values", values, limit)?;
    serde_json::from_slice(text).map_err(|error| LoadError::malformed("JSON", error.to_string()))
}
