//! Buffers and buffer views: bytes of the GLB chunk, of data URIs, of files beside the scene, and decompressed ones.

use std::borrow::Cow;

use percent_encoding::percent_decode_str;
use rayon::prelude::*;

use super::document::Document;
use super::meshopt;
use crate::load::source::{self, Folder};
use crate::load::{LoadError, LoadLimits, Warnings};

/// Where URIs are read from, with what is left of the cap on all their bytes together.
pub(super) struct UriReader<'a> {
    folder: &'a Folder,
    bytes_left: u64,
}

impl<'a> UriReader<'a> {
    /// Reads at most `limit` bytes in all.
    pub fn new(folder: &'a Folder, limit: u64) -> UriReader<'a> {
        UriReader { folder, bytes_left: limit }
    }

    /// Whether a URI could be read, without doing so.
    pub fn check(&self, uri: &str) -> Result<(), LoadError> {
        if uri.starts_with("data:") { Ok(()) } else { self.folder.resolve_uri(uri).map(|_| ()) }
    }

    /// The bytes that a URI stands for: of the URI itself, or of a file in the scene's folder.
    pub fn read(&mut self, uri: &str) -> Result<Vec<u8>, LoadError> {
        let bytes = match uri.strip_prefix("data:") {
            Some(data) => decode_data_uri(data)?,
            None => source::read_capped(&self.folder.resolve_uri(uri)?, self.bytes_left)?,
        };
        LoadError::check_limit("bytes of buffers and images", bytes.len() as u64, self.bytes_left)?;
        self.bytes_left -= bytes.len() as u64;
        Ok(bytes)
    }
}

/// What follows `data:`, decoded (RFC 2397).
fn decode_data_uri(data: &str) -> Result<Vec<u8>, LoadError> {
    let (kind, body) = data.split_once(',').ok_or_else(|| LoadError::malformed("data URI", "no comma"))?;
    if kind.ends_with(";base64") {
        decode_base64(body).ok_or_else(|| LoadError::malformed("data URI", "not valid base64"))
    } else {
        Ok(percent_decode_str(body).collect())
    }
}

/// RFC 4648, section 4; padding may be missing.
fn decode_base64(text: &str) -> Option<Vec<u8>> {
    let text = text.trim_end_matches('=').as_bytes();
    if text.len() % 4 == 1 {
        return None;
    }
    let mut bytes = Vec::with_capacity(text.len() / 4 * 3 + 2);
    for group in text.chunks(4) {
        let mut bits = 0_u32;
        for (place, &symbol) in group.iter().enumerate() {
            let value = match symbol {
                b'A'..=b'Z' => symbol - b'A',
                b'a'..=b'z' => symbol - b'a' + 26,
                b'0'..=b'9' => symbol - b'0' + 52,
                b'+' => 62,
                b'/' => 63,
                _ => return None,
            };
            bits |= u32::from(value) << (18 - 6 * place);
        }
        bytes.extend_from_slice(&bits.to_be_bytes()[1..group.len()]);
    }
    Some(bytes)
}

/// The bytes of a compressed view, or why there are none: an error only once they are needed.
type Decompressed = Result<Vec<u8>, String>;

/// All buffers of a document, and what its compressed views decompress to.
pub(super) struct Buffers<'a> {
    document: &'a Document,
    /// `None` where the file has no bytes for it: a fallback for readers without `EXT_meshopt_compression`.
    buffers: Vec<Option<Cow<'a, [u8]>>>,
    /// By view; `None` where it is not compressed.
    decompressed: Vec<Option<Decompressed>>,
}

/// The bytes of a view.
#[derive(Debug, Clone, Copy)]
pub(super) struct View<'a> {
    pub bytes: &'a [u8],
    /// `None` where elements follow one another tightly.
    pub stride_bytes: Option<usize>,
}

impl<'a> Buffers<'a> {
    /// Reads all buffers and decompresses all compressed views.
    pub fn read(
        document: &'a Document,
        bin: Option<&'a [u8]>,
        uris: &mut UriReader<'_>,
        limits: &LoadLimits,
        warnings: &mut Warnings,
    ) -> Result<Buffers<'a>, LoadError> {
        let mut buffers = Vec::with_capacity(document.buffers.len());
        for (index, buffer) in document.buffers.iter().enumerate() {
            let at = || format!("buffers[{index}]");
            let bytes: Option<Cow<'a, [u8]>> = match (&buffer.uri, bin) {
                (Some(uri), _) => Some(uris.read(uri)?.into()),
                (None, Some(bin)) if index == 0 => Some(bin.into()),
                (None, _) => None,
            };
            if let Some(bytes) = &bytes {
                let (found, claimed) = (bytes.len() as u64, buffer.byte_length);
                if found < claimed {
                    let fault = format!("byteLength {claimed}, but there are only {found} bytes");
                    return Err(LoadError::malformed(at(), fault));
                }
                // A chunk is padded to a multiple of four.
                if found > claimed.saturating_add(3) {
                    warnings.add(format!("{}: {} bytes past its byteLength are ignored", at(), found - claimed));
                }
            }
            buffers.push(bytes);
        }
        let mut all = Buffers { document, buffers, decompressed: Vec::new() };
        all.decompressed = all.decompress(limits)?;
        Ok(all)
    }

    fn decompress(&self, limits: &LoadLimits) -> Result<Vec<Option<Decompressed>>, LoadError> {
        let claimed = self.document.buffer_views.iter().filter_map(|view| view.extensions.meshopt.as_ref());
        let total = claimed.fold(0_u64, |sum, m| sum.saturating_add(m.count.saturating_mul(m.byte_stride)));
        LoadError::check_limit("bytes of EXT_meshopt_compression views", total, limits.file_bytes)?;
        Ok(self
            .document
            .buffer_views
            .par_iter()
            .map(|view| {
                let compressed = view.extensions.meshopt.as_ref()?;
                let fallback_bytes = self.document.buffers.get(view.buffer).map_or(0, |buffer| buffer.byte_length);
                if view.byte_offset.saturating_add(view.byte_length) > fallback_bytes {
                    return Some(Err(format!("the view itself ends past the {fallback_bytes} bytes of its buffer")));
                }
                let bytes = self.range(compressed.buffer, compressed.byte_offset, compressed.byte_length);
                Some(bytes.and_then(|bytes| meshopt::decompress(compressed, bytes)))
            })
            .collect())
    }

    fn range(&self, buffer: usize, offset: u64, length: u64) -> Result<&[u8], String> {
        let bytes = self
            .buffers
            .get(buffer)
            .ok_or_else(|| format!("buffer {buffer} does not exist, there are {}", self.buffers.len()))?;
        let bytes = bytes.as_ref().ok_or_else(|| format!("buffer {buffer} has no data"))?;
        let end = offset.checked_add(length).filter(|&end| end <= bytes.len() as u64);
        let end =
            end.ok_or_else(|| format!("{length} bytes at {offset} are past the {} of buffer {buffer}", bytes.len()))?;
        Ok(&bytes[offset as usize..end as usize])
    }

    /// The bytes of view `index`.
    pub fn view(&self, index: usize) -> Result<View<'_>, LoadError> {
        let at = || format!("bufferViews[{index}]");
        let view = self.document.buffer_views.get(index).ok_or_else(|| {
            LoadError::malformed(at(), format!("does not exist, there are {}", self.document.buffer_views.len()))
        })?;
        if let Some(Some(decompressed)) = self.decompressed.get(index) {
            let bytes = decompressed
                .as_ref()
                .map_err(|fault| LoadError::malformed(format!("{} (EXT_meshopt_compression)", at()), fault))?;
            let stride = view.extensions.meshopt.as_ref().map(|compressed| compressed.byte_stride as usize);
            return Ok(View { bytes, stride_bytes: stride });
        }
        let bytes = self.range(view.buffer, view.byte_offset, view.byte_length);
        let bytes = bytes.map_err(|fault| LoadError::malformed(at(), fault))?;
        let stride_bytes = match view.byte_stride {
            None => None,
            // glTF 2.0, 5.11.4: the allowed range.
            Some(stride @ 4..=252) => Some(stride as usize),
            Some(stride) => return Err(LoadError::malformed(at(), format!("byteStride {stride} is not in 4 to 252"))),
        };
        Ok(View { bytes, stride_bytes })
    }
}
