//! The folder of a commit: what is known of each piece, from the files that it left.

use std::path::PathBuf;

use anyhow::Context;
use serde::{Deserialize, Serialize};

use super::pieces::Piece;
use crate::report::kept::Source;
use crate::report::{Bar, Figure};

/// How a run of a piece went; written when its process has ended.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Record {
    /// What was run.
    pub command: String,
    /// When, and by what.
    pub source: Source,
    /// How long the process ran. What an interrupted run before it took does not count.
    pub wall_s: f64,
    /// Why it does not count, where it does not.
    pub failed: Option<String>,
}

/// What a page of all pieces shows of a report, of the fields of [`crate::report::Report`].
#[derive(Debug, Clone, Deserialize)]
pub struct Found {
    /// Of the source tree.
    pub commit: String,
    /// The graphics adapter and its driver.
    pub adapter: String,
    /// Processor and threads.
    pub cpu: String,
    /// What the figures must reach.
    pub bars: Vec<Bar>,
    /// Plots and pictures.
    pub figures: Vec<Figure>,
}

/// What is known of a piece.
#[derive(Debug, Clone)]
pub enum Status {
    /// It has not been run to its end.
    NotRun,
    /// It failed; the report is there where only a row of it failed.
    Failed(Record, Option<Found>),
    /// It is complete.
    Finished(Record, Found),
}

impl Status {
    /// The report, where there is one.
    pub fn found(&self) -> Option<&Found> {
        match self {
            Status::NotRun => None,
            Status::Failed(_, found) => found.as_ref(),
            Status::Finished(_, found) => Some(found),
        }
    }
}

/// The pieces of a commit.
#[derive(Debug)]
pub struct Folder {
    /// DIR/COMMIT.
    pub path: PathBuf,
    /// What runs pieces now.
    pub source: Source,
}

impl Folder {
    /// Where a piece's files go.
    pub fn of(&self, piece: &Piece) -> PathBuf {
        self.path.join(&piece.name)
    }

    /// What is known of a piece. A record of another command counts as none; so does one of another program, where
    /// files were changed after the commit, for such a tree has no name.
    pub fn status(&self, piece: &Piece) -> Status {
        let text = std::fs::read_to_string(self.record_path(piece)).unwrap_or_default();
        let is_of_this = |record: &Record| {
            let same_program = record.source.build == self.source.build || !self.source.commit.ends_with("-dirty");
            record.command == piece.command && same_program
        };
        let Some(record) = serde_json::from_str(&text).ok().filter(is_of_this) else {
            return Status::NotRun;
        };
        match (self.found(piece), &record.failed) {
            (Ok(found), None) => Status::Finished(record, found),
            (Ok(found), Some(_)) => Status::Failed(record, Some(found)),
            (Err(_), Some(_)) => Status::Failed(record, None),
            (Err(_), None) => Status::NotRun,
        }
    }

    /// The report of a piece, if it is of this commit.
    pub fn found(&self, piece: &Piece) -> anyhow::Result<Found> {
        let path = self.of(piece).join(format!("{}.json", piece.topic()));
        let read = || -> anyhow::Result<Found> { Ok(serde_json::from_slice(&std::fs::read(&path)?)?) };
        let found = read().with_context(|| format!("no report in {}", path.display()))?;
        let (made, now) = (&found.commit, &self.source.commit);
        anyhow::ensure!(made == now, "made of commit {}: the source tree was changed meanwhile", short(made));
        Ok(found)
    }

    /// Makes room for a run: what an earlier one wrote at its end goes, what it kept to go on from stays.
    pub fn clear(&self, piece: &Piece) -> anyhow::Result<()> {
        let folder = self.of(piece);
        std::fs::create_dir_all(&folder).with_context(|| folder.display().to_string())?;
        for path in [self.record_path(piece), folder.join(format!("{}.json", piece.topic())), folder.join("index.html")]
        {
            if path.exists() {
                std::fs::remove_file(&path).with_context(|| path.display().to_string())?;
            }
        }
        Ok(())
    }

    /// Writes how a run went.
    pub fn keep(&self, piece: &Piece, record: &Record) -> anyhow::Result<()> {
        let path = self.record_path(piece);
        std::fs::write(&path, serde_json::to_string_pretty(record)?).with_context(|| path.display().to_string())
    }

    fn record_path(&self, piece: &Piece) -> PathBuf {
        self.of(piece).join("piece.json")
    }
}

/// A commit by its first ten letters; `-dirty` stays.
pub fn short(commit: &str) -> String {
    let (hash, dirty) = commit.strip_suffix("-dirty").map_or((commit, ""), |hash| (hash, "-dirty"));
    hash.chars().take(10).chain(dirty.chars()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::scratch_folder;

    #[test]
    fn changed_files_show_in_a_short_commit() {
        assert_eq!(short("0123456789abcdef"), "0123456789");
        assert_eq!(short("0123456789abcdef-dirty"), "0123456789-dirty");
        assert_eq!(short("unknown"), "unknown");
    }

    #[test]
    fn a_piece_is_finished_only_by_its_own_command_of_this_tree() {
        let path = scratch_folder("all-status");
        let folder = |commit: &str, build: &str| Folder {
            path: path.clone(),
            source: Source { date: "d".into(), commit: commit.into(), build: build.into() },
        };
        let piece = |command: &str| Piece { name: "p".into(), command: command.into() };
        let is_finished = |of: &Folder, command: &str| matches!(of.status(&piece(command)), Status::Finished(..));
        let report = |commit: &str| {
            let text =
                format!("{{\"commit\":\"{commit}\",\"adapter\":\"a\",\"cpu\":\"c\",\"bars\":[],\"figures\":[]}}");
            std::fs::write(path.join("p/codec.json"), text).unwrap();
        };
        let run = |of: &Folder| {
            of.clear(&piece("codec")).unwrap();
            report(&of.source.commit);
            let record = Record { command: "codec".into(), source: of.source.clone(), wall_s: 1.0, failed: None };
            of.keep(&piece("codec"), &record).unwrap();
        };
        let clean = folder("c", "1");
        assert!(!is_finished(&clean, "codec"), "nothing is there");
        run(&clean);
        assert!(is_finished(&clean, "codec"));
        assert!(is_finished(&folder("c", "2"), "codec"), "the same sources, built again");
        assert!(!is_finished(&clean, "codec --quick"), "another command");
        report("other");
        assert!(!is_finished(&clean, "codec"), "the report is of another commit");
        std::fs::write(path.join("p/codec.json"), "{\"commit\":").unwrap();
        assert!(!is_finished(&clean, "codec"), "the report is cut off");
        run(&folder("c-dirty", "1"));
        assert!(is_finished(&folder("c-dirty", "1"), "codec"));
        assert!(!is_finished(&folder("c-dirty", "2"), "codec"), "other changes, perhaps");
        std::fs::remove_dir_all(path).unwrap();
    }
}
