//! Keeps ARCHITECTURE.md true: the paths it names exist, and imports run one way, between crates and within each.

use std::path::Path;

use anyhow::{Context, bail};

use crate::circles;

/// The crates in the order of the data's way: each may depend only on crates of an earlier group.
const ORDER: &[&[&str]] = &[
    &["camera", "network", "manual"],
    &["protocol", "shaders", "scene"],
    &["gpu", "impostor"],
    &["surface"],
    &["server", "client"],
    &["web", "bench"],
    &["tests", "fuzz"],
];

/// What must stay thin: these never see a scene.
const WITHOUT_SCENE: &[&str] = &["gpu", "surface", "client", "web"];

/// Checks all of it.
pub fn check() -> anyhow::Result<()> {
    check_imports()?;
    check_paths()?;
    circles::check()
}

fn check_imports() -> anyhow::Result<()> {
    for (rank, group) in ORDER.iter().enumerate() {
        let allowed: Vec<&str> = ORDER[..rank].concat();
        for name in *group {
            let manifest =
                std::fs::read_to_string(format!("{name}/Cargo.toml")).with_context(|| format!("reading {name}"))?;
            for dependency in ORDER.concat() {
                let depends = manifest.lines().any(|line| {
                    line.strip_prefix(dependency)
                        .is_some_and(|rest| rest.starts_with(".workspace") || rest.starts_with(" ="))
                });
                if depends && !allowed.contains(&dependency) {
                    bail!("{name} must not depend on {dependency}: imports run {ORDER:?}");
                }
                if depends && dependency == "scene" && WITHOUT_SCENE.contains(name) {
                    bail!("{name} must not depend on scene: it is for the server side only");
                }
            }
        }
    }
    Ok(())
}

/// Every `code span` of ARCHITECTURE.md that looks like a path must exist; names all that do not.
fn check_paths() -> anyhow::Result<()> {
    let text = std::fs::read_to_string("ARCHITECTURE.md").context("reading ARCHITECTURE.md")?;
    let is_path = |span: &str| {
        span.contains('/')
            && !span.starts_with(['/', '-', '.'])
            && span.chars().all(|c| c.is_ascii_alphanumeric() || "/._-".contains(c))
    };
    let missing: Vec<&str> =
        text.split('`').skip(1).step_by(2).filter(|span| is_path(span) && !Path::new(span).exists()).collect();
    if !missing.is_empty() {
        bail!("ARCHITECTURE.md names what does not exist: {}", missing.join(", "));
    }
    Ok(())
}
