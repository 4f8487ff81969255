//! A run as one page that needs nothing beside it: limits, figures, what was run, and plots over its time.

use protocol::message::Welcome;

use super::health::without_token;
use super::table::figures;
use super::{Report, Second};
use crate::report::html::document;
use crate::report::machine;
use crate::report::plot::{Axes, Scatter, Series, curves_svg};
use crate::report::rows::bar_table;
use crate::report::table::{Table, escape, number};

/// Plots as large as they are drawn, one below the other, so that their words can be read.
const STYLE: &str = ".plots { grid-template-columns: minmax(0, 860px); } .plots svg { width: 100%; height: auto; } pre { white-space: pre-wrap; }";

/// The page as text; `command` is what was typed.
pub fn page(report: &Report, command: &str) -> anyhow::Result<String> {
    let mut body = format!("<h1>Load test</h1>\n<pre>{}</pre>\n", escape(&without_token(command)));
    body += &format!("<h2>Limits</h2>\n{}", bar_table(&report.bars).html());
    body += &format!("<h2>Figures</h2>\n{}", figures(report).html());
    if report.errors > 0 {
        let mut table = Table::new(["why clients ended early", "clients"]);
        for (cause, count) in report.errors_by_cause() {
            table.row([cause.to_owned(), count.to_string()]);
        }
        body += &table.html();
    }
    body += &format!("<h2>Over the time of the run</h2>\n<div class=\"plots\">\n{}</div>\n", plots(report)?);
    body += &format!("<h2>What was run</h2>\n{}", facts(report).html());
    Ok(document("Load test", STYLE, &body))
}

/// When, where, and what the server greeted its clients with.
fn facts(report: &Report) -> Table {
    let mut table = Table::new(["run", ""]);
    let mut fact = |name: &str, value: String| table.row([name.to_owned(), value]);
    fact("date", machine::date_utc());
    fact("commit of the load", machine::commit());
    fact("processor of the load", machine::cpu());
    if let Some(welcome) = &report.welcome {
        let Welcome { bounds_min_world: min, bounds_max_world: max, .. } = welcome;
        let extent: Vec<String> = (0..3).map(|axis| number(max[axis] - min[axis])).collect();
        fact("scene", welcome.scene_name.clone());
        fact("extent", format!("{} m", extent.join(" x ")));
        fact("to be", if welcome.walk { "walked in" } else { "gone round" }.to_owned());
        fact("look", format!("{:?}", welcome.look).to_lowercase());
        fact("between two ticks of the server", format!("{:.0} ms", welcome.update_interval_s * 1e3));
        fact("version of the protocol", welcome.version.to_string());
    }
    table
}

fn plots(report: &Report) -> anyhow::Result<String> {
    let limit_ms = |what: &str| report.bars.iter().find(|bar| bar.what.starts_with(what)).map(|bar| bar.at_most);
    let latency =
        [curve(report, "median", |second| second.latency_ms.p50), curve(report, "p99", |second| second.latency_ms.p99)];
    let interval = [curve(report, "p99", |second| second.interval_ms.p99)];
    let errors = [
        curve(report, "clients that ended by an error", |second| second.errors as f64),
        curve(report, "reconnections", |second| second.reconnections as f64),
    ];
    let one = |name: &str, of: fn(&Second) -> f64| vec![curve(report, name, of)];
    let with_limit = |curves: &[Series], what: &str| {
        let end_s = report.over_time.last().map_or(0.0, |second| second.to_s);
        let limit = limit_ms(what).map(|ms| Series { name: "limit".to_owned(), points: vec![(0.0, ms), (end_s, ms)] });
        curves.iter().cloned().chain(limit).collect()
    };
    let plots = [
        ("Pose to its update", "ms", with_limit(&latency, "from a pose")),
        ("Between two updates of a client", "ms", with_limit(&interval, "between two updates")),
        ("Updates", "updates a second", one("all clients", |second| second.updates_per_s)),
        ("Received", "Mbit/s", one("all clients", |second| second.bytes_per_s * 8e-6)),
        ("Connected", "clients", one("at the end of a second", |second| second.connected as f64)),
        ("Errors and reconnections", "a second", errors.to_vec()),
    ];
    let drawn = plots.into_iter().map(|(title, y_label, series)| {
        let x_label = "second of the run".to_owned();
        let plot = Scatter { title: title.to_owned(), x_label, y_label: y_label.to_owned(), series };
        let svg = curves_svg(&plot, Axes { log_x: false, front: false })?;
        Ok(format!("<figure>{svg}</figure>\n"))
    });
    drawn.collect()
}

/// A figure of each second in which there was one.
fn curve(report: &Report, name: &str, of: fn(&Second) -> f64) -> Series {
    let points = report.over_time.iter().map(|second| (second.to_s, of(second)));
    Series { name: name.to_owned(), points: points.filter(|point| point.1.is_finite()).collect() }
}

#[cfg(test)]
mod tests {
    use super::super::Percentiles;
    use super::*;
    use crate::report::Bar;

    fn second(to_s: f64) -> Second {
        let nothing = Percentiles::of(Vec::new());
        let latency_ms = Percentiles::of(vec![40.0, 60.0]);
        Second {
            to_s,
            connected: 3,
            updates_per_s: 7.0,
            bytes_per_s: 1e6,
            errors: 0,
            reconnections: 1,
            latency_ms,
            interval_ms: nothing,
        }
    }

    #[test]
    fn the_page_holds_everything_itself() {
        let bars = vec![Bar::at_most("from a pose to its update, p99", 500.0, Some(612.0), "ms")];
        let report = Report {
            server: "ws://<host>".to_owned(),
            over_time: vec![second(1.0), second(2.0)],
            bars,
            ..Report::default()
        };
        let page =
            page(&report, "vantage-load --server ws://host?token=secret --script 'walk:2,<idle>'").expect("a page");
        assert!(!page.contains("secret"));
        assert_eq!(page.matches("<svg").count(), 6);
        // A mark for each of two seconds in all plots but the one of what was not measured, and one in every legend.
        assert_eq!(page.matches("<circle").count(), 2 * 5 + 6);
        for text in [
            "ws://&lt;host&gt;",
            "walk:2,&lt;idle&gt;",
            "token=...",
            "second of the run",
            ">\nlimit\n<",
            "\np99\n",
            "MISS",
        ] {
            assert!(page.contains(text), "{text}");
        }
        for unit in ["ms", "updates a second", "Mbit/s", "clients", "a second"] {
            assert!(page.contains(&format!("\n{unit}\n")), "no axis has {unit}");
        }
        for outside in ["<script", "<link", "src=", "href=", "url("] {
            assert!(!page.contains(outside), "{outside}");
        }
    }

    #[test]
    fn a_run_without_figures_has_a_page() {
        page(&Report::default(), "vantage-load").expect("a page");
    }
}
