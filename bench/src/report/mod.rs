//! The frame of every report: figures in one schema, and the files that show them.
//!
//! A [`Report`] is filled by a topic and written by [`write::write_all`] as `TOPIC.json`, `TOPIC.csv`, SVG plots and one
//! `index.html`. Field names carry their units. What failed stays in as a row that says why; a bar that is missed is printed
//! as a miss.

pub mod html;
pub mod kept;
pub mod machine;
pub mod plot;
pub mod progress;
pub mod rows;
pub mod table;
pub mod write;

use std::borrow::Cow;
use std::fmt;
use std::marker::PhantomData;

use serde::de::{MapAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use serde_json::Value;

use crate::spread::Spread;
use table::Table;

/// Values by name, in the order in which they are to be read.
#[derive(Debug, Clone, PartialEq)]
pub struct Fields<T>(pub Vec<(String, T)>);

impl<T> Default for Fields<T> {
    fn default() -> Self {
        Fields(Vec::new())
    }
}

impl<T> Fields<T> {
    /// Adds or replaces a value.
    pub fn set(&mut self, name: impl Into<String>, value: impl Into<T>) {
        let (name, value) = (name.into(), value.into());
        match self.0.iter_mut().find(|(known, _)| *known == name) {
            Some((_, slot)) => *slot = value,
            None => self.0.push((name, value)),
        }
    }

    /// The value of a name.
    pub fn get(&self, name: &str) -> Option<&T> {
        self.0.iter().find(|(known, _)| known == name).map(|(_, value)| value)
    }
}

impl<T: Serialize> Serialize for Fields<T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_map(self.0.iter().map(|(name, value)| (name, value)))
    }
}

impl<'de, T: Deserialize<'de>> Deserialize<'de> for Fields<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Fields<T>, D::Error> {
        deserializer.deserialize_map(InOrder(PhantomData))
    }
}

/// Reads [`Fields`] in the order in which they are written.
struct InOrder<T>(PhantomData<T>);

impl<'de, T: Deserialize<'de>> Visitor<'de> for InOrder<T> {
    type Value = Fields<T>;

    fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("values by name")
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Fields<T>, A::Error> {
        let mut fields = Vec::new();
        while let Some(entry) = map.next_entry()? {
            fields.push(entry);
        }
        Ok(Fields(fields))
    }
}

/// One method at one setting on one scene.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Row {
    /// The scene's name.
    pub scene: String,
    /// What was measured.
    pub method: String,
    /// Its settings.
    pub parameters: Fields<Value>,
    /// Errors and similarities, each with its spread.
    pub error: Fields<Spread>,
    /// Milliseconds by stage.
    pub time_ms: Fields<Spread>,
    /// Bytes by kind.
    pub bytes: Fields<f64>,
    /// Everything that is counted, rates and ratios included; the name says what.
    pub counts: Fields<f64>,
    /// Why there are no figures.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub failed: Option<String>,
}

impl Row {
    /// A row without figures yet.
    pub fn new(scene: &str, method: &str) -> Row {
        Row { scene: scene.to_owned(), method: method.to_owned(), ..Row::default() }
    }

    /// A row that says why it has no figures.
    pub fn failed(scene: &str, method: &str, error: &anyhow::Error) -> Row {
        Row { failed: Some(format!("{error:#}")), ..Row::new(scene, method) }
    }

    /// A figure by its path, for example `error.flip.mean` or `counts.images`.
    pub fn figure(&self, path: &str) -> Option<f64> {
        let (group, name) = path.split_once('.')?;
        let spread = |fields: &Fields<Spread>| {
            let (name, part) = name.split_once('.')?;
            let spread = fields.get(name)?;
            match part {
                "mean" => Some(spread.mean),
                "median" => Some(spread.median),
                "p95" => Some(spread.p95),
                "worst" => Some(spread.worst),
                _ => None,
            }
        };
        match group {
            "error" => spread(&self.error),
            "time_ms" => spread(&self.time_ms),
            "bytes" => self.bytes.get(name).copied(),
            "counts" => self.counts.get(name).copied(),
            _ => None,
        }
    }
}

/// What a figure must reach.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Bar {
    /// What is measured, on which scene.
    pub what: String,
    /// The most that passes; JSON has null for what is not finite.
    #[serde(deserialize_with = "number_or_null")]
    pub at_most: f64,
    /// What was found; `None` where the run could not be made.
    pub found: Option<f64>,
    /// Unit of both, empty for plain numbers; `share` is shown as a percentage.
    pub unit: Cow<'static, str>,
    /// Whether it passes.
    pub verdict: Verdict,
}

/// Whether a bar is met.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "UPPERCASE")]
pub enum Verdict {
    /// The figure is at most the bar.
    Pass,
    /// It is above, or there is none.
    Miss,
}

impl Bar {
    /// A bar that passes while the figure is at most `at_most`.
    pub fn at_most(what: impl Into<String>, at_most: f64, found: Option<f64>, unit: &'static str) -> Bar {
        let verdict = if found.is_some_and(|found| found <= at_most) { Verdict::Pass } else { Verdict::Miss };
        Bar { what: what.into(), at_most, found, unit: unit.into(), verdict }
    }

    /// Whether it is missed.
    pub fn is_missed(&self) -> bool {
        self.verdict == Verdict::Miss
    }
}

fn number_or_null<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
    Ok(Option::deserialize(deserializer)?.unwrap_or(f64::NAN))
}

/// A picture or plot of the page, as a file beside it.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Figure {
    /// File name inside of the report's folder.
    pub file: String,
    /// What it shows, in a sentence.
    pub caption: String,
}

/// Everything that a run of a topic found.
#[derive(Debug, Clone, Serialize)]
pub struct Report {
    /// The topic's name.
    pub topic: String,
    /// What the topic shows, in a sentence or two.
    pub about: String,
    /// Of the source tree; ends with `-dirty` where files were changed.
    pub commit: String,
    /// The graphics adapter and its driver; `none` where no pass ran.
    pub adapter: String,
    /// Processor and the threads that this process may use.
    pub cpu: String,
    /// UTC, ISO 8601.
    pub date: String,
    /// The scenes, by name.
    pub scene: Vec<String>,
    /// What was run, so that it can be run again.
    pub settings: Fields<Value>,
    /// What the figures must reach.
    pub bars: Vec<Bar>,
    /// Tables of the topic's own, with their titles; where there are any, the terminal shows them instead of all rows.
    #[serde(skip)]
    pub tables: Vec<(String, Table)>,
    /// The figures.
    pub rows: Vec<Row>,
    /// Plots and pictures, in order.
    pub figures: Vec<Figure>,
    /// What a reader must know to judge the figures.
    pub notes: Vec<String>,
}

impl Report {
    /// An empty report of this machine, now.
    pub fn new(topic: &str, about: &str) -> Report {
        Report {
            topic: topic.to_owned(),
            about: about.to_owned(),
            commit: machine::commit(),
            adapter: "none".to_owned(),
            cpu: machine::cpu(),
            date: machine::date_utc(),
            scene: Vec::new(),
            settings: Fields::default(),
            bars: Vec::new(),
            tables: Vec::new(),
            rows: Vec::new(),
            figures: Vec::new(),
            notes: Vec::new(),
        }
    }

    /// Whether a run could not be made.
    pub fn has_failures(&self) -> bool {
        self.rows.iter().any(|row| row.failed.is_some())
    }
}

/// An empty folder for a test's files.
#[cfg(test)]
pub(crate) fn scratch_folder(name: &str) -> std::path::PathBuf {
    let folder = std::env::temp_dir().join(format!("vantage-bench-{name}-{}", std::process::id()));
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).expect("the temporary folder is writable");
    folder
}
