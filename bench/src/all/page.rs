//! The page of all pieces, and their bars as Markdown.

use anyhow::Context;

use super::folder::{Folder, Found, Status, short};
use super::pieces::Piece;
use crate::report::html::document;
use crate::report::rows::bar_cells;
use crate::report::table::{Table, escape};
use crate::topics;

const STYLE: &str = "
table.pieces { font-size: 14px; width: 100%; } .pieces tr.not-run, .pieces td.not-run { color: #777; }
.pieces th.topic { padding-top: 1.6rem; font-size: 1.05rem; max-width: none; }
.pieces th.topic small { font-weight: 400; color: #555; } .pieces td { white-space: nowrap; }
.pieces td.piece { white-space: normal; min-width: 22rem; } .pieces td.piece code { display: block; }
.pieces code { font-size: 12px; color: #444; overflow-wrap: anywhere; } .pieces .why { font-size: 12px; color: #b00020; }
.pieces details { white-space: normal; max-width: 20rem; } .plots figcaption { overflow-wrap: anywhere; }
progress { width: 100%; height: 0.7rem; accent-color: #00663d; }
";

/// Writes `index.html` and `bars.md`.
pub fn write(folder: &Folder, pieces: &[Piece]) -> anyhow::Result<()> {
    let known: Vec<Known> = pieces.iter().map(|piece| Known { piece, status: folder.status(piece) }).collect();
    let files = [("index.html", page(folder, &known)), ("bars.md", markdown(folder, &known))];
    for (name, text) in files {
        let path = folder.path.join(name);
        std::fs::write(&path, text).with_context(|| path.display().to_string())?;
    }
    Ok(())
}

/// A piece with what is known of it.
struct Known<'a> {
    piece: &'a Piece,
    status: Status,
}

fn page(folder: &Folder, known: &[Known<'_>]) -> String {
    let title = format!("Every report of {}", short(&folder.source.commit));
    let mut body = format!("<h1>{}</h1>\n<p>{}</p>\n", escape(&title), escape(&sum(known)));
    let finished = known.iter().filter(|known| matches!(known.status, Status::Finished(..))).count();
    body += &format!("<progress value=\"{finished}\" max=\"{}\"></progress>\n", known.len());
    body += &facts(folder, known).html();
    let missed = bars(known, true);
    if !missed.is_empty() {
        body += &format!("<h2>Bars that are missed</h2>\n{}", missed.html());
    }
    body += "<h2>Pieces</h2>\n<div class=\"wide\"><table class=\"pieces\">\n";
    let headings = ["piece", "", "took", "bars", "commit", "adapter", "files"].map(|text| format!("<th>{text}</th>"));
    body += &format!("<thead><tr>{}</tr></thead>\n", headings.concat());
    for topic in topics::ALL {
        let of_topic = known.iter().filter(|known| known.piece.topic() == topic.name());
        let rows: String = of_topic.map(row).collect();
        let (name, about) = (escape(topic.name()), escape(topic.about()));
        body += &format!(
            "<tbody><tr><th class=\"topic\" colspan=\"7\">{name} <small>{about}</small></th></tr>\n{rows}</tbody>\n"
        );
    }
    body += "</table></div>\n";
    body += &gallery(known);
    document(&title, STYLE, &body)
}

/// How many pieces are finished, in words.
fn sum(known: &[Known<'_>]) -> String {
    let count = |is: fn(&Status) -> bool| known.iter().filter(|known| is(&known.status)).count();
    let finished = count(|status| matches!(status, Status::Finished(..)));
    let failed = count(|status| matches!(status, Status::Failed(..)));
    let not_run = count(|status| matches!(status, Status::NotRun));
    let all_bars: Vec<bool> = known
        .iter()
        .filter_map(|known| known.status.found())
        .flat_map(|found| &found.bars)
        .map(|bar| bar.is_missed())
        .collect();
    let met = all_bars.iter().filter(|missed| !**missed).count();
    format!(
        "{finished} of {} pieces are finished, {failed} failed, {not_run} are yet to be run. {met} of {} bars are met.",
        known.len(),
        all_bars.len()
    )
}

fn facts(folder: &Folder, known: &[Known<'_>]) -> Table {
    let each = |what: fn(&Found) -> &String| {
        let mut names: Vec<&str> =
            known.iter().filter_map(|known| known.status.found()).map(|found| what(found).as_str()).collect();
        names.sort_unstable();
        names.dedup();
        names.join("; ")
    };
    let took_s: f64 = known.iter().filter_map(|known| took_s(&known.status)).sum();
    let mut table = Table::new(["run", ""]);
    table.row(["commit", folder.source.commit.as_str()]);
    if took_s > 0.0 {
        table.row(["adapter", each(|found| &found.adapter).as_str()]);
        table.row(["cpu", each(|found| &found.cpu).as_str()]);
        table.row(["took", span_of_time(took_s).as_str()]);
    }
    table
}

fn took_s(status: &Status) -> Option<f64> {
    match status {
        Status::NotRun => None,
        Status::Failed(record, _) | Status::Finished(record, _) => Some(record.wall_s),
    }
}

fn row(known: &Known<'_>) -> String {
    let Known { piece, status } = known;
    let name = escape(&piece.name);
    let command = format!("<code>cargo xtask report {}</code>", escape(&piece.command));
    let (class, word, why) = match status {
        Status::NotRun if piece.needs_assets() => ("not-run", "not run yet", "reads files that VANTAGE_ASSETS names"),
        Status::NotRun => ("not-run", "not run yet", ""),
        Status::Failed(record, _) => ("miss", "failed", record.failed.as_deref().unwrap_or_default()),
        Status::Finished(..) => ("pass", "finished", ""),
    };
    let found = status.found();
    let title = if found.is_some() { format!("<a href=\"{name}/index.html\">{name}</a>") } else { name.clone() };
    let why_class = if class == "miss" { "why" } else { "note" };
    let cells = [
        format!("<td class=\"piece\"><b>{title}</b>{command}<span class=\"{why_class}\">{}</span></td>", escape(why)),
        format!("<td class=\"{class}\">{word}</td>"),
        format!("<td class=\"number\">{}</td>", took_s(status).map_or(String::new(), span_of_time)),
        bars_cell(found),
        format!("<td><code>{}</code></td>", found.map_or(String::new(), |found| escape(&short(&found.commit)))),
        format!("<td>{}</td>", found.map_or(String::new(), |found| escape(adapter(found)))),
        format!("<td>{}</td>", files(piece, status)),
    ];
    let row_class = if class == "not-run" { " class=\"not-run\"" } else { "" };
    format!("<tr{row_class}>{}</tr>\n", cells.concat())
}

/// An adapter without its driver; the facts have both.
fn adapter(found: &Found) -> &str {
    found.adapter.split(" (").next().unwrap_or_default()
}

fn bars_cell(found: Option<&Found>) -> String {
    let bars = found.map_or(&[][..], |found| &found.bars);
    let missed = bars.iter().filter(|bar| bar.is_missed()).count();
    match (bars.len(), missed) {
        (0, _) => "<td></td>".to_owned(),
        (all, 0) => format!("<td class=\"pass\">{all} met</td>"),
        (all, missed) => format!("<td class=\"miss\">{missed} of {all} missed</td>"),
    }
}

/// Links to what a piece wrote.
fn files(piece: &Piece, status: &Status) -> String {
    let name = escape(&piece.name);
    let link = |file: &str, text: &str| format!("<a href=\"{name}/{}\">{}</a>", escape(file), escape(text));
    let mut links = Vec::new();
    if status.found().is_some() {
        let topic = piece.topic();
        links = vec![link(&format!("{topic}.json"), "JSON"), link(&format!("{topic}.csv"), "CSV")];
    }
    if took_s(status).is_some() {
        links.push(link("log.txt", "log"));
    }
    let figures = status.found().map_or(&[][..], |found| &found.figures);
    let pictures: Vec<String> = figures.iter().map(|figure| link(&figure.file, &figure.file)).collect();
    let pictures = match figures.len() {
        0 => String::new(),
        count => format!("<details><summary>{count} pictures</summary>{}</details>", pictures.join("<br>")),
    };
    links.join(" ") + &pictures
}

/// The first plot or picture of each piece.
fn gallery(known: &[Known<'_>]) -> String {
    let figures = known.iter().filter_map(|known| {
        let figure = known.status.found()?.figures.first()?;
        let (name, file) = (escape(&known.piece.name), escape(&figure.file));
        Some(format!(
            "<figure><a href=\"{name}/index.html\"><img loading=\"lazy\" src=\"{name}/{file}\" alt=\"\"></a>\
             <figcaption><b>{name}</b>: {}</figcaption></figure>\n",
            escape(&figure.caption)
        ))
    });
    let figures: String = figures.collect();
    if figures.is_empty() {
        return figures;
    }
    format!("<h2>The first picture of each</h2>\n<div class=\"plots\">\n{figures}</div>\n")
}

/// Bars with their pieces: all, or those that are missed.
fn bars(known: &[Known<'_>], only_missed: bool) -> Table {
    let mut table = Table::new(["piece", "bar", "at most", "found", "verdict"]);
    for known in known {
        let bars = known.status.found().map_or(&[][..], |found| &found.bars);
        for bar in bars.iter().filter(|bar| bar.is_missed() || !only_missed) {
            table.row([known.piece.name.clone()].into_iter().chain(bar_cells(bar)));
        }
    }
    table
}

fn markdown(folder: &Folder, known: &[Known<'_>]) -> String {
    let commit = &folder.source.commit;
    format!("# Bars of {commit}\n\n{}\n\n{}", sum(known), bars(known, false).markdown())
}

/// A time as people say it: two units at most.
pub fn span_of_time(seconds: f64) -> String {
    let whole = seconds.round() as u64;
    let (hours, minutes) = (whole / 3600, whole / 60 % 60);
    match whole {
        0..60 => format!("{whole} s"),
        60..3600 => format!("{minutes} min {} s", whole % 60),
        _ => format!("{hours} h {minutes} min"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_read_at_a_glance() {
        assert_eq!(span_of_time(59.4), "59 s");
        assert_eq!(span_of_time(59.6), "1 min 0 s");
        assert_eq!(span_of_time(3599.9), "1 h 0 min");
        assert_eq!(span_of_time(11_220.0), "3 h 7 min");
    }
}
