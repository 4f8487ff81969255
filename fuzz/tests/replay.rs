//! Runs every target over its seeds and over what the fuzzer found, without the fuzzer.

#![allow(clippy::unwrap_used, reason = "a test that unwraps fails, as it should")]

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};

use vantage_fuzz::{TARGETS, seeds::seeds, target};

fn corpus() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("corpus")
}

/// Runs a target over its inputs; names those that it panics at, and seeds that mean nothing to it.
fn replay(name: &str) {
    let target = target(name).unwrap();
    let folder = std::fs::read_dir(corpus().join(name)).unwrap();
    let kept = folder.map(|entry| entry.unwrap().path()).filter(|path| path.extension().is_none());
    let kept = kept.map(|path| (path.display().to_string(), std::fs::read(&path).unwrap()));
    let run = |bytes: &[u8]| catch_unwind(AssertUnwindSafe(|| (target.run)(bytes)));
    let failed: Vec<String> = kept.filter(|(_, bytes)| run(bytes).is_err()).map(|(input, _)| input).collect();
    assert!(failed.is_empty(), "{name} fails at {failed:?}");
    let seeds = seeds(name);
    assert!(seeds.len() > 4, "{name} has no seeds");
    let unsound: Vec<String> =
        seeds.into_iter().filter(|(_, seed)| !matches!(run(seed), Ok(true))).map(|(seed, _)| seed).collect();
    assert!(unsound.is_empty(), "{name} does not take its seeds {unsound:?}");
}

#[test]
fn gltf_files() {
    replay("gltf");
}

#[test]
fn mesh_files() {
    replay("mesh_files");
}

#[test]
fn wire_messages() {
    replay("wire");
}

#[test]
fn codec_bytes() {
    replay("codec");
}

#[test]
fn sessions() {
    replay("session");
}

#[test]
fn traces_links_and_cameras() {
    replay("traces");
}

#[test]
fn every_target_has_a_folder_and_every_folder_a_target() {
    let mut folders: Vec<String> =
        std::fs::read_dir(corpus()).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    let mut names: Vec<&str> = TARGETS.iter().map(|target| target.name).collect();
    folders.sort_unstable();
    names.sort_unstable();
    assert_eq!(folders, names);
}

/// Of all targets, in bytes: everybody who clones the repository takes them along.
const MOST_BYTES: u64 = 400_000;

#[test]
fn the_corpus_stays_small() {
    let folders = TARGETS.iter().flat_map(|target| std::fs::read_dir(corpus().join(target.name)).unwrap());
    let bytes: u64 = folders.map(|entry| entry.unwrap().metadata().unwrap().len()).sum();
    assert!(bytes < MOST_BYTES, "{bytes} bytes");
}
