//! `report all`: its pieces are commands that exist and that docs/papers.md lists; what is finished stays; what fails stops nothing.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::Command;

use vantage_bench::all::folder::{Folder, Status};
use vantage_bench::all::pieces::{Piece, pieces};
use vantage_bench::all::walk::walk;
use vantage_bench::command::command;
use vantage_bench::report::kept::Source;
use vantage_bench::topics;

#[test]
fn every_piece_is_a_command_that_vantage_report_takes() {
    for piece in [pieces(false), pieces(true)].concat() {
        let arguments = piece.arguments(Path::new("/assets")).unwrap();
        let typed = std::iter::once("vantage-report".to_owned()).chain(arguments).chain(["--out".into(), "x".into()]);
        if let Err(error) = command().try_get_matches_from(typed) {
            panic!("{}: {error}", piece.name);
        }
    }
}

#[test]
fn every_topic_has_a_piece() {
    for quick in [false, true] {
        let of_pieces: BTreeSet<String> = pieces(quick).iter().map(|piece| piece.topic().to_owned()).collect();
        let all: BTreeSet<String> = topics::ALL.iter().map(|topic| topic.name().to_owned()).collect();
        assert_eq!(of_pieces, all);
    }
}

#[test]
fn the_papers_page_lists_the_same_commands() {
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/papers.md");
    let text = std::fs::read_to_string(page).unwrap();
    let section = text.split("\n## Commands\n").nth(1).unwrap().split("\n## ").next().unwrap();
    let listed: BTreeSet<(String, String)> = section.lines().flat_map(listed_in_row).collect();
    let run: BTreeSet<(String, String)> = pieces(false).into_iter().map(|piece| (piece.name, piece.command)).collect();
    let of_run = |(name, command): &(String, String)| {
        run.iter().any(|(piece, run)| (piece == name || piece.starts_with(&format!("{name}-"))) && run == command)
    };
    for row in &listed {
        assert!(of_run(row), "the page has what no piece runs: {row:?}");
    }
    for (name, command) in &run {
        assert!(listed.iter().any(|(_, listed)| listed == command), "the page lacks {name}: {command}");
    }
}

/// The name of a row of the table, with hyphens, and its commands: each span of code that is one, and the same with its last word
/// replaced by each span in the parentheses behind it.
fn listed_in_row(row: &str) -> Vec<(String, String)> {
    let cells: Vec<&str> = row.split(" | ").collect();
    let [name, typed, ..] = cells[..] else { return Vec::new() };
    let name = name.trim_matches(['|', '*', ' ']).replace(' ', "-");
    let mut commands = Vec::new();
    for after in typed.split("`cargo xtask report ").skip(1) {
        let (command, rest) = after.split_once('`').expect("a span of code ends");
        commands.push((name.clone(), command.to_owned()));
        let others = rest.trim_start().strip_prefix('(').and_then(|rest| rest.split_once(')'));
        let others = others.map_or("", |(others, _)| others);
        let (but_last, _) = command.rsplit_once(' ').unwrap_or((command, ""));
        commands.extend(others.split('`').skip(1).step_by(2).map(|word| (name.clone(), format!("{but_last} {word}"))));
    }
    commands
}

struct Tried {
    folder: Folder,
    pieces: Vec<Piece>,
}

/// What a stand-in for `vantage-report` writes into the folder `$1` for the topic `$0`, and a line a run.
const MAKES_A_REPORT: &str = r#"echo run >> "$1/runs"
echo '{"commit":"c0ffee","adapter":"none","cpu":"c","bars":[{"what":"holes","at_most":1,"found":2,"unit":"","verdict":"MISS"}],
"figures":[{"file":"holes.svg","caption":"Holes."}]}' > "$1/$0.json""#;

impl Tried {
    fn new(name: &str) -> Tried {
        let path = std::env::temp_dir().join(format!("vantage-all-{name}-{}", std::process::id()));
        let _ = std::fs::remove_dir_all(&path);
        let source = Source { date: "now".into(), commit: "c0ffee".into(), build: "b".into() };
        let piece = |name: &str, command: &str| Piece { name: name.into(), command: command.into() };
        let pieces =
            vec![piece("first", "codec --quick"), piece("second", "timing"), piece("third", "codec --scene \"a b\"")];
        Tried { folder: Folder { path, source }, pieces }
    }

    /// Walks through all pieces; the one of a name runs a script of its own.
    fn walk(&self, other: &str, script: &str) -> anyhow::Result<()> {
        let chosen: Vec<&Piece> = self.pieces.iter().collect();
        walk(&self.folder, &self.pieces, &chosen, |piece, out| {
            let script = if piece.name == other { script } else { MAKES_A_REPORT };
            let mut command = Command::new("sh");
            command.args(["-c", script, piece.topic()]).arg(out);
            Ok(Some(command))
        })
    }

    fn runs(&self) -> [usize; 3] {
        [0, 1, 2].map(|k| self.text(&format!("{}/runs", self.pieces[k].name)).lines().count())
    }

    fn text(&self, file: &str) -> String {
        std::fs::read_to_string(self.folder.path.join(file)).unwrap_or_default()
    }

    fn is_finished(&self, k: usize) -> bool {
        matches!(self.folder.status(&self.pieces[k]), Status::Finished(..))
    }
}

impl Drop for Tried {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(PathBuf::from(&self.folder.path));
    }
}

#[test]
fn what_is_finished_is_not_run_again() {
    let tried = Tried::new("resumed");
    tried.walk("", "").unwrap();
    assert_eq!(tried.runs(), [1, 1, 1]);
    std::fs::remove_file(tried.folder.path.join("second/piece.json")).unwrap();
    tried.walk("", "").unwrap();
    assert_eq!(tried.runs(), [1, 2, 1], "the second had been interrupted");
}

#[test]
fn what_fails_is_named_and_stops_nothing() {
    let tried = Tried::new("failed");
    let error = tried.walk("second", "echo it broke; exit 3").unwrap_err().to_string();
    assert!(error.contains("1 of 3") && error.contains("second") && !error.contains("third"), "{error}");
    assert_eq!([0, 1, 2].map(|k| tried.is_finished(k)), [true, false, true]);
    assert!(tried.text("index.html").contains("it broke"));
    tried.walk("", "").unwrap();
    assert_eq!(tried.runs(), [1, 1, 1], "only what failed is run again");
}

#[test]
fn an_end_without_a_report_is_a_failure() {
    let tried = Tried::new("empty");
    tried.walk("", "").unwrap();
    std::fs::remove_file(tried.folder.path.join("first/piece.json")).unwrap();
    assert!(tried.walk("first", "exit 0").is_err(), "the report of the run before does not count");
    assert!(!tried.is_finished(0));
}

#[test]
fn the_page_shows_every_piece() {
    let tried = Tried::new("page");
    let chosen = [&tried.pieces[0]];
    walk(&tried.folder, &tried.pieces, &chosen, |_, out| {
        let mut command = Command::new("sh");
        command.args(["-c", MAKES_A_REPORT, "codec"]).arg(out);
        Ok(Some(command))
    })
    .unwrap();
    let page = tried.text("index.html");
    let command_of_third = "cargo xtask report codec --scene &quot;a b&quot;";
    for shown in ["first/index.html", "first/codec.json", "first/holes.svg", "second", "third", command_of_third] {
        assert!(page.contains(shown), "{shown}");
    }
    assert_eq!(page.matches("not run yet").count(), 2);
    assert!(tried.text("bars.md").contains("| first | holes | 1 | 2 | MISS |"));
}
