//! No two files of a crate use each other, neither directly nor by way of others: what several need lies below them.
//!
//! A file uses another where it names something that the other defines: by `use`, or by a path in its code. A name that a parent
//! passes on (`pub use child::Name`) counts as one of the file that defines it, and passing it on is no use, unless the parent
//! names it in its own code. `mod child;` is no use.
//!
//! Not seen are names that nobody writes: methods and fields of a value that came from elsewhere, and what macros make. Neither are
//! conditions other than `cfg(test)`, whose code is left out; `#[path]`; and names that a function or a block imports are taken for the whole
//! module's.

mod modules;
mod rings;
mod scan;
mod tokens;

use std::path::Path;

use anyhow::{Context, bail};

use modules::{Modules, Sources, Uses};
use rings::rings;

/// Checks every crate of the workspace.
pub fn check() -> anyhow::Result<()> {
    let manifest = std::fs::read_to_string("Cargo.toml").context("reading Cargo.toml")?;
    let mut found = Vec::new();
    for name in members(&manifest) {
        let mut sources = Sources::new();
        read(Path::new(name).join("src").as_path(), &mut sources)?;
        let roots: Vec<&str> = sources.keys().map(String::as_str).filter(|file| is_root(name, file)).collect();
        for root in roots {
            found.extend(circles(&Modules::of(&sources, root).uses()));
        }
    }
    if !found.is_empty() {
        bail!("files that use each other in a circle, {} times:\n{}", found.len(), found.join("\n"));
    }
    Ok(())
}

/// The folders of a workspace's crates.
fn members(manifest: &str) -> Vec<&str> {
    let list = manifest.split_once("members = [").map_or("", |(_, after)| after.split(']').next().unwrap_or_default());
    list.split('"').skip(1).step_by(2).collect()
}

/// Whether a crate begins in a file: a library, or a program.
fn is_root(name: &str, file: &str) -> bool {
    let within = file.strip_prefix(name).and_then(|rest| rest.strip_prefix("/src/")).unwrap_or_default();
    let program = within.strip_prefix("bin/").unwrap_or("/");
    matches!(within, "lib.rs" | "main.rs") || !program.contains('/') || program.ends_with("/main.rs")
}

fn read(folder: &Path, into: &mut Sources) -> anyhow::Result<()> {
    for entry in std::fs::read_dir(folder).with_context(|| format!("reading {}", folder.display()))? {
        let path = entry?.path();
        if path.is_dir() {
            read(&path, into)?;
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            let source = std::fs::read_to_string(&path).with_context(|| format!("reading {}", path.display()))?;
            into.insert(path.to_string_lossy().replace('\\', "/"), source);
        }
    }
    Ok(())
}

/// A paragraph a circle: who uses what of whom.
fn circles(uses: &Uses<'_>) -> Vec<String> {
    let paragraph = |ring: Vec<&str>| {
        let within = uses.iter().filter(|((from, to), _)| ring.contains(from) && ring.contains(to));
        let lines = within.map(|((from, to), names)| format!("    {from} uses of {to}: {}", names.join(", ")));
        format!("  {} files:\n{}", ring.len(), lines.collect::<Vec<_>>().join("\n"))
    };
    rings(uses.keys().copied()).into_iter().map(paragraph).collect()
}

#[cfg(test)]
mod tests;
