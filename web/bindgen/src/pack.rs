//! `vantage-pack FROM TO`: copies the built web client into a new folder, each file by Brotli and gzip beside itself, where that is less.
//!
//! Browsers take Brotli over TLS and from this machine alone.

use std::io::Write;
use std::path::{Path, PathBuf};

use anyhow::{Context, bail};

/// The most that the format has: it is done once, and decoded as fast as any other.
const BROTLI_QUALITY: u32 = 11;
const BROTLI_WINDOW_BITS: u32 = 22;
/// Of the coder's buffer.
const BUFFER_BYTES: usize = 1 << 16;

fn main() -> anyhow::Result<()> {
    let arguments: Vec<PathBuf> = std::env::args_os().skip(1).map(PathBuf::from).collect();
    let [from, to] = arguments.as_slice() else { bail!("usage: vantage-pack FROM TO") };
    if to.exists() {
        std::fs::remove_dir_all(to).with_context(|| to.display().to_string())?;
    }
    pack(from, to)
}

fn pack(from: &Path, to: &Path) -> anyhow::Result<()> {
    std::fs::create_dir_all(to).with_context(|| to.display().to_string())?;
    for entry in std::fs::read_dir(from).with_context(|| from.display().to_string())? {
        let entry = entry?;
        let target = to.join(entry.file_name());
        if entry.file_type()?.is_dir() {
            pack(&entry.path(), &target)?;
            continue;
        }
        let bytes = std::fs::read(entry.path()).with_context(|| entry.path().display().to_string())?;
        std::fs::write(&target, &bytes)?;
        for (end, packed) in [(".br", by_brotli(&bytes)?), (".gz", by_gzip(&bytes)?)] {
            if packed.len() < bytes.len() {
                let mut name = target.clone().into_os_string();
                name.push(end);
                std::fs::write(name, packed)?;
            }
        }
    }
    Ok(())
}

fn by_brotli(bytes: &[u8]) -> std::io::Result<Vec<u8>> {
    let mut packed = Vec::new();
    let mut coder = brotli::CompressorWriter::new(&mut packed, BUFFER_BYTES, BROTLI_QUALITY, BROTLI_WINDOW_BITS);
    coder.write_all(bytes)?;
    coder.flush()?;
    drop(coder);
    Ok(packed)
}

fn by_gzip(bytes: &[u8]) -> std::io::Result<Vec<u8>> {
    let mut coder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::best());
    coder.write_all(bytes)?;
    coder.finish()
}
