//! The page of a report: everything that the run found, readable without a script or a network.

use super::rows::{bar_table, row_tables};
use super::table::{Table, escape};
use super::{Bar, Report};

const STYLE: &str = "
body { font: 15px/1.5 system-ui, sans-serif; margin: 2rem auto; max-width: 76rem; padding: 0 1rem; color: #1c1c1c; }
h1 { font-size: 1.6rem; margin-bottom: 0.2rem; } h2 { font-size: 1.2rem; margin-top: 2rem; }
.wide { overflow-x: auto; } table { border-collapse: collapse; font-size: 13px; font-variant-numeric: tabular-nums; }
th, td { padding: 0.25rem 0.6rem; border-bottom: 1px solid #ddd; text-align: left; vertical-align: top; }
th { border-bottom: 2px solid #888; vertical-align: bottom; max-width: 9rem; }
td.number { text-align: right; white-space: nowrap; } td.pass { color: #00663d; font-weight: 600; }
td.miss { color: #b00020; font-weight: 600; } figure { margin: 1.2rem 0; } figure img { max-width: 100%; height: auto; }
figcaption { color: #555; font-size: 13px; } .plots { display: grid; gap: 1rem;
grid-template-columns: repeat(auto-fit, minmax(30rem, 1fr)); } .plots figure { margin: 0; } .plots img { width: 100%; }
pre { background: #f4f4f4; padding: 0.6rem; overflow-x: auto; }
";

/// The page as text.
pub fn page(report: &Report) -> String {
    let mut body = format!("<h1>{}</h1>\n<p>{}</p>\n", escape(&report.topic), escape(&report.about));
    body += &facts(report).html();
    if !report.bars.is_empty() {
        let missed = report.bars.iter().filter(|bar| Bar::is_missed(bar)).count();
        body += &format!("<h2>Bars: {} of {} met</h2>\n", report.bars.len() - missed, report.bars.len());
        body += &bar_table(&report.bars).html();
    }
    if !report.notes.is_empty() {
        let notes: String = report.notes.iter().map(|note| format!("<li>{}</li>\n", escape(note))).collect();
        body += &format!("<h2>How to read it</h2>\n<ul>\n{notes}</ul>\n");
    }
    for (title, table) in &report.tables {
        body += &format!("<h2>{}</h2>\n{}", escape(title), table.html());
    }
    body += &figures(report, true);
    for (scene, table) in row_tables(&report.rows) {
        body += &format!("<h2>{}</h2>\n{}", escape(&scene), table.html());
    }
    body += &figures(report, false);
    document(&report.topic, "", &body)
}

/// A page in the style of all reports; `style` is what it has beside.
pub fn document(title: &str, style: &str, body: &str) -> String {
    format!(
        "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>{} - Vantage report</title>\n<style>{STYLE}{style}</style></head>\n<body>\n{body}</body></html>\n",
        escape(title)
    )
}

fn facts(report: &Report) -> Table {
    let mut table = Table::new(["run", ""]);
    table.row(["date", report.date.as_str()]);
    table.row(["commit", report.commit.as_str()]);
    table.row(["adapter", report.adapter.as_str()]);
    table.row(["cpu", report.cpu.as_str()]);
    table.row(["scenes", report.scene.join(", ").as_str()]);
    for (name, value) in &report.settings.0 {
        let text = value.as_str().map_or_else(|| value.to_string(), str::to_owned);
        table.row([name.as_str(), text.as_str()]);
    }
    table
}

/// Plots (SVG) in a grid before the tables, pictures (everything else) after them.
fn figures(report: &Report, plots: bool) -> String {
    let shown: Vec<_> = report.figures.iter().filter(|figure| figure.file.ends_with(".svg") == plots).collect();
    if shown.is_empty() {
        return String::new();
    }
    let figures: String = shown
        .iter()
        .map(|figure| {
            let (file, caption) = (escape(&figure.file), escape(&figure.caption));
            format!("<figure><img src=\"{file}\" alt=\"{caption}\"><figcaption>{caption}</figcaption></figure>\n")
        })
        .collect();
    if plots {
        format!("<h2>Plots</h2>\n<div class=\"plots\">\n{figures}</div>\n")
    } else {
        format!("<h2>Pictures</h2>\n{figures}")
    }
}
