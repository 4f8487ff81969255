//! Tables: the same cells as text for the terminal, as HTML and as CSV.

/// Cells under headings.
#[derive(Debug, Clone, Default)]
pub struct Table {
    headings: Vec<String>,
    rows: Vec<Vec<String>>,
}

impl Table {
    /// A table without rows.
    pub fn new<S: Into<String>>(headings: impl IntoIterator<Item = S>) -> Table {
        Table { headings: headings.into_iter().map(Into::into).collect(), rows: Vec::new() }
    }

    /// Adds a row; it must have a cell for each heading.
    pub fn row<S: Into<String>>(&mut self, cells: impl IntoIterator<Item = S>) {
        let cells: Vec<String> = cells.into_iter().map(Into::into).collect();
        assert_eq!(cells.len(), self.headings.len(), "a cell for each heading");
        self.rows.push(cells);
    }

    /// Whether there are no rows.
    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    /// Aligned columns: words to the left, numbers to the right.
    pub fn text(&self) -> String {
        let columns = 0..self.headings.len();
        let width = |c: usize| {
            let cells = self.rows.iter().map(|row| row[c].chars().count());
            cells.chain([self.headings[c].chars().count()]).max().unwrap_or(0)
        };
        let widths: Vec<usize> = columns.clone().map(width).collect();
        let is_number: Vec<bool> = columns.map(|c| self.is_number_column(c)).collect();
        let line = |cells: &[String]| {
            let padded = cells.iter().enumerate().map(|(c, cell)| {
                let gap = " ".repeat(widths[c] - cell.chars().count());
                if is_number[c] { format!("{gap}{cell}") } else { format!("{cell}{gap}") }
            });
            padded.collect::<Vec<_>>().join("  ").trim_end().to_owned() + "\n"
        };
        let rule: Vec<String> = widths.iter().map(|&width| "-".repeat(width)).collect();
        line(&self.headings) + &line(&rule) + &self.rows.iter().map(|row| line(row)).collect::<String>()
    }

    /// Comma-separated values with a line of headings (RFC 4180).
    pub fn csv(&self) -> String {
        let quote = |cell: &String| {
            if cell.contains([',', '"', '\n', '\r']) {
                format!("\"{}\"", cell.replace('"', "\"\""))
            } else {
                cell.clone()
            }
        };
        let line = |cells: &Vec<String>| cells.iter().map(quote).collect::<Vec<_>>().join(",") + "\n";
        std::iter::once(&self.headings).chain(&self.rows).map(line).collect()
    }

    /// A table of Markdown.
    pub fn markdown(&self) -> String {
        let line = |cells: &[String]| {
            let cells: Vec<String> = cells.iter().map(|cell| cell.replace('|', "\\|").replace('\n', " ")).collect();
            format!("| {} |\n", cells.join(" | "))
        };
        let rule = format!("|{}\n", "---|".repeat(self.headings.len()));
        line(&self.headings) + &rule + &self.rows.iter().map(|row| line(row)).collect::<String>()
    }

    /// An HTML table.
    pub fn html(&self) -> String {
        let cell = |tag: &str, c: usize, text: &str| {
            let class = match text {
                "PASS" => " class=\"pass\"",
                "MISS" => " class=\"miss\"",
                _ if self.is_number_column(c) => " class=\"number\"",
                _ => "",
            };
            format!("<{tag}{class}>{}</{tag}>", escape(text))
        };
        let line = |tag: &str, cells: &[String]| {
            let cells: String = cells.iter().enumerate().map(|(c, text)| cell(tag, c, text)).collect();
            format!("<tr>{cells}</tr>\n")
        };
        let body: String = self.rows.iter().map(|row| line("td", row)).collect();
        format!(
            "<div class=\"wide\"><table>\n<thead>{}</thead>\n<tbody>{body}</tbody></table></div>\n",
            line("th", &self.headings)
        )
    }

    fn is_number_column(&self, column: usize) -> bool {
        let starts_as_number =
            |cell: &String| cell.is_empty() || cell.starts_with(|c: char| c.is_ascii_digit() || c == '-');
        !self.rows.is_empty() && self.rows.iter().all(|row| starts_as_number(&row[column]))
    }
}

/// A number with about four significant digits.
pub fn number(value: f64) -> String {
    let size = value.abs();
    match size {
        _ if !value.is_finite() => format!("{value}"),
        _ if value == value.trunc() && size < 1e7 => format!("{value:.0}"),
        _ if size >= 1e7 => format!("{value:.3e}"),
        _ if size >= 1000.0 => format!("{value:.0}"),
        _ if size >= 100.0 => format!("{value:.1}"),
        _ if size >= 10.0 => format!("{value:.2}"),
        _ if size >= 0.001 => format!("{value:.4}"),
        _ => format!("{value:.2e}"),
    }
}

/// A share as a percentage.
pub fn percent(share: f64) -> String {
    format!("{:.3} %", share * 100.0)
}

/// Text inside of HTML.
pub fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn example() -> Table {
        let mut table = Table::new(["method", "ms"]);
        table.row(["quads, \"averaged\"", "1.5"]);
        table.row(["<points>", "10"]);
        table
    }

    #[test]
    fn text_is_aligned() {
        let text = example().text();
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines[2], "quads, \"averaged\"  1.5");
        assert_eq!(lines[3], "<points>            10");
    }

    #[test]
    fn csv_html_and_markdown_are_escaped() {
        assert_eq!(example().csv(), "method,ms\n\"quads, \"\"averaged\"\"\",1.5\n<points>,10\n");
        assert!(example().html().contains("<td>&lt;points&gt;</td>"));
        let mut table = Table::new(["bar"]);
        table.row(["a | b"]);
        assert_eq!(table.markdown(), "| bar |\n|---|\n| a \\| b |\n");
    }

    #[test]
    fn numbers_are_short() {
        let cases = [
            (0.0, "0"),
            (12.0, "12"),
            (0.123456, "0.1235"),
            (31.4159, "31.42"),
            (123_456.7, "123457"),
            (1e-5, "1.00e-5"),
        ];
        for (value, expected) in cases {
            assert_eq!(number(value), expected);
        }
    }
}
