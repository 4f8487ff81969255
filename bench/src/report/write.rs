//! Writes a report: JSON, CSV and the page; and prints its tables.

use std::path::Path;

use anyhow::Context;

use super::rows::{bar_table, ordered_names, plain, row_tables};
use super::table::Table;
use super::{Report, Row, html};

/// Writes `TOPIC.json`, `TOPIC.csv` and `index.html` into `folder`; plots and pictures are there already.
pub fn write_all(report: &Report, folder: &Path) -> anyhow::Result<()> {
    let json = serde_json::to_string_pretty(report)?;
    let files = [
        (format!("{}.json", report.topic), json),
        (format!("{}.csv", report.topic), csv_table(&report.rows).csv()),
        ("index.html".to_owned(), html::page(report)),
    ];
    for (name, text) in files {
        let path = folder.join(name);
        std::fs::write(&path, text).with_context(|| path.display().to_string())?;
    }
    Ok(())
}

/// What the terminal shows: where it ran, the rows, the bars, the notes.
pub fn terminal_text(report: &Report) -> String {
    let mut text = format!("{}: {}\nadapter: {}\ncpu: {}\n\n", report.topic, report.about, report.adapter, report.cpu);
    let rows: Vec<Row> =
        report.rows.iter().filter(|row| report.tables.is_empty() || row.failed.is_some()).cloned().collect();
    for (heading, table) in report.tables.iter().cloned().chain(row_tables(&rows)) {
        text += &format!("{heading}\n{}\n", table.text());
    }
    if !report.bars.is_empty() {
        text += &format!("Bars\n{}\n", bar_table(&report.bars).text());
    }
    for note in &report.notes {
        text += &format!("- {note}\n");
    }
    text
}

/// Every figure of every row, a column each; names are paths as [`Row::figure`] takes them.
pub fn csv_table(rows: &[Row]) -> Table {
    let paths = ordered_names(rows, figure_paths);
    let parameters = ordered_names(rows, |row| row.parameters.0.iter().map(|(name, _)| name.clone()).collect());
    let mut headings = vec!["scene".to_owned(), "method".to_owned()];
    headings.extend(parameters.iter().map(|name| format!("parameters.{name}")));
    headings.extend(paths.iter().cloned());
    headings.push("failed".to_owned());
    let mut table = Table::new(headings);
    for row in rows {
        let mut cells = vec![row.scene.clone(), row.method.clone()];
        cells.extend(parameters.iter().map(|name| row.parameters.get(name).map_or(String::new(), plain)));
        cells.extend(paths.iter().map(|path| row.figure(path).map_or(String::new(), |figure| figure.to_string())));
        cells.push(row.failed.clone().unwrap_or_default());
        table.row(cells);
    }
    table
}

fn figure_paths(row: &Row) -> Vec<String> {
    let spread = |group: &'static str, name: &String| {
        ["mean", "median", "p95", "worst"].map(|part| format!("{group}.{name}.{part}"))
    };
    let errors = row.error.0.iter().flat_map(|(name, _)| spread("error", name));
    let times = row.time_ms.0.iter().flat_map(|(name, _)| spread("time_ms", name));
    let bytes = row.bytes.0.iter().map(|(name, _)| format!("bytes.{name}"));
    let counts = row.counts.0.iter().map(|(name, _)| format!("counts.{name}"));
    errors.chain(times).chain(bytes).chain(counts).collect()
}
