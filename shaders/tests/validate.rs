//! Every shader file parses and validates as naga sees it, in the modules of the entry points that import it.

use std::collections::BTreeSet;

use naga::valid::{Capabilities, ValidationFlags, Validator};

fn validate(path: &str) -> Result<naga::Module, String> {
    let text = vantage_shaders::source(path).map_err(|error| error.to_string())?;
    let module = naga::front::wgsl::parse_str(&text).map_err(|error| error.emit_to_string_with_path(&text, path))?;
    Validator::new(ValidationFlags::all(), Capabilities::all())
        .validate(&module)
        .map_err(|error| error.emit_to_string_with_path(&text, path))?;
    Ok(module)
}

/// Files may use what their importers declare, as `common/sky.wgsl` does, so a file is checked in the modules it is part of; one that is part
/// of none would go unchecked.
#[test]
fn every_file_is_valid() {
    let mut checked = BTreeSet::new();
    let mut errors = Vec::new();
    for entry in vantage_shaders::entry_files() {
        match validate(entry) {
            Ok(module) if module.entry_points.is_empty() => errors.push(format!("{entry} has no entry point")),
            Ok(_) => {}
            Err(error) => errors.push(error),
        }
        let text = vantage_shaders::source(entry).expect("validated");
        checked.extend(
            vantage_shaders::ALL
                .iter()
                .map(|(path, _)| *path)
                .filter(|path| text.contains(&format!("// ---- {path}\n"))),
        );
    }
    errors.extend(
        vantage_shaders::ALL
            .iter()
            .filter(|(path, _)| !checked.contains(path))
            .map(|(path, _)| format!("nothing imports {path}")),
    );
    assert!(checked.len() >= 4, "the build script embedded nothing");
    assert!(errors.is_empty(), "{}", errors.join("\n"));
}
