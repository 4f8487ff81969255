//! The WGSL of Vantage and its one resolver, used at run time, by the tests and in the browser.
//!
//! Files live under `wgsl/` and are embedded by the build script: a new file needs no registration, and the test
//! `tests/validate.rs` checks it with naga. A line `#import "common/srgb.wgsl"` pulls in another file, once each, before the
//! rest of the importing file; `enable …;` lines are moved to the top, where WGSL wants them. Variants are made with
//! `override` constants, never by editing text.

#[cfg(feature = "layout")]
pub mod layout;

use std::collections::BTreeSet;

/// Every shader file: its path below `wgsl/` and its text.
pub static ALL: &[(&str, &str)] = include!(concat!(env!("OUT_DIR"), "/files.rs"));

/// Why a shader could not be put together. All are mistakes in the program.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ShaderError {
    /// No file has this path.
    #[error("no shader file '{path}' (imported by '{importer}')")]
    Missing {
        /// The path asked for.
        path: String,
        /// Who asked.
        importer: String,
    },
    /// An import line that is not `#import "path"`.
    #[error("'{path}' line {line}: expected #import \"path\"")]
    Import {
        /// The file.
        path: String,
        /// Counted from 1.
        line: usize,
    },
}

/// The whole WGSL module of the file at `path` (below `wgsl/`), imports included.
pub fn source(path: &str) -> Result<String, ShaderError> {
    let mut module = Module::default();
    module.add(path, "the program")?;
    module.enables.push_str(&module.body);
    Ok(module.enables)
}

/// The paths of the files that hold an entry point: each is a module of its own.
pub fn entry_files() -> impl Iterator<Item = &'static str> {
    let is_entry = |text: &str| ["@vertex", "@fragment", "@compute"].iter().any(|stage| text.contains(stage));
    ALL.iter().filter(move |(_, text)| is_entry(text)).map(|(path, _)| *path)
}

#[derive(Default)]
struct Module {
    enables: String,
    body: String,
    seen: BTreeSet<String>,
}

impl Module {
    fn add(&mut self, path: &str, importer: &str) -> Result<(), ShaderError> {
        if !self.seen.insert(path.to_owned()) {
            return Ok(());
        }
        let missing = || ShaderError::Missing { path: path.to_owned(), importer: importer.to_owned() };
        let (_, text) = ALL.iter().find(|(name, _)| *name == path).ok_or_else(missing)?;
        let mut own = format!("// ---- {path}\n");
        for (index, line) in text.lines().enumerate() {
            let trimmed = line.trim_start();
            if let Some(rest) = trimmed.strip_prefix("#import") {
                let bad = || ShaderError::Import { path: path.to_owned(), line: index + 1 };
                let import = rest.trim().strip_prefix('"').and_then(|rest| rest.strip_suffix('"')).ok_or_else(bad)?;
                self.add(import, path)?;
            } else if trimmed.starts_with("enable ") {
                if !self.enables.contains(trimmed.trim_end()) {
                    self.enables.push_str(trimmed.trim_end());
                    self.enables.push('\n');
                }
            } else {
                own.push_str(line);
                own.push('\n');
            }
        }
        self.body.push_str(&own);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_import_is_included_once_and_first() {
        let text = source("common/shade.wgsl").unwrap();
        assert_eq!(text.matches("fn srgb_from_linear(").count(), 1);
        assert!(text.find("fn srgb_from_linear(") < text.find("fn diffuse_light("));
        assert!(!text.contains("#import"));
    }

    #[test]
    fn a_missing_file_names_itself() {
        assert_eq!(
            source("nothing.wgsl"),
            Err(ShaderError::Missing { path: "nothing.wgsl".into(), importer: "the program".into() })
        );
    }
}
