//! Rows of earlier runs, so that what takes hours is not done again: each is kept as soon as it is measured, a line of JSON.
//!
//! A row is found by a key of everything that its figures depend on, adapter and settings; the program itself is told apart by its bytes,
//! for a source tree may be changed after a commit and before the next one. What fails is not kept.

use std::collections::HashMap;
use std::fs::{File, OpenOptions};
use std::hash::{DefaultHasher, Hasher};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use anyhow::Context;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::{Row, machine};

/// Which rows of earlier runs are taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Taken {
    /// Those that this very program measured.
    #[default]
    SameBuild,
    /// Those of every build: for what was changed since does not concern them, as whoever asks for it knows.
    AnyBuild,
    /// None: everything is measured anew.
    Nothing,
}

/// What a row was measured by.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Source {
    /// UTC, ISO 8601.
    pub date: String,
    /// Of the source tree.
    pub commit: String,
    /// Tells programs apart.
    pub build: String,
}

impl Source {
    /// This program, of this source tree, now.
    pub fn now() -> anyhow::Result<Source> {
        Ok(Source { date: machine::date_utc(), commit: machine::commit(), build: build()?.to_owned() })
    }
}

#[derive(Serialize, Deserialize)]
struct Line {
    key: Value,
    source: Source,
    row: Row,
}

/// The rows of a folder.
#[derive(Debug)]
pub struct Kept {
    path: PathBuf,
    now: Source,
    /// By their keys; those of this run too.
    rows: HashMap<String, (Source, Row)>,
}

impl Kept {
    /// Reads what earlier runs of a topic kept in a folder. A line that is cut off is passed over.
    pub fn open(folder: &Path, topic: &str, taken: Taken) -> anyhow::Result<Kept> {
        Kept::opened_by(Source::now()?, folder, topic, taken)
    }

    fn opened_by(now: Source, folder: &Path, topic: &str, taken: Taken) -> anyhow::Result<Kept> {
        let path = folder.join(format!("{topic}-rows.jsonl"));
        let text = if path.exists() { std::fs::read_to_string(&path)? } else { String::new() };
        let lines = text.lines().filter_map(|line| serde_json::from_str::<Line>(line).ok());
        let is_taken = |line: &Line| match taken {
            Taken::SameBuild => line.source.build == now.build,
            Taken::AnyBuild => true,
            Taken::Nothing => false,
        };
        // The last one of a key is the latest.
        let rows = lines.filter(is_taken).map(|line| (line.key.to_string(), (line.source, line.row))).collect();
        Ok(Kept { path, now, rows })
    }

    /// What measures rows now.
    pub fn now(&self) -> &Source {
        &self.now
    }

    /// The row of a key, with what measured it.
    pub fn get(&self, key: &Value) -> Option<(&Source, &Row)> {
        self.rows.get(&key.to_string()).map(|(source, row)| (source, row))
    }

    /// Keeps a row, on the disk at once.
    pub fn keep(&mut self, key: &Value, row: &Row) -> anyhow::Result<()> {
        let line = Line { key: key.clone(), source: self.now.clone(), row: row.clone() };
        let file = OpenOptions::new().create(true).append(true).open(&self.path);
        let write = |mut file: File| {
            // What a killed run cut off ends here.
            let begins = if ends_amid_a_line(&self.path)? { "\n" } else { "" };
            writeln!(file, "{begins}{}", serde_json::to_string(&line)?)
        };
        file.and_then(write).with_context(|| self.path.display().to_string())?;
        self.rows.insert(key.to_string(), (line.source, line.row));
        Ok(())
    }
}

fn ends_amid_a_line(path: &Path) -> std::io::Result<bool> {
    Ok(std::fs::read(path)?.last().is_some_and(|byte| *byte != b'\n'))
}

/// What tells this program from others: a hash of its bytes.
fn build() -> anyhow::Result<&'static str> {
    static BUILD: OnceLock<String> = OnceLock::new();
    if BUILD.get().is_none() {
        let mut hasher = DefaultHasher::new();
        hasher.write(&std::fs::read(std::env::current_exe()?)?);
        let _ = BUILD.set(format!("{:016x}", hasher.finish()));
    }
    BUILD.get().map(String::as_str).context("it was set above")
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;
    use crate::report::scratch_folder;
    use crate::spread::Spread;

    fn by(build: &str) -> Source {
        Source { date: "2026-11-22T00:00:00Z".into(), commit: "c".into(), build: build.into() }
    }

    fn row(error: f64) -> Row {
        let mut row = Row::new("grass", "maps");
        row.parameters.set("lamp", 0.25);
        row.parameters.set("image_px", 512);
        row.error.set("visibility", Spread::single(error));
        row.counts.set("samples", 7.0);
        row
    }

    #[test]
    fn rows_come_back_as_they_were_and_only_for_their_settings() {
        let folder = scratch_folder("kept");
        let open = |build: &str, taken| Kept::opened_by(by(build), &folder, "shadows", taken).unwrap();
        let (small, large) = (json!({"image_px": 512, "lamp": 1.0}), json!({"image_px": 1024, "lamp": 1.0}));
        let mut kept = open("a", Taken::SameBuild);
        assert_eq!(kept.get(&small), None);
        kept.keep(&small, &row(0.1)).unwrap();
        kept.keep(&small, &row(1.0 / 3.0)).unwrap();
        assert_eq!(open("a", Taken::SameBuild).get(&small), Some((&by("a"), &row(1.0 / 3.0))));
        assert_eq!(open("a", Taken::SameBuild).get(&large), None);
        assert_eq!(open("b", Taken::SameBuild).get(&small), None, "another program measured it");
        assert!(open("b", Taken::AnyBuild).get(&small).is_some());
        assert_eq!(open("a", Taken::Nothing).get(&small), None);
        std::fs::remove_dir_all(folder).unwrap();
    }

    #[test]
    fn a_line_that_was_cut_off_costs_its_row_alone() {
        let folder = scratch_folder("kept-cut");
        let open = || Kept::opened_by(by("a"), &folder, "shadows", Taken::SameBuild).unwrap();
        open().keep(&json!(1), &row(1.0)).unwrap();
        let path = folder.join("shadows-rows.jsonl");
        let text = std::fs::read_to_string(&path).unwrap();
        std::fs::write(&path, text.clone() + &text[..text.len() / 2]).unwrap();
        open().keep(&json!(2), &row(2.0)).unwrap();
        let kept = open();
        assert_eq!(kept.get(&json!(1)), Some((&by("a"), &row(1.0))));
        assert_eq!(kept.get(&json!(2)), Some((&by("a"), &row(2.0))));
        std::fs::remove_dir_all(folder).unwrap();
    }
}
