//! Tables of rows and bars, for people.

use std::collections::BTreeSet;

use serde_json::Value;

use super::table::{Table, number, percent};
use super::{Bar, Row};
use crate::spread::Spread;

/// A table a scene for people: spreads as `mean / p95 / worst`, times as medians, shares as percentages.
pub fn row_tables(rows: &[Row]) -> Vec<(String, Table)> {
    let scenes = ordered_names(rows, |row| vec![row.scene.clone()]);
    let of_scene = |scene: &String| {
        let rows: Vec<Row> = rows.iter().filter(|row| row.scene == *scene).cloned().collect();
        (scene.clone(), scene_table(&rows))
    };
    scenes.iter().map(of_scene).collect()
}

fn scene_table(rows: &[Row]) -> Table {
    let parameters = ordered_names(rows, |row| row.parameters.0.iter().map(|(name, _)| name.clone()).collect());
    let errors = ordered_names(rows, |row| row.error.0.iter().map(|(name, _)| name.clone()).collect());
    let times = ordered_names(rows, |row| row.time_ms.0.iter().map(|(name, _)| name.clone()).collect());
    let bytes = ordered_names(rows, |row| row.bytes.0.iter().map(|(name, _)| name.clone()).collect());
    let counts = ordered_names(rows, |row| row.counts.0.iter().map(|(name, _)| name.clone()).collect());
    let mut headings = vec!["method".to_owned()];
    headings.extend(parameters.iter().cloned());
    headings.extend(errors.iter().map(|name| match name.strip_suffix("_share") {
        Some(name) => format!("{name} % (mean/p95/worst)"),
        None => format!("{name} (mean/p95/worst)"),
    }));
    headings.extend(times.iter().map(|name| format!("{name} ms")));
    headings.extend(bytes.iter().map(|name| format!("{name} bytes")));
    headings.extend(counts.iter().cloned());
    let mut table = Table::new(headings);
    for row in rows {
        let method = match &row.failed {
            Some(why) => format!("{} FAILED: {why}", row.method),
            None => row.method.clone(),
        };
        let mut cells = vec![method];
        cells.extend(parameters.iter().map(|name| row.parameters.get(name).map_or(String::new(), plain)));
        cells.extend(
            errors.iter().map(|name| row.error.get(name).map_or(String::new(), |spread| spread_cell(name, spread))),
        );
        cells.extend(
            times.iter().map(|name| row.time_ms.get(name).map_or(String::new(), |spread| number(spread.median))),
        );
        cells
            .extend(bytes.iter().map(|name| row.bytes.get(name).map_or(String::new(), |&value| number(value.round()))));
        cells.extend(counts.iter().map(|name| row.counts.get(name).map_or(String::new(), |&value| number(value))));
        table.row(cells);
    }
    table
}

fn spread_cell(name: &str, spread: &Spread) -> String {
    if spread.count == 1 && !name.ends_with("_share") {
        return number(spread.mean);
    }
    let figures = [spread.mean, spread.p95, spread.worst];
    if name.ends_with("_share") {
        figures.map(|share| format!("{:.3}", share * 100.0)).join(" / ")
    } else if name.ends_with("_db") {
        figures.map(|value| format!("{value:.2}")).join(" / ")
    } else {
        figures.map(|value| format!("{value:.4}")).join(" / ")
    }
}

/// The bars with what was found.
pub fn bar_table(bars: &[Bar]) -> Table {
    let mut table = Table::new(["bar", "at most", "found", "verdict"]);
    for bar in bars {
        table.row(bar_cells(bar));
    }
    table
}

/// What a bar is of, what it asks, what was found, and the verdict.
pub fn bar_cells(bar: &Bar) -> [String; 4] {
    let value = |value: f64| match &*bar.unit {
        "share" => percent(value),
        "" => number(value),
        unit => format!("{} {unit}", number(value)),
    };
    let verdict = if bar.is_missed() { "MISS" } else { "PASS" };
    let found = bar.found.map_or("not measured".to_owned(), value);
    [bar.what.clone(), value(bar.at_most), found, verdict.to_owned()]
}

pub(super) fn ordered_names(rows: &[Row], names: impl Fn(&Row) -> Vec<String>) -> Vec<String> {
    let mut seen = BTreeSet::new();
    rows.iter().flat_map(names).filter(|name| seen.insert(name.clone())).collect()
}

pub(super) fn plain(value: &Value) -> String {
    match value {
        Value::String(text) => text.clone(),
        other => other.to_string(),
    }
}
