//! What the client draws with must run on WebGL2: it speaks GLSL ES 3.00, which lacks more than naga says.

use naga::back::glsl;
use naga::valid::{Capabilities, ValidationFlags, Validator};

/// Functions of GLSL ES 3.10 that naga writes for 3.00 without a word; `mix` of integers is what becomes of `select` of vectors.
const LATER: [&str; 8] = [
    "findLSB(",
    "findMSB(",
    "bitCount(",
    "bitfieldReverse(",
    "bitfieldExtract(",
    "bitfieldInsert(",
    "mix(ivec",
    "mix(uvec",
];

/// The GLSL of every entry point of a file.
fn glsl(path: &str) -> Result<Vec<String>, String> {
    let text = vantage_shaders::source(path).map_err(|error| error.to_string())?;
    let module = naga::front::wgsl::parse_str(&text).map_err(|error| error.emit_to_string_with_path(&text, path))?;
    let info = Validator::new(ValidationFlags::all(), Capabilities::all())
        .validate(&module)
        .map_err(|error| error.emit_to_string_with_path(&text, path))?;
    let options =
        glsl::Options { version: glsl::Version::Embedded { version: 300, is_webgl: true }, ..glsl::Options::default() };
    let write = |entry: &naga::EntryPoint| {
        let pipeline =
            glsl::PipelineOptions { shader_stage: entry.stage, entry_point: entry.name.clone(), multiview: None };
        let mut written = String::new();
        let policies = naga::proc::BoundsCheckPolicies::default();
        let failed = |error: glsl::Error| format!("{path}, {}: {error}", entry.name);
        // As `override` constants are by default; no pipeline is made with any left.
        let (module, info) = naga::back::pipeline_constants::process_overrides(
            &module,
            &info,
            Some((entry.stage, &entry.name)),
            &naga::back::PipelineConstants::default(),
        )
        .map_err(|error| format!("{path}, {}: {error}", entry.name))?;
        let mut writer =
            glsl::Writer::new(&mut written, &module, &info, &options, &pipeline, policies).map_err(failed)?;
        writer.write().map_err(failed)?;
        Ok(written)
    };
    module.entry_points.iter().map(write).collect()
}

#[test]
fn what_the_client_lights_and_reflects_with_is_glsl_es_3() {
    // What lies under `compute/` is not made where there are no compute shaders.
    let is_everywhere = |path: &&str| path.starts_with("client/") && !path.starts_with("client/compute/");
    let of_client = vantage_shaders::entry_files().filter(is_everywhere);
    let mut entries = 0;
    for path in of_client {
        for text in glsl(path).unwrap_or_else(|error| panic!("{error}")) {
            entries += 1;
            assert_eq!(LATER.iter().find(|name| text.contains(**name)), None, "{path}");
        }
    }
    assert!(entries > 20, "{entries} entry points, vertex and fragment");
}

/// `discard` does not end a function in WGSL: browsers refuse one that has something to return and does not. Naga takes it.
#[test]
fn no_function_ends_by_discarding() {
    for path in vantage_shaders::entry_files() {
        let text = vantage_shaders::source(path).expect("composed before");
        assert!(!text.contains("\n    discard;\n}"), "{path}");
    }
}
