//! `cargo xtask test`: every check and every test, counted together.

use std::path::Path;
use std::time::Instant;

use anyhow::bail;

use crate::run::{Tool, cargo, step, target_dir};
use crate::setup::{self, Need};
use crate::{architecture, web};

/// How many checks passed, failed and were skipped.
#[derive(Debug, Default, Clone, Copy, PartialEq, Eq)]
struct Tally {
    passed: u64,
    failed: u64,
    skipped: u64,
}

impl Tally {
    const PASSED: Tally = Tally { passed: 1, failed: 0, skipped: 0 };
    const FAILED: Tally = Tally { passed: 0, failed: 1, skipped: 0 };

    fn add(&mut self, other: Tally) {
        self.passed += other.passed;
        self.failed += other.failed;
        self.skipped += other.skipped;
    }
}

/// A step's name and what runs it.
type Step = (&'static str, fn() -> anyhow::Result<Tally>);

const STEPS: &[Step] = &[
    ("format", format),
    ("architecture", architecture),
    ("lints, native", lint_native),
    ("lints, wasm32", lint_wasm),
    ("documentation", document),
    ("tests, native", test_native),
    ("tests, browser", test_browser),
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
        total.add(tally);
        rows.push((name, tally, start.elapsed().as_secs()));
    }
    println!();
    for (name, tally, seconds) in rows {
        println!(
            "{name:16} {:4} passed {:3} failed {:3} skipped {seconds:5} s",
            tally.passed, tally.failed, tally.skipped
        );
    }
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

fn test_native() -> anyhow::Result<Tally> {
    let tool = cargo().args(["test", "--workspace", "--no-fail-fast"]);
    // EGL complains on every start without it.
    let quiet = std::env::var_os("XDG_RUNTIME_DIR").unwrap_or_else(|| std::env::temp_dir().into());
    count(tool.env("XDG_RUNTIME_DIR", quiet))
}

fn test_browser() -> anyhow::Result<Tally> {
    let web_dir = std::path::absolute(web::build(web::Profile::Fast)?)?;
    cargo().args(["build", "--workspace", "--bin", "vantage-server"]).check()?;
    let tests = Path::new("tests/browser");
    Tool::new("npm").args(["ci", "--no-audit", "--no-fund", "--silent"]).dir(tests).check()?;
    let server = std::path::absolute(target_dir().join("debug/vantage-server"))?;
    let node = Tool::new("node").args(["run.mjs"]).dir(tests);
    count(node.env("VANTAGE_SERVER_BIN", server).env("VANTAGE_WEB_DIR", web_dir))
}

/// Runs a test program and adds up the results it prints; one that fails without a failed test (it did not build, or died)
/// counts as one failure, and so does one that ran nothing.
fn count(tool: Tool) -> anyhow::Result<Tally> {
    let mut tally = Tally::default();
    let succeeded = tool.watch(|line| {
        if let Some(found) = parse_result(line) {
            tally.add(found);
        }
    })?;
    let nothing_ran = tally.passed + tally.failed == 0;
    if (!succeeded && tally.failed == 0) || nothing_ran {
        tally.add(Tally::FAILED);
    }
    Ok(tally)
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
    use super::{Tally, parse_result};

    #[test]
    fn results_of_cargo_and_of_the_browser_tests_are_read() {
        let cargo = "test result: FAILED. 3 passed; 1 failed; 2 ignored; 0 measured; 0 filtered out; finished in 0.00s";
        assert_eq!(parse_result(cargo), Some(Tally { passed: 3, failed: 1, skipped: 2 }));
        assert_eq!(parse_result("2 passed, 0 failed, 1 skipped"), Some(Tally { passed: 2, failed: 0, skipped: 1 }));
        assert_eq!(parse_result("running 3 tests"), None);
        assert_eq!(parse_result("warning: 2 passed"), None);
    }
}
