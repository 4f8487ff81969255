//! Every shader file parses and validates as naga sees it, alone or as the module of its entry points.

use naga::valid::{Capabilities, ValidationFlags, Validator};

fn validate(path: &str) -> Result<naga::Module, String> {
    let text = vantage_shaders::source(path).map_err(|error| error.to_string())?;
    let module = naga::front::wgsl::parse_str(&text).map_err(|error| error.emit_to_string_with_path(&text, path))?;
    Validator::new(ValidationFlags::all(), Capabilities::all())
        .validate(&module)
        .map_err(|error| error.emit_to_string_with_path(&text, path))?;
    Ok(module)
}

#[test]
fn every_file_is_valid() {
    assert!(vantage_shaders::ALL.len() >= 4, "the build script embedded nothing");
    let errors: Vec<String> = vantage_shaders::ALL.iter().filter_map(|(path, _)| validate(path).err()).collect();
    assert!(errors.is_empty(), "{}", errors.join("\n"));
}

#[test]
fn entry_files_have_entry_points() {
    for path in vantage_shaders::entry_files() {
        let module = validate(path).expect("checked by every_file_is_valid");
        assert!(!module.entry_points.is_empty(), "{path} has no entry point");
    }
}
