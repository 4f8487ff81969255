//! What rows are measured with, and where they are kept.

use gpu::Gpu;
use serde_json::Value;

use super::settings::Settings;
use super::subject::Subject;
use crate::report::Row;
use crate::report::kept::Kept;
use crate::topic::Run;

/// See the module.
pub(super) struct Bench<'a> {
    pub gpu: Gpu,
    pub settings: Settings,
    pub run: &'a Run,
    pub kept: Kept,
    pub machine: Value,
}

impl Bench<'_> {
    pub fn subject(&self, name: &str) -> anyhow::Result<Subject> {
        Subject::new(&self.gpu, self.run.load(name)?, &self.settings)
    }

    /// The row of a key as an earlier run kept it.
    pub fn resumed(&self, key: &Value) -> Option<Row> {
        self.kept.get(key).map(|(source, row)| marked(row.clone(), &source.date, &source.commit, &source.build, true))
    }

    /// Keeps a row that was measured now.
    pub fn keep(&mut self, key: &Value, row: Row) -> anyhow::Result<Row> {
        self.kept.keep(key, &row)?;
        let now = self.kept.now();
        Ok(marked(row, &now.date, &now.commit, &now.build, false))
    }
}

/// A row with what measured it.
fn marked(mut row: Row, date: &str, commit: &str, build: &str, resumed: bool) -> Row {
    for (name, value) in [("measured", date), ("commit", commit), ("build", build)] {
        row.parameters.set(name, value);
    }
    row.parameters.set("resumed", resumed);
    row
}
