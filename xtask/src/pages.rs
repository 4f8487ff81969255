//! Keeps the pages together: every link from one to another, to a heading or to a file of the repository leads somewhere, and the book names every page of `docs`.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use anyhow::{Context, bail};

/// What is not ours to write.
const NOT_OURS: &[&str] = &["target", "node_modules"];
/// The pages of the book, in order.
const CONTENTS: &str = "docs/SUMMARY.md";

/// Checks all of it; names all that is wrong.
pub fn check() -> anyhow::Result<()> {
    let mut pages = Vec::new();
    find(Path::new("."), &mut pages)?;
    let mut wrong = Vec::new();
    let mut linked = BTreeSet::new();
    for page in &pages {
        let text = std::fs::read_to_string(page).with_context(|| page.display().to_string())?;
        for link in links(&text).filter(|link| !link.contains("://") && !link.starts_with("mailto:")) {
            let (path, heading) = link.split_once('#').map_or((link, None), |(path, heading)| (path, Some(heading)));
            let target = if path.is_empty() { page.clone() } else { flat(&page.with_file_name("").join(path)) };
            if page.ends_with(CONTENTS) {
                linked.insert(target.clone());
            }
            if !target.exists() {
                wrong.push(format!("{}: {link} leads nowhere", page.display()));
            } else if let Some(heading) = heading
                && !headings(&std::fs::read_to_string(&target).unwrap_or_default()).any(|found| found == heading)
            {
                wrong.push(format!("{}: {link}: there is no such heading", page.display()));
            }
        }
    }
    let of_book = pages.iter().filter(|page| page.starts_with("docs") && !page.ends_with(CONTENTS));
    wrong.extend(
        of_book.filter(|page| !linked.contains(*page)).map(|page| format!("{CONTENTS} lacks {}", page.display())),
    );
    if wrong.is_empty() { Ok(()) } else { bail!("{}", wrong.join("\n")) }
}

/// Pages of the book.
pub fn of_book() -> anyhow::Result<Vec<PathBuf>> {
    let mut pages = Vec::new();
    find(Path::new("docs"), &mut pages)?;
    pages.sort();
    Ok(pages)
}

/// Lines of code blocks, without what follows a `#`; one that ends in the middle of something goes on in the next.
pub fn code(text: &str) -> Vec<String> {
    let (mut is_fenced, mut lines) = (false, Vec::<String>::new());
    for line in text.lines() {
        if line.trim_start().starts_with("```") {
            is_fenced = !is_fenced;
        } else if is_fenced || line.starts_with("    ") {
            let line = line.split(" #").next().unwrap_or(line).trim();
            match lines.last_mut().filter(|last| last.ends_with('|') || last.ends_with('\\')) {
                Some(last) => *last = format!("{} {line}", last.trim_end_matches('\\')),
                None => lines.push(line.to_owned()),
            }
        }
    }
    lines.retain(|line| !line.is_empty());
    lines
}

fn find(folder: &Path, pages: &mut Vec<PathBuf>) -> anyhow::Result<()> {
    for entry in std::fs::read_dir(folder).with_context(|| folder.display().to_string())? {
        let entry = entry?;
        let (path, name) = (flat(&entry.path()), entry.file_name());
        let is_ours = !name.as_encoded_bytes().starts_with(b".") && NOT_OURS.iter().all(|other| name != *other);
        match entry.file_type()? {
            kind if kind.is_dir() && is_ours => find(&path, pages)?,
            kind if kind.is_file() && path.extension().is_some_and(|extension| extension == "md") => pages.push(path),
            _ => {}
        }
    }
    Ok(())
}

/// Without `.` and `..`, as far as they are within it.
fn flat(path: &Path) -> PathBuf {
    use std::path::Component;
    let mut parts = PathBuf::new();
    for part in path.components() {
        match part {
            Component::CurDir => {}
            Component::ParentDir if parts.pop() => {}
            part => parts.push(part),
        }
    }
    parts
}

/// The targets of `[text](target)` outside of code.
fn links(text: &str) -> impl Iterator<Item = &str> {
    prose(text).flat_map(|line| {
        let spans = line.split('`').step_by(2);
        spans
            .flat_map(|span| span.split("](").skip(1).filter_map(|rest| rest.split_once(')').map(|(target, _)| target)))
    })
}

/// Headings as GitHub and mdBook name them: small letters, digits and dashes.
fn headings(text: &str) -> impl Iterator<Item = String> {
    let titles = prose(text).filter(|line| line.starts_with('#')).map(|line| line.trim_start_matches('#').trim());
    titles.map(|title| {
        let kept = title.chars().filter(|c| c.is_alphanumeric() || matches!(c, ' ' | '-' | '_'));
        kept.map(|c| if c == ' ' { '-' } else { c.to_ascii_lowercase() }).collect()
    })
}

/// Lines outside of code blocks.
fn prose(text: &str) -> impl Iterator<Item = &str> {
    let mut is_code = false;
    text.lines().filter(move |line| {
        let fence = line.trim_start().starts_with("```");
        is_code ^= fence;
        !fence && !is_code && !line.starts_with("    ")
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_of_code_go_on() {
        let text = "words\n    one --two  # why\n\n    three |\n        four\n```\nfive\n```\n";
        assert_eq!(code(text), ["one --two", "three | four", "five"]);
    }

    #[test]
    fn links_and_headings_are_found_outside_of_code() {
        let text = "# A `b`: c, d\n[x](y.md#z) and `[no](no)` ![p](q.png)\n```\n[no](no)\n# no\n```\n    [no](no)\n";
        assert_eq!(links(text).collect::<Vec<_>>(), ["y.md#z", "q.png"]);
        assert_eq!(headings(text).collect::<Vec<_>>(), ["a-b-c-d"]);
        assert_eq!(flat(Path::new("./a/b/../c.md")), Path::new("a/c.md"));
    }
}
