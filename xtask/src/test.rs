//! `cargo xtask test`: every check and every test, counted together.

use std::path::Path;
use std::time::Instant;

use anyhow::bail;

use crate::run::{Tool, cargo, step, target_dir};
use crate::setup::{self, Need};
use crate::{architecture, commands, packaging, pages, web};

/// How many checks passed, failed and were skipped.
#[derive(Debug, Default, Clone, PartialEq, Eq)]
struct Tally {
    passed: u64,
    failed: u64,
    skipped: u64,
    /// Of those that failed, as far as they have any.
    names: Vec<String>,
}

impl Tally {
    const PASSED: Tally = Tally::of(1, 0, 0);
    const FAILED: Tally = Tally::of(0, 1, 0);
    const SKIPPED: Tally = Tally::of(0, 0, 1);

    const fn of(passed: u64, failed: u64, skipped: u64) -> Tally {
        Tally { passed, failed, skipped, names: Vec::new() }
    }

    fn add(&mut self, other: Tally) {
        self.passed += other.passed;
        self.failed += other.failed;
        self.skipped += other.skipped;
        self.names.extend(other.names);
    }
}

/// A step's name and what runs it.
type Step = (&'static str, fn() -> anyhow::Result<Tally>);

const STEPS: &[Step] = &[
    ("format", format),
    ("architecture", architecture),
    ("pages", pages),
    ("lints, native", lint_native),
    ("lints, wasm32", lint_wasm),
    ("documentation", document),
    ("packaging", packaging),
    ("tests, native", test_native),
    ("tests, browser", test_browser),
    ("commands", run_commands),
];

/// Runs the steps whose name holds one of `only` (all without any), shows a table of them, and fails when one failed.
pub fn run_all(only: &[String]) -> anyhow::Result<()> {
    setup::install(Need::USUAL)?;
    let mut total = Tally::default();
    let mut rows = Vec::new();
    for &(name, run) in STEPS.iter().filter(|(name, _)| only.is_empty() || only.iter().any(|word| name.contains(word)))
    {
        step(name);
        let start = Instant::now();
        let tally = run().unwrap_or_else(|error| {
            println!("{name}: {error:#}");
            Tally::FAILED
        });
        rows.push((name, tally.clone(), start.elapsed().as_secs()));
        total.add(tally);
    }
    println!();
    for (name, tally, seconds) in rows {
        println!(
            "{name:16} {:4} passed {:3} failed {:3} skipped {seconds:5} s",
            tally.passed, tally.failed, tally.skipped
        );
    }
    total.names.iter().for_each(|name| println!("FAILED: {name}"));
    println!("{} passed, {} failed, {} skipped", total.passed, total.failed, total.skipped);
    if total.failed > 0 {
        bail!("{} failed", total.failed);
    }
    Ok(())
}

fn format() -> anyhow::Result<Tally> {
    cargo().args(["fmt", "--all", "--check"]).check()?;
    Ok(Tally::PASSED)
}

fn architecture() -> anyhow::Result<Tally> {
    architecture::check()?;
    Ok(Tally::PASSED)
}

fn pages() -> anyhow::Result<Tally> {
    pages::check()?;
    Ok(Tally::PASSED)
}

fn lint_native() -> anyhow::Result<Tally> {
    cargo().args(["clippy", "--workspace", "--all-targets", "--", "-D", "warnings"]).check()?;
    Ok(Tally::PASSED)
}

fn lint_wasm() -> anyhow::Result<Tally> {
    web::wasm_cargo("clippy")
        .args(["--package", "vantage-web", "--package", "vantage-client", "--lib", "--profile", "web-dev"])
        .args(["--", "-D", "warnings"])
        .check()?;
    Ok(Tally::PASSED)
}

fn document() -> anyhow::Result<Tally> {
    cargo().args(["doc", "--workspace", "--no-deps", "--quiet"]).env("RUSTDOCFLAGS", "-D warnings").check()?;
    Ok(Tally::PASSED)
}

fn packaging() -> anyhow::Result<Tally> {
    let mut tally = Tally::default();
    for (what, check) in packaging::CHECKS {
        tally.add(match check() {
            Ok(None) => Tally::PASSED,
            Ok(Some(why)) => {
                println!("{what}: skipped, as {why}");
                Tally::SKIPPED
            }
            Err(error) => {
                println!("{what}: {error:#}");
                Tally::FAILED
            }
        });
    }
    Ok(tally)
}

fn test_native() -> anyhow::Result<Tally> {
    let mut first = count(cargo_test(&["--no-fail-fast"]))?;
    // Software drivers, which nearly all of these tests draw with, corrupt memory now and then where devices of several threads
    // work at once: then a whole program is gone without a failed test. A test that fails is never repeated.
    if first.tally.failed == 0 {
        let died = std::mem::take(&mut first.failed_targets);
        first.succeeded |= !died.is_empty();
        for target in died {
            println!("{} died without a failed test: once more, one test at a time", target.join(" "));
            let target: Vec<&str> = target.iter().map(String::as_str).chain(["--", "--test-threads=1"]).collect();
            first.tally.add(count(cargo_test(&target))?.tally());
        }
    }
    Ok(first.tally())
}

fn cargo_test(arguments: &[&str]) -> Tool {
    // EGL complains on every start without it.
    let quiet = std::env::var_os("XDG_RUNTIME_DIR").unwrap_or_else(|| std::env::temp_dir().into());
    cargo().args(["test", "--workspace"]).args(arguments).env("XDG_RUNTIME_DIR", quiet)
}

fn test_browser() -> anyhow::Result<Tally> {
    let web_dir = std::path::absolute(web::build(web::Profile::Fast)?)?;
    cargo().args(["build", "--workspace", "--bin", "vantage-server"]).check()?;
    let tests = Path::new("tests/browser");
    Tool::new("npm").args(["ci", "--no-audit", "--no-fund", "--silent"]).dir(tests).check()?;
    let server = std::path::absolute(target_dir().join("debug/vantage-server"))?;
    let node = Tool::new("node").args(["run.mjs"]).dir(tests);
    Ok(count(node.env("VANTAGE_SERVER_BIN", server).env("VANTAGE_WEB_DIR", web_dir))?.tally())
}

/// What README and the book tell to type.
fn run_commands() -> anyhow::Result<Tally> {
    cargo().args(["build", "--workspace", "--bins"]).check()?;
    Ok(match commands::run_all()? {
        Some((passed, names)) => Tally { names: names.clone(), ..Tally::of(passed, names.len() as u64, 0) },
        None => {
            println!("skipped, as something serves where the commands do");
            Tally::SKIPPED
        }
    })
}

/// What became of a test program.
#[derive(Default)]
struct Outcome {
    tally: Tally,
    succeeded: bool,
    /// Arguments that name the targets of which cargo says that they failed.
    failed_targets: Vec<Vec<String>>,
}

impl Outcome {
    /// Its results; one that fails without a failed test (it did not build, or died) counts as one failure, and so does one that
    /// ran nothing.
    fn tally(mut self) -> Tally {
        let nothing_ran = self.tally.passed + self.tally.failed == 0;
        if (!self.succeeded && self.tally.failed == 0) || nothing_ran {
            self.tally.add(Tally::FAILED);
        }
        self.tally
    }
}

/// Runs a test program and adds up the results it prints.
fn count(tool: Tool) -> anyhow::Result<Outcome> {
    let mut outcome = Outcome::default();
    outcome.succeeded = tool.watch(|line| {
        if let Some(found) = parse_result(line) {
            outcome.tally.add(found);
        }
        outcome.tally.names.extend(parse_failed_test(line));
        outcome.failed_targets.extend(parse_failed_target(line));
    })?;
    Ok(outcome)
}

/// Reads ``    `-p vantage-server --test redundancy` ``, as cargo lists targets that failed, without the package: `--workspace`
/// stands for it, as other features would be built otherwise.
fn parse_failed_target(line: &str) -> Option<Vec<String>> {
    let arguments = line.trim().strip_prefix("`-p ")?.strip_suffix('`')?;
    let (_, target) = arguments.split_once(' ')?;
    Some(target.split(' ').map(str::to_owned).collect())
}

/// Reads `test NAME ... FAILED` (cargo) and `FAILED  NAME: why` (the browser tests).
fn parse_failed_test(line: &str) -> Option<String> {
    let of_cargo = line.strip_prefix("test ").and_then(|rest| rest.trim_end().strip_suffix("FAILED"));
    let name = of_cargo.or_else(|| line.strip_prefix("FAILED  "))?;
    Some(name.trim().trim_end_matches("...").trim_end().to_owned())
}

/// Reads `test result: ok. 3 passed; 0 failed; 1 ignored; …` (cargo) and `3 passed, 0 failed, 1 skipped` (the browser tests).
fn parse_result(line: &str) -> Option<Tally> {
    let rest =
        line.strip_prefix("test result: ").map_or(line, |rest| rest.split_once(". ").map_or(rest, |parts| parts.1));
    let mut tally = Tally::default();
    let mut fields = rest.split([';', ',']);
    for (name, field) in [("passed", &mut tally.passed), ("failed", &mut tally.failed)] {
        *field = fields.next()?.trim().strip_suffix(name)?.trim().parse().ok()?;
    }
    let third = fields.next().unwrap_or("0 skipped").trim();
    tally.skipped = third.strip_suffix("ignored").or(third.strip_suffix("skipped"))?.trim().parse().ok()?;
    Some(tally)
}

#[cfg(test)]
mod tests {
    use super::{Outcome, Tally, parse_failed_target, parse_failed_test, parse_result};

    #[test]
    fn a_target_that_died_is_named_without_its_package() {
        let target = parse_failed_target("    `-p vantage-server --test redundancy`");
        assert_eq!(target, Some(vec!["--test".to_owned(), "redundancy".to_owned()]));
        assert_eq!(parse_failed_target("error: 1 target failed:"), None);
    }

    #[test]
    fn failed_tests_are_named() {
        let named = [
            "test a walk, at 500 ms ... FAILED",
            "test shelf::opens ... ok",
            "FAILED  webgpu: fits a phone: Error",
            "test result: FAILED. 3 passed",
        ];
        let names: Vec<String> = named.into_iter().filter_map(parse_failed_test).collect();
        assert_eq!(names, ["a walk, at 500 ms", "webgpu: fits a phone: Error"]);
    }

    #[test]
    fn a_program_that_died_is_one_failure() {
        let died = || Outcome { tally: Tally::of(3, 0, 0), ..Outcome::default() };
        assert_eq!(died().tally(), Tally::of(3, 1, 0));
        assert_eq!(Outcome { succeeded: true, ..died() }.tally(), Tally::of(3, 0, 0));
        assert_eq!(Outcome { succeeded: true, ..Outcome::default() }.tally().failed, 1, "nothing ran");
    }

    #[test]
    fn results_of_cargo_and_of_the_browser_tests_are_read() {
        let cargo = "test result: FAILED. 3 passed; 1 failed; 2 ignored; 0 measured; 0 filtered out; finished in 0.00s";
        assert_eq!(parse_result(cargo), Some(Tally::of(3, 1, 2)));
        assert_eq!(parse_result("2 passed, 0 failed, 1 skipped"), Some(Tally::of(2, 0, 1)));
        assert_eq!(parse_result("running 3 tests"), None);
        assert_eq!(parse_result("warning: 2 passed"), None);
    }
}
